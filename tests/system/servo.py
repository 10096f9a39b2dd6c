#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Servo motors of a running daemon, with the simulated motors of preset servo-mill.

Their control and their faults are tested in virtual time (device / servoing). Here are the ways of positions and
states, and who stops a motor when the daemon itself cannot. A computer that is busy for a tenth of a second stops
a motor, as it must; then it is reset and begins again."""
import contextlib
import os
import re
import signal
import subprocess
import sys
import time

from house import PATIENCE, House, equal, main, wait_equal, wait_for


@contextlib.contextmanager
def machine(**keys):
    """Three motors, and a program that commands them."""
    with uncommanded(**keys) as (house, sim, daemon):
        commander = subprocess.Popen([house.programs["servo_commander"], house.runtime, "mill"], stdin=subprocess.PIPE,
                                     text=True, bufsize=1)
        house.children.append(commander)
        yield house, sim, daemon, commander
        commander.stdin.close()


@contextlib.contextmanager
def uncommanded(own=None, device=None, **keys):
    """Without that program; `own`: what one of the motors has in addition, `device`: what the device has."""
    with House() as house:
        house.device_keys["mill"] |= (device or {}) | {"lost-after-ms": 5000, "stale-after-ms": 4000, "heartbeat-timeout-ms": 2000,
                                      "pwm-period": 1250}
        common = {"counts-per-unit": 400, "max-speed": 300, "pid-p": 1, "pid-i": 10, "pid-d": 0.01, "velocity-gain": 0.0026,
                  "smooth-s": 0.001, "min-following-error": 20, "max-following-error": 40, "max-age-ms": 100,
                  "stall-s": 3, "silent-s": 1, **keys}
        house.servo_keys = {name: {"encoder": i, "pwm": i, "direction-pin": 31 + i, "enable-pin": 35 + i, **common}
                            for i, name in enumerate("xyz")}
        for name, more in (own or {}).items():
            house.servo_keys[name] |= more
        sim = house.start_sim("--preset", "servo-mill")
        daemon = house.start_daemon()
        house.wait_fresh()
        wait_for("all to be ready", lambda: [servo["condition"] for servo in servos(house)] == ["none"] * 3,
                 say=lambda: servos(house))
        yield house, sim, daemon


def servos(house):
    return house.state().get("servos", [])


def tell(commander, *words):
    print(*words, file=commander.stdin, flush=True)


def motor(house, sim, number):
    """What the simulated motor does."""
    return {key: float(value) for key, value in (line.split("=") for line in house.ask_sim(sim, "motor", number).splitlines())}


def enable(house, commander, number=0):
    def enabled():
        servo = servos(house)[number]
        if servo["state"] != "enabled":
            if servo["state"] == "fault":
                tell(commander, "reset", number)
                time.sleep(0.2)
            tell(commander, "on", number)
            time.sleep(0.3)
        return servos(house)[number]["state"] == "enabled"
    wait_for("it to be enabled", enabled, say=lambda: (servos(house)[number], house.log()))


def go(house, commander, number, to):
    """There, whatever stops it on the way."""
    def arrived():
        if servos(house)[number]["state"] != "enabled":
            enable(house, commander, number)
        tell(commander, "to", number, to)
        time.sleep(0.1)
        return abs(servos(house)[number]["position"] - to) < 0.1
    wait_for(f"{to}", arrived, say=lambda: (servos(house)[number], house.log()))


def test_a_motor_goes_where_it_is_commanded_to():
    with machine() as (house, sim, _daemon, commander):
        equal([servo["name"] for servo in servos(house)], ["x", "y", "z"])
        house.tells("servo 0     x: at 0.0000, off", "status", "mill")
        go(house, commander, 1, 12.5)

        def there():
            # a computer that stops for a moment may switch it off at any time
            go(house, commander, 1, -3)
            return (abs(motor(house, sim, 1)["turns"] + 3 / 5) < 0.02 and
                    [servo["state"] for servo in servos(house)] == ["off", "enabled", "off"] and
                    ", enabled, error " in house.ctl("status", "mill").stdout and
                    abs(float(house.ctl("get", "mill", "servo.01.pos-fb").stdout) + 3) < 0.1)
        wait_for("the shaft to be there", there, say=lambda: (servos(house)[1], motor(house, sim, 1), house.log()))
        equal(motor(house, sim, 0)["count"], 0)
        equal(house.ctl("get", "mill", "servo.01.name").stdout, "y\n")
        tell(commander, "off", 1)

        def is_off():
            if (state := servos(house)[1]["state"]) == "fault":
                tell(commander, "reset", 1)
            return state == "off"
        wait_for("it off", is_off, say=lambda: (servos(house)[1], house.log()))
        wait_equal("no voltage", lambda: motor(house, sim, 1)["output"], 0)


def test_a_broken_motor_is_a_fault_until_it_is_reset():
    with machine(**{"min-following-error": 1, "max-following-error": 2}) as (house, sim, _daemon, commander):
        enable(house, commander)
        house.ask_sim(sim, "motor", 0, "stalled")
        tell(commander, "to", 0, 30)
        wait_equal("the fault", lambda: servos(house)[0]["state"], "fault")
        wait_equal("no voltage", lambda: motor(house, sim, 0)["output"], 0)
        house.tells("off until it is reset", "status", "mill")
        wait_for("the log", lambda: "servo 0: fault: " in house.log())
        house.ask_sim(sim, "motor", 0, "good")
        enable(house, commander)


def ended(house, *words, until=None, command="servo"):
    """Status and text of pokeysctl servo, which ends by itself, or by a signal when `until` is true."""
    log = f"ctl{len(house.children)}.log"
    ran = house.spawn("pokeysctl", "-r", house.runtime, command, "mill", *words, log=log)
    if until:
        wait_for("it to go on", lambda: until() or ran.poll() is not None, say=lambda: house.log(log))
        ran.send_signal(signal.SIGINT)
    return ran.wait(PATIENCE), house.log(log)


def succeeds(house, *words, until=None):
    """Its text; a computer that is busy for a tenth of a second stops a motor, and then it is tried again."""
    texts = []

    def did():
        status, text = ended(house, *words, until=until)
        texts.append(text)
        if status:
            assert "off by a fault" in text, text
            ended(house, words[0], "reset")
        return not status
    wait_for("success", did, say=lambda: texts)
    return texts[-1]


def test_pokeysctl_moves_a_motor_and_leaves_it_off():
    with uncommanded() as (house, sim, _daemon):
        text = succeeds(house, "x", "move-to", "5", "--speed", "20")
        assert re.search(r"^mill: servo x: at [45]\.\d+; following error at most \d+\.\d+, \d\.\d+ at rest; output at most "
                         r"\d+ %$", text, re.MULTILINE), text
        assert abs(servos(house)[0]["position"] - 5) < 0.1
        equal((servos(house)[0]["state"], motor(house, sim, 0)["output"]), ("off", 0))
        wait_for("the shaft to be there", lambda: abs(motor(house, sim, 0)["turns"] - 1) < 0.05)
        succeeds(house, "1", "move", "-2.5", "--speed", "20")
        assert abs(servos(house)[1]["position"] + 2.5) < 0.1
        begin = servos(house)[0]["position"]
        table = house.folder / "x.csv"
        succeeds(house, "x", "move", "2", "--speed", "20", "--csv", str(table))
        lines = table.read_text(encoding="utf-8").splitlines()
        equal(lines[0], "time_s,commanded,position,error,commanded_velocity,velocity,output")
        rows = [[float(cell) for cell in line.split(",")] for line in lines[1:]]
        assert len(rows) > 20 and rows == sorted(rows) and abs(rows[-1][2] - begin - 2) < 0.1, lines
        equal(ended(house, "x", "move", "1", "--speed", "1", "--csv", "/nowhere/x"),
              (1, "pokeysctl: --csv: /nowhere/x: No such file or directory\n"))
        succeeds(house, "x", "swing", "10", "--speed", "50", until=lambda: abs(servos(house)[0]["position"] - begin) > 5)
        equal((servos(house)[0]["state"], motor(house, sim, 0)["output"]), ("off", 0))


def test_pokeysctl_finds_gains():
    with uncommanded(**{"pid-p": 0.2, "pid-i": 0, "pid-d": 0, "velocity-gain": 0}) as (house, sim, _daemon):
        texts = []

        def found():
            status, text = ended(house, "x", "tune", "40")
            texts.append(text)
            if "off by a fault" in text:
                ended(house, "x", "reset")
            return not status
        wait_for("gains", found, say=lambda: texts)
        gains = dict(re.findall(r"^(\S+) = (\S+)$", texts[-1], re.MULTILINE))
        equal(list(gains), ["pid-p", "pid-i", "pid-d", "velocity-gain", "acceleration-gain"])
        assert "\n[servo x]\npid-p = " in texts[-1], texts
        # those of the simulated motor, whatever else this computer does
        assert 0.002 < float(gains["velocity-gain"]) < 0.0035, texts
        assert 2e-5 < float(gains["acceleration-gain"]) < 1e-4, texts
        equal([servos(house)[0][key] for key in ("state", "tuning")], ["off", "done"])
        equal(motor(house, sim, 0)["output"], 0)
        for name, value in gains.items():
            equal(ended(house, "x", "gain", name, value)[0], 0)
        succeeds(house, "x", "move-to", "10", "--speed", "20")
        status, text = ended(house, "x", "tune", "0.1")
        equal((status, text), (1, "pokeysctl: mill: servo x: refused: 0.1 is less than 96 counts of the encoder, a soft "
                                  "limit is nearer than 0.055, a limit switch is pressed, or the motor moves\n"))


def program(house, *lines):
    """A file of moves."""
    path = os.path.join(house.folder, "moves.txt")
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")
    return path


def moves(house, *lines, until=None):
    """Status and text of pokeysctl moves; what a busy computer has stopped is tried again."""
    results = []

    def did():
        results.append(ended(house, program(house, *lines), command="moves", until=until))
        stopped = "off by a fault" in results[-1][1]
        for name in "xyz" if stopped else "":
            ended(house, name, "reset")
        return not stopped
    wait_for("an end", did, say=lambda: results)
    return results[-1]


def test_pokeysctl_moves_motors_together():
    with uncommanded() as (house, sim, _daemon):
        sides = [f"x {x} y {y}" for n in range(20) for x, y in ((5, 0), (5, 5), (0, 5), (0, 0))]
        status, text = moves(house, "speed 80  # of all", *sides, "", "; the last one", "z -2.5 x 1 speed 20")
        equal(status, 0)
        assert re.search(r"^mill: completed all 81 moves\n  x: at (1|0\.9)\S*; following error at most \S+\n  y: at \S+; .*\n"
                         r"  z: at -2\.[45]\S*; ", text, re.MULTILINE), text
        for number, place in enumerate((1, 0, -2.5)):
            assert abs(servos(house)[number]["position"] - place) < 0.1
            equal((servos(house)[number]["state"], motor(house, sim, number)["output"]), ("off", 0))
        wait_for("the shaft to be there", lambda: abs(motor(house, sim, 2)["turns"] + 0.5) < 0.05)
        shown = house.state()["moves"]
        assert shown["taken"] >= 81
        equal((shown["state"], shown["waiting"], shown["end"]), ("idle", 0, "done"))


def with_axes(**keys):
    """Two axes of the pulse engine beside the motors; one has no name of its own."""
    axis = {"mode": "position", "invert": "off", "max-speed": 20000, "max-acceleration": 200000, "pulses-per-unit": 200,
            **keys}
    return uncommanded(device={"axes": 2, "generator": "external", "axis.0.soft-limits": "off", "axis.0.name": "a", "axis.1.soft-limits": "on", "axis.1.soft-minimum": -1000,
                               "axis.1.soft-maximum": 4000} |
                       {f"axis.{i}.{key}": value for i in range(2) for key, value in axis.items()})


def axes(house):
    return house.state()["engine"]["axes"]


def test_pokeysctl_moves_axes_and_motors_together():
    with with_axes() as (house, _sim, _daemon):
        equal([(axis["name"], axis["pulses_per_unit"]) for axis in axes(house)[:2]], [("a", 200), ("axis.1", 200)])
        status, text = moves(house, "speed 40", "x 10 a 5 axis.1 -2.5", "a 12.345", "y -3 a 10 axis.1 20")
        equal(status, 0)
        assert re.search(r"^mill: completed all 3 moves\n  x: at (10|9\.9)\S*; .*\n  y: .*\n  a: at 10\.0000\n"
                         r"  axis\.1: at 20\.0000\n$", text, re.M), text
        equal([axis["position"] for axis in axes(house)[:2]], [2000, 4000])
        house.tells("axis 0      2000 (reference 2000) stopped, a at 10.0000", "status", "mill")
        equal([axis["enabled"] for axis in axes(house)[:2]], [False, False])
        equal(house.state()["flags"]["machine_on"], False)
        # no motor is needed
        status, text = moves(house, "a 0 axis.1 0 speed 50")
        equal((status, text.splitlines()[-3:]), (0, ["mill: completed all 1 moves", "  a: at 0.0000", "  axis.1: at 0.0000"]))
        for line, why in (("axis.1 20.01", "axis.1 20.01 is beyond its soft limits, -5 to 20"),
                          ("a 1e6", "a 1e+06 is further than the device can count"),
                          ("0 1 a 1 a 2", "a is given twice"),
                          ("axis.0 1", '"axis.0" is not a motor or an axis of mill (x, y, z, a, axis.1); a line has their '
                           "names and positions, or speed and a number")):
            status, text = ended(house, program(house, "speed 5", line), command="moves")
            equal((status, text.split(":2: ")[-1]), (1, why + "\n"))


def test_a_limit_switch_stops_the_moves_of_all():
    with with_axes(**{"limit-plus": "on", "limit-plus-invert": "off", "limit-plus-pin": "dedicated"}) as (house, sim, _daemon):
        for number, place in enumerate((3000, 9000)):
            house.ask_sim(sim, "switch", number, "plus", place, 2000000)
        status, text = moves(house, "x 50 a 50 speed 20")
        equal(status, 1)
        assert re.search(r"^pokeysctl: mill: axis a: stopped at 3\d\d\d pulses: stopped by limit, positive limit switch$", text,
                         re.M), text
        wait_equal("all off", lambda: [servo["state"] for servo in servos(house)], ["off"] * 3)
        wait_equal("the machine off", lambda: house.state()["flags"]["machine_on"], False)
        equal(ended(house, program(house, "a 0 speed 5"), command="moves"),
              (1, "pokeysctl: mill: axis a: it is on its positive limit switch; move it off first: pokeysctl axis mill 0 "
               "move PULSES\n"))


def test_pokeysctl_ends_moves_by_a_signal():
    with uncommanded() as (house, sim, _daemon):
        # it may be there already, from an attempt that a stall of the computer has ended
        status, text = moves(house, "x 90 y 90 speed 20", "x 0 y 0", until=lambda: (state := house.state()) and
                             state["moves"]["state"] != "idle" and state["servos"][0]["position"] > 5)
        equal(status, 1)
        assert "mill: path ended early: did not complete all 2 moves" in text, text
        equal(house.state()["moves"]["end"], "aborted")
        assert 4 < servos(house)[0]["position"] < 90
        wait_for("the event", lambda: "moves: aborted, with " in house.log())
        equal([motor(house, sim, number)["output"] for number in range(3)], [0] * 3)


def test_a_fault_stops_the_moves_of_all():
    with uncommanded(**{"min-following-error": 2, "max-following-error": 4}) as (house, sim, _daemon):
        def broke():
            house.ask_sim(sim, "motor", 0, "stalled")
            return True
        status, text = ended(house, program(house, "x 90 y 90 speed 20", "x 0 y 0"), command="moves",
                             until=lambda: servos(house)[1]["position"] > 5 and broke() and servos(house)[0]["fault"] != "none")
        equal(status, 1)
        assert "servo x: off by a fault: " in text, text
        equal(house.state()["moves"]["end"], "a motor or axis was switched off, or had a fault")
        wait_for("y to be off", lambda: servos(house)[1]["state"] == "off")
        equal([motor(house, sim, number)["output"] for number in range(3)], [0] * 3)


def test_moves_that_cannot_be_taken_move_nothing():
    with uncommanded() as (house, sim, _daemon):
        for lines, why in (
                (["x 1", "x 5"], 'moves.txt:1: no speed is given; write "speed 20" before, or give --speed 20'),
                (["speed 9", "x 5", "w 3"], 'moves.txt:3: "w" is not a motor or an axis of mill (x, y, z); a line has '
                 "their names and positions, or speed and a number"),
                (["speed 9", "x 5 x 6"], "moves.txt:2: x is given twice"),
                (["speed 0"], "moves.txt:1: speed is a number above 0, up to 1000000 units/s"),
                (["speed 5 x"], "moves.txt:1: there is not a number after x"),
                (["speed 5 x 1e"], 'moves.txt:1: "1e" is not a number'),
                (["speed 5 x nan"], 'moves.txt:1: "nan" is not a number'),
                (["speed 5 x 1e300"], "moves.txt:1: x 1e+300 is further than the device can count"),
                ([""], "moves.txt: contains no moves; example of a line: x 10 y 5 speed 20"),
                (["# nothing"], "moves.txt: contains no moves; example of a line: x 10 y 5 speed 20")):
            status, text = ended(house, program(house, *lines), command="moves")
            equal(status, 1)
            assert text.startswith("pokeysctl: ") and text.endswith(why + "\n"), text
        equal(ended(house, "/dev/null", command="moves"), (1, "pokeysctl: /dev/null: is empty\n"))
        equal(house.state()["moves"]["taken"], 0)
        equal([motor(house, sim, number)["count"] for number in range(3)], [0] * 3)


def test_pokeysctl_homes_a_motor():
    home = {"home-pin": 7, "home-search-speed": -50, "home-position": 5, "home-distance": 30}
    with uncommanded(own={"x": home}) as (house, sim, _daemon):
        # pressed from 10 mm to the left of where it stands
        house.ask_sim(sim, "motor", 0, "home", -2000000, -4000, 7)
        wait_for("the switch to be read", lambda: not servos(house)[0]["home_switch"])
        text = succeeds(house, "x", "home")
        assert re.search(r"^mill: servo x: homed, at [45]\.\d+$", text, re.MULTILINE), text
        equal([servos(house)[0][key] for key in ("state", "homed", "homing", "home_end")], ["off", True, "none", "done"])
        wait_for("the shaft to be there", lambda: abs(motor(house, sim, 0)["turns"] + 1) < 0.05)
        assert "homed" in house.ctl("status", "mill").stdout
        status, text = ended(house, "y", "home")
        equal(status, 1)
        assert "servo y: not homed: pokeysd.conf has no home-search-speed for this motor" in text, text
        # a wire that is broken: pressed wherever it is
        house.ask_sim(sim, "motor", 0, "home", "off")
        wait_for("the switch to be read", lambda: servos(house)[0]["home_switch"])

        def not_homed():
            status, text = ended(house, "x", "home")
            equal(status, 1)
            if "off by a fault" in text:
                ended(house, "x", "reset")
            return "mill: servo x: not homed: the home switch did not open" in text
        wait_for("it to be found", not_homed)
        equal((servos(house)[0]["state"], servos(house)[0]["homed"]), ("off", False))
        assert "NOT HOMED: the home switch did not open" in house.ctl("status", "mill").stdout


def test_pokeysctl_says_why_a_motor_does_not_move():
    with uncommanded(**{"min-following-error": 1, "max-following-error": 2}) as (house, sim, _daemon):
        status, text = ended(house, "w", "reset")
        equal((status, text), (1, 'pokeysctl: mill: there is no servo "w"; its servos: x, y, z\n'))
        house.ask_sim(sim, "motor", 0, "stalled")
        status, text = ended(house, "x", "move", "30", "--speed", "100")
        equal(status, 1)
        assert re.search(r"pokeysctl: mill: servo x: off by a fault: (following error|stalled|encoder silent); ", text), text
        status, text = ended(house, "x", "move", "1", "--speed", "1")
        assert status == 1 and "off by a fault" in text, text
        house.ask_sim(sim, "motor", 0, "good")
        equal(ended(house, "x", "reset"), (0, "mill: servo x: reset; it can be enabled again\n"))
        equal(ended(house, "x", "reset"), (0, "mill: servo x: no fault\n"))


def test_pokeysctl_changes_gains():
    with uncommanded() as (house, _sim, _daemon):
        equal(ended(house, "x", "gain", "velocity-gain", "0.0035"),
              (0, "mill: servo x: velocity-gain = 0.0035 until pokeysd ends; write it into [servo x] in pokeysd.conf to "
                  "keep it\n"))
        wait_equal("the gain", lambda: round(servos(house)[0]["gains"]["velocity"], 6), 0.0035)
        equal(ended(house, "x", "gain", "pid-i", "0")[0], 0)
        equal(ended(house, "x", "gain", "pid-p", "0"),
              (1, "pokeysctl: mill: servo x: pid-p = 0 is refused: pid-p and pid-i must not both be 0\n"))
        equal(round(servos(house)[0]["gains"]["p"], 6), 1)


def test_without_its_commander_it_is_off():
    for number in (signal.SIGKILL, signal.SIGSTOP):
        with machine() as (house, sim, _daemon, commander):
            enable(house, commander)
            house.ask_sim(sim, "motor", 0, "push", 100)
            commander.send_signal(number)
            wait_equal("no voltage", lambda: motor(house, sim, 0)["output"], 0)
            wait_equal("it off", lambda: servos(house)[0]["state"] in ("off", "fault"), True)
            commander.send_signal(signal.SIGCONT)


def test_the_device_stops_them_when_the_daemon_is_killed_or_hangs():
    for number in (signal.SIGKILL, signal.SIGSTOP):
        with machine() as (house, sim, daemon, commander):
            def driven():
                enable(house, commander)
                return abs(motor(house, sim, 0)["output"]) > 0.02
            house.ask_sim(sim, "motor", 0, "push", 100)
            wait_for("voltage", driven)
            daemon.send_signal(number)
            wait_equal("no voltage", lambda: motor(house, sim, 0)["output"], 0)


def test_a_device_without_its_failsafe_moves_nothing():
    with House() as house:
        house.device_keys["mill"] |= {"pwm-period": 1250, "failsafe": "off"}
        house.servo_keys = {"x": {"encoder": 0, "counts-per-unit": 400, "pwm": 0, "direction-pin": 31, "max-speed": 9, "pid-p": 1}}
        daemon = house.start_daemon(wait=False)
        equal(daemon.wait(PATIENCE), 78)
        assert "[servo x]: the failsafe of its device is off: the motor would keep running" in house.log(), house.log()


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=3))
