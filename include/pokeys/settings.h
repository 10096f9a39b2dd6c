/* SPDX-License-Identifier: MIT */
/*
 * The device's own settings: what it shall be (the wish, written by the
 * commander), what it is and what is wanted in all (the report, written by
 * the daemon).
 *
 * A setting counts only if its bit in a `set` word or mask is 1. In a wish the
 * bit means "this is wanted, and the rest is none of my business"; in the
 * report's `device` it means "known: the device has it and said this".
 * What pokeysd.conf wants and what the commander wishes are laid over each
 * other, the commander's last, and stand in the report's `wanted`.
 *
 * The daemon reads the device's values, writes only differences, only while
 * the pulse engine stands and motion is not permitted, and never to flash
 * unless asked to save. A value out of range refuses that one setting
 * (report.refused), all others go on.
 *
 * Pins are 0-based here as in state.h; 255 = none. Speeds are pulses/s.
 * Layout rules, magic, version and hash as in state.h.
 */
#ifndef POKEYS_SETTINGS_H
#define POKEYS_SETTINGS_H

#include <stdint.h>
#include <pokeys/state.h>

#ifdef __cplusplus
extern "C" {
#endif

#define POKEYS_WISH_MAGIC	UINT32_C(0x48574b50)	/* "PKWH" */
#define POKEYS_REPORT_MAGIC	UINT32_C(0x50524b50)	/* "PKRP" */
#define POKEYS_WISH_VERSION	2
#define POKEYS_REPORT_VERSION	2
#define POKEYS_WISH_HASH	UINT64_C(0x90bba2dde6674bea)
#define POKEYS_REPORT_HASH	UINT64_C(0x27bb31d594bd80c8)

/* axis.set: which members below are meant. options and switches have masks of their own. */
enum {
	POKEYS_AXIS_SET_PIN_LIMIT_MINUS = 1u << 0,
	POKEYS_AXIS_SET_PIN_LIMIT_PLUS = 1u << 1,
	POKEYS_AXIS_SET_PIN_HOME = 1u << 2,
	POKEYS_AXIS_SET_PIN_ENABLE = 1u << 3,
	POKEYS_AXIS_SET_INVERT_ENABLE = 1u << 4,
	POKEYS_AXIS_SET_FILTER_LIMIT_MINUS = 1u << 5,
	POKEYS_AXIS_SET_FILTER_LIMIT_PLUS = 1u << 6,
	POKEYS_AXIS_SET_FILTER_HOME = 1u << 7,
	POKEYS_AXIS_SET_FILTER_PROBE = 1u << 8,
	POKEYS_AXIS_SET_HOMING_ALGORITHM = 1u << 9,
	POKEYS_AXIS_SET_HOMING_SPEED = 1u << 10,
	POKEYS_AXIS_SET_HOMING_RETURN = 1u << 11,
	POKEYS_AXIS_SET_BACK_OFF = 1u << 12,
	POKEYS_AXIS_SET_MPG_ENCODER = 1u << 13,
	POKEYS_AXIS_SET_MPG_MULTIPLIER = 1u << 14,
	POKEYS_AXIS_SET_MPG_DIVIDER = 1u << 15,
	POKEYS_AXIS_SET_MAX_SPEED = 1u << 16,
	POKEYS_AXIS_SET_MAX_ACCELERATION = 1u << 17,
	POKEYS_AXIS_SET_MAX_DECELERATION = 1u << 18,
	POKEYS_AXIS_SET_SOFT_MINIMUM = 1u << 19,
	POKEYS_AXIS_SET_SOFT_MAXIMUM = 1u << 20,
	POKEYS_AXIS_SET_SIGNALS = 1u << 21,
	/* from here on in requests of their own, protocol section 3.24.3 */
	POKEYS_AXIS_SET_BACKLASH_WIDTH = 1u << 22,
	POKEYS_AXIS_SET_BACKLASH_ACCELERATION = 1u << 23,
	POKEYS_AXIS_SET_POSTEP_TYPE = 1u << 24,
	POKEYS_AXIS_SET_POSTEP_ADDRESS = 1u << 25,
	POKEYS_AXIS_SET_POSTEP_STEP = 1u << 26,
	POKEYS_AXIS_SET_POSTEP_TEMPERATURE = 1u << 27,
};

/* Protocol section 3.24.4. Pins of switches and enable: 0 = dedicated input, else 1-based. */
struct pokeys_axis_settings {
	uint32_t set;                  /* POKEYS_AXIS_SET_* */
	uint8_t options, options_mask; /* 1 enabled, 2 inverted, 4 internal planner, 8 position
					* mode, 16 home inverted, 32 soft limits, 128 masked */
	uint8_t switches,
		switches_mask; /* 1 limit-, 2 limit+, 4 home, 8 home on limit-,
				* 16 home on limit+, 32/64/128 invert limit-/limit+/home */
	uint8_t pin_limit_minus, pin_limit_plus, pin_home, pin_enable;
	uint8_t invert_enable;
	uint8_t filter_limit_minus, filter_limit_plus, filter_home, filter_probe; /* 0..254 */
	uint8_t homing_algorithm; /* low nibble on activation, high nibble on release */
	uint8_t homing_speed;     /* % of max_speed */
	uint8_t homing_return;    /* % of the homing speed */
	uint8_t mpg_encoder;      /* 1-based, 0 none */
	uint8_t signals;          /* 1 invert step, 2 invert direction, 4 index falling */
	int16_t mpg_multiplier;
	uint16_t mpg_divider;
	uint16_t backlash_half;                   /* half of the play, pulses */
	int32_t soft_minimum, soft_maximum;       /* pulses */
	int32_t back_off;                         /* pulses */
	float max_speed;                          /* pulses/s */
	float max_acceleration, max_deceleration; /* pulses/s^2 */
	uint8_t backlash_acceleration;            /* pulses/ms^2 */
	uint8_t postep_type;                      /* of the PoStep driver, 0 none */
	uint8_t postep_address;                   /* I2C */
	uint8_t postep_step;                      /* 0..8 = full step .. 1/256 */
	uint8_t postep_temperature;               /* limit, degrees C */
	uint8_t reserved[7];
};

/* Protocol section 3.8. Encoders 0..24. */
struct pokeys_encoder_settings {
	uint8_t options, options_mask; /* 1 count, 2 4x sampling, 4 2x sampling, 16..128 key
					* maps */
	uint8_t pins_set;              /* 1 = pin_a and pin_b are meant */
	uint8_t pin_a, pin_b;          /* 0-based */
	uint8_t reserved[3];
};

/* settings.set */
enum {
	POKEYS_SET_FAST_ENCODERS = 1u << 0, /* fast_configuration and fast_options */
	POKEYS_SET_ULTRA_FAST = 1u << 1,    /* ultra_* */
	POKEYS_SET_PWM_PERIOD = 1u << 2,
	POKEYS_SET_ANALOG_FILTER = 1u << 3,
	POKEYS_SET_AXES = 1u << 4,
	POKEYS_SET_CHARGE_PUMP = 1u << 5,
	POKEYS_SET_GENERATOR = 1u << 6,
	POKEYS_SET_EMERGENCY_INVERT = 1u << 7,
	POKEYS_SET_EMERGENCY_PIN = 1u << 8,
	POKEYS_SET_POWER_STATES = 1u << 9,
	POKEYS_SET_FAILSAFE = 1u << 10, /* failsafe_* as a whole */
	POKEYS_SET_MATRIX = 1u << 11,   /* matrix_* as a whole */
	POKEYS_SET_NAME = 1u << 12,
	POKEYS_SET_POEXTBUS = 1u << 13, /* poextbus_* */
	POKEYS_SET_BACKLASH = 1u << 14, /* backlash_enable */
	POKEYS_SET_BACKLASH_SPEED = 1u << 15,
	POKEYS_SET_POSTEP = 1u << 16,       /* postep_enable */
	POKEYS_SET_SYNC_PWM = 1u << 17,     /* sync_pwm_* as a whole */
	POKEYS_SET_SYNC_OUTPUTS = 1u << 18, /* sync_out_* as a whole */
	POKEYS_SET_THREADING = 1u << 19,    /* threading_* as a whole */
};

struct pokeys_settings {
	uint32_t set;                      /* POKEYS_SET_* */
	uint32_t pwm_period;               /* ticks of capability.pwm_hz */
	uint8_t pin_set[POKEYS_PIN_BYTES]; /* bit = pin_function[] is meant */
	uint8_t pin_function[56];          /* protocol section 3.2 */
	struct pokeys_encoder_settings encoder[25];
	uint8_t fast_configuration, fast_options; /* protocol section 3.8, 0xCE; 1 index
						   * inputs, 16 no 4x, 32/64/128 invert */
	uint8_t ultra_enable, ultra_options;      /* 0x1C */
	uint32_t ultra_filter;
	uint8_t axes;        /* number enabled, 0..8 */
	uint8_t charge_pump; /* 0 off, 1 default pin, else pin */
	uint8_t generator;   /* type, 0x40 swap step and direction, 0x80
			      * extended I/O */
	uint8_t emergency_invert;
	uint8_t emergency_pin; /* as on the wire: 0 off, 1 default, else
				* terminal + 10 */
	uint8_t power_states;
	uint8_t poextbus_connector, poextbus_no_crc;
	uint8_t failsafe_timeout;     /* 100 ms, 0 off */
	uint8_t failsafe_peripherals; /* 1 digital, 2 PoExtBus, 4 PWM, 8 pulse engine */
	uint8_t failsafe_outputs[POKEYS_PIN_BYTES];
	uint8_t failsafe_poextbus[POKEYS_POEXTBUS];
	uint8_t failsafe_pwm[POKEYS_PWM];                   /* percent */
	uint8_t matrix_enable, matrix_rows, matrix_columns; /* 1..16 rows, 1..8 columns */
	uint8_t matrix_row_pin[16], matrix_column_pin[8];   /* 0-based */
	uint8_t reserved[7];
	uint32_t analog_filter; /* protocol section 3.5, RC filter, 0 = none */
	char name[24];          /* at most 20 characters, NUL terminated */
	uint8_t backlash_enable;
	uint8_t backlash_speed; /* as on the wire, its unit is not documented */
	uint8_t postep_enable;  /* the device talks to PoStep drivers */
	uint8_t sync_pwm_enable, sync_pwm_axis, sync_pwm_channel; /* channel 0..5 */
	uint8_t sync_out_enable, sync_out_axis;
	uint8_t sync_out_pin[8];  /* per bit: terminal, 0 none, 92..99 external
				   * output */
	uint8_t threading_mode;   /* 0 index, 1 encoder and index, 2, 3 the same at
				   * high speed; 0x40 count index pulses, 0x80
				   * test */
	uint8_t threading_ignore; /* bit = axis that does not take part */
	uint16_t threading_ticks; /* of the encoder, a revolution */
	uint16_t threading_rpm;   /* aimed at */
	uint16_t threading_speed_gain, threading_position_gain; /* unit not documented */
	uint8_t reserved2[6];
	struct pokeys_axis_settings axis[POKEYS_AXES];
};

/* The wish, service pokeys/<name>/wish: written by the commander, rarely. */
struct pokeys_wish {
	uint32_t magic;
	uint16_t version, size_units;
	uint64_t hash;
	uint32_t session;    /* of the command image */
	uint32_t generation; /* differs for each write, never 0 */
	struct pokeys_settings settings;
};

/* state.config_state, report.state */
enum pokeys_config_state {
	POKEYS_CONFIG_UNKNOWN = 0, /* the device's settings have not been read */
	POKEYS_CONFIG_WAITING = 1, /* differences wait for the machine to be off */
	POKEYS_CONFIG_APPLYING = 2,
	POKEYS_CONFIG_APPLIED = 3, /* all that is wanted, the device has */
	POKEYS_CONFIG_REFUSED = 4, /* but for report.refused */
};

/* report.refused: which setting; report.refused_index: of which pin, encoder or axis. */
enum pokeys_setting {
	POKEYS_SETTING_NONE = 0,
	POKEYS_SETTING_PIN = 1,
	POKEYS_SETTING_ENCODER = 2,
	POKEYS_SETTING_ENCODER_PINS = 3,
	POKEYS_SETTING_FAST_ENCODERS = 4,
	POKEYS_SETTING_ULTRA_FAST = 5,
	POKEYS_SETTING_ENGINE = 6,
	POKEYS_SETTING_EMERGENCY = 7,
	POKEYS_SETTING_AXIS = 8,
	POKEYS_SETTING_PWM = 9,
	POKEYS_SETTING_ANALOG_FILTER = 10,
	POKEYS_SETTING_FAILSAFE = 11,
	POKEYS_SETTING_MATRIX = 12,
	POKEYS_SETTING_NAME = 13,
	POKEYS_SETTING_POEXTBUS = 14,
	POKEYS_SETTING_BACKLASH = 15,
	POKEYS_SETTING_POSTEP = 16,
	POKEYS_SETTING_POSTEP_MODES = 17,
	POKEYS_SETTING_SYNC_PWM = 18,
	POKEYS_SETTING_SYNC_OUTPUTS = 19,
	POKEYS_SETTING_THREADING = 20,
};

/* The report, service pokeys/<name>/settings: written by the daemon when something changes. */
struct pokeys_report {
	uint32_t magic;
	uint16_t version, size_units;
	uint64_t hash;
	uint64_t epoch, t_publish_ns;
	uint32_t count;      /* reports since the daemon's start; state.report_count */
	uint32_t generation; /* of the wish that is in `wanted`; 0 = none yet */
	uint8_t state;       /* enum pokeys_config_state */
	uint8_t refused;     /* enum pokeys_setting, the last one */
	uint8_t refused_index;
	uint8_t reserved[5];
	struct pokeys_settings device; /* as the device has it */
	struct pokeys_settings wanted; /* pokeysd.conf and wish together */
};

#ifdef __cplusplus
}
#endif

#endif /* POKEYS_SETTINGS_H */
