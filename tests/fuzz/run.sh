#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# run.sh target corpus runs
#
# Runs one fuzz target with so many inputs, so that the result does not depend on
# the speed of the machine, or for POKEYS_FUZZ_SECONDS. The committed corpus is read
# only: what the run finds worth keeping goes to a folder of its own and is dropped,
# but an input that crashes stays beside the target and is shown.
set -eu
target=$1 corpus=$2 limit=-runs=$3
seed=${POKEYS_SEED:-20055}
[ -z "${POKEYS_FUZZ_SECONDS-}" ] || limit=-max_total_time=$POKEYS_FUZZ_SECONDS

if [ ! -d "$corpus" ] || [ -z "$(ls "$corpus")" ]; then
	echo "$corpus: no corpus; put a few good inputs there" >&2
	exit 1
fi

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
echo "POKEYS_SEED=$seed $limit"

# addresses are among what the fuzzer learns from
same_addresses=$(setarch -R true 2>/dev/null && echo "setarch -R" || true)

status=0
# shellcheck disable=SC2086 # two words, or none
$same_addresses "$target" -seed="$seed" "$limit" -max_len=1024 -timeout=20 \
	-rss_limit_mb=1024 -print_final_stats=1 -artifact_prefix="$target." \
	"$dir" "$corpus" >"$dir/log" 2>&1 || status=$?

if [ "$status" -ne 0 ]; then
	cat "$dir/log"
	echo "again: $target <the input named above>"
	exit 1
fi
grep -E '^(stat::number_of_executed_units|stat::new_units_added|#[0-9]+.*DONE)' "$dir/log"
