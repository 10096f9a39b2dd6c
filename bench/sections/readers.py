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


def of(run, count):
    """Medians with so many readers: publishing alone, and with the lines taken back before."""
    alone = run[count]["p50_ns"]
    return {"alone": alone, "both": alone + run[f"taking {count}"]["p50_ns"]}


def figures(runs):
    rows = []
    none = [of(run, "0") for run in runs]
    for count in COUNTS[1:]:
        some = [of(run, count) for run in runs]
        value, low, high = ratios(some, none, "alone")
        rows.append(Figure(f"publishing with {count} readers: ratio to none", value, "", total(runs, count, "samples"),
                           low, high, 1.15, "publishing with 20 readers: ratio to none" if count == "20" else ""))
        value, low, high = ratios(some, none, "both")
        rows.append(Figure(f"the same and taking the lines back, {count} readers: ratio to none", value, "",
                           total(runs, count, "samples"), low, high))
    value, low, high = middle(runs, "mirroring 20", "p50_ns")
    rows.append(Figure("writing the mirror behind it, caches cold after a sleep, 20 readers", value, "ns",
                       total(runs, "mirroring 20", "samples"), low, high))
    return rows


def report(runs):
    rows = []
    for number, count in enumerate(COUNTS):
        value = middle(runs, count, "p50_ns")
        rows.append((count, f"{value[0]:.0f}", f"{value[1]} to {value[2]}",
                     f"{middle(runs, f'mirroring {count}', 'p50_ns')[0]:.0f}",
                     f"{middle(runs, f'taking {count}', 'p50_ns')[0]:.0f}",
                     f"{middle(runs, count, 'p99_ns')[0]:.0f}", total(runs, count, "samples"),
                     sum(run["reads"][number] for run in runs)))
    return ["One image a millisecond by a realtime thread that slept in between, and 50 µs more after it took the"
            " image's place back, as it does while a device answers; each reader is a process on the other cores that"
            " reads a thousand times a second. The target says \"the same within noise\"; 1.15 is what is taken for"
            " that.", "",
            *table(("readers", "p50 ns", "95 % interval", "mirror p50 ns", "taking back p50 ns", "p99 ns", "samples", "reads meanwhile"), rows)]
