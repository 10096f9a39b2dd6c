#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# Whether this clang can link a libFuzzer target: status 0 if it can.
dir=$(mktemp -d) || exit 1
trap 'rm -rf "$dir"' EXIT
cat >"$dir/probe.c" <<'PROBE'
#include <stddef.h>
#include <stdint.h>
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t len);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t len)
{
	(void)data;
	(void)len;
	return 0;
}
PROBE
"$1" -fsanitize=fuzzer,address,undefined "$dir/probe.c" -o "$dir/probe"
