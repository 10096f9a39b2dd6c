#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-or-later
# What happens inside a virtual machine whose user installs the packages: the first start, what the
# doctor fixes and takes back, an upgrade while a machine is on and while it is off, removal, purge.
. /in/lib.sh

export DEBIAN_FRONTEND=noninteractive
names="pokeysd pokeys-tools linuxcnc-pokeys libpokeys-shm0 python3-pokeys pokeys-gateway pokeys-remote
libpokeys-shm-dev"

# All that is in the file system, but for what changes by itself.
inventory() {
	find / -xdev \( -path /proc -o -path /sys -o -path /dev -o -path /tmp -o -path /in -o -path /out -o -path /root \
		-o -path /var/cache -o -path /var/lib/apt -o -path /var/lib/dpkg -o -path /var/lib/systemd \
		-o -path /var/log/journal -o -path /var/log/apt -o -path '*/__pycache__' -o -user cnc \) -prune -o \
		! -path '/var/log/dpkg.log' ! -path '/var/log/alternatives.log' ! -path '*.pyc' ! -path '/etc/*-' \
		! -path '/etc/ld.so.cache' ! -path '/var/backups/*' -print | sort
	find /run /dev/shm -mindepth 1 -maxdepth 2 \( -path '*pokeys*' -o -path '*iox*' \) | sort
}

install_from() {
	apt-get install -y -q --no-install-recommends "$1"/*.deb >/out/apt 2>&1 || { tail -n 5 /out/apt; return 1; }
}

nothing_runs_by_itself() {
	local unit
	for unit in pokeysd pokeys-guard pokeys-gateway; do
		[ "$(systemctl is-enabled $unit)" = disabled ] && ! systemctl --quiet is-active $unit ||
			{ echo "$unit: $(systemctl is-enabled $unit) $(systemctl is-active $unit)"; return 1; }
	done
}

configure_it() {
	usermod -a -G pokeys,pokeys-monitor cnc && starts_may_take_long || return 1
	mkdir -p /etc/systemd/system/pokeysd.service.d /etc/systemd/system/pokeys-gateway.service.d
	printf '[Service]\nWatchdogSec=60\n' >/etc/systemd/system/pokeysd.service.d/slow.conf
	printf '[Service]\nTimeoutStartSec=600\n' >/etc/systemd/system/pokeys-gateway.service.d/slow.conf
	systemctl daemon-reload
	pokeysctl discover --config --timeout 5000 --address 127.0.0.1 >/out/found.conf || return 1
	# an emulated second takes several
	sed "s/^\[device .*/[device $name]/; s/^; heartbeat-timeout-ms.*/heartbeat-timeout-ms = 3000/" /out/found.conf |
		sed "s/^heartbeat-timeout-ms.*/&\nstale-after-ms = 3000\nlost-after-ms = 8000\ndeadline-floor-us = 20000/" |
		sed 's/^\[daemon\]/&\ninterface = lo\nperiod-us = 4000/' >/etc/pokeysd/pokeysd.conf
	pokeysd --check-config
}

monitor_reads() { # as somebody who may only read
	useradd --no-create-home --groups pokeys-monitor watcher
	runuser -u watcher -- pokeysctl get "$name" info.SerialNumber || return 1
	! runuser -u watcher -- pokeysctl output "$name" 31 on --for 1 >/out/refused 2>&1 && grep -qi "group\|permi" /out/refused ||
		{ cat /out/refused; return 1; }
}

listens_to_itself_only() {
	systemctl start pokeys-gateway && within 300 eval "ss -Hltnp | grep -q pokeys-gateway" || return 1
	local far
	far=$(ss -Hltn | awk '$4 !~ /^(127\.|\[::1\])/')
	[ -z "$far" ] || { echo "$far"; return 1; }
}

# The exposure of each unit, in tenths.
is_confined() {
	local unit most
	for unit in pokeysd:20 pokeys-guard:20 pokeys-gateway:20; do
		most=${unit#*:} unit=${unit%:*}
		systemd-analyze --no-pager security --threshold="$most" $unit.service >/out/security.$unit ||
			{ tail -n 1 /out/security.$unit; return 1; }
	done
}

# GRUB as an installation leaves it, with a kernel to boot.
set_up_grub() {
	mkdir -p /boot/grub /etc/default && cp /usr/share/grub/default/grub /etc/default/grub &&
		touch /boot/vmlinuz-6.1.0-1-rt-amd64 && update-grub && grep -q vmlinuz-6.1.0-1-rt-amd64 /boot/grub/grub.cfg
}

in_grub() { grep -q "vmlinuz-6.1.0-1-rt-amd64.* $1" /boot/grub/grub.cfg; }
timers_migrate() { cat /proc/sys/kernel/timer_migration; }

doctor_fixes() {
	local file
	pokeysctl doctor --fix --yes >/out/fix 2>&1 || { tail -n 1 /out/fix; return 1; }
	for file in pokeysd/pokeysd.conf.d/90-doctor-cpu.conf default/grub.d/pokeysd-isolation.cfg \
		default/grub.d/pokeysd-interrupts.cfg sysctl.d/90-pokeysd-timers.conf; do
		grep -q "Written by pokeysctl doctor --fix" /etc/$file || { echo "no $file"; return 1; }
	done
	in_grub "isolcpus=managed_irq,domain,1 nohz_full=1 rcu_nocbs=1" && in_grub irqaffinity=0 ||
		{ grep vmlinuz /boot/grub/grub.cfg; return 1; }
	[ "$(timers_migrate)" = 0 ] || { echo "timer_migration is $(timers_migrate)"; return 1; }
	pokeysd --check-config && systemctl restart pokeysd && within 240 fresh &&
		[ "$(realtime_thread | awk '{ print $3 }')" = 1 ] || { realtime_thread; return 1; }
}

doctor_undoes() {
	pokeysctl doctor --undo --yes >/out/undo 2>&1 || { tail -n 1 /out/undo; return 1; }
	! in_grub isolcpus= && ! in_grub irqaffinity= && [ "$(timers_migrate)" = 1 ] ||
		{ echo "timer_migration $(timers_migrate), $(grep vmlinuz /boot/grub/grub.cfg)"; return 1; }
	[ ! -e /etc/pokeysd/pokeysd.conf.d ] && ! grep -rq "pokeysctl doctor --fix" /etc || { echo "files are left"; return 1; }
	systemctl restart pokeysd && within 240 fresh
}

is_on() { systemctl show -P StatusText pokeysd | grep -q " on"; }
switch() { as_cnc halcmd setp pokeys.0.machine-is-on "$1"; }

upgrade_leaves_a_machine_that_is_on() {
	local before servo
	switch 0 && sleep 1 && switch 1 && within 120 is_on || { systemctl show -P StatusText pokeysd; return 1; }
	before=$(main_pid) servo=$(servo_pid)
	install_from /in/packages/next || return 1
	grep -q "not restarted, because a machine, a motor or a heater is on" /out/apt || { grep pokeysd: /out/apt; return 1; }
	[ "$(main_pid) $(servo_pid)" = "$before $servo" ] && is_on && within 120 fresh
}

upgrade_restarts_a_machine_that_is_off() {
	local before servo
	switch 0 && within 120 eval '! is_on' || return 1
	before=$(main_pid) servo=$(servo_pid)
	apt-get install -y -q --reinstall --no-install-recommends /in/packages/next/pokeysd_*.deb >/out/apt 2>&1 ||
		{ tail -n 3 /out/apt; return 1; }
	[ "$(main_pid)" != "$before" ] || { echo "it was not restarted"; return 1; }
	[ "$(servo_pid)" = "$servo" ] && within 240 fresh && within 120 pin_is connected TRUE
}

removal_stops_and_keeps() {
	systemctl stop linuxcnc
	echo "# mine" >>/etc/pokeysd/pokeysd.conf
	# shellcheck disable=SC2086
	apt-get remove -y -q $names >/out/apt 2>&1 || { tail -n 3 /out/apt; return 1; }
	! pgrep -x 'pokeysd|pokeys-gateway|pokeys-guard' && grep -q "# mine" /etc/pokeysd/pokeysd.conf &&
		[ -z "$(systemctl list-units --no-legend --all 'pokeys*' | grep -v sim)" ]
}

purge_leaves_nothing() {
	local left
	# the others had no configuration, so they are gone already
	left=$(dpkg-query -W -f='${db:Status-Status} ${Package}\n' '*pokeys*' | awk '$1 == "config-files" { print $2 }')
	# shellcheck disable=SC2086
	apt-get purge -y -q $left >/out/apt 2>&1 || { tail -n 3 /out/apt; return 1; }
	systemctl stop pokeys-sim
	rm -rf /etc/systemd/system/pokeys*.service.d $sim
	userdel watcher
	inventory >/out/after
	left=$(diff /out/before /out/after | grep '^[<>]')
	[ -z "$left" ] || { echo "left: $(head -n 5 <<<"$left" | tr '\n' ' ')"; return 1; }
}

check grub_is_set_up set_up_grub
inventory >/out/before
check packages_are_installed install_from /in/packages/first
check nothing_runs_by_itself nothing_runs_by_itself
check simulator_runs start_simulator
check configuration_is_drafted_and_good configure_it
check service_starts systemctl start pokeysd
check device_is_found_and_runs within 240 fresh
check doctor_fixes doctor_fixes
check doctor_undoes doctor_undoes
check linuxcnc_runs_and_sees_the_device start_linuxcnc 10000000
check guard_starts systemctl start pokeys-guard
check monitor_reads_and_no_more monitor_reads
check listens_to_itself_only listens_to_itself_only
check units_are_confined is_confined
check upgrade_leaves_a_machine_that_is_on upgrade_leaves_a_machine_that_is_on
check upgrade_restarts_a_machine_that_is_off upgrade_restarts_a_machine_that_is_off
check removal_stops_and_keeps_the_configuration removal_stops_and_keeps
check purge_leaves_nothing purge_leaves_nothing
journalctl --no-pager -u pokeysd -u pokeys-guard -u pokeys-gateway >/out/journal
echo end
