#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The daemon under strace: what it asks of the kernel is what the unit permits,
and what it does when the kernel fails it or holds its realtime thread."""
import ctypes
import os
import pathlib
import re
import shutil
import signal
import sys
import time

from house import PATIENCE, House, Skip, equal, main, run, wait_for
from trouble import drain, has_cleared, killed


def traced(house, *options, **spawn):
    """The daemon under strace; (strace's process, the daemon's pid)."""
    house.programs = {**house.programs, "strace": shutil.which("strace") or "strace"}
    house.write_conf()
    try:
        child = house.spawn("strace", "-f", "-qq", "-o", house.folder / "trace", *options,
                            house.programs["pokeysd"], "--config", house.conf,
                            **{"log": "pokeysd.log", **spawn})
    except FileNotFoundError:
        raise Skip("strace is not installed") from None
    pid = 0

    def below():
        nonlocal pid
        try:
            # strace has other children as well, before it begins
            for word in pathlib.Path(f"/proc/{child.pid}/task/{child.pid}/children").read_text().split():
                if pathlib.Path(f"/proc/{word}/comm").read_text() == "pokeysd\n":
                    pid = int(word)
        except (FileNotFoundError, ProcessLookupError):
            pass
        return pid or child.poll() is not None
    wait_for("the daemon below strace", below)
    if child.poll() is not None and "ptrace" in house.log():
        raise Skip("processes may not be traced here")
    return child, pid


def has_a_ring(strace, daemon, house):
    """Once it is ready, or has ended. Without one nothing can be done to it."""
    wait_for("the daemon ready", lambda: strace.poll() is not None or "ready:" in house.log(), say=house.log)
    if "transport is socket" in house.log():
        if strace.poll() is None:
            os.kill(daemon, signal.SIGTERM)
            strace.wait(PATIENCE)
        raise Skip("io_uring is not to be had here")


def settings(unit):
    values = {}
    for line in unit.read_text().splitlines():
        key, equals, value = line.partition("=")
        if equals and not key.startswith("#"):
            values.setdefault(key, []).extend(value.split())
    return values


def expand(names):
    """System calls of a list that may have @groups."""
    calls = set()
    for name in names:
        if not name.startswith("@"):
            calls.add(name)
            continue
        out = run("systemd-analyze", "syscall-filter", name)
        if out.returncode:
            raise Skip("systemd-analyze is not installed")
        calls |= expand(word for line in out.stdout.splitlines()[1:]
                        for word in [line.strip()] if word and not word.startswith("#"))
    return calls


def test_the_unit_permits_all_that_the_daemon_does():
    with House() as house:
        metrics = house.folder / "m"
        house.daemon_keys |= {"metrics-file": metrics, "metrics-interval-ms": 100,
                              "discovery-interval-ms": 100, "discovery-address": house.address}
        house.device_keys["other"] = {"serial": 5}
        unit = settings(House.programs["pokeysd.service.in"])
        permitted = expand(unit["SystemCallFilter"])
        house.start_sim()
        strace, daemon = traced(house)
        house.wait_fresh()
        house.spawn("commander", house.runtime, "mill", 31, log="commander.log")
        wait_for("metrics", metrics.exists)
        time.sleep(0.5)
        os.kill(daemon, signal.SIGTERM)
        equal(strace.wait(PATIENCE), 0, house.log())
        trace = (house.folder / "trace").read_text(errors="replace")
        calls = set(re.findall(r"^\d+ +(?:<\.\.\. )?(\w+)[( ]", trace, flags=re.M)) - {"resumed"}
        exchange = "sendmmsg" if "transport is socket" in house.log() else "io_uring_enter"
        assert {"mlockall", exchange, "sendto"} <= calls and len(calls) > 30, calls
        # execve starts it, before the filter is in force for what it runs
        assert not calls - permitted, f"not permitted: {sorted(calls - permitted)}"
        families = set(re.findall(r"socket\((AF_\w+)", trace))
        assert families <= set(unit["RestrictAddressFamilies"]), families
        written = set(re.findall(r'open(?:at)?\([^"]*"([^"]+)", [^)]*(?:O_WRONLY|O_RDWR|O_CREAT)', trace))
        outside = {path for path in written if not path.startswith(str(house.folder)) and path.startswith("/")}
        assert outside <= {"/dev/null", "/dev/cpu_dma_latency"}, outside


def test_a_ring_that_fails_for_good_ends_the_daemon_with_a_reason():
    with House() as house:
        house.start_sim()
        strace, daemon = traced(house, "-e", "trace=io_uring_enter",
                                "-e", "inject=io_uring_enter:error=EBADF:when=300+")
        has_a_ring(strace, daemon, house)
        status = strace.wait(PATIENCE)
        said = house.log()
        assert status == 1, (status, said)
        assert "has ended by itself: Bad file descriptor" in said, said
        assert not any(house.runtime.iterdir()), list(house.runtime.iterdir())


def test_a_realtime_thread_that_is_held_gets_no_sign_of_life_and_is_not_waited_for():
    with House() as house:
        house.start_sim()
        strace, daemon = traced(house, "-e", "trace=io_uring_enter",
                                "-e", "inject=io_uring_enter:delay_enter=15000000:when=1500",
                                env={**house.open_notify(), "WATCHDOG_USEC": "200000"})
        has_a_ring(strace, daemon, house)
        wait_for("a sign of life", lambda: any("WATCHDOG" in told for told in drain(house)))

        def held():
            first = house.state().get("cycle", 0)
            time.sleep(2)  # longer than a busy machine holds it
            return first and house.state().get("cycle") == first
        wait_for("the thread held", held)
        drain(house)
        time.sleep(0.6)
        told = drain(house)
        assert not any("WATCHDOG" in word for word in told), told
        device = house.device()
        assert not device["publishing"] and "not publishing" in device["reason"], device["reason"]
        os.kill(daemon, signal.SIGTERM)
        wait_for("the complaint", lambda: "does not end" in house.log())
        equal(strace.wait(PATIENCE), 1, house.log())


def calls_at_start(house):
    """How often the daemon makes each call until it is ready."""
    strace, daemon = traced(house)
    wait_for("the daemon", (house.runtime / "current").exists)
    os.kill(daemon, signal.SIGTERM)
    equal(strace.wait(PATIENCE), 0, house.log())
    counts = {}
    for name in re.findall(r"^\d+ +(\w+)\(", (house.folder / "trace").read_text(errors="replace"), flags=re.M):
        counts[name] = counts.get(name, 0) + 1
    return counts


def one_failure(call, error, when):
    with House() as house:
        strace, daemon = traced(house, "-e", f"trace={call}", "-e", f"inject={call}:error={error}:when={when}")
        wait_for(f"{call} #{when} {error}: a start or an end",
                 lambda: strace.poll() is not None or (house.runtime / "current").exists(), say=house.log)
        went_on = strace.poll() is None
        if went_on and daemon:
            try:
                os.kill(daemon, signal.SIGTERM)
            except ProcessLookupError:
                pass
        status = strace.wait(PATIENCE)
        allowed = (0, 1) if went_on else (1, 75, 77)
        assert status in allowed, f"{call} #{when} {error}: status {status}: {house.log()}"
        assert went_on or house.log().strip(), f"{call} #{when} {error}: ended without a word"


def test_a_call_that_fails_at_the_start_ends_it_in_words_or_not_at_all():
    with House() as house:
        counts = calls_at_start(house)
    sweep = [("signalfd4", "EMFILE"), ("mlockall", "ENOMEM"), ("socket", "EMFILE"), ("setsockopt", "EPERM"),
             ("io_uring_setup", "EPERM"), ("io_uring_setup", "ENOMEM"), ("io_uring_register", "EINVAL"),
             ("clone3", "EAGAIN"), ("mkdir", "EROFS"), ("mkdirat", "ENOSPC"), ("flock", "EWOULDBLOCK"),
             ("ftruncate", "ENOSPC"), ("fchmod", "EPERM"), ("fchown", "EPERM"), ("symlink", "ENOSPC"), ("rename", "EIO"),
             ("pwrite64", "ENOSPC"), ("write", "ENOSPC"), ("unlinkat", "EACCES"), ("bind", "EADDRINUSE"),
             ("sched_setscheduler", "EPERM"), ("sched_setaffinity", "EINVAL"), ("getrandom", "EINTR")]
    cases = [(call, error, when) for call, error in sweep for when in range(1, counts.get(call, 0) + 1)]
    assert len(cases) > 30, counts
    for case in cases:  # all: which there are depends on the machine, so a choice would not be the same
        one_failure(*case)


def test_a_daemon_that_is_ended_while_it_reads_its_configuration_ends_in_order():
    with House() as house:
        killed(house)
        signalled = "-P", house.conf, "-e", "inject=openat:signal=SIGTERM:when=1"
        daemon, _ = traced(house, *signalled)
        has_cleared(house, daemon)
        # who only asks has nothing to put in order
        out = run("strace", "-qq", "-o", os.devnull, *signalled, house.programs["pokeysd"], "--check-config",
                  "--config", house.conf)
        equal(out.returncode, -signal.SIGTERM, out)


def test_a_start_that_fails_clears_what_a_killed_daemon_left():
    with House(transport="io_uring") as house:
        ring = ctypes.CDLL(None).syscall(425, 1, ctypes.create_string_buffer(120))  # io_uring_setup
        if ring < 0:
            raise Skip("there is no io_uring here")
        os.close(ring)
        killed(house)
        daemon, _ = traced(house, "-e", "inject=io_uring_setup:error=EPERM")
        has_cleared(house, daemon, 1, "transport io_uring: ")


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
