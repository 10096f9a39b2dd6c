#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Every name of both schemes against the simulated device, through the daemon and a
real LinuxCNC HAL: no name without a rule, none that has not moved.

Sessions are machines of their own, several at a time, because most of the time is
spent waiting: a setting of one would be in the way of another.

usage: live_every.py MODULE.so POKEYSD POKEYS-SIM LIST-NAMES [PATTERN]
With a pattern only the sessions that have such an act are played.
"""
from concurrent.futures import ThreadPoolExecutor
import os
import pathlib
import re
import sys
import time
import hal_machine
import every_axis
import every_bus
import every_clock
import every_config
import every_device
import every_drive
import every_elsewhere
import every_encoder
import every_heater
import every_homing
import every_io
import every_keyboard
import every_link
import every_modes
import every_motion
import every_name
import every_old_encoders
import every_old_settings
import every_panel
import every_play
import every_poextbus
import every_probe
import every_rest
import every_settings
import every_start
import every_threading

LIST_NAMES = sys.argv.pop(4)
# the longest first
SESSIONS = [every_settings.ACTS + every_old_settings.ACTS + every_old_encoders.ACTS,
            every_bus.ACTS, every_keyboard.ACTS, every_drive.POSTEP, every_link.LINK,
            every_clock.DEVICE, every_threading.ACTS, every_drive.ACTS, every_link.HEART,
            every_heater.ACTS,
            every_start.ACTS, every_clock.ACTS, every_encoder.ACTS + every_link.ACTS,
            every_io.ACTS, every_poextbus.ACTS + every_panel.ACTS, every_settings.PINS,
            every_axis.ACTS, every_motion.ACTS, every_rest.ACTS, every_rest.OLD_MOTION, every_homing.ACTS,
            every_homing.MASKS, every_homing.PINS, every_homing.JOG, every_homing.GROUPED,
            every_config.ACTS, every_modes.ACTS, every_probe.ACTS, every_probe.OLD]
ACTS = sum(SESSIONS, [])
AT_ONCE, ATTEMPTS = 3, 3
WHOLE = 10_000_000     # characters of a log, which has far fewer
# HAL makes them for each funct, whoever's it is
OF_HAL = re.compile(r"(?:read|write)\.(?:time|tmax|tmax-increased)")


class Machine(hal_machine.Machine):
    """A bench with nothing on it, all names of both schemes."""

    preset = "factory"

    def __init__(self, more, lost_ms):
        self.lost_ms = lost_ms
        super().__init__()
        conf = self.folder / "conf"
        conf.write_text(conf.read_text().replace("[device mill]", f"{more}\n\n[device mill]"))
        self.signals = {}       # of the names that are connected to one
        self.beats = True
        self.inside = None

    def device(self):
        super().device()
        self.inside = every_device.Device(self.folder / "sim")
        self.inside.ask("emergency off", *(f"module {i} on {10 + i}" for i in range(16)))

    def load(self):
        self.hal.start(f"runtime={self.folder}/run names=all")

    def beat(self, beats):
        """Whether the thread tells the daemon anything. LinuxCNC's thread must stand when a funct is
        taken out of it: one that is just running it looks at its freed entry afterwards, and dies."""
        if beats != self.beats:
            order = "addf" if beats else "delf"
            self.hal.ok(f"halcmd stop && halcmd {order} pokeys.0.write servo-thread && halcmd start")
        self.beats = beats

    def link(self, signal, *names):
        """To one signal, by which they are set from now on."""
        self.hal.ok(f"halcmd net {signal} " + " ".join(f"pokeys.0.{name}" for name in names))
        self.signals.update(dict.fromkeys(names, signal))

    def close(self):
        if self.inside:
            self.inside.close()
        super().close()


def elsewhere(names):
    """Names that another test moves, which must be there."""
    found = set()
    for file, patterns in every_elsewhere.ELSEWHERE.items():
        assert pathlib.Path(__file__).with_name(file).exists(), file
        for pattern in patterns:
            fits = {name for name in names if re.fullmatch(pattern, name)}
            assert fits, f"{file}: no name fits {pattern}"
            found |= fits
    return found


def is_in_the_table(machine, names):
    """What HAL shows is what the table says, and so what there are rules for."""
    live = {name for name in every_play.values_of(machine.hal) if not OF_HAL.fullmatch(name)}
    assert live == set(names), f"HAL and the table differ: {sorted(live ^ set(names))[:40]}"


def lost_ms_of(session):
    """Where no loss is waited for, a moment without a processor is none."""
    return 1000 if session is every_link.LINK else 3000 if session is every_clock.DEVICE else 10000


def perform(session, names, found, record):
    """One session; what went wrong, or nothing. Where a stall of the daemon or of HAL took the
    permission to move away in the middle of an act, as it must, the session begins again."""
    for _ in range(ATTEMPTS):
        try:
            return attempt(session, names, found, record)
        except every_play.PermissionGone as reason:
            print(f"{', '.join(act.title for act in session)}: once more: {reason}", flush=True)
            fault = str(reason)
    return f"FAILED: {ATTEMPTS} times: {fault}"


def attempt(session, names, found, record):
    from_nothing = every_start.START in session     # HAL is there before the others are
    more = every_start.CONFIG if from_nothing else every_heater.CONFIG if session is every_heater.ACTS else ""
    machine = Machine(more, lost_ms_of(session))
    try:
        if from_nothing:
            machine.load()
            is_in_the_table(machine, names)
        else:
            machine.all()
            machine.hal.becomes("config.state", 3)
        for act in session:
            every_play.play(machine, act, found, record)
        return ""
    except every_play.PermissionGone as reason:
        if every_play.STALL.search(machine.log("pokeysd", last=WHOLE)):
            raise
        return f"FAILED: {reason}, and nothing was late:\n{machine.log('pokeysd')}\n"
    except (AssertionError, EOFError) as fault:
        return (f"FAILED: {fault}\n{machine.hal.said()[-1000:]}\n{machine.log('pokeysd')}\n"
                f"{machine.log('sim')}\n")
    finally:
        machine.close()


def main():
    began = time.monotonic()
    names = every_name.names_of(LIST_NAMES)
    left_out = elsewhere(names)
    found = every_name.rules_of(ACTS, names, left_out)
    pattern = sys.argv[4] if len(sys.argv) > 4 else ""
    record = {}
    with ThreadPoolExecutor(int(os.environ.get("POKEYS_AT_ONCE", AT_ONCE))) as pool:
        runs = [pool.submit(perform, session, names, found, record)
                for session in SESSIONS
                if any(re.search(pattern, act.title) for act in session)]
        faults = [fault for run in runs if (fault := run.result())]
    print("\n".join(faults), end="")
    still = [name for name, (_, _, direction) in names.items()
             if name not in left_out and not every_name.has_moved(record, name, direction)]
    print(f"{len(names) - len(left_out)} of {len(names)} names in {time.monotonic() - began:.0f} s")
    if still and not pattern and not faults:
        print(f"FAILED: {len(still)} names have not moved: {still}")
    return 1 if faults or still and not pattern else 0


if __name__ == "__main__":
    sys.exit(main())
