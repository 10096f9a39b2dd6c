# SPDX-License-Identifier: GPL-2.0-or-later
"""Programs of others, from the Python package index, in an environment of their own, for tests."""
import hashlib
import os
import pathlib
import subprocess
import sys

OFFLINE = ("No matching distribution found", "Failed to establish a new connection", "name resolution")


def environment(name, *steps):
    """The Python that has a package; `steps` are the words of pip install, in their order.

    It is kept in the user's cache, because it takes a minute to make. Without an index, the test is skipped.
    """
    cache = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache")
    folder = cache / "pokeysd" / f"{name}-{hashlib.sha256(repr((steps, sys.version)).encode()).hexdigest()[:12]}"
    python = folder / "bin/python"
    if not (folder / "whole").exists():
        ran = subprocess.run(["/usr/bin/python3", "-m", "venv", "--clear", folder], capture_output=True, text=True,
                             check=False)
        if ran.returncode:
            skip(f"no virtual environment can be made (python3-venv): {ran.stdout.strip()}")
        for words in steps:
            ran = subprocess.run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *words],
                                 capture_output=True, text=True, check=False)
            if ran.returncode and any(text in ran.stdout + ran.stderr for text in OFFLINE):
                skip(f"pip reaches no package index, and needs {name} from there")
            assert ran.returncode == 0, ran.stdout + ran.stderr
        (folder / "whole").touch()
    return python


def skip(why):
    """End the test as skipped."""
    print(f"skipped: {why}", file=sys.stderr)
    sys.exit(77)
