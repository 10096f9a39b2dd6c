/* SPDX-License-Identifier: MIT */
/*
 * The state image: what the daemon knows of one device, as one moment.
 *
 * Published once a cycle as a whole into shared memory (service
 * pokeys/<name>/state); a reader gets all of one cycle or all of another.
 * Times are nanoseconds of CLOCK_MONOTONIC of this machine. Decide staleness
 * by your own clock from the time stamps: the flag cannot be raised by a
 * writer that is dead.
 *
 * Pin, encoder and axis indices are 0-based: pin[0] is the terminal that the
 * device calls pin 1.
 *
 * Fixed-size types, 8-byte aligned, no implicit padding. A change of layout
 * changes POKEYS_STATE_VERSION and POKEYS_STATE_HASH. The hash is 64-bit FNV-1a
 * (offset basis 0xcbf29ce484222325, prime 0x100000001b3) of this text: for each
 * member of the struct in order "name:offset:size;", both numbers in bytes and
 * decimal, an array counting as one member; and if the member is a struct or
 * an array of structs, directly behind it "{", the same text for that struct
 * (offsets from its own start), "}". C, Rust and Python each compute it, and a
 * test compares them. What a value means is not in the hash: a new meaning
 * needs a new version.
 */
#ifndef POKEYS_STATE_H
#define POKEYS_STATE_H

#include <stdint.h>
#include <pokeys/loop.h>

#ifdef __cplusplus
extern "C" {
#endif

#define POKEYS_STATE_MAGIC	UINT32_C(0x54534b50)	/* "PKST" */
#define POKEYS_DIAG_MAGIC	UINT32_C(0x47444b50)	/* "PKDG" */
#define POKEYS_STATE_VERSION	22
#define POKEYS_DIAG_VERSION	4
#define POKEYS_STATE_HASH	UINT64_C(0xffba3099fa38976e)
#define POKEYS_DIAG_HASH	UINT64_C(0x043bbadfaaa1ea0e)

enum {
	POKEYS_PINS = 55,
	POKEYS_PIN_BYTES = 8, /* 55 bits, padded */
	POKEYS_ANALOG = 7,    /* pins 41..47 */
	POKEYS_ENCODERS = 26, /* 0..24 basic and fast, 25 ultra-fast */
	POKEYS_PWM = 6,
	POKEYS_AXES = 8,
	POKEYS_POEXTBUS = 10,     /* bytes */
	POKEYS_PONET = 16,        /* modules */
	POKEYS_MATRIX_BYTES = 16, /* 128 keys */
	POKEYS_SLOW_GROUPS = 20,
};

enum pokeys_link {
	POKEYS_LINK_SEARCHING = 0,   /* no address yet, or nobody answers */
	POKEYS_LINK_IDENTIFYING = 1, /* answers; asking who it is */
	POKEYS_LINK_CONFIGURING = 2, /* known; reading and adjusting its configuration */
	POKEYS_LINK_RUNNING = 3,
	POKEYS_LINK_LOST = 4, /* was running, does not answer */
};

/* Why the link is not running, or was not the last time. */
enum pokeys_fault {
	POKEYS_FAULT_NONE = 0,
	POKEYS_FAULT_NO_ADDRESS = 1, /* discovery has not found the serial number */
	POKEYS_FAULT_NO_ANSWER = 2,
	POKEYS_FAULT_WRONG_SERIAL = 3,   /* another device answers at the address */
	POKEYS_FAULT_UNSUPPORTED = 4,    /* a device type this driver does not know */
	POKEYS_FAULT_CONFIG_REFUSED = 5, /* the device did not take a setting */
	POKEYS_FAULT_LOCKED = 6,         /* the device's configuration is locked */
	POKEYS_FAULT_REBOOTED = 7,       /* its tick counter went back */
	POKEYS_FAULT_NETWORK = 8,        /* the kernel cannot send (no route, link down) */
	POKEYS_FAULT_IN_USE = 9,         /* another daemon, or another section, drives it */
	POKEYS_FAULT_SUSPENDED = 10,     /* the daemon's computer was suspended */
};

/* state.flags */
enum {
	POKEYS_STATE_STALE = 1u << 0,         /* fast data older than the limit */
	POKEYS_STATE_COMMANDER = 1u << 1,     /* a commander's heartbeat is fresh */
	POKEYS_STATE_SAFE = 1u << 2,          /* outputs and axes are in the safe state */
	POKEYS_STATE_MACHINE_ON = 1u << 3,    /* motion is permitted (edge seen, link running) */
	POKEYS_STATE_NEEDS_EDGE = 1u << 4,    /* machine-on is high, a fresh edge is awaited */
	POKEYS_STATE_REALTIME = 1u << 5,      /* SCHED_FIFO and locked memory */
	POKEYS_STATE_FALLBACK = 1u << 6,      /* a slower transport than asked for */
	POKEYS_STATE_BAD_COMMAND = 1u << 7,   /* values of the command image were refused */
	POKEYS_STATE_STOPPING = 1u << 8,      /* the daemon is ending */
	POKEYS_STATE_GUARD = 1u << 9,         /* the XDP guard is attached */
	POKEYS_STATE_OUTPUTS_HELD = 1u << 10, /* safe after a loss or emergency
					       * stop, until machine-on rises */
	POKEYS_STATE_EDGE_UNREAD = 1u << 11,  /* machine-on is high, and its edge was refused:
					       * the commander's positions were too old */
};

/* state.failsafe: the device's own, for when nobody talks to it (protocol section 3.21) */
enum pokeys_failsafe {
	POKEYS_FAILSAFE_UNKNOWN = 0, /* not read, or the device has none */
	POKEYS_FAILSAFE_OFF = 1,
	POKEYS_FAILSAFE_ARMED = 2, /* as wanted, read back from the device */
	POKEYS_FAILSAFE_OTHER = 3, /* on, but not as we want it */
};

/* state.phase.state: whether the daemon's cycle follows the commander's thread */
enum pokeys_phase_state {
	POKEYS_PHASE_OFF = 0,     /* pokeysd.conf says so */
	POKEYS_PHASE_FREE = 1,    /* nobody to follow */
	POKEYS_PHASE_UNFIT = 2,   /* no period of a commander's fits the daemon's */
	POKEYS_PHASE_SEEKING = 3, /* on the way to it, or its reads cannot be predicted */
	POKEYS_PHASE_LOCKED = 4,  /* data are published just before each read */
};

/* state.engine.task: what the device does by itself, on behalf of a one-shot */
enum pokeys_task {
	POKEYS_TASK_NONE = 0,
	POKEYS_TASK_HOMING = 1,
	POKEYS_TASK_PROBING = 2,
	POKEYS_TASK_HYBRID_PROBING = 3, /* the commander moves, the device watches */
	POKEYS_TASK_JOGGING = 4,        /* axes follow hand wheels at the device */
	POKEYS_TASK_THREADING = 5,      /* the buffer is played by the spindle's turns */
};

enum pokeys_task_phase {
	POKEYS_TASK_IDLE = 0,
	POKEYS_TASK_PREPARING = 1, /* the engine is brought to stand */
	POKEYS_TASK_STARTING = 2,  /* the device was asked to begin */
	POKEYS_TASK_WORKING = 3,   /* it was seen to have begun */
	POKEYS_TASK_COMPLETE = 4,  /* homed; the commander has yet to finish it */
	POKEYS_TASK_FINISHING = 5, /* the end is requested from the device, or results are */
	POKEYS_TASK_STOPPING = 6,  /* the engine is brought to stand */
};

enum pokeys_task_result {
	POKEYS_TASK_RESULT_NONE = 0,
	POKEYS_TASK_DONE = 1,
	POKEYS_TASK_CANCELLED = 2, /* by a one-shot, machine off, or loss of the commander */
	POKEYS_TASK_TIMED_OUT = 3,
	POKEYS_TASK_FAILED = 4,    /* the device did not begin, or did something else */
	POKEYS_TASK_TRIPPED = 5,   /* a limit switch or the emergency input */
	POKEYS_TASK_NOT_FOUND = 6, /* the probe touched nothing */
	POKEYS_TASK_LOST = 7,      /* the link was lost meanwhile */
	/* 8 and 9 are the HAL's: refused, not known */
	POKEYS_TASK_STARVED = 10, /* the buffer ran dry in the middle of a thread */
	POKEYS_TASK_BEHIND = 11,  /* the spindle left more slots waiting than have room */
};

/* Index of state.slow_millihertz[]: what is polled beside the fast requests. */
enum pokeys_slow_group {
	POKEYS_SLOW_ENCODERS_LOW = 0,
	POKEYS_SLOW_ENCODERS_HIGH = 1,
	POKEYS_SLOW_ANALOG = 2,
	POKEYS_SLOW_COUNTERS = 3,
	POKEYS_SLOW_POEXTBUS = 4,
	POKEYS_SLOW_TICK = 5,
	POKEYS_SLOW_PWM = 6,
	POKEYS_SLOW_LOAD = 7,
	POKEYS_SLOW_CLOCK = 8,
	POKEYS_SLOW_EXTERNAL = 9,
	POKEYS_SLOW_IDENTITY = 10,
	POKEYS_SLOW_PONET = 11,
	POKEYS_SLOW_DEDICATED = 12,   /* dedicated inputs of the pulse engine */
	POKEYS_SLOW_MATRIX = 13,      /* keys beyond the first 8 x 8 */
	POKEYS_SLOW_BACKLASH = 14,    /* what the compensation has added */
	POKEYS_SLOW_POSTEP = 15,      /* status of PoStep drivers */
	POKEYS_SLOW_POSTEP_RARE = 16, /* their currents, modes and versions */
};

struct pokeys_identity {
	uint32_t serial;
	uint32_t address; /* IPv4, host byte order */
	uint8_t hardware; /* hardware id, protocol section 2.3; 0 with serial 0 =
			   * unknown */
	uint8_t firmware_major, firmware_minor, firmware_revision;
	uint8_t user_id;
	uint8_t locked;  /* configuration lock */
	uint8_t load;    /* device's processor load, percent */
	uint8_t options; /* activated options */
	char name[24];   /* NUL terminated */
	char type[24];   /* e.g. "PoKeys57CNC", NUL terminated */
	char build[16];  /* firmware's build date, NUL terminated */
};

/* Capabilities of the device's type (protocol section 2.4). Counts or flags. */
struct pokeys_capability {
	uint8_t pins, pwm, basic_encoders, encoders, fast_encoders, ultra_fast_encoders;
	uint8_t analog_inputs, digital_counters, matrix_keyboard, lcd, matrix_led, poextbus;
	uint8_t ponet, i2c, one_wire, easy_sensors;
	uint8_t pulse_engine; /* its version: 0 = none, 1, 2 */
	uint8_t failsafe;
	uint8_t axes;     /* of the pulse engine, as it reports */
	uint8_t axis_khz; /* highest pulse frequency, kHz */
	uint8_t key_mapping, triggered_key_mapping, key_repeat_delay, joystick;
	uint8_t macros, analog_filtering, init_outputs, connection_signal;
	uint8_t web_interface, additional_options, load_status, custom_name;
	uint8_t sensor_list, potlog27, reserved[6];
	uint32_t pwm_hz; /* PWM counter's clock */
	uint32_t reserved2;
	uint64_t digital_in, digital_out, analog_in, counter, pwm_pins; /* bit = pin index */
};

enum { POKEYS_AXIS_NAME = 16 };

struct pokeys_axis {
	int32_t position;       /* pulses, as the device reports */
	int32_t reference;      /* pulses, last reference the device was sent;
				 * velocity mode: pulses/s */
	uint8_t state;          /* protocol section 3.24.1 */
	uint8_t enabled;        /* configured and driven by us */
	uint8_t mode;           /* enum pokeys_axis_mode in effect */
	uint8_t position_epoch; /* changes when the device starts a new count. Even: the
				 * position is lost (restart, another device, set by
				 * another client). Odd: it is known (set by the
				 * commander's one-shot, or homed by the device) */
	uint8_t limit_minus, limit_plus, home, error; /* switches, evaluated, 1 = tripped */
	uint8_t soft_limit;
	uint8_t in_position; /* at rest at the newest command, which the device had then */
	uint8_t homed;
	uint8_t parked;          /* homed or probed: follows again when its enable has been
				  * low, or its command meets its position */
	int32_t following_error; /* pulses, command - position; 0 unless it is driven by
				  * positions; `delayed` is subtracted */
	int32_t delayed;         /* pulses commanded since the time of the position, for a
				  * driven axis in buffered mode; else, and while it is not
				  * known what the buffer contains, 0 */
	uint8_t reserved[4];
	uint64_t t_reference_ns;            /* when that reference was last sent */
	int64_t probe;                      /* pulses, latched */
	float max_speed;                    /* pulses/s, as configured in the device */
	float max_acceleration;             /* pulses/s^2 */
	int32_t soft_minimum, soft_maximum; /* pulses, likewise; the ends of the range: none */
	double pulses_per_unit;             /* for moves; below 0: the count falls; 0: not given */
	char name[POKEYS_AXIS_NAME];        /* for moves, ends with 0 */
};

struct pokeys_engine {
	uint8_t state;        /* protocol section 3.24.1 */
	uint8_t axes_enabled; /* number */
	uint8_t activated;
	uint8_t limit_override;
	uint8_t emergency; /* 1 = state 101, or the emergency input is active */
	uint8_t charge_pump;
	uint8_t generator;
	uint8_t misc_inputs;
	uint8_t relays, outputs; /* external outputs, as the device has them */
	uint8_t buffer_slots;    /* total, as the device reports */
	uint8_t buffer_level;    /* used, as far as known */
	uint8_t power_states;
	uint8_t probe_status;
	uint8_t slot_time; /* of the motion buffer, 100 us */
	uint8_t emergency_invert;
	uint8_t emergency_pin; /* as on the wire: 0 off, 1 default, else terminal + 10 */
	uint8_t dedicated_limit_minus, dedicated_limit_plus, dedicated_home; /* raw, per axis */
	uint8_t limit_minus, limit_plus, home; /* raw switch bits of the status, per axis */
	uint8_t stops;       /* without a ramp, by limit switches and emergency input, modulo 256 */
	uint8_t task;        /* enum pokeys_task, the one at work or the last one */
	uint8_t task_phase;  /* enum pokeys_task_phase */
	uint8_t task_result; /* enum pokeys_task_result */
	uint8_t task_axes;   /* bit = axis */
	uint32_t task_count; /* tasks that have ended */
	uint32_t buffer_underruns; /* the buffer ran dry while axes were moving */
	uint32_t buffer_resyncs;   /* positions were read back to know what was executed */
	struct pokeys_axis axis[POKEYS_AXES];
};

/* Why a one-shot of threading was not sent; 0 when one is taken. */
enum pokeys_threading_refusal {
	POKEYS_THREADING_WELL = 0,
	POKEYS_THREADING_OFF = 1,          /* the machine is off */
	POKEYS_THREADING_NOT_SET = 2,      /* its settings are not (all) given, or not yet taken */
	POKEYS_THREADING_NO_AXIS = 3,      /* no axis in buffered mode is enabled and takes part */
	POKEYS_THREADING_MOVING = 4,       /* an axis in buffered mode has not come to rest */
	POKEYS_THREADING_BUSY = 5,         /* another task is at work, or threading is already */
	POKEYS_THREADING_NOT_PREPARED = 6, /* to arm */
	POKEYS_THREADING_NOT_BEGUN = 7,    /* there is nothing to release */
	POKEYS_THREADING_BAD_LIMIT = 8,    /* time limit out of range */
};

/* The device's own threading, protocol section 3.24.3, 0x85/35. */
struct pokeys_threading {
	uint8_t preparing, prepared, waiting, active;
	uint8_t ignore_axes;              /* bit = axis that does not take part */
	uint8_t refused;                  /* enum pokeys_threading_refusal, of the last request */
	uint16_t behind;                  /* slots that are made and not yet played */
	int32_t velocity, position_error; /* unit not documented */
	uint32_t spindle_rpm, index_count;
};

/*
 * A PoStep motor driver, protocol section 3.24.3, 0x85/51 to 54. The device asks it when
 * it likes; `updates` counts that. Currents are as the device has them: their unit is
 * not documented.
 */
struct pokeys_postep {
	uint64_t t_update_ns;      /* when updates was last seen to change; 0 = never */
	uint32_t update_count;     /* how often it was */
	uint8_t supply;            /* 0.25 V */
	uint8_t temperature;       /* degrees C */
	uint8_t inputs;            /* 1 bootloader, 2 sleep, 4 step, 8 direction, 16/32 BIN1/2,
				    * 64 end switch */
	uint8_t state;             /* 1 sleep, 2 active, 3 idle, 4 overheated, 5 DC motor */
	uint8_t faults;            /* 1 temperature, 2/4 overcurrent A/B, 8/16 predriver A/B,
				    * 32 undervoltage, 64 stall, 128 stall latched */
	uint8_t updates;           /* as the device counts, wraps at 256 */
	uint8_t mode;              /* 1 external, 2 step, 3 DC motor, 4 position, 5 BINx */
	uint8_t step_mode;         /* 0..8 = full step .. 1/256 */
	uint8_t temperature_limit; /* degrees C */
	uint8_t hardware_major, hardware_minor, firmware_major, firmware_minor;
	uint8_t reserved;
	uint16_t full_scale, idle, overheat; /* currents, raw */
};

struct pokeys_rtc {
	uint16_t year;
	uint8_t month, day, hour, minute, second, day_of_week;
	uint16_t day_of_year;
	uint8_t unnamed; /* the byte the device sends beside, undocumented */
	uint8_t reserved[5];
};

/* One module on PoNET, protocol section 3.13. */
struct pokeys_ponet_module {
	uint8_t type;    /* 0 none, 16 kbd48CNC */
	uint8_t address; /* I2C */
	uint8_t size;    /* bytes of data */
	uint8_t options; /* protocol section 3.13 */
	uint8_t status;  /* 0 data are good */
	uint8_t light;   /* ambient light */
	uint8_t version;
	uint8_t failures; /* exchanges without data in a row, saturating */
	uint8_t data[16]; /* inputs */
};

struct pokeys_link_statistics {
	uint64_t sent, resent, received, accepted;
	/*
	 * Requests without a reply by their deadline: `missed` counts them at once. Of them,
	 * `late` were answered later, and `lost` never; which one is known when the request's
	 * id is used again, up to some hundred requests later, so late + lost <= missed.
	 */
	uint64_t missed, late, lost;
	uint64_t timed_out, stray, duplicate, stale, corrupt, wrong_source, send_failed;
	uint64_t cycles_late; /* fast data did not come in its cycle */
	uint64_t reconnects;
	uint32_t rtt_last_ns, rtt_smoothed_ns, rtt_variation_ns, rtt_min_ns, rtt_max_ns;
	uint32_t deadline_ns;
	uint32_t in_flight;
	uint32_t packet_error_level; /* rises with losses, falls with answers; 0 = well */
	uint64_t refused_command;    /* values in the command image that were refused */
	uint64_t one_shot_refused;
};

/* How the daemon's cycle lies to the commander's reads; of the daemon, the same in each image. */
struct pokeys_phase {
	uint8_t state;  /* enum pokeys_phase_state */
	uint8_t master; /* daemon's index of the device whose commander it
			 * follows, 255 none */
	uint8_t reserved[2];
	uint32_t losses;    /* times the lock was lost */
	int32_t error_ns;   /* last read: how much later than the cycle was laid for */
	uint32_t lead_ns;   /* from the tick to the read it is laid for */
	uint32_t jitter_ns; /* of the reads, mean deviation */
	uint32_t period_ns; /* from this cycle's tick to the next */
};

enum { POKEYS_ONE_SHOT_RESULTS = 16 };

/* enum in result.outcome */
enum pokeys_outcome {
	POKEYS_OUTCOME_NONE = 0,
	POKEYS_OUTCOME_DONE = 1,
	POKEYS_OUTCOME_FAILED = 2,  /* the device refused, or it certainly did not happen */
	POKEYS_OUTCOME_UNKNOWN = 3, /* sent, no answer, could not be read back */
	POKEYS_OUTCOME_REFUSED = 4, /* never sent: invalid, or not permitted now */
};

struct pokeys_one_shot_result {
	uint32_t id;
	uint8_t operation, outcome, reserved[2];
};

struct pokeys_state {
	uint32_t magic;
	uint16_t version, size_units; /* size in units of 8 bytes */
	uint64_t hash;
	uint64_t epoch; /* differs for each start of the daemon */
	uint64_t cycle; /* counts every cycle of the loop */
	uint64_t period_ns;
	uint64_t t_cycle_ns; /* the tick this cycle began at */
	uint64_t t_publish_ns;
	uint64_t t_digital_ns, t_analog_ns, t_encoder_ns, t_motion_ns, t_slow_ns;
	uint64_t t_analog_slow_ns; /* of analog[0] and [1], which no fast reply carries */
	uint64_t stale_after_ns;   /* limit that the stale flag uses */
	uint32_t flags;            /* POKEYS_STATE_* */
	uint8_t link;              /* enum pokeys_link */
	uint8_t fault;             /* enum pokeys_fault, reason of the last one */
	uint8_t access;            /* level of the device's password: 0 all, 255 locked */
	uint8_t failsafe;          /* enum pokeys_failsafe */
	uint64_t t_link_ns;        /* when link last changed */
	uint32_t device_tick_ms, fault_count;
	struct pokeys_identity identity;
	struct pokeys_capability capability;

	/* Bits: pin i = byte i/8, bit i%8. */
	uint8_t digital_in[POKEYS_PIN_BYTES];
	uint8_t digital_out[POKEYS_PIN_BYTES];       /* as last acknowledged by the device */
	uint8_t digital_out_owned[POKEYS_PIN_BYTES]; /* pins that are configured as outputs,
						      * except those of heaters
						      * and servo motors */
	uint8_t pin_function[56];                    /* protocol section 3.2 */
	uint16_t analog[8];                          /* raw 0..4095, [0] = pin 41 */
	int32_t encoder[POKEYS_ENCODERS];            /* counts, wrap at 2^32 */
	uint32_t encoder_enabled;                    /* bit = encoder */
	uint32_t encoder_index;                      /* bit = index seen since armed */
	uint64_t encoder_t_ns[POKEYS_ENCODERS];      /* when that count was sampled */
	uint32_t encoder_resync[POKEYS_ENCODERS];    /* jumps mended by a 32-bit read */
	uint32_t counter[56];                        /* digital counters, [55] unused */
	uint32_t pwm_period, pwm_enabled;
	uint32_t pwm_duty[POKEYS_PWM];
	struct pokeys_engine engine;
	uint8_t matrix[POKEYS_MATRIX_BYTES];
	uint8_t poextbus[16]; /* [0..9], as the device has them */
	uint8_t ponet_state;  /* the bus's: 10 ready, protocol section
			       * 3.13 */
	uint8_t ponet_count;  /* modules found */
	uint8_t kbd48_module; /* which is the kbd48CNC, 255 none */
	uint8_t matrix_enabled;
	uint8_t reserved2[4];
	uint64_t kbd48_keys; /* bit = key pressed, 4 * column + row */
	struct pokeys_ponet_module ponet[POKEYS_PONET];
	uint32_t slow_millihertz[POKEYS_SLOW_GROUPS]; /* measured, enum pokeys_slow_group */
	struct pokeys_rtc rtc;

	/*
	 * Acknowledgement of one-shot commands (command.h). A newer id in the place of one
	 * that was asked for: its outcome was overwritten, unless it is one that goes on by
	 * itself (homing) and still does (engine.task_phase); then it is yet to come.
	 */
	uint32_t one_shot_session, one_shot_ack; /* taken up to here, of this session */
	struct pokeys_one_shot_result one_shot[POKEYS_ONE_SHOT_RESULTS]; /* [id % 16] */
	uint64_t command_heartbeat; /* of the command image in effect */
	uint64_t command_t_ns;
	uint32_t config_generation; /* of the wish (settings.h) in effect */
	uint8_t config_state;       /* enum pokeys_config_state */
	uint8_t encoder_epoch;      /* changes when the device's counters may have begun
				     * again: it was restarted, or it is another one */
	uint8_t reserved3[2];
	uint32_t report_count;   /* settings.h: the report has changed when this has */
	uint32_t config_foreign; /* settings that somebody else has changed, so often */
	struct pokeys_phase phase;

	/* What hangs on the pulse engine besides; asked for only where pokeysd.conf or a
	 * commander has switched it on. */
	uint64_t t_postep_ns;          /* of the status in postep */
	int16_t backlash[POKEYS_AXES]; /* pulses that the compensation has added */
	struct pokeys_threading threading;
	struct pokeys_postep postep[POKEYS_AXES];

	struct pokeys_link_statistics statistics;
	struct pokeys_heater heater[POKEYS_HEATERS];
	struct pokeys_servo servo[POKEYS_SERVOS];
	struct pokeys_moves moves;
};

/*
 * The age of a time stamp of an image at now_ns, in ns. now_ns is CLOCK_MONOTONIC, as are all
 * times of the image; read it after the image. The result is POKEYS_NEVER if nothing has come
 * yet (0), or if the time stamp is in the future: no daemon of this boot wrote that, so it must
 * not count as fresh. Clock readings of two processors may differ a little, so the age is 0 up
 * to POKEYS_AHEAD_MOST_NS ahead. Pure: any thread, realtime safe.
 */
#define POKEYS_NEVER UINT64_MAX
#define POKEYS_AHEAD_MOST_NS UINT64_C(1000000)

static inline uint64_t pokeys_age_ns(uint64_t t_ns, uint64_t now_ns)
{
	if (!t_ns || (t_ns > now_ns && t_ns - now_ns > POKEYS_AHEAD_MOST_NS))
		return POKEYS_NEVER;
	return t_ns > now_ns ? 0 : now_ns - t_ns;
}

/*
 * The age of the data that every cycle brings: inputs and, if the device has axes, positions,
 * whichever is older. POKEYS_NEVER if that is the age of either. Data older than stale_after_ns
 * are stale, whatever the flags say. Pure: any thread, realtime safe. If the image may be
 * written at the same time, copy it first (pokeys_client_read() does).
 */
static inline uint64_t pokeys_state_age_ns(const struct pokeys_state *state, uint64_t now_ns)
{
	uint64_t inputs = pokeys_age_ns(state->t_digital_ns, now_ns), positions;

	if (state->capability.pulse_engine < 2)
		return inputs;
	positions = pokeys_age_ns(state->t_motion_ns, now_ns);
	return positions > inputs ? positions : inputs;
}

/*
 * Histogram of durations: bucket i counts durations d (ns) with
 * pokeys_duration_bucket(d) == i; buckets are 1/4 octave wide from 64 ns up,
 * the first one takes all below, the last one all above (about 4 s).
 */
enum { POKEYS_HISTOGRAM_BUCKETS = 104 };

struct pokeys_histogram {
	uint64_t count, sum_ns, min_ns, max_ns;
	uint64_t bucket[POKEYS_HISTOGRAM_BUCKETS];
};

/* The bucket a duration belongs to; the reverse is pokeys_histogram_lower() of shm.h. */
static inline unsigned int pokeys_duration_bucket(uint64_t ns)
{
	unsigned int top, bucket;

	if (ns < 64)
		return 0;
	top = 63u - (unsigned int)__builtin_clzll(ns);
	bucket = 1 + 4 * (top - 6) + (unsigned int)(ns >> (top - 2) & 3);
	return bucket < POKEYS_HISTOGRAM_BUCKETS ? bucket : POKEYS_HISTOGRAM_BUCKETS - 1;
}

/* The diagnostic image, service pokeys/<name>/diag, about ten times a second. */
struct pokeys_diag {
	uint32_t magic;
	uint16_t version, size_units;
	uint64_t hash;
	uint64_t epoch, cycle, t_publish_ns;
	uint64_t cycles_skipped; /* ticks missed, never caught up */
	uint64_t events_dropped, event_high_water;
	uint64_t transport_system_calls, transport_waits_avoided, transport_rearmed;
	uint64_t transport_no_buffers, transport_overflow, transport_truncated;
	uint64_t minor_faults, major_faults; /* of the realtime thread since it began its loop */
	/* what the XDP guard let in and dropped at the daemon's interface, of everybody's
	 * packets; 0 without POKEYS_STATE_GUARD */
	uint64_t guard_passed, guard_dropped;
	char transport[16];
	struct pokeys_histogram wakeup;          /* tick to running */
	struct pokeys_histogram round_trip;      /* every unambiguous reply */
	struct pokeys_histogram fast_round_trip; /* of the two fast requests */
	/* of the three classes of requests (async.h), all together */
	struct pokeys_histogram read_round_trip, write_round_trip, one_shot_round_trip;
	struct pokeys_histogram receive;     /* kernel's receive stamp to this program */
	struct pokeys_histogram fresh;       /* tick to fast data complete */
	struct pokeys_histogram publish;     /* cost of publishing */
	struct pokeys_histogram cycle_work;  /* tick to end of the cycle's work */
	struct pokeys_histogram age_at_read; /* of the fast data when the commander reads them */
};

#ifdef __cplusplus
}
#endif

#endif /* POKEYS_STATE_H */
