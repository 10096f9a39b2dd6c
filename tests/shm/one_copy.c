/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Rule 3, one copy of iceoryx2 in a process.
 *
 * Who lives is told by record locks, and those belong to the process: a copy
 * asks the kernel about a lock that another copy of the same process holds,
 * and hears that nobody does. So a program either links shm_dep or loads
 * libpokeys_shm.so, never both; two devices in one process are two clients of
 * one copy. The first test does it wrong and shows what happens.
 */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "tests/shm/folder.h"

#ifdef __SANITIZE_ADDRESS__
/* What a library that has been unloaded still held (3 kB each time) counts as leaked. */
const char *__asan_default_options(void);
const char *__asan_default_options(void)
{
	return "detect_leaks=0";
}
#endif

struct library {
	void *handle;
	int (*open)(pokeys_client **, const char *, const char *, const char *, unsigned int);
	enum pokeys_client_state (*poll)(pokeys_client *);
	int (*follow)(pokeys_client *, unsigned int);
	int (*read)(pokeys_client *, struct pokeys_state *);
	void (*close)(pokeys_client *);
};

static void load(struct library *library)
{
	const char *path = getenv("SHM_LIBRARY");

	assert_non_null(path);
	library->handle = dlopen(path, RTLD_NOW | RTLD_GLOBAL);
	if (!library->handle)
		fail_msg("%s", dlerror());
	*(void **)&library->open = dlsym(library->handle, "pokeys_client_open");
	*(void **)&library->poll = dlsym(library->handle, "pokeys_client_poll");
	*(void **)&library->follow = dlsym(library->handle, "pokeys_client_follow");
	*(void **)&library->read = dlsym(library->handle, "pokeys_client_read");
	*(void **)&library->close = dlsym(library->handle, "pokeys_client_close");
}

static bool is_mapped(const char *name)
{
	FILE *maps = fopen("/proc/self/maps", "r");
	char line[512];
	bool found = false;

	while (fgets(line, sizeof(line), maps))
		found |= strstr(line, name) != NULL;
	fclose(maps);
	return found;
}

static void two_copies_declare_each_other_dead(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	struct library library;
	pokeys_client *client;

	load(&library);
	assert_int_equal(library.open(&client, folder->path, "mill", "test",
				      POKEYS_CLIENT_COMMANDER),
			 0);
	assert_int_equal(library.poll(client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(shm_host_maintain(host), 1); /* it lives, and was buried */
	library.close(client);
	dlclose(library.handle);
	shm_host_close(host);
}

static void clients_of_one_copy_live(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *first = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	pokeys_client *second = folder_client(folder, 0);
	struct pokeys_state image;

	for (int i = 0; i < 10; i++) {
		assert_int_equal(pokeys_client_poll(first), POKEYS_CLIENT_ATTACHED);
		assert_int_equal(pokeys_client_poll(second), POKEYS_CLIENT_ATTACHED);
		assert_int_equal(shm_host_maintain(host), 0);
	}
	assert_int_equal(shm_device_commanders(mill), 1);
	assert_int_equal(pokeys_client_read(second, &image), 0);
	pokeys_client_close(first);
	pokeys_client_close(second);
	assert_int_equal(shm_host_maintain(host), 0);
	shm_host_close(host);
}

/* LinuxCNC unloads its modules: nothing of ours may stay behind. */
static void library_goes_when_it_is_closed(void **state)
{
	struct folder *folder = *state;
	char said[256];
	pid_t daemon = folder_peer(folder, "host", said);
	struct pokeys_state image;
	struct library library;
	pokeys_client *client;

	for (int i = 0; i < 3; i++) {
		load(&library);
		assert_true(is_mapped("libpokeys_shm.so"));
		assert_int_equal(library.open(&client, folder->path, "mill", "test",
					      POKEYS_CLIENT_COMMANDER),
				 0);
		assert_int_equal(library.follow(client, 1), 0);
		for (int j = 0; j < 60000 && library.read(client, &image); j++)
			folder_sleep_ms(1);
		assert_int_equal(library.read(client, &image), 0);
		library.close(client);
		assert_int_equal(dlclose(library.handle), 0);
		assert_false(is_mapped("libpokeys_shm.so"));
	}
	assert_int_equal(folder_end_peer(daemon, 15), 0);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(library_goes_when_it_is_closed),
		BOTH(clients_of_one_copy_live),
		BOTH(two_copies_declare_each_other_dead),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
