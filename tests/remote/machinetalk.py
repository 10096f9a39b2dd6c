#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""machinekit's own client, pymachinetalk, with a proxy: in an environment of its own, made by pip."""
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

import rig
from rig import halcmd, wait

sys.path.insert(1, str(rig.ROOT / "tests"))
import foreign  # noqa: E402  pylint: disable=wrong-import-position

# pymachinetalk 0.13.3 asks for a library that no longer builds, and does not need it
STEPS = (["setuptools==57.5.0", "wheel"], ["--no-build-isolation", "--no-deps", "pymachinetalk==0.13.3"],
         ["machinetalk-protobuf==1.2.1", "protobuf==3.20.3", "pyzmq", "fysom==2.1.6", "zeroconf", "six"])
CONFIG = "[pin panel.start]\nfailsafe = 0\n\n[component panel]\ninterval-ms = 20\n"
PROGRAM = """
import sys
from pymachinetalk.halremote import HAL_BIT, HAL_FLOAT, HAL_IN, HAL_IO, HAL_OUT, HAL_S32, HAL_U32, RemoteComponent
one = RemoteComponent(sys.argv[1])
for name, kind, direction in (("start", HAL_BIT, HAL_OUT), ("speed", HAL_FLOAT, HAL_IN), ("count", HAL_S32, HAL_IO),
                              ("mask", HAL_U32, HAL_OUT)):
    pin = one.newpin(name, kind, HAL_IN if name == sys.argv[2] else direction)
    pin.on_value_changed.append(lambda value, name=name: print(name, value, flush=True))
    pin.on_synced_changed.append(lambda value, name=name: print(name, "synced", value, flush=True))
one.on_connected_changed.append(lambda value: print("connected", value, flush=True))
one.on_state_changed.append(lambda state: print("state", state, flush=True))
one.halrcmd_uri, one.halrcomp_uri = "tcp://127.0.0.1:6202", "tcp://127.0.0.1:6201"
one.start()
for line in sys.stdin:
    name, value = line.split()
    one[name] = type(one[name])(float(value))
one.stop()
"""


DISCOVERER = """
import time
from pymachinetalk.dns_sd import Service, ServiceDiscovery
found = [Service(kind) for kind in ("halrcmd", "halrcomp", "halgroup")]
one = ServiceDiscovery(lookup_interval=500)
for each in found:
    one.register(each)
one.start()
before = None
while True:
    now = " ".join(each.uri or "-" for each in found)
    if now != before:
        print(now, len({each.uuid for each in found}), flush=True)
    before = now
    time.sleep(0.05)
"""


class Panel:
    """pymachinetalk in a process of its own."""

    def __init__(self, machine, name="panel", changed="-"):
        self.log = pathlib.Path(machine.folder.name, f"panel-{time.monotonic_ns()}.log")
        with open(self.log, "wb") as log:
            self.child = subprocess.Popen([os.environ["POKEYS_PANEL_PYTHON"], "-c", PROGRAM, name, changed], stdout=log,
                                          stderr=log, stdin=subprocess.PIPE, text=True, bufsize=1,
                                          env={"HOME": machine.folder.name, "PATH": "/usr/bin:/bin"})

    def said(self):
        return self.log.read_text(encoding="utf-8")

    def says(self, line, after=0):
        wait(f"it says {line!r} and not {self.said()!r}", lambda: f"{line}\n" in self.said()[after:])

    def put(self, name, value):
        self.child.stdin.write(f"{name} {value}\n")

    def close(self):
        self.child.kill()
        self.child.wait()
        self.child.stdin.close()


def it_binds_sets_and_sees(machine):
    machine.proxy(CONFIG)
    panel = Panel(machine)
    panel.says("connected True")
    for name, value, shown in (("start", 1, True), ("count", -5, -5), ("mask", 4000000000, 4000000000)):
        panel.put(name, value)
        machine.becomes(f"panel.{name}", shown)
    # confirmed by the proxy
    panel.says("mask synced True", panel.said().index("mask 4000000000"))
    halcmd("setp", "panel.speed", 2.5)
    panel.says("speed 2.5")
    halcmd("setp", "panel.count", 12)
    panel.says("count 12")
    machine.becomes("panel.link-ok", True)
    # another one, with the same component
    other = Panel(machine)
    other.says("connected True")
    for line in ("start True", "count 12", "speed 2.5"):
        other.says(line)
    machine.becomes("panel.clients", 2)
    # and one that thinks it is another component
    wrong = Panel(machine, changed="mask")
    wrong.says("state error")
    assert "pin panel.mask is u32 and OUT here, and u32 and IN in the request" in wrong.said(), wrong.said()
    for each in (panel, other, wrong):
        each.close()
    machine.becomes("panel.start", False)


def it_survives_the_proxy(machine):
    proxy = machine.proxy(CONFIG)
    panel = Panel(machine)
    panel.says("connected True")
    panel.put("start", 1)
    panel.put("mask", 3)
    machine.becomes("panel.mask", 3)
    pid, before = proxy.pid, len(panel.said())
    os.kill(pid, signal.SIGKILL)
    panel.says("start False", before)
    machine.becomes("panel.bound", True)
    # a setting that may be old is not obeyed, and shown as what is the case
    def obeyed():
        panel.put("mask", 7)
        time.sleep(0.3)
        panel.put("mask", 8)
        time.sleep(0.3)
        return machine.get("panel.mask") == 8
    wait("its settings count", obeyed)
    assert "state error" not in panel.said() and "connected False" not in panel.said()[before:], panel.said()
    panel.close()


def the_example_of_the_page(machine):
    page = (rig.ROOT / "docs/remote.md").read_text(encoding="utf-8")
    program = re.search(r"^```python\n(.*?)^```$", page, re.M | re.S)[1]
    machine.proxy(re.search(r"^```\n(\[pin .*?)^```$", page, re.M | re.S)[1])
    log = pathlib.Path(machine.folder.name, "example.log")
    with open(log, "wb") as out:
        child = subprocess.Popen([os.environ["POKEYS_PANEL_PYTHON"], "-u", "-c", program], stdout=out, stderr=out)
    try:
        wait("the button is pressed", lambda: "panel" in rig.listed() and machine.get("panel.start"))
        halcmd("setp", "panel.lamp", 1)
        wait("the lamp is on", lambda: "lamp True" in log.read_text(encoding="utf-8"))
    finally:
        child.kill()
        child.wait()
    machine.becomes("panel.start", False)


def it_finds_what_is_announced(machine):
    """Over mDNS, in a network that has nothing but this computer."""
    try:
        import zeroconf  # noqa: F401
    except ImportError as error:
        print(f"not tried: it_finds_what_is_announced: {error} (Debian: python3-zeroconf)")
        return
    folder = pathlib.Path(machine.folder.name)
    (folder / "clients").mkdir()
    subprocess.run(["/usr/bin/python3", "-B", sys.argv[1], "--make-key", folder / "proxy"], check=True, capture_output=True)
    log = folder / "discovery.log"
    with open(log, "wb") as out:
        child = subprocess.Popen([os.environ["POKEYS_PANEL_PYTHON"], "-c", DISCOVERER], stdout=out, stderr=out)
    try:
        proxy = machine.proxy("[secure]\ncommand = 127.0.0.1:7202\nupdate = 127.0.0.1:7201\ngroup = 127.0.0.1:7200\n"
                              "key = proxy.key_secret\nclients = clients\nannounce = yes\n[group dro]\nsignals = x\n")
        there = "tcp://127.0.0.1:7202 tcp://127.0.0.1:7201 tcp://127.0.0.1:7200 1\n"
        wait("it is found", lambda: there in log.read_text(encoding="utf-8"))
        # and it is not announced any more when it has ended
        proxy.end()
        wait("it is gone", lambda: log.read_text(encoding="utf-8").endswith("- - - 1\n"))
    finally:
        child.kill()
        child.wait()
    # without the section, nothing is
    machine.proxy()
    machine.client().connect()
    assert (folder / "remote.log").read_text(encoding="utf-8").count("announced") == 1


def it_may_begin_before_linuxcnc(machine):
    panel = Panel(machine)
    time.sleep(0.5)
    machine.proxy(CONFIG)
    panel.says("connected True")
    panel.close()


if rig.INSIDE not in os.environ:
    if sys.version_info >= (3, 12):
        foreign.skip("pymachinetalk 0.13.3 cannot be installed with Python 3.12 or newer")
    os.environ["POKEYS_PANEL_PYTHON"] = str(foreign.environment("pymachinetalk", *STEPS))
rig.main([it_binds_sets_and_sees, it_survives_the_proxy, it_may_begin_before_linuxcnc, it_finds_what_is_announced, the_example_of_the_page])
