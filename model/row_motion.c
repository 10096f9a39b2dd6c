/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The pulse engine, its axes, and what the device does by itself.
 *
 * HAL's joints are in machine units, by a scale that only LinuxCNC has. Here are the
 * device's pulses, called counts as in LinuxCNC's step generators.
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
	       HELP("the emergency input: 0 off, 1 default pin, else terminal + 10")),
	BITS("engine.misc.%02u.in", engine.misc_inputs, 8, ""),

	TASK("kind", task, "",
	     HELP("what the device does, or did last, by itself: 0 nothing, 1 homing, 2 probing, "
		  "3 hybrid probing, 4 jogging, 5 threading")),
	TASK("phase", task_phase, "",
	     HELP("0 idle, 1 engine is being stopped, 2 start requested, 3 working, 4 complete, "
		  "5 finishing, 6 stopping")),
	TASK("result", task_result, "", WORDS(pokeys_task_result_name),
	     HELP("how the last one ended: 1 done, else why not")),
	TASK("axes", task_axes, "", HELP("bits of its axes")),
	TASK("count", task_count, "", HELP("how many have ended since the daemon's start")),

	AXIS("counts", position, "pulses", HELP("position as the device reports")),
	AXIS("counts-cmd", reference, "pulses",
	     HELP("the position last sent to the device; if it is driven by speed, pulses per "
		  "second")),
	AXIS("counts-error", following_error, "pulses",
	     HELP("command less position; 0 unless it is driven by positions")),
	AXIS("counts-probed", probe, "pulses", HELP("where the probe tripped")),
	EACH_AGE("joint.%02u.age-cmd-us", engine.axis, t_reference_ns, US,
		 HELP("time since counts-cmd was sent")),
	AXIS("max-rate", max_speed, "pulses/s", HELP("highest speed, as the device has it")),
	AXIS("max-rate-change", max_acceleration, "pulses/s^2",
	     HELP("acceleration, as the device has it")),
	AXIS("mode-in-effect", mode, "",
	     HELP("what drives it: 0 nothing, 1 positions, 2 speed, 3 the motion buffer")),
	AXIS("position-epoch", position_epoch, "",
	     HELP("changes when the device starts a new count; even: the position is lost, odd: "
		  "it is known")),
	AXIS("state", state, "", WORDS(pokeys_axis_state_name)),
	AXIS_FLAG("enabled", enabled, ""),
	AXIS_FLAG("homed", homed, ""),
	AXIS_FLAG("at-counts-cmd", in_position, "", HELP("stands, and counts is counts-cmd")),
	AXIS_FLAG("parked", parked, "",
		  HELP("homed or probed: follows its command again once that meets counts, or "
		       "its enable has been false")),
	AXIS_FLAG("error", error, ""),
	AXIS_FLAG("limit-neg", limit_minus, ""),
	AXIS_FLAG("limit-pos", limit_plus, ""),
	AXIS_FLAG("home-sw", home, ""),
	AXIS_FLAG("soft-limit", soft_limit, ""),
	AXIS_BIT("limit-neg-raw", limit_minus, "", HELP("the switch's bit of the status")),
	AXIS_BIT("limit-pos-raw", limit_plus, "", HELP("the switch's bit of the status")),
	AXIS_BIT("home-raw", home, "", HELP("the switch's bit of the status")),
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
	       HELP("why the last request was refused, 0 it was not")),
	THREAD("ignored-axes", ignore_axes, "", HELP("bits of the axes that do not take part")),
};

MODEL_GROUP(model_motion, rows);
