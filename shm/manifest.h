/* SPDX-License-Identifier: MIT */
/*
 * What a root says of itself: layouts and devices, as text. Cold.
 */
#ifndef SHM_MANIFEST_H
#define SHM_MANIFEST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <pokeys/shm.h>
#include "shm/runtime.h"

#define SHM_MANIFEST "manifest"

struct manifest_layout {
	unsigned int version;
	uint64_t hash;
	uint64_t size;
};

struct manifest {
	long pid;
	uint64_t epoch;
	struct manifest_layout layout[POKEYS_SHM_IMAGES]; /* enum pokeys_shm_image */
	char iceoryx2[16];
	char boot[40]; /* of the kernel: times of another boot mean nothing */
	char device[SHM_DEVICES_MAX][POKEYS_SHM_NAME_MAX];
	size_t devices;
};

/* This program's layouts and this boot, no device. */
void manifest_init(struct manifest *manifest);

/* Also lists and allocates the root's segments. 0 or -errno. */
int manifest_write(const char *root, const struct manifest *manifest);

/* 0; -ENOENT; -EPROTO: there is something, but not a manifest; -errno. */
int manifest_read(const char *root, struct manifest *out);

/*
 * Whether it is one to attach to: 0; -EPROTONOSUPPORT its layouts are not ours,
 * both are named in `why`; -ENOENT it was written before the machine was started.
 */
int manifest_check(const struct manifest *manifest, char *why, size_t size);

/* Whether the segments are as they were made: 0, -ENOENT, -EBADMSG with why, -errno. */
int manifest_check_segments(const char *root, char *why, size_t size);

/* Whether the root that had one has none any more: it has been removed. */
bool manifest_gone(const char *root);

bool manifest_has_device(const struct manifest *manifest, const char *name);

#endif
