/* SPDX-License-Identifier: MIT */
/*
 * The daemon's side of the shared memory: owns the runtime folder, creates
 * the services of each device, publishes state and takes commands.
 *
 * <runtime>/lock          held (flock) by the one daemon of this folder, says its pid
 * <runtime>/monitor/      the mirror: a file for each device, to be read only (mirror.h)
 * <runtime>/e.<epoch>/    everything of this start, root path of iceoryx2
 * <runtime>/e.<epoch>/manifest   its layouts, devices and segments, as text
 * <runtime>/current       link to it, renamed into place when all is ready
 *
 * Who may reach a root may write everything in it (readers map for writing). So the
 * group is trusted not to break things, and nothing it writes is believed: images are
 * judged whenever they are read. All others see the mirror, if they are of its group.
 *
 * Threads: host_* and device_open..close belong to the control thread (cold);
 * the functions marked realtime to the realtime thread.
 */
#ifndef SHM_HOST_H
#define SHM_HOST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>
#include <pokeys/shm.h>

struct shm_host;
struct shm_device;

/*
 * Take the runtime folder (made with mode 2751 if missing) and make a fresh
 * root in it; roots of dead daemons are removed. `group` (NULL = leave) gets
 * access: a name or a number; the folder then belongs to it and is 2751 (one
 * that exists, is otherwise and holds other things is refused instead).
 * `monitor_group` may read the mirror (NULL: pokeys-monitor, where there is one). 0, or
 * -errno with one line in `why`: -EBUSY another daemon holds it. With 0 `why`
 * is empty or holds a warning.
 */
int shm_host_open(struct shm_host **out, const char *runtime_directory, const char *group,
		  const char *monitor_group, char *why, size_t size);

/*
 * Remove what a daemon that was killed has left in the folder, and what looks like one that
 * hangs: link, roots, control socket and lock. The flight recorder's ring stays, which is
 * no sign of life but the witness of why it died. 0, also if there is nothing, or if
 * somebody who reads there keeps a root from becoming empty (then the lock stays, and the
 * next call removes it); -EBUSY a daemon that lives holds it; -errno, also where something
 * cannot be removed: then the rest has been, and the lock stays, so that the next call says
 * the same. `why` as above. Cold.
 */
int shm_host_clear(const char *runtime_directory, char *why, size_t size);

/* The group that may read the mirror; (gid_t)-1 = there is none. */
gid_t shm_host_monitors(const struct shm_host *host);

/* Add a device before publish. -EEXIST, -EINVAL (name), -errno. */
int shm_host_add(struct shm_host *host, const char *name, struct shm_device **out, char *why,
		 size_t size);

/* Let clients find it: swap the `current` link. */
int shm_host_publish(struct shm_host *host, char *why, size_t size);

/* This start's number, as state.epoch wants it. */
uint64_t shm_host_epoch(const struct shm_host *host);

/*
 * Clean up after dead clients; if the commander of a device is dead, make its
 * command service anew so that the next one can attach; if the link is gone, make
 * it again. Call a few times a second. Returns how many dead ones were found, or
 * -errno: -ESTALE what was published has been removed, nobody can attach any more.
 */
int shm_host_maintain(struct shm_host *host);

/* Tell everyone who waits for this device. Never waits. */
void shm_device_notify(struct shm_device *device);

/* Commanders attached (0 or 1). Cold. */
int shm_device_commanders(struct shm_device *device);

/* Remove the link and the root, release the lock. NULL is allowed. */
void shm_host_close(struct shm_host *host);

/*
 * Realtime. Publish one whole image (magic, version, hash and epoch are filled
 * in). Wait-free, no system call. Loan gives the cell to fill in place: its
 * content is that of two updates ago, all of it must be rewritten. Commit is for the
 * commander, for whom it is urgent; mirror shows the image that was committed last to
 * all others, before the next loan. Write does all of it.
 */
void shm_device_write(struct shm_device *device, const struct pokeys_state *state);
struct pokeys_state *shm_device_loan(struct shm_device *device);
void shm_device_commit(struct shm_device *device);
void shm_device_mirror(struct shm_device *device);

/*
 * Realtime, and for speed only: the cell of the next loan is taken back from the caches
 * of those who have read it, before the answers are there and not a sleep earlier, for
 * what has slept meanwhile finds its own caches cold. Each line is written (with what
 * it holds): to ask for it with a prefetch has no effect where this core still has a
 * copy that it shares. It takes 0.1 to 0.4 us. Without it publishing costs up to three
 * times as much, a microsecond more, as soon as there are readers on other cores.
 */
void shm_device_prepare(struct shm_device *device);

void shm_device_write_diag(struct shm_device *device, const struct pokeys_diag *diag);
void shm_device_write_report(struct shm_device *device, const struct pokeys_report *report);

/*
 * Write one event to the mirror. Its number is assigned here, and waiting clients wake up. The
 * control thread. Never waits.
 */
void shm_device_write_event(struct shm_device *device, const struct pokeys_event *event);

/*
 * Realtime. The newest command image: 1 = *out is a whole image of our
 * layout; 0 = nobody has ever written; -EPROTO = something is there that is not one
 * (refused and counted by the caller). Values inside are not judged here.
 */
int shm_device_read_command(struct shm_device *device, struct pokeys_command *out);

/*
 * Realtime. The wish, if it was written since the last call (one load of a
 * counter if not): 1 = *out is a whole one of our layout, news at least once;
 * 0 = nothing new, or nobody has ever written; -EPROTO = what was written is
 * not one (said once for each write). Values inside are not judged here.
 */
int shm_device_read_wish(struct shm_device *device, struct pokeys_wish *out);

#endif
