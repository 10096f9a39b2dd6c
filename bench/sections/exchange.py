# SPDX-License-Identifier: GPL-2.0-or-later
"""The HAL component's read and write without LinuxCNC, beside memcpy, by what is exported."""
from figures import Figure, middle, table, total

TITLE = "HAL component: exchange of read and write"
SECONDS = 10
RUNS = (("both", "0"), ("both", "4"), ("both", "26"), ("canonical", "4"), ("legacy", "4"), ("all", "4"))
MOST_US = {("both", "0"): 2.0, ("both", "4"): 2.0}


def measure(bench):
    found = {run: [] for run in RUNS}
    for _ in bench.turns("exchange"):
        for names, encoders in RUNS:
            found[names, encoders].append(bench.program("exchange", encoders, names))
    return [{"names": names, "encoders": encoders, "runs": runs} for (names, encoders), runs in found.items()]


def figures(found):
    runs, rows = {(row["names"], row["encoders"]): row["runs"] for row in found}, []
    for names, encoders in (("both", "0"), ("both", "4"), ("all", "4")):
        value, low, high = (ns / 1000 for ns in middle(runs[names, encoders], "both", "p50_ns"))
        rows.append(Figure(f"pokeys.0.read and .write, names={names}, {encoders} encoders moving", value, "µs",
                           total(runs[names, encoders], "both", "samples"), low, high, MOST_US.get((names, encoders)),
                           f"`pokeys.0.read` + `.write`, `names={names}`, {encoders} encoders moving"))
    return rows


def report(found):
    rows = ((row["names"], row["encoders"],
             *(f"{middle(row['runs'], part, p)[0]:.0f}" for part, p in
               (("read", "p50_ns"), ("read", "p99_ns"), ("write", "p50_ns"), ("write", "p99_ns"), ("memcpy", "p50_ns"))),
             total(row["runs"], "both", "samples")) for row in found)
    return ["Without LinuxCNC, all axes and an input moving; memcpy is of one state and one command image together.", "",
            *table(("names", "encoders moving", "read p50 ns", "p99", "write p50 ns", "p99", "memcpy p50 ns",
                    "samples"), rows)]
