#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Who may run the guard, who may ask it for a socket, and what it says if it cannot work.
Arguments: as guard.py.
"""
import errno
import os
import re
import signal
import socket
import struct
import sys

from guard import DEVICE, PINS, PORT, RUN, STATUS, STRANGER, main, program_on, send_far, sh, wait_for


def whoever_may_not_or_cannot_is_told_in_one_line(w):
    def refused(status, pattern, *before):
        out = sh(*before, w.guard_exe, "-c", w.conf, "run", check=False)
        lines = out.stderr.splitlines()
        assert out.returncode == status and len(lines) == 1 and re.search(pattern, lines[0]), out
        assert not STATUS.exists()
    w.write_conf(f"address = {DEVICE}\n")
    refused(77, "CAP_BPF.*without it.*pokeysd works on", "setpriv", "--bounding-set", "-bpf,-sys_admin,-net_admin",
            "--inh-caps", "-bpf,-sys_admin,-net_admin")
    w.write_conf("serial = 0\n")
    refused(78, "serial")
    w.conf.write_text(f"[device mill]\naddress = {DEVICE}\n")
    refused(78, "interface is not given")
    w.write_conf(f"address = {DEVICE}\n")
    # somebody else's program: it stays
    sh("bpftool", "prog", "load", w.program, "/sys/fs/bpf/other")
    for mode in ("xdpdrv", "xdpgeneric"):
        sh("bpftool", "net", "attach", mode, "pinned", "/sys/fs/bpf/other", "dev", "pk0")
        before = program_on("pk0")
        refused(69, "another XDP program is on it")
        assert before and program_on("pk0") == before
        sh("bpftool", "net", "detach", mode, "dev", "pk0")
    # nor does anybody else's take ours away
    w.start_guard()
    before = program_on("pk0")
    for words in (("attach", "xdp", "pinned", "/sys/fs/bpf/other"), ("detach", "xdp")):
        assert sh("bpftool", "net", *words, "dev", "pk0", check=False).returncode, words
    assert sh("ip", "link", "set", "pk0", "xdp", "off", check=False).returncode
    assert before and program_on("pk0") == before
    w.end_guard()
    # pins of a build with other maps
    (PINS).mkdir(exist_ok=True)
    sh("bpftool", "map", "create", PINS / "devices", "type", "array", "key", 4, "value", 8, "entries", 1,
       "name", "devices")
    w.start_guard()
    assert "another version" in w.guard.log.read_text()
    w.end_guard()
    sh("umount", "/sys/fs/bpf")
    refused(69, "is no bpf file system")
    # without a BPF file system, the folder of --pins is missing too; the error names the file system
    out = sh(w.guard_exe, "--pins", RUN / "no", "-c", w.conf, "run", check=False)
    assert out.returncode == 69 and "/sys/fs/bpf is no bpf file system" in out.stderr, out
    sh("mount", "-t", "bpf", "bpf", "/sys/fs/bpf")


def user_and_capabilities_of_the_unit_suffice(w):
    """As in the unit, the guard is not root and sees its folder of pins at another path. The next guard takes over
    what a killed guard has left."""
    nobody, place = 65534, RUN / "pins"
    w.write_conf(f"address = {DEVICE}\n", transport="xdp")
    sh("chmod", "0700", PINS.parent)
    PINS.mkdir(mode=0o750)
    place.mkdir()
    sh("mount", "--bind", PINS, place)
    for folder in (PINS, STATUS.parent):
        os.chown(folder, nobody, nobody)
    keep = "-all,+bpf,+net_admin,+perfmon,+net_raw"
    words = ["setpriv", "--reuid", nobody, "--regid", nobody, "--clear-groups", "--bounding-set", keep, "--inh-caps", keep,
             "--ambient-caps", keep, w.guard_exe, "--pins", place, "-c", w.conf]

    def start():
        STATUS.unlink(missing_ok=True)
        w.guard = w.spawn(*words, "run")
        wait_for("the guard", lambda: STATUS.exists() or w.guard.poll() is not None)
        assert w.guard.poll() is None, w.guard.log.read_text()
    (STATUS.parent / "lock").unlink(missing_ok=True)
    start()
    w.arrived()
    # root needs no --pins to read the counters
    got = w.counted(lambda: send_far(STRANGER, PORT, 50, bytes(64)), drop_foreign=50)
    assert got.get("drop_foreign") == 50 and w.arrived() == 0, got
    before = program_on("pk0")
    w.end_guard(signal.SIGKILL)
    assert before and program_on("pk0") == before
    start()
    assert w.counters()["drop_foreign"] == 50, w.counters()
    w.end_guard()
    assert not program_on("pk0") and not list(PINS.iterdir()) and not STATUS.exists()
    # what a guard that was killed has left can be removed as well
    start()
    w.end_guard(signal.SIGKILL)
    sh(*words, "remove")
    assert not program_on("pk0") and not list(PINS.iterdir())
    assert "is no bpf file system" in sh(w.guard_exe, "--pins", RUN, "-c", w.conf, "run", check=False).stderr
    assert "No such file" in sh(w.guard_exe, "--pins", RUN / "no", "-c", w.conf, "run", check=False).stderr
    sh("umount", place)
    PINS.rmdir()


def guard_with_a_socket(w):
    """Start the guard; return the path of its socket."""
    place = RUN.parent / "pokeys-guard" / "xdp"
    w.write_conf(f"address = {DEVICE}\n", transport="xdp")
    w.start_guard()
    wait_for("the socket", place.exists)
    return place


def a_socket_is_for_the_daemon_and_not_for_its_group(w):
    """Whoever may connect is sent away all the same unless it is root or the daemon's user."""
    place = guard_with_a_socket(w)
    place.chmod(0o666)
    ask = ("import socket, sys; s = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET); s.settimeout(60);"
           f"s.connect('{place}'); sys.exit(s.recv(100) != b'')")
    sh("setpriv", "--reuid", "65534", "--clear-groups", "/usr/bin/python3", "-c", ask)
    w.end_guard()


def a_daemon_of_another_version_is_told_so(w):
    place = guard_with_a_socket(w)
    for version, size in ((1, 48), (3, 400)):
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as daemon:
            daemon.settimeout(60)
            daemon.connect(str(place))
            daemon.send(struct.pack("=II", version, 1).ljust(size, b"\0"))
            assert struct.unpack("=Ii", daemon.recv(100))[1] == -errno.EPROTO, version
    w.end_guard()


CHECKS = [
    a_daemon_of_another_version_is_told_so,
    a_socket_is_for_the_daemon_and_not_for_its_group,
    whoever_may_not_or_cannot_is_told_in_one_line,
    user_and_capabilities_of_the_unit_suffice,
]

if __name__ == "__main__":
    sys.exit(main(CHECKS))
