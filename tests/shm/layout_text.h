/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The layouts of the images as text: "name:offset:size;" of every member. */
#ifndef TESTS_SHM_LAYOUT_TEXT_H
#define TESTS_SHM_LAYOUT_TEXT_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include <pokeys/settings.h>
#include <pokeys/state.h>

enum layout_image {
	LAYOUT_STATE,
	LAYOUT_DIAG,
	LAYOUT_COMMAND,
	LAYOUT_REPORT,
	LAYOUT_WISH,
	LAYOUT_IMAGES
};

enum { LAYOUT_TEXT_MAX = 8192 };

const char *layout_name(enum layout_image image);
size_t layout_size(enum layout_image image);
void layout_text(enum layout_image image, char text[LAYOUT_TEXT_MAX]);
bool layout_gapless(enum layout_image image);
uint64_t layout_hash(const char *text);

#endif
