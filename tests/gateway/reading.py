#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The gateway's page, data and metrics, compared with what pokeysctl says; and what it refuses."""
import contextlib
import json
import math
import os
import re
import signal
import socket
import subprocess
import sys
import urllib.parse

from rig import OPEN, PATIENCE, PYTHON, ROOT, WARM, Gateway, House, Skip, environment, loops, machine, need_libraries
from house import end, equal, main, wait_equal, wait_for  # noqa: E402  (rig.py finds it)


EXAMPLES = ROOT / "examples/prometheus"
LOOPS = "pokeys_heater_", "pokeys_servo_"


def workshop(**keys):
    """A device with some of everything."""
    return machine("--preset", "demo", **{"digital-inputs": "4,9", "digital-outputs": "31-34", "analog-inputs": "43",
                                          "axes": 3, **keys})


def samples(page):
    """The samples of a page of metrics: name, labels as a frozenset, value."""
    found = {}
    for line in page.splitlines():
        if line and not line.startswith("#"):
            name, labels, value = re.fullmatch(r"([a-zA-Z_:]+)(?:\{(.*)\})? (\S+)", line).groups()
            key = name, frozenset(re.findall(r'(\w+)="((?:[^"\\]|\\.)*)"', labels or ""))
            assert key not in found, f"twice: {line}"
            found[key] = float(value)
    return found


def scrape(gateway, **headers):
    status, kind, body = gateway.ask("/metrics", **headers)
    equal(status, 200)
    return kind["Content-Type"], samples(body.decode())


def is_process_value(name):
    """Of the machine, and not of the transport or of the gateway."""
    return name.startswith("pokeys_") and not name.startswith("pokeys_gateway_") and not name.endswith(
        ("_total", "_bucket", "_count", "_sum")) and name not in (
        "pokeys_up", "pokeys_daemon_up", "pokeys_fault", "pokeys_link", "pokeys_device_info", "pokeys_data_age_seconds")


def one(found, metric, /, **labels):
    """The value of a sample of mill; None = there is none."""
    return found.get((metric, frozenset({"device": "mill", **labels}.items())))


def test_the_data_are_those_of_pokeysctl():
    with workshop() as (house, sim, daemon, gateway):
        house.ask_sim(sim, "analog", 43, 2000)
        house.says("get", "mill", "adc.02.raw", stdout="2000\n")
        daemon.send_signal(signal.SIGSTOP)
        try:
            house.says("get", "mill", "stale", stdout="true\n")
            mine, theirs = gateway.json("/api/devices/mill"), json.loads(house.ctl("get", "mill", "--json").stdout)
            listed = gateway.json("/api/devices")["devices"]
            events = gateway.json("/api/devices/mill/events")["events"]
            said = [json.loads(line) for line in house.ctl("events", "--json").stdout.splitlines()]
        finally:
            daemon.send_signal(signal.SIGCONT)
        equal((mine["connected"], "daemon not publishing" in mine["reason"]), (False, True), mine["reason"])
        equal([(row["name"], row["type"], row["link"]) for row in listed], [("mill", "PoKeys57CNC", "running")])
        there = [name for name in theirs["values"] if name in mine["values"]]
        assert len(there) > 1500, len(there)
        for name in there:
            if "age" not in name:
                found, wanted = mine["values"][name], theirs["values"][name]
                assert found == wanted or math.isclose(found, wanted, rel_tol=1e-6), (name, found, wanted)
        equal({name: mine["words"][name] for name in theirs["words"] if name in mine["words"]},
              {name: word for name, word in theirs["words"].items() if name in mine["words"]})
        assert mine["words"]["link-state"] == "running", mine["words"]
        equal([(row["number"], row["kind"], row["text"], row["device"]) for row in events],
              [(row["number"], row["kind"], row["text"], row["device"]) for row in said])
        names = {row["name"]: row for row in gateway.json("/api/names")["names"]}
        equal(set(names) >= set(theirs["values"]), True)
        equal((names["pwm.00.value"]["writable"], names["pin.03.in"]["writable"]), (True, False))


def test_metrics_are_the_values_of_the_moment():
    with workshop() as (house, sim, _daemon, gateway):
        for level in (0, 1):
            house.ask_sim(sim, "pin", 4, level)
            wait_equal("the input", lambda: one(scrape(gateway)[1], "pokeys_input", terminal="4", name="pin.03.in"),
                       level)
        house.ask_sim(sim, "analog", 43, 4095)
        wait_for("the voltage", lambda: abs(one(scrape(gateway)[1], "pokeys_analog_volts", terminal="43",
                                                name="adc.02.volts") - 3.2992) < 1e-3)
        kind, found = scrape(gateway)
        assert kind.startswith("text/plain; version=0.0.4"), kind
        equal(one(found, "pokeys_up"), 1)
        equal(one(found, "pokeys_link", pokeys_link="running"), 1)
        equal(one(found, "pokeys_link", pokeys_link="lost"), 0)
        equal(one(found, "pokeys_device_info", serial="65432", type="PoKeys57CNC", address=house.address,
                  firmware="4.7.15"), 1)
        outputs = {dict(labels)["terminal"] for name, labels in found if name == "pokeys_output"}
        equal(outputs, {"31", "32", "33", "34"})
        # what is set up as an input, and nothing else
        values = gateway.json("/api/devices/mill")["values"]
        for metric, bit, first in (("pokeys_input", 2, 0), ("pokeys_output", 4, 0), ("pokeys_analog_volts", 8, 40)):
            there = {dict(labels)["terminal"] for name, labels in found if name == metric}
            wanted = {str(i + 1) for i in range(first, 55) if values[f"pin.{i:02}.function-in-effect"] & bit}
            equal(there, wanted, metric)
        assert not outputs & {dict(labels)["terminal"] for name, labels in found if name == "pokeys_input"}
        equal({dict(labels)["axis"] for name, labels in found if name == "pokeys_axis_position_pulses"},
              set("01234567"))
        assert all("pokeys_" in name or name.startswith(("process_", "python_")) for name, _ in found), found
        # a histogram is one: cumulative, and its last bucket is its count
        daemon = [(name, labels) for name, labels in found if name.endswith("_bucket")]
        whats = {name for name, _ in daemon}
        assert {"pokeys_wakeup_seconds_bucket", "pokeys_round_trip_seconds_bucket"} <= whats, whats
        for name in whats:
            rows = sorted((float(dict(labels)["le"]), found[name, labels]) for n, labels in daemon if n == name)
            assert [value for _, value in rows] == sorted(value for _, value in rows), rows
            count = name.replace("_bucket", "_count")
            # the gateway's own is that of no device
            own = name.startswith("pokeys_gateway_")
            equal(rows[-1], (float("inf"), found[count, frozenset()] if own else one(found, count)))
            assert len(rows) > (8 if own else 10), rows
        counts = house.device()["diag"]["latency_us"]["wakeup"]
        assert one(found, "pokeys_wakeup_seconds_count") <= counts["count"], counts
        # the other format, which Prometheus asks for
        kind, other = scrape(gateway, Accept="application/openmetrics-text; version=1.0.0")
        assert kind.startswith("application/openmetrics-text"), kind
        equal(one(other, "pokeys_up"), 1)


def test_metrics_of_heaters_and_motors():
    with loops() as (house, sim, _daemon, gateway):
        house.ask_sim(sim, "analog", 43, WARM)
        house.ask_sim(sim, "analog", 44, OPEN)
        wait_for("the temperature", lambda: abs(
            (one(scrape(gateway)[1], "pokeys_heater_temperature_celsius", heater="bed") or 0) - 25) < 0.5)
        found = scrape(gateway)[1]
        # what is not known is no number
        equal(one(found, "pokeys_heater_temperature_celsius", heater="hotend"), None)
        for metric, value in (("target_celsius", 0), ("power_ratio", 0), ("fault", 0), ("faults_total", 0),
                              ("power_limited", 0), ("at_temperature", 0)):
            equal(one(found, f"pokeys_heater_{metric}", heater="bed"), value, metric)
        equal([one(found, "pokeys_heater_state", heater="bed", pokeys_heater_state=word) for word in ("off", "heating")],
              [1, 0])
        assert abs(one(found, "pokeys_servo_position_units", servo="x")) < 1
        equal(one(found, "pokeys_servo_state", servo="x", pokeys_servo_state="off"), 1)
        # those that there are, and no others
        for kind, names in (("heater", {"bed", "hotend"}), ("servo", {"x"})):
            equal({dict(labels)[kind] for _, labels in found if kind in dict(labels)}, names)


def dashboard():
    """The queries of Grafana's dashboard, as Grafana sends them for all devices."""
    document = json.loads((EXAMPLES / "grafana.json").read_text())
    return [target["expr"].replace("$device", ".*").replace("$__rate_interval", "1m")
            for panel in document["panels"] for target in panel.get("targets", ())]


def test_promtool_has_no_complaint():
    def promtool(*words, **options):
        try:
            ran = subprocess.run(["promtool", "check", *words], capture_output=True, check=False, timeout=60, **options)
        except FileNotFoundError:
            raise Skip("promtool is not installed (Debian: prometheus)") from None
        equal(ran.returncode, 0, ran.stdout + ran.stderr)
        return ran.stdout + ran.stderr
    with workshop() as (house, _sim, _daemon, gateway):
        equal(promtool("metrics", input=gateway.ask("/metrics")[2]), b"")
        promtool("config", EXAMPLES / "prometheus.yml")
        # it checks queries in rules only; JSON is YAML
        (rules := house.folder / "dashboard.yml").write_text(json.dumps({"groups": [{"name": "dashboard", "rules": [
            {"record": f"panel:{i}", "expr": query} for i, query in enumerate(dashboard())]}]}))
        promtool("rules", rules)


def test_alerts_and_dashboard_are_about_metrics_that_there_are():
    alerts = re.sub(r"summary:.*", "", (EXAMPLES / "alerts.yml").read_text())
    with workshop() as (house, _sim, _daemon, gateway):
        equal(gateway.port > 0 and house.state()["link"], "running")
        found = scrape(gateway)[1]
        there = {name for name, _ in found} | {label for _, labels in found for label, _ in labels}
        for text in alerts, *dashboard():
            named = set(re.findall(r"\bpokeys_\w+", text))
            assert named, text
            # of drivers that have answered
            equal({name for name in named - there - {"pokeys_postep_temperature_celsius"}
                   if not name.startswith(LOOPS)}, set(), text)
    with loops() as (house, sim, _daemon, gateway):
        house.ask_sim(sim, "analog", 43, WARM)
        wait_for("the temperature", lambda: one(scrape(gateway)[1], "pokeys_heater_temperature_celsius", heater="bed"))
        there = {name for name, _ in scrape(gateway)[1]}
        for text in alerts, *dashboard():
            named = {name for name in re.findall(r"\bpokeys_\w+", text) if name.startswith(LOOPS)}
            equal(named - there, set(), text)


def test_what_cannot_be_read_has_no_values():
    with workshop(**{"stale-after-ms": 300, "lost-after-ms": 500}) as (house, sim, daemon, gateway):
        sim.kill()
        wait_equal("the loss", lambda: one(scrape(gateway)[1], "pokeys_up"), 0)
        wait_equal("why", lambda: one(scrape(gateway)[1], "pokeys_fault", fault="no answer"), 1)
        equal({name for name, _ in scrape(gateway)[1] if is_process_value(name)}, set())
        assert one(scrape(gateway)[1], "pokeys_data_age_seconds") > 0.3
        house.start_sim()
        wait_equal("the return", lambda: one(scrape(gateway)[1], "pokeys_up"), 1)
        found = scrape(gateway)[1]
        equal([name for name, _ in found if name == "pokeys_fault"], [])
        assert {"pokeys_input", "pokeys_emergency"} <= {name for name, _ in found if is_process_value(name)}
        # a daemon that does nothing any more
        daemon.send_signal(signal.SIGSTOP)
        wait_equal("its silence", lambda: one(scrape(gateway)[1], "pokeys_up"), 0)
        found = scrape(gateway)[1]
        equal(({name for name, _ in found if is_process_value(name)}, one(found, "pokeys_link", pokeys_link="running")),
              (set(), None))
        daemon.send_signal(signal.SIGCONT)
        equal(end(daemon), 0)
        wait_for("no daemon", lambda: "no daemon" in gateway.json("/healthz")["trouble"])
        wait_equal("no daemon", lambda: scrape(gateway)[1]["pokeys_daemon_up", frozenset()], 0)
        equal(one(scrape(gateway)[1], "pokeys_up"), 0)
        mill = gateway.json("/api/devices/mill")
        equal((mill["connected"], mill["values"], "no daemon" in mill["reason"]), (False, {}, True), mill["reason"])


def test_it_goes_on_with_the_next_daemon():
    with workshop() as (house, _sim, daemon, gateway):
        daemon.send_signal(signal.SIGKILL)
        daemon.wait()
        wait_for("the loss", lambda: not gateway.json("/api/devices/mill")["connected"])
        house.device_keys = {"lathe": house.device_keys["mill"]}
        house.start_daemon(wait=False)
        gateway.wait_running("lathe")
        wait_equal("the devices", lambda: [row["name"] for row in gateway.json("/api/devices")["devices"]], ["lathe"])
        log = house.log("gateway.log")
        assert "mill: showing it" in log and "lathe: showing it" in log, log


def test_it_may_be_there_before_the_daemon():
    with House() as house:
        gateway = Gateway(house)
        wait_equal("an answer", lambda: gateway.json("/api/devices")["devices"], [])
        assert "no daemon in" in gateway.json("/healthz")["trouble"]
        house.start_sim()
        house.start_daemon()
        gateway.wait_running()
        equal(gateway.json("/healthz"), {"format": 1, "status": "ok", "trouble": ""})


def test_the_page_is_there_and_safe():
    with workshop() as (_house, _sim, _daemon, gateway):
        for path, kind in (("/", "text/html"), ("/page.js", "text/javascript"), ("/page.css", "text/css")):
            status, headers, body = gateway.ask(path)
            equal((status, headers["Content-Type"], len(body) > 500), (200, f"{kind}; charset=utf-8", True))
            assert "default-src 'self'" in headers["Content-Security-Policy"], headers
            equal((headers["X-Content-Type-Options"], headers["Cache-Control"]), ("nosniff", "no-store"))
        # nothing of it comes from elsewhere
        page = b"".join(gateway.ask(path)[2] for path in ("/", "/page.js", "/page.css"))
        assert not re.search(rb"(?:src|href|url\(|import|fetch\()[^\n]{0,20}(?:https?:)?//", page), page
        # and it is small
        size = 0
        for path in "/", "/page.js", "/page.css":
            _status, headers, body = gateway.ask(path, **{"Accept-Encoding": "gzip"})
            size += len(body)
            equal(headers["Content-Encoding"], "gzip")
        print(f"the page has {size} bytes")
        assert size <= 60000, size


def test_what_is_refused():
    with workshop() as (house, _sim, _daemon, gateway):
        for host in ("evil.example", "evil.example:80", "127.0.0.1.evil.example", "192.168.1.1", "[2001:db8::1]", "",
                     "["):
            status, headers, body = gateway.ask("/api/devices", Host=host)
            equal((status, json.loads(body)["error"]["code"]), (403, 403), host)
            assert "Content-Security-Policy" in headers and "mill" not in body.decode(), body
        for host in ("localhost", "localhost:8580", "LOCALHOST", "127.0.0.1:1", "[::1]", "[::1]:8580", "127.1.2.3"):
            equal(gateway.ask("/api/devices", Host=host)[0], 200, host)
        for path in ("/nowhere", "/api/devices/lathe", "/../config.py", "/web/index.html", "/..%2f..%2fetc/passwd",
                     "/api/devices/..%2f..%2fx/events"):
            answer = gateway.ask(path)
            equal((answer[0], "error" in json.loads(answer[2])), (404, True), path)
        assert "there are: mill" in json.loads(gateway.ask("/api/devices/lathe")[2])["error"]["message"]
        for method in ("POST", "PUT", "DELETE", "OPTIONS"):
            status, headers, _ = gateway.ask("/api/devices", method)
            equal((status, headers["Allow"]), (405, "GET,HEAD"), method)
        # what is no HTTP, and too long, ends that connection and nothing else
        for sent in (b"\r\n" * 5, b"GET / HTTP/9.9\r\n\r\n", b"\x16\x03\x01" * 50,
                     b"GET /" + b"a" * 20000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n",
                     b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"y" * (1 << 20) + b"\r\n\r\n"):
            with socket.create_connection(("127.0.0.1", gateway.port), timeout=PATIENCE) as raw, \
                    contextlib.suppress(OSError):
                raw.sendall(sent)
                raw.shutdown(socket.SHUT_WR)
                answer = raw.recv(65536)
                assert not answer or re.match(rb"HTTP/\d\.\d (4|5)\d\d ", answer), (sent[:50], answer)
        # without a Host, or with two
        for hosts in (b"", b"Host: localhost\r\nHost: evil.example\r\n"):
            with socket.create_connection(("127.0.0.1", gateway.port), timeout=PATIENCE) as raw:
                raw.sendall(b"GET /api/devices HTTP/1.0\r\n" + hosts + b"\r\n")
                answer = raw.recv(65536)
                assert re.match(rb"HTTP/1\.[01] 40[03] ", answer) and b"mill" not in answer, (hosts, answer)
        gateway.wait_running()
        assert "Traceback" not in house.log("gateway.log"), house.log("gateway.log")


def test_its_end_is_graceful():
    with workshop() as (house, _sim, _daemon, gateway):
        for number in (signal.SIGTERM, signal.SIGINT):
            equal(end(gateway.child, number), 0, house.log("gateway.log"))
            log = house.log("gateway.log")
            assert log.rstrip().endswith("pokeys-gateway: ending") and "Traceback" not in log, log
            gateway = Gateway(house)
            gateway.wait_running()


def test_it_says_where_it_is_and_why_it_cannot_begin():
    need_libraries()
    with House() as house, socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        options = {"env": {**environment(), "PATH": "/usr/bin:/bin"}, "capture_output": True, "text": True,
                   "timeout": PATIENCE, "check": False}
        program = [PYTHON, str(House.programs["pokeys-gateway"]), "--runtime-directory", str(house.runtime)]
        ran = subprocess.run([*program, "--listen", f"127.0.0.1:{port}"], **options)
        equal((ran.returncode, "Traceback" in ran.stderr), (1, False), ran.stderr)
        assert f"127.0.0.1:{port}: address already in use" in ran.stderr.lower(), ran.stderr
        good = options["env"]
        options["env"] = good | {"POKEYS_SHM_LIBRARY": "/nowhere/libpokeys_shm.so"}
        ran = subprocess.run(program, **options)
        equal((ran.returncode, "install pokeysd" in ran.stderr, "Traceback" in ran.stderr), (1, True, False),
              ran.stderr)
        with socket.socket() as everywhere:
            everywhere.bind(("0.0.0.0", 0))
            everywhere.listen()
            ran = subprocess.run(["sh", "-c", 'LISTEN_FDS=1 LISTEN_PID=$$ exec "$0" "$@"', *program], close_fds=False,
                                 preexec_fn=lambda: (os.dup2(everywhere.fileno(), 3), os.set_inheritable(3, True)),
                                 **{**options, "env": good})
        equal((ran.returncode, "is reached from other computers, and there are no users" in ran.stderr), (78, True),
              ran.stderr)
        options["env"] = good | {"POKEYSCTL": "/nowhere/pokeysctl"}
        ran = subprocess.run(program, **options)
        equal((ran.returncode, ran.stderr.splitlines()[-1]), (1, "pokeys-gateway: /nowhere/pokeysctl: No such file or "
              "directory; install pokeys-tools, or set POKEYSCTL to its path"))
        gateway = Gateway(house)
        address = gateway.wait("its address", lambda: re.search(r"the page is at (http://\S+)",
                                                                house.log("gateway.log")))
        equal(urllib.parse.urlsplit(address[1]).port, gateway.port)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
