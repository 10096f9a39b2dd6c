#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""All C is as .clang-format has it. Each version of clang-format has its own opinion, so one version
judges: another one, or none, is a reason to skip this test."""
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys

from check_files import files_of

VERSION, SKIP = "19", 77
AT_ONCE = 40  # files to a process


def formatter():
    """The program of that version; None if there is none."""
    for name in f"clang-format-{VERSION}", "clang-format":
        try:
            said = subprocess.run([name, "--version"], capture_output=True, text=True, check=False).stdout
        except FileNotFoundError:
            continue
        if re.search(rf"version {VERSION}\.", said):
            return name
    return None


def complaints(program, root, names):
    """A line for each file that has another format."""
    done = subprocess.run([program, "--dry-run", "-Werror", *names], cwd=root, capture_output=True, text=True,
                          check=False)
    first = {}
    for name, line in re.findall(r"^(\S+?):(\d+):\d+: error:", done.stderr, re.M):
        first.setdefault(name, line)
    if done.returncode and not first:
        return [done.stderr.strip()]
    return [f"{name}:{line}: not formatted; {program} -i {name}" for name, line in first.items()]


def main():
    """Check all files, as many processes at once as there are processors."""
    root, program = pathlib.Path(sys.argv[1]), formatter()
    if not program:
        print(f"not tried: clang-format {VERSION} is not installed (Debian: clang-format-{VERSION})", file=sys.stderr)
        return SKIP
    names = [name for name in files_of(root) if name.endswith((".c", ".h"))]
    assert names, f"no C file in {root}"
    parts = [names[at:at + AT_ONCE] for at in range(0, len(names), AT_ONCE)]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        found = [line for lines in pool.map(lambda part: complaints(program, root, part), parts) for line in lines]
    print("\n".join(found) or f"{len(names)} files formatted")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
