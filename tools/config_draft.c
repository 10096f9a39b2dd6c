// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * With the lines that are written here, pokeysd must change nothing in the device. What is not
 * given in its file is not always left alone: some keys need others, and members of one request
 * are written together. The draft is therefore parsed as the daemon parses it and compared with
 * the device. Lines that differ are commented out, and this is repeated until both agree.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include "daemon/control/config.h"
#include "tools/config_draft.h"
#include "tools/config_print.h"
#include "tools/print.h"

enum {
	COLUMNS = 96,
	WHY_MAX = SETTINGS_VALUE_MAX + 64,
	HEAD_LINES = 2,
	ROUNDS = 200,
	HELP_MAX = 600
};

/* A key that the device has said something of. */
struct entry {
	const struct settings_key *key;
	uint32_t index;
	char text[SETTINGS_VALUE_MAX];
	bool said;          /* pokeysd.conf can express the value */
	bool is_line;       /* printed as a line, not as a comment */
	unsigned long line; /* its number when the draft was judged last, 0 = it was none */
	char why[WHY_MAX];  /* the reason why it is a comment; "" = nothing is set up */
};

struct draft {
	const struct pokeys_settings *device;
	bool is_wish; /* of somebody, who sets what is given, and not what a device has */
	struct pokeys_settings listed; /* the device's, without terminals that are in no list */
	struct entry *entry;
	size_t count;
	struct config config;
	unsigned int faults;
	bool changed;
};

/* Settings in which every value is off, none or 0. */
static const struct pokeys_settings *nothing_set_up(void)
{
	static struct pokeys_settings settings;

	settings.set = UINT32_MAX;
	memset(settings.pin_set, 0xff, sizeof(settings.pin_set));
	return &settings;
}

static bool is_nothing(const struct entry *entry)
{
	char blank[SETTINGS_VALUE_MAX];

	settings_print(entry->key, 0, nothing_set_up(), blank);
	return !strcmp(entry->text, blank);
}

static bool is_of(const struct entry *entry, const char *prefix)
{
	return !strncmp(entry->key->name, prefix, strlen(prefix));
}

/* Keys of one request: if only some are given, the daemon writes 0 for the others. */
static bool is_together(const struct entry *one, const struct entry *other)
{
	if (config_is_pin_list(one->key) || config_is_pin_list(other->key))
		return one->key == other->key;
	return one->index == other->index && one->key->set_offset == other->key->set_offset &&
	       one->key->set_bits == other->key->set_bits;
}

static void comment(struct draft *draft, const struct entry *entry, const char *why)
{
	for (size_t i = 0; i < draft->count; i++) {
		struct entry *other = &draft->entry[i];

		if (!other->is_line || !is_together(entry, other))
			continue;
		other->is_line = false;
		draft->changed = true;
		snprintf(other->why, sizeof(other->why), "%s", why);
	}
}

/* Whether any key of the same request is set up. */
static bool any_is_set_up(const struct draft *draft, const struct entry *entry)
{
	for (size_t i = 0; i < draft->count; i++)
		if (is_together(entry, &draft->entry[i]) && !is_nothing(&draft->entry[i]))
			return true;
	return false;
}

/*
 * Keys of an axis or encoder that is in use are lines, whatever they say, because the daemon
 * assumes values for some that are missing. PoStep drivers are left to the device: any key of
 * theirs makes the daemon talk to them. A failsafe that is off is commented out as well, so
 * that the daemon sets its default failsafe.
 */
static void choose_lines(struct draft *draft)
{
	for (size_t i = 0; i < draft->count; i++) {
		struct entry *entry = &draft->entry[i];

		entry->is_line = draft->is_wish || strchr(entry->key->name, '#') ||
				 is_of(entry, "axes") || is_of(entry, "backlash") ||
				 any_is_set_up(draft, entry);
		if (!draft->is_wish && (is_of(entry, "postep") || is_of(entry, "axis.#.postep")))
			entry->is_line = false;
	}
	for (size_t i = 0; i < draft->count; i++) {
		const struct entry *entry = &draft->entry[i];
		char why[WHY_MAX];

		if (!draft->is_wish && is_of(entry, "failsafe-timeout-ms") && is_nothing(entry))
			comment(draft, entry, "");
		if (entry->said)
			continue;
		snprintf(why, sizeof(why),
			 "The device's value is %s, which pokeysd.conf cannot "
			 "express.",
			 entry->text);
		comment(draft, entry, why);
	}
}

static void collect(struct draft *draft)
{
	for (size_t i = 0; i < settings_key_count; i += config_group(i)) {
		const size_t keys = config_group(i);

		for (uint32_t n = 0; n < config_indices(&settings_keys[i]); n++) {
			for (size_t k = i; k < i + keys; k++) {
				struct entry *entry = &draft->entry[draft->count];

				if (!draft->is_wish &&
				    config_is_idle(&settings_keys[k], n, draft->device))
					continue;
				entry->key = &settings_keys[k];
				entry->index = n;
				entry->said = settings_print(entry->key, n, &draft->listed,
							     entry->text);
				draft->count += entry->said || *entry->text;
			}
		}
	}
}

/* The entry judged at this line number, or NULL. */
static const struct entry *line_at(const struct draft *draft, unsigned long line)
{
	for (size_t i = 0; line && i < draft->count; i++)
		if (draft->entry[i].line == line)
			return &draft->entry[i];
	return NULL;
}

/* "draft:7: [device x]: terminal 46 is used by analog-inputs (line 3) as well" */
static void take_fault(void *context, const char *text)
{
	struct draft *draft = context;
	const struct entry *entry;
	char why[WHY_MAX], *at;
	const char *said = strstr(text, "]: ");

	draft->faults++;
	entry = line_at(draft, strtoul(text + strcspn(text, ":") + 1, NULL, 10));
	if (!entry)
		return;
	snprintf(why, sizeof(why), "pokeysd rejects this line: %s", said ? said + 3 : text);
	at = strstr(why, " (line ");
	if (at)
		memmove(at, at + strcspn(at, ")") + 1, strlen(at + strcspn(at, ")")));
	comment(draft, entry, why);
}

/* False: no memory. */
static bool judge(struct draft *draft)
{
	char *text = NULL, name[SETTINGS_NAME_MAX];
	size_t length = 0;
	unsigned long line = HEAD_LINES;
	FILE *to = open_memstream(&text, &length);

	if (!to)
		return false;
	fputs("[device draft]\naddress = 127.0.0.1\n", to);
	for (size_t i = 0; i < draft->count; i++) {
		struct entry *entry = &draft->entry[i];

		entry->line = entry->is_line ? ++line : 0;
		settings_name(entry->key, entry->index, name);
		if (entry->is_line)
			fprintf(to, "%s = %s\n", name, entry->text);
	}
	if (fclose(to) || !text) {
		free(text);
		return false;
	}
	draft->faults = 0;
	config_parse("draft", text, length, &draft->config, take_fault, draft);
	free(text);
	return true;
}

static bool is_same_place(const struct settings_key *one, const struct settings_key *other)
{
	const char *hash = strchr(one->name, '#');

	return hash && !strncmp(one->name, other->name, (size_t)(hash - one->name) + 1);
}

/* The key's line, or all lines of its axis or encoder if it follows from others. */
static void comment_key(struct draft *draft, const struct settings_key *key, uint32_t index)
{
	static const char why[] = "With this line, pokeysd would change the device.";
	const bool before = draft->changed;

	draft->changed = false;
	for (size_t i = 0; i < draft->count; i++)
		if (draft->entry[i].key == key && draft->entry[i].index == index)
			comment(draft, &draft->entry[i], why);
	for (size_t i = 0; !draft->changed && i < draft->count; i++)
		if (draft->entry[i].index == index && is_same_place(key, draft->entry[i].key) &&
		    draft->entry[i].is_line) {
			comment(draft, &draft->entry[i], why);
			draft->changed = false;
		}
	draft->changed = draft->changed || before;
}

static bool pins_differ(const struct draft *draft)
{
	const struct pokeys_settings *wanted = &draft->config.device[0].settings;

	for (unsigned int pin = 0; pin < POKEYS_PINS; pin++)
		if (config_pin_known(wanted, pin) &&
		    (!config_pin_known(draft->device, pin) ||
		     wanted->pin_function[pin] != draft->device->pin_function[pin]))
			return true;
	return false;
}

/* What the daemon would make of the draft, and of what is in the device. */
static void compare(struct draft *draft)
{
	const struct pokeys_settings *wanted = &draft->config.device[0].settings;

	for (size_t i = 0; i < settings_key_count; i++) {
		const struct settings_key *key = &settings_keys[i];

		if (!strncmp(key->name, "failsafe", 8))
			continue;
		for (uint32_t n = 0; n < config_indices(key); n++)
			if (settings_differ(key, n, wanted, draft->device))
				comment_key(draft, key, n);
	}
	for (size_t i = 0; pins_differ(draft) && i < draft->count; i++)
		if (config_is_pin_list(draft->entry[i].key))
			comment(draft, &draft->entry[i],
				"With this line, pokeysd would change the function of a terminal.");
}

static void print_help(const struct settings_key *key, FILE *to)
{
	char text[HELP_MAX];

	snprintf(text, sizeof(text), "%s%s%s%s", key->help, key->unit ? " [" : "",
		 key->unit ? key->unit : "", key->unit ? "]" : "");
	print_wrapped("# ", "# ", COLUMNS, text, to);
}

static bool is_first(const struct draft *draft, const struct entry *entry)
{
	for (const struct entry *other = draft->entry; other < entry; other++)
		if (other->key == entry->key)
			return false;
	return true;
}

static void print_entry(const struct draft *draft, const struct entry *entry, FILE *to)
{
	const struct entry *before = entry > draft->entry ? entry - 1 : NULL;
	char name[SETTINGS_NAME_MAX];

	if (before && strchr(entry->key->name, '#') &&
	    (before->index != entry->index || !is_same_place(entry->key, before->key)))
		fputc('\n', to);
	if (is_first(draft, entry) && !draft->is_wish)
		print_help(entry->key, to);
	if (*entry->why)
		fprintf(to, "# %s\n", entry->why);
	if (draft->is_wish && config_is_pin_list(entry->key) && !strcmp(entry->text, "none"))
		return;
	settings_name(entry->key, entry->index, name);
	if (!entry->is_line && config_is_pin_list(entry->key) && !strcmp(entry->text, "none"))
		fprintf(to, "; %s =\n", name);
	else
		fprintf(to, "%s%s = %s\n", entry->is_line ? "" : "; ", name, entry->text);
}

/* Keeps only terminals that a list can express; config_print_odd_pins() prints the others. */
static void leave_out_odd_pins(struct draft *draft)
{
	draft->listed = *draft->device;
	for (unsigned int pin = 0; pin < POKEYS_PINS; pin++)
		if (!config_pin_has_list(draft->device->pin_function[pin], pin))
			draft->listed.pin_set[pin / 8] &= (uint8_t)~(1u << pin % 8);
}

static int write_draft(struct draft *draft, FILE *to)
{
	bool settled = false;

	leave_out_odd_pins(draft);
	collect(draft);
	choose_lines(draft);
	for (int i = 0; !settled && i < ROUNDS; i++) {
		draft->changed = false;
		if (!judge(draft))
			return -ENOMEM;
		if (!draft->faults && !draft->is_wish)
			compare(draft);
		settled = !draft->changed;
	}
	for (size_t i = 0; (!settled || draft->faults) && i < draft->count; i++)
		comment(draft, &draft->entry[i],
			"pokeysd rejects this line in combination with others.");
	if (!draft->is_wish)
		fputs("\n# The device's present settings. If you change a line, pokeysd changes\n"
		      "# that setting in the device. Otherwise, it changes only the device's\n"
		      "# failsafe.\n",
		      to);
	for (size_t i = 0; i < draft->count; i++)
		print_entry(draft, &draft->entry[i], to);
	config_print_odd_pins(draft->device, to);
	return 0;
}

static int draft_settings(const struct pokeys_settings *device, bool is_wish, FILE *to)
{
	struct draft *draft = calloc(1, sizeof(*draft));
	size_t most = 0;
	int result = -ENOMEM;

	for (size_t i = 0; i < settings_key_count; i++)
		most += config_indices(&settings_keys[i]);
	if (draft)
		draft->entry = calloc(most + 1, sizeof(*draft->entry));
	if (draft && draft->entry) {
		draft->device = device;
		draft->is_wish = is_wish;
		result = write_draft(draft, to);
	}
	if (draft)
		free(draft->entry);
	free(draft);
	return result;
}

int config_draft_settings(const struct pokeys_settings *device, FILE *to)
{
	return draft_settings(device, false, to);
}

int config_draft_wish(const struct pokeys_settings *wish, FILE *to)
{
	return draft_settings(wish, true, to);
}

void config_draft_name(const char *text, size_t length, const char *otherwise, char *name,
		       size_t size)
{
	static const char allowed[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
				      "0123456789_";
	size_t at = 0;

	for (size_t i = 0; i < length && text[i] && at + 1 < size; i++)
		if (strchr(allowed, text[i]))
			name[at++] = text[i];
		else if (at && name[at - 1] != '-') /* -x would be an option */
			name[at++] = '-';
	while (at && name[at - 1] == '-')
		at--;
	name[at] = '\0';
	if (!at)
		snprintf(name, size, "%s", otherwise);
}
