# SPDX-License-Identifier: MIT
"""What has happened to a device: the lines that the daemon has logged of it."""
from __future__ import annotations

import ctypes
import errno
from ctypes import c_char, c_uint32, c_uint64
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any

from . import _library
from .errors import LibraryMissing

KEPT = 128
_LEVELS = {3: "error", 4: "warning", 5: "notice", 6: "info", 7: "debug"}
_BEGIN = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True)
class Event:
    """Something that has happened to a device."""

    number: int
    """Counts from 1 at each start of the daemon. A gap: some were overwritten before they were read."""
    epoch: int
    """Which start of the daemon it was; the ``epoch`` of the state."""
    time: datetime
    """When it happened (UTC)."""
    level: str
    """error, warning, notice, info or debug."""
    kind: str
    """A word for programs, such as link, safe-state or position-lost; new ones may come."""
    text: str
    """One line for a person; may be worded otherwise in the next version."""
    held: int
    """So many events of this kind came before it that were only counted."""


class _Stored(ctypes.Structure):
    """struct pokeys_event."""

    _fields_ = [("number", c_uint64), ("t_ns", c_uint64), ("wall_ns", c_uint64), ("level", c_uint32),
                ("held", c_uint32), ("kind", c_char * 32), ("text", c_char * 256)]


class Cursor(ctypes.Structure):
    """Where a reader is: struct pokeys_events_cursor. A new one is before the oldest event that is kept."""

    _fields_ = [("epoch", c_uint64), ("next", c_uint64)]


_Buffer = _Stored * KEPT


def take(client: Any, cursor: Cursor) -> list[Event] | None:
    """The events that are new, or None if the client is not attached. One thread at a time for each client."""
    found = _Buffer()
    count = _library.library().fast.pokeys_client_read_events(client, ctypes.byref(cursor), found,
                                                              ctypes.sizeof(_Stored), KEPT)
    if count == -errno.EINVAL:
        raise LibraryMissing(f"{_library.library().name} is of another version than this package; install pokeysd "
                             "and the package of the same version")
    if count < 0:
        return None
    return [Event(stored.number, cursor.epoch, _BEGIN + timedelta(microseconds=stored.wall_ns // 1000),
                  _LEVELS.get(stored.level, "error"), stored.kind.decode(errors="replace"),
                  stored.text.decode(errors="replace"), stored.held) for stored in found[:count]]
