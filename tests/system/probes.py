#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The probes of pokeysd, read from the program itself (section .note.stapsdt), are those
that docs/tracing.md lists, with as many arguments. Arguments: the program, the page."""
import pathlib
import re
import struct
import sys


def section(data, wanted):
    """A section of a 64-bit little-endian ELF file; None if it is not there."""
    assert data[:6] == b"\x7fELF\x02\x01", "no 64-bit little-endian program"
    offset, = struct.unpack_from("<Q", data, 40)
    size, count, names = struct.unpack_from("<HHH", data, 58)

    def header(number):
        return struct.unpack_from("<IIQQQQIIQQ", data, offset + number * size)

    text = header(names)[4]
    for number in range(count):
        found = header(number)
        name = data[text + found[0]:data.index(b"\0", text + found[0])]
        if name == wanted:
            return data[found[4]:found[4] + found[5]]
    return None


def probes(notes):
    """{(provider, name): set of numbers of arguments} of all notes."""
    found = {}
    while notes:
        name_size, size, kind = struct.unpack_from("<III", notes)
        at = 12 + (name_size + 3 & ~3)
        if kind == 3 and notes[12:12 + name_size] == b"stapsdt\0":
            provider, name, arguments = notes[at + 24:at + size].split(b"\0")[:3]
            assert struct.unpack_from("<Q", notes, at)[0], "a probe without a place"
            assert not struct.unpack_from("<Q", notes, at + 16)[0], "a semaphore: it costs more than a nop"
            found.setdefault((provider.decode(), name.decode()), set()).add(len(arguments.split()))
        notes = notes[at + (size + 3 & ~3):]
    return found


def documented(page):
    """{name: number of arguments} of the table of probes."""
    table = page[page.index("## Probes"):]
    rows = re.findall(r"^\| `([a-z_]+)` \| ([^|]*) \|", table, re.M)
    return {name: len(re.findall(r"`[a-z_]+`", arguments)) for name, arguments in rows}


def main():
    notes = section(pathlib.Path(sys.argv[1]).read_bytes(), b".note.stapsdt")
    if notes is None:
        print("pokeysd was built without probes (systemtap-sdt-dev)", file=sys.stderr)
        return 77
    found = {key: value for key, value in probes(notes).items() if key[0] == "pokeysd"}
    listed = documented(pathlib.Path(sys.argv[2]).read_text(encoding="utf-8"))
    assert listed, "no table of probes"
    assert {name for _, name in found} == set(listed), \
        f"not listed: {sorted({n for _, n in found} - set(listed))}, not there: " \
        f"{sorted(set(listed) - {n for _, n in found})}"
    for (_, name), counts in found.items():
        assert counts == {listed[name]}, f"{name} has {sorted(counts)} arguments, {listed[name]} are listed"
    print(f"{len(found)} probes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
