#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Threading by the device through pins: simulated device and spindle, real daemon, real
LinuxCNC HAL. Where the axis is in the end and what led it there counts, never when.

usage: live_thread.py MODULE.so POKEYSD POKEYS-SIM [PATTERN]
"""
import struct
import sys
import time
import hal_machine
from hal_live import wait
from safety import safety

TURN = 4096         # quadrature steps; every fourth is counted
# so slow that a daemon which gets no processor for a while starves nothing
TARGET, SLOW = 6000, 120
LIMITS = (1.0, 1.0, 1.0)    # of SETTINGS, in pulses a millisecond
WAY = -2            # of joint 0, at 10 a second: 200 slots of one pulse
NO_CONNECTION = 9    # threading.reason
SETTINGS = {
    "encoder.ultra.enable": 1, "joint.00.mode": 3, "joint.00.max-velocity": 10,
    "joint.00.max-acceleration": 10000, "joint.00.max-deceleration": 10000,
    "threading.mode": 1, "threading.ticks-per-revolution": TURN // 4,
    "threading.target-rpm": TARGET, "threading.speed-gain": 200,
    "threading.position-gain": 100, "threading.ignore-axes": 0,
}


class Lathe(hal_machine.Machine):
    options = ("--count-free",)     # a lost fill costs no thread then

    def load(self):
        self.hal.start(f"runtime={self.folder}/run names=canonical")
        self.hal.set("joint.00.scale", hal_machine.SCALE)


def has_settings(m):
    """The device has all of them, by the protocol's numbers (every_settings, every_threading)."""
    inside = m.sim("field")
    thread = bytes.fromhex(inside["engine.thread"][2:])
    block = bytes.fromhex(inside["axis.block.0"][2:])
    want = (SETTINGS[f"threading.{name}"] for name in ("ticks-per-revolution", "target-rpm",
                                                       "speed-gain", "position-gain"))
    return (inside["encoder.ultra"] == "0x01" and thread[0] == SETTINGS["threading.mode"] and
            struct.unpack_from("<4H", thread, 4) == tuple(want) and thread[12] == 0 and
            block[0] & 12 == 0 and struct.unpack_from("<3f", block, 8) == LIMITS)


def position(m):
    return int(m.sim("axis 0")["position"])


def press(m, pin):
    """Once more where the data were stale just then, on a busy machine."""
    for _ in range(60):
        m.hal.set(pin, 1)
        m.hal.periods()
        m.hal.set(pin, 0)
        m.hal.becomes("connected", True)  # only then are reasons shown
        m.hal.periods()
        if m.hal.get("threading.reason") != NO_CONNECTION:
            return
    raise AssertionError(f"{pin} was refused each time, for there was no connection")


def stands(m):
    """By the device, and for long enough that what had been sent has come."""
    m.passes()
    return float(m.sim("axis 0")["speed"]) == 0


def begin(m):
    """A machine that is on, with a spindle that turns slower than the target."""
    hal = m.all()
    for name, value in SETTINGS.items():
        hal.set(name, value)
    wait("the device has the settings", lambda: has_settings(m))
    m.passes()
    hal.becomes("config.state", 3)
    m.sim("axis 0 decouple")
    m.sim(f"spindle {SLOW} {TURN}")
    m.machine_on()
    m.move(0.1)         # the buffer has been seen to be used
    m.move(0)
    return hal


def arm(m, way=WAY):
    """Prepared, under way and armed."""
    press(m, "threading.prepare")
    m.hal.becomes("threading.prepared", True)
    m.hal.set("joint.00.pos-cmd", way)
    press(m, "threading.arm")


def lead(m):
    """The spindle leads the axis."""
    arm(m)
    wait("the spindle leads, or it has failed", lambda: m.hal.get("threading.active") or
         m.hal.get("threading.error") or m.hal.get("threading.refused"))
    assert m.hal.get("threading.error") == 0 and m.hal.get("threading.reason") == 0, \
        f"error {m.hal.get('threading.error')}, reason {m.hal.get('threading.reason')}"
    wait("the axis moves", lambda: position(m) < -5)


def a_thread_is_cut_to_its_end(m):
    hal = begin(m)
    lead(m)
    hal.becomes("joint.00.pos-fb", WAY)         # LinuxCNC goes on
    assert hal.get("threading.behind") > 0 and position(m) > WAY * hal_machine.SCALE
    hal.becomes("threading.behind", 0, limit=120)
    wait("it is at its end", lambda: position(m) == WAY * hal_machine.SCALE)
    assert hal.get("threading.index-count") > 0
    hal.becomes("threading.spindle-rpm", lambda have: abs(have - SLOW) < 60)
    press(m, "threading.release")
    hal.becomes("threading.active", False)
    wait("it is over", lambda: m.sim("spindle")["threading"] == "off")
    assert hal.get("threading.error") == 0 and hal.get("threading.refused") is False
    wait("its command is where it is", lambda: hal.get("joint.00.following-error") == 0)
    m.move(1)
    assert position(m) == hal_machine.SCALE


def what_does_not_fit_says_why(m):
    hal = begin(m)
    press(m, "threading.arm")
    hal.becomes("threading.refused", True)
    hal.becomes("threading.reason", 6)
    press(m, "threading.prepare")
    hal.becomes("threading.prepared", True)
    hal.becomes("threading.refused", False)
    press(m, "threading.force")
    hal.becomes("threading.reason", 5)
    press(m, "threading.release")
    hal.becomes("threading.prepared", False)
    hal.set("machine-is-on", 0)
    hal.becomes("machine-on-permitted", False)
    press(m, "threading.prepare")
    hal.becomes("threading.reason", 1)
    assert "the machine is off" in m.log("pokeysd")


def stays_where_it_is(m):
    """The device has left threading and the axis stands still, whatever the spindle does."""
    with safety():
        wait("the device has left threading", lambda: m.sim("spindle")["threading"] == "off")
        wait("it stands", lambda: stands(m))
    there = position(m)
    assert there < 0, there
    m.sim(f"spindle {TARGET}")
    m.hal.set("joint.00.pos-cmd", 100 * WAY)
    m.passes()
    now = position(m)
    with safety():
        assert now == there, f"the axis moves though the device has left threading: {there} -> {now}"
    m.hal.becomes("joint.00.pos-fb", there / hal_machine.SCALE)


def ends(m, how):
    hal = begin(m)
    lead(m)
    how(hal)
    hal.becomes("threading.active", False)
    hal.becomes("threading.error", 2)
    stays_where_it_is(m)


def cancel_stops_it(m):
    ends(m, lambda hal: press(m, "threading.cancel"))


def machine_off_stops_it(m):
    ends(m, lambda hal: hal.set("machine-is-on", 0))


def a_spindle_above_its_target_stops_it(m):
    hal = begin(m)
    m.sim(f"spindle {4 * TARGET} {TURN}")
    arm(m, 100 * WAY)
    hal.becomes("threading.error", 10)
    assert position(m) > 100 * WAY * hal_machine.SCALE
    stays_where_it_is(m)


if __name__ == "__main__":
    hal_machine.Machine = Lathe
    sys.exit(hal_machine.main([a_thread_is_cut_to_its_end, what_does_not_fit_says_why,
                               cancel_stops_it, machine_off_stops_it,
                               a_spindle_above_its_target_stops_it]))
