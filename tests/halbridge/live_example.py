#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The example HAL file: alone, and with a device that follows it.

usage: live_example.py MODULE.so HOST-PROGRAM
"""
import time
import hal_live

EXAMPLE = hal_live.ROOT / "examples/linuxcnc/first-light.hal"


def copy(rig):
    """The example as it is, but with the test's runtime folder."""
    text = EXAMPLE.read_text(encoding="utf-8")
    assert "\nloadrt pokeys_shm\n" in text
    path = rig.folder / EXAMPLE.name
    path.write_text(text.replace("loadrt pokeys_shm\n", f"loadrt pokeys_shm runtime={rig.runtime}\n"),
                    encoding="utf-8")
    return path


def halrun_takes_it_as_it_is(rig):
    rig.hal.ok(f"halrun -f {EXAMPLE}")


def the_axis_moves_from_where_it_stands(rig):
    host = rig.host()
    host.say("axis 0 position 1000")
    rig.hal.ok(f"halcmd -f {copy(rig)}")
    rig.hal.becomes("joint.00.pos-fb", 5)
    host.sees("axis0", "1000,0,1,0")
    rig.hal.set("machine-is-on", 1)
    host.sees("flags", "1")
    host.say("set flags 0x0a")      # commander, machine on
    last = (int(host.command()["heartbeat"]), 1000)
    end = time.monotonic() + 60
    while abs(last[1] - 1000) < 50:
        assert time.monotonic() < end, "it does not move"
        command = host.command()
        now = (int(command["heartbeat"]), int(command["axis0"].split(",")[0]))
        # 20 mm/s at 200 pulses/mm are 4 pulses a period
        assert abs(now[1] - last[1]) <= 4 * (now[0] - last[0]) + 1, f"it jumps: {last} -> {now}"
        last = now
    hal_live.wait("it is enabled", lambda: host.command()["axis0"].endswith(",1,1"))


def the_input_switches_the_output(rig):
    host = rig.host()
    host.say("set own 12 1")
    rig.hal.ok(f"halcmd -f {copy(rig)}")
    host.say("set in 0 1")
    host.sees("out", "0010000000000000")


hal_live.main([
    halrun_takes_it_as_it_is,
    the_axis_moves_from_where_it_stands,
    the_input_switches_the_output,
])
