#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# run.sh target corpus
#
# Runs one fuzz target for a bounded time. The committed corpus is read only:
# what the run finds worth keeping goes to a folder of its own and is dropped,
# but an input that crashes stays beside the target and is shown.
set -eu
target=$1 corpus=$2
seed=${POKEYS_SEED:-20055}
seconds=${POKEYS_FUZZ_SECONDS:-10}

if [ ! -d "$corpus" ] || [ -z "$(ls "$corpus")" ]; then
	echo "$corpus: no corpus; put a few good inputs there" >&2
	exit 1
fi

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
echo "POKEYS_SEED=$seed POKEYS_FUZZ_SECONDS=$seconds"

status=0
"$target" -seed="$seed" -max_total_time="$seconds" -max_len=1024 -timeout=20 \
	-rss_limit_mb=1024 -print_final_stats=1 -artifact_prefix="$target." \
	"$dir" "$corpus" >"$dir/log" 2>&1 || status=$?

if [ "$status" -ne 0 ]; then
	cat "$dir/log"
	echo "again: $target <the input named above>"
	exit 1
fi
grep -E '^(stat::number_of_executed_units|stat::new_units_added|#[0-9]+.*DONE)' "$dir/log"
