#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The legacy scheme is the older component's interface, name by name.

Every name, kind, type and direction of legacy_names.tsv is made by the table,
and the table makes no other but the choices (legacy.*) and what that component did not
tell at all: that positions are lost.

usage: legacy_names.py LIST-NAMES legacy_names.tsv
"""
import itertools
import pathlib
import re
import subprocess
import sys


OURS = re.compile(r"pokeys\.0\.(?:legacy\.|position-lost )")


def indices(words):
    if words == "-":
        return [None]
    first, last = map(int, words.split(".."))
    return range(first, last + 1)


def interface(path):
    """NAME KIND TYPE DIRECTION of every instance, as list-names prints them."""
    lines = []
    for line in pathlib.Path(path).read_text(encoding="utf-8").splitlines():
        if line.startswith("#") or not line:
            continue
        name, kind, form, direction, i, j = line.split("\t")
        for a, b in itertools.product(indices(i), indices(j)):
            whole = name.replace("{i}", str(a)).replace("{j}", str(b))
            lines.append(f"pokeys.0.{whole} {kind} {form} {direction.split(' (')[0]}")
    return sorted(lines)


def table(program, schemes):
    out = subprocess.run([program, "names", schemes], capture_output=True, text=True,
                         check=True).stdout
    return sorted(out.splitlines())


def main():
    want = interface(sys.argv[2])
    have = sorted(table(sys.argv[1], "legacy") + table(sys.argv[1], "ponet"))
    ours = [line for line in have if not OURS.match(line)]
    assert len(want) == len(set(want)) == 2987, len(want)
    differ = sorted(set(ours) ^ set(want))
    assert not differ, f"{len(differ)} differ:\n" + "\n".join(differ[:40])
    both = {line.split()[0] for line in table(sys.argv[1], "all")}
    missing = sorted(set(line.split()[0] for line in want) - both)
    assert not missing, f"not in names=all: {missing[:10]}"
    print(f"{len(want)} names agree, {len(have) - len(ours)} of ours beside them")


if __name__ == "__main__":
    main()
