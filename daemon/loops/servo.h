/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A servo motor: the encoder that says where it is, its controller, and what stops it by itself.
 * Pure: the time is a parameter, nothing is allocated, nothing is sent. Realtime thread only.
 *
 * Whoever owns it calls servo_step() in each cycle, with what is known of the device and what is
 * commanded now. The output has to be what servo_step() returned, and nothing if it was not called.
 *
 * Positions are in units of the axis (mm, degrees). An output is a part of the full voltage, from
 * -1 to 1; 1 has to make the position grow.
 *
 * What it cannot see: an encoder that falls silent while the output stays as it is. It is found as
 * soon as the output changes by more than silent_output, and until then the motor may turn by what
 * that moves it: some millimetres at usual gains, most with slow commands.
 */
#ifndef LOOPS_SERVO_H
#define LOOPS_SERVO_H

#include <stdbool.h>
#include <stdint.h>

/* Why it does not move. */
enum servo_fault {
	SERVO_FINE,
	SERVO_DEVICE,     /* the device is lost, was restarted, or is not configured */
	SERVO_STALE,      /* no reading of the encoder for stale_ns */
	SERVO_EMERGENCY,  /* emergency stop */
	SERVO_JUMP,       /* the encoder says that it was faster than it can be */
	SERVO_ODD,        /* the command is no number, or faster than speed_jump */
	SERVO_FOLLOWING,  /* it is too far from where it is commanded to be */
	SERVO_STALLED,    /* it is pushed hard, and does not get away */
	SERVO_SILENT,     /* it is pushed, and the encoder does not count */
	SERVO_RUNAWAY,    /* it gets faster against its output: one of them is reversed */
	SERVO_SOFT_LIMIT, /* commanded beyond least or most */
	SERVO_SWITCH,     /* at a limit switch */
	SERVO_HEATER,     /* a heater whose faults stop it has one */
	SERVO_FAULTS
};

/* Why it was not enabled when that was commanded. It has to be commanded off before it is again. */
enum servo_refusal {
	SERVO_TAKEN,
	SERVO_AFTER_FAULT, /* a fault has to be reset first */
	SERVO_NOT_READY,   /* its condition would be a fault at once */
	SERVO_ELSEWHERE,   /* the commanded position is not where the axis is */
	SERVO_OFF_FIRST,   /* off was not commanded since the start, a fault, or a loss */
	SERVO_UNREAD,      /* who commanded it on, after off, did not know where the axis is */
};

/* Of an output of -1 to 1. */
struct servo_gains {
	double p;            /* output for each unit of the error */
	double i;            /* ... and second */
	double d;            /* output for each unit/s that it is slower than commanded */
	double velocity;     /* output for each unit/s that is commanded (feed-forward) */
	double acceleration; /* output for each unit/s^2 that is commanded (feed-forward) */
};

#define SERVO_STALE_MOST_NS UINT64_C(100000000)

struct servo_config {
	double scale;       /* counts for each unit; below 0: it counts the other way */
	double least, most; /* soft limits, as soon as it is homed; units. -+INFINITY: none */
	double speed_most;  /* at this speed follow_most is allowed; units/s */
	double speed_jump;  /* it cannot be faster, units/s */
	struct servo_gains gains;
	double deadband;       /* an error up to this is none, units; one of a count never is */
	double integral_most;  /* of the output, 0 to 1 */
	double output_most;    /* above 0, up to 1 */
	double smooth;         /* time constant of speeds and accelerations, seconds */
	double follow_least;   /* allowed error while it stands, units; above 0 */
	double follow_most;    /* ... at speed_most; not below follow_least */
	double stall_output;   /* with this output, above 0 up to 1, ... */
	double stall_move;     /* ... it has to move so far, units, ... */
	double stall_s;        /* ... within this time, seconds; at most 10 */
	double silent_output;  /* an output may change by so much without a count, 0 to 1 */
	double silent_s;       /* ... by 1 more than that for so long, by less for longer */
	double runaway_output; /* it may not get faster against a higher output than this, ... */
	double runaway_move;   /* ... for longer than this way, units */
	uint64_t stale_ns;     /* at most SERVO_STALE_MOST_NS */
};

/* What is usual; scale, speeds, gains, following error and ways have to be those of the axis. */
extern const struct servo_config servo_usual;

/* What is known of the device in this cycle. */
struct servo_input {
	int32_t counts;    /* of the encoder; they go on after the largest with the smallest */
	uint64_t read_ns;  /* when they were read; 0: never */
	uint64_t asked_ns; /* perhaps they are as old as that; 0: no older than read_ns */
	bool usable;       /* the device is found and configured */
	uint32_t epoch;    /* another number: its counters may have lost their counts */
	uint32_t slips;    /* another number: the counts of before were wrong */
	bool emergency;
	bool heater;                /* a heater whose faults stop it has one */
	bool low, high;             /* the limit switches are active */
	bool seeks_low, seeks_high; /* ... and one of them is what the axis is homing to */
};

/* What is commanded in this cycle. */
struct servo_wish {
	bool alive; /* somebody commands */
	bool blind; /* ... and does not know where the axis is: may not enable it */
	bool enable;
	double position; /* units */
	double velocity; /* units/s, of that position; NAN: it is estimated */
};

struct servo {
	struct servo_config config;

	bool primed;           /* there is a count that the next one can be compared with */
	int32_t last;          /* count */
	uint64_t read_ns;      /* when that was read */
	uint64_t asked_ns;     /* ... at the earliest */
	uint32_t epoch, slips; /* of the device, then */
	int64_t counts;        /* since the start */
	double offset;         /* of the position, units */
	double position;       /* units */
	double rate;           /* ... a second, without noise */
	double raw_rate;       /* ... with it: of the last two readings */
	bool homed;            /* the position is that of the machine */

	bool armed; /* off was commanded since the start, a fault and a loss */
	bool enabled;
	enum servo_refusal refusal;
	double wanted; /* position that is commanded */
	double wanted_rate, wanted_acceleration;
	uint64_t changed_ns, interval_ns; /* of the commanded position: when, and how often */

	double error;      /* off what was commanded when the encoder was read, units */
	double rate_error; /* ... likewise, of the speed, units/s */
	double span;       /* seconds between the last two readings */
	double integral;   /* in units of the output */
	double bridge;     /* ... from the gains of before to those of now; goes to 0 */
	double output;
	bool forced; /* its output in the next step is this one */
	double force;
	uint64_t step_ns;           /* of the last step; 0: there was none */
	enum servo_fault condition; /* what is wrong now */
	enum servo_fault fault;     /* what has stopped it; stays until servo_reset() */

	double stall_from;            /* position, from which it has to get away */
	double stalled;               /* seconds for which it was pushed hard there */
	double idle_output;           /* what was the output when the encoder counted last? */
	double idle_push;             /* how far it was from that since, times seconds */
	double against;               /* way that it has moved against its output */
	double against_rate;          /* how fast it was when that began */
	double soft_least, soft_most; /* what is allowed now: it may return from beyond */
	double low_at, high_at;     /* where it is on a limit switch, the innermost; NAN: on none */
	double low_stop, high_stop; /* ... and how far it may be commanded there */
};

/*
 * Judge a configuration and begin, off. NULL, or what is wrong, in the words of pokeysd.conf(5).
 * Not for realtime.
 */
const char *servo_init(struct servo *servo, const struct servo_config *config);

/* One cycle: the output from now on, -output_most to output_most; 0 if it is not enabled. */
double servo_step(struct servo *servo, const struct servo_input *input,
		  const struct servo_wish *wish, uint64_t now_ns);

/*
 * Clear the fault. False: its cause is still there, and so is the fault. A limit switch and a soft
 * limit are no such causes, or the axis could not return. What the next step will be called with
 * tells whether a cause that was commanded is gone.
 */
bool servo_reset(struct servo *servo, const struct servo_input *input,
		 const struct servo_wish *wish);

/*
 * Before a step: its output is this one then, whatever is commanded, and its command is where it
 * is. All that stops it does so as before.
 */
void servo_force(struct servo *servo, double output);

/* It stands without output: what has held it before tells nothing about its encoder. */
void servo_forget_output(struct servo *servo);

/* Off, as if that was commanded. */
void servo_off(struct servo *servo);

/* Another one commands from now on: off has to be commanded before it is enabled (again). */
void servo_another(struct servo *servo);

/*
 * Here is that position, homed or not. False: not while it is enabled, or without a reading, or it
 * is no number, or one so large that counts are lost in it.
 */
bool servo_place(struct servo *servo, double position, bool homed);

/*
 * All positions are larger by `shift` from now on, also the commanded one, so an axis that is
 * enabled does not move.
 */
void servo_renumber(struct servo *servo, double shift, bool homed);

/*
 * It has sought its lower limit switch, or its upper one, and now stands there: from now on it may
 * not go further onto it.
 */
void servo_watch_switch(struct servo *servo, double wanted, bool low);

/*
 * Other gains, while it runs: the output does not jump, but goes over to theirs within some tenths
 * of a second. False: they are none, nothing changed.
 */
bool servo_regain(struct servo *servo, const struct servo_gains *gains);

#endif
