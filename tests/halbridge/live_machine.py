#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The whole way: simulated device, real daemon over UDP, real LinuxCNC HAL.

Each test has a simulator at an address of its own, a daemon and a HAL, and
moves one end to see the other. Waits are generous; what the machine was able
to do is printed, and only what must hold at any speed is asserted.

usage: live_machine.py MODULE.so POKEYSD POKEYS-SIM [PATTERN]
"""
import sys
import time
import hal_live
import hal_machine
from safety import safety


def inputs_come_and_outputs_go(m):
    hal = m.all()
    m.sim("pin 13 0")
    hal.becomes("pin.12.in", False)
    m.sim("pin 13 1")
    hal.becomes("pin.12.in", True)
    hal.becomes("pin.12.in-not", False)
    for out, back in ((30, 8), (33, 11)):      # wired to each other in the simulator
        before = hal.get(f"pin.{back:02}.in")
        hal.set(f"pin.{out:02}.out", 1)
        m.sim_shows(f"pin {out + 1}", "latch", "1")
        hal.becomes(f"pin.{back:02}.in", not before)
        hal.set(f"pin.{out:02}.out", 0)
        m.sim_shows(f"pin {out + 1}", "latch", "0")
        hal.becomes(f"pin.{back:02}.in", before)
    hal.set("pin.12.out", 1)                    # an input of the device: untouched
    hal.set("pin.30.out", 1)                    # looked at in its turn, before or after that
    m.sim_shows("pin 31", "latch", "1")
    m.passes()
    found = m.sim("pin 13")["latch"]
    with safety():
        assert found == "0", found
    assert hal.get("command-refused") is False


def identity_and_analog(m):
    hal = m.all()
    for name, value in (("devSerial", 65432), ("info.DeviceTypeID", 32), ("info.PinCount", 55),
                        ("info.PulseEnginev2", 1), ("info.PulseEngine", 0)):
        hal.becomes(name, value)
    m.sim("analog 43 2048")
    hal.becomes("adc.02.raw", 2048)
    hal.set("adc.02.scale", 1000)
    hal.becomes("adc.02.value", 1650)


def encoders_turn(m):
    hal = m.all()
    m.sim("encoder 0 count 5000")
    hal.becomes("encoder.00.count", 5000)
    hal.set("encoder.00.reset", 1)
    hal.becomes("encoder.00.position", 0)
    hal.set("encoder.00.reset", 0)
    hal.periods()
    m.sim("encoder 0 turn -250")
    hal.becomes("encoder.00.position", -2.5)
    # the ultra-fast one turns at 600 rpm with 4000 counts
    hal.set("encoder.25.scale", 4000)
    hal.becomes("encoder.25.velocity", lambda have: abs(have - 10) <= 0.5)


def index_zeroes_the_count(m):
    hal = m.all()
    m.sim("encoder 25 rate 0")
    m.sim("encoder 25 count 30000")
    hal.becomes("encoder.25.count", 30000)
    hal.set("encoder.25.index-enable", 1)
    m.sim_shows("field encoder.ultra-armed", "encoder.ultra-armed", "0x01")
    m.passes()
    assert hal.get("encoder.25.index-enable") is True
    m.sim("encoder 25 turn 100")
    m.sim("index 25")
    hal.becomes("encoder.25.index-enable", False)
    hal.becomes("encoder.25.count", 0)
    m.sim("encoder 25 turn 12")
    hal.becomes("encoder.25.count", 12)


def an_axis_moves_and_comes_back(m):
    hal = m.all()
    assert hal.get("joint.00.enabled") is False
    hal.set("joint.00.pos-cmd", 5)
    m.passes()
    found = m.sim("axis 0")["position"], hal.get("joint.00.pos-fb")
    with safety():
        assert found == ("0", 0), f"it moves without machine-is-on: {found}"
    m.machine_on()
    m.move(30)
    assert m.sim("axis 0")["position"] == "3000"
    hal.becomes("encoder.00.count", 3000)
    m.move(-12.34)
    hal.becomes("encoder.00.count", -1234)
    hal.set("machine-is-on", 0)
    hal.becomes("machine-on-permitted", False)
    hal.set("joint.00.pos-cmd", 20)
    m.passes()
    found = m.sim("axis 0")["position"]
    with safety():
        assert found == "-1234", "it moves though the machine is off"


def numbers_that_are_none_do_not_move_it(m):
    hal = m.all()
    m.machine_on()
    m.move(10)
    for bad in ("nan", "inf", "-inf", "1e300", "200000"):
        hal.set("joint.00.pos-cmd", bad)
        hal.becomes("joint.00.refused", True)
        m.passes()
        found = m.sim("axis 0")["position"]
        with safety():
            assert found == "1000", f"{bad} moved it to {found}"
        hal.set("joint.00.pos-cmd", 10)
        hal.becomes("joint.00.refused", False)
    assert hal.get("command-refused-count") == 0, "the daemon had to refuse what we should have"
    m.move(11)


def a_killed_linuxcnc_leaves_a_safe_machine(m):
    hal = m.all()
    hal.set("pin.30.out", 1)
    m.machine_on()
    m.sim_shows("pin 31", "latch", "1")
    hal.set("joint.00.pos-cmd", 1500)           # far: it is still moving when it happens
    hal_live.wait("the axis moves", lambda: float(m.sim("axis 0")["speed"]) != 0)
    hal.ok("kill -9 $(pidof rtapi_app)")
    with safety():
        off = m.sim_shows("pin 31", "latch", "0")
        hal_live.wait("the axis stands", lambda: float(m.sim("axis 0")["speed"]) == 0)
    stood = m.sim("axis 0")["position"]
    with safety():
        assert int(stood) < 150000, "it went on to where it was sent"
    print(f"LinuxCNC killed: output off after {off * 1000:.0f} ms (heartbeat timeout 3000 ms)")
    hal.clean_up()
    m.load()
    hal.becomes("commander", True)
    hal.becomes("safe-state", False)
    hal.set("joint.00.enable", 1)
    m.passes()
    found = m.sim("axis 0")["position"]
    with safety():
        assert found == stood, "it moved without an edge of machine-on"


def a_killed_daemon_is_survived(m):
    hal = m.all()
    pid = hal.pid()
    hal.set("pin.31.out", 1)
    m.machine_on()
    m.move(7)
    m.kill("pokeysd")
    stale = hal.becomes("stale", True)
    assert hal.get("joint.00.pos-fb") == 7 and hal.get("connected") is False
    hal.becomes("daemon-alive", False)
    began = time.monotonic()
    m.daemon()
    hal.becomes("connected", True)
    fresh = time.monotonic() - began
    hal.becomes("commander", True)
    assert hal.pid() == pid
    assert hal.get("joint.00.pos-fb") == 7
    hal.becomes("needs-edge", True)
    hal.becomes("outputs-held", True)
    hal.becomes("joint.00.position-lost", True)
    hal.set("joint.00.pos-cmd", 9)
    m.passes()
    found, on = m.sim("axis 0")["position"], m.sim("pin 32")["latch"]
    with safety():
        assert found == "700", found
        assert on == "0", "an output came back without an edge of machine-on"
    m.machine_on()
    m.sim_shows("pin 32", "latch", "1")
    hal.becomes("outputs-held", False)
    m.move(9)
    print(f"daemon killed: seen stale after {stale * 1000:.0f} ms, fresh {fresh:.2f} s after its start")


def a_rebooted_device_comes_back(m):
    hal = m.all()
    hal.set("encoder-keep-count", 1)
    hal.set("joint.00.motion-homed", 1)
    hal.set("encoder.05.sampling", 4)
    hal.becomes("encoder.05.enabled", True)
    m.sim("encoder 5 count 5000")
    hal.becomes("encoder.05.count", 5000)
    m.machine_on()
    m.move(5)
    m.sim("reboot keep-config")
    hal.becomes("machine-on-permitted", False)
    hal.becomes("connected", True)
    hal.becomes("needs-edge", True)
    with safety():
        hal.becomes("joint.00.position-lost", True)
        hal.becomes("unhome", True)
        assert hal.get("position-lost") is True
        assert hal.get("joint.00.pos-fb") == 5, "the position jumped"
        hal.becomes("encoder-count-lost", True)
        assert hal.get("encoder.05.count") == 5000, "the hand wheel jumped"
    m.passes()
    found = m.sim("axis 0")["position"]
    with safety():
        assert found == "0", "it went on by itself"
    # its engine stands, which takes the permission, some time before its clock is asked for
    hal_live.wait("the daemon has seen the restart", lambda: "was restarted" in m.log("pokeysd"))
    hal.becomes("connected", True)
    m.machine_on()
    m.move(3)
    found = m.sim("axis 0")["position"]
    with safety():
        assert found == "-200", "it went to another place than two units back"
        assert hal.get("position-lost") is True
    m.sim("encoder 5 count 7")
    hal.becomes("encoder.05.count", 5007)
    for i in range(26):
        hal.set(f"encoder.{i:02d}.reset", 1)
    hal.becomes("encoder-count-lost", False)
    hal.set("joint.00.motion-homed", 0)
    hal.becomes("unhome", False)
    assert hal.get("position-lost") is True
    hal.set("joint.00.motion-homed", 1)
    hal.becomes("joint.00.position-lost", False)
    hal.becomes("unhome", False)


def every_order_of_starting_works(m):
    m.load()
    assert m.hal.get("connected") is False
    m.daemon()
    m.hal.becomes("daemon-alive", True)
    assert m.hal.get("connected") is False
    m.device()
    m.hal.becomes("connected", True)
    m.machine_on()
    m.move(2)


def a_silent_device_is_stale_and_comes_back(m):
    hal = m.all()
    hal.set("encoder-keep-count", 1)
    hal.set("pin.31.out", 1)
    hal.set("encoder.05.sampling", 4)
    hal.becomes("encoder.05.enabled", True)
    m.sim("encoder 5 count 5000")
    hal.becomes("encoder.05.count", 5000)
    m.machine_on()
    m.sim_shows("pin 32", "latch", "1")
    m.sim("silence 3600000")
    hal.becomes("stale", True)
    hal.becomes("daemon-alive", True)
    hal.becomes("packet-error-exceeded", True)
    hal.becomes("link-state", lambda have: have != hal_machine.RUNNING)
    # a hand wheel is turned while its cable is out
    hal.becomes("age-us", lambda microseconds: microseconds > 600000)
    m.sim("encoder 5 count 5500")
    m.sim("silence 0")
    hal.becomes("connected", True)
    with safety():
        hal.becomes("encoder-count-lost", True)
        assert hal.get("encoder.05.count") == 5000, "the hand wheel jumped"
    m.sim("encoder 5 count 5507")
    hal.becomes("encoder.05.count", 5007)
    hal.becomes("packet-error-exceeded", False)
    hal.becomes("needs-edge", True)
    hal.becomes("machine-on-permitted", False)
    hal.becomes("outputs-held", True)
    with safety():
        m.sim_shows("pin 32", "latch", "0")
    m.machine_on()
    m.sim_shows("pin 32", "latch", "1")
    m.move(1)


def a_slow_period_is_said_and_not_each(m):
    began = time.monotonic()
    hal = m.all()
    hal.set("time-threshold", 0.001)
    hal.says(" us in one period, more than time-threshold (")
    count = hal.get("time-exceeded-count")
    hal.becomes("time-exceeded-count", lambda have: have > count + 1000)
    lines = hal.said().count("more than time-threshold")
    assert lines <= 2 + (time.monotonic() - began) / 10, hal.said()


def an_unloaded_component_says_so(m):
    """Signals keep the last value: LinuxCNC would go on, with a device that nobody drives."""
    hal = m.all()
    hal.set("pin.31.out", 1)
    m.machine_on()
    m.sim_shows("pin 32", "latch", "1")
    for name, signal in (("stale", "old"), ("connected", "there"), ("machine-on-permitted", "may")):
        hal.ok(f"halcmd net {signal} pokeys.0.{name}")
    hal.set("joint.00.pos-cmd", 100000)
    hal_live.wait("the axis moves", lambda: float(m.sim("axis 0")["speed"]) != 0)
    hal_live.wait("it is driven", lambda: [hal.ok(f"halcmd gets {signal}") for signal in ("old", "there", "may")] ==
                  ["FALSE", "TRUE", "TRUE"])
    hal.ok("halcmd unloadrt pokeys_shm")
    said = [hal.ok(f"halcmd gets {signal}") for signal in ("old", "there", "may")]
    with safety():
        assert said == ["TRUE", "FALSE", "FALSE"], f"LinuxCNC still sees {said}"
        hal_live.wait("the axis stands", lambda: float(m.sim("axis 0")["speed"]) == 0)
        m.sim_shows("pin 32", "latch", "0")


TESTS = [
    inputs_come_and_outputs_go,
    identity_and_analog,
    encoders_turn,
    index_zeroes_the_count,
    an_axis_moves_and_comes_back,
    numbers_that_are_none_do_not_move_it,
    a_killed_linuxcnc_leaves_a_safe_machine,
    a_killed_daemon_is_survived,
    a_rebooted_device_comes_back,
    every_order_of_starting_works,
    a_silent_device_is_stale_and_comes_back,
    a_slow_period_is_said_and_not_each,
    an_unloaded_component_says_so,
]


if __name__ == "__main__":
    sys.exit(hal_machine.main(TESTS))
