#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The user interface of a LinuxCNC session without anybody: homes, moves, ends.

LinuxCNC starts it as [DISPLAY]DISPLAY. Its last line is "moved" if all went well.
"""
import sys
import time
import hal
import linuxcnc


def until(what, test, limit=20):
    end = time.monotonic() + limit
    while not test():
        if time.monotonic() > end:
            print(f"not within {limit} s: {what}", file=sys.stderr)
            sys.exit(1)
        time.sleep(0.02)


def main():
    component = hal.component("mill-ui")
    component.ready()
    command, status = linuxcnc.command(), linuxcnc.stat()

    def is_(**want):
        status.poll()
        return all(getattr(status, key) == value for key, value in want.items())

    until("connected", lambda: hal.get_value("pokeys.0.connected"))
    # settings that the HAL file has just made must have arrived
    until("settings applied", lambda: hal.get_value("pokeys.0.config.state") == 3)
    command.state(linuxcnc.STATE_ESTOP_RESET)
    until("emergency reset", lambda: is_(estop=0))
    command.state(linuxcnc.STATE_ON)
    until("machine on", lambda: is_(task_state=linuxcnc.STATE_ON))
    until("motion permitted", lambda: hal.get_value("pokeys.0.machine-on-permitted"))
    # not before: scale and offset are taken over while the machine is off
    began = [hal.get_value(f"pokeys.0.joint.{i:02}.pos-fb") for i in range(3)]
    print(f"the axes stand at {began}", file=sys.stderr)
    command.mode(linuxcnc.MODE_MANUAL)
    command.wait_complete()
    command.teleop_enable(0)
    command.wait_complete()
    command.home(-1)
    until("homed", lambda: is_(homed=(1, 1, 1) + (0,) * (len(status.homed) - 3)))
    command.mode(linuxcnc.MODE_MDI)
    command.wait_complete()
    command.mdi("G21 G90 G1 X10 Y5 Z-2 F600")
    command.wait_complete(20)
    until("in position", lambda: all(
        abs(hal.get_value(f"pokeys.0.joint.{i:02}.pos-fb") - began[i] - way) < 0.01
        for i, way in enumerate((10, 5, -2))))
    print("moved", file=sys.stderr)


main()
