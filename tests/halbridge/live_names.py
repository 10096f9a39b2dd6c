#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""What halcmd shows of a loaded module is the table, name by name.

usage: live_names.py MODULE.so HOST-PROGRAM LIST-NAMES
"""
import subprocess
import sys
import hal_live

LIST_NAMES = sys.argv.pop(3)


def table():
    out = subprocess.run([LIST_NAMES, "names", "canonical"], capture_output=True, text=True, check=True).stdout
    return sorted(out.splitlines())


# what HAL itself makes for each funct
HALS_OWN = tuple(f"{funct}.{name}" for funct in ("read", "write")
                 for name in ("time", "tmax", "tmax-increased"))


def shown(hal):
    """As list-names prints: NAME KIND TYPE DIRECTION."""
    lines = []
    for kind in ("pin", "param"):
        for line in hal.ok(f"halcmd -s show {kind} 'pokeys.*'").splitlines():
            words = line.split()
            if words and not words[4].endswith(HALS_OWN):
                owner, form, direction, name = words[0], words[1], words[2], words[4]
                assert owner == "pokeys_shm", line
                lines.append(f"{name} {kind} {form} {direction}")
    return sorted(lines)


def the_live_hal_is_the_table(rig):
    rig.hal.ok("halcmd loadrt pokeys_shm runtime=/nonexistent")
    have, want = shown(rig.hal), table()
    assert len(want) > 400
    differ = sorted(set(have) ^ set(want))
    assert not differ, "differ:\n" + "\n".join(differ)
    assert have == want


def two_devices_have_two_sets(rig):
    rig.hal.ok("halcmd loadrt pokeys_shm devices=mill,panel runtime=/nonexistent")
    have = shown(rig.hal)
    want = table()
    assert have == sorted(want + [line.replace("pokeys.0.", "pokeys.1.") for line in want])
    functs = rig.hal.ok("halcmd -s show funct 'pokeys.*'").split()
    assert [name for name in functs if name.startswith("pokeys.")] == \
        ["pokeys.0.read", "pokeys.0.write", "pokeys.1.read", "pokeys.1.write"], functs


hal_live.main([the_live_hal_is_the_table, two_devices_have_two_sets])
