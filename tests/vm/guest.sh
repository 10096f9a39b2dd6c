#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-or-later
# What happens inside the virtual machine of two processors, as root, once it is up:
# the whole installed thing under systemd, on an isolated core.
#
# Only whether things happen is checked, never how fast: emulated processors that
# share a host's mean nothing in time. guest-timing.sh is for that.
. /in/lib.sh

configure_it() {
	isolate_daemon || return 1
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

core_is_isolated() { [ "$(cat /sys/devices/system/cpu/isolated)" = 1 ]; }

thread_is_fifo_on_core_1() {
	local class priority core
	read -r class priority core < <(realtime_thread) || { echo "no SCHED_FIFO thread"; return 1; }
	[ "$priority $core" = "80 1" ] || { echo "$class $priority on core $core"; return 1; }
}

memory_is_locked() { [ "$(awk '/^VmLck/ { print $2 }' "/proc/$(main_pid)/status")" -gt 0 ]; }
is_not_root() { [ "$(ps -o user= -p "$(main_pid)")" = pokeys ]; }

# LinuxCNC puts it on the isolated core of the highest number by itself.
servo_thread_is_on_core_1() {
	local cores
	cores=$(ps -L -o cls=,psr= -p "$(servo_pid)" | awk '$1 == "FF" { print $2 }' | sort -u | tr '\n' ' ')
	[ "$cores" = "1 " ] || { echo "on: $cores"; return 1; }
}

output_is() { pokeys-sim --ctl $sim pin 31 | grep -qx "latch=$1"; }
output_follows() {
	as_cnc halcmd setp pokeys.0.pin.30.out 1 && within 120 output_is 1 || return 1
	as_cnc halcmd setp pokeys.0.pin.30.out 0 && within 120 output_is 0
}
input_follows() {
	pokeys-sim --ctl $sim pin 13 0 && within 120 pin_is pin.12.in FALSE || return 1
	pokeys-sim --ctl $sim pin 13 1 && within 120 pin_is pin.12.in TRUE
}

# again WAY SIGNAL: the daemon is hit, systemd starts it anew, the pins live again, LinuxCNC never noticed
again() {
	local before servo
	before=$(main_pid)
	servo=$(servo_pid) || { echo "LinuxCNC does not run"; return 1; }
	kill "-$1" "$before"
	within 180 eval '[ "$(main_pid)" != '"$before"' ] && systemctl is-active pokeysd' || return 1
	within 240 fresh && within 120 pin_is connected TRUE || return 1
	[ "$(servo_pid)" = "$servo" ] || { echo "LinuxCNC was restarted as well"; return 1; }
}

# A key is changed, systemctl reload brings it into the device.
reload_configures() {
	sed -i 's/^digital-outputs.*/digital-outputs = 31-34, 20/; s/^\[device.*/&\ndigital-inputs = 21/' \
		/etc/pokeysd/pokeysd.conf
	systemctl reload pokeysd || return 1
	within 240 eval 'pokeys-sim --ctl $sim pin 21 | grep -qx function=0x02'
}

# The unit's capabilities and system calls suffice, on this kernel, and the group can see it.
guarded() { status | grep -q '"guard":true'; }
guard_is_seen() {
	systemctl start pokeys-guard || { journalctl -o cat -u pokeys-guard | head -n 20 >/out/guard; return 1; }
	within 240 guarded && within 240 fresh || return 1
	as_cnc pokeys-guard status | grep -q '^pass_device [1-9]' || { echo "cnc sees no packets"; return 1; }
}
guard_comes_again() {
	local before
	before=$(systemctl show -P MainPID pokeys-guard)
	[ "$before" != 0 ] || { echo "it does not run"; return 1; }
	kill -KILL "$before"
	within 180 eval '[ "$(systemctl show -P MainPID pokeys-guard)" != '"$before"' ] &&
		systemctl is-active pokeys-guard' || return 1
	within 180 guarded && within 240 fresh
}
guard_goes() {
	systemctl stop pokeys-guard || return 1
	within 180 eval '! guarded' || return 1
	[ ! -e /sys/fs/bpf/pokeysd ] || { echo "pins are left"; return 1; }
	within 240 fresh
}

# As it is installed: the confinement of its unit suffices, and the daemon's end is none of its own.
page_of() { python3 -c "import sys, urllib.request; print(urllib.request.urlopen(sys.argv[1]).read().decode())" \
	"http://127.0.0.1:8580/$1"; }
gateway_shows() { page_of metrics | grep -qx "pokeys_up{device=\"$name\"} 1.0"; }
gateway_shows_the_device() {
	mkdir /tmp/decoy && cp /bin/sleep /tmp/decoy/pokeysd && { /tmp/decoy/pokeysd 100000 >/dev/null 2>&1 & echo $! >/tmp/decoy.pid; }
	printf '[Service]\nRuntimeMaxSec=180\n' >/tmp/slow.conf &&
		install -D -m 644 /tmp/slow.conf /etc/systemd/system/pokeys-doctor@.service.d/slow.conf && systemctl daemon-reload
	# loading Python's modules takes this computer half a minute of its own, and more of the host's
	printf '[Service]\nTimeoutStartSec=600\n' >/tmp/gateway-slow.conf && install -D -m 644 /tmp/gateway-slow.conf \
		/run/systemd/system/pokeys-gateway.service.d/slow.conf && systemctl daemon-reload
	systemctl start pokeys-gateway || { journalctl -o cat -u pokeys-gateway | tail -n 20 >/out/gateway; return 1; }
	within 240 gateway_shows || { page_of healthz >/out/gateway; return 1; }
	page_of "api/devices/$name" | grep -q '"joint.00.counts"'
}
gateway_may_do_nothing() {
	local pid
	pid=$(systemctl show -P MainPID pokeys-gateway)
	[ "$(ps -o user= -p "$pid")" = pokeys-gateway ] || ps -o user= -p "$pid" | grep -qx 'pokeys-+' || return 1
	grep -qx 'CapEff:	0000000000000000' "/proc/$pid/status" || return 1
	systemctl is-enabled pokeys-gateway && { echo "it is enabled by itself"; return 1; }
	! nsenter -t "$pid" -m -S "$(id -u pokeys-gateway)" -G "$(id -g pokeys-gateway)" touch /run/pokeysd/x 2>/dev/null
}
# The gateway sends the record of the killed daemon, from the daemon's folder, and one of the last seconds.
fetch() { python3 -c "import sys, urllib.request; urllib.request.urlretrieve(*sys.argv[1:])" "http://127.0.0.1:8580/$1" "$2"; }
gateway_gives_records() {
	local died
	within 240 eval 'page_of api/records | grep -q "the daemon died"' || { page_of api/records; return 1; }
	died=$(page_of api/records | grep -o 'pokeysd-[0-9TZ]*-died.pcapng' | head -n 1)
	fetch "api/records/$died" /tmp/died.pcapng && cmp /tmp/died.pcapng "/var/log/pokeysd/$died" || return 1
	fetch "api/devices/$name/record" /tmp/now.pcapng && pokeysctl replay /tmp/now.pcapng | grep -q "^[0-9]"
}
# It sees hardly anything itself; the doctor's unit sees the other processes, and who holds the device.
# The pokeysd that is no daemon has been there since before the daemon was started again.
gateway_asks_the_doctor() {
	within 240 doctor_sees_all
	local seen=$?
	kill "$(cat /tmp/decoy.pid)"
	[ $seen = 0 ] || cat /tmp/doctor.log
	return $seen
}
doctor_sees_all() {
	python3 - >/tmp/doctor.log 2>&1 <<-PYTHON
		import json, urllib.request
		ask = urllib.request.Request("http://127.0.0.1:8580/api/doctor", method="POST")
		found = json.load(urllib.request.urlopen(ask))
		verdicts = {one["check"]: one["verdict"] for one in found["findings"]}
		print(found)
		assert not found["limited"] and verdicts["isolcpus"] == "ok" and verdicts["kernel"] == "ok", verdicts
		wrong = [name for name in ("dma-latency", "daemon", "daemon-thread", "memory-lock", "priority", "route",
		                           "linuxcnc-core") if verdicts[name] in ("unknown", "problem")]
		assert not wrong, wrong
	PYTHON
}
# The console: a pseudoterminal in the unit's own folder, files in the folder of its state. With the drop-in of
# docs/console.md, a serial port, and a group that may open the pseudoterminal.
console_says() { timeout 20 python3 - "$@" <<-PYTHON
	import os, socket, sys
	where, line, wanted = sys.argv[1:]
	if where.startswith("/"):
	    fd = os.open(where, os.O_RDWR | os.O_NOCTTY)
	    send, take = (lambda data: os.write(fd, data)), (lambda: os.read(fd, 4096))
	else:
	    one = socket.create_connection(("127.0.0.1", int(where)))
	    send, take = one.sendall, (lambda: one.recv(4096))
	send(line.encode() + b"\\n")
	said = b""
	while not said.endswith(b"\\n"):
	    said += take()
	print(where, line, said, flush=True)
	sys.exit(wanted not in said.decode())
	PYTHON
}
gateway_has_a_console() {
	console_works && return
	journalctl -o cat -u pokeys-gateway | tail -n 20 >>/out/console
	return 1
}
console_works() {
	runuser -u pokeys-gateway -- mkdir /var/lib/pokeys-gateway/files || return 1
	printf '%s\n' '[telnet]' 'listen = 127.0.0.1:2323' '[esp3d]' 'listen = 127.0.0.1:8581' \
		'folder = /var/lib/pokeys-gateway/files' '[console]' 'level = user' '[pty]' \
		'path = /run/pokeys-gateway/printer' >/etc/pokeysd/gateway.conf
	cp /etc/pokeysd/gateway.conf /tmp/gateway.conf
	printf '%s\n' '[machine]' 'kind = pokeys' >>/etc/pokeysd/gateway.conf
	systemctl restart pokeys-gateway && within 240 console_says 2323 '?' "echo:$name: connected" >>/out/console &&
		console_says 2323 '[ESP730]create=/part.gcode' ok && console_says /run/pokeys-gateway/printer M105 ok &&
		[ -f /var/lib/pokeys-gateway/files/part.gcode ] || return 1
	mkdir -p /etc/systemd/system/pokeys-gateway.service.d
	printf '%s\n' '[Service]' PrivateDevices=no PrivateUsers=no 'DeviceAllow=char-ttyS rw' SupplementaryGroups=dialout \
		>/etc/systemd/system/pokeys-gateway.service.d/port.conf
	printf '%s\n' 'group = dialout' '[machine]' 'port = /dev/ttyS1' >>/tmp/gateway.conf
	cp /tmp/gateway.conf /etc/pokeysd/gateway.conf
	systemctl daemon-reload && systemctl restart pokeys-gateway &&
		within 240 console_says 2323 '[ESP900]' 'ENABLED - /dev/ttyS1' >>/out/console || return 1
	within 240 eval 'journalctl -o cat -u pokeys-gateway | grep -q "/dev/ttyS1: connected, 115200 baud"' || return 1
	[ "$(stat -L -c %G /run/pokeys-gateway/printer)" = dialout ] || return 1
	rm -r /etc/systemd/system/pokeys-gateway.service.d /etc/pokeysd/gateway.conf
	systemctl daemon-reload && systemctl restart pokeys-gateway
}
gateway_goes() { within 240 gateway_shows && systemctl stop pokeys-gateway && ! page_of metrics 2>/dev/null; }

watchdog_was_it() { journalctl -u pokeysd --no-pager | grep -i watchdog; }

# Histograms are brought out for whoever runs this on real hardware; here they say nothing.
latency() {
	timeout 120 stress-ng --cpu 1 --taskset 0 --timeout 20 --quiet &
	timeout 60 cyclictest -q -m -t 1 -a 1 -p 70 -i 1000 -D 6 --json=/out/cyclictest.json >/dev/null || return 1
	timeout 60 pokeysctl latency --seconds 6 --svg /out/latency.svg --json >/out/latency.json || return 1
	wait
	grep -q '"num_threads": 1' /out/cyclictest.json && within 120 fresh && status >/out/status.json
}

# After the daemon was killed, the outputs are held until machine-on rises.
switch_on() {
	as_cnc halcmd setp pokeys.0.machine-is-on 0 && sleep 1 &&
		as_cnc halcmd setp pokeys.0.machine-is-on 1 && sleep 1 && pin_is outputs-held FALSE
}
linuxcnc_dies() {
	within 120 pin_is outputs-held TRUE && output_is 0 || { echo "outputs are not held"; return 1; }
	as_cnc halcmd setp pokeys.0.pin.30.out 1 && within 120 switch_on && within 120 output_is 1 || return 1
	kill -KILL "$(servo_pid)"
	within 120 output_is 0
}

# Killed, and no other one comes that would take the folder: the file has a fault by now; or
# it is stopped before there is one.
nothing_looks_like_a_daemon() {
	local left
	left=$(find /run/pokeysd -mindepth 1 ! -name 'recorder*')
	[ -z "$left" ] || { echo "left: $(head -n 3 <<<"$left" | tr '\n' ' ')"; return 1; }
}
ended_for_its_configuration() {
	systemctl is-failed pokeysd && [ "$(systemctl show -P ExecMainStatus pokeysd)" = 78 ]
}
killed_for_good() {
	sed -i '1i nonsense' /etc/pokeysd/pokeysd.conf
	kill -KILL "$(main_pid)"
	within 180 ended_for_its_configuration || return 1
	nothing_looks_like_a_daemon || return 1
	sed -i 1d /etc/pokeysd/pokeysd.conf
	systemctl start pokeysd && within 240 fresh || return 1
	kill -KILL "$(main_pid)"
	systemctl stop pokeysd && nothing_looks_like_a_daemon || return 1
	systemctl start pokeysd && within 240 fresh
}

# Once it has written what a killed one had recorded: that stays for the next start otherwise.
service_stops() {
	within 240 fresh && within 240 [ ! -e /run/pokeysd/recorder.died ] && systemctl stop pokeysd
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
check simulator_runs start_simulator --property=CPUAffinity=0
check service_starts systemctl start pokeysd
check realtime_thread_is_fifo_80_on_core_1 thread_is_fifo_on_core_1
check memory_is_locked memory_is_locked
check daemon_is_not_root is_not_root
check device_is_found_and_runs within 240 fresh
check linuxcnc_runs_and_sees_the_device start_linuxcnc 10000000
check linuxcnc_is_realtime servo_thread_is_fifo
check servo_thread_is_on_core_1 servo_thread_is_on_core_1
check output_follows_its_pin output_follows
check input_reaches_its_pin input_follows
check guard_is_on_and_seen guard_is_seen
check killed_guard_comes_again guard_comes_again
check stopped_guard_leaves_nothing guard_goes
check gateway_shows_the_device gateway_shows_the_device
check gateway_may_do_nothing_else gateway_may_do_nothing
check gateway_has_a_console gateway_has_a_console
check reload_configures_the_device reload_configures
check killed_daemon_comes_again again KILL
check hung_daemon_is_found_by_the_watchdog again STOP
check watchdog_is_in_the_journal watchdog_was_it
check gateway_gives_records gateway_gives_records
check gateway_asks_the_doctor gateway_asks_the_doctor
check gateway_goes_on_and_stops gateway_goes
check cyclictest_beside_it latency
check outputs_are_safe_when_linuxcnc_dies linuxcnc_dies
check killed_for_good_leaves_no_daemon_to_be_seen killed_for_good
check service_stops service_stops
check nothing_is_left nothing_is_left
journalctl --no-pager -u pokeysd -u pokeys-guard -u pokeys-gateway -u 'pokeys-doctor@*' >/out/journal
echo end
