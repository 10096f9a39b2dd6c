#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Boot a PREEMPT_RT kernel with systemd in a virtual machine and run guest.sh in it.

    run.py BUILD        BUILD is the build folder; disk and results are in BUILD/vm

The disk is built once a week, or when image.sh changes. KVM is used where the
processor has it and a machine really comes up with it; emulation does as well.
Prints each check of guest.sh; status 77 with the reason where it cannot run.
"""
import datetime
import hashlib
import os
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
NEEDS = {"qemu-system-x86_64": "qemu-system-x86", "mmdebstrap": "mmdebstrap", "mke2fs": "e2fsprogs"}
FILES = ("disk.ext4", "vmlinuz", "initrd")
KERNEL = ("root=/dev/vda rw console=ttyS0 quiet loglevel=3 panic=-1 mitigations=off tsc=reliable "
          "isolcpus=managed_irq,domain,1 nohz_full=1 rcu_nocbs=1 systemd.show_status=no")
KVM_SECONDS, SECONDS = 120, 420


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


def image(folder):
    """The folder with disk, kernel and initrd; made if it is not there."""
    week = "-".join(str(part) for part in datetime.date.today().isocalendar()[:2])
    key = hashlib.sha256((HERE / "image.sh").read_bytes() + week.encode()).hexdigest()[:16]
    made = folder / f"image-{key}"
    if all((made / name).exists() for name in FILES):
        return made
    for old in folder.glob("image-*"):
        shutil.rmtree(old)
    print("making the disk of the virtual machine", flush=True)
    new = folder / "image-new"
    with open(folder / "image.log", "wb") as log:
        done = subprocess.run([HERE / "image.sh", new], stdout=log, stderr=log, check=False)
    if done.returncode:
        lines = (folder / "image.log").read_text(errors="replace").strip().splitlines()
        skip(f"the disk could not be made: {lines[-1] if lines else done.returncode}; see {folder}/image.log")
    new.rename(made)
    return made


def shares(build, folder):
    """What the guest sees: /in with the installed tree and its script, /out empty."""
    for name in ("in", "out"):
        shutil.rmtree(folder / name, ignore_errors=True)
        (folder / name).mkdir(parents=True)
    subprocess.run(["meson", "install", "-C", str(build), "--no-rebuild", "--quiet",
                    "--destdir", str(folder / "in/install")], check=True, stdout=subprocess.DEVNULL)
    shutil.copy(HERE / "guest.sh", folder / "in")


def command(disk, folder, accelerator):
    machine = {"kvm": ["-accel", "kvm", "-cpu", "host"],
               "tcg": ["-accel", "tcg,thread=multi", "-cpu", "max"]}[accelerator]
    share = []
    for name, read_only in (("in", ",readonly=on"), ("out", "")):
        share += ["-virtfs", f"local,path={folder / name},mount_tag={name},security_model=none{read_only}"]
    return ["qemu-system-x86_64", *machine, "-smp", "2", "-m", "1536", "-nographic", "-no-reboot",
            "-nic", "none", "-kernel", str(disk / "vmlinuz"), "-initrd", str(disk / "initrd"),
            "-append", KERNEL, *share,
            "-drive", f"file={disk / 'disk.ext4'},format=raw,if=none,id=disk,snapshot=on",
            "-device", "virtio-blk-pci,drive=disk,num-queues=1"]


def boot(disk, folder, accelerator, seconds):
    """Lines of the guest's results; None if it did not end in time."""
    with open(folder / "console.log", "wb") as console:
        try:
            subprocess.run(command(disk, folder, accelerator), stdin=subprocess.DEVNULL, stdout=console,
                           stderr=console, timeout=seconds, check=False)
        except subprocess.TimeoutExpired:
            print(f"the machine ({accelerator}) was ended after {seconds} s")
    results = folder / "out/results"
    return results.read_text(errors="replace").splitlines() if results.exists() else []


def has_kvm():
    flags = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").split()
    return ("vmx" in flags or "svm" in flags) and os.access("/dev/kvm", os.R_OK | os.W_OK)


def run(disk, folder):
    lines = boot(disk, folder, "kvm", KVM_SECONDS) if has_kvm() else []
    if not lines:
        shutil.rmtree(folder / "out")
        (folder / "out").mkdir()
        lines = boot(disk, folder, "tcg", SECONDS)
    return lines


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    missing = [package for program, package in NEEDS.items() if not shutil.which(program)]
    if missing:
        skip(f"not installed: {' '.join(missing)}")
    if os.geteuid():
        skip("only root can make the disk of the virtual machine")
    folder = build / "vm"
    folder.mkdir(exist_ok=True)
    disk = image(folder)
    shares(build, folder)
    lines = run(disk, folder)
    print("\n".join(lines))
    if "end" not in lines:
        print(f"FAIL the machine did not come to its end; see {folder}/console.log and {folder}/out")
        return 1
    return 1 if any(line.startswith("FAIL") for line in lines) else 0


if __name__ == "__main__":
    sys.exit(main())
