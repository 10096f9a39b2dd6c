/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The servo motors of pokeysd.conf. One that is not there has the state "none". */
#include "model/rows.h"

#define SERVO(name_, member_, ...)	\
	EACH_NUMBER("servo.%02u." name_, servo, member_, __VA_ARGS__)
#define MOVES(name_, member_, ...)	NUMBER("moves." name_, moves.member_, __VA_ARGS__)

static const struct model_row rows[] = {
	EACH("servo.%02u.name", MODEL_TEXT, servo, name, "",
	     HELP("name of the motor in pokeysd.conf; empty = there is none")),
	SERVO("state", state, "", WORDS(pokeys_servo_state_name),
	      HELP("0 = no such motor, 1 off, 2 enabled, 3 fault, 4 off, "
		   "but not acknowledged by the device")),
	SERVO("pos-fb", position, ""),
	EACH_AGE("servo.%02u.age-ms", servo, t_ns, MS, HELP("time since the encoder was read")),
	SERVO("vel-fb", velocity, "1/s"),
	SERVO("commanded", commanded, "",
	      HELP("commanded position while it is enabled, else its position, units")),
	SERVO("commanded-velocity", commanded_velocity, "1/s",
	      HELP("commanded velocity, or what was found from the positions, units/s")),
	SERVO("error", error, ""),
	SERVO("output", output, ""),
	SERVO("fault-code", fault, "", WORDS(pokeys_servo_fault_name)),
	SERVO("condition", condition, "", WORDS(pokeys_servo_fault_name)),
	SERVO("obstacle", obstacle, "", WORDS(pokeys_obstacle_name),
	      HELP("why the device is not ready for it; 0 = it is")),
	SERVO("refused", refused, "", WORDS(pokeys_servo_refusal_name)),
	EACH_FLAG("servo.%02u.homed", servo, homed, ""),
	EACH_FLAG("servo.%02u.limit-minus", servo, low, ""),
	EACH_FLAG("servo.%02u.limit-plus", servo, high, ""),
	SERVO("home-state", homing, "", WORDS(pokeys_servo_homing_name),
	      HELP("what the daemon does to find its home switch; 0 = it is not homing")),
	SERVO("home-end", home_end, "", WORDS(pokeys_servo_home_end_name)),
	EACH_FLAG("servo.%02u.home-switch", servo, home, "", HELP("its home switch is pressed")),
	SERVO("faults", fault_count, "", HELP("faults of the motor since the daemon's start")),
	SERVO("encoder", encoder, "", HELP("number of its encoder")),
	SERVO("counts-per-unit", counts_per_unit, "",
	      HELP("counts of the encoder for each unit of the axis")),
	SERVO("min-position", minimum, "", HELP("soft limit, units")),
	SERVO("max-position", maximum, "", HELP("soft limit, units")),
	SERVO("pid-p", p, "", HELP("proportional gain, output for each unit of error")),
	SERVO("pid-i", i, "", HELP("integral gain, output for each unit of error and second")),
	SERVO("pid-d", d, "", HELP("derivative gain, output for each unit/s")),
	SERVO("velocity-gain", velocity_gain, "",
	      HELP("feed-forward, output for each unit/s that is commanded")),
	SERVO("acceleration-gain", acceleration_gain, "",
	      HELP("feed-forward, output for each unit/s^2 that is commanded")),
	MOVES("state", state, "", WORDS(pokeys_moves_state_name),
	      HELP("0 = no path of servo motors, 1 moving, 2 held, 3 aborting, 4 over, and held "
		   "until the commanded positions are there")),
	MOVES("waiting", waiting, "", HELP("moves that wait, with the one under way")),
	MOVES("taken", taken, "", HELP("moves since the daemon's start")),
	MOVES("held", held, "", HELP("1 = the motors wait on the path until they are resumed")),
	MOVES("speed", speed, "1/s", HELP("speed along the path, units/s")),
	MOVES("feed", feed, "", HELP("part of the commanded speeds, 0 to 2")),
	MOVES("end", end, "", WORDS(pokeys_moves_end_name),
	      HELP("how the last path has ended; 0 = there was none, or it has not; 1 = done")),
	MOVES("refusal", refused, "", WORDS(pokeys_moves_refusal_name),
	      HELP("why the last move was not taken; 0 = it was")),
	MOVES("motors", motors, "", HELP("servo motors that are moved, one bit each")),
};

MODEL_GROUP(model_servo, rows);
