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
 * looks. A look that finds that one of them has not run since the last says nothing:
 * it may be in no thread any more, or in one with a long period.
 */
#include "halbridge/callers.h"

enum { LOOKS = 2 };

bool callers_look(struct callers *callers, const struct callers_seen *seen)
{
	const bool ran = seen->reads != callers->reads && seen->writes != callers->writes;

	if (!ran)
		return false;
	callers->reads = seen->reads;
	callers->writes = seen->writes;
	if (seen->reader == seen->writer) {
		callers->different = 0;
		callers->told = false;
		return false;
	}
	if (++callers->different < LOOKS || callers->told)
		return false;
	callers->told = true;
	return true;
}
