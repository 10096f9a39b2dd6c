# SPDX-License-Identifier: GPL-2.0-or-later
"""All that a device has to say, fast and slow, in one cycle."""
from figures import Figure, middle, ratios, table, total, us
from rig import Fault

TITLE = "Everything of one device, fast and slow, in one cycle"
SECONDS = 60
CLIENTS = {"blocking": "sendto, select, recvfrom, one question after the other",
           "batching": "sendmmsg, recvmmsg in a tight loop", "ring": "bare io_uring, sleeping"}
DAEMONS = {"sleep": "pokeysd, mode sleep, slow = together", "spin": "pokeysd, mode spin, slow = together"}
TOGETHER = {"slow": "together", "slow-hz": 100, "window": 20}


def questions_of(run):
    return 2 + run["burst_answers"]


def measure(bench):
    found = {name: [] for name in (*CLIENTS, *DAEMONS)}
    bench.start_fast_simulator()
    for _ in bench.turns("everything"):
        for name in CLIENTS:
            found[name].append(bench.client(name, "all", bench.cycles // 2))
        for name in DAEMONS:
            found[name].append(bench.daemon(TOGETHER, mode=name))
    asked, meant = max(map(questions_of, found["spin"])), found["blocking"][0]["questions"]
    if abs(asked - meant) > 1:
        raise Fault(f"pokeysd had {asked:.1f} answers in a cycle, the clients ask {meant}: not the same questions")
    return found


def spread(found, name):
    """(path of the time for everything)"""
    return "burst" if name in DAEMONS else "all"


def against(found, name):
    runs = [{"p50_ns": run["burst"]["p50_ns"]} for run in found[name]]
    bases = [{"p50_ns": run["all"]["p50_ns"]} for run in found["blocking"]]
    return ratios(runs, bases, "p50_ns")


def figures(found):
    rows = []
    for name, text in DAEMONS.items():
        value, low, high = against(found, name)
        rows.append(Figure(f"{text}: everything of a device, ratio to a blocking client that asks the same", value, "",
                           total(found[name], "burst", "samples"), low, high, 0.3,
                           f"everything of a device in one cycle, mode `{name}`, to a blocking client"))
    return rows


def report(found):
    rows = []
    for name, text in {**CLIENTS, **DAEMONS}.items():
        path = spread(found, name)
        value = middle(found[name], path, "p50_ns")
        asked = questions_of(found[name][0]) if name in DAEMONS else found[name][0]["questions"]
        rows.append((text, f"{asked:.1f}", us(value[0]), f"{us(value[1])} to {us(value[2])}",
                     us(middle(found[name], path, "p99_ns")[0]), total(found[name], path, "samples"),
                     total(found[name], "lost")))
    return ["0xCC, pulse engine status, 32-bit encoders, analog inputs, PoExtBus, tick counter, PWM, load, clock,"
            " external outputs, identity, dedicated inputs; from the tick to the last answer (pokeysd's: the kernel's"
            " receive stamp). The daemon does so in every tenth cycle; the others have the two fast ones only.", "",
            *table(("contender", "questions", "p50 µs", "over the rounds", "p99 µs", "samples", "lost"), rows)]
