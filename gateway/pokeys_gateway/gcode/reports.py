# SPDX-License-Identifier: GPL-2.0-or-later
"""Temperatures that clients get periodically (M155)."""
from __future__ import annotations

import asyncio
from collections.abc import Callable
from weakref import ReferenceType, WeakKeyDictionary, ref

from ..console.client import Client
from .parser import BadWords, Line

REPORT_S = 0.5, 60.0        # from one to the next


class Reports:
    """Belongs to the event loop's thread."""

    def __init__(self, hears: Callable[[Client], bool], tell: Callable[[Client], None]) -> None:
        """``hears``: it has a lasting connection; ``tell`` reports to it."""
        self._hears, self._tell = hears, tell
        self._next: WeakKeyDictionary[Client, asyncio.TimerHandle] = WeakKeyDictionary()
        self._closed = False

    def begin(self, asker: Client, line: Line) -> None:
        """From now on, S and seconds; 0 ends them. :class:`BadWords`."""
        seconds = line.words().get("S")
        least, most = REPORT_S
        if seconds is None or (seconds != 0 and not least <= seconds <= most):
            raise BadWords(f"{line.name} takes S and seconds, {least:g} to {most:g}, or 0")
        if not self._hears(asker):
            raise BadWords(f"{line.name} needs a lasting connection; use M105 instead")
        if timer := self._next.pop(asker, None):
            timer.cancel()
        if seconds:
            self._in(asker, seconds)

    def close(self) -> None:
        """End all."""
        self._closed = True
        for timer in self._next.values():
            timer.cancel()

    def _in(self, asker: Client, seconds: float) -> None:
        if not self._closed:
            self._next[asker] = asyncio.get_running_loop().call_later(seconds, self._report, ref(asker), seconds)

    def _report(self, whose: ReferenceType[Client], seconds: float) -> None:
        asker = whose()
        if not asker:
            return
        self._next.pop(asker, None)
        if self._hears(asker):
            self._in(asker, seconds)
            self._tell(asker)
