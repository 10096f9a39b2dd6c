#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-or-later
# What happens inside the virtual machine, as root, once it is up. Each check
# prints "ok NAME" or "FAIL NAME: why"; the last line is "end". The host reads
# them from /out/results.
#
# Two emulated processors: only whether things happen is checked, never how
# fast. Limits in seconds are there so that nothing waits for ever.
set -u
exec >/out/results 2>/out/errors
export LC_ALL=C HOME=/root

name=mill
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
		usermod -a -G pokeys cnc
}

configure_it() {
	mkdir -p /etc/systemd/system/pokeysd.service.d
	cp /usr/share/doc/pokeysd/isolated-core.conf /etc/systemd/system/pokeysd.service.d/
	systemctl daemon-reload
	cat >/etc/pokeysd/pokeysd.conf <<-CONF
		[daemon]
		cpu = 1
		group = pokeys
		period-us = 4000
		interface = lo

		[device $name]
		address = 127.0.0.1
		digital-outputs = 31-34
		heartbeat-timeout-ms = 2000
		stale-after-ms = 2000
		lost-after-ms = 5000
		deadline-floor-us = 20000
	CONF
	pokeysd --check-config
}

start_simulator() {
	systemd-run --quiet --unit=pokeys-sim --property=CPUAffinity=0 \
		pokeys-sim --model 57CNC --address 127.0.0.1 --control $sim --preset demo
	within 10 test -S $sim
}

start_linuxcnc() {
	cat >/tmp/servo.hal <<-HAL
		loadrt threads name1=servo-thread period1=10000000
		loadrt pokeys_shm devices=$name
		addf pokeys.0.read servo-thread
		addf pokeys.0.write servo-thread
		start
		loadusr -w sleep 600
	HAL
	systemd-run --quiet --unit=linuxcnc --uid=cnc --property=LimitRTPRIO=99 \
		--property=LimitMEMLOCK=infinity --property=StandardOutput=append:/out/linuxcnc \
		--property=StandardError=append:/out/linuxcnc --property=WorkingDirectory=~ \
		halrun -f /tmp/servo.hal
	within 30 pin_is connected TRUE
}

kernel_is_realtime() { uname -v | grep PREEMPT_RT && [ "$(cat /sys/kernel/realtime)" = 1 ]; }
core_is_isolated() { [ "$(cat /sys/devices/system/cpu/isolated)" = 1 ]; }

thread_is_fifo_on_core_1() {
	local class priority core
	read -r class priority core < <(realtime_thread) || { echo "no SCHED_FIFO thread"; return 1; }
	[ "$priority $core" = "80 1" ] || { echo "$class $priority on core $core"; return 1; }
}

memory_is_locked() { [ "$(awk '/^VmLck/ { print $2 }' "/proc/$(main_pid)/status")" -gt 0 ]; }
is_not_root() { [ "$(ps -o user= -p "$(main_pid)")" = pokeys ]; }

servo_thread_is_fifo() {
	grep -q 'POSIX realtime' /out/linuxcnc || { echo "LinuxCNC said: $(head -n 1 /out/linuxcnc)"; return 1; }
	ps -L -o cls= -p "$(servo_pid)" | grep -q FF
}

output_is() { pokeys-sim --ctl $sim pin 31 | grep -qx "latch=$1"; }
output_follows() {
	as_cnc halcmd setp pokeys.0.pin.30.out 1 && within 10 output_is 1 || return 1
	as_cnc halcmd setp pokeys.0.pin.30.out 0 && within 10 output_is 0
}
input_follows() {
	pokeys-sim --ctl $sim pin 13 0 && within 10 pin_is pin.12.in FALSE || return 1
	pokeys-sim --ctl $sim pin 13 1 && within 10 pin_is pin.12.in TRUE
}

# again WAY SIGNAL: the daemon is hit, systemd starts it anew, the pins live again, LinuxCNC never noticed
again() {
	local before servo
	before=$(main_pid)
	servo=$(servo_pid) || { echo "LinuxCNC does not run"; return 1; }
	kill "-$1" "$before"
	within 15 eval '[ "$(main_pid)" != '"$before"' ] && systemctl is-active pokeysd' || return 1
	within 20 fresh && within 10 pin_is connected TRUE || return 1
	[ "$(servo_pid)" = "$servo" ] || { echo "LinuxCNC was restarted as well"; return 1; }
}

# A key is changed, systemctl reload brings it into the device.
reload_configures() {
	sed -i 's/^digital-outputs.*/digital-outputs = 31-34, 20/; s/^\[device.*/&\ndigital-inputs = 21/' \
		/etc/pokeysd/pokeysd.conf
	systemctl reload pokeysd || return 1
	within 20 eval 'pokeys-sim --ctl $sim pin 21 | grep -qx function=0x02'
}

# The unit's capabilities and system calls suffice, on this kernel, and the group can see it.
guarded() { status | grep -q '"guard":true'; }
guard_is_seen() {
	systemctl start pokeys-guard || { journalctl -o cat -u pokeys-guard | head -n 20 >/out/guard; return 1; }
	within 20 guarded && fresh || return 1
	as_cnc pokeys-guard status | grep -q '^pass_device [1-9]' || { echo "cnc sees no packets"; return 1; }
}
guard_comes_again() {
	local before
	before=$(systemctl show -P MainPID pokeys-guard)
	[ "$before" != 0 ] || { echo "it does not run"; return 1; }
	kill -KILL "$before"
	within 15 eval '[ "$(systemctl show -P MainPID pokeys-guard)" != '"$before"' ] &&
		systemctl is-active pokeys-guard' || return 1
	within 15 guarded && fresh
}
guard_goes() {
	systemctl stop pokeys-guard || return 1
	within 15 eval '! guarded' || return 1
	[ ! -e /sys/fs/bpf/pokeysd ] || { echo "pins are left"; return 1; }
	fresh
}

watchdog_was_it() { journalctl -u pokeysd --no-pager | grep -i watchdog; }

latency() {
	timeout 20 stress-ng --cpu 1 --taskset 0 --timeout 8 --quiet &
	timeout 20 cyclictest -q -m -t 1 -a 1 -p 70 -i 1000 -D 6 --json=/out/cyclictest.json >/dev/null
	wait
	fresh && status >/out/status.json
}

linuxcnc_dies() {
	as_cnc halcmd setp pokeys.0.pin.30.out 1 && within 10 output_is 1 || return 1
	kill -KILL "$(servo_pid)"
	within 10 output_is 0
}

nothing_is_left() {
	local left
	left=$(find /dev/shm /run/pokeysd -mindepth 1 \( -user pokeys -o -path '/run/pokeysd/*' \) ! -name lock)
	[ -z "$left" ] || { echo "left: $(head -n 3 <<<"$left" | tr '\n' ' ')"; return 1; }
}

check kernel_is_preempt_rt kernel_is_realtime
check core_1_is_isolated core_is_isolated
check package_is_installed install_it
check configuration_is_good configure_it
check simulator_runs start_simulator
check service_starts systemctl start pokeysd
check realtime_thread_is_fifo_80_on_core_1 thread_is_fifo_on_core_1
check memory_is_locked memory_is_locked
check daemon_is_not_root is_not_root
check device_is_found_and_runs within 20 fresh
check linuxcnc_runs_and_sees_the_device start_linuxcnc
check linuxcnc_is_realtime servo_thread_is_fifo
check output_follows_its_pin output_follows
check input_reaches_its_pin input_follows
check guard_is_on_and_seen guard_is_seen
check killed_guard_comes_again guard_comes_again
check stopped_guard_leaves_nothing guard_goes
check reload_configures_the_device reload_configures
check killed_daemon_comes_again again KILL
check hung_daemon_is_found_by_the_watchdog again STOP
check watchdog_is_in_the_journal watchdog_was_it
check cyclictest_beside_it latency
check outputs_are_safe_when_linuxcnc_dies linuxcnc_dies
check service_stops systemctl stop pokeysd
check nothing_is_left nothing_is_left
journalctl --no-pager -u pokeysd -u pokeys-guard >/out/journal
echo end
