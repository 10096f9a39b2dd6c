#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A whole LinuxCNC run on examples/linuxcnc/mill: what a user gets, without a screen.

Simulator, daemon and LinuxCNC (motmod, milltask, io, halui) in namespaces of their
own; machinist.py sits in front of it as the user interface. The example's files
are used as they are but for what `changes` lists.

usage: first_cut.py first_cut|buffered|buffered_untold|device_homing POKEYS_SHM.so POKEYS_HOMECOMP.so POKEYSD POKEYS-SIM
                    POKEYSCTL

POKEYS_CUT_S: most seconds the machine may take (default 240).
"""
import os
import pathlib
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT / "scripts"))
from rig import ADDRESS, Fault, Rig  # pylint: disable=wrong-import-position

EXAMPLE = ROOT / "examples/linuxcnc/mill"
LIMIT_S = float(os.environ.get("POKEYS_CUT_S", "240"))
SAMPLER = """\
loadrt sampler depth=8000 cfg=ffffffff
addf sampler.0 servo-thread
""" + "".join(f"net {axis}-cmd sampler.0.pin.{2 * i}\nnet {axis}-fb sampler.0.pin.{2 * i + 1}\n"
              for i, axis in enumerate("xyza"))
# A machine without realtime and with other tests on it is late by tens of
# milliseconds at times. What is tested is where the machine ends, not when.
LATE = """\
realtime = optional
[device mill]
heartbeat-timeout-ms = 3000
stale-after-ms = 700
lost-after-ms = 1500
failsafe-timeout-ms = 5000
"""


def changes(rig):
    """What the example's files say instead: file -> [(its text, ours)]."""
    return {
        "mill.ini": [
            ("DISPLAY = axis\n", f"DISPLAY = {rig.run}/machinist\n"),
            ("RUNTIME = /run/pokeysd\n", f"RUNTIME = {rig.run}/pokeysd\n"),
            ("HALFILE = mill.hal\n", "HALFILE = mill.hal\nHALFILE = sampler.hal\n"),
            ("PATIENCE = 0.02\n", "PATIENCE = 0.7\n"),
            # and the feedback may be as old as that
            ("FERROR = 2\nMIN_FERROR = 0.5\n", "FERROR = 60\nMIN_FERROR = 60\n"),
            ("FERROR = 5\nMIN_FERROR = 1\n", "FERROR = 90\nMIN_FERROR = 90\n"),
        ],
        "pokeysd.conf": [
            ("[daemon]\n", f"[daemon]\nruntime-directory = {rig.run}/pokeysd\n"),
            ("[device mill]\n", LATE),
            ("address = 192.168.1.250\n", f"address = {ADDRESS}\n"),
        ],
    }


# Besides: what device-homing.hal says is to be changed.
DEVICE_HOMING = {
    "mill.ini": [("EMCMOT = motmod\n", "EMCMOT = motmod\nHOMEMOD = pokeys_homecomp\n"),
                 ("HALFILE = mill.hal\n", "HALFILE = mill.hal\nHALFILE = device-homing.hal\n")],
    "mill.hal": [("names=canonical", "names=both")],
}


BUFFERED = {
    "pokeysd.conf": [(f"axis.{axis}.mode = position\n", f"axis.{axis}.mode = buffered\n")
                     for axis in range(4)],
}
# What each kind of work changes besides, what it asks of the simulator, and what the
# machinist is to do.
WORKS = {
    "first_cut": ({}, (), "first_cut"),
    "buffered": (BUFFERED, ("--count-free",), "first_cut"),
    # its status does not tell how full the buffer is: positions have to
    "buffered_untold": (BUFFERED, (), "first_cut"),
    "device_homing": (DEVICE_HOMING, (), "device_homing"),
}


class Mill(Rig):
    """Rig's folder with the example in it."""

    def __init__(self, work, pokeysd, sim, pokeysctl):
        super().__init__(pokeysctl.parents[1], "mill")
        self.work, self.pokeysd, self.sim = work, pokeysd, sim
        self.mill = self.run / "mill"
        shutil.copytree(EXAMPLE, self.mill)
        self.change(changes(self))
        self.change(WORKS[work][0])
        (self.mill / "sampler.hal").write_text(SAMPLER, encoding="utf-8")
        panel = self.run / "machinist"
        panel.write_text(f'#!/bin/sh\nexec /usr/bin/python3 -B {HERE}/machinist.py "$@"\n', encoding="utf-8")
        panel.chmod(0o755)
        for path in [self.mill, *self.mill.iterdir()]:
            path.chmod(0o777 if path.is_dir() else 0o666)  # LinuxCNC may be another user here

    def change(self, files):
        for name, words in files.items():
            text = (self.mill / name).read_text(encoding="utf-8")
            for old, new in words:
                if old not in text:
                    raise Fault(f"examples/linuxcnc/mill/{name} has no {old!r}: mend this test")
                text = text.replace(old, new)
            (self.mill / name).write_text(text, encoding="utf-8")

    def start(self):
        control = self.run / "sim.sock"
        self.spawn("pokeys-sim", self.sim, "--model", "57CNC", "--address", ADDRESS, "--no-discovery",
                   "--control", control, "--script", self.mill / "bench.sim", "--service-us", 100,
                   *WORKS[self.work][1])
        self.wait_for("the simulator's control socket", control.exists, 10, "pokeys-sim")
        self.spawn("pokeysd", self.pokeysd, "--config", self.mill / "pokeysd.conf")
        self.wait_for("the daemon's shared memory", (self.run / "pokeysd/current").exists, 20, "pokeysd")
        self.wait_for("the device running", lambda: self.status()["fresh"], 20, "pokeysd")

    def cut(self):
        """LinuxCNC with the machinist; their status."""
        env = os.environ | {"MACHINIST_SIM": f"{self.sim} --ctl {self.run}/sim.sock",
                            "MACHINIST_MILL": str(self.mill), "MACHINIST_WORK": WORKS[self.work][2]}
        with open(self.run / "linuxcnc.log", "wb") as log:
            child = subprocess.Popen(("linuxcnc", "-r", self.mill / "mill.ini"), stdout=log, stderr=log,
                                     stdin=subprocess.DEVNULL, env=env, cwd=self.mill)
            try:
                return child.wait(LIMIT_S)
            except subprocess.TimeoutExpired:
                child.kill()
                return f"not done within {LIMIT_S} s"

    def text(self, name):
        return (self.run / name).read_text(errors="replace") if (self.run / name).exists() else ""


def inside(work, programs):
    mill = Mill(work, *programs)
    try:
        mill.start()
        status = mill.cut()
        print(mill.text("report"), end="")
        if status == 0 and "the end\n" in mill.text("report"):
            return 0
        print(f"FAILED: {status}\n{mill.text('linuxcnc.log')[-6000:]}\n{mill.text('pokeysd.log')[-2000:]}")
    except Fault as fault:
        print(f"FAILED: {fault}")
    finally:
        mill.close()
    return 1


def main():
    if sys.argv[1] == "--inside":
        return inside(sys.argv[2], [pathlib.Path(word) for word in sys.argv[3:]])
    work, (module, homecomp, *programs) = sys.argv[1], (pathlib.Path(w).resolve() for w in sys.argv[2:])
    os.execv(ROOT / "scripts/hal-isolated",
             ["hal-isolated", "--module", str(module), "--module", str(homecomp), "--network",
              *(word for path in programs for word in ("--keep", str(path.parent))),
              "/usr/bin/python3", "-B", __file__, "--inside", work, *map(str, programs)])
    return 1


if __name__ == "__main__":
    sys.exit(main())
