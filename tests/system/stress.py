#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Disks that write, caches that are thrashed, a kernel that wants its memory back: the
realtime thread faults no page in, and nothing of the devices is lost. How late it wakes up
meanwhile says nothing here; that wants a machine of its own."""
import ctypes
import multiprocessing
import os
import pathlib
import sys
import tempfile
import time

from house import House, Skip, equal, main, wait_for

BLOCK = 8 << 20
CACHE = 48 << 20  # more than the caches of any processor that this runs on
ROUNDS = 12
CYCLES = 4000
PIDFD_OPEN, PROCESS_MADVISE, PAGEOUT = 434, 440, 21


class Range(ctypes.Structure):
    _fields_ = (("begin", ctypes.c_size_t), ("length", ctypes.c_size_t))


def page_out(pid):
    """The kernel takes all of a process' memory that it may take."""
    libc = ctypes.CDLL(None, use_errno=True)
    process = libc.syscall(PIDFD_OPEN, pid, 0)
    if process < 0:
        raise Skip(f"pidfd_open: {os.strerror(ctypes.get_errno())}")
    for line in pathlib.Path(f"/proc/{pid}/maps").read_text().splitlines():
        begin, end = (int(word, 16) for word in line.split()[0].split("-"))
        if begin >> 63:
            continue  # vsyscall is the kernel's
        place = Range(begin, end - begin)
        taken = libc.syscall(PROCESS_MADVISE, process, ctypes.byref(place), 1, PAGEOUT, 0)
        if taken < 0 and ctypes.get_errno() in (1, 38):
            os.close(process)
            raise Skip(f"process_madvise: {os.strerror(ctypes.get_errno())}")
    os.close(process)


def faults_of(pid):
    """Page faults of all of its threads, so far."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return int(fields[7]) + int(fields[9])


def write_and_read(rounds):
    with tempfile.TemporaryFile(dir="/var/tmp") as file:
        while True:
            file.seek(0)
            file.write(os.urandom(1 << 16) * (BLOCK >> 16))
            file.flush()
            os.fsync(file.fileno())
            os.posix_fadvise(file.fileno(), 0, BLOCK, os.POSIX_FADV_DONTNEED)
            file.seek(0)
            file.read()
            with rounds.get_lock():
                rounds.value += 1


def thrash(rounds):
    one, other = bytearray(CACHE), bytearray(CACHE)
    while True:
        one[:] = other
        other[:] = one
        with rounds.get_lock():
            rounds.value += 1


class Stress:
    def __init__(self):
        context = multiprocessing.get_context("spawn")  # no copy of a page of ours
        self.rounds = [context.Value("l", 0) for _ in range(4)]
        work = (write_and_read, write_and_read, thrash, thrash)
        self.processes = [context.Process(target=each, args=(count,), daemon=True)
                          for each, count in zip(work, self.rounds)]

    def __enter__(self):
        for process in self.processes:
            process.start()
        return self

    def __exit__(self, *_):
        for process in self.processes:
            process.kill()
            process.join()

    def has_worked(self):
        return min(count.value for count in self.rounds) >= ROUNDS


def quiet(house):
    """What the realtime thread has faulted in once it has been the same for half a second."""
    before = None
    wait_for("the diagnostic image", lambda: house.device()["diag"])

    def settled():
        nonlocal before
        diag = house.device()["diag"]["counters"]
        was, before = before, (diag["minor_faults"], diag["major_faults"])
        time.sleep(0.5)
        return was == before
    wait_for("no more page faults", settled, say=lambda: before)
    return before


def test_disks_and_caches_and_a_kernel_short_of_memory():
    with House() as house:
        # the commander may be late, as nobody locks its memory
        house.device_keys["mill"] |= {"lost-after-ms": 60000, "heartbeat-timeout-ms": 60000, "digital-outputs": "31-34"}
        house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        if not house.state()["flags"]["realtime"]:
            raise Skip("no right to lock memory or to SCHED_FIFO here")
        commander = house.spawn("commander", house.runtime, "mill", 31, log="commander.log")
        wait_for("the output", lambda: house.state()["outputs"][30])
        faults, before = quiet(house), house.state()
        # of a process that locks nothing the kernel takes what it wants
        others = faults_of(commander.pid)
        page_out(commander.pid)
        wait_for("its page faults", lambda: faults_of(commander.pid) > others)
        with Stress() as stress:
            def enough():
                page_out(daemon.pid)
                return stress.has_worked() and house.state()["cycle"] - before["cycle"] > CYCLES
            wait_for("the work", enough, 300, say=lambda: [count.value for count in stress.rounds])
        diag, after = house.device()["diag"]["counters"], house.state()
        equal((diag["minor_faults"], diag["major_faults"]), faults)
        equal((after["link"], after["fault_count"]), ("running", before["fault_count"]))
        equal(after["statistics"]["reconnects"], before["statistics"]["reconnects"])
        house.wait_fresh()
        wait_for("the output", lambda: house.state()["outputs"][30])


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
