#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""What pokeysctl doctor asks the kernel itself (ethtool's ioctls, netlink, routes,
sysfs), in a network namespace with a pair of interfaces of its own. The made-up
trees of doctor.py cannot show whether those questions are put right."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

CONF = "[daemon]\ncpu = 0\n[device near]\naddress = 10.1.0.2\n[device far]\naddress = 10.9.0.2\n"
NEIGHBOUR = ["ip", "neighbour", "replace", "10.1.0.2", "lladdr", "02:00:00:00:00:02", "dev", "nic", "nud"]


def sh(*words):
    subprocess.run(words, check=True, timeout=120)


def look(program, conf):
    out = subprocess.run([program, "doctor", "--json", "--config", conf, "-r", "/nowhere"],
                         capture_output=True, text=True, timeout=120, check=False)
    assert out.stderr == "", out.stderr
    return {(f["check"], f["subject"]): f for f in json.loads(out.stdout)["findings"]}


def inside(program, conf):
    sh("mount", "-t", "sysfs", "none", "/sys")
    sh("ip", "link", "set", "lo", "up")
    sh("ip", "link", "add", "nic", "type", "veth", "peer", "name", "peer")
    sh("ip", "address", "add", "10.1.0.1/24", "dev", "nic")
    sh("ip", "link", "set", "nic", "up")

    found = look(program, conf)
    assert found["nic-link", "nic"]["verdict"] == "problem", found["nic-link", "nic"]
    assert found["route", "far"]["verdict"] == "problem" and found["neighbour", "far"]["verdict"] == "unknown"
    sh("ip", "link", "set", "peer", "up")
    sh("ip", "route", "add", "default", "via", "10.1.0.7")
    found = look(program, conf)
    assert found["nic-link", "nic"]["verdict"] == "ok", found["nic-link", "nic"]
    assert found["route", "near"]["why"] == "directly at nic", found["route", "near"]
    assert found["route", "far"]["verdict"] == "advice", found["route", "far"]
    assert sum(1 for check, _ in found if check == "nic-link") == 1, "one interface, judged once"

    # whatever this driver answers: it was asked, and the answer understood
    assert found["nic-offloads", "nic"]["verdict"] in ("ok", "advice"), found["nic-offloads", "nic"]
    assert found["nic-queues", "nic"]["verdict"] in ("ok", "advice"), found["nic-queues", "nic"]

    words = {"none": "no complete entry", "permanent": "permanent", "stale": "stale",
             "reachable": "not permanent", "failed": "does not answer"}
    for state, text in words.items():
        if state != "none":
            sh(*NEIGHBOUR, state)
        finding = look(program, conf)["neighbour", "near"]
        assert text in finding["why"], (state, finding)
        wanted = {"permanent": "ok", "failed": "problem"}.get(state, "advice")
        assert finding["verdict"] == wanted, (state, finding)
        if state in ("stale", "reachable"):
            sh(*finding["mend"].split())
            assert look(program, conf)["neighbour", "near"]["verdict"] == "ok", finding
    print(f"{len(found)} findings, {len(words)} states of a neighbour")


def main():
    if sys.argv[1] == "--inside":
        return inside(*sys.argv[2:])
    probe = subprocess.run(["unshare", "--net", "--mount", "mount", "-t", "sysfs", "none", "/sys"],
                           capture_output=True, text=True, check=False)
    if probe.returncode:
        print(f"no namespace of my own: {probe.stderr.strip()}", file=sys.stderr)
        return 77
    with tempfile.TemporaryDirectory() as folder:
        conf = pathlib.Path(folder) / "pokeysd.conf"
        conf.write_text(CONF)
        return subprocess.run(["unshare", "--net", "--mount", sys.executable, __file__, "--inside",
                               os.path.abspath(sys.argv[1]), conf], timeout=120, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
