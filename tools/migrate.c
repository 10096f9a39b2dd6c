// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl migrate: a machine that was written for the older userspace component.
 */
#include <string.h>
#include "tools/migrate.h"
#include "tools/pokeysctl.h"

int command_migrate(const struct options *options)
{
	struct migrate machine;
	struct migrate_changes changes = { 0 };
	int result;

	if (!options->name_count) {
		complain("migrate needs the machine's INI file: pokeysctl migrate INI [HAL ...]");
		return STATUS_USAGE;
	}
	if (options->json) {
		complain("migrate takes no --json");
		return STATUS_USAGE;
	}
	result = migrate_read(&machine, options->names[0], options->names + 1,
			      options->name_count - 1);
	if (!result)
		result = migrate_find_changes(&machine, &changes);
	if (!result && !machine.uses) {
		complain("%s: nothing in it or its HAL files is a name of the older component "
			 "(pokeys.0. ...)", options->names[0]);
		result = -1;
	}
	if (!result) {
		result = migrate_report(&machine, &changes, stdout);
		if (result)
			complain("%s: %s", options->names[0], strerror(-result));
	}
	if (!result && options->write)
		result = migrate_write(&machine, &changes);
	migrate_free_changes(&changes);
	migrate_free(&machine);
	return result ? STATUS_FAILED : STATUS_OK;
}
