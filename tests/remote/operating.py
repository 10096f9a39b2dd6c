#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC operated over the control socket of pokeys-remote: queued, answered at once, and stopped by itself."""
import itertools
import os
import pathlib
import re
import signal
import subprocess
import time

import rig
from linuxcncrig import ADDRESS, LinuxCNC, position, stands, switch_on, the_screen
from rig import wait

PROGRAMME = "G21 G90 G64\nG0 X0 Y0\n" + "".join(f"G1 X{step % 7} Y{step % 5} F3000\n" for step in range(60)) + \
    "G1 X3.25 Y-1.5\nM2\n"


def on(machine):
    """A client that has subscribed, of a machine that is on."""
    one = machine.control()
    assert one.asked("subscribe") is None
    one.until(lambda seen: seen.get("task") == "estop")
    switch_on(one)
    return one


def homed(machine):
    one = on(machine)
    one.fine("mode", mode="manual")
    one.fine("home", joint=-1)
    one.until(lambda seen: all(seen["homed"]) and seen["motion"] == "axes")
    return one


PRESSES = itertools.count(1)


def hold(one, axis, speed, until):
    """Jog as long as somebody holds the key, which repeats; the press. On a busy machine, it is pressed again."""
    press = next(PRESSES)

    def held():
        nonlocal press
        if fault := one.do("jog", axis=axis, speed=speed, press=press):
            assert fault == "this press has ended", fault
            press = next(PRESSES)
        return until()
    wait(f"{axis} jogs", held)
    return press


def up(one, axis):
    """The key is up."""
    one.fine("jog", axis=axis, speed=0, press=0)


def processes(role):
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if f"linuxcncsession\0{role}".encode() in path.read_bytes():
                found.append(int(path.parent.name))
        except OSError:
            continue
    return found


def state_and_refusals(machine):
    one = machine.control()
    # before anything was asked for, nothing of LinuxCNC is touched
    assert processes("watch") == processes("commands") == []
    assert one.asked("subscribe") is None
    state = one.until(lambda seen: seen.get("task") == "estop")
    assert (state["connected"], state["axes"], state["joints"], state["mode"]) == (True, ["x", "y", "z"], 3, "manual")
    assert (state["max_feed_override"], state["max_rapid_override"], state["max_spindle_override"]) == (1.5, 1, 1)
    for method, params, text in (
            ("mdi", {"line": "G0 X1"}, "the machine is not on"), ("run", {}, "the machine is not on"),
            ("home", {"joint": 0}, "the machine is not on"), ("resume", {}, "the machine is not on"),
            ("jog", {"axis": "0", "speed": 1, "press": -1}, "the machine is not on"),
            ("jog", {"axis": "x", "speed": 1, "press": -1}, "joints are jogged now, by number"),
            ("jog", {"axis": "3", "speed": 1, "press": -1}, "there is no joint 3"),
            ("override", {"what": "feed", "value": 1.6}, "feed override is from 0 to 1.5"),
            ("override", {"what": "spindle", "value": 1.1}, "spindle override is from 0 to 1")):
        assert one.do(method, **params) == text, (method, params)
    for method, params, text in (
            ("mdi", {"line": "G0\nX1"}, "line: one line of G-code"), ("mdi", {"line": "(" + 254 * "x" + ")"}, "at most 255"),
            ("mdi", {"line": " "}, "line: one line"), ("mode", {"mode": "off"}, "mode: one of manual, mdi, auto"),
            ("override", {"what": "x", "value": 1}, "what: one of feed, rapid, spindle"),
            ("jog", {"axis": "x", "speed": float("nan"), "press": 1}, "speed: units/s"),
            ("jog", {"axis": "\u00b2", "speed": 1, "press": 1}, "axis: the letter"),
            ("jog", {"axis": "X", "speed": 1, "press": 1}, "axis: the letter"),
            ("jog", {"axis": "x"}, "linuxcnc.jog needs exactly these parameters: axis (str), speed (float), press (int)")):
        assert text in one.asked(method, **params), (method, params)
    switch_on(one)
    assert one.do("mdi", line="G0 X1") == "the mode is not MDI"
    assert one.do("run") == "the mode is not auto"
    assert one.do("jog", axis="x", speed=1, press=next(PRESSES)) == "joints are jogged now, by number"
    one.fine("override", what="feed", value=1.25)
    one.fine("override", what="rapid", value=0.5)
    one.until(lambda seen: (seen["feed_override"], seen["rapid_override"]) == (1.25, 0.5))
    one.fine("mode", mode="auto")
    one.until(lambda seen: seen["mode"] == "auto")
    assert one.do("run") == "no programme is loaded"
    assert one.do("home", joint=0) == "the mode is not manual"
    one.fine("mode", mode="mdi")
    # nothing is homed; a busy machine may not say so in time
    wait("it is refused", lambda: one.do("mdi", line="G1 X1 F60") == "LinuxCNC refuses it; its message says why")
    assert one.asked("emergency_stop") is None
    one.until(lambda seen: seen["task"] == "estop")
    # who subscribes later gets all of it
    two = machine.control()
    assert two.asked("subscribe") is None
    assert two.until(lambda seen: seen.get("mode") == "mdi")["axes"] == ["x", "y", "z"]


def a_jog_lasts_as_long_as_it_is_held(machine):
    one = homed(machine)
    assert one.do("jog", axis="0", speed=1, press=next(PRESSES)) == "axes are jogged now, by letter"
    assert one.do("jog", axis="a", speed=1, press=next(PRESSES)) == "there is no axis a"
    hold(one, "x", 20, lambda: position(0) > 5)
    up(one, "x")
    there = stands(0)
    press = hold(one, "x", -30, lambda: position(0) < there - 2)
    # nobody says more: it stops by itself, and what comes late does not begin it again
    there = stands(0)
    assert one.do("jog", axis="x", speed=-30, press=press) == "this press has ended"
    assert one.do("jog", axis="x", speed=30, press=press) == "this press has ended"
    assert stands(0) == there
    # somebody else stops it: the key is still down, and has to be pressed again
    two = machine.control()
    press = hold(one, "x", 20, lambda: position(0) > there + 2)
    assert two.asked("stop") is None
    assert one.do("jog", axis="x", speed=20, press=press) == "this press has ended"
    stands(0)
    # the other way at once
    hold(one, "y", 20, lambda: position(1) > 2)
    hold(one, "y", -20, lambda: position(1) < 0)
    # and another one meanwhile
    two.asked("subscribe")
    one.fine("jog", axis="y", speed=-20, press=next(PRESSES))

    pressed = 0

    def refused():
        nonlocal pressed
        hold(one, "y", -20, lambda: True)
        pressed = next(PRESSES)
        return two.do("jog", axis="y", speed=20, press=pressed) == "somebody else jogs y"
    wait("it is refused; on a busy machine, a jog may have ended", refused)
    # it does not begin when the other key is up
    up(one, "y")
    assert two.do("jog", axis="y", speed=20, press=pressed) == "this press has ended"
    there = stands(1)
    hold(one, "y", -20, lambda: position(1) < there - 1)
    assert one.do("mode", mode="mdi") in ("an axis is jogged", None)
    wait("nothing is held", lambda: one.do("mode", mode="manual") is None)
    hold(two, "z", 10, lambda: position(2) > 1)
    # the connection ends while it is held
    two.fine("jog", axis="z", speed=10, press=next(PRESSES))
    two.close()
    stands(1)
    stands(2)
    # up to the limit and no farther
    hold(one, "x", 50, lambda: position(0) > 80)
    assert 80 < stands(0) <= 100
    one.fine("mode", mode="mdi")
    assert one.do("jog", axis="x", speed=1, press=next(PRESSES)) == "the mode is not manual"


def a_jog_ends_with_its_processes(machine):
    one = homed(machine)
    proxy = rig.listed()["pokeys-remote"]
    for how in (signal.SIGKILL, signal.SIGSTOP):
        # ten times as fast as the axis may go: 0.3 s of its way, and what it needs to slow down
        hold(one, "x", 500, lambda where=position(0): position(0) > where + 10)
        os.kill(processes("commands")[0], how)
        seen = position(0)
        assert stands(0) - seen < 0.3 * 50 + 50 ** 2 / 500 / 2 + 1
        if how == signal.SIGSTOP:
            number = one.send("jog", axis="x", speed=20, press=next(PRESSES))
            os.kill(processes("commands")[0], signal.SIGCONT)
            while number not in one.done:
                one.hear()
            up(one, "x")
            stands(0)
    hold(one, "x", -20, lambda where=position(0): position(0) < where - 2)
    os.kill(proxy, signal.SIGSTOP)
    stands(0)
    os.kill(proxy, signal.SIGCONT)
    wait("it is obeyed again", lambda: one.asked("jog", axis="x", speed=-20, press=next(PRESSES)) is None)
    hold(one, "x", -20, lambda where=position(0): position(0) < where - 2)
    os.kill(proxy, signal.SIGKILL)
    stands(0)
    wait("its processes have ended", lambda: not processes("commands") + processes("watch"))
    two = machine.control()
    assert two.asked("subscribe") is None
    two.until(lambda seen: seen.get("task") == "on")
    hold(two, "x", 20, lambda where=position(0): position(0) > where + 2)
    os.kill(processes("watch")[0], signal.SIGKILL)
    assert two.until(lambda seen: not seen["connected"])["why"] == "the process for it has ended"
    two.until(lambda seen: seen["connected"] and seen["task"] == "on")


def to_stop_goes_first(machine):
    one = homed(machine)
    one.fine("mode", mode="mdi")
    one.fine("mdi", line="G1 X90 F300")
    wait("it moves", lambda: position(0) > 0.5)
    # as if LinuxCNC took no commands: one is given, 32 wait, and there is no place for another one
    os.kill(processes("commands")[0], signal.SIGSTOP)
    waiting = [one.send("mdi", line=f"G1 X{number}") for number in range(34)]
    while not set(waiting) <= one.answers.keys():
        one.hear()
    assert [number for number in waiting if one.answers[number]] == waiting[33:]
    assert one.answers[waiting[33]] == "32 commands wait already, which is the most"
    assert one.asked("stop") is None
    assert 0.5 < stands(0) < 60
    while not set(waiting[1:33]) <= one.done.keys():
        one.hear()
    assert {one.done[number] for number in waiting[1:33]} == {"it was stopped"}
    os.kill(processes("commands")[0], signal.SIGCONT)
    there = position(0)
    while waiting[0] not in one.done:
        one.hear()
    assert one.done[waiting[0]] == "it was stopped"
    assert stands(0) == there
    # and the next one is obeyed, but not one behind one that is refused
    number = [one.send("mdi", line="G1 X50") for _ in range(2)] if one.asked("mode", mode="manual") is None else []
    while not set(number) <= one.done.keys():
        one.hear()
    assert [one.done[each] for each in number] == ["the mode is not MDI", "the command before it was not carried out"]
    one.fine("mode", mode="mdi")
    one.fine("mdi", line="G1 X1 F3000")
    one.until(lambda seen: seen["position"]["x"] == 1)
    # also while it is held
    one.fine("mode", mode="manual")
    hold(one, "y", 10, lambda: position(1) > 1)
    assert one.asked("stop") is None
    stands(1)


def what_came_before_a_stop_does_not_move(machine):
    one = homed(machine)
    two = machine.control()
    one.fine("mode", mode="mdi")
    proxy = rig.listed()["pokeys-remote"]
    # so much at once that the stop is read before most of it
    os.kill(proxy, signal.SIGSTOP)
    lines = [one.send("mdi", line=f"G1 X{number} F3000") for number in range(40)]
    late = machine.control()
    late.send("mdi", line="G1 X90 F3000")
    two.send("stop")
    os.kill(proxy, signal.SIGCONT)
    assert two.asked("mode", mode="manual") is None
    while not set(lines) <= one.answers.keys():
        one.hear()
    while 1 not in late.answers:
        late.hear()
    there = stands(0)
    assert one.asked("stop") is None and stands(0) == there
    assert late.answers[1] in ("it was stopped", "this may be old; send it again")
    # who is gone asks for nothing any more
    one.fine("mode", mode="mdi")
    os.kill(proxy, signal.SIGSTOP)
    late.send("mdi", line="G1 X90 F3000")
    late.close()
    os.kill(proxy, signal.SIGCONT)
    assert one.asked("override", what="feed", value=1) is None and stands(0) == there
    # a stop while another one is under way
    watch = processes("watch")[0]
    os.kill(watch, signal.SIGSTOP)
    first = one.send("stop")
    one.fine("mdi", line="G1 X90 F300")
    wait("it moves", lambda: position(0) > there + 0.5)
    second = two.send("stop")
    assert two.asked("override", what="feed", value=1) is None
    os.kill(watch, signal.SIGCONT)
    while first not in one.answers:
        one.hear()
    while second not in two.answers:
        two.hear()
    assert one.answers[first] is two.answers[second] is None and stands(0) < 80


def programmes_run_beside_a_storm_of_settings(machine):
    one = homed(machine)
    path = machine.folder / "programme.ngc"
    path.write_text(PROGRAMME, encoding="utf-8")
    path.chmod(0o666)
    client = rig.Client("storm").connect()
    the_screen().program_open(str(path))
    one.until(lambda seen: seen["file"] == str(path))
    one.fine("mode", mode="auto")
    one.fine("run")
    one.until(lambda seen: seen["interpreter"] != "idle")
    assert one.do("mode", mode="manual") == "a programme or an MDI line runs"
    one.fine("pause")
    one.until(lambda seen: seen["paused"])
    for number in range(3000):
        client.send(259, pin=[client.pin("mask", number), client.pin("jog", number / 7)])
        if number == 500:
            one.fine("resume")
    client.set(mask=7)
    one.until(lambda seen: seen["interpreter"] == "idle" and not seen["moving"])
    assert (position(0), position(1), one.state["task"]) == (3.25, -1.5, "on")
    client.close()


def the_program_of_the_chapter(machine):
    """docs/remote.md: what it prints is what it does."""
    page = (rig.ROOT / "docs/remote.md").read_text(encoding="utf-8")
    program, printed = re.search(r"^```python\n(import json\n.*?)^```$.*?^```\n(.*?)^```$", page, re.M | re.S).groups()
    one = homed(machine)
    ran = subprocess.run(["/usr/bin/python3", "-c", program], capture_output=True, text=True, check=True,
                         timeout=rig.PATIENCE)
    assert sorted(ran.stdout.splitlines()) == sorted(printed.splitlines()), ran.stdout
    one.until(lambda seen: seen["position"]["x"] == 10)


def messages_if_they_are_asked_for(machine):
    one = homed(machine)
    one.fine("mode", mode="mdi")
    wait("it is refused", lambda: one.do("mdi", line="G987") == "LinuxCNC refuses it; its message says why")
    wait("it is said", lambda: one.said or one.hear())
    assert one.said[0]["kind"] == "error" and "out of range" in one.said[0]["text"], one.said


def another_user_may_operate_if_listed(machine):
    if not rig.of_other_users():
        print("not tried: another user (this needs root)")
        return
    on(machine)
    program = ("import json, os, socket\n"
               "os.setgroups([]); os.setgid(65534); os.setuid(65534)\n"
               f"one = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)\none.connect({ADDRESS!r})\n"
               "def ask(method, **params):\n"
               "    one.sendall(json.dumps({'jsonrpc': '2.0', 'id': 1, 'method': method, 'params': params}).encode() + "
               "b'\\n')\n"
               "    print(one.recv(4096).decode().split('\\n')[0])\n"
               "ask('linuxcnc.stop')\nask('newcomp', component='panel')\n")
    ran = subprocess.run(["/usr/bin/python3", "-c", program], capture_output=True, text=True, check=True)
    assert '"result":true' in ran.stdout and "user 65534 may operate LinuxCNC, and nothing else" in ran.stdout, ran


if __name__ == "__main__":
    rig.main([state_and_refusals, a_jog_lasts_as_long_as_it_is_held, a_jog_ends_with_its_processes, to_stop_goes_first,
              what_came_before_a_stop_does_not_move, programmes_run_beside_a_storm_of_settings, the_program_of_the_chapter,
              messages_if_they_are_asked_for,
              another_user_may_operate_if_listed], LinuxCNC)
