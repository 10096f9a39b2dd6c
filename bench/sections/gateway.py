# SPDX-License-Identifier: GPL-2.0-or-later
"""What the gateway's clients notice of one another, and what the daemon notices of them."""
import contextlib
import importlib
import os
import pathlib
import socket
import sys
import time

from figures import Figure, Skip, middle, ratios, table, total

TITLE = "The gateway: 20 clients that read beside 100 that do not"
SECONDS = 420
LIVE, FROZEN, RATE = 20, 100, 20
HERE = pathlib.Path(__file__).resolve().parents[1]
WAYS = ("gateway", "plain")
NAMES = {"gateway": "pokeys-gateway", "plain": "a plain broadcast over aiohttp"}


def free_port():
    with contextlib.closing(socket.socket()) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def skipped(bench):
    return bench.status()["diag"]["counters"]["cycles_skipped"]


def memory_kb(pid):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1])
    return 0


def listens(port):
    try:
        socket.create_connection(("127.0.0.1", port)).close()
    except OSError:
        return False
    return True


def serve(bench, way, port):
    if way == "gateway":
        words = (HERE.parent / "gateway/pokeys-gateway", "--listen", f"127.0.0.1:{port}", "--runtime-directory",
                 bench.run / "pokeysd")
    else:
        words = (sys.executable, "-B", HERE / "broadcast.py", port, bench.run / "pokeysd", bench.device, RATE)
    bench.spawn(way, "taskset", "-c", bench.cpu_sim, *words)
    bench.wait_for(f"{NAMES[way]} to listen", lambda: listens(port), 20, way)
    # until it has found the device
    time.sleep(2)


def need(bench, what, *modules):
    """A gateway can be started, or Skip: without these modules, `what` is not measured."""
    for name in modules:
        try:
            importlib.import_module(name)
        except ImportError as error:
            raise Skip(f"{error}: {what} is not measured") from None
    os.environ |= {"POKEYS_SHM_LIBRARY": str(bench.build / "shm/libpokeys_shm.so.0"), "PYTHONDONTWRITEBYTECODE": "1",
                   "PYTHONPATH": f"{HERE.parent / 'gateway'}:{HERE.parent / 'python'}",
                   "POKEYSCTL": str(bench.build / "tools/pokeysctl")}


def measure(bench):
    need(bench, "the gateway", "aiohttp", "prometheus_client")
    seconds = 15 if bench.quick else 60
    bench.start_simulator()
    bench.start_daemon({"cpu": bench.cpu_client}, {})
    bench.wait_for("the daemon's counters", lambda: bench.status()["diag"], 20)
    found = []
    for _ in bench.turns("gateway", 1 if bench.quick else 3):
        run = {}
        before = skipped(bench)
        time.sleep(seconds)
        run["idle"] = {"skipped": skipped(bench) - before}
        for way in WAYS:
            port = free_port()
            serve(bench, way, port)
            before = skipped(bench)
            run[way] = bench.output("taskset", "-c", bench.cpu_sim, sys.executable, "-B", HERE / "watchers.py", port,
                                    bench.device, LIVE, FROZEN, RATE, seconds)
            run[way] |= {"skipped": skipped(bench) - before, "memory_kb": memory_kb(bench.started[way].pid)}
            bench.stop(way)
        found.append(run)
    return found


def figures(runs):
    rows = []
    value, low, high = middle(runs, "gateway", "max_ms")
    rows.append(Figure("longest gap of a client that reads", value, "ms", total(runs, "gateway", "messages"), low, high,
                       100, "gateway: longest gap of 20 clients at 20 Hz beside 100 stopped ones"))
    value, low, high = ratios([run["gateway"] for run in runs], [run["plain"] for run in runs], "max_ms")
    rows.append(Figure("the same: ratio to a plain broadcast", value, "", len(runs), low, high, 1))
    value, low, high = middle(runs, "gateway", "memory_kb")
    rows.append(Figure("memory of the gateway, the most", value / 1024, "MB", len(runs), low / 1024, high / 1024, 80,
                       "gateway: memory with 120 clients"))
    value, low, high = middle(runs, "gateway", "kept_s")
    rows.append(Figure("a client that takes nothing is ended after", value, "s", total(runs, "gateway", "ended"), low,
                       high, 15))
    return rows


def report(runs):
    rows = []
    for way in WAYS:
        values = [middle(runs, way, name)[0] for name in ("p50_ms", "p99_ms", "max_ms")]
        rows.append((NAMES[way], *(f"{value:.0f}" for value in values), total(runs, way, "messages"),
                     f"{total(runs, way, 'ended')} of {total(runs, way, 'frozen')}",
                     f"{middle(runs, way, 'memory_kb')[0] / 1024:.0f}", total(runs, way, "skipped")))
    return [f"Each of {LIVE + FROZEN} clients wants all values of the device {RATE} times a second; {FROZEN} of them never"
            " read. The gateway sends differences; a plain broadcast sends all values and waits for each client in turn."
            " Clients, server and simulator share one core, the daemon has another.",
            f" Cycles that the daemon missed in the same time without clients: {total(runs, 'idle', 'skipped')}.", "",
            *table(("server", "gap p50 ms", "p99 ms", "longest ms", "messages", "ended", "memory MB", "cycles missed"),
                   rows)]
