# SPDX-License-Identifier: GPL-2.0-or-later
"""How soon the daemon has a stop that comes to the gateway's console while axes move by G-code."""
import pathlib
import sys

from figures import Figure, middle, table, total
from sections.gateway import free_port, listens, need

TITLE = "G-code: from a stop at the gateway's console to the daemon"
SECONDS = 120
WAYS = {"telnet": "a client of telnet", "serial": "a program at the pseudoterminal", "page": "the page"}
MOST_MS = 6  # a cycle of the daemon, and 5 ms
HERE = pathlib.Path(__file__).resolve().parents[1]
AXIS = {"axes": 1, "generator": "external", "axis.0.name": "x", "axis.0.pulses-per-unit": 200, "axis.0.mode": "position",
        "axis.0.invert": "off", "axis.0.max-speed": 20000, "axis.0.max-acceleration": 200000}


def measure(bench):
    need(bench, "the console", "aiohttp", "prometheus_client", "serial")
    bench.start_simulator()
    bench.start_daemon({"cpu": bench.cpu_client}, AXIS)
    port, telnet = free_port(), free_port()
    pty, conf = bench.run / "pty", bench.run / "gateway.conf"
    conf.write_text(f"[gateway]\nruntime-directory = {bench.run / 'pokeysd'}\n[http]\nlisten = 127.0.0.1:{port}\n"
                    f"[machine]\nkind = pokeys\ndevice = {bench.device}\n[telnet]\nlisten = 127.0.0.1:{telnet}\n"
                    f"[pty]\npath = {pty}\n[console]\nlevel = user\n", encoding="utf-8")
    bench.spawn("gateway", "taskset", "-c", bench.cpu_sim, HERE.parent / "gateway/pokeys-gateway", "--config", conf)
    bench.wait_for("the gateway to listen", lambda: listens(port), 20, "gateway")
    return [bench.output("taskset", "-c", bench.cpu_sim, sys.executable, "-B", HERE / "stoppers.py", bench.device,
                         bench.run / "pokeysd", telnet, pty, port, 10 if bench.quick else 30)
            for _ in bench.turns("stops", 1 if bench.quick else 3)]


def figures(runs):
    rows = []
    for way, text in WAYS.items():
        value, low, high = middle(runs, way, "p50_ms")
        rows.append(Figure(f"stop (M410) by {text}, until the daemon has it, p50", value, "ms", total(runs, way, "stops"), low,
                           high, MOST_MS, f"gateway: a stop by {text} is with the daemon after, p50"))
    return rows


def report(runs):
    return ["An axis moves by G-code, and a client sends M410. The time ends when the daemon publishes that the path is being"
            " ended. Gateway, clients and simulator share one core, the daemon has another.", "",
            *table(("from", "p50 of each round, ms", "stops"),
                   [(text, ", ".join(f"{run[way]['p50_ms']:.1f}" for run in runs), total(runs, way, "stops"))
                    for way, text in WAYS.items()])]
