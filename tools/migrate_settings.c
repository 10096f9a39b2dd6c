/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What a machine sets up in its device: the component itself is run here, with the values of
 * the INI and HAL files, without HAL and without a device.
 *
 * The component requests only settings that differ from the device's. It is run twice, with
 * devices that differ in every byte, so each setting is requested at least once.
 */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "halbridge/binding.h"
#include "halbridge/ini_apply.h"
#include "halbridge/legacy_settings.h"
#include "halbridge/wish.h"
#include "settings/key.h"
#include "tools/migrate.h"
#include "tools/pokeysctl.h"

enum { LOOKS = 4 }; /* until nothing more follows from what was set */

struct run {
	struct instance instance;
	struct values values;
	uint64_t storage[BINDING_PINS];
	void *pointers[BINDING_PINS];
	struct legacy_settings legacy;
	struct wish wish;
	struct pokeys_report report;
	bool driven[POKEYS_AXES];
};

static void tell(void *argument, const char *line)
{
	if (argument)
		complain("%s", line);
}

/* The complaint of the INI file has the line; those of the wish would say the same again. */
static void refuse(void *argument, const struct wish_item *item, double value)
{
	(void)argument;
	(void)item;
	(void)value;
}

/* setp, of a parameter or of a pin that nothing is linked to. */
static void set_values(const struct migrate *machine, unsigned int device, struct run *run)
{
	for (size_t i = 0; i < machine->uses; i++) {
		const struct migrate_use *use = &machine->use[i];
		char *at = (char *)&run->values;
		double value;

		/* ini_apply() has set the keys */
		if (use->device != device || !use->row || use->is_computed || use->line->is_key)
			continue;
		if (use->how == MIGRATE_LINKED && migrate_fits("PEv2.N.joint-pos-cmd", use->name) &&
		    use->index < POKEYS_AXES)
			run->driven[use->index] = true;
		if (use->how != MIGRATE_SET)
			continue;
		value = migrate_value(use->other);
		/* what no parameter can hold, LinuxCNC refuses */
		if (fabs(value) <= UINT32_MAX || (use->row->type == TABLE_FLOAT && isfinite(value)))
			table_put(use->row, at + table_offset(use->row, use->index),
				  use->row->type == TABLE_BIT ? value != 0 : value);
	}
}

/* A device that has everything set up, to this value in each byte. */
static void make_report(struct pokeys_report *report, uint8_t byte)
{
	struct pokeys_settings *device = &report->device;

	memset(device, byte, sizeof(*device));
	device->set = UINT32_MAX;
	memset(device->pin_set, 0xff, sizeof(device->pin_set));
	device->axes = POKEYS_AXES;
	for (size_t i = 0; i < sizeof(device->encoder) / sizeof(device->encoder[0]); i++) {
		device->encoder[i].options_mask = UINT8_MAX;
		device->encoder[i].pins_set = UINT8_MAX;
	}
	for (size_t i = 0; i < POKEYS_AXES; i++) {
		device->axis[i].set = UINT32_MAX;
		device->axis[i].options_mask = UINT8_MAX;
		device->axis[i].options |= 1; /* it is in use, or the rest would not count */
		device->axis[i].switches_mask = UINT8_MAX;
	}
	report->state = POKEYS_CONFIG_APPLIED;
}

static void run_component(const struct migrate *machine, unsigned int device, struct run *run,
			  uint8_t byte, bool tells)
{
	memset(run, 0, sizeof(*run));
	table_set_parameters(&run->values);
	for (size_t i = 0; i < BINDING_PINS; i++)
		run->pointers[i] = &run->storage[i];
	run->instance.values = &run->values;
	run->instance.pointers = run->pointers;
	run->instance.schemes = TABLE_BOTH | TABLE_FORMER;
	run->instance.number = device;
	wish_init(&run->wish);
	make_report(&run->report, byte);
	wish_report(&run->wish, &run->report, &run->values);
	ini_apply(&machine->ini, &run->instance, tell, tells ? run : NULL);
	set_values(machine, device, run);
	for (int i = 0; i < LOOKS; i++) {
		legacy_settings_look(&run->legacy, &run->values, run->driven);
		wish_look(&run->wish, &run->values, refuse, NULL);
	}
}

/* As many axes as are set up. The component asks for all that the device has. */
static void count_axes(struct pokeys_settings *settings)
{
	uint8_t axes = 0;

	for (uint8_t i = 0; i < POKEYS_AXES; i++)
		if (settings->axis[i].set || settings->axis[i].options_mask)
			axes = (uint8_t)(i + 1);
	if (!axes || settings->set & POKEYS_SET_AXES)
		return;
	settings->set |= POKEYS_SET_AXES;
	settings->axes = axes;
}

/* Adds the settings of one run to the result. */
static void add(struct pokeys_settings *to, const struct pokeys_settings *from)
{
	for (size_t i = 0; i < settings_key_count; i++) {
		const struct settings_key *key = &settings_keys[i];

		for (uint32_t n = 0; n < (key->count ? key->count : 1); n++) {
			char text[SETTINGS_VALUE_MAX];

			if (settings_given(key, n, from) && settings_print(key, n, from, text))
				settings_store(key, n, text, to);
		}
	}
}

int migrate_settings(const struct migrate *machine, unsigned int device,
		     struct pokeys_settings *settings)
{
	struct run *run = calloc(1, sizeof(*run));

	memset(settings, 0, sizeof(*settings));
	if (!run)
		return -ENOMEM;
	for (int i = 0; i < 2; i++) {
		run_component(machine, device, run, i ? 0x55 : 0, !i && !device);
		add(settings, &run->wish.image.settings);
	}
	count_axes(settings);
	free(run);
	return 0;
}
