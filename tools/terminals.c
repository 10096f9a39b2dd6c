/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * pokeysctl terminals: what is printed on a board, in HAL and in pokeysd.conf.
 *
 * HAL counts terminals from 0, the board and pokeysd.conf from 1, and the relays are at
 * neither: whoever has a board in his hands should not have to work that out.
 */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <pokeys/state.h>
#include "tools/json.h"
#include "tools/pokeysctl.h"
#include "wire/encoder.h"
#include "wire/io.h"
#include "wire/label.h"
#include "wire/model.h"

enum { WORDS = 200 };

/* Words with commas between them. */
struct words {
	char text[WORDS];
	size_t length;
};

static void add(struct words *words, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void add(struct words *words, const char *format, ...)
{
	va_list arguments;
	int n;

	if (words->length >= WORDS - 3)
		return;
	if (words->length)
		words->length += (size_t)snprintf(words->text + words->length,
						  WORDS - words->length, ", ");
	va_start(arguments, format);
	n = vsnprintf(words->text + words->length, WORDS - words->length, format, arguments);
	va_end(arguments);
	words->length += n > 0 ? (size_t)n : 0;
	if (words->length >= WORDS)
		words->length = WORDS - 1;
}

struct terminal {
	struct words hal;  /* its pins */
	struct words can;  /* what it can be by its function */
	struct words also; /* what else uses it, and by which key */
};

static bool is_in(uint64_t terminals, unsigned int terminal)
{
	return terminals >> (terminal - 1) & 1;
}

static void add_functions(struct terminal *to, const struct wire_pinmap *map, unsigned int n)
{
	if (is_in(map->digital_in | map->digital_out, n))
		add(&to->hal, "pin.%02u", n - 1);
	if (is_in(map->digital_in, n))
		add(&to->can, "input");
	if (is_in(map->digital_out, n))
		add(&to->can, "output");
	if (is_in(map->analog_in, n)) {
		add(&to->hal, "adc.%02u", n - WIRE_ANALOG_FIRST_PIN);
		add(&to->can, "analog");
	}
	if (is_in(map->counter, n)) {
		add(&to->hal, "counter.%02u", n - 1);
		add(&to->can, "counter");
	}
	for (unsigned int i = 0; i < WIRE_MODEL_PWMS; i++) {
		if (map->pwm_pin[i] != n)
			continue;
		add(&to->hal, "pwm.%02u", i);
		add(&to->can, "PWM");
	}
}

static void add_encoder(struct terminal *to, const struct wire_encoder_pins *pins,
			unsigned int encoder, const char *key, const char *index_key,
			unsigned int n)
{
	if (pins->a == n)
		add(&to->also, "encoder %u channel A (%s)", encoder, key);
	if (pins->b == n)
		add(&to->also, "encoder %u channel B (%s)", encoder, key);
	if (pins->index == n)
		add(&to->also, "encoder %u index (%s)", encoder, index_key);
}

static void add_signals(struct terminal *to, const struct wire_pinmap *map, unsigned int n)
{
	for (unsigned int i = 0; i < WIRE_MODEL_FASTS; i++)
		add_encoder(to, &map->fast[i], i, "fast-encoders", "fast-encoder-index", n);
	for (unsigned int i = 0; i < WIRE_MODEL_FASTS; i++)
		if (memcmp(&map->fast_old[i], &map->fast[i], sizeof(map->fast[i])) != 0)
			add_encoder(to, &map->fast_old[i], i, "fast-encoders = alternative",
				    "fast-encoder-index", n);
	add_encoder(to, &map->ultra, WIRE_ENCODER_ULTRA, "ultra-fast-encoder", "ultra-fast-encoder",
		    n);
	for (unsigned int i = 0; i < WIRE_MODEL_INTERNAL_AXES; i++) {
		if (map->step[i] == n)
			add(&to->also, "step of axis %u (generator = internal)", i);
		if (map->direction[i] == n)
			add(&to->also, "direction of axis %u (generator = internal)", i);
	}
	if (is_in(map->generator, n))
		add(&to->also, "pulse generator (generator = external)");
	if (is_in(map->generator_io, n))
		add(&to->also, "pulse generator (generator-extended-io)");
	if (is_in(map->poextbus, n))
		add(&to->also, "PoExtBus (poextbus-connector = terminals)");
	if (map->emergency == n)
		add(&to->also, "emergency stop (emergency-pin = default)");
	if (map->charge_pump == n)
		add(&to->also, "charge pump (charge-pump = default)");
}

/* False if nothing is known of it but that it is there. */
static bool describe(const struct wire_model *model, unsigned int n, struct terminal *to)
{
	memset(to, 0, sizeof(*to));
	add_functions(to, model->pinmap, n);
	add_signals(to, model->pinmap, n);
	return to->hal.length || to->also.length;
}

static const char *label_of(const struct wire_labels *labels, unsigned int n)
{
	return labels && labels->terminal[n] ? labels->terminal[n] : "";
}

static void print_table(const struct wire_model *model, const struct wire_labels *labels)
{
	struct terminal terminal;

	printf("%s, terminals as in pokeysd.conf:\n\n  %-8s  %-28s  %-24s  %s\n", model->name,
	       "terminal", "in HAL (pokeys.N.)", "can be", "on the board; also, with this key");
	for (unsigned int n = 1; n <= model->pins; n++) {
		const char *label = label_of(labels, n);

		if (!describe(model, n, &terminal) && !*label)
			continue;
		printf("  %-8u  %-28s  %-24s  %s%s%s\n", n, terminal.hal.text, terminal.can.text,
		       label, *label && terminal.also.length ? "; " : "", terminal.also.text);
	}
	if (!labels)
		return;
	puts("\nOutputs that are no terminals (in pokeysd.conf, resume-outputs calls all of them "
	     "external):\n");
	for (unsigned int i = 0; i < WIRE_LABEL_OUTPUTS; i++)
		printf("  %-12s  external.%02u.out\n", labels->output[i], i);
}

static void print_json(const struct wire_model *model, const struct wire_labels *labels)
{
	struct terminal terminal;
	struct json json;
	char hal[32];

	json_init(&json, stdout);
	json_object(&json, NULL);
	json_unsigned(&json, "format", 1);
	json_text(&json, "model", model->name);
	json_array(&json, "terminals");
	for (unsigned int n = 1; n <= model->pins; n++) {
		if (!describe(model, n, &terminal) && !*label_of(labels, n))
			continue;
		json_object(&json, NULL);
		json_unsigned(&json, "terminal", n);
		json_text(&json, "hal", terminal.hal.text);
		json_text(&json, "can_be", terminal.can.text);
		json_text(&json, "label", label_of(labels, n));
		json_text(&json, "also", terminal.also.text);
		json_end(&json);
	}
	json_end(&json);
	json_array(&json, "outputs");
	for (unsigned int i = 0; labels && i < WIRE_LABEL_OUTPUTS; i++) {
		snprintf(hal, sizeof(hal), "external.%02u.out", i);
		json_object(&json, NULL);
		json_text(&json, "label", labels->output[i]);
		json_text(&json, "hal", hal);
		json_end(&json);
	}
	json_end(&json);
	json_end(&json);
}

static bool is_listed(const struct wire_model *model)
{
	return model->ethernet && model->pinmap->digital_in;
}

/* As it is printed on the board, with "PoKeys" or without. */
static const struct wire_model *find(const char *name)
{
	const struct wire_model *model;
	const char *rest = strncasecmp(name, "PoKeys", 6) ? name : name + 6;

	for (size_t i = 0; (model = wire_model_at(i)); i++)
		if (is_listed(model) && !strcasecmp(model->name + 6, rest))
			return model;
	return NULL;
}

/* Two hardware versions of one model are one. */
static void list_models(struct words *to)
{
	const struct wire_model *model;

	for (size_t i = 0; (model = wire_model_at(i)); i++)
		if (is_listed(model) && find(model->name) == model)
			add(to, "%s", model->name);
}

int command_terminals(const struct options *options)
{
	struct words models = { .length = 0 };
	const struct wire_model *model;

	list_models(&models);
	if (options->name_count != 1) {
		complain("terminals: name one model: %s", models.text);
		return STATUS_USAGE;
	}
	model = find(options->names[0]);
	if (!model) {
		complain("terminals: there is no table for \"%s\"; the models are %s",
			 options->names[0], models.text);
		return STATUS_USAGE;
	}
	if (options->json)
		print_json(model, wire_labels(model->hardware));
	else
		print_table(model, wire_labels(model->hardware));
	return STATUS_OK;
}
