#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-or-later
# What happens inside the virtual machine of one processor that counts instructions:
# each takes 8 ns of its time, whatever the host does meanwhile. Two runs give the
# same times, so here, and only here, times are measured and held against each other.
#
# It is no model of a real processor: no caches, no memory that is slow, a timer
# interrupt that costs what emulating it costs. What it shows is how many instructions
# there are between a timer's expiry and the daemon's first own one, beside those of
# cyclictest on the same kernel, and in pokeys.0.read and .write.
#
# The processor does 125 million instructions a second. A simulated device and the
# network below it take more than a millisecond of that, so all have 4 ms. That is the
# kernel's own tick as well (HZ=250): what is begun every 4 ms has it in each of its turns
# or in none, and which of the two is chance. So wake-ups are measured in two starts each,
# the daemon's and cyclictest's, and LinuxCNC's functions with 3.9 ms.
. /in/lib.sh

configure_it() {
	cat >/etc/pokeysd/pokeysd.conf <<-CONF
		[daemon]
		period-us = 4000
		group = pokeys
		interface = lo
		recorder-seconds = 10

		[device $name]
		address = 127.0.0.1
		heartbeat-timeout-ms = 2000
		stale-after-ms = 2000
		lost-after-ms = 5000
		deadline-floor-us = 5000
	CONF
	pokeysd --check-config
}

# Above the load, below the daemon: a device does not wait for this machine's scheduler.
start_device() {
	start_simulator --property=CPUSchedulingPolicy=fifo --property=CPUSchedulingPriority=10
}

load_it() { systemd-run --quiet --unit=load stress-ng --cpu 1 --vm 1 --vm-bytes 16M --timeout 600 --quiet; }

# As the daemon's thread: same priority, period and scheduling class; one at a time,
# for two threads of one priority on one processor would measure each other.
sleeper() {
	local turn
	for turn in 1 2; do
		timeout 600 cyclictest -q -m -t 1 -p 80 -i 4000 -l 1500 -h 1000 \
			--histfile=/out/cyclictest-$turn.histogram >/dev/null
		[ -s /out/cyclictest-$turn.histogram ] || return 1
	done
}

# Its recorder has each cycle to the nanosecond, from its start on.
daemon_under_load() {
	local turn
	for turn in 1 2; do
		systemctl restart pokeysd && within 120 fresh || return 1
		sleep 6
		cp /run/pokeysd/recorder /out/recorder-$turn || return 1
	done
}

daemon_beside_the_tick() {
	sed -i 's/^period-us = 4000/period-us = 3900/' /etc/pokeysd/pokeysd.conf &&
		pokeysd --check-config && systemctl restart pokeysd && within 240 fresh
}

# Both at once, as somebody would do it on a machine of his own.
beside() {
	timeout 300 pokeysctl latency --seconds 2 --svg /out/latency.svg --json >/out/latency.json
	[ -s /out/latency.json ]
}

# Ticks of the processor's counter, one a nanosecond here.
funct_times() {
	local i
	for i in $(seq 25); do
		echo "$(pin read.time) $(pin write.time)"
	done >/out/hal-times
	[ "$(wc -l </out/hal-times)" = 25 ]
}

# Nothing older is in the lead: how long before a read the cycle must begin is counted anew.
daemon_anew() { systemctl restart pokeysd && within 240 fresh && within 240 pin_is connected TRUE; }

# At each read of the servo thread, on a machine that does nothing else: locked, and after
# 16 s of its own time, 4,000 cycles, for the lead is a quantile of some thousand.
ages_at_read() {
	within 240 pin_is phase-locked TRUE || return 1
	as_cnc halcmd loadrt sampler depth=2000 cfg=ff &&
		as_cnc halcmd net age pokeys.0.age-us sampler.0.pin.0 &&
		as_cnc halcmd net rtt pokeys.0.rtt-us sampler.0.pin.1 || return 1
	sleep 16
	as_cnc halcmd addf sampler.0 servo-thread && as_cnc halsampler -n 1500 >/out/ages || return 1
	pin_is phase-locked TRUE || { echo "the lock was lost"; return 1; }
	status >/out/locked.json
}

check kernel_is_preempt_rt kernel_is_realtime
check package_is_installed install_it
check configuration_is_good configure_it
check simulator_runs start_device
check load_runs load_it
check cyclictest_under_load sleeper
check daemon_under_load daemon_under_load
check latency_beside_it beside
check load_ends systemctl stop load
check daemon_beside_the_tick daemon_beside_the_tick
check linuxcnc_runs_and_sees_the_device start_linuxcnc 3900000
check linuxcnc_is_realtime servo_thread_is_fifo
check times_of_read_and_write funct_times
check daemon_anew daemon_anew
check ages_at_read ages_at_read
uname -r >/out/kernel
dmesg | grep -i 'tsc:' >/out/clock
journalctl --no-pager -u pokeysd >/out/journal
echo end
