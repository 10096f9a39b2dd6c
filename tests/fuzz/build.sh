#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# build.sh clang source-root output depfile source... -- link-argument...
#
# Compiles one fuzz target with its sanitizers and tells ninja every header it
# used, so that a changed header rebuilds it.
set -eu
clang=$1 root=$2 output=$3 depfile=$4
shift 4

objects=$output.o
rm -rf "$objects"
mkdir -p "$objects"
: >"$objects/headers"

count=0
while [ $# -gt 0 ] && [ "$1" != -- ]; do
	count=$((count + 1))
	"$clang" -c -std=gnu11 -D_GNU_SOURCE -g -O1 -fno-omit-frame-pointer \
		-fno-strict-aliasing -fsanitize=fuzzer,address,undefined \
		-fno-sanitize-recover=undefined -Wall -Wextra -Werror \
		-I"$root" -I"$root/include" \
		-MMD -MF "$objects/$count.d" -MT x "$1" -o "$objects/$count.o"
	sed -e 's/^x://' -e 's/\\$//' "$objects/$count.d" >>"$objects/headers"
	shift
done
[ $# -eq 0 ] || shift

printf '%s:' "$output" >"$depfile"
tr '\n' ' ' <"$objects/headers" >>"$depfile"
"$clang" -fsanitize=fuzzer,address,undefined "$objects"/*.o "$@" -o "$output"
