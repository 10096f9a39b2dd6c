#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The man page's list of pins and parameters is the table's.

usage: man_page.py LIST-NAMES PAGE.scd [--update]
"""
import pathlib
import subprocess
import sys

# the markers of each list in the page, and the schemes it shows
LISTS = (
    ("; the table begins\n", "; the table ends\n", ("loops",)),
    ("; the older names begin\n", "; the older names end\n", ("legacy", "ponet")),
)


def printed(schemes):
    return "".join(subprocess.run([sys.argv[1], "man", word], capture_output=True, text=True,
                                  check=True).stdout for word in schemes)


def main():
    page = pathlib.Path(sys.argv[2])
    text = whole = page.read_text(encoding="utf-8")
    for begin, end, schemes in LISTS:
        before, rest = whole.split(begin)
        whole = before + begin + printed(schemes) + end + rest.split(end)[1]
    if sys.argv[3:] == ["--update"]:
        page.write_text(whole, encoding="utf-8")
        return 0
    if text == whole:
        return 0
    for old, new in zip(text.splitlines(), whole.splitlines()):
        if old != new:
            print(f"the page says:  {old}\nthe table says: {new}")
            break
    print("run man_page.py with --update")
    return 1


sys.exit(main())
