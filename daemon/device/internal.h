/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the files of this room share: one struct for each behaviour, and the
 * functions by which they call each other. Everything here belongs to the
 * realtime thread.
 *
 * One rule keeps the order simple: what a reply says is stored when it comes,
 * what follows from it is done in the next device_cycle(). So no request is
 * cancelled, and no state left, from inside a parser.
 */
#ifndef DEVICE_INTERNAL_H
#define DEVICE_INTERNAL_H

#include "daemon/device/buffer.h"
#include "daemon/device/device.h"
#include "daemon/device/encoder.h"
#include "daemon/device/histogram.h"
#include "daemon/device/life.h"
#include "daemon/device/loops.h"
#include "daemon/device/moving.h"
#include "daemon/device/operation.h"
#include "daemon/device/output.h"
#include "daemon/device/pipeline.h"
#include "daemon/device/place.h"
#include "daemon/device/plan.h"
#include "daemon/device/restart.h"
#include "daemon/device/setting.h"
#include "daemon/device/shared.h"
#include "daemon/device/task.h"
#include "daemon/device/threading.h"
#include "wire/bus.h"
#include "wire/encoder.h"
#include "wire/io.h"
#include "wire/model.h"
#include "wire/panel.h"
#include "wire/pulse.h"
#include "wire/system.h"

#define MS UINT64_C(1000000)
#define SECOND (1000 * MS)

enum {
	BUDGET = 3,        /* requests a cycle, and one more for motion */
	ENCODER_BANKS = 2, /* 0xCD: 0..12 and 13..25 */
};

#define MOTION_POSITION_MAX (INT32_C(1) << 24)	/* the planner's, protocol section 3.24.1 */
#define OUTPUT_PINS ((UINT64_C(1) << POKEYS_PINS) - 1)

/* identify.c */
enum identify_step {
	IDENTIFY_DATA,
	IDENTIFY_TICK,
	IDENTIFY_NAME,
	IDENTIFY_USER,
	IDENTIFY_OPTIONS,
	IDENTIFY_STEPS
};

struct identify {
	struct {
		bool open, done;
		uint8_t failures;
	} step[IDENTIFY_STEPS];
	struct wire_identity identity;
	bool alive_open, alive_tick; /* the request that tells whether it still lives */
	uint64_t alive_ns;
};

/* access.c */
enum access_phase {
	ACCESS_ASK,    /* is it locked, and what is the seed? */
	ACCESS_ANSWER, /* the hash is to be sent */
	ACCESS_OPEN,
	ACCESS_SHUT, /* until again_ns */
};

struct access {
	uint8_t phase; /* enum access_phase */
	uint8_t failures, tries;
	uint8_t level; /* as the newest answer said */
	uint8_t alike; /* so many in a row said it, up to 3 */
	bool refused;  /* our password, at least once */
	bool open;     /* a request is under way */
	bool said;
	uint64_t again_ns;
	uint8_t seed[32];
};

/* intake.c */
struct intake {
	uint32_t session; /* 0 = none seen */
	uint64_t heartbeat;
	uint64_t seen_ns;     /* when it last changed; 0 = never */
	uint64_t t_ns;        /* of the image */
	uint64_t read_age_ns; /* of the commander's reading then; POKEYS_NEVER = none */
	bool read_recently;   /* young enough to begin a motion by */
	bool fresh;
	bool ended; /* it has said that it ends */
	bool machine_on, limit_override, emergency;
	uint64_t outputs, outputs_mask;
	struct axis_wish axis[POKEYS_AXES];
	struct output_wish output;
	struct heating_wish heating;
	struct servoing_wish servoing[POKEYS_SERVOS];
	bool bad;
	uint64_t refused;
	uint64_t said_ns[COMMAND_FAULTS];
};

/* safe.c */
struct safe {
	bool wanted; /* the commander is gone, or the daemon ends */
	bool stopping;
	bool ran; /* the link, when the stop began */
	uint64_t stopping_ns;
	uint64_t started_ns;        /* first cycle, 0 = none yet */
	uint64_t commanded;         /* outputs that a commander ever drove */
	uint64_t acked, acked_mask; /* outputs as the device has acknowledged them */
	bool edge_armed;            /* machine-on was seen low while all was well */
	bool edge_unread;           /* the last edge was refused, for old positions */
	bool permitted;             /* motion */
	bool reached;
	bool lost;     /* something was, since motion was permitted last */
	bool stopped;  /* the commander's emergency stop was, likewise */
	bool switched; /* this session has commanded machine-on */
	bool held_said, emergency_said;
};

/* motion.c, reference.c */
enum motion_phase {
	MOTION_OFF,  /* the engine stands, or is to stand */
	MOTION_HOLD, /* telling it where it is, before it may run */
	MOTION_START,
	MOTION_ON,
	MOTION_TASK, /* it homes or probes by itself */
};

struct references {
	uint8_t mask;
	int32_t position[POKEYS_AXES];
	uint16_t velocity[POKEYS_AXES];
};

struct motion {
	uint8_t phase;            /* enum motion_phase */
	bool run_open, stop_open; /* engine state requests under way */
	bool stop_wanted;         /* until the engine is seen to stand */
	bool verify;              /* a status asked after the last of them must come first */
	bool override_sent;
	uint64_t state_ended_ns;
	uint64_t run_after_ns; /* not to be started again before */
	uint8_t driven;        /* bit = axis follows the command */
	uint8_t releasing;     /* was driven, is being told to hold */
	uint8_t mask_sent;     /* output enables as last told */
	uint8_t mask_stopped;  /* ... with a stop */
	int32_t hold[POKEYS_AXES];
	uint64_t reference_sent;  /* serial of the newest one */
	uint64_t reference_taken; /* ... that was answered */
	uint64_t reference_mixed; /* ... that was sent again with other values than first */
	uint64_t reference_clear; /* from this one on, answers acknowledge */
	bool answered;            /* the newest one was, and older ones are awaited */
	bool known;               /* acked is what the device has */
	uint64_t reference_ns;    /* when it was last sent */
	uint8_t settled;          /* bit = axis of which the device has the newest reference */
	uint64_t settled_ns[POKEYS_AXES]; /* since when */
	uint64_t status_ns;               /* when the status of the positions was asked for */
	struct references sent, acked;
};

/* one_shot.c, operation.c */
enum one_shot_phase {
	ONE_SHOT_IDLE,
	ONE_SHOT_NEXT, /* `step` is to be sent */
	ONE_SHOT_OPEN, /* sent, not answered */
};

struct one_shots {
	uint32_t tail;              /* next id to take */
	uint8_t phase;              /* enum one_shot_phase */
	uint8_t step;               /* of the operation */
	bool acted;                 /* a request that changes something was sent */
	uint8_t unread;             /* so many times reading back was not answered */
	uint64_t serial;            /* the mailbox's, of the request that is awaited */
	struct pokeys_one_shot now; /* the one at work */
	int32_t before[WIRE_ENCODER_BANK];
	uint32_t armed; /* bit = encoder that waits for its index */
	bool disarm;    /* fast encoders' index inputs are to be switched back */
	bool disarm_open;
	uint64_t refused;
	uint64_t saved_ns; /* flash was written, or may have been; 0 = never */
	uint8_t order;     /* operation that waits for its turn; 0 = none */
	bool ordered;      /* the one at work came from a terminal */
};

/* meter.c */
struct meter {
	struct pokeys_statistics before; /* at the last look */
	uint64_t said_ns[EVENT_PACKETS_KINDS];
	uint64_t said_count[EVENT_PACKETS_KINDS];
	uint64_t cycles_late, reconnects;
	uint64_t overtaken; /* replies, by those to newer requests */
	uint64_t odd;       /* answers that those before and after them contradict */
	uint32_t level;
	bool stale, stale_said;
	uint64_t stale_said_ns;
	struct pokeys_histogram round_trip, fast_round_trip, class_round_trip[3];
	struct pokeys_histogram receive, fresh, age_at_read;
};

/* request.c: how many events of a kind in this second. */
struct talk {
	uint64_t since_ns;
	uint32_t count;
};

struct device {
	pokeys_device_t mailbox; /* first: parsers find the device by it */
	struct device_config config;
	struct event_ring *events;
	struct pokeys_io io; /* the mailbox' way out, see device.c */
	struct talk talk[EVENT_CODES];
	uint64_t now_ns; /* of the call we are in */
	uint64_t cycle, tick_ns;
	uint64_t cycle_ns;   /* now_ns of the last cycle */
	unsigned int budget; /* requests that may still be sent in this cycle */
	struct life life;
	struct identify identify;
	struct restart restart;
	struct access access;
	struct configure configure;
	struct wishes wishes;
	struct shared shared;
	struct plan plan;
	struct fast fast;
	struct pipeline pipeline;
	struct intake intake;
	struct safe safe;
	struct heatings heatings;
	struct servoings servoings;
	struct moving moving;
	struct outputs outputs;
	struct ponet ponet;
	struct motion motion;
	struct place place;
	struct task task;
	struct threading threading;
	struct buffer buffer;
	struct one_shots one_shots;
	struct meter meter;
	struct encoder encoder[POKEYS_ENCODERS];
	struct pokeys_state image;
};

static inline struct device *device_of(pokeys_device_t *mailbox)
{
	return (struct device *)mailbox;
}

static inline bool running(const struct device *device)
{
	return device->image.link == POKEYS_LINK_RUNNING;
}

/* Engine states that only a commander's clear ends. */
static inline bool engine_tripped(uint8_t state)
{
	return state == WIRE_ENGINE_STOP_LIMIT || state == WIRE_ENGINE_STOP_EMERGENCY;
}

/* The reply was good; otherwise entry->state says what became of the request. */
static inline bool answered(const mailbox_entry_t *entry)
{
	return entry->state == POKEYS_REQUEST_DONE;
}

/* 55 pins as bytes in the images, and as one number here. */
static inline uint64_t pins_load(const uint8_t bytes[POKEYS_PIN_BYTES])
{
	return wire_get_u56(bytes) | (uint64_t)bytes[7] << 56;
}

static inline void pins_store(uint8_t bytes[POKEYS_PIN_BYTES], uint64_t pins)
{
	wire_put_u56(bytes, pins);
	bytes[7] = (uint8_t)(pins >> 56);
}

/* request.c */

/*
 * Encode, create and send within this cycle's budget. False: not now (budget,
 * window or ids are used up); nothing was sent and the caller tries again in
 * the next cycle. deadline_ns 0 = as measured; otherwise the answer may take
 * so long (one-shots that take the device's time).
 */
bool request_send(struct device *device, enum wire_op op, const void *value, pokeys_parser_t parser,
		  pokeys_refresh_t refresh, void *context);
/* ... into the last places, which are kept for what may switch a heater or a motor off. */
bool request_send_first(struct device *device, enum wire_op op, const void *value,
			pokeys_parser_t parser, pokeys_refresh_t refresh, void *context);
/* ... which a newer one will replace, so that it is not repeated; 0xCC into the last places. */
bool request_send_once(struct device *device, enum wire_op op, const void *value,
		       pokeys_parser_t parser, pokeys_refresh_t refresh, void *context);
bool request_send_patiently(struct device *device, enum wire_op op, const void *value,
			    pokeys_parser_t parser, uint64_t deadline_ns);

/*
 * The open request of this parser and context: send it again in this cycle, as the newest values
 * cannot wait for its answer; or end it. False: there is none, or not now.
 */
bool request_again(struct device *device, pokeys_parser_t parser, const void *context);
bool request_cancel(struct device *device, pokeys_parser_t parser, const void *context);
/* There is one, of which the transport has taken no packet yet. */
bool request_unsent(const struct device *device, pokeys_parser_t parser, const void *context);

/* An event of this device; too many of a kind in a second are dropped. */
void device_say(struct device *device, enum event_code code, enum event_level level, int64_t a,
		int64_t b, int64_t c);

/* identify.c */
void identify_begin(struct device *device);
void identify_cycle(struct device *device);
/* Its device data as one more answer says it: may it be taken? Once for each answer. */
bool identify_believed(struct device *device, const uint8_t reply[WIRE_PK]);
/* Take a device for ours, or say why not. */
enum pokeys_fault identify_take(struct device *device, const uint8_t reply[WIRE_PK]);
/* Now and then: does it live, is it the same one, the same start, is it locked? */
void identify_alive(struct device *device);

/* watch.c: once the link runs and nothing else is to be done to settings */
void watch_turn(struct device *device);
/*
 * It was read in its turn, and says this: false = not to be believed yet, and nothing has
 * changed.
 */
bool watch_believes(struct device *device, struct setting *setting, const union setting_value *now);
/* It was read in its turn and differs so from what is wanted: true if all is as before. */
bool watch_settled(struct device *device, struct setting *setting, uint64_t differs);
void watch_unanswered(struct setting *setting);

/* access.c: true when the device lets us in */
bool access_cycle(struct device *device);
void access_begin(struct device *device);

/* configure.c */
void configure_begin(struct device *device);
void configure_cycle(struct device *device);
/* Something else is wanted now: look at all settings that differ again; all: at each. */
void configure_again(struct device *device, bool all);
/* While the link runs: the next request for a setting, if one is due; true if one was sent. */
bool configure_send(struct device *device);
/* A setting is being written just now: nothing may begin to move. */
bool configure_writing(const struct device *device);
enum pokeys_config_state configure_state(const struct device *device);

/* apply.c: a setting is one of device->configure.setting[]. */
unsigned int setting_number(const struct device *device, const struct setting *setting);
/* Nothing moves, nor may it. */
bool setting_may_write(const struct device *device);
/* These three: false = not now. */
bool setting_read(struct device *device, struct setting *setting);
bool setting_write(struct device *device, struct setting *setting);
bool setting_reboot(struct device *device, struct setting *setting);
bool setting_effect(struct device *device, struct setting *setting);
/* It is wanted, and this device or firmware does not have it: say so, once. */
void setting_missing(struct device *device, struct setting *setting);
/* `differs`: which of it, 0 = the device did not answer. */
void setting_refuse(struct device *device, struct setting *setting, uint64_t differs);
/* Somebody else has written these bits of it. Returns how many. */
uint32_t setting_say_foreign(struct device *device, const struct setting *setting,
			     uint64_t foreign);
/* pokeysd.conf wants something else than the device has, or does not say. */
bool setting_blocks(const struct device *device, const struct setting *setting);

/* setting_sync.c: the PWM channel that follows an axis, -1 = none does */
int setting_synced_channel(const struct device *device);
/* Bits of the encoders that count in another way by this setting than before. */
uint32_t setting_encoders_changed(const struct device *device, unsigned int number,
				  const union setting_value *before,
				  const union setting_value *now);

/* setting_backlash.c: as a slow group */
bool backlash_has(const struct device *device);
enum wire_op backlash_ask(struct device *device, union slow_request *request);
void backlash_take(struct device *device, const mailbox_entry_t *entry);

/* setting_postep_modes.c: the drivers' own modes came beside; one that lost its power forgets */
void postep_look_again(struct device *device, const struct wire_postep_modes_req *modes);
/* Every driver has the step mode that is wanted of it; says which has not. At machine-on. */
bool postep_permits(struct device *device);

/* postep.c: into the image, and as slow groups */
void postep_forget(struct device *device);
void postep_status(struct device *device, const mailbox_entry_t *entry);
void postep_modes(struct device *device, const struct wire_postep_modes_req *modes);
bool postep_has(const struct device *device);
enum wire_op postep_ask(struct device *device, union slow_request *request);
enum wire_op postep_ask_rare(struct device *device, union slow_request *request);
void postep_take_rare(struct device *device, const mailbox_entry_t *entry);

/* setting_system.c */
enum pokeys_failsafe failsafe_state(const struct device *device);
/* What the device has; NULL = it has not been read. */
const struct wire_failsafe_req *failsafe_known(const struct device *device);

/* wish.c */
void device_wish_init(struct device *device);
/* The device is known now. */
void wish_begin(struct device *device);
/* Another commander: what the one before wished does not count any more. */
void wish_session(struct device *device, uint32_t session);
/* The device's own settings, to be reported. */
struct pokeys_settings *wish_known(struct device *device);
void wish_refuse(struct device *device, enum pokeys_setting setting, uint8_t index);
/* The device has it now. */
void wish_settled(struct device *device, enum pokeys_setting setting);

/* plan.c */
void plan_begin(struct device *device);
/* In each cycle of a running device: what is urgent; then the rest. */
void plan_cycle(struct device *device);
void plan_spare(struct device *device);
/* The link cannot run: bring outputs and axes into the safe state all the same. */
void plan_blocked(struct device *device);
/* How long so many fast answers take, as a rule. */
uint64_t plan_answers_ns(const struct device *device, unsigned int count);
/* Is it still the same start of the same device? Asks at once; only questions until then. */
void plan_doubt(struct device *device);
bool plan_doubts(const struct device *device);
/* It is: so its clock says, and its identity. */
void plan_tick_right(struct device *device);
void plan_identity_right(struct device *device);
/* A reply to 0xCC has come. */
void plan_heard(struct device *device);
/* Requests of it are awaited. */
bool plan_busy(const struct device *device);

/* fast.c */
void fast_begin(struct device *device);
/* As far as one more may be under way. */
void fast_send_io(struct device *device);
void fast_send_status(struct device *device);
/* How many 0xCC are under way. */
unsigned int fast_io_open(const struct device *device);
/* From this tick on, until both replies are in. */
void fast_measure(struct device *device);
/* A heater or a motor is to be off, and no request says so. */
bool fast_hides_off(const struct device *device);
/* No request that is under way says anything else of these pins. */
bool fast_pins_settled(const struct device *device, uint64_t pins, uint64_t on);
/* Of these, only replies to requests that are made from now on say something. */
void fast_doubt(struct device *device, uint64_t pins);
/* How many are under way, also those whose replies are late. */
unsigned int fast_open(const struct device *device);

/* slow.c */
void slow_begin(struct device *device);
/* Whether a group has waited so long that it takes the place of another request. */
bool slow_overdue(const struct device *device);
bool slow_send(struct device *device);
/* One more of those that all go in one cycle (slow_together); false: there is none. */
bool slow_send_together(struct device *device);
/* This bank of encoders is to be read at once. */
void slow_encoders_now(struct device *device, unsigned int bank);
void slow_identity_now(struct device *device);
/* Which pins count has changed. */
void slow_counters(struct device *device);
/* Now and then: how often each group was answered. */
void slow_rates(struct device *device);
extern const struct slow_kind slow_groups[SLOW_GROUPS];

/* ponet.c: as a slow group */
void ponet_begin(struct device *device);
bool ponet_has(const struct device *device);
enum wire_op ponet_ask(struct device *device, union slow_request *request);
void ponet_take(struct device *device, const mailbox_entry_t *entry);
void ponet_unanswered(struct device *device);

/* decode.c */
void decode_io(struct device *device, const mailbox_entry_t *entry);
/* These two: false = its positions cannot be, and are not taken. */
bool decode_status(struct device *device, const mailbox_entry_t *entry);
bool decode_engine(struct device *device, const struct wire_pulse_status_rep *status,
		   uint64_t asked_ns, uint64_t came_ns);
void decode_encoders(struct device *device, unsigned int bank, const mailbox_entry_t *entry);
void decode_encoders_forget(struct device *device);
/* Its counters may have begun again: the next counts are of another epoch. */
void decode_encoders_anew(struct device *device);
void decode_pwm(struct device *device, const struct wire_pwm_rep *pwm);
/* Nothing is known of the device yet. */
void decode_init(struct device *device);
void decode_axis_setup(struct device *device, unsigned int axis,
		       const struct wire_axis_config *config);

/* intake.c */
void intake_cycle(struct device *device, const struct pokeys_command *command, int refused);
/* No commander until the next heartbeat. */
void intake_forget(struct device *device);
/* intake_output.c */
void intake_outputs(struct device *device, const struct pokeys_command *command);
void intake_refuse(struct device *device, enum command_fault fault, int64_t index);
/* Pulses that an axis in this mode can be commanded, to either side. */
int32_t intake_furthest(uint8_t mode);
/* Further out than the soft limits and than `from`, in pulses: back in is always allowed. */
bool intake_beyond_soft_limits(const struct device *device, unsigned int axis, double from,
			       double to);

/* safe.c */
void safe_begin(struct device *device);
void safe_cycle(struct device *device);
void safe_permit_drop(struct device *device);
/* The device, its commander, or this machine's time: outputs are held until an edge. */
void safe_lost(struct device *device);
/* A commander of which the first image is here. */
void safe_session(struct device *device, bool machine_on, bool resumed);
/* The commander's emergency stop, or the button at a pulse engine that is set up. */
bool safe_emergency(const struct device *device);
/* Whether the commander's outputs are kept from the device after a loss. */
bool safe_holds(const struct device *device);
/* Whether these (DEVICE_RESUME_*) are to be in the safe state. */
bool safe_part(const struct device *device, unsigned int part);
/* Outputs that are to be written now, and their values; mask 0 = none. */
void safe_outputs(const struct device *device, uint64_t *outputs, uint64_t *mask);
void safe_outputs_acked(struct device *device, uint64_t outputs, uint64_t mask);
/*
 * The device has acknowledged what is on these pins, and nothing else is under way to them: with
 * two versions nobody knows which is executed last.
 */
bool safe_pins_settled(const struct device *device, uint64_t pins, uint64_t on);

/* motion.c */
void motion_begin(struct device *device);
/* Decide anew what is wanted, from command, permission and status. */
void motion_update(struct device *device);
/* An engine state request, if one is due; true if one was sent. */
bool motion_send_state(struct device *device);
/* A status came, to a request of asked_ns. */
void motion_status(struct device *device, uint64_t asked_ns);
/* Positions were set: what is known of them may be older. */
void motion_displaced(struct device *device);
/* The engine does not move an axis. */
bool motion_standing(const struct device *device);
/* Of these axes, those whose outputs have to be enabled one by one (ENABLED_MASKED). */
uint8_t motion_masked(const struct device *device, uint8_t axes);
/* Axes that can be driven, each in the mode that the device has it set up for. */
bool motion_drivable(const struct device *device, unsigned int axis);

/* reference.c */
/* References go out with a mask (0x25), so axes that are not told are not touched. */
bool reference_by_mask(const struct device *device);
/* After a new position: by how much its reference is to lead it. */
void reference_lead(const struct device *device, unsigned int axis, struct axis_wish *wish);
/* The reference: the position, and what it leads by, within what is permitted; pulses. */
int32_t reference_ahead(const struct device *device, unsigned int axis,
			const struct axis_wish *wish);
/* Some axis takes references at all. */
bool reference_any(const struct device *device);
/* It stands where it is to be, also by what is commanded now. Not of one in buffered mode. */
bool reference_met(const struct device *device, unsigned int axis);
bool reference_due(const struct device *device);
bool reference_send(struct device *device);
/* How many are under way, also those whose replies are late. */
unsigned int reference_under_way(const struct device *device);
/* Axes that are let go, and whose last reference is where they are, need no other one. */
void reference_release(struct device *device);
/* What was acknowledged is not what the device has. */
void reference_forget(struct device *device);

/* one_shot.c */

/* Another commander: what it queued before we saw it is not executed. */
void one_shot_session(struct device *device, uint32_t head);
void one_shot_intake(struct device *device, const struct pokeys_command *command);
bool one_shot_send(struct device *device);
/* One that no commander queued; 0, or -EALREADY. */
int one_shot_order(struct device *device, enum pokeys_one_shot_operation operation);
void one_shot_cycle(struct device *device);
/* The link is gone: what is at work ends. */
void one_shot_abort(struct device *device);
/* Axes whose position is being set just now. */
uint8_t one_shot_axes(const struct device *device);

/* For operations: send the request of this step, or end with an outcome. */
bool one_shot_request(struct device *device, enum wire_op op, const void *value);
bool one_shot_request_patiently(struct device *device, enum wire_op op, const void *value,
				uint64_t deadline_ns);
void one_shot_end(struct device *device, enum pokeys_outcome outcome);
void one_shot_refuse(struct device *device, struct refusal why);
/* What it began goes on beside the queue; its outcome comes by device_one_shot_outcome(). */
void one_shot_release(struct device *device);
void device_one_shot_outcome(struct device *device, uint32_t id, uint8_t operation,
			     enum pokeys_outcome outcome);

/* meter.c */
void meter_cycle(struct device *device);
void meter_reply(struct device *device, const mailbox_entry_t *entry, bool fast);
void meter_publish(const struct device *device, struct pokeys_link_statistics *out);

#endif
