# SPDX-License-Identifier: GPL-2.0-or-later
"""How well heaters and servo motors are controlled, beside LinuxCNC's own pid on the same plant."""
import pathlib

from figures import Figure, table

TITLE = "Control: beside LinuxCNC's pid, with the same gains"
SECONDS = 10
PLANTS = {"hotend": "hot end to 210 °C", "bed": "bed to 90 °C"}
WHO = {"ours": "pokeysd", "linuxcnc": "LinuxCNC's pid"}


def measure(bench):
    module = pathlib.Path("/usr/lib/linuxcnc/modules/pid.so")
    return bench.program("control", *([module] if module.exists() else ()))


def figures(found):
    """Nothing here depends on this computer."""
    servo = found["servo"]["ours"]
    return [Figure("servo motor: largest error in a move at 200 mm/s and 2000 mm/s²", servo["worst_mm"] * 1000, "µm",
                   servo["samples"], readme="servo motor: largest error in a move at 200 mm/s and 2000 mm/s²"),
            *(Figure(f"{text}: overshoot", found[plant]["ours"]["overshoot_k"], "K", found[plant]["ours"]["samples"],
                     readme=f"{text}: overshoot") for plant, text in PLANTS.items())]


def report(found):
    servo = ((WHO[who], f"{1000 * run['worst_mm']:.0f}", f"{1000 * run['rms_mm']:.0f}", f"{1000 * run['overshoot_mm']:.0f}",
              f"{run['settled_s']:.2f}", f"{1000 * run['disturbed_mm']:.0f}") for who, run in found["servo"].items())
    heaters = ((text, WHO[who], f"{run['overshoot_k']:.2f}", f"{run['settled_s']:.0f}", f"{run['disturbed_k']:.2f}",
                f"{run['recovered_s']:.0f}") for plant, text in PLANTS.items() for who, run in found[plant].items())
    return ["In simulated time, so each run has the same figures. The gains of both are the same: those of "
            "`examples/linuxcnc/servo-mill` for the motor, and those that `pokeysctl heater tune` finds for the heaters.", "",
            "A motor with a screw of 5 mm moves by 100 mm. Its encoder is read once in each cycle of 1 ms, and a reading is one "
            "cycle old. Errors are those of the screw. A torque of 0.05 N·m then pushes it.", "",
            *table(("controller", "largest error, µm", "rms, µm", "overshoot, µm", "within 20 µm after, s", "pushed by, µm"),
                   servo), "",
            "A heater is switched on when it is cold. After 20 minutes a fan begins to cool it.", "",
            *table(("heater", "controller", "overshoot, K", "within 1 K after, s", "fan: lowest, K", "within 1 K again, s"),
                   heaters)]
