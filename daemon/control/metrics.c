// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Whoever reads the file (a node exporter's textfile collector, usually) must
 * see a whole one: it is written beside and renamed. On a full disk the old
 * file stays and grows old, which the collector notices by its mtime; the
 * failure is counted, told once, and told again when it has changed.
 */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "daemon/control/log.h"
#include "daemon/control/metrics.h"
#include "daemon/device/event.h"

void metrics_init(struct metrics *metrics, const char *path, uint64_t interval_ns, uint64_t now_ns)
{
	*metrics = (struct metrics){ .path = path, .interval_ns = interval_ns, .next_ns = now_ns };
}

bool metrics_due(const struct metrics *metrics, uint64_t now_ns)
{
	return *metrics->path && now_ns >= metrics->next_ns;
}

/*
 * Something else under that name, a FIFO above all, would hold the control
 * thread, and with it SIGTERM and the watchdog, for as long as nobody reads.
 */
static int open_beside(const char *path)
{
	int fd = open(path, O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0644);
	struct stat status;

	if (fd < 0)
		return -errno;
	if (fstat(fd, &status) || !S_ISREG(status.st_mode)) {
		close(fd);
		return -EEXIST;
	}
	if (!ftruncate(fd, 0))
		return fd;
	close(fd);
	return -EIO;
}

static int write_beside(const char *path, const struct report *report)
{
	int fd = open_beside(path);
	FILE *to = fd < 0 ? NULL : fdopen(fd, "w");
	int result;

	if (fd < 0)
		return fd;
	if (!to) {
		result = -errno;
		close(fd);
		return result;
	}
	/* whatever the umask says: counters are no secret, and another user collects them */
	fchmod(fd, 0644);
	errno = 0;
	result = report_metrics(report, to) ? -(errno ? errno : EIO) : 0;
	if (fclose(to) && !result)
		result = -errno;
	return result;
}

static void tell(struct metrics *metrics, int result)
{
	if (result && result != metrics->last)
		log_line(EVENT_WARNING, "metrics file %s cannot be written: %s", metrics->path,
			 strerror(-result));
	else if (!result && metrics->last)
		log_line(EVENT_NOTICE, "metrics file %s is written again", metrics->path);
	metrics->last = result;
}

int metrics_write(struct metrics *metrics, const struct report *report, uint64_t now_ns)
{
	char beside[300];
	int result;

	snprintf(beside, sizeof(beside), "%s.new", metrics->path);
	result = write_beside(beside, report);
	if (!result && rename(beside, metrics->path))
		result = -errno;
	if (result) {
		unlink(beside);
		metrics->failed++;
	}
	tell(metrics, result);
	metrics->next_ns = now_ns + metrics->interval_ns;
	return result;
}
