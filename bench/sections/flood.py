# SPDX-License-Identifier: GPL-2.0-or-later
"""A flood from a foreign address onto the daemon's core, without and with the guard.

Device and stranger are at the far end of the veth pair, on the other core. A veth has
no interrupt of its own: what it receives is worked on by the core that sends. So
receive packet steering (rps_cpus) puts it onto the daemon's core, replies as well, as
an interrupt there would. A native XDP program still runs before that, on the sending
core; a generic one after it, on the daemon's. A card in the guarded machine is
between the two: native, on the daemon's core. Both are measured; the generic one is
had by an MTU that veth has no native XDP for.

The reference has the same packets on the far core, sent to nobody there: what the
stranger costs the device's core must not be taken for the flood's effect.
"""
import contextlib
import json
import os
import pathlib
import subprocess

from bench import PERIOD_US
from figures import Figure, middle, ratios, table, total, us
from guarded import guard, mounts, need_guard, run
from rig import Fault

TITLE = "A flood of foreign packets, with and without pokeys-guard"
SECONDS = 40
RATE, ROUNDS, MOST_S = 200000, 3, 20
LOST = "requests lost (no answer to any try)"
STRANGER, NOBODY, CLOSED = "10.77.0.66", "10.77.1.1", 40000
# name: what it is, flooded, guarded, generic
WAYS = {"idle": ("no flood (the same packets sent elsewhere)", False, False, False),
        "flood": ("flood, no guard", True, False, False),
        "native": ("flood, guard in the driver (native)", True, True, False),
        "generic": ("flood, generic guard on the daemon's core", True, True, True)}


@contextlib.contextmanager
def packets(bench, flooded):
    """So many a second from the stranger: here, or to nobody."""
    to = bench.here if flooded else NOBODY
    command = [*bench.there, bench.build / "bench/bench-flood", STRANGER, to, CLOSED, RATE, MOST_S, bench.cpu_sim]
    with subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          text=True) as child:
        result = {}
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, child.pid, -20)
        try:
            if child.stdout.readline().strip() != "sending":
                raise Fault(child.stderr.read().strip() or "bench-flood did not begin")
            yield result
        finally:
            child.terminate()
            result.update(json.loads(child.stdout.read() or '{"sent": 0, "ns": 1}'))


@contextlib.contextmanager
def filtered(bench, guarded, generic):
    """Behind a guard of that kind, or behind none; its counters, when it ends."""
    if not guarded:
        yield {}
        return
    run(*bench.there, "ip", "link", "set", bench.network.far_interface, "mtu", "9000" if generic else "1500")
    try:
        with guard(bench) as seen:
            yield seen
    finally:
        run(*bench.there, "ip", "link", "set", bench.network.far_interface, "mtu", "1500")


def start_device(bench):
    """Before everything else on its core, the stranger too, and asleep between requests: a request
    that the device has no time to answer is none that the flood has cost."""
    bench.start_simulator("--cpu", bench.cpu_sim)
    with contextlib.suppress(OSError):
        os.sched_setscheduler(bench.started["pokeys-sim"].pid, os.SCHED_FIFO, os.sched_param(20))


def one(bench, flooded, guarded, generic):
    """The daemon, watched."""
    bench.start_daemon({"cpu": bench.cpu_client, "period-us": PERIOD_US, "mode": "sleep",
                        "interface": bench.interface}, {"lost-after-ms": 2000})
    with filtered(bench, guarded, generic) as seen, packets(bench, flooded) as sent:
        found = bench.watch()
    bench.stop("pokeysd")
    found["rate"] = sent["sent"] / sent["ns"] * 1e9
    found["mode"] = seen.get("mode", "")
    found["dropped"] = int(seen.get("drop_foreign", 0))
    return found


def measure(bench):
    need_guard(bench)
    found = {name: [] for name in WAYS}
    run(*bench.there, "ip", "address", "add", f"{STRANGER}/24", "dev", bench.network.far_interface)
    run(*bench.there, "ip", "link", "add", "nobody", "type", "veth", "peer", "name", "nobody1")
    run(*bench.there, "ip", "address", "add", "10.77.1.2/24", "dev", "nobody")
    run(*bench.there, "ip", "link", "set", "nobody", "up")
    run(*bench.there, "ip", "link", "set", "nobody1", "up", "arp", "off")
    run(*bench.there, "ip", "neighbour", "add", NOBODY, "lladdr", "02:00:00:00:00:99", "dev", "nobody")
    try:
        with mounts():
            steering = pathlib.Path(f"/sys/class/net/{bench.interface}/queues/rx-0/rps_cpus")
            steering.write_text(f"{1 << bench.cpu_client:x}\n", encoding="ascii")
            for _ in bench.turns("flood", min(ROUNDS, bench.rounds)):
                start_device(bench)
                for name, (_, *how) in WAYS.items():
                    found[name].append(one(bench, *how))
                bench.stop("pokeys-sim")
            bench.end_all()
            steering.write_text("0\n", encoding="ascii")
    finally:
        run(*bench.there, "ip", "link", "del", "nobody")
        run(*bench.there, "ip", "address", "del", f"{STRANGER}/24", "dev", bench.network.far_interface)
    return found


def figures(found):
    rows = [Figure(f"{WAYS['idle'][0]}: {LOST}", total(found["idle"], "lost"), "",
                   total(found["idle"], "round_trip", "samples"))]
    for name, most in (("flood", None), ("native", 1.3), ("generic", 1.3)):
        value, low, high = ratios(found[name], found["idle"], "round_trip", "p50_ns")
        samples = total(found[name], "round_trip", "samples")
        rows.append(Figure(f"{WAYS[name][0]}, {RATE // 1000} k packets/s: round trip p50 to that without flood", value, "",
                           samples, low, high, most,
                           f"{RATE:,} foreign packets/s, {WAYS[name][0]}: round trip, ratio to no flood"))
        rows.append(Figure(f"{WAYS[name][0]}: {LOST}", total(found[name], "lost"), "", samples,
                           most=0 if most else None))
    return rows


def report(found):
    rows = []
    for name, (text, *_) in WAYS.items():
        runs = found[name]
        rows.append((text, us(middle(runs, "round_trip", "p50_ns")[0]), us(middle(runs, "round_trip", "p99_ns")[0]),
                     us(middle(runs, "cpu_ns")[0]), f"{middle(runs, 'rate')[0] / 1000:.0f}",
                     total(runs, "dropped"), total(runs, "lost"), total(runs, "resent"), total(runs, "missing"),
                     total(runs, "missed"),
                     total(runs, "round_trip", "samples")))
    modes = {run["mode"] for name in ("native", "generic") for run in found[name]}
    return ["Sent from a PoKeys port by an address that is no device's, to a closed port of the daemon's machine; what"
            " is received is worked on by the daemon's core (RPS), the stranger and the device are on the other one."
            f" pokeysd in mode sleep. The guard was {' and '.join(sorted(modes))} as planned for each row: a native one"
            " drops before steering, on the sending core, a generic one on the daemon's. A request is sent again"
            " when its deadline has passed, which its late answer may then follow.", "",
            *table(("what", "round trip p50 µs", "p99 µs", "processor µs a cycle", "k packets/s sent", "dropped by the guard",
                    "lost", "resent", "packets without reply", "cycles missed", "samples"), rows)]
