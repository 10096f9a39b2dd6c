// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The control thread running proves nothing: the machine hangs on the
 * realtime thread. So a sign of life is given only if that thread has
 * completed a cycle since the last look, a few milliseconds ago. A loop that
 * stands gets no sign, and the first cycle after it stood gives one at once.
 *
 * It is given by a thread that does nothing else. The control thread reads and writes
 * files, and a disk may hang for seconds; a daemon that is killed for that in the middle
 * of a cut does more harm than metrics that are late.
 */
#include <time.h>
#include "daemon/control/clock.h"
#include "daemon/control/notify.h"
#include "daemon/control/thread.h"
#include "daemon/control/watchdog.h"

enum { ROUND_MS = 20 };

void watchdog_init(struct watchdog *watchdog, uint64_t limit_ns, uint64_t cycles, uint64_t now_ns)
{
	/* four signs in the time of one: a single late one costs nothing */
	watchdog->interval_ns = limit_ns / 4;
	watchdog->next_ns = now_ns;
	watchdog->seen = cycles;
}

bool watchdog_due(struct watchdog *watchdog, uint64_t cycles, uint64_t now_ns)
{
	bool advances = cycles != watchdog->seen;

	watchdog->seen = cycles;
	if (!watchdog->interval_ns || !advances || now_ns < watchdog->next_ns)
		return false;
	watchdog->next_ns = now_ns + watchdog->interval_ns;
	return true;
}

static void *run(void *argument)
{
	static const struct timespec nap = { .tv_nsec = ROUND_MS * 1000000 };
	struct watchdog *watchdog = argument;

	while (!atomic_load(&watchdog->stop)) {
		if (watchdog_due(watchdog, atomic_load(watchdog->cycles), clock_now()))
			notify_alive();
		nanosleep(&nap, NULL);
	}
	return NULL;
}

int watchdog_start(struct watchdog *watchdog, uint64_t limit_ns, const _Atomic uint64_t *cycles)
{
	int result;

	if (!limit_ns)
		return 0;
	watchdog_init(watchdog, limit_ns, 0, clock_now());
	watchdog->cycles = cycles;
	atomic_store(&watchdog->stop, false);
	result = thread_make(&watchdog->thread, run, watchdog);
	watchdog->running = !result;
	return result;
}

void watchdog_stop(struct watchdog *watchdog)
{
	if (!watchdog->running)
		return;
	atomic_store(&watchdog->stop, true);
	pthread_join(watchdog->thread, NULL);
	watchdog->running = false;
}
