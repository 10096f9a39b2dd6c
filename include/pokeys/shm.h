/* SPDX-License-Identifier: MIT */
/*
 * Attach to the shared memory of a pokeysd: read a device's state, wait for
 * news, or command it.
 *
 * A client may be opened before any daemon exists, survives the daemon's
 * death, and finds the next one by itself: pokeys_client_poll() does that and
 * is called from time to time (or by a thread of the library,
 * pokeys_client_follow()). Reading is lock-free and makes no system call.
 *
 * Who does not command reads a copy that only the daemon may write, and maps it
 * read-only: it can disturb nobody, and there may be any number of such clients. Its
 * user has to be in the monitor group, a commander's in the group of the folder.
 *
 * Cold functions allocate, make system calls, may block for milliseconds and
 * need some 200 kB of stack; they never run in a realtime thread. Realtime
 * functions do none of it (16 kB of stack).
 *
 * One copy of this library per process: programs link the shared object
 * libpokeys_shm.so.
 */
#ifndef POKEYS_SHM_H
#define POKEYS_SHM_H

#include <stddef.h>
#include <stdint.h>
#include <pokeys/command.h>
#include <pokeys/events.h>
#include <pokeys/settings.h>
#include <pokeys/state.h>

#ifdef __cplusplus
extern "C" {
#endif

#define POKEYS_RUNTIME_DIRECTORY "/run/pokeysd"

enum {
	POKEYS_SHM_NAME_MAX = 32, /* device names: 1..31 of [A-Za-z0-9_-] */
	POKEYS_SHM_READERS = 32,  /* of one of iceoryx2's images at once: commanders */
};

typedef struct pokeys_client pokeys_client;

/* pokeys_client_open flags */
enum {
	POKEYS_CLIENT_COMMANDER = 1u << 0, /* also take the device's one command image */
	POKEYS_CLIENT_EVENTS = 1u << 1,    /* for pokeys_client_wait() */
};

/* pokeys_client_status() */
enum pokeys_client_state {
	POKEYS_CLIENT_DETACHED = 0, /* no daemon there (yet, or any more) */
	POKEYS_CLIENT_ATTACHED = 1,
	POKEYS_CLIENT_REFUSED = 2, /* a daemon is there, but: see the reason */
};

/*
 * Make a client for one device. `runtime_directory` NULL means
 * POKEYS_RUNTIME_DIRECTORY. `program` names this process to others (shown by
 * tools), e.g. "halui", of the same characters as a device name. The folder is
 * an absolute path of at most 49 characters (sockets live below it). No daemon
 * needs to exist. Cold. 0, -EINVAL (a name that cannot be), -ENOMEM.
 */
int pokeys_client_open(pokeys_client **out, const char *runtime_directory, const char *device,
		       const char *program, unsigned int flags);

/*
 * Detach and free; ends the follower thread first. If the client is a commander, the daemon
 * first carries out its last command image, and then brings the device into its safe state. NULL
 * is allowed. Cold.
 */
void pokeys_client_close(pokeys_client *client);

/*
 * Look for the daemon; attach, or attach anew if another daemon has taken
 * over. Cold, a few microseconds when nothing has changed. Returns enum
 * pokeys_client_state. Not while a follower thread runs.
 */
enum pokeys_client_state pokeys_client_poll(pokeys_client *client);

/*
 * Start a thread (not realtime, all signals blocked, ended and joined by
 * close) that polls every `interval_ms` (1..10000). Cold. 0 or -errno.
 */
int pokeys_client_follow(pokeys_client *client, unsigned int interval_ms);

/* How it stands, and in `why` (if size > 0) one line for a person. Any thread, cold. */
enum pokeys_client_state pokeys_client_status(const pokeys_client *client, char *why, size_t size);

/*
 * The newest whole state (or diagnostic) image. Realtime, lock-free: one
 * thread at a time per client. 0; -ENOTCONN if not attached; -EPROTO if what
 * was read is not such an image (a foreign writer); -EAGAIN if the writer was faster
 * a thousand times in a row (no daemon is). *out is untouched unless 0 is returned.
 */
int pokeys_client_read(pokeys_client *client, struct pokeys_state *out);
int pokeys_client_read_diag(pokeys_client *client, struct pokeys_diag *out);

/*
 * Overwrite the command image (magic, version and hash are filled in here;
 * heartbeat, times and session are the caller's; of the one-shots those are
 * taken over that were queued since the last writes of this session, so one
 * that was queued must not be changed). Realtime, wait-free, one thread at a
 * time. 0; -ENOTCONN; -EPERM without POKEYS_CLIENT_COMMANDER; -EBUSY while a holder runs.
 */
int pokeys_client_write(pokeys_client *client, const struct pokeys_command *command);

/*
 * Command without a loop of one's own (POKEYS_CLIENT_COMMANDER): a thread of the library (not
 * realtime, ended and joined by close) looks for the daemon and writes the command that
 * pokeys_client_command() gave it, every `period_ms` (1..1000) with a new heartbeat, until the
 * program has not renewed its lease for `lease_ms` (10..60000): because it waits, hangs or is
 * in a debugger. From then on nothing is written, nor after the daemon was away, so the device
 * is in its safe state heartbeat-timeout-ms later at the latest; as it is if the process is
 * killed. If it is stopped for less than its lease, that is a late heartbeat as any other:
 * resume-outputs in pokeysd.conf decides what follows. `period_ms` has to be well below
 * heartbeat-timeout-ms. Meanwhile pokeys_client_write() and pokeys_client_wait() are -EBUSY,
 * and pokeys_client_poll() returns the status only. Cold. 0, -EPERM, -EINVAL, -EALREADY, -EBUSY
 * while a follower thread runs, -errno.
 */
int pokeys_client_hold(pokeys_client *client, unsigned int period_ms, unsigned int lease_ms);

/*
 * The command to be held from now on; renews the lease. heartbeat, t_ns and period_ns are the
 * holder's, and so is session if it is 0; t_thread_ns is the caller's (command.h). 1 = the
 * lease had run out or the daemon was away, so the device was in its safe state meanwhile, and
 * outputs may wait for machine-on; 0; -ENOTCONN without
 * pokeys_client_hold(). Any thread, cold.
 */
int pokeys_client_command(pokeys_client *client, const struct pokeys_command *command);

/* Renew the lease of the command that is held: as above; 1 renews nothing. Any thread, cold. */
int pokeys_client_renew(pokeys_client *client);

/*
 * What the device's settings are and shall be (settings.h); it has changed when
 * state.report_count has. Errors as pokeys_client_read(). Lock-free, so that a
 * realtime thread may, but 1.7 kB: meant for now and then. One thread at a time.
 */
int pokeys_client_read_report(pokeys_client *client, struct pokeys_report *out);

/*
 * Copy what has happened to the device since *cursor, oldest first, at most `max` events of
 * `event_size` bytes (sizeof(struct pokeys_event)), and move *cursor behind them. Returns how
 * many; fewer than `max` = there are no more for now. Events that were overwritten meanwhile
 * are left out, which their numbers show. When the client has attached to another daemon
 * (another cursor->epoch), it begins with that one's first. The last events of a daemon can be
 * read until the client is polled again; a follower thread polls at any time. -ENOTCONN;
 * -EPERM with POKEYS_CLIENT_COMMANDER: open another client; -EINVAL another event_size, of
 * another version of this library. Any thread, cold.
 */
int pokeys_client_read_events(pokeys_client *client, struct pokeys_events_cursor *cursor,
			      struct pokeys_event *out, size_t event_size, size_t max);

/*
 * Overwrite the commander's wish for the device's settings (magic, version and
 * hash are filled in here; session and a new generation are the caller's).
 * Errors as pokeys_client_write(). Wait-free, one thread at a time, for now and
 * then. The wish ends with the daemon: write it again when state.epoch has
 * changed, after -ENOTCONN, and at the start.
 */
int pokeys_client_write_wish(pokeys_client *client, const struct pokeys_wish *wish);

/*
 * Wait for news (the link state, a fault or the settings have changed, or there is an event for
 * pokeys_client_read_events(); and about ten times a second), at most timeout_ms. It is seen up
 * to 5 ms later. 1 = there is, 0 = time passed or a signal came, -ENOTCONN, -EPERM without
 * POKEYS_CLIENT_EVENTS, -EBUSY while a follower or a holder runs. Cold; not from a thread other
 * than the one that polls.
 */
int pokeys_client_wait(pokeys_client *client, unsigned int timeout_ms);

/*
 * How many commanders the device has (0 or 1); without POKEYS_CLIENT_COMMANDER as the daemon
 * has counted them last, a few times a second. -ENOTCONN. Any thread, cold.
 */
int pokeys_client_commanders(pokeys_client *client);

/*
 * Names of the devices of the running daemon, each NUL terminated, at most
 * `max` of them. Returns how many there are, 0 if no daemon runs, or -errno.
 * Cold.
 */
int pokeys_shm_devices(const char *runtime_directory, char names[][POKEYS_SHM_NAME_MAX],
		       size_t max);

/*
 * Hash of the layout that the library itself was built with: for bindings in
 * other languages, which must refuse to work with another one. 0 for an image
 * that does not exist. Any thread.
 */
enum pokeys_shm_image {
	POKEYS_SHM_STATE = 0,
	POKEYS_SHM_DIAG = 1,
	POKEYS_SHM_COMMAND = 2,
	POKEYS_SHM_REPORT = 3,
	POKEYS_SHM_WISH = 4,
	POKEYS_SHM_IMAGES,
};
uint64_t pokeys_shm_layout(unsigned int image);

/* Bucket of a duration, and the lower bound (ns) of a bucket: state.h. Realtime. */
unsigned int pokeys_histogram_bucket(uint64_t ns);
uint64_t pokeys_histogram_lower(unsigned int bucket);
/* Duration (ns) below which the part `p` (0..1) of all lies; 0 if empty. */
uint64_t pokeys_histogram_percentile(const struct pokeys_histogram *histogram, double p);

#ifdef __cplusplus
}
#endif

#endif /* POKEYS_SHM_H */
