#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl trace on a running daemon: every cycle's time is told whole, and by whom.
Skipped loudly where the kernel or our rights do not permit it; refused in one line
without rights, without a daemon, without a recorder."""
import json
import os
import pathlib
import shutil
import sys

sys.path.insert(0, str(pathlib.Path(sys.argv[1]).parent))
from house import House, Skip, main, run  # noqa: E402

UNAVAILABLE, NO_RIGHT = 69, 77
WINDOW_US = 500  # collect = 0.5 of the period
WHERES = {"timer", "interrupt", "softirq", "wake-up", "behind", "plan", "send", "device", "receive", "run"}


def trace(house, *words, before=()):
    return run(*before, House.programs["pokeysctl"], "-r", house.runtime, "trace", *words)


def judge_cycle(cycle):
    assert set(cycle) == {"cycle", "tick_ns", "length_us", "awake_us", "skipped", "whole", "where_us", "parts"}
    assert set(cycle["where_us"]) == WHERES
    assert abs(sum(cycle["where_us"].values()) - cycle["length_us"]) < 0.1, cycle
    assert 0 <= cycle["awake_us"] <= cycle["length_us"]
    for part in cycle["parts"]:
        assert part["us"] <= cycle["where_us"][part["where"]] + 0.1, cycle


def traced(mode):
    with House(mode=mode) as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        out = trace(house, "--seconds", "1", "--slowest", "7", "--json")
        if out.returncode in (UNAVAILABLE, NO_RIGHT):
            raise Skip(out.stderr.strip())
        assert out.returncode == 0 and not out.stderr, out
        found = json.loads(out.stdout)
        assert set(found) == {"format", "seconds", "period_us", "cycles", "dropped", "median_us", "p99_us",
                              "longest_us", "slowest"}
        assert found["format"] == 1 and found["cycles"] >= 7 and found["period_us"] == 1000
        lengths = [cycle["length_us"] for cycle in found["slowest"]]
        assert len(lengths) == 7 and lengths == sorted(lengths, reverse=True)
        assert abs(lengths[0] - found["longest_us"]) < 0.1
        for cycle in found["slowest"]:
            judge_cycle(cycle)
        text = trace(house, "--seconds", "1", "--slowest", "1")
        assert text.returncode == 0 and text.stdout.startswith(tuple("0123456789")), text
        assert text.stdout.count("\ncycle ") == 1, text.stdout
        return found


def test_a_daemon_that_sleeps():
    found = traced("sleep")
    whole = [cycle for cycle in found["slowest"] if cycle["whole"]]
    assert whole or found["dropped"], "the thread was never seen to switch"
    # it asks a device and waits for it, but not in a cycle whose window was over by then
    in_time = [cycle for cycle in whole if cycle["length_us"] < WINDOW_US]
    neither = [cycle for cycle in in_time if cycle["where_us"]["device"] + cycle["where_us"]["run"] <= 0]
    assert not neither, neither


def test_a_daemon_that_spins():
    traced("spin")


def test_nothing_is_longer_than_a_high_threshold():
    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        out = trace(house, "--seconds", "2", "--threshold", "1e9", "--json")
        if out.returncode in (UNAVAILABLE, NO_RIGHT):
            raise Skip(out.stderr.strip())
        assert out.returncode == 0 and json.loads(out.stdout)["slowest"] == [], out


def test_without_rights_it_says_so_in_one_line():
    if os.geteuid() or not shutil.which("setpriv"):
        raise Skip("not root, or no setpriv to give up rights with")
    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        out = trace(house, "--seconds", "0.1", before=("setpriv", "--bounding-set=-all", "--inh-caps=-all",
                                                       "--"))
        if out.returncode == UNAVAILABLE:
            raise Skip(out.stderr.strip())
        assert out.returncode == NO_RIGHT and "root" in out.stderr, out
        assert len(out.stderr.splitlines()) == 1 and not out.stdout, out


def test_without_a_daemon_or_a_recorder_it_says_so():
    with House(**{"recorder-seconds": 0}) as house:
        out = trace(house)
        assert out.returncode == 1 and "no daemon runs there" in out.stderr, out
        house.start_sim()
        house.start_daemon()
        out = trace(house)
        assert out.returncode == 1 and "recorder-seconds" in out.stderr, out


if __name__ == "__main__":
    sys.argv.pop(1)
    sys.exit(main(sys.modules[__name__]))
