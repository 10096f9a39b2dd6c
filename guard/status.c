// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the guard has done, for people, for the daemon and for metrics.
 *
 * The daemon has no right to BPF and systemd lets only root into /sys/fs/bpf,
 * so the counters are written into a file, in a folder where nobody but the
 * guard can write: whoever reads it may believe it. Its time stamp is how a
 * reader sees that nobody writes any more.
 */
#include <bpf/bpf.h>
#include <bpf/libbpf.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>
#include "guard/kernel.h"

#define GUARD_NAME(id, name, help) name,
static const char *const names[] = { GUARD_VERDICT_TABLE(GUARD_NAME) };

int guard_counters(uint64_t out[GUARD_VERDICTS])
{
	char pin[GUARD_PATH];
	int cores = libbpf_num_possible_cpus();
	int fd = bpf_obj_get_opts(guard_pin("counters", pin), NULL);
	uint64_t *each;
	int result = 0;

	if (fd < 0)
		return -errno;
	each = calloc(cores > 0 ? (size_t)cores : 1, sizeof(*each));
	if (!each || cores < 0)
		result = -ENOMEM;
	for (uint32_t i = 0; !result && i < GUARD_VERDICTS; i++) {
		out[i] = 0;
		if (bpf_map_lookup_elem(fd, &i, each))
			result = -errno;
		for (int core = 0; !result && core < cores; core++)
			out[i] += each[core];
	}
	free(each);
	close(fd);
	return result;
}

void guard_print(FILE *to, const struct guard_place *place, const uint64_t counters[GUARD_VERDICTS],
		 uint64_t now_ns)
{
	fprintf(to, "interface %s\nmode %s\ntime_ns %llu\n", place->interface,
		place->native ? "native" : "generic", (unsigned long long)now_ns);
	for (int i = 0; i < GUARD_VERDICTS; i++)
		fprintf(to, "%s %llu\n", names[i], (unsigned long long)counters[i]);
}

int guard_publish(const struct guard_place *place, uint64_t now_ns)
{
	uint64_t counters[GUARD_VERDICTS] = { 0 };
	int result = place->index ? guard_counters(counters) : 0;
	FILE *to;
	int fd;

	if (result || !place->index) {
		unlink(GUARD_STATUS);
		return result;
	}
	fd = open(GUARD_STATUS ".new", O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0644);
	to = fd < 0 ? NULL : fdopen(fd, "w");
	if (!to)
		return -errno;
	fchmod(fd, 0644);
	guard_print(to, place, counters, now_ns);
	if (fclose(to) || rename(GUARD_STATUS ".new", GUARD_STATUS))
		return -errno;
	return 0;
}
