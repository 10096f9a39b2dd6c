# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeys-guard beside a contender: what it needs around it, and its counters."""
import contextlib
import ctypes
import os
import pathlib
import subprocess
import time

from figures import Skip

STATUS = pathlib.Path("/run/pokeys-guard/status")
MOUNTS = (("sysfs", "/sys"), ("bpf", "/sys/fs/bpf"), ("tmpfs", "/run"))
MNT_DETACH = 2
SET_CHECKSUMS = """
import array, fcntl, socket, struct, sys
value = array.array("B", struct.pack("II", 0x17, int(sys.argv[2])))  # ETHTOOL_STXCSUM
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
    fcntl.ioctl(s, 0x8946, struct.pack("16sP", sys.argv[1].encode(), value.buffer_info()[0]))
"""


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise Skip(f"{' '.join(str(w) for w in words)}: {(done.stderr or done.stdout).strip()}")


def need_guard(bench):
    """Skip with the reason if it cannot be run here."""
    if not (bench.build / "guard/pokeys-guard").exists():
        raise Skip("pokeys-guard was not built")
    if os.geteuid() != 0:
        raise Skip("needs root, for BPF")


@contextlib.contextmanager
def whole_checksums(bench):
    """The device's kernel leaves them to a card, which a veth is not; AF_XDP looks at them."""
    def let_the_card(value):
        run(*bench.there, "/usr/bin/python3", "-c", SET_CHECKSUMS, bench.network.far_interface, value)
    let_the_card("0")
    try:
        yield
    finally:
        let_the_card("1")


@contextlib.contextmanager
def mounts():
    """/sys of our network, a bpf file system, a /run for the guard; only we see them."""
    libc, made = ctypes.CDLL(None, use_errno=True), []
    try:
        for kind, path in MOUNTS:
            run("mount", "-t", kind, kind, path)
            made.append(path)
        yield
    finally:
        for path in reversed(made):
            libc.umount2(path.encode(), MNT_DETACH)


@contextlib.contextmanager
def guard(bench):
    """With the configuration that was written last. Its counters go into what is yielded, when it ends."""
    result = {}
    bench.spawn("pokeys-guard", bench.build / "guard/pokeys-guard", "-c", bench.run / "pokeysd.conf", "run")
    bench.prefer("pokeys-guard")
    bench.wait_for("the guard", STATUS.exists, 30, "pokeys-guard")
    try:
        yield result
    finally:
        time.sleep(0.6)  # it writes four times a second
        text = STATUS.read_text(encoding="utf-8")
        result.update(line.split(" ", 1) for line in text.splitlines())
        bench.stop("pokeys-guard")
