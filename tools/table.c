/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * pokeysctl(1): one table of subcommands, one of options. Which option goes with which
 * subcommand is in the tables, so that help, parser, complaints and completion agree.
 */
#include "tools/table.h"
#include <string.h>
#include <pokeys/shm.h>

const struct command table_commands[] = {
	{ "discover", "", "search the network for devices",
	  TAKES_TIMEOUT | TAKES_ADDRESS | TAKES_INTERFACE | TAKES_DRAFT, command_discover },
	{ "devices", "", "list the devices of the running daemon", TAKES_RUNTIME, command_devices },
	{ "status", "[DEVICE ...]", "show the state of the devices once",
	  TAKES_RUNTIME | TAKES_NAMES, command_status },
	{ "get", "DEVICE [NAME ...]", "print values by name; a name may contain * and ?",
	  TAKES_RUNTIME | TAKES_NAMES, command_get },
	{ "names", "[NAME ...]", "list the names of all values and their meanings", TAKES_NAMES,
	  command_names },
	{ "config", "show | diff | apply | save DEVICE",
	  "show a device's settings, compare them with the requested ones, apply or "
	  "save these",
	  TAKES_RUNTIME | TAKES_NAMES, command_config },
	{ "migrate", "INI [HAL ...]",
	  "show what to change on a machine written for the older component; --write writes "
	  "new files",
	  TAKES_NAMES | TAKES_WRITE, command_migrate },
	{ "doctor", "", "find what makes this machine late, and say how to fix it",
	  TAKES_RUNTIME | TAKES_CPU | TAKES_CONFIG | TAKES_ROOT | TAKES_FIX, command_doctor },
	{ "latency", "", "measure how late threads wake up, and the daemon's own latency",
	  TAKES_RUNTIME | TAKES_CPU | TAKES_CONFIG | TAKES_MEASURE | TAKES_SECONDS,
	  command_latency },
	{ "trace", "", "show what took the time in the slowest cycles (root)",
	  TAKES_RUNTIME | TAKES_SECONDS | TAKES_TRACE, command_trace },
	{ "output", "DEVICE TERMINALS on | off", "hold outputs for a while, without LinuxCNC",
	  TAKES_RUNTIME | TAKES_NAMES | TAKES_DURATION, command_output },
	{ "pwm", "DEVICE TERMINALS PERCENT",
	  "hold PWM outputs at a duty for a while, without LinuxCNC",
	  TAKES_RUNTIME | TAKES_NAMES | TAKES_DURATION, command_pwm },
	{ "axis", "DEVICE AXIS move PULSES | move-to PULSES | home | stop | clear",
	  "move or home one axis, without LinuxCNC", TAKES_RUNTIME | TAKES_NAMES | TAKES_SPEED,
	  command_axis },
	{ "heater", "DEVICE HEATER heat CELSIUS | tune CELSIUS | gain GAIN VALUE | reset",
	  "heat to a temperature, find or change gains, or clear a fault, without LinuxCNC",
	  TAKES_RUNTIME | TAKES_NAMES | TAKES_DURATION | TAKES_CSV, command_heater },
	{ "servo",
	  "DEVICE MOTOR move UNITS | move-to UNITS | swing UNITS | home | tune UNITS | "
	  "gain GAIN VALUE | reset",
	  "move or home a servo motor, find or change gains, or clear its fault, without LinuxCNC",
	  TAKES_RUNTIME | TAKES_NAMES | TAKES_DURATION | TAKES_SPEED | TAKES_CSV, command_servo },
	{ "moves", "DEVICE FILE",
	  "move servo motors and axes together along a path, without LinuxCNC",
	  TAKES_RUNTIME | TAKES_NAMES | TAKES_SPEED, command_moves },
	{ "record", "[DEVICE] FILE",
	  "write the packets and events of the last seconds to a file for Wireshark",
	  TAKES_RUNTIME | TAKES_NAMES, command_record },
	{ "replay", "FILE", "print such a file, one line for each packet and event", TAKES_NAMES,
	  command_replay },
	{ "events", "[DEVICE ...]", "print what has happened to the devices",
	  TAKES_RUNTIME | TAKES_NAMES | TAKES_FOLLOW, command_events },
	{ "terminals", "MODEL",
	  "show what a board's terminals and relays are called in LinuxCNC and in pokeysd.conf",
	  TAKES_NAMES, command_terminals },
	{ "top", "[DEVICE ...]", "show the state of the devices continuously",
	  TAKES_RUNTIME | TAKES_NAMES | TAKES_COUNT | TAKES_INTERVAL, command_top },
	{ .name = NULL },
};

const struct option_row table_options[] = {
	{ "json", 'j', NULL, 0, "output for scripts; pokeysctl(1) lists the keys" },
	{ "runtime-directory", 'r', "DIR", TAKES_RUNTIME,
	  "directory of the daemon (" POKEYS_RUNTIME_DIRECTORY ")" },
	{ "timeout", 't', "MS", TAKES_TIMEOUT, "how long to wait for answers (500)" },
	{ "address", 'a', "A,B", TAKES_ADDRESS, "also search these addresses, behind a router" },
	{ "interface", 'i', "NIC", TAKES_INTERFACE, "search only on this interface" },
	{ "count", 'n', "N", TAKES_COUNT, "end after N redraws (never)" },
	{ "follow", 'f', NULL, TAKES_FOLLOW, "go on with what happens next, until Ctrl-C" },
	{ "interval", 'd', "S", TAKES_INTERVAL, "seconds between redraws (0.5)" },
	{ "cpu", 'c', "N", TAKES_CPU, "the core to check or measure (the daemon's)" },
	{ "config", 'o', "FILE", TAKES_CONFIG, "the daemon's configuration file" },
	{ "config", 'D', NULL, TAKES_DRAFT,
	  "print a pokeysd.conf for the devices found, with their present settings" },
	{ "write", 'W', NULL, TAKES_WRITE,
	  "write the changed files beside the old ones (mill.pokeysd.ini)" },
	{ "fix", 'X', NULL, TAKES_FIX,
	  "show the files that mend what was found, ask, and write them (root)" },
	{ "undo", 'U', NULL, TAKES_FIX, "show those files, ask, and remove them (root)" },
	{ "yes", 'y', NULL, TAKES_FIX, "do not ask" },
	{ "root", 'R', "DIR", TAKES_ROOT, "examine another machine, whose files are in DIR" },
	{ "seconds", 's', "S", TAKES_SECONDS, "how long to measure (10)" },
	{ "for", 'F', "S", TAKES_DURATION,
	  "how many seconds to hold outputs (5), or to heat or swing (until Ctrl-C)" },
	{ "speed", 'S', "SPEED", TAKES_SPEED,
	  "of the move: pulses/s (a tenth of the axis' highest), of servo motors units/s" },
	{ "slowest", 'l', "N", TAKES_TRACE, "how many of the slowest cycles to show (5)" },
	{ "threshold", 'T', "US", TAKES_TRACE, "only cycles of at least US microseconds (0)" },
	{ "priority", 'p', "P", TAKES_MEASURE, "SCHED_FIFO priority of the threads (80)" },
	{ "no-realtime", 'N', NULL, TAKES_MEASURE, "measure without realtime priority" },
	{ "svg", 'v', "FILE", TAKES_MEASURE, "also draw the histograms" },
	{ "csv", 'x', "FILE", TAKES_CSV, "also write what happens to the heater or motor, as CSV" },
	{ "help", 'h', NULL, 0, "this text, or that of the command named" },
	{ "version", 'V', NULL, 0, "the version" },
	{ "completion", 'C', NULL, 0, "list commands and options for a shell's completion" },
	{ .name = NULL },
};

_Static_assert(sizeof(table_options) / sizeof(table_options[0]) <= TABLE_OPTIONS_MAX,
	       "more options than getopt's table has places");

/* Whether another option of the same name takes precedence. */
static bool is_hidden(const struct option_row *row, unsigned int takes)
{
	for (const struct option_row *other = table_options; other->name; other++)
		if (other != row && !strcmp(other->name, row->name) && !(row->takes & takes))
			return other < row || other->takes & takes;
	return false;
}

void table_long_options(unsigned int takes, struct option options[TABLE_OPTIONS_MAX])
{
	memset(options, 0, TABLE_OPTIONS_MAX * sizeof(*options));
	for (const struct option_row *row = table_options; row->name; row++)
		if (!is_hidden(row, takes))
			*options++ = (struct option){ row->name,
						      row->value ? required_argument : no_argument,
						      NULL, row->letter };
}

unsigned int table_takes(int letter)
{
	for (const struct option_row *row = table_options; row->name; row++)
		if (row->letter == letter)
			return row->takes;
	return 0;
}

bool table_short(const struct option_row *row)
{
	return strchr(TABLE_LETTERS + 1, row->letter);
}
