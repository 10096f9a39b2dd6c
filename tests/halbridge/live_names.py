#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""What halcmd shows of a loaded module is the table, name by name.

usage: live_names.py MODULE.so HOST-PROGRAM LIST-NAMES
"""
import subprocess
import sys
import hal_live

LIST_NAMES = sys.argv.pop(3)


def table(schemes):
    out = subprocess.run([LIST_NAMES, "names", schemes], capture_output=True, text=True,
                         check=True).stdout
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


def memory(hal):
    """Bytes of HAL's memory: used, and all there are."""
    return [int(number) for number in
            hal.ok("halcmd status mem").split("memory:")[1].split()[0].split("/")]


def check(rig, schemes):
    rig.hal.ok(f"halcmd loadrt pokeys_shm runtime=/nonexistent names={schemes}")
    have, want = shown(rig.hal), table(schemes)
    differ = sorted(set(have) ^ set(want))
    assert not differ, "differ:\n" + "\n".join(differ[:40])
    assert have == want and len(want) > 2000


def the_canonical_names_are_the_table(rig):
    check(rig, "canonical")


def the_core_names_are_the_table_without_what_is_set_apart(rig):
    check(rig, "core")
    used, _ = memory(rig.hal)
    assert len(table("canonical")) - len(table("core")) > 250
    print(f"{len(table('core'))} names take {used} bytes")


def the_legacy_names_are_the_table(rig):
    check(rig, "legacy")


def all_names_are_the_table(rig):
    check(rig, "all")


def both_schemes_take_half_of_hals_memory(rig):
    check(rig, "both")
    used, size = memory(rig.hal)
    print(f"{len(table('both'))} names take {used} of {size} bytes")
    assert used <= size // 2


def two_devices_have_two_sets(rig):
    rig.hal.ok("halcmd loadrt pokeys_shm devices=mill,panel runtime=/nonexistent")
    second = [line.replace("pokeys.0.", "pokeys.1.") for line in table("canonical")]
    assert shown(rig.hal) == sorted(table("both") + second)
    functs = rig.hal.ok("halcmd -s show funct 'pokeys.*'").split()
    assert [name for name in functs if name.startswith("pokeys.")] == \
        ["pokeys.0.read", "pokeys.0.write", "pokeys.1.read", "pokeys.1.write"], functs


def a_reload_uses_its_memory_again(rig):
    rig.hal.ok("halcmd loadrt threads name1=servo-thread period1=1000000")
    used = []
    for _ in range(10):
        rig.hal.ok("halcmd loadrt pokeys_shm runtime=/nonexistent")
        rig.hal.ok("halcmd unloadrt pokeys_shm")
        used.append(memory(rig.hal)[0])
    # HAL itself keeps 24 bytes of each funct
    assert used[-1] - used[0] <= 9 * 48, used


hal_live.main([
    the_canonical_names_are_the_table,
    the_core_names_are_the_table_without_what_is_set_apart,
    the_legacy_names_are_the_table,
    all_names_are_the_table,
    both_schemes_take_half_of_hals_memory,
    two_devices_have_two_sets,
    a_reload_uses_its_memory_again,
])
