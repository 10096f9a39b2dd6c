// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Few options on purpose: what a device is and does stands in the
 * configuration file only, so that there is one place to look at. Here is
 * what differs between two runs of one configuration.
 */
#include <stdio.h>
#include "daemon/control/config.h"
#include "daemon/control/options.h"
#include "usage/option.h"

enum { CHECK_CONFIG = 256, CLEAR, NO_REALTIME, RUNTIME_DIRECTORY, HELP_CONFIG, VERSION };

static const struct option table[] = {
	{ "config", required_argument, NULL, 'c' },
	{ "check-config", no_argument, NULL, CHECK_CONFIG },
	{ "clear", no_argument, NULL, CLEAR },
	{ "no-realtime", no_argument, NULL, NO_REALTIME },
	{ "runtime-directory", required_argument, NULL, RUNTIME_DIRECTORY },
	{ "help", no_argument, NULL, 'h' },
	{ "help-config", no_argument, NULL, HELP_CONFIG },
	{ "version", no_argument, NULL, VERSION },
	{ NULL, 0, NULL, 0 },
};

static const char help[] =
	"usage: pokeysd [OPTION ...]\n"
	"\n"
	"  -c, --config FILE        read FILE instead of " CONFIG_PATH "\n"
	"  --check-config           say whether the configuration is in order, and end\n"
	"  --clear                  remove what a killed daemon left in its folder, and end\n"
	"  --no-realtime            go on where realtime priority or locked memory is refused\n"
	"  --runtime-directory DIR  folder of the shared memory, instead of the configured one\n"
	"  -h, --help               this text\n"
	"  --help-config            all keys of the configuration file\n"
	"  --version                the version\n";

bool options_parse(struct options *options, int argc, char **argv, int *status)
{
	int option;

	*options = (struct options){ .config = CONFIG_PATH };
	*status = STATUS_OK;
	while ((option = usage_option("pokeysd", argc, argv, ":c:h", table)) != -1) {
		switch (option) {
		case 'c':
			options->config = optarg;
			break;
		case CHECK_CONFIG:
			options->check_config = true;
			break;
		case CLEAR:
			options->clear = true;
			break;
		case NO_REALTIME:
			options->no_realtime = true;
			break;
		case RUNTIME_DIRECTORY:
			options->runtime_directory = optarg;
			break;
		case 'h':
			fputs(help, stdout);
			return false;
		case HELP_CONFIG:
			config_help(stdout);
			return false;
		case VERSION:
			puts("pokeysd " POKEYSD_VERSION);
			return false;
		default:
			*status = STATUS_USAGE;
			return false;
		}
	}
	if (optind < argc) {
		fprintf(stderr, "pokeysd: \"%s\" is not an option; pokeysd --help lists them\n",
			argv[optind]);
		*status = STATUS_USAGE;
		return false;
	}
	return true;
}
