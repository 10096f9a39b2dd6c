// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl status and pokeysctl devices. The exit status of `status` is an
 * answer as well: 0 only if every device that was asked for is running and its
 * data is fresh, so that a script needs no JSON to find out.
 */
#include <pokeys/names.h>
#include "tools/json.h"
#include "tools/pokeysctl.h"
#include "tools/print.h"
#include "tools/view.h"

static int judge(const struct view *view)
{
	int status = STATUS_OK;

	for (size_t i = 0; i < view->count; i++) {
		if (view->device[i].freshness == VIEW_NONE)
			return STATUS_FAILED;
		if (view->device[i].freshness != VIEW_FRESH)
			status = STATUS_STALE;
	}
	return status;
}

int command_status(const struct options *options)
{
	struct view *view = view_only();
	int status = view_open(view, options->runtime_directory, options->names,
			       options->name_count);

	if (!status) {
		view_read(view);
		if (options->json)
			print_json_all(view, stdout);
		else
			for (size_t i = 0; i < view->count; i++)
				print_status(&view->device[i], stdout);
		status = judge(view);
	}
	view_close(view);
	return status;
}

static void put_names(const struct view *view)
{
	struct json json;

	json_init(&json, stdout);
	json_object(&json, NULL);
	json_unsigned(&json, "format", 1);
	json_array(&json, "devices");
	for (size_t i = 0; i < view->count; i++)
		json_text(&json, NULL, view->device[i].name);
	json_end(&json);
	json_end(&json);
}

int command_devices(const struct options *options)
{
	struct view *view = view_only();
	int status = view_open(view, options->runtime_directory, NULL, 0);

	if (!status && options->json)
		put_names(view);
	for (size_t i = 0; !status && !options->json && i < view->count; i++)
		puts(view->device[i].name);
	view_close(view);
	return status;
}
