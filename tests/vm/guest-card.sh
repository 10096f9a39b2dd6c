#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-or-later
# What happens inside a virtual machine with network cards: interrupts, NAPI contexts,
# queues, and an XDP of the driver's own (virtio-net) or none (e1000e), which a pair of
# veth has not.
#
# near0 and near1 are the cards here, wire0 and wire1 the other ends of their cables, in
# a name space "far" with the simulated device. It is plugged into the one cable or the
# other: its address moves. What each card made of it is noted in the results; times mean
# nothing here. Nothing depends on the kernel being Debian 12's: a newer one polls.
. /in/lib.sh

here=10.77.0.1 address=10.77.0.2 stranger=10.77.0.66
flood=500
near=near0 wire=wire0

exec 3>&1
note() { echo "note $*" >&3; }		# from within a check, whose output is not shown
far() { ip netns exec far "$@"; }
monitor() { echo "$*" >/dev/virtio-ports/monitor; }
driver() { basename "$(readlink "/sys/class/net/$1/device/driver")"; }
counter() { pokeys-guard status | awk -v name="$1" '$1 == name { print $2 }'; }
diag() { status | grep -o "\"$1\":[^,}]*" | head -n 1 | cut -d: -f2 | tr -d '"'; }
vectors() { # the numbers of a card's interrupts; a virtio device's are one folder up
	local folder=/sys/class/net/$1/device
	[ -d "$folder/msi_irqs" ] || folder=$folder/..
	ls "$folder/msi_irqs"
}
interrupts() { # of a card so far: all its vectors, both processors
	awk -v wanted=" $(vectors "$1" | tr '\n' ' ')" '
		index(wanted, " " ($1 + 0) " ") { sum += $2 + $3 } END { print sum + 0 }' /proc/interrupts
}
polled() { # packets that were taken in by polling a card, not by an interrupt
	awk '$1 == "TcpExt:" && !n { for (i = 2; i <= NF; i++) if ($i == "BusyPollRxPackets") n = i; next }
		$1 == "TcpExt:" { print $n }' /proc/net/netstat
}

# In the journal of a unit since it was started last.
said() {
	journalctl --no-pager -o cat "_SYSTEMD_INVOCATION_ID=$(systemctl show -P InvocationID "$1")" |
		grep -q -e "$2"
}
says() { # UNIT TEXT: before long
	within 120 said "$1" "$2" && return
	journalctl --no-pager -o cat -n 3 -u "$1" | tr '\n' '|'
	return 1
}

name_cards() {
	local at name
	for at in /sys/class/net/*; do
		case $(cat "$at/address") in
		52:54:00:00:00:01) name=near0 ;;
		52:54:00:00:00:02) name=wire0 ;;
		52:54:00:00:00:03) name=near1 ;;
		52:54:00:00:00:04) name=wire1 ;;
		*) continue ;;
		esac
		ip link set "${at##*/}" name $name || return 1
	done
	[ "$(driver near0) $(driver near1)" = "virtio_net e1000e" ] || { echo "other drivers"; return 1; }
}
lay_cables() {
	ip netns add far && ip link set wire0 netns far && ip link set wire1 netns far &&
		far ip link set lo up && far ip link set wire0 up && far ip link set wire1 up &&
		ip link set near0 up && ip link set near1 up
}
# Both ends of the cable get their addresses. The stranger is what others there send from.
plug() {
	ip address flush dev near0 && ip address flush dev near1 &&
		far ip address flush dev wire0 && far ip address flush dev wire1 &&
		ip address add $here/24 dev "$near" &&
		far ip address add $address/24 dev "$wire" &&
		far ip address add $stranger/24 dev "$wire" &&
		far ip route replace $here dev "$wire" src $stranger
}

trouble() { # into a file: what the network looks like
	{
		ip -s link && ip address && ip neighbour && ip route
		far ip -s link && far ip address && far ip neighbour && far ip route
		pokeys-guard status
		pokeysctl status
		journalctl --no-pager -n 60
	} >"/out/trouble-$near" 2>&1
}
# restart TRANSPORT MODE: guard and daemon anew at the card in use, everything fresh
restart() {
	systemctl stop pokeysd pokeys-guard
	cat >/etc/pokeysd/pokeysd.conf <<-CONF
		[daemon]
		cpu = 1
		group = pokeys
		period-us = 4000
		busy-poll-us = 4000
		interface = $near
		guard = dedicated
		transport = $1
		mode = $2

		[device $name]
		address = $address
		stale-after-ms = 2000
		lost-after-ms = 5000
		deadline-floor-us = 20000
	CONF
	systemctl start pokeys-guard || { journalctl -o cat -n 1 -u pokeys-guard; return 1; }
	systemctl start pokeysd || { journalctl -o cat -n 1 -u pokeysd; return 1; }
	within 180 fresh || { trouble; return 1; }
}

guard_is() { # MODE WORD_OF_IP
	local mode
	mode=$(counter mode)
	[ "$mode" = "$1" ] || { echo "it is $mode"; return 1; }
	ip -o link show dev "$near" | grep -q " $2" || { ip -o link show dev "$near"; return 1; }
	says pokeysd "guarded ($1 XDP)"
}
grows() { # COUNTER of the guard: by two hundred
	local before
	before=$(counter "$1")
	within 180 eval '[ "$(counter '"$1"')" -ge '$((before + 200))' ]' && return
	trouble
	echo "$1 stays at $(counter "$1")"
	return 1
}
flood_is_dropped() {
	local before
	before=$(counter drop_else)
	far bash -c "exec 3>/dev/udp/$here/9; for ((i = 0; i < $flood; i++)); do printf x >&3; done"
	within 120 eval '[ "$(counter drop_else)" -ge '$((before + flood))' ]' ||
		{ echo "$(($(counter drop_else) - before)) of $flood"; return 1; }
	note "$near: $(($(counter drop_else) - before)) packets of others dropped, $flood sent"
	within 180 fresh
}
# The driver refuses for one setting; the guard says which may be meant, and mended it is native.
refusal_is_told() {
	ip link set near0 mtu 9000 && systemctl restart pokeys-guard || return 1
	says pokeys-guard "on near0, generic (the driver refuses XDP" &&
		says pokeys-guard "near0: dmesg says what.*ip link set near0 mtu 1500" && guard_is generic xdpgeneric && grows pass_device || return 1
	ip link set near0 mtu 1500 && systemctl restart pokeys-guard && guard_is native xdp
}

polls_rings() { [ "$(printf '%s\n6.9\n' "$(uname -r)" | sort -V | head -n 1)" = 6.9 ]; }
mode_auto_is_said() {
	if polls_rings; then
		says pokeysd "mode is napi.*near0 can be polled"
	else
		says pokeysd "mode is sleep: this kernel's io_uring cannot poll a card (Linux 6.9 can)"
	fi
}
mode_napi_is_said() {
	if polls_rings; then
		says pokeysd "mode is napi (polls the card for up to"
	else
		says pokeysd "mode is sleep instead of napi: this kernel's io_uring cannot poll a card"
	fi
}
# Into the results: what half a thousand cycles and their replies cost this card.
note_cost() {
	local irq poll cycle
	irq=$(interrupts "$near") poll=$(polled) cycle=$(diag cycle)
	within 120 eval '[ "$(diag cycle)" -ge '$((cycle + 500))' ]' || return 1
	irq=$(($(interrupts "$near") - irq)) poll=$(($(polled) - poll)) cycle=$(($(diag cycle) - cycle))
	[ $irq -gt 0 ] || { echo "no interrupt of $near in $cycle cycles"; return 1; }
	note "$near: $(driver "$near"), $(diag transport), mode $1: $cycle cycles," \
		"$irq interrupts, $poll packets polled"
}
socket_is_said() {
	says pokeysd "pass the kernel's network stack by (AF_XDP, \(copied once\|zero-copy\)" &&
		pokeysctl status | grep -q 'xdp \(copy\|zero-copy\)' && grows pass_socket
}
link_goes_and_comes() { # COMMAND_DOWN COMMAND_UP
	eval "$1" && within 120 eval '! fresh' || return 1
	eval "$2" && within 180 fresh && return
	trouble
	return 1
}

finding() { # CHECK: its two lines for the card or the device here
	pokeysctl doctor | grep -A 1 -E "^[a-z]+ +$1 +($near|$name):"
}
finds() { # VERDICT CHECK
	finding "$2" | grep -q "^$1 " || { finding "$2" | head -n 1; return 1; }
}
# What the doctor advises is pasted, and it is content.
mends() { # CHECK...
	local command each
	for each in "$@"; do
		finds advice "$each" || return 1
		command=$(finding "$each" | sed -n 's/^ *-> //p')
		note "$(finding "$each" | head -n 1 | tr -s ' '), mended by: $command"
		eval "$command" || { echo "does not work: $command"; return 1; }
		finds ok "$each" || return 1
	done
}
all_to_core_1() {
	local irq
	for irq in $(vectors "$near"); do
		echo 1 >"/proc/irq/$irq/smp_affinity_list" || return 1
	done
	note "$near: $(vectors "$near" | wc -l) interrupts of its own"
}

check kernel_is_preempt_rt kernel_is_realtime
check package_is_installed install_it
check cards_are_there name_cards
check cables_are_laid lay_cables
check device_is_at_virtio plug
check service_may_be_slow isolate_daemon
check simulator_runs start_simulator --property=CPUAffinity=0 \
	--property=NetworkNamespacePath=/run/netns/far

check virtio_runs restart auto auto
check virtio_guard_is_native guard_is native xdp
check virtio_device_passes grows pass_device
check virtio_flood_is_dropped flood_is_dropped
check virtio_mode_auto_is_said mode_auto_is_said
check virtio_cost note_cost auto
check virtio_refusal_of_xdp_is_told refusal_is_told
check virtio_interrupts_to_core_1 all_to_core_1
check virtio_doctor_mends mends nic-interrupts nic-offloads neighbour
check virtio_link_down_and_up link_goes_and_comes 'ip link set near0 down' 'ip link set near0 up'
check virtio_cable_out_and_in link_goes_and_comes 'monitor set_link near0 off' 'monitor set_link near0 on'

check virtio_runs_with_napi restart io_uring napi
check virtio_mode_napi_is_said mode_napi_is_said
check virtio_cost_with_napi note_cost napi

check virtio_runs_with_xdp restart xdp auto
check virtio_replies_go_into_the_socket socket_is_said
check virtio_cost_with_xdp note_cost auto
check virtio_xdp_link_down_and_up link_goes_and_comes 'ip link set near0 down' 'ip link set near0 up'
check virtio_replies_go_into_the_socket_again grows pass_socket
check virtio_xdp_cable_out_and_in link_goes_and_comes 'monitor set_link near0 off' \
	'monitor set_link near0 on'
check virtio_replies_go_into_the_socket_once_more grows pass_socket

near=near1 wire=wire1
check device_is_at_e1000e plug
check e1000e_runs restart xdp auto
check e1000e_guard_is_generic guard_is generic xdpgeneric
check e1000e_missing_xdp_is_told says pokeys-guard "on near1, generic (this driver has no XDP"
check e1000e_device_passes grows pass_device
check e1000e_flood_is_dropped flood_is_dropped
check e1000e_has_no_af_xdp says pokeysd "transport is io_uring, for the interface's driver has no XDP"
check e1000e_cost note_cost auto
check e1000e_interrupts_to_core_1 all_to_core_1
check e1000e_doctor_mends mends nic-interrupts nic-coalescing nic-offloads neighbour
check e1000e_link_down_and_up link_goes_and_comes 'ip link set near1 down' 'ip link set near1 up'
check e1000e_cable_out_and_in link_goes_and_comes 'monitor set_link near1 off' 'monitor set_link near1 on'
uname -r >/out/kernel
pokeysctl doctor >/out/doctor
journalctl --no-pager >/out/journal
echo end
