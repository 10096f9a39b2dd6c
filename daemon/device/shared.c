/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Terminals that this board uses twice, or that lack the configured function on it.
 *
 * pokeysd.conf was judged before the device was known, and by itself: what only some
 * boards cannot do, what a commander wishes besides, and what the device still has from
 * somebody else (a generator, an encoder) could not be seen. Nothing is refused here: what
 * the device makes of it is not documented, and it may have been wired so for years.
 */
#include <string.h>
#include "daemon/device/internal.h"
#include "daemon/device/wish.h"

static uint64_t by_name(const struct device_config *config)
{
	const uint64_t pins = pins_load(config->resume_outputs) & OUTPUT_PINS;

	return config->resume_auto || pins == OUTPUT_PINS ? 0 : pins;
}

static bool is_same(const struct shared_pair *pair, const struct terminal_conflict *conflict)
{
	return pair->a == conflict->a.number && pair->b == conflict->b.number &&
	       pair->terminals == conflict->terminals;
}

static bool is_told(const struct shared *before, const struct terminal_conflict *conflict)
{
	for (size_t i = 0; i < before->count; i++)
		if (is_same(&before->pair[i], conflict))
			return true;
	return false;
}

/* What a terminal listens to that nobody asks for excludes nothing. */
static void forget_inputs(struct pokeys_settings *device)
{
	for (unsigned int i = 0; i < POKEYS_PINS; i++)
		if (!(device->pin_function[i] & WIRE_PIN_OUTPUT))
			device->pin_set[i / 8] &= (uint8_t)~(1u << i % 8);
}

static unsigned int function_of(uint8_t pin)
{
	return pin & WIRE_PIN_COUNTER   ? WIRE_PIN_COUNTER :
	       pin & WIRE_PIN_ANALOG_IN ? WIRE_PIN_ANALOG_IN :
					  pin & (WIRE_PIN_INPUT | WIRE_PIN_OUTPUT);
}

/* The device accepts any function for any terminal without an error. */
static void tell_absent(struct device *device, const struct pokeys_settings *wanted,
			const struct wire_pinmap *board)
{
	const struct {
		unsigned int function;
		uint64_t there;
	} kind[SHARED_FUNCTIONS] = {
		{ WIRE_PIN_INPUT, board->digital_in },
		{ WIRE_PIN_OUTPUT, board->digital_out },
		{ WIRE_PIN_ANALOG_IN, board->analog_in },
		{ WIRE_PIN_COUNTER, board->counter },
	};
	const uint64_t set = pins_load(wanted->pin_set) & OUTPUT_PINS;

	if (!board->digital_in)
		return; /* nobody knows what its terminals can do */
	for (unsigned int k = 0; k < SHARED_FUNCTIONS; k++) {
		const uint64_t told = device->shared.absent[k];
		uint64_t absent = 0;

		for (unsigned int i = 0; i < POKEYS_PINS; i++)
			if (function_of(wanted->pin_function[i]) == kind[k].function)
				absent |= UINT64_C(1) << i;
		absent &= set & ~kind[k].there;
		device->shared.absent[k] = absent;
		if (absent & ~told)
			device_say(device, EVENT_TERMINALS_ABSENT, EVENT_WARNING,
				   (int64_t)(absent & ~told), kind[k].function, 0);
	}
}

void shared_pwm(struct device *device, uint32_t channels)
{
	if (!(channels & ~device->shared.pwm))
		return;
	device->shared.pwm |= channels;
	device->wishes.changed = true;
}

void shared_tell(struct device *device, const struct pokeys_report *report)
{
	const struct device_config *config = &device->config;
	struct terminal_daemon daemon = {
		.safe_on = pins_load(config->safe_mask) & pins_load(config->safe_outputs),
		.safe_hold = pins_load(config->safe_hold),
		.resume = by_name(config),
		.pwm = device->shared.pwm,
	};
	const struct wire_pinmap *board = wire_model(device->image.identity.hardware)->pinmap;
	const struct shared before = device->shared;
	struct terminal_conflict conflict[TERMINAL_CONFLICTS_MAX];
	struct pokeys_settings settings = report->device;
	size_t count;

	if (!running(device) ||
	    (report->state != POKEYS_CONFIG_APPLIED && report->state != POKEYS_CONFIG_REFUSED))
		return;
	heating_terminals(config->heater, config->heaters, &daemon);
	servoing_terminals(config->servo, config->servos, &daemon);
	forget_inputs(&settings);
	wish_lay(&settings, &report->wanted);
	count = terminal_conflicts(&settings, &daemon, board, conflict);
	loops_unshare(device);
	for (size_t i = 0; i < count; i++) {
		/* at the terminal of a loop's output it is refused; a switch is only told of */
		if (conflict[i].b.kind == TERMINAL_COMMANDED)
			continue;
		loops_share(device, conflict[i].a.key, conflict[i].a.index);
		loops_share(device, conflict[i].b.key, conflict[i].b.index);
	}
	device->shared.count = 0;
	for (size_t i = 0; i < count && i < SHARED_MAX; i++) {
		const struct terminal_conflict *c = &conflict[i];

		device->shared.pair[device->shared.count++] = (struct shared_pair){
			c->terminals,
			c->a.number,
			c->b.number,
		};
		if (!is_told(&before, c))
			device_say(device, EVENT_TERMINALS_SHARED, EVENT_WARNING,
				   (int64_t)c->terminals, c->a.number, c->b.number);
	}
	tell_absent(device, &report->wanted, board);
}
