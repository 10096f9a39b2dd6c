/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A device's settings as a commented part of a new pokeysd.conf. */
#ifndef TOOLS_CONFIG_DRAFT_H
#define TOOLS_CONFIG_DRAFT_H

#include <stddef.h>
#include <stdio.h>
#include <pokeys/settings.h>

/*
 * Prints each key that the device has reported, with its help text at the first occurrence. A
 * line that pokeysd would reject, or with which it would change the device, is a comment with
 * the reason. A key that is not set up is also a comment.
 * 0 or -ENOMEM. Cold.
 */
int config_draft_settings(const struct pokeys_settings *device, FILE *to);

/*
 * Prints each key that is given, without help. A line that pokeysd would reject is a comment
 * with the reason. 0 or -ENOMEM. Cold.
 */
int config_draft_wish(const struct pokeys_settings *wish, FILE *to);

/*
 * The name of a device's section from the first `length` characters of a text: what a name may
 * not have is a dash. `otherwise` is used if nothing is left. At most size - 1 characters.
 */
void config_draft_name(const char *text, size_t length, const char *otherwise, char *name,
		       size_t size);

#endif
