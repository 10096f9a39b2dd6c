// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Every key of pokeysd.conf, once.
 *
 * The parser, --check-config, --help-config, the key list of
 * pokeysd.conf(5) and the tests of every limit all walk this table, so a key
 * that exists is documented, bounded and tested, and a key that is documented
 * exists. Defaults are written as a user would write them and go through the
 * same code as a user's values: a default out of its own range cannot be.
 *
 * The keys of the device's own settings are those of the settings room's table,
 * which pokeysctl prints them with; they are adopted here, behind our own.
 *
 * Pins are numbered here as they are printed on the terminals, from 1: that
 * is what somebody with a screwdriver reads. Axes and encoders are numbered
 * from 0, as in the HAL (joint.00, encoder.00) and in the protocol.
 */
#include "daemon/control/config_row.h"

static const struct config_key own[] = {
	KEY(DAEMON(runtime_directory), "runtime-directory", CONFIG_FILE,
	    .fallback = POKEYS_RUNTIME_DIRECTORY,
	    .help = "Folder of the shared memory. One daemon per folder; the HAL component and the "
		    "tools have to use the same folder."),
	KEY(DAEMON(group), "group", CONFIG_TEXT,
	    .help = "Group whose members may command: LinuxCNC's user has to be a member. If not "
		    "set, the group of the folder is not changed."),
	KEY(DAEMON(monitor_group), "monitor-group", CONFIG_TEXT,
	    .help = "Group whose members may read all data of the devices, with pokeysctl for "
		    "example, and change nothing. If not set, it is pokeys-monitor if this group "
		    "exists, otherwise the group of the folder. The daemon's user has to be a "
		    "member."),
	KEY(DAEMON(transport), "transport", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "auto", CONFIG_AUTO }, { "io_uring", CONFIG_IO_URING },
			   { "socket", CONFIG_SOCKET }, { "xdp", CONFIG_XDP }),
	    .fallback = "auto",
	    .help = "How packets reach the network. auto uses io_uring, or plain sockets if the "
		    "kernel refuses io_uring. xdp bypasses the kernel's network stack (AF_XDP); it "
		    "needs interface and pokeys-guard(8), and behaves like auto if AF_XDP is not "
		    "available."),
	KEY(DAEMON(interface), "interface", CONFIG_TEXT,
	    .help = "Network interface that all devices are connected to. If not set, a device "
		    "with serial alone is driven through the interface at which it has answered, "
		    "and with address, the routing table decides. Set it if two interfaces are in "
		    "the network of the devices."),
	KEY(DAEMON(guard), "guard", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "shared", 0 }, { "dedicated", 1 }), .fallback = "shared",
	    .help = "What pokeys-guard(8), if it is started, lets in at the interface: with "
		    "shared, everything that is not aimed at the daemon; with dedicated, only the "
		    "devices, ARP and ICMP."),
	KEY(DAEMON(mode), "mode", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "auto", CONFIG_WAIT_AUTO }, { "sleep", CONFIG_WAIT_SLEEP },
			   { "napi", CONFIG_WAIT_NAPI }, { "spin", CONFIG_WAIT_SPIN }),
	    .fallback = "auto",
	    .help = "How the realtime thread waits. sleep releases the processor until a packet "
		    "arrives. napi first polls the network card for a while; it needs io_uring and "
		    "Linux 6.9. spin keeps the processor, reacts a few microseconds faster and "
		    "needs a dedicated core. auto selects spin on an isolated core that LinuxCNC "
		    "does not use, else napi if interface names a card that can be polled, else "
		    "sleep; the log gives the reason."),
	KEY(DAEMON(busy_poll_us), "busy-poll-us", CONFIG_INTEGER, RANGE(0, 10000),
	    .fallback = "200", .unit = "us",
	    .help = "With mode napi: how long the thread polls the network card for a reply before "
		    "it sleeps. With 0, auto never selects napi."),
	KEY(DAEMON(period_us), "period-us", CONFIG_INTEGER, RANGE(250, 4000), .fallback = "1000",
	    .unit = "us",
	    .help = "Length of a cycle. In each cycle the daemon reads each device once and writes "
		    "the shared memory once."),
	KEY(DAEMON(collect), "collect", CONFIG_REAL, RANGE(0.1, 0.9), .fallback = "0.5",
	    .unit = "of a period",
	    .help = "How long a cycle waits for its fast replies before it publishes what it has."),
	KEY(DAEMON(phase_lock), "phase-lock", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "no", LOOP_PHASE_NO }, { "auto", LOOP_PHASE_AUTO },
			   { "yes", LOOP_PHASE_YES }),
	    .fallback = "auto",
	    .help = "Align the cycle so that fresh data is published just before each read of "
		    "LinuxCNC's servo thread. auto does so if that thread's period is a multiple "
		    "or a part of period-us, within 1 %. yes does the same and writes a warning if "
		    "it is not possible. no does not align the cycle."),
	KEY(DAEMON(duty), "duty", CONFIG_REAL, RANGE(0.1, 1), .fallback = "0.9",
	    .unit = "of a period",
	    .help = "Largest part of each period for which a spinning loop runs: 0.1 to 0.9, or 1 "
		    "if realtime throttling is off (kernel.sched_rt_runtime_us = -1)."),
	KEY(DAEMON(cpu), "cpu", CONFIG_INTEGER, RANGE(0, 1023), .words = WORDS({ "any", -1 }),
	    .fallback = "any", .help = "Core that the realtime thread is pinned to."),
	KEY(DAEMON(priority), "priority", CONFIG_INTEGER, RANGE(1, 98), .fallback = "80",
	    .help = "SCHED_FIFO priority of the realtime thread. LinuxCNC's servo thread has 98."),
	KEY(DAEMON(realtime), "realtime", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "required", 1 }, { "optional", 0 }), .fallback = "required",
	    .help = "If the system refuses the priority or locked memory, optional continues with "
		    "a warning, and required ends the daemon. optional is the same as "
		    "--no-realtime."),
	KEY(DAEMON(discovery_interval_ms), "discovery-interval-ms", CONFIG_INTEGER,
	    RANGE(100, 60000), .fallback = "1000", .unit = "ms",
	    .help = "How often the network is searched while a device with a serial number is "
		    "missing. Nothing is sent while no such device is missing."),
	KEY(DAEMON(discovery_address), "discovery-address", CONFIG_ADDRESS_LIST,
	    .help = "Addresses to which the search is sent in addition to the broadcasts in every "
		    "network of every interface (or of the one that interface names), for devices "
		    "behind a router."),
	KEY(DAEMON(metrics_file), "metrics-file", CONFIG_FILE,
	    .help = "File to which counters are written in Prometheus' text format. If not set, no "
		    "file is written."),
	KEY(DAEMON(metrics_interval_ms), "metrics-interval-ms", CONFIG_INTEGER, RANGE(100, 3600000),
	    .fallback = "10000", .unit = "ms", .help = "How often the metrics file is rewritten."),
	KEY(DAEMON(recorder_seconds), "recorder-seconds", CONFIG_INTEGER, RANGE(0, 60),
	    .fallback = "5", .unit = "s",
	    .help = "For how long the latest packets and events are kept in memory for pokeysctl "
		    "record. Memory grows with this time and the number of devices, in powers of "
		    "two: 8 MiB for one device at 1 kHz and 5 s. It is never more than 128 MiB, "
		    "which is about 5 s of 26 devices at 1 kHz; with more devices, the time is "
		    "shorter. 0 keeps none."),
	KEY(DAEMON(record_folder), "record-folder", CONFIG_FILE,
	    .help = "Folder to which these packets and events are written at a fault, as a file "
		    "for Wireshark. If not set, the folder that systemd provides is used, "
		    "/var/log/pokeysd; a daemon that is started by hand then writes no files. "
		    "Members of monitor-group may read the files if the folder lets them."),
	KEY(DAEMON(record_files), "record-files", CONFIG_INTEGER, RANGE(0, 1000), .fallback = "20",
	    .help = "How many such files are kept; the oldest are removed. 0 writes none."),
	KEY(DAEMON(record_interval_s), "record-interval-s", CONFIG_INTEGER, RANGE(1, 86400),
	    .fallback = "60", .unit = "s",
	    .help = "At most one such file is written in this time for each reason (lost, "
		    "commander, emergency, limit, transport, late)."),
	KEY(DAEMON(log_level), "log-level", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "error", EVENT_ERROR }, { "warning", EVENT_WARNING },
			   { "notice", EVENT_NOTICE }, { "info", EVENT_INFO },
			   { "debug", EVENT_DEBUG }),
	    .fallback = "info", .help = "Least important message that is written."),

	KEY(DEVICE(address), "address", CONFIG_ADDRESS,
	    .help = "Address of the device. If not set, the daemon searches for the device by its "
		    "serial number. If both are set, a device with another serial number at this "
		    "address is refused."),
	KEY(DEVICE(port), "port", CONFIG_INTEGER, RANGE(1, 65535), .fallback = "20055",
	    .help = "UDP port of the device."),
	KEY(DEVICE(serial), "serial", CONFIG_INTEGER, RANGE(1, 4294967295.0),
	    .words = WORDS({ "any", 0 }), .fallback = "any",
	    .help = "Serial number, as pokeysctl discover shows it."),
	KEY(DEVICE(heartbeat_timeout_ms), "heartbeat-timeout-ms", CONFIG_REAL, RANGE(1, 60000),
	    .fallback = "100", .unit = "ms",
	    .help = "If the commander (LinuxCNC) is silent for longer, outputs and axes go to the "
		    "safe state."),
	KEY(DEVICE(stale_after_ms), "stale-after-ms", CONFIG_REAL, RANGE(0.5, 60000),
	    .fallback = "8", .unit = "ms",
	    .help = "Inputs and positions older than this are flagged stale."),
	KEY(DEVICE(lost_after_ms), "lost-after-ms", CONFIG_REAL, RANGE(5, 60000), .fallback = "200",
	    .unit = "ms",
	    .help = "If there is no valid reply for longer, the device is lost and the daemon "
		    "searches for it again."),
	KEY(DEVICE(fast_divider), "fast-divider", CONFIG_INTEGER, RANGE(1, 100), .fallback = "1",
	    .unit = "cycles",
	    .help = "Inputs and positions of the device are read in every n-th cycle. For a device "
		    "that cannot answer as fast as the loop runs."),
	KEY(DEVICE(slow_hz), "slow-hz", CONFIG_REAL, RANGE(0.1, 100), .fallback = "5", .unit = "Hz",
	    .help = "How often slow data is read: load, clock, counters, PWM."),
	KEY(DEVICE(slow_together), "slow", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "spread", 0 }, { "together", 1 }), .fallback = "spread",
	    .help = "spread reads slow data with one request per cycle, each kind at its rate. "
		    "together reads all slow data except PoNET's in one cycle, slow-hz times a "
		    "second, for a device that accepts so many requests at once; it needs window = "
		    "20 or more."),
	KEY(DEVICE(encoder_hz), "encoder-hz", CONFIG_REAL, RANGE(1, 1000), .fallback = "50",
	    .unit = "Hz",
	    .help = "How often full 32-bit encoder counts are read to check the reconstruction "
		    "from 8 bits."),
	KEY(DEVICE(analog_hz), "analog-hz", CONFIG_REAL, RANGE(1, 1000), .fallback = "50",
	    .unit = "Hz",
	    .help = "How often those analog inputs are read that the fast reply does not carry."),
	KEY(DEVICE(deadline_floor_us), "deadline-floor-us", CONFIG_REAL, RANGE(50, 1000000),
	    .fallback = "300", .unit = "us",
	    .help = "Shortest deadline of a request; without a reply by then, it is sent again. "
		    "Between this and deadline-ceiling-ms, the deadline follows the measured round "
		    "trip."),
	KEY(DEVICE(deadline_ceiling_ms), "deadline-ceiling-ms", CONFIG_REAL, RANGE(0.05, 5000),
	    .fallback = "50", .unit = "ms", .help = "Longest deadline of a request."),
	KEY(DEVICE(deadline_initial_ms), "deadline-initial-ms", CONFIG_REAL, RANGE(0.05, 5000),
	    .fallback = "10", .unit = "ms",
	    .help = "Deadline of a request before the first round trip has been measured."),
	KEY(DEVICE(reply_lifetime_ms), "reply-lifetime-ms", CONFIG_REAL, RANGE(1, 5000),
	    .fallback = "500", .unit = "ms",
	    .help = "How late a reply may still arrive. The request number is not used again "
		    "before this time has passed."),
	KEY(DEVICE(retries), "retries", CONFIG_INTEGER, RANGE(0, 20), .fallback = "3",
	    .help = "How often a request that may be repeated is repeated; 0 means never."),
	KEY(DEVICE(window), "window", CONFIG_INTEGER, RANGE(2, 64), .fallback = "32",
	    .unit = "requests",
	    .help = "Largest number of requests in flight at once. Inputs, positions and "
		    "references are asked for in every cycle although older requests are "
		    "unanswered, as far as this permits and the device is fast enough."),
	KEY(DEVICE(retry_budget), "retry-budget", CONFIG_INTEGER, RANGE(1, 100000),
	    .fallback = "200", .unit = "/s",
	    .help = "Largest number of repetitions per second, so that a bad line is not made "
		    "worse."),
	KEY(DEVICE(send_budget), "send-budget", CONFIG_INTEGER, RANGE(10, 100000),
	    .fallback = "8000", .unit = "/s",
	    .help = "Largest number of packets per second to this device."),
	KEY(DEVICE(safe_on), "safe-on", CONFIG_PIN_LIST, RANGE(1, POKEYS_PINS),
	    .help = "Outputs that are on in the safe state. All others are off, except those of "
		    "safe-hold."),
	KEY(DEVICE(safe_hold), "safe-hold", CONFIG_PIN_LIST, RANGE(1, POKEYS_PINS),
	    .help = "Outputs that the safe state leaves as they are."),
	KEY(DEVICE(resume), "resume-outputs", CONFIG_PIN_LIST, RANGE(1, POKEYS_PINS),
	    .words = WORDS({ "auto", CONFIG_RESUME_AUTO }, { "none", 0 },
			   { "all", CONFIG_RESUME_PARTS | ((INT64_C(1) << POKEYS_PINS) - 1) },
			   { "pwm", CONFIG_RESUME_PART(DEVICE_RESUME_PWM) },
			   { "PoExtBus", CONFIG_RESUME_PART(DEVICE_RESUME_POEXTBUS) },
			   { "external", CONFIG_RESUME_PART(DEVICE_RESUME_EXTERNAL) },
			   { "PoNET", CONFIG_RESUME_PART(DEVICE_RESUME_PONET) }),
	    .fallback = "auto",
	    .help = "Outputs that follow the commander again at once after a loss of the device "
		    "or of the heartbeat, or after the computer was suspended. All others stay "
		    "in the safe state until machine-on rises. auto: none of a PoKeys57CNC, of "
		    "a device with axes, or of one whose machine-on is used; all of another one, "
		    "such as a panel. Pins, pwm, PoExtBus, external (outputs and relays) and "
		    "PoNET may be combined, with commas between."),
	KEY(DEVICE(on_emergency), "on-emergency", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "safe", 0 }, { "hold", 1 }), .fallback = "safe",
	    .help = "Outputs at an emergency stop of the commander, which always stops the axes. "
		    "safe: they are in the safe state until it is released and machine-on rises; "
		    "hold: they follow the commander."),
	KEY(DEVICE(failsafe), "failsafe", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "off", 0 }, { "on", 1 }), .fallback = "on",
	    .help = "on: the daemon configures the device to bring its outputs into the state of "
		    "the failsafe keys by itself when it no longer receives anything; off: the "
		    "failsafe setting of the device is not changed."),
	KEY(DEVICE(heater_watts), "max-heater-power-w", CONFIG_REAL, RANGE(1, 1e6),
	    .words = WORDS({ "unlimited", 0 }), .fallback = "unlimited", .unit = "W",
	    .help = "Highest electrical power of all heaters of the device together, for a "
		    "supply that does not suffice for all of them. If they need more, no heater "
		    "with a PWM output gets more than a certain part of its rated-power-w, which "
		    "is the same for all; a heater that needs less is not affected. Those with "
		    "output-pin are not limited. Each heater needs rated-power-w."),
	KEY(DEVICE(corner_deviation), "corner-deviation", CONFIG_REAL, RANGE(0, 1e3),
	    .fallback = "0.01", .unit = "units",
	    .help = "Sets the speed of servo motors and axes at a corner of a path (moves of "
		    "pokeysctl). It is the highest speed at which they could follow a rounded "
		    "corner that deviates from the programmed corner by no more than this. 0: "
		    "they stop at each corner."),
	KEY(DEVICE(axis[0].per_unit), "axis.#.pulses-per-unit", CONFIG_REAL, RANGE(-1e6, 1e6),
	    .count = POKEYS_AXES, .stride = sizeof(((struct config_raw_device *)0)->axis[0]),
	    .words = WORDS({ "none", 0 }), .fallback = "none",
	    .help = "Pulses per unit of the axis (mm or degree), for pokeysctl moves. If negative, "
		    "the count decreases when the position increases. none: the axis cannot be "
		    "part of a path. LinuxCNC has its own scale for each joint."),
	KEY(DEVICE(axis[0].lead), "axis.#.lead", CONFIG_INTEGER, WORDS_ONLY, .count = POKEYS_AXES,
	    .stride = sizeof(((struct config_raw_device *)0)->axis[0]),
	    .words = WORDS({ "off", 0 }, { "on", 1 }), .fallback = "on",
	    .help = "Position mode. on: while the commanded position moves, the reference "
		    "that is sent to the device is ahead of it by the braking distance "
		    "(the square of the speed, divided by twice max-deceleration). This "
		    "prevents a lag of the same distance. off: the commanded position is sent "
		    "unchanged. Use off if a moving axis runs ahead of its command; the "
		    "device then brakes harder than max-deceleration."),
	KEY(DEVICE(axis[0].name), "axis.#.name", CONFIG_TEXT, .count = POKEYS_AXES,
	    .stride = sizeof(((struct config_raw_device *)0)->axis[0]),
	    .help = "Name of the axis in a file of moves, such as x. If it is not set, the name is "
		    "axis.0 for axis 0."),
	KEY(DEVICE(password_file), "password-file", CONFIG_FILE,
	    .help = "File whose only line is the device's password. It has to be owned by the "
		    "daemon's user, which is pokeys in the installed unit, and readable by nobody "
		    "else (mode 600). The file is read at the start."),

};

enum { OWN = sizeof(own) / sizeof(own[0]) };

/* A key of the device's own settings, as one of this file. */
static void adopt(const struct settings_key *from, struct config_key *to)
{
	bool scalar = from->type == SETTINGS_NUMBER || from->type == SETTINGS_REAL;

	*to = (struct config_key){
		.section = DEVICE(settings),
		.name = from->name,
		.type = CONFIG_SETTING,
		.setting = from,
		.count = from->count,
		.fallback = scalar ? "leave" : NULL,
		.unit = from->unit,
		.help = from->help,
		RANGE(1, 0),
	};
}

const struct config_key *config_key_at(size_t number)
{
	static struct config_key adopted[CONFIG_KEYS_MAX];
	size_t index;

	if (number < OWN)
		return &own[number];
	index = number - OWN;
	if (index < config_loop_key_count)
		return &config_loop_keys[index];
	index -= config_loop_key_count;
	if (index >= settings_key_count || number >= CONFIG_KEYS_MAX)
		return NULL;
	if (!adopted[index].name)
		adopt(&settings_keys[index], &adopted[index]);
	return &adopted[index];
}

size_t config_key_number(const struct config_key *key)
{
	size_t number = 0;

	while (config_key_at(number) != key)
		number++;
	return number;
}
