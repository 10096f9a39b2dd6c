// SPDX-License-Identifier: GPL-2.0-or-later
/* pokeysctl axis, from the command line to its exit status. */
#include "tools/axis.h"
#include "tools/commander.h"

int command_axis(const struct options *options)
{
	static struct axis axis;
	struct axis_order wanted;
	int status;

	if (!axis_take(options, &wanted))
		return STATUS_USAGE;
	axis.device = options->names[0];
	axis.number = wanted.axis;
	axis.speed = options->speed;
	axis.client = commander_open(options, axis.device, &axis.state, &status);
	if (!axis.client)
		return status;
	axis.command.session = commander_session();
	status = axis_run(&axis, &wanted) ? STATUS_OK : STATUS_FAILED;
	pokeys_client_close(axis.client);
	return status;
}
