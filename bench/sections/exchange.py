# SPDX-License-Identifier: GPL-2.0-or-later
"""The HAL component's read and write without LinuxCNC, beside memcpy, by what is exported, and with caches
that other programs have filled meanwhile."""
from figures import Figure, middle, table, total

TITLE = "HAL component: exchange of read and write"
SECONDS = 15
WARM, COLD = "warm", "cold"
RUNS = (("both", "0", WARM), ("both", "4", WARM), ("both", "26", WARM), ("canonical", "4", WARM),
        ("legacy", "4", WARM), ("all", "4", WARM), ("canonical", "4", COLD), ("both", "4", COLD))
# what is shown as a figure, and its target in µs
FIGURES = ((("both", "0", WARM), "p50", 2.0), (("both", "4", WARM), "p50", 2.0), (("all", "4", WARM), "p50", None),
           (("both", "4", COLD), "p50", 3.0), (("both", "4", COLD), "p99", 6.0))


def measure(bench):
    found = {run: [] for run in RUNS}
    for _ in bench.turns("exchange"):
        for names, encoders, caches in RUNS:
            found[names, encoders, caches].append(
                bench.program("exchange", encoders, names, *([] if caches == WARM else [caches])))
    return [{"names": names, "encoders": encoders, "caches": caches, "runs": runs}
            for (names, encoders, caches), runs in found.items()]


def figures(found):
    runs, rows = {(row["names"], row["encoders"], row["caches"]): row["runs"] for row in found}, []
    for run, part, most in FIGURES:
        names, encoders, caches = run
        value, low, high = (ns / 1000 for ns in middle(runs[run], "both", f"{part}_ns"))
        more = (", cold caches" if caches == COLD else "") + (f", {part}" if part != "p50" else "")
        rows.append(Figure(f"pokeys.0.read and .write, names={names}, {encoders} encoders moving{more}", value, "µs",
                           total(runs[run], "both", "samples"), low, high, most,
                           f"`pokeys.0.read` + `.write`, `names={names}`, {encoders} encoders moving{more}"))
    return rows


def report(found):
    rows = ((row["names"], row["encoders"], row["caches"],
             *(f"{middle(row['runs'], part, p)[0]:.0f}" for part, p in
               (("read", "p50_ns"), ("read", "p99_ns"), ("write", "p50_ns"), ("write", "p99_ns"), ("memcpy", "p50_ns"))),
             total(row["runs"], "both", "samples")) for row in found)
    return [("Without LinuxCNC, all axes and an input moving; memcpy is of one state and one command image together."
            " Cold: before each read, 8 MiB of other data displace the second-level cache and 128 KiB of other code the"
            " first-level one. Before each write, only the first-level caches are displaced. This imitates LinuxCNC and"
            " other programs."), "",
            *table(("names", "encoders moving", "caches", "read p50 ns", "p99", "write p50 ns", "p99", "memcpy p50 ns",
                    "samples"), rows)]
