// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl config. Showing reads the shared memory, as everything else here
 * does; it asks the device for nothing. Ordering goes to the daemon, which is
 * the only one who may write to a device: one request, one answer.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <pokeys/names.h>
#include "tools/config_print.h"
#include "tools/order.h"
#include "tools/pokeysctl.h"
#include "tools/view.h"

/* Whether the device's settings have been read since it was found last. */
static bool is_read(const struct pokeys_report *report)
{
	static const struct pokeys_settings nothing;

	return memcmp(&report->device, &nothing, sizeof(nothing)) != 0;
}

/* What is told may be of before, and why; nothing where it is of now. */
static void tell_age(const struct view_device *device)
{
	if (device->freshness == VIEW_DEAD)
		complain("%s: %s; these are the settings that were read last", device->name,
			 device->why);
	else if (device->state.link != POKEYS_LINK_RUNNING)
		complain("%s is %s%s%s; these are the settings that were read last", device->name,
			 pokeys_link_name(device->state.link), *device->why ? ": " : "",
			 device->why);
}

/*
 * The report of a device; 0, or it has been said why there is none. A device that is
 * lost, or whose daemon does not publish, has most likely what it had: that may be
 * looked at, but nothing can be concluded from it.
 */
static int read_report(const struct options *options, bool of_now, struct view *view,
		       struct pokeys_report *report)
{
	const char *name = options->names[1];
	struct view_device *device;
	int result;

	if (view_open(view, options->runtime_directory, &options->names[1], 1))
		return -1;
	view_read(view);
	device = &view->device[0];
	if (device->freshness == VIEW_NONE || (of_now && device->freshness == VIEW_DEAD)) {
		complain("%s: %s", name, device->why);
		return -1;
	}
	result = pokeys_client_read_report(device->client, report);
	if (result) {
		complain("%s: its settings cannot be read: %s", name, strerror(-result));
		return -1;
	}
	if (report->state != POKEYS_CONFIG_UNKNOWN || (is_read(report) && !of_now)) {
		tell_age(device);
		return 0;
	}
	complain("%s: its settings have not been read%s%s%s", name,
		 is_read(report) ? " since it was lost" : " yet", *device->why ? ": " : "",
		 device->why);
	return -1;
}

static int show(const struct options *options)
{
	static struct pokeys_report report;
	struct view *view = view_only();
	int result = read_report(options, false, view, &report);

	if (!result && options->json)
		config_print_show_json(options->names[1], &report, stdout);
	else if (!result)
		config_print_show(options->names[1], view->device[0].state.identity.serial, &report,
				  stdout);
	view_close(view);
	return result ? STATUS_FAILED : STATUS_OK;
}

static int diff(const struct options *options)
{
	static struct pokeys_report report;
	struct view *view = view_only();
	int result = read_report(options, true, view, &report);
	unsigned int count = 0;

	if (!result && options->json)
		count = config_print_diff_json(options->names[1], &report, stdout);
	else if (!result)
		count = config_print_diff(&report, stdout);
	view_close(view);
	if (result)
		return STATUS_STALE;
	return count ? STATUS_FAILED : STATUS_OK;
}

static int order(const struct options *options)
{
	char text[ORDER_TEXT_MAX];
	int result;

	if (options->json) {
		complain("config %s takes no --json", options->names[0]);
		return STATUS_USAGE;
	}
	result = order_give(options->runtime_directory, options->names[0], options->names[1], text);
	if (result) {
		complain("%s", text);
		return STATUS_FAILED;
	}
	puts(text);
	return STATUS_OK;
}

int command_config(const struct options *options)
{
	static const struct {
		const char *name;
		int (*run)(const struct options *options);
	} verbs[] = {
		{ "show", show },
		{ "diff", diff },
		{ "apply", order },
		{ "save", order },
	};

	for (size_t i = 0; options->name_count == 2 && i < sizeof(verbs) / sizeof(verbs[0]); i++)
		if (!strcmp(options->names[0], verbs[i].name))
			return verbs[i].run(options);
	complain("config needs a verb and one device: pokeysctl config show | diff | apply | save "
		 "DEVICE");
	return STATUS_USAGE;
}
