# SPDX-License-Identifier: GPL-2.0-or-later
"""Motion: how old a commanded position is when it reaches the device, and how full the
device's buffer is in buffered mode."""
from figures import Figure, middle, number, table, total, us

TITLE = "Motion: age of a position, level of the motion buffer"
SECONDS = 60
AXES = {"axes": 3, "axis.0.max-speed": 25000, "axis.0.max-acceleration": 1000000,
        "heartbeat-timeout-ms": 3000, "stale-after-ms": 500, "lost-after-ms": 1000}
MODES = ("position", "buffered")
TARGET = "jitter of 2 ms, 0.1 % lost"


def age(bench, mode, commands):
    bench.start_daemon({"cpu": bench.cpu_client, "period-us": 1000}, {**AXES, "axis.0.mode": mode})
    try:
        return bench.program("age", bench.run / "pokeysd", bench.device, commands)
    finally:
        bench.stop("pokeysd")


def measure(bench):
    found = {"buffer": bench.program("buffer", 10 if bench.quick else 60)}
    bench.start_fast_simulator("--count-free")
    found["age"] = {mode: [] for mode in MODES}
    for _ in bench.turns("age of a position", min(bench.rounds, 3)):
        for mode in MODES:
            found["age"][mode].append(age(bench, mode, 2 * bench.cycles))
    return found


def share(levels, part):
    """The level below which this part of all milliseconds lies."""
    left = part * sum(levels)
    for level, count in enumerate(levels):
        left -= count
        if left < 0:
            return level
    return len(levels) - 1


def figures(found):
    runs = found["age"]["position"]
    rows = {row["line"]: row for row in found["buffer"]}
    bound = (runs[0]["period_ns"] + middle(runs, "half_round_trip", "p50_ns")[0]) / 1000
    shown = []
    for percent, key in (("median", "p50_ns"), ("p99", "p99_ns")):
        value, low, high = middle(runs, "arrived", key)
        shown.append(Figure(f"position mode: from the commander's write to the device, {percent} (target: a cycle and half a "
                            "round trip)", value / 1000, "µs", total(runs, "arrived", "samples"), low / 1000,
                            high / 1000, bound,
                            readme=f"position mode: commander's write to the device, {percent}"))
    row = rows[TARGET]
    shown.append(Figure(f"buffered mode, {row['axes']} axes at {row['khz']} kHz, {row['seconds']} s of simulated time, "
                        f"{TARGET}: underruns", row["underruns"], "", 1000 * row["seconds"], most=0,
                        readme=f"buffered mode, {row['axes']} axes at {row['khz']} kHz, {TARGET}, "
                               f"{row['seconds']} s of simulated time: underruns"))
    shown.append(Figure("buffered mode, all lines of the table: axes that end off the commanded pulse",
                        sum(row["axes_off"] for row in found["buffer"]), "",
                        sum(row["axes"] for row in found["buffer"]), most=0))
    return shown


def report(found):
    rows = []
    for mode in MODES:
        runs = found["age"][mode]
        rows.append((mode, *(us(middle(runs, what, part)[0]) for what in ("left", "arrived")
                             for part in ("p50_ns", "p99_ns")),
                     us(middle(runs, "half_round_trip", "p50_ns")[0]), total(runs, "left", "samples")))
    lines = ["A commander writes a new position at any moment of the daemon's cycle of 1 ms. It has left when the daemon"
             " has sent it, in buffered mode when the last slot of the way has; it is at the device half a round"
             " trip later.", "",
             *table(("mode", "left p50 µs", "p99", "at the device p50 µs", "p99", "half a round trip µs", "commands"),
                    rows), "",
             "Buffered mode in simulated time: all axes at full speed; the level is the number of slots in the device's"
             " buffer, looked at once a millisecond.", "",
             *table(("line", "s", "underruns", "resyncs", "level least", "0.1 % below", "median", "99.9 % below", "most",
                     "fills in parts", "axes off"),
                    ((row["line"], row["seconds"], row["underruns"], row["resyncs"],
                      next(i for i, count in enumerate(row["level"]) if count), share(row["level"], 0.001),
                      share(row["level"], 0.5), share(row["level"], 0.999),
                      max(i for i, count in enumerate(row["level"]) if count), row["fills_in_parts"],
                      row["axes_off"]) for row in found["buffer"])), ""]
    target = next(row for row in found["buffer"] if row["line"] == TARGET)
    lines += [f"Histogram of the level, {TARGET}:", "",
              *table(("slots", "milliseconds", "part"),
                     ((level, count, f"{number(100 * count / sum(target['level']))} %")
                      for level, count in enumerate(target["level"]) if count))]
    return lines
