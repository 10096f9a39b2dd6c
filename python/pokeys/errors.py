# SPDX-License-Identifier: MIT
"""The exceptions of this package; each message is one line for a person."""
from __future__ import annotations

from datetime import UTC, datetime, timedelta
from typing import Any


class Error(Exception):
    """Base of all errors of this package."""


class LibraryMissing(Error):
    """libpokeys_shm.so.0 cannot be loaded, or its version differs from that of this package."""


class NoDaemon(Error):
    """No pokeysd is running, or it has ended."""


class NoSuchDevice(Error):
    """The daemon has no device with this name; ``devices`` has the names of its devices."""

    def __init__(self, message: str, devices: list[str]) -> None:
        super().__init__(message)
        self.devices = devices

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.devices)


class Refused(Error):
    """A daemon is running, but this program is not allowed, or not able, to read its data."""


class Stale(Error):
    """The values are old. ``age`` is in seconds, ``since`` a datetime (UTC); both are None if no data has come yet."""

    def __init__(self, message: str, age: float | None) -> None:
        super().__init__(message)
        self.age = age
        self.since = None if age is None else datetime.now(UTC) - timedelta(seconds=age)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.age), {"since": self.since}


class Lapsed(Error):
    """A lease had run out, or the daemon was away: the device was in its safe state meanwhile.

    Nothing is commanded until a value is set again, and then that one alone.
    """


class ToolFailed(Error):
    """pokeysctl failed; the message is its error output."""
