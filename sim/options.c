// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The command line, from one table. Faults of the link are not in it: they
 * have a table of their own (fault.c), and each is an option for both
 * directions ("--loss"), for requests ("--loss-request") and for replies
 * ("--loss-reply").
 */
#include "sim/options.h"

#include <string.h>

#include "sim/fault.h"
#include "sim/parse.h"
#include "sim/preset.h"

enum kind {
	FLAG,  /* bool */
	CLEAR, /* bool, set to false */
	STRING,
	ADDRESS, /* uint8_t[4] */
	MODEL,
	UINT8,
	UINT16,
	UINT32,
	UINT64,
	INT,
	MICROSECONDS, /* uint64_t of nanoseconds */
	PROBABILITY,  /* double */
};

struct row {
	const char *name;
	const char *argument; /* NULL: takes none */
	enum kind kind;
	size_t offset;
	int64_t low, high;
	const char *help;
};

#define FIELD(name) offsetof(struct sim_options, name)

static const struct row rows[] = {
	{ "model", "NAME", MODEL, FIELD(rig.device.hardware), 0, 0, SIM_HARDWARE_NAMES " (57CNC)" },
	{ "serial", "N", UINT32, FIELD(rig.device.serial), 1, UINT32_MAX, "serial number (65432)" },
	{ "name", "TEXT", STRING, FIELD(rig.device.name), 0, 0, "device name, 20 characters" },
	{ "user-id", "N", UINT8, FIELD(rig.device.user_id), 0, 255, "user id (0)" },
	{ "firmware", "BYTE", UINT8, FIELD(rig.device.firmware_major), 1, 255,
	  "coded version, 0x37 is 4.7 (0x37)" },
	{ "revision", "N", UINT8, FIELD(rig.device.firmware_revision), 0, 255,
	  "firmware revision (15)" },
	{ "address", "A.B.C.D", ADDRESS, FIELD(rig.device.ip), 0, 0,
	  "address to live at (127.0.0.1)" },
	{ "port", "N", UINT16, FIELD(port), 0, 65535, "port, 0 for any free one (20055)" },
	{ "no-tcp", NULL, CLEAR, FIELD(tcp), 0, 0, "serve UDP only" },
	{ "no-discovery", NULL, CLEAR, FIELD(discovery), 0, 0, "do not answer searches" },
	{ "preset", "NAME", STRING, FIELD(preset), 0, 0,
	  "ready-made machine: factory, loopback, demo, printer,\n"
	  "                             servo-mill (factory)" },
	{ "script", "FILE", STRING, FIELD(script), 0, 0, "run control commands from a file" },
	{ "control", "SOCKET", STRING, FIELD(control), 0, 0, "listen there for commands" },
	{ "seed", "N", UINT64, FIELD(rig.seed), 0, INT64_MAX, "seed of all that is random (1)" },
	{ "service-us", "US", MICROSECONDS, FIELD(rig.service_ns), 0, 10000000,
	  "time the device takes for a request (0)" },
	{ "jitter-us", "US", MICROSECONDS, FIELD(rig.jitter_ns), 0, 10000000,
	  "and up to this much more (0)" },
	{ "hiccup", "P", PROBABILITY, FIELD(rig.hiccup), 0, 1,
	  "probability of a request which takes far longer (0)" },
	{ "hiccup-us", "US", MICROSECONDS, FIELD(rig.hiccup_ns), 0, 10000000, "how much longer" },
	{ "save-us", "US", MICROSECONDS, FIELD(rig.save_ns), 0, 10000000,
	  "time it is busy after saving to flash (0)" },
	{ "boot-ms", "MS", UINT32, FIELD(rig.device.boot_ms), 0, 600000,
	  "silence after a reboot (0)" },
	{ "emergency-base", "N", UINT8, FIELD(rig.device.choices.emergency_base), 1, 100,
	  "base of the emergency pin setting (10)" },
	{ "count-free", NULL, FLAG, FIELD(rig.device.choices.count_free), 0, 0,
	  "the status counts free slots of the motion buffer, not all" },
	{ "echo-synced", NULL, FLAG, FIELD(rig.device.choices.echo_synced), 0, 0,
	  "do not tell what synced PWM and outputs are set up for" },
	{ "drop-unknown", NULL, FLAG, FIELD(rig.device.choices.drop_unknown), 0, 0,
	  "do not answer unknown operations at all" },
	{ "enforce-security", NULL, FLAG, FIELD(rig.device.choices.enforce_security), 0, 0,
	  "refuse commands while locked by password" },
	{ "ready-fd", "FD", INT, FIELD(ready_fd), 0, 1024,
	  "write a line to this descriptor when serving" },
	{ "spin", NULL, FLAG, FIELD(spin), 0, 0, "never sleep: lowest latency, one whole CPU" },
	{ "cpu", "N", INT, FIELD(cpu), 0, 1023, "stay on this CPU" },
	{ "quiet", NULL, FLAG, FIELD(quiet), 0, 0, "print nothing but errors" },
	{ "help", NULL, FLAG, FIELD(help), 0, 0, "print this" },
	{ "version", NULL, FLAG, FIELD(version), 0, 0, "print the version" },
};

#define ROWS (sizeof(rows) / sizeof(rows[0]))

static void defaults(struct sim_options *options)
{
	static const uint8_t home[4] = { 127, 0, 0, 1 };

	memset(options, 0, sizeof(*options));
	memcpy(options->rig.device.ip, home, sizeof(home));
	options->rig.seed = 1;
	options->port = WIRE_PORT;
	options->tcp = true;
	options->discovery = true;
	options->ready_fd = -1;
	options->cpu = -1;
}

static bool store_integer(void *field, const struct row *row, int64_t value)
{
	switch (row->kind) {
	case UINT8:
		*(uint8_t *)field = (uint8_t)value;
		return true;
	case UINT16:
		*(uint16_t *)field = (uint16_t)value;
		return true;
	case UINT32:
		*(uint32_t *)field = (uint32_t)value;
		return true;
	case UINT64:
		*(uint64_t *)field = (uint64_t)value;
		return true;
	case INT:
		*(int *)field = (int)value;
		return true;
	case MICROSECONDS:
		*(uint64_t *)field = UINT64_C(1000) * (uint64_t)value;
		return true;
	case FLAG:
	case CLEAR:
	case STRING:
	case ADDRESS:
	case MODEL:
	case PROBABILITY:
	default:
		return false;
	}
}

static bool store_model(uint8_t *hardware, const char *name, const char *value,
			struct sim_text *why)
{
	uint8_t found = sim_hardware_find(value);

	if (!found) {
		sim_text_add(why, "%s: '%.60s' is not one of %s", name, value, SIM_HARDWARE_NAMES);
		return false;
	}
	*hardware = found;
	return true;
}

/* Stores the value of an option; `name` is it with its dashes, for the message. */
static bool store(struct sim_options *options, const struct row *row, const char *name,
		  const char *value, struct sim_text *why)
{
	void *field = (char *)options + row->offset;
	int64_t number;

	switch (row->kind) {
	case FLAG:
	case CLEAR:
		*(bool *)field = row->kind == FLAG;
		return true;
	case STRING:
		*(const char **)field = value;
		return true;
	case ADDRESS:
		return sim_parse_address(why, name, value, field);
	case MODEL:
		return store_model(field, name, value, why);
	case PROBABILITY:
		return sim_parse_number(why, name, value, 0, 1, field);
	case UINT8:
	case UINT16:
	case UINT32:
	case UINT64:
	case INT:
	case MICROSECONDS:
	default:
		return sim_parse_integer(why, name, value, row->low, row->high, &number) &&
		       store_integer(field, row, number);
	}
}

static const struct row *find(const char *name)
{
	for (size_t i = 0; i < ROWS; i++) {
		if (!strcmp(rows[i].name, name))
			return &rows[i];
	}
	return NULL;
}

/* "loss", "loss-request" or "loss-reply": the fault's name and the directions. */
static bool split_fault(const char *option, char *name, size_t size, bool dirs[SIM_LINK_DIRS])
{
	size_t len = strlen(option);
	size_t cut = len;

	dirs[SIM_LINK_REQUEST] = dirs[SIM_LINK_REPLY] = true;
	if (len > 8 && !strcmp(option + len - 8, "-request")) {
		dirs[SIM_LINK_REPLY] = false;
		cut = len - 8;
	} else if (len > 6 && !strcmp(option + len - 6, "-reply")) {
		dirs[SIM_LINK_REQUEST] = false;
		cut = len - 6;
	}
	if (cut >= size)
		return false;
	memcpy(name, option, cut);
	name[cut] = '\0';
	for (unsigned int i = 0; i < sim_fault_count; i++) {
		if (!strcmp(sim_fault_rows[i].name, name))
			return true;
	}
	return false;
}

/* `option` is as it was given, for the message; `name` is the fault's own. */
static bool set_fault(struct sim_options *options, const char *option, const char *name,
		      const bool dirs[SIM_LINK_DIRS], const char *value, struct sim_text *why)
{
	char reason[256];
	struct sim_text bad;

	sim_text_init(&bad, reason, sizeof(reason));
	for (unsigned int dir = 0; dir < SIM_LINK_DIRS; dir++) {
		if (!dirs[dir] || sim_fault_set(&options->rig.link.faults[dir], name, value, &bad))
			continue;
		sim_text_add(why, "%s%s", option, reason + strlen(name));
		return false;
	}
	return true;
}

/* One option; *used is the number of words it took. */
static bool take(struct sim_options *options, char **argv, int *used, struct sim_text *why)
{
	bool dirs[SIM_LINK_DIRS];
	const struct row *row;
	char name[64];
	char fault[64];
	const char *value = strchr(argv[0], '=');
	size_t len = value ? (size_t)(value - argv[0]) : strlen(argv[0]);

	if (strncmp(argv[0], "--", 2) != 0 || len >= sizeof(name)) {
		sim_text_add(why, "there is no option %.60s; pokeys-sim --help lists them",
			     argv[0]);
		return false;
	}
	memcpy(name, argv[0], len);
	name[len] = '\0';
	*used = 1;
	row = find(name + 2);
	if (row && !row->argument) {
		if (value)
			sim_text_add(why, "%s: takes no value", name);
		return !value && store(options, row, name, NULL, why);
	}
	if (!row && !split_fault(name + 2, fault, sizeof(fault), dirs)) {
		sim_text_add(why, "there is no option %s; pokeys-sim --help lists them", name);
		return false;
	}
	if (value) {
		value++;
	} else {
		value = argv[1];
		*used = 2;
	}
	if (!value || !*value) {
		sim_text_add(why, "%s: needs a value; pokeys-sim --help lists the options", name);
		return false;
	}
	if (row)
		return store(options, row, name, value, why);
	return set_fault(options, name, fault, dirs, value, why);
}

/* The vendor's library takes a PoKeys56E for a PoKeys55 by its number (protocol section 2.3). */
static bool serial_fits(uint8_t hardware, uint32_t serial, struct sim_text *why)
{
	if (hardware != WIRE_HW_56E || !serial || (serial >= 20000 && serial < 65535))
		return true;
	sim_text_add(why, "--serial: a PoKeys56E has a number from 20000 to 65534, not %u", serial);
	return false;
}

static bool check(const struct sim_options *options, struct sim_text *why)
{
	const uint8_t *ip = options->rig.device.ip;
	unsigned int which;

	/* From 0.0.0.0 replies would leave with another address (protocol section 7.1). */
	if (ip[0] == 0 || ip[0] >= 224) {
		sim_text_add(why, "--address: %u.%u.%u.%u is not one a device can have", ip[0],
			     ip[1], ip[2], ip[3]);
		return false;
	}
	if (!serial_fits(options->rig.device.hardware, options->rig.device.serial, why))
		return false;
	if (options->preset)
		return sim_parse_choice(why, "--preset", options->preset, SIM_PRESETS, &which);
	return true;
}

bool sim_options_parse(struct sim_options *options, int argc, char **argv, struct sim_text *why)
{
	int used;

	defaults(options);
	for (int i = 1; i < argc; i += used) {
		if (!take(options, argv + i, &used, why))
			return false;
	}
	return check(options, why);
}

static void print_option(FILE *to, const char *name, const char *argument, const char *help)
{
	char left[40];

	snprintf(left, sizeof(left), "--%s%s%s", name, argument ? " " : "",
		 argument ? argument : "");
	fprintf(to, "  %-26s %s\n", left, help);
}

void sim_options_help(FILE *to)
{
	fputs("usage: pokeys-sim [OPTION...]\n"
	      "       pokeys-sim --ctl SOCKET COMMAND...\n\n"
	      "Simulates a PoKeys device over UDP and TCP.\n\n",
	      to);
	for (size_t i = 0; i < ROWS; i++)
		print_option(to, rows[i].name, rows[i].argument, rows[i].help);
	fputs("\nFaults of the network, each also as --NAME-request and --NAME-reply:\n", to);
	for (unsigned int i = 0; i < sim_fault_count; i++)
		print_option(to, sim_fault_rows[i].name, sim_fault_rows[i].argument,
			     sim_fault_rows[i].help);
	fputs("\nDIST is US, LOW-HIGH (evenly) or heavy:LOW:HIGH[:ALPHA].\n"
	      "Commands for --ctl: try the command help.\n",
	      to);
}
