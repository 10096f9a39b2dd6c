# SPDX-License-Identifier: GPL-2.0-or-later
# shellcheck shell=bash
# Run the suites and count. Sourced by ./run.
#
# unit, sim and fuzz tests run side by side, as do the machines of vm, of which
# each has use for a processor and a half and none measures by our clock; net and
# hal tests hold real sockets or LinuxCNC and have the processor for themselves.
# The sanitized builds run unit and sim again. The last line is
# "N passed, N failed, N skipped".
#
# Random tests take their seed from POKEYS_SEED. Here it is one number, so that
# the same tree gives the same answer; POKEYS_SEED=N ./run test tries another.

export POKEYS_SEED=${POKEYS_SEED:-20055}

SUITES_ALL=(unit sim net hal vm fuzz asan tsan)

# suite_run BUILD LABEL JOBS SUITE...
suite_run() {
	local build=$1 label=$2 jobs=$3 suite arguments=() status=0
	shift 3
	for suite; do arguments+=(--suite "$suite"); done
	say "testing: $label"
	# what an earlier run wrote must not be counted if this one writes nothing
	rm -f "$build/meson-logs/log-$label.json"
	meson test -C "$build" --no-rebuild --print-errorlogs --num-processes "$jobs" \
		--timeout-multiplier "$([ "$build" = build ] && echo 5 || echo 20)" \
		--logbase "log-$label" "${arguments[@]}" || status=$?
	TEST_LOGS+=("$build/meson-logs/log-$label.json=$status")
}

sanitized_run() {
	local label=$1 sanitizer=$2
	configure_and_build "build/$label" -Dwerror=true -Db_sanitize="$sanitizer" -Db_lundef=false \
		-Dcargo-target-dir="$PWD/build/shm/cargo" || die "the $label build failed"
	suite_run "build/$label" "$label" 2 unit sim
}

check_suites() {
	local suite
	for suite; do
		[[ " ${SUITES_ALL[*]} " == *" $suite "* ]] ||
			die "unknown suite '$suite', one of: ${SUITES_ALL[*]}"
	done
}

# What check_suites has seen.
run_tests() {
	local suite
	# meson ends its suite on ^C, and ends well; the rest shall not follow
	trap 'exit 130' INT
	TEST_LOGS=()
	[ $# -gt 0 ] || set -- "${SUITES_ALL[@]}"
	reconfigure_for_fuzzing build
	configure_and_build build -Dwerror=true || die "the build failed"
	for suite; do
		case $suite in
		unit|sim|vm|fuzz)	suite_run build "$suite" 2 "$suite" ;;
		net|hal)	suite_run build "$suite" 1 "$suite" ;;
		asan)	sanitized_run asan address,undefined ;;
		tsan)	TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp" sanitized_run tsan thread ;;
		esac
	done
	scripts/count-tests "${TEST_LOGS[@]}"
}
