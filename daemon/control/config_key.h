/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The one table of keys, and what is written in a file before it is judged as
 * a whole. Internal to the configuration; tests walk the table.
 */
#ifndef CONTROL_CONFIG_KEY_H
#define CONTROL_CONFIG_KEY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "daemon/control/config.h"

enum config_section { CONFIG_DAEMON, CONFIG_DEVICE, CONFIG_SECTIONS };

/* What a value is, and where it goes: the C type of the field follows from it. */
enum config_type {
	CONFIG_INTEGER,		/* int64_t: words, or minimum..maximum */
	CONFIG_REAL,		/* double: words, or minimum..maximum */
	CONFIG_TEXT,		/* char[size], no blanks */
	CONFIG_FILE,		/* char[size], an absolute path */
	CONFIG_ADDRESS,		/* uint32_t, IPv4, host byte order */
	CONFIG_ADDRESS_LIST,	/* struct config_list */
	CONFIG_PIN_LIST,	/* uint64_t, bit = pin - 1; minimum..maximum */
	CONFIG_PIN_PAIR,	/* uint8_t[2], 0-based; minimum..maximum */
};

struct config_word {
	const char *name;
	int64_t value;
};

struct config_key {
	enum config_section section;
	const char *name;		/* '#' stands for an index */
	enum config_type type;
	size_t offset, size;		/* of the field in its raw section */
	uint32_t count, stride;		/* indices 0..count-1 (0 = no index), bytes between them */
	double minimum, maximum;	/* maximum < minimum: words only */
	const struct config_word *words;	/* ends with a NULL name; may be NULL */
	const char *fallback;		/* default, as a user would write it; NULL = none */
	const char *unit;		/* NULL = none */
	const char *help;
};

extern const struct config_key config_keys[];
extern const size_t config_key_count;

enum { CONFIG_INDICES = 25 };	/* the largest count in the table */

struct config_list {
	uint32_t count;
	uint32_t address[CONFIG_ADDRESSES];
};

struct config_raw_daemon {
	char runtime_directory[CONFIG_PATH_MAX];
	char group[33];
	char interface[16];
	char metrics_file[256];
	int64_t transport, mode, period_us, cpu, priority, realtime, log_level;
	int64_t busy_poll_us, discovery_interval_ms, metrics_interval_ms;
	double collect, duty;
	struct config_list discovery_address;
};

struct config_raw_axis {
	int64_t mode, invert, soft_limits, soft_minimum, soft_maximum;
	double max_speed, max_acceleration, max_deceleration;
};

struct config_raw_encoder {
	int64_t enable, sampling;
	uint8_t pins[2];
};

struct config_raw_device {
	char name[32];
	uint32_t address;
	int64_t port, serial;
	double heartbeat_timeout_ms, stale_after_ms, lost_after_ms;
	int64_t fast_divider;
	double slow_hz, encoder_hz, analog_hz;
	double deadline_floor_us, deadline_ceiling_ms, deadline_initial_ms, reply_lifetime_ms;
	int64_t retries, window, retry_budget, send_budget;
	uint64_t digital_inputs, digital_outputs, analog_inputs, inverted_pins;
	uint64_t safe_on, safe_hold;
	int64_t axes, emergency_pin, fast_encoders, ultra_fast_encoder;
	struct config_raw_axis axis[POKEYS_AXES];
	struct config_raw_encoder encoder[CONFIG_INDICES];
};

/* Where each key of a section stands in the file; 0 = it does not. */
struct config_lines {
	uint32_t section;
	uint32_t key[128][CONFIG_INDICES];
};

/* A file while it is read. */
struct config_file {
	const char *name;
	config_complain complain;
	void *context;
	int faults;
	struct config_raw_daemon daemon;
	struct config_raw_device device[TRANSPORT_CHANNELS];
	uint32_t devices;
	struct config_lines daemon_lines;
	struct config_lines device_lines[TRANSPORT_CHANNELS];
};

/* Put every default into a section. */
void config_defaults(enum config_section section, void *raw);

/*
 * Judge and store one value. NULL = stored, else what is wrong with it (a
 * static text to stand after what was given).
 */
const char *config_store(const struct config_key *key, uint32_t index, const char *text, void *raw);

/* What may be written for a key, for a person: "250..4000", "sleep | spin". */
size_t config_allowed(const struct config_key *key, char *text, size_t size);

/* The key that a name means, with its index; NULL and *why if none. */
const struct config_key *config_find(enum config_section section, const char *name,
				     uint32_t *index, char *why, size_t size);

/* Count and pass on a complaint about a line (0 = about the whole file). */
void config_fault(struct config_file *file, uint32_t line, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* Rules between keys, then raw values into *out. Complains by itself. */
void config_judge(struct config_file *file, struct config *out);

#endif
