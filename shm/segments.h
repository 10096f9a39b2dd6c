/* SPDX-License-Identifier: MIT */
/*
 * The files of a root that are mapped: list them, make sure of their memory,
 * and check before mapping that they still are what was made. Cold.
 */
#ifndef SHM_SEGMENTS_H
#define SHM_SEGMENTS_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/*
 * Print "segment <name> <size>" for each, and allocate what is sparse, so that
 * a full tmpfs is an error here and not a SIGBUS later. 0 or -errno.
 */
int segments_print(const char *root, FILE *file);

/*
 * Is the file `name` of a root (as printed) a file of that size? 0, -ENOENT,
 * or -EBADMSG with the reason in `why`.
 */
int segment_check(const char *root, const char *name, uint64_t bytes, char *why, size_t size);

#endif
