// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Every request captured from the vendor's library gets its one reply, with
 * its operation, its id and a good checksum, and none of the documented
 * operations is answered as an unknown one. The file is tests/wire's; what the
 * replies in it say came from something simpler than a device and is not
 * compared (protocol section 7).
 */
#include "tests/sim/talk.h"

#include <stdio.h>
#include <stdlib.h>

static struct sim_device dev;
static const char *path;
static char line[8192];

static size_t from_hex(const char *text, uint8_t *bytes, size_t most)
{
	size_t len = 0;
	unsigned int byte;

	while (len < most && sscanf(text, "%2x", &byte) == 1) {
		bytes[len++] = (uint8_t)byte;
		text += 2;
	}
	return len;
}

static void check_reply(const char *name, const uint8_t *rq, size_t len, bool answered)
{
	const uint8_t *last = rq + len - WIRE_PK;
	uint8_t rp[WIRE_PK];
	uint64_t unknown = dev.stats.unknown;
	size_t got = sim_device_request(&dev, dev.now_ns + MS, rq, len, rp);

	if (got != (answered ? WIRE_PK : 0))
		fail_msg("%s: %zu bytes of reply", name, got);
	if (!answered)
		return;
	if (rp[0] != WIRE_REPLY || rp[1] != rq[1] || rp[6] != last[6] || rp[7] != wire_checksum(rp))
		fail_msg("%s: bad header", name);
	if (dev.stats.unknown != unknown)
		fail_msg("%s: answered as unknown", name);
}

static void every_captured_request_is_answered(void **state)
{
	struct sim_device_options options = { .hardware = WIRE_HW_57CNC };
	FILE *file = fopen(path, "r");
	unsigned int rows = 0;

	(void)state;
	assert_non_null(file);
	sim_device_init(&dev, &options);
	while (fgets(line, sizeof(line), file)) {
		char *rest = line;
		char *name = strsep(&rest, "\t");
		char *request = strsep(&rest, "\t");
		uint8_t rq[SIM_MULTI];
		size_t len;

		if (*line == '#' || !request || !rest || !strcmp(request, "empty"))
			continue; /* searches are in identity.c */
		len = from_hex(request, rq, sizeof(rq));
		check_reply(name, rq, len, *rest != '-');
		rows++;
	}
	fclose(file);
	assert_true(rows > 170);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_captured_request_is_answered),
	};

	if (argc != 2) {
		fprintf(stderr, "usage: %s golden-packets.tsv\n", argv[0]);
		return 2;
	}
	path = argv[1];
	return cmocka_run_group_tests(tests, NULL, NULL);
}
