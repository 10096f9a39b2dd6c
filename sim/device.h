/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_DEVICE_H
#define SIM_DEVICE_H

/*
 * A PoKeys device, as bytes in and bytes out (protocol sections 1 to 3 and 5).
 *
 * Pure: no clock, no socket, no allocation, no global. The time is handed in
 * and may be virtual; it must not go back. One device per struct, of which
 * any number may exist; a struct is used by one thread at a time. The struct
 * is large (about 40 KB): make it static or embed it.
 *
 * The simulator reads and writes the bytes of every command by the sheet
 * itself and not through wire's encoders. With those, a field wire has put in
 * the wrong place would be wrong on both ends and no test would ever see it.
 */

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "sim/analog.h"
#include "sim/bus.h"
#include "sim/encoder.h"
#include "sim/engine.h"
#include "sim/identity.h"
#include "sim/mechanics.h"
#include "sim/oven.h"
#include "sim/servo.h"
#include "sim/panel.h"
#include "sim/pins.h"
#include "sim/postep.h"
#include "wire/model.h"
#include "wire/packet.h"

#define SIM_MULTI (8 * WIRE_PK)	/* the multi-part buffer fill in one datagram */
#define SIM_LOG_ENTRIES 27

/* What the sources leave open (protocol section 8). Zero is the default. */
struct sim_choices {
	bool drop_unknown;      /* no reply to an unknown operation, instead of an empty one */
	bool enforce_security;  /* locked (0xE1 level > 0): only reads are answered */
	bool echo_synced;       /* 0x0A and 0x0B do not tell: a read is answered by itself */
	bool count_free;        /* status @58 counts free slots, not all (section 8) */
	uint8_t axis_khz;       /* status @57; 0 is what the generator makes, 125 or 25 */
	uint8_t emergency_base; /* 0x06 holds base + 1-based pin; 0 is taken as 10 */
};

struct sim_device_options {
	uint8_t hardware;          /* enum wire_hardware; 0 is taken as WIRE_HW_57CNC */
	uint32_t serial;           /* 0 is taken as 65432 */
	uint8_t firmware_major;    /* coded, 0x37 = 4.7; 0 is taken as 0x37 */
	uint8_t firmware_revision; /* both 0 are taken as 4.7.15 */
	uint8_t user_id;
	const char *name;     /* NULL: "SimPoKeys" and the model; copied */
	uint8_t ip[4];        /* own address; 0.0.0.0 is taken as 127.0.0.1 */
	int64_t clock_s;      /* calendar time at start, seconds since 1970 UTC */
	unsigned int boot_ms; /* dead time after a reboot */
	struct sim_choices choices;
};

/* Why a packet was not answered. */
enum sim_drop {
	SIM_DROP_LENGTH,
	SIM_DROP_HEADER,
	SIM_DROP_CHECKSUM,
	SIM_DROP_UNKNOWN, /* only with choices.drop_unknown */
	SIM_DROP_REFUSED, /* locked by password */
	SIM_DROP_BOOTING,
	SIM_DROP_SILENT, /* the operation has no reply */
	SIM_DROPS,
};

struct sim_device_stats {
	uint64_t requests; /* executed, the parts of a multi-part fill as one */
	uint64_t replies;
	uint64_t unknown; /* operations the device does not have */
	uint64_t dropped[SIM_DROPS];
	uint64_t executed[256];    /* by operation (byte 1) */
	uint64_t executed_pe[256]; /* pulse engine, by sub-command (byte 2) */
	uint64_t saves;
	uint64_t reboots;
	uint64_t failsafes;
	uint64_t slots; /* milliseconds lived through */
};

struct sim_pwm_config {
	uint8_t enabled;
	uint32_t duty[6];
	uint32_t period;
};

struct sim_failsafe_config {
	uint8_t timeout; /* x100 ms, 0 off */
	uint8_t peripherals;
	uint8_t outputs[7];
	uint8_t poext[SIM_POEXT_BYTES];
	uint8_t pwm[6]; /* percent */
};

struct sim_clock_config {
	uint8_t rule; /* daylight saving rule */
	int8_t offset;
};

/* Plain stores which a command writes and the matching one reads, without any effect here. */
struct sim_store_config {
	uint8_t key_map[3][SIM_PINS];       /* 0xC1..0xC3 */
	uint8_t key_triggered[4][SIM_PINS]; /* 0xD7 1..4 */
	uint8_t encoder_keys[2][50];        /* 0xC6, 0xC7 */
	uint8_t typematic[2][SIM_PINS];     /* 0x21, 0x22 */
	uint8_t servo_setup[SIM_PINS];      /* 0x4A 0x00/0x01 */
	uint8_t servo_channel[8][SIM_PINS]; /* 0x4A 0x10/0x11 */
	uint8_t decoder[2];                 /* 0x09 */
	uint32_t oem[62];                   /* 0xFD */
	uint64_t oem_set;
};

/* Everything 0x50 saves. */
struct sim_config {
	struct sim_identity_config identity;
	struct sim_network_config network;
	struct sim_security_config security;
	struct sim_pins_config pins;
	struct sim_encoders_config encoders;
	uint32_t analog_filter;
	struct sim_pwm_config pwm;
	struct sim_engine_config engine;
	struct sim_panel_config panel;
	struct sim_bus_config bus;
	struct sim_failsafe_config failsafe;
	struct sim_clock_config clock;
	struct sim_store_config store;
};

/* The world around the device: survives its reboots. */
struct sim_bench {
	struct sim_pins_bench pins;
	struct sim_machine machine;
	struct sim_shaft shaft[SIM_ENCODERS];
	struct sim_source analog[SIM_ANALOGS];
	struct sim_oven oven[SIM_ANALOGS];
	struct sim_servo servo[SIM_ENCODERS];
	bool servo_switches;         /* some of them have one, sim_servos_rewired() */
	uint64_t blinking;           /* pins which toggle by themselves, sim_bench_blink() */
	uint32_t blink_ms[SIM_PINS]; /* and their half periods */
	struct sim_bus_bench bus;
	struct sim_postep postep[SIM_AXES];
	uint8_t keys[SIM_KEYS / 8]; /* matrix keyboard, key k = byte k / 8 bit k % 8 */
	uint8_t load_percent;
};

/* One simple pulse generator, 0x4C. */
struct sim_blip {
	uint16_t period; /* 0.1 ms */
	uint16_t left;   /* pulses still to make */
	uint8_t duty;
	uint64_t end_ns;
};

/* Lost at a reboot. */
struct sim_runtime {
	uint64_t boot_ns; /* when the device began to answer */
	uint64_t dead_until_ns;
	uint64_t heard_ns; /* last valid packet, for the failsafe */
	bool failsafe_applied;
	uint8_t security_level;
	uint8_t seed[32];
	uint8_t session[10];
	int64_t clock_s; /* calendar time at clock_ns */
	uint64_t clock_ns;
	uint8_t log_count;
	uint16_t log[SIM_LOG_ENTRIES];
	uint16_t poil_state;
	uint16_t poil_breakpoint;
	uint8_t poil_debug;
	uint8_t poil_enabled;
	uint8_t poil_memory[6][256];
	uint8_t servo_position[SIM_PINS];
	uint8_t fill_parts; /* parts of a multi-part fill which have come */
	uint8_t fill[SIM_MULTI];
	struct sim_blip blip[SIM_PINS];
	uint32_t pwm_begun; /* how often a write has begun the period of PWM again */
	uint64_t pwm_begun_ns;
	uint32_t pwm_pulse[6]; /* the duty of before goes on until pwm_until_ns */
	uint64_t pwm_until_ns[6];
};

struct sim_device {
	struct sim_device_options options;
	uint64_t now_ns;  /* of the last call */
	uint64_t slot_ns; /* when the next millisecond slot is due */
	bool started;
	bool dirty;               /* levels may have changed: settle the pins */
	struct sim_config config; /* in RAM */
	struct sim_config flash;
	struct sim_config factory;
	struct sim_pins pins;
	struct sim_encoders encoders;
	struct sim_analog analog;
	struct sim_engine engine;
	struct sim_panel panel;
	struct sim_bus bus;
	struct sim_runtime run;
	struct sim_bench bench;
	struct sim_device_stats stats;
};

/*
 * A device in factory state, switched on; NULL options are all defaults. Its
 * time begins with the first call that brings one. options->name is not kept.
 */
void sim_device_init(struct sim_device *dev, const struct sim_device_options *options);

/*
 * Takes one datagram (or one frame of a stream) and answers into reply.
 * Returns 64, or 0 when there is no reply; stats.dropped tells why. 512 bytes
 * are a multi-part fill with one reply, which carries the id of its last part
 * (section 1.6). Runs the device up to now_ns first.
 */
size_t sim_device_request(struct sim_device *dev, uint64_t now_ns, const uint8_t *req, size_t len,
			  uint8_t reply[WIRE_PK]);

/* Runs the device up to now_ns: engine slots, filters, clock, failsafe. */
void sim_device_advance(struct sim_device *dev, uint64_t now_ns);

/*
 * Answers a search (an empty datagram, section 1.9) from a host: returns the
 * length of the reply, 19 or 14, or 0 when the device has searching switched
 * off or is booting.
 */
size_t sim_device_discovery(struct sim_device *dev, uint64_t now_ns, const uint8_t asker[4],
			    uint8_t reply[SIM_DISCOVERY_MAX]);

/*
 * Power off and on at now_ns. The configuration comes back from flash, or is
 * the factory's when lose_config is set. Dead for options.boot_ms.
 */
void sim_device_reboot(struct sim_device *dev, uint64_t now_ns, bool lose_config);

/* A connection was opened: the security level falls back to its default. */
void sim_device_connected(struct sim_device *dev);

/* Saves the configuration in RAM to flash, as 0x50 does. */
void sim_device_save(struct sim_device *dev);

/* Appends to the system log (0x84); the oldest entry goes when it is full. */
void sim_device_log(struct sim_device *dev, uint16_t entry);

/* Milliseconds since the device was switched on. */
uint32_t sim_device_tick(const struct sim_device *dev);

/* The duty of a PWM output in this period, ticks; a new one counts from the next period. */
uint32_t sim_pwm_duty(const struct sim_device *dev, unsigned int channel);

/* "57CNC" and so on; NULL for an id the simulator cannot be. */
const char *sim_hardware_name(uint8_t hardware);

/* The id of such a name; 0 when there is none. SIM_HARDWARE_NAMES lists them for a message. */
uint8_t sim_hardware_find(const char *name);
#define SIM_HARDWARE_NAMES "57CNC, 57E, 57U, 57CNCpro4x25, 57CNCdb25, 56E"

/* Short name of a drop reason, for statistics. */
const char *sim_drop_name(enum sim_drop drop);

#endif
