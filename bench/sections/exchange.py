# SPDX-License-Identifier: GPL-2.0-or-later
"""The HAL component's read and write without LinuxCNC, beside memcpy, by what is exported."""
from figures import Figure, table

TITLE = "HAL component: exchange of read and write"
SECONDS = 6
RUNS = (("both", "0"), ("both", "4"), ("both", "26"), ("canonical", "4"), ("legacy", "4"), ("all", "4"))


def measure(bench):
    return [{"names": names, "encoders": n, **bench.program("exchange", n, names)} for names, n in RUNS]


def figures(found):
    rows = {(row["names"], row["encoders"]): row for row in found}
    return [Figure(f"pokeys.0.read and .write, names={names}, {n} encoders moving", rows[names, n]["both"]["p50_ns"] / 1000,
                   "µs", rows[names, n]["both"]["samples"],
                   readme=f"`pokeys.0.read` + `.write`, `names={names}`, {n} encoders moving")
            for names, n in (("both", "0"), ("both", "4"), ("all", "4"))]


def report(found):
    rows = ((row["names"], row["encoders"], row["read"]["p50_ns"], row["read"]["p99_ns"], row["write"]["p50_ns"],
             row["write"]["p99_ns"], row["memcpy"]["p50_ns"], row["both"]["samples"]) for row in found)
    return ["Without LinuxCNC, all axes and an input moving; memcpy is of one state and one command image together.", "",
            *table(("names", "encoders moving", "read p50 ns", "p99", "write p50 ns", "p99", "memcpy p50 ns",
                    "samples"), rows)]
