// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A full disk is no "in order", and half a status is none. Whoever pipes into head has
 * what he wants: that is no line worth. Which of the writes found out that he left,
 * and with it the error, is chance; the pipe says so itself.
 */
#include <errno.h>
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "usage/written.h"

static bool reader_left(void)
{
	struct pollfd out = { .fd = STDOUT_FILENO };

	return poll(&out, 1, 0) > 0 && out.revents & POLLERR;
}

int usage_written(const char *program, int status)
{
	const int error = fflush(stdout) ? errno : 0;

	if (!error && !ferror(stdout))
		return status;
	if (error != EPIPE && !reader_left())
		fprintf(stderr, "%s: standard output: %s\n", program,
			error ? strerror(error) : "not all could be written");
	return EXIT_FAILURE;
}
