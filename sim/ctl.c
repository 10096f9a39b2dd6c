// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeys-sim --ctl SOCKET COMMAND...: one command to a running simulator. Its
 * answer goes to stdout, a refusal to stderr; the exit status is 0, 1 for a
 * refusal, 2 when nobody answers.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <sysexits.h>
#include <unistd.h>

#include "sim/server.h"

#define PATIENCE_S 5

static int open_socket(const char *path)
{
	struct sockaddr_un sa = { .sun_family = AF_UNIX };
	struct timeval patience = { .tv_sec = PATIENCE_S };
	int fd;

	if (strlen(path) >= sizeof(sa.sun_path))
		return -ENAMETOOLONG;
	memcpy(sa.sun_path, path, strlen(path) + 1);
	fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
	if (fd < 0)
		return -errno;
	setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
	if (connect(fd, (struct sockaddr *)&sa, sizeof(sa)) < 0) {
		int r = -errno;

		close(fd);
		return r;
	}
	return fd;
}

/* Prints a reply line; -1 when more are to come, else the exit status. */
static int print_line(const char *line)
{
	if (!strcmp(line, "ok"))
		return 0;
	if (!strncmp(line, "error: ", 7)) {
		fprintf(stderr, "pokeys-sim: %s\n", line + 7);
		return 1;
	}
	puts(line);
	return -1;
}

static int print_reply(int fd)
{
	FILE *in = fdopen(fd, "r");
	char line[1024];
	int status = -1;

	if (!in) {
		close(fd);
		return 2;
	}
	while (status < 0 && fgets(line, sizeof(line), in)) {
		line[strcspn(line, "\n")] = '\0';
		status = print_line(line);
	}
	fclose(in);
	if (status < 0)
		fprintf(stderr, "pokeys-sim: no answer\n");
	return status < 0 ? 2 : status;
}

int sim_ctl(int argc, char **argv)
{
	char line[SIM_CONTROL_LINE];
	struct sim_text text;
	int fd;

	if (argc < 2 || !*argv[0] || !*argv[1]) {
		fputs("pokeys-sim: --ctl needs a socket and a command; pokeys-sim --help lists "
		      "them\n",
		      stderr);
		return EX_USAGE;
	}
	sim_text_init(&text, line, sizeof(line) - 1);
	for (int i = 1; i < argc; i++)
		sim_text_add(&text, "%s%s", i > 1 ? " " : "", argv[i]);
	line[text.used] = '\n';
	fd = open_socket(argv[0]);
	if (fd < 0) {
		fprintf(stderr,
			"pokeys-sim: %s: %s; give the socket that a simulator was "
			"started with (--control)\n",
			argv[0], strerror(-fd));
		return 2;
	}
	if (send(fd, line, text.used + 1, MSG_NOSIGNAL) < 0) {
		fprintf(stderr, "pokeys-sim: %s: %s\n", argv[0], strerror(errno));
		close(fd);
		return 2;
	}
	return print_reply(fd);
}
