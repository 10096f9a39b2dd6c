# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs of others, from the Python package index, in an environment of their own, for tests."""
import fcntl
import hashlib
import os
import pathlib
import subprocess
import sys

OFFLINE = ("No matching distribution found", "Failed to establish a new connection", "name resolution")


def environment(name, *steps):
    """The Python that has a package; `steps` are the words of pip install, in their order.

    Without an index, the test is skipped.
    """
    python, why = wanted(name, *steps)
    return python if python else skip(why)


def wanted(name, *steps):
    """The same, or None and why there is none.

    It is kept in the user's cache, because it takes up to a minute to make.
    """
    cache = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache")
    folder = cache / "pokeysd" / f"{name}-{hashlib.sha256(repr((steps, sys.version)).encode()).hexdigest()[:12]}"
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder.with_suffix(".lock"), "w", encoding="ascii") as lock:
        # another test may want the same
        fcntl.flock(lock, fcntl.LOCK_EX)
        return _make(name, folder, steps)


def _make(name, folder, steps):
    python = folder / "bin/python"
    if not (folder / "whole").exists():
        ran = subprocess.run(["/usr/bin/python3", "-m", "venv", "--clear", folder], capture_output=True, text=True,
                             check=False)
        if ran.returncode:
            return None, f"no virtual environment can be made (python3-venv): {ran.stdout.strip()}"
        for words in steps:
            ran = subprocess.run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *words],
                                 capture_output=True, text=True, check=False)
            if ran.returncode and any(text in ran.stdout + ran.stderr for text in OFFLINE):
                return None, f"pip reaches no package index, and needs {name} from there"
            assert ran.returncode == 0, ran.stdout + ran.stderr
        (folder / "whole").touch()
    return python, ""


def skip(why):
    """End the test as skipped."""
    print(f"skipped: {why}", file=sys.stderr)
    sys.exit(77)
