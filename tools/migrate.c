// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl migrate: a machine that was written for the older userspace component.
 */
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include "tools/migrate.h"
#include "tools/pokeysctl.h"

/* What is left to a person. */
static void print_next(const struct migrate *machine, bool is_written)
{
	const char *ini = migrate_file_name(machine, SIZE_MAX);
	const int length = (int)strcspn(ini, ".");
	int step = 1;

	puts("\nNext steps:");
	printf("%d. Decide on names with another meaning and on choices above.\n", step++);
	if (!is_written)
		printf("%d. Run \"pokeysctl migrate --write %s\". It writes %.*s.pokeysd.ini, "
		       "changed HAL files,\n   and %.*s.pokeysd.conf beside the old files.\n",
		       step++, ini, length, ini, length, ini);
	printf("%d. Add the section of %.*s.pokeysd.conf to /etc/pokeysd/pokeysd.conf. Then run:\n"
	       "   sudo pokeysd --check-config && sudo systemctl restart pokeysd && "
	       "pokeysctl status\n",
	       step++, length, ini);
	printf("%d. Start \"linuxcnc %.*s.pokeysd.ini\". Test the emergency stop, the limit "
	       "switches and the\n   outputs before you move an axis.\n",
	       step, length, ini);
}

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
			 "(pokeys.0. ...)",
			 options->names[0]);
		result = -1;
	}
	if (!result) {
		result = migrate_report(&machine, &changes, stdout);
		if (result)
			complain("%s: %s", options->names[0], strerror(-result));
	}
	if (!result && options->write) {
		puts("");
		result = migrate_write(&machine, &changes);
	}
	if (!result)
		print_next(&machine, options->write);
	migrate_free_changes(&changes);
	migrate_free(&machine);
	return result ? STATUS_FAILED : STATUS_OK;
}
