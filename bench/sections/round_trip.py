# SPDX-License-Identifier: GPL-2.0-or-later
"""The daemon beside clients that ask the same two questions on the same simulator."""
from bench import PERIOD_US
from figures import Figure, middle, number, ratios, table, total, us

TITLE = f"Round trip: 0xCC and pulse engine status, once every {PERIOD_US} µs"
SECONDS = 60
CLIENTS = {"blocking": "sendto, select, recvfrom, one after the other (as the vendor's library)",
           "sleeping": "both at once, poll, recv", "spinning": "both at once, recv in a tight loop"}
DAEMONS = {"sleep": "pokeysd, mode sleep", "spin": "pokeysd, mode spin"}
NAMES = {**CLIENTS, **DAEMONS}


def measure(bench):
    found = {name: [] for name in NAMES}
    bench.start_fast_simulator()
    for _ in bench.turns("round trips"):
        for name in CLIENTS:
            found[name].append(bench.client(name))
        for name in DAEMONS:
            found[name].append(bench.daemon(bench.cycles, mode=name))
    return found


def against(found, name, base, most, readme=""):
    value, low, high = ratios(found[name], found[base], "both", "p50_ns")
    return Figure(f"{NAMES[name]}, both answers in: ratio to {NAMES[base]}", value, "",
                  total(found[name], "both", "samples"), low, high, most, readme)


def figures(found):
    return [against(found, "spin", "spinning", 1.10, "mode `spin`, both fast answers in, to a bare spinning socket"),
            against(found, "sleep", "blocking", 1.10, "mode `sleep`, to a blocking client that asks the same")]


def report(found):
    rows = []
    for name, text in NAMES.items():
        runs = found[name]
        both, ratio = middle(runs, "both", "p50_ns"), ratios(runs, found["spinning"], "both", "p50_ns")
        rows.append((text, us(middle(runs, "round_trip", "p50_ns")[0]), us(both[0]),
                     f"{us(both[1])} to {us(both[2])}", number(ratio[0]), us(middle(runs, "both", "p99_ns")[0]),
                     us(middle(runs, "cpu_ns")[0]), total(runs, "both", "samples"), total(runs, "lost")))
    return ["Same simulator (service time 0, spinning on the other core). A daemon's figures count from its tick.",
            "", *table(("contender", "round trip p50 µs", "both answers p50 µs", "over the rounds",
                        "ratio to spinning", "both p99 µs", "processor µs a cycle", "samples", "lost"), rows)]
