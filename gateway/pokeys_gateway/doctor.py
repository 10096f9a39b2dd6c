# SPDX-License-Identifier: GPL-2.0-or-later
"""The findings of pokeysctl doctor about this computer.

The gateway's service sees hardly anything of the computer, and should not see more. Another unit,
pokeys-doctor.socket, runs the doctor, and the gateway only reads the findings. A gateway that was started
by hand runs the doctor itself.

The doctor looks at every process, so it runs only when a client asks, and not more often than every few
seconds.
"""
from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .aside import aside
from .model import program

PATIENCE_S, KEPT_S = 20.0, 5.0
LATE = f"pokeysctl doctor has not answered in {PATIENCE_S:.0f} s"
SIZE_MOST = 256 * 1024
VERDICTS = "problem", "advice", "unknown", "ok"     # the worst first
_KEYS = "check", "subject", "verdict", "why", "mend", "keep"


class NoDoctor(Exception):
    """Why there are no findings."""


@dataclass(frozen=True)
class Opinion:
    """Findings, and when the doctor has looked."""

    time: float                         # seconds since 1970
    limited: bool                       # it had the rights of the gateway only
    findings: list[dict[str, str]]      # the worst first


def _parse(text: bytes) -> list[dict[str, str]]:
    """ValueError, LookupError, TypeError, RecursionError."""
    findings: list[dict[str, Any]] = json.loads(text)["findings"]
    found = [{key: str(one[key]) for key in _KEYS} for one in findings]
    return sorted(found, key=lambda one: VERDICTS.index(one["verdict"]))


def _of_the_service(path: Path) -> bytes:
    """What the unit says. OSError."""
    end_at = time.monotonic() + PATIENCE_S
    found = b""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_CLOEXEC) as connection:
        connection.settimeout(PATIENCE_S)
        connection.connect(str(path))
        while len(found) <= SIZE_MOST and (part := connection.recv(SIZE_MOST)):
            found += part
            connection.settimeout(max(0.001, end_at - time.monotonic()))
    return found


def _our_own(runtime: str) -> bytes:
    """What a doctor with our rights says. OSError, subprocess.TimeoutExpired."""
    # its status is that of the computer
    return subprocess.run([program(), "doctor", "--json", "--runtime-directory", runtime], stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, timeout=PATIENCE_S, check=False).stdout


def look(path: Path | None, runtime: str) -> Opinion:
    """The findings of this moment. Blocks. :class:`NoDoctor`."""
    text, limited = None, True
    try:
        if path:
            # there is no such unit here, or it is not for us
            with contextlib.suppress(FileNotFoundError, ConnectionRefusedError, PermissionError):
                text = _of_the_service(path)
        limited = text is None
        return Opinion(time.time(), limited, _parse(_our_own(runtime) if text is None else text))
    except (TimeoutError, subprocess.TimeoutExpired):
        raise NoDoctor(LATE) from None
    except OSError as error:
        raise NoDoctor(f"{error.filename or path}: {error.strerror or error}") from None
    except (ValueError, LookupError, TypeError, RecursionError):
        log = "the gateway" if limited else "pokeys-doctor@"
        raise NoDoctor(f"pokeysctl doctor has given no findings; the log of {log} says why") from None


class Doctor:
    """Looks once for all clients that ask meanwhile. Belongs to the event loop's thread."""

    def __init__(self, path: Path | None, runtime: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._path = path
        self._runtime = runtime
        self._clock = clock
        self._looking: asyncio.Future[Opinion] | None = None
        self._until = 0.0

    async def ask(self) -> Opinion:
        """Findings, or why there are none, that are at most KEPT_S old. :class:`NoDoctor`."""
        looking = self._looking
        # one that hangs is not followed by others
        if not looking or (looking.done() and self._clock() >= self._until):
            looking = self._looking = aside(look, self._path, self._runtime)
            looking.add_done_callback(self._keep)
        done, _ = await asyncio.wait((looking,), timeout=PATIENCE_S + 1)
        if not done:
            raise NoDoctor(LATE)
        try:
            return looking.result()
        except NoDoctor as error:
            raise NoDoctor(str(error)) from None

    def _keep(self, looking: asyncio.Future[Opinion]) -> None:
        self._until = self._clock() + KEPT_S
        looking.exception()     # seen, also if nobody waits any more
