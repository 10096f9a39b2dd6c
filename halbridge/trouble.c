/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Several things may be wrong at once, and one is shown: that which has to be mended
 * first. Without a connection nothing else is known; an emergency stop is often why a
 * driver reports an error.
 */
#include "halbridge/trouble.h"
#include <pokeys/command.h>
#include <pokeys/settings.h>

enum { STOPPED_BY_LIMIT = 100 }; /* engine.state, protocol section 3.24.1 */

static bool any_driver(const struct pokeys_state *state)
{
	bool any = false;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		any |= state->engine.axis[i].mode != POKEYS_AXIS_OFF && state->engine.axis[i].error;
		any |= state->postep[i].faults != 0;
	}
	return any;
}

static bool any_heater(const struct pokeys_state *state)
{
	const struct pokeys_heater *heater = state->heater;

	for (unsigned int i = 0; i < POKEYS_HEATERS && heater[i].state != POKEYS_HEATER_NONE; i++)
		if (heater[i].fault && heater[i].stops_machine)
			return true;
	return false;
}

static bool is_misconfigured(const struct pokeys_state *state)
{
	return state->config_state == POKEYS_CONFIG_REFUSED;
}

static enum trouble_code judge(const struct values *values, const struct pokeys_state *state,
			       bool fresh)
{
	if (!fresh)
		return state->link == POKEYS_LINK_CONFIGURING &&
				       (state->fault == POKEYS_FAULT_CONFIG_REFUSED ||
					state->fault == POKEYS_FAULT_LOCKED) &&
				       values->daemon_alive ?
			       TROUBLE_CONFIGURATION :
			       TROUBLE_COMMUNICATION;
	if (values->emergency_stop || state->engine.emergency)
		return TROUBLE_EMERGENCY;
	if (any_heater(state))
		return TROUBLE_HEATER;
	if (state->engine.state == STOPPED_BY_LIMIT)
		return TROUBLE_LIMIT;
	if (any_driver(state))
		return TROUBLE_DEVICE;
	return is_misconfigured(state) ? TROUBLE_CONFIGURATION : TROUBLE_NONE;
}

void trouble_read(struct trouble *trouble, struct values *values, const struct pokeys_state *state,
		  bool fresh)
{
	const enum trouble_code code = judge(values, state, fresh);

	trouble->connected_once |= fresh;
	if (code && !trouble->active && trouble->connected_once)
		values->error_count++;
	trouble->active = code && trouble->connected_once;
	values->error_code = code;
	values->error_active = code != TROUBLE_NONE;
}
