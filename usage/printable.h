/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Text of strangers in a line of ours: what a file holds, what a process calls itself.
 * Nothing of it is to command a terminal, or to begin another line.
 */
#ifndef USAGE_PRINTABLE_H
#define USAGE_PRINTABLE_H

/* Whatever is not printable ASCII becomes '?', in place. Any thread. */
static inline void usage_printable(char *text)
{
	for (; *text; text++)
		if ((unsigned char)*text < 0x20 || (unsigned char)*text >= 0x7f)
			*text = '?';
}

#endif
