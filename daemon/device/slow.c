/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The slow groups: each with a rate of its own, one request of them a cycle
 * (protocol section 3.25).
 *
 * Rates go by the clock, not by counting cycles: the next turn of a group is
 * one period after this one began. So a stall or a run of lost packets is
 * never caught up with a burst. Whoever has waited longest goes first, which
 * makes the list rotate by itself when there is less room than work.
 *
 * What a firmware has never answered is asked less and less often, so that it
 * costs nothing to those that do answer.
 */

#include <string.h>
#include "daemon/device/internal.h"
#include "wire/bus.h"

#define OVERDUE_NS (4 * MS)	/* then it takes the place of a fast request */

enum {
	OPEN_MAX = 2,		/* awaited at once: a slow device must not drown in them */
	FAILURES_FEW = 3,
	FAILURES_MAX = 6,	/* doublings of the period */
	READ_CLOCK = WIRE_RTC_READ,
	READ_BUS = 2,		/* 0xDA, @2 */
};

struct group {
	enum wire_op op;
	double (*hertz)(const struct device_config *config);
	bool (*has)(const struct device *device);
	void (*ask)(struct device *device, void *request);
	void (*take)(struct device *device, const mailbox_entry_t *entry);
};

union slow_request {
	struct wire_encoders_req encoders;
	struct wire_analog_req analog;
	struct wire_counters_req counters;
	struct wire_poextbus_req poextbus;
	struct wire_pwm_req pwm;
	struct wire_rtc_req clock;
	struct wire_pulse_outputs_req external;
};

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

static void ask_low(struct device *device, void *request)
{
	((struct wire_encoders_req *)request)->option = WIRE_ENCODERS_READ_LOW;
	mark_bank(device, 0);
}

static void ask_high(struct device *device, void *request)
{
	((struct wire_encoders_req *)request)->option = WIRE_ENCODERS_READ_HIGH;
	mark_bank(device, 1);
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

static void ask_nothing(struct device *device, void *request)
{
	(void)device;
	(void)request;
}

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

static void ask_counters(struct device *device, void *request)
{
	struct wire_counters_req *counters = request;
	struct plan *plan = &device->plan;

	for (unsigned int i = 0; i < WIRE_COUNTERS; i++) {
		plan->counter_asked[i] = plan->counter_pin[plan->counter_next];
		counters->pin[i] = plan->counter_asked[i];
		plan->counter_next = (uint8_t)((plan->counter_next + 1) % plan->counters);
	}
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

static void ask_bus(struct device *device, void *request)
{
	(void)device;
	((struct wire_poextbus_req *)request)->option = READ_BUS;
}

static void take_bus(struct device *device, const mailbox_entry_t *entry)
{
	struct wire_poextbus_rep bus;

	wire_poextbus_decode_rep(entry->response_buffer, &bus);
	memcpy(device->image.poextbus, bus.data, sizeof(bus.data));
}

/* PWM, load, clocks. */

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

	wire_pwm_decode_rep(entry->response_buffer, &pwm);
	decode_pwm(device, &pwm);
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

static void ask_clock(struct device *device, void *request)
{
	(void)device;
	((struct wire_rtc_req *)request)->option = READ_CLOCK;
}

static void take_clock(struct device *device, const mailbox_entry_t *entry)
{
	struct pokeys_rtc *rtc = &device->image.rtc;
	struct wire_rtc_req clock;

	wire_rtc_decode_rep(entry->response_buffer, &clock);
	*rtc = (struct pokeys_rtc){
		.year = clock.year, .month = clock.month, .day = clock.day, .hour = clock.hour,
		.minute = clock.minute, .second = clock.second, .day_of_week = clock.weekday,
		.day_of_year = clock.yearday,
	};
}

/* External outputs and relays of the pulse engine. */
static bool has_external(const struct device *device)
{
	return device->image.capability.pulse_engine >= 2;
}

static void ask_external(struct device *device, void *request)
{
	(void)device;
	((struct wire_pulse_outputs_req *)request)->read_only = 1;
}

static void take_external(struct device *device, const mailbox_entry_t *entry)
{
	struct wire_pulse_outputs_rep external;

	wire_pulse_outputs_decode_rep(entry->response_buffer, &external);
	device->image.engine.relays = external.relays;
	device->image.engine.outputs = external.oc;
}

static const struct group groups[SLOW_GROUPS] = {
	[SLOW_ENCODERS_LOW] = { WIRE_OP_ENCODERS, encoder_hertz, has_low, ask_low, take_low },
	[SLOW_ENCODERS_HIGH] = { WIRE_OP_ENCODERS, encoder_hertz, has_high, ask_high, take_high },
	[SLOW_ANALOG] = { WIRE_OP_ANALOG, analog_hertz, has_analog, ask_nothing, take_analog },
	[SLOW_COUNTERS] = { WIRE_OP_COUNTERS, bus_hertz, has_counters, ask_counters,
			    take_counters },
	[SLOW_POEXTBUS] = { WIRE_OP_POEXTBUS, bus_hertz, has_bus, ask_bus, take_bus },
	[SLOW_TICK] = { WIRE_OP_TICK, slow_hertz, has_always, ask_nothing, identify_tick },
	[SLOW_PWM] = { WIRE_OP_PWM, slow_hertz, has_pwm, ask_nothing, take_pwm },
	[SLOW_LOAD] = { WIRE_OP_SYSTEM_LOAD, slow_hertz, has_load, ask_nothing, take_load },
	[SLOW_CLOCK] = { WIRE_OP_RTC, slow_hertz, has_always, ask_clock, take_clock },
	[SLOW_EXTERNAL] = { WIRE_OP_PULSE_OUTPUTS, slow_hertz, has_external, ask_external,
			    take_external },
	[SLOW_IDENTITY] = { WIRE_OP_DEVICE_DATA, rare_hertz, has_always, ask_nothing,
			    identify_again },
};

/* 0 = never by itself. */
static uint64_t period_of(const struct device *device, unsigned int group)
{
	const double hertz = groups[group].hertz(&device->config);
	const unsigned int failures = device->plan.slow[group].failures;

	if (!(hertz > 0.001))
		return 0;
	return (uint64_t)(1e9 / hertz) << (failures < FAILURES_MAX ? failures : FAILURES_MAX);
}

static void ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		  uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	const unsigned int group = (unsigned int)(uintptr_t)context;
	struct slow *slow = &device->plan.slow[group];

	device->now_ns = now_ns;
	slow->open = false;
	if (!answered(entry)) {
		if (!slow->answered && slow->failures < FAILURES_MAX)
			slow->failures++;
		return;
	}
	slow->failures = 0;
	slow->answered = true;
	groups[group].take(device, entry);
	device->image.t_slow_ns = entry->timestamp_received;
	meter_reply(device, entry, false);
}

/* The group that has waited longest, SLOW_GROUPS = none is due, or enough are open. */
static unsigned int longest_due(const struct device *device)
{
	uint64_t oldest = device->now_ns + 1;
	unsigned int found = SLOW_GROUPS, open = 0;

	for (unsigned int i = 0; i < SLOW_GROUPS; i++) {
		const struct slow *slow = &device->plan.slow[i];

		open += slow->open;
		if (slow->open || slow->due_ns >= oldest || !groups[i].has(device))
			continue;
		oldest = slow->due_ns;
		found = i;
	}
	return open < OPEN_MAX ? found : SLOW_GROUPS;
}

bool slow_overdue(const struct device *device)
{
	const unsigned int group = longest_due(device);

	return group < SLOW_GROUPS &&
	       device->now_ns - device->plan.slow[group].due_ns >= OVERDUE_NS;
}

bool slow_send(struct device *device)
{
	const unsigned int group = longest_due(device);
	union slow_request request;
	struct slow *slow;
	uint64_t period;

	if (group == SLOW_GROUPS)
		return false;
	memset(&request, 0, sizeof(request));
	groups[group].ask(device, &request);
	if (!request_send(device, groups[group].op, &request, ended, NULL,
			  (void *)(uintptr_t)group))
		return false;
	slow = &device->plan.slow[group];
	slow->open = true;
	period = period_of(device, group);
	slow->due_ns = period ? device->now_ns + period : UINT64_MAX;
	return true;
}

static void at_once(struct device *device, unsigned int group)
{
	struct slow *slow = &device->plan.slow[group];
	const uint64_t when = device->now_ns > OVERDUE_NS ? device->now_ns - OVERDUE_NS : 0;

	if (slow->failures < FAILURES_FEW && slow->due_ns > when)
		slow->due_ns = when;
}

void slow_encoders_now(struct device *device, unsigned int bank)
{
	at_once(device, bank ? SLOW_ENCODERS_HIGH : SLOW_ENCODERS_LOW);
}

void slow_tick_now(struct device *device)
{
	at_once(device, SLOW_TICK);
}

/* All are due at the beginning, so that the image is soon complete. */
void slow_begin(struct device *device)
{
	struct plan *plan = &device->plan;

	for (unsigned int i = 0; i < SLOW_GROUPS; i++)
		plan->slow[i].due_ns = device->now_ns;
	for (unsigned int i = 0; i < POKEYS_PINS; i++) {
		if (device->image.pin_function[i] & WIRE_PIN_COUNTER)
			plan->counter_pin[plan->counters++] = (uint8_t)i;
	}
}
