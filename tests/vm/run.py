#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Boot a PREEMPT_RT kernel with systemd in a virtual machine and run a script in it.

    run.py BUILD service   guest.sh, two processors: that everything happens
    run.py BUILD card      guest-card.sh, the same with network cards: drivers with
                           interrupts, queues and XDP of their own
    run.py BUILD packages  guest-packages.sh, the Debian packages in a system that LinuxCNC
                           is installed in: first start, doctor --fix, upgrade, removal
    run.py BUILD timing    guest-timing.sh, one processor that counts instructions:
                           how long it takes, the same in each run; judged by timing.py

BUILD is the build folder. The disk is in BUILD/vm, built once a week or when image.sh
changes; results and histograms stay in BUILD/vm/service and so on. All but timing
use KVM if the processor has it and the virtual machine finishes with it; otherwise they are
emulated. Prints each check of the script; status 77 with the reason where it
cannot run.
"""
import datetime
import fcntl
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys

import timing

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from safety import UNSAFE  # noqa: E402  pylint: disable=wrong-import-position

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
NEEDS = {"qemu-system-x86_64": "qemu-system-x86", "mmdebstrap": "mmdebstrap", "mke2fs": "e2fsprogs"}
FILES = ("disk.ext4", "vmlinuz", "initrd")
KERNEL = ("root=/dev/vda rw console=ttyS0 quiet loglevel=3 panic=-1 mitigations=off tsc=reliable "
          "systemd.show_status=no")
ISOLATED = " isolcpus=managed_irq,domain,1 nohz_full=1 rcu_nocbs=1"
# two to four minutes on a host that has nothing else to do
KVM_SECONDS, SECONDS = 300, 1700


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


def image(folder, packages):
    """The folder with disk, kernel and initrd; made if it is not there. One is for packages: LinuxCNC is
    installed there with all that it depends on."""
    kind = "packages" if packages else "image"
    week = "-".join(str(part) for part in datetime.date.today().isocalendar()[:2])
    key = hashlib.sha256((HERE / "image.sh").read_bytes() + week.encode()).hexdigest()[:16]
    made = folder / f"{kind}-{key}"
    if all((made / name).exists() for name in FILES):
        return made
    for old in folder.glob(f"{kind}-*"):
        shutil.rmtree(old)
    print("making the disk of the virtual machine", flush=True)
    new = folder / f"{kind}-new"
    with open(folder / "image.log", "wb") as log:
        done = subprocess.run([HERE / "image.sh", new, kind], stdout=log, stderr=log, check=False)
    if done.returncode:
        lines = (folder / "image.log").read_text(errors="replace").strip().splitlines()
        skip(f"the disk could not be made: {lines[-1] if lines else done.returncode}; see {folder}/image.log")
    new.rename(made)
    return made


def next_version(packages, to):
    """The same packages with a higher version, as another build would be."""
    for package in packages.glob("*.deb"):
        tree = to / "tree"
        subprocess.run(["dpkg-deb", "--raw-extract", package, tree], check=True)
        control = tree / "DEBIAN/control"
        text = control.read_text(encoding="utf-8")
        version = re.search(r"^Version: (.*)$", text, re.MULTILINE)[1]
        control.write_text(text.replace(version, f"{version}+next1"), encoding="utf-8")
        made = to / package.name.replace("-1_", "-1+next1_")
        subprocess.run(["dpkg-deb", "--root-owner-group", "--build", tree, made], check=True,
                       stdout=subprocess.DEVNULL)
        shutil.rmtree(tree)


def put_packages(folder):
    """Those of the newest commit, and the next version of them."""
    with open(folder / "package.log", "wb") as log:
        done = subprocess.run([ROOT / "scripts/package", "--output", folder / "made"], stdout=log, stderr=log,
                              check=False)
    if done.returncode:
        sys.exit(f"FAIL the packages could not be built; see {folder}/package.log")
    for name in ("first", "next"):
        (folder / "in/packages" / name).mkdir(parents=True)
    for package in (folder / "made").glob("*.deb"):
        if "-dbgsym_" not in package.name:
            shutil.copy(package, folder / "in/packages/first")
    next_version(folder / "in/packages/first", folder / "in/packages/next")


def shares(build, folder, script, packages):
    """What the guest sees: /in with the installed tree or the packages and its scripts, /out empty."""
    for name in ("in", "out"):
        shutil.rmtree(folder / name, ignore_errors=True)
        (folder / name).mkdir(parents=True)
    if packages:
        put_packages(folder)
    else:
        subprocess.run(["meson", "install", "-C", str(build), "--no-rebuild", "--quiet",
                        "--destdir", str(folder / "in/install")], check=True, stdout=subprocess.DEVNULL)
    shutil.copy(HERE / "lib.sh", folder / "in")
    shutil.copy(HERE / script, folder / "in/guest.sh")


ACCELERATORS = {
    "kvm": ["-accel", "kvm", "-cpu", "host", "-smp", "2"],
    "tcg": ["-accel", "tcg,thread=multi", "-cpu", "max", "-smp", "2"],
    # an instruction takes 2^3 ns; with a second processor it hangs
    "icount": ["-accel", "tcg,thread=single", "-icount", f"shift={timing.SHIFT},sleep=off", "-cpu", "max",
               "-smp", "1"],
}


# Each hub is a cable with a card at both ends, and nothing of it leaves QEMU.
CARDS = (("near0", "virtio-net-pci", 0, "01"), ("wire0", "virtio-net-pci", 0, "02"),
         ("near1", "e1000e", 1, "03"), ("wire1", "virtio-net-pci", 1, "04"))


def cards():
    """And QEMU's monitor within the guest, as a port that it can write commands to: the two
    ends of one socket, for a monitor cannot be joined to a port otherwise."""
    words = ["-chardev", "socket,id=monitor,path=monitor,server=on,wait=off", "-mon", "chardev=monitor",
             "-chardev", "socket,id=port,path=monitor", "-device", "virtio-serial-pci",
             "-device", "virtserialport,chardev=port,name=monitor"]
    for name, model, hub, mac in CARDS:
        words += ["-netdev", f"hubport,id=at-{name},hubid={hub}",
                  "-device", f"{model},id={name},netdev=at-{name},mac=52:54:00:00:00:{mac},romfile="]
    return words


def command(disk, folder, accelerator, isolated):
    share = []
    for name, read_only in (("in", ",readonly=on"), ("out", "")):
        share += ["-virtfs", f"local,path={folder / name},mount_tag={name},security_model=none{read_only}"]
    return ["qemu-system-x86_64", *ACCELERATORS[accelerator], "-m", "1536", "-nographic", "-no-reboot",
            # the second port has a machine that says nothing
            "-serial", "mon:stdio", "-serial", "null",
            "-nic", "none", "-kernel", str(disk / "vmlinuz"), "-initrd", str(disk / "initrd"),
            "-append", KERNEL + (ISOLATED if isolated else ""), *share,
            "-drive", f"file={disk / 'disk.ext4'},format=raw,if=none,id=disk,snapshot=on",
            "-device", "virtio-blk-pci,drive=disk,num-queues=1"]


def boot(disk, folder, accelerator, seconds, more=(), isolated=True):
    """Lines of the guest's results, and whether it was ended for it took too long."""
    late = False
    with open(folder / "console.log", "wb") as console:
        try:
            subprocess.run([*command(disk, folder, accelerator, isolated), *more], stdin=subprocess.DEVNULL,
                           stdout=console, stderr=console, timeout=seconds, cwd=folder, check=False)
        except subprocess.TimeoutExpired:
            print(f"the machine ({accelerator}) was ended after {seconds} s")
            late = True
    results = folder / "out/results"
    return results.read_text(errors="replace").splitlines() if results.exists() else [], late


def has_kvm():
    flags = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").split()
    return ("vmx" in flags or "svm" in flags) and os.access("/dev/kvm", os.R_OK | os.W_OK)


def run_service(disk, folder, more=(), isolated=True, seconds=KVM_SECONDS):
    lines, late = boot(disk, folder, "kvm", seconds, more, isolated) if has_kvm() else ([], False)
    # where KVM is emulated itself, a machine may begin and crawl; one that broke down is a failure
    if not lines or (late and not any(line.startswith("FAIL") for line in lines)):
        shutil.rmtree(folder / "out")
        (folder / "out").mkdir()
        lines, _ = boot(disk, folder, "tcg", SECONDS, more, isolated)
    return lines


def run_card(disk, folder):
    return run_service(disk, folder, cards())


def run_packages(disk, folder):
    """On a computer that nobody has prepared for realtime."""
    return run_service(disk, folder, isolated=False, seconds=2 * KVM_SECONDS)


def run_timing(disk, folder):
    lines, _ = boot(disk, folder, "icount", SECONDS, isolated=False)
    if "end" not in lines or any(line.startswith("FAIL") for line in lines):
        return lines
    return lines[:-1] + timing.judge(folder) + ["end"]


TIERS = {"service": ("guest.sh", run_service), "card": ("guest-card.sh", run_card),
         "packages": ("guest-packages.sh", run_packages), "timing": ("guest-timing.sh", run_timing)}
PACKAGERS = {"dpkg-buildpackage": "dpkg-dev", "dh": "debhelper", "esbuild": "esbuild", "apt-ftparchive": "apt-utils"}


def main():
    build, tier = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2]
    script, run = TIERS[tier]
    packages = tier == "packages"
    needs = NEEDS | (PACKAGERS if packages else {})
    missing = [package for program, package in needs.items() if not shutil.which(program)]
    if missing:
        skip(f"not installed: {' '.join(missing)}")
    if os.geteuid():
        skip("only root can make the disk of the virtual machine")
    folder = build / "vm" / tier
    folder.mkdir(parents=True, exist_ok=True)
    with open(build / "vm/lock", "w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # one makes the disk, the others wait for it
        disk = image(build / "vm", packages)
        shares(build, folder, script, packages)
    lines = run(disk, folder)
    print("\n".join(lines))
    if "end" not in lines:
        print(f"FAIL the machine did not come to its end; see {folder}/console.log and {folder}/out")
        return 1
    print(f"results and histograms are in {folder}/out")
    # one that must hold on every machine is not tried again (tests/safety.py)
    if any(line.startswith("FAIL outputs_are_safe") for line in lines):
        return UNSAFE
    return 1 if any(line.startswith("FAIL") for line in lines) else 0


if __name__ == "__main__":
    sys.exit(main())
