// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysd(8).
 *
 * Standard descriptors are there before any other: started with stderr closed, the next file
 * opened would become descriptor 2, and messages would be written into it,
 * be it a lock file or a device's socket. Only signals are held before that: one that
 * comes while we start must end the daemon in order, not just the process.
 */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include "daemon/control/config.h"
#include "daemon/control/config_key.h"
#include "daemon/control/daemon.h"
#include "daemon/control/log.h"
#include "daemon/control/options.h"
#include "daemon/control/service.h"
#include "daemon/control/signals.h"
#include "shm/host.h"
#include "usage/written.h"

static struct config config;
static struct daemon the_daemon;

static void keep_standard_descriptors(void)
{
	int fd;

	do {
		fd = open("/dev/null", O_RDWR);
	} while (fd >= 0 && fd <= STDERR_FILENO);
	if (fd > STDERR_FILENO)
		close(fd);
}

static void complain(void *context, const char *line)
{
	const struct options *options = context;

	if (options->check_config)
		fprintf(stderr, "%s\n", line);
	else
		log_line(EVENT_ERROR, "%s", line);
}

/* A folder on the command line has to be as good as one in the file. */
static int override(const struct options *options)
{
	struct config_raw_daemon raw;
	uint32_t index;
	char why[256];
	const struct config_key *key = config_find(CONFIG_DAEMON, "runtime-directory", &index, why,
						   sizeof(why));
	const char *wrong;

	if (options->no_realtime)
		config.realtime_required = false;
	if (!options->runtime_directory)
		return 0;
	wrong = config_store(key, index, options->runtime_directory, &raw);
	if (!wrong) {
		memcpy(config.runtime_directory, raw.runtime_directory,
		       sizeof(config.runtime_directory));
		return 0;
	}
	config_allowed(key, why, sizeof(why));
	log_line(EVENT_ERROR, "--runtime-directory: \"%s\" %s; allowed: %s",
		 options->runtime_directory, wrong, why);
	return STATUS_USAGE;
}

/*
 * For the service manager, when there is no daemon any more and perhaps no other one will
 * come: then nobody takes the folder, which clears it. Of the configuration only the folder
 * is read, for what is broken in it may be why none comes.
 */
static int clear(struct options *options)
{
	char why[256];
	int result;

	if (!options->runtime_directory &&
	    config_read_folder(options->config, &config, complain, options))
		return STATUS_CONFIG;
	result = override(options);
	if (result)
		return result;
	result = shm_host_clear(config.runtime_directory, why, sizeof(why));
	if (result)
		log_line(EVENT_ERROR, "%s", why);
	if (result == -EBUSY)
		return STATUS_BUSY;
	return result ? STATUS_FAILED : STATUS_OK;
}

int main(int argc, char **argv)
{
	int (*read)(const char *path, struct config *out, config_complain tell, void *context);
	struct options options;
	char judged[160] = "";
	int status;

	signals_hold();
	keep_standard_descriptors();
	if (!options_parse(&options, argc, argv, &status))
		return usage_written("pokeysd", status);
	log_open(STDERR_FILENO, EVENT_INFO);
	if (options.clear)
		return clear(&options);
	read = options.check_config ? config_check : config_read;
	if (options.check_config) {
		signals_release(); /* it leaves nothing behind */
		service_become(judged, sizeof(judged));
	}
	if (read(options.config, &config, complain, &options))
		return STATUS_CONFIG;
	status = override(&options);
	if (status)
		return status;
	if (options.check_config) {
		printf("%s: in order, %u device%s%s\n", options.config, config.devices,
		       config.devices == 1 ? "" : "s", judged);
		return usage_written("pokeysd", STATUS_OK);
	}
	log_open(STDERR_FILENO, config.log_level);
	return daemon_run(&the_daemon, &config, options.config);
}
