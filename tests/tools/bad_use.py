#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Bad use of pokeysctl: one line that says what, where and what to do, before any work."""
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

CASES = (
    ([], 64, "a command is missing; pokeysctl --help lists the commands"),
    (["frob"], 64, 'there is no command "frob"; pokeysctl --help lists the commands'),
    (["top", "--count", "0"], 64, '--count: "0" is not allowed; allowed: 1..1000000000'),
    (["status", "-r", "run"], 64, '--runtime-directory: "run" is not allowed; a path from / is'),
    (["discover", "--interface", "nowhere0"], 1,
     "the network cannot be searched at --interface nowhere0: there is no such interface; .*"),
    (["doctor", "--config", "/nowhere"], 1, "--config: /nowhere: No such file or directory"),
    (["doctor", "--root", "/nowhere", "--config", "/x"], 1, "--config: /nowhere/x: No such .*"),
    (["doctor", "--cpu", "1023"], 1, "--cpu 1023: this computer has no such core, or it is offline"),
    (["doctor", "-r", "run"], 64, '--runtime-directory: "run" is not allowed; a path from / is'),
    (["devices", "mill"], 64, "devices takes no argument: mill; see pokeysctl devices --help"),
    (["replay", "--cpu", "1", "x"], 64, "replay takes no such option; see pokeysctl replay --help"),
    (["output", "mill", "31", "up"], 64, "output needs a device, terminals, and on or off: .*"),
    (["output", "mill", "31,", "on"], 64, '"31,": terminals are numbers from 1 to 55, such as .*'),
    (["pwm", "mill", "17"], 64, "pwm needs a device, terminals, and a duty: .*"),
    (["pwm", "mill", "17", "120%"], 64, '"120%": the duty is a percentage from 0 to 100, such as 30%'),
    (["axis", "mill", "0"], 64, "axis needs a device, the number of an axis, and what to do: .*"),
    (["axis", "mill", "0", "home", "1"], 64, "axis needs a device, .*"),
    (["axis", "mill", "8", "home"], 64, '"8": axes are numbered from 0 to 7'),
    (["axis", "mill", "-1", "home"], 64, '"-1": axes are numbered from 0 to 7'),
    (["axis", "mill", "0", "home", "--speed", "5"], 64, "--speed is for move and move-to"),
    (["axis", "mill", "0", "move", "1.5"], 64, '"1.5": pulses are a whole number, such as 1000 or -1000'),
    (["axis", "mill", "0", "move", "1", "--speed", "0"], 64, '--speed: "0" is not allowed; allowed: 0.001..1000000'),
    (["axis", "mill", "0", "move", "1", "--speed", "0.5"], 64, "--speed of an axis is 1 to 1000000 pulses/s"),
    (["output", "mill", "31", "on", "--for", "5s"], 64, '--for: "5s" is not allowed; allowed: 0.1..86400'),
    (["heater", "mill", "bed"], 64, "heater needs a device, a heater, and what to do: .*"),
    (["heater", "mill", "bed", "cool", "20"], 64, "heater needs a device, .*"),
    (["heater", "mill", "bed", "reset", "20"], 64, "heater needs a device, .*"),
    (["heater", "mill", "bed", "heat", "60C"], 64, '"60C": temperatures are numbers from 0 to 2000, in degrees C'),
    (["heater", "mill", "bed", "heat", "-1"], 64, '"-1": temperatures are numbers from 0 to 2000, in degrees C'),
    (["heater", "mill", "bed", "heat", "nan"], 64, '"nan": temperatures are numbers .*'),
    (["heater", "mill", "bed", "tune", "0"], 64, "tune needs the temperature at which the heater will be used"),
    (["heater", "mill", "bed", "tune", "60", "--for", "9"], 64, "--for is for heat"),
    (["heater", "mill", "bed", "gain", "pid-p"], 64, "heater needs a device, .*"),
    (["heater", "mill", "bed", "gain", "velocity-gain", "1"], 64,
     '"velocity-gain": a heater has the gains pid-p, pid-i, pid-d'),
    (["heater", "mill", "bed", "gain", "pid-p", "100001"], 64, '"100001": pid-p is a number from 0 to 100000'),
    (["servo", "mill", "x"], 64, "servo needs a device, a motor, and what to do: .*"),
    (["servo", "mill", "x", "go", "20"], 64, "servo needs a device, .*"),
    (["servo", "mill", "x", "move"], 64, "servo needs a device, .*"),
    (["servo", "mill", "x", "reset", "20"], 64, "servo needs a device, .*"),
    (["servo", "mill", "x", "home", "20"], 64, "servo needs a device, .*"),
    (["servo", "mill", "x", "home", "--speed", "1"], 64, "--speed is for move, move-to and swing"),
    (["servo", "mill", "x", "tune"], 64, "servo needs a device, .*"),
    (["servo", "mill", "x", "tune", "-5"], 64, "tune needs the distance that the motor may move, above 0"),
    (["servo", "mill", "x", "tune", "5", "--speed", "1"], 64, "--speed is for move, move-to and swing"),
    (["servo", "mill", "x", "move", "nan", "--speed", "1"], 64, '"nan": positions are numbers .*'),
    (["servo", "mill", "x", "move", "2e6", "--speed", "1"], 64, '"2e6": positions are numbers .*'),
    (["servo", "mill", "x", "move-to", "-1"], 64, "move-to needs --speed, in units/s"),
    (["servo", "mill", "x", "move", "1", "--speed", "1", "--for", "9"], 64, "--for is for swing"),
    (["servo", "mill", "x", "reset", "--speed", "1"], 64, "--speed is for move, move-to and swing"),
    (["moves", "mill"], 64, "moves needs a device and a file of moves: .*"),
    (["moves", "mill", "a", "b"], 64, "moves needs a device and a file of moves: .*"),
    (["moves", "mill", "/nowhere/at all"], 1, "/nowhere/at all: No such file or directory"),
    (["moves", "mill", "/"], 1, "/: .*"),
    (["servo", "mill", "x", "gain", "p", "1"], 64,
     '"p": a servo has the gains pid-p, pid-i, pid-d, velocity-gain, acceleration-gain'),
    (["servo", "mill", "x", "gain", "pid-d", "1e-3x"], 64, '"1e-3x": pid-d is a number from 0 to 1000000'),
    (["get"], 64, "get: no device given; usage: .*"),
    (["get", "mill", "pin.99.in"], 64, 'get: no value is named "pin.99.in"; "pokeysctl names" lists the names'),
    (["get", "mill", "pokeys.0.cycle"], 64, 'get: write "pokeys.0.cycle" without "pokeys.0."'),
    (["get", "mill", "joint.00.pos-fb"], 64, 'get: "joint.00.pos-fb" exists only in LinuxCNC '
     r"\(halcmd getp pokeys.N.joint.00.pos-fb\); the device's own value is joint.00.counts"),
    (["get", "mill", "pin.03.out"], 64, 'get: "pin.03.out" can be commanded, but not read'),
    (["names", "no-*"], 64, 'names: no value is named "no-\\*"; "pokeysctl names" lists the names'),
    (["config", "frob", "mill"], 64, "config needs a verb and one device: pokeysctl config show .*"),
    (["record", "-r", "/nowhere", "x"], 1, "no recorder in /nowhere: no daemon runs there .* is on a disk, or .*"),
    (["record", "-r", "run", "/nowhere/x"], 64, '--runtime-directory: "run" is not allowed; .*'),
    (["doctor", "--config", "/"], 1, "--config: /: Is a directory"),
    (["doctor", "--cpu", "1.5"], 64, '--cpu: "1.5" is not allowed; allowed: 0..1023'),
    (["top", "--count", "0x1p-1"], 64, '--count: "0x1p-1" is not allowed; .*'),
    (["trace", "--slowest", "2.5"], 64, '--slowest: "2.5" is not allowed; allowed: 0..100'),
    (["doctor", "--root", "/nowhere"], 1, "--root: /nowhere: No such file or directory"),
    (["doctor", "--root", sys.argv[1]], 1, "--root: .*: Not a directory"),
    (["latency", "--config", "/nowhere"], 1, "--config: /nowhere: No such file or directory"),
    # 600 s: it is told before anything is measured, or the time limit ends this
    (["latency", "--no-realtime", "--seconds", "600", "--svg", "/nowhere/x.svg"], 1,
     "--svg: /nowhere/x.svg: No such file or directory"),
)


def main():
    for words, status, line in CASES:
        ran = subprocess.run([sys.argv[1], *words], capture_output=True, text=True, timeout=120,
                             check=False)
        assert (ran.returncode, ran.stdout) == (status, ""), (words, ran)
        assert re.fullmatch(f"pokeysctl: {line}\n", ran.stderr), (words, ran.stderr)
    with tempfile.TemporaryDirectory() as folder:
        for path, kept in (pathlib.Path(folder, "old.svg"), "old"), (pathlib.Path(folder, "new.svg"), None):
            if kept:
                path.write_text(kept, encoding="ascii")
            ran = subprocess.run([sys.argv[1], "latency", "--no-realtime", "--cpu", "1000", "--seconds", "600",
                                  "-r", folder, "--svg", path], capture_output=True, text=True, timeout=120,
                                 check=False)
            assert ran.returncode == 1 and "core 1000 is not there" in ran.stderr, ran
            assert (path.read_text(encoding="ascii") if path.exists() else None) == kept, (path, kept)
    for words in (["--help"], ["--version"], ["doctor"], ["doctor", "--json"]):
        with open("/dev/full", "w", encoding="ascii") as full:
            ran = subprocess.run([sys.argv[1], *words], stdout=full, stderr=subprocess.PIPE,
                                 text=True, timeout=120, check=False)
        told = "pokeysctl: standard output: No space left on device\n"
        assert (ran.returncode, ran.stderr) == (1, told), (words, ran)
    # who left has seen enough
    ends, to = os.pipe()
    os.close(ends)
    ran = subprocess.run([sys.argv[1], "doctor"], stdout=to, stderr=subprocess.PIPE, timeout=120, check=False,
                         preexec_fn=lambda: signal.signal(signal.SIGPIPE, signal.SIG_IGN))
    os.close(to)
    assert (ran.returncode, ran.stderr) == (1, b""), ran
    print(f"{len(CASES)} mistakes")


if __name__ == "__main__":
    main()
