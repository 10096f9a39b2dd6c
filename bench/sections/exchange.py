# SPDX-License-Identifier: GPL-2.0-or-later
"""The HAL component's read and write without LinuxCNC, beside memcpy."""
from figures import Figure, table

TITLE = "HAL component: exchange of read and write"
SECONDS = 3
ENCODERS = ("0", "4", "26")


def measure(bench):
    return {n: bench.program("exchange", n) for n in ENCODERS}


def figures(found):
    return [Figure(f"pokeys.0.read and .write, all names of both schemes, {n} encoders moving",
                   found[n]["both"]["p50_ns"] / 1000, "µs", found[n]["both"]["samples"],
                   readme=f"`pokeys.0.read` + `.write`, all names of both schemes, {n} encoders moving")
            for n in ENCODERS[:2]]


def report(found):
    rows = ((n, e["read"]["p50_ns"], e["write"]["p50_ns"], e["memcpy"]["p50_ns"]) for n, e in found.items())
    return ["Without LinuxCNC; memcpy is of one state and one command image together.", "",
            *table(("encoders moving", "read p50 ns", "write p50 ns", "memcpy p50 ns"), rows)]
