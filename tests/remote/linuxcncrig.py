# SPDX-License-Identifier: GPL-2.0-or-later
"""A whole LinuxCNC without a device, for tests: three axes whose feedback is the command, and a proxy.

For main() of rig.py. The screen of this LinuxCNC is a process that does nothing.
"""
import json
import os
import pathlib
import signal
import socket
import subprocess
import sys
import tempfile

import rig
from rig import halcmd, wait

ADDRESS = "\0pokeys-remote/pokeys-remote"
INI = """\
[EMC]
VERSION = 1.1
MACHINE = remote
[DISPLAY]
DISPLAY = {folder}/screen
MAX_FEED_OVERRIDE = 1.5
[TASK]
TASK = milltask
CYCLE_TIME = 0.010
[RS274NGC]
PARAMETER_FILE = parameters
[EMCMOT]
EMCMOT = motmod
COMM_TIMEOUT = 4.0
SERVO_PERIOD = 1000000
[EMCIO]
EMCIO = io
CYCLE_TIME = 0.100
[HAL]
HALFILE = machine.hal
[KINS]
KINEMATICS = trivkins coordinates=xyz
JOINTS = 3
[TRAJ]
COORDINATES = X Y Z
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
MAX_LINEAR_VELOCITY = 50
DEFAULT_LINEAR_VELOCITY = 20
"""
AXIS = """\
[AXIS_{letter}]
MIN_LIMIT = -100
MAX_LIMIT = 100
MAX_VELOCITY = 50
MAX_ACCELERATION = 500
[JOINT_{number}]
TYPE = LINEAR
MIN_LIMIT = -100
MAX_LIMIT = 100
MAX_VELOCITY = 50
MAX_ACCELERATION = 500
FERROR = 90
MIN_FERROR = 90
HOME = 0
HOME_OFFSET = 0
HOME_SEQUENCE = 0
"""
HAL = """\
loadrt [KINS]KINEMATICS
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS
addf motion-command-handler servo-thread
addf motion-controller      servo-thread
net x joint.0.motor-pos-cmd => joint.0.motor-pos-fb
net y joint.1.motor-pos-cmd => joint.1.motor-pos-fb
net z joint.2.motor-pos-cmd => joint.2.motor-pos-fb
net enable iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
net tool-change iocontrol.0.tool-change => iocontrol.0.tool-changed
net tool-prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
loadusr -W pokeys-remote --config remote.conf
"""


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
        files = {"machine.ini": INI.format(folder=self.folder) + "".join(
            AXIS.format(letter=letter, number=number) for number, letter in enumerate("XYZ")),
            "machine.hal": HAL, "remote.conf": "[operate]\nusers = nobody\nmessages = yes\n",
            "screen": f"#!/bin/sh\necho $$ >{self.folder}/screen.pid\nexec sleep 600\n"}
        for name, text in files.items():
            (self.folder / name).write_text(text, encoding="utf-8")
        # LinuxCNC may be another user here
        self.folder.chmod(0o777)
        (self.folder / "screen").chmod(0o755)
        path = f"{pathlib.Path(sys.argv[1]).parent}:{os.environ['PATH']}"
        with open(self.folder / "linuxcnc.log", "wb") as log:
            self.child = subprocess.Popen(["linuxcnc", "-r", self.folder / "machine.ini"], stdout=log, stderr=log,
                                          stdin=subprocess.DEVNULL, cwd=self.folder, env={**os.environ, "PATH": path})
        try:
            self.screen = int(wait("LinuxCNC is there", self._screen))
        except AssertionError as fault:
            raise AssertionError(f"{fault}: {self.said()}") from None

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
