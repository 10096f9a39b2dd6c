# SPDX-License-Identifier: MIT
"""What can go wrong, each in one line for a person."""
from __future__ import annotations

from datetime import UTC, datetime, timedelta


class Error(Exception):
    """Base of all errors of this package."""


class LibraryMissing(Error):
    """libpokeys_shm.so.0 cannot be loaded, or is one of another version than this package."""


class NoDaemon(Error):
    """No pokeysd runs, or it has ended."""


class NoSuchDevice(Error):
    """The daemon has no device of this name; ``devices`` has those that it has."""

    def __init__(self, message: str, devices: list[str]) -> None:
        super().__init__(message)
        self.devices = devices


class Refused(Error):
    """A daemon is there, but this program may not or cannot read it."""


class Stale(Error):
    """The values are old. ``age`` is in seconds, ``since`` when they were true; None: never."""

    def __init__(self, message: str, age: float | None) -> None:
        super().__init__(message)
        self.age = age
        self.since = None if age is None else datetime.now(UTC) - timedelta(seconds=age)


class Lapsed(Error):
    """A lease had run out, or the daemon was away: the device was in its safe state meanwhile.

    Nothing is commanded until a value is set again.
    """


class ToolFailed(Error):
    """pokeysctl could not do what it was asked for; the text is what it said."""
