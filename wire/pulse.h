/* SPDX-License-Identifier: MIT */
#ifndef WIRE_PULSE_H
#define WIRE_PULSE_H

/*
 * Pulse engine v2: operation 0x85 with the sub-command at @2, and the
 * multi-part fill 0xB0; protocol sections 3.24 and 1.6.
 *
 * Positions are pulses, speeds pulses per ms, accelerations pulses per ms^2;
 * one slot is 1 ms. Bit or index n of "per axis" is axis n, 0-based. Switch
 * and enable pins are 1-based with 0 for the dedicated input.
 */

#include "wire/op.h"
#include "wire/slots.h"

/* Engine state, status @10. */
enum wire_engine_state {
	WIRE_ENGINE_STOPPED = 0,
	WIRE_ENGINE_RUNNING = 3,
	WIRE_ENGINE_JOGGING = 10,
	WIRE_ENGINE_STOPPING = 11,
	WIRE_ENGINE_HOME = 20,
	WIRE_ENGINE_HOMING = 21,
	WIRE_ENGINE_PROBE_COMPLETE = 30,
	WIRE_ENGINE_PROBING = 31,
	WIRE_ENGINE_PROBE_ERROR = 32,
	WIRE_ENGINE_HYBRID_STOPPING = 40,
	WIRE_ENGINE_HYBRID_COMPLETE = 41,
	WIRE_ENGINE_STOP_LIMIT = 100,
	WIRE_ENGINE_STOP_EMERGENCY = 101,
};

/* Axis state, status @16... */
enum wire_axis_state {
	WIRE_AXIS_STOPPED = 0,
	WIRE_AXIS_READY = 1,
	WIRE_AXIS_RUNNING = 2,
	WIRE_AXIS_BUFFER = 5,
	WIRE_AXIS_HOMING_RESETTING = 8,
	WIRE_AXIS_HOMING_BACKING_OFF = 9,
	WIRE_AXIS_HOME = 10,
	WIRE_AXIS_HOMING_START = 11,
	WIRE_AXIS_HOMING_SEARCH = 12,
	WIRE_AXIS_HOMING_BACK = 13,
	WIRE_AXIS_PROBED = 14,
	WIRE_AXIS_PROBE_START = 15,
	WIRE_AXIS_PROBE_SEARCH = 16,
	WIRE_AXIS_ERROR = 20,
	WIRE_AXIS_LIMIT = 30,
};

/* Generator byte, status @15 and setup @10. */
#define WIRE_GENERATOR_TYPE 0x0F	/* mask */
#define WIRE_GENERATOR_EXTERNAL 0	/* 8 axes, 125 kHz */
#define WIRE_GENERATOR_INTERNAL 1	/* 3 axes, 25 kHz */
#define WIRE_GENERATOR_SMART 2
#define WIRE_GENERATOR_SWAP 0x40	/* step and direction swapped */
#define WIRE_GENERATOR_EXTENDED_IO 0x80

/* Power-enable states, setup @13 and status @4; << 4 for the charge pump. */
#define WIRE_POWER_STOPPED 0x01
#define WIRE_POWER_STOP_LIMIT 0x02
#define WIRE_POWER_STOP_EMERGENCY 0x04

/* Misc inputs, status @62. */
#define WIRE_MISC_INPUT5 0x10
#define WIRE_MISC_INPUT6 0x20
#define WIRE_MISC_INPUT7 0x40
#define WIRE_MISC_SPINDLE_ERROR 0x80

/* 0x85/00 and 0x85/08 request. */
struct wire_pulse_status_req {
	uint8_t check; /* any value; a good reply has 0x5A + check at @63 */
};

/* 0x85/00 reply (section 3.24.2). */
struct wire_pulse_status_rep {
	uint8_t soft_limits; /* active, per axis */
	uint8_t power_states;
	uint8_t limit_override;
	uint8_t axes_enabled; /* number of enabled axes */
	uint8_t activated;    /* 1: initialised */
	uint8_t engine_state; /* enum wire_engine_state */
	uint8_t charge_pump;
	uint8_t limit_pos;             /* limit + tripped, per axis */
	uint8_t limit_neg;             /* limit - tripped, per axis */
	uint8_t home;                  /* home switch, per axis */
	uint8_t generator;             /* WIRE_GENERATOR_ */
	uint8_t axis_state[WIRE_AXES]; /* enum wire_axis_state */
	int32_t position[WIRE_AXES];
	uint8_t axes_supported;
	uint8_t max_khz; /* highest pulse frequency */
	uint8_t buffer_slots;
	uint8_t slot_time; /* 100 us */
	uint8_t emergency_invert;
	uint8_t driver_error; /* per axis */
	uint8_t misc_inputs;  /* WIRE_MISC_ */
	uint8_t check;        /* checked by wire_match_reply() */
};

/* Result byte of setup, smart generator setup and reset. */
struct wire_pulse_result_rep {
	uint8_t result; /* 0 OK */
};

/* 0x85/01; generator and power states take effect after 0x85/05. */
struct wire_pulse_setup_req {
	uint8_t axes;        /* enabled axes, 0..8 */
	uint8_t charge_pump; /* 0 off, 1 default pin, >= 10 pin */
	uint8_t generator;
	uint8_t buffer_slots; /* 0 default */
	uint8_t emergency_invert;
	uint8_t power_states;
};

/* 0x85/02 */
struct wire_pulse_state_req {
	uint8_t state;          /* enum wire_engine_state */
	uint8_t limit_override; /* 1: motion in both directions in spite of limits */
	uint8_t enable_mask;    /* outputs of axes with WIRE_AXIS_ENABLED_MASKED */
};

/* 0x85/03 */
struct wire_pulse_positions_req {
	uint8_t mask;
	int32_t position[WIRE_AXES];
};

/* 0x85/04; bits of oc on a 57CNC: 0 SSR2, 1 relay 2, 2 relay 1, 3..6 OC1..4, 7 SSR1. */
struct wire_pulse_outputs_req {
	uint8_t relays;
	uint8_t oc;
	uint8_t read_only; /* 1: only read */
};
struct wire_pulse_outputs_rep {
	uint8_t relays;
	uint8_t oc;
};

/* 0x85/06; pin 0 off, 1 default, else 1-based pin + 10 (section 6, D17). */
#define WIRE_EMERGENCY_PIN_DEFAULT 1
#define WIRE_EMERGENCY_PIN_BASE 10
struct wire_pulse_emergency_req {
	uint8_t write;
	uint8_t read_mark; /* @5, 1 from the vendor's library when reading; ignored */
	uint8_t pin;
};
struct wire_pulse_emergency_rep {
	uint8_t pin;
};

/* 0x85/08: raw levels of the dedicated inputs, per axis. Order: -, +, home. */
struct wire_pulse_status2_rep {
	uint8_t limit_neg;
	uint8_t limit_pos;
	uint8_t home;
	uint8_t check;
};

/* 0x85/0A and 0x85/0B, request and reply. */
#define WIRE_SYNC_OFF 0
#define WIRE_SYNC_ON 1
#define WIRE_SYNC_READ 2
/* pins from here on are outputs of the engine's connector */
#define WIRE_SYNC_EXTERNAL_FIRST 92
#define WIRE_SYNC_EXTERNAL_LAST 99
struct wire_pulse_sync_pwm_req {
	uint8_t option;  /* WIRE_SYNC_ */
	uint8_t axis;    /* source of the value */
	uint8_t channel; /* PWM channel 0..5 */
};
struct wire_pulse_sync_outputs_req {
	uint8_t option; /* WIRE_SYNC_ */
	uint8_t axis;
	uint8_t pin[8]; /* per bit: 1-based, 0 none, 92..99 on-board outputs */
};

/* Axis options, @8. */
#define WIRE_AXIS_ENABLED 0x01
#define WIRE_AXIS_INVERTED 0x02
#define WIRE_AXIS_INTERNAL_PLANNER 0x04	/* clear: buffer mode */
#define WIRE_AXIS_POSITION_MODE 0x08	/* clear: speed mode */
#define WIRE_AXIS_INVERTED_HOME 0x10
#define WIRE_AXIS_SOFT_LIMITS 0x20
#define WIRE_AXIS_FAST_OUTPUT 0x40
#define WIRE_AXIS_ENABLED_MASKED 0x80

/* Axis switches, @9. */
#define WIRE_SWITCH_LIMIT_N 0x01
#define WIRE_SWITCH_LIMIT_P 0x02
#define WIRE_SWITCH_HOME 0x04
#define WIRE_SWITCH_HOME_ON_N 0x08	/* home shared with limit - */
#define WIRE_SWITCH_HOME_ON_P 0x10
#define WIRE_SWITCH_INVERT_N 0x20
#define WIRE_SWITCH_INVERT_P 0x40
#define WIRE_SWITCH_INVERT_HOME 0x80

/* Homing algorithm, @43: low nibble on activation, high nibble on release. */
#define WIRE_HOMING_SLOW 1
#define WIRE_HOMING_REVERSE 2
#define WIRE_HOMING_ARM_INDEX 4
#define WIRE_HOMING_RESET_STOP 8
#define WIRE_HOMING_DEFAULT 0x83	/* also meant by 0 and 0xFF */

/* Signal options, @51. */
#define WIRE_SIGNAL_INVERT_STEP 0x01
#define WIRE_SIGNAL_INVERT_DIR 0x02
#define WIRE_SIGNAL_INDEX_FALLING 0x04

/*
 * One axis (section 3.24.4). Always read, change, write: a set replaces all
 * of it, signal options and reserved bytes included.
 */
struct wire_axis_config {
	uint8_t options;  /* WIRE_AXIS_ */
	uint8_t switches; /* WIRE_SWITCH_ */
	uint8_t pin_home, pin_limit_n, pin_limit_p;
	uint8_t homing_speed;  /* % of max_speed */
	uint8_t homing_return; /* % of the homing speed */
	uint8_t mpg_encoder;   /* 1-based, 0 none */
	float max_speed;
	float max_accel;
	float max_decel;
	int32_t soft_min, soft_max;
	int16_t mpg_multiplier;
	uint8_t pin_enable;
	uint8_t invert_enable;
	uint8_t filter_limit_n, filter_limit_p, filter_home; /* 0..254 */
	uint8_t homing_algorithm;                            /* WIRE_HOMING_ */
	uint8_t mpg_1x;                                      /* firmware 4.2.18 to 4.2.31 only */
	int32_t back_off;                                    /* pulses */
	uint16_t mpg_divider;
	uint8_t signals; /* WIRE_SIGNAL_ */
	uint8_t filter_probe;
	uint8_t reserved[11]; /* @53..63 */
};

/* 0x85/10; the reply does not say which axis it is of. */
struct wire_pulse_axis_get_req {
	uint8_t axis;
};
struct wire_pulse_axis_get_rep {
	struct wire_axis_config config;
};

/* 0x85/11 */
struct wire_pulse_axis_set_req {
	uint8_t axis;
	struct wire_axis_config config;
};

/* 0x85/18 reply and 0x85/19 request. */
#define WIRE_DRIVERS 4
struct wire_pulse_drivers {
	struct {
		uint8_t step;    /* 0 full .. 8 1/256 */
		uint8_t current; /* 0..255 = 0..2.5 A */
	} driver[WIRE_DRIVERS];
};

/* 0x85/20: pulses in position mode, pulses per SECOND in speed mode. All axes count. */
struct wire_pulse_move_req {
	int32_t reference[WIRE_AXES];
};

/* 0x85/25, firmware >= 4.4.7 */
struct wire_pulse_move_pv_req {
	uint8_t mask;
	int32_t position[WIRE_AXES];
	uint16_t velocity[WIRE_AXES]; /* 0..65535 = 0..100 % of max_speed */
};

/* 0x85/21 */
struct wire_pulse_home_start_req {
	uint8_t mask;
	int32_t offset[WIRE_AXES];
};

/* 0x85/22 */
struct wire_pulse_home_finish_req {
	uint8_t state;      /* engine state to enter */
	uint8_t keep_state; /* 1: do not change the engine state */
};

/* 0x85/23; input 0 off, 1..8 external, else 1-based pin + 8. */
struct wire_pulse_probe_start_req {
	uint8_t mask;
	uint8_t hybrid;           /* 1: mask, limit and speed do not count */
	int32_t limit[WIRE_AXES]; /* furthest position */
	float speed;              /* ratio of max_speed */
	uint8_t input;
	uint8_t polarity;
};

/* 0x85/24 */
struct wire_pulse_probe_finish_req {
	uint8_t keep_state; /* 0: engine goes to STOPPED, 1: only clear probing */
};
struct wire_pulse_probe_finish_rep {
	int32_t position[WIRE_AXES];
	uint8_t status; /* per axis: found */
};

/* 0x85/35 and 0x85/36 reply (section 6, D25). */
struct wire_thread_status_rep {
	uint8_t preparing, prepared, waiting, active;
	int32_t velocity; /* estimated */
	int32_t position_error;
	uint32_t rpm;
	uint8_t ignore_axes; /* mask */
	uint32_t index_count;
	uint8_t debug[35];
};
#define WIRE_THREAD_ENCODER 1	/* mode: the encoder's counts are taken, not the index alone */

/* 0x85/36 */
struct wire_thread_params_req {
	uint8_t mode;   /* 0 index, 1 encoder + index, 2 hs index, 3 hs encoder */
	uint16_t ticks; /* encoder ticks per revolution */
	uint16_t target_rpm;
	uint16_t speed_gain;
	uint16_t position_gain;
	uint8_t ignore_axes;
};

/* 0x85/40 and 0x85/41 */
struct wire_backlash {
	uint16_t half_width; /* pulses */
	uint8_t accel;       /* pulses per ms^2 */
	uint8_t reserved;    /* goes back as it came */
};
struct wire_pulse_backlash_set_req {
	uint8_t enable;
	uint8_t max_speed;
	struct wire_backlash axis[WIRE_AXES];
};
struct wire_pulse_backlash_rep {
	uint8_t enable;
	uint8_t max_speed;
	struct wire_backlash axis[WIRE_AXES];
	int16_t compensation[WIRE_AXES]; /* current */
};

/* 0x85/50 .. 0x85/54: PoStep drivers; option 0x10 writes, 0 reads. */
#define WIRE_POSTEP_WRITE 0x10
struct wire_postep_comm_req {
	uint8_t option;
	uint8_t enable;
	struct {
		uint8_t type;
		uint8_t address; /* I2C */
		uint8_t update;
	} axis[WIRE_AXES];
};
struct wire_postep_status_rep {
	struct {
		uint8_t supply;      /* 0.25 V */
		uint8_t temperature; /* degrees C */
		uint8_t inputs;
		uint8_t state;
		uint8_t faults;
		uint8_t updates; /* counter */
	} axis[WIRE_AXES];
};
struct wire_postep_currents_req {
	uint8_t option;
	struct {
		uint16_t full_scale, idle, overheat; /* unit not documented */
	} axis[WIRE_AXES];
};
struct wire_postep_modes_req {
	uint8_t option;
	struct {
		uint8_t mode;
		uint8_t step;        /* 0..8 = 1..1/256 */
		uint8_t temperature; /* limit */
		uint8_t reserved[3]; /* go back as they came */
	} axis[WIRE_AXES];
};
struct wire_postep_versions_rep {
	struct {
		uint8_t hw_major, hw_minor, fw_major, fw_minor;
	} axis[WIRE_AXES];
};

/* 0x85/90 reply and 0x85/91 request. */
struct wire_smart_config {
	uint8_t pulse_width[WIRE_AXES];
	uint32_t spindle_period;
	uint8_t encoder_config;
	uint8_t count_mode;
	uint16_t step_period;
	uint8_t axes;
	uint8_t probe_config;
	uint8_t filter[2];
	uint8_t step_gpio;
	uint8_t dir_gpio;
	uint8_t step_pwm;
	uint8_t step_multiplier[WIRE_AXES];
	uint8_t encoder_multiplier[WIRE_AXES];
	uint16_t max_mismatch[WIRE_AXES];
};
/* 0x85/92, 0x85/95, 0x85/96 */
struct wire_smart_reset_req {
	uint8_t axes;
};
struct wire_smart_status_rep {
	uint8_t mismatch_axes;
	uint16_t spindle_period;
	uint8_t inputs;
	int16_t mismatch[WIRE_AXES];
	int32_t position[WIRE_AXES];
};
struct wire_smart_encoders_rep {
	int32_t value[WIRE_AXES];
};

/*
 * 0x85/FF (8-bit slots) and 0x85/FE (16-bit slots). Slots follow each other,
 * axis 0 first, one byte or two for every axis; see wire_slot8() and
 * wire_slot_get(). slots * axes may exceed the data: use wire_fill_fits().
 */
struct wire_pulse_fill_req {
	uint8_t slots;
	uint8_t axes; /* stride of a slot in values */
	uint8_t data[WIRE_FILL_DATA];
};

/* Reply of every fill: the status, but slots taken instead of sub-command. */
struct wire_pulse_fill_rep {
	uint8_t accepted;
	struct wire_pulse_status_rep status; /* its check byte is not set */
};

/* One part of 0xB0 (section 1.6). */
struct wire_pulse_fill_part_req {
	uint8_t part;  /* index, WIRE_MULTI_START, WIRE_MULTI_STOP */
	uint8_t width; /* WIRE_SLOTS_8BIT or WIRE_SLOTS_16BIT */
	uint8_t slots;
	uint8_t axes;
	uint8_t data[WIRE_FILL_DATA];
};

WIRE_OPS_PULSE(WIRE_TYPED)

#endif
