#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Devices are found in networks as people set them up: addresses without a broadcast
address, labelled ones, two interfaces in one network, a device with another mask."""
import contextlib
import json
import pathlib
import sys

from house import House, equal, run, wait_for
from spaces import begin, ip, start_far

SERIAL = 54321


@contextlib.contextmanager
def cable(name, *ours, device=None):
    """Interface `name` of this computer with `ours` (words of ip address add), to a name
    space of that name, with this address at its end."""
    ip("netns", "add", name)
    try:
        ip("link", "add", name, "type", "veth", "peer", "name", "eth0", "netns", name)
        for words in ours:
            ip("address", "add", *words.split(), "dev", name)
        ip("link", "set", name, "up")
        if device:
            ip("-n", name, "address", "add", device, "dev", "eth0")
        ip("-n", name, "link", "set", "lo", "up")
        ip("-n", name, "link", "set", "eth0", "up")
        yield name
    finally:
        run("ip", "link", "delete", name)  # with the name space alone it goes some time later
        ip("netns", "delete", name)


def found(house, *options):
    """Serial number and address of each device that pokeysctl discover prints."""
    out = run(house.programs["pokeysctl"], "discover", "--json", "--timeout", "2000", *options)
    devices = json.loads(out.stdout)["devices"] if out.stdout else []
    return {(d["serial"], d["address"]) for d in devices} if devices else out.stderr


def is_found(name, address, *options):
    with House() as house:
        start_far(house, name, address, SERIAL)
        for more in ((), options):
            equal(found(house, *more), {(SERIAL, address)}, more)


def is_driven(name, address, **keys):
    """By its serial number alone."""
    with House(**{"discovery-interval-ms": 100, **keys}) as house:
        house.device_keys["mill"] = {"serial": SERIAL}
        start_far(house, name, address, SERIAL)
        house.start_daemon()
        house.wait_fresh("mill")


def test_an_address_that_was_added_without_a_broadcast_address():
    with cable("v0", "10.9.9.1/24", device="10.9.9.2/24"):
        assert "broadcast" not in json.loads(ip("-j", "address", "show", "v0"))[0]["addr_info"][0]
        is_found("v0", "10.9.9.2", "--interface", "v0")
        is_driven("v0", "10.9.9.2")


def test_a_second_address_with_a_label():
    with cable("v0", "10.9.7.1/24", "10.9.8.1/24 broadcast + label v0:pk", device="10.9.8.2/24"):
        is_found("v0", "10.9.8.2", "--interface", "v0")
        is_driven("v0", "10.9.8.2", interface="v0")


def test_two_interfaces_in_one_network():
    with cable("v0", "10.9.9.1/24"), cable("v1", "10.9.9.7/24", device="10.9.9.3/24"):
        is_found("v1", "10.9.9.3", "--interface", "v1")
        is_driven("v1", "10.9.9.3")
        is_driven("v1", "10.9.9.3", interface="v1")


def test_two_interfaces_at_one_switch():
    """The device sends its replies to either, as its ARP table happens to have them."""
    with cable("v0", "10.9.9.1/24"), cable("v1", "10.9.9.7/24"):
        ip("-n", "v1", "link", "set", "eth0", "name", "eth1")
        ip("-n", "v1", "link", "set", "eth1", "netns", "v0")
        ip("-n", "v0", "link", "add", "br0", "type", "bridge")
        for port in ("eth0", "eth1"):
            ip("-n", "v0", "link", "set", port, "master", "br0", "up")
        ip("-n", "v0", "address", "add", "10.9.9.3/24", "dev", "br0")
        ip("-n", "v0", "link", "set", "br0", "up")
        macs = [json.loads(ip("-j", "link", "show", name))[0]["address"] for name in ("v0", "v1")]
        with House(**{"discovery-interval-ms": 100}) as house:
            house.device_keys["mill"] = {"serial": SERIAL}
            start_far(house, "v0", "10.9.9.3", SERIAL)
            house.start_daemon()
            house.wait_fresh("mill")
            before = house.state("mill")["statistics"]["reconnects"]
            for mac in macs * 2:
                for ours in ("10.9.9.1", "10.9.9.7"):
                    ip("-n", "v0", "neighbour", "replace", ours, "lladdr", mac, "dev", "br0", "nud", "permanent")
                accepted = house.state("mill")["statistics"]["accepted"]
                wait_for("replies", lambda: house.state("mill")["statistics"]["accepted"] >  # pylint: disable=cell-var-from-loop
                         accepted + 500)  # pylint: disable=cell-var-from-loop
            equal(house.state("mill")["statistics"]["reconnects"], before, house.log())


def test_a_device_with_another_mask():
    with cable("v0", "10.9.9.1/24", device="10.9.9.2/16"):
        is_found("v0", "10.9.9.2", "--interface", "v0")


def test_who_was_asked_is_told_if_nobody_answers():
    with cable("v0", "10.9.9.1/24", "10.8.0.1/30"), House() as house:
        said = found(house)
        for words in ("no device answered", "v0 (10.9.9.1/24)", "10.9.9.255", "v0 (10.8.0.1/30)", "10.8.0.3",
                      "255.255.255.255", "from UDP port", "power and cable"):
            assert words in said, (words, said)
    with House() as house:
        assert "no interface but loopback is up" in found(house)


def test_an_address_without_a_network():
    with cable("v0", "10.9.9.1/32", device="10.9.9.2/24"):
        ip("route", "add", "10.9.9.2/32", "dev", "v0")
        is_found("v0", "10.9.9.2", "--interface", "v0")


def test_an_interface_without_broadcasts_is_told():
    made = run("ip", "tuntap", "add", "t0", "mode", "tun")
    if made.returncode:
        print(f"  not tried: no such interface here: {made.stderr.strip()}")
        return
    try:
        ip("address", "add", "10.7.0.1/30", "dev", "t0")
        ip("link", "set", "t0", "up")
        with House() as house:
            said = found(house)
        assert "not asked at t0 (10.7.0.1/30): it cannot send broadcasts; use --address" in said, said
    finally:
        ip("link", "delete", "t0")


@contextlib.contextmanager
def firewall(name):
    """Answers that come in at this interface are dropped. By routing rules, which every kernel has."""
    ip("rule", "add", "pref", "10", "lookup", "local")
    ip("rule", "delete", "pref", "0")
    ip("rule", "add", "pref", "5", "iif", name, "ipproto", "udp", "sport", "20055", "blackhole")
    try:
        yield
    finally:
        ip("rule", "delete", "pref", "5")
        ip("rule", "add", "pref", "0", "lookup", "local")
        ip("rule", "delete", "pref", "10")


def test_an_answer_that_this_computer_drops_is_told():
    with cable("v0", "10.9.9.1/24", device="10.9.9.3/24"), House() as house:
        start_far(house, "v0", "10.9.9.3", SERIAL)
        with firewall("v0"):
            said = found(house)
        assert "10.9.9.3 has answered, but this computer dropped the answer" in said, said
        assert "firewall" in said and "address = 10.9.9.3" in said and "power" not in said, said
        equal(found(house), {(SERIAL, "10.9.9.3")})


def test_the_daemon_says_where_it_has_searched():
    """A number that was mistyped; then an answer that this computer drops."""
    with cable("v0", "10.9.9.1/24", device="10.9.9.3/24"), House(**{"discovery-interval-ms": 100}) as house:
        house.device_keys["mill"] = {"serial": SERIAL + 1}
        start_far(house, "v0", "10.9.9.3", SERIAL)
        house.start_daemon()
        wait_for("the other number in the log", lambda: f"answers came from serial {SERIAL};" in house.log())
        assert f"mill (serial {SERIAL + 1}): not found by a search at v0 (10.9.9.1/24)" in house.log(), house.log()
        with firewall("v0"):
            wait_for("nobody in the log", lambda: "at v0 (10.9.9.1/24); sudo pokeysctl discover tells" in house.log())


def test_a_new_configuration_names_the_interface():
    with cable("v0", "10.9.9.1/24", device="10.9.9.3/24"), House() as house:
        start_far(house, "v0", "10.9.9.3", SERIAL)
        out = run(house.programs["pokeysctl"], "discover", "--config", "--timeout", "2000")
        assert "\n; interface = v0\n" in out.stdout and f"\nserial = {SERIAL}\n" in out.stdout, out


def test_an_interface_that_does_not_exist_is_named():
    with House() as house:
        assert "v7" in found(house, "--interface", "v7")


def make_network():
    ip("link", "set", "lo", "up")
    for which in ("all", "default"):  # a name space may begin with those of this computer
        pathlib.Path(f"/proc/sys/net/ipv4/conf/{which}/rp_filter").write_text("0\n", encoding="ascii")


if __name__ == "__main__":
    sys.exit(begin(make_network, sys.modules[__name__]))
