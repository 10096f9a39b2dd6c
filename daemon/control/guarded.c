// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The daemon has no right to look at BPF programs, and shall have none: what
 * it knows of the guard is a file of a few lines "key value" in a folder where
 * only the guard can write. The file says when it was written; if that is long
 * ago, the guard was killed or the computer was started again.
 *
 * Nothing depends on what is read here but a flag, a line in the log and
 * metrics. Names go into the metrics' text, so they are let in letter by letter.
 */
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "daemon/control/guarded.h"

#define FRESH_NS UINT64_C(3000000000)
#define AHEAD_NS UINT64_C(500000000)	/* written since the caller looked at the clock */

enum { FILE_MAX = 4096 };

struct lines {
	const char *interface, *mode;
	uint64_t time_ns;
};

static ssize_t slurp(const char *path, char *text, size_t size)
{
	int fd = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
	struct stat status;
	ssize_t length = -1;

	if (fd < 0)
		return -1;
	if (!fstat(fd, &status) && S_ISREG(status.st_mode))
		length = read(fd, text, size - 1);
	close(fd);
	if (length >= 0)
		text[length] = '\0';
	return length;
}

/* Decimal digits and nothing else, within 64 bits. */
static bool number(const char *text, uint64_t *out)
{
	size_t digits = strspn(text, "0123456789");

	if (!digits || digits > 19 || text[digits])
		return false;
	*out = strtoull(text, NULL, 10);
	return true;
}

static void take_counter(struct guarded *out, const char *name, const char *value)
{
	size_t length = strlen(name);

	if (out->counters == GUARDED_COUNTERS || length >= sizeof(out->counter[0].name) ||
	    length != strspn(name, "abcdefghijklmnopqrstuvwxyz_") ||
	    !number(value, &out->counter[out->counters].value))
		return;
	if (!strncmp(name, "pass_", 5))
		out->passed += out->counter[out->counters].value;
	else if (!strncmp(name, "drop_", 5))
		out->dropped += out->counter[out->counters].value;
	memcpy(out->counter[out->counters++].name, name, length + 1);
}

static void take_line(struct guarded *out, struct lines *lines, const char *name, const char *value)
{
	if (!strcmp(name, "interface"))
		lines->interface = value;
	else if (!strcmp(name, "mode"))
		lines->mode = value;
	else if (!strcmp(name, "time_ns"))
		number(value, &lines->time_ns);
	else
		take_counter(out, name, value);
}

void guarded_read(struct guarded *out, const char *path, const char *interface, uint64_t now_ns)
{
	struct lines lines = { 0 };
	char text[FILE_MAX], *rest = NULL;

	memset(out, 0, sizeof(*out));
	if (!*interface || slurp(path, text, sizeof(text)) < 0)
		return;
	for (char *name = strtok_r(text, " ", &rest); name; name = strtok_r(NULL, " ", &rest)) {
		char *value = strtok_r(NULL, "\n", &rest);

		if (value)
			take_line(out, &lines, name, value);
	}
	out->on = lines.interface && !strcmp(lines.interface, interface) &&
		  lines.time_ns < now_ns + AHEAD_NS && now_ns < lines.time_ns + FRESH_NS;
	if (!out->on)
		memset(out, 0, sizeof(*out));
	else if (lines.mode && strlen(lines.mode) < sizeof(out->mode))
		memcpy(out->mode, lines.mode, strlen(lines.mode) + 1);
}
