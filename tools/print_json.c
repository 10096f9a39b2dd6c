// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A device's state for scripts. The keys are a promise: they are listed in
 * pokeysctl(1), a test compares, and a key keeps its meaning as long as
 * "format" is 1. Where the image says that something is not known, the value
 * is null, not a number that looks like data.
 */
#include <math.h>
#include <stddef.h>
#include <string.h>
#include <pokeys/names.h>
#include "tools/print.h"

/* Numbers that stand in the images as they are. */
struct row {
	const char *key;
	size_t offset, width;
};

#define STATISTIC(field) { #field, offsetof(struct pokeys_link_statistics, field), \
			   sizeof(((struct pokeys_link_statistics *)0)->field) }
static const struct row statistics[] = {
	STATISTIC(sent),
	STATISTIC(resent),
	STATISTIC(received),
	STATISTIC(accepted),
	STATISTIC(missed),
	STATISTIC(late),
	STATISTIC(lost),
	STATISTIC(timed_out),
	STATISTIC(stray),
	STATISTIC(duplicate),
	STATISTIC(stale),
	STATISTIC(corrupt),
	STATISTIC(wrong_source),
	STATISTIC(send_failed),
	STATISTIC(cycles_late),
	STATISTIC(reconnects),
	STATISTIC(rtt_last_ns),
	STATISTIC(rtt_smoothed_ns),
	STATISTIC(rtt_min_ns),
	STATISTIC(rtt_max_ns),
	STATISTIC(deadline_ns),
	STATISTIC(in_flight),
	STATISTIC(packet_error_level),
	STATISTIC(refused_command),
	STATISTIC(one_shot_refused),
};

#define DIAG(field) { #field, offsetof(struct pokeys_diag, field), \
		      sizeof(((struct pokeys_diag *)0)->field) }
static const struct row counters[] = {
	DIAG(cycles_skipped),
	DIAG(events_dropped),
	DIAG(event_high_water),
	DIAG(transport_system_calls),
	DIAG(transport_waits_avoided),
	DIAG(transport_rearmed),
	DIAG(transport_no_buffers),
	DIAG(transport_overflow),
	DIAG(transport_truncated),
	DIAG(minor_faults),
	DIAG(major_faults),
	DIAG(guard_passed),
	DIAG(guard_dropped),
};

static const struct {
	const char *key;
	uint32_t bit;
} flags[] = {
	{ "commander", POKEYS_STATE_COMMANDER },
	{ "safe", POKEYS_STATE_SAFE },
	{ "machine_on", POKEYS_STATE_MACHINE_ON },
	{ "needs_edge", POKEYS_STATE_NEEDS_EDGE },
	{ "edge_unread", POKEYS_STATE_EDGE_UNREAD },
	{ "outputs_held", POKEYS_STATE_OUTPUTS_HELD },
	{ "realtime", POKEYS_STATE_REALTIME },
	{ "fallback", POKEYS_STATE_FALLBACK },
	{ "bad_command", POKEYS_STATE_BAD_COMMAND },
	{ "stopping", POKEYS_STATE_STOPPING },
	{ "guard", POKEYS_STATE_GUARD },
};

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

static void put_rows(struct json *json, const char *key, const struct row *rows, size_t count,
		     const void *image)
{
	json_object(json, key);
	for (size_t i = 0; i < count; i++) {
		uint64_t value = 0;

		memcpy(&value, (const char *)image + rows[i].offset, rows[i].width);
		json_unsigned(json, rows[i].key, value);
	}
	json_end(json);
}

static void put_age(struct json *json, const char *key, const struct view_device *device,
		    uint64_t then_ns)
{
	json_real(json, key, view_age_ns(device->now_ns, then_ns) / 1e3);
}

static void put_ages(struct json *json, const struct view_device *device)
{
	const struct pokeys_state *state = &device->state;

	json_object(json, "age_us");
	put_age(json, "publish", device, state->t_publish_ns);
	put_age(json, "digital", device, state->t_digital_ns);
	put_age(json, "analog", device, state->t_analog_ns);
	put_age(json, "encoder", device, state->t_encoder_ns);
	put_age(json, "motion", device, state->t_motion_ns);
	put_age(json, "slow", device, state->t_slow_ns);
	json_end(json);
}

/* Fixed-size texts in the image need not end. */
static void put_bounded(struct json *json, const char *key, const char *text, size_t size)
{
	char copy[64];

	snprintf(copy, sizeof(copy), "%.*s", (int)size, text);
	json_text(json, key, copy);
}

static void put_identity(struct json *json, const struct pokeys_identity *id)
{
	char text[32];

	json_object(json, "identity");
	json_unsigned(json, "serial", id->serial);
	put_bounded(json, "type", id->type, sizeof(id->type));
	put_bounded(json, "name", id->name, sizeof(id->name));
	json_unsigned(json, "hardware", id->hardware);
	snprintf(text, sizeof(text), "%u.%u.%u", id->firmware_major, id->firmware_minor,
		 id->firmware_revision);
	json_text(json, "firmware", text);
	put_bounded(json, "build", id->build, sizeof(id->build));
	snprintf(text, sizeof(text), "%u.%u.%u.%u", id->address >> 24, id->address >> 16 & 255,
		 id->address >> 8 & 255, id->address & 255);
	json_text(json, "address", text);
	json_unsigned(json, "user_id", id->user_id);
	json_bool(json, "locked", id->locked);
	json_unsigned(json, "load", id->load);
	json_end(json);
}

static void put_bits(struct json *json, const char *key, const uint8_t *bits)
{
	json_array(json, key);
	for (unsigned int pin = 0; pin < POKEYS_PINS; pin++)
		json_unsigned(json, NULL, print_bit(bits, pin));
	json_end(json);
}

static void put_io(struct json *json, const struct pokeys_state *state)
{
	put_bits(json, "inputs", state->digital_in);
	put_bits(json, "outputs", state->digital_out);
	put_bits(json, "outputs_owned", state->digital_out_owned);
	json_array(json, "pin_functions");
	for (unsigned int i = 0; i < POKEYS_PINS; i++)
		json_unsigned(json, NULL, state->pin_function[i]);
	json_end(json);
	json_array(json, "analog");
	for (unsigned int i = 0; i < POKEYS_ANALOG; i++)
		json_unsigned(json, NULL, state->analog[i]);
	json_end(json);
}

static void put_encoders(struct json *json, const struct view_device *device)
{
	const struct pokeys_state *state = &device->state;

	json_array(json, "encoders");
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++) {
		json_object(json, NULL);
		json_bool(json, "enabled", state->encoder_enabled >> i & 1);
		json_integer(json, "count", state->encoder[i]);
		put_age(json, "age_us", device, state->encoder_t_ns[i]);
		json_unsigned(json, "resync", state->encoder_resync[i]);
		json_end(json);
	}
	json_end(json);
}

static void put_histograms(struct json *json, const struct pokeys_diag *diag)
{
	json_object(json, "latency_us");
	for (size_t i = 0; i < print_histogram_count; i++) {
		const struct pokeys_histogram *h = print_histogram_of(diag, i);
		double count = (double)h->count;

		json_object(json, print_histograms[i].key);
		json_unsigned(json, "count", h->count);
		json_real(json, "min", h->count ? (double)h->min_ns / 1e3 : NAN);
		json_real(json, "mean", h->count ? (double)h->sum_ns / 1e3 / count : NAN);
		json_real(json, "p50",
			  h->count ? (double)pokeys_histogram_percentile(h, 0.5) / 1e3 : NAN);
		json_real(json, "p99",
			  h->count ? (double)pokeys_histogram_percentile(h, 0.99) / 1e3 : NAN);
		json_real(json, "p999",
			  h->count ? (double)pokeys_histogram_percentile(h, 0.999) / 1e3 : NAN);
		json_real(json, "max", h->count ? (double)h->max_ns / 1e3 : NAN);
		json_end(json);
	}
	json_end(json);
}

static void put_diag(struct json *json, const struct view_device *device)
{
	if (!device->has_diag) {
		json_null(json, "diag");
		return;
	}
	json_object(json, "diag");
	put_bounded(json, "transport", device->diag.transport, sizeof(device->diag.transport));
	put_rows(json, "counters", counters, COUNT(counters), &device->diag);
	put_histograms(json, &device->diag);
	json_end(json);
}

static void put_phase(struct json *json, const struct pokeys_phase *phase)
{
	json_object(json, "phase");
	json_text(json, "state", pokeys_phase_name(phase->state));
	json_unsigned(json, "master", phase->master);
	json_unsigned(json, "losses", phase->losses);
	json_real(json, "error_us", phase->error_ns / 1e3);
	json_real(json, "lead_us", phase->lead_ns / 1e3);
	json_real(json, "jitter_us", phase->jitter_ns / 1e3);
	json_real(json, "period_us", phase->period_ns / 1e3);
	json_end(json);
}

static void put_state(struct json *json, const struct view_device *device)
{
	const struct pokeys_state *state = &device->state;

	json_object(json, "state");
	json_text(json, "link", pokeys_link_name(state->link));
	json_text(json, "fault", pokeys_fault_name(state->fault));
	json_unsigned(json, "fault_count", state->fault_count);
	json_unsigned(json, "epoch", state->epoch);
	json_unsigned(json, "cycle", state->cycle);
	json_real(json, "period_us", (double)state->period_ns / 1e3);
	json_real(json, "stale_after_us", (double)state->stale_after_ns / 1e3);
	put_ages(json, device);
	json_object(json, "flags");
	for (size_t i = 0; i < COUNT(flags); i++)
		json_bool(json, flags[i].key, state->flags & flags[i].bit);
	json_end(json);
	json_unsigned(json, "config_foreign", state->config_foreign);
	put_phase(json, &state->phase);
	put_identity(json, &state->identity);
	put_io(json, state);
	put_encoders(json, device);
	print_json_engine(json, state);
	print_json_heaters(json, state);
	print_json_servos(json, state);
	put_rows(json, "statistics", statistics, COUNT(statistics), &state->statistics);
	json_end(json);
}

static void put_device(struct json *json, const struct view_device *device)
{
	json_object(json, NULL);
	json_text(json, "name", device->name);
	json_bool(json, "attached", device->freshness != VIEW_NONE);
	json_bool(json, "publishing", device->freshness > VIEW_DEAD);
	json_bool(json, "fresh", device->freshness == VIEW_FRESH);
	json_text(json, "reason", device->why);
	if (device->freshness == VIEW_NONE) {
		json_null(json, "state");
		json_null(json, "diag");
	} else {
		put_state(json, device);
		put_diag(json, device);
	}
	json_end(json);
}

void print_json_all(const struct view *view, FILE *to)
{
	struct json json;

	json_init(&json, to);
	json_object(&json, NULL);
	json_unsigned(&json, "format", 1);
	json_array(&json, "devices");
	for (size_t i = 0; i < view->count; i++)
		put_device(&json, &view->device[i]);
	json_end(&json);
	json_end(&json);
	fflush(to);
}
