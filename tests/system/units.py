#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""systemd has nothing to say about our units, with and without the drop-in, and
its exposure stays low. `verify` ends with 0 on keys that it does not know, so
what it prints counts, not its status."""
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile

EXPOSURE, GUARD_EXPOSURE, GATEWAY_EXPOSURE, DOCTOR_EXPOSURE = 20, 20, 20, 25  # tenths
ACL_GROUP = 8               # a named group (linux/posix_acl.h)


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def verify(folder, name="pokeysd", kind="service"):
    out = run("systemd-analyze", "verify", "--man=no", str(folder / f"{name}.{kind}"))
    said = "\n".join(line for line in (out.stdout + out.stderr).splitlines() if name in line)
    return said or (f"status {out.returncode}: {out.stderr}" if out.returncode else "")


def check_unit(folder, name, unit, program, exposure):
    """Without faults, and no more exposed than that. Any program stands for one that may not have been built."""
    copy = folder / f"{name}.service"
    text = re.sub(r"^ExecStart=\S+", f"ExecStart={program}", unit.read_text(), flags=re.M)
    copy.write_text(text)
    faults = verify(folder, name)
    assert not faults, faults
    out = run("systemd-analyze", "security", "--offline=yes", f"--threshold={exposure}", str(copy))
    assert out.returncode == 0, out.stdout + out.stderr
    print(out.stdout.splitlines()[-1])
    return text


def check_guard(folder, unit, program):
    text = check_unit(folder, "pokeys-guard", unit, program, GUARD_EXPOSURE)
    # a kernel without BPF has no such folder, which the guard says better than systemd
    assert "\nBindPaths=-/sys/fs/bpf/pokeysd:%t/pokeys-guard/pins\n" in text, text
    assert "\nUser=pokeys-guard\n" in text, text
    # a machine without XDP is not degraded by that, and nothing is tried for ever
    assert "SuccessExitStatus=69\n" in text and "RestartPreventExitStatus=64 69 75 77 78\n" in text, text


def check_gateway(folder, unit, program):
    """It may read, and not command."""
    text = check_unit(folder, "pokeys-gateway", unit, program, GATEWAY_EXPOSURE)
    groups = re.findall(r"^(?:Group|SupplementaryGroups)=(.*)$", text, re.M)
    assert groups == ["pokeys-gateway", "pokeys-monitor"], groups
    assert "\nIPAddressDeny=any\nIPAddressAllow=localhost\n" in text, text


def check_doctor(folder, unit, socket, program):
    """The socket starts it; it sees all, and may change nothing."""
    text = check_unit(folder, "pokeys-doctor@", unit, program, DOCTOR_EXPOSURE)
    assert "\nProtectSystem=strict\n" in text and "\nIPAddressDeny=any\n" in text, text
    assert "\nCapabilityBoundingSet=CAP_SYS_PTRACE CAP_DAC_READ_SEARCH\n" in text, text
    shutil.copy(socket, folder / socket.name)
    faults = verify(folder, "pokeys-doctor", "socket")
    assert not faults, faults
    assert "\nSocketGroup=pokeys-gateway\nSocketMode=0660\n" in socket.read_text(), socket


def equal_mode(path, wanted):
    mode = path.stat().st_mode & 0o7777
    assert mode == wanted, (path, oct(mode))


def main():
    unit, dropin, guard, gateway, doctor, socket, daemon, sysusers, tmpfiles = (
        pathlib.Path(a).resolve() for a in sys.argv[1:10])
    if not shutil.which("systemd-analyze"):
        print("systemd-analyze is not installed", file=sys.stderr)
        return 77
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        text = re.sub(r"^(ExecStart=|ExecStopPost=-)\S+", rf"\g<1>{daemon}", unit.read_text(), flags=re.M)
        (folder / "pokeysd.service").write_text(text)
        faults = verify(folder)
        assert not faults, faults
        # a changed configuration needs no restart of the machine
        assert "ExecReload=/bin/kill -HUP $MAINPID\n" in text, "the unit cannot be reloaded"
        # and whoever was killed leaves nothing that looks like a daemon, whatever comes of the next
        clear = f"ExecStopPost=-{daemon} --clear"
        assert f"{clear}\n{clear} --runtime-directory %t/pokeysd\n" in text, text
        assert "RuntimeDirectory=pokeysd\n" in text
        # a daemon that hangs is killed after two seconds
        assert "WatchdogSec=2\n" in text, text
        # a mistake is found at all
        (folder / "pokeysd.service").write_text(text.replace("[Install]", "Nonsense=1\n[Install]"))
        assert "Nonsense" in verify(folder), "verify does not see an unknown key"
        (folder / "pokeysd.service").write_text(text)
        out = run("systemd-analyze", "security", "--offline=yes", f"--threshold={EXPOSURE}",
                  str(folder / "pokeysd.service"))
        assert out.returncode == 0, out.stdout + out.stderr
        print(out.stdout.splitlines()[-1])
        (folder / "pokeysd.service.d").mkdir()
        copy = folder / "pokeysd.service.d" / dropin.name
        copy.write_text(dropin.read_text() + "Nonsense=1\n")
        assert "Nonsense" in verify(folder), "verify does not read the drop-in"
        shutil.copy(dropin, copy)
        faults = verify(folder)
        assert not faults, faults
        check_guard(folder, guard, daemon)
        check_gateway(folder, gateway, daemon)
        check_doctor(folder, doctor, socket, daemon)
        if shutil.which("systemd-sysusers"):
            out = run("systemd-sysusers", "--dry-run", f"--root={folder}", str(sysusers))
            assert out.returncode == 0 and "invalid" not in out.stderr.lower(), out.stderr
        if shutil.which("systemd-tmpfiles"):
            (folder / "etc").mkdir()
            (folder / "etc/passwd").write_text("pokeys:x:999:999::/:/bin/false\n")
            (folder / "etc/group").write_text("pokeys:x:999:\n")
            assert "group:pokeys-monitor:r-x" in tmpfiles.read_text() and "g pokeys-monitor " in sysusers.read_text()
            # systemd-tmpfiles looks up the names in access control lists on this computer, not under --root
            (copy := folder / "tmpfiles.conf").write_text(tmpfiles.read_text().replace(":pokeys-monitor:", ":998:"))
            out = run("systemd-tmpfiles", "--create", f"--root={folder}", str(copy))
            assert out.returncode == 0 and not out.stderr, out.stderr
            for name, mode in ("run/pokeysd", 0o2751), ("var/log/pokeysd", 0o750):
                equal_mode(folder / name, mode)
            # systemd's chmod at each start leaves the entry of the readers' group
            (folder / "var/log/pokeysd").chmod(0o750)
            entries = os.getxattr(folder / "var/log/pokeysd", "system.posix_acl_access")[4:]
            assert struct.pack("<HHI", ACL_GROUP, 5, 998) in [entries[i:i + 8] for i in range(0, len(entries), 8)]
    return 0


if __name__ == "__main__":
    sys.exit(main())
