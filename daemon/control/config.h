/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * pokeysd.conf: read whole, checked whole, accepted whole or not at all.
 */
#ifndef CONTROL_CONFIG_H
#define CONTROL_CONFIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include "daemon/device/device.h"
#include "daemon/rt/loop.h"
#include "daemon/transport/transport.h"

#define CONFIG_PATH "/etc/pokeysd/pokeysd.conf"
#define CONFIG_FOLDER_ENDING ".d"

enum {
	CONFIG_PATH_MAX = 50, /* SHM_DIRECTORY_MAX: sockets live below the folder */
	CONFIG_ADDRESSES = 8,
	CONFIG_FILES = 33,      /* of one configuration */
	CONFIG_FAULTS_MAX = 50, /* complaints about one file, then no more */
};

enum config_transport { CONFIG_AUTO, CONFIG_IO_URING, CONFIG_SOCKET, CONFIG_XDP };
enum config_wait { CONFIG_WAIT_AUTO, CONFIG_WAIT_SLEEP, CONFIG_WAIT_NAPI, CONFIG_WAIT_SPIN };

/* Everything in the units that its users want. */
struct config {
	char runtime_directory[CONFIG_PATH_MAX];
	char group[33];            /* empty = leave */
	char monitor_group[33];    /* empty = pokeys-monitor, if there is one */
	char interface[16];        /* empty = any */
	char metrics_file[256];    /* empty = none */
	uint32_t recorder_seconds; /* 0 = nothing is recorded */
	char record_folder[256];   /* empty = what the service manager gives */
	uint32_t record_files;     /* kept; 0 = none are written */
	uint64_t record_interval_ns;
	bool interface_dedicated; /* for pokeys-guard */
	enum config_transport transport;
	enum config_wait wait;
	uint32_t busy_poll_us;    /* with CONFIG_WAIT_NAPI */
	struct loop_options loop; /* mode is chosen by waiting_choose() */
	int cpu;                  /* -1 = not pinned */
	int priority;
	bool realtime_required;
	uint64_t discovery_interval_ns;
	uint32_t discovery_address[CONFIG_ADDRESSES]; /* besides the interfaces' */
	uint32_t discovery_addresses;
	uint64_t metrics_interval_ns;
	int log_level; /* syslog's */
	uint32_t devices;
	struct device_config device[TRANSPORT_CHANNELS];
};

/* One complaint, one line without newline: "file:line: section: key: what, and what is allowed". */
typedef void (*config_complain)(void *context, const char *line);

/*
 * Read a file, and after it those of the folder "path.d" that end in .conf: of a key of [daemon],
 * the last file counts. 0 and *out filled, or the number of faults found (each was
 * complained about; *out is untouched). Cold.
 */
int config_read(const char *path, struct config *out, config_complain complain, void *context);

/*
 * The same, and a group, an interface or a core that is not on this machine is a
 * fault as well. Only for a person who asks: an interface that is not there yet
 * may come a second later, and is then no reason never to start.
 */
int config_check(const char *path, struct config *out, config_complain complain, void *context);

/*
 * The same as config_read, and password files are not looked at: for programs
 * that neither need them nor have the right to read them.
 */
int config_read_public(const char *path, struct config *out, config_complain complain,
		       void *context);

/*
 * Only [daemon] runtime-directory, or its default, into out->runtime_directory; whatever else
 * is wrong with the file is not looked at. 0; a fault of that key, or of the file as a
 * whole, is complained about and leaves *out untouched.
 */
int config_read_folder(const char *path, struct config *out, config_complain complain,
		       void *context);

/* The same as config_read from memory; `name` stands for the file in complaints. */
int config_parse(const char *name, const char *text, size_t length, struct config *out,
		 config_complain complain, void *context);

/*
 * The files that belong to a configuration in the order in which they are read: `path`, which may
 * be missing, and those of the folder "path.d". Their number, to be freed by
 * config_free_files(), or -errno; -E2BIG = more than CONFIG_FILES. Cold.
 */
int config_files(const char *path, char *file[CONFIG_FILES]);
void config_free_files(char *file[], int files);

/* The transport's name as transport_open() takes it. */
const char *config_transport_name(enum config_transport transport);

/* All keys for a person (--help-config), or as the man page has them. */
void config_help(FILE *to);
void config_man(FILE *to);

#endif
