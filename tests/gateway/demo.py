#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""./run demo --web prints a part: the page and the console are where the first line says, show it from outside of its network
namespace, and end with it on Ctrl-C.

usage: demo.py SOURCE BUILD MODULE.so
"""
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request

SOURCE, BUILD, MODULE = map(pathlib.Path, sys.argv[1:])
PATIENCE = 180
NEEDED = "aiohttp", "prometheus_client"
# as a slicer writes it, but the simulated hot end is there soon
PART = """M104 S30
G28
M83
G1 Z0.4 F600
M109 S30
G92 E0
{sides}
M104 S0
G91
G1 Z5 F600
G90
M84
"""
SIDES = 40


def start(part):
    return subprocess.Popen(
        ["/usr/bin/python3", "-B", SOURCE / "scripts/listen", "page=18580", "telnet=12323", "--",
         SOURCE / "scripts/hal-isolated", "--module", MODULE.resolve(), "--keep", BUILD, "--keep", part.parent, "--network",
         "/usr/bin/python3", "-B", SOURCE / "scripts/print_part.py", "--build", BUILD, "--file", part,
         "--judge"],
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


def watch(page, console):
    """From the page and from telnet, while it is printed: where the axes were, and how far the job was."""
    seen, bytes_done, end_at = set(), set(), time.monotonic() + PATIENCE
    with console.makefile("r") as said:
        while len(seen) < 10 or len(bytes_done) < 3:
            values = json.loads(ask(f"{page}api/devices/printer"))["values"]
            seen.add(values["joint.00.counts"])
            console.sendall(b"M27\n")
            while not (line := said.readline()).startswith("ok"):
                if found := re.match(r"SD printing byte (\d+)/", line):
                    bytes_done.add(found[1])
            assert time.monotonic() < end_at, (seen, bytes_done)
            time.sleep(0.05)
    return len(seen)


def main():
    ran = subprocess.run(["/usr/bin/python3", "-c", f"import {', '.join(NEEDED)}"], check=False, capture_output=True)
    if ran.returncode:
        print("not tried: python3-aiohttp or python3-prometheus-client is not installed", file=sys.stderr)
        return 77
    with tempfile.TemporaryDirectory() as folder:
        part = pathlib.Path(folder) / "box.gcode"
        corners = (60, 40), (60, 60), (40, 60), (40, 40)
        part.write_text(PART.format(sides="\n".join(
            "G1 X{} Y{} E0.5 F2400".format(*corners[i % 4]) for i in range(SIDES))), encoding="utf-8")
        return show(start(part))


def show(child):
    try:
        first = child.stdout.readline()
        if not first and child.wait(PATIENCE) == 77:
            print(f"not tried: {child.stderr.read().strip()}", file=sys.stderr)
            return 77
        found = re.fullmatch(r"the page is at (http://127\.0\.0\.1:185\d\d/), the console at telnet 127\.0\.0\.1 (123\d\d)\n", first)
        assert found, first
        assert b"<title>PoKeys" in ask(found[1])
        with socket.create_connection(("127.0.0.1", int(found[2])), PATIENCE) as console:
            seen = watch(found[1], console)
        # each line was done once
        until(child, rf"demo: ok moves={SIDES + 2} ")
        until(child, "demo: it is printed again and again; Ctrl-C ends it")
        os.killpg(child.pid, signal.SIGINT)
        out, err = child.communicate(timeout=PATIENCE)
        assert (child.returncode, out, err) == (130, "", ""), (child.returncode, out, err)
    finally:
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
    print(f"{seen} positions")
    return 0


if __name__ == "__main__":
    sys.exit(main())
