/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The pulse engine, its axes, and what the device does by itself.
 *
 * HAL's joints are in machine units, with a scale that only LinuxCNC knows. The rows here are
 * in the device's pulses, called counts as in LinuxCNC's step generators.
 */
#include "model/rows.h"

#define ENGINE(name_, member_, ...)	NUMBER("engine." name_, engine.member_, __VA_ARGS__)
#define ENGINE_FLAG(name_, member_, ...)	FLAG("engine." name_, engine.member_, __VA_ARGS__)
#define AXIS(name_, member_, ...)	\
	EACH_NUMBER("joint.%02u." name_, engine.axis, member_, __VA_ARGS__)
#define AXIS_FLAG(name_, member_, ...)	\
	EACH_FLAG("joint.%02u." name_, engine.axis, member_, __VA_ARGS__)
#define AXIS_BIT(name_, member_, ...)	\
	BITS("joint.%02u." name_, engine.member_, POKEYS_AXES, __VA_ARGS__)
#define TASK(name_, member_, ...)	NUMBER("task." name_, engine.member_, __VA_ARGS__)
#define THREAD(name_, member_, ...)	NUMBER("threading." name_, threading.member_, __VA_ARGS__)
#define THREAD_FLAG(name_, member_)	FLAG("threading." name_, threading.member_, "")

static const struct model_row rows[] = {
	NUMBER("engine-state", engine.state, "", WORDS(pokeys_engine_state_name)),
	FLAG("emergency", engine.emergency, ""),
	ENGINE("axes-enabled", axes_enabled, ""),
	ENGINE_FLAG("activated", activated, ""),
	ENGINE("charge-pump-state", charge_pump, ""),
	ENGINE("generator-state", generator, ""),
	ENGINE("power-states-in-effect", power_states, ""),
	ENGINE("probe-status", probe_status, ""),
	ENGINE("buffer-slots", buffer_slots, ""),
	ENGINE("buffer-level", buffer_level, ""),
	ENGINE("buffer-underruns", buffer_underruns, ""),
	ENGINE("buffer-resyncs", buffer_resyncs, ""),
	ENGINE("slot-us", slot_time, "us", FACTOR(100)),
	ENGINE_FLAG("limit-override-active", limit_override, ""),
	ENGINE_FLAG("emergency-invert-in-effect", emergency_invert, "",
		    HELP("the emergency input is inverted: normally open")),
	ENGINE("emergency-pin-in-effect", emergency_pin, "",
	       HELP("the emergency input: 0 off, 1 default pin, otherwise terminal + 10")),
	BITS("engine.misc.%02u.in", engine.misc_inputs, 8, ""),

	TASK("kind", task, "",
	     HELP("current or last task of the device: 0 none, 1 homing, 2 probing, "
		  "3 hybrid probing, 4 jogging, 5 threading")),
	TASK("phase", task_phase, "",
	     HELP("phase of the task: 0 idle, 1 stopping the engine first, 2 start requested, "
		  "3 working, 4 complete, 5 finishing, 6 stopping")),
	TASK("result", task_result, "", WORDS(pokeys_task_result_name),
	     HELP("result of the last task: 1 done, otherwise the reason")),
	TASK("axes", task_axes, "", HELP("axes of the task, one bit each")),
	TASK("count", task_count, "", HELP("tasks ended since the daemon's start")),

	AXIS("counts", position, "pulses", HELP("position reported by the device")),
	AXIS("counts-cmd", reference, "pulses",
	     HELP("position last sent to the device; in speed mode (mode-in-effect 2) a speed in "
		  "pulses/s")),
	AXIS("counts-error", following_error, "pulses",
	     HELP("commanded position minus counts-delayed minus counts; 0 in speed mode or if not "
		  "driven")),
	AXIS("counts-delayed", delayed, "pulses",
	     HELP("commanded since the time of the reported position, in buffered mode; 0 in other "
		  "modes")),
	AXIS("counts-probed", probe, "pulses", HELP("position at which the probe tripped")),
	EACH_AGE("joint.%02u.age-cmd-us", engine.axis, t_reference_ns, US,
		 HELP("time since counts-cmd was sent")),
	AXIS("max-rate", max_speed, "pulses/s", HELP("highest speed configured in the device")),
	AXIS("max-rate-change", max_acceleration, "pulses/s^2",
	     HELP("acceleration configured in the device")),
	AXIS("soft-min", soft_minimum, "pulses",
	     HELP("soft limit configured in the device; -2147483648 = none")),
	AXIS("soft-max", soft_maximum, "pulses",
	     HELP("soft limit configured in the device; 2147483647 = none")),
	AXIS("pulses-per-unit", pulses_per_unit, "pulses",
	     HELP("scale of the axis for moves of the daemon; 0 = not given")),
	EACH("joint.%02u.name", MODEL_TEXT, engine.axis, name, "",
	     HELP("name of the axis for moves of the daemon")),
	AXIS("mode-in-effect", mode, "",
	     HELP("how the axis is driven: 0 not, 1 positions, 2 speed, 3 motion buffer")),
	AXIS("position-epoch", position_epoch, "",
	     HELP("changes when the device restarts its count; even: position lost, odd: "
		  "position known")),
	AXIS("state", state, "", WORDS(pokeys_axis_state_name)),
	AXIS_FLAG("enabled", enabled, ""),
	AXIS_FLAG("homed", homed, ""),
	AXIS_FLAG("at-counts-cmd", in_position, "",
		  HELP("at rest at counts-cmd, and nothing newer is commanded")),
	AXIS_FLAG("parked", parked, "",
		  HELP("homed or probed: ignores its command until the command equals counts "
		       "or its enable has been false")),
	AXIS_FLAG("error", error, ""),
	AXIS_FLAG("limit-neg", limit_minus, ""),
	AXIS_FLAG("limit-pos", limit_plus, ""),
	AXIS_FLAG("home-sw", home, ""),
	AXIS_FLAG("soft-limit", soft_limit, ""),
	AXIS_BIT("limit-neg-raw", limit_minus, "", HELP("bit of the switch in the raw status")),
	AXIS_BIT("limit-pos-raw", limit_plus, "", HELP("bit of the switch in the raw status")),
	AXIS_BIT("home-raw", home, "", HELP("bit of the switch in the raw status")),
	AXIS_BIT("limit-neg-dedicated", dedicated_limit_minus, ""),
	AXIS_BIT("limit-pos-dedicated", dedicated_limit_plus, ""),
	AXIS_BIT("home-dedicated", dedicated_home, ""),
	AXIS_BIT("probed", probe_status, "",
		 HELP("the axis' bit of the probe status: counts-probed is from the last "
		      "probing")),

	THREAD_FLAG("preparing", preparing),
	THREAD_FLAG("prepared", prepared),
	THREAD_FLAG("waiting", waiting),
	THREAD_FLAG("active", active),
	THREAD("velocity", velocity, ""),
	THREAD("position-error", position_error, ""),
	THREAD("spindle-rpm", spindle_rpm, "rpm"),
	THREAD("index-count", index_count, ""),
	THREAD("behind", behind, ""),
	THREAD("refusal", refused, "", WORDS(pokeys_threading_refusal_name),
	       HELP("why the last threading request was refused; 0 = it was accepted")),
	THREAD("ignored-axes", ignore_axes, "", HELP("axes that do not take part, one bit each")),
};

MODEL_GROUP(model_motion, rows);
