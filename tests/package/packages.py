#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The Debian packages: lintian finds nothing, another build gives the same bytes without a network, and in a
clean Debian they can be installed, used and removed, with nothing left. Packages that are built of the same
sources on the other supported release of Debian are installed, used and removed there as well.

usage: packages.py SOURCE
"""
import hashlib
import os
import pathlib
import platform
import re
import shutil
import subprocess
import sys
import tempfile

NEEDS = ("dpkg-buildpackage", "dh", "lintian", "mmdebstrap", "esbuild", "apt-ftparchive", "unshare")
MISSING = 77
RELEASES = ("bookworm", "trixie")
# Another place, time zone and home, no network, and another user's mask.
ELSEWHERE = {"TZ": "Pacific/Chatham", "LC_ALL": "C.UTF-8", "LANG": "C.UTF-8", "HOME": "/nonexistent"}
# What changes by itself in a Debian. Users and groups stay, as Debian advises, and with them their lines.
VOLATILE = re.compile(r"/(proc|sys|dev|tmp|run/(mount|lock|systemd)|var/(cache|lib/(apt|dpkg|systemd|ucf)))(/|$)"
                      r"|/var/log/(apt|dpkg|alternatives)|/etc/ld\.so\.cache$"
                      r"|/etc/(passwd|group|shadow|gshadow|subuid|subgid)-?$"
                      r"|.*\.pyc$|.*__pycache__|/var/lib/(python|polkit-1)|/usr/share/(mime|icons)|/var/lib/.*\.cache$")
# Of the older component, installed by hand.
OLDER = ("usr/bin/pokeys", "usr/lib/linuxcnc/modules/pokeys_homecomp.so")
USE = """
set -eux
getent passwd pokeys pokeys-guard pokeys-gateway
getent group pokeys-monitor
test "$(stat -c %U:%G:%a /run/pokeysd)" = pokeys:pokeys:2751
pokeysd --version
pokeysd --check-config
pokeysctl --version
pokeys-sim --help >/dev/null
pokeys-gateway --version
pokeys-remote --version
python3 -c 'import pokeys; print(pokeys.__file__)'
systemd-analyze verify pokeysd.service pokeys-guard.service pokeys-gateway.service
test -f /usr/lib/linuxcnc/modules/pokeys_shm.so
! grep -q older /usr/bin/pokeys /usr/lib/linuxcnc/modules/pokeys_homecomp.so
man -w pokeysd.conf pokeys_shm pokeysctl
test "$(systemctl is-enabled pokeysd.service)" = disabled
zgrep -q 'Permission is hereby granted' /usr/share/doc/libpokeys-shm0/licenses-of-crates.gz
"""


class Fault(Exception):
    """What is wrong, in a line or more."""


def run(*command, env=None, cwd=None):
    """What a command prints; Fault with the end of that if it fails."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, cwd=cwd,
                          stdin=subprocess.DEVNULL, env=os.environ | (env or {}))
    if done.returncode:
        raise Fault(f"{' '.join(map(str, command))[:200]}: status {done.returncode}\n{done.stdout[-4000:]}"
                    f"{done.stderr[-4000:]}")
    return done.stdout


def sums(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.glob("*.deb")}


def is_a_repository(folder):
    """The lists name each package once, and nothing that is not there."""
    names = re.findall(r"^Filename: \./(\S+)$", (folder / "Packages").read_text(encoding="utf-8"), re.MULTILINE)
    if sorted(names) != sorted(sums(folder)):
        raise Fault(f"the repository lists {names}, and there are {sorted(sums(folder))}")
    other = folder.parent / "other"
    other.mkdir()
    (other / "build.log").write_text("of another program\n", encoding="utf-8")
    for place in ("/", other):
        again = subprocess.run(["scripts/package", "--output", place], capture_output=True, text=True, check=False)
        if again.returncode != 1 or "contains other files" not in again.stderr:
            raise Fault(f"--output {place} was accepted: {again.stderr}")


def is_clean(folder):
    said = run("lintian", "--allow-root", "--fail-on", "error,warning,info,pedantic", "--pedantic", "--display-info",
               next(folder.glob("*.changes")))
    print(said or "lintian finds nothing")


def is_reproducible(folder, work):
    place = work / "elsewhere/in-a-folder-with-a-longer-name"
    place.mkdir(parents=True)
    run("dpkg-source", "-x", next(folder.glob("*.dsc")), place / "tree")
    rustup = os.environ.get("RUSTUP_HOME", str(pathlib.Path.home() / ".rustup"))
    cargo = pathlib.Path(shutil.which("cargo")).parent
    run("unshare", *([] if os.geteuid() == 0 else ["--map-root-user"]), "--net",
        "sh", "-c", "umask 027; exec dpkg-buildpackage -d -us -uc -b", cwd=place / "tree",
        env=ELSEWHERE | {"DEB_BUILD_OPTIONS": "nocheck", "RUSTUP_HOME": rustup,
                         "PATH": f"/usr/sbin:/usr/bin:/sbin:/bin:{cargo}"})
    here, there = sums(folder), sums(place)
    differ = [name for name in here if here[name] != there.get(name)]
    if differ or len(here) != len(there):
        raise Fault(f"built again elsewhere, these differ: {differ}")
    print(f"{len(here)} packages, built again without a network: the same bytes")


def files(root):
    """What is in a root, but for what changes by itself."""
    found = set()
    for folder, names, others in os.walk(root):
        inside = "/" + os.path.relpath(folder, root).removeprefix(".")
        names[:] = [name for name in names if not VOLATILE.match(os.path.join(inside, name))]
        found.update(path for path in (os.path.join(inside, name) for name in [*names, *others])
                     if not VOLATILE.match(path))
    return found


def documented(source):
    """The command of docs/install.md that installs packages, for root."""
    text = (source / "docs/install.md").read_text(encoding="utf-8")
    return next(line.removeprefix("sudo ") for line in text.splitlines() if line.startswith("sudo apt install ./"))


def clean_debian(root, release, *packages):
    """A function that runs a script in a new, small Debian; its keyword ``network``: with the network."""
    run("mmdebstrap", "--quiet", "--variant=minbase", "--mode=root", "--aptopt=Acquire::Retries \"5\"",
        f"--include={','.join(packages)}", release, root)

    def inside(script, *, network=True):
        # unit tests need /sys and pseudoterminals, which builders of Debian have
        return run("unshare", "--mount", "--pid", "--fork", "--kill-child", *([] if network else ["--net"]),
                   f"--mount-proc={root}/proc", "sh", "-ec",
                   'mount --bind -o ro /sys "$0/sys"; mount -t devpts -o newinstance,ptmxmode=0666 devpts "$0/dev/pts"; '
                   'exec chroot "$0" /bin/bash -ec "$1"', root,
                   "export DEBIAN_FRONTEND=noninteractive LC_ALL=C HOME=/root; "
                   f"mount -t tmpfs tmpfs /dev/shm; cd /; {script}")
    return inside


def is_built(folder, work, release):
    """The folder of the packages that a release of Debian builds of the sources in `folder`, without a network."""
    root = work / f"{release}-builds"
    inside = clean_debian(root, release, "build-essential", "ca-certificates")
    (root / "build").mkdir()
    for path in [*folder.glob("*.dsc"), *folder.glob("*.tar.xz")]:
        shutil.copy(path, root / "build")
    inside("apt-get update -q; apt-get build-dep -y -q --no-install-recommends /build/*.dsc")
    inside("cd /build; dpkg-source -x *.dsc tree; cd tree; dpkg-buildpackage -us -uc -b", network=False)
    inside("cd /build; rm -rf tree; dpkg-scanpackages . >Packages")
    built = {path.name.split("_")[0] for path in (root / "build").glob("*.deb")}
    if built != {path.name.split("_")[0] for path in folder.glob("*.deb")}:
        raise Fault(f"{release} builds only {sorted(built)}")
    return root / "build"


def can_be_used(source, folder, work, release):
    root = work / release
    inside = clean_debian(root, release, "systemd", "systemd-sysv", "python3-minimal", "man-db", "udev",
                          "ca-certificates", "bash")
    shutil.copytree(folder, root / "build/packages")
    names = sorted(path.name.split("_")[0] for path in folder.glob("*.deb") if "-dbgsym_" not in path.name)
    inside("echo 'deb [trusted=yes] file:/build/packages ./' >/etc/apt/sources.list.d/pokeysd.list; apt-get update -q")
    # the Debian dependencies stay, so both listings contain them
    would = inside(f"apt-get install -s -q --no-install-recommends {' '.join(names)}")
    others = set(re.findall(r"^Inst (\S+)", would, re.MULTILINE)) - set(names)
    inside(f"apt-get install -y -q --no-install-recommends {' '.join(sorted(others))}")
    before = files(root)
    for name in OLDER:
        (root / name).write_text("#!/bin/sh\necho older\n", encoding="utf-8")
        (root / name).chmod(0o755)
    inside(documented(source).replace("apt install", "apt-get install -y -q --no-install-recommends"))
    inside(f"apt-get install -y -q --no-install-recommends {' '.join(names)}")
    print(inside(USE))
    # as an upgrade does: the former version's scripts, then the new version's
    inside(f"apt-get install -y -q --reinstall {' '.join(names)}")
    print(inside(USE))
    inside("echo '# mine' >>/etc/pokeysd/pokeysd.conf; touch /var/log/pokeysd/one.pcapng; mkdir -p /run/pokeysd/e.1")
    inside(f"apt-get remove -y -q {' '.join(names)}")
    for name in OLDER:
        if "older" not in (root / name).read_text(encoding="utf-8"):
            raise Fault(f"{name} of the older component did not come back")
        (root / name).unlink()
    if "# mine" not in (root / "etc/pokeysd/pokeysd.conf").read_text(encoding="utf-8"):
        raise Fault("the removal deleted the configuration")
    inside(f"apt-get purge -y -q {' '.join(names)}")
    after = files(root)
    if after - before or before - after:
        raise Fault(f"left after purge: {sorted(after - before)[:40]}; gone: {sorted(before - after)[:40]}")
    print(f"{release}: installed, used, removed and purged: nothing is left")


def main():
    source = pathlib.Path(sys.argv[1])
    missing = [tool for tool in NEEDS if not shutil.which(tool)]
    if missing:
        print(f"skipped: {', '.join(missing)} missing", file=sys.stderr)
        return MISSING
    os.chdir(source)
    with tempfile.TemporaryDirectory(prefix="pokeys-package-", dir="/var/tmp") as name:
        work = pathlib.Path(name)
        try:
            print(run("scripts/package", "--output", work / "packages"))
            is_a_repository(work / "packages")
            is_clean(work / "packages")
            is_reproducible(work / "packages", work)
            if os.geteuid():
                print("installation skipped: only root can make a clean Debian", file=sys.stderr)
                return MISSING
            here = platform.freedesktop_os_release().get("VERSION_CODENAME")
            can_be_used(source, work / "packages", work, here)
            for release in RELEASES:
                if release != here:
                    can_be_used(source, is_built(work / "packages", work, release), work, release)
        except Fault as fault:
            print(f"FAILED: {fault}")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
