// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Commands for the device as a whole, its link, and the simulator. A fault is
 * changed in a copy first, so that "fault both" cannot spoil one direction and
 * then refuse the other.
 */
#include "sim/control_part.h"

#include <string.h>

#include "sim/fault.h"
#include "sim/preset.h"

static bool do_fault(struct sim_order *order)
{
	struct sim_link_faults faults[SIM_LINK_DIRS];
	unsigned int which;

	for (unsigned int dir = 0; dir < SIM_LINK_DIRS; dir++)
		faults[dir] = order->rig->link.way[dir].faults;
	if (!order->word[0]) {
		sim_fault_print(&faults[SIM_LINK_REQUEST], "request.", order->out);
		sim_fault_print(&faults[SIM_LINK_REPLY], "reply.", order->out);
		return true;
	}
	if (!sim_order_choice(order, 0, "direction", "request|reply|both|off", &which))
		return false;
	if (which == 3 && !sim_order_no_more(order, 1))
		return false;
	if (which < 3 && !sim_order_no_more(order, 3))
		return false;
	for (unsigned int dir = 0; dir < SIM_LINK_DIRS; dir++) {
		if (which == 3)
			memset(&faults[dir], 0, sizeof(faults[dir]));
		else if ((which == 2 || which == dir) &&
			 !sim_fault_set(&faults[dir], order->word[1], order->word[2], order->why))
			return false;
	}
	for (unsigned int dir = 0; dir < SIM_LINK_DIRS; dir++)
		sim_link_set_faults(&order->rig->link, (enum sim_link_dir)dir, &faults[dir]);
	return true;
}

static bool do_service(struct sim_order *order)
{
	int64_t us, jitter = 0;

	if (!sim_order_integer(order, 0, "service time in us", 0, 10000000, &us))
		return false;
	if (order->word[1] && (!sim_order_integer(order, 1, "jitter in us", 0, 10000000, &jitter) ||
			       !sim_order_no_more(order, 2)))
		return false;
	order->rig->service_ns = UINT64_C(1000) * (uint64_t)us;
	order->rig->jitter_ns = UINT64_C(1000) * (uint64_t)jitter;
	return true;
}

static bool do_silence(struct sim_order *order)
{
	uint64_t now_ns = order->control->now_ns;
	unsigned int which = 2;
	int64_t ms;

	if (!sim_order_integer(order, 0, "ms", 0, 86400000, &ms))
		return false;
	if (order->word[1] &&
	    (!sim_order_choice(order, 1, "direction", "request|reply|both", &which) ||
	     !sim_order_no_more(order, 2)))
		return false;
	for (unsigned int dir = 0; dir < SIM_LINK_DIRS; dir++) {
		if (which == 2 || which == dir)
			sim_link_silence(&order->rig->link, (enum sim_link_dir)dir, now_ns,
					 now_ns + UINT64_C(1000000) * (uint64_t)ms);
	}
	return true;
}

static bool do_reboot(struct sim_order *order)
{
	const unsigned int usual_ms = order->dev->options.boot_ms;
	int64_t ms = usual_ms;
	unsigned int what = 0;

	if (order->word[0] && !sim_order_choice(order, 0, "what", "keep-config|lose-config", &what))
		return false;
	if (order->word[0] && order->word[1] &&
	    (!sim_order_integer(order, 1, "ms", 0, 600000, &ms) || !sim_order_no_more(order, 2)))
		return false;
	order->dev->options.boot_ms = (unsigned int)ms;
	sim_rig_reboot(order->rig, order->control->now_ns, what == 1);
	order->dev->options.boot_ms = usual_ms;
	return true;
}

static bool do_save(struct sim_order *order)
{
	if (!sim_order_no_more(order, 0))
		return false;
	sim_device_save(order->dev);
	return true;
}

static bool do_preset(struct sim_order *order)
{
	return sim_order_no_more(order, 1) &&
	       sim_preset_apply(order->dev, order->word[0], order->why);
}

static bool do_stray(struct sim_order *order)
{
	int64_t count;

	if (!sim_order_integer(order, 0, "packets", 1, 1000, &count) ||
	    !sim_order_no_more(order, 1))
		return false;
	while (count--) {
		if (!sim_rig_stray(order->rig, order->control->now_ns)) {
			sim_text_add(order->why, "nobody has been answered yet");
			return false;
		}
	}
	return true;
}

static bool do_load(struct sim_order *order)
{
	int64_t percent;

	if (!sim_order_integer(order, 0, "percent", 0, 100, &percent) ||
	    !sim_order_no_more(order, 1))
		return false;
	order->dev->bench.load_percent = (uint8_t)percent;
	return true;
}

static bool do_serial(struct sim_order *order)
{
	int64_t serial;

	if (!sim_order_integer(order, 0, "serial", 1, UINT32_MAX, &serial) ||
	    !sim_order_no_more(order, 1))
		return false;
	order->dev->options.serial = (uint32_t)serial;
	return true;
}

static bool do_firmware(struct sim_order *order)
{
	int64_t major, revision;

	if (!sim_order_integer(order, 0, "version byte", 1, 255, &major) ||
	    !sim_order_integer(order, 1, "revision", 0, 255, &revision) ||
	    !sim_order_no_more(order, 2))
		return false;
	order->dev->options.firmware_major = (uint8_t)major;
	order->dev->options.firmware_revision = (uint8_t)revision;
	return true;
}

static bool do_exit(struct sim_order *order)
{
	if (!sim_order_no_more(order, 0))
		return false;
	order->control->exit = true;
	return true;
}

const struct sim_command sim_commands_system[] = {
	{ "stat", "", "everything counted, one key=value a line", sim_control_stat },
	{ "fault", "[off | request|reply|both NAME VALUE]",
	  "faults of the link, by the names of the options", do_fault },
	{ "service", "US [JITTER_US]", "time the device takes for a request", do_service },
	{ "silence", "MS [request|reply|both]", "nothing passes for so long", do_silence },
	{ "stray", "COUNT", "send the last reply again, so many times", do_stray },
	{ "reboot", "[keep-config|lose-config [MS]]", "power off and on; silent for MS",
	  do_reboot },
	{ "save", "", "save the configuration to flash, as command 0x50", do_save },
	{ "preset", SIM_PRESETS, "put a ready-made machine on the bench", do_preset },
	{ "serial", "N", "become another device", do_serial },
	{ "firmware", "BYTE REVISION", "another firmware, 0x37 15 is 4.7.15", do_firmware },
	{ "load", "PERCENT", "system load", do_load },
	{ "exit", "", "end the simulator", do_exit },
	{ 0 },
};
