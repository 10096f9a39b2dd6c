#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Does everything in C build where char is unsigned, as on arm64, and with sanitizers?

Each source is checked with the options that it is built with, and for comparisons that are
always true or false with such a char. Sanitizers change what the compiler warns of: it no
longer knows the range of a shift, for example. Nothing is run here; the sanitized builds,
which take minutes, are in suites asan and tsan.

usage: unsigned_char.py COMPILE_COMMANDS.json
"""
import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys

CHECK = ["-funsigned-char", "-fsanitize=address,undefined", "-Wtype-limits", "-Werror", "-fsyntax-only"]
OUTPUTS = re.compile(r" -(?:o|MQ|MF) \S+| -MD\b| -MMD\b")


def sources(path: pathlib.Path) -> dict[str, tuple[str, str]]:
    """Of each source the folder and the command, of several the first."""
    found: dict[str, tuple[str, str]] = {}
    for entry in json.loads(path.read_text(encoding="utf-8")):
        if entry["file"].endswith(".c"):
            found.setdefault(entry["file"], (entry["directory"], entry["command"]))
    return found


def complaints(folder: str, command: str) -> str:
    """What the compiler says of one source, empty if nothing."""
    words = shlex.split(OUTPUTS.sub("", command))
    done = subprocess.run(words + CHECK, cwd=folder, capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else done.stderr


def main() -> int:
    """Check all of them, as many at once as there are processors."""
    found = sources(pathlib.Path(sys.argv[1]))
    assert found, f"no source in {sys.argv[1]}"
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        said = list(pool.map(lambda entry: complaints(*entry), found.values()))
    bad = [text for text in said if text]
    print("\n".join(bad))
    print(f"{len(found)} sources, {len(bad)} that do not build with an unsigned char or a sanitizer")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
