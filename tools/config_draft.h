/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A device's settings as a commented part of a new pokeysd.conf. */
#ifndef TOOLS_CONFIG_DRAFT_H
#define TOOLS_CONFIG_DRAFT_H

#include <stdio.h>
#include <pokeys/settings.h>

/*
 * Each key that the device has said anything of, with its help where it comes first. The
 * lines are judged as the daemon does it: what it would refuse, or write into the device
 * otherwise than it is there, is a comment with the reason; so is what is not set up at all.
 * 0 or -ENOMEM. Cold.
 */
int config_draft_settings(const struct pokeys_settings *device, FILE *to);

#endif
