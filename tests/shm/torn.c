/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * No torn image: a writer that floods, readers that check every word of what
 * they get, in another process and in threads of this one.
 *
 * POKEYS_READS sets how many reads (default 10^7; the nightly 10^9). The last
 * test shows that the check can see: the same images, copied without the
 * protocol, are torn within seconds.
 */
#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include "tests/shm/folder.h"

enum { THREADS = 2, SEARCH_SECONDS = 60 };

static _Atomic bool stop;

static void *flood(void *argument)
{
	struct shm_device *mill = argument;
	struct pokeys_state image;

	for (uint64_t cycle = 1; !atomic_load(&stop); cycle++) {
		folder_pattern(&image, cycle);
		shm_device_write(mill, &image);
	}
	return NULL;
}

struct reading {
	pokeys_client *client;
	uint64_t reads, failed, torn, backwards;
};

/* The newest image, however often a writer that does nothing else is faster. */
static int read_image(pokeys_client *client, struct pokeys_state *image)
{
	int r;

	do
		r = pokeys_client_read(client, image);
	while (r == -EAGAIN);
	return r;
}

static void *read_many(void *argument)
{
	struct reading *reading = argument;
	struct pokeys_state image;
	uint64_t last = 0;

	for (uint64_t i = 0; i < reading->reads; i++) {
		if (read_image(reading->client, &image))
			reading->failed++;
		else if (image.cycle && !folder_pattern_whole(&image))
			reading->torn++;
		else if (image.cycle < last)
			reading->backwards++;
		last = image.cycle;
	}
	return NULL;
}

static void flooded_readers_see_whole_images_in_order(void **state)
{
	uint64_t reads = folder_count("POKEYS_READS", 10000000);
	struct folder *folder = *state;
	struct reading readings[THREADS];
	pthread_t writer, readers[THREADS];
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);

	atomic_store(&stop, false);
	assert_int_equal(pthread_create(&writer, NULL, flood, mill), 0);
	for (int i = 0; i < THREADS; i++) {
		readings[i] = (struct reading){
			.client = folder_client(folder, 0),
			.reads = reads / THREADS,
		};
		assert_int_equal(pokeys_client_poll(readings[i].client), POKEYS_CLIENT_ATTACHED);
		assert_int_equal(pthread_create(&readers[i], NULL, read_many, &readings[i]), 0);
	}
	for (int i = 0; i < THREADS; i++) {
		pthread_join(readers[i], NULL);
		assert_int_equal(readings[i].failed, 0);
		assert_int_equal(readings[i].torn, 0);
		assert_int_equal(readings[i].backwards, 0);
		pokeys_client_close(readings[i].client);
	}
	atomic_store(&stop, true);
	pthread_join(writer, NULL);
	shm_host_close(host);
}

static void writer_stopped_in_its_write_harms_no_reader(void **state)
{
	struct folder *folder = *state;
	pokeys_client *client = folder_client(folder, 0);
	struct pokeys_state image;
	char said[256];
	pid_t daemon = folder_peer(folder, "flood", said);

	assert_string_equal(said, "ready");
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	srand(folder_seed());
	for (int i = 0; i < 300; i++) {
		kill(daemon, SIGSTOP); /* nearly always inside a write */
		waitpid(daemon, NULL, WUNTRACED);
		for (int j = 0; j < 20; j++) {
			assert_int_equal(pokeys_client_read(client, &image), 0);
			assert_true(folder_pattern_whole(&image));
		}
		kill(daemon, SIGCONT);
		usleep((useconds_t)rand() % 300);
	}
	kill(daemon, SIGSTOP);
	folder_end_peer(daemon, SIGKILL);
	assert_int_equal(pokeys_client_read(client, &image), 0);
	assert_true(folder_pattern_whole(&image));
	pokeys_client_close(client);
	shm_host_close(folder_host_mill(folder, (struct shm_device *[1]){ NULL }));
}

#ifndef __SANITIZE_THREAD__ /* a data race on purpose */
static void *flood_bare(void *argument)
{
	struct pokeys_state *bare = argument;
	struct pokeys_state image;

	for (uint64_t cycle = 1; !atomic_load(&stop); cycle++) {
		folder_pattern(&image, cycle);
		memcpy(bare, &image, sizeof(image));
		atomic_signal_fence(memory_order_seq_cst);
	}
	return NULL;
}

static void without_the_protocol_torn_images_are_seen(void **state)
{
	static struct pokeys_state bare;
	uint64_t began = folder_now_ns();
	struct pokeys_state image;
	pthread_t writer;
	bool torn = false;

	(void)state;
	atomic_store(&stop, false);
	folder_pattern(&bare, 0);
	assert_int_equal(pthread_create(&writer, NULL, flood_bare, &bare), 0);
	while (!torn && folder_now_ns() - began < SEARCH_SECONDS * UINT64_C(1000000000)) {
		memcpy(&image, &bare, sizeof(image));
		atomic_signal_fence(memory_order_seq_cst);
		torn = !folder_pattern_whole(&image);
	}
	atomic_store(&stop, true);
	pthread_join(writer, NULL);
	assert_true(torn);
}
#endif

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(flooded_readers_see_whole_images_in_order),
		BOTH(writer_stopped_in_its_write_harms_no_reader),
#ifndef __SANITIZE_THREAD__
		cmocka_unit_test(without_the_protocol_torn_images_are_seen),
#endif
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
