#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Includes point only to allowed rooms.

The table is the second column of the design's house. A file's room is its
folder; a room may include itself, the rooms listed for it, and nothing else of
the house. Called with --self-test as second argument, proves on made-up input
that a wrong include is found.
"""
import pathlib
import re
import sys

MAY_USE = {
    "include": [],
    "wire": ["include"],
    "settings": ["wire", "include"],
    "usage": [],
    "shm": ["include"],
    "sim": ["usage", "wire", "include"],
    "daemon/engine": ["wire", "include"],
    "daemon/transport": [],
    "daemon/loops": [],
    "daemon/device": ["daemon/engine", "daemon/loops", "settings", "wire", "include"],
    "daemon/recorder": ["daemon/device", "daemon/transport", "wire", "include"],
    "daemon/rt": ["daemon/recorder", "daemon/device", "daemon/transport", "shm", "include"],
    "daemon/control": ["daemon/rt", "daemon/recorder", "daemon/device", "daemon/engine", "daemon/loops", "daemon/transport",
                       "wire", "settings", "shm", "usage", "include"],
    # where the devices are is in pokeysd.conf, and one reader reads that
    "guard": ["daemon/control", "daemon/device", "daemon/transport", "usage", "wire", "include"],
    "halbridge": ["include", "shm", "usage"],
    # its names and help texts are HAL's
    "model": ["halbridge", "shm", "wire", "include"],
    # discovery is a socket's work, and the tools' search is the daemon's search; device: survey.h; a new
    # configuration is judged as the daemon does it
    "tools": ["include", "halbridge", "model", "settings", "shm", "usage", "wire", "daemon/transport", "daemon/recorder",
              "daemon/device", "daemon/control"],
    "examples": ["include"],
}
GENERATED = {"version.h", "guard.skel.h", "trace.skel.h"}  # made by the build, belongs to no room
INCLUDE = re.compile(r'^\s*#\s*include\s+(?:"([^"]+)"|<(pokeys/[^>]+)>)')


def room_of(path):
    parts = path.split("/")
    if parts[0] == "daemon" and len(parts) > 2:
        return "/".join(parts[:2])
    return parts[0]


def faults(name, text):
    room = room_of(name)
    if room not in MAY_USE:
        return
    for number, line in enumerate(text.splitlines(), 1):
        match = INCLUDE.match(line)
        if not match:
            continue
        target = match.group(1) or "include/" + match.group(2)
        if target in GENERATED:
            continue
        if "/" not in target:
            yield f'{name}:{number}: "{target}": write the room as well ("{room}/{target}")'
        elif room_of(target) != room and room_of(target) not in MAY_USE[room]:
            allowed = ", ".join(MAY_USE[room]) or "no other room"
            yield f"{name}:{number}: {room} must not include {target}; it may use: {allowed}"


def self_test():
    bad = ('wire/a.c', '#include "daemon/engine/mailbox.h"\n'), ('daemon/rt/a.c', '#include "wire/op.h"\n'), \
          ('halbridge/a.c', '#include <pokeys/state.h>\n#include "daemon/rt/loop.h"\n'), ('sim/a.c', '#include "a.h"\n')
    good = ('sim/a.c', '#include "wire/op.h"\n#include <stdio.h>\n'), ('daemon/rt/a.c', '#include "shm/host.h"\n')
    assert all(len(list(faults(*case))) == 1 for case in bad)
    assert not any(list(faults(*case)) for case in good)


def main():
    self_test()
    root = pathlib.Path(sys.argv[1])
    found, seen = [], 0
    for room in MAY_USE:
        for path in sorted((root / room).rglob("*.[ch]")):
            name = path.relative_to(root).as_posix()
            if "/target/" in name:
                continue
            seen += 1
            found += faults(name, path.read_text(encoding="utf-8"))
    print("\n".join(found) or f"{seen} files, every include points to an allowed room")
    return 1 if found or not seen else 0


if __name__ == "__main__":
    sys.exit(main())
