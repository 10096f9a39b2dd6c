/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Outputs that do not travel with 0xCC: when they are written.
 *
 * The rule is that of the references: write whenever what is wanted differs
 * from what was last acknowledged, put the newest values into a resend, and
 * count no answer when two versions were under way. Values may be lost,
 * repeated or overtaken without harm, as long as the newest comes last.
 *
 * What can be read back is believed more than an acknowledgement: a device
 * whose own failsafe has acted, or that was set from elsewhere, is written
 * again. A reading only counts when it was asked for after the last write had
 * ended, for the two may overtake each other.
 *
 * A write that is under way is not waited for if a heater or a motor is to be off that it has on:
 * it goes out again at once, with the newest values.
 *
 * One that the device does not answer is tried less and less often, so that it
 * costs nothing to the others; they take turns.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define AGAIN_NS (20 * MS)
enum { FAILURES_MAX = 7 }; /* doublings of it */

static bool wanted(const struct device *device, unsigned int place, union output_value *want)
{
	unsigned int index;
	const struct output_kind *kind = output_kind(place, &index);

	memset(want, 0, sizeof(*want));
	return kind->want(device, index, want);
}

/* The setting that carries it is under way, with what is wanted of it. */
static bool is_carried(const struct device *device, unsigned int place)
{
	unsigned int index;
	const uint8_t carrier = output_kind(place, &index)->carrier;

	return carrier < SETTINGS && device->configure.setting[carrier].state == SETTING_WRITING;
}

static bool same(const union output_value *a, const union output_value *b)
{
	return !memcmp(a, b, sizeof(*a));
}

/*
 * A period is as long as somebody wants, and a loop that is switched off is off at once: the pulse
 * of a duty that was reduced may still go on.
 */
static bool cuts_off(const struct device *device, unsigned int place,
		     const union output_value *want)
{
	const struct output *output = &device->outputs.output[place];
	const unsigned int stopping = place == OUTPUT_PWM ? loops_channels_stopping(device) : 0;

	for (unsigned int i = 0; i < POKEYS_PWM; i++)
		if (stopping >> i & 1 && (want->pwm.duty[i] != output->have.pwm.duty[i] ||
					  device->now_ns < output->pulse_until_ns[i]))
			return true;
	return false;
}

static bool is_due(const struct device *device, unsigned int place, union output_value *want)
{
	const struct output *output = &device->outputs.output[place];

	if (output->open || device->now_ns < output->after_ns || is_carried(device, place) ||
	    !wanted(device, place, want))
		return false;
	return !output->known || !same(want, &output->have) || cuts_off(device, place, want);
}

/* PWM: duties alone do not begin the period again. */
static void encode(struct device *device, unsigned int place, const union output_value *want,
		   union output_value *request)
{
	struct output *output = &device->outputs.output[place];

	output->gentle = place == OUTPUT_PWM && output->known &&
			 want->pwm.enabled == output->have.pwm.enabled &&
			 want->pwm.period == output->have.pwm.period &&
			 !cuts_off(device, place, want);
	*request = *want;
	if (output->gentle)
		request->pwm.duties_only = 1;
}

/* What was written has been acknowledged. */
static void note_pulses(struct output *output, uint64_t now_ns)
{
	const uint64_t period_ns = (uint64_t)output->sent.pwm.period * WIRE_PWM_TICK_NS;

	for (unsigned int i = 0; i < POKEYS_PWM; i++) {
		if (!output->gentle)
			output->pulse_until_ns[i] = 0;
		else if (output->sent.pwm.duty[i] != output->have.pwm.duty[i])
			output->pulse_until_ns[i] = now_ns + period_ns;
	}
}

/* Sent again: with the newest values. */
static void refresh(pokeys_device_t *mailbox, mailbox_entry_t *entry, void *context)
{
	struct device *device = device_of(mailbox);
	const unsigned int place = (unsigned int)(uintptr_t)context;
	struct output *output = &device->outputs.output[place];
	union output_value want;
	unsigned int index;

	if (!wanted(device, place, &want) || (same(&want, &output->sent) && !output->mixed &&
					      !(output->gentle && cuts_off(device, place, &want))))
		return;
	output->mixed = true;
	output->gentle = false;
	output->sent = want;
	wire_encode_req(output_kind(place, &index)->op, entry->request_buffer, &want);
}

/* After a write that was not answered. A loop that is to be off cannot wait. */
static uint64_t pause_ns(const struct device *device, unsigned int place)
{
	if (place == OUTPUT_PWM && loops_channels(device))
		return 0;
	return AGAIN_NS << device->outputs.output[place].failures;
}

static void ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		  uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	const unsigned int place = (unsigned int)(uintptr_t)context;
	struct output *output = &device->outputs.output[place];
	unsigned int index;
	const struct output_kind *kind = output_kind(place, &index);

	device->now_ns = now_ns;
	output->open = false;
	output->known = false;
	output->ended_ns = now_ns;
	if (entry->state == POKEYS_REQUEST_CANCELLED)
		return;
	if (!answered(entry) || (kind->done && !kind->done(entry))) {
		output->after_ns = now_ns + pause_ns(device, place);
		if (output->failures < FAILURES_MAX)
			output->failures++;
		return;
	}
	output->failures = 0;
	if (output->mixed)
		return;
	if (place == OUTPUT_PWM)
		note_pulses(output, now_ns);
	output->known = true;
	output->have = output->sent;
	if (kind->learn)
		kind->learn(device, &output->have);
}

static bool send(struct device *device, unsigned int place, const union output_value *want)
{
	struct output *output = &device->outputs.output[place];
	void *const own = (void *)(uintptr_t)place;
	union output_value request;
	unsigned int index;
	const struct output_kind *kind = output_kind(place, &index);

	encode(device, place, want, &request);
	if (place == OUTPUT_PWM ?
		    !request_send_first(device, kind->op, &request, ended, refresh, own) :
		    !request_send(device, kind->op, &request, ended, refresh, own))
		return false;
	output->open = true;
	output->mixed = false;
	output->driven = output->driven || !safe_part(device, kind->part);
	output->sent = *want;
	return true;
}

/* Those of PoNET only if there is a module: this is looked at in every cycle. */
static unsigned int places(const struct device *device)
{
	return device->image.ponet_count ? OUTPUTS : OUTPUT_PONET;
}

bool output_send(struct device *device)
{
	struct outputs *outputs = &device->outputs;
	const unsigned int count = places(device);
	union output_value want;

	for (unsigned int i = 0; i < count; i++) {
		const unsigned int place = (outputs->next + i) % count;

		if (!is_due(device, place, &want))
			continue;
		if (!send(device, place, &want))
			return false;
		outputs->next = (uint8_t)((place + 1) % count);
		return true;
	}
	return false;
}

/* A loop is to be off, and what is under way has it on, or nothing is. */
static bool hides_off(const struct device *device, const struct output *output)
{
	const unsigned int channels = loops_channels_stopping(device);
	union output_value want;

	if (!output->open || !channels || !wanted(device, OUTPUT_PWM, &want))
		return false;
	for (unsigned int i = 0; i < POKEYS_PWM; i++)
		if (channels >> i & 1 && output->sent.pwm.duty[i] != want.pwm.duty[i])
			return true;
	if (output->gentle && cuts_off(device, OUTPUT_PWM, &want))
		return true;
	return request_unsent(device, ended, (void *)(uintptr_t)OUTPUT_PWM);
}

bool output_send_loops(struct device *device)
{
	struct output *pwm = &device->outputs.output[OUTPUT_PWM];
	union output_value want;

	if (hides_off(device, pwm)) {
		const union output_value before = pwm->sent;
		const bool gentle = pwm->gentle;

		if (request_again(device, ended, (void *)(uintptr_t)OUTPUT_PWM))
			return true;
		pwm->sent = before; /* the transport has not taken it */
		pwm->gentle = gentle;
		return false;
	}
	return is_due(device, OUTPUT_PWM, &want) && send(device, OUTPUT_PWM, &want);
}

bool output_take_along(struct device *device, unsigned int place, union output_value *now)
{
	struct output *output = &device->outputs.output[place];
	union output_value want;

	if (output->open)
		return false;
	if (running(device) && wanted(device, place, &want))
		*now = want;
	output->known = false;
	return true;
}

static bool is_settled(const struct device *device, unsigned int place)
{
	const struct output *output = &device->outputs.output[place];
	union output_value want;

	if (is_carried(device, place))
		return false;
	return !wanted(device, place, &want) ||
	       (!output->open && output->known && same(&want, &output->have) &&
		!cuts_off(device, place, &want));
}

/*
 * A module that no commander drove is switched off as well, but not waited for: one
 * that does not answer would keep the safe state of everything else unsaid.
 */
static bool awaited(const struct device *device, unsigned int place)
{
	return place < OUTPUT_PONET || device->outputs.output[place].driven;
}

bool output_settled(const struct device *device)
{
	for (unsigned int i = 0; i < places(device); i++)
		if (awaited(device, i) && !is_settled(device, i))
			return false;
	return true;
}

bool output_readable(const struct device *device, unsigned int place, uint64_t asked_ns)
{
	const struct output *output = &device->outputs.output[place];

	return !output->open && asked_ns >= output->ended_ns;
}

void output_seen(struct device *device, unsigned int place)
{
	struct output *output = &device->outputs.output[place];

	if (output->known && !output_is_shown(device, place, &output->have))
		output->known = false;
}

/* Running (again): what it acknowledged before says nothing any more. */
void output_begin(struct device *device)
{
	for (unsigned int i = 0; i < OUTPUTS; i++) {
		struct output *output = &device->outputs.output[i];
		const bool driven = output->driven;

		memset(output, 0, sizeof(*output));
		output->driven = driven;
	}
}
