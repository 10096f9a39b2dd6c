#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The man page's list of pins and parameters is the table's.

usage: man_page.py LIST-NAMES PAGE.scd [--update]
"""
import pathlib
import subprocess
import sys

BEGIN, END = "; the table begins\n", "; the table ends\n"


def main():
    page = pathlib.Path(sys.argv[2])
    text = page.read_text(encoding="utf-8")
    table = subprocess.run([sys.argv[1], "man", "canonical"], capture_output=True, text=True, check=True).stdout
    before, rest = text.split(BEGIN)
    have, after = rest.split(END)
    if sys.argv[3:] == ["--update"]:
        page.write_text(before + BEGIN + table + END + after, encoding="utf-8")
        return 0
    if have == table:
        return 0
    for old, new in zip(have.splitlines(), table.splitlines()):
        if old != new:
            print(f"the page says:  {old}\nthe table says: {new}")
            break
    print("run man_page.py with --update")
    return 1


sys.exit(main())
