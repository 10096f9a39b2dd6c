#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Completion of pokeysctl in bash: it offers what the help lists, and names that exist."""
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

PROGRAM, SCRIPT = sys.argv[1:]

# asked for devices, it knows two, of the daemon in the directory "other" a third one
STAND_IN = f"""#!/bin/sh
[ "$1" != get ] || {{ echo "pin.00.in  0"; echo "cycle      7"; [ "$2" != mill ] || echo "mill.only 1"; exit 2; }}
[ "$1" = devices ] || exec {shlex.quote(os.path.abspath(PROGRAM))} "$@"
echo mill; echo lathe
[ "$3" != other ] || echo gantry
"""


def completed(folder, *words):
    """What is offered for the last word."""
    line = " ".join(shlex.quote(word) for word in words)
    ran = subprocess.run(
        ["bash", "--norc", "-c", f"source {shlex.quote(os.path.abspath(SCRIPT))}; COMP_WORDS=({line}); "
         'COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _pokeysctl; printf "%s\\n" "${COMPREPLY[@]}"'],
        cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    assert (ran.returncode, ran.stderr) == (0, ""), (words, ran)
    return sorted(ran.stdout.split())


def helped(*words):
    return subprocess.run([PROGRAM, *words, "--help"], capture_output=True, text=True, timeout=60,
                          check=True).stdout


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        ctl = str(folder / "pokeysctl")
        pathlib.Path(ctl).write_text(STAND_IN, encoding="utf-8")
        os.chmod(ctl, 0o755)
        (folder / "inner").mkdir()
        (folder / "seen.pcapng").touch()
        files, folders, devices = ["inner", "pokeysctl", "seen.pcapng"], ["inner"], ["lathe", "mill"]

        commands = re.findall(r"^  ([a-z]+)", helped(), re.M)
        assert len(commands) > 9 and completed(folder, ctl, "") == sorted(commands)
        for command in commands:
            options = re.findall(r"^  .{3} (--[a-z-]+)", helped(command), re.M)
            assert len(options) >= 4, (command, options)
            assert completed(folder, ctl, command, "--") == sorted(options), command
        for words, wanted in (
                (["sta"], ["status"]),
                (["-"], ["--help", "--version"]),
                (["status", "--ru"], ["--runtime-directory"]),
                (["status", ""], devices),
                (["status", "mill", "l"], ["lathe"]),
                (["status", "-r", "other", ""], ["gantry", *devices]),
                (["status", "--runtime-directory", "=", "other", "g"], ["gantry"]),
                (["-r", "other", "status", "g"], ["gantry"]),
                (["status", "-r", ""], folders),
                (["config", ""], ["apply", "diff", "save", "show"]),
                (["config", "show", ""], devices),
                (["config", "show", "mill", ""], []),
                (["get", ""], devices),
                (["get", "mill", ""], ["cycle", "mill.only", "pin.00.in"]),
                (["get", "-r", "other", "mill", "cycle", "p"], ["pin.00.in"]),
                (["names", "rtt-"], ["rtt-avg-us", "rtt-jitter-us", "rtt-max-us", "rtt-min-us", "rtt-us"]),
                (["record", ""], sorted(devices + files)),
                (["record", "mill", "se"], ["seen.pcapng"]),
                (["replay", "se"], ["seen.pcapng"]),
                (["doctor", "--config", "se"], ["seen.pcapng"]),
                (["doctor", "--config", "=", "se"], ["seen.pcapng"]),
                (["doctor", "--config", "="], files),
                (["doctor", "--root", ""], folders),
                (["doctor", "--cpu", ""], []),
                (["discover", "--interface", "l"], ["lo"]),
                (["top", "--count", "3", "m"], ["mill"]),
                (["devices", ""], []),
                (["frob", ""], [])):
            offered = completed(folder, ctl, *words)
            if words == ["discover", "--interface", "l"]:
                offered = [nic for nic in offered if nic == "lo"]
            assert offered == wanted, (words, offered, wanted)
    print(f"{len(commands)} commands")


if __name__ == "__main__":
    main()
