# SPDX-License-Identifier: GPL-2.0-or-later
"""An axis that moves as long as somebody holds a button: short moves, and an end of the path when no wish comes.

How long a short move takes depends on the axis, on its acceleration and on the feed override. So the queue alone
does not say when the axis stands: the path is ended when no wish has come for :data:`QUIET_S`, or at once when the
button is up. If the gateway itself dies, the daemon notices the missing heartbeat and stops the axis.
"""
from __future__ import annotations

import asyncio
import logging

from ..wire import NotDone
from .holder import Holder, begin
from .motion import NUDGE_S, Motion

QUIET_S = 0.15
AHEAD_MOST = 2              # short moves in the queue
_LOG = logging.getLogger("pokeys-gateway")


class Jog:
    """One axis at a time. Belongs to the event loop's thread."""

    def __init__(self, motion: Motion, holder: Holder) -> None:
        self._motion, self._holder = motion, holder
        self._letter = ""               # of the axis that is held
        self._moves: int | None = None  # the daemon's count after our last short move
        self._quiet: asyncio.TimerHandle | None = None
        self._going: set[asyncio.Task[None]] = set()

    async def wish(self, letter: str, speed: float) -> None:
        """It is held, at so many units/s. :class:`NotDone`: this press has to end."""
        asked = asyncio.get_running_loop().time()
        if self._letter not in ("", letter):
            raise NotDone(f"{self._letter} is jogged already, and one axis at a time")
        self._letter = letter
        self._wait()
        # the client may be gone in the middle of it, and what was begun must not stay half done
        going = asyncio.get_running_loop().create_task(self._go(letter, speed, asked))
        self._going.add(going)
        going.add_done_callback(self._gone)
        await asyncio.shield(going)

    def end(self) -> None:
        """It is up, or no wish has come any more: the axis stops as soon as it can."""
        moves = self._moves
        self.forget()
        if moves is not None:
            begin(self._end(moves))

    def forget(self) -> None:
        """A stop ends it."""
        if self._quiet:
            self._quiet.cancel()
        self._quiet, self._letter, self._moves = None, "", None

    def _wait(self) -> None:
        if self._quiet:
            self._quiet.cancel()
        self._quiet = asyncio.get_running_loop().call_later(QUIET_S, self.end)

    def _gone(self, going: asyncio.Task[None]) -> None:
        self._going.discard(going)
        if not going.cancelled() and going.exception():
            self.end()

    async def _go(self, letter: str, speed: float, asked: float) -> None:
        await self._holder.take()
        if not self._motion.is_idle(self._moves):
            raise NotDone("something else moves")
        if self._motion.waiting() >= AHEAD_MOST:
            return
        moves = await self._motion.nudge(letter, speed, asked + NUDGE_S)
        if moves is None:
            return
        self._moves = moves
        if not self._letter:
            self.end()      # it was let go meanwhile

    async def _end(self, moves: int) -> None:
        try:
            if self._holder.held and self._motion.waiting() and self._motion.is_idle(moves):
                await self._motion.abort()
        except NotDone as error:
            _LOG.warning("%s: the end of a jog: %s", self._holder.device, error)
