/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * From the state image to those of the older names that no canonical one
 * stands for: its counters of its own loop, its step codes, encoders by a
 * factor instead of counts per unit, bytes and words of the buses.
 *
 * A step code told where the old component's loop was; there is no such loop
 * any more, so each tells how old or how often read its group's data are:
 * that is what people looked at it for.
 *
 * An encoder's name from index 10 on is the same in both schemes, and then
 * scale is the canonical one (counts per unit). legacy.encoder-factor turns
 * those into the old meaning.
 */
#include "halbridge/legacy.h"
#include <stddef.h>
#include <string.h>
#include "halbridge/exchange.h"

#define VOLTS_PER_COUNT	(3.3 / 4096)	/* protocol section 3.6 */
#define AGE_MOST	2000000000.0	/* microseconds that fit into the pin */

enum { SHARED_NAME_FROM = 10 };

void legacy_init(struct legacy *legacy)
{
	memset(legacy, 0, sizeof(*legacy));
	for (unsigned int i = 0; i < LEGACY_ENCODERS; i++)
		legacy->encoder_scale[i] =
			(struct factor){ .used = 1, .seen = 1, .may_be_zero = true };
}

static int32_t age_us(uint64_t t_ns, uint64_t now_ns)
{
	double age = t_ns && t_ns < now_ns ? (double)(now_ns - t_ns) / 1e3 : 0;

	return (int32_t)(age < AGE_MOST ? age : AGE_MOST);
}

static void read_connection(const struct exchange *exchange, struct values *values, uint64_t now_ns)
{
	const struct pokeys_state *state = exchange->state;
	struct value_legacy *legacy = &values->legacy;

	legacy->connection.step = values->daemon_alive ? (int32_t)values->link_state : -1;
	legacy->connection.error = values->stale;
	legacy->connection.udp = exchange->have_state && state->identity.serial != 0;
	if (!exchange->have_state)
		return;
	legacy->encoder_step = age_us(state->t_encoder_ns, now_ns);
	legacy->digin_step = (uint32_t)age_us(state->t_digital_ns, now_ns);
	legacy->engine.step = age_us(state->t_motion_ns, now_ns);
	legacy->poextbus.step = (int32_t)state->slow_millihertz[POKEYS_SLOW_POEXTBUS];
	if (legacy->ponet.step != (int32_t)state->slow_millihertz[POKEYS_SLOW_PONET])
		values_changed(values, BLOCK_LEGACY_PONET);
	legacy->ponet.step = (int32_t)state->slow_millihertz[POKEYS_SLOW_PONET];
}

/* The device's second has changed. */
static void next_second(struct legacy *own, struct legacy_clock *clock, uint32_t second,
			uint64_t now_ns)
{
	double ns = (double)(now_ns - own->second_ns);

	clock->last_second = own->second;
	if (own->clock_known && ns > 0)
		clock->rate = (uint32_t)(own->reads * 1e9 / ns + 0.5);
	own->second = second;
	own->second_ns = now_ns;
	own->reads = 0;
	own->waited = 0;
	own->waiting = true;
}

static void read_clock(struct legacy *own, struct values *values, const struct pokeys_state *state,
		       uint64_t now_ns)
{
	struct legacy_clock *clock = &values->legacy.clock;
	const uint32_t second = state->rtc.second, minute = state->rtc.minute;

	own->reads++;
	clock->loops = own->reads;
	clock->unnamed = state->rtc.unnamed;
	if (minute != own->minute) {
		clock->last_minute = own->minute;
		own->minute = minute;
	}
	if (second != own->second || !own->clock_known)
		next_second(own, clock, second, now_ns);
	own->clock_known = true;
	own->waited += own->waiting;
	if (own->waiting && clock->second_back == second) {
		clock->latency = own->waited - 1;
		own->waiting = false;
	}
}

static void read_encoder(struct exchange *exchange, struct values *values, unsigned int i)
{
	struct legacy_encoder *value = &values->legacy.encoder[i];
	const struct encoder *encoder = &exchange->encoder[i];
	double counts = (double)(encoder->total - encoder->zero);
	double rate = encoder->velocity.rate;
	bool moved = exchange->encoders_moved >> i & 1;
	double scale;

	if (!moved && value->scale == exchange->legacy.encoder_scale[i].seen)
		return;
	scale = factor_take(&exchange->legacy.encoder_scale[i], &exchange->refusals, value->scale,
			    offsetof(struct values, legacy.encoder) + i * sizeof(*value) +
				    offsetof(struct legacy_encoder, scale));

	value->position = counts * scale;
	value->velocity = rate * scale;
	values_touched(values, offsetof(struct values, legacy.encoder) + i * sizeof(*value),
		       sizeof(*value));
	if (i < SHARED_NAME_FROM || !values->legacy.choice.encoder_factor)
		return;
	values->encoder[i].position = counts * exchange->encoder[i].scale.used;
	values->encoder[i].velocity = rate * exchange->encoder[i].scale.used;
	values_touched(values, encoder_member(i, 0), sizeof(values->encoder[i]));
}

/* The choice counts for an encoder that stands, too. */
static void read_choice(struct exchange *exchange, const struct values *values)
{
	const bool factor = values->legacy.choice.encoder_factor;

	if (factor == exchange->legacy.encoder_factor)
		return;
	exchange->legacy.encoder_factor = factor;
	for (unsigned int i = SHARED_NAME_FROM; i < POKEYS_ENCODERS; i++)
		encoder_show_again(&exchange->encoder[i]);
	exchange->encoders_moved |= ~((UINT32_C(1) << SHARED_NAME_FROM) - 1);
}

/* The canonical part has seen whether anything has changed there. */
static void read_modules(struct values *values, const struct pokeys_state *state)
{
	const uint32_t blocks = 1u << BLOCK_PONET | 1u << BLOCK_KBD48;
	struct value_legacy *legacy = &values->legacy;

	if (!(values->changed & blocks))
		return;
	for (unsigned int i = 0; i < POKEYS_PONET; i++) {
		legacy->ponet.id[i] = i;
		legacy->ponet.address[i] = state->ponet[i].address;
		legacy->ponet.type[i] = state->ponet[i].type;
		legacy->ponet.size[i] = state->ponet[i].size;
		legacy->ponet.options[i] = state->ponet[i].options;
		for (unsigned int k = 0; k < LEGACY_WORDS; k++)
			legacy->ponet.in[i][k] = state->ponet[i].data[k];
	}
	legacy->ponet.found = state->ponet_count;
	legacy->ponet.available = state->kbd48_module < POKEYS_PONET;
	legacy->ponet.keyboard = legacy->ponet.available ? state->kbd48_module : 0;
	values_changed(values, BLOCK_LEGACY_PONET);
}

static void read_buses(struct exchange *exchange, struct values *values)
{
	const struct pokeys_state *state = exchange->state;
	struct legacy *own = &exchange->legacy;
	struct value_legacy *legacy = &values->legacy;

	for (unsigned int i = 0; i < POKEYS_POEXTBUS; i++) {
		legacy->poextbus.in[i] = state->poextbus[i];
		legacy->poextbus.out[i] = exchange->command.poextbus[i];
	}
	read_modules(values, state);
	if (own->brightness_known && values->kbd48.brightness_sent != own->brightness) {
		legacy->ponet.brightness_before = own->brightness;
		values_changed(values, BLOCK_LEGACY_PONET);
	}
	own->brightness = values->kbd48.brightness_sent;
	own->brightness_known = true;
}

static void read_analog(struct values *values, const struct pokeys_state *state)
{
	struct value_legacy *legacy = &values->legacy;

	for (unsigned int i = 0; i < POKEYS_ANALOG; i++)
		legacy->adcin[i].volts = state->analog[i] * VOLTS_PER_COUNT;
	for (unsigned int i = 0; i < POKEYS_PWM; i++) {
		legacy->adcout[i].step = state->pwm_duty[POKEYS_PWM - 1 - i];
		legacy->adcout[i].pin = 17 + i;
	}
	legacy->adcout_step = state->pwm_enabled;
}

void legacy_read(struct exchange *exchange, struct values *values, uint64_t now_ns)
{
	if (!exchange->legacy.on)
		return;
	read_connection(exchange, values, now_ns);
	if (exchange->have_state)
		values->one_shot_failed_count += legacy_failed(exchange);
	read_choice(exchange, values);
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		read_encoder(exchange, values, i);
	if (exchange->fresh) {
		read_clock(&exchange->legacy, values, exchange->state, now_ns);
		read_buses(exchange, values);
		read_analog(values, exchange->state);
		legacy_home_read(exchange, values);
		legacy_read_axes(exchange, values);
	}
	legacy_read_engine(exchange, values, exchange->fresh);
	values_changed(values, BLOCK_LEGACY_LINK);
	values_changed(values, BLOCK_LEGACY_IO);
	values_changed(values, BLOCK_LEGACY_AXIS);
	values_changed(values, BLOCK_LEGACY_ENGINE);
}
