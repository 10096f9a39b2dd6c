#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Bad use of pokeysctl: one line that says what, where and what to do, before any work."""
import re
import subprocess
import sys

CASES = (
    ([], 64, "a command is missing; pokeysctl --help lists the commands"),
    (["frob"], 64, 'there is no command "frob"; pokeysctl --help lists the commands'),
    (["top", "--count", "0"], 64, '--count: "0" is not allowed; allowed: 1..1000000000'),
    (["status", "-r", "run"], 1, '--runtime-directory: "run" is not allowed; a path from / is'),
    (["discover", "--interface", "nowhere0"], 1,
     "the network cannot be searched at --interface nowhere0: there is no such interface; .*"),
    (["doctor", "--config", "/nowhere"], 1, "--config: /nowhere: No such file or directory"),
    (["doctor", "--root", "/nowhere", "--config", "/x"], 1, "--config: /nowhere/x: No such .*"),
    (["doctor", "--root", "/nowhere"], 1, "--root: /nowhere: No such file or directory"),
    (["doctor", "--root", sys.argv[1]], 1, "--root: .*: Not a directory"),
    (["latency", "--config", "/nowhere"], 1, "--config: /nowhere: No such file or directory"),
    # 600 s: it is told before anything is measured, or the time limit ends this
    (["latency", "--no-realtime", "--seconds", "600", "--svg", "/nowhere/x.svg"], 1,
     "--svg: /nowhere/x.svg: No such file or directory"),
)


def main():
    for words, status, line in CASES:
        ran = subprocess.run([sys.argv[1], *words], capture_output=True, text=True, timeout=20,
                             check=False)
        assert (ran.returncode, ran.stdout) == (status, ""), (words, ran)
        assert re.fullmatch(f"pokeysctl: {line}\n", ran.stderr), (words, ran.stderr)
    for words in (["--help"], ["--version"], ["doctor"], ["doctor", "--json"]):
        with open("/dev/full", "w", encoding="ascii") as full:
            ran = subprocess.run([sys.argv[1], *words], stdout=full, stderr=subprocess.PIPE,
                                 text=True, timeout=20, check=False)
        told = "pokeysctl: standard output: No space left on device\n"
        assert (ran.returncode, ran.stderr) == (1, told), (words, ran)
    print(f"{len(CASES)} mistakes")


if __name__ == "__main__":
    main()
