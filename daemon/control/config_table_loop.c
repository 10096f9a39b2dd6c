// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The keys of the closed loops, [heater NAME] and [servo NAME]: a part of the table of all keys
 * (config_table.c), which says how they are written.
 */
#include "daemon/control/config_row.h"

const struct config_key config_loop_keys[] = {
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
	    .unit = "(terminals 22 to 17)", .words = WORDS({ "none", -1 }), .fallback = "none",
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
	    .unit = "(terminals 22 to 17)", .words = WORDS({ "none", -1 }), .fallback = "none",
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
	KEY(HEATER(fan_hysteresis), "fan-hysteresis", CONFIG_REAL, RANGE(0.1, 100), .fallback = "5",
	    .unit = "K", .help = "The fan stops when the heater is colder than fan-above by this."),
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
		    "(see heartbeat-timeout-ms), for example for a kiln. Another commander can "
		    "only switch it off meanwhile. ever: it heats until a target of 0 is "
		    "commanded."),
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
	    .unit = "(terminals 22 to 17)", .words = WORDS({ "none", -1 }), .fallback = "none",
	    .help = "PWM output to the amplifier; 0 to 5 are pwm.00 to pwm.05 in HAL. The device "
		    "needs pwm-period, which applies to all its PWM outputs; 1250 is 20 kHz."),
	KEY(SERVO(reverse_pwm), "reverse-pwm", CONFIG_INTEGER, RANGE(0, POKEYS_PWM - 1),
	    .unit = "(terminals 22 to 17)", .words = WORDS({ "none", -1 }), .fallback = "none",
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
	KEY(SERVO(dwell_ms), "dwell-ms", CONFIG_REAL, RANGE(0, 100), .fallback = "0", .unit = "ms",
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
	    .words = WORDS({ "auto", CONFIG_SERVO_AUTO }), .fallback = "auto", .unit = "units/s^2",
	    .help = "Acceleration while the axis is homing. The axis moves past the switch by "
		    "the distance that it needs to stop. auto: the speed of the search is reached "
		    "in 0.1 s."),
	KEY(SERVO(home_offset), "home-offset", CONFIG_REAL, RANGE(-1e9, 1e9), .fallback = "0",
	    .unit = "units", .help = "Position of the axis where the home switch closes."),
	KEY(SERVO(home_position), "home-position", CONFIG_REAL, RANGE(-1e9, 1e9), .fallback = "0",
	    .unit = "units",
	    .help = "Position to which the axis moves at the end, from min-position to "
		    "max-position, and at most home-distance from home-offset. If the home switch "
		    "is a limit switch, it has to be at least min-following-error off the switch."),
	KEY(SERVO(home_distance), "home-distance", CONFIG_REAL, RANGE(1e-6, 1e9),
	    .words = WORDS({ "auto", CONFIG_SERVO_AUTO }), .fallback = "auto", .unit = "units",
	    .help = "Longest distance of the search, and of each movement off the switch. If the "
		    "axis moves further, homing fails, and the axis decelerates to a stop. The "
		    "distance has to be at least the square of home-search-speed, divided by "
		    "home-acceleration. auto: 1.1 times the distance from min-position to "
		    "max-position, both of which then have to be given."),
	KEY(SERVO(least), "min-position", CONFIG_REAL, RANGE(-1e9, 1e9),
	    .words = WORDS({ "none", -CONFIG_UNLIMITED }), .fallback = "none", .unit = "units",
	    .help = "Soft limit, in effect once the axis is homed."),
	KEY(SERVO(most), "max-position", CONFIG_REAL, RANGE(-1e9, 1e9),
	    .words = WORDS({ "none", CONFIG_UNLIMITED }), .fallback = "none", .unit = "units",
	    .help = "The same at the upper end."),
	KEY(SERVO(speed_most), "max-speed", CONFIG_REAL, RANGE(1e-6, 1e6), .unit = "units/s",
	    .help = "Highest speed of the axis. At this speed max-following-error applies."),
	KEY(SERVO(acceleration_most), "max-acceleration", CONFIG_REAL, RANGE(1e-6, 1e9),
	    .words = WORDS({ "auto", CONFIG_SERVO_AUTO }), .fallback = "auto", .unit = "units/s^2",
	    .help = "Highest acceleration of the axis on a path (moves of pokeysctl). auto: "
		    "max-speed is reached in 0.2 s."),
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
	KEY(SERVO(smooth_s), "smooth-s", CONFIG_REAL, RANGE(0, 1), .fallback = "0.002", .unit = "s",
	    .help = "Time constant of the filter for measured speeds."),
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
	KEY(SERVO(stall_s), "stall-s", CONFIG_REAL, RANGE(0.01, 10), .fallback = "0.3", .unit = "s",
	    .help = "See stall-output."),
	KEY(SERVO(silent_output), "silent-output", CONFIG_REAL, RANGE(0.01, 1), .fallback = "0.2",
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

const size_t config_loop_key_count = sizeof(config_loop_keys) / sizeof(config_loop_keys[0]);
