/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The control language and the script reader over arbitrary text: every line
 * has one answer which ends in a verdict, and nothing it says can put the
 * bench into a state the device then trips over.
 */

#include <stdlib.h>
#include <string.h>

#include "sim/control.h"
#include "sim/script.h"

#define MOST 1024

static struct sim_rig rig;
static struct sim_script script;

static void hold(bool fact)
{
	if (!fact)
		abort();
}

static void run_line(struct sim_control *control, uint64_t now_ns, const char *text, size_t len)
{
	char reply[SIM_CONTROL_REPLY];
	char *line = malloc(len + 1);
	struct sim_text out;
	bool good;

	hold(line != NULL);
	memcpy(line, text, len);
	line[len] = '\0';
	sim_text_init(&out, reply, sizeof(reply));
	good = sim_control_run(control, now_ns, line, &out);
	hold(out.used >= 3 && reply[out.used - 1] == '\n');
	hold(good == !strcmp(reply + out.used - 3, "ok\n"));
	free(line);
}

static void run_script(const uint8_t *data, size_t len)
{
	char *text = malloc(len + 1);
	char reason[256];
	struct sim_text why;

	hold(text != NULL);
	memcpy(text, data, len);
	text[len] = '\0';
	sim_text_init(&why, reason, sizeof(reason));
	if (!sim_script_parse(&script, text, &why))
		hold(why.used > 0);
	free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t len);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t len)
{
	struct sim_control control = { .rig = &rig };
	const char *text = (const char *)data;
	uint64_t now_ns = 1;

	if (len > MOST)
		return 0;
	sim_rig_init(&rig, NULL);
	while (len) {
		const char *end = memchr(text, '\n', len);
		size_t line = end ? (size_t)(end - text) : len;

		run_line(&control, now_ns, text, line);
		now_ns += 20000000;
		line += end != NULL;
		text += line;
		len -= line;
	}
	sim_rig_run(&rig, now_ns + 100000000);
	run_script(data, (size_t)(text - (const char *)data));
	return 0;
}
