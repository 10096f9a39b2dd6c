/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One-shots of encoders: set a count, and wait for an index pulse (protocol
 * section 3.8).
 *
 * The device can only write thirteen counters at once. The other twelve must
 * get the counts that they have when the device executes the write, which is
 * a little later than we know them. What is known is taken forward at each
 * encoder's speed by half a round trip; at constant speed nothing is lost, a
 * change of speed within that time costs some counts. Nothing better can be
 * had from the device, so set a count while the others stand if it matters.
 *
 * An index pulse zeroes a counter in the device. Nothing reports it, so it is
 * seen as the jump to zero that no motion explains; a counter that already
 * was within JUMP of zero hides it until the next turn. The fast encoders'
 * index inputs stay armed for every pulse once they are on, therefore they
 * are switched back as soon as the first one was seen.
 */

#include <stdlib.h>
#include <string.h>
#include "daemon/device/internal.h"

enum {
	STEP_READ,
	STEP_WRITE,
	STEP_READ_BACK,
};

#define JUMP 128	/* counts */

/* Set encoder. */

static unsigned int bank_of(const struct pokeys_one_shot *shot)
{
	return shot->index / WIRE_ENCODER_BANK;
}

static struct refusal why_not_set(const struct device *device, const struct pokeys_one_shot *shot)
{
	if (shot->index >= device->image.capability.encoders)
		return refusal(REFUSAL_NO_ENCODER, shot->index);
	return refusal(servoing_may_write(device, shot->index) ? REFUSAL_NONE :
								 REFUSAL_SERVO_ENCODER,
		       shot->index);
}

/* Where this encoder will be when the device reads our packet. */
static int32_t count_then(const struct device *device, unsigned int i)
{
	const struct encoder *encoder = &device->encoder[i];
	const uint64_t then = device->now_ns + device->mailbox.statistics.rtt_smoothed_ns / 2;

	if (!encoder->known || encoder->doubt)
		return device->one_shots.before[i % WIRE_ENCODER_BANK];
	return (int32_t)((uint32_t)encoder->count + (uint32_t)encoder_travel(encoder, then));
}

static bool set_write(struct device *device)
{
	const struct pokeys_one_shot *shot = &device->one_shots.now;
	const unsigned int bank = bank_of(shot);
	struct wire_encoders_req request = {
		.option = bank ? WIRE_ENCODERS_WRITE_HIGH : WIRE_ENCODERS_WRITE_LOW,
	};

	if (!servoing_may_write(device, shot->index)) {
		one_shot_refuse(device, refusal(REFUSAL_SERVO_ENCODER, shot->index));
		return false;
	}
	for (unsigned int i = 0; i < WIRE_ENCODER_BANK; i++)
		request.value[i] = count_then(device, bank * WIRE_ENCODER_BANK + i);
	request.value[shot->index % WIRE_ENCODER_BANK] = shot->value[0];
	return one_shot_request(device, WIRE_OP_ENCODERS, &request);
}

static bool set_send(struct device *device)
{
	struct wire_encoders_req read = { .option = WIRE_ENCODERS_READ_LOW };

	if (device->one_shots.step == STEP_WRITE)
		return set_write(device);
	if (bank_of(&device->one_shots.now))
		read.option = WIRE_ENCODERS_READ_HIGH;
	return one_shot_request(device, WIRE_OP_ENCODERS, &read);
}

static void go_to(struct device *device, uint8_t step)
{
	device->one_shots.step = step;
	device->one_shots.phase = ONE_SHOT_NEXT;
}

/* All counts of the bank may have jumped: none is certain any more. */
static void forget_bank(struct device *device)
{
	const unsigned int bank = bank_of(&device->one_shots.now);

	for (unsigned int i = 0; i < WIRE_ENCODER_BANK; i++)
		encoder_forget(&device->encoder[bank * WIRE_ENCODER_BANK + i]);
	servoing_written(device, ((UINT32_C(1) << WIRE_ENCODER_BANK) - 1)
					 << bank * WIRE_ENCODER_BANK);
	slow_encoders_now(device, bank);
}

static int64_t distance(int32_t a, int32_t b)
{
	return llabs((int64_t)(int32_t)((uint32_t)a - (uint32_t)b));
}

static void read_back(struct device *device, const struct wire_encoders_rep *reply)
{
	const struct pokeys_one_shot *shot = &device->one_shots.now;
	const unsigned int i = shot->index % WIRE_ENCODER_BANK;
	const bool set = distance(reply->value[i], shot->value[0]) <=
			 distance(reply->value[i], device->one_shots.before[i]);

	one_shot_end(device, set ? POKEYS_OUTCOME_DONE : POKEYS_OUTCOME_FAILED);
}

static void set_answered(struct device *device, const mailbox_entry_t *entry)
{
	struct wire_encoders_rep reply;

	wire_encoders_decode_rep(entry->response_buffer, &reply);
	switch (device->one_shots.step) {
	case STEP_READ:
		memcpy(device->one_shots.before, reply.value, sizeof(reply.value));
		go_to(device, STEP_WRITE);
		break;
	case STEP_WRITE:
		forget_bank(device);
		one_shot_end(device, POKEYS_OUTCOME_DONE);
		break;
	default:
		read_back(device, &reply);
		break;
	}
}

static void set_unknown(struct device *device)
{
	forget_bank(device);
	go_to(device, STEP_READ_BACK);
}

const struct operation operation_set_encoder = {
	.why_not = why_not_set,
	.send = set_send,
	.answered = set_answered,
	.unknown = set_unknown,
};

/* Arm index. */

static const struct wire_fast_encoders_rep *fast_setup(const struct device *device)
{
	return &device->configure.setting[SETTING_FAST_ENCODERS].value.fast;
}

static bool is_fast(const struct device *device, unsigned int encoder)
{
	return encoder < device->image.capability.fast_encoders &&
	       (fast_setup(device)->status & 0x0F) != WIRE_FAST_OFF;
}

static bool has_index(const struct device *device, unsigned int encoder)
{
	return encoder == WIRE_ENCODER_ULTRA ?
		       device->image.encoder_enabled >> WIRE_ENCODER_ULTRA & 1 :
		       is_fast(device, encoder);
}

static struct refusal why_not_arm(const struct device *device, const struct pokeys_one_shot *shot)
{
	if (!has_index(device, shot->index))
		return refusal(REFUSAL_NO_INDEX, shot->index);
	if (shot->index == WIRE_ENCODER_ULTRA &&
	    !wire_firmware_at_least(&device->identify.identity.firmware, 4, 2, 19))
		return refusal(REFUSAL_INDEX_FIRMWARE, shot->index);
	return refusal(servoing_may_arm(device, shot->index) ? REFUSAL_NONE : REFUSAL_SERVO_INDEX,
		       shot->index);
}

static bool fast_index(struct device *device, bool on, struct wire_fast_encoders_req *request)
{
	*request = (struct wire_fast_encoders_req){
		.option = fast_setup(device)->status,
		.index = on ? fast_setup(device)->index | 1 : fast_setup(device)->index,
	};
	return request->option != WIRE_FAST_READ;
}

static bool arm_send(struct device *device)
{
	const struct wire_ultra_encoder_rep *ultra =
		&device->configure.setting[SETTING_ULTRA_ENCODER].value.ultra;
	const struct wire_ultra_encoder_req arm = {
		.mode = WIRE_ULTRA_ON,
		.options = ultra->options,
		.reset_on_index = 1,
		.filter = ultra->filter,
	};
	struct wire_fast_encoders_req fast;

	if (device->one_shots.now.index == WIRE_ENCODER_ULTRA)
		return one_shot_request(device, WIRE_OP_ULTRA_ENCODER, &arm);
	if (!fast_index(device, true, &fast)) {
		one_shot_refuse(device, refusal(REFUSAL_NO_INDEX, device->one_shots.now.index));
		return false;
	}
	return one_shot_request(device, WIRE_OP_FAST_ENCODERS, &fast);
}

static void arm_answered(struct device *device, const mailbox_entry_t *entry)
{
	const uint32_t bit = UINT32_C(1) << device->one_shots.now.index;

	(void)entry;
	device->one_shots.armed |= bit;
	device->image.encoder_index &= ~bit;
	one_shot_end(device, POKEYS_OUTCOME_DONE);
}

const struct operation operation_arm_index = {
	.why_not = why_not_arm,
	.send = arm_send,
	.answered = arm_answered,
};

/* Much nearer to zero than any motion explains. */
static bool jumped(const struct encoder *encoder, int32_t count, uint64_t t_ns)
{
	const int32_t travel = encoder_travel(encoder, t_ns);
	const int32_t ahead = (int32_t)((uint32_t)encoder->count + (uint32_t)travel);

	return encoder->known && distance(count, ahead) >= JUMP + llabs(travel) &&
	       llabs(count) < llabs(ahead);
}

bool operation_index_seen(struct device *device, unsigned int i, int32_t count, uint64_t t_ns)
{
	const uint32_t bit = UINT32_C(1) << i;

	if (!(device->one_shots.armed & bit) || !jumped(&device->encoder[i], count, t_ns))
		return false;
	device->one_shots.armed &= ~bit;
	device->image.encoder_index |= bit;
	if (i != WIRE_ENCODER_ULTRA)
		device->one_shots.disarm = true;
	return true;
}

bool operation_index_awaited(const struct device *device)
{
	const uint32_t fast = (UINT32_C(1) << device->image.capability.fast_encoders) - 1;
	const struct one_shots *shots = &device->one_shots;

	return shots->armed & fast || shots->disarm || shots->disarm_open ||
	       (shots->phase != ONE_SHOT_IDLE && shots->now.operation == POKEYS_ONE_SHOT_ARM_INDEX);
}

static void disarm_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
			 uint64_t now_ns)
{
	struct device *device = device_of(mailbox);

	(void)context;
	device->now_ns = now_ns;
	device->one_shots.disarm_open = false;
	if (!answered(entry) && entry->state != POKEYS_REQUEST_CANCELLED)
		device->one_shots.disarm = true;
}

bool operation_disarm(struct device *device)
{
	const uint32_t fast = (UINT32_C(1) << device->image.capability.fast_encoders) - 1;
	struct one_shots *shots = &device->one_shots;
	struct wire_fast_encoders_req request;

	if (!shots->disarm || shots->disarm_open)
		return false;
	if (shots->armed & fast || !fast_index(device, false, &request)) {
		shots->disarm = false; /* another one still waits for its index */
		return false;
	}
	if (!request_send(device, WIRE_OP_FAST_ENCODERS, &request, disarm_ended, NULL, NULL))
		return false;
	shots->disarm = false;
	shots->disarm_open = true;
	return true;
}
