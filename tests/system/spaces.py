# SPDX-License-Identifier: GPL-2.0-or-later
"""Networks of a test's own: name spaces in which it may pull cables and set addresses."""
import os
import subprocess
import sys

from house import main, run, wait_for


def ip(*words):
    """What this command of ip(8) prints."""
    out = run("ip", *words)
    assert out.returncode == 0, (words, out)
    return out.stdout


def start_far(house, name, address, serial):
    """A simulated device in the name space `name`."""
    control = house.folder / f"{name}.sock"
    with open(house.folder / "sim.log", "ab") as log:
        child = subprocess.Popen(["ip", "netns", "exec", name, house.programs["pokeys-sim"], "--address", address,
                                  "--serial", str(serial), "--control", control, "--quiet"],
                                 stdout=log, stderr=log, stdin=subprocess.DEVNULL)
    house.children.append(child)
    wait_for("the simulator", control.exists)
    child.control = control
    return child


def why_not():
    """What is missing to run this, or None. Makes the mounts."""
    if os.geteuid() != 0:
        return "needs root, for name spaces"
    for command in (("mount", "-t", "tmpfs", "run", "/run"), ("ip", "link", "add", "try", "type", "bridge"),
                    ("ip", "link", "del", "try")):
        try:
            out = run(*command)
        except FileNotFoundError as missing:
            return str(missing)
        if out.returncode:
            return f"{' '.join(command)}: {out.stderr.strip()}"
    return None


def begin(make_network, module):
    """Run the tests of this module in name spaces of their own; the exit status."""
    os.environ["PATH"] += ":/usr/sbin:/sbin"
    if os.environ.pop("POKEYS_INSIDE", None) is None:
        out = run("unshare", "--mount", "--net", "true")
        if out.returncode:
            print(f"skipped: no name spaces here: {out.stderr.strip()}", file=sys.stderr)
            return 77
        os.environ["POKEYS_INSIDE"] = "1"
        os.execvp("unshare", ["unshare", "--mount", "--net", sys.executable, *sys.argv])
    reason = why_not()
    if reason:
        print(f"skipped: {reason}", file=sys.stderr)
        return 77
    make_network()
    return main(module)
