# SPDX-License-Identifier: GPL-2.0-or-later
"""The lines of one client that take time, carried out one after the other. Other clients do not wait for them."""
from __future__ import annotations

import asyncio
import copy
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING
from weakref import ReferenceType, ref

from ..console.client import Client
from .parser import BadWords, Line

if TYPE_CHECKING:
    from .card import Storing

LANE_MOST = 8               # lines that wait; the client's next ones stay with the router
KEPT_MOST = 64
BUSY_S = 2.0
BUSY = "echo:busy: processing"


class Modes:
    """What the lines of one client have set. Those of another one change nothing of it."""

    def __init__(self) -> None:
        self.relative = self.relative_extruder = False
        self.scale = 1.0                    # mm for each unit
        self.feed: float | None = None      # as given, units/s
        self.feed_scale = 1.0               # mm for each of them
        self.tool = 0                       # hot end
        self.motion = ""                    # the last one of G0 to G3
        self.doubt = False                  # G90 may be among the lines that were not carried out

    def interrupt(self) -> None:
        """Lines were not carried out: the next move has to name its command, and after G91 its mode."""
        self.motion = ""
        self.doubt = self.doubt or self.relative

    def set_feed(self, number: float) -> None:
        """F: units/min; 0 changes nothing. :class:`BadWords`."""
        if number < 0:
            raise BadWords("F must be greater than 0")
        if number == 0:
            return
        self.feed, self.feed_scale = number / 60, self.scale


class Kept:
    """Modes of clients that come again with each request, by user and address.

    A request has its own, or two at once would change each other's: a line of G91 would be carried out after the other
    one's G90. What it has set is kept when it has ended.
    """

    def __init__(self) -> None:
        self._of: dict[tuple[str, str], Modes] = {}
        # the requests under way: whose, the modes at its beginning, and now
        self._requests: list[tuple[ReferenceType[Client], Modes, Modes, Modes]] = []

    def of(self, client: Client) -> Modes:
        """Those of the requests that have ended."""
        self._requests = [one for one in self._requests if not _take_over(*one)]
        key = client.who.name if client.who else "", client.address
        self._of[key] = kept = self._of.pop(key, None) or Modes()
        if len(self._of) > KEPT_MOST:
            del self._of[next(iter(self._of))]
        modes = copy.copy(kept)
        self._requests.append((ref(client), kept, copy.copy(kept), modes))
        return modes


def _take_over(whose: ReferenceType[Client], kept: Modes, begun: Modes, now: Modes) -> bool:
    """What a request has changed, if it has ended."""
    client = whose()
    if client and client.connected:
        return False
    vars(kept).update({name: value for name, value in vars(now).items() if value != vars(begun)[name]})
    return True


@dataclass(frozen=True)
class Job:
    """A line that is to be carried out."""

    asker: Client | None    # None: a file
    line: Line
    modes: Modes
    tell: Callable[[str], None]
    storing: Storing | None = None      # it is part of a file
    several: bool = False   # commands are in the line, of which one may set a mode

    @property
    def gone(self) -> bool:
        """Nobody waits for it any more."""
        return self.asker is not None and not self.asker.connected

    def owe(self, replies: int) -> None:
        """Its asker has so many more to come."""
        if self.asker:
            self.asker.due += replies


class Lane:
    """Belongs to the event loop's thread."""

    def __init__(self, run: Callable[[Job], Awaitable[None]], on_room: Callable[[], None]) -> None:
        """``run`` carries a job out, with its reply, and raises nothing."""
        self._run, self._on_room = run, on_room
        self._jobs: deque[Job] = deque()        # the first one is under way
        self._task: asyncio.Task[None] | None = None
        self._skips = 0             # so many of the first ones
        self.modes = Modes()
        self.storing: Storing | None = None     # lines that come now go into this file
        self.held = False           # the router keeps what the client sends

    @property
    def busy(self) -> bool:
        """Something is under way."""
        return bool(self._jobs)

    @property
    def full(self) -> bool:
        """It takes no more."""
        return len(self._jobs) > LANE_MOST

    def put(self, job: Job) -> None:
        """Carry it out after the others."""
        self._jobs.append(job)
        job.owe(1)
        if not self._task:
            self._task = asyncio.get_running_loop().create_task(self._go())

    def skip(self, lines: int) -> None:
        """A line has failed: those that are here already count on it, and so many have been discarded."""
        self._skips = len(self._jobs)
        if self._skips > 1 or lines or self._jobs[0].several:
            self.modes.interrupt()

    def has(self, job: Job) -> bool:
        """It is still under way."""
        return bool(self._jobs) and self._jobs[0] is job

    def holds(self, name: str) -> bool:
        """A line with this command is under way, or waits."""
        return any(job.line.name == name for job in self._jobs)

    def skips(self, job: Job) -> bool:
        """Is this one of them?"""
        return self._skips > 0 and self.has(job)

    def tell(self, text: str) -> None:
        """A reply to the line that is under way."""
        self._jobs[0].tell(text)

    def clear(self, why: str) -> int:
        """Carry out nothing any more, and end what is under way, without replies; how many lines that are."""
        lines = len(self._jobs)
        several = bool(self._jobs) and self._jobs[0].several
        for job in self._jobs:
            job.owe(-1)
            if job.storing:
                job.storing.spoil(why)
        self._jobs.clear()
        self._skips = 0
        self.modes.motion = ""      # the next move has to name its command
        if lines > 1 or several:
            self.modes.interrupt()
        if self._task:
            self._task.cancel()
            self._task = None
        return lines

    async def _go(self) -> None:
        while self._jobs:
            job = self._jobs[0]
            busy = asyncio.get_running_loop().create_task(_tell_busy(job))
            try:
                await self._run(job)
            finally:
                busy.cancel()
            if not self._jobs or self._jobs[0] is not job:
                return      # cleared meanwhile
            self._jobs.popleft()
            self._skips = max(0, self._skips - 1)
            job.owe(-1)
            self._on_room()
        self._task = None


async def _tell_busy(job: Job) -> None:
    while True:
        await asyncio.sleep(BUSY_S)
        job.tell(BUSY)
