/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * pokeys-guard: the XDP program put on an interface, looked after, taken off.
 * Nothing here is for the realtime thread; the guard is a process of its own.
 */
#ifndef GUARD_GUARD_H
#define GUARD_GUARD_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include "daemon/control/config.h"
#include "guard/rules.h"

#define GUARD_BPFFS	"/sys/fs/bpf"
#define GUARD_PINS	GUARD_BPFFS "/pokeysd"	/* the guard's own, without --pins */
#define GUARD_RUN	"/run/pokeys-guard"
#define GUARD_STATUS	GUARD_RUN "/status"

/* Exit statuses, as pokeys-guard(8) lists them. */
enum {
	GUARD_OK = 0,
	GUARD_FAILED = 1,
	GUARD_USAGE = 64,
	GUARD_UNAVAILABLE = 69, /* no XDP here: the daemon works on without */
	GUARD_BUSY = 75,
	GUARD_NO_RIGHT = 77,
	GUARD_CONFIG = 78,
};

/* What is on an interface. */
struct guard_place {
	char interface[16];
	uint32_t index; /* 0 = it is on none */
	bool native;    /* in the driver, else generic ... */
	int error;      /* ... for this errno of the driver's; 0 = not asked */
	bool dedicated;
};

/*
 * Keep the pins in this folder instead of GUARD_PINS. It must exist on a BPF file system; the guard
 * does not remove it. The service needs this, because its user cannot enter GUARD_BPFFS. Call it
 * first. Returns false if the path is too long.
 */
bool guard_use_pins(const char *folder);

/*
 * Load the program, with the counters and devices of an earlier one if they are
 * still pinned; `sockets`: and able to direct packets to an AF_XDP socket. 0, or
 * an exit status after one line that says what is missing.
 */
int guard_load(bool dedicated, bool sockets);

/*
 * Put it on place->interface, in place of an earlier one that is still there;
 * one that is on another interface is taken off. Fills index and native. 0, an
 * exit status after one line, or -ENODEV without one: there is no such interface.
 */
int guard_attach(struct guard_place *place);

/* False = it is not there any more: the interface went, or somebody detached it. */
bool guard_is_attached(const struct guard_place *place);

/* Take it off its interface. Idempotent. */
void guard_detach(void);

/* The same, and remove what was pinned. Idempotent. 0, or -errno of what could not be removed. */
int guard_remove(void);

/* Where a pinned one is. 0, or -errno (-ENOENT: there is none, -EACCES: not for us to see). */
int guard_find(struct guard_place *place);

/* The sums over all cores. 0 or -errno. */
int guard_counters(uint64_t out[GUARD_VERDICTS]);

/*
 * Who may pass. Devices with a serial number and no address keep the one they
 * had, or are searched for at most 3 * 200 ms; returns how many are not known yet, or -errno.
 */
int guard_set_devices(const struct config *config);

/* Lines "key value" as pokeys-guard status prints them and GUARD_STATUS holds them. */
void guard_print(FILE *to, const struct guard_place *place, const uint64_t counters[GUARD_VERDICTS],
		 uint64_t now_ns);

/* Write GUARD_STATUS as a whole; place->index 0 = there is no guard: the file goes. 0 or -errno. */
int guard_publish(const struct guard_place *place, uint64_t now_ns);

/*
 * Two guards would take each other off, and so would a remove beside one that works. The
 * descriptor to close, or an exit status below 0 (GUARD_BUSY, ...), which has been logged.
 */
int guard_lock(void);

/* Until SIGTERM or SIGINT. An exit status. */
int guard_run(const struct config *config);

/* What systemctl status and the journal are told, and everything that is lost without. */
#define GUARD_LOSS "; without it packets of others are sorted out by the kernel's network " \
	"stack, on the cores of the daemon as well; pokeysd works on"

#endif
