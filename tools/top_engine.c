// SPDX-License-Identifier: GPL-2.0-or-later
/* What top draws of the pulse engine: a line for each axis, few for all that hangs on them. */
#include <string.h>
#include <pokeys/names.h>
#include "tools/print.h"
#include "tools/top.h"

static void draw_axes(struct screen *screen, const struct pokeys_engine *engine)
{
	if (!engine->axes_enabled)
		return;
	screen_line(screen, "axis    position   reference  state               engine %s%s",
		    pokeys_engine_state_name(engine->state), engine->emergency ? " EMERGENCY" : "");
	for (unsigned int i = 0; i < engine->axes_enabled && i < POKEYS_AXES; i++) {
		const struct pokeys_axis *axis = &engine->axis[i];

		screen_line(screen, "%4u %11d %11d  %-18s %s%s%s%s%s", i, axis->position,
			    axis->reference, pokeys_axis_state_name(axis->state),
			    axis->homed ? " homed" : "", axis->limit_minus ? " LIMIT-" : "",
			    axis->limit_plus ? " LIMIT+" : "", axis->home ? " home-switch" : "",
			    axis->error ? " ERROR" : "");
	}
}

/* Three to a line, and those with faults once more. */
static void draw_drivers(struct screen *screen, const struct view_device *device)
{
	char line[160] = "PoStep", text[40], faults[128];
	unsigned int shown = 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (!print_has_postep(device, i))
			continue;
		if (shown && shown % 3 == 0) {
			screen_line(screen, "%s", line);
			strcpy(line, "      ");
		}
		snprintf(line + strlen(line), sizeof(line) - strlen(line), " %u: %-20s", i,
			 print_postep(&device->state, i, text));
		shown++;
	}
	if (shown)
		screen_line(screen, "%s", line);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (print_has_postep(device, i) && device->state.postep[i].faults)
			screen_line(screen, "PoStep %u FAULT: %s", i,
				    print_postep_faults(&device->state.postep[i], faults));
}

void top_engine(struct screen *screen, const struct view_device *device)
{
	char text[200];

	draw_axes(screen, &device->state.engine);
	draw_drivers(screen, device);
	if (*print_threading(&device->state, text))
		screen_line(screen, "threading %s", text);
}
