# SPDX-License-Identifier: GPL-2.0-or-later
"""A real LinuxCNC HAL and a daemon of nothing but shared memory, for tests.

The HAL runs in namespaces of its own (scripts/hal-isolated) with pokeys_shm
from the build folder; a shell inside takes commands. Everything ends with the
test, however that ends.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import traceback

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
import safety  # noqa: E402  pylint: disable=wrong-import-position

MARK = "=== status"
PIN_TURNS = 2 * 32      # BINDING_TURNS, once begun and once whole


def skip(why):
    print(why, file=sys.stderr)
    sys.exit(77)


def wait(what, condition, limit=60):
    """Until it holds; how long that took, or AssertionError."""
    began = time.monotonic()
    while not condition():
        assert time.monotonic() < began + limit, f"not within {limit} s: {what}"
        time.sleep(0.01)
    return time.monotonic() - began


class Hal:
    """`run(line)` gives (status, stdout); stderr goes to a file, see `said()`."""

    def __init__(self, module, folder):
        self.folder = pathlib.Path(folder)
        self.errors = self.folder / "hal.err"
        with open(self.errors, "wb") as errors:
            self.shell = subprocess.Popen(
                [str(ROOT / "scripts/hal-isolated"), "--module", module, "--keep", str(folder),
                 "bash", "--norc"],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, text=True, bufsize=1)
        try:
            self.run("true")
        except (EOFError, BrokenPipeError):
            if self.shell.wait() == 77:
                skip(self.said())
            raise

    def run(self, line, limit=120):
        """Run a line in the inner shell; after `limit` s, kill the shell and everything in it."""
        hangs = threading.Timer(limit, self.shell.kill)
        hangs.start()
        try:
            return self._run(line)
        finally:
            hangs.cancel()

    def _run(self, line):
        self.shell.stdin.write(f"{line}\nprintf '\\n%s %d\\n' '{MARK}' $?\n")
        out = []
        while True:
            read = self.shell.stdout.readline()
            if not read:
                raise EOFError(f"the HAL ended at: {line}\n{self.said()}")
            if read.startswith(MARK):
                return int(read.split()[-1]), "".join(out).strip()
            out.append(read)

    def ok(self, line):
        status, out = self.run(line)
        assert status == 0, f"{line}: status {status}\n{out}\n{self.said()}"
        return out

    def said(self):
        return self.errors.read_text(errors="replace")

    def start(self, *parameters, threads=True):
        """Load the module, run its functs in a 1 ms thread."""
        if threads:
            self.ok("halcmd loadrt threads name1=servo-thread period1=1000000")
        self.ok("halcmd loadrt pokeys_shm " + " ".join(parameters))
        self.ok("halcmd addf pokeys.0.read servo-thread && halcmd addf pokeys.0.write servo-thread")
        self.ok("halcmd start")

    def get(self, name, device=0):
        return self.value(f"pokeys.{device}.{name}")

    def value(self, name):
        text = self.ok(f"halcmd getp {name}")
        return {"TRUE": True, "FALSE": False}.get(text) if text in ("TRUE", "FALSE") else float(text)

    def set(self, name, value):
        self.ok(f"halcmd setp pokeys.0.{name} {value}")

    def becomes(self, name, value, limit=60, device=0):
        """Wait until a pin has the value, or one that a function likes; how long it took, or
        AssertionError."""
        began = time.monotonic()
        while True:
            have = self.get(name, device)
            if value(have) if callable(value) else have == value:
                return time.monotonic() - began
            wanted = "as wanted" if callable(value) else value
            assert time.monotonic() < began + limit, \
                f"{name} is {have}, not {wanted}, after {limit} s"

    def says(self, text, after=0):
        """Wait until the HAL has printed this; the first `after` characters do not count."""
        wait(f"it says: {text}", lambda: text in self.said()[after:])

    def periods(self):
        """The HAL's thread has taken what is set now: what is set later is another value."""
        for _ in range(2):
            begin = self.get("age-us")
            self.becomes("age-us", lambda have, begin=begin: have != begin)

    def clean_up(self):
        """What a killed rtapi_app leaves, as a user does."""
        self.ok("while pidof rtapi_app >/dev/null; do sleep 0.02; done; halrun -U")

    def pid(self):
        return self.ok("pidof rtapi_app")

    def close(self):
        self.shell.stdin.close()
        self.shell.wait()


class Host:
    """tests/halbridge/host.c: a state image that is moved by hand."""

    def __init__(self, program, runtime, device="mill"):
        self.child = subprocess.Popen([program, str(runtime), device], stdin=subprocess.PIPE,
                                      stdout=subprocess.PIPE, text=True, bufsize=1)
        assert self.child.stdout.readline() == "ready\n"

    def say(self, line):
        self.child.stdin.write(line + "\n")
        answer = self.child.stdout.readline().strip()
        assert answer != "?", f"host does not know: {line}"
        return answer

    def command(self):
        """The newest command image as a dict of strings."""
        return dict(word.split("=", 1) for word in self.say("show").split())

    def sees(self, key, value, limit=60):
        end = time.monotonic() + limit
        while self.command()[key] != value:
            assert time.monotonic() < end, f"{key} is {self.command()[key]}, not {value}"
            time.sleep(0.005)

    def beats(self, count):
        """The commander has read and written so often since: each pin has had its turn after
        PIN_TURNS of it."""
        begin = int(self.command()["heartbeat"])
        wait(f"{count} heartbeats", lambda: int(self.command()["heartbeat"]) - begin >= count)

    def kill(self):
        self.child.kill()
        self.child.wait()

    def close(self):
        if self.child.poll() is None:
            self.say("quit")
        self.child.wait()


class Rig:
    """A folder, a HAL in it, and hosts that are ended with it."""

    def __init__(self, module, program):
        # not where TMPDIR says: the path must be short, sockets live below it
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="pokeys-hal-", dir="/tmp"))
        self.folder.chmod(0o755)
        self.runtime = self.folder / "run"
        self.runtime.mkdir()
        self.program, self.hosts = program, []
        try:
            self.hal = Hal(module, self.folder)
        except BaseException:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise

    def host(self, device="mill"):
        self.hosts.append(Host(self.program, self.runtime, device))
        return self.hosts[-1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.hal.close()
        for host in self.hosts:
            if host.child.poll() is None:
                host.kill()
        shutil.rmtree(self.folder, ignore_errors=True)


def main(tests):
    """Run each test in a rig of its own: TESTS MODULE.so HOST-PROGRAM [PATTERN]."""
    module, program = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    pattern = sys.argv[3] if len(sys.argv) > 3 else ""
    faults = []
    for test in tests:
        if not re.search(pattern, test.__name__):
            continue
        with Rig(module, program) as rig:
            try:
                test(rig)
                print(f"ok: {test.__name__}")
            except (AssertionError, EOFError) as fault:
                faults.append(fault)
                print(f"FAILED: {test.__name__}: {fault}\n{traceback.format_exc()}{rig.hal.said()[-4000:]}")
    sys.exit(safety.status(faults))
