#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""What may happen between a running daemon and its device below IP: the cable out, ARP
entries flushed, a wrong hardware address announced, another device at the same
address. In name spaces of our own: here the
machine with br0, behind one port of it the device, behind the other its twin, which
has the same address and another serial number."""
import json
import sys
import time

from house import House, end, equal, rng, run, wait_equal, wait_for
from safety import safety
from spaces import begin, ip, start_far

HERE, DEVICE = "10.78.0.1", "10.78.0.2"
SERIAL, OTHER = 54321, 777
MACS = {"mill": "02:00:00:00:00:0a", "twin": "02:00:00:00:00:0b", "nobody": "02:00:00:00:00:99"}
# a machine that is held for a moment has not lost its device
PATIENT = {"lost-after-ms": 20000}


def make_network():
    ip("link", "set", "lo", "up")
    ip("link", "add", "br0", "address", "02:00:00:00:00:01", "type", "bridge")
    ip("addr", "add", f"{HERE}/24", "dev", "br0")
    ip("link", "set", "br0", "up")
    # what the kernel does anyway, a few times faster
    ip("ntable", "change", "name", "arp_cache", "dev", "br0", "base_reachable", "2000", "retrans", "200",
       "delay_probe", "1000")
    for name in ("mill", "twin"):
        ip("netns", "add", name)
        ip("link", "add", f"to-{name}", "type", "veth", "peer", "name", "eth0", "netns", name)
        ip("link", "set", f"to-{name}", "master", "br0", "up")
        ip("-n", name, "link", "set", "eth0", "address", MACS[name])
        ip("-n", name, "link", "set", "lo", "up")
        ip("-n", name, "addr", "add", f"{DEVICE}/24", "dev", "eth0")
    ip("-n", "mill", "link", "set", "eth0", "up")


def announce(owner, port=None):
    """A gratuitous ARP: DEVICE is at the owner's hardware address from now on, says who is behind the port."""
    out = run("ip", "netns", "exec", port or owner, sys.executable, "-c", f"""
import socket
mac = bytes.fromhex("{MACS[owner].replace(':', '')}")
at = mac + socket.inet_aton("{DEVICE}")
with socket.socket(socket.AF_PACKET, socket.SOCK_RAW) as s:
    s.bind(("eth0", 0))
    s.send(b"\\xff" * 6 + mac + bytes.fromhex("08060001080006040001") + at + bytes(6) + at[6:])
""")
    assert out.returncode == 0, out


def entry():
    """The hardware address that the kernel has for the device, None while it looks for it."""
    found = json.loads(ip("-j", "neigh", "show", DEVICE, "dev", "br0") or "[]")
    return found[0].get("lladdr") if found else None


class Lan(House):
    """A daemon here, simulated devices in their name spaces."""
    def __init__(self, **keys):
        super().__init__()
        self.device_keys["mill"] = {"address": DEVICE, "serial": SERIAL, **keys}

    def start_far(self, name, serial):
        return start_far(self, name, DEVICE, serial)

    def start(self):
        sim = self.start_far("mill", SERIAL)
        ip("neigh", "flush", "dev", "br0")
        self.start_daemon()
        self.wait_fresh("mill")
        return sim

    def accepted(self):
        return self.state()["statistics"]["accepted"]

    def reconnects(self):
        return self.state()["statistics"]["reconnects"]


def test_an_entry_that_is_flushed_is_not_noticed():
    with Lan(**PATIENT) as lan:
        lan.start()
        for _ in range(30):
            before = lan.accepted()
            ip("neigh", "flush", "dev", "br0")
            wait_for("answers", lambda: lan.accepted() > before + 20)  # pylint: disable=cell-var-from-loop
        equal(lan.reconnects(), 0, lan.log())


def test_a_wrong_hardware_address_is_a_loss_and_mends_itself():
    with Lan(**{"lost-after-ms": 300}) as lan:
        lan.start()

        def loses(before):
            # its kernel asks for ours now and then: in that moment the lie is over before there is a loss
            if lan.reconnects() == before and entry() == MACS["mill"]:
                announce("nobody", "mill")
            return lan.reconnects() > before

        for _ in range(3):
            before = lan.reconnects()
            wait_for("loss and return", lambda: loses(before))  # pylint: disable=cell-var-from-loop
            lan.wait_fresh("mill")
            wait_equal("the entry", entry, MACS["mill"])
        assert "lost (was running): it does not answer" in lan.log(), lan.log()


def test_a_cable_that_is_pulled_out_and_put_in_again():
    with Lan(**{"lost-after-ms": 300}) as lan:
        lan.start()
        for round_ in range(30):
            before = lan.reconnects()
            length = 0.01 * 200 ** rng.random()
            ip("link", "set", "to-mill", "down")
            if round_ % 10:
                time.sleep(length)
            else:
                wait_for("the loss", lambda: lan.state().get("link", "running") != "running")
            ip("link", "set", "to-mill", "up")
            wait_for(f"the device after {length:.2f} s", lambda: lan.fresh() and  # pylint: disable=cell-var-from-loop
                     (round_ % 10 or lan.reconnects() > before))  # pylint: disable=cell-var-from-loop
        assert "lost (was running): it does not answer" in lan.log(), lan.log()


def operations(lan, sim):
    """What the device has executed: {operation: times}."""
    rows = (row.split("=") for row in lan.ask_sim(sim, "stat").splitlines() if row.startswith(("op.", "pe.")))
    return {name: int(value) for name, value in rows}


def settings(lan, sim):
    """What it is set up for, without what it counts by itself."""
    return [row for row in lan.ask_sim(sim, "field").splitlines() if row.startswith(("pin.function", "encoder.option",
            "encoder.pins", "encoder.fast", "pwm", "engine.axes", "axis.block", "engine.state", "engine.outputs"))]


def asked(lan, twin, times):
    """What it has executed when it was asked so many times more who it is, or the device is there again."""
    first = operations(lan, twin).get("op.00", 0)
    return wait_for("questions", lambda: ((now := operations(lan, twin)).get("op.00", 0) >= first + times or
                                          entry() == MACS["mill"]) and now)


def refused(lan):
    """Who answers is another one. The last fault is kept while the device itself runs again."""
    state = lan.state()
    return state.get("link") == "searching" and state.get("fault") == "wrong serial number"


def gets_only_questions(lan, twin, mill):
    """Who it is (op.00) and nothing else; what was on its way before has been executed then."""
    for _ in range(20):
        announce("twin")
        # on a busy machine the kernel asks everybody when its own questions come late: anew then
        wait_for("the twin", lambda: refused(lan) or entry() == MACS["mill"])
        if entry() == MACS["mill"]:
            continue
        its = operations(lan, mill)
        before, after = asked(lan, twin, 1), asked(lan, twin, 3)
        # both answer the kernel's ARP broadcast, so the device may have been found and driven in between;
        # what was under way when the entry changed back reached the twin
        if entry() == MACS["mill"] or operations(lan, mill) != its:
            continue
        grown = {name for name, value in after.items() if value != before.get(name, 0)}
        with safety():
            assert grown <= {"op.00"}, f"a device that is not ours was driven: {before}, {after}"
        return
    raise AssertionError("the kernel has always found the device itself")


def test_another_device_at_the_address_is_left_alone():
    with Lan(**{"lost-after-ms": 300, "digital-outputs": "31-34", "axes": 2, "pwm-period": 2500}) as lan:
        mill = lan.start()
        twin = lan.start_far("twin", OTHER)
        ip("-n", "twin", "link", "set", "eth0", "up")
        before = settings(lan, twin)
        assert len(before) > 8, before
        for round_ in range(3):
            gets_only_questions(lan, twin, mill)
            wait_for("the reason", lambda: f"serial number {OTHER} answers, but {SERIAL} is configured" in lan.log(),
                     say=lan.log)
            if round_ == 1:  # the device shouts louder
                announce("mill")
            else:  # the twin is unplugged
                ip("-n", "twin", "link", "set", "eth0", "down")
            lan.wait_fresh("mill")
            ip("-n", "twin", "link", "set", "eth0", "up")
        after = settings(lan, twin)
        with safety():
            equal(after, before)
        print(f"  the twin has executed {operations(lan, twin)}")
        end(twin)


if __name__ == "__main__":
    sys.exit(begin(make_network, sys.modules[__name__]))
