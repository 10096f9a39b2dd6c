/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * HAL lets read be added to one thread and write to another. Then the faster one
 * interrupts the other in its midst, and everything that the two share, and that is
 * safe because one comes after the other, is not: write makes a command of half an old
 * and half a new image of the device; a one-shot is queued twice or not at all, and so
 * are index-enable and homing, which are one-shots; a mark that a pin has changed is
 * lost. It cannot be mended with a lock, for neither may wait. So it is told.
 *
 * Who only moves the functs to another thread has them in two for a moment; hence two
 * looks. A look that finds that write has not run since the last says nothing: it may
 * be in no thread any more, or in one with a long period. Where only read has not, no
 * axis may be driven (exchange.c), and that is reported.
 */
#include "halbridge/callers.h"

enum { LOOKS = 2 };

static bool is_unread(struct callers *callers, const struct callers_seen *seen)
{
	const bool wrote = seen->writes != callers->last_writes;

	callers->last_writes = seen->writes;
	if (seen->reads != callers->reads)
		callers->unread = 0;
	else
		callers->unread += wrote;
	return callers->unread >= LOOKS;
}

/* Once, until *told is taken back. */
static enum callers_news tell(bool *told, enum callers_news news)
{
	if (*told)
		return CALLERS_AS_BEFORE;
	*told = true;
	return news;
}

enum callers_news callers_look(struct callers *callers, const struct callers_seen *seen)
{
	if (is_unread(callers, seen))
		return tell(&callers->told_unread, CALLERS_NO_READ);
	if (seen->reads == callers->reads || seen->writes == callers->writes)
		return CALLERS_AS_BEFORE;
	callers->reads = seen->reads;
	callers->writes = seen->writes;
	callers->told_unread = false;
	if (seen->reader == seen->writer) {
		callers->different = 0;
		callers->told = false;
		return CALLERS_AS_BEFORE;
	}
	return ++callers->different < LOOKS ? CALLERS_AS_BEFORE :
					      tell(&callers->told, CALLERS_TWO_THREADS);
}
