/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A device's settings as a commented part of a new pokeysd.conf. */
#ifndef TOOLS_CONFIG_DRAFT_H
#define TOOLS_CONFIG_DRAFT_H

#include <stdio.h>
#include <pokeys/settings.h>

/*
 * Each key that the device has said anything of, with its help where it comes first. What is
 * off, none or 0 is a comment, so that pokeysd leaves it to the device.
 */
void config_draft_settings(const struct pokeys_settings *device, FILE *to);

#endif
