#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Modes, homing and probing by the canonical names: simulated device, real daemon, real
LinuxCNC HAL. Where the machine is in the end is what counts, never when.

usage: live_motion.py MODULE.so POKEYSD POKEYS-SIM [PATTERN]
"""
import sys
import time
import hal_machine
from hal_live import wait
from safety import safety

BUFFERED, VELOCITY, POSITION = 3, 2, 1


def position(m, axis=0):
    return int(m.sim(f"axis {axis}")["position"])


def stands(m, axis=0):
    before = position(m, axis)
    time.sleep(0.1)
    return position(m, axis) == before


def shows(m, pin, value=True):
    return lambda: m.hal.get(pin) == value


def an_axis_is_homed_where_its_switch_is(m):
    hal = m.all()
    hal.set("joint.00.home-offset", -20)
    m.machine_on()
    m.press("joint.00.home", shows(m, "joint.00.homed"))
    hal.becomes("homing.active", False)
    hal.becomes("homing.error", 0)
    hal.becomes("joint.00.homing", False)
    wait("it stands", lambda: stands(m))
    # the counter was set at the switch's edge, the axis ran on a little off the switch
    there = position(m)
    assert -2000 <= there <= -1900, there
    hal.becomes("joint.00.pos-fb", there / hal_machine.SCALE)
    m.machine_on()
    m.move(-15)


def a_group_is_homed_together(m):
    hal = m.all()
    for joint in (1, 2):
        hal.set(f"joint.{joint:02}.scale", hal_machine.SCALE)
        hal.set(f"joint.{joint:02}.home-group", 1)
        hal.set(f"joint.{joint:02}.enable", 1)
    m.machine_on()
    m.press("joint.02.home", shows(m, "joint.01.homed"))
    hal.becomes("joint.02.homed", True)
    other = position(m, 0)
    with safety():
        assert other == 0, f"an axis outside the group moved to {other}"
    assert hal.get("joint.00.homed") is False
    hal.becomes("homing.active", False)


def homing_is_cancelled(m):
    hal = m.all()
    m.sim("switch 0 home -2000000000 -8000000")     # it would search for a long time
    m.sim("switch 0 minus -2000000000 -9000000")
    m.machine_on()
    m.press("joint.00.home", shows(m, "homing.phase", 3))
    hal.becomes("homing.active", True)
    hal.becomes("joint.00.homing", True)
    m.press("homing.cancel", shows(m, "homing.active", False))
    with safety():
        wait("it stands", lambda: stands(m))
    hal.becomes("homing.error", 2)
    assert hal.get("joint.00.homed") is False


def the_device_probes(m):
    hal = m.all()
    m.sim("probe 0 800 2000000 no pin 13")
    hal.set("probe.terminal", 13)
    hal.set("probe.axes", 1)
    hal.set("probe.speed", 0.05)
    hal.set("joint.00.probe-target", 30)
    m.machine_on()
    hal.becomes("probe.contact", False)
    m.press("probe.start", shows(m, "probe.done"))
    hal.becomes("probe.error", 0)
    hal.becomes("joint.00.probed", True)
    # latched in the millisecond of the contact, at most that many pulses late
    hal.becomes("joint.00.probe-pos", lambda have: have != 0)
    assert 8 <= hal.get("joint.00.probe-pos") < 8.5, hal.get("joint.00.probe-pos")
    wait("it stands", lambda: stands(m))
    hal.becomes("probe.active", False)
    hal.becomes("probe.contact", True)          # it stands on the work
    m.sim("probe off")
    hal.becomes("probe.contact", False)
    m.machine_on()
    # towards 30, from beyond 8, and nothing there
    m.press("probe.start", shows(m, "probe.error", 6))
    assert hal.get("probe.done") is False


def a_refused_probing_says_so(m):
    hal = m.all()
    hal.set("probe.axes", 1)
    # no input is set up, and the machine is off
    m.press("probe.start", shows(m, "probe.error", 8))
    hal.set("probe.speed", 2)
    hal.becomes("input-refused", True)
    hal.says("pokeys.0.probe.speed = 2: must be 0 to 1")


def without_a_read_no_axis_is_driven(m):
    hal = m.all()
    m.machine_on()
    m.move(40)
    hal.ok("halcmd stop && halcmd delf pokeys.0.read servo-thread && halcmd start")
    hal.becomes("read-missing", True)
    hal.becomes("connected", False)
    hal.becomes("machine-on-permitted", False)
    # LinuxCNC's command follows a pos-fb that says nothing
    hal.set("joint.00.pos-cmd", 0)
    for on in (0, 1):
        hal.set("machine-is-on", on)
        wait("it stands", lambda: stands(m))
    with safety():
        assert position(m) == 4000, f"it runs to {position(m)} without being read"
    hal.says("pokeys.0.write runs without pokeys.0.read")
    hal.ok("halcmd stop && halcmd addf pokeys.0.read servo-thread 1 && halcmd start")
    hal.becomes("read-missing", False)
    hal.becomes("connected", True)
    hal.becomes("needs-edge", True)
    m.cycles(100)
    with safety():
        assert position(m) == 4000, f"it runs to {position(m)} without an edge"
    m.machine_on()
    m.move(20)


def an_emergency_stop_ends_motion_and_outputs(m):
    hal = m.all()
    hal.set("pin.31.out", 1)
    m.machine_on()
    m.sim_shows("pin 32", "latch", "1")
    hal.set("joint.00.pos-cmd", 100000)
    wait("it moves", lambda: float(m.sim("axis 0")["speed"]) != 0)
    hal.set("emergency-stop", 1)
    with safety():
        m.sim_shows("pin 32", "latch", "0")
        wait("it stands", lambda: stands(m))
    hal.becomes("error-code", 4)
    hal.becomes("machine-on-permitted", False)
    stood = position(m)
    hal.set("emergency-stop", 0)
    hal.becomes("error-active", False)
    hal.becomes("needs-edge", True)
    m.passes()
    with safety():
        assert position(m) == stood, "it goes on by itself"
        assert m.sim("pin 32")["latch"] == "0", "an output came back by itself"
    m.machine_on()
    m.sim_shows("pin 32", "latch", "1")
    m.move(1)


def limits_can_be_overridden(m):
    hal = m.all()
    m.machine_on()
    hal.set("engine.limit-override", 1)
    hal.becomes("engine.limit-override-active", True)
    hal.set("engine.limit-override", 0)
    hal.becomes("engine.limit-override-active", False)


def each_mode_by_its_parameter(m):
    hal = m.all()
    hal.becomes("joint.00.mode", POSITION)      # as the device has it
    m.machine_on()
    m.move(5)
    hal.set("machine-is-on", 0)
    hal.becomes("machine-on-permitted", False)
    wait("it stands", lambda: stands(m))
    m.applied("joint.00.mode", BUFFERED)
    m.machine_on()
    m.move(12.34)
    wait("it is there to the pulse", lambda: position(m) == 1234 and stands(m))
    hal.becomes("joint.00.following-error", 0)
    hal.becomes("engine.buffer-slots", 128)
    hal.set("machine-is-on", 0)
    hal.becomes("machine-on-permitted", False)
    m.applied("joint.00.mode", VELOCITY)
    m.machine_on()
    hal.set("joint.00.vel-cmd", 10)
    wait("it runs", lambda: position(m) > 1500)
    hal.set("joint.00.vel-cmd", -10)
    wait("it runs back", lambda: position(m) < 1400)
    hal.set("joint.00.vel-cmd", 0)
    wait("it stands", lambda: stands(m))


def what_cannot_be_is_refused_with_its_name(m):
    hal = m.all()
    hal.set("joint.07.scale", 100)
    hal.set("joint.07.enable", 1)               # the device has three axes
    m.machine_on()
    hal.becomes("command-refused", True)
    wait("the daemon says which", lambda: "axis 7" in m.log("pokeysd"))
    hal.set("joint.07.enable", 0)
    hal.becomes("command-refused", False)
    hal.set("joint.01.scale", 0)
    hal.becomes("joint.01.refused", True)
    hal.says("pokeys.0.joint.01.scale = 0: must not be 0")


TESTS = [
    an_axis_is_homed_where_its_switch_is,
    a_group_is_homed_together,
    homing_is_cancelled,
    the_device_probes,
    a_refused_probing_says_so,
    without_a_read_no_axis_is_driven,
    an_emergency_stop_ends_motion_and_outputs,
    limits_can_be_overridden,
    each_mode_by_its_parameter,
    what_cannot_be_is_refused_with_its_name,
]


if __name__ == "__main__":
    sys.exit(hal_machine.main(TESTS))
