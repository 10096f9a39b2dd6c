#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""No two rooms define a function of the same name: a program that links both would call one of them for the
other, without a word.

usage: check_symbols.py NM LIBRARY.a ...
"""
import collections
import subprocess
import sys


def main():
    rooms = collections.defaultdict(set)
    for library in sys.argv[2:]:
        listed = subprocess.run((sys.argv[1], "--defined-only", "--extern-only", "--format=posix", library),
                                capture_output=True, text=True, check=True).stdout
        for line in listed.splitlines():
            words = line.split()
            if len(words) > 1 and words[1] in "TDRB":
                rooms[words[0]].add(library)
    assert len(rooms) > 500, f"only {len(rooms)} names in {sys.argv[2:]}"
    faults = [f"{name} is defined in {', '.join(sorted(where))}" for name, where in rooms.items() if len(where) > 1]
    print("\n".join(faults) or f"{len(rooms)} names, each in one room")
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
