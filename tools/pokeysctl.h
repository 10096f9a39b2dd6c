/* SPDX-License-Identifier: GPL-2.0-or-later */
/* pokeysctl(1): what its parts share. */
#ifndef TOOLS_POKEYSCTL_H
#define TOOLS_POKEYSCTL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Exit statuses, as pokeysctl(1) lists them. */
enum {
	STATUS_OK = 0,
	STATUS_FAILED = 1, /* no daemon, no answer, cannot be read, a problem */
	STATUS_STALE = 2,  /* read, but a device is not running or its data is old */
	STATUS_USAGE = 64,
};

enum { ADDRESSES_MAX = 8 };

/* The command line, after it was judged. */
struct options {
	const char *runtime_directory;
	bool runtime_named; /* by --runtime-directory */
	bool json;
	uint32_t timeout_ms;
	uint32_t count; /* 0 = for ever */
	double interval_s;
	const char *interface;
	uint32_t address[ADDRESSES_MAX];
	size_t addresses;
	int cpu;                               /* -1 = not said */
	const char *config, *root, *svg, *csv; /* NULL = not said */
	double seconds;
	double duration_s; /* 0 = not said */
	double speed;      /* pulses/s, or units/s; 0 = not said */
	double threshold_us;
	uint32_t slowest;
	int priority;
	bool no_realtime;
	bool follow;
	bool draft;          /* a pokeysd.conf is to be printed */
	bool write;          /* changed files are to be written */
	bool fix, undo, yes; /* of doctor: write its files, remove them, do not ask */
	char *const *names;  /* devices */
	size_t name_count;
};

/* One line to stderr: "pokeysctl: ...". */
void complain(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* The subcommands; each returns an exit status. */
int command_discover(const struct options *options);
int command_devices(const struct options *options);
int command_status(const struct options *options);
int command_axis(const struct options *options);
int command_config(const struct options *options);
int command_doctor(const struct options *options);
int command_events(const struct options *options);
int command_get(const struct options *options);
int command_heater(const struct options *options);
int command_servo(const struct options *options);
int command_latency(const struct options *options);
int command_migrate(const struct options *options);
int command_moves(const struct options *options);
int command_names(const struct options *options);
int command_output(const struct options *options);
int command_pwm(const struct options *options);
int command_record(const struct options *options);
int command_replay(const struct options *options);
int command_trace(const struct options *options);
int command_terminals(const struct options *options);
int command_top(const struct options *options);

#endif
