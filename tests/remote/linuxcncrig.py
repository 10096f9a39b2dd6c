# SPDX-License-Identifier: GPL-2.0-or-later
"""A whole LinuxCNC without a device, for tests: that of examples/linuxcnc/remote-panel.

For main() of rig.py. The screen of this LinuxCNC is a process that does nothing.
"""
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

import rig
from rig import halcmd, wait

EXAMPLE = rig.ROOT / "examples/linuxcnc/remote-panel"
ADDRESS = "\0pokeys-remote/pokeys-remote"


class Control:
    """A connection to the control socket."""

    def __init__(self):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.settimeout(rig.PATIENCE)
        self.socket.connect(ADDRESS)
        self.number, self.state, self.said, self.answers, self.done = 0, {}, [], {}, {}
        self._read = b""

    def send(self, method, **params):
        self.number += 1
        self.socket.sendall(json.dumps({"jsonrpc": "2.0", "id": self.number, "method": f"linuxcnc.{method}",
                                        "params": params}).encode() + b"\n")
        return self.number

    def hear(self):
        """The next message."""
        while b"\n" not in self._read:
            data = self.socket.recv(65536)
            assert data, "the proxy closed the connection"
            self._read += data
        line, self._read = self._read.split(b"\n", 1)
        said = json.loads(line)
        if "method" not in said:
            self.answers[said["id"]] = said.get("error", {}).get("message")
        elif said["method"] == "linuxcnc.done":
            self.done[said["params"]["id"]] = said["params"]["error"]
        elif said["method"] == "linuxcnc.state":
            if said["params"].get("connected") is not None:
                self.state = {}
            self.state.update(said["params"])
        else:
            self.said.append(said["params"])

    def asked(self, method, **params):
        """Queued: None, or why it is not."""
        number = self.send(method, **params)
        while number not in self.answers:
            self.hear()
        return self.answers[number]

    def do(self, method, **params):
        """Done: None, or why it is not."""
        fault = self.asked(method, **params)
        while not fault and self.number not in self.done:
            self.hear()
        return fault or self.done[self.number]

    def fine(self, method, **params):
        fault = self.do(method, **params)
        assert fault is None, fault

    def until(self, test):
        """The state when it is so."""
        while not test(self.state):
            self.hear()
        return self.state

    def close(self):
        self.socket.close()


class LinuxCNC:
    """It, with files in a folder; for main() of rig.py."""

    def __init__(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="pokeys-remote-")
        self.folder = pathlib.Path(self.temporary.name)
        self.controls = []
        shutil.copytree(EXAMPLE, self.folder, dirs_exist_ok=True)
        self._change("remote-panel.ini", "DISPLAY = axis", f"DISPLAY = {self.folder}/screen")
        self._change("remote-panel.conf", "[remote]\ncreate = no", "[operate]\nusers = nobody\nmessages = yes")
        (self.folder / "screen").write_text(f"#!/bin/sh\necho $$ >{self.folder}/screen.pid\nexec sleep 600\n",
                                            encoding="ascii")
        # LinuxCNC may be another user here
        for path in (self.folder, *self.folder.iterdir()):
            path.chmod(0o777)
        path = f"{pathlib.Path(sys.argv[1]).parent}:{os.environ['PATH']}"
        with open(self.folder / "linuxcnc.log", "wb") as log:
            self.child = subprocess.Popen(["linuxcnc", "-r", self.folder / "remote-panel.ini"], stdout=log, stderr=log,
                                          stdin=subprocess.DEVNULL, cwd=self.folder, env={**os.environ, "PATH": path})
        try:
            self.screen = int(wait("LinuxCNC is there", self._screen))
        except AssertionError as fault:
            raise AssertionError(f"{fault}: {self.said()}") from None

    def _change(self, name, old, new):
        path = self.folder / name
        text = path.read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{path.name} of the example has no {old!r}: mend this test"
        path.write_text(text.replace(old, new), encoding="utf-8")

    def _screen(self):
        assert self.child.poll() is None, "LinuxCNC has ended"
        path = self.folder / "screen.pid"
        return path.read_text(encoding="ascii").strip() if path.exists() else None

    def control(self):
        self.controls.append(Control())
        return self.controls[-1]

    def said(self):
        return (self.folder / "linuxcnc.log").read_text(encoding="utf-8", errors="replace")[-3000:]

    def close(self):
        """As its screen would end it."""
        for one in self.controls:
            one.close()
        os.kill(self.screen, signal.SIGTERM)
        self.child.wait(rig.PATIENCE)
        self.temporary.cleanup()


def position(axis):
    return float(halcmd("getp", f"joint.{axis}.motor-pos-cmd"))


def the_screen():
    import linuxcnc
    return linuxcnc.command()


def switch_on(one):
    """As the machinist does it, at the screen."""
    import linuxcnc
    for state, name in ((linuxcnc.STATE_ESTOP_RESET, "off"), (linuxcnc.STATE_ON, "on")):
        the_screen().state(state)
        one.until(lambda seen, name=name: seen.get("task") == name)


def stands(number):
    """It comes to a stop, and does not go on. A thread that gets no processor moves nothing either, so what
    counts is that it is commanded to stand."""
    def still():
        before = position(number)
        time.sleep(0.2)
        return float(halcmd("getp", f"joint.{number}.vel-cmd")) == 0 and position(number) == before
    wait(f"joint {number} stands", still)
    before = position(number)
    time.sleep(0.5)
    assert position(number) == before
    return before
