/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Other parts of the pulse engine: backlash compensation and PoStep drivers. */
#include "model/rows.h"

#define DRIVER(name_, member_, ...)	\
	EACH_NUMBER("joint.%02u.postep." name_, postep, member_, __VA_ARGS__)

static const struct model_row rows[] = {
	NUMBERS("joint.%02u.backlash-taken", backlash, POKEYS_AXES, "pulses"),
	DRIVER("supply", supply, "V", FACTOR(0.25)),
	DRIVER("temperature", temperature, "deg C"),
	DRIVER("state", state, "", WORDS(pokeys_postep_state_name)),
	EACH_FLAG("joint.%02u.postep.fault", postep, faults, ""),
	DRIVER("faults", faults, ""),
	DRIVER("inputs", inputs, ""),
	DRIVER("updates", update_count, ""),
	EACH_AGE("joint.%02u.postep.age-ms", postep, t_update_ns, MS,
		 HELP("PoStep driver: time since its last observed answer")),
	DRIVER("mode", mode, "",
	       HELP("PoStep driver: 1 external, 2 step, 3 DC motor, 4 position, 5 BINx")),
	DRIVER("step-mode-in-effect", step_mode, "",
	       HELP("PoStep driver: 0 full steps, 1 half steps, 2 quarter steps .. 8 1/256 steps")),
	DRIVER("temperature-limit-in-effect", temperature_limit, "deg C",
	       HELP("PoStep driver: switches off above this temperature")),
	DRIVER("current-raw", full_scale, ""),
	DRIVER("current-idle-raw", idle, ""),
	DRIVER("current-overheat-raw", overheat, ""),
	DRIVER("hardware-major", hardware_major, "",
	       HELP("PoStep driver: version of its hardware")),
	DRIVER("hardware-minor", hardware_minor, "",
	       HELP("PoStep driver: version of its hardware")),
	DRIVER("firmware-major", firmware_major, "",
	       HELP("PoStep driver: version of its firmware")),
	DRIVER("firmware-minor", firmware_minor, "",
	       HELP("PoStep driver: version of its firmware")),
};

MODEL_GROUP(model_drive, rows);
