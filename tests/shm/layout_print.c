/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Print what this compiler makes of the headers, one image a line: name, size,
 * hash as published, text. The Python test holds its own layouts against it.
 */
#include <inttypes.h>
#include <stdio.h>
#include "tests/shm/layout_text.h"

int main(void)
{
	static const uint64_t hashes[LAYOUT_IMAGES] = {
		POKEYS_STATE_HASH,  POKEYS_DIAG_HASH, POKEYS_COMMAND_HASH,
		POKEYS_REPORT_HASH, POKEYS_WISH_HASH,
	};
	char text[LAYOUT_TEXT_MAX];

	for (enum layout_image image = 0; image < LAYOUT_IMAGES; image++) {
		layout_text(image, text);
		printf("%s %zu %016" PRIx64 " %s\n", layout_name(image), layout_size(image),
		       hashes[image], text);
	}
	return 0;
}
