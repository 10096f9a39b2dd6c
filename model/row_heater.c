/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The heaters of pokeysd.conf. One that is not there has the state "none". */
#include "model/rows.h"

#define HEATER(name_, member_, ...)	\
	EACH_NUMBER("heater.%02u." name_, heater, member_, __VA_ARGS__)

static const struct model_row rows[] = {
	EACH("heater.%02u.name", MODEL_TEXT, heater, name, "",
	     HELP("name of the heater in pokeysd.conf; empty = there is none")),
	HEATER("state", state, "", WORDS(pokeys_heater_state_name),
	       HELP("0 = no such heater, 1 off, 2 heating, 3 tuning, 4 fault, 5 off, but "
		    "not acknowledged by the device")),
	HEATER("temperature", temperature, "deg C"),
	EACH_AGE("heater.%02u.age-ms", heater, t_ns, MS,
		 HELP("time since the temperature was measured")),
	HEATER("target-in-effect", target, "deg C"),
	HEATER("power", power, ""),
	EACH_FLAG("heater.%02u.at-temperature", heater, at_temperature, ""),
	EACH_FLAG("heater.%02u.fault", heater, fault, ""),
	HEATER("fault-code", fault, "", WORDS(pokeys_heater_fault_name)),
	HEATER("condition", condition, "", WORDS(pokeys_heater_fault_name)),
	HEATER("obstacle", obstacle, "", WORDS(pokeys_obstacle_name),
	       HELP("why the device is not ready for it; 0 = it is")),
	HEATER("refused", refused, "", WORDS(pokeys_heater_refusal_name)),
	HEATER("faults", fault_count, "", HELP("faults of the heater since the daemon's start")),
	EACH_FLAG("heater.%02u.power-limited", heater, limited, "",
		  HELP("max-heater-power-w gives it less power than it asks for")),
	HEATER("fan", fan, "", WORDS(pokeys_heater_fan_name),
	       HELP("fan of the heater: 0 = there is none, 1 off, 2 on")),
	EACH_FLAG("heater.%02u.stops-machine", heater, stops_machine, "",
		  HELP("its fault also stops the servo motors of its device (on-fault)")),
	HEATER("min-temperature", minimum, "deg C", HELP("below this, it does not heat")),
	HEATER("max-temperature", maximum, "deg C", HELP("above this, it has a fault")),
	HEATER("max-target", target_maximum, "deg C", HELP("highest target that is accepted")),
	HEATER("pid-p", p, "", HELP("proportional gain, 1/255 of full power for each kelvin")),
	HEATER("pid-i", i, "", HELP("integral gain, 1/255 of full power for each kelvin second")),
	HEATER("pid-d", d, "",
	       HELP("derivative gain, 1/255 of full power for each kelvin a second")),
	HEATER("tuning", tuning, "", WORDS(pokeys_heater_tuning_name),
	       HELP("search for gains: 0 = none yet, 1 runs, 2 done, 3 failed")),
	HEATER("tune-cycles", tune_cycles, "", HELP("oscillations of the last search for gains")),
	HEATER("tuned-p", tuned_p, "", HELP("proportional gain that the last search has found")),
	HEATER("tuned-i", tuned_i, "", HELP("integral gain that the last search has found")),
	HEATER("tuned-d", tuned_d, "", HELP("derivative gain that the last search has found")),
};

MODEL_GROUP(model_heater, rows);
