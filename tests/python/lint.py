#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A Python package under mypy --strict, which is Debian's, and under ruff, which is not in Debian.

usage: lint.py FOLDER PATH ...; the folder of another package that it uses is in MYPYPATH."""
import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import foreign  # noqa: E402  pylint: disable=wrong-import-position

PACKAGE, PATHS = sys.argv[1], sys.argv[2:]
RUFF = "ruff==0.17.6"       # another one finds other things


def main():
    missing, status = [], 0
    python, why = foreign.wanted("ruff", [RUFF])
    with tempfile.TemporaryDirectory() as cache:
        for program, why_not, words in (
                (shutil.which("mypy"), "mypy is not installed", ["--strict", "--cache-dir", cache, *PATHS]),
                (python and python.with_name("ruff"), why, ["check", "--no-cache", "."])):
            if not program:
                missing.append(why_not)
                continue
            ran = subprocess.run([program, *words], cwd=PACKAGE, text=True, check=False, stdout=subprocess.PIPE,
                                 stderr=subprocess.STDOUT)
            print(f"{pathlib.Path(program).name}: {ran.stdout.strip()}")
            status |= ran.returncode != 0
    if missing:
        print(f"not tried: {'; '.join(missing)}", file=sys.stderr)
    return 1 if status else 77 if len(missing) == 2 else 0


if __name__ == "__main__":
    sys.exit(main())
