/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PoNET: which modules there are, and their inputs (protocol section 3.13).
 *
 * The bus is slow and answers later than the request: a reading is started and
 * then fetched until it is done. So it is one slow group whose requests follow
 * a round of steps, one at a time:
 *
 *	look:	bus state, then settings and version of each of the 16 modules
 *	read:	for each module with inputs start and fetch its data, now and
 *		then its light, and after many rounds the bus state again
 *
 * All is looked at anew when the bus leaves and reaches its ready state, or now
 * and then as long as there is no module. A fetch does not say of which module
 * it is. It is sent only after the start was answered, and the next start only
 * after the fetch; a start that the network keeps back and delivers twice could
 * still give a module its neighbour's data once, and the next round mends that.
 *
 * Another client of the device that reads another module does the same to us, and
 * may do so in every round; nothing in an answer tells it. So a key that is newly
 * pressed is believed when a second reading, made at once, has it too.
 *
 * A module that does not answer keeps its last data, but for the keys of a
 * keyboard: a jog key that cannot be read any more must not stay pressed.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define NOBODY_NS (2 * SECOND)		/* look again for modules, while there is none */

enum {
	BUS_READING = 50,  /* bus states, from here ... */
	BUS_PWM = 80,      /* ... to here it is at work */
	FETCHES_MAX = 50,  /* then the module does not answer */
	LIGHT_ROUNDS = 8,  /* light once in so many readings of a module */
	STATE_ROUNDS = 32, /* bus state once in so many readings */
	KEYS_ROUND = 8,    /* requests that a module may need for its turn ... */
	KEYS_MORE = 32,    /* ... and some that get lost; then keys are up */
};

bool ponet_has(const struct device *device)
{
	return device->image.capability.ponet && device->now_ns >= device->ponet.after_ns;
}

enum wire_op ponet_ask(struct device *device, union slow_request *request)
{
	struct ponet *ponet = &device->ponet;

	switch ((enum ponet_step)ponet->step) {
	case PONET_STATE:
		return WIRE_OP_PONET_STATUS;
	case PONET_SETTINGS:
	case PONET_VERSION:
		request->module.module = ponet->module;
		return ponet->step == PONET_SETTINGS ? WIRE_OP_PONET_SETTINGS :
						       WIRE_OP_PONET_VERSION;
	case PONET_START:
	case PONET_FETCH:
	case PONET_LIGHT_START:
	case PONET_LIGHT_FETCH:
		break;
	}
	request->ponet.module = ponet->module;
	request->ponet.option = ponet->step == PONET_START || ponet->step == PONET_LIGHT_START ?
					WIRE_PONET_START :
					WIRE_PONET_FETCH;
	return ponet->step == PONET_START || ponet->step == PONET_FETCH ? WIRE_OP_PONET_DATA :
									  WIRE_OP_PONET_LIGHT;
}

static void look(struct device *device)
{
	device->ponet.step = PONET_SETTINGS;
	device->ponet.module = 0;
	device->ponet.fetches = 0;
}

static bool has_option(const struct device *device, unsigned int module, uint8_t option)
{
	return device->image.ponet[module].type && device->image.ponet[module].options & option;
}

/* The next module with inputs; the state of the bus when all had their turn often enough. */
static void next_reading(struct device *device)
{
	struct ponet *ponet = &device->ponet;

	ponet->fetches = 0;
	ponet->again = false;
	ponet->step = PONET_STATE;
	if (++ponet->readings % STATE_ROUNDS == 0)
		return;
	for (unsigned int i = 1; i <= POKEYS_PONET; i++) {
		const unsigned int module = (ponet->module + i) % POKEYS_PONET;

		if (!has_option(device, module, WIRE_PONET_OPT_INPUTS))
			continue;
		ponet->module = (uint8_t)module;
		ponet->step = PONET_START;
		return;
	}
	ponet->after_ns = device->now_ns + NOBODY_NS;
}

/* In a number as wide as the index: GCC 12 at -O3 counts downwards in one of 8 bits. */
static void count_modules(struct device *device)
{
	struct pokeys_state *image = &device->image;
	unsigned int count = 0;

	image->kbd48_module = UINT8_MAX;
	for (unsigned int i = 0; i < POKEYS_PONET; i++) {
		count += image->ponet[i].type != 0;
		if (image->ponet[i].type == WIRE_PONET_KBD48 && image->kbd48_module == UINT8_MAX)
			image->kbd48_module = (uint8_t)i;
	}
	image->ponet_count = (uint8_t)count;
	if (image->kbd48_module == UINT8_MAX)
		image->kbd48_keys = 0;
	device->ponet.complete = true;
}

/* The module after this one, or reading when all have been looked at. */
static void next_module(struct device *device)
{
	struct ponet *ponet = &device->ponet;

	ponet->step = PONET_SETTINGS;
	if (++ponet->module < POKEYS_PONET)
		return;
	count_modules(device);
	ponet->module = POKEYS_PONET - 1;
	next_reading(device);
}

/* At work with its modules, or waiting for work. */
static bool at_work(uint8_t state)
{
	return state == WIRE_PONET_READY || (state >= BUS_READING && state <= BUS_PWM);
}

static void take_state(struct device *device, const uint8_t *reply)
{
	struct wire_ponet_status_rep status;
	struct ponet *ponet = &device->ponet;
	const bool was_ready = ponet->ready;

	wire_ponet_status_decode_rep(reply, &status);
	device->image.ponet_state = status.state;
	ponet->ready = at_work(status.state);
	if (!device->image.ponet_count || !was_ready || !ponet->ready)
		look(device);
	else
		next_reading(device);
}

static void take_settings(struct device *device, const uint8_t *reply)
{
	struct pokeys_ponet_module *module = &device->image.ponet[device->ponet.module];
	struct wire_ponet_settings_rep settings;
	bool there;

	wire_ponet_settings_decode_rep(reply, &settings);
	there = settings.result == WIRE_BUS_OK && settings.type;
	if (!there || module->type != settings.type)
		memset(module, 0, sizeof(*module));
	if (!there) {
		next_module(device);
		return;
	}
	module->type = settings.type;
	module->address = settings.address;
	module->size = settings.size;
	module->options = settings.options;
	device->ponet.step = PONET_VERSION;
}

static void take_version(struct device *device, const uint8_t *reply)
{
	struct wire_ponet_version_rep version;

	wire_ponet_version_decode_rep(reply, &version);
	if (version.result == WIRE_BUS_OK)
		device->image.ponet[device->ponet.module].version = version.version;
	next_module(device);
}

static void fail(struct device *device)
{
	struct pokeys_ponet_module *module = &device->image.ponet[device->ponet.module];

	if (module->failures < UINT8_MAX)
		module->failures++;
	next_reading(device);
}

/* False when there is a key that was not pressed before, and it has to be read again. */
static bool take_keys(struct device *device, uint64_t keys)
{
	struct ponet *ponet = &device->ponet;
	uint64_t *pressed = &device->image.kbd48_keys;

	ponet->since_keys = 0;
	if (keys & ~*pressed && !ponet->again) {
		ponet->again = true;
		ponet->keys = keys;
		return false;
	}
	*pressed = ponet->again ? keys & (ponet->keys | *pressed) : keys;
	return true;
}

static void take_data(struct device *device, const uint8_t *reply)
{
	struct ponet *ponet = &device->ponet;
	struct pokeys_ponet_module *module = &device->image.ponet[ponet->module];
	struct wire_ponet_data_rep data;

	wire_ponet_data_decode_rep(reply, &data);
	if (data.result == WIRE_BUS_FAIL || ++ponet->fetches > FETCHES_MAX) {
		fail(device);
		return;
	}
	ponet->step = PONET_FETCH;
	if (ponet->fetches == 1 || data.result != WIRE_BUS_OK ||
	    data.status == WIRE_PONET_STILL_BUSY)
		return; /* the answer to the start, or not done yet */
	module->status = data.status;
	if (data.status) {
		fail(device);
		return;
	}
	module->failures = 0;
	if (ponet->module == device->image.kbd48_module &&
	    !take_keys(device, wire_kbd48_keys(data.data))) {
		ponet->fetches = 0;
		ponet->step = PONET_START;
		return;
	}
	memcpy(module->data, data.data, sizeof(module->data));
	if (!has_option(device, ponet->module, WIRE_PONET_OPT_LIGHT) ||
	    ponet->round[ponet->module]++ % LIGHT_ROUNDS) {
		next_reading(device);
		return;
	}
	ponet->step = PONET_LIGHT_START;
	ponet->fetches = 0;
}

static void take_light(struct device *device, const uint8_t *reply)
{
	struct ponet *ponet = &device->ponet;
	struct wire_ponet_light_rep light;

	wire_ponet_light_decode_rep(reply, &light);
	ponet->step = PONET_LIGHT_FETCH;
	if (light.result != WIRE_BUS_FAIL && ++ponet->fetches <= FETCHES_MAX) {
		if (ponet->fetches == 1 || light.result != WIRE_BUS_OK ||
		    light.status == WIRE_PONET_STILL_BUSY)
			return;
		if (!light.status)
			device->image.ponet[ponet->module].light = light.value;
	}
	next_reading(device);
}

static void release_keys(struct device *device)
{
	const uint32_t most = KEYS_MORE + KEYS_ROUND * (uint32_t)device->image.ponet_count;

	if (++device->ponet.since_keys > most)
		device->image.kbd48_keys = 0;
}

void ponet_take(struct device *device, const mailbox_entry_t *entry)
{
	static void (*const take[])(struct device *, const uint8_t *) = {
		[PONET_STATE] = take_state,       [PONET_SETTINGS] = take_settings,
		[PONET_VERSION] = take_version,   [PONET_START] = take_data,
		[PONET_FETCH] = take_data,        [PONET_LIGHT_START] = take_light,
		[PONET_LIGHT_FETCH] = take_light,
	};

	release_keys(device);
	take[device->ponet.step](device, entry->response_buffer);
}

void ponet_unanswered(struct device *device)
{
	struct ponet *ponet = &device->ponet;

	release_keys(device);
	if (ponet->step >= PONET_START)
		fail(device);
}

void ponet_begin(struct device *device)
{
	struct pokeys_state *image = &device->image;

	memset(&device->ponet, 0, sizeof(device->ponet));
	memset(image->ponet, 0, sizeof(image->ponet));
	image->ponet_state = 0;
	image->ponet_count = 0;
	image->kbd48_module = UINT8_MAX;
	image->kbd48_keys = 0;
}
