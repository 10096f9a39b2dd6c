#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
echo "skipped: no clang with libFuzzer found at configuration time;" \
	"install clang and libclang-rt-dev, then: meson setup --reconfigure build" >&2
exit 77
