// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The inside of the device by name: what it is configured as and what it
 * counts, read and changed without a request over the wire. So a test compares
 * what arrived in the device with what it asked for, by numbers that no encoder
 * of ours has made, and moves what no hand on the bench can reach (a state, a
 * probed position).
 *
 * Bytes are shown as the protocol has them, in hexadecimal and in one word; a
 * block of an axis counts from byte 8 of its request.
 */
#include "sim/control_part.h"

#include <stddef.h>
#include <string.h>

#include "sim/engine_part.h"

enum kind {
	BYTES,    /* uint8_t */
	WORDS,    /* uint32_t */
	INTEGERS, /* int32_t */
	LONGS,    /* int64_t */
	HALVES,   /* uint16_t */
};

struct field {
	const char *name;
	enum kind kind;
	uint16_t count;  /* values in a row */
	uint16_t rows;   /* 0: one without a number */
	uint32_t stride; /* from row to row, bytes */
	size_t at;
};

#define AT(member_)	.at = offsetof(struct sim_device, member_)
#define SIZE(member_)	sizeof(((struct sim_device *)0)->member_)
#define BYTE(name_, member_)	{ name_, BYTES, SIZE(member_), 0, 0, AT(member_) }
#define ONE(name_, kind_, member_)	{ name_, kind_, 1, 0, 0, AT(member_) }
#define MANY(name_, kind_, member_) \
	{ name_, kind_, SIZE(member_) / SIZE(member_[0]), 0, 0, AT(member_) }
#define ROWS(name_, kind_, count_, rows_, array_, member_) \
	{ name_, kind_, count_, rows_, SIZE(array_[0]), AT(array_[0] member_) }

static const struct field fields[] = {
	BYTE("pin.function", config.pins.function),
	MANY("pin.counter", WORDS, pins.counter),
	BYTE("encoder.option", config.encoders.option),
	BYTE("encoder.pins", config.encoders.pins),
	BYTE("encoder.fast", config.encoders.fast),
	BYTE("encoder.fast-index", config.encoders.fast_index),
	BYTE("encoder.ultra", config.encoders.ultra_on),
	BYTE("encoder.ultra-options", config.encoders.ultra_options),
	ONE("encoder.ultra-filter", WORDS, config.encoders.ultra_filter),
	BYTE("encoder.ultra-armed", encoders.ultra_armed),
	MANY("encoder.raw", WORDS, encoders.raw),
	ONE("analog.filter", WORDS, config.analog_filter),
	BYTE("pwm.enabled", config.pwm.enabled),
	ONE("pwm.period", WORDS, config.pwm.period),
	MANY("pwm.duty", WORDS, config.pwm.duty),
	BYTE("engine.axes", config.engine.axes),
	BYTE("engine.charge-pump", config.engine.charge_pump),
	BYTE("engine.generator", config.engine.generator),
	BYTE("engine.emergency-invert", config.engine.emergency_invert),
	BYTE("engine.emergency-pin", config.engine.emergency_pin),
	BYTE("engine.power-states", config.engine.power_states),
	BYTE("engine.backlash-enable", config.engine.backlash_enable),
	BYTE("engine.backlash-speed", config.engine.backlash_speed),
	BYTE("engine.backlash", config.engine.backlash),
	BYTE("engine.synced-pwm", config.engine.synced_pwm),
	BYTE("engine.synced-outputs", config.engine.synced_out),
	BYTE("engine.synced-pins", config.engine.synced_pins),
	BYTE("engine.thread", config.engine.thread),
	BYTE("engine.postep", config.engine.postep_enable),
	BYTE("engine.postep-drivers", config.engine.postep_comm),
	BYTE("engine.postep-modes", config.engine.postep_mode),
	BYTE("engine.state", engine.state),
	ONE("engine.reboot-ms", WORDS, engine.reboot_ms),
	BYTE("engine.generator-in-effect", engine.generator),
	BYTE("engine.power-in-effect", engine.power_states),
	BYTE("engine.slots", bench.machine.told_slots),
	BYTE("engine.slot-time", bench.machine.told_slot_time),
	BYTE("engine.override", engine.override),
	BYTE("engine.output-mask", engine.output_mask),
	BYTE("engine.soft-limited", engine.soft_limited),
	BYTE("engine.relays", engine.relays),
	BYTE("engine.outputs", engine.outputs),
	BYTE("engine.home-mask", engine.home_mask),
	BYTE("engine.probe-mask", engine.probe_mask),
	BYTE("engine.probe-status", engine.probe_status),
	MANY("engine.probe-position", INTEGERS, engine.probe_position),
	ROWS("postep.powered", BYTES, 1, SIM_AXES, bench.postep, .powered),
	ROWS("postep.address", BYTES, 1, SIM_AXES, bench.postep, .address),
	ROWS("postep.supply", BYTES, 1, SIM_AXES, bench.postep, .supply),
	ROWS("postep.temperature", BYTES, 1, SIM_AXES, bench.postep, .temperature),
	ROWS("postep.inputs", BYTES, 1, SIM_AXES, bench.postep, .inputs),
	ROWS("postep.state", BYTES, 1, SIM_AXES, bench.postep, .state),
	ROWS("postep.faults", BYTES, 1, SIM_AXES, bench.postep, .faults),
	ROWS("postep.mode", BYTES, 1, SIM_AXES, bench.postep, .mode),
	ROWS("postep.step", BYTES, 1, SIM_AXES, bench.postep, .step),
	ROWS("postep.limit", BYTES, 1, SIM_AXES, bench.postep, .limit),
	ROWS("postep.current", HALVES, 3, SIM_AXES, bench.postep, .current),
	ROWS("postep.version", BYTES, 4, SIM_AXES, bench.postep, .version),
	ROWS("postep.saved", BYTES, 1, SIM_AXES, bench.postep, .saved),
	ROWS("axis.back-compensation", INTEGERS, 1, SIM_AXES, engine.axis, .back_compensation),
	ROWS("axis.motor", LONGS, 1, SIM_AXES, bench.machine.axis, .position),
	ROWS("axis.block", BYTES, SIM_AXIS_BLOCK, SIM_AXES, config.engine.axis, ),
	ROWS("axis.state", BYTES, 1, SIM_AXES, engine.axis, .state),
	ROWS("axis.pulses", LONGS, 1, SIM_AXES, engine.axis, .pulses),
	ROWS("axis.reference", INTEGERS, 1, SIM_AXES, engine.axis, .reference),
	ROWS("axis.home-offset", INTEGERS, 1, SIM_AXES, engine.axis, .home_offset),
	ROWS("axis.target", INTEGERS, 1, SIM_AXES, engine.axis, .target),
	BYTE("poextbus.data", bus.poext),
	BYTE("poextbus.connector", config.bus.poext_connector),
	BYTE("poextbus.no-crc", config.bus.poext_no_crc),
	BYTE("ponet.state", bus.modules.state),
	BYTE("ponet.brightness", bus.modules.pwm),
	ROWS("ponet.out", BYTES, SIM_MODULE_BYTES, SIM_MODULES, bus.modules.out, ),
	ROWS("ponet.in", BYTES, SIM_MODULE_BYTES, SIM_MODULES, bench.bus.module, .in),
	ROWS("ponet.type", BYTES, 1, SIM_MODULES, bench.bus.module, .type),
	ROWS("ponet.address", BYTES, 1, SIM_MODULES, bench.bus.module, .address),
	ROWS("ponet.size", BYTES, 1, SIM_MODULES, bench.bus.module, .size),
	ROWS("ponet.version", BYTES, 1, SIM_MODULES, bench.bus.module, .version),
	ROWS("ponet.status", BYTES, 1, SIM_MODULES, bench.bus.module, .status),
	BYTE("ponet.options", config.bus.module_options),
	BYTE("keyboard", config.panel.keyboard),
	BYTE("keys", bench.keys),
	BYTE("failsafe.timeout", config.failsafe.timeout),
	BYTE("failsafe.parts", config.failsafe.peripherals),
	BYTE("failsafe.outputs", config.failsafe.outputs),
	BYTE("failsafe.poextbus", config.failsafe.poext),
	BYTE("failsafe.pwm", config.failsafe.pwm),
	BYTE("device.user-id", config.identity.user_id),
	BYTE("device.locked", config.identity.locked),
	BYTE("device.activated", config.identity.activated),
	BYTE("device.access", run.security_level),
	BYTE("device.clock-rule", config.clock.rule),
	ONE("device.clock", LONGS, run.clock_s),
};

#define FIELDS (sizeof(fields) / sizeof(fields[0]))

static uint8_t *place(const struct sim_order *order, const struct field *field, unsigned int row)
{
	return (uint8_t *)order->dev + field->at + (size_t)row * field->stride;
}

static long long load(const struct field *field, const uint8_t *at, unsigned int i)
{
	switch (field->kind) {
	case WORDS:
		return ((const uint32_t *)(const void *)at)[i];
	case INTEGERS:
		return ((const int32_t *)(const void *)at)[i];
	case LONGS:
		return ((const int64_t *)(const void *)at)[i];
	case HALVES:
		return ((const uint16_t *)(const void *)at)[i];
	case BYTES:
		break;
	}
	return at[i];
}

static void store(const struct field *field, uint8_t *at, unsigned int i, int64_t value)
{
	switch (field->kind) {
	case WORDS:
		((uint32_t *)(void *)at)[i] = (uint32_t)value;
		return;
	case INTEGERS:
		((int32_t *)(void *)at)[i] = (int32_t)value;
		return;
	case LONGS:
		((int64_t *)(void *)at)[i] = value;
		return;
	case HALVES:
		((uint16_t *)(void *)at)[i] = (uint16_t)value;
		return;
	case BYTES:
		at[i] = (uint8_t)value;
	}
}

static void show_row(struct sim_order *order, const struct field *field, unsigned int row)
{
	const uint8_t *at = place(order, field, row);

	if (field->rows)
		sim_text_add(order->out, "%s.%u=", field->name, row);
	else
		sim_text_add(order->out, "%s=", field->name);
	if (field->kind == BYTES)
		sim_text_add(order->out, "0x");
	for (unsigned int i = 0; i < field->count; i++) {
		if (field->kind == BYTES)
			sim_text_add(order->out, "%02x", at[i]);
		else
			sim_text_add(order->out, "%s%lld", i ? "," : "", load(field, at, i));
	}
	sim_text_add(order->out, "\n");
}

static void show(struct sim_order *order, const struct field *field)
{
	unsigned int row = 0;

	do
		show_row(order, field, row);
	while (++row < field->rows);
}

static const struct field *find(struct sim_order *order)
{
	for (size_t i = 0; i < FIELDS; i++) {
		if (!strcmp(fields[i].name, order->word[0]))
			return &fields[i];
	}
	sim_text_add(order->why, "'%.60s' is no field", order->word[0]);
	return NULL;
}

/* Everything that is made of what stands in the fields. */
static void take(struct sim_device *dev, const struct field *field)
{
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		struct sim_axis *axis = &dev->engine.axis[i];

		if (!strcmp(field->name, "axis.block"))
			sim_axis_load(dev, i);
		if (!strcmp(field->name, "axis.pulses"))
			axis->planner.position = (double)axis->pulses;
	}
	sim_pins_settle(dev);
}

static bool do_field(struct sim_order *order)
{
	static const int64_t low[] = { 0, 0, INT32_MIN, INT64_MIN, 0 };
	static const int64_t high[] = { UINT8_MAX, UINT32_MAX, INT32_MAX, INT64_MAX, UINT16_MAX };
	const struct field *field;
	int64_t index, value;
	unsigned int places;

	if (!order->word[0]) {
		for (size_t i = 0; i < FIELDS; i++)
			show(order, &fields[i]);
		return true;
	}
	field = find(order);
	if (!field)
		return false;
	if (!order->word[1]) {
		show(order, field);
		return true;
	}
	places = field->count * (field->rows ? field->rows : 1u);
	if (!sim_order_integer(order, 1, "index", 0, places - 1, &index) ||
	    !sim_order_integer(order, 2, "value", low[field->kind], high[field->kind], &value) ||
	    !sim_order_no_more(order, 3))
		return false;
	store(field, place(order, field, (unsigned int)index / field->count),
	      (unsigned int)index % field->count, value);
	take(order->dev, field);
	return true;
}

const struct sim_command sim_commands_field[] = {
	{ "field", "[NAME [INDEX VALUE]]", "show the values inside the device; change one of them",
	  do_field },
	{ 0 },
};
