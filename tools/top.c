// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl top: one device on 80 by 24 characters, or a line for each of
 * several. What a machinist looks for stands on top: does it run, how old is
 * the data, is it in the safe state.
 *
 * Rates are differences between two drawings; all else is of one moment.
 */
#include <errno.h>
#include <math.h>
#include <string.h>
#include <unistd.h>
#include <pokeys/names.h>
#include "tools/pokeysctl.h"
#include "tools/print.h"
#include "tools/screen.h"
#include "tools/top.h"
#include "tools/view.h"

/* Counters as they were drawn last, for rates. */
struct before {
	uint64_t now_ns, cycle, received, missed;
};

struct rates {
	double cycles, received, missed; /* a second; NAN at first */
};

static struct rates rates_of(struct before *before, const struct view_device *device)
{
	const struct pokeys_state *state = &device->state;
	double seconds = (double)(device->now_ns - before->now_ns) / 1e9;
	struct rates rates = { NAN, NAN, NAN };

	if (before->now_ns && state->cycle >= before->cycle) {
		rates.cycles = (double)(state->cycle - before->cycle) / seconds;
		rates.received = (double)(state->statistics.received - before->received) / seconds;
		rates.missed = (double)(state->statistics.missed - before->missed) / seconds;
	}
	*before = (struct before){ device->now_ns, state->cycle, state->statistics.received,
				   state->statistics.missed };
	return rates;
}

/* What is not known is not shown as zeros. */
static void draw_identity(struct screen *screen, const struct pokeys_identity *id)
{
	char type[32], place[32] = "";
	uint32_t a = id->address;

	if (a)
		snprintf(place, sizeof(place), "  at %u.%u.%u.%u", a >> 24, a >> 16 & 255,
			 a >> 8 & 255, a & 255);
	if (id->serial)
		screen_line(screen, "%s %u  firmware %u.%u.%u%s",
			    print_clean(id->type, sizeof(id->type), type), id->serial,
			    id->firmware_major, id->firmware_minor, id->firmware_revision, place);
	else
		screen_line(screen, "(not identified yet)%s", place);
}

static void draw_head(struct screen *screen, const struct view_device *device,
		      const struct rates *rates)
{
	const struct pokeys_state *state = &device->state;
	const struct pokeys_identity *id = &state->identity;
	char age[16], phase[80];

	screen_line(screen, "%s: %s%s%s", device->name, pokeys_link_name(state->link),
		    *device->why ? ": " : "", device->why);
	draw_identity(screen, id);
	screen_line(screen, "age %-9s %s%s%s%s%s", print_duration(view_data_age_ns(device), age),
		    state->flags & POKEYS_STATE_COMMANDER ? " commanded" : " no commander",
		    state->flags & POKEYS_STATE_MACHINE_ON ? "  machine on" : "",
		    state->flags & POKEYS_STATE_SAFE ? "  SAFE STATE" : "",
		    state->flags & POKEYS_STATE_BAD_COMMAND ? "  COMMANDS REFUSED" : "",
		    state->flags & POKEYS_STATE_REALTIME ? "" : "  NOT REALTIME");
	if (!isnan(rates->cycles))
		screen_line(screen, "cycle %llu, %.0f/s   packets %.0f/s   late %llu   lost %llu",
			    (unsigned long long)state->cycle, rates->cycles, rates->received,
			    (unsigned long long)state->statistics.late,
			    (unsigned long long)state->statistics.lost);
	else
		screen_line(screen, "cycle %llu   late %llu   lost %llu",
			    (unsigned long long)state->cycle,
			    (unsigned long long)state->statistics.late,
			    (unsigned long long)state->statistics.lost);
	screen_line(screen, "phase %s", print_phase(&state->phase, phase));
}

/* Ten terminals to a group; '.' off, '#' on, ' ' not of this kind. */
static void pin_row(const uint8_t *bits, const uint8_t *shown, char out[72])
{
	size_t at = 0;

	for (unsigned int pin = 0; pin < POKEYS_PINS; pin++) {
		bool is_shown = !shown || print_bit(shown, pin);

		if (pin && pin % 10 == 0)
			out[at++] = ' ';
		out[at++] = !is_shown ? ' ' : print_bit(bits, pin) ? '#' : '.';
	}
	out[at] = '\0';
}

static void draw_pins(struct screen *screen, const struct pokeys_state *state)
{
	char row[72];

	screen_line(screen, "pin  1          11         21         31         41         51");
	pin_row(state->digital_in, NULL, row);
	screen_line(screen, "in   %s", row);
	pin_row(state->digital_out, state->digital_out_owned, row);
	screen_line(screen, "out  %s", row);
	screen_line(screen, "adc  %u %u %u %u %u %u %u", state->analog[0], state->analog[1],
		    state->analog[2], state->analog[3], state->analog[4], state->analog[5],
		    state->analog[6]);
}

/* Six to a line, at most three lines. */
static void draw_encoders(struct screen *screen, const struct pokeys_state *state)
{
	char line[100] = "enc ";
	unsigned int shown = 0;

	for (unsigned int i = 0; i < POKEYS_ENCODERS && shown < 18; i++) {
		if (!(state->encoder_enabled >> i & 1))
			continue;
		if (shown && shown % 6 == 0) {
			screen_line(screen, "%s", line);
			strcpy(line, "    ");
		}
		snprintf(line + strlen(line), sizeof(line) - strlen(line), "%2u:%-9d", i,
			 state->encoder[i]);
		shown++;
	}
	if (shown)
		screen_line(screen, "%s", line);
}

static void draw_heaters(struct screen *screen, const struct pokeys_state *state)
{
	char text[PRINT_HEATER_MAX];

	for (unsigned int i = 0; i < POKEYS_HEATERS; i++)
		if (print_has_heater(state, i))
			screen_line(screen, "heater %u  %s", i,
				    print_heater(&state->heater[i], text));
}

static void draw_servos(struct screen *screen, const struct pokeys_state *state)
{
	char text[PRINT_SERVO_MAX];

	for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
		if (print_has_servo(state, i))
			screen_line(screen, "servo %u   %s", i,
				    print_servo(&state->servo[i], text));
}

static void draw_latencies(struct screen *screen, const struct pokeys_diag *diag)
{
	static const double parts[] = { 0.5, 0.9, 0.99, 0.999 };
	char transport[32];

	screen_line(screen, "%-14s %9s %9s %9s %9s %9s",
		    print_clean(diag->transport, sizeof(diag->transport), transport), "median",
		    "p90", "p99", "p99.9", "most");
	for (size_t i = 0; i < print_histogram_count; i++) {
		const struct pokeys_histogram *h = print_histogram_of(diag, i);
		char text[5][16];

		if (!h->count || !print_histograms[i].in_top)
			continue;
		for (size_t p = 0; p < 4; p++)
			print_duration((double)pokeys_histogram_percentile(h, parts[p]), text[p]);
		print_duration((double)h->max_ns, text[4]);
		screen_line(screen, "%-14s %9s %9s %9s %9s %9s", print_histograms[i].title, text[0],
			    text[1], text[2], text[3], text[4]);
	}
}

static void draw_one(struct screen *screen, const struct view_device *device, struct before *before)
{
	struct rates rates;

	if (device->freshness == VIEW_NONE) {
		screen_line(screen, "%s: not attached: %s", device->name, device->why);
		return;
	}
	rates = rates_of(before, device);
	draw_head(screen, device, &rates);
	if (device->freshness != VIEW_FRESH)
		screen_line(screen, "NOT CURRENT, the last values received:");
	draw_pins(screen, &device->state);
	draw_encoders(screen, &device->state);
	top_engine(screen, device);
	draw_heaters(screen, &device->state);
	draw_servos(screen, &device->state);
	if (device->has_diag)
		draw_latencies(screen, &device->diag);
}

static void draw_row(struct screen *screen, const struct view_device *device, struct before *before)
{
	char age[16], half[16], most[16];
	const struct pokeys_histogram *h = &device->diag.round_trip;
	const bool answered = device->has_diag && h->count;
	struct rates rates;

	if (device->freshness == VIEW_NONE) {
		screen_line(screen, "%-16s not attached: %s", device->name, device->why);
		return;
	}
	rates = rates_of(before, device);
	screen_line(screen, "%-16s %-12s %9s %9s %9s %8.3g  %s", device->name,
		    pokeys_link_name(device->state.link),
		    print_duration(view_data_age_ns(device), age),
		    print_duration(answered ? (double)pokeys_histogram_percentile(h, 0.5) :
					      INFINITY,
				   half),
		    print_duration(answered ? (double)pokeys_histogram_percentile(h, 0.99) :
					      INFINITY,
				   most),
		    isnan(rates.missed) ? 0 : rates.missed, device->why);
}

static void draw(struct screen *screen, const struct view *view, struct before *before)
{
	screen_begin(screen);
	if (view->count == 1) {
		draw_one(screen, &view->device[0], &before[0]);
	} else {
		screen_line(screen, "%-16s %-12s %9s %9s %9s %8s", "DEVICE", "LINK", "AGE",
			    "TRIP P50", "TRIP P99", "MISSED/S");
		for (size_t i = 0; i < view->count; i++)
			draw_row(screen, &view->device[i], &before[i]);
	}
	if (screen->keys)
		screen_line(screen, "q: quit");
	screen_end(screen);
}

/* False: nobody reads it any more. */
static bool show(const struct options *options, struct view *view, int signal_fd)
{
	static struct before before[VIEW_DEVICES];
	struct screen screen = { .terminal = false };

	if (!options->json)
		screen_open(&screen);
	for (uint32_t done = 1;; done++) {
		view_read(view);
		if (options->json)
			print_json_all(view, stdout);
		else
			draw(&screen, view, before);
		if (ferror(stdout) || done == options->count ||
		    screen_wait(&screen, options->interval_s, signal_fd))
			break;
	}
	if (!options->json)
		screen_close(&screen);
	return !screen.left;
}

int command_top(const struct options *options)
{
	struct view *view = view_only();
	int signal_fd;
	int status = view_open(view, options->runtime_directory, options->names,
			       options->name_count);

	if (!status) {
		signal_fd = screen_signals();
		if (!show(options, view, signal_fd))
			status = STATUS_FAILED;
		if (signal_fd >= 0)
			close(signal_fd);
	}
	view_close(view);
	return status;
}
