/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What happens to heaters and servo motors, as people read it. */

#include <pokeys/names.h>
#include <pokeys/state.h>
#include "daemon/device/event_line.h"

void event_put_heater(struct line *line, const struct event *e)
{
	if (!e->b) {
		put(line, "heater %lld: reset", (long long)e->a);
		return;
	}
	put(line, "heater %lld: fault: %s", (long long)e->a,
	    pokeys_heater_fault_name((uint8_t)e->b));
	if (e->c != EVENT_NO_TEMPERATURE)
		put(line, ", at %.1f C", (double)e->c / 10);
	put(line, "; off until it is reset");
}

void event_put_heater_refused(struct line *line, const struct event *e)
{
	put(line, "heater %lld: ", (long long)e->a);
	if (e->b == POKEYS_HEATER_NOT_READY)
		put(line, "target refused: %s", pokeys_heater_fault_name((uint8_t)e->c));
	else if (e->c == EVENT_NO_TEMPERATURE)
		put(line, "target refused: %s", pokeys_heater_refusal_name((uint8_t)e->b));
	else
		put(line, "target %.1f C refused: %s", (double)e->c / 10,
		    pokeys_heater_refusal_name((uint8_t)e->b));
}

void event_put_heater_tuned(struct line *line, const struct event *e)
{
	if (e->b == POKEYS_HEATER_TUNING_RUNS)
		put(line, "heater %lld: search for gains started at %.1f C", (long long)e->a,
		    (double)e->c / 10);
	else if (e->b == POKEYS_HEATER_TUNING_DONE)
		put(line,
		    "heater %lld: gains found, heater off; copy the gains from pokeysctl "
		    "status to pokeysd.conf",
		    (long long)e->a);
	else
		put(line, "heater %lld: search for gains ended without a result", (long long)e->a);
}

void event_put_heater_left(struct line *line, const struct event *e)
{
	put(line, "heater %lld: switched off, its commander is gone", (long long)e->a);
}

static void put_unheard(struct line *line, const struct event *e, const char *loop,
			const char *what)
{
	if (e->a)
		put(line,
		    "it does not acknowledge that a %s is off: nothing is sent to it for "
		    "%lld ms, so that its own failsafe switches its outputs off",
		    what, (long long)e->a);
	else
		put(line,
		    "%s %lld: the device does not acknowledge that it is off; it may be on, "
		    "and no failsafe of the device is known to switch it off soon: disconnect the "
		    "power of this %s",
		    loop, (long long)e->b, what);
}

void event_put_heater_unheard(struct line *line, const struct event *e)
{
	put_unheard(line, e, "heater", "heater");
}

void event_put_servo(struct line *line, const struct event *e)
{
	if (!e->b)
		put(line, "servo %lld: reset", (long long)e->a);
	else
		put(line, "servo %lld: fault: %s, at %.3f; off until it is reset", (long long)e->a,
		    pokeys_servo_fault_name((uint8_t)e->b), (double)e->c / 1000);
}

void event_put_servo_refused(struct line *line, const struct event *e)
{
	put(line, "servo %lld: not enabled: %s", (long long)e->a,
	    e->b == POKEYS_SERVO_NOT_READY ? pokeys_servo_fault_name((uint8_t)e->c) :
					     pokeys_servo_refusal_name((uint8_t)e->b));
}

void event_put_servo_left(struct line *line, const struct event *e)
{
	put(line, "servo %lld: off at %.3f, its commander is gone", (long long)e->a,
	    (double)e->c / 1000);
}

void event_put_servo_unheard(struct line *line, const struct event *e)
{
	put_unheard(line, e, "servo", "servo motor");
}

static void put_gain(struct line *line, const struct event *e, const char *loop)
{
	put(line,
	    "%s %lld: %s = %.6g until the daemon ends; to keep it, write it into "
	    "pokeysd.conf",
	    loop, (long long)e->a, pokeys_gain_name((uint8_t)e->b),
	    (double)e->c / EVENT_GAIN_SCALE);
}

void event_put_heater_gain(struct line *line, const struct event *e)
{
	put_gain(line, e, "heater");
}

void event_put_servo_gain(struct line *line, const struct event *e)
{
	put_gain(line, e, "servo");
}

void event_put_servo_home(struct line *line, const struct event *e)
{
	if (e->b == POKEYS_SERVO_HOME_NONE)
		put(line, "servo %lld: homing", (long long)e->a);
	else if (e->b == POKEYS_SERVO_HOME_DONE)
		put(line, "servo %lld: homed, at %.3f", (long long)e->a, (double)e->c / 1000);
	else
		put(line, "servo %lld: not homed: %s", (long long)e->a,
		    pokeys_servo_home_end_name((uint8_t)e->b));
}

void event_put_moves(struct line *line, const struct event *e)
{
	const char *plural = e->c == 1 ? "" : "s";
	const bool axis = e->b >= POKEYS_SERVOS;

	if (e->a == POKEYS_MOVES_STOPPED)
		put(line, "%s %lld: off, so its path ends, with %lld move%s left out",
		    axis ? "axis" : "servo", (long long)(e->b - (axis ? POKEYS_SERVOS : 0)),
		    (long long)e->c, plural);
	else
		put(line, "moves: aborted, with %lld move%s left out", (long long)e->c, plural);
}

void event_put_servo_tuned(struct line *line, const struct event *e)
{
	if (e->b == POKEYS_SERVO_TUNING_RUNS)
		put(line, "servo %lld: searches for its gains", (long long)e->a);
	else if (e->b == POKEYS_SERVO_TUNING_DONE)
		put(line, "servo %lld: gains found; the motor is off", (long long)e->a);
	else
		put(line, "servo %lld: no gains found: %s; the motor is off", (long long)e->a,
		    pokeys_servo_tune_reason_name((uint8_t)e->c));
}
