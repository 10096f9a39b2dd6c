#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""./run demo --web: the page is where the last line says, shows the demo moving from outside of its
network namespace, and ends with it on Ctrl-C.

usage: demo.py SOURCE BUILD MODULE.so
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import time
import urllib.request

SOURCE, BUILD, MODULE = map(pathlib.Path, sys.argv[1:])
PATIENCE = 180
NEEDED = "aiohttp", "prometheus_client"


def start(seconds):
    return subprocess.Popen(
        ["/usr/bin/python3", "-B", SOURCE / "scripts/listen", "18580", SOURCE / "scripts/hal-isolated", "--module",
         MODULE.resolve(), "--keep", BUILD, "--network", "/usr/bin/python3", "-B", SOURCE / "scripts/demo.py",
         "--build", BUILD, "--seconds", str(seconds), "--web"],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))


def ask(address):
    with urllib.request.urlopen(address, timeout=PATIENCE) as answer:
        return answer.read()


def until(child, pattern):
    """The lines up to one that fits, and the match."""
    for line in child.stdout:
        if found := re.match(pattern, line):
            return found
    raise AssertionError((child.wait(PATIENCE), child.stderr.read()))


def main():
    ran = subprocess.run(["/usr/bin/python3", "-c", f"import {', '.join(NEEDED)}"], check=False, capture_output=True)
    if ran.returncode:
        print("not tried: python3-aiohttp or python3-prometheus-client is not installed", file=sys.stderr)
        return 77
    child = start(2)
    try:
        first = child.stdout.readline()
        if not first and child.wait(PATIENCE) == 77:
            print(f"not tried: {child.stderr.read().strip()}", file=sys.stderr)
            return 77
        assert re.fullmatch(r"the page is at http://127\.0\.0\.1:185\d\d/\n", first), first
        until(child, "demo: ok ")
        address = until(child, r"demo: (http://\S+/) shows it moving; Ctrl-C ends it")[1]
        assert b"<title>PoKeys" in ask(address)
        seen, end_at = set(), time.monotonic() + PATIENCE
        while len(seen) < 20:
            device = json.loads(ask(f"{address}api/devices/demo"))
            assert time.monotonic() < end_at, (seen, device)
            seen.add(device["values"].get("joint.00.counts"))
            time.sleep(0.05)
        os.killpg(child.pid, signal.SIGINT)
        out, err = child.communicate(timeout=PATIENCE)
        assert (child.returncode, out, err) == (130, "", ""), (child.returncode, out, err)
    finally:
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
    print(f"{len(seen)} positions")
    return 0


if __name__ == "__main__":
    sys.exit(main())
