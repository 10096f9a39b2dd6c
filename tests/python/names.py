#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""python/pokeys/_names.py is what generate.py makes of the names that there are now."""
import pathlib
import subprocess
import sys

GENERATE, NAMES = pathlib.Path(sys.argv[1]), sys.argv[2]


def main():
    wanted = subprocess.run([sys.executable, GENERATE, NAMES], capture_output=True, text=True, check=True).stdout
    there = (GENERATE.parent / "pokeys" / "_names.py").read_text(encoding="utf-8")
    if there == wanted:
        return 0
    print("python/pokeys/_names.py is of other names; make it again: "
          "python3 python/generate.py build/tools/names.json > python/pokeys/_names.py")
    return 1


if __name__ == "__main__":
    sys.exit(main())
