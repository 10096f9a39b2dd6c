/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * pokeysctl(1): the command line. What may be written there is in the tables of
 * table.c; help, parser, complaints and completion all go by them.
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
#include "tools/table.h"
#include "usage/option.h"
#include "usage/written.h"

static void help_options(unsigned int takes)
{
	for (const struct option_row *row = table_options; row->name; row++) {
		char left[64];

		if (row->takes && !(row->takes & takes))
			continue;
		snprintf(left, sizeof(left), "%c%c%c --%s%s%s", table_short(row) ? '-' : ' ',
			 table_short(row) ? row->letter : ' ', table_short(row) ? ',' : ' ',
			 row->name, row->value ? " " : "", row->value ? row->value : "");
		printf("  %-28s  %s\n", left, row->help);
	}
}

/* Of one command, or NULL: of all. */
static void help(const struct command *only)
{
	if (only) {
		printf("usage: pokeysctl %s%s%s [OPTION ...]\n\n  %s: %s\n\n", only->name,
		       *only->arguments ? " " : "", only->arguments, only->name, only->help);
		help_options(only->takes);
		return;
	}
	puts("usage: pokeysctl COMMAND [OPTION ...]\n");
	for (const struct command *command = table_commands; command->name; command++)
		printf("  %s%s%s\n\t%s\n", command->name, *command->arguments ? " " : "",
		       command->arguments, command->help);
	puts("");
	help_options(0);
	puts("\npokeysctl COMMAND --help lists the options of a command.");
}

/* A line for each command: its name, arguments and options; read by pokeysctl.bash. */
static void print_completion(void)
{
	for (const struct command *command = table_commands; command->name; command++) {
		printf("%s:%s:", command->name, command->arguments);
		for (const struct option_row *row = table_options; row->name; row++)
			if (!row->takes || row->takes & command->takes)
				printf(" --%s%s%s", row->name, row->value ? "=" : "",
				       row->value ? row->value : "");
		puts("");
	}
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

static bool take_option(struct options *options, int option)
{
	double number = 0;
	bool good = true;

	switch (option) {
	case 'r':
		options->runtime_directory = optarg;
		options->runtime_named = true;
		break;
	case 't':
		good = argument_whole("timeout", optarg, 1, 60000, &number);
		options->timeout_ms = (uint32_t)number;
		break;
	case 'a':
		good = argument_addresses(options, optarg);
		break;
	case 'i':
		options->interface = optarg;
		break;
	case 'n':
		good = argument_whole("count", optarg, 1, 1e9, &number);
		options->count = (uint32_t)number;
		break;
	case 'd':
		good = argument_number("interval", optarg, 0.01, 3600, &options->interval_s);
		break;
	case 'c':
		good = argument_whole("cpu", optarg, 0, 1023, &number);
		options->cpu = (int)number;
		break;
	case 'o':
		options->config = optarg;
		break;
	case 'D':
		options->draft = true;
		break;
	case 'W':
		options->write = true;
		break;
	case 'X':
		options->fix = true;
		break;
	case 'U':
		options->undo = true;
		break;
	case 'y':
		options->yes = true;
		break;
	case 'R':
		options->root = optarg;
		break;
	case 's':
		good = argument_number("seconds", optarg, 0.1, 86400, &options->seconds);
		break;
	case 'F':
		good = argument_number("for", optarg, 0.1, 86400, &options->duration_s);
		break;
	case 'S':
		good = argument_number("speed", optarg, 0.001, 1e6, &options->speed);
		break;
	case 'l':
		good = argument_whole("slowest", optarg, 0, 100, &number);
		options->slowest = (uint32_t)number;
		break;
	case 'T':
		good = argument_number("threshold", optarg, 0, 1e9, &options->threshold_us);
		break;
	case 'p':
	case 'N':
	case 'v':
		good = take_measure(options, option);
		break;
	case 'x':
		options->csv = optarg;
		break;
	case 'f':
		options->follow = true;
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
	for (const struct command *command = table_commands; command->name; command++)
		if (!strcmp(command->name, name))
			return command;
	return NULL;
}

/* It is an option that has its value in the next word. */
static bool takes_next(const char *word)
{
	for (const struct option_row *row = table_options; row->name; row++)
		if (row->value && !strncmp(word, "--", 2) && !strcmp(word + 2, row->name))
			return true;
	return !strcmp(word, "-r");
}

/* Options of the first command on the command line; options may precede the command. */
static unsigned int named_takes(int argc, char **argv)
{
	const struct command *command = NULL;

	for (int i = 1; i < argc && !command; i++)
		if (i == 1 || !takes_next(argv[i - 1]))
			command = find_command(argv[i]);
	return command ? command->takes : 0;
}

/* "-1000" is a number and no option: with a space before it, getopt(3) takes it for none. */
static void keep_numbers(int argc, char **argv)
{
	for (int i = 1; i < argc; i++) {
		char *spaced;

		if (argv[i][0] == '-' && argv[i][1] >= '0' && argv[i][1] <= '9' &&
		    asprintf(&spaced, " %s", argv[i]) >= 0)
			argv[i] = spaced;
	}
}

/* Any order of command, options and names. 0 and *command, or how to exit. */
static bool take_line(struct options *options, int argc, char **argv,
		      const struct command **command, int *status)
{
	struct option long_options[TABLE_OPTIONS_MAX];
	unsigned int wanted = 0;
	bool helps = false;
	int option;

	table_long_options(named_takes(argc, argv), long_options);
	keep_numbers(argc, argv);
	*status = STATUS_USAGE;
	while ((option = usage_option("pokeysctl", argc, argv, TABLE_LETTERS, long_options)) >= 0) {
		if (option == 'V' || option == 'C') {
			if (option == 'C')
				print_completion();
			else
				puts("pokeysctl " POKEYSD_VERSION);
			*status = STATUS_OK;
			return false;
		}
		if (option == 'h')
			helps = true;
		else if (!take_option(options, option))
			return false;
		wanted |= table_takes(option);
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
	complain("%s takes no %s%s; see pokeysctl %s --help", (*command)->name,
		 wanted & TAKES_NAMES ? "argument: " : "such option",
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
