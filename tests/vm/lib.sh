# SPDX-License-Identifier: GPL-2.0-or-later
# shellcheck shell=bash
# What the scripts inside the virtual machine share. Each check prints "ok NAME"
# or "FAIL NAME: why"; the last line is "end". The host reads them from /out/results.
#
# Limits in seconds are there so that nothing waits for ever; on a host that others
# use as well an emulated second is long, so they are long too.
set -u
exec >/out/results 2>/out/errors
export LC_ALL=C HOME=/root

name=mill
address=127.0.0.1
sim=/run/pokeys-sim.sock

ok() { echo "ok $1"; }
fail() { echo "FAIL $1: $2"; }
check() { # NAME COMMAND...
	local what=$1 said
	shift
	if said=$("$@" 2>&1); then ok "$what"; else fail "$what" "$(tail -n 1 <<<"$said")"; fi
}
# within SECONDS COMMAND...: until it succeeds
within() {
	local end=$((SECONDS + $1))
	shift
	until "$@" >/dev/null 2>&1; do
		[ $SECONDS -lt $end ] || { echo "not within the time: $*"; return 1; }
		sleep 0.1
	done
}

status() { pokeysctl status "$name" --json; }
fresh() { status | grep -q '"fresh":true'; }
main_pid() { systemctl show -P MainPID pokeysd; }
realtime_thread() { # prints class priority processor of the daemon's realtime thread
	ps -L -o cls=,rtprio=,psr= -p "$(main_pid)" | awk '$1 == "FF"'
}
as_cnc() { runuser -u cnc -- "$@"; }
pin() { as_cnc halcmd getp "pokeys.0.$1"; }
pin_is() { [ "$(pin "$1")" = "$2" ]; }
servo_pid() { pgrep -o -x rtapi_app; }

install_it() {
	tar -C /in/install -c . | tar -C / -x --keep-directory-symlink --no-same-owner &&
		systemd-sysusers && systemd-tmpfiles --create && ldconfig &&
		udevadm control --reload && udevadm trigger -s misc && systemctl daemon-reload &&
		usermod -a -G pokeys,pokeys-monitor cnc && starts_may_take_long
}

# As long as a host that does other things likes: 15 s were too short for the guard's.
starts_may_take_long() {
	local unit
	for unit in pokeysd pokeys-guard; do
		mkdir -p "/etc/systemd/system/$unit.service.d" &&
			printf '[Service]\nTimeoutStartSec=180\n' \
				>"/etc/systemd/system/$unit.service.d/start.conf" || return 1
	done
	systemctl daemon-reload
}

# The drop-in for the isolated core, as a user would copy it, and a longer watchdog, because an
# emulated second may take several real ones; units.py checks the limit of the unit itself.
isolate_daemon() {
	mkdir -p /etc/systemd/system/pokeysd.service.d &&
		cp /usr/share/doc/pokeysd/isolated-core.conf /etc/systemd/system/pokeysd.service.d/ &&
		printf '[Service]\nWatchdogSec=60\n' >/etc/systemd/system/pokeysd.service.d/slow.conf &&
		systemctl daemon-reload
}

start_simulator() { # [systemd property]
	systemd-run --quiet --unit=pokeys-sim "$@" \
		pokeys-sim --model 57CNC --address $address --control $sim --preset demo
	within 180 test -S $sim
}

# A servo thread of so many ns with the module in it; everything alive before it returns.
start_linuxcnc() {
	cat >/tmp/servo.hal <<-HAL
		loadrt threads name1=servo-thread period1=$1
		loadrt pokeys_shm devices=$name
		addf pokeys.0.read servo-thread
		addf pokeys.0.write servo-thread
		start
		loadusr -w sleep 6000
	HAL
	systemd-run --quiet --unit=linuxcnc --uid=cnc --property=LimitRTPRIO=99 \
		--property=LimitMEMLOCK=infinity --property=StandardOutput=append:/out/linuxcnc \
		--property=StandardError=append:/out/linuxcnc --property=WorkingDirectory=~ \
		halrun -f /tmp/servo.hal
	within 360 pin_is connected TRUE
}

kernel_is_realtime() { uname -v | grep PREEMPT_RT && [ "$(cat /sys/kernel/realtime)" = 1 ]; }
servo_thread_is_fifo() {
	grep -q 'POSIX realtime' /out/linuxcnc || { echo "LinuxCNC said: $(head -n 1 /out/linuxcnc)"; return 1; }
	ps -L -o cls= -p "$(servo_pid)" | grep -q FF
}
