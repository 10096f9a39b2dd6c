// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeys-guard(8).
 *
 * What is guarded stands in pokeysd.conf, read by the daemon's own reader: two
 * files, or two readers, would one day disagree on where a device is. Its
 * password files are not opened: this program needs none of them, and runs
 * without the right to.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include "daemon/control/clock.h"
#include "daemon/control/log.h"
#include "daemon/device/event.h"
#include "guard/guard.h"
#include "usage/option.h"
#include "usage/written.h"

enum { VERSION = 256, PINS, TEXT_MAX = 4096 };

static struct config config;

static const struct option table[] = {
	{ "config", required_argument, NULL, 'c' },
	{ "help", no_argument, NULL, 'h' },
	{ "pins", required_argument, NULL, PINS },
	{ "version", no_argument, NULL, VERSION },
	{ NULL, 0, NULL, 0 },
};

static const char help[] =
	"usage: pokeys-guard [OPTION ...] run | status | remove\n"
	"\n"
	"  run                guard the interface of pokeysd.conf until SIGTERM\n"
	"  status             where the guard is, and its counters\n"
	"  remove             take off what a guard that was killed has left\n"
	"\n"
	"  -c, --config FILE  read FILE instead of " CONFIG_PATH "\n"
	"      --pins FOLDER  keep pins in FOLDER, which exists, instead of " GUARD_PINS "\n"
	"  -h, --help         this text\n"
	"  --version          the version\n";

static void complain(void *context, const char *line)
{
	(void)context;
	log_line(EVENT_ERROR, "%s", line);
}

static int run(const char *path)
{
	if (config_read_public(path, &config, complain, NULL))
		return GUARD_CONFIG;
	if (!*config.interface) {
		log_line(EVENT_ERROR, "%s: [daemon]: interface is not given; it says what to guard",
			 path);
		return GUARD_CONFIG;
	}
	return guard_run(&config);
}

/* For those whom the kernel does not let look: what the running guard has written. */
static int show_file(int error)
{
	char text[TEXT_MAX];
	FILE *from = fopen(GUARD_STATUS, "r");
	size_t length;

	if (!from) {
		fprintf(stderr,
			"pokeys-guard: no guard is at work, or none that this user may "
			"see: %s\n",
			strerror(error));
		return GUARD_FAILED;
	}
	length = fread(text, 1, sizeof(text), from);
	fclose(from);
	fwrite(text, 1, length, stdout);
	return GUARD_OK;
}

static int status(const char *path)
{
	uint64_t counters[GUARD_VERDICTS];
	struct guard_place place;
	int result = guard_find(&place);

	(void)path;
	result = result ? result : guard_counters(counters);
	if (result == -EACCES || result == -EPERM)
		return show_file(-result);
	if (result) {
		fprintf(stderr, "pokeys-guard: no guard is on any interface\n");
		return GUARD_FAILED;
	}
	guard_print(stdout, &place, counters, clock_now());
	return GUARD_OK;
}

static int take_off(const char *path)
{
	int locked = guard_lock(), result;

	(void)path;
	if (locked < 0)
		return -locked;
	result = guard_remove();
	close(locked);
	if (!result)
		return GUARD_OK;
	fprintf(stderr, "pokeys-guard: the pins cannot be removed: %s\n", strerror(-result));
	return result == -EACCES || result == -EPERM ? GUARD_NO_RIGHT : GUARD_FAILED;
}

static const struct {
	const char *name;
	int (*run)(const char *config_path);
} commands[] = {
	{ "run", run },
	{ "status", status },
	{ "remove", take_off },
};

/* *path and 0; or how to exit, below 0. */
static int take_options(int argc, char **argv, const char **path)
{
	int option;

	while ((option = usage_option("pokeys-guard", argc, argv, ":c:h", table)) != -1) {
		switch (option) {
		case 'c':
			*path = optarg;
			break;
		case PINS:
			if (guard_use_pins(optarg))
				break;
			fprintf(stderr, "pokeys-guard: --pins: the path is too long\n");
			return -1 - GUARD_USAGE;
		case 'h':
			fputs(help, stdout);
			return -1;
		case VERSION:
			puts("pokeys-guard " POKEYSD_VERSION);
			return -1;
		default:
			return -1 - GUARD_USAGE;
		}
	}
	return 0;
}

int main(int argc, char **argv)
{
	const char *path = CONFIG_PATH;
	int result = take_options(argc, argv, &path);

	if (result)
		return usage_written("pokeys-guard", -1 - result);
	log_program("pokeys-guard");
	log_open(STDERR_FILENO, EVENT_INFO);
	for (size_t i = 0; optind == argc - 1 && i < sizeof(commands) / sizeof(commands[0]); i++)
		if (!strcmp(argv[optind], commands[i].name))
			return usage_written("pokeys-guard", commands[i].run(path));
	fprintf(stderr, "pokeys-guard: %s%s%s; pokeys-guard --help lists the commands\n",
		optind < argc ? "there is no command \"" : "a command is missing",
		optind < argc ? argv[argc - 1] : "", optind < argc ? "\"" : "");
	return GUARD_USAGE;
}
