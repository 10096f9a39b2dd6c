#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Every source file names its licence (the one of its room), opens with a note on
why it is so, and carries no path of somebody's machine; C has at most 100 columns."""
import pathlib
import re
import subprocess
import sys

MIT_ROOMS = ("include/", "wire/", "shm/", "daemon/engine/", "examples/", "python/")
SOURCE = (".c", ".h", ".rs", ".py", ".sh", ".build")
NOTE = {".c"}
NARROW, COLUMNS, TAB = {".c", ".h"}, 100, 8
# the licence line, then at least two lines of comment
OPENING = re.compile(r"(//|/\*) SPDX[^\n]*\n\s*/\*[^\n]*\n(?:(?!\*/).)*\n", re.DOTALL)
PRIVATE = re.compile(r"(?<![\w.])(/(?:home|work)/\w|/root/)")


def files_of(root):
    """The names of the files of the project, also of those that are not committed yet."""
    out = subprocess.run(["git", "-C", root, "ls-files", "--cached", "--others", "--exclude-standard"],
                         capture_output=True, text=True, check=False)
    # a release archive has no git: every file below counts
    names = out.stdout.splitlines() if out.returncode == 0 and out.stdout else [
        path.relative_to(root).as_posix() for path in pathlib.Path(root).rglob("*")
        if "build" not in path.relative_to(root).parts]
    return sorted(name for name in names if (pathlib.Path(root) / name).is_file())


def faults(name, text):
    head = text[:400]
    licence = "MIT" if name.startswith(MIT_ROOMS) else "GPL-2.0-or-later"
    if name.endswith(".build"):
        licence = ""  # build files may be either
    if f"SPDX-License-Identifier: {licence}" not in head:
        yield f"{name}: the first lines must say SPDX-License-Identifier: {licence}"
    if pathlib.PurePath(name).suffix in NOTE and not OPENING.match(text):
        yield f"{name}: after the licence, open with a note on why it is so"
    for number, line in enumerate(text.split("\n"), 1):
        width = len(line.expandtabs(TAB))
        if pathlib.PurePath(name).suffix in NARROW and width > COLUMNS:
            yield f"{name}:{number}: {width} columns, at most {COLUMNS}"
    match = PRIVATE.search(text)
    if match and name != "tests/house/check_files.py":
        yield f"{name}: names a path of one machine: {match.group(0)}"


def main():
    root, found, seen = sys.argv[1], [], 0
    for name in files_of(root):
        if not name.endswith(SOURCE):
            continue
        seen += 1
        found += faults(name, (pathlib.Path(root) / name).read_text(encoding="utf-8"))
    print("\n".join(found) or f"{seen} files in order")
    return 1 if found or not seen else 0


if __name__ == "__main__":
    sys.exit(main())
