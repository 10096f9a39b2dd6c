#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""docs/compatibility.md tells of every choice with its default, and of no other.

usage: compatibility.py LIST-NAMES compatibility.md
"""
import pathlib
import re
import subprocess
import sys

ROW = re.compile(r"^\| `(legacy\.[a-z-]+)` \| (\d)", re.MULTILINE)
LISTED = re.compile(r"^\*(legacy\.[a-z-]+)\* \(param bit RW(?:, default (\d))?", re.MULTILINE)


def main():
    page = pathlib.Path(sys.argv[2]).read_text(encoding="utf-8")
    man = subprocess.run([sys.argv[1], "man", "legacy"], capture_output=True, text=True,
                         check=True).stdout
    told = dict(ROW.findall(page))
    have = {name: default or "0" for name, default in LISTED.findall(man)}
    assert len(have) > 5
    assert told == have, f"the page says {told}\nthe table says {have}"


main()
