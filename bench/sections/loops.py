# SPDX-License-Identifier: GPL-2.0-or-later
"""What heaters and servo motors cost the realtime thread in each cycle."""
from figures import Figure, interval, middle, pick, table, total

TITLE = "Closed loops: heaters and servo motors"
SECONDS = 40
MACHINES = ("none", "heaters", "motors", "both")
MOST_US = 15.0


def measure(bench):
    return [bench.program("loops", 20000 if bench.quick else 100000) for _ in bench.turns("loops", min(bench.rounds, 5))]


def more(runs, machine, part):
    """Microseconds that the loops add to a cycle: of each run with and without, which take turns in it."""
    return tuple(ns / 1000 for ns in interval([pick(run, machine, part) - pick(run, "none", part) for run in runs]))


def figures(found):
    heaters, motors = found[0]["heater_count"], found[0]["motor_count"]
    rows = []
    for machine, what in (("heaters", f"{heaters} heaters"), ("motors", f"{motors} servo motors"),
                          ("both", f"{heaters} heaters and {motors} servo motors")):
        value, low, high = more(found, machine, "p50_ns")
        rows.append(Figure(f"{what}: more work in each cycle, median", value, "µs", total(found, machine, "samples"), low,
                           high, MOST_US if machine == "both" else None,
                           f"{what}: more work of the realtime thread in each cycle, median" if machine == "both" else ""))
    return rows


def report(found):
    rows = ((machine, *(f"{middle(found, machine, part)[0] / 1000:.2f}" for part in ("p50_ns", "p99_ns")),
             *(f"{more(found, machine, part)[0]:.2f}" for part in ("p50_ns", "p99_ns")), total(found, machine, "samples"))
            for machine in MACHINES)
    return [f"The daemon's work in a cycle of 1 ms (not the network, not the images) with {found[0]['heater_count']} heaters that "
            f"heat, {found[0]['motor_count']} motors that move, or both, in simulated time and in turns.", "",
            *table(("loops", "p50 µs", "p99 µs", "more than none, p50", "p99", "cycles"), rows)]
