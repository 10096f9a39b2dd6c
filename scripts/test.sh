# SPDX-License-Identifier: GPL-2.0-or-later
# shellcheck shell=bash
# Run the suites and count the results. Sourced by ./run.
#
# There are two tiers. The first must pass before a change lands and is short enough
# to be run for every change: unit, sim, net, gateway, and hal with one whole LinuxCNC machine.
# `all` adds the other LinuxCNC machines, the page in a browser, PREEMPT_RT machines, the Debian packages,
# fuzzing, long runs of the gateway, and unit and sim again in sanitized builds. The end of the output lists the suites left out.
#
# Tests run two at a time, also in sanitized builds. Those of net, gateway and HAL spend most of their time
# waiting and run four at a time (two with --load), the longest first (priority in tests/*/meson.build); LinuxCNC's machines must
# not be late and run alone. Those of web, vm and soak, which use a browser, virtual machines or much traffic,
# run one at a time. A test that is in two suites runs once. The last line is "N passed, N failed, N skipped".
#
# --repeat N runs the suites N times and prints how often each test failed. --load N
# runs them beside N busy processes and stops them at random moments (under-load).
#
# Random tests take their seed from POKEYS_SEED. The default is fixed, so that the same
# tree gives the same result; POKEYS_SEED=N ./run test uses another seed.

export POKEYS_SEED=${POKEYS_SEED:-20055}

SUITES_LANDING=(unit sim net gateway hal)
SUITES_ALL=("${SUITES_LANDING[@]}" linuxcnc web vm package fuzz soak asan tsan)

# Time limits are for tests that hang, so that a hang costs minutes and not the whole run.
# In tests/*/meson.build a limit is three to four times the duration of the test on two
# quiet processors, at least one minute. These factors extend it for a busy machine and
# for a sanitizer.
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

# sanitized_run LABEL SANITIZER [meson option ...]
sanitized_run() {
	local label=$1 sanitizer=$2
	shift 2
	configure_and_build "build/$label" -Dwerror=true -Db_sanitize="$sanitizer" -Db_lundef=false \
		-Dpage=disabled "$@" ||
		die "the $label build failed"
	suite_run "build/$label" "$label" 2 unit sim
}

# parse_tests WORD...: set SUITES, REPEAT and LOAD from the command line
parse_tests() {
	local word suite

	SUITES=() REPEAT='' LOAD=0
	while [ $# -gt 0 ]; do
		word=$1
		shift
		case $word in
		--repeat=*|--load=*)	set -- "${word%%=*}" "${word#*=}" "$@" ;;
		--repeat)	is_count "$word" "${1-}" 1 1000; REPEAT=$((10#$1)); shift ;;
		--load)	is_count "$word" "${1-}" 0 64; LOAD=$((10#$1)); shift ;;
		-*)	die "unknown option '$word'; ./run help lists the options" ;;
		all)	SUITES+=("${SUITES_ALL[@]}") ;;
		*)	SUITES+=("$word") ;;
		esac
	done
	[ ${#SUITES[@]} -gt 0 ] || SUITES=("${SUITES_LANDING[@]}")
	# under load the question is what fails: nothing is run again
	[ "$LOAD" = 0 ] || REPEAT=${REPEAT:-1}
	for suite in "${SUITES[@]}"; do
		[[ " ${SUITES_ALL[*]} " == *" $suite "* ]] ||
			die "unknown suite '$suite'; use all, or any of: ${SUITES_ALL[*]}"
	done
}

is_count() {
	[[ $2 =~ ^[0-9]{1,4}$ ]] && [ "$2" -ge "$3" ] && [ "$2" -le "$4" ] ||
		die "$1 needs a whole number from $3 to $4, not '$2'"
}

is_wanted() {
	[[ " ${SUITES[*]} " == *" $1 "* ]]
}

# run_group LABEL JOBS SUITE...: those of the suites that are selected
run_group() {
	local label=$1 jobs=$2 suite wanted=()
	shift 2
	for suite; do ! is_wanted "$suite" || wanted+=("$suite"); done
	[ ${#wanted[@]} -eq 0 ] || suite_run build "$label" "$jobs" "${wanted[@]}"
}

# Run the selected suites once, in this order, whatever their order on the command line.
run_round() {
	# beside busy processes, nothing is left of a processor that waits
	local waiting=4
	[ "$LOAD" = 0 ] || waiting=2
	run_group unit-sim 2 unit sim
	run_group net-gateway "$waiting" net gateway
	run_group hal-linuxcnc "$waiting" hal linuxcnc
	run_group web 1 web
	run_group vm 1 vm
	run_group package 1 package
	run_group fuzz 2 fuzz
	run_group soak 1 soak
	# char is unsigned on arm64
	! is_wanted asan || sanitized_run asan address,undefined -Dc_args=-funsigned-char
	! is_wanted tsan || TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp" sanitized_run tsan thread
}

left_out() {
	local suite left=()
	for suite in "${SUITES_ALL[@]}"; do is_wanted "$suite" || left+=("$suite"); done
	echo "${left[*]}"
}

# The rounds that were run are worth something.
interrupted() {
	[ -z "$REPEAT" ] || [ ${#TEST_LOGS[@]} -eq 0 ] || scripts/tally-tests "${TEST_LOGS[@]}" || true
	exit 130
}

# Run what parse_tests has selected.
run_tests() {
	local round

	# meson ends its suite on ^C, and ends well; the rest shall not follow
	trap 'interrupted' INT
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
