# SPDX-License-Identifier: GPL-2.0-or-later
"""How old the fast data are when LinuxCNC's servo thread reads them: free-running beside
locked, the same simulator and the same HAL thread, a daemon of its own each turn.

Ages are those of every read, as the component has them (pokeys.0.age-us, by LinuxCNC's
own sampler: the daemon's histogram has buckets a quarter wide), from after the lock was
reached to the end of the turn. A daemon that runs freely lies anywhere to the servo
thread, so its ages differ from turn to turn by up to a period. With each turn stands
what the host of a virtual machine took from its processors meanwhile."""
import contextlib
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time

from figures import Figure, interval, middle, table, us
from rig import Fault

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples" / "python"))

TITLE = "Age of the fast data when LinuxCNC reads them, servo thread of 1 kHz"
SECONDS = 100
ALLOWED_US = 100  # beside the round trip, with the lock
LATE_US = 500  # a read that found the data of the cycle before, with the lock
DEPTH = 1000  # samples that may wait for halsampler
WAYS = {"free": ("free-running", {"phase-lock": "no", "mode": "sleep"}),
        "locked": ("phase lock", {"phase-lock": "yes", "mode": "sleep"}),
        "spin": ("phase lock, mode spin", {"phase-lock": "yes", "mode": "spin"})}


def lower_ns(bucket):
    """As pokeys_histogram_lower(): where a bucket begins."""
    return (4 + (bucket - 1) % 4) << ((bucket - 1) // 4 + 4) if bucket else 0


def quantile_ns(count, part):
    """Between the two ends of the bucket in proportion: a bucket is up to a quarter wide,
    more than what is to be told from the target here."""
    wanted, below = max(1, sum(count) * part), 0
    for bucket, here in enumerate(count):
        if here and below + here >= wanted:
            begin = lower_ns(bucket)
            return begin + (lower_ns(bucket + 1) - begin) * (wanted - below) / here
        below += here
    return 0


def since(before, after):
    count = [b - a for a, b in zip(before.bucket, after.bucket)]
    return {"samples": sum(count), **{f"p{name}_ns": quantile_ns(count, part)
                                      for name, part in (("50", 0.5), ("99", 0.99), ("100", 1))}}


def sampled(bench, seconds):
    """The ages at the reads of so many seconds, in the order of their size."""
    missed = bench.hal.get_value("sampler.0.overruns")
    with subprocess.Popen("halsampler", stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True) as child:
        lines = []
        reader = threading.Thread(target=lambda: lines.extend(child.stdout.read().split()))
        reader.start()
        bench.halcmd("setp", "sampler.0.enable", "1")
        time.sleep(seconds)
        bench.halcmd("setp", "sampler.0.enable", "0")
        bench.wait_for("the samples", lambda: not bench.hal.get_value("sampler.0.curr-depth"), 10)
        child.send_signal(signal.SIGINT)
        reader.join()
    if bench.hal.get_value("sampler.0.overruns") != missed or not lines:
        raise Fault("halsampler came too late for what was sampled")
    ages = sorted(float(line) for line in lines if line != "overrun")
    return {"samples": len(ages), **{f"p{part}_ns": 1000 * ages[min(len(ages) * part // 100, len(ages) - 1)]
                                     for part in (50, 99, 100)},
            "late": sum(age >= LATE_US for age in ages)}


def stolen_ms():
    """What the host has taken from all processors, as the kernel counts it; 0 where it cannot."""
    words = pathlib.Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0].split()
    return int(words[8]) * 1000 / os.sysconf("SC_CLK_TCK")


def make_realtime(program, priority):
    """SCHED_FIFO for every thread of a program, where that is permitted; 0 = it is not."""
    for comm in pathlib.Path("/proc").glob("[0-9]*/comm"):
        with contextlib.suppress(OSError):
            if comm.read_text().strip() == program:
                for task in (comm.parent / "task").iterdir():
                    os.sched_setscheduler(int(task.name), os.SCHED_FIFO, os.sched_param(priority))
                return priority
    return 0


def diag(client):
    image = client.read_diag()
    if not image:
        raise Fault("the daemon is gone")
    return image


def turn(bench, client, way):
    bench.start_daemon({"cpu": bench.cpu_client, **WAYS[way][1]}, {})
    bench.wait_for("pokeys.0.connected", lambda: bench.get("connected"), 10)
    if way != "free":
        bench.wait_for("the lock", lambda: bench.status()["state"]["phase"]["state"] == "locked", 20)
    time.sleep(1 if bench.quick else 4)  # the lead is known after some thousand cycles
    bench.wait_for("the shared memory", lambda: client.poll() == 1 and client.read_diag(), 10)
    before, stolen = diag(client), stolen_ms()
    age = sampled(bench, 1 if bench.quick else 4)
    after, stolen, phase = diag(client), stolen_ms() - stolen, bench.status()["state"]["phase"]
    bench.stop("pokeysd")
    return {"age": age, "stolen_ms": stolen, "round_trip": since(before.fast_round_trip, after.fast_round_trip),
            "fresh": since(before.fresh, after.fresh), "phase": phase}


def measure(bench):
    os.environ["POKEYS_SHM_LIBRARY"] = str(bench.build / "shm/libpokeys_shm.so.0")
    import pokeys  # pylint: disable=import-outside-toplevel
    bench.start_simulator("--cpu", bench.cpu_sim)  # sleeps between requests, so it may have priority
    make_realtime("pokeys-sim", 50)
    bench.start_hal()
    bench.halcmd("loadrt", "sampler", f"depth={DEPTH}", "cfg=f")
    bench.halcmd("setp", "sampler.0.enable", "0")
    bench.halcmd("net", "age", "pokeys.0.age-us", "sampler.0.pin.0")
    bench.halcmd("addf", "sampler.0", "servo-thread")
    reader = bench.hal.component("bench")  # HAL lets only components read
    reader.ready()
    bench.halcmd("start")
    found = {"priority": make_realtime("rtapi_app", 98), **{way: [] for way in WAYS}}
    with pokeys.Client(bench.device, str(bench.run / "pokeysd"), "bench") as client:
        for _ in bench.turns("free and locked", 2 if bench.quick else 3):
            for way in WAYS:
                found[way].append(turn(bench, client, way))
    reader.exit()
    return found


def figures(found):
    rows = []
    for way, (text, _) in WAYS.items():
        base = middle(found[way], "round_trip", "p50_ns")[0]
        samples = sum(run["age"]["samples"] for run in found[way])
        for part in ("50", "99"):
            value, low, high = interval([run["age"][f"p{part}_ns"] / 1000 for run in found[way]])
            most = base / 1000 + ALLOWED_US if way != "free" and part == "99" else None
            rows.append(Figure(f"age at LinuxCNC's read, {text}, p{part}", value, "µs", samples, low, high, most,
                               f"age of the data at LinuxCNC's read, {text}, p{part}"))
    return rows


def report(found):
    def row(way, run):
        return (WAYS[way][0], *(us(run["age"][f"p{part}_ns"]) for part in ("50", "99", "100")),
                us(run["round_trip"]["p50_ns"]), us(run["fresh"]["p99_ns"]), f"{run['phase']['lead_us']:.0f}",
                f"{run['phase']['jitter_us']:.1f}", run["phase"]["state"], f"{run['stolen_ms']:.0f}",
                run["age"]["late"], run["age"]["samples"])
    priority = f"SCHED_FIFO {found['priority']}" if found["priority"] else "SCHED_OTHER"
    return [f"POSIX threads, the servo thread {priority}. A row is a turn: a daemon of its own. Target with the"
            f" lock: p99 at most the round trip (p50) and {ALLOWED_US} µs, on an idle machine.", "",
            *table(("", "age p50 µs", "p99 µs", "most µs", "round trip p50 µs", "data fresh p99 µs", "lead µs",
                    "reads' jitter µs", "phase", "stolen ms", f"older than {LATE_US} µs", "reads"),
                   (row(way, run) for runs in zip(*(found[way] for way in WAYS))
                    for way, run in zip(WAYS, runs)))]
