#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The whole daemon while the computer's clock passes a limit, in a time namespace of its own."""
import json
import re
import subprocess
import sys
import time

from house import PATIENCE, House, Skip, end, equal, main, wait_for
from safety import WORD, Unsafe, safety

BEYOND = 2  # seconds that all must be well after the limit
SECOND = 10**9


class Late(Exception):
    """The clock had passed the limit before the device ran."""


def now():
    return time.clock_gettime_ns(time.CLOCK_MONOTONIC)


def inside(limit_ns):
    """A commander's output stays on, and nobody notices anything."""
    with House() as house:
        # a link or a commander that is late on a busy computer is another test's matter
        house.device_keys["mill"] |= {"digital-outputs": 31, "lost-after-ms": 60000,
                                      "heartbeat-timeout-ms": 60000, "failsafe-timeout-ms": 25500}
        sim = house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        house.spawn("commander", house.runtime, "mill", 31, log="commander.log")
        wait_for("the commander's output", lambda: "latch=1" in house.ask_sim(sim, "pin", 31))
        said, before = len(house.log()), house.state()
        if now() >= limit_ns:
            raise Late
        wait_for("the limit", lambda: now() > limit_ns + BEYOND * SECOND)
        house.wait_fresh()
        after = house.state()
        equal(daemon.poll(), None, house.log())
        assert after["cycle"] > before["cycle"], (before["cycle"], after["cycle"])
        equal(after["epoch"], before["epoch"])
        with safety():
            assert "latch=1" in house.ask_sim(sim, "pin", 31), "the output went off"
        new = house.log()[said:]
        assert not re.search("lost|restart|suspend|silent|emergency", new), new
        house.says("status", returncode=0)
        equal(end(daemon), 0, house.log())
        assert "latch=0" in house.ask_sim(sim, "pin", 31), "the output stayed on"


def passes(limit_ns):
    """In a namespace whose clock is so long before the limit that the device runs by then."""
    lead = 5
    while True:
        # no earlier than zero, and both clocks alike: their difference is a suspend
        offset = (limit_ns - now()) // SECOND - lead
        done = subprocess.run(["unshare", "--time", "--monotonic", str(offset), "--boottime", str(offset), sys.executable,
                               "-B", __file__, "--inside", str(limit_ns), json.dumps({k: str(v) for k, v in House.programs.items()})],
                              capture_output=True, text=True, timeout=6 * PATIENCE, check=False)
        if "unshare: " in done.stderr:
            raise Skip(done.stderr.strip())
        if "Late" not in done.stderr:
            break
        lead *= 2
        assert lead <= PATIENCE, "the device never ran in time"
    if WORD in done.stderr:
        raise Unsafe(done.stderr)
    equal(done.returncode, 0, done.stderr)


def test_49_days_are_32_bits_of_milliseconds():
    passes((1 << 32) * 10**6)


def test_104_days_are_all_nanoseconds_that_a_double_holds():
    passes(1 << 53)


if __name__ == "__main__":
    if sys.argv[1] == "--inside":
        House.programs = json.loads(sys.argv[3])
        inside(int(sys.argv[2]))
        sys.exit(0)
    sys.exit(main(sys.modules[__name__]))
