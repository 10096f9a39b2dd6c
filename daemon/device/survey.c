/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A device's settings, one request after the other: its identity, whether it is locked, then each
 * setting that setting.c knows. A request that is not a read (wire_request_class()) is not sent; a
 * setting that has to be made ready first, by other requests, is not read.
 *
 * The device of the realtime loop serves as the store of what was read. It is never cycled, so it
 * sends no other requests.
 */

#include <string.h>
#include "daemon/device/internal.h"
#include "daemon/device/survey.h"

enum {
	PORT = 20055,
	ROUNDS = 3, /* of one question, each with all its retries */
	SILENT = 5, /* unanswered questions in a row: the device is absent then */
	STEP_IDENTITY = SETTINGS,
	STEP_ACCESS,
};

#define FLOOR_NS (50 * MS)	/* time enough for a network that nobody has tuned */

struct survey {
	struct device device; /* first: parsers find the survey by it */
	struct event_ring events;
	struct pokeys_settings settings;
	unsigned int step;
	unsigned int failures;           /* of this step */
	unsigned int unanswered, silent; /* steps, and of these the last ones */
	bool open;
	enum survey_state state;
};

size_t survey_size(void)
{
	return (sizeof(struct survey) + 63) & ~(size_t)63;
}

void survey_begin(struct survey *survey, const struct pokeys_io *io, uint32_t address,
		  uint32_t serial, uint64_t now_ns)
{
	struct device_config config;

	memset(survey, 0, sizeof(*survey));
	device_config_defaults(&config);
	config.mailbox.deadline_floor_ns = FLOOR_NS;
	config.serial = serial;
	device_init(&survey->device, &config, io, &survey->events);
	pokeys_device_set_peer(&survey->device.mailbox, address, PORT);
	survey->device.now_ns = now_ns;
	survey->step = STEP_IDENTITY;
}

static void next_step(struct survey *survey)
{
	survey->failures = 0;
	if (survey->step == STEP_IDENTITY)
		survey->step = STEP_ACCESS;
	else
		survey->step = survey->step == STEP_ACCESS ? 0 : survey->step + 1;
	if (survey->step == SETTINGS)
		survey->state = SURVEY_DONE;
}

static void take_identity(struct survey *survey, const uint8_t *reply)
{
	enum pokeys_fault fault;

	if (!identify_believed(&survey->device, reply))
		return;
	fault = identify_take(&survey->device, reply);
	if (fault == POKEYS_FAULT_WRONG_SERIAL)
		survey->state = SURVEY_OTHER;
	else if (fault)
		survey->state = SURVEY_UNSUPPORTED;
	else
		next_step(survey);
}

static void take_access(struct survey *survey, const uint8_t *reply)
{
	struct wire_security_rep security;

	wire_security_decode_rep(reply, &security);
	if (security.level == WIRE_LEVEL_UNLOCKED)
		next_step(survey);
	else
		survey->state = SURVEY_LOCKED;
}

static void take_setting(struct survey *survey, const uint8_t *reply)
{
	struct setting *setting = &survey->device.configure.setting[survey->step];
	unsigned int index;
	const struct setting_kind *kind = setting_kind(survey->step, &index);

	wire_decode_rep(kind->read, reply, &setting->value);
	kind->learn(&survey->device, index, &setting->value);
	kind->report(&survey->settings, index, &setting->value);
	next_step(survey);
}

/* A firmware that does not know a question does not answer it. */
static void pass_over(struct survey *survey)
{
	survey->unanswered++;
	if (survey->step == STEP_IDENTITY || ++survey->silent >= SILENT)
		survey->state = SURVEY_SILENT;
	else
		next_step(survey);
}

static void ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		  uint64_t now_ns)
{
	struct survey *survey = context;

	(void)mailbox;
	survey->device.now_ns = now_ns;
	survey->open = false;
	if (!answered(entry)) {
		if (++survey->failures >= ROUNDS)
			pass_over(survey);
		return;
	}
	survey->silent = 0;
	if (survey->step == STEP_IDENTITY) {
		take_identity(survey, entry->response_buffer);
	} else if (survey->step == STEP_ACCESS) {
		take_access(survey, entry->response_buffer);
	} else {
		take_setting(survey, entry->response_buffer);
	}
}

/* The request that reads this setting; false = there is none. */
static bool ask_setting(const struct survey *survey, enum wire_op *op,
			union setting_request *request)
{
	const struct device *device = &survey->device;
	unsigned int index;
	const struct setting_kind *kind = setting_kind(survey->step, &index);
	uint8_t packet[WIRE_PK];

	if (!kind->has(device, index) || kind->ready ||
	    (survey->step >= SETTING_AXIS && index >= device->image.capability.axes))
		return false;
	memset(request, 0, sizeof(*request));
	kind->ask(index, request);
	*op = kind->read;
	wire_encode_req(kind->read, packet, request);
	return wire_request_class(wire_op(kind->read), packet) == WIRE_READ;
}

static void ask(struct survey *survey)
{
	union setting_request request;
	enum wire_op op = survey->step == STEP_IDENTITY ? WIRE_OP_DEVICE_DATA : WIRE_OP_SECURITY;
	const void *value = NULL;

	while (survey->state == SURVEY_READING && survey->step < SETTINGS) {
		if (ask_setting(survey, &op, &request)) {
			value = &request;
			break;
		}
		next_step(survey);
	}
	if (survey->state == SURVEY_READING)
		survey->open = request_send(&survey->device, op, value, ended, NULL, survey);
}

enum survey_state survey_turn(struct survey *survey, uint64_t now_ns)
{
	survey->device.now_ns = now_ns;
	survey->device.budget = 1;
	pokeys_device_check(&survey->device.mailbox, now_ns);
	if (survey->state == SURVEY_READING && !survey->open)
		ask(survey);
	return survey->state;
}

void survey_deliver(struct survey *survey, const uint8_t *data, size_t length,
		    const struct pokeys_rx *rx, uint64_t now_ns)
{
	pokeys_device_deliver(&survey->device.mailbox, data, length, rx, now_ns);
}

const struct pokeys_identity *survey_identity(const struct survey *survey)
{
	return &survey->device.image.identity;
}

const struct pokeys_capability *survey_capability(const struct survey *survey)
{
	return &survey->device.image.capability;
}

unsigned int survey_unanswered(const struct survey *survey)
{
	return survey->unanswered;
}

const struct pokeys_settings *survey_settings(const struct survey *survey)
{
	return &survey->settings;
}
