# SPDX-License-Identifier: GPL-2.0-or-later
# shellcheck shell=bash
# Run the suites and count. Sourced by ./run.
#
# There are two tiers. The one that lands is short enough to be run for every
# change: unit, sim, net, and hal with one whole LinuxCNC machine. `all` is
# everything: the other LinuxCNC machines, PREEMPT_RT machines, fuzzing, and unit
# and sim again in sanitized builds. What a run leaves out is said at its end.
#
# unit, sim and fuzz tests run side by side. net and hal tests hold real sockets
# or LinuxCNC and have the processors for themselves, as have the machines of vm.
# A test that is in two suites runs once. The last line is
# "N passed, N failed, N skipped".
#
# Random tests take their seed from POKEYS_SEED. Here it is one number, so that
# the same tree gives the same answer; POKEYS_SEED=N ./run test tries another.

export POKEYS_SEED=${POKEYS_SEED:-20055}

SUITES_LANDING=(unit sim net hal)
SUITES_ALL=("${SUITES_LANDING[@]}" linuxcnc vm fuzz asan tsan)

# Limits of time are for tests that hang: one costs minutes, and not the run. In
# tests/*/meson.build they are three to four times what the test takes on two quiet
# processors, a minute at least; here is the room for a machine that is busy, and for
# a sanitizer.
ROOM_PLAIN=2
ROOM_SANITIZED=4

# suite_run BUILD LABEL JOBS SUITE...
suite_run() {
	local build=$1 label=$2 jobs=$3 suite arguments=() status=0
	shift 3
	for suite; do arguments+=(--suite "$suite"); done
	say "testing: $label"
	# what an earlier run wrote must not be counted if this one writes nothing
	rm -f "$build/meson-logs/log-$label.json"
	meson test -C "$build" --no-rebuild --print-errorlogs --num-processes "$jobs" \
		--timeout-multiplier "$([ "$build" = build ] && echo "$ROOM_PLAIN" || echo "$ROOM_SANITIZED")" \
		--logbase "log-$label" "${arguments[@]}" || status=$?
	TEST_LOGS+=("$build/meson-logs/log-$label.json=$status=$(IFS=+; echo "$*")")
}

sanitized_run() {
	local label=$1 sanitizer=$2
	configure_and_build "build/$label" -Dwerror=true -Db_sanitize="$sanitizer" -Db_lundef=false \
		-Dcargo-target-dir="$PWD/build/shm/cargo" || die "the $label build failed"
	suite_run "build/$label" "$label" 2 unit sim
}

# suites_of WORD...: the suites that the words of the command line stand for
suites_of() {
	case $* in
	"")	echo "${SUITES_LANDING[@]}" ;;
	all)	echo "${SUITES_ALL[@]}" ;;
	*)	echo "$@" ;;
	esac
}

check_suites() {
	local suite
	for suite in $(suites_of "$@"); do
		[[ " ${SUITES_ALL[*]} " == *" $suite "* ]] ||
			die "unknown suite '$suite', one of: ${SUITES_ALL[*]}, or 'all' alone"
	done
}

# What check_suites has seen.
run_tests() {
	local suite asked side_by_side=() alone=() rest=() left=()
	# meson ends its suite on ^C, and ends well; the rest shall not follow
	trap 'exit 130' INT
	TEST_LOGS=()
	asked=" $(suites_of "$@") "
	for suite in "${SUITES_ALL[@]}"; do
		[[ $asked == *" $suite "* ]] || { left+=("$suite"); continue; }
		case $suite in
		unit|sim)	side_by_side+=("$suite") ;;
		net|hal|linuxcnc)	alone+=("$suite") ;;
		*)	rest+=("$suite") ;;
		esac
	done
	[[ $asked != *" fuzz "* ]] || reconfigure_for_fuzzing build
	configure_and_build build -Dwerror=true || die "the build failed"
	[ ${#side_by_side[@]} -eq 0 ] || suite_run build unit-sim 2 "${side_by_side[@]}"
	[ ${#alone[@]} -eq 0 ] || suite_run build net-hal 1 "${alone[@]}"
	for suite in "${rest[@]}"; do
		case $suite in
		vm)	suite_run build vm 1 vm ;;
		fuzz)	suite_run build fuzz 2 fuzz ;;
		asan)	sanitized_run asan address,undefined ;;
		tsan)	TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp" sanitized_run tsan thread ;;
		esac
	done
	scripts/judge-tests --multiplier "$ROOM_PLAIN" --left-out "${left[*]}" "${TEST_LOGS[@]}"
}
