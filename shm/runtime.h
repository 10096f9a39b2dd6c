/* SPDX-License-Identifier: MIT */
/*
 * The runtime folder as files: names, the `current` link, and
 * removing what dead daemons left. Cold.
 */
#ifndef SHM_RUNTIME_H
#define SHM_RUNTIME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <pokeys/shm.h>

enum {
	SHM_DIRECTORY_MAX = 50, /* runtime folder with its NUL, see runtime.c */
	SHM_PATH_MAX = 128,     /* a path in or below it */
	SHM_ROOT_NAME_MAX = 24, /* "e." and a hexadecimal number */
	SHM_DEVICES_MAX = 64,
};

/* 1..31 of [A-Za-z0-9_-]. */
bool runtime_device_name_ok(const char *name);

/* A name that a daemon gives its root: e.<epoch>. */
bool runtime_root_name_ok(const char *name);

/* Absolute, and short enough for the socket paths below it. 0 or -EINVAL, -ENAMETOOLONG. */
int runtime_check_directory(const char *directory, char *why, size_t size);

/*
 * Why this user may not enter `path`, or read it if it is a file, and what to do: one line in
 * `why`, with the group that may. It asks the system for that group's name, which may
 * take its time: cold, not for a realtime thread. Returns -EACCES.
 */
int runtime_denied(const char *path, char *why, size_t size);

/* Name of the current root. 0, -ENOENT no daemon, -EPROTO a foreign thing, -errno. */
int runtime_current(const char *directory, char name[SHM_ROOT_NAME_MAX]);

/* Nobody but the daemon may enter it now: it makes files there. */
bool runtime_is_closed(const char *root);

/*
 * Could anybody but the daemon have put files into this root? 0, -ENOENT it is gone, or -EPERM
 * with the reason in `why`. Whoever attaches as root must not map what somebody else put there.
 */
int runtime_check_root(const char *directory, const char *root, char *why, size_t size);

/* Make or replace the link. */
int runtime_set_current(const char *directory, const char *name);

/* Remove every root but `keep` (NULL = all); the caller holds the lock. */
int runtime_remove_stale(int directory_fd, const char *keep);

/* Remove a root with all that is in it. */
int runtime_remove_tree(int directory_fd, const char *name);

#endif
