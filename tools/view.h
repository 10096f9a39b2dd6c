/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The devices of one daemon, as this program sees them by its own clock. */
#ifndef TOOLS_VIEW_H
#define TOOLS_VIEW_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <pokeys/shm.h>

enum { VIEW_DEVICES = 64 };

/* How the newest image is to be taken. */
enum view_freshness {
	VIEW_NONE,  /* nothing could be read; see `why` */
	VIEW_DEAD,  /* the daemon does not publish any more */
	VIEW_STALE, /* it does, but the device's data is old */
	VIEW_FRESH,
};

struct view_device {
	char name[POKEYS_SHM_NAME_MAX];
	pokeys_client *client;
	uint64_t now_ns; /* when it was read */
	enum view_freshness freshness;
	bool has_diag;
	uint8_t postep_axes; /* bit = axis whose PoStep driver is set up */
	char why[200];       /* one line, empty when fresh */
	struct pokeys_state state;
	struct pokeys_diag diag;
};

struct view {
	const char *runtime_directory;
	size_t count;
	struct view_device device[VIEW_DEVICES];
};

/* The view of this program. A command needs one, and it is large. */
struct view *view_only(void);

uint64_t view_now(void);

/*
 * Attach to the named devices, or to all if there are no names. 0, or a
 * status to exit with, and then it has been said why.
 */
int view_open(struct view *view, const char *runtime_directory, char *const names[], size_t count);

/*
 * Attach to these, of which pokeys_shm_devices() knew a moment ago; their daemon may be
 * gone meanwhile. Says nothing. 0, or -ENOMEM, and then there are none.
 */
int view_attach(struct view *view, const char *runtime_directory, char names[][POKEYS_SHM_NAME_MAX],
		size_t count);

/* Read them all. */
void view_read(struct view *view);

void view_close(struct view *view);

/* Judge an image that was read at now_ns: freshness and `why`. */
void view_judge(struct view_device *device);

/*
 * The time at which an image was read: between the two readings of the clock, and not before
 * the image was published. This is the earliest possible time, so that a pause of this program
 * between the two readings does not look like a silent daemon.
 */
uint64_t view_moment(uint64_t before_ns, uint64_t published_ns, uint64_t after_ns);

/* pokeys_age_ns() as a number; INFINITY if then_ns is 0 or in the future. */
double view_age_ns(uint64_t now_ns, uint64_t then_ns);

/*
 * Of the data that every cycle brings: inputs and, from a device with a pulse engine,
 * positions, whichever is older. INFINITY if one of them never came or is in the future.
 */
double view_data_age_ns(const struct view_device *device);

#endif
