#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""examples/linuxcnc/remote-panel as its README has it: LinuxCNC and the panel, each from its command."""
import os
import re
import select
import subprocess

import rig
from linuxcncrig import EXAMPLE, LinuxCNC, position, switch_on
from rig import halcmd, wait

PINS = ("run", "stop", "running", "x")


class Panel:
    """panel.py with somebody in front of it."""

    def __init__(self):
        self.child = subprocess.Popen([EXAMPLE / "panel.py"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
        self.seen = {}

    def types(self, word):
        self.child.stdin.write(f"{word}\n".encode())

    def shows(self, name, test):
        """Until it has printed such a value of a pin."""
        while not (name in self.seen and test(self.seen[name])):
            assert select.select([self.child.stdout], [], [], rig.PATIENCE)[0], f"no {name} in {rig.PATIENCE} s: {self.seen}"
            line = self.child.stdout.readline().decode()
            assert line, "the panel has ended"
            pin, value = line.split()
            self.seen[pin.partition(".")[2]] = {"True": True, "False": False}.get(value) if value[0] in "TF" else float(value)

    def end(self):
        self.child.kill()
        self.child.wait()
        self.child.stdin.close()
        self.child.stdout.close()


def becomes(name, value):
    wait(f"{name} is {value}", lambda: halcmd("getp", name).strip() == value)


def as_the_readme_says(machine):
    readme = (EXAMPLE / "README.md").read_text(encoding="utf-8")
    assert "\nlinuxcnc remote-panel.ini\n./panel.py\n" in readme
    assert set(re.findall(r"^\| (`.*?) \|", readme, re.M)) and all(
        f"`{name}`" in readme for name in os.listdir(EXAMPLE) if name != "README.md")
    import linuxcnc
    one, panel = machine.control(), Panel()
    one.asked("subscribe")
    one.until(lambda seen: seen.get("task") == "estop")
    panel.shows("running", lambda value: value is False)
    switch_on(one)
    one.fine("home", joint=-1)
    one.until(lambda seen: all(seen["homed"]))
    linuxcnc.command().program_open(str(machine.folder / "remote-panel.ngc"))
    one.until(lambda seen: seen["file"].endswith("remote-panel.ngc"))
    panel.types("run")
    panel.shows("running", lambda value: value is True)
    panel.shows("x", lambda value: value > 1)
    panel.types("stop")
    panel.shows("running", lambda value: value is False)
    assert position(0) < 20
    panel.types("run")
    panel.shows("running", lambda value: value is True)
    # the panel dies; the programme goes on, and the button is up
    panel.end()
    becomes("panel.link-ok", "FALSE")
    becomes("panel.run", "FALSE")
    becomes("run.out", "FALSE")
    again = Panel()
    again.shows("running", lambda value: value is False)
    state = one.until(lambda seen: seen["interpreter"] == "idle" and not seen["moving"])
    assert state["task"] == "on" and max(abs(position(0)), abs(position(1))) < 1e-6
    again.types("run")
    again.shows("running", lambda value: value is True)
    again.types("stop")
    again.shows("running", lambda value: value is False)
    # its standard input ends
    again.child.stdin.close()
    assert again.child.wait(rig.PATIENCE) == 0
    again.child.stdout.close()


if __name__ == "__main__":
    rig.main([as_the_readme_says], LinuxCNC)
