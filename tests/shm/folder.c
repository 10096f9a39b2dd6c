/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * See folder.h. The pattern fills all that follows the header with words made
 * from the cycle number and their place, so that a copy of two halves from
 * two cycles cannot be mistaken for a whole one.
 */
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include "tests/shm/folder.h"

enum { HEADER_WORDS = offsetof(struct pokeys_state, period_ns) / 8 };

int folder_begin(void **state)
{
	struct folder *folder = calloc(1, sizeof(*folder));

	strcpy(folder->base, "/dev/shm/pk.XXXXXX");
	if (!mkdtemp(folder->base)) {
		strcpy(folder->base, "/tmp/pk.XXXXXX");
		if (!mkdtemp(folder->base))
			return -1;
	}
	chmod(folder->base, 0755);
	snprintf(folder->path, sizeof(folder->path), "%s/run", folder->base);
	*state = folder;
	return 0;
}

static int remove_one(const char *path, const struct stat *status, int type, struct FTW *at)
{
	(void)status;
	(void)at;
	return type == FTW_DP ? rmdir(path) : unlink(path);
}

int folder_end(void **state)
{
	struct folder *folder = *state;
	bool clean = !rmdir(folder->path) || errno == ENOENT;

	if (!clean)
		fprintf(stderr, "something is left in %s\n", folder->path);
	nftw(folder->base, remove_one, 16, FTW_DEPTH | FTW_PHYS);
	free(folder);
	return clean ? 0 : -1;
}

struct shm_host *folder_host(struct folder *folder, struct shm_device **devices,
			     const char *const *names)
{
	struct shm_host *host;

	if (shm_host_open(&host, folder->path, NULL, NULL, folder->why, sizeof(folder->why)))
		fail_msg("open: %s", folder->why);
	for (size_t i = 0; names[i]; i++) {
		if (shm_host_add(host, names[i], &devices[i], folder->why, sizeof(folder->why)))
			fail_msg("add: %s", folder->why);
	}
	if (shm_host_publish(host, folder->why, sizeof(folder->why)))
		fail_msg("publish: %s", folder->why);
	return host;
}

struct shm_host *folder_host_mill(struct folder *folder, struct shm_device **mill)
{
	static const char *const names[] = { "mill", NULL };

	return folder_host(folder, mill, names);
}

pokeys_client *folder_client(struct folder *folder, unsigned int flags)
{
	pokeys_client *client;

	assert_int_equal(pokeys_client_open(&client, folder->path, "mill", "test", flags), 0);
	return client;
}

const char *folder_status(struct folder *folder, const pokeys_client *client)
{
	pokeys_client_status(client, folder->why, sizeof(folder->why));
	return folder->why;
}

pid_t folder_peer_at(const char *directory, const char *role, char *said)
{
	const char *program = getenv("SHM_PEER");
	char line[256] = "";
	int pipe_fds[2];
	FILE *from;
	pid_t pid;

	assert_non_null(program);
	assert_int_equal(pipe2(pipe_fds, O_CLOEXEC), 0);
	pid = fork();
	assert_true(pid >= 0);
	if (!pid) {
		dup2(pipe_fds[1], STDOUT_FILENO);
		execl(program, program, role, directory, NULL);
		_exit(127);
	}
	close(pipe_fds[1]);
	if (said) {
		from = fdopen(pipe_fds[0], "r");
		if (fgets(line, sizeof(line), from))
			line[strcspn(line, "\n")] = '\0';
		memcpy(said, line, sizeof(line));
		fclose(from);
	} else {
		close(pipe_fds[0]);
	}
	return pid;
}

pid_t folder_peer(const struct folder *folder, const char *role, char *said)
{
	return folder_peer_at(folder->path, role, said);
}

int folder_end_peer(pid_t pid, int signal_number)
{
	int status = 0;

	kill(pid, signal_number);
	assert_int_equal(waitpid(pid, &status, 0), pid);
	return status;
}

unsigned int folder_count(const char *variable, unsigned int usual)
{
	const char *text = getenv(variable);

	return text && *text ? (unsigned int)strtoul(text, NULL, 10) : usual;
}

unsigned int folder_seed(void)
{
	unsigned int seed = folder_count("POKEYS_SEED", (unsigned int)folder_now_ns());

	printf("POKEYS_SEED=%u\n", seed);
	return seed;
}

static uint64_t word(uint64_t cycle, size_t place)
{
	return cycle * UINT64_C(0x9e3779b97f4a7c15) + place;
}

void folder_pattern(struct pokeys_state *state, uint64_t cycle)
{
	uint64_t words[sizeof(*state) / 8] = { 0 };

	for (size_t i = HEADER_WORDS; i < sizeof(*state) / 8; i++)
		words[i] = word(cycle, i);
	memcpy(state, words, sizeof(*state));
	state->cycle = cycle;
}

int folder_pattern_whole(const struct pokeys_state *state)
{
	uint64_t words[sizeof(*state) / 8];

	memcpy(words, state, sizeof(words));
	for (size_t i = HEADER_WORDS; i < sizeof(*state) / 8; i++) {
		if (words[i] != word(state->cycle, i))
			return 0;
	}
	return 1;
}

uint64_t folder_now_ns(void)
{
	struct timespec now;

	clock_gettime(CLOCK_MONOTONIC, &now);
	return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

void folder_sleep_ms(unsigned int ms)
{
	const struct timespec time = { ms / 1000, (long)(ms % 1000) * 1000000 };

	nanosleep(&time, NULL);
}
