# SPDX-License-Identifier: GPL-2.0-or-later
"""How long a line waits for a path that does not go on."""
from __future__ import annotations

import asyncio
from collections.abc import Callable

import pokeys

from ..wire import NotDone
from .member import members as members_of

STILL_S = 600.0             # so long a path may wait for something, unless the feed override is 0


class Patience:
    """Of one wait. Belongs to the event loop's thread."""

    def __init__(self, check: Callable[[], None], percent: Callable[[], float]) -> None:
        """``check`` raises what has ended the wait; ``percent`` is the feed override."""
        self._check, self._percent = check, percent
        self._mark = (0, 0.0)
        self._since = asyncio.get_running_loop().time()

    def __call__(self, state: pokeys.State) -> None:
        """Look at each state. :class:`NotDone` if nothing has moved for long, unless that was commanded."""
        self._check()
        now = asyncio.get_running_loop().time()
        mark = int(state["moves.waiting"]), sum(member.place for member in members_of(state).values())
        if mark != self._mark or self._percent() == 0:
            self._mark, self._since = mark, now
        elif now - self._since > STILL_S:
            raise NotDone(f"nothing has moved for {STILL_S / 60:.0f} minutes")
