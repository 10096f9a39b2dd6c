#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The user interface of a LinuxCNC session without anybody: homes, moves, ends.

LinuxCNC starts it as [DISPLAY]DISPLAY. Its last line is "moved" if all went well.
A busy machine may be late for a moment, and then its emergency chain opens: it is
switched on again, as an operator does, and goes on.

With MILL_UI_SIM (the words before a command to the simulator) the device is then
switched off and on, and "restarted" is the last line.
"""
import os
import subprocess
import sys
import time
import hal
import linuxcnc

LIMIT, SOON = 60, 10    # s
TRIES = 5
BOOT_MS = (0, 100)
WAYS, HALF_A_PULSE = (10, 5, -2), 0.5 / 200     # STEP_SCALE of mill.ini


class Off(Exception):
    """The machine has been switched off."""


def within(limit, test):
    end = time.monotonic() + limit
    while not (found := test()) and time.monotonic() < end:
        time.sleep(0.02)
    return found


def until(what, test):
    if not within(LIMIT, test):
        print(f"not within {LIMIT} s: {what}", file=sys.stderr)
        sys.exit(1)


def settings_are_taken():
    """Those that the HAL file has made: first of all by the component."""
    made, taken = (hal.get_value(f"pokeys.0.config.generation{which}") for which in ("", "-applied"))
    return 0 < made == taken and hal.get_value("pokeys.0.config.state") == 3


class Operator:
    def __init__(self):
        self.command, self.status = linuxcnc.command(), linuxcnc.stat()
        self.errors = linuxcnc.error_channel()
        self.began = None       # where the axes stood

    def looks(self, **want):
        self.status.poll()
        return all(getattr(self.status, key) == value for key, value in want.items())

    def told(self):
        """What LinuxCNC has told its operator."""
        said = []
        while (error := self.errors.poll()) is not None:
            said.append(error[1])
        return said

    def sees(self, what, test):
        """While the machine is on."""
        def seen():
            if not self.looks(task_state=linuxcnc.STATE_ON):
                raise Off
            return test()
        until(what, seen)

    def comes_on(self):
        self.command.state(linuxcnc.STATE_ESTOP_RESET)
        if not within(SOON, lambda: self.looks(estop=0)):
            return False
        self.command.state(linuxcnc.STATE_ON)
        return within(SOON, lambda: self.looks(task_state=linuxcnc.STATE_ON))

    def switch_on(self):
        until("machine on", self.comes_on)
        self.sees("motion permitted", lambda: hal.get_value("pokeys.0.machine-on-permitted"))

    def home(self):
        axes = range(len(WAYS))
        if not self.began:
            # not before: scale and offset are taken over while the machine is off
            self.began = [hal.get_value(f"pokeys.0.joint.{i:02}.pos-fb") for i in axes]
            print(f"the axes stand at {self.began}", file=sys.stderr)
        if all(self.status.homed[i] for i in axes):
            return
        self.command.mode(linuxcnc.MODE_MANUAL)
        self.command.wait_complete()
        self.command.teleop_enable(0)
        self.command.wait_complete()
        self.command.home(-1)
        self.sees("homed", lambda: all(self.status.homed[i] for i in axes))

    def move(self):
        self.command.mode(linuxcnc.MODE_MDI)
        self.command.wait_complete()
        self.command.mdi("G21 G90 G1 X10 Y5 Z-2 F600")
        self.sees("in position", lambda: all(
            abs(hal.get_value(f"pokeys.0.joint.{i:02}.pos-fb") - self.began[i] - way) < HALF_A_PULSE
            for i, way in enumerate(WAYS)))

    def is_restarted(self, sim, boot_ms):
        """The device counts from 0, and LinuxCNC does not go on with positions of before."""
        def places():
            return [hal.get_value(f"pokeys.0.joint.{i:02}.pos-fb") for i in range(len(WAYS))]

        def nothing_is_homed():
            self.status.poll()
            return not any(self.status.homed[i] for i in range(len(WAYS)))

        def is_there():
            return all(abs(a - b) < HALF_A_PULSE for a, b in zip(places(), stood))

        stood = places()
        subprocess.run([*sim.split(), "reboot", "keep-config", str(boot_ms)], check=True, capture_output=True)
        until("emergency stop", lambda: self.looks(task_state=linuxcnc.STATE_ESTOP))
        until("no joint homed", nothing_is_homed)
        until("connected", lambda: hal.get_value("pokeys.0.connected"))
        until("the loss is known", lambda: hal.get_value("pokeys.0.position-lost"))
        until("the axes where they stood", is_there)
        self.switch_on()
        until("the axes where they stood, switched on", is_there)


def do(operator, work):
    """As often as the machine is switched off meanwhile; whether it came to its end."""
    for _ in range(TRIES):
        try:
            operator.switch_on()
            operator.home()
            work()
            return True
        except Off:
            print(f"switched off meanwhile: {operator.told()}", file=sys.stderr)
    return False


def main():
    component = hal.component("mill-ui")
    component.ready()
    operator = Operator()
    until("connected", lambda: hal.get_value("pokeys.0.connected"))
    until("settings taken", settings_are_taken)
    if not do(operator, operator.move):
        return 1
    print("moved", file=sys.stderr)
    sim = os.environ.get("MILL_UI_SIM")
    for boot_ms in BOOT_MS if sim else ():
        if not do(operator, lambda boot_ms=boot_ms: operator.is_restarted(sim, boot_ms)):
            return 1
    if sim:
        print("restarted", file=sys.stderr)
    return 0



sys.exit(main())
