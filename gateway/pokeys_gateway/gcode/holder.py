# SPDX-License-Identifier: GPL-2.0-or-later
"""The place of a device's one commander, which the gateway has while G-code needs it.

Nothing here keeps anybody safe: the daemon ends what was commanded when the lease or the heartbeat ends, whatever
the gateway does. The event loop renews the lease, so a loop that hangs loses it.

Whatever may take a moment is done by one thread, in the order in which it was asked for. A stop has its place in
that order too, but what was asked for before it and has not begun is not done.
"""
from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import pokeys

from ..wire import NotDone

LEASE_S = 1.0
BEAT_S = 0.1                # from one renewal to the next
LOOK_S = 0.01               # ... for an outcome
OUTCOME_S = 3.0
STOPPED = "stopped"
Result = TypeVar("Result")
_LOG = logging.getLogger("pokeys-gateway")


class Holder:
    """Belongs to the event loop's thread. What is asked for raises :class:`NotDone` with the reason."""

    def __init__(self, device: str, runtime: str) -> None:
        self.device = device
        self.on_beat: Callable[[], None] = lambda: None             # while the place is held
        self.on_lost: Callable[[str], None] = lambda why: None      # it is not held any more
        self._runtime = runtime
        self._thread = ThreadPoolExecutor(1, "commander")
        self._turn = 0              # how many stops there were
        self._place: pokeys.Commander | None = None
        self._command: pokeys.Command | None = None
        self._opening: asyncio.Task[None] | None = None
        self._beating: asyncio.Task[None] | None = None

    @property
    def held(self) -> bool:
        """The gateway commands the device."""
        return self._command is not None

    def interrupt(self) -> None:
        """A stop has come: what was asked for before is not done, unless it is done already."""
        self._turn += 1

    async def take(self) -> None:
        """Become the commander, unless the gateway is it. May take three seconds."""
        if self._command:
            return
        if not self._opening:
            self._opening = asyncio.get_running_loop().create_task(self._open())
            self._opening.add_done_callback(self._opened)
        await asyncio.shield(self._opening)

    async def settle(self) -> bool:
        """Until an attempt to become it has ended; whether the gateway is it."""
        if self._opening:
            with contextlib.suppress(NotDone):
                await asyncio.shield(self._opening)
        return self.held

    async def update(self, values: Mapping[str, Any]) -> None:
        """Command these values."""
        command = self._commanding()
        await self._do(lambda: command.update(values))

    async def stop(self, values: Mapping[str, Any]) -> None:
        """Command these values, whatever comes meanwhile, and wait until the daemon has seen them."""
        command = self._commanding()

        def both() -> None:
            command.update(values)
            command.wait()
        await self._do(both, always=True)

    async def wait(self) -> None:
        """Until the daemon has seen what was commanded."""
        await self._do(self._commanding().wait)

    async def order(self, operation: pokeys.OneShot, *, index: int = 0, mask: int = 0, flags: int = 0,
                    values: Sequence[int] = (), parameters: Sequence[float] = (),
                    fractions: Sequence[int] = ()) -> pokeys.Outcome:
        """Give a one-shot, and wait for its outcome."""
        command = self._commanding()
        order = await self._do(lambda: command.order(operation, index=index, mask=mask, flags=flags, values=values,
                                                     parameters=parameters, fractions=fractions))
        loop = asyncio.get_running_loop()
        end = loop.time() + OUTCOME_S
        while loop.time() < end:
            if outcome := await self._do(lambda: order.outcome):
                return outcome
            await asyncio.sleep(LOOK_S)
        raise NotDone("the daemon does not answer")

    async def release(self) -> None:
        """Command nothing any more; the daemon switches off what was commanded."""
        place, self._place, self._command = self._place, None, None
        if self._beating:
            self._beating.cancel()
            self._beating = None
        if place:
            await asyncio.get_running_loop().run_in_executor(self._thread, _leave, place)

    async def close(self) -> None:
        """The gateway ends."""
        self.interrupt()
        await self.settle()
        await self.release()
        self._thread.shutdown(wait=False)

    # ---- the thread

    def _commanding(self) -> pokeys.Command:
        if not self._command:
            raise NotDone(f"the gateway does not command {self.device}")
        return self._command

    async def _do(self, work: Callable[[], Result], *, always: bool = False) -> Result:
        turn = self._turn

        def whole() -> Result:
            if turn != self._turn and not always:
                raise NotDone(STOPPED)
            return work()
        try:
            return await asyncio.get_running_loop().run_in_executor(self._thread, whole)
        except (pokeys.Error, OSError, KeyError, TypeError, ValueError) as error:
            raise NotDone(str(error) or type(error).__name__) from None

    def _enter(self) -> tuple[pokeys.Commander, pokeys.Command]:
        with pokeys.attach(self.device, runtime=self._runtime) as device:
            place = device.command(lease=LEASE_S)
        return place, place.__enter__()

    async def _open(self) -> None:
        self._place, command = await self._do(self._enter)
        self._command = command
        _LOG.info("%s: G-code commands it", self.device)
        self._beating = asyncio.get_running_loop().create_task(self._beat(command))

    def _opened(self, opening: asyncio.Task[None]) -> None:
        self._opening = None
        if not opening.cancelled():
            opening.exception()     # whoever waits for it has it

    async def _beat(self, command: pokeys.Command) -> None:
        """Renew the lease, as long as it is held."""
        loop = asyncio.get_running_loop()
        while True:
            try:
                await loop.run_in_executor(self._thread, command.renew)
                self.on_beat()
            except (pokeys.Error, ValueError) as error:
                await self._lose(str(error))
                return
            except Exception:
                _LOG.exception("watching what is commanded")
            await asyncio.sleep(BEAT_S)

    async def _lose(self, why: str) -> None:
        _LOG.warning("%s: G-code commands it no more: %s", self.device, why)
        self._beating = None        # this task, which goes on
        await self.release()
        self.on_lost(why)


def _leave(place: pokeys.Commander) -> None:
    place.__exit__(None, None, None)
