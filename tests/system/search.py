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
    return {(d["serial"], d["address"]) for d in json.loads(out.stdout)["devices"]} if out.stdout else out.stderr


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


def test_an_interface_that_does_not_exist_is_named():
    with House() as house:
        assert "v7" in found(house, "--interface", "v7")


def make_network():
    ip("link", "set", "lo", "up")


if __name__ == "__main__":
    sys.exit(begin(make_network, sys.modules[__name__]))
