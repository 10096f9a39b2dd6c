# SPDX-License-Identifier: GPL-2.0-or-later
"""What the component costs a servo thread of LinuxCNC. (How old its data are: age.py.)"""
import statistics
import time

from figures import Figure

TITLE = "In LinuxCNC: cost of read and write in a servo thread of 1 kHz"
SECONDS = 12


def measure(bench):
    seconds = 1 if bench.quick else 5
    reader = bench.start_servo_thread()
    ticks = {"read": [], "write": []}
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for funct, found in ticks.items():
            found.append(bench.get(f"{funct}.time"))
        time.sleep(0.001)
    reader.exit()
    return {"samples": len(ticks["read"]), "read_ticks_p50": statistics.median(ticks["read"]),
            "write_ticks_p50": statistics.median(ticks["write"])}


def figures(found):
    return [Figure(f"pokeys.0.{funct} in LinuxCNC, p50", found[f"{funct}_ticks_p50"], "ticks", found["samples"])
            for funct in ("read", "write")]


def report(found):
    return [f"POSIX threads. `pokeys.0.read.time` p50 {found['read_ticks_p50']:.0f} and"
            f" `pokeys.0.write.time` p50 {found['write_ticks_p50']:.0f} ticks of the processor's counter."]
