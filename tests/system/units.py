#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""systemd has nothing to say about our unit, with and without the drop-in, and
its exposure stays low. `verify` ends with 0 on keys that it does not know, so
what it prints counts, not its status."""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

EXPOSURE = 25  # tenths


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def verify(folder):
    out = run("systemd-analyze", "verify", "--man=no", str(folder / "pokeysd.service"))
    said = "\n".join(line for line in (out.stdout + out.stderr).splitlines() if "pokeysd" in line)
    return said or (f"status {out.returncode}: {out.stderr}" if out.returncode else "")


def main():
    unit, dropin, daemon, sysusers, tmpfiles = (pathlib.Path(a).resolve() for a in sys.argv[1:6])
    if not shutil.which("systemd-analyze"):
        print("systemd-analyze is not installed", file=sys.stderr)
        return 77
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        text = re.sub(r"^ExecStart=\S+", f"ExecStart={daemon}", unit.read_text(), flags=re.M)
        (folder / "pokeysd.service").write_text(text)
        faults = verify(folder)
        assert not faults, faults
        # a changed configuration needs no restart of the machine
        assert "ExecReload=/bin/kill -HUP $MAINPID\n" in text, "the unit cannot be reloaded"
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
        if shutil.which("systemd-sysusers"):
            out = run("systemd-sysusers", "--dry-run", f"--root={folder}", str(sysusers))
            assert out.returncode == 0 and "invalid" not in out.stderr.lower(), out.stderr
        if shutil.which("systemd-tmpfiles"):
            (folder / "etc").mkdir()
            (folder / "etc/passwd").write_text("pokeys:x:999:999::/:/bin/false\n")
            (folder / "etc/group").write_text("pokeys:x:999:\n")
            out = run("systemd-tmpfiles", "--create", f"--root={folder}", str(tmpfiles))
            assert out.returncode == 0 and not out.stderr, out.stderr
            mode = (folder / "run/pokeysd").stat().st_mode & 0o7777
            assert mode == 0o2770, oct(mode)
    return 0


if __name__ == "__main__":
    sys.exit(main())
