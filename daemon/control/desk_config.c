// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What is ordered: config apply, config save, and the whole file again.
 *
 * A file is read whole and taken whole: one fault, and nothing of it reaches a
 * device; the faults go to whoever asked. Only the device's settings are taken
 * from it while the daemon runs. All else of a section (address, times, the
 * safe state) is what the realtime side was built with, and whoever has changed
 * it is told that it wants a restart.
 *
 * An order is not done when it has been given. So saving is answered when the
 * device has said how it went, and applying when the report says what became
 * of it: all applied, refused, or waiting for the machine to be off.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include "daemon/control/desk.h"
#include "daemon/control/log.h"
#include "usage/printable.h"

#define MS		UINT64_C(1000000)
#define SETTLE_NS	(200 * MS)	/* what a device that answers needs for most of it */
#define APPLY_NS	(5000 * MS)
#define SAVE_NS		(8000 * MS)	/* a save takes a second and more */
#define ORDER_NS	(3000 * MS)

struct faults {
	size_t at;
	char text[DESK_ANSWER_MAX - 400];
};

static void collect(void *context, const char *line)
{
	struct faults *faults = context;
	size_t room = sizeof(faults->text) - faults->at;
	int length = snprintf(faults->text + faults->at, room, "%s%s", faults->at ? "\n" : "",
			      line);

	if (length > 0 && (size_t)length < room)
		faults->at += (size_t)length;
	faults->text[faults->at] = '\0';
}

static void log_fault(void *context, const char *line)
{
	(void)context;
	log_line(EVENT_ERROR, "%s", line);
}

static const struct device_config *find(const struct config *config, const char *name)
{
	for (uint32_t i = 0; i < config->devices; i++)
		if (!strcmp(config->device[i].name, name))
			return &config->device[i];
	return NULL;
}

/* Whether anything but the settings has changed. */
static bool wants_restart(const struct device_config *before, const struct device_config *now)
{
	struct device_config one = *before, other = *now;

	memset(&one.settings, 0, sizeof(one.settings));
	memset(&other.settings, 0, sizeof(other.settings));
	one.index = other.index;
	return memcmp(&one, &other, sizeof(one)) != 0;
}

static int give(struct desk *desk, uint32_t device, enum device_order what,
		const struct pokeys_settings *settings, uint32_t *id)
{
	struct loop_order order = {
		.id = desk->next_id,
		.device = (uint8_t)device,
		.what = (uint8_t)what,
		.replace = settings != NULL,
	};

	if (settings)
		order.settings = *settings;
	*id = desk->next_id++;
	return loop_order_give(desk->loop, &order);
}

/* Who changed what was set up is asked later, and by somebody else. */
static void note(const struct desk *desk, const struct desk_client *client, uint32_t device,
		 enum device_order what)
{
	struct ucred who = { .pid = 0 };
	socklen_t size = sizeof(who);

	getsockopt(client->fd, SOL_SOCKET, SO_PEERCRED, &who, &size);
	log_line(EVENT_NOTICE, "%s: config %s, ordered by user %u (process %d)",
		 desk->config->device[device].name, what == DEVICE_ORDER_SAVE ? "save" : "apply",
		 who.uid, who.pid);
}

static void order(struct desk *desk, struct desk_client *client, uint32_t device,
		  enum device_order what, const struct pokeys_settings *settings, uint64_t now_ns)
{
	if (give(desk, device, what, settings, &client->id)) {
		desk_answer(desk, client, false, "too many orders are at work; try again");
		return;
	}
	note(desk, client, device, what);
	client->phase = DESK_ORDERED;
	client->device = (uint8_t)device;
	client->what = (uint8_t)what;
	client->since_ns = now_ns;
}

static void apply(struct desk *desk, struct desk_client *client, uint32_t device, uint64_t now_ns)
{
	static struct config config;
	const char *name = desk->config->device[device].name;
	struct faults faults = { 0 };
	const struct device_config *now;

	if (config_read(desk->config_path, &config, collect, &faults)) {
		desk_answer(desk, client, false, "nothing was changed:\n%s", faults.text);
		return;
	}
	now = find(&config, name);
	if (!now) {
		desk_answer(desk, client, false,
			    "nothing was changed: %s has no [device %s] any "
			    "more",
			    desk->config_path, name);
	} else {
		client->restart = wants_restart(&desk->config->device[device], now);
		order(desk, client, device, DEVICE_ORDER_APPLY, &now->settings, now_ns);
	}
	explicit_bzero(&config, sizeof(config)); /* passwords */
}

static uint32_t index_of(const struct config *config, const char *name)
{
	uint32_t i = 0;

	while (i < config->devices && strcmp(config->device[i].name, name))
		i++;
	return i;
}

void desk_begin(struct desk *desk, struct desk_client *client, char *request, uint64_t now_ns)
{
	bool is_apply = !strncmp(request, "config apply ", 13);
	bool is_save = !strncmp(request, "config save ", 12);
	const char *name = request + (is_apply ? 13 : 12);
	uint32_t device;

	usage_printable(request);
	if (!is_apply && !is_save) {
		desk_answer(desk, client, false,
			    "\"%s\" is no request; requests are: config apply "
			    "DEVICE, config save DEVICE",
			    request);
		return;
	}
	device = index_of(desk->config, name);
	if (device == desk->config->devices)
		desk_answer(desk, client, false, "there is no device \"%s\"", name);
	else if (is_apply)
		apply(desk, client, device, now_ns);
	else
		order(desk, client, device, DEVICE_ORDER_SAVE, NULL, now_ns);
}

static const char *restart_note(const struct desk_client *client)
{
	return client->restart ? "\nOther keys of its section, heaters or servos have changed as "
				 "well: those need a restart of the daemon." :
				 "";
}

void desk_executed(struct desk *desk, struct desk_client *client, int result, uint64_t now_ns)
{
	const char *name = desk->config->device[client->device].name;

	client->since_ns = now_ns;
	client->cycle = atomic_load(&desk->loop->shared.cycles);
	if (!result) {
		client->phase = client->what == DEVICE_ORDER_APPLY ? DESK_APPLYING : DESK_SAVING;
		return;
	}
	if (result == -ENOTCONN && client->what == DEVICE_ORDER_APPLY)
		desk_answer(desk, client, true,
			    "%s: the configuration was taken over; the device is "
			    "away and gets its settings when it is back%s",
			    name, restart_note(client));
	else if (result == -ENOTCONN)
		desk_answer(desk, client, false, "%s: the device is away", name);
	else if (result == -EBUSY)
		desk_answer(desk, client, false,
			    "%s: motion is permitted; switch the machine off "
			    "first",
			    name);
	else if (result == -EAGAIN)
		desk_answer(desk, client, false,
			    "%s: its flash memory was written less than 2 s "
			    "ago, and each time wears it; try again later",
			    name);
	else if (result == -EALREADY)
		desk_answer(desk, client, false, "%s: another order is at work; try again", name);
	else
		desk_answer(desk, client, false, "%s: %s", name, strerror(-result));
}

/*
 * What became of the settings, once the device has had time for it. A report knows
 * of the order when the cycle that executed it has ended, however long that takes.
 */
static bool answer_applied(struct desk *desk, struct desk_client *client)
{
	const char *name = desk->config->device[client->device].name;
	struct pokeys_report report;

	if (atomic_load(&desk->loop->shared.cycles) == client->cycle ||
	    desk->read(desk->context, client->device, &report))
		return false;
	if (report.state == POKEYS_CONFIG_APPLIED)
		desk_answer(desk, client, true, "%s: the device has all that is wanted%s", name,
			    restart_note(client));
	else if (report.state == POKEYS_CONFIG_WAITING)
		desk_answer(desk, client, true,
			    "%s: the configuration was taken over; what differs "
			    "waits until the machine is off (pokeysctl config diff %s)%s",
			    name, name, restart_note(client));
	else if (report.state == POKEYS_CONFIG_REFUSED)
		desk_answer(desk, client, false,
			    "%s: the device did not take everything "
			    "(pokeysctl config diff %s; the journal says what)%s",
			    name, name, restart_note(client));
	else
		return false;
	return true;
}

void desk_watch(struct desk *desk, struct desk_client *client, uint64_t now_ns)
{
	const char *name = desk->config->device[client->device].name;
	uint64_t spent = now_ns - client->since_ns;

	if (client->phase == DESK_ORDERED && spent > ORDER_NS)
		desk_answer(desk, client, false, "%s: the realtime loop does not take the order",
			    name);
	else if (client->phase == DESK_APPLYING && spent > SETTLE_NS &&
		 !answer_applied(desk, client) && spent > APPLY_NS)
		desk_answer(desk, client, true,
			    "%s: the configuration was taken over and is still "
			    "being applied (pokeysctl config diff %s)%s",
			    name, name, restart_note(client));
	else if (client->phase == DESK_SAVING && spent > SAVE_NS)
		desk_answer(desk, client, false,
			    "%s: the device has not said whether it saved its "
			    "settings; the journal may say more",
			    name);
}

void desk_event(struct desk *desk, const struct event *event, uint64_t now_ns)
{
	if (event->code != EVENT_ONE_SHOT || event->a != POKEYS_ONE_SHOT_SAVE_CONFIG ||
	    event->b != EVENT_ORDERED)
		return;
	/* the save may be done before we knew that it began */
	desk_take_results(desk, now_ns);
	for (size_t i = 0; i < DESK_CLIENTS; i++) {
		struct desk_client *client = &desk->client[i];

		if (client->phase != DESK_SAVING || client->device != event->device)
			continue;
		if ((uint8_t)event->c == POKEYS_OUTCOME_DONE)
			desk_answer(desk, client, true,
				    "%s: its settings are in its flash memory "
				    "now",
				    desk->config->device[event->device].name);
		else
			desk_answer(desk, client, false,
				    "%s: the device did not save its settings; "
				    "the journal says why",
				    desk->config->device[event->device].name);
	}
}

_Static_assert((int)LOOP_ORDERS >= (int)TRANSPORT_CHANNELS + (int)DESK_CLIENTS,
	       "a reload while every client has an order");

void desk_reload(struct desk *desk)
{
	static struct config config;
	bool restart = false;
	uint32_t given = 0, id;

	if (config_read(desk->config_path, &config, log_fault, NULL)) {
		log_line(EVENT_ERROR, "SIGHUP: %s has faults; nothing was changed",
			 desk->config_path);
		return;
	}
	for (uint32_t i = 0; i < desk->config->devices; i++) {
		const struct device_config *before = &desk->config->device[i];
		const struct device_config *now = find(&config, before->name);

		restart |= !now || wants_restart(before, now);
		given += now && !give(desk, i, DEVICE_ORDER_APPLY, &now->settings, &id);
	}
	restart |= config.devices != desk->config->devices;
	explicit_bzero(&config, sizeof(config)); /* passwords */
	log_line(EVENT_NOTICE,
		 "SIGHUP: %s was read again; its settings go to %u of %u "
		 "devices%s",
		 desk->config_path, given, desk->config->devices,
		 restart ? "; it has other changes, which need a restart" : "");
}
