#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks which units a package upgrade restarts, with a fake systemctl that records its arguments.

usage: restart_if_idle.py SOURCE
"""
import os
import pathlib
import subprocess
import sys
import tempfile

SYSTEMCTL = """#!/bin/sh
case $1 in
--quiet) case " $RUNNING " in *" $3 "*) exit 0 ;; esac; exit 3 ;;
show) printf '%s\\n' "$STATUS" ;;
*) echo "$*" >>"$ASKED" ;;
esac
"""
BOTH = "pokeys-guard.service pokeysd.service"
RELOADED = "daemon-reload\n"
RESTARTED = f"{RELOADED}restart {BOTH}\n"
CASES = (
    # running, status of the daemon, what systemctl is asked for, what is said
    ("", "", RELOADED, ""),
    (BOTH, "mill running, 212 us", RESTARTED, ""),
    (BOTH, "mill running (safe state), 212 us; lathe lost: no answer", RESTARTED, ""),
    (BOTH, "iron searching", RESTARTED, ""),
    (BOTH, "mill running, machine on, 212 us", RELOADED,
     f"the old version keeps running. When all machines are off, run: sudo systemctl restart {BOTH}"),
    (BOTH, "mill running, 212 us; lathe running, a motor on, 98 us", RELOADED, "a machine, a motor or a heater is on"),
    (BOTH, "printer running, a heater on, 212 us", RELOADED, "a machine, a motor or a heater is on"),
    (BOTH, "", RELOADED, "the daemon's status does not show whether a machine is on"),
    (BOTH, "mill running, 212 us; lathe not published yet", RELOADED, "the daemon's status does not show whether a machine is on"),
    (BOTH, "bringing the devices to their safe state", RELOADED, "the daemon's status does not show whether a machine is on"),
    ("pokeysd.service", "mill running, 212 us", f"{RELOADED}restart pokeysd.service\n", ""),
    # without the daemon, no device is commanded
    ("pokeys-guard.service", "", f"{RELOADED}restart pokeys-guard.service\n", ""),
)


def main():
    script = pathlib.Path(sys.argv[1]) / "debian/restart-if-idle"
    faults = 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "systemctl").write_text(SYSTEMCTL, encoding="utf-8")
        (folder / "systemctl").chmod(0o755)
        for running, status, wanted, line in CASES:
            asked = folder / "asked"
            asked.write_text("", encoding="utf-8")
            done = subprocess.run((script, *BOTH.split()), capture_output=True, text=True, check=False,
                                  env=os.environ | {"PATH": f"{folder}:{os.environ['PATH']}", "RUNNING": running,
                                                    "STATUS": status, "ASKED": str(asked)})
            found = asked.read_text(encoding="utf-8")
            right = line in done.stdout if line else not done.stdout
            if done.returncode or done.stderr or found != wanted or not right:
                print(f"running {running!r}, status {status!r}: asked for {found!r}, said {done.stdout!r}"
                      f" {done.stderr!r}, status {done.returncode}")
                faults += 1
    print(f"{len(CASES)} cases, {faults} faults")
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
