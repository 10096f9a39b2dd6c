# SPDX-License-Identifier: GPL-2.0-or-later
"""An axis that moves as long as somebody holds a button: short moves, and an end of the path when no wish comes.

How long a short move takes depends on the axis, on its acceleration and on the feed override. So the queue alone
does not say when the axis stands: the path is ended when no wish has come for :data:`QUIET_S`, or at once when the
button is up. If the gateway itself dies, the daemon notices the missing heartbeat and stops the axis.
"""
from __future__ import annotations

import asyncio
import functools
import logging
from collections.abc import Callable

from ..wire import NotDone
from .holder import Holder, begin
from .member import NUDGE_S
from .motion import Motion

QUIET_S = 0.15
AHEAD_MOST = 2              # short moves in the queue
END_TRIES, END_S = 3, 0.1   # to end its path, and from one to the next
_LOG = logging.getLogger("pokeys-gateway")


class Jog:
    """One axis at a time, for one client. Belongs to the event loop's thread."""

    def __init__(self, motion: Motion, holder: Holder, stuck: Callable[[], object]) -> None:
        """``stuck`` is called if a path cannot be ended."""
        self._motion, self._holder, self._stuck = motion, holder, stuck
        self._owner: object = None      # who holds it; None: nobody
        self._letter = ""               # of the axis that is held
        self._moves: int | None = None  # the daemon's count after our last short move
        self._quiet: asyncio.TimerHandle | None = None
        self._going: set[asyncio.Task[None]] = set()
        self._ending: set[asyncio.Task[None]] = set()

    async def wish(self, owner: object, letter: str, speed: float) -> None:
        """It is held by `owner`, at so many units/s. :class:`NotDone`: this press has to end."""
        asked = asyncio.get_running_loop().time()
        if self._ending:
            return      # it still slows down from before
        if self._owner not in (None, owner):
            raise NotDone(f"{self._letter} is jogged already, and one axis at a time")
        self._owner, self._letter = owner, letter
        self._wait()
        # the client may be gone in the middle of it, and what was begun must not stay half done
        going = asyncio.get_running_loop().create_task(self._go(owner, letter, speed, asked))
        self._going.add(going)
        going.add_done_callback(functools.partial(self._gone, owner))
        await asyncio.shield(going)

    def end(self, owner: object) -> None:
        """It is up: the axis stops as soon as it can."""
        if owner == self._owner:
            moves = self._moves
            self.forget()
            self._end(moves)

    def forget(self) -> None:
        """A stop ends it."""
        if self._quiet:
            self._quiet.cancel()
        self._quiet, self._owner, self._letter, self._moves = None, None, "", None

    def _wait(self) -> None:
        if self._quiet:
            self._quiet.cancel()
        self._quiet = asyncio.get_running_loop().call_later(QUIET_S, self.end, self._owner)

    def _gone(self, owner: object, going: asyncio.Task[None]) -> None:
        self._going.discard(going)
        if not going.cancelled() and going.exception():
            self.end(owner)

    async def _go(self, owner: object, letter: str, speed: float, asked: float) -> None:
        await self._holder.take()
        if not self._motion.is_idle(self._moves):
            raise NotDone("something else moves")
        if self._motion.waiting() >= AHEAD_MOST:
            return
        moves = await self._motion.nudge(letter, speed, asked + NUDGE_S)
        if moves is None:
            return
        if owner == self._owner:
            self._moves = moves
        else:
            self._end(moves)        # it was let go meanwhile

    def _end(self, moves: int | None) -> None:
        if moves is not None:
            ending = begin(self._end_path(moves))
            self._ending.add(ending)
            ending.add_done_callback(self._ending.discard)

    async def _end_path(self, moves: int) -> None:
        for _ in range(END_TRIES):
            try:
                await self._motion.end_path(moves)
                return
            except NotDone as error:
                if not self._holder.held:
                    return
                _LOG.warning("%s: the end of a jog: %s", self._holder.device, error)
            await asyncio.sleep(END_S)
        self._stuck()
