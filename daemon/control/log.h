/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Lines for a person, to stderr: the journal under systemd, a terminal else.
 * The control thread's; never called from the realtime thread.
 */
#ifndef CONTROL_LOG_H
#define CONTROL_LOG_H

#include <stdbool.h>
#include <stdint.h>

/*
 * Where lines go and the least important level (enum event_level) that does.
 * Under systemd (JOURNAL_STREAM names this descriptor) lines carry "<level>".
 */
void log_open(int fd, int level);

/* Whose lines these are, where the journal does not say it; kept, not copied; first "pokeysd". */
void log_program(const char *name);

/* One line, without newline. Never waits: what the reader does not take is counted and dropped. */
void log_line(int level, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Lines dropped so far because nobody took them. */
uint64_t log_dropped(void);

/* At most so many lines of one kind in a while. */
struct log_limit {
	uint64_t start_ns;
	uint32_t passed, held;
};

enum { LOG_BURST = 10 };
#define LOG_WHILE_NS UINT64_C(10000000000)

/* True = say it; then *held is how many were not said in the while before. */
bool log_permit(struct log_limit *limit, uint64_t now_ns, uint32_t *held);

#endif
