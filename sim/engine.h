/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_ENGINE_H
#define SIM_ENGINE_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/mechanics.h"
#include "sim/planner.h"

/*
 * The pulse engine v2 (protocol sections 3.24 and 5.3): eight axes stepped in
 * slots of 1 ms, homing, probing, jogging, and the ring of the buffered mode.
 */

#define SIM_SLOT_NS 1000000u
#define SIM_RING_SLOTS 128
#define SIM_AXIS_BLOCK 55	/* axis configuration, bytes 8..62 on the wire */
#define SIM_ENGINE_REBOOT_MS 1000
#define SIM_DEFAULT_EMERGENCY_PIN 51	/* pin 52, counted from 0 */

enum sim_engine_state {
	SIM_PE_STOPPED = 0,
	SIM_PE_RUNNING = 3,
	SIM_PE_JOGGING = 10,
	SIM_PE_STOPPING = 11,
	SIM_PE_HOME = 20,
	SIM_PE_HOMING = 21,
	SIM_PE_PROBE_COMPLETE = 30,
	SIM_PE_PROBING = 31,
	SIM_PE_PROBE_ERROR = 32,
	SIM_PE_HYBRID_STOPPING = 40,
	SIM_PE_HYBRID_COMPLETE = 41,
	SIM_PE_STOP_LIMIT = 100,
	SIM_PE_STOP_EMERGENCY = 101,
};

enum sim_axis_state {
	SIM_AX_STOPPED = 0,
	SIM_AX_READY = 1,
	SIM_AX_RUNNING = 2,
	SIM_AX_BUFFER = 5,
	SIM_AX_HOMING_RESETTING = 8,
	SIM_AX_HOMING_BACKING_OFF = 9,
	SIM_AX_HOME = 10,
	SIM_AX_HOMING_START = 11,
	SIM_AX_HOMING_SEARCH = 12,
	SIM_AX_HOMING_BACK = 13,
	SIM_AX_PROBED = 14,
	SIM_AX_PROBE_START = 15,
	SIM_AX_PROBE_SEARCH = 16,
	SIM_AX_LIMIT = 30,
};

/* Axis options, byte 8 of the block. */
#define SIM_AC_ENABLED 0x01
#define SIM_AC_INVERTED 0x02
#define SIM_AC_PLANNER 0x04
#define SIM_AC_POSITION 0x08
#define SIM_AC_INVERTED_HOME 0x10
#define SIM_AC_SOFT_LIMIT 0x20
#define SIM_AC_FAST_OUTPUT 0x40
#define SIM_AC_MASKED 0x80

/* Axis switch options, byte 9 of the block. */
#define SIM_SW_LIMIT_MINUS 0x01
#define SIM_SW_LIMIT_PLUS 0x02
#define SIM_SW_HOME 0x04
#define SIM_SW_HOME_ON_MINUS 0x08
#define SIM_SW_HOME_ON_PLUS 0x10
#define SIM_SW_INVERT_MINUS 0x20
#define SIM_SW_INVERT_PLUS 0x40
#define SIM_SW_INVERT_HOME 0x80

/* Kept in flash. Blocks are held as they came, reserved bytes included. */
struct sim_engine_config {
	uint8_t axes; /* enabled axes, 0x01 @8 */
	uint8_t charge_pump;
	uint8_t generator;
	uint8_t buffer_size;
	uint8_t emergency_invert;
	uint8_t power_states;
	uint8_t emergency_pin; /* 0x06: 0 off, 1 default, else base + pin */
	uint8_t axis[SIM_AXES][SIM_AXIS_BLOCK];
	uint8_t drivers[8]; /* 0x18: step code and current of four */
	uint8_t backlash_enable;
	uint8_t backlash_speed;
	uint8_t backlash[4 * SIM_AXES];
	uint8_t synced_pwm[3]; /* enable, source axis, channel */
	uint8_t synced_out[2]; /* enable, source axis */
	uint8_t synced_pins[8];
	uint8_t postep_enable;
	uint8_t postep_comm[24];
	uint8_t postep_current[48];
	uint8_t postep_mode[48];
	uint8_t smart[SIM_AXIS_BLOCK]; /* 0x90 @8..62 */
	uint8_t thread[13];            /* 0x36 @8..20 */
};

/* An axis block decoded, with the speeds sane. */
struct sim_axis_setup {
	uint8_t options;
	uint8_t switches;
	uint8_t home_pin, minus_pin, plus_pin; /* 1-based, 0 dedicated */
	uint8_t home_percent, return_percent;
	uint8_t mpg_encoder; /* 1-based, 0 none */
	double mpg_ratio;
	struct sim_planner_limits limits;
	int32_t soft_min, soft_max;
	uint8_t enable_pin, enable_invert;
	uint8_t home_on_active, home_on_release; /* algorithm nibbles */
	int32_t back_off;
	uint8_t signals;
};

struct sim_axis {
	struct sim_axis_setup setup;
	struct sim_planner planner;
	int64_t pulses; /* planner.position rounded */
	uint8_t state;
	int32_t reference;
	double speed_ratio; /* of 0x25; 1 after 0x20 */
	int homing_way;     /* +1 or -1 */
	double homing_speed;
	bool homing_was_active;
	bool index_armed;
	bool index_seen;
	int32_t home_offset;
	int32_t target; /* of the back-off or the probe */
	double mpg_target;
	uint32_t mpg_last;
	int back_way;              /* backlash: last direction of motion */
	int32_t back_compensation; /* pulses added by the backlash */
	uint64_t clamped;          /* slots asking for more than the generator gives */
};

struct sim_ring_slot {
	uint16_t magnitude[SIM_AXES];
	uint8_t negative; /* bit = axis */
};

struct sim_ring {
	struct sim_ring_slot slot[SIM_RING_SLOTS];
	unsigned int head;
	unsigned int used;
	bool moving;        /* the last slot taken asked for motion */
	uint64_t underruns; /* ran empty after such a slot */
	uint64_t slots_accepted;
	uint64_t slots_taken;
};

enum sim_thread_state {
	SIM_THREAD_OFF,
	SIM_THREAD_PREPARING,
	SIM_THREAD_PREPARED,
	SIM_THREAD_WAITING,
	SIM_THREAD_ACTIVE,
	SIM_THREAD_RELEASING, /* on its way back to a slot a millisecond */
};

/* Slots played by the spindle's angle (engine_thread.c). */
struct sim_thread {
	uint8_t state; /* enum sim_thread_state */
	bool has_slot; /* now is being played */
	bool first;    /* nothing has been measured since the index */
	uint32_t index_count;
	int64_t base;  /* of the shaft at the index it began at, steps */
	int64_t last;  /* of the shaft, a millisecond ago */
	double turn;   /* of the spindle since then, as it is measured */
	double whole;  /* ... at the index seen last */
	double played; /* slots since then */
	double speed;  /* slots a millisecond */
	double part;   /* of the slot that has been played */
	struct sim_ring_slot now;
	int32_t done[SIM_AXES]; /* pulses of it that have been made */
	uint64_t ignored;       /* slots that asked an ignored axis for motion */
	uint64_t dry;           /* milliseconds without a slot to play */
};

struct sim_engine {
	uint8_t state;
	uint32_t reboot_ms; /* time left of a reboot of the engine */
	uint8_t generator;  /* in effect since the last reboot of the engine */
	uint8_t power_states;
	uint8_t override;
	uint8_t output_mask;
	uint8_t soft_limited;      /* bit = axis */
	uint8_t minus, plus, home; /* evaluated switches, bit = axis */
	uint8_t relays, outputs;   /* external outputs, 0x04 */
	uint8_t home_mask;
	uint8_t probe_mask;
	uint8_t probe_input;
	uint8_t probe_level;
	uint8_t probe_status;
	bool probe_hybrid;
	double probe_speed;
	int32_t probe_position[SIM_AXES];
	struct sim_thread thread;
	uint8_t postep_status[6 * SIM_AXES]; /* 0x51, as fetched last */
	uint8_t postep_version[SIM_AXES][4];
	struct sim_ring ring;
	struct sim_axis axis[SIM_AXES];
};

struct sim_device;

/* Starts the engine from the configuration in RAM (power-up, end of 0x85/0x05). */
void sim_engine_start(struct sim_device *dev);

/* Factory setting of a device of this hardware. */
void sim_engine_defaults(struct sim_engine_config *config, uint8_t hardware);

/* Takes an axis block into use: after 0x11 and at start. */
void sim_axis_load(struct sim_device *dev, unsigned int axis);

/* One slot of 1 ms. */
void sim_engine_slot(struct sim_device *dev);

/* Axes the present generator drives, and its highest pulse rate in kHz. */
unsigned int sim_engine_axes_supported(const struct sim_device *dev);
unsigned int sim_engine_kilohertz(const struct sim_device *dev);

/* The axis is enabled and within the number of axes in use. */
bool sim_axis_usable(const struct sim_device *dev, unsigned int axis);

/*
 * The driver of the axis is switched on: in every state in which the engine
 * works, in the stopped ones by the power mask (0x01 @13), and for axes with
 * a masked enable only while their bit of 0x02 @5 is set.
 */
bool sim_axis_powered(const struct sim_device *dev, unsigned int axis);

/* Level an axis' enable output drives onto a pin (0-based), -1 if it is none of them. */
int sim_engine_enable_pin(const struct sim_device *dev, unsigned int pin);

/* Position as reported: wraps as the device's 32-bit counter does. */
static inline int32_t sim_axis_position(const struct sim_axis *axis)
{
	return (int32_t)(uint32_t)axis->pulses;
}

/* Brings minus, plus and home up to date; a stopped engine does not do so by itself. */
void sim_engine_read_switches(struct sim_device *dev);

/* Emergency input active now, whatever the state of the engine. */
bool sim_engine_emergency(const struct sim_device *dev);

#endif
