/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The module as LinuxCNC loads it, read in one thread and write in another: an error
 * line names both, once. (That one thread is nothing to complain of: quiet.c.)
 *
 *	two_threads MODULE.so
 */
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>
#include "tests/halbridge/fake_hal.h"

static _Atomic bool stop;

static void nap(void)
{
	const struct timespec time = { .tv_nsec = 1000000 };

	nanosleep(&time, NULL);
}

/* Not at the same time: this is about who calls, and not a race. */
static pthread_mutex_t turn = PTHREAD_MUTEX_INITIALIZER;

static void *hal_thread(void *argument)
{
	const struct fake_funct *funct = argument;

	while (!stop) {
		pthread_mutex_lock(&turn);
		funct->run(funct->argument, 1000000);
		pthread_mutex_unlock(&turn);
		nap();
	}
	return NULL;
}

int main(int argc, char **argv)
{
	char runtime[] = "/tmp/pokeys-threads-XXXXXX";
	struct fake_funct functs[2];
	struct fake_module module;
	pthread_t threads[2];
	bool good;

	if (argc != 2 || !mkdtemp(runtime))
		return 2;
	if (fake_hal_load(&module, argv[1], NULL, NULL, runtime)) {
		fprintf(stderr, "the module does not load: %s\n", fake_hal_said());
		return 1;
	}
	functs[0] = fake_hal_funct("pokeys.0.read");
	functs[1] = fake_hal_funct("pokeys.0.write");
	for (int i = 0; i < 2; i++)
		pthread_create(&threads[i], NULL, hal_thread, &functs[i]);
	for (int i = 0; i < 30000 && !fake_hal_complaints("different threads"); i++)
		nap();
	good = fake_hal_complaints("pokeys.0.read and pokeys.0.write are in different "
				   "threads") == 1;
	printf("%s: two threads are told\n", good ? "ok" : "FAILED");
	stop = true;
	for (int i = 0; i < 2; i++)
		pthread_join(threads[i], NULL);
	fake_hal_unload(&module);
	rmdir(runtime);
	return !good;
}
