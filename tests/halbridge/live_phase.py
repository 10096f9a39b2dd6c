#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The phase lock the whole way: a real servo thread, a real daemon, a simulated device.
That it is reached, shown, lost and reached again; not how exact it is, which is a
matter of the machine (./run bench) and of arithmetic (rt / phase).

Cycle and servo thread have 4 ms: a busy machine without realtime is late by tenths of
milliseconds, and a lock wants reads within an eighth of a period.

usage: live_phase.py MODULE.so POKEYSD POKEYS-SIM [PATTERN]
"""
import json
import pathlib
import subprocess
import sys
import time
import hal_machine

PATIENCE = 120  # s; two seconds on an idle machine
POKEYSCTL = pathlib.Path(hal_machine.POKEYSD).parents[2] / "tools/pokeysctl"


def begin(m, lock):
    conf = m.folder / "conf"
    conf.write_text(conf.read_text().replace(
        "[device mill]", f"period-us = 4000\nphase-lock = {lock}\n\n[device mill]\nstale-after-ms = 500"))
    m.device()
    m.daemon()
    m.hal.ok("halcmd loadrt threads name1=servo-thread period1=4000000")
    m.hal.start(f"runtime={m.folder}/run", threads=False)
    m.hal.becomes("connected", True, limit=PATIENCE)
    return m.hal


def status(m):
    done = subprocess.run([POKEYSCTL, "--runtime-directory", m.folder / "run", "status", "mill", "--json"],
                          capture_output=True, text=True, check=False)
    try:
        return json.loads(done.stdout)["devices"][0]
    except (ValueError, LookupError):
        raise AssertionError(f"pokeysctl status: {done.stderr or done.stdout}") from None


def phase_becomes(m, state):
    end = time.monotonic() + PATIENCE
    while (phase := status(m)["state"]["phase"])["state"] != state:
        assert time.monotonic() < end, f"the phase is {phase}, not {state}, after {PATIENCE} s"
        time.sleep(0.05)
    return phase


def the_lock_is_reached_lost_and_reached_again(m):
    hal = begin(m, "yes")
    took = hal.becomes("phase-locked", True, limit=PATIENCE)
    phase = phase_becomes(m, "locked")  # as it is then: it may have been lost meanwhile
    print(f"locked in {took:.1f} s: {phase}")
    assert phase["master"] == 0 and phase["lead_us"] > 0
    assert abs(phase["period_us"] - 4000) <= 80, "a cycle is more than 2 % off"
    # no read comes when expected to the nanosecond
    hal.becomes("phase-error-us", lambda have: have != 0, limit=PATIENCE)
    hal.ok("halcmd stop")
    losses = phase_becomes(m, "free")["losses"]
    assert losses >= 1
    hal.ok("halcmd start")
    assert phase_becomes(m, "locked")["losses"] >= losses
    m.kill("pokeysd")
    hal.becomes("phase-locked", False, limit=PATIENCE)
    m.daemon()
    hal.becomes("phase-locked", True, limit=PATIENCE)


def reads_are_counted(m, count):
    """The status once so many reads are; the diagnostic image comes later than the first state."""
    end = time.monotonic() + PATIENCE
    while not (diag := (seen := status(m))["diag"]) or diag["latency_us"]["age_at_read"]["count"] < count:
        assert time.monotonic() < end, f"not {count} ages in {PATIENCE} s: {diag}"
        time.sleep(0.05)
    return seen


def ages_of_reads_are_counted_and_shown(m):
    hal = begin(m, "yes")
    age = reads_are_counted(m, 100)["diag"]["latency_us"]["age_at_read"]
    assert 0 < age["min"] <= age["p50"] <= age["p99"] <= age["max"]
    for what in ("p99", "max"):
        hal.becomes(f"latency.age-{what}-us", lambda have: have > 0, limit=PATIENCE)


def without_it_the_cycle_runs_freely(m):
    hal = begin(m, "no")
    seen = reads_are_counted(m, 500)
    assert seen["state"]["phase"]["state"] == "off"
    assert seen["state"]["phase"]["period_us"] == 4000
    assert hal.get("phase-locked") is False and hal.get("phase-error-us") == 0


TESTS = [
    the_lock_is_reached_lost_and_reached_again,
    ages_of_reads_are_counted_and_shown,
    without_it_the_cycle_runs_freely,
]


if __name__ == "__main__":
    sys.exit(hal_machine.main(TESTS))
