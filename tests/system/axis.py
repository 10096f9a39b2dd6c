#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl axis: one axis is moved or homed without LinuxCNC, and stands whatever becomes of the program."""
import contextlib
import json
import re
import signal
import sys
import time

from house import House, end, equal, main, wait_for

AXIS = {"mode": "position", "invert": "off", "max-speed": 20000, "max-acceleration": 200000, "soft-limits": "off",
        "limit-minus": "on", "limit-plus": "on", "home": "on", "limit-minus-invert": "off",
        "limit-plus-invert": "off", "home-invert": "off", "limit-minus-pin": "dedicated",
        "limit-plus-pin": "dedicated", "home-pin": "dedicated", "homing-invert": "off", "homing-speed": 24,
        "homing-return-speed": 15, "homing-algorithm": 131, "homing-back-off": 0}


@contextlib.contextmanager
def machine(**keys):
    with House() as house:
        # a busy computer is late at times, and that would be a loss
        house.device_keys["mill"] |= {"heartbeat-timeout-ms": 1000, "lost-after-ms": 5000, "stale-after-ms": 4000,
                                      "failsafe-timeout-ms": 9000, "axes": 3, "generator": "external",
                                      **{f"axis.{i}.{key}": value for i in range(3) for key, value in AXIS.items()},
                                      "axis.1.mode": "buffered", **keys}
        sim = house.start_sim()
        for i in range(3):
            house.ask_sim(sim, "switch", i, "home", -2000000, -4000)
            house.ask_sim(sim, "switch", i, "minus", -2000000, -6000)
            house.ask_sim(sim, "switch", i, "plus", 6000, 2000000)
        house.start_daemon()
        house.wait_fresh()
        yield house, sim


def counts(house, axis=0):
    return int(house.ctl("get", "mill", f"joint.{axis:02}.counts").stdout)


def off(house):
    """The machine is off, and nothing moves."""
    wait_for("machine off", lambda: house.ctl("get", "mill", "machine-on-permitted").stdout == "false\n",
             say=house.log)
    wait_for("the engine to stop", lambda: house.ctl("get", "mill", "engine-state").stdout in ("0\n", "100\n", "101\n"),
             say=house.log)


def axis(house, *words):
    return house.ctl("axis", "mill", *words)


def test_an_axis_is_moved_there_and_back():
    with machine() as (house, _sim):
        ran = axis(house, 0, "move", 1000)
        equal((ran.returncode, ran.stderr), (0, ""))
        equal(ran.stdout, "mill: axis 0 from 0 to 1000 pulses, 2000 pulses/s; Ctrl-C stops it\n"
                          "mill: axis 0 is at 1000 pulses\n")
        equal(counts(house), 1000)
        off(house)
        equal(axis(house, 0, "move", "-1500", "--speed", 5000).returncode, 0)
        equal(counts(house), -500)
        equal(axis(house, 0, "stop").stdout, "mill: axis 0 is at -500 pulses\n")
        off(house)
        equal(counts(house, 1), 0)


def test_the_device_homes_it():
    for number in (0, 1):
        with machine() as (house, _sim):
            ran = axis(house, number, "home")
            equal((ran.returncode, ran.stderr), (0, ""), house.log())
            assert re.search(rf"^mill: axis {number} is homed, at -?\d+ pulses$", ran.stdout, re.M), ran.stdout
            off(house)
            equal(house.ctl("get", "mill", f"joint.{number:02}.homed").stdout, "true\n")


def test_a_signal_lets_it_brake():
    with machine() as (house, sim):
        house.ask_sim(sim, "switch", 0, "plus", 50000, 2000000)
        child = house.spawn("pokeysctl", "-r", house.runtime, "axis", "mill", 0, "move", 40000, log="ctl.log")
        wait_for("motion", lambda: counts(house) > 200, say=lambda: house.log("ctl.log"))
        equal(end(child, signal.SIGINT), 1)
        said = re.search(r"axis 0: ended by a signal\n.*axis 0: it is at (\d+) pulses\n$", house.log("ctl.log"))
        off(house)
        assert said and int(said[1]) == counts(house) < 39000, (house.log("ctl.log"), counts(house))


def test_killed_or_stopped_it_stands():
    for number in (signal.SIGKILL, signal.SIGSTOP):
        with machine() as (house, sim):
            house.ask_sim(sim, "switch", 0, "plus", 50000, 2000000)
            child = house.spawn("pokeysctl", "-r", house.runtime, "axis", "mill", 0, "move", 45000, "--speed", 3000,
                                log="ctl.log")
            wait_for("motion", lambda: counts(house) > 200, say=lambda: house.log("ctl.log"))
            child.send_signal(number)
            off(house)
            assert counts(house) < 40000, counts(house)
            if number == signal.SIGSTOP:
                child.send_signal(signal.SIGCONT)
                equal(child.wait(60), 1)
                assert re.search(r"axis 0: (this program was stopped|stopped at)", house.log("ctl.log")), house.log("ctl.log")
                off(house)


def test_it_is_as_fast_as_was_said_and_never_gets_a_far_position():
    with machine() as (house, _sim):
        child = house.spawn("pokeysctl", "-r", house.runtime, "axis", "mill", 0, "move-to", 4000, "--speed", 2000,
                            log="ctl.log")
        seen = []
        while child.poll() is None:
            found = json.loads(house.ctl("get", "mill", "joint.00.counts*", "age.motion-us", "--json").stdout)["values"]
            seen.append((time.monotonic() - found["age.motion-us"] / 1e6, found["joint.00.counts"],
                         found["joint.00.counts-cmd"]))
        equal((child.returncode, counts(house)), (0, 4000), house.log("ctl.log"))
        moving = [place for place in seen if 200 < place[1] < 3800]
        (began, first, _), (ended, last, _) = moving[0], moving[-1]
        assert 1500 < (last - first) / (ended - began) < 2200, moving
        # a second's way at most, and what it needs to brake
        assert max(abs(place[2] - place[1]) for place in moving) < 2000 * 1.1, moving


def test_a_device_that_is_restarted_is_not_moved():
    with machine() as (house, sim):
        house.ask_sim(sim, "switch", 0, "plus", 50000, 2000000)
        child = house.spawn("pokeysctl", "-r", house.runtime, "axis", "mill", 0, "move", 40000, "--speed", 2000,
                            log="ctl.log")
        wait_for("motion", lambda: counts(house) > 200, say=lambda: house.log("ctl.log"))
        house.ask_sim(sim, "reboot")
        equal(child.wait(60), 1, house.log("ctl.log"))
        off(house)
        assert abs(counts(house)) < 3000, (counts(house), house.log("ctl.log"))


def test_what_speed_cannot_be_is_refused():
    with machine(**{"axis.2.mode": "velocity"}) as (house, _sim):
        ran = axis(house, 0, "move", 100)
        equal((ran.returncode, ran.stdout), (1, ""))
        assert "would move it at its highest speed" in ran.stderr and "--speed 20000 permits that" in ran.stderr, ran
        equal(axis(house, 0, "move", 100, "--speed", 20000).returncode, 0)


def test_a_limit_switch_ends_it():
    with machine() as (house, _sim):
        ran = axis(house, 0, "move", 9000, "--speed", 20000)
        equal(ran.returncode, 1)
        assert re.search(r"^pokeysctl: mill: axis 0: stopped at [67]\d\d\d pulses: stopped by limit", ran.stderr), ran
        equal(ran.stderr.count("\n"), 1, ran.stderr)
        off(house)
        # it is moved off again, in the one direction, and before anything else
        for words, text in (((0, "move", 10), "it is on its positive limit switch, and can only be moved back"),
                            ((2, "move", 10), "axis 0 is on a limit switch; move that one off it first")):
            ran = axis(house, *words)
            equal((ran.returncode, ran.stdout), (1, ""))
            assert text in ran.stderr, ran
        # ... while no switch is looked at: slowly, and only until it is open
        house.ask_sim(_sim, "switch", 0, "plus", 3000, 2000000)
        ran = axis(house, 0, "move-to", 1000, "--speed", 20000)
        equal(ran.returncode, 1)
        assert "its limit switch is still pressed, 2000 pulses on" in ran.stderr, ran
        house.ask_sim(_sim, "switch", 0, "plus", 6000, 2000000)
        ran = axis(house, 0, "move-to", -9000, "--speed", 20000)
        equal(ran.returncode, 1)
        assert re.search(r"stopped at -[67]\d\d\d pulses: stopped by limit, negative limit switch", ran.stderr), ran
        ran = axis(house, 0, "move-to", 0, "--speed", 20000)
        equal((ran.returncode, ran.stderr, counts(house)), (0, "", 0), house.log())
        equal(axis(house, 2, "move", 10).returncode, 0)


def test_an_emergency_stop_ends_it_until_it_is_released():
    with machine(**{"emergency-pin": "default", "emergency-invert": "off"}) as (house, sim):
        house.ask_sim(sim, "switch", 0, "plus", 50000, 2000000)
        child = house.spawn("pokeysctl", "-r", house.runtime, "axis", "mill", 0, "move", 45000, "--speed", 3000,
                            log="ctl.log")
        wait_for("motion", lambda: counts(house) > 200, say=lambda: house.log("ctl.log"))
        house.ask_sim(sim, "emergency", "pressed")
        equal(child.wait(60), 1)
        assert "stopped by emergency" in house.log("ctl.log"), house.log("ctl.log")
        off(house)
        place = counts(house)
        for words in ((0, "move", 100), (0, "home")):
            ran = axis(house, *words)
            equal((ran.returncode, ran.stdout, counts(house)), (1, "", place))
            assert "stopped by emergency; release the button, then: pokeysctl axis mill 0 clear" in ran.stderr, ran
        # a device does not say at once that the button is still pressed, but stops again
        axis(house, 0, "clear")
        equal((axis(house, 0, "move", 100).returncode, counts(house)), (1, place))
        house.ask_sim(sim, "emergency", "released")
        wait_for("the release", lambda: axis(house, 0, "clear").returncode == 0, say=house.log)
        equal(counts(house), place)
        equal(axis(house, 0, "move-to", place + 100).returncode, 0)
        equal(counts(house), place + 100)


def test_what_cannot_be_is_told_in_one_line():
    with machine(**{"axis.0.soft-limits": "on", "axis.0.soft-minimum": -100, "axis.0.soft-maximum": 1000}) as (house, _sim):
        def refused(*words):
            ran = axis(house, *words)
            equal((ran.returncode, ran.stderr.count("\n")), (1, 1), ran.stderr)
            off(house)
            return ran.stderr
        assert "axis 1: it is in buffered mode, and only one in position mode can be moved" in refused(1, "move", 10)
        assert "axis 5: it is not set up; see axes and axis.5.mode" in refused(5, "move", 10)
        assert "--speed 30000 is above its highest speed, 20000 pulses/s" in refused(0, "move", 10, "--speed", 30000)
        assert "are too far" in refused(0, "move-to", 20000000)
        assert "the daemon refuses this position" in refused(0, "move", 2000)
        equal(counts(house), 0)
        child = house.spawn("commander", house.runtime, "mill", 32, log="commander.log")
        wait_for("the commander", lambda: "commanding" in house.log("commander.log"))
        assert re.search(r"another commander holds device 'mill': process \d+ \(commander\)", refused(0, "stop"))
        end(child, signal.SIGKILL)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=3))
