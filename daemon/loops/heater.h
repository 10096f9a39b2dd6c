/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A heater: its sensor, its controller, and what switches it off by itself. Pure: the time is a
 * parameter, nothing is allocated, nothing is sent. Realtime thread only.
 *
 * Whoever owns it calls heater_sample() for each reading, heater_device() whenever something is
 * to be said of the device, heater_commander() and heater_command() with what is so now, and
 * heater_step() ten times a second. The output has to be what heater_step() returned, and nothing
 * if it was not called. If less than that is available, the caller says so with
 * heater_available(), and the output has to be heater->power.
 *
 * What it cannot see: a sensor that is stuck within a kelvin of the target, until the controller
 * has run up to full power. That is what a thermal fuse is for.
 */
#ifndef LOOPS_HEATER_H
#define LOOPS_HEATER_H

#include <stdbool.h>
#include <stdint.h>
#include "daemon/loops/pid.h"
#include "daemon/loops/sensor.h"

#define HEATER_PERIOD_NS UINT64_C(100000000)
#define HEATER_RISES 3
#define HEATER_SAMPLES 31		/* of a period, at most; the newest ones */

/* Why it does not heat. The first ones are conditions of a moment, the others of a time. */
enum heater_fault {
	HEATER_FINE,
	HEATER_DEVICE,   /* the device is lost, was restarted, or is not configured */
	HEATER_STALE,    /* no reading for stale_ns */
	HEATER_ODD,      /* the reading is no number */
	HEATER_OPEN,     /* the sensor's wire is broken */
	HEATER_SHORTED,  /* ... shorted */
	HEATER_OVER,     /* above most */
	HEATER_UNDER,    /* below least */
	HEATER_JUMP,     /* the temperature has changed faster than any heater could */
	HEATER_NO_RISE,  /* while it heats, it does not get warmer */
	HEATER_FELL,     /* it was warm, and gets colder than it should be */
	HEATER_UNHEEDED, /* near its target, but full power has no effect */
	HEATER_FAULTS
};

enum heater_law {
	HEATER_PID,
	HEATER_BANG_BANG,
};

struct heater_config {
	struct sensor_config sensor;
	double least, most; /* degrees Celsius; outside of these is a fault */
	double target_most; /* a target above is refused; below most */
	enum heater_law law;
	struct pid_gains gains; /* of an output of 0 to 1, for each kelvin */
	double hysteresis;      /* BANG_BANG: on below the target by so much, off above it, K */
	double power_most;      /* above 0, up to 1 */
	double rate_most;       /* the temperature cannot change faster, K/s */
	double slack;           /* nearer to the target it is warm, K */
	double rise;            /* it has to rise so much in window_ns while it is cold, K */
	uint64_t window_ns;     /* at most 10 minutes */
	uint64_t stale_ns;      /* at most 2 s */
	uint64_t lease_ns;      /* it goes on so long without a commander; UINT64_MAX: for ever */
};

/* What is usual, for a sensor of a beta thermistor of 100 kohm at 4.7 kohm. */
extern const struct heater_config heater_usual;

enum heater_refusal {
	HEATER_TAKEN,
	HEATER_OUT_OF_RANGE, /* no number, below 0, or above target_most; the old target stays */
	HEATER_AFTER_FAULT,  /* nothing but off (0), until off was commanded without a fault */
	HEATER_NOT_READY,    /* its condition would be a fault at once */
};

/* Finding the gains. */
enum heater_tuning {
	TUNE_NONE,
	TUNE_RUNS,
	TUNE_DONE,
	TUNE_FAILED, /* a fault, another command, or an hour was over */
};

struct heater_tune {
	enum heater_tuning state;
	struct pid_gains gains; /* what was found, when it is done */
	double lowest, highest; /* powers that it was heated with in the cycles that count */
	double height, period;  /* of the oscillation: K from lowest to highest, seconds */
	unsigned int cycles;    /* so far */
	bool on;
	double high, low; /* temperatures of this cycle */
	uint64_t begun_ns, switched_ns, above_ns;
};

struct heater {
	struct heater_config config;
	struct sensor sensor;
	struct pid pid;

	/* Readings since the last step: the newest good ones, and how many of all were what. */
	double sample[HEATER_SAMPLES];
	unsigned int samples;
	unsigned int count[SENSOR_ODD + 1];
	uint64_t sampled_ns; /* when the newest one was read; 0: there was none */
	double temperature;  /* of the last good ones; NAN: there was none */
	uint64_t good_ns;    /* when that was read */
	double before;       /* the temperature of a second ago, from which it may not jump */
	uint64_t before_ns;  /* ... 0: there was none */

	double target; /* 0: off */
	double wanted; /* what was commanded last, taken or not; NAN: nothing yet */
	enum heater_refusal refusal;
	bool device;           /* it can be used */
	bool lost;             /* it could not be used at some time since the last step */
	bool armed;            /* off was commanded since the start and the last fault */
	uint64_t commander_ns; /* it was alive then; 0: never */

	double power;                /* 0 to power_most */
	double available;            /* ... of which it could have been so much */
	bool limited;                /* it asked for more */
	bool on;                     /* BANG_BANG */
	enum heater_fault condition; /* what is wrong now */
	enum heater_fault sensed;    /* ... with the sensor alone */
	struct heater_tune tune;
	enum heater_fault fault; /* what has switched it off; stays until heater_reset() */
	uint64_t step_ns;        /* of the last step */

	/* Is it getting warm, is it staying warm? */
	bool watched;       /* calm and load are those of the last step */
	double calm;        /* the temperature, without noise */
	double load;        /* the power, in the middle of the last seconds */
	double room;        /* what that could have been */
	double press;       /* the part of the last seconds in which it took all it could */
	uint64_t whole_ns;  /* so long it could have its highest power */
	bool warm;          /* is or was near its target, since it was switched on */
	bool cold;          /* is further from it than slack, and has to rise */
	double base;        /* from here, the lowest for base_ns */
	uint64_t base_ns;   /* time at its highest power, or as much as longer with less */
	uint64_t paused_ns; /* it was switched off then; 0: it never heated, or was reset */
	double begun;       /* calm, when it was switched on */
	double peak;        /* the highest since then */
	double risen;       /* each time before that, since base_ns began, K */
	bool full;          /* the load is nearly all there is */
	double full_base;   /* ... for full_ns, from here */
	uint64_t full_ns;   /* likewise */
	/* how long the last rises took at full power; 0: not known */
	uint64_t rise_ns[HEATER_RISES];
};

/*
 * Judge a configuration and begin, off. NULL, or what is wrong, in the words of pokeysd.conf(5).
 * Not for realtime.
 */
const char *heater_init(struct heater *heater, const struct heater_config *config);

/* A reading of the sensor's input (0 to 1), and when it was read. */
void heater_sample(struct heater *heater, double reading, uint64_t read_ns);

/* Whether the device can be used: found, configured, not restarted since. */
void heater_device(struct heater *heater, bool usable);

/* Whether who commands it is alive. */
void heater_commander(struct heater *heater, bool alive, uint64_t now_ns);

/*
 * Another one commands from now on: what the one before had commanded arms nothing, and off has to
 * be commanded before the heater takes a target. One that heats goes on until its lease is over.
 */
void heater_another(struct heater *heater);

/* Off, whatever is commanded, and whether it finds its gains or heats. */
void heater_off(struct heater *heater);

/* The target that is commanded now, degrees Celsius; 0 is off. The same has the same answer. */
enum heater_refusal heater_command(struct heater *heater, double target);

/*
 * Heat to a target, oscillate there and find the gains for it: some minutes. Then it is off, and
 * heater->tune has the result. heater_off() ends it, and another target that is taken.
 */
enum heater_refusal heater_tune(struct heater *heater, double target);

/* One period: the power from now on, 0 to power_most. */
double heater_step(struct heater *heater, uint64_t now_ns);

/* After a step: no more than this is available of its power (0 to 1) until the next step. */
void heater_available(struct heater *heater, double power);

/* Off, by command or by a fault: an output must not be on for its own reasons any more. */
bool heater_is_off(const struct heater *heater);

/* Clear the fault. False: its cause is still there, and so is the fault. */
bool heater_reset(struct heater *heater);

/* Other gains, while it runs; the power does not jump. False: they are none, nothing changed. */
bool heater_regain(struct heater *heater, const struct pid_gains *gains);

/* Is it at its target, within so many kelvin? False if it is off. */
bool heater_is_at(const struct heater *heater, double within);

#endif
