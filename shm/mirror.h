/* SPDX-License-Identifier: MIT */
/*
 * The mirror: what the daemon publishes, once more, for those who may read and nothing else.
 *
 * iceoryx2's readers map its files for writing, for a reader has to say that it reads. So
 * whoever may attach there may also forge commands, or structures that make another process
 * crash. The mirror is one file for each device, <runtime>/monitor/<device>, that only the
 * daemon may write and that is mapped read-only: a reader leaves no trace in it, there may be
 * any number of them, and one that stops in the middle or lies dead holds nobody up.
 *
 * Behind the images is a ring with what the daemon has logged of the device (pokeys/events.h).
 *
 * Each image has two cells and a counter. The writer fills the cell that is not the newest and
 * then counts; it never waits. A reader copies the newest cell and looks whether it was
 * overtaken meanwhile: only by a second update does the writer come back to the same cell. A
 * writer that dies half-way leaves the newest image whole.
 *
 * One thing is left to a reader who means harm, on kernels with transparent huge pages, which
 * PREEMPT_RT has not: he may have the kernel gather the pages of a file (MADV_COLLAPSE), and the
 * writer waits for that. `deny` in shmem_enabled forbids it.
 *
 * A file is complete before it gets its name, and a daemon gives each start a file of its own.
 * So a reader that sees another file behind the name attaches again, and the old mapping stays
 * readable as long as it likes.
 */
#ifndef SHM_MIRROR_H
#define SHM_MIRROR_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>
#include <pokeys/shm.h>
#include "shm/runtime.h"

#define MIRROR_FOLDER	"monitor"
#define MIRROR_GROUP	"pokeys-monitor"
#define MIRROR_MAGIC	UINT64_C(0x524F5252494D4B50)	/* "PKMIRROR", little endian */

enum {
	MIRROR_VERSION = 2,
	MIRROR_ALIGN = 64,
	MIRROR_TEXT = 40,
};

/* What the mirror has of the images in shm.h, in this order. */
enum mirror_image { MIRROR_STATE, MIRROR_DIAG, MIRROR_REPORT, MIRROR_IMAGES };

struct mirror_part {
	uint64_t hash; /* of the layout */
	uint32_t version;
	uint32_t size;    /* of the image, bytes */
	uint32_t counter; /* where its counter is, bytes from the beginning */
	uint32_t cell[2]; /* where its cells are; the newest is that of counter & 1 */
	uint32_t reserved;
};

/*
 * A ring of struct pokeys_event: number n is in slot (n - 1) % slots, and has its number while it
 * is whole.
 */
struct mirror_ring {
	uint32_t counter; /* where the number of the newest is, bytes from the
			   * beginning */
	uint32_t slot;    /* where the slots are */
	uint32_t slots, slot_size;
};

struct mirror_head {
	uint64_t magic;
	uint32_t version;
	uint32_t head_size; /* of this structure */
	uint64_t file_size;
	uint64_t epoch;         /* state.epoch */
	char boot[MIRROR_TEXT]; /* of the kernel: times of another boot mean nothing */
	char device[POKEYS_SHM_NAME_MAX];
	uint32_t number, devices; /* which of how many the daemon has, from 0 */
	struct mirror_part part[MIRROR_IMAGES];
	struct mirror_ring events;
	/* by the control thread, now and then */
	_Atomic uint32_t notices;   /* counts what pokeys_client_wait() ends for */
	_Atomic int32_t commanders; /* 0 or 1 */
};
_Static_assert(sizeof(struct mirror_head) % 8 == 0, "the layout is the same everywhere");

/* ---- the daemon's side: mirror.c */

struct mirror_cells {
	_Atomic uint64_t *counter;
	unsigned char *cell[2];
	size_t size;
};

struct mirror {
	struct mirror_head *head; /* NULL = there is none */
	struct mirror_cells image[MIRROR_IMAGES];
	int folder_fd; /* the host's */
	ino_t inode;
};

/*
 * The folder <runtime>/monitor, made if missing, mode 0750, of group *gid ((gid_t)-1: as it
 * comes). If that group cannot be given, *gid becomes -1, with a line in `why`; with `must` it
 * is an error. Returns a descriptor of the folder or -errno, with a line in `why`. Cold.
 */
int mirror_folder(int runtime_fd, const char *runtime, bool must, gid_t *gid, char *why,
		  size_t size);

/*
 * A device's file, all of whose pages are there, without its name yet; the images are to be
 * written. mirror_publish() gives it the name, and says how many devices there are. 0 or
 * -errno. Cold.
 */
int mirror_make(struct mirror *mirror, int folder_fd, gid_t gid, const char *device,
		unsigned int number, uint64_t epoch);
int mirror_publish(const struct mirror *mirror, size_t devices);
/* Unmap it, and remove its name. Readers keep what they have mapped. Cold. */
void mirror_remove(struct mirror *mirror);

/* Remove the folder with all that daemons have left in it. 0 or -errno. Cold. */
int mirror_clear(int runtime_fd);

/* One whole image. Realtime, wait-free; one thread for each image. Nothing if there is none. */
void mirror_write(struct mirror *mirror, enum mirror_image image, const void *from);

/* One event; its number is given here. Wait-free; the control thread alone. */
void mirror_write_event(struct mirror *mirror, const struct pokeys_event *event);

/* Whether its name still belongs to it. Cold. */
bool mirror_is_there(const struct mirror *mirror);

/* Another notice for who waits, and how many commanders there are. Cold. */
void mirror_notify(struct mirror *mirror);
void mirror_show_commanders(struct mirror *mirror, int commanders);

/* ---- the reader's side: mirror_view.c */

struct mirror_view {
	const struct mirror_head *shared; /* mapped; for what changes in it */
	size_t size;
	dev_t device; /* which file it is */
	ino_t inode;
	struct mirror_head head; /* as it was judged */
};

/*
 * Map a device's file, after all of it was judged. 0; -ENOENT no daemon; -ENODEV a daemon
 * without this device; -EACCES; -EPROTONOSUPPORT other layouts; -EPROTO not such a file;
 * -errno; with one line in `why`. Cold.
 */
int mirror_open(struct mirror_view *view, const char *runtime, const char *device, char *why,
		size_t size);
void mirror_close(struct mirror_view *view);

/* One line on what mirror_devices() has returned (0, -errno) and what to do. Returns it. Cold. */
int mirror_explain(const char *runtime, int error, char *why, size_t size);

/* Whether the name still belongs to the file that is mapped. Cold. */
bool mirror_is_current(const struct mirror_view *view, const char *runtime, const char *device);

/*
 * Copy the newest image. 0; -EPROTO it is no such image; -EAGAIN the writer was faster many
 * times in a row. *out is untouched then. Realtime, 10 kB of stack.
 */
int mirror_read(const struct mirror_view *view, enum mirror_image image, void *out);

/*
 * Copy the events from number *next on, at most `max`, and move *next behind them; what has been
 * overwritten is left out. Returns how many. Lock-free.
 */
size_t mirror_read_events(const struct mirror_view *view, uint64_t *next, struct pokeys_event *out,
			  size_t max);

/*
 * Names of the daemon's devices, in its order. How many; 0 also while it makes or removes
 * its files, so that nobody takes one for its only device; or -errno. Cold.
 */
int mirror_devices(const char *runtime, char names[][POKEYS_SHM_NAME_MAX], size_t max);

#endif
