# SPDX-License-Identifier: GPL-2.0-or-later
"""What all doors share: the source, the names, and the tasks that go on beside the clients."""
from __future__ import annotations

import asyncio
import bisect
import logging
import time
from collections.abc import Callable, Coroutine
from typing import Any

from .config import Config
from .model import Model
from .operate import Operators
from .source import Source

LOOK_S = 1.0
LAG_S, LAG_LATE_S, LAG_QUIET_S = 0.02, 0.010, 10.0
LAG_WARN_S = 0.05           # an idle computer is more than LAG_LATE_S late a few times an hour
LAGS_S = 0.001, 0.002, 0.005, LAG_LATE_S, 0.02, LAG_WARN_S, 0.1, 0.5       # upper bounds of its histogram
_LOG = logging.getLogger("pokeys-gateway")


class Lag:
    """How late the event loop is: whatever blocks it keeps all clients waiting."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.most = 0.0
        self.total = 0.0
        self.counts = [0] * (len(LAGS_S) + 1)       # between the bounds, and above the last one
        self.late = 0               # how often it was later than LAG_LATE_S
        self._warned: float | None = None

    def take(self, late: float) -> None:
        """Note one measurement, in seconds; more than 50 ms are logged, at most once in 10 s."""
        self.most = max(self.most, late)
        self.total += late
        self.counts[bisect.bisect_left(LAGS_S, late)] += 1
        self.late += late > LAG_LATE_S
        now = self._clock()
        if late <= LAG_WARN_S:
            return
        if self._warned is None or now - self._warned >= LAG_QUIET_S:
            self._warned = now
            _LOG.warning("the event loop was %.0f ms late; all clients waited (more than %.0f ms, since the start: %d)",
                         late * 1e3, LAG_LATE_S * 1e3, self.late)

    async def watch(self) -> None:
        """Measure for ever."""
        while True:
            before = self._clock()
            await asyncio.sleep(LAG_S)
            self.take(max(0.0, self._clock() - before - LAG_S))


class Hub:
    """The heart of the gateway. Belongs to the event loop's thread."""

    def __init__(self, config: Config, model: Model) -> None:
        self.config = config
        self.model = model
        self.source = Source(config.runtime_directory)
        self.operators = Operators(config.proxy)
        self.lag = Lag()
        self._tasks: list[asyncio.Task[None]] = []
        self._told = ""

    async def start(self) -> None:
        """Find the devices that are there, and go on looking."""
        await self._look()
        self._begin(self._follow())
        self._begin(self.lag.watch())

    def _begin(self, work: Coroutine[Any, Any, None]) -> None:
        self._tasks.append(asyncio.get_running_loop().create_task(work))

    async def _look(self) -> None:
        before = self.source.names()
        await asyncio.to_thread(self.source.look)
        if self.source.trouble != self._told:
            self._told = self.source.trouble
            if self._told:
                _LOG.warning("%s", self._told)
        for name in sorted(set(self.source.names()) - set(before)):
            _LOG.info("%s: showing it", name)

    async def _follow(self) -> None:
        while True:
            await asyncio.sleep(LOOK_S)
            try:
                await self._look()
            except Exception:
                _LOG.exception("looking for devices")

    def no_such_device(self, name: object) -> str:
        """For a client that asks for one that is not there."""
        return f"there is no device {name!r}; there are: {', '.join(self.source.names()) or 'none'}"

    def events(self, name: str, since: tuple[int, int] | None = None) -> list[dict[str, Any]]:
        """What has happened to a device, for JSON; from the event of this epoch and number on, if it is still there."""
        found = self.source.events(name)
        # the newest are asked for again and again
        at = next((i for i in reversed(range(len(found))) if (found[i].epoch, found[i].number) == since), 0)
        return [{"device": one.device, "epoch": one.epoch, "number": one.number, "time": one.time.isoformat(),
                 "level": one.level, "kind": one.kind, "text": one.text, "held": one.held}
                for one in found[at:]]

    async def close(self) -> None:
        """End the tasks and detach."""
        self.operators.close()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await asyncio.to_thread(self.source.close)
