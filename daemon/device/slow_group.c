/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the slow groups are: how often, whether this device has it, the request,
 * and where its answer goes (protocol section 3.25).
 *
 * Of what we write ourselves a reading only counts when it was asked for after
 * the last write had ended, or an overtaken packet would undo a value.
 */

#include <string.h>
#include "daemon/device/internal.h"

enum { LOW_ROWS = 8 }; /* of the matrix keyboard, in 0xCC */

static double encoder_hertz(const struct device_config *config)
{
	return config->encoder_hz;
}

static double analog_hertz(const struct device_config *config)
{
	return config->analog_hz;
}

static double slow_hertz(const struct device_config *config)
{
	return config->slow_hz;
}

static double rare_hertz(const struct device_config *config)
{
	return config->slow_hz / 5;
}

static double bus_hertz(const struct device_config *config)
{
	return config->slow_hz * 4;
}

/* A reading takes two requests at least. */
static double ponet_hertz(const struct device_config *config)
{
	return config->analog_hz * 2;
}

/* Encoders in 32 bits, 0xCD. */

#define BANK_MASK ((UINT32_C(1) << WIRE_ENCODER_BANK) - 1)
#define BASIC_MASK ((UINT32_C(1) << WIRE_ENCODER_BASIC) - 1)

static bool has_low(const struct device *device)
{
	return device->image.encoder_enabled & BANK_MASK;
}

static bool has_high(const struct device *device)
{
	return device->image.encoder_enabled & BASIC_MASK & ~BANK_MASK;
}

static void mark_bank(struct device *device, unsigned int bank)
{
	for (unsigned int i = 0; i < WIRE_ENCODER_BANK; i++)
		encoder_mark(&device->encoder[bank * WIRE_ENCODER_BANK + i]);
}

static enum wire_op ask_low(struct device *device, union slow_request *request)
{
	request->encoders.option = WIRE_ENCODERS_READ_LOW;
	mark_bank(device, 0);
	return WIRE_OP_ENCODERS;
}

static enum wire_op ask_high(struct device *device, union slow_request *request)
{
	request->encoders.option = WIRE_ENCODERS_READ_HIGH;
	mark_bank(device, 1);
	return WIRE_OP_ENCODERS;
}

static void take_low(struct device *device, const mailbox_entry_t *entry)
{
	decode_encoders(device, 0, entry);
}

static void take_high(struct device *device, const mailbox_entry_t *entry)
{
	decode_encoders(device, 1, entry);
}

/* Pins 41 and 42, which 0xCC does not have. */
static bool has_analog(const struct device *device)
{
	const uint8_t *function = &device->image.pin_function[WIRE_ANALOG_FIRST_PIN - 1];

	return device->image.capability.analog_inputs &&
	       (function[0] | function[1]) & WIRE_PIN_ANALOG_IN;
}

#define ASK_PLAINLY(name, op) \
	static enum wire_op ask_##name(struct device *device, union slow_request *request) \
	{ \
		(void)device; \
		(void)request; \
		return op; \
	}

ASK_PLAINLY(analog, WIRE_OP_ANALOG)
ASK_PLAINLY(tick, WIRE_OP_TICK)
ASK_PLAINLY(pwm, WIRE_OP_PWM)
ASK_PLAINLY(load, WIRE_OP_SYSTEM_LOAD)
ASK_PLAINLY(identity, WIRE_OP_DEVICE_DATA)
ASK_PLAINLY(clock, WIRE_OP_RTC)
ASK_PLAINLY(dedicated, WIRE_OP_PULSE_STATUS2)
ASK_PLAINLY(matrix, WIRE_OP_KB_STATUS)

static void take_analog(struct device *device, const mailbox_entry_t *entry)
{
	struct wire_analog_rep analog;

	wire_analog_decode_rep(entry->response_buffer, &analog);
	for (unsigned int i = 0; i < WIRE_ANALOGS; i++)
		device->image.analog[i] = analog.value[i];
	device->image.t_analog_slow_ns = entry->timestamp_received;
}

/* Counters, thirteen at a time. */

static bool has_counters(const struct device *device)
{
	return device->plan.counters > 0;
}

static enum wire_op ask_counters(struct device *device, union slow_request *request)
{
	struct wire_counters_req *counters = &request->counters;
	struct plan *plan = &device->plan;

	for (unsigned int i = 0; i < WIRE_COUNTERS; i++) {
		plan->counter_asked[i] = plan->counter_pin[plan->counter_next];
		counters->pin[i] = plan->counter_asked[i];
		plan->counter_next = (uint8_t)((plan->counter_next + 1) % plan->counters);
	}
	return WIRE_OP_COUNTERS;
}

static void take_counters(struct device *device, const mailbox_entry_t *entry)
{
	struct wire_counters_rep counters;

	wire_counters_decode_rep(entry->response_buffer, &counters);
	for (unsigned int i = 0; i < WIRE_COUNTERS; i++)
		device->image.counter[device->plan.counter_asked[i]] = counters.value[i];
}

/* PoExtBus, as the device has it. */

static bool has_bus(const struct device *device)
{
	return device->image.capability.poextbus > 0;
}

static enum wire_op ask_bus(struct device *device, union slow_request *request)
{
	(void)device;
	request->poextbus.option = WIRE_POEXTBUS_READ;
	return WIRE_OP_POEXTBUS;
}

static void take_bus(struct device *device, const mailbox_entry_t *entry)
{
	struct wire_poextbus_rep bus;

	if (!output_readable(device, OUTPUT_POEXTBUS, entry->timestamp_first_sent))
		return;
	wire_poextbus_decode_rep(entry->response_buffer, &bus);
	memcpy(device->image.poextbus, bus.data, sizeof(bus.data));
	output_seen(device, OUTPUT_POEXTBUS);
}

static bool has_always(const struct device *device)
{
	(void)device;
	return true;
}

static bool has_pwm(const struct device *device)
{
	return device->image.capability.pwm > 0;
}

static void take_pwm(struct device *device, const mailbox_entry_t *entry)
{
	struct wire_pwm_rep pwm;

	if (!output_readable(device, OUTPUT_PWM, entry->timestamp_first_sent))
		return;
	wire_pwm_decode_rep(entry->response_buffer, &pwm);
	decode_pwm(device, &pwm);
	output_seen(device, OUTPUT_PWM);
}

static bool has_load(const struct device *device)
{
	return device->image.capability.load_status > 0;
}

static void take_load(struct device *device, const mailbox_entry_t *entry)
{
	struct wire_system_load_rep load;

	wire_system_load_decode_rep(entry->response_buffer, &load);
	device->image.identity.load = load.percent;
}

static void take_clock(struct device *device, const mailbox_entry_t *entry)
{
	struct pokeys_rtc *rtc = &device->image.rtc;
	struct wire_rtc_req clock;

	wire_rtc_decode_rep(entry->response_buffer, &clock);
	*rtc = (struct pokeys_rtc){
		.year = clock.year,
		.month = clock.month,
		.day = clock.day,
		.hour = clock.hour,
		.minute = clock.minute,
		.second = clock.second,
		.day_of_week = clock.weekday,
		.day_of_year = clock.yearday,
		.unnamed = clock.dst,
	};
}

/* External outputs and relays of the pulse engine. */
static bool has_external(const struct device *device)
{
	return device->image.capability.pulse_engine >= 2;
}

static enum wire_op ask_external(struct device *device, union slow_request *request)
{
	(void)device;
	request->external.read_only = 1;
	return WIRE_OP_PULSE_OUTPUTS;
}

static void take_external(struct device *device, const mailbox_entry_t *entry)
{
	struct wire_pulse_outputs_rep external;

	if (!output_readable(device, OUTPUT_EXTERNAL, entry->timestamp_first_sent))
		return;
	wire_pulse_outputs_decode_rep(entry->response_buffer, &external);
	device->image.engine.relays = external.relays;
	device->image.engine.outputs = external.oc;
	output_seen(device, OUTPUT_EXTERNAL);
}

/* Dedicated inputs of the pulse engine, raw. */
static void take_dedicated(struct device *device, const mailbox_entry_t *entry)
{
	struct pokeys_engine *engine = &device->image.engine;
	struct wire_pulse_status2_rep inputs;

	wire_pulse_status2_decode_rep(entry->response_buffer, &inputs);
	engine->dedicated_limit_minus = inputs.limit_neg;
	engine->dedicated_limit_plus = inputs.limit_pos;
	engine->dedicated_home = inputs.home;
}

/* Matrix keys in rows 8 to 15, which 0xCC does not have. */
static bool has_matrix(const struct device *device)
{
	const struct wire_kb_config *config =
		&device->configure.setting[SETTING_MATRIX].value.matrix.config;

	return config->enable && (config->size & 0x0F) >= LOW_ROWS;
}

static void take_matrix(struct device *device, const mailbox_entry_t *entry)
{
	struct wire_kb_status_rep keys;

	wire_kb_status_decode_rep(entry->response_buffer, &keys);
	memcpy(device->image.matrix + LOW_ROWS, keys.key + LOW_ROWS,
	       POKEYS_MATRIX_BYTES - LOW_ROWS);
}

const struct slow_kind slow_groups[SLOW_GROUPS] = {
	[SLOW_ENCODERS_LOW] = { encoder_hertz, has_low, ask_low, take_low },
	[SLOW_ENCODERS_HIGH] = { encoder_hertz, has_high, ask_high, take_high },
	[SLOW_ANALOG] = { analog_hertz, has_analog, ask_analog, take_analog },
	[SLOW_COUNTERS] = { bus_hertz, has_counters, ask_counters, take_counters },
	[SLOW_POEXTBUS] = { bus_hertz, has_bus, ask_bus, take_bus },
	[SLOW_TICK] = { slow_hertz, has_always, ask_tick, restart_tick },
	[SLOW_PWM] = { slow_hertz, has_pwm, ask_pwm, take_pwm },
	[SLOW_LOAD] = { slow_hertz, has_load, ask_load, take_load },
	[SLOW_CLOCK] = { slow_hertz, has_always, ask_clock, take_clock },
	[SLOW_EXTERNAL] = { slow_hertz, has_external, ask_external, take_external },
	[SLOW_IDENTITY] = { rare_hertz, has_always, ask_identity, restart_identity },
	[SLOW_PONET] = { ponet_hertz, ponet_has, ponet_ask, ponet_take },
	[SLOW_DEDICATED] = { analog_hertz, has_external, ask_dedicated, take_dedicated },
	[SLOW_MATRIX] = { bus_hertz, has_matrix, ask_matrix, take_matrix },
	[SLOW_BACKLASH] = { slow_hertz, backlash_has, backlash_ask, backlash_take },
	[SLOW_POSTEP] = { slow_hertz, postep_has, postep_ask, postep_status },
	[SLOW_POSTEP_RARE] = { rare_hertz, postep_has, postep_ask_rare, postep_take_rare },
};
