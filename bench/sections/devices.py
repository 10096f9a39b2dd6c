# SPDX-License-Identifier: GPL-2.0-or-later
"""Several devices in one thread: what they cost, whether all of them fare alike, and whether a dead device
harms the others or costs more than a device that answers."""
import signal
import statistics
import time

from bench import PERIOD_US
from figures import Figure, middle, ratios, table, total, us

TITLE = "Several devices in one thread"
SECONDS = 60
COUNTS = (1, 4, 16)
MANY = 64  # the most of a daemon; with their simulators on the second core, they need a period of 4 ms
MANY_US = 4000
DEAD = "16, one of them dead"
FEW_SLOW, MANY_SLOW = f"16, every {MANY_US} µs", f"{MANY}, every {MANY_US} µs"
ROWS = (*map(str, COUNTS), DEAD, FEW_SLOW, MANY_SLOW)


def names(count):
    return [f"d{number}" for number in range(count)]


def watch(bench, count, period_us=PERIOD_US):
    """Of the first device cycle by cycle, of all of them what the daemon's histograms say."""
    began, spent = time.monotonic(), bench.thread_ns()
    run = bench.watch(bench.cycles, "d0")
    run["busy"] = (bench.thread_ns() - spent) / (time.monotonic() - began) / 1e9
    run["device_us"] = run["busy"] * period_us / count
    fresh = [bench.status(name)["diag"]["latency_us"]["fresh"]["p50"] for name in names(count)]
    run["fresh_us"] = [value for value in fresh if value is not None]
    run["unfair"] = max(run["fresh_us"]) / min(run["fresh_us"])
    return run


def start(bench, count, period_us=PERIOD_US):
    bench.start_daemon_with({"cpu": bench.cpu_client, "period-us": period_us},
                            {name: {"address": bench.network.address(number)}
                             for number, name in enumerate(names(count))})
    bench.wait_for(f"{count} devices running", lambda: all(bench.status(name)["fresh"] for name in names(count)), 30,
                   "pokeysd")


def one_round(bench, found):
    for count in COUNTS:
        start(bench, count)
        found[str(count)].append(watch(bench, count))
        if count < COUNTS[-1]:
            bench.stop("pokeysd")
    victim = bench.started[f"sim{COUNTS[-1] - 1}"]
    victim.send_signal(signal.SIGSTOP)
    try:
        found[DEAD].append(watch(bench, COUNTS[-1] - 1))
    finally:
        victim.send_signal(signal.SIGCONT)
    bench.stop("pokeysd")
    for row, count in ((FEW_SLOW, COUNTS[-1]), (MANY_SLOW, MANY)):
        start(bench, count, MANY_US)
        found[row].append(watch(bench, count, MANY_US))
        bench.stop("pokeysd")


def measure(bench):
    found = {row: [] for row in ROWS}
    for number in range(MANY):
        bench.start_simulator_at(bench.network.address(number), f"sim{number}", "--cpu", bench.cpu_sim,
                                 "--serial", 65432 + number)
        bench.prefer(f"sim{number}")
    for _ in bench.turns("devices", 2 if bench.quick else 3):
        one_round(bench, found)
    return found


def figures(found):
    busy = middle(found["16"], "busy")
    dead = ratios(found[DEAD], found["16"], "all", "p50_ns")
    unfair = middle(found["16"], "unfair")
    samples = total(found["16"], "cycles")
    busy_dead = ratios(found[DEAD], found["16"], "busy")
    each = ratios(found[MANY_SLOW], found[FEW_SLOW], "device_us")
    return [Figure("16 devices at 1 kHz in one thread: busy part of the period", *(100 * v for v in busy[:1]), "%", samples,
                   100 * busy[1], 100 * busy[2], 60, "16 devices at 1 kHz in one thread: busy part of the period"),
            Figure("16 devices: slowest one's answers to the fastest one's, medians", unfair[0], "", samples, unfair[1],
                   unfair[2]),
            Figure("one dead device among 16: another one's answers, ratio to all alive", dead[0], "",
                   total(found[DEAD], "all", "samples"), dead[1], dead[2], 1.15),
            Figure("one dead device among 16: busy part of the period, ratio to all alive", busy_dead[0], "",
                   total(found[DEAD], "cycles"), busy_dead[1], busy_dead[2], 1.1),
            Figure(f"{MANY} devices: processor time per device, ratio to 16 devices", each[0], "",
                   total(found[MANY_SLOW], "cycles"), each[1], each[2], 1.1)]


def report(found):
    rows = []
    for name in ROWS:
        runs = found[name]
        whole = middle(runs, "all", "p50_ns")
        rows.append((name, f"{100 * middle(runs, 'busy')[0]:.1f}", f"{middle(runs, 'device_us')[0]:.1f}",
                     us(whole[0]), f"{us(whole[1])} to {us(whole[2])}", us(middle(runs, "all", "p99_ns")[0]), f"{statistics.median(r['unfair'] for r in runs):.2f}",
                     total(runs, "all", "samples"), total(runs, "missed"), total(runs, "late")))
    return [f"The period is {PERIOD_US} µs unless the row says otherwise. One simulator for each device, all on the"
            " other core, mode sleep. The times are those of the first device, from the start of the cycle until its image is published. Slowest to fastest is over all devices, from"
            " histograms whose buckets are a fifth wide. The dead one dies when the measuring begins.", "",
            *table(("devices", "busy % of the period", "processor µs per device and cycle", "published p50 µs",
                    "95 % interval", "p99 µs", "slowest to fastest", "samples", "cycles missed", "late"), rows)]
