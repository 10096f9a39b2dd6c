# SPDX-License-Identifier: GPL-2.0-or-later
"""Messages of the console: lines, or parts of them, each with one owner.

Whoever has a message passes it on or releases it, once. A client gets a copy of its own. So the ledger's
count of live messages is 0 when all is quiet, and a leak cannot hide.
"""
from __future__ import annotations

import enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .client import Client


class Part(enum.Enum):
    """The part of a line that a message is; a line longer than the client's limit comes in several."""

    HEAD = enum.auto()
    CORE = enum.auto()
    TAIL = enum.auto()
    UNIQUE = enum.auto()

    @property
    def first(self) -> bool:
        """Nothing of the line came before."""
        return self in (Part.HEAD, Part.UNIQUE)

    @property
    def last(self) -> bool:
        """Nothing of the line follows."""
        return self in (Part.TAIL, Part.UNIQUE)


class Ledger:
    """How many messages there are, and have been."""

    def __init__(self) -> None:
        self.live = 0
        self.made = 0

    def message(self, data: bytes, part: Part = Part.UNIQUE, origin: Client | None = None,
                target: Client | None = None, level: str = "", request: int = 0) -> Message:
        """A new message, which belongs to the caller."""
        return Message(self, data, part, origin, target, level, request)


class Message:
    """Data and its context. Belongs to the event loop's thread."""

    __slots__ = ("_ledger", "data", "level", "origin", "part", "request", "target")

    def __init__(self, ledger: Ledger, data: bytes, part: Part, origin: Client | None, target: Client | None,
                 level: str, request: int) -> None:
        self._ledger: Ledger | None = ledger
        self.data = data
        self.part = part
        self.origin = origin        # None: the gateway itself
        self.target = target        # None: not routed yet
        self.level = level          # what the origin was allowed when it sent this
        self.request = request      # the origin's number for it; an answer has the same
        ledger.live += 1
        ledger.made += 1

    @property
    def size(self) -> int:
        """In bytes."""
        return len(self.data)

    @property
    def lines(self) -> int:
        """How many lines it is; a part counts as one."""
        return max(1, self.data.count(b"\n"))

    @property
    def ended(self) -> bool:
        """Has the line its end?"""
        return self.data[-1:] in (b"\r", b"\n")

    def copy(self, target: Client) -> Message:
        """The same for another receiver."""
        assert self._ledger, "copied after its release"
        return Message(self._ledger, self.data, self.part, self.origin, target, self.level, self.request)

    def discard(self) -> None:
        """Release it, if nobody has done so: after a fault."""
        if self._ledger:
            self.release()

    def release(self) -> None:
        """It is done with. Once."""
        assert self._ledger, "released twice"
        self._ledger.live -= 1
        self._ledger = None
