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
#include "daemon/control/config_key.h"

#define DAEMON(field) CONFIG_DAEMON, .offset = offsetof(struct config_raw_daemon, field), \
	.size = sizeof(((struct config_raw_daemon *)0)->field)
#define DEVICE(field) CONFIG_DEVICE, .offset = offsetof(struct config_raw_device, field), \
	.size = sizeof(((struct config_raw_device *)0)->field)

#define HEATER(field) CONFIG_HEATER, .offset = offsetof(struct config_raw_heater, field), \
	.size = sizeof(((struct config_raw_heater *)0)->field)

#define SERVO(field) CONFIG_SERVO, .offset = offsetof(struct config_raw_servo, field), \
	.size = sizeof(((struct config_raw_servo *)0)->field)

#define WORDS(...) ((const struct settings_word[]){ __VA_ARGS__, { NULL, 0 } })
#define RANGE(low, high) .minimum = (low), .maximum = (high)
#define WORDS_ONLY RANGE(1, 0)

#define KEY(where, name_, type_, ...) \
	{ .section = where, .name = (name_), .type = (type_), __VA_ARGS__ }

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
			   { "yes", LOOP_PHASE_YES }), .fallback = "auto",
	    .help = "Align the cycle so that fresh data is published just before each read of "
		    "LinuxCNC's servo thread. auto does so if that thread's period is a multiple "
		    "or a part of period-us, within 1 %. yes does the same and writes a warning if "
		    "it is not possible. no does not align the cycle."),
	KEY(DAEMON(duty), "duty", CONFIG_REAL, RANGE(0.1, 1), .fallback = "0.9",
	    .unit = "of a period",
	    .help = "Largest part of each period for which a spinning loop runs: 0.1 to 0.9, or 1 "
		    "if realtime throttling is off (kernel.sched_rt_runtime_us = -1)."),
	KEY(DAEMON(cpu), "cpu", CONFIG_INTEGER, RANGE(0, 1023), .words = WORDS({ "any", -1 }),
	    .fallback = "any",
	    .help = "Core that the realtime thread is pinned to."),
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
	KEY(DAEMON(metrics_interval_ms), "metrics-interval-ms", CONFIG_INTEGER,
	    RANGE(100, 3600000), .fallback = "10000", .unit = "ms",
	    .help = "How often the metrics file is rewritten."),
	KEY(DAEMON(recorder_seconds), "recorder-seconds", CONFIG_INTEGER, RANGE(0, 60),
	    .fallback = "5", .unit = "s",
	    .help = "For how long the latest packets and events are kept in memory for pokeysctl "
		    "record: at least this time, in at most 128 MiB (8 MiB for one device at 1 "
		    "kHz). 0 keeps none."),
	KEY(DAEMON(record_folder), "record-folder", CONFIG_FILE,
	    .help = "Folder to which these packets and events are written at a fault, as a file "
		    "for Wireshark. If not set, the folder that systemd provides is used, "
		    "/var/log/pokeysd; a daemon that is started by hand then writes no files. "
		    "Members of monitor-group may read the files if the folder lets them."),
	KEY(DAEMON(record_files), "record-files", CONFIG_INTEGER, RANGE(0, 1000),
	    .fallback = "20",
	    .help = "How many such files are kept; the oldest are removed. 0 writes none."),
	KEY(DAEMON(record_interval_s), "record-interval-s", CONFIG_INTEGER, RANGE(1, 86400),
	    .fallback = "60", .unit = "s",
	    .help = "At most one such file is written in this time for each reason (lost, "
		    "commander, emergency, limit, transport, late)."),
	KEY(DAEMON(log_level), "log-level", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "error", EVENT_ERROR }, { "warning", EVENT_WARNING },
			   { "notice", EVENT_NOTICE }, { "info", EVENT_INFO },
			   { "debug", EVENT_DEBUG }),
	    .fallback = "info",
	    .help = "Least important message that is written."),

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
	KEY(DEVICE(lost_after_ms), "lost-after-ms", CONFIG_REAL, RANGE(5, 60000),
	    .fallback = "200", .unit = "ms",
	    .help = "If there is no valid reply for longer, the device is lost and the daemon "
		    "searches for it again."),
	KEY(DEVICE(fast_divider), "fast-divider", CONFIG_INTEGER, RANGE(1, 100), .fallback = "1",
	    .unit = "cycles",
	    .help = "Inputs and positions of the device are read in every n-th cycle. For a device "
		    "that cannot answer as fast as the loop runs."),
	KEY(DEVICE(slow_hz), "slow-hz", CONFIG_REAL, RANGE(0.1, 100), .fallback = "5",
	    .unit = "Hz",
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
	    .fallback = "50", .unit = "ms",
	    .help = "Longest deadline of a request."),
	KEY(DEVICE(deadline_initial_ms), "deadline-initial-ms", CONFIG_REAL, RANGE(0.05, 5000),
	    .fallback = "10", .unit = "ms",
	    .help = "Deadline of a request before the first round trip has been measured."),
	KEY(DEVICE(reply_lifetime_ms), "reply-lifetime-ms", CONFIG_REAL, RANGE(1, 5000),
	    .fallback = "500", .unit = "ms",
	    .help = "How late a reply may still arrive. The request number is not used again "
		    "before this time has passed."),
	KEY(DEVICE(retries), "retries", CONFIG_INTEGER, RANGE(0, 20), .fallback = "3",
	    .help = "How often a request that may be repeated is repeated; 0 means never."),
	KEY(DEVICE(window), "window", CONFIG_INTEGER, RANGE(2, 64), .fallback = "8",
	    .unit = "requests",
	    .help = "Largest number of requests in flight at once."),
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
	KEY(DEVICE(password_file), "password-file", CONFIG_FILE,
	    .help = "File whose only line is the device's password. It has to be owned by the "
		    "daemon's user, which is pokeys in the installed unit, and readable by nobody "
		    "else (mode 600). The file is read at the start."),

	KEY(HEATER(device), "device", CONFIG_TEXT,
	    .help = "Name of the device that has the heater's sensor and output. It may be left "
		    "out if there is only one device."),
	KEY(HEATER(sensor_pin), "sensor-pin", CONFIG_INTEGER, RANGE(41, 47),
	    .help = "Terminal of the sensor; the daemon makes it an analog input."),
	KEY(HEATER(sensor), "sensor", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "thermistor", CONFIG_THERMISTOR },
			   { "steinhart-hart", CONFIG_STEINHART }, { "pt100", CONFIG_PT100 },
			   { "pt1000", CONFIG_PT1000 }, { "linear", CONFIG_LINEAR },
			   { "table", CONFIG_SENSOR_TABLE }),
	    .help = "Kind of the sensor. thermistor: by its resistance at one temperature and "
		    "its beta; steinhart-hart: a thermistor by three points; pt100, pt1000: "
		    "platinum, IEC 60751; linear: an amplifier whose voltage changes linearly "
		    "with the temperature; table: points, with linear interpolation. A "
		    "thermistor, pt100 or pt1000 is connected between the terminal and ground."),
	KEY(HEATER(ohm), "thermistor-ohm", CONFIG_REAL, RANGE(1, 1e8), .fallback = "100000",
	    .unit = "ohm", .help = "Resistance of the thermistor at thermistor-celsius."),
	KEY(HEATER(ohm_at), "thermistor-celsius", CONFIG_REAL, RANGE(-50, 500), .fallback = "25",
	    .unit = "C", .help = "Temperature at which it has that resistance."),
	KEY(HEATER(beta), "thermistor-beta", CONFIG_REAL, RANGE(500, 10000), .fallback = "3950",
	    .unit = "K", .help = "Beta of the thermistor, from its data sheet."),
	KEY(HEATER(points), "sensor-points", CONFIG_POINTS,
	    .help = "Points of steinhart-hart (three) or table (two or more): temperature in C, "
		    "a colon, and the resistance in ohm. For a table with pull-up-ohm = 0, give "
		    "the voltage instead of the resistance, measured where reference-v is."),
	KEY(HEATER(pull_up), "pull-up-ohm", CONFIG_REAL, RANGE(0, 1e7), .fallback = "4700",
	    .unit = "ohm",
	    .help = "Resistor between the sensor's terminal and the reference of the device's "
		    "analog inputs (3.3 V)."),
	KEY(HEATER(reference), "reference-v", CONFIG_REAL, RANGE(0.1, 50), .fallback = "3.3",
	    .unit = "V",
	    .help = "For linear and for a table of voltages: voltage at which the analog input "
		    "has its highest reading. With a voltage divider before the terminal, give "
		    "the voltage before the divider."),
	KEY(HEATER(volts_at_0), "volts-at-0", CONFIG_REAL, RANGE(-50, 50), .fallback = "0",
	    .unit = "V", .help = "Voltage of a linear sensor at 0 C."),
	KEY(HEATER(volts_per_kelvin), "volts-per-kelvin", CONFIG_REAL, RANGE(-10, 10),
	    .fallback = "0.01", .unit = "V/K",
	    .help = "By how much that voltage changes with each kelvin."),
	KEY(HEATER(pwm), "pwm", CONFIG_INTEGER, RANGE(0, POKEYS_PWM - 1),
	    .words = WORDS({ "none", -1 }), .fallback = "none",
	    .help = "PWM output that drives the heater; 0 to 5 are pwm.00 to pwm.05 in HAL. The "
		    "device needs pwm-period, which applies to all its PWM outputs."),
	KEY(HEATER(output_pin), "output-pin", CONFIG_INTEGER, RANGE(1, POKEYS_PINS),
	    .words = WORDS({ "none", 0 }), .fallback = "none",
	    .help = "Terminal that switches the heater, instead of a PWM output. The daemon "
		    "makes it a digital output. Use it for a relay, for example."),
	KEY(HEATER(least_s), "min-switch-s", CONFIG_REAL, RANGE(0.1, 3600), .fallback = "1",
	    .unit = "s",
	    .help = "With output-pin: minimum time for which the output stays on or off. When "
		    "the heater is switched off by a fault, by command or otherwise, the output "
		    "is off at once."),
	KEY(HEATER(watts), "rated-power-w", CONFIG_REAL, RANGE(0.1, 100000),
	    .words = WORDS({ "unknown", 0 }), .fallback = "unknown", .unit = "W",
	    .help = "Electrical power of the heater when its output is fully on. It is needed if "
		    "its device has max-heater-power-w."),
	KEY(HEATER(fan_pwm), "fan-pwm", CONFIG_INTEGER, RANGE(0, POKEYS_PWM - 1),
	    .words = WORDS({ "none", -1 }), .fallback = "none",
	    .help = "PWM output of a fan that cools the heater's surroundings, such as the cold "
		    "end of a hot end. The fan runs while the heater is hotter than fan-above, "
		    "also while it is off or has a fault, and while its temperature is not "
		    "known. No commander can switch it."),
	KEY(HEATER(fan_pin), "fan-pin", CONFIG_INTEGER, RANGE(1, POKEYS_PINS),
	    .words = WORDS({ "none", 0 }), .fallback = "none",
	    .help = "Terminal that switches such a fan, instead of fan-pwm. The daemon makes it "
		    "a digital output."),
	KEY(HEATER(fan_above), "fan-above", CONFIG_REAL, RANGE(0, 2000), .fallback = "50",
	    .unit = "C", .help = "Temperature of the heater above which its fan runs."),
	KEY(HEATER(fan_hysteresis), "fan-hysteresis", CONFIG_REAL, RANGE(0.1, 100),
	    .fallback = "5", .unit = "K",
	    .help = "The fan stops when the heater is colder than fan-above by this."),
	KEY(HEATER(fan_speed), "fan-speed", CONFIG_REAL, RANGE(0.01, 1), .fallback = "1",
	    .help = "Duty of fan-pwm while the fan runs; 1 is full speed."),
	KEY(HEATER(law), "control", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "pid", HEATER_PID }, { "bang-bang", HEATER_BANG_BANG }),
	    .fallback = "pid",
	    .help = "pid: the power is controlled continuously. bang-bang: max-power is on when "
		    "the temperature is hysteresis below the target, and off when it is "
		    "hysteresis above it."),
	KEY(HEATER(p), "pid-p", CONFIG_REAL, RANGE(0, 100000), .fallback = "22.2",
	    .help = "Proportional gain, in units of 1/255 of full power for each kelvin, as "
		    "Marlin and Klipper have it."),
	KEY(HEATER(i), "pid-i", CONFIG_REAL, RANGE(0, 100000), .fallback = "1.08",
	    .help = "Integral gain, in the same units for each kelvin and second."),
	KEY(HEATER(d), "pid-d", CONFIG_REAL, RANGE(0, 100000), .fallback = "114",
	    .help = "Derivative gain, in the same units for each kelvin a second. It acts on the "
		    "temperature and not on the target."),
	KEY(HEATER(smooth_s), "pid-smooth-s", CONFIG_REAL, RANGE(0, 60), .fallback = "0.5",
	    .unit = "s", .help = "Time constant of the derivative's filter."),
	KEY(HEATER(hysteresis), "hysteresis", CONFIG_REAL, RANGE(0.05, 40), .fallback = "1",
	    .unit = "K",
	    .help = "For control = bang-bang: distance from the target at which the output "
		    "switches. It has to be below watch-slack."),
	KEY(HEATER(least), "min-temperature", CONFIG_REAL, RANGE(-250, 2000), .fallback = "5",
	    .unit = "C",
	    .help = "A lower temperature is a fault while the heater heats, and prevents it "
		    "from being switched on."),
	KEY(HEATER(most), "max-temperature", CONFIG_REAL, RANGE(-200, 2000), .unit = "C",
	    .help = "A higher temperature is a fault, also while the heater is off."),
	KEY(HEATER(target_most), "max-target", CONFIG_REAL, RANGE(1, 2000), .unit = "C",
	    .words = WORDS({ "auto", CONFIG_TARGET_AUTO }), .fallback = "auto",
	    .help = "A higher target is refused. auto: 15 K below max-temperature."),
	KEY(HEATER(power_most), "max-power", CONFIG_REAL, RANGE(0.01, 1), .fallback = "1",
	    .help = "Highest power; 1 is full power."),
	KEY(HEATER(rate_most), "max-rate", CONFIG_REAL, RANGE(0.01, 200), .fallback = "20",
	    .unit = "K/s",
	    .help = "A temperature that changes faster is a fault: the sensor is assumed to be "
		    "defective."),
	KEY(HEATER(stale_ms), "max-age-ms", CONFIG_REAL, RANGE(100, 2000), .fallback = "300",
	    .unit = "ms", .help = "A reading that is older is a fault while it heats."),
	KEY(HEATER(window_s), "watch-window-s", CONFIG_REAL, RANGE(1, 600), .fallback = "40",
	    .unit = "s",
	    .help = "In this time the temperature has to rise by watch-rise while the heater is "
		    "further below its target than watch-slack."),
	KEY(HEATER(rise), "watch-rise", CONFIG_REAL, RANGE(0.5, 20), .fallback = "1", .unit = "K",
	    .help = "See watch-window-s."),
	KEY(HEATER(slack), "watch-slack", CONFIG_REAL, RANGE(1, 50), .fallback = "4", .unit = "K",
	    .help = "A heater that was within this distance of its target, and is now further "
		    "below it, has to rise by watch-rise in watch-window-s."),
	KEY(HEATER(within), "at-temperature-k", CONFIG_REAL, RANGE(0.1, 100), .fallback = "2",
	    .unit = "K",
	    .help = "The heater is reported as at its temperature if it is within this distance "
		    "of its target."),
	KEY(HEATER(hold_s), "hold-s", CONFIG_REAL, RANGE(0, 86400), .words = WORDS({ "ever", -1 }),
	    .fallback = "0", .unit = "s",
	    .help = "Time for which the heater continues to heat after its commander is gone "
		    "(see heartbeat-timeout-ms), for example for a kiln. ever: it heats until a "
		    "target of 0 is commanded."),
	KEY(HEATER(stops_machine), "on-fault", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "heater", 0 }, { "machine", 1 }), .fallback = "heater",
	    .help = "What a fault of the heater stops. heater: this heater only. machine: the "
		    "fault also stops all servo motors of its device. error-code in LinuxCNC is "
		    "6 until the heater is reset; then each motor has to be reset as well."),
	KEY(HEATER(without_failsafe), "without-failsafe", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "no", 0 }, { "yes", 1 }), .fallback = "no",
	    .help = "no: the heater is used only while the device's own failsafe is set up to "
		    "switch its output off. yes: the heater is used without this failsafe, and "
		    "its output may stay on if this computer fails."),

	KEY(SERVO(device), "device", CONFIG_TEXT,
	    .help = "Name of the device that has the motor's encoder and outputs. It may be left "
		    "out if there is only one device."),
	KEY(SERVO(encoder), "encoder", CONFIG_INTEGER, RANGE(0, POKEYS_ENCODERS - 1),
	    .help = "Encoder of the motor, as in HAL (encoder.00 is 0). It has to be set up in "
		    "[device NAME] or in the device, with four counts for each cycle (4x) if "
		    "possible."),
	KEY(SERVO(scale), "counts-per-unit", CONFIG_REAL, RANGE(-1e7, 1e7),
	    .help = "Counts of the encoder for each unit of the axis (mm or degree). Below 0: "
		    "the position grows while the encoder counts down."),
	KEY(SERVO(drive), "drive", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "sign-magnitude", DRIVE_SIGN }, { "antiphase", DRIVE_ANTIPHASE },
			   { "two-pwm", DRIVE_TWO_PWM }),
	    .fallback = "sign-magnitude",
	    .help = "What the motor's amplifier expects. sign-magnitude: pwm and direction-pin. "
		    "antiphase: pwm, whose duty of 50 % is standstill, and enable-pin. two-pwm: "
		    "pwm for one direction and reverse-pwm for the other."),
	KEY(SERVO(pwm), "pwm", CONFIG_INTEGER, RANGE(0, POKEYS_PWM - 1),
	    .words = WORDS({ "none", -1 }), .fallback = "none",
	    .help = "PWM output to the amplifier; 0 to 5 are pwm.00 to pwm.05 in HAL. The device "
		    "needs pwm-period, which applies to all its PWM outputs; 1250 is 20 kHz."),
	KEY(SERVO(reverse_pwm), "reverse-pwm", CONFIG_INTEGER, RANGE(0, POKEYS_PWM - 1),
	    .words = WORDS({ "none", -1 }), .fallback = "none",
	    .help = "With drive = two-pwm, which needs it: PWM output for the other direction."),
	KEY(SERVO(direction_pin), "direction-pin", CONFIG_INTEGER, RANGE(1, POKEYS_PINS),
	    .words = WORDS({ "none", 0 }), .fallback = "none",
	    .help = "With drive = sign-magnitude, which needs it: terminal of the direction; on "
		    "is the direction in which the position shrinks (grows, with invert-output = "
		    "yes). The daemon makes it a digital output."),
	KEY(SERVO(enable_pin), "enable-pin", CONFIG_INTEGER, RANGE(1, POKEYS_PINS),
	    .words = WORDS({ "none", 0 }), .fallback = "none",
	    .help = "Terminal that enables the amplifier while the motor is controlled; drive = "
		    "antiphase needs it. The daemon makes it a digital output."),
	KEY(SERVO(invert_output), "invert-output", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "no", 0 }, { "yes", 1 }), .fallback = "no",
	    .help = "yes: exchanges the two directions, as exchanging the motor's wires does."),
	KEY(SERVO(dwell_ms), "dwell-ms", CONFIG_REAL, RANGE(0, 100), .fallback = "0",
	    .unit = "ms",
	    .help = "With drive = sign-magnitude: time for which PWM is off before and after a "
		    "change of direction, in addition to the time until the device has "
		    "acknowledged the change. For a relay, or an amplifier that needs it."),
	KEY(SERVO(limit_minus_pin), "limit-minus-pin", CONFIG_INTEGER, RANGE(1, POKEYS_PINS),
	    .words = WORDS({ "none", 0 }), .fallback = "none",
	    .help = "Terminal of the limit switch at the lower end. The daemon makes it a "
		    "digital input."),
	KEY(SERVO(limit_plus_pin), "limit-plus-pin", CONFIG_INTEGER, RANGE(1, POKEYS_PINS),
	    .words = WORDS({ "none", 0 }), .fallback = "none",
	    .help = "Terminal of the limit switch at the upper end."),
	KEY(SERVO(limit_minus_invert), "limit-minus-invert", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "off", 0 }, { "on", 1 }), .fallback = "off",
	    .help = "off: the switch is pressed while its terminal is high, as with a switch to "
		    "ground that opens when it is pressed; a broken wire then counts as pressed. "
		    "on: the switch is pressed while its terminal is low, as with a switch to "
		    "ground that closes when it is pressed; a broken wire is not detected."),
	KEY(SERVO(limit_plus_invert), "limit-plus-invert", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "off", 0 }, { "on", 1 }), .fallback = "off",
	    .help = "The same for the switch at the upper end."),
	KEY(SERVO(home_search), "home-search-speed", CONFIG_REAL, RANGE(-1e6, 1e6),
	    .words = WORDS({ "none", 0 }), .fallback = "none", .unit = "units/s",
	    .help = "Speed of the search for the home switch; below 0: the switch is at the lower "
		    "end. With it the daemon can home the axis (home of pokeysctl servo). LinuxCNC "
		    "homes its joints itself, and does not need it."),
	KEY(SERVO(home_pin), "home-pin", CONFIG_INTEGER, RANGE(1, POKEYS_PINS),
	    .words = WORDS({ "none", 0 }), .fallback = "none",
	    .help = "Terminal of the home switch. The daemon makes it a digital input. none: the "
		    "limit switch in the direction of the search is the home switch. This limit "
		    "switch does not stop the motor during homing; the other one does."),
	KEY(SERVO(home_invert), "home-invert", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "off", 0 }, { "on", 1 }), .fallback = "off",
	    .help = "off: the home switch is pressed while its terminal is high. on: it is "
		    "pressed while its terminal is low. The switch has to stay pressed while the "
		    "axis moves past it and stops."),
	KEY(SERVO(home_latch), "home-latch-speed", CONFIG_REAL, RANGE(1e-6, 1e6),
	    .words = WORDS({ "auto", CONFIG_SERVO_AUTO }), .fallback = "auto", .unit = "units/s",
	    .help = "Speed of the second, slow approach, on which the daemon measures the "
		    "position where the switch closes. auto: a tenth of home-search-speed."),
	KEY(SERVO(home_acceleration), "home-acceleration", CONFIG_REAL, RANGE(1e-6, 1e9),
	    .words = WORDS({ "auto", CONFIG_SERVO_AUTO }), .fallback = "auto",
	    .unit = "units/s^2",
	    .help = "Acceleration while the axis is homing. The axis moves past the switch by "
		    "the distance that it needs to stop. auto: the speed of the search is reached "
		    "in 0.1 s."),
	KEY(SERVO(home_offset), "home-offset", CONFIG_REAL, RANGE(-1e9, 1e9), .fallback = "0",
	    .unit = "units",
	    .help = "Position of the axis where the home switch closes."),
	KEY(SERVO(home_position), "home-position", CONFIG_REAL, RANGE(-1e9, 1e9),
	    .fallback = "0", .unit = "units",
	    .help = "Position to which the axis moves at the end, from min-position to "
		    "max-position. If the home switch is a limit switch, it has to be at least "
		    "min-following-error off the switch."),
	KEY(SERVO(home_distance), "home-distance", CONFIG_REAL, RANGE(1e-6, 1e9),
	    .words = WORDS({ "auto", CONFIG_SERVO_AUTO }), .fallback = "auto", .unit = "units",
	    .help = "Longest distance of the search, and of each movement off the switch. After "
		    "it, homing has failed, and the axis decelerates to a stop. auto: 1.1 times "
		    "the distance from min-position to max-position, both of which then have to "
		    "be given."),
	KEY(SERVO(least), "min-position", CONFIG_REAL, RANGE(-1e9, 1e9),
	    .words = WORDS({ "none", -CONFIG_UNLIMITED }), .fallback = "none", .unit = "units",
	    .help = "Soft limit, in effect once the axis is homed."),
	KEY(SERVO(most), "max-position", CONFIG_REAL, RANGE(-1e9, 1e9),
	    .words = WORDS({ "none", CONFIG_UNLIMITED }), .fallback = "none", .unit = "units",
	    .help = "The same at the upper end."),
	KEY(SERVO(speed_most), "max-speed", CONFIG_REAL, RANGE(1e-6, 1e6), .unit = "units/s",
	    .help = "Highest speed of the axis. At this speed max-following-error applies."),
	KEY(SERVO(speed_jump), "impossible-speed", CONFIG_REAL, RANGE(1e-6, 1e7),
	    .words = WORDS({ "auto", CONFIG_SERVO_AUTO }), .fallback = "auto", .unit = "units/s",
	    .help = "Speed that the axis cannot reach. If the encoder counts faster, this is a "
		    "fault of the encoder. auto: three times max-speed."),
	KEY(SERVO(p), "pid-p", CONFIG_REAL, RANGE(0, 1e6),
	    .help = "Proportional gain: part of the full voltage for each unit of error."),
	KEY(SERVO(i), "pid-i", CONFIG_REAL, RANGE(0, 1e6), .fallback = "0",
	    .help = "Integral gain, for each unit of error and second."),
	KEY(SERVO(d), "pid-d", CONFIG_REAL, RANGE(0, 1e6), .fallback = "0",
	    .help = "Derivative gain, for each unit/s by which the axis is slower than "
		    "commanded."),
	KEY(SERVO(velocity), "velocity-gain", CONFIG_REAL, RANGE(0, 1e6), .fallback = "0",
	    .help = "Feed-forward (FF1 in LinuxCNC): part of the full voltage for each unit/s "
		    "that is commanded."),
	KEY(SERVO(acceleration), "acceleration-gain", CONFIG_REAL, RANGE(0, 1e6), .fallback = "0",
	    .help = "Feed-forward (FF2 in LinuxCNC) for each unit/s² that is commanded."),
	KEY(SERVO(deadband), "deadband", CONFIG_REAL, RANGE(0, 1e6), .fallback = "0",
	    .unit = "units",
	    .help = "An error up to this is treated as 0. An error of one count always is."),
	KEY(SERVO(integral_most), "max-integral", CONFIG_REAL, RANGE(0, 1),
	    .words = WORDS({ "auto", CONFIG_SERVO_AUTO }), .fallback = "auto",
	    .help = "Highest output of the integral part. auto: half of max-output."),
	KEY(SERVO(output_most), "max-output", CONFIG_REAL, RANGE(0.01, 1), .fallback = "1",
	    .help = "Highest output; 1 is the full voltage."),
	KEY(SERVO(smooth_s), "smooth-s", CONFIG_REAL, RANGE(0, 1), .fallback = "0.002",
	    .unit = "s", .help = "Time constant of the filter for measured speeds."),
	KEY(SERVO(follow_least), "min-following-error", CONFIG_REAL, RANGE(1e-6, 1e6),
	    .fallback = "0.5", .unit = "units",
	    .help = "A larger error is a fault while the axis stands. The axis can be enabled "
		    "only within this distance of the commanded position."),
	KEY(SERVO(follow_most), "max-following-error", CONFIG_REAL, RANGE(1e-6, 1e6),
	    .fallback = "2", .unit = "units",
	    .help = "Largest error at max-speed. At a lower commanded speed the limit is "
		    "proportionally smaller, but at least min-following-error."),
	KEY(SERVO(stall_output), "stall-output", CONFIG_REAL, RANGE(0.01, 1),
	    .words = WORDS({ "auto", CONFIG_SERVO_AUTO }), .fallback = "auto",
	    .help = "The axis is stalled if the output is this high or higher for stall-s and "
		    "the axis moves less than stall-distance. auto: 0.9 of max-output."),
	KEY(SERVO(stall_move), "stall-distance", CONFIG_REAL, RANGE(1e-6, 1e6), .fallback = "0.1",
	    .unit = "units", .help = "See stall-output."),
	KEY(SERVO(stall_s), "stall-s", CONFIG_REAL, RANGE(0.01, 10), .fallback = "0.3",
	    .unit = "s", .help = "See stall-output."),
	KEY(SERVO(silent_output), "silent-output", CONFIG_REAL, RANGE(0.01, 1),
	    .fallback = "0.2",
	    .help = "The output may change by this much while the encoder does not count. The "
		    "part of a change above it, multiplied by its duration, is compared with "
		    "silent-s."),
	KEY(SERVO(silent_s), "silent-s", CONFIG_REAL, RANGE(0.001, 1), .fallback = "0.02",
	    .unit = "s",
	    .help = "Delay of the fault if the change exceeds silent-output by 1, the full "
		    "voltage. A smaller excess takes longer in proportion: one of 0.1 takes ten "
		    "times as long."),
	KEY(SERVO(runaway_output), "runaway-output", CONFIG_REAL, RANGE(0, 1), .fallback = "0.1",
	    .help = "It is a fault if the output is higher than this and the axis moves against "
		    "it, getting faster, for more than runaway-distance. The usual cause is an "
		    "encoder or a motor that is connected in reverse."),
	KEY(SERVO(runaway_move), "runaway-distance", CONFIG_REAL, RANGE(1e-6, 1e6),
	    .fallback = "0.2", .unit = "units", .help = "See runaway-output."),
	KEY(SERVO(stale_ms), "max-age-ms", CONFIG_REAL, RANGE(1, 100), .fallback = "10",
	    .unit = "ms",
	    .help = "It is a fault if the last reading of the encoder is older than this."),
	KEY(SERVO(without_failsafe), "without-failsafe", CONFIG_INTEGER, WORDS_ONLY,
	    .words = WORDS({ "no", 0 }, { "yes", 1 }), .fallback = "no",
	    .help = "no: the motor is controlled only while the device's own failsafe is set up "
		    "to switch it off. yes: it is controlled without this failsafe, and may keep "
		    "running if this computer fails."),
};

enum { OWN = sizeof(own) / sizeof(own[0]) };

/* A key of the device's own settings, as one of this file. */
static void adopt(const struct settings_key *from, struct config_key *to)
{
	bool scalar = from->type == SETTINGS_NUMBER || from->type == SETTINGS_REAL;

	*to = (struct config_key){
		.section = DEVICE(settings), .name = from->name, .type = CONFIG_SETTING,
		.setting = from,
		.count = from->count, .fallback = scalar ? "leave" : NULL, .unit = from->unit,
		.help = from->help, RANGE(1, 0),
	};
}

const struct config_key *config_key_at(size_t number)
{
	static struct config_key adopted[CONFIG_KEYS_MAX];
	size_t index = number - OWN;

	if (number < OWN)
		return &own[number];
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
