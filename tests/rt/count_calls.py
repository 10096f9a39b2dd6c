#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""System calls of the realtime thread, counted by strace from outside.

In sleep mode a cycle has two system calls and one for each reply, at most; and
the thread's own counter, which everybody reads, must agree with what strace saw.
Arguments: probe, simulator, transport ("socket" is held only to agreement: it
needs a second call for each reply). Exit status 77 where tracing is refused."""
import collections
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SECONDS = 3
PERIOD_US = 4000    # tracing makes every call slow


def skip(reason):
    print(f"skipped: {reason}", file=sys.stderr)
    sys.exit(77)


class Probe:
    def __init__(self, program, simulator, transport):
        self.process = subprocess.Popen([program, simulator, transport, "sleep", str(PERIOD_US)],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        first = self.process.stdout.readline().split()
        if first[:1] != ["thread"]:
            sys.exit("the probe did not start")
        self.thread = first[1]

    def ask(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        pairs = (word.split("=") for word in self.process.stdout.readline().split())
        return {name: float(value) for name, value in pairs}

    def end(self):
        self.process.stdin.close()
        return self.process.wait(timeout=120)


def trace(probe, log):
    """Counters before and after, with the thread traced for all of the time between."""
    strace = subprocess.Popen(["strace", "-p", probe.thread, "-o", log],
                              stderr=subprocess.PIPE, text=True)
    said = strace.stderr.readline()
    if "attached" not in said:
        strace.wait()
        return None, None, said.strip()
    time.sleep(0.2)
    before = probe.ask()
    time.sleep(SECONDS)
    after = probe.ask()
    strace.send_signal(signal.SIGINT)
    strace.wait()
    return before, after, ""


def names(log):
    with open(log, encoding="ascii", errors="replace") as lines:
        found = (re.match(r"(\w+)\(", line) for line in lines)
        return collections.Counter(m.group(1) for m in found if m)


def main():
    program, simulator, transport = sys.argv[1:]
    if not shutil.which("strace"):
        skip("strace is not installed")
    probe = Probe(program, simulator, transport)
    with tempfile.NamedTemporaryFile() as log:
        before, after, refused = trace(probe, log.name)
        seen = names(log.name)
    status = probe.end()
    if before is None:
        skip(f"strace may not trace here: {refused}")
    delta = {name: after[name] - before[name] for name in before}
    total = sum(seen.values())
    allowed = 2 * delta["cycles"] + delta["received"] + 2 * delta["resent"]
    print(f"{transport}: {delta['cycles']:.0f} cycles, {delta['received']:.0f} replies, "
          f"{delta['calls']:.0f} calls counted, {delta['calls'] / delta['cycles']:.2f} a cycle; "
          f"strace: {total} {dict(seen)}")
    faults = []
    if status:
        faults.append(f"the probe ended with {status}")
    if delta["cycles"] < 20:
        faults.append("hardly any cycle was seen")
    if transport == "io_uring" and delta["calls"] > allowed:
        faults.append(f"{delta['calls']:.0f} calls are more than the {allowed:.0f} allowed")
    # strace saw the time before and after as well, some tenths of a second
    if not delta["calls"] <= total <= delta["calls"] * 1.5 + 1000:
        faults.append(f"strace saw {total} calls, the thread counted {delta['calls']:.0f}")
    known = {"clock_nanosleep", "io_uring_enter", "ppoll", "sendmmsg", "recvmmsg", "restart_syscall"}
    if set(seen) - known:
        faults.append(f"calls that do not belong there: {sorted(set(seen) - known)}")
    print("\n".join(faults))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
