// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The control thread running proves nothing: the machine hangs on the
 * realtime thread. So a sign of life is given only if that thread has
 * completed a cycle since the last look, a few milliseconds ago. A loop that
 * stands gets no sign, and the first cycle after it stood gives one at once.
 */
#include "daemon/control/watchdog.h"

void watchdog_init(struct watchdog *watchdog, uint64_t limit_ns, uint64_t cycles, uint64_t now_ns)
{
	/* four signs in the time of one: a single late one costs nothing */
	watchdog->interval_ns = limit_ns / 4;
	watchdog->next_ns = now_ns;
	watchdog->cycles = cycles;
}

bool watchdog_due(struct watchdog *watchdog, uint64_t cycles, uint64_t now_ns)
{
	bool advances = cycles != watchdog->cycles;

	watchdog->cycles = cycles;
	if (!watchdog->interval_ns || !advances || now_ns < watchdog->next_ns)
		return false;
	watchdog->next_ns = now_ns + watchdog->interval_ns;
	return true;
}
