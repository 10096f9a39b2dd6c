/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One setting of the device: how it is read, compared, written and learned.
 *
 * configure.c turns them all the same way; what each is stands in setting_*.c,
 * and setting.c has the table.
 */
#ifndef DEVICE_SETTING_H
#define DEVICE_SETTING_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/settings.h>
#include "wire/bus.h"
#include "wire/encoder.h"
#include "wire/io.h"
#include "wire/panel.h"
#include "wire/pulse.h"
#include "wire/system.h"

struct device;

enum setting_state {
	SETTING_READ, /* to be read */
	SETTING_READING,
	SETTING_WRITE, /* differs: to be written */
	SETTING_WRITING,
	SETTING_EFFECT, /* written; takes effect by a further request */
	SETTING_DONE,
	SETTING_REFUSED,
};

enum setting_index {
	SETTING_PINS,
	SETTING_ENCODER_OPTIONS,
	SETTING_ENCODER_PINS,
	SETTING_FAST_ENCODERS,
	SETTING_ULTRA_ENCODER,
	SETTING_PWM,
	SETTING_FILTER,
	SETTING_POEXTBUS,
	SETTING_MATRIX,
	SETTING_NAME,
	SETTING_FAILSAFE,
	SETTING_ENGINE,
	SETTING_EMERGENCY,
	SETTING_BACKLASH,
	SETTING_SYNC_PWM,
	SETTING_SYNC_OUTPUTS,
	SETTING_POSTEP,
	SETTING_POSTEP_MODES,
	SETTING_THREADING,
	SETTING_AXIS, /* and one more for each further axis */
	SETTINGS = SETTING_AXIS + POKEYS_AXES
};

/* The parameters cannot be read; status has to stand first, an answer is decoded into it. */
struct setting_thread {
	struct wire_thread_status_rep status;
	struct wire_thread_params_req params;
	bool written; /* params were acknowledged */
};

union setting_value {
	struct wire_pin_all_rep pins;
	struct wire_encoder_options_rep options;
	struct wire_encoder_pins_rep encoder_pins;
	struct wire_fast_encoders_rep fast;
	struct wire_ultra_encoder_rep ultra;
	struct wire_pwm_rep pwm;
	struct wire_filter_rep filter;
	struct wire_poextbus_rep poextbus;
	struct wire_kb_config_rep matrix;
	struct wire_device_name_rep name;
	struct wire_failsafe_req failsafe;
	struct wire_pulse_status_rep engine;
	struct wire_pulse_emergency_rep emergency;
	struct wire_pulse_axis_get_rep axis;
	struct wire_pulse_backlash_rep backlash;
	struct wire_pulse_sync_pwm_req sync_pwm;
	struct wire_pulse_sync_outputs_req sync_outputs;
	struct wire_postep_comm_req postep;
	struct wire_postep_modes_req modes;
	struct setting_thread thread;
};

union setting_request {
	struct wire_pin_all_req pins;
	struct wire_encoder_options_req options;
	struct wire_encoder_pins_req encoder_pins;
	struct wire_fast_encoders_req fast;
	struct wire_ultra_encoder_req ultra;
	struct wire_pwm_req pwm;
	struct wire_filter_set_req filter;
	struct wire_poextbus_req poextbus;
	struct wire_kb_option_req matrix_get;
	struct wire_kb_config_set_req matrix_set;
	struct wire_device_name_req name;
	struct wire_failsafe_req failsafe;
	struct wire_pulse_status_req status;
	struct wire_pulse_setup_req setup;
	struct wire_pulse_emergency_req emergency;
	struct wire_pulse_axis_get_req axis_get;
	struct wire_pulse_axis_set_req axis_set;
	struct wire_pulse_backlash_set_req backlash_set;
	struct wire_pulse_sync_pwm_req sync_pwm;
	struct wire_pulse_sync_outputs_req sync_outputs;
	struct wire_postep_comm_req postep;
	struct wire_postep_modes_req modes;
	struct wire_thread_params_req thread;
};

struct setting {
	uint8_t state;               /* enum setting_state */
	uint8_t failures;            /* reads without answer */
	uint8_t writes;              /* answered, and not taken all the same */
	uint8_t unanswered;          /* writes without answer */
	bool said;                   /* that it is refused */
	bool watched;                /* it is read in its turn (watch.c), and at rest */
	uint64_t differed;           /* ... from what is wanted, before */
	uint64_t odd;                /* ... and at the last reading, believed or not */
	bool waited;                 /* ... to be written, before */
	bool known;                  /* value is what the device said last */
	uint64_t changed;            /* bit = pin or encoder written; bit 0 = all else */
	uint64_t after_ns;           /* read not before */
	uint64_t asked_ns;           /* when value was asked for */
	union setting_value value;   /* as the device has it */
	union setting_request write; /* as we want it */
};

/* postep_talk.c: on the way to the drivers, and back. */
struct postep_talk {
	uint8_t step;                 /* of what has to be done, 0 = the first */
	uint8_t passing;              /* bit = axis whose setting was sent to the device */
	uint8_t awaited;              /* bit = axis whose driver has not been talked to since */
	uint8_t updates[POKEYS_AXES]; /* its counter then */
	bool open, waiting, counted;
	uint8_t fetched;                /* bit = axis whose driver's own values have been read */
	uint8_t turning;                /* bit = axis whose driver gets another step mode */
	uint8_t permitted[POKEYS_AXES]; /* step modes when motion was permitted, 255 = not known */
	uint64_t until_ns, again_ns;
};

/* setting_sync.c: what was acknowledged last. */
struct synced {
	struct wire_pulse_sync_pwm_req pwm;
	struct wire_pulse_sync_outputs_req outputs;
	bool pwm_taken, outputs_taken;
};

struct configure {
	struct setting setting[SETTINGS];
	struct postep_talk postep;
	struct synced synced;
	bool standing;      /* the pulse engine stands: settings may be written */
	bool found_running; /* the engine, since we look at it */
	bool stop_open;
	uint64_t watch_ns;  /* when the next one is read in its turn */
	uint8_t watch_last; /* the last watched setting other than a pin's function */
	bool watch_pins;    /* those were the last */
	uint64_t again_ns;  /* blocked until then; 0 = not */
};

/* What is wanted, by whom, and what the device has. */
struct wishes {
	struct pokeys_settings accepted; /* of the commander's, what was in range */
	struct pokeys_settings wanted;   /* pokeysd.conf's, and the commander's over it */
	struct pokeys_settings known;    /* the device's own */
	uint32_t session;                /* of the commander who wished */
	uint32_t generation;             /* of the commander's wish; 0 = none yet */
	uint32_t count;                  /* reports */
	uint8_t refused, refused_index;  /* enum pokeys_setting, the last one */
	uint8_t state_reported;
	bool out_of_range; /* ... was so by itself: only another wish mends it */
	bool changed;      /* since the last report */
};

struct setting_kind {
	enum wire_op read, write;
	/* What a report calls it. */
	enum pokeys_setting name;
	/* The device must answer it even if nobody wants anything of it. */
	bool vital;
	/* A device that has it otherwise, or not at all, runs all the same. */
	bool dispensable;
	/* Whether this device has it at all. */
	bool (*has)(const struct device *device, unsigned int index);
	/*
	 * What to say if it has not and is wanted all the same: the firmware that brought it,
	 * major << 16 | minor << 8 | revision. 0 = nothing.
	 */
	uint32_t since;
	/* Only a PoKeys57CNC has it. */
	bool only_57cnc;
	/* It may be read now. NULL = always. */
	bool (*ready)(struct device *device);
	/* Whether these settings say anything about it. */
	bool (*wanted)(const struct pokeys_settings *want, unsigned int index);
	/* The request that reads it. */
	void (*ask)(unsigned int index, union setting_request *request);
	/* What would have to be written; returns what differs, 0 = nothing. */
	uint64_t (*merge)(const struct pokeys_settings *want, unsigned int index,
			  const union setting_value *value, union setting_request *request);
	/*
	 * The last word before the write: outputs go along with it, those of this very
	 * moment, into the request; false = wait. NULL = none do.
	 */
	bool (*take_along)(struct device *device, union setting_request *request);
	/* The write was acknowledged; for what cannot be read back. NULL = that does not count. */
	void (*taken)(struct device *device, const union setting_request *request);
	/* Into the state image. */
	void (*learn)(struct device *device, unsigned int index, const union setting_value *value);
	/* Into the report. */
	void (*report)(struct pokeys_settings *known, unsigned int index,
		       const union setting_value *value);
	/* What an event says was written; `which` is a bit of `changed`. */
	int64_t (*written)(const union setting_value *value, unsigned int which);
	/* The write takes effect by a further request only. NULL = never. */
	bool (*needs_effect)(const union setting_value *value,
			     const union setting_request *request);
	/* ... this one; false = not now. When it has ended the setting is to be read again. */
	bool (*effect)(struct device *device, struct setting *setting);
};

/* In `changed` and what merge() returns: no axis' own. */
enum { SETTING_ENGINE_BIT = POKEYS_AXES };

#define SETTING_VERSION(major, minor, revision) ((major) << 16 | (minor) << 8 | (revision))

/* The firmware is this version or newer. */
bool setting_since(const struct device *device, uint32_t version);

/* The kind of a setting, and its index within the kind. */
const struct setting_kind *setting_kind(unsigned int setting, unsigned int *index);

extern const struct setting_kind setting_pins;
extern const struct setting_kind setting_encoder_options, setting_encoder_pins;
extern const struct setting_kind setting_fast, setting_ultra;
extern const struct setting_kind setting_pwm, setting_filter, setting_poextbus, setting_matrix;
extern const struct setting_kind setting_name, setting_failsafe;
extern const struct setting_kind setting_backlash, setting_sync_pwm, setting_sync_outputs;
extern const struct setting_kind setting_postep, setting_postep_modes;
extern const struct setting_kind setting_engine, setting_emergency, setting_thread, setting_axis;

/* For kinds: an unconditional yes, a read request of zeros, nothing to learn. */
bool setting_always(const struct device *device, unsigned int index);
bool setting_has_engine(const struct device *device, unsigned int index);
void setting_ask_zeros(unsigned int index, union setting_request *request);
void setting_learn_nothing(struct device *device, unsigned int index,
			   const union setting_value *value);

#endif
