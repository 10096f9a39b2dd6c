# SPDX-License-Identifier: GPL-2.0-or-later
"""All that a device has to say, fast and slow, in one cycle.

Once with a simulator that answers as fast as it can, and once behind a wire and a
device that take WIRE_US each way, as a network and a device's own stack do. The first
shows what asking costs, and is bounded by what a packet costs the simulator; the second
what waiting for each answer costs."""
from figures import Figure, middle, ratios, table, total, us
from rig import Fault

TITLE = "Everything of one device, fast and slow, in one cycle"
SECONDS = 90
WIRE_US = 50
CLIENTS = {"blocking": "sendto, select, recvfrom, one question after the other",
           "batching": "sendmmsg, recvmmsg in a tight loop", "ring": "bare io_uring, sleeping"}
DAEMONS = {"sleep": "pokeysd, mode sleep, slow = together", "spin": "pokeysd, mode spin, slow = together"}
ORDER = ("sleep", "blocking", "spin", "batching", "ring")
NAMES = {**CLIENTS, **DAEMONS}
PLACES = {"direct": ("simulator without delay", ()), "wire": (f"{WIRE_US} µs each way", ("--delay-us", WIRE_US))}
TOGETHER = {"slow": "together", "slow-hz": 100}


def one(bench, name):
    """Every contender's time for everything under one name."""
    if name in CLIENTS:
        return bench.client(name, "all", bench.cycles // 3)
    run = bench.daemon(TOGETHER, cycles=bench.cycles, mode=name)
    return {"questions": 2 + run["burst_answers"], "all": run["burst"], "lost": run["lost"]}


def same_questions(runs):
    """A daemon that asks other things than the clients must not be compared with them."""
    asked, meant = max(run["questions"] for run in runs["spin"]), runs["blocking"][0]["questions"]
    if asked > 2 and abs(asked - meant) > 1:
        raise Fault(f"pokeysd had {asked:.1f} answers in a cycle, the clients ask {meant}: not the same questions")


def measure(bench):
    found = {place: {name: [] for name in NAMES} for place in PLACES}
    for place, (text, options) in PLACES.items():
        bench.start_fast_simulator(*options)
        for name in bench.contests(f"everything, {text}", ORDER, bench.rounds if place == "direct" else 2):
            found[place][name].append(one(bench, name))
        bench.stop("pokeys-sim")
        same_questions(found[place])
    return found


def figures(found):
    rows = []
    for place, runs in found.items():
        for name, text in DAEMONS.items():
            value, low, high = ratios(runs[name], runs["blocking"], "all", "p50_ns")
            rows.append(Figure(f"{text}, {PLACES[place][0]}: ratio to a blocking client that asks the same", value, "",
                               total(runs[name], "all", "samples"), low, high, 0.3,
                               f"all data of a device in one cycle, mode `{name}`, {PLACES[place][0]}:"
                               " ratio to a blocking client"))
    return rows


def report(found):
    rows = []
    for place, runs in found.items():
        for name, text in NAMES.items():
            value, ratio = middle(runs[name], "all", "p50_ns"), ratios(runs[name], runs["blocking"], "all", "p50_ns")
            rows.append((PLACES[place][0], text, f"{runs[name][0]['questions']:.1f}", us(value[0]),
                         f"{us(value[1])} to {us(value[2])}", f"{ratio[0]:.2f}" if ratio[0] else "",
                         us(middle(runs[name], "all", "p99_ns")[0]), total(runs[name], "all", "samples"),
                         total(runs[name], "lost")))
    return ["0xCC, pulse engine status, 32-bit encoders, analog inputs, PoExtBus, tick counter, PWM, load, clock,"
            " external outputs, identity, dedicated inputs; from the start of the cycle to the last answer (pokeysd's:"
            " the kernel's receive stamp). pokeysd does so in every tenth cycle, with the two fast ones only in between. What a"
            " packet costs the simulator bounds the first part: no client can be quicker than the one that batches"
            " and spins.", "",
            *table(("simulator", "contender", "questions", "p50 µs", "95 % interval", "ratio to blocking", "p99 µs",
                    "samples", "lost"), rows)]
