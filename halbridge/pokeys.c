/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * pokeys: the userspace component, for HAL files that say "loadusr -W pokeys".
 *
 * A shell as pokeys_shm is one, around the same tables and the same exchange,
 * with a loop of its own instead of two functs, and with the machine's INI file
 * as the older component read it. It needs pokeysd: without one it loads as
 * well, says so in one line and waits, its pins alive and `connected` false.
 *
 * The loop is not realtime. A period that comes late is not caught up with; the
 * daemon brings everything into the safe state if the loop stays away longer
 * than its heartbeat timeout, whoever kept it.
 */
#include <errno.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sysexits.h>
#include <time.h>
#include <rtapi.h>
#include <hal.h>
#include "halbridge/ini_adopt.h"
#include "halbridge/instance.h"
#include "halbridge/monitor.h"
#include "halbridge/pokeys_options.h"
#include "usage/written.h"

#define SECOND_NS	UINT64_C(1000000000)

enum { RATE_DEFAULT = 1000, RATE_LEAST = 100, RATE_MOST = 2000 };

static volatile sig_atomic_t ended;
static int component;
static struct instance *instances[TABLE_DEVICES];
static struct monitor monitor;

static void on_signal(int number)
{
	(void)number;
	ended = 1;
}

/* SIGTERM is how LinuxCNC ends a userspace component. */
static void catch_signals(void)
{
	struct sigaction action = { .sa_handler = on_signal };

	sigaction(SIGTERM, &action, NULL);
	sigaction(SIGINT, &action, NULL);
}

/* The file LinuxCNC runs with; an empty one if there is none, after a line. */
static struct ini_file read_ini(void)
{
	const char *path = getenv("INI_FILE_NAME");
	struct ini_file file = { .path = path };
	int r;

	if (!path || !*path) {
		rtapi_print_msg(RTAPI_MSG_INFO, "pokeys: INI_FILE_NAME is not set: no [POKEYS] "
						"settings\n");
		return file;
	}
	r = ini_file_read(&file, path);
	if (r)
		rtapi_print_msg(RTAPI_MSG_ERR, "pokeys: %s: %s: no [POKEYS] settings\n", path,
				strerror(-r));
	return file;
}

static int make_instance(const struct pokeys_options *options, const struct ini_file *file,
			 unsigned int number)
{
	const unsigned int schemes = number ? TABLE_LEGACY : TABLE_BOTH | options->schemes;
	int r = instance_make(&instances[number], component, number, options->prefix[number],
			      schemes | TABLE_FORMER);

	if (r)
		return r;
	instances[number]->binding.in_turns = 1; /* a slow loop misses no short pulse */
	ini_adopt(file, instances[number]);
	return 0;
}

static int start(const struct pokeys_options *options, const struct ini_file *file)
{
	int r = 0;

	for (unsigned int i = 0; i < options->count && !r; i++)
		r = make_instance(options, file, i);
	if (r)
		return r;
	monitor = (struct monitor){
		.runtime = options->runtime,
		.instances = instances,
		.count = options->count,
	};
	r = monitor_start(&monitor);
	return r ? r : hal_ready(component);
}

/* rtc.loop-frequ-demand of the first instance, Hz; a bad one changes nothing. */
static uint32_t rate(void)
{
	static uint32_t seen, used = RATE_DEFAULT;
	uint32_t wanted = instances[0]->values->legacy.clock.rate_demand;

	if (wanted == seen)
		return used;
	seen = wanted;
	if (!wanted)
		used = RATE_DEFAULT;
	else if (wanted >= RATE_LEAST && wanted <= RATE_MOST)
		used = wanted;
	else
		rtapi_print_msg(RTAPI_MSG_ERR,
				"%s.rtc.loop-frequ-demand = %u: must be %d to %d, "
				"or 0 for %d; the loop keeps %u Hz\n",
				instances[0]->prefix, wanted, RATE_LEAST, RATE_MOST, RATE_DEFAULT,
				used);
	return used;
}

static struct timespec time_of(uint64_t ns)
{
	return (struct timespec){ .tv_sec = (time_t)(ns / SECOND_NS),
				  .tv_nsec = (long)(ns % SECOND_NS) };
}

static void loop(size_t count)
{
	uint64_t next = instance_now();

	while (!ended) {
		uint64_t period = SECOND_NS / rate(), now = instance_now();
		struct timespec when;

		for (size_t i = 0; i < count; i++) {
			instance_read(instances[i]);
			instance_write(instances[i], period);
		}
		next = next + period > now ? next + period : now + period;
		when = time_of(next);
		clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, NULL);
	}
	monitor_stop(&monitor); /* it would say that the connection is lost */
	for (size_t i = 0; i < count; i++)
		instance_leave(instances[i]);
}

/* The instances first: they hold HAL's memory, and the last hal_exit() unmaps that. */
static void end(void)
{
	monitor_stop(&monitor);
	for (size_t i = 0; i < TABLE_DEVICES; i++)
		instance_end(instances[i]);
	if (component > 0)
		hal_exit(component);
}

/* Asked by a person, not by loadusr: no HAL is needed to answer. */
static bool answer(const char *word)
{
	if (!strcmp(word, "--version")) {
		puts("pokeys " POKEYS_VERSION);
		return true;
	}
	if (strcmp(word, "--help") && strcmp(word, "-h"))
		return false;
	puts("usage: loadusr -W pokeys [count=N | names=NAME[,NAME]...] [runtime=FOLDER]\n"
	     "                          [loops=heaters|servos|all]\n"
	     "\n"
	     "LinuxCNC userspace component for the devices of pokeysd, under the older names.\n"
	     "\n"
	     "  count=N          instances pokeys.0 to pokeys.N-1 (1)\n"
	     "  names=NAME,...   instances with names of their own\n"
	     "  runtime=FOLDER   the daemon's runtime-directory\n"
	     "  loops=WORD       names of heaters, servos or all, for the first instance\n"
	     "  --help           this text\n"
	     "  --version        the version\n"
	     "\n"
	     "More in pokeys(1).");
	return true;
}

int main(int argc, char **argv)
{
	struct pokeys_options options;
	struct ini_file file;
	char why[256];
	int r;

	if (argc == 2 && answer(argv[1]))
		return usage_written("pokeys", EXIT_SUCCESS);
	if (pokeys_options_read(&options, argc, argv, why, sizeof(why))) {
		fprintf(stderr, "pokeys: %s\n", why);
		return EX_USAGE;
	}
	catch_signals();
	rtapi_set_msg_level(RTAPI_MSG_INFO);
	component = hal_init("pokeys");
	if (component <= 0)
		return 1;
	file = read_ini();
	r = options.runtime ? 0 : ini_runtime(&file, &options.runtime, why, sizeof(why));
	if (!r) {
		r = start(&options, &file);
		snprintf(why, sizeof(why), "not loaded: %s", strerror(-r));
	}
	if (r)
		rtapi_print_msg(RTAPI_MSG_ERR, "pokeys: %s\n", why);
	else
		loop(options.count);
	end();
	ini_file_free(&file);
	return r ? 1 : 0;
}
