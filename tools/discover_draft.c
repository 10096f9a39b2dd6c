/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * pokeysctl discover --config: a pokeysd.conf for the devices that were found.
 *
 * Each device is asked for its settings over the network, by reads only, so it does not matter
 * whether something drives it meanwhile. What it is set up for becomes lines; what only the
 * user can know is suggested in comments.
 */
#include <errno.h>
#include <grp.h>
#include <net/if.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <pokeys/shm.h>
#include "daemon/device/survey.h"
#include "daemon/transport/addresses.h"
#include "tools/config_draft.h"
#include "tools/discover.h"
#include "tools/view.h"
#include "wire/model.h"

#define PORT 20055
#define TURN_NS UINT64_C(2000000)

static int send_packet(void *context, const uint8_t *packet, size_t length)
{
	struct transport *t = context;

	return t->ops->send(t, 0, packet, length);
}

/* Runs the survey until it ends. */
static enum survey_state converse(struct transport *t, struct survey *survey)
{
	enum survey_state state;
	struct transport_packet packet;

	while ((state = survey_turn(survey, view_now())) == SURVEY_READING) {
		t->ops->wait(t, view_now() + TURN_NS);
		while (t->ops->receive(t, &packet) > 0) {
			const struct pokeys_rx rx = {
				.address = packet.address,
				.port = packet.port,
			};

			survey_deliver(survey, packet.data, packet.length, &rx, view_now());
		}
	}
	return state;
}

/*
 * Each device gets a socket of its own, so that no packets from other devices arrive there.
 * 0 and *state, or -errno if the device cannot be asked; the survey has begun in any case.
 */
static int read_device(const struct found *found, const struct options *options,
		       struct survey *survey, enum survey_state *state)
{
	const struct transport_options how = { .interface = options->interface };
	const struct transport_address at = {
		.address = found->from.address,
		.port = PORT,
		.interface = found->from.interface,
	};
	struct transport *t = NULL;
	const char *why;
	int result = transport_open(&t, "socket", &how, &why);
	const struct pokeys_io io = { .send = send_packet, .context = t };

	survey_begin(survey, &io, at.address, found->answer.serial, view_now());
	if (!result)
		result = t->ops->attach(t, 0);
	if (!result)
		result = t->ops->start(t);
	if (!result)
		result = t->ops->aim(t, 0, &at);
	if (!result)
		*state = converse(t, survey);
	if (t)
		transport_close(t);
	return result;
}

/* Names differ, or there would be two sections of one name. */
static void make_unique(char names[][POKEYS_SHM_NAME_MAX], size_t count)
{
	char *name = names[count];
	size_t length = strlen(name);
	unsigned int number = 2;

	if (length > POKEYS_SHM_NAME_MAX - 5)
		length = POKEYS_SHM_NAME_MAX - 5;
	for (size_t i = 0; i < count; i++) {
		if (strcmp(names[i], name) != 0)
			continue;
		snprintf(name + length, 5, "-%u", number++ % 1000);
		i = SIZE_MAX; /* from the first one: this name may exist as well */
	}
}

/* The network card with the smallest network that has this address; 0 = behind a router. */
static unsigned int interface_to(const struct transport_address *at)
{
	static struct own_address own[ADDRESSES_OWN_MAX];
	const int count = addresses_own(own, ADDRESSES_OWN_MAX, 0);
	unsigned int interface = 0;
	uint8_t prefix = 0;

	if (at->interface)
		return at->interface;
	for (int i = 0; i < count; i++) {
		const uint32_t mask = own[i].prefix ? ~UINT32_C(0) << (32 - own[i].prefix) : 0;

		if ((own[i].address ^ at->address) & mask || own[i].prefix < prefix)
			continue;
		interface = own[i].loopback ? 0 : own[i].interface;
		prefix = own[i].prefix;
	}
	return interface;
}

/* The network card that all of them are at; "" = none, or several. */
static void only_interface(const struct found *found, size_t count, char name[IF_NAMESIZE])
{
	const unsigned int interface = interface_to(&found[0].from);

	*name = '\0';
	for (size_t i = 1; i < count; i++)
		if (interface_to(&found[i].from) != interface)
			return;
	if (interface)
		if_indextoname(interface, name);
}

static void print_head(const struct found *found, size_t count, FILE *to)
{
	char interface[IF_NAMESIZE];

	only_interface(found, count, interface);
	fputs("# Devices that answered \"pokeysctl discover --config\", with their settings.\n"
	      "# Save this as /etc/pokeysd/pokeysd.conf, then run: sudo pokeysd --check-config\n"
	      "# pokeysd.conf(5) describes all keys. To enable a line that begins with \";\",\n"
	      "# remove the \";\".\n"
	      "\n"
	      "[daemon]\n"
	      "# Members of this group may command the devices.\n",
	      to);
	fprintf(to, "%sgroup = pokeys\n", getgrnam("pokeys") ? "" : "; ");
	if (*interface)
		fprintf(to,
			"# To use only this network card, enable this line.\n"
			"; interface = %s\n",
			interface);
	fputs("# The core that runs only the realtime thread; \"pokeysctl doctor\" explains how\n"
	      "# to reserve one.\n"
	      "; cpu = 1\n",
	      to);
}

/* Keys that a machine needs and that cannot be read from the device. */
static void suggest(FILE *to)
{
	fputs("\n# If LinuxCNC sends no heartbeat for heartbeat-timeout-ms, outputs in safe-hold\n"
	      "# keep their value, outputs in safe-on go on, and all others go off.\n"
	      "; safe-hold = 31\n"
	      "; safe-on = 32\n"
	      "; heartbeat-timeout-ms = 100\n",
	      to);
}

static const char *const endings[] = {
	[SURVEY_SILENT] = "the device answered the search, but not the requests for its settings",
	[SURVEY_OTHER] = "a device with another serial number answers at this address",
	[SURVEY_UNSUPPORTED] = "pokeysd does not drive devices of this type",
	[SURVEY_LOCKED] = "the device is locked with a password, so its settings cannot be read",
};

/* A search reaches neither what is behind a router nor this computer itself. */
static void print_place(const struct found *found, const char *address, FILE *to)
{
	if (found->answer.serial)
		fprintf(to, "serial = %u\n", found->answer.serial);
	if (interface_to(&found->from))
		fprintf(to,
			"# If the address is set, pokeysd does not search for the device.\n"
			"; address = %s\n",
			address);
	else
		fprintf(to,
			"# pokeysd searches only the networks of this computer. This device\n"
			"# is in another one, so its address is required.\n"
			"address = %s\n",
			address);
}

/* Whether its settings are in the file. */
static bool print_device(const struct found *found, const char *name, const struct survey *survey,
			 enum survey_state state, const char *failure, FILE *to)
{
	const char *why = failure ? failure : endings[state];
	char address[16], firmware[16];
	bool whole;

	discover_address(found->from.address, address);
	discover_firmware(&found->answer, firmware);
	fprintf(to, "\n# %s, firmware %s, at %s\n", discover_type(&found->answer), firmware,
		address);
	if (why) {
		complain("%u at %s: %s", found->answer.serial, address, why);
		fprintf(to, "# The settings are missing: %s.\n", why);
	}
	if (!failure && (state == SURVEY_UNSUPPORTED || state == SURVEY_OTHER)) {
		fprintf(to, "; [device %s]\n; serial = %u\n", name, found->answer.serial);
		return false;
	}
	fprintf(to,
		"# You may change this name. LinuxCNC (devices=) and pokeysctl use it.\n"
		"[device %s]\n",
		name);
	print_place(found, address, to);
	if (!failure && state == SURVEY_LOCKED)
		fputs("# Write the password into the following file, as its only line.\n"
		      "; password-file = /etc/pokeysd/password\n",
		      to);
	suggest(to);
	whole = !failure && state == SURVEY_DONE;
	if (whole && survey_unanswered(survey))
		fprintf(to,
			"\n# The device did not answer %u of the requests for its settings.\n"
			"# The settings that are missing below are unknown.\n",
			survey_unanswered(survey));
	if (whole && config_draft_settings(survey_settings(survey), to))
		complain("%u at %s: out of memory while printing its settings",
			 found->answer.serial, address);
	return whole;
}

static bool is_printed(const uint32_t *serials, size_t count, uint32_t serial)
{
	for (size_t i = 0; i < count; i++)
		if (serials[i] == serial)
			return true;
	return false;
}

/* Of a device found in two networks, the first address that answers counts, else the last. */
static bool is_needed(const struct found *found, size_t count, enum survey_state state, int failure)
{
	return (!failure && state == SURVEY_DONE) || count < 2 ||
	       found[1].answer.serial != found->answer.serial;
}

/* Whether all settings of all devices are there. */
static bool print_devices(const struct found *found, size_t count, const struct options *options,
			  struct survey *survey, FILE *to)
{
	static char names[TRANSPORT_CHANNELS + 1][POKEYS_SHM_NAME_MAX];
	uint32_t serials[TRANSPORT_CHANNELS];
	size_t printed = 0;
	bool all = true;

	for (size_t i = 0; i < count; i++) {
		enum survey_state state = SURVEY_READING;
		const char *label;
		int failure;

		if (is_printed(serials, printed, found[i].answer.serial))
			continue;
		if (printed == TRANSPORT_CHANNELS) {
			complain("a daemon drives at most %d devices; the others are omitted",
				 TRANSPORT_CHANNELS);
			return false;
		}
		failure = read_device(&found[i], options, survey, &state);
		if (!is_needed(&found[i], count - i, state, failure))
			continue;
		label = survey_identity(survey)->name;
		label = *label ? label : discover_type(&found[i].answer);
		config_draft_name(label, strlen(label), "pokeys", names[printed],
				  sizeof(names[printed]));
		make_unique(names, printed);
		all = print_device(&found[i], names[printed], survey, state,
				   failure ? strerror(-failure) : NULL, to) &&
		      all;
		/* devices that the daemon cannot drive do not count towards the limit */
		if (!failure && (state == SURVEY_UNSUPPORTED || state == SURVEY_OTHER))
			continue;
		serials[printed++] = found[i].answer.serial;
	}
	return all;
}

int discover_draft(const struct found *found, size_t count, const struct options *options, FILE *to)
{
	struct survey *survey = aligned_alloc(64, survey_size());
	bool all;

	if (!survey) {
		complain("out of memory, the devices' settings cannot be read");
		return STATUS_FAILED;
	}
	print_head(found, count, to);
	all = print_devices(found, count, options, survey, to);
	free(survey);
	return all ? STATUS_OK : STATUS_FAILED;
}
