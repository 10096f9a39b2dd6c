#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks that each installed file is in exactly one Debian package, that the packages list no others, and that no
line of a description is longer than lintian allows.

usage: check_packages.py SOURCE BUILD
"""
import fnmatch
import json
import pathlib
import re
import subprocess
import sys

DESCRIPTION_MOST = 80           # characters of a line


def named(source):
    """[(pattern, package's list)] of all lists in debian/."""
    lists = [*source.glob("debian/*.install"), *source.glob("debian/*.manpages")]
    return [(line.split()[0], path.name) for path in lists for line in path.read_text(encoding="utf-8").splitlines()
            if line.strip() and not line.startswith("#")]


def is_within(name, pattern):
    """A pattern is a file, or a folder with all that is in it; {a,b} matches either word."""
    if braces := re.search(r"\{([^}]*)\}", pattern):
        return any(is_within(name, pattern[:braces.start()] + word + pattern[braces.end():])
                   for word in braces[1].split(","))
    return any(fnmatch.fnmatchcase(part, pattern) for part in (name, *map(str, pathlib.PurePath(name).parents)))


def main():
    source, build = pathlib.Path(sys.argv[1]), sys.argv[2]
    told = subprocess.run(("meson", "introspect", build, "--installed"), capture_output=True, text=True, check=True)
    # what a script installs, and not meson
    installed = {path.lstrip("/") for path in json.loads(told.stdout).values()} | {"etc/pokeysd/pokeysd.conf"}
    lists = named(source)
    faults = []
    for name in sorted(installed):
        where = [file for pattern, file in lists if is_within(name, pattern)]
        if len(where) != 1:
            faults.append(f"{name}: in {', '.join(where) or 'no package: name it in one of debian/*.install'}")
    for pattern, file in lists:
        if not (source / pattern).exists() and not any(is_within(name, pattern) for name in installed):
            faults.append(f"debian/{file}: {pattern}: nothing of this name is installed")
    for number, line in enumerate((source / "debian/control").read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith(" ") and not line.startswith("  ") and len(line) > DESCRIPTION_MOST:
            faults.append(f"debian/control:{number}: {len(line)} characters, at most {DESCRIPTION_MOST} are allowed")
    print("\n".join(faults) or f"{len(installed)} files, each in one package")
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
