# SPDX-License-Identifier: GPL-2.0-or-later
"""How late the gateway's event loop is while its console has too much to do."""
import pathlib
import re
import sys
import urllib.request

from figures import Figure, table, total
from sections.gateway import free_port, listens, need

TITLE = "The gateway's console: how late its event loop is under floods"
SECONDS = 480
ADDRESS = "127.0.0.1"
HERE = pathlib.Path(__file__).resolve().parents[1]
WAYS = {"idle": "one client reads, and nobody says anything", "machine": "the machine talks without a pause",
        "client": "a client sends 10,000 lines a second",
        "pages": "the machine talks without a pause, and 100 web sockets read nothing"}
PERCENTILE, MOST_MS = 0.999, 10
BUCKET = re.compile(r'^pokeys_gateway_loop_lag_seconds_bucket\{le="([^"]+)"\} (\S+)$', re.M)


def lags(port):
    """The histogram of the loop's lag: upper bounds in seconds, and how often it was not above."""
    with urllib.request.urlopen(f"http://{ADDRESS}:{port}/metrics") as answer:
        return {float(bound): float(count) for bound, count in BUCKET.findall(answer.read().decode())}


def measure(bench):
    need(bench, "the console", "aiohttp", "prometheus_client", "serial")
    port, telnet, pages = free_port(), free_port(), free_port()
    link, conf = bench.run / "printer", bench.run / "gateway.conf"
    conf.write_text(f"[http]\nlisten = {ADDRESS}:{port}\n[machine]\nport = {link}\n[telnet]\nlisten = {ADDRESS}:{telnet}\n"
                    f"[esp3d]\nlisten = {ADDRESS}:{pages}\n[console]\nlevel = user\n", encoding="utf-8")
    bench.spawn("gateway", "taskset", "-c", bench.cpu_client, HERE.parent / "gateway/pokeys-gateway", "--config", conf,
                "--runtime-directory", bench.run / "pokeysd")
    bench.wait_for("the gateway to listen", lambda: listens(port), 20, "gateway")
    found = {way: [] for way in WAYS}
    for way in bench.contests("the console", tuple(WAYS), 1 if bench.quick else 3):
        before = lags(port)
        run = bench.output("taskset", "-c", bench.cpu_sim, sys.executable, "-B", HERE / "talkers.py", ADDRESS, telnet,
                           pages, link, way, 5 if bench.quick else 30)
        run["lags"] = [[bound if bound < 1e9 else None, count - before[bound]] for bound, count in lags(port).items()]
        found[way].append(run)
    bench.stop("gateway")
    return found


def percentile_ms(runs):
    """An upper bound of it, in milliseconds, and of how many samples; None: it is above all bounds."""
    counts = [sum(pair) for pair in zip(*([count for _, count in run["lags"]] for run in runs))]
    bounds = [bound for bound, _ in runs[0]["lags"]]
    value = next((bound for bound, count in zip(bounds, counts) if count >= PERCENTILE * counts[-1]), None)
    return value and value * 1e3, int(counts[-1])


def figures(found):
    rows = []
    for way, text in WAYS.items():
        value, samples = percentile_ms(found[way])
        rows.append(Figure(f"lag p99.9, not above: {text}", value, "ms", samples, most=MOST_MS,
                           readme=f"gateway: its event loop's lag p99.9 (upper bound) while {text}"))
    return rows


def report(found):
    return ["The gateway has a core; the machine and all clients share another one. The gateway measures its event loop"
            " 50 times a second, as the time by which a timer is late.", "",
            *table(("meanwhile", "lines a second", *(f"≤ {bound * 1e3:g} ms" if bound else "later" for bound, _ in
                                                     found["idle"][0]["lags"]), "samples"),
                   [(text, f"{total(found[way], 'lines') / total(found[way], 'seconds'):.0f}", *shares(found[way]),
                     percentile_ms(found[way])[1]) for way, text in WAYS.items()])]


def shares(runs):
    counts = [sum(pair) for pair in zip(*([count for _, count in run["lags"]] for run in runs))]
    return [f"{100 * count / counts[-1]:.2f} %" for count in counts]
