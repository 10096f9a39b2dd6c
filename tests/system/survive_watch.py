#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Inside an isolated HAL: load pokeys_shm, switch an output on, and tell on stdout,
one line of JSON each with a CLOCK_MONOTONIC time, whenever `connected` or `stale`
changes. On a line on stdin: one line with rtapi_app's pid, descriptors and the
servo thread's count of cycles. /usr/bin/python3: LinuxCNC's module is Debian's.
"""
import json
import os
import pathlib
import subprocess
import sys
import threading
import time

import hal

RUNTIME, OUT_PIN = sys.argv[1], sys.argv[2]


one_line = threading.Lock()  # two threads tell; print writes line and newline one by one


def tell(**what):
    with one_line:
        print(json.dumps({"t": time.monotonic(), **what}), flush=True)


def halcmd(*words):
    # rtapi_app, which the first loadrt starts, must not keep our stdout open
    subprocess.run(("halcmd",) + words, stdin=subprocess.DEVNULL, stdout=sys.stderr, check=True)


def rtapi_app():
    for entry in pathlib.Path("/proc").glob("[0-9]*/comm"):
        try:
            if entry.read_text().strip() == "rtapi_app":
                return entry.parent
        except OSError:
            pass
    return None


def answer():
    for _ in sys.stdin:
        app = rtapi_app()
        tell(pid=int(app.name) if app else 0, descriptors=len(os.listdir(app / "fd")) if app else 0,
             maps=len((app / "maps").read_text().splitlines()) if app else 0,
             beats=hal.get_value("beat.0.count"))


def main():
    halcmd("loadrt", "threads", "name1=servo-thread", "period1=1000000")
    halcmd("loadrt", "pokeys_shm", "devices=mill", f"runtime={RUNTIME}")
    # counts servo cycles by itself: proof that the thread went on
    halcmd("loadrt", "charge_pump")
    halcmd("loadrt", "updown", "names=beat.0")
    halcmd("addf", "pokeys.0.read", "servo-thread")
    halcmd("addf", "charge-pump", "servo-thread")
    halcmd("addf", "beat.0", "servo-thread")
    halcmd("addf", "pokeys.0.write", "servo-thread")
    halcmd("net", "pump", "charge-pump.out", "beat.0.countup")
    halcmd("setp", f"pokeys.0.pin.{OUT_PIN}.out", "1")
    halcmd("start")
    watcher = hal.component("watch")
    watcher.ready()
    threading.Thread(target=answer, daemon=True).start()
    seen = {}
    while True:
        for pin in ("connected", "stale"):
            value = bool(hal.get_value(f"pokeys.0.{pin}"))
            if seen.get(pin) != value:
                seen[pin] = value
                tell(pin=pin, value=value)
        time.sleep(0.0005)


if __name__ == "__main__":
    main()
