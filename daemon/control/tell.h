/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the daemon says of a device: a line of the log, and the same as an event for those who
 * may only read the shared memory (pokeys/events.h). The control thread's, cold.
 */
#ifndef CONTROL_TELL_H
#define CONTROL_TELL_H

#include <stdint.h>
#include <pokeys/events.h>
#include "daemon/control/config.h"

#define TELL_ALL UINT32_MAX		/* of the daemon or the network, and so of each device */

struct teller {
	const struct config *config; /* names of the devices */
	/* Gets each event of a device (index), without its number; NULL = nobody. */
	void (*show)(void *context, uint32_t device, const struct pokeys_event *event);
	void *context;
};

/* To the log alone; the text is `said`'s, after the name of the device (index or TELL_ALL). */
void tell_log(const struct teller *teller, uint32_t device, const struct pokeys_event *said);

/*
 * To those who read: what happened at `t_ns`, which was before `now_ns` (CLOCK_MONOTONIC).
 * Times and flags are filled in here. What is only for who debugs is left out.
 */
void tell_show(const struct teller *teller, uint32_t device, const struct pokeys_event *said,
	       uint64_t t_ns, uint64_t now_ns);

/* To both, as of now. `kind` is a word that stays the same. */
void tell_line(const struct teller *teller, uint32_t device, int level, const char *kind,
	       const char *format, ...) __attribute__((format(printf, 5, 6)));

#endif
