// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Commands for the machine on the pulse engine. Positions are those of the
 * motor and not of the device's counter: "axis 0 machine 500" carries the
 * table away by hand, and the device only notices by its switches.
 */
#include "sim/control_part.h"

#include <math.h>
#include <string.h>

static bool axis_word(struct sim_order *order, int i, unsigned int *axis)
{
	int64_t number;

	if (!sim_order_integer(order, i, "axis", 0, SIM_AXES - 1, &number))
		return false;
	*axis = (unsigned int)number;
	return true;
}

static void show_axis(struct sim_order *order, unsigned int i)
{
	const struct sim_axis *ax = &order->dev->engine.axis[i];
	const struct sim_mechanics *m = &order->dev->bench.machine.axis[i];

	sim_text_add(order->out,
		     "state=%u\nposition=%d\nspeed=%.6f\nreference=%d\n"
		     "machine=%lld\nsteps=%llu\nclamped=%llu\npowered=%d\n",
		     ax->state, sim_axis_position(ax), ax->planner.speed, ax->reference,
		     (long long)m->position, (unsigned long long)m->steps,
		     (unsigned long long)ax->clamped, sim_axis_powered(order->dev, i));
}

/* couple ENCODER NUM DEN [INDEX_EVERY]: words from 2 on. */
static bool couple(struct sim_order *order, unsigned int axis)
{
	int64_t encoder, num, den, every = 0;

	if (!sim_order_integer(order, 2, "encoder", 0, SIM_ENCODERS - 1, &encoder) ||
	    !sim_order_integer(order, 3, "steps", -1000000, 1000000, &num) ||
	    !sim_order_integer(order, 4, "pulses", 1, 1000000, &den))
		return false;
	if (order->word[5] &&
	    !sim_order_integer(order, 5, "pulses between indexes", 0, INT32_MAX, &every))
		return false;
	if (order->word[5] && !sim_order_no_more(order, 6))
		return false;
	sim_bench_couple(order->dev, axis, (int)encoder, (int32_t)num, (int32_t)den, every);
	return true;
}

static bool do_axis(struct sim_order *order)
{
	unsigned int axis, what;
	int64_t position;

	if (!axis_word(order, 0, &axis))
		return false;
	if (order->word[1]) {
		if (!sim_order_choice(order, 1, "what", "machine|couple|decouple", &what))
			return false;
		if (what == 1 && !couple(order, axis))
			return false;
		if (what == 2) {
			if (!sim_order_no_more(order, 2))
				return false;
			sim_bench_couple(order->dev, axis, -1, 1, 1, 0);
		}
		if (what == 0) {
			if (!sim_order_integer(order, 2, "position", INT32_MIN, INT32_MAX,
					       &position) ||
			    !sim_order_no_more(order, 3))
				return false;
			order->dev->bench.machine.axis[axis].position = position;
			sim_pins_settle(order->dev);
		}
	}
	show_axis(order, axis);
	return true;
}

/* FROM TO [nc|no] at word i; the next word's place is returned, 0 if it is bad. */
static int interval(struct sim_order *order, int i, struct sim_switch *sw)
{
	unsigned int open = 0;

	if (!sim_order_integer(order, i, "from", INT32_MIN, INT32_MAX, &sw->from) ||
	    !sim_order_integer(order, i + 1, "to", sw->from, INT32_MAX, &sw->to))
		return 0;
	i += 2;
	if (order->word[i] && (!strcmp(order->word[i], "nc") || !strcmp(order->word[i], "no"))) {
		open = !strcmp(order->word[i], "no");
		i++;
	}
	sw->wired = true;
	sw->normally_open = open;
	return i;
}

static struct sim_switch *switch_of(struct sim_device *dev, unsigned int axis, unsigned int which)
{
	struct sim_mechanics *m = &dev->bench.machine.axis[axis];

	if (which == 0)
		return &m->minus;
	return which == 1 ? &m->plus : &m->home;
}

static bool do_switch(struct sim_order *order)
{
	struct sim_switch sw = { .pin = SIM_DEDICATED };
	unsigned int axis, which;
	int64_t pin;
	int at;

	if (!axis_word(order, 0, &axis) ||
	    !sim_order_choice(order, 1, "switch", "minus|plus|home", &which))
		return false;
	if (order->word[2] && !strcmp(order->word[2], "off")) {
		if (!sim_order_no_more(order, 3))
			return false;
		sim_bench_switch(order->dev, switch_of(order->dev, axis, which), &sw);
		return true;
	}
	at = interval(order, 2, &sw);
	if (!at)
		return false;
	if (order->word[at]) {
		if (!sim_order_integer(order, at++, "pin", 1, SIM_PINS, &pin))
			return false;
		sw.pin = (uint8_t)(pin - 1);
	}
	if (!sim_order_no_more(order, at))
		return false;
	sim_bench_switch(order->dev, switch_of(order->dev, axis, which), &sw);
	return true;
}

#define MOTOR_KINDS "sign|antiphase|two-pwm|none"
#define MOTOR_STATES "good|stalled|reversed|silent|cut"
#define MOTOR_SWITCHES "minus|plus|home"

static bool motor_pin(struct sim_order *order, int at, uint8_t *pin)
{
	int64_t number;

	if (!sim_order_integer(order, at, "pin", 1, SIM_PINS, &number))
		return false;
	*pin = (uint8_t)(number - 1);
	return true;
}

static bool motor_channel(struct sim_order *order, int at, uint8_t *channel)
{
	int64_t number;

	if (!sim_order_integer(order, at, "channel", 0, 5, &number))
		return false;
	*channel = (uint8_t)number;
	return true;
}

static bool fit_motor(struct sim_order *order, unsigned int encoder, enum sim_servo_kind kind)
{
	struct sim_servo servo = { .kind = kind, .enable = SIM_SERVO_NONE };
	int at = 3;

	if (!motor_channel(order, 2, &servo.pwm))
		return false;
	if (kind == SIM_SERVO_SIGN && !motor_pin(order, at++, &servo.other))
		return false;
	if (kind == SIM_SERVO_TWO_PWM && !motor_channel(order, at++, &servo.other))
		return false;
	if ((kind == SIM_SERVO_ANTIPHASE || order->word[at]) &&
	    !motor_pin(order, at++, &servo.enable))
		return false;
	if (!sim_order_no_more(order, at))
		return false;
	sim_servo_fit(order->dev, encoder, &servo, &sim_motor_small);
	return true;
}

/* minus|plus|home off | FROM TO [nc|no] PIN */
static bool motor_switch(struct sim_order *order, struct sim_servo *servo, unsigned int which)
{
	struct sim_switch sw = { .wired = false };
	int at = 3;

	if (!order->word[2] || strcmp(order->word[2], "off")) {
		at = interval(order, 2, &sw);
		if (!at || !motor_pin(order, at++, &sw.pin))
			return false;
	}
	if (!sim_order_no_more(order, at))
		return false;
	servo->end[which] = sw;
	sim_servos_rewired(order->dev);
	return true;
}

static bool change_motor(struct sim_order *order, unsigned int encoder)
{
	struct sim_servo *servo = &order->dev->bench.servo[encoder];
	unsigned int word;
	int64_t torque;

	if (!sim_order_choice(order, 1, "change",
			      MOTOR_KINDS "|" MOTOR_STATES "|push|" MOTOR_SWITCHES, &word))
		return false;
	if (word < 3)
		return fit_motor(order, encoder, (enum sim_servo_kind)word);
	if (word == 3) {
		if (!sim_order_no_more(order, 2))
			return false;
		sim_servo_remove(order->dev, encoder);
		return true;
	}
	if (!servo->fitted) {
		sim_text_add(order->why, "nothing is fitted to this encoder; fit a motor first");
		return false;
	}
	if (word < 9) {
		if (!sim_order_no_more(order, 2))
			return false;
		sim_motor_break(&servo->motor, (enum sim_motor_fault)(word - 4));
		return true;
	}
	if (word > 9)
		return motor_switch(order, servo, word - 10);
	if (!sim_order_integer(order, 2, "torque in mNm", -100000, 100000, &torque) ||
	    !sim_order_no_more(order, 3))
		return false;
	servo->motor.torque = (double)torque / 1000;
	return true;
}

static bool do_motor(struct sim_order *order)
{
	const struct sim_servo *servo;
	int64_t encoder;

	if (!sim_order_integer(order, 0, "encoder", 0, SIM_ENCODERS - 1, &encoder))
		return false;
	if (order->word[1] && !change_motor(order, (unsigned int)encoder))
		return false;
	servo = &order->dev->bench.servo[encoder];
	if (!servo->fitted) {
		sim_text_add(order->out, "fitted=0\n");
		return true;
	}
	sim_text_add(order->out, "fitted=1\nturns=%.4f\nrpm=%.1f\ncount=%d\noutput=%.4f\n",
		     servo->motor.load / (2 * M_PI), servo->motor.speed * 30 / M_PI, servo->count,
		     sim_servo_output(order->dev, (unsigned int)encoder));
	return true;
}

/* probe AXIS FROM TO [nc|no] pin N | input N */
static bool do_probe(struct sim_order *order)
{
	struct sim_machine *machine = &order->dev->bench.machine;
	struct sim_switch sw = { 0 };
	unsigned int axis, where;
	int64_t number;
	int at;

	if (order->word[0] && !strcmp(order->word[0], "off")) {
		if (!sim_order_no_more(order, 1))
			return false;
		sim_bench_switch(order->dev, &machine->probe, &sw);
		return true;
	}
	if (!axis_word(order, 0, &axis))
		return false;
	at = interval(order, 1, &sw);
	if (!at || !sim_order_choice(order, at, "place", "pin|input", &where) ||
	    !sim_order_integer(order, at + 1, "number", 1, where ? 8 : SIM_PINS, &number) ||
	    !sim_order_no_more(order, at + 2))
		return false;
	sw.pin = (uint8_t)(where ? SIM_PROBE_INPUT + number : number - 1);
	machine->probe_axis = (uint8_t)axis;
	sim_bench_switch(order->dev, &machine->probe, &sw);
	return true;
}

static bool do_emergency(struct sim_order *order)
{
	struct sim_machine *machine = &order->dev->bench.machine;
	unsigned int what;

	if (order->word[0]) {
		if (!sim_order_choice(order, 0, "what", "released|pressed|nc|no|off", &what) ||
		    !sim_order_no_more(order, 1))
			return false;
		if (what >= 2) {
			machine->emergency_open = what == 3;
			machine->emergency_wired = what != 4;
		}
		sim_bench_emergency(order->dev, what >= 2 ? machine->emergency_pressed : what);
	}
	sim_text_add(order->out, "pressed=%d\nactive=%d\n", machine->emergency_pressed,
		     sim_engine_emergency(order->dev));
	return true;
}

static bool bit_command(struct sim_order *order, const char *what, int64_t low, int64_t high,
			uint8_t *bits)
{
	unsigned int on;
	int64_t number;
	uint8_t bit;

	if (!sim_order_integer(order, 0, what, low, high, &number) ||
	    !sim_order_choice(order, 1, "state", "0|1", &on) || !sim_order_no_more(order, 2))
		return false;
	bit = (uint8_t)(1u << (number - low));
	*bits = (uint8_t)(on ? *bits | bit : *bits & ~bit);
	return true;
}

static bool do_driver_error(struct sim_order *order)
{
	return bit_command(order, "axis", 0, SIM_AXES - 1, &order->dev->bench.machine.driver_error);
}

static bool do_input(struct sim_order *order)
{
	return bit_command(order, "input", 1, 8, &order->dev->bench.machine.misc);
}

static bool do_raw(struct sim_order *order)
{
	struct sim_machine *machine = &order->dev->bench.machine;
	unsigned int axis, which, level;
	uint8_t *bits;
	uint8_t bit;

	if (!axis_word(order, 0, &axis) ||
	    !sim_order_choice(order, 1, "input", "minus|plus|home", &which) ||
	    !sim_order_choice(order, 2, "level", "0|1", &level) || !sim_order_no_more(order, 3))
		return false;
	bits = which == 0 ? &machine->raw_minus :
			    (which == 1 ? &machine->raw_plus : &machine->raw_home);
	bit = (uint8_t)(1u << axis);
	*bits = (uint8_t)(level ? *bits | bit : *bits & ~bit);
	return true;
}

static bool do_mismatch(struct sim_order *order)
{
	unsigned int axis;
	int64_t steps;

	if (!axis_word(order, 0, &axis) ||
	    !sim_order_integer(order, 1, "steps", INT16_MIN, INT16_MAX, &steps) ||
	    !sim_order_no_more(order, 2))
		return false;
	order->dev->bench.machine.mismatch[axis] = (int16_t)steps;
	return true;
}

static bool do_engine(struct sim_order *order)
{
	const struct sim_engine *pe = &order->dev->engine;

	if (!sim_order_no_more(order, 0))
		return false;
	sim_engine_read_switches(order->dev);
	sim_text_add(order->out,
		     "state=%u\naxes=%u\nminus=0x%02x\nplus=0x%02x\nhome=0x%02x\n"
		     "soft=0x%02x\noverride=%u\nrelays=0x%02x\noutputs=0x%02x\n"
		     "ring=%u\nunderruns=%llu\nprobe=0x%02x\n",
		     pe->state, order->dev->config.engine.axes, pe->minus, pe->plus, pe->home,
		     pe->soft_limited, pe->override, pe->relays, pe->outputs, pe->ring.used,
		     (unsigned long long)pe->ring.underruns, pe->probe_status);
	return true;
}

const struct sim_command sim_commands_motion[] = {
	{ "axis", "A [machine POSITION | couple ENCODER STEPS PULSES [INDEX_EVERY] | decouple]",
	  "show an axis; put its machine somewhere; fasten an encoder to it", do_axis },
	{ "switch", "A minus|plus|home off | FROM TO [nc|no] [PIN]",
	  "a switch of the machine, actuated from FROM to TO", do_switch },
	{ "motor",
	  "K [sign CHANNEL PIN [PIN] | antiphase CHANNEL PIN | two-pwm CHANNEL CHANNEL"
	  " [PIN] | none | good|stalled|reversed|silent|cut | push MNM | minus|plus|home off"
	  " | minus|plus|home FROM TO [nc|no] PIN]",
	  "a motor that turns encoder K, enabled by the last PIN; its switches", do_motor },
	{ "probe", "off | A FROM TO [nc|no] pin|input N", "what the probe touches", do_probe },
	{ "emergency", "[pressed|released|nc|no|off]", "the emergency button", do_emergency },
	{ "driver-error", "A 0|1", "error input of a motor driver", do_driver_error },
	{ "input", "N 0|1", "external input 1..8 of the engine", do_input },
	{ "raw", "A minus|plus|home 0|1", "level of a dedicated input nothing is wired to",
	  do_raw },
	{ "mismatch", "A STEPS", "steps lost, as the smart generator sees it", do_mismatch },
	{ "engine", "", "show the pulse engine", do_engine },
	{ 0 },
};
