/* SPDX-License-Identifier: MIT */
/*
 * Is there room for what is about to be made? Asked beforehand, see room.c. Cold.
 */
#ifndef SHM_ROOM_H
#define SHM_ROOM_H

#include <stddef.h>
#include <stdint.h>

/*
 * `bytes` free in the file system of `folder`, and `files` more that may be
 * opened: 0, -ENOSPC or -EMFILE (-ENFILE) with one line in `why`, -errno.
 */
int room_check(const char *folder, uint64_t bytes, int files, char *why, size_t size);

#endif
