# SPDX-License-Identifier: GPL-2.0-or-later
"""What publishing costs while others read."""
from figures import Figure, middle, ratios, table, total

TITLE = "Publishing one image while others read it"
SECONDS = 15
COUNTS = ("0", "1", "5", "20")


def measure(bench):
    slices = 2 if bench.quick else 5
    return [bench.program("readers", bench.run / "readers", slices, bench.cpu_client)
            for _ in bench.turns("readers")]


def figures(runs):
    rows = []
    for count in COUNTS[1:]:
        value, low, high = ratios([{"p50_ns": run[count]["p50_ns"]} for run in runs],
                                  [{"p50_ns": run["0"]["p50_ns"]} for run in runs], "p50_ns")
        rows.append(Figure(f"publishing with {count} readers: ratio to none", value, "", total(runs, count, "samples"),
                           low, high, 1.15, "publishing with 20 readers, to none" if count == "20" else ""))
    return rows


def report(runs):
    rows = []
    for number, count in enumerate(COUNTS):
        value = middle(runs, count, "p50_ns")
        rows.append((count, f"{value[0]:.0f}", f"{value[1]} to {value[2]}",
                     f"{middle(runs, count, 'p99_ns')[0]:.0f}", total(runs, count, "samples"),
                     sum(run["reads"][number] for run in runs)))
    return ["One image a millisecond by a realtime thread that slept in between, and 50 µs more after it took the"
            " image's place back, as it does while a device answers; each reader is a process on the other cores that"
            " reads a thousand times a second. The target says \"the same within noise\"; 1.15 is what is taken for"
            " that.", "",
            *table(("readers", "p50 ns", "over the rounds", "p99 ns", "samples", "reads meanwhile"), rows)]
