#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl trace on a running daemon: every cycle's time is told whole, and by whom.
Skipped loudly where the kernel or our rights do not permit it; refused in one line
without rights, without a daemon, without a recorder."""
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(sys.argv[1]).parent))
from house import PATIENCE, House, Skip, main, run, wait_for  # noqa: E402

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


def traced(house):
    house.start_sim()
    house.start_daemon()
    house.wait_fresh()
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_nvcsw
    out = trace(house, "--seconds", "1", "--slowest", "7", "--json")
    if out.returncode in (UNAVAILABLE, NO_RIGHT):
        raise Skip(out.stderr.strip())
    assert out.returncode == 0 and not out.stderr, out
    # fifty times a second, and not by each of thousands of events on the core that is watched
    woken = resource.getrusage(resource.RUSAGE_CHILDREN).ru_nvcsw - before
    assert woken < 1000, woken
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


def test_a_daemon_that_sleeps():
    def most_wait_for_the_device():
        out = trace(house, "--seconds", "1", "--slowest", "100", "--json")
        assert out.returncode == 0, out
        # recorded completely, and in time: on a busy machine the slowest cycles are those whose window ended
        # before they had sent their requests
        cycles = [cycle["where_us"] for cycle in json.loads(out.stdout)["slowest"]
                  if cycle["whole"] and cycle["length_us"] < WINDOW_US]
        return sum(where["device"] + where["run"] > 0 for where in cycles) > len(cycles) / 2

    with House(mode="sleep") as house:
        traced(house)
        wait_for("cycles that wait for the device", most_wait_for_the_device)


def test_a_daemon_that_spins():
    with House(mode="spin") as house:
        traced(house)


def test_nothing_is_longer_than_a_high_threshold():
    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        out = trace(house, "--seconds", "2", "--threshold", "1e9", "--json")
        if out.returncode in (UNAVAILABLE, NO_RIGHT):
            raise Skip(out.stderr.strip())
        assert out.returncode == 0 and json.loads(out.stdout)["slowest"] == [], out


def watching(house, ready):
    """A trace of ten minutes, at the moment when ready(its /proc folder) is true."""
    child = house.spawn("pokeysctl", "-r", house.runtime, "trace", "--seconds", "600", "--json",
                        stderr=subprocess.PIPE, text=True)

    def there():
        try:
            return child.poll() is not None or ready(pathlib.Path("/proc", str(child.pid)))
        except OSError:  # it ended just now
            return True
    wait_for("the tracer", there)
    return child


def heard(child):
    out, told = child.communicate(timeout=PATIENCE)
    if child.returncode in (UNAVAILABLE, NO_RIGHT):
        raise Skip(told.strip())
    return json.loads(out), told


def test_an_interrupt_that_comes_early_does_not_last_for_ever():
    def listens(process):
        caught = int(process.joinpath("status").read_text().split("SigCgt:")[1].split()[0], 16)
        return caught >> signal.SIGINT - 1 & 1

    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        child = watching(house, listens)
        child.send_signal(signal.SIGINT)
        found, told = heard(child)
        assert 0 <= found["seconds"] < 600, found
        assert bool(told) == (not found["cycles"]) and "daemon" not in told, (found, told)


def test_a_daemon_that_dies_ends_it():
    def is_in_the_kernel(process):
        return any("bpf" in os.readlink(link) for link in process.joinpath("fd").iterdir() if link.is_symlink())

    with House() as house:
        house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        child = watching(house, is_in_the_kernel)
        daemon.kill()
        daemon.wait()
        found, told = heard(child)
        assert found["seconds"] < 600, found
        assert re.fullmatch(r"pokeysctl: the daemon ended after [0-9.]+ s\n", told), told
        out = trace(house, "--seconds", "600")
        assert out.returncode == 1 and "does not run" in out.stderr and not out.stdout, out


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


def test_without_the_kernels_types_it_says_what_is_lost():
    if os.geteuid() or not shutil.which("unshare") or not os.path.isdir("/sys/kernel/btf"):
        raise Skip("not root, or nothing to hide")
    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        out = trace(house, before=("unshare", "--mount", "sh", "-c",
                                   'mount -t tmpfs none /sys/kernel/btf && exec "$@"', "sh"))
        assert out.returncode == UNAVAILABLE and not out.stdout, out
        assert re.fullmatch("pokeysctl: .*BTF.*latency shows how late.*\n", out.stderr), out


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
