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
# --repeat N runs all of it N times and prints which tests failed how often, --load N
# beside N busy processes and with stops at random moments (under-load).
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
	label+=$ROUND
	say "testing: $label"
	# what an earlier run wrote must not be counted if this one writes nothing
	rm -f "$build/meson-logs/log-$label.json"
	"${UNDER_LOAD[@]}" meson test -C "$build" --no-rebuild --print-errorlogs --num-processes "$jobs" \
		--timeout-multiplier "$([ "$build" = build ] && echo "$ROOM_PLAIN" || echo "$ROOM_SANITIZED")" \
		--logbase "log-$label" "${arguments[@]}" || status=$?
	TEST_LOGS+=("$build/meson-logs/log-$label.json=$status=$(IFS=+; echo "$*")")
}

sanitized_run() {
	local label=$1 sanitizer=$2
	configure_and_build "build/$label" -Dwerror=true -Db_sanitize="$sanitizer" -Db_lundef=false || die "the $label build failed"
	suite_run "build/$label" "$label" 2 unit sim
}

# parse_tests WORD...: what the command line asks for, into SUITES, REPEAT and LOAD
parse_tests() {
	local word suite

	SUITES=() REPEAT='' LOAD=0
	while [ $# -gt 0 ]; do
		word=$1
		shift
		case $word in
		--repeat=*|--load=*)	set -- "${word%%=*}" "${word#*=}" "$@" ;;
		--repeat)	is_count "$word" "${1-}" 1 1000; REPEAT=$1; shift ;;
		--load)	is_count "$word" "${1-}" 0 64; LOAD=$1; shift ;;
		-*)	die "unknown option '$word'; ./run help lists what there is" ;;
		all)	SUITES+=("${SUITES_ALL[@]}") ;;
		*)	SUITES+=("$word") ;;
		esac
	done
	[ ${#SUITES[@]} -gt 0 ] || SUITES=("${SUITES_LANDING[@]}")
	for suite in "${SUITES[@]}"; do
		[[ " ${SUITES_ALL[*]} " == *" $suite "* ]] ||
			die "unknown suite '$suite', one of: ${SUITES_ALL[*]}, or all"
	done
}

is_count() {
	[[ $2 =~ ^[0-9]{1,4}$ ]] && [ "$2" -ge "$3" ] && [ "$2" -le "$4" ] ||
		die "$1 '$2': a whole number from $3 to $4 is needed"
}

is_wanted() {
	[[ " ${SUITES[*]} " == *" $1 "* ]]
}

# What is wanted, once; in this order, whatever that of the command line.
run_round() {
	local suite side_by_side=() alone=()

	for suite in unit sim; do ! is_wanted $suite || side_by_side+=($suite); done
	for suite in net hal linuxcnc; do ! is_wanted $suite || alone+=($suite); done
	[ ${#side_by_side[@]} -eq 0 ] || suite_run build unit-sim 2 "${side_by_side[@]}"
	[ ${#alone[@]} -eq 0 ] || suite_run build net-hal 1 "${alone[@]}"
	! is_wanted vm || suite_run build vm 1 vm
	! is_wanted fuzz || suite_run build fuzz 2 fuzz
	! is_wanted asan || sanitized_run asan address,undefined
	! is_wanted tsan || TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp" sanitized_run tsan thread
}

left_out() {
	local suite left=()
	for suite in "${SUITES_ALL[@]}"; do is_wanted "$suite" || left+=("$suite"); done
	echo "${left[*]}"
}

# What parse_tests has read.
run_tests() {
	local round

	# meson ends its suite on ^C, and ends well; the rest shall not follow
	trap 'exit 130' INT
	TEST_LOGS=() ROUND='' UNDER_LOAD=()
	[ "$LOAD" = 0 ] || UNDER_LOAD=(scripts/under-load --busy "$LOAD")
	! is_wanted fuzz || reconfigure_for_fuzzing build
	configure_and_build build -Dwerror=true || die "the build failed"
	if [ -z "$REPEAT" ]; then
		run_round
		scripts/judge-tests --multiplier "$ROOM_PLAIN" --left-out "$(left_out)" "${TEST_LOGS[@]}"
		return
	fi
	for ((round = 1; round <= REPEAT; round++)); do
		say "round $round of $REPEAT"
		ROUND=-$round
		run_round
	done
	scripts/tally-tests "${TEST_LOGS[@]}"
}
