# SPDX-License-Identifier: GPL-2.0-or-later
"""Processes beside the proxy, for what may wait: modules of this package, which end with their standard input."""
from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

_PACKAGES = str(Path(__file__).resolve().parent.parent)


def start(module: str, *words: str, stdin: int) -> subprocess.Popen[bytes]:
    """A module of this package as a program; what it prints to standard error is ours. :class:`OSError`."""
    path = os.pathsep.join(filter(None, (_PACKAGES, os.environ.get("PYTHONPATH"))))
    # -P: the folder of the machine's configuration is no place for modules
    return subprocess.Popen([sys.executable, "-B", "-P", "-m", f"{__package__}.{module}", *words], stdin=stdin,
                            stdout=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": path})
