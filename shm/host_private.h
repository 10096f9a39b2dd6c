/* SPDX-License-Identifier: MIT */
/* What the files of the host share. */
#ifndef SHM_HOST_PRIVATE_H
#define SHM_HOST_PRIVATE_H

#include "shm/handover.h"
#include "shm/host.h"
#include "shm/iox.h"
#include "shm/manifest.h"
#include "shm/mirror.h"
#include "shm/runtime.h"

enum { SHM_SERVICE_NAME_MAX = POKEYS_SHM_NAME_MAX + 24 };

/* What the commander writes. */
enum shm_intake { SHM_INTAKE_COMMAND, SHM_INTAKE_WISH, SHM_INTAKES };

struct shm_device {
	struct shm_host *host;
	char name[POKEYS_SHM_NAME_MAX];
	struct iox_state_writer *state;
	const struct pokeys_state *newest; /* the cell that was committed last */
	struct iox_diag_writer *diag;
	struct iox_report_writer *report;
	struct mirror mirror;
	struct handover intake[SHM_INTAKES]; /* their readers, or NULL for a moment */
	bool recycle; /* the last commander died: its place is to be made anew */
};

struct shm_host {
	char directory[SHM_DIRECTORY_MAX];
	char root_name[SHM_ROOT_NAME_MAX];
	char root[SHM_PATH_MAX];
	int directory_fd;
	int lock_fd;
	int mirror_fd; /* the mirror's folder */
	gid_t mirror_gid;
	struct iox_node *node;
	struct manifest manifest;
	bool published;
	bool unclear; /* not all could be cleared */
	struct shm_device devices[SHM_DEVICES_MAX];
	size_t count;
};

/* Folder, lock and root: 0, or -errno; then give back what was taken all the same. */
int shm_folder_take(struct shm_host *host, const char *group, const char *monitor_group, char *why,
		    size_t size);
/* Lock it and remove what a dead daemon left; the same. Nothing there is 0. */
int shm_folder_clear(struct shm_host *host, char *why, size_t size);
void shm_folder_give_back(struct shm_host *host);

/* Who may enter the root: the daemon alone, or its group as well; and write in it. 0 or -errno. */
int shm_root_close(const struct shm_host *host);
int shm_root_open(const struct shm_host *host);
int shm_root_guard(const struct shm_host *host);

/* `create`: O_CREAT, or 0 = -ENOENT if there is none. 0, -EBUSY a daemon that lives has it. */
int shm_lock_take(struct shm_host *host, int create, char *why, size_t size);

int shm_device_open(struct shm_device *device, struct shm_host *host, const char *name, char *why,
		    size_t size);
void shm_device_close(struct shm_device *device);

/* "pokeys/<device>/<image>", in `name`. */
const char *shm_service_name(char name[SHM_SERVICE_NAME_MAX], const char *device,
			     const char *image);

int shm_intakes_open(struct shm_device *device, struct iox_error *error);
void shm_intakes_close(struct shm_device *device);
/* After a death: 1 the commander's place was made anew, 0 it was free, -EAGAIN try again. */
int shm_intakes_recycle(struct shm_device *device);

#endif
