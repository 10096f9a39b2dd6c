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
#include "settings/key.h"

enum config_section { CONFIG_DAEMON, CONFIG_DEVICE, CONFIG_HEATER, CONFIG_SERVO, CONFIG_SECTIONS };

/* What a value is, and where it goes: the C type of the field follows from it. */
enum config_type {
	CONFIG_INTEGER,      /* int64_t: words, or minimum..maximum */
	CONFIG_REAL,         /* double: words, or minimum..maximum */
	CONFIG_TEXT,         /* char[size], no blanks */
	CONFIG_FILE,         /* char[size], an absolute path */
	CONFIG_ADDRESS,      /* uint32_t, IPv4, host byte order */
	CONFIG_ADDRESS_LIST, /* struct config_list */
	CONFIG_PIN_LIST,     /* uint64_t, bit = pin - 1; minimum..maximum, or words: those of
			      * one bit in a list, others alone */
	CONFIG_POINTS,       /* struct config_points */
	CONFIG_SETTING,      /* struct pokeys_settings, as `setting` says */
};

struct config_key {
	enum config_section section;
	const char *name; /* '#' stands for an index */
	enum config_type type;
	size_t offset, size;     /* of the field in its raw section */
	uint32_t count, stride;  /* indices 0..count-1 (0 = no index), bytes between them */
	double minimum, maximum; /* maximum < minimum: words only */
	const struct settings_word *words; /* ends with a NULL name; may be NULL */
	const char *fallback;              /* default, as a user would write it; NULL = none */
	const char *unit;                  /* NULL = none */
	const char *help;
	const struct settings_key *setting;
};

/* resume-outputs, beside the pins. */
#define CONFIG_RESUME_PART(part)	((int64_t)(part) << 56)		/* DEVICE_RESUME_* */
#define CONFIG_RESUME_PARTS		CONFIG_RESUME_PART(0xf)
#define CONFIG_RESUME_AUTO		((int64_t)3 << 60)

enum {
	CONFIG_KEYS_MAX = 256,
	CONFIG_INDICES = 25, /* the largest count in the table */
	CONFIG_HEATERS = 16, /* of all devices */
	CONFIG_SERVOS = 16,
};

/* Walk them: NULL behind the last one. The control thread. */
const struct config_key *config_key_at(size_t number);
size_t config_key_number(const struct config_key *key);

struct config_list {
	uint32_t count;
	uint32_t address[CONFIG_ADDRESSES];
};

/* As they are written: degrees Celsius, and ohm or volts. */
struct config_points {
	uint32_t count;
	struct sensor_point point[SENSOR_POINTS];
};

/* [heater] sensor */
enum config_sensor {
	CONFIG_THERMISTOR,
	CONFIG_STEINHART,
	CONFIG_PT100,
	CONFIG_PT1000,
	CONFIG_LINEAR,
	CONFIG_SENSOR_TABLE,
	CONFIG_SENSORS
};

struct config_raw_daemon {
	char runtime_directory[CONFIG_PATH_MAX];
	char group[33], monitor_group[33];
	char interface[16];
	char metrics_file[256];
	char record_folder[256];
	int64_t recorder_seconds, record_files, record_interval_s;
	int64_t transport, mode, period_us, cpu, priority, realtime, log_level, guard;
	int64_t busy_poll_us, discovery_interval_ms, metrics_interval_ms;
	int64_t phase_lock;
	double collect, duty;
	struct config_list discovery_address;
};

struct config_raw_device {
	char name[32];
	uint32_t address;
	int64_t port, serial;
	double heartbeat_timeout_ms, stale_after_ms, lost_after_ms;
	int64_t fast_divider;
	double slow_hz, encoder_hz, analog_hz;
	int64_t slow_together;
	double deadline_floor_us, deadline_ceiling_ms, deadline_initial_ms, reply_lifetime_ms;
	int64_t retries, window, retry_budget, send_budget;
	uint64_t safe_on, safe_hold, resume;
	int64_t failsafe, on_emergency;
	double heater_watts;     /* 0: not given */
	double corner_deviation; /* units */
	struct {
		char name[POKEYS_AXIS_NAME]; /* empty: not given */
		double per_unit;             /* 0: not given */
		int64_t lead;
	} axis[POKEYS_AXES];
	char password_file[256];
	char password[33]; /* its content, once it was judged */
	struct pokeys_settings settings;
};

struct config_raw_heater {
	char name[32], device[32];
	int64_t sensor_pin, sensor;
	double ohm, ohm_at, beta, pull_up, reference, volts_at_0, volts_per_kelvin;
	struct config_points points;
	int64_t pwm, output_pin; /* -1, 0: not given */
	double least_s;
	double watts;             /* 0: not given */
	int64_t fan_pwm, fan_pin; /* -1, 0: not given */
	double fan_above, fan_hysteresis, fan_speed;
	int64_t law;
	double p, i, d, smooth_s, hysteresis;
	double least, most, target_most; /* target_most: or CONFIG_TARGET_AUTO */
	double power_most, rate_most, stale_ms, window_s, rise, slack, within;
	double hold_s; /* -1: for ever */
	int64_t stops_machine;
	int64_t without_failsafe;
	/* once they were judged */
	uint32_t of, number; /* device, and which one of its heaters */
	struct heating_config out;
};

#define CONFIG_TARGET_AUTO	(-1000)

struct config_raw_servo {
	char name[32], device[32];
	int64_t encoder;
	double scale;
	int64_t drive, pwm, reverse_pwm, direction_pin, enable_pin, invert_output;
	double dwell_ms;
	int64_t limit_minus_pin, limit_plus_pin, limit_minus_invert, limit_plus_invert;
	int64_t home_pin, home_invert;
	double home_search, home_latch;          /* home_latch: or CONFIG_SERVO_AUTO */
	double home_acceleration, home_distance; /* or CONFIG_SERVO_AUTO */
	double home_offset, home_position;
	double least, most;            /* -+CONFIG_UNLIMITED */
	double speed_most, speed_jump; /* speed_jump: or CONFIG_SERVO_AUTO */
	double acceleration_most;      /* or CONFIG_SERVO_AUTO */
	double p, i, d, velocity, acceleration;
	double deadband, integral_most; /* integral_most: or CONFIG_SERVO_AUTO */
	double output_most, smooth_s;
	double follow_least, follow_most;
	double stall_output, stall_move, stall_s; /* stall_output: or CONFIG_SERVO_AUTO */
	double silent_output, silent_s, runaway_output, runaway_move, stale_ms;
	int64_t without_failsafe;
	/* once they were judged */
	uint32_t of, number; /* device, and which one of its servo motors */
	struct servoing_config out;
};

#define CONFIG_SERVO_AUTO	(-1)
#define CONFIG_UNLIMITED	INT64_MAX

/*
 * A file's content, or that of one in the folder beside it, which is read after it. A place is a
 * line (from 1) and, in the upper bits, the number of the text.
 */
struct config_text {
	const char *name; /* its path */
	const char *text;
	size_t length;
};

enum { CONFIG_LINE_BITS = 24 };

/* The place of each key of a section; 0 = the key is not set. */
struct config_lines {
	uint32_t section, last; /* first and last header */
	uint32_t key[CONFIG_KEYS_MAX][CONFIG_INDICES];
	bool faulty[CONFIG_KEYS_MAX]; /* what stands there was refused */
};

/* A file while it is read. */
struct config_file {
	const struct config_text *text; /* at most CONFIG_FILES of them */
	config_complain complain;
	void *context;
	int faults;
	bool public; /* password files are left alone */
	bool here;   /* it is for this machine: its groups, interfaces, cores */
	struct config_raw_daemon daemon;
	struct config_raw_device device[TRANSPORT_CHANNELS];
	uint32_t devices;
	struct config_lines daemon_lines;
	struct config_lines device_lines[TRANSPORT_CHANNELS];
	struct config_raw_heater heater[CONFIG_HEATERS];
	uint32_t heaters;
	struct config_lines heater_lines[CONFIG_HEATERS];
	struct config_raw_servo servo[CONFIG_SERVOS];
	uint32_t servos;
	struct config_lines servo_lines[CONFIG_SERVOS];
};

/* For whom a configuration is read. */
enum config_reader { CONFIG_TO_RUN, CONFIG_TO_CHECK, CONFIG_PUBLIC, CONFIG_FOLDER };

/* Texts in their order, judged as one configuration. As config_read(). */
int config_parse_texts(const struct config_text *text, size_t texts, enum config_reader reader,
		       struct config *out, config_complain complain, void *context);

/* Put every default into a section. */
void config_defaults(enum config_section section, void *raw);

/*
 * Judge and store one value. NULL = stored, else what is wrong with it (a
 * static text to stand after what was given).
 */
const char *config_store(const struct config_key *key, uint32_t index, const char *text, void *raw);

/* What may be written for a key, for a person: "250..4000 us", "sleep | spin". */
size_t config_allowed(const struct config_key *key, char *text, size_t size);

/* The key that a name means, with its index; NULL and *why if none. */
const struct config_key *config_find(enum config_section section, const char *name, uint32_t *index,
				     char *why, size_t size);

/* "line 3", or "NAME:3" if it is another file than that of `from`. */
enum { CONFIG_WHERE = 300 };
const char *config_where(const struct config_file *file, uint32_t place, uint32_t from,
			 char where[CONFIG_WHERE]);

/* Count and pass on a complaint about a place (line 0 = about the whole file). */
void config_fault(struct config_file *file, uint32_t place, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* Pass on what is none, for a person who asks. */
void config_note(const struct config_file *file, uint32_t place, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* Rules between keys, then raw values into *out. Complains by itself. */
void config_judge(struct config_file *file, struct config *out);

/* What is not on this machine: a group, an interface, a core. */
void config_judge_here(struct config_file *file);

/* Place of a key if it is in a file, else that of the section. */
uint32_t config_line_of(const struct config_lines *lines, const char *name, uint32_t index);

/* Raw values into the units of their users; nothing can go wrong any more. */
void config_convert_daemon(const struct config_raw_daemon *raw, struct config *out);
void config_convert_device(const struct config_raw_device *raw, uint64_t period_ns,
			   struct device_config *out);
/* What a file of moves calls it. */
void config_axis_name(const struct config_raw_device *raw, unsigned int axis,
		      char name[POKEYS_AXIS_NAME]);
void config_convert_heater(const struct config_raw_heater *raw, struct heating_config *out);
void config_convert_servo(const struct config_raw_servo *raw, struct servoing_config *out);
bool config_is_set(const struct config_lines *lines, const char *name, uint32_t index);
/* What the section has for this key was refused. */
bool config_is_faulty(const struct config_lines *lines, const char *name);

/*
 * The one line of a password file into out[33]. NULL, or what is wrong with the
 * file (a static text). Nothing of its content is ever told.
 */
const char *config_read_password(const char *path, char out[33]);

/* It is there for the service's user alone, who we are not: nobody can tell from here. */
bool config_password_hidden(const char *path);

#endif
