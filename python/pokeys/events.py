# SPDX-License-Identifier: MIT
"""What has happened to a device: lines that the daemon has logged."""
from __future__ import annotations

import ctypes
import errno
from ctypes import c_char, c_uint16, c_uint32, c_uint64
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

from . import _library
from .errors import LibraryMissing

KEPT = 128
_ALL_DEVICES = 1
_LEVELS = {3: "error", 4: "warning", 5: "notice", 6: "info"}
_BEGIN = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True)
class Event:
    """Something that has happened to a device. ``str(event)`` is the line of ``pokeysctl events``."""

    device: str | None
    """Name of the device; None if it concerns all devices of the daemon."""
    number: int
    """Counts from 1 at each start of the daemon. A gap means that events were overwritten before they were read."""
    epoch: int
    """Identifies the start of the daemon; the same as ``daemon.epoch`` of the state."""
    time: datetime
    """When it happened (UTC)."""
    level: str
    """error, warning, notice or info."""
    kind: str
    """A word for programs, such as link, safe-state or position-lost. New ones may be added."""
    text: str
    """One line for people. A later version may word it differently."""
    held: int
    """How many events of this kind came before this one and were only counted."""


    def __str__(self) -> str:
        time = self.time.astimezone().strftime("%Y-%m-%d %H:%M:%S.%f")[:-3]
        device = f"{self.device}: " if self.device else ""
        held = f" ({self.held} more of this kind were not written)" if self.held else ""
        return f"{time}  {self.level:7}  {device}{self.text}{held}"


class _Stored(ctypes.Structure):
    """struct pokeys_event."""

    _fields_ = [("number", c_uint64), ("t_ns", c_uint64), ("wall_ns", c_uint64), ("level", c_uint16),
                ("flags", c_uint16), ("held", c_uint32), ("kind", c_char * 32), ("text", c_char * 600)]


class _Cursor(ctypes.Structure):
    """struct pokeys_events_cursor."""

    _fields_ = [("epoch", c_uint64), ("next", c_uint64)]


class Reader:
    """Takes the events of a device, each once, beginning with the oldest that is kept."""

    def __init__(self, device: str) -> None:
        self._device = device
        self._cursor = _Cursor()
        self._found = (_Stored * KEPT)()

    def take(self, client: Any) -> list[Event] | None:
        """The events that are new; None if the client is not attached."""
        found = self._found
        count = _library.library().cold.pokeys_client_read_events(client, ctypes.byref(self._cursor), found,
                                                                  ctypes.sizeof(_Stored), KEPT)
        if count == -errno.EINVAL:
            raise LibraryMissing(_library.OTHER_VERSION.format(_library.library().name))
        return None if count < 0 else [self._event(stored) for stored in found[:count]]

    def _event(self, stored: Any) -> Event:
        return Event(None if stored.flags & _ALL_DEVICES else self._device, stored.number, self._cursor.epoch,
                     _BEGIN + timedelta(microseconds=stored.wall_ns // 1000), _LEVELS.get(stored.level, "error"),
                     stored.kind.decode(errors="replace"), stored.text.decode(errors="replace"), stored.held)
