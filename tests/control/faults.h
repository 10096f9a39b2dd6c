/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A configuration read from text, and the faults that were told of it. */
#ifndef TESTS_CONTROL_FAULTS_H
#define TESTS_CONTROL_FAULTS_H

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/control/config.h"

#define GOOD "[device a]\naddress = 10.0.0.1\n"

enum { LINES = 64 };

struct heard {
	int count;
	char line[LINES][512];
};

static struct heard heard;
static struct config config;

static inline void hear(void *context, const char *line)
{
	struct heard *to = context;

	assert_null(strchr(line, '\n'));
	if (to->count < LINES)
		snprintf(to->line[to->count], sizeof(to->line[0]), "%s", line);
	to->count++;
}

static inline int parse(const char *text)
{
	memset(&heard, 0, sizeof(heard));
	return config_parse("f", text, strlen(text), &config, hear, &heard);
}

/* One fault, and it reads so. */
static inline void assert_fault(const char *text, const char *expected)
{
	int faults = parse(text);

	if (faults != 1 || strcmp(heard.line[0], expected))
		fail_msg("%d faults, the first: %s", faults, faults ? heard.line[0] : "none");
}

#endif
