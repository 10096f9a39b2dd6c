#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Daemon, LinuxCNC and device each die again and again while the others run.

POKEYS_ROUNDS sets how often each of them dies (default 10). The durations are printed
for information; the tests only assert that each event happens. These tests assert time
limits in virtual time: `halbridge / link`, `device / outputs`, `device / life`.
"""
import json
import os
import pathlib
import select
import statistics
import subprocess
import sys
import time

from house import PATIENCE, House, Skip, end, equal, main, rng, shared_memory, wait_for
from safety import safety

ROOT = pathlib.Path(__file__).resolve().parents[2]
WATCH = pathlib.Path(__file__).with_name("survive_watch.py")
ROUNDS = int(os.environ.get("POKEYS_ROUNDS", "10"))
OUT = 31  # terminal; HAL's pin.30

sys.dont_write_bytecode = True


class Hal:
    """LinuxCNC's HAL with the watcher in it; dies as a whole."""

    def __init__(self, house):
        module = House.programs["pokeys_shm.so"]
        self.errors = house.folder / "hal.log"
        self.log = open(self.errors, "ab")
        self.child = subprocess.Popen(
            [ROOT / "scripts/hal-isolated", "--module", module, "--keep", house.folder,
             "/usr/bin/python3", "-B", WATCH, house.runtime, str(OUT - 1)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.log, bufsize=0)
        house.children.append(self.child)
        self.events, self.rest = [], b""

    def read(self, seconds):
        """Take what it says into self.events; True if something came."""
        if not select.select([self.child.stdout], [], [], seconds)[0]:
            return False
        data = os.read(self.child.stdout.fileno(), 65536)
        if not data:
            if self.child.wait() == 77:
                raise Skip("an isolated HAL is not permitted here")
            raise AssertionError("the HAL ended by itself")
        *lines, self.rest = (self.rest + data).split(b"\n")
        self.events += [json.loads(line) for line in lines]
        return True

    def wait(self, after, limit, **what):
        """The first event after a time that has these values; its delay. 0 if the pin has had
        the value before and keeps it: data are stale now and then on a busy machine."""
        deadline = time.monotonic() + limit
        while True:
            for event in self.events:
                if event["t"] >= after and what.items() <= event.items():
                    return event["t"] - after
            last = [event for event in self.events if event.get("pin") == what["pin"]][-1:]
            if not self.read(0.1) and last and last[0]["t"] < after and what.items() <= last[0].items():
                return 0.0
            assert time.monotonic() < deadline, f"{what}: not within {limit} s; {self.said()}"

    def said(self):
        return f"the HAL said {self.events[-3:]} {self.errors.read_text(errors='replace')[-600:]}"

    def ask(self):
        self.events.clear()
        self.child.stdin.write(b"?\n")
        deadline = time.monotonic() + PATIENCE
        while not (found := [event for event in self.events if "pid" in event]):
            assert time.monotonic() < deadline, f"no answer within {PATIENCE} s; {self.said()}"
            self.read(1)
        return found[0]

    def kill(self):
        self.child.kill()
        self.child.wait()
        self.log.close()


def summary(what, seconds):
    """Print the figures. 0 s is ignored: the pin had that value already."""
    ms = sorted(1000 * s for s in seconds if s > 0)
    assert ms, f"{what}: never seen"
    print(f"{what}: {len(ms)} times, median {statistics.median(ms):.1f} ms, most {ms[-1]:.1f} ms")


def start(house, *options):
    house.device_keys["mill"] |= {"digital-outputs": OUT, "heartbeat-timeout-ms": 50}
    sim = house.start_sim("--preset", "demo", *options)
    return sim, house.start_daemon()


def test_the_daemon_is_killed_while_linuxcnc_runs():
    before = shared_memory()
    with House() as house:
        _, daemon = start(house)
        hal = Hal(house)
        hal.wait(0, PATIENCE, pin="connected", value=True)
        first = hal.ask()
        stale, fresh = [], []
        for _ in range(ROUNDS):
            time.sleep(rng.random() * 0.2)
            killed = time.monotonic()
            daemon.kill()
            daemon.wait()
            stale.append(hal.wait(killed, PATIENCE, pin="stale", value=True))
            began = time.monotonic()
            daemon = house.start_daemon(wait=False)
            fresh.append(hal.wait(began, PATIENCE, pin="connected", value=True))
        last = hal.ask()
        assert last["pid"] == first["pid"] != 0, "rtapi_app is another one"
        assert last["beats"] > first["beats"], "the servo thread stands"

        def has_not_grown():    # it has some more for a moment, when it looks for a daemon
            now = hal.ask()
            return (now["descriptors"] <= first["descriptors"] and
                    now["maps"] <= first["maps"] + 4)
        wait_for(f"no more descriptors and mappings than {first}", has_not_grown, say=hal.said)
        end(daemon)
        left = {path.name for path in house.runtime.iterdir()} - {"lock"}
        assert not left, f"left in the runtime folder: {left}"
        hal.kill()
        summary("pins stale after the daemon's death", stale)
        summary("pins fresh after its start", fresh)
    left = shared_memory() - before
    assert not left, f"left in /dev/shm: {left}"


def test_linuxcnc_is_killed():
    before = shared_memory()
    with House() as house:
        sim, _ = start(house)
        safe = []
        for _ in range(ROUNDS):
            hal = Hal(house)
            hal.wait(0, PATIENCE, pin="connected", value=True)
            wait_for("the output on", lambda: "latch=1" in house.ask_sim(sim, "pin", OUT))
            killed = time.monotonic()
            hal.kill()
            with safety():
                wait_for("the output off", lambda: "latch=0" in house.ask_sim(sim, "pin", OUT))
            safe.append(time.monotonic() - killed)
        summary("outputs in the safe state after LinuxCNC's death", safe)
    left = shared_memory() - before
    assert not left, f"left in /dev/shm: {left}"


def test_the_device_reboots():
    boot_s = 0.4
    with House() as house:
        sim, daemon = start(house, "--boot-ms", str(int(boot_s * 1000)))
        hal = Hal(house)
        hal.wait(0, PATIENCE, pin="connected", value=True)
        again = []
        for number in range(ROUNDS):
            time.sleep(rng.random() * 0.2)
            # before it is told: it may be back before whoever told it has ended
            began = time.monotonic()
            house.ask_sim(sim, "reboot", "lose-config" if number % 2 else "keep-config")
            hal.wait(began, PATIENCE, pin="connected", value=False)
            again.append(hal.wait(began + boot_s, PATIENCE, pin="connected", value=True))
        equal(daemon.poll(), None, house.log())
        hal.kill()
        summary("pins fresh after the device answers again", again)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
