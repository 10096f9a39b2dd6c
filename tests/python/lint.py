#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A Python package under mypy --strict and ruff, as far as they are installed.

usage: lint.py FOLDER PATH ...; the folder of another package that it uses is in MYPYPATH."""
import shutil
import subprocess
import sys
import tempfile

PACKAGE, PATHS = sys.argv[1], sys.argv[2:]


def main():
    missing, status = [], 0
    with tempfile.TemporaryDirectory() as cache:
        for program, words in (("mypy", ["--strict", "--cache-dir", cache, *PATHS]),
                               ("ruff", ["check", "--no-cache", "."])):
            if not shutil.which(program):
                missing.append(program)
                continue
            ran = subprocess.run([program, *words], cwd=PACKAGE, text=True, check=False, stdout=subprocess.PIPE,
                                 stderr=subprocess.STDOUT)
            print(f"{program}: {ran.stdout.strip()}")
            status |= ran.returncode != 0
    if missing:
        print(f"not tried, because it is not installed: {', '.join(missing)}", file=sys.stderr)
    return 1 if status else 77 if len(missing) == 2 else 0


if __name__ == "__main__":
    sys.exit(main())
