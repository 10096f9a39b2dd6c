/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The one line that each event becomes. A text here may only use what is in the event; the
 * names of states and reasons are in event_name.c.
 */

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <pokeys/command.h>
#include <pokeys/names.h>
#include <pokeys/settings.h>
#include <pokeys/state.h>
#include "daemon/device/event_line.h"
#include "daemon/device/event_name.h"
#include "daemon/device/wish.h"
#include "settings/terminal.h"
#include "wire/io.h"
#include "wire/op.h"
#include "wire/system.h"

static void put_link(struct line *line, const struct event *e)
{
	if (e->a == e->b)
		put(line, "still %s%s", event_link_name(e->a),
		    e->c == POKEYS_FAULT_NONE ? ": the fault reported before has gone" :
						event_fault_text(e->c));
	else
		put(line, "%s (was %s)%s", event_link_name(e->a), event_link_name(e->b),
		    event_fault_text(e->c));
}

static void put_identified(struct line *line, const struct event *e)
{
	put(line, "is serial number %lld, hardware %lld, firmware %lld.%lld.%lld", (long long)e->a,
	    (long long)e->b, (long long)(e->c >> 16 & 0xff), (long long)(e->c >> 8 & 0xff),
	    (long long)(e->c & 0xff));
}

static void put_wrong_serial(struct line *line, const struct event *e)
{
	put(line,
	    "serial number %lld answers, but %lld is configured; the device is not used: "
	    "check address and serial",
	    (long long)e->a, (long long)e->b);
}

/* What a setting is to a person; a number may follow. */
static const struct {
	enum wire_op op;
	const char *name;
} op_settings[] = {
	{ WIRE_OP_PIN_ALL, "terminal" },
	{ WIRE_OP_ENCODER_OPTIONS, "encoder" },
	{ WIRE_OP_ENCODER_PINS, "terminals of encoder" },
	{ WIRE_OP_FAST_ENCODERS, "fast encoders" },
	{ WIRE_OP_ULTRA_ENCODER, "ultra-fast encoder" },
	{ WIRE_OP_PULSE_SETUP, "pulse engine" },
	{ WIRE_OP_PULSE_EMERGENCY, "emergency pin" },
	{ WIRE_OP_PULSE_AXIS_SET, "axis" },
	{ WIRE_OP_PWM, "PWM period" },
	{ WIRE_OP_FILTER_SET, "analog filter" },
	{ WIRE_OP_POEXTBUS, "PoExtBus" },
	{ WIRE_OP_KB_CONFIG_SET, "matrix keyboard" },
	{ WIRE_OP_DEVICE_NAME, "device name" },
	{ WIRE_OP_FAILSAFE, "failsafe" },
	{ WIRE_OP_PULSE_BACKLASH_SET, "backlash" },
	{ WIRE_OP_PULSE_SYNC_PWM, "synced PWM" },
	{ WIRE_OP_PULSE_SYNC_OUTPUTS, "synced outputs" },
	{ WIRE_OP_POSTEP_COMM, "PoStep" },
	{ WIRE_OP_POSTEP_MODES, "PoStep driver" },
	{ WIRE_OP_THREAD_PARAMS, "threading" },
};

/* One request for all axes; the number is that of one of them. */
static bool is_of_axis(int64_t op)
{
	return op == WIRE_OP_PULSE_BACKLASH_SET || op == WIRE_OP_POSTEP_COMM ||
	       op == WIRE_OP_POSTEP_MODES;
}

static void put_setting(struct line *line, const struct event *e)
{
	const struct wire_op_row *row = wire_op((enum wire_op)e->a);
	const char *name = row ? row->name : "unknown setting";

	for (size_t i = 0; i < sizeof(op_settings) / sizeof(op_settings[0]); i++)
		if ((int64_t)op_settings[i].op == e->a)
			name = op_settings[i].name;
	put(line, "%s", name);
	if (e->b >= 0)
		put(line, "%s %lld", is_of_axis(e->a) ? " of axis" : "", (long long)e->b);
}

/* Protocol section 3.2. */
static void put_function(struct line *line, int64_t function)
{
	static const char *const names[0x80] = {
		[0x00] = "inactive",      [0x02] = "digital input", [0x04] = "digital output",
		[0x08] = "analog input",  [0x10] = "analog output", [0x40] = "counter input",
		[0x42] = "counter input",
	};
	const char *name = names[function & 0x7f];

	if (name)
		put(line, "%s", name);
	else
		put(line, "function 0x%llx", (unsigned long long)function & 0x7f);
	put(line, function & 0x80 ? ", inverted" : "");
}

static void put_config_changed(struct line *line, const struct event *e)
{
	put_setting(line, e);
	if (e->a == WIRE_OP_PIN_ALL) {
		put(line, ": ");
		put_function(line, e->c);
	} else {
		put(line, " configured");
	}
	put(line, " (not saved in the device)");
}

static void put_config_foreign(struct line *line, const struct event *e)
{
	put(line, "somebody else has changed ");
	put_setting(line, e);
	if (e->a == WIRE_OP_PIN_ALL) {
		put(line, " to ");
		put_function(line, e->c);
	}
	put(line, "; until the machine is off, this applies, then it is set again. Look for "
		  "another program that uses this device");
}

static void put_config_refused(struct line *line, const struct event *e)
{
	put_setting(line, e);
	if (e->c == SETTING_UNANSWERED)
		put(line, ": the device answers no request about it; check the network, and "
			  "whether its firmware has this setting, or remove the setting");
	else if (e->c == SETTING_LOCKED)
		put(line, " was refused by the device: its configuration is locked; unlock it or "
			  "remove that setting");
	else if (e->a == WIRE_OP_POSTEP_MODES)
		put(line, " did not take its step mode or temperature limit; check that it has "
			  "power, and its type and I2C address");
	else
		put(line, " was refused by the device; check the value, or whether it is locked");
}

static void put_config_missing(struct line *line, const struct event *e)
{
	struct event which = *e;

	which.b = -1;
	put_setting(line, &which);
	if (e->c)
		put(line, " is configured, but only a PoKeys57CNC has it; remove those settings");
	else
		put(line,
		    " is configured, but this firmware does not have it (%lld.%lld.%lld "
		    "does); update the device or remove those settings",
		    (long long)(e->b >> 16 & 0xff), (long long)(e->b >> 8 & 0xff),
		    (long long)(e->b & 0xff));
}

static void put_postep(struct line *line, const struct event *e)
{
	const char *between = ": ";

	put(line, "PoStep driver of axis %lld", (long long)e->a);
	for (unsigned int i = 0; i < 8; i++) {
		if (!(e->b >> i & 1))
			continue;
		put(line, "%s%s", between, pokeys_postep_fault_name(i));
		between = ", ";
	}
}

static void put_step_mode(struct line *line, const struct event *e)
{
	put(line, "motion is not permitted: the PoStep driver of axis %lld ", (long long)e->a);
	if (e->c < 0) {
		put(line, "is still switching to a step mode that is no longer configured; "
			  "wait until it has switched");
	} else {
		if (e->b < 0)
			put(line, "does not report its step mode");
		else
			put(line, "has step mode 1/%lld", 1LL << (e->b & 31));
		put(line,
		    ", but 1/%lld is configured; wait until it is set up (check its power "
		    "and that setting)",
		    1LL << (e->c & 31));
	}
	put(line, ", then switch the machine on again");
}

static void put_wish_refused(struct line *line, const struct event *e)
{
	const char *part = wish_axis_part(e->c);

	put(line, "requested setting %s of number %lld%s", pokeys_setting_name((uint8_t)e->a),
	    (long long)e->b, *part ? ", " : "");
	for (; *part; part++)
		put(line, "%c", *part == '_' ? '-' : *part | 0x20);
	put(line, ", is out of range for this device; the previous value stays "
		  "in use");
}

static void put_locked(struct line *line, const struct event *e)
{
	switch (e->a) {
	case LOCK_NO_PASSWORD:
		put(line, "requires a password (level %lld); set password-file", (long long)e->b);
		break;
	case LOCK_WRONG_PASSWORD:
		put(line, "rejects the password in password-file (level %lld)", (long long)e->b);
		break;
	default:
		put(line, "settings differ, but its configuration is locked; unlock it or remove "
			  "those settings");
		break;
	}
}

static void put_rebooted(struct line *line, const struct event *e)
{
	put(line, "was restarted: its clock went from %lld to %lld ms", (long long)e->a,
	    (long long)e->b);
}

static void put_commander(struct line *line, const struct event *e)
{
	if (e->a)
		put(line, "a commander drives it");
	else if (e->c)
		put(line, "the commander has ended");
	else if (e->b < 0)
		put(line, "another commander has begun, or the same one again; "
			  "no heartbeat from it yet");
	else
		put(line, "the commander's heartbeat is %lld us late", (long long)e->b);
}

static void put_safe(struct line *line, const struct event *e)
{
	if (e->a)
		put(line, "outputs and axes are in the safe state");
	else
		put(line, e->b ? "left the safe state" :
				 "safe state unknown: the device does not answer");
}

static void put_outputs_held(struct line *line, const struct event *e)
{
	if (e->a)
		put(line, "outputs are held in the safe state; switch the machine off and on "
			  "(exceptions after a loss: resume-outputs in pokeysd.conf)");
	else
		put(line, "outputs follow the commander again");
}

static void put_emergency(struct line *line, const struct event *e)
{
	if (e->a)
		put(line, "emergency stop from the commander: axes stop, outputs %s",
		    e->b ? "follow the commander (on-emergency = hold)" : "go to the safe state");
	else
		put(line, "emergency stop from the commander released; switch the machine off "
			  "and on to continue");
}

static void put_suspended(struct line *line, const struct event *e)
{
	put(line,
	    "the computer was suspended for %lld.%lld s; all devices count as lost: switch "
	    "the machine off and on",
	    (long long)e->a / 1000, (long long)e->a / 100 % 10);
}

static bool is_one(unsigned int axes)
{
	return axes && !(axes & (axes - 1));
}

/* "axis 2", "axes 0 and 1", "axes 0, 1 and 3" */
static void put_axes(struct line *line, unsigned int axes)
{
	const char *before = is_one(axes) ? "axis " : "axes ";

	for (unsigned int i = 0; axes >> i; i++) {
		if (!(axes >> i & 1))
			continue;
		put(line, "%s%u", before, i);
		before = is_one(axes >> (i + 1)) ? " and " : ", ";
	}
}

static void put_position_lost(struct line *line, const struct event *e)
{
	const bool one = is_one((uint8_t)e->a);

	put(line, one ? "the position of " : "the positions of ");
	put_axes(line, (uint8_t)e->a);
	put(line, " %s no longer valid (%s); home %s", one ? "is" : "are",
	    event_place_loss_name(e->b), one ? "it" : "them");
}

static void put_machine(struct line *line, const struct event *e)
{
	put(line, e->a ? "motion is permitted" : "motion is no longer permitted");
}

static void put_override(struct line *line, const struct event *e)
{
	put(line, e->a ? "limit override is active: no limit switch stops any axis" :
			 "limit override has ended: limit switches stop the axes again");
}

static void put_task(struct line *line, const struct event *e)
{
	put(line, "%s", event_task_name(e->a));
	if (e->c) {
		put(line, " of ");
		put_axes(line, (uint8_t)e->c);
	}
	put(line, ": %s", pokeys_task_result_name((uint8_t)e->b));
}

static void put_threading(struct line *line, const struct event *e)
{
	put(line, "%s refused: %s", event_one_shot_name(e->a),
	    pokeys_threading_refusal_name((uint8_t)e->b));
}

static void put_unread(struct line *line, int64_t age_ms)
{
	if (age_ms < 0)
		put(line, "machine-on: the commander has not read the positions");
	else
		put(line, "machine-on: the positions known to the commander are %lld ms old",
		    (long long)age_ms);
	put(line, "; add pokeys.N.read before pokeys.N.write in the same thread (addf), then "
		  "switch the machine off and on");
}

static void put_bad_command(struct line *line, const struct event *e)
{
	put(line, "command refused: ");
	if (e->a == COMMAND_FAULT_NOT_OFFERED)
		put(line, "this device has no %s", event_part_name(e->b));
	else if (e->a == COMMAND_FAULT_UNREAD)
		put_unread(line, e->b);
	else
		put(line, "%s %lld", event_command_fault_name(e->a), (long long)e->b);
}

static void put_foreign_image(struct line *line, const struct event *e)
{
	put(line,
	    "command image of another layout (magic 0x%llx, version %lld); "
	    "daemon and commander must be of one release",
	    (unsigned long long)e->a, (long long)e->b);
}

static void put_foreign_wish(struct line *line, const struct event *e)
{
	(void)e;
	put(line, "the commander's settings request is refused: it has a different layout, or no "
		  "session or generation; daemon and commander must be of one release");
}

/* '#' in the text stands for the axis or encoder. */
static void put_refusal(struct line *line, unsigned int reason, unsigned int part)
{
	if (reason == REFUSAL_NONE)
		return;
	put(line, ": ");
	for (const char *text = event_refusal_name(reason); *text; text++)
		if (*text == '#')
			put(line, "%u", part);
		else
			put(line, "%c", *text);
}

static void put_one_shot(struct line *line, const struct event *e)
{
	if (e->b == EVENT_ORDERED)
		put(line, "order of a terminal");
	else
		put(line, "one-shot %lld", (long long)e->b);
	put(line, " (%s): %s", event_one_shot_name(e->a), event_outcome_name((uint8_t)e->c));
	if ((uint8_t)e->c == POKEYS_OUTCOME_REFUSED)
		put_refusal(line, (uint8_t)(e->c >> 8), (uint8_t)(e->c >> 16));
}

static void put_stale(struct line *line, const struct event *e)
{
	if (!e->a)
		put(line, "data is fresh again");
	else if (e->b < 0)
		put(line, "data is stale: some of it has not been received yet");
	else
		put(line, "data is stale: %lld us old", (long long)e->b);
}

static void put_packets(struct line *line, const struct event *e)
{
	put(line, "%lld %s", (long long)e->b, event_packets_name(e->a, e->b));
}

static void put_cycle_skipped(struct line *line, const struct event *e)
{
	put(line, "%lld cycle%s missed; is something else on this core?", (long long)e->a,
	    e->a == 1 ? " was" : "s were");
}

static void put_transport(struct line *line, const struct event *e)
{
	int error = (int)(0 - (uint64_t)e->a);

	put(line, "network transport failed: %s", strerror(error));
	if (error == EADDRNOTAVAIL)
		put(line, "; the interface has no address of its own (ip address); retrying");
	else if (error == ENODEV)
		put(line, "; the interface is not there (ip link); retrying");
}

static void put_engine(struct line *line, const struct event *e)
{
	switch (e->a) {
	case 100:
		put(line, "pulse engine stopped by a limit switch; clear the fault (in LinuxCNC: "
			  "reset the emergency stop) to go on");
		break;
	case 101:
		put(line, "pulse engine stopped by the emergency input; clear the fault (in "
			  "LinuxCNC: reset the emergency stop) to go on");
		break;
	default:
		put(line, "pulse engine went from state %lld to %lld", (long long)e->b,
		    (long long)e->a);
	}
}

static void put_phase(struct line *line, const struct event *e)
{
	const double period = (double)e->b / 1e3, jitter = (double)e->c / 1e3;

	switch (e->a) {
	case POKEYS_PHASE_LOCKED:
		put(line, "the cycle follows the commander's thread (every %g us, jitter %.0f us)",
		    period, jitter);
		break;
	case POKEYS_PHASE_SEEKING:
		put(line,
		    "the cycle cannot follow the commander's thread: its reads come too "
		    "irregularly (every %g us, jitter %.0f us)",
		    period, jitter);
		break;
	case POKEYS_PHASE_UNFIT:
		put(line,
		    "the cycle cannot follow the commander's thread: its period of %g us is "
		    "no multiple or part of period-us",
		    period);
		break;
	default:
		put(line, "the cycle follows no commander's thread");
	}
}

static void put_not_safe(struct line *line, const struct event *e)
{
	put(line, "the safe state was not acknowledged: outputs may still be on, axes may still "
		  "move; its own failsafe ");
	if (e->a < 0)
		put(line, "is not known");
	else if (!e->a)
		put(line, "is off, and nothing else stops them");
	else if (e->b == WIRE_FAILSAFE_ALL)
		put(line, "acts %lld ms after the last packet", (long long)e->a);
	else
		put(line, "acts %lld ms after the last packet (failsafe-parts %lld)",
		    (long long)e->a, (long long)e->b);
	put(line, "; look at the machine, then whether it answers (pokeysctl discover)");
}

static void put_shared(struct line *line, const struct event *e)
{
	char a[SETTINGS_NAME_MAX], b[SETTINGS_NAME_MAX], list[TERMINAL_LIST_MAX];
	const uint64_t terminals = (uint64_t)e->a & ((UINT64_C(1) << POKEYS_PINS) - 1);

	put(line,
	    "%s %s used by %s and by %s on this board, and can only be used by one of them; "
	    "remove the other in pokeysd.conf or in HAL",
	    terminal_list(terminals, list), terminals & (terminals - 1) ? "are" : "is",
	    terminal_owner_name((unsigned int)e->b, a), terminal_owner_name((unsigned int)e->c, b));
}

static void put_absent(struct line *line, const struct event *e)
{
	char list[TERMINAL_LIST_MAX];
	const uint64_t terminals = (uint64_t)e->a & ((UINT64_C(1) << POKEYS_PINS) - 1);

	put(line,
	    "%s cannot be %s on this board; choose another one in pokeysd.conf or in HAL "
	    "(pokeysctl terminals MODEL lists them)",
	    terminal_list(terminals, list),
	    e->b == WIRE_PIN_COUNTER   ? "a counter" :
	    e->b == WIRE_PIN_ANALOG_IN ? "an analog input" :
	    e->b == WIRE_PIN_OUTPUT    ? "a digital output" :
					 "a digital input");
}

static void (*const texts[EVENT_CODES])(struct line *, const struct event *) = {
	[EVENT_LINK] = put_link,
	[EVENT_IDENTIFIED] = put_identified,
	[EVENT_WRONG_SERIAL] = put_wrong_serial,
	[EVENT_CONFIG_CHANGED] = put_config_changed,
	[EVENT_CONFIG_REFUSED] = put_config_refused,
	[EVENT_REBOOTED] = put_rebooted,
	[EVENT_COMMANDER] = put_commander,
	[EVENT_SAFE] = put_safe,
	[EVENT_MACHINE] = put_machine,
	[EVENT_BAD_COMMAND] = put_bad_command,
	[EVENT_FOREIGN_IMAGE] = put_foreign_image,
	[EVENT_FOREIGN_WISH] = put_foreign_wish,
	[EVENT_ONE_SHOT] = put_one_shot,
	[EVENT_STALE] = put_stale,
	[EVENT_PACKETS] = put_packets,
	[EVENT_CYCLE_SKIPPED] = put_cycle_skipped,
	[EVENT_TRANSPORT] = put_transport,
	[EVENT_SUSPENDED] = put_suspended,
	[EVENT_OUTPUTS_HELD] = put_outputs_held,
	[EVENT_EMERGENCY] = put_emergency,
	[EVENT_POSITION_LOST] = put_position_lost,
	[EVENT_ENGINE] = put_engine,
	[EVENT_WISH_REFUSED] = put_wish_refused,
	[EVENT_LOCKED] = put_locked,
	[EVENT_TASK] = put_task,
	[EVENT_PHASE] = put_phase,
	[EVENT_THREADING] = put_threading,
	[EVENT_CONFIG_MISSING] = put_config_missing,
	[EVENT_POSTEP] = put_postep,
	[EVENT_STEP_MODE] = put_step_mode,
	[EVENT_NOT_SAFE] = put_not_safe,
	[EVENT_TERMINALS_SHARED] = put_shared,
	[EVENT_CONFIG_FOREIGN] = put_config_foreign,
	[EVENT_HEATER] = event_put_heater,
	[EVENT_HEATER_REFUSED] = event_put_heater_refused,
	[EVENT_HEATER_TUNED] = event_put_heater_tuned,
	[EVENT_HEATER_LEFT] = event_put_heater_left,
	[EVENT_HEATER_UNHEARD] = event_put_heater_unheard,
	[EVENT_SERVO] = event_put_servo,
	[EVENT_SERVO_REFUSED] = event_put_servo_refused,
	[EVENT_SERVO_LEFT] = event_put_servo_left,
	[EVENT_SERVO_UNHEARD] = event_put_servo_unheard,
	[EVENT_HEATER_GAIN] = event_put_heater_gain,
	[EVENT_SERVO_GAIN] = event_put_servo_gain,
	[EVENT_SERVO_HOME] = event_put_servo_home,
	[EVENT_MOVES] = event_put_moves,
	[EVENT_SERVO_TUNED] = event_put_servo_tuned,
	[EVENT_TERMINALS_ABSENT] = put_absent,
	[EVENT_LIMIT_OVERRIDE] = put_override,
};

size_t event_format(const struct event *event, const char *device, char *text, size_t size)
{
	struct line line = { .text = text, .size = size };

	if (!size)
		return 0;
	text[0] = '\0';
	if (device)
		put(&line, "%s: ", device);
	if (event->code < EVENT_CODES && texts[event->code])
		texts[event->code](&line, event);
	else
		put(&line, "event %u", (unsigned int)event->code);
	return line.length;
}
