// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Commands for pins, encoders, analog inputs and keys. Pins are counted from 1
 * here and from 0 everywhere else, because whoever types them has the board
 * before his eyes; pin_word() is the one place of the conversion.
 */
#include "sim/control_part.h"

#include <math.h>
#include <string.h>

static bool pin_word(struct sim_order *order, int i, unsigned int *pin)
{
	int64_t number;

	if (!sim_order_integer(order, i, "pin", 1, SIM_PINS, &number))
		return false;
	*pin = (unsigned int)number - 1;
	return true;
}

static bool do_pin(struct sim_order *order)
{
	unsigned int pin, level;

	if (!pin_word(order, 0, &pin))
		return false;
	if (order->word[1]) {
		if (!sim_order_choice(order, 1, "level", "0|1", &level) ||
		    !sim_order_no_more(order, 2))
			return false;
		sim_bench_pin(order->dev, pin, level);
	}
	sim_text_add(order->out, "level=%u\nlatch=%u\nfunction=0x%02x\n",
		     sim_pin_level(order->dev, pin),
		     (unsigned int)(order->dev->pins.latch >> pin & 1),
		     order->dev->config.pins.function[pin]);
	return true;
}

static bool do_wire(struct sim_order *order)
{
	unsigned int from, to;

	if (!pin_word(order, 0, &from) || !pin_word(order, 1, &to) || !sim_order_no_more(order, 2))
		return false;
	sim_bench_wire(order->dev, from, to);
	return true;
}

static bool do_unwire(struct sim_order *order)
{
	unsigned int to;

	if (!pin_word(order, 0, &to) || !sim_order_no_more(order, 1))
		return false;
	sim_bench_wire(order->dev, SIM_NO_PIN, to);
	return true;
}

static bool do_blink(struct sim_order *order)
{
	unsigned int pin;
	int64_t ms;

	if (!pin_word(order, 0, &pin) ||
	    !sim_order_integer(order, 1, "half period in ms", 0, 3600000, &ms) ||
	    !sim_order_no_more(order, 2))
		return false;
	sim_bench_blink(order->dev, pin, (uint32_t)ms);
	return true;
}

static bool do_function(struct sim_order *order)
{
	unsigned int pin;
	int64_t function;

	if (!pin_word(order, 0, &pin) ||
	    !sim_order_integer(order, 1, "function byte", 0, 255, &function) ||
	    !sim_order_no_more(order, 2))
		return false;
	order->dev->config.pins.function[pin] = (uint8_t)function;
	sim_pins_settle(order->dev);
	return true;
}

static bool do_inputs(struct sim_order *order)
{
	uint64_t inputs = sim_pins_inputs(order->dev);

	if (!sim_order_no_more(order, 0))
		return false;
	sim_text_add(order->out, "inputs=0x%014llx\nlatch=0x%014llx\nlevel=0x%014llx\n",
		     (unsigned long long)inputs, (unsigned long long)order->dev->pins.latch,
		     (unsigned long long)order->dev->pins.level);
	return true;
}

static bool do_counter(struct sim_order *order)
{
	unsigned int pin;
	int64_t add;

	if (!pin_word(order, 0, &pin))
		return false;
	if (order->word[1]) {
		if (!sim_order_integer(order, 1, "counts", INT32_MIN, INT32_MAX, &add) ||
		    !sim_order_no_more(order, 2))
			return false;
		order->dev->pins.counter[pin] += (uint32_t)add;
	}
	sim_text_add(order->out, "counter=%u\n", order->dev->pins.counter[pin]);
	return true;
}

static bool encoder_word(struct sim_order *order, unsigned int *encoder)
{
	int64_t number;

	if (!sim_order_integer(order, 0, "encoder", 0, SIM_ENCODERS - 1, &number))
		return false;
	*encoder = (unsigned int)number;
	return true;
}

/* encoder K [count N | turn N | rate N | index-every N] */
static bool do_encoder(struct sim_order *order)
{
	unsigned int k, what;
	int64_t n;

	if (!encoder_word(order, &k))
		return false;
	if (order->word[1]) {
		if (!sim_order_choice(order, 1, "what", "count|turn|rate|index-every", &what) ||
		    !sim_order_integer(order, 2, "number", INT32_MIN, INT32_MAX, &n) ||
		    !sim_order_no_more(order, 3))
			return false;
		if (what == 0)
			sim_bench_encoder(order->dev, k, (uint32_t)n);
		else if (what == 1)
			sim_encoder_turn(order->dev, k, n);
		else if (what == 2)
			order->dev->bench.shaft[k].rate = n;
		else
			order->dev->bench.shaft[k].index_every = n;
	}
	sim_text_add(order->out, "count=%d\nshaft=%lld\n", (int32_t)order->dev->encoders.raw[k],
		     (long long)order->dev->bench.shaft[k].position);
	return true;
}

static bool do_index(struct sim_order *order)
{
	unsigned int k;

	if (!encoder_word(order, &k) || !sim_order_no_more(order, 1))
		return false;
	sim_encoder_index(order->dev, k);
	return true;
}

/* The spindle's shaft, that of the ultra-fast encoder: spindle [RPM [STEPS]] */
static bool do_spindle(struct sim_order *order)
{
	static const char *const states[] = {
		"off", "preparing", "prepared", "waiting", "active", "releasing",
	};
	struct sim_shaft *shaft = &order->dev->bench.shaft[SIM_ULTRA_FAST];
	const struct sim_thread *thread = &order->dev->engine.thread;
	int64_t rpm = 0, steps = shaft->index_every;

	if (order->word[0]) {
		if (!sim_order_integer(order, 0, "rpm", -100000, 100000, &rpm) ||
		    (order->word[1] &&
		     !sim_order_integer(order, 1, "steps of a turn", 4, 1000000, &steps)) ||
		    !sim_order_no_more(order, 2))
			return false;
		sim_bench_spindle(order->dev, rpm, steps);
	}
	sim_text_add(order->out,
		     "rpm=%lld\nsteps=%lld\nindexes=%u\nthreading=%s\n"
		     "played=%.3f\ndry=%llu\nignored=%llu\n",
		     shaft->index_every ?
			     llround(60.0 * (double)shaft->rate / (double)shaft->index_every) :
			     0,
		     (long long)shaft->index_every, thread->index_count, states[thread->state],
		     thread->played, (unsigned long long)thread->dry,
		     (unsigned long long)thread->ignored);
	return true;
}

/* analog PIN VALUE, or analog PIN wave LOW HIGH PERIOD_MS */
static bool do_analog(struct sim_order *order)
{
	struct sim_source source = { 0 };
	int64_t pin, low, high = 0, period = 0;
	int at = 1;

	if (!sim_order_integer(order, 0, "pin", SIM_FIRST_ANALOG_PIN + 1,
			       SIM_FIRST_ANALOG_PIN + SIM_ANALOGS, &pin))
		return false;
	if (order->word[1]) {
		bool wave = !strcmp(order->word[1], "wave");

		at += wave;
		if (!sim_order_integer(order, at++, "value", 0, SIM_ANALOG_MAX, &low))
			return false;
		if (wave && (!sim_order_integer(order, at++, "high", 0, SIM_ANALOG_MAX, &high) ||
			     !sim_order_integer(order, at++, "period in ms", 2, 3600000, &period)))
			return false;
		if (!sim_order_no_more(order, at))
			return false;
		source.low = (uint16_t)low;
		source.high = (uint16_t)high;
		source.period_ms = (uint32_t)period;
		order->dev->bench.analog[pin - SIM_FIRST_ANALOG_PIN - 1] = source;
	}
	sim_text_add(order->out, "value=%u\n",
		     sim_analog_value(order->dev, (unsigned int)pin - SIM_FIRST_ANALOG_PIN - 1));
	return true;
}

#define OVEN_STATES "good|open|short|stuck|drift|out"
#define OVEN_KINDS "hotend|bed|none"

static bool fit_oven(struct sim_order *order, unsigned int input, unsigned int kind)
{
	static const struct sim_heat_config *const kinds[] = { &sim_heat_hotend, &sim_heat_bed };
	unsigned int by_pin;
	int64_t output;

	if (kind >= sizeof(kinds) / sizeof(kinds[0])) {
		if (!sim_order_no_more(order, 2))
			return false;
		sim_oven_remove(order->dev, input);
		return true;
	}
	if (!sim_order_choice(order, 2, "output", "pwm|pin", &by_pin) ||
	    !sim_order_integer(order, 3, by_pin ? "pin" : "channel", by_pin ? 1 : 0,
			       by_pin ? SIM_PINS : 5, &output) ||
	    !sim_order_no_more(order, 4))
		return false;
	sim_oven_fit(order->dev, input, kinds[kind], !by_pin,
		     (unsigned int)output - (by_pin ? 1 : 0));
	return true;
}

/* The sensor becomes so; drift takes thousandths of a kelvin a second. */
static bool break_oven(struct sim_order *order, struct sim_heat *heat, unsigned int state)
{
	const bool drifts = state == SIM_HEAT_DRIFT;
	int64_t drift = 0;

	if (drifts && !sim_order_integer(order, 2, "drift in mK/s", -100000, 100000, &drift))
		return false;
	if (!sim_order_no_more(order, drifts ? 3 : 2))
		return false;
	sim_heat_break(heat, (enum sim_heat_fault)state);
	heat->drift = (double)drift / 1000;
	return true;
}

static bool change_oven(struct sim_order *order, unsigned int input)
{
	struct sim_oven *oven = &order->dev->bench.oven[input];
	unsigned int word;

	if (!sim_order_choice(order, 1, "change", OVEN_KINDS "|" OVEN_STATES "|fan", &word))
		return false;
	if (word < 3)
		return fit_oven(order, input, word);
	if (!oven->fitted) {
		sim_text_add(order->why, "nothing is fitted to this pin; fit a hotend or a bed "
					 "first");
		return false;
	}
	if (word < 9)
		return break_oven(order, &oven->heat, word - 3);
	if (!sim_order_choice(order, 2, "fan", "0|1", &word) || !sim_order_no_more(order, 3))
		return false;
	oven->fan = word;
	return true;
}

static bool do_heat(struct sim_order *order)
{
	const struct sim_oven *oven;
	int64_t pin;

	if (!sim_order_integer(order, 0, "pin", SIM_FIRST_ANALOG_PIN + 1,
			       SIM_FIRST_ANALOG_PIN + SIM_ANALOGS, &pin))
		return false;
	if (order->word[1] && !change_oven(order, (unsigned int)pin - SIM_FIRST_ANALOG_PIN - 1))
		return false;
	oven = &order->dev->bench.oven[pin - SIM_FIRST_ANALOG_PIN - 1];
	if (!oven->fitted) {
		sim_text_add(order->out, "fitted=0\n");
		return true;
	}
	sim_text_add(order->out, "fitted=1\nblock=%.1f\nsensor=%.1f\npower=%.3f\n",
		     oven->heat.block, oven->heat.sensor,
		     sim_oven_power(order->dev, (unsigned int)pin - SIM_FIRST_ANALOG_PIN - 1));
	return true;
}

static bool do_pwm(struct sim_order *order)
{
	const struct sim_pwm_config *pwm = &order->dev->config.pwm;

	if (!sim_order_no_more(order, 0))
		return false;
	sim_text_add(order->out, "enabled=0x%02x\nperiod=%u\n", pwm->enabled, pwm->period);
	for (int i = 0; i < 6; i++)
		sim_text_add(order->out, "duty.%d=%u\n", i, pwm->duty[i]);
	return true;
}

static bool do_key(struct sim_order *order)
{
	unsigned int pressed;
	uint8_t bit;
	int64_t key;

	if (!sim_order_integer(order, 0, "key", 0, SIM_KEYS - 1, &key) ||
	    !sim_order_choice(order, 1, "state", "0|1", &pressed) || !sim_order_no_more(order, 2))
		return false;
	bit = (uint8_t)(1u << (key % 8));
	if (pressed)
		order->dev->bench.keys[key / 8] |= bit;
	else
		order->dev->bench.keys[key / 8] &= (uint8_t)~bit;
	return true;
}

static bool do_lcd(struct sim_order *order)
{
	if (!sim_order_no_more(order, 0))
		return false;
	for (int row = 0; row < SIM_LCD_ROWS; row++)
		sim_text_add(order->out, "row.%d=%.*s\n", row, SIM_LCD_COLUMNS,
			     order->dev->panel.text[row]);
	return true;
}

static bool do_matrix(struct sim_order *order)
{
	if (!sim_order_no_more(order, 0))
		return false;
	for (int display = 0; display < SIM_LEDS; display++) {
		sim_text_add(order->out, "display.%d=", display);
		for (int row = 0; row < 8; row++)
			sim_text_add(order->out, "%02x", order->dev->panel.led[display][row]);
		sim_text_add(order->out, "\n");
	}
	return true;
}

const struct sim_command sim_commands_io[] = {
	{ "pin", "N [0|1]", "drive pin N from outside; shows its level and output latch", do_pin },
	{ "wire", "FROM TO", "lead the level of pin FROM to pin TO", do_wire },
	{ "unwire", "TO", "cut the wire to pin TO", do_unwire },
	{ "blink", "N MS", "toggle pin N every MS milliseconds, 0 stops", do_blink },
	{ "function", "N BYTE", "configure pin N, as command 0x10 would", do_function },
	{ "inputs", "", "inputs as reported, output latches, levels", do_inputs },
	{ "counter", "N [COUNTS]", "add to the digital counter of pin N", do_counter },
	{ "encoder", "K [count|turn|rate|index-every N]",
	  "set the counter, turn the shaft by or at quadrature steps (per second)", do_encoder },
	{ "index", "K", "one index pulse of encoder K", do_index },
	{ "spindle", "[RPM [STEPS]]",
	  "turn the spindle, with an index every STEPS quadrature steps (4096)", do_spindle },
	{ "analog", "PIN [VALUE | wave LOW HIGH PERIOD_MS]", "0..4095 at pin 41..47", do_analog },
	{ "heat",
	  "PIN [hotend|bed pwm|pin N | none | good|open|short|stuck|drift MK|out"
	  " | fan 0|1]",
	  "a heated block with its sensor at pin 41..47", do_heat },
	{ "pwm", "", "PWM channels", do_pwm },
	{ "key", "K 0|1", "key 0..127 of the matrix keyboard", do_key },
	{ "lcd", "", "text on the display", do_lcd },
	{ "matrix", "", "LED matrices, a byte for each row", do_matrix },
	{ 0 },
};
