// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeys-sim: reads the command line, builds the rig, serves it. Everything
 * random comes from one seed, which is printed so that a run can be repeated.
 */
#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sysexits.h>
#include <time.h>
#include <unistd.h>

#include "sim/preset.h"
#include "sim/server.h"
#include "usage/written.h"

#define SCRIPT_BYTES 1048576

static struct sim_rig rig;
static struct sim_server server;
static struct sim_script script;

static int complain(const char *reason, int status)
{
	fprintf(stderr, "pokeys-sim: %s\n", reason);
	return status;
}

/* The whole file as one string; NULL with errno set, EILSEQ: it is no text. */
static char *read_file(const char *path)
{
	FILE *file = fopen(path, "re");
	char *text = malloc(SCRIPT_BYTES + 1);
	size_t len;
	int error = 0;

	if (!file || !text) {
		if (file)
			fclose(file);
		free(text);
		return NULL;
	}
	len = fread(text, 1, SCRIPT_BYTES + 1, file);
	if (ferror(file))
		error = errno;
	else if (len > SCRIPT_BYTES)
		error = EFBIG;
	else if (memchr(text, '\0', len))
		error = EILSEQ; /* what is behind it would never be run */
	fclose(file);
	if (error) {
		free(text);
		errno = error;
		return NULL;
	}
	text[len] = '\0';
	return text;
}

static bool load_script(const char *path, struct sim_text *why)
{
	char *text = read_file(path);
	char reason[256];
	struct sim_text bad;

	if (!text) {
		sim_text_add(why, "--script %s: %s", path,
			     errno == EILSEQ ? "it is no text" : strerror(errno));
		return false;
	}
	sim_text_init(&bad, reason, sizeof(reason));
	if (sim_script_parse(&script, text, &bad))
		return true;
	sim_text_add(why, "%s: %s", path, reason);
	return false;
}

static bool pin_to(int cpu, struct sim_text *why)
{
	cpu_set_t set;

	CPU_ZERO(&set);
	CPU_SET((size_t)cpu, &set);
	if (sched_setaffinity(0, sizeof(set), &set) == 0)
		return true;
	sim_text_add(why, "--cpu %d: %s", cpu,
		     errno == EINVAL ? "there is no such CPU, or not for this process" :
				       strerror(errno));
	return false;
}

/* Whoever waits for the line would wait for ever; and a file of ours may get the number. */
static bool ready_can_be_told(int fd, struct sim_text *why)
{
	if (fd < 0 || fcntl(fd, F_GETFD) >= 0)
		return true;
	sim_text_add(why, "--ready-fd %d: %s", fd, strerror(errno));
	return false;
}

static bool prepare(struct sim_options *options, struct sim_text *why)
{
	options->rig.device.clock_s = time(NULL);
	if (!ready_can_be_told(options->ready_fd, why))
		return false;
	if (options->cpu >= 0 && !pin_to(options->cpu, why))
		return false;
	if (options->script && !load_script(options->script, why))
		return false;
	sim_rig_init(&rig, &options->rig);
	return !options->preset || sim_preset_apply(&rig.device, options->preset, why);
}

static void announce(const struct sim_options *options)
{
	const uint8_t *ip = options->rig.device.ip;
	char line[64];
	int len;

	if (!options->quiet) {
		printf("pokeys-sim: %s serial %u at %u.%u.%u.%u:%u, seed %llu\n",
		       sim_hardware_name(rig.device.options.hardware), rig.device.options.serial,
		       ip[0], ip[1], ip[2], ip[3], server.port,
		       (unsigned long long)options->rig.seed);
		fflush(stdout);
	}
	if (options->ready_fd < 0)
		return;
	len = snprintf(line, sizeof(line), "ready %u.%u.%u.%u %u\n", ip[0], ip[1], ip[2], ip[3],
		       server.port);
	if (write(options->ready_fd, line, (size_t)len) != len)
		fprintf(stderr, "pokeys-sim: --ready-fd %d: %s\n", options->ready_fd,
			strerror(errno));
	close(options->ready_fd);
}

static int serve(const struct sim_options *options)
{
	int r = sim_server_open(&server, options, &rig, options->script ? &script : NULL);

	if (r < 0)
		return EXIT_FAILURE;
	announce(options);
	r = sim_server_run(&server);
	sim_server_close(&server);
	free(script.text);
	return r < 0 ? EXIT_FAILURE : EXIT_SUCCESS;
}

int main(int argc, char **argv)
{
	struct sim_options options;
	char reason[512];
	struct sim_text why;

	if (argc > 1 && !strcmp(argv[1], "--ctl"))
		return usage_written("pokeys-sim", sim_ctl(argc - 2, argv + 2));
	sim_text_init(&why, reason, sizeof(reason));
	if (!sim_options_parse(&options, argc, argv, &why))
		return complain(reason, EX_USAGE);
	if (options.help) {
		sim_options_help(stdout);
		return usage_written("pokeys-sim", EXIT_SUCCESS);
	}
	if (options.version) {
		printf("pokeys-sim %s\n", POKEYS_VERSION);
		return usage_written("pokeys-sim", EXIT_SUCCESS);
	}
	if (!prepare(&options, &why))
		return complain(reason, EXIT_FAILURE);
	return serve(&options);
}
