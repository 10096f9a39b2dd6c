/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Whether all that was printed has arrived.
 */
#ifndef USAGE_WRITTEN_H
#define USAGE_WRITTEN_H

/*
 * Flush standard output. The status to end with: `status`, or 1 where not all of it could
 * be written, which is told in one line to stderr, but to a reader that left. Cold.
 */
int usage_written(const char *program, int status);

#endif
