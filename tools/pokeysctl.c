// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl(1): one table of subcommands, one of options. Which option goes
 * with which subcommand stands in the table, so that help, parser and
 * complaints agree.
 */
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <pokeys/shm.h>
#include "tools/argument.h"
#include "tools/pokeysctl.h"
#include "usage/option.h"
#include "usage/written.h"

/* Which options a subcommand takes besides --json. */
enum {
	TAKES_RUNTIME = 1, TAKES_TIMEOUT = 2, TAKES_ADDRESS = 4, TAKES_INTERFACE = 8,
	TAKES_COUNT = 16, TAKES_INTERVAL = 32, TAKES_NAMES = 64, TAKES_CPU = 128,
	TAKES_CONFIG = 256, TAKES_ROOT = 512, TAKES_MEASURE = 1024, TAKES_SECONDS = 2048,
	TAKES_TRACE = 4096,
};

static const struct command {
	const char *name, *arguments, *help;
	unsigned int takes;
	int (*run)(const struct options *options);
} commands[] = {
	{ "discover", "[--timeout MS] [--address A,B] [--interface NIC]",
	  "search the network for devices", TAKES_TIMEOUT | TAKES_ADDRESS | TAKES_INTERFACE,
	  command_discover },
	{ "devices", "", "devices of the running daemon", TAKES_RUNTIME, command_devices },
	{ "status", "[DEVICE ...]", "how they are, once", TAKES_RUNTIME | TAKES_NAMES,
	  command_status },
	{ "config", "show | diff | apply | save DEVICE",
	  "what the device is set up for; what is wanted otherwise; write that; keep it",
	  TAKES_RUNTIME | TAKES_NAMES, command_config },
	{ "doctor", "[--cpu N] [--config FILE] [--root DIR]",
	  "what makes this machine late, and how to mend it",
	  TAKES_RUNTIME | TAKES_CPU | TAKES_CONFIG | TAKES_ROOT, command_doctor },
	{ "latency", "[--cpu N] [--seconds S] [--priority P | --no-realtime] [--svg FILE] "
	  "[--config FILE]", "how late threads wake up, and the daemon's",
	  TAKES_RUNTIME | TAKES_CPU | TAKES_CONFIG | TAKES_MEASURE | TAKES_SECONDS,
	  command_latency },
	{ "trace", "[--seconds S] [--slowest N] [--threshold US]",
	  "where the time of the slowest cycles went (root)",
	  TAKES_RUNTIME | TAKES_SECONDS | TAKES_TRACE, command_trace },
	{ "record", "[DEVICE] FILE", "the last seconds' packets and events into a file for "
	  "Wireshark", TAKES_RUNTIME | TAKES_NAMES, command_record },
	{ "replay", "FILE", "what such a file holds, a line for each packet and event",
	  TAKES_NAMES, command_replay },
	{ "top", "[DEVICE ...] [--count N] [--interval S]", "how they are, again and again",
	  TAKES_RUNTIME | TAKES_NAMES | TAKES_COUNT | TAKES_INTERVAL, command_top },
};

enum { COMMANDS = sizeof(commands) / sizeof(commands[0]) };

static const struct option long_options[] = {
	{ "runtime-directory", required_argument, NULL, 'r' },
	{ "json", no_argument, NULL, 'j' },
	{ "timeout", required_argument, NULL, 't' },
	{ "address", required_argument, NULL, 'a' },
	{ "interface", required_argument, NULL, 'i' },
	{ "count", required_argument, NULL, 'n' },
	{ "interval", required_argument, NULL, 'd' },
	{ "cpu", required_argument, NULL, 'c' },
	{ "config", required_argument, NULL, 'f' },
	{ "root", required_argument, NULL, 'R' },
	{ "seconds", required_argument, NULL, 's' },
	{ "priority", required_argument, NULL, 'p' },
	{ "no-realtime", no_argument, NULL, 'N' },
	{ "slowest", required_argument, NULL, 'l' },
	{ "threshold", required_argument, NULL, 'T' },
	{ "svg", required_argument, NULL, 'v' },
	{ "help", no_argument, NULL, 'h' },
	{ "version", no_argument, NULL, 'V' },
	{ NULL, 0, NULL, 0 },
};

/* Of one command, or NULL: of all. */
static void help(const struct command *only)
{
	puts("usage: pokeysctl COMMAND [OPTION ...]\n");
	for (size_t i = 0; i < COMMANDS; i++)
		if (!only || only == &commands[i])
			printf("  %s%s%s\n\t%s\n", commands[i].name,
			       *commands[i].arguments ? " " : "", commands[i].arguments,
			       commands[i].help);
	puts("\n  -j, --json                   for scripts; pokeysctl(1) lists the keys");
	if (!only || only->takes & TAKES_RUNTIME)
		puts("  -r, --runtime-directory DIR  of the daemon (default "
		     POKEYS_RUNTIME_DIRECTORY ")");
	puts("  -h, --help                   of all commands, or of the one named\n"
	     "      --version");
}

/* What latency alone takes. */
static bool take_measure(struct options *options, int option)
{
	double number = options->priority;
	bool good = true;

	if (option == 'p')
		good = argument_whole("priority", optarg, 1, 98, &number);
	else if (option == 'N')
		options->no_realtime = true;
	else
		options->svg = optarg;
	options->priority = (int)number;
	return good;
}

/* One option; the bit that a command needs to take it goes into *needs. */
static bool take_option(struct options *options, int option, unsigned int *needs)
{
	double number = 0;
	bool good = true;

	switch (option) {
	case 'r':
		*needs = TAKES_RUNTIME;
		options->runtime_directory = optarg;
		break;
	case 't':
		*needs = TAKES_TIMEOUT;
		good = argument_whole("timeout", optarg, 1, 60000, &number);
		options->timeout_ms = (uint32_t)number;
		break;
	case 'a':
		*needs = TAKES_ADDRESS;
		good = argument_addresses(options, optarg);
		break;
	case 'i':
		*needs = TAKES_INTERFACE;
		options->interface = optarg;
		break;
	case 'n':
		*needs = TAKES_COUNT;
		good = argument_whole("count", optarg, 1, 1e9, &number);
		options->count = (uint32_t)number;
		break;
	case 'd':
		*needs = TAKES_INTERVAL;
		good = argument_number("interval", optarg, 0.01, 3600, &options->interval_s);
		break;
	case 'c':
		*needs = TAKES_CPU;
		good = argument_whole("cpu", optarg, 0, 1023, &number);
		options->cpu = (int)number;
		break;
	case 'f':
		*needs = TAKES_CONFIG;
		options->config = optarg;
		break;
	case 'R':
		*needs = TAKES_ROOT;
		options->root = optarg;
		break;
	case 's':
		*needs = TAKES_SECONDS;
		good = argument_number("seconds", optarg, 0.1, 86400, &options->seconds);
		break;
	case 'l':
		*needs = TAKES_TRACE;
		good = argument_whole("slowest", optarg, 0, 100, &number);
		options->slowest = (uint32_t)number;
		break;
	case 'T':
		*needs = TAKES_TRACE;
		good = argument_number("threshold", optarg, 0, 1e9, &options->threshold_us);
		break;
	case 'p':
	case 'N':
	case 'v':
		*needs = TAKES_MEASURE;
		good = take_measure(options, option);
		break;
	case 'j':
		options->json = true;
		break;
	default:
		good = false;
	}
	return good;
}

static const struct command *find_command(const char *name)
{
	for (size_t i = 0; i < COMMANDS; i++)
		if (!strcmp(commands[i].name, name))
			return &commands[i];
	return NULL;
}

/* Any order of command, options and names. 0 and *command, or how to exit. */
static bool take_line(struct options *options, int argc, char **argv,
		      const struct command **command, int *status)
{
	unsigned int wanted = 0;
	bool helps = false;
	int option;

	*status = STATUS_USAGE;
	while ((option = usage_option("pokeysctl", argc, argv, ":r:jh", long_options)) != -1) {
		unsigned int needs = 0;

		if (option == 'V') {
			puts("pokeysctl " POKEYSD_VERSION);
			*status = STATUS_OK;
			return false;
		}
		if (option == 'h')
			helps = true;
		else if (!take_option(options, option, &needs))
			return false;
		wanted |= needs;
	}
	*command = optind < argc ? find_command(argv[optind]) : NULL;
	if (helps && (*command || optind == argc)) {
		help(*command);
		*status = STATUS_OK;
		return false;
	}
	if (!*command) {
		complain("%s%s%s; pokeysctl --help lists the commands",
			 optind < argc ? "there is no command \"" : "a command is missing",
			 optind < argc ? argv[optind] : "", optind < argc ? "\"" : "");
		return false;
	}
	options->names = argv + optind + 1;
	options->name_count = (size_t)(argc - optind - 1);
	if (options->name_count)
		wanted |= TAKES_NAMES;
	if (!(wanted & ~(*command)->takes))
		return true;
	wanted &= ~(*command)->takes;
	complain("%s takes no %s%s; pokeysctl %s --help tells what it takes", (*command)->name,
		 wanted & TAKES_NAMES ? "word behind it: " : "such option",
		 wanted & TAKES_NAMES ? options->names[0] : "", (*command)->name);
	return false;
}

/* Why a file cannot be read, 0 if it can. */
static int unreadable(const char *path)
{
	struct stat st;

	if (access(path, R_OK) || stat(path, &st))
		return errno;
	return S_ISDIR(st.st_mode) ? EISDIR : 0;
}

/*
 * What somebody names is there, or he would be told of another machine than his.
 * STATUS_OK, or what to end with.
 */
static int named_are_there(const struct options *options)
{
	const char *root = options->root ? options->root : "";
	char path[PATH_MAX];

	if (*options->runtime_directory != '/') {
		complain("--runtime-directory: \"%s\" is not allowed; a path from / is",
			 options->runtime_directory);
		return STATUS_USAGE;
	}
	if (options->config) {
		snprintf(path, sizeof(path), "%s%s", root, options->config);
		if (unreadable(path)) {
			complain("--config: %s: %s", path, strerror(unreadable(path)));
			return STATUS_FAILED;
		}
	}
	/* with a slash behind it, so that it is a folder */
	snprintf(path, sizeof(path), "%s/", root);
	if (options->root && access(path, R_OK | X_OK)) {
		complain("--root: %s: %s", root, strerror(errno));
		return STATUS_FAILED;
	}
	return STATUS_OK;
}

int main(int argc, char **argv)
{
	struct options options = {
		.runtime_directory = POKEYS_RUNTIME_DIRECTORY,
		.timeout_ms = 500,
		.interval_s = 0.5,
		.cpu = -1,
		.seconds = 10,
		.priority = 80,
		.slowest = 5,
	};
	const struct command *command;
	int status;

	if (!take_line(&options, argc, argv, &command, &status))
		return usage_written("pokeysctl", status);
	status = named_are_there(&options);
	if (status)
		return status;
	return usage_written("pokeysctl", command->run(&options));
}
