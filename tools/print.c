// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A device's state for a person. What is not known is not shown as zero: a
 * device that never answered has no inputs. Pins are numbered as on the
 * terminals, from 1, as in pokeysd.conf.
 */
#include <math.h>
#include <string.h>
#include <pokeys/names.h>
#include "tools/print.h"

#define HISTOGRAM(field, title, ...) \
	{ #field, title, offsetof(struct pokeys_diag, field), __VA_ARGS__ }

const struct print_histogram print_histograms[] = {
	HISTOGRAM(wakeup, "wake-up", true),
	HISTOGRAM(round_trip, "round trip", true),
	HISTOGRAM(fast_round_trip, "fast requests", true),
	HISTOGRAM(read_round_trip, "reads", false),
	HISTOGRAM(write_round_trip, "writes", false),
	HISTOGRAM(one_shot_round_trip, "one-shots", false),
	HISTOGRAM(receive, "receive", true),
	HISTOGRAM(fresh, "data fresh", true),
	HISTOGRAM(age_at_read, "age at read", true),
	HISTOGRAM(publish, "publish", true),
	HISTOGRAM(cycle_work, "cycle work", true),
};
const size_t print_histogram_count = sizeof(print_histograms) / sizeof(print_histograms[0]);

const struct pokeys_histogram *print_histogram_of(const struct pokeys_diag *diag, size_t index)
{
	return (const void *)((const char *)diag + print_histograms[index].offset);
}

const char *print_duration(double ns, char text[16])
{
	if (!isfinite(ns))
		snprintf(text, 16, "-");
	else if (ns < 999.5)
		snprintf(text, 16, "%.0f ns", ns);
	else if (ns < 999.5e3)
		snprintf(text, 16, "%.3g us", ns / 1e3);
	else if (ns < 999.5e6)
		snprintf(text, 16, "%.3g ms", ns / 1e6);
	else
		snprintf(text, 16, "%.1f s", ns / 1e9);
	return text;
}

bool print_bit(const uint8_t *bits, unsigned int index)
{
	return bits[index / 8] >> index % 8 & 1;
}

void print_pins(const uint8_t bits[POKEYS_PIN_BYTES], char *text, size_t size)
{
	size_t at = 0;

	for (unsigned int pin = 0; pin < POKEYS_PINS && at + 4 < size; pin++)
		if (print_bit(bits, pin))
			at += (size_t)snprintf(text + at, size - at, "%s%u", at ? " " : "",
					       pin + 1);
	if (!at)
		snprintf(text, size, "none");
}

const char *print_clean(const char *bytes, size_t size, char text[32])
{
	size_t length = 0;

	for (; length < size && length < 31 && bytes[length]; length++)
		text[length] = bytes[length] >= 0x20 && bytes[length] < 0x7f ? bytes[length] : '?';
	text[length] = '\0';
	return text;
}

static void print_identity(const struct pokeys_state *state, FILE *to)
{
	const struct pokeys_identity *id = &state->identity;
	char type[32], name[32];
	uint32_t a = id->address;

	if (!id->serial && !a)
		return;
	fprintf(to, "  device      ");
	if (id->serial)
		fprintf(to, "%s%s%s, serial %u, firmware %u.%u.%u, ",
			print_clean(id->type, sizeof(id->type), type), *id->name ? " " : "",
			print_clean(id->name, sizeof(id->name), name), id->serial,
			id->firmware_major, id->firmware_minor, id->firmware_revision);
	fprintf(to, "at %u.%u.%u.%u\n", a >> 24, a >> 16 & 255, a >> 8 & 255, a & 255);
}

static void print_control(const struct pokeys_state *state, FILE *to)
{
	fprintf(to, "  control     %s, %s%s%s%s%s\n",
		state->flags & POKEYS_STATE_COMMANDER ? "commanded" : "no commander",
		state->flags & POKEYS_STATE_MACHINE_ON ? "motion permitted" : "no motion",
		state->flags & POKEYS_STATE_NEEDS_EDGE ? " (switch machine-on off and on)" : "",
		state->flags & POKEYS_STATE_SAFE ? ", outputs in the safe state" : "",
		state->flags & POKEYS_STATE_OUTPUTS_HELD ?
			", outputs held since a loss until machine-on rises" :
			"",
		state->flags & POKEYS_STATE_BAD_COMMAND ? ", COMMANDS REFUSED" : "");
}

const char *print_phase(const struct pokeys_phase *phase, char text[80])
{
	char lead[16], jitter[16];

	if (phase->state == POKEYS_PHASE_LOCKED || phase->state == POKEYS_PHASE_SEEKING)
		snprintf(text, 80, "%s, tick %s before the read, error %+.1f us, jitter %s",
			 pokeys_phase_name(phase->state), print_duration(phase->lead_ns, lead),
			 phase->error_ns / 1e3, print_duration(phase->jitter_ns, jitter));
	else
		snprintf(text, 80, "%s", pokeys_phase_name(phase->state));
	return text;
}

static void print_io(const struct pokeys_state *state, FILE *to)
{
	uint8_t outputs[POKEYS_PIN_BYTES];
	char text[256];

	print_pins(state->digital_in, text, sizeof(text));
	fprintf(to, "  inputs on   %s\n", text);
	for (unsigned int i = 0; i < POKEYS_PIN_BYTES; i++)
		outputs[i] = state->digital_out[i] & state->digital_out_owned[i];
	print_pins(outputs, text, sizeof(text));
	fprintf(to, "  outputs on  %s\n", text);
	fprintf(to, "  analog     ");
	for (unsigned int i = 0; i < POKEYS_ANALOG; i++)
		fprintf(to, " %u", state->analog[i]);
	fputc('\n', to);
	if (!state->encoder_enabled)
		return;
	fprintf(to, "  encoders   ");
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		if (state->encoder_enabled >> i & 1)
			fprintf(to, " %u:%d", i, state->encoder[i]);
	fputc('\n', to);
}

static void print_packets(const struct view_device *device, FILE *to)
{
	const struct pokeys_link_statistics *s = &device->state.statistics;

	fprintf(to,
		"  packets     %llu sent, %llu late, %llu lost, %llu repeated, %llu given up, "
		"%llu unexpected, %llu damaged or foreign\n",
		(unsigned long long)s->sent, (unsigned long long)s->late,
		(unsigned long long)s->lost, (unsigned long long)s->resent,
		(unsigned long long)s->timed_out,
		(unsigned long long)(s->stray + s->duplicate + s->stale),
		(unsigned long long)(s->corrupt + s->wrong_source));
}

static void print_latencies(const struct pokeys_diag *diag, FILE *to)
{
	for (size_t i = 0; i < print_histogram_count; i++) {
		const struct pokeys_histogram *h = print_histogram_of(diag, i);
		char half[16], most[16], all[16];

		if (!h->count)
			continue;
		fprintf(to, "  %-13s %s median, %s p99, %s most\n", print_histograms[i].title,
			print_duration((double)pokeys_histogram_percentile(h, 0.5), half),
			print_duration((double)pokeys_histogram_percentile(h, 0.99), most),
			print_duration((double)h->max_ns, all));
	}
}

void print_status(const struct view_device *device, FILE *to)
{
	const struct pokeys_state *state = &device->state;
	char age[16], transport[32], phase[80];

	if (device->freshness == VIEW_NONE) {
		fprintf(to, "%s: not attached: %s\n", device->name, device->why);
		return;
	}
	fprintf(to, "%s: %s%s%s\n", device->name, pokeys_link_name(state->link),
		*device->why ? ": " : "", device->why);
	print_identity(state, to);
	if (state->t_digital_ns) {
		fprintf(to, "  data        %s old, cycle %llu, every %g ms, %s%s\n",
			print_duration(view_data_age_ns(device), age),
			(unsigned long long)state->cycle, (double)state->period_ns / 1e6,
			device->has_diag ? print_clean(device->diag.transport,
						       sizeof(device->diag.transport), transport) :
					   "?",
			state->flags & POKEYS_STATE_REALTIME ? "" : ", NOT REALTIME");
		if (device->freshness != VIEW_FRESH)
			fputs("  values      NOT CURRENT, the last ones received\n", to);
		print_control(state, to);
		if (state->config_foreign)
			fprintf(to,
				"  settings    changed %u time%s by another program; see the "
				"log\n",
				state->config_foreign, state->config_foreign == 1 ? "" : "s");
		fprintf(to, "  phase       %s\n", print_phase(&state->phase, phase));
		print_io(state, to);
		print_engine(device, to);
		print_heaters(state, to);
		print_servos(state, to);
	}
	print_packets(device, to);
	if (device->has_diag)
		print_latencies(&device->diag, to);
}

void print_wrapped(const char *first, const char *next, int columns, const char *text, FILE *to)
{
	int column = fprintf(to, "%s", first);
	bool begins = true;

	while (*text) {
		const int length = (int)strcspn(text, " ");

		if (!begins && column + 1 + length > columns) {
			column = fprintf(to, "\n%s", next) - 1;
			begins = true;
		}
		column += fprintf(to, "%s%.*s", begins ? "" : " ", length, text);
		begins = false;
		text += length;
		text += strspn(text, " ");
	}
	fputc('\n', to);
}
