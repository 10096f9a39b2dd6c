# SPDX-License-Identifier: GPL-2.0-or-later
"""What lost packets do to the data: the daemon beside a client that waits."""
import math

from figures import Figure, table, us

TITLE = "Lost packets"
SECONDS = 40
LEVELS = (0, 0.001, 0.01, 0.05, 0.1, 0.2)
PERIOD_MS, ROOM = 1, 1.3


def measure(bench):
    found = []
    for level in LEVELS:
        bench.say(f"loss of {100 * level:g} %")
        bench.start_fast_simulator("--loss", level, "--seed", 7)
        client = bench.client("blocking", cycles=bench.cycles)
        found.append({"level": level, "client": client, "daemon": bench.daemon({"lost-after-ms": 2000})})
        bench.stop("pokeys-sim")
    return found


def late(run):
    """Part of the cycles without their data: late for pokeysd's image, given up by the client."""
    return run.get("incomplete", run["lost"]) / max(run["cycles"], 1)


def limit_ms(level):
    """Older than that is one value in a hundred if each cycle asks anew, and a reply follows unless it is lost."""
    return (math.ceil(math.log(0.01) / math.log(1 - (1 - level) ** 2)) + 1) * PERIOD_MS


def figures(found):
    return [Figure(f"{100 * row['level']:g} % of packets lost each way: age of pokeysd's data, p99",
                   row["daemon"]["age"]["p99_ns"] / 1e6, "ms", row["daemon"]["age"]["samples"],
                   most=ROOM * limit_ms(row["level"]),
                   readme=f"{100 * row['level']:g} % of packets lost each way: age of the data, p99")
            for row in found if row["level"] >= 0.01]


def report(found):
    rows = []
    for row in found:
        daemon, client = row["daemon"], row["client"]
        rows.append((f"{100 * row['level']:g}", us(daemon["age"]["p50_ns"]), us(daemon["age"]["p99_ns"]),
                     us(daemon["age"]["p999_ns"]), f"{100 * late(daemon):.1f}", daemon["resent"],
                     daemon["age"]["samples"], us(client["all"]["p99_ns"]), f"{100 * late(client):.1f}"))
    return ["Each way so many percent of the packets are dropped, by a fixed seed. pokeysd in mode sleep; age is that"
            " of the fast data, as a reader finds it who comes at any time. The blocking client gives an answer up after"
            " 20 ms (the vendor's library waits 1.1 s) and does without it.", "",
            *table(("loss %", "age p50 µs", "age p99 µs", "age p99.9 µs", "cycles late %", "resent", "samples",
                    "client: p99 of what came µs", "client: cycles without answer %"), rows)]
