#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Devices are found in networks as people set them up: addresses without a broadcast
address, labelled ones, two interfaces in one network, a device with another mask."""
import contextlib
import json
import sys

from house import House, equal, run
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
        assert "no other interface than loopback is up" in found(house)


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


def test_an_interface_that_does_not_exist_is_named():
    with House() as house:
        assert "v7" in found(house, "--interface", "v7")


def make_network():
    ip("link", "set", "lo", "up")


if __name__ == "__main__":
    sys.exit(begin(make_network, sys.modules[__name__]))
