# SPDX-License-Identifier: GPL-2.0-or-later
"""The device that G-code commands: what is commanded, what stops it, and when the gateway is its commander.

The gateway takes the commander's place with the first command that needs it, and leaves it when nothing is
commanded any more, so that others can have it. After an emergency stop, a heater's fault or the loss of the place,
nothing is commanded until M999: a host that goes on sending lines must not go on printing.
"""
from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine, Mapping
from typing import Any

from ..hub import Hub
from ..wire import NotDone
from .heating import Heating
from .holder import Holder

IDLE_S = 5.0                # commanding nothing
STOP_S = 2.0                # to be confirmed
LOOK_S = 0.005
EMERGENCY = "emergency_stop"
RESUME = "M999"
_LOG = logging.getLogger("pokeys-gateway")


class Operation:
    """Belongs to the event loop's thread."""

    def __init__(self, hub: Hub, device: str, failed: Callable[[str], None]) -> None:
        """``failed`` is told why nothing is commanded any more."""
        self._hub = hub
        self._failed = failed
        self.holder = Holder(device, hub.config.runtime_directory)
        self.holder.on_beat = self._look
        self.holder.on_lost = self._lost
        self.heating = Heating(hub, self.holder)
        self.halted = ""            # why nothing is commanded; "": it may be
        self._idle_since: float | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    def check(self) -> None:
        """:class:`NotDone` if nothing may be commanded."""
        if self.halted:
            raise NotDone(f"{self.halted}; {RESUME} permits commands again")

    def begin_stop(self, method: str) -> asyncio.Future[None]:
        """It is under way from now on, and done when the daemon has confirmed it; or :class:`NotDone`."""
        self.holder.interrupt()
        if method == EMERGENCY:
            self.halted = "stopped by M112"
        stop = self._begin(self._stop(method == EMERGENCY))
        stop.add_done_callback(lambda done: done.cancelled() or done.exception())
        return stop

    async def resume(self) -> str:
        """After a stop or a fault: reset the heaters, and permit commands. What is still wrong, as lines."""
        if self.holder.held:
            await self.holder.update({"emergency-stop": False})
            await self.holder.wait()
        self.halted = ""
        if not self.heating.faulty:
            return ""
        await self.holder.take()
        return "\n".join(f"echo:{line}" for line in await self.heating.reset())

    async def close(self) -> None:
        """The gateway ends: the daemon switches off what was commanded."""
        await self.holder.close()

    # ---- what happens

    def _begin(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    def _look(self) -> None:
        """While the place is held."""
        now = asyncio.get_running_loop().time()
        if why := self.heating.trouble(now):
            self._fail(why)
        if self.heating.commanded or self._tasks:
            self._idle_since = None
        elif self._idle_since is None:
            self._idle_since = now
        elif now - self._idle_since >= IDLE_S:
            self._idle_since = None
            self._begin(self.holder.release())

    def _lost(self, why: str) -> None:
        """The daemon has switched off what was commanded."""
        if self.heating.commanded:
            self._fail(why)

    def _fail(self, why: str) -> None:
        _LOG.error("%s: %s", self.holder.device, why)
        self.halted = why
        self.holder.interrupt()
        values = self.heating.forget()
        if self.holder.held:
            self._begin(self._all_off(values))
        self._failed(why)

    async def _all_off(self, values: Mapping[str, float]) -> None:
        try:
            await self.holder.stop(values)
        except NotDone as error:
            _LOG.warning("%s: %s", self.holder.device, error)

    async def _stop(self, emergency: bool) -> None:
        held = await self.holder.settle()
        if held:
            await self.holder.stop({"emergency-stop": True, **self.heating.forget()} if emergency else {})
        loop = asyncio.get_running_loop()
        end = loop.time() + STOP_S
        while not self._stopped(held, emergency):
            if loop.time() >= end:
                raise NotDone("a heater is still on" if held else f"another program commands {self.holder.device}")
            await asyncio.sleep(LOOK_S)

    def _stopped(self, held: bool, emergency: bool) -> bool:
        reading = self._hub.source.read(self.holder.device)
        if not reading or not reading.state:
            raise NotDone(reading.reason if reading else self._hub.no_such_device(self.holder.device))
        if held:
            return not emergency or self.heating.off()
        return not reading.state.commander_alive
