#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Whole LinuxCNC runs on examples/linuxcnc: what a user gets, without a screen.

Simulator, daemon and LinuxCNC (motmod, milltask, io, halui) in namespaces of their
own; machinist.py sits in front of it as the user interface. The example's files
are used as they are but for what `changes` lists.

usage: first_cut.py WORK POKEYS_SHM.so POKEYS_HOMECOMP.so POKEYSD POKEYS-SIM POKEYSCTL
       WORK is one of WORKS below.

POKEYS_CUT_S: most seconds the machine may take (default 280).
"""
import collections
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT / "scripts"), str(ROOT / "tests")]
from rig import ADDRESS, Fault, Rig  # noqa: E402  pylint: disable=wrong-import-position
from safety import UNSAFE  # noqa: E402  pylint: disable=wrong-import-position

DEEDS = 6                   # of harass.py
LIMIT_S = float(os.environ.get("POKEYS_CUT_S", "280"))
# What is recorded of each servo period: pairs of signals of the example.
RECORDED = {
    "mill": [f"{axis}-{what}" for axis in "xyza" for what in ("cmd", "fb")],
    "gantry": [f"{axis}-{what}" for axis in ("x", "y", "y2", "z") for what in ("cmd", "fb")],
    "lathe": ["x-cmd", "x-fb", "z-cmd", "z-fb", "spindle-revs", "spindle-speed"],
    # Z twice: a line has four joints
    "servo-mill": [f"{axis}-{what}" for axis in "xyzz" for what in ("cmd", "fb")],
    "printer-bed": [f"{axis}-{what}" for axis in "xyzz" for what in ("cmd", "fb")],
}
# A machine without realtime and with other tests on it is late by tens of
# milliseconds at times. What is tested is where the machine ends, not when.
LATE = """\
realtime = optional
[device {name}]
heartbeat-timeout-ms = 3000
stale-after-ms = 1500
lost-after-ms = 2500
failsafe-timeout-ms = 5000
"""
# Servo motors are stopped after 0.1 s without a reading, whatever else is allowed.
# A simulator that gets no processor turns its motors by as much at once, so they go slowly.
LATE_SERVOS = {
    "servo-mill.ini": [(re.compile("^MAX_VELOCITY = .*$", re.MULTILINE), "MAX_VELOCITY = 15"),
                       ("SERVO_PERIOD = 1000000\n", "SERVO_PERIOD = 2000000\n"),
                       (re.compile("^HOME_SEARCH_VEL = (-?)15$", re.MULTILINE), r"HOME_SEARCH_VEL = \g<1>5")],
    "pokeysd.conf": [("[daemon]\n", "[daemon]\nperiod-us = 2000\n"),
                     ("failsafe-timeout-ms = 5000\n", "failsafe-timeout-ms = 1000\n"),
                     ("impossible-speed = 600\n", "impossible-speed = 9000\n"),
                     (re.compile("^min-following-error = 0.5$", re.MULTILINE),
                      "min-following-error = 20\nmax-age-ms = 100\nstall-s = 3\nsilent-s = 1\nrunaway-distance = 50"),
                     (re.compile("^max-following-error = 2$", re.MULTILINE), "max-following-error = 40")],
}


def changes(rig):
    """What the example's files say instead: file -> [(its text, ours)]."""
    name = rig.name
    return {
        f"{name}.ini": [
            ("DISPLAY = axis\n", f"DISPLAY = {rig.run}/machinist\n"),
            ("RUNTIME = /run/pokeysd\n", f"RUNTIME = {rig.run}/pokeysd\n"),
            (f"HALFILE = {name}.hal\n", f"HALFILE = {name}.hal\nHALFILE = sampler.hal\n"),
            ("PATIENCE = 0.02\n", "PATIENCE = 1.0\n"),
            # and the feedback may be as old as that
            (re.compile(r"^((MIN_)?FERROR) = .*$", re.MULTILINE), r"\1 = 90"),
        ],
        "pokeysd.conf": [
            ("[daemon]\n", f"[daemon]\nruntime-directory = {rig.run}/pokeysd\n"),
            (f"[device {name}]\n", LATE.format(name=name)),
            ("address = 192.168.1.250\n", f"address = {ADDRESS}\n"),
        ],
    }


# A bed takes minutes to 60 degrees, and a late computer has old readings.
COOL_BED = {"warm-up.ngc": [("Q60", "Q30")],
            "pokeysd.conf": [("max-temperature = 110", "max-age-ms = 2000\nmax-temperature = 110")]}

# Besides: what device-homing.hal says is to be changed.
DEVICE_HOMING = {
    "mill.ini": [("EMCMOT = motmod\n", "EMCMOT = motmod\nHOMEMOD = pokeys_homecomp\n"),
                 ("HALFILE = mill.hal\n", "HALFILE = mill.hal\nHALFILE = device-homing.hal\n")],
    "mill.hal": [("names=canonical", "names=both")],
}


def sampler(name):
    """A HAL file that records these signals while sampler.0.enable is set."""
    return ("loadrt sampler depth=8000 cfg=ffffffff\naddf sampler.0 servo-thread\n"
            "setp sampler.0.enable 0\n" +
            "".join(f"net {signal} sampler.0.pin.{i}\n" for i, signal in enumerate(RECORDED[name])))


# A machine without realtime starves the buffer now and then; the simulated motors lose no step.
NO_STEP_LOST = "setp pokeys.0.engine.dry-loses-position 0\n"
PLAYED = {"pokeysd.conf": [(f"axis.{axis}.mode = position\n", f"axis.{axis}.mode = buffered\n")
                           for axis in range(4)]}
BUFFERED = PLAYED | {"mill.hal": [("setp patience.on-delay", NO_STEP_LOST + "setp patience.on-delay")]}
# Then pos-fb is where an axis is, so it is known how late that is.
WITH_DELAY = {"mill.hal": [(re.compile("^net motion-type.*$", re.MULTILINE), "")]}
# What pendant.hal and device-jog.hal say is to be changed.
PENDANT = {
    "mill.ini": [("HALFILE = mill.hal\n", "HALFILE = mill.hal\nHALFILE = pendant.hal\n"
                                          "HALFILE = device-jog.hal\n")],
    "mill.hal": [(re.compile("^net machine-on.*$", re.MULTILINE), "")],
    "pokeysd.conf": [("digital-inputs = 4  ", "digital-inputs = 4, 6  "),
                     ("axes = 4\n", "axes = 4\nencoder.0.enable = on\nencoder.0.sampling = 4\n"
                                    "encoder.0.pins = 1, 2\naxis.0.mpg-encoder = 0\n"
                                    "axis.0.mpg-multiplier = 4\naxis.0.mpg-divider = 1\n")],
}
# What one-switch.hal says is to be changed.
ONE_SWITCH = {
    "mill.ini": [("HALFILE = mill.hal\n", "HALFILE = mill.hal\nHALFILE = one-switch.hal\n"),
                 (re.compile(r"^\[JOINT_[012]\]$", re.MULTILINE), r"\g<0>\nHOME_IGNORE_LIMITS = YES")],
    "pokeysd.conf": [(f"axis.{axis}.limit-{end} = on\n", f"axis.{axis}.limit-{end} = off\n")
                     for axis, end in ((0, "minus"), (1, "minus"), (2, "plus"))],
}
# The same for homing by the device.
SHARED = {
    "pokeysd.conf": [(f"axis.{axis}.limit-{end} = on\n",
                      f"axis.{axis}.limit-{end} = on\naxis.{axis}.home-shared = limit-{end}\n")
                     for axis, end in ((0, "minus"), (1, "minus"), (2, "plus"))],
}
# What device-thread.hal says is to be changed.
THREAD = {
    "lathe.hal": [("setp patience.on-delay", NO_STEP_LOST + "setp patience.on-delay")],
    "lathe.ini": [("HALFILE = lathe.hal\n", "HALFILE = lathe.hal\nHALFILE = device-thread.hal\n"),
                  ("HALFILE = sampler.hal\n", "HALFILE = sampler.hal\nHALFILE = error.hal\n")],
    "pokeysd.conf": [(f"axis.{axis}.mode = position\n", f"axis.{axis}.mode = buffered\n") for axis in range(2)] +
                    [("axes = 2 ", "threading-mode = encoder\nthreading-ticks = 4096\nthreading-rpm = 320\n"
                                   "threading-speed-gain = 200\nthreading-position-gain = 100\naxes = 2 ")],
}


def first_cut_settings(name, patience):
    """What docs/first-cut.md says for a computer without a realtime kernel, and a patience."""
    return {
        f"{name}.ini": [("PATIENCE = 1.0\n", f"PATIENCE = {patience}\n")],
        "pokeysd.conf": [("heartbeat-timeout-ms = 3000\nstale-after-ms = 1500\nlost-after-ms = 2500\n",
                          "heartbeat-timeout-ms = 1000\nstale-after-ms = 100\nlost-after-ms = 2000\n")],
    }


def both(first, then):
    """Changes, and more of them."""
    return {name: first.get(name, []) + then.get(name, []) for name in first | then}


# Nothing but the example's own net unhomes a joint then.
BY_PIN = {"mill.ini": [(re.compile("^VOLATILE_HOME = 1$", re.MULTILINE), "VOLATILE_HOME = 0")]}
# Where Z really is, beside the rest: LinuxCNC is told its own command then.
ERROR = "net z-apart pokeys.0.joint.01.following-error => sampler.0.pin.6\n"
# On which machine, what is changed besides, what is asked of the simulator, and what the
# machinist is to do.
WORKS = {
    "first_cut": ("mill", {}, (), "first_cut"),
    "buffered": ("mill", both(BUFFERED, WITH_DELAY), ("--count-free",), "first_cut"),
    # the programme alone: short enough to be run for each change
    "buffered_lossy": ("mill", BUFFERED, ("--count-free",), "lossy_cut"),
    # what each wire does to the path, in each mode
    "wires": ("mill", {}, (), "wires"),
    "wires_buffered": ("mill", both(BUFFERED, WITH_DELAY), ("--count-free",), "wires"),
    # its delay, and what LinuxCNC sees of it
    "undelayed": ("mill", both(BUFFERED, WITH_DELAY), ("--count-free",), "undelayed"),
    # its status does not tell how full the buffer is: positions have to
    "buffered_untold": ("mill", both(BUFFERED, WITH_DELAY), (), "first_cut"),
    "device_homing": ("mill", DEVICE_HOMING, (), "device_homing"),
    "one_switch": ("mill", ONE_SWITCH, (), "one_switch"),
    "one_switch_device_homing": ("mill", both(DEVICE_HOMING, SHARED), (), "one_switch_device_homing"),
    "jogging": ("mill", PENDANT, (), "jogging"),
    "gantry": ("gantry", {}, (), "gantry"),
    "lathe": ("lathe", {}, (), "lathe"),
    "printer_bed": ("printer-bed", COOL_BED, (), "printer_bed"),
    "servo_mill": ("servo-mill", LATE_SERVOS, (), "servo_mill"),
    "device_thread": ("lathe", THREAD, ("--count-free",), "device_thread"),
    # the same, and a gateway is stopped, killed and flooded beside it
    "gateway": ("mill", {}, (), "first_cut"),
    "restarts": ("mill", first_cut_settings("mill", 0.2), (), "restarts"),
    "restarts_soon": ("mill", first_cut_settings("mill", 0.02), (), "restarts"),
    "restarts_by_pin": ("mill", both(BY_PIN, first_cut_settings("mill", 0.2)), (), "restarts"),
    "restarts_device_homing": ("mill", both(DEVICE_HOMING, first_cut_settings("mill", 0.2)), (), "restarts"),
    "restarts_gantry": ("gantry", first_cut_settings("gantry", 0.2), (), "restarts"),
    "restarts_lathe": ("lathe", first_cut_settings("lathe", 0.2), (), "restarts"),
    "restarts_printer_bed": ("printer-bed", both(COOL_BED, first_cut_settings("printer-bed", 0.2)), (), "restarts"),
    "restarts_by_pin_soon": ("mill", both(BY_PIN, first_cut_settings("mill", 0.02)), (), "restarts"),
    "restarts_device_homing_soon": ("mill", both(DEVICE_HOMING, first_cut_settings("mill", 0.02)), (), "restarts"),
    "restarts_gantry_soon": ("gantry", first_cut_settings("gantry", 0.02), (), "restarts"),
    "losses": ("mill", first_cut_settings("mill", 0.2), (), "losses"),
    "losses_by_pin": ("mill", both(BY_PIN, first_cut_settings("mill", 0.02)), (), "losses"),
    "losses_gantry": ("gantry", first_cut_settings("gantry", 0.2), (), "losses"),
    "losses_lathe": ("lathe", first_cut_settings("lathe", 0.2), (), "losses"),
    "dry": ("mill", both(PLAYED, first_cut_settings("mill", 0.2)), ("--count-free",), "dry"),
    "dry_untold": ("mill", both(PLAYED, first_cut_settings("mill", 0.2)), (), "dry"),
    "dry_by_pin": ("mill", both(both(BY_PIN, PLAYED), first_cut_settings("mill", 0.2)), ("--count-free",), "dry"),
    "restarts_lathe_soon": ("lathe", first_cut_settings("lathe", 0.02), (), "restarts"),
}


# A monitor in Python, beside it all the time: whatever changes, and whether the machine was on then.
WATCH = """
import asyncio, json, sys
sys.path.insert(0, sys.argv[1])
import pokeys

async def watch():
    with pokeys.attach(sys.argv[3], runtime=sys.argv[2]) as device:
        async for state in device.changes("joint.*.counts", "machine-on-permitted", rate=50):
            print(json.dumps([state.machine_on_permitted, [joint.counts for joint in state.joint]]), flush=True)

asyncio.run(watch())
"""


class Machine(Rig):
    """Rig's folder with the example in it."""

    def __init__(self, work, pokeysd, sim, pokeysctl):
        self.name, more, self.sim_options, self.work = WORKS[work]
        self.harassed, self.has_axes = work == "gateway", self.name != "servo-mill"
        super().__init__(pokeysctl.parents[1], self.name)
        self.pokeysd, self.sim = pokeysd, sim
        self.folder = self.run / self.name
        shutil.copytree(ROOT / "examples/linuxcnc" / self.name, self.folder)
        self.change(changes(self))
        self.change(more)
        (self.folder / "sampler.hal").write_text(sampler(self.name), encoding="utf-8")
        (self.folder / "error.hal").write_text(ERROR, encoding="utf-8")
        panel = self.run / "machinist"
        panel.write_text(f'#!/bin/sh\nexec /usr/bin/python3 -B {HERE}/machinist.py "$@"\n', encoding="utf-8")
        panel.chmod(0o755)
        for path in [self.folder, *self.folder.iterdir()]:
            path.chmod(0o777 if path.is_dir() else 0o666)  # LinuxCNC may be another user here

    def change(self, files):
        for name, words in files.items():
            text = (self.folder / name).read_text(encoding="utf-8")
            for old, new in words:
                old = old if isinstance(old, re.Pattern) else re.compile(re.escape(old))
                text, count = old.subn(new, text)
                if not count:
                    raise Fault(f"{self.name}/{name} has no {old.pattern!r}: mend this test")
            (self.folder / name).write_text(text, encoding="utf-8")

    def start(self):
        control = self.run / "sim.sock"
        self.spawn("pokeys-sim", self.sim, "--model", "57CNC", "--address", ADDRESS, "--no-discovery",
                   "--control", control, "--script", self.folder / "bench.sim", "--service-us", 100,
                   *self.sim_options)
        self.wait_for("the simulator's control socket", control.exists, 60, "pokeys-sim")
        self.spawn("pokeysd", self.pokeysd, "--config", self.folder / "pokeysd.conf")
        self.wait_for("the daemon's shared memory", (self.run / "pokeysd/current").exists, 60, "pokeysd")
        self.wait_for("the device running", self.is_fresh, 60, "pokeysd")
        os.environ["POKEYS_SHM_LIBRARY"] = str(self.build / "shm/libpokeys_shm.so.0")
        if self.has_axes:
            self.spawn("monitor", "/usr/bin/python3", "-B", "-c", WATCH, ROOT / "python", self.run / "pokeysd", self.name)
        if self.harassed:
            self.spawn("harass", "/usr/bin/python3", "-B", HERE / "harass.py", self.build, self.run / "pokeysd", 8580)

    def judge_gateway(self):
        """All of it was done to the gateway, several times, while the machine moved."""
        if self.started["harass"].poll() is not None:
            raise Fault(f"the gateway was not as it should be: {self.text('harass.log')[-3000:]}")
        deeds = collections.Counter(line.split()[1] for line in self.text("harass.log").splitlines()
                                    if line.startswith("deed "))
        if len(deeds) < DEEDS or min(deeds.values()) < 3:
            raise Fault(f"too little was done to the gateway: {dict(deeds)}")
        print(f"done to the gateway: {dict(deeds)}")

    def judge_monitor(self):
        """What the monitor in Python has seen is what happened."""
        if self.started["monitor"].poll() is not None:
            raise Fault(f"the monitor in Python has ended: {self.log_tail('monitor')}")
        counts = json.loads(self.get("joint.*.counts"))["values"]
        self.wait_for("what the device has, in the monitor in Python",
                      lambda: self.seen()[-1][1] == list(counts.values()), 60, "monitor")
        # a lathe has two axes
        moved = [len({positions[i] for on, positions in self.seen() if on}) for i in range(2)]
        if min(moved) < 3:
            raise Fault(f"the monitor in Python has seen {moved} positions of the first two axes")
        print(f"the monitor in Python has seen {len(self.seen())} changes")

    def seen(self):
        """A line that is being written is not one yet."""
        return [json.loads(line) for line in self.text("monitor.log").splitlines(True) if line.endswith("\n")]

    def get(self, *names):
        return subprocess.run((self.build / "tools/pokeysctl", "-r", self.run / "pokeysd", "get", self.name, *names,
                               "--json"), capture_output=True, text=True, check=False).stdout

    def cut(self):
        """LinuxCNC with the machinist; their status."""
        env = os.environ | {"MACHINIST_SIM": f"{self.sim} --ctl {self.run}/sim.sock",
                            "MACHINIST_FOLDER": str(self.folder), "MACHINIST_WORK": self.work,
                            "MACHINIST_DEVICE": ADDRESS}
        with open(self.run / "linuxcnc.log", "wb") as log:
            child = subprocess.Popen(("linuxcnc", "-r", self.folder / f"{self.name}.ini"), stdout=log, stderr=log,
                                     stdin=subprocess.DEVNULL, env=env, cwd=self.folder)
            try:
                return child.wait(LIMIT_S)
            except subprocess.TimeoutExpired:
                child.kill()
                return f"not done within {LIMIT_S} s"

    def text(self, name):
        return (self.run / name).read_text(errors="replace") if (self.run / name).exists() else ""


def inside(work, programs):
    machine = Machine(work, *programs)
    try:
        machine.start()
        status = machine.cut()
        print(machine.text("report"), end="")
        if status == 0 and "the end\n" in machine.text("report"):
            if machine.has_axes:
                machine.judge_monitor()
            if machine.harassed:
                machine.judge_gateway()
            return 0
        print(f"FAILED: {status}\n{machine.text('linuxcnc.log')[-6000:]}\n"
              f"{machine.text('pokeysd.log')[-2000:]}")
        if f"status {UNSAFE}\n" in machine.text("report"):
            return UNSAFE
    except Fault as fault:
        print(f"FAILED: {fault}")
    finally:
        machine.close()
    return 1


def main():
    if sys.argv[1] == "--inside":
        return inside(sys.argv[2], [pathlib.Path(word) for word in sys.argv[3:]])
    if sys.argv[1] == "gateway" and subprocess.run(["/usr/bin/python3", "-c", "import aiohttp, prometheus_client"],
                                                   capture_output=True, check=False).returncode:
        print("not tried: python3-aiohttp or python3-prometheus-client is not installed", file=sys.stderr)
        return 77
    work, (module, homecomp, *programs) = sys.argv[1], (pathlib.Path(w).resolve() for w in sys.argv[2:])
    os.execv(ROOT / "scripts/hal-isolated",
             ["hal-isolated", "--module", str(module), "--module", str(homecomp), "--network",
              *(word for path in programs for word in ("--keep", str(path.parent))),
              "/usr/bin/python3", "-B", __file__, "--inside", work, *map(str, programs)])
    return 1


if __name__ == "__main__":
    sys.exit(main())
