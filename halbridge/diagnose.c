/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What tells how the driver does is wanted most when the device is silent, so
 * these pins are filled from stale images as well. Nobody closes a loop over
 * them: they are filled every 16th period, and cost nothing in the others.
 */
#include "halbridge/diagnose.h"

static void read_rates(struct value_diagnostics *value, const struct pokeys_state *state)
{
	for (unsigned int i = 0; i < POKEYS_SLOW_GROUPS; i++)
		value->rate_hz[i] = state->slow_millihertz[i] / 1e3;
}

static void read_packets(struct value_diagnostics *value, const struct pokeys_link_statistics *s)
{
	value->sent = (uint32_t)s->sent;
	value->resent = (uint32_t)s->resent;
	value->received = (uint32_t)s->received;
	value->late = (uint32_t)s->late;
	value->lost = (uint32_t)s->lost;
	value->timed_out = (uint32_t)s->timed_out;
	value->stray = (uint32_t)s->stray;
	value->duplicate = (uint32_t)s->duplicate;
	value->stale_reply = (uint32_t)s->stale;
	value->corrupt = (uint32_t)s->corrupt;
	value->wrong_source = (uint32_t)s->wrong_source;
	value->send_failed = (uint32_t)s->send_failed;
	value->cycles_late = (uint32_t)s->cycles_late;
	value->in_flight = s->in_flight;
	value->deadline_us = s->deadline_ns / 1e3;
}

static void read_device(struct value_diagnostics *value, const struct pokeys_state *state)
{
	uint32_t resyncs = 0;

	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		resyncs += state->encoder_resync[i];
	value->encoder_resyncs = resyncs;
	value->device_tick_s = state->device_tick_ms / 1e3;
	value->load = state->identity.load;
	value->locked = state->identity.locked;
	value->access = state->access;
	value->failsafe_state = state->failsafe;
	value->config_state = state->config_state;
	value->config_generation_applied = state->config_generation;
	value->config_foreign = state->config_foreign;
	value->realtime = state->flags & POKEYS_STATE_REALTIME;
	value->fallback = state->flags & POKEYS_STATE_FALLBACK;
	value->guard = state->flags & POKEYS_STATE_GUARD;
}

void diagnose_read(struct values *values, const struct pokeys_state *state)
{
	read_rates(&values->diagnostics, state);
	read_packets(&values->diagnostics, &state->statistics);
	read_device(&values->diagnostics, state);
	values_changed(values, BLOCK_DIAGNOSTICS);
}
