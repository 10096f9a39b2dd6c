#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# linuxcnc-paths.sh HALCOMPILE: the folder of this LinuxCNC's realtime modules
# and, on a second line, that of its headers. Within a build that make runs, its options are not ours.
set -eu
modinc=$("$1" --print-modinc)
printf 'include %s\nprint-paths:\n\t@echo $(RTLIBDIR)\n\t@echo $(lastword %s)\n' "$modinc" \
	'$(patsubst -I%,%,$(filter -I%/include -I%/include/linuxcnc,$(EXTRA_CFLAGS)))' |
	env -u MAKEFLAGS -u MAKELEVEL make -s -f - MODINC="$modinc" print-paths
