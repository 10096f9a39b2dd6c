# SPDX-License-Identifier: GPL-2.0-or-later
"""The daemon's flight recorder: the records that it has written at faults, and what its ring holds now.

Everything here waits for a disk or for another process, so it is called aside from the event loop
(aside.py). Whoever may write to the folder must not be able to make the gateway send other files, so links
are refused.
"""
from __future__ import annotations

import contextlib
import errno
import os
import re
import stat
import subprocess
import tempfile
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from .model import program

KIND = "application/x-pcapng"
PATIENCE_S = 20.0           # for pokeysctl
RECORDS_MOST = 1000         # as record-files in pokeysd.conf(5)
# the end of a file's name (pokeysctl(1), FLIGHT RECORDER)
REASONS = {
    "lost": "a device was lost",
    "commander": "the commander was silent while the machine was on",
    "emergency": "the pulse engine was stopped by its emergency input",
    "limit": "the pulse engine was stopped by a limit switch",
    "heater": "a heater was switched off by a fault",
    "servo": "a servo motor was stopped by a fault",
    "late": "cycles were missed",
    "transport": "the transport failed",
    "died": "the daemon died",
}
_NAME = re.compile(r"pokeysd-([0-9]{8}T[0-9]{6}Z)-([a-z]{1,16})\.pcapng")
_TIME = "%Y%m%dT%H%M%SZ"


class NoRecord(Exception):
    """Why there is no record to send."""


class NoSuchRecord(NoRecord):
    """It does not exist."""


@dataclass(frozen=True)
class Record:
    """A file of the folder."""

    name: str
    time: datetime      # UTC
    reason: str         # a key of REASONS, or another word of a newer daemon
    bytes: int

    @property
    def text(self) -> str:
        """Why it was written, in words."""
        return REASONS.get(self.reason, self.reason)


def _parse(name: str, size: int) -> Record | None:
    """The record of this name; None if it is not the name of one."""
    found = _NAME.fullmatch(name)
    if not found:
        return None
    try:
        time = datetime.strptime(found[1], _TIME).replace(tzinfo=UTC)
    except ValueError:
        return None
    return Record(name, time, found[2], size)


class Recorder:
    """The records of one folder, and the ring of one runtime directory. Any thread; blocks."""

    def __init__(self, folder: Path, runtime: str) -> None:
        self.folder = folder
        self._runtime = runtime

    def look(self) -> tuple[list[Record], str]:
        """The records, the newest first, and why the folder cannot be read."""
        found = []
        try:
            names = os.listdir(self.folder)
        except OSError as error:
            return [], f"{self.folder}: {error.strerror}; see record-folder in pokeys-gateway.conf(5)"
        for name in names:
            # the daemon may have removed it meanwhile
            with contextlib.suppress(OSError):
                status = os.lstat(self.folder / name)
                if stat.S_ISREG(status.st_mode) and (record := _parse(name, status.st_size)):
                    found.append(record)
        return sorted(found, key=lambda one: one.name, reverse=True)[:RECORDS_MOST], ""

    def open(self, name: str) -> tuple[int, int]:
        """A descriptor of a record, and its size. :class:`NoRecord`."""
        if not _parse(name, 0):
            raise NoSuchRecord(f"{name!r} is not the name of a record")
        try:
            file = os.open(self.folder / name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as error:
            missing = error.errno in (errno.ENOENT, errno.ENOTDIR, errno.ELOOP)
            raise (NoSuchRecord if missing else NoRecord)(f"{name}: {error.strerror}") from None
        status = os.fstat(file)
        if not stat.S_ISREG(status.st_mode):
            os.close(file)
            raise NoSuchRecord(f"{name}: not a regular file")
        return file, status.st_size

    def now(self, device: str) -> tuple[int, int]:
        """A record of the last seconds, as :meth:`open` gives one: a file without a name.

        It is complete before it is sent: the ring goes round in seconds, and a client may be slower.
        :class:`NoRecord`.
        """
        try:
            with tempfile.TemporaryFile() as record, tempfile.TemporaryFile() as said:
                ran = subprocess.run(
                    [program(), "record", "--runtime-directory", self._runtime, "--", device, "-"],
                    stdin=subprocess.DEVNULL, stdout=record, stderr=said, timeout=PATIENCE_S, check=False)
                if not ran.returncode:
                    return os.dup(record.fileno()), os.fstat(record.fileno()).st_size
                said.seek(0)
                complaint = said.read(1000).decode(errors="replace").strip()
        except subprocess.TimeoutExpired:
            raise NoRecord(f"pokeysctl record has not ended in {PATIENCE_S:.0f} s") from None
        except OSError as error:
            raise NoRecord(f"{error.filename or 'a temporary file'}: {error.strerror}") from None
        raise NoRecord(complaint.removeprefix("pokeysctl: ").partition("\n")[0] or
                       f"pokeysctl has ended with status {ran.returncode}")
