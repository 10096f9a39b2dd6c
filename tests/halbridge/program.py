#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The userspace component asked by a person at a terminal, where there is no HAL.
What it prints of itself is on standard output and its status is 0."""
import subprocess
import sys

PROGRAM, VERSION = sys.argv[1:]


def ask(*words):
    out = subprocess.run([PROGRAM, *words], capture_output=True, text=True, timeout=60, check=False)
    return out.returncode, out.stdout, out.stderr


def main():
    asked = ask("--version")
    assert asked == (0, f"pokeys {VERSION}\n", ""), asked
    for word in ("--help", "-h"):
        status, said, error = ask(word)
        assert (status, error) == (0, ""), (status, error)
        for option in ("count=", "names=", "runtime=", "loops=", "--help", "--version"):
            assert option in said, (option, said)
    for words in (("--nonsense",), ("count=0",), ("--help", "count=0")):
        status, said, error = ask(*words)
        assert status == 64 and not said and len(error.splitlines()) == 1, (words, status, said, error)


if __name__ == "__main__":
    main()
