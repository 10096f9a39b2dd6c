# SPDX-License-Identifier: GPL-2.0-or-later
"""A gateway beside a House (tests/system/house.py): a daemon and a simulated device."""
import contextlib
import functools
import http.client
import json
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import traceback

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/system"))
from house import PATIENCE, House, Skip, wait_for  # noqa: E402  pylint: disable=wrong-import-position

PYTHON = "/usr/bin/python3"
House.programs |= {"sh": pathlib.Path("/bin/sh"), "python": pathlib.Path(PYTHON)}
NEEDED = "aiohttp", "prometheus_client", "serial"


def need_libraries():
    """Debian's Python has what the gateway needs, or the test cannot be run."""
    if missing := _missing():
        raise Skip(f"{missing} (Debian: python3-aiohttp, python3-prometheus-client, python3-serial)")


@functools.cache
def _missing():
    ran = subprocess.run([PYTHON, "-c", f"import {', '.join(NEEDED)}"], capture_output=True, text=True, check=False)
    return ran.stderr.strip().splitlines()[-1] if ran.returncode else ""


def run_in_fork(begin, *words, given=""):
    """What a program says and how it ends, as subprocess.run() does, in a fork of this process: begin(words) is its main(),
    and its libraries are here already. To load them takes most of a second."""
    with tempfile.TemporaryFile() as into, tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        into.write(given.encode())
        into.seek(0)
        sys.stdout.flush()
        sys.stderr.flush()
        pid = os.fork()
        if pid == 0:
            for number, file in enumerate((into, out, err)):
                os.dup2(file.fileno(), number)
            status = 1
            try:
                status = begin([os.fsdecode(word) for word in words])
            except SystemExit as ended:
                status = ended.code
            except BaseException:           # as Python ends
                traceback.print_exc()
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
        status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
        out.seek(0)
        err.seek(0)
        return subprocess.CompletedProcess(words, status, out.read().decode(), err.read().decode())


class Gateway:
    """A gateway that listens on a socket of ours, so that no port is taken twice."""

    def __init__(self, house, *words, runtime=None, port=0):
        need_libraries()
        self.house = house
        self.socket = socket.socket()
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.bind(("127.0.0.1", port))
        self.socket.listen(64)
        self.port = self.socket.getsockname()[1]
        # as sd_listen_fds(3) wants it
        self.child = house.spawn(
            "sh", "-c", 'LISTEN_PID=$$ exec "$0" "$@"', House.programs["pokeys-gateway"], "--runtime-directory",
            runtime or house.runtime, *words, log="gateway.log", close_fds=False,
            preexec_fn=lambda: (os.dup2(self.socket.fileno(), 3), os.set_inheritable(3, True)),
            env={**os.environ, **environment(), "LISTEN_FDS": "1"})
        self.socket.close()

    def ask(self, path, method="GET", **headers):
        """Status, headers and body of an answer."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        try:
            connection.request(method, path, headers=headers)
            answer = connection.getresponse()
            return answer.status, dict(answer.getheaders()), answer.read()
        finally:
            connection.close()

    def own(self, name):
        """A value of the gateway itself, from /metrics."""
        return next(float(line.split()[1]) for line in self.ask("/metrics")[2].decode().splitlines()
                    if line.startswith(f"pokeys_gateway_{name} "))

    def json(self, path):
        """The document of an answer that is good."""
        status, headers, body = self.ask(path)
        assert (status, headers["Content-Type"].split(";")[0]) == (200, "application/json"), (path, status, body)
        return json.loads(body)

    def wait(self, what, test):
        """Until test() holds; the gateway must not end meanwhile."""
        def holds():
            try:
                return test()
            except ConnectionError:
                self.child.wait(PATIENCE)
                raise AssertionError(f"the gateway ended: {self.house.log('gateway.log')}") from None
        return wait_for(what, holds, say=lambda: self.house.log("gateway.log"))

    def wait_running(self, name="mill"):
        """Until the device is shown as running."""
        self.wait(f"{name} running", lambda: {"name": name, "connected": True}.items() <= next(
            (one for one in self.json("/api/devices")["devices"] if one["name"] == name), {}).items())


@contextlib.contextmanager
def machine(*sim_words, more="", heaters=None, servos=None, **keys):
    """A House with a device that runs, and a gateway that shows it: house, simulator, daemon, gateway.

    `keys` go into the device's section, `heaters` and `servos` are sections by their names, and `more` goes into the
    gateway's configuration, where @folder@ is that of the House. The deadlines are those of a busy computer, unless they are given.
    """
    need_libraries()
    with House() as house:
        house.device_keys["mill"] |= {"lost-after-ms": 5000, "stale-after-ms": 4000, **keys}
        house.heater_keys, house.servo_keys = heaters or {}, servos or {}
        (records := house.folder / "records").mkdir()
        # nothing in the gateway depends on the length of a cycle, with which a daemon and a device are always busy; motors do
        house.daemon_keys |= {"record-folder": records, "period-us": 1000 if servos else 4000}
        sim = house.start_sim(*sim_words)
        daemon = house.start_daemon()
        house.wait_fresh()
        (conf := house.folder / "gateway.conf").write_text(
            f"[gateway]\nrecord-folder = {records}\ndoctor-socket = {house.folder / 'doctor'}\n"
            f"{more.replace('@folder@', str(house.folder))}", encoding="utf-8")
        gateway = Gateway(house, "--config", conf)
        gateway.wait_running()
        yield house, sim, daemon, gateway


# a reading of 25 C by a thermistor of 100 kohm with 4.7 kohm, and of a broken wire
WARM, OPEN = 3911, 4095


def loops(**keys):
    """A machine() with a heater, a heater whose sensor is broken, and a servo motor; for the preset servo-mill."""
    heater = {"sensor": "thermistor", "max-temperature": 120, "watch-window-s": 600, "max-age-ms": 2000}
    return machine("--preset", "servo-mill", heaters={
        "bed": {"sensor-pin": 43, "output-pin": 39, "fan-pin": 40, **heater},
        "hotend": {"sensor-pin": 44, "output-pin": 41, **heater},
    }, servos={"x": {"encoder": 0, "pwm": 0, "direction-pin": 31, "enable-pin": 35, "counts-per-unit": 400,
                     "max-speed": 300, "pid-p": 1, "max-age-ms": 100}},
        **{"pwm-period": 1250, "heartbeat-timeout-ms": 2000, "encoder.0.enable": "on", "encoder.0.pins": "1, 2",
           "encoder.0.sampling": 4, **keys})


def environment():
    """Where the programs and libraries of the build are."""
    library = next(path for name, path in House.programs.items() if name.startswith("libpokeys_shm.so"))
    # many gateways are started, and to compile it takes as long as all the rest of a start
    return {"PYTHONPATH": f"{ROOT / 'gateway'}:{ROOT / 'python'}", "PYTHONDONTWRITEBYTECODE": "",
            "PYTHONPYCACHEPREFIX": str(library.parents[1] / "pycache"),
            "POKEYS_SHM_LIBRARY": str(library),
            **({"POKEYS_GATEWAY_WEB": str(House.programs["page.js"].parent)} if "page.js" in House.programs else {}),
            "POKEYSCTL": str(House.programs["pokeysctl"])}
