#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The demo, as ./run demo starts it: it ends well with its line, says one when ^C or a full
disk ends it before, none when its reader has left, and leaves nothing behind.

usage: demo.py SOURCE BUILD MODULE.so
"""
import os
import pathlib
import re
import signal
import subprocess
import sys

SOURCE, BUILD, MODULE = map(pathlib.Path, sys.argv[1:])
PATIENCE = 180
OK = re.compile(r"demo: ok cycles=\d+ late=\d+ lost=\d+ age_us_p50=\d+ age_us_p99=\d+ rtt_us_p50=\d+")


def start(seconds, out=subprocess.PIPE):
    """In a process group of its own, as a terminal gives one to each command."""
    return subprocess.Popen(
        [SOURCE / "scripts/hal-isolated", "--module", MODULE.resolve(), "--keep", BUILD,
         "--network", "/usr/bin/python3", "-B", SOURCE / "scripts/demo.py", "--build", BUILD,
         "--seconds", str(seconds)],
        stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))


def left():
    """Processes of demos with this build."""
    ours = []
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = path.read_bytes().split(b"\0")
        except OSError:
            continue
        if str(BUILD / "daemon/control/pokeysd").encode() in words or str(SOURCE / "scripts/demo.py").encode() in words:
            ours.append(path.parent.name)
    return ours


def it_ends_with_its_line():
    child = start(2)
    out, err = child.communicate(timeout=PATIENCE)
    if child.returncode == 77:
        print(f"skipped: {err.strip()}")
        sys.exit(77)
    lines = out.splitlines()
    assert child.returncode == 0 and OK.fullmatch(lines[-1]), (child.returncode, out, err)
    assert re.search(r"cmd +[\d.-]+ mm  pos +[\d.-]+ mm", lines[1]), out


def an_interrupt_is_no_failure():
    child = start(PATIENCE)
    first = [child.stdout.readline() for _ in range(2)]
    assert "pos" in first[1], first
    os.killpg(child.pid, signal.SIGINT)
    out, err = child.communicate(timeout=PATIENCE)
    assert (child.returncode, "failed" in out) == (130, False), (child.returncode, out, err)


def what_cannot_be_written_is_one_line():
    with open("/dev/full", "w", encoding="ascii") as full:
        child = start(2, full)
        err = child.communicate(timeout=PATIENCE)[1]
    assert (child.returncode, err) == (1, "demo: standard output: No space left on device\n"), (child.returncode, err)


def a_reader_that_leaves_has_seen_enough():
    child = start(PATIENCE)
    assert child.stdout.readline()
    child.stdout.close()
    err = child.stderr.read()
    assert (child.wait(PATIENCE), err) == (1, ""), (child.returncode, err)


def main():
    before = left()
    for check in (it_ends_with_its_line, an_interrupt_is_no_failure, what_cannot_be_written_is_one_line,
                  a_reader_that_leaves_has_seen_enough):
        check()
        print(f"ok: {check.__name__}")
    after = left()
    assert not set(after) - set(before), after


if __name__ == "__main__":
    main()
