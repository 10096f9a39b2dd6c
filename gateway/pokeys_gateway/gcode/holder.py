# SPDX-License-Identifier: GPL-2.0-or-later
"""The place of a device's one commander, which the gateway has while G-code needs it.

Nothing here keeps anybody safe: the daemon ends what was commanded when the lease or the heartbeat ends, whatever
the gateway does. The event loop renews the lease, so a loop that hangs loses it.

Whatever may take a moment is done by one thread, in the order in which it was asked for. A stop has its place in
that order too. What belongs to a line that was begun before the stop (:meth:`Holder.begin`) is not done any more.
"""
from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable, Coroutine, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import Context, ContextVar
from typing import Any, TypeVar

import pokeys

from ..wire import NotDone

LEASE_S = 1.0
BEAT_S = 0.1                # from one renewal to the next
LOOK_S = 0.005              # ... for an outcome
OUTCOME_S = 3.0
AXES, SERVOS = 8, 6         # of the command image
STOPPED = "stopped"
Result = TypeVar("Result")
# how many stops there were when the line was begun that this task carries out; None: it belongs to no line
_TURN: ContextVar[int | None] = ContextVar("turn", default=None)
_LOG = logging.getLogger("pokeys-gateway")


def begin(work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
    """A task that belongs to no line, whoever begins it."""
    return asyncio.get_running_loop().create_task(work, context=Context())


async def each(*steps: Callable[[], Awaitable[object]]) -> None:
    """All of them, also if one fails; then the first failure."""
    failed: Exception | None = None
    for step in steps:
        try:
            await step()
        except Exception as error:
            failed = failed or error
    if failed:
        raise failed


class Holder:
    """Belongs to the event loop's thread. What is asked for raises :class:`NotDone` with the reason."""

    def __init__(self, device: str, runtime: str, seen: Callable[[], pokeys.State]) -> None:
        """``seen`` is the device's state, for those who command it."""
        self.device, self.seen = device, seen
        self.on_beat: Callable[[], None] = lambda: None             # while the place is held
        self.on_lost: Callable[[str], None] = lambda why: None      # it is not held any more
        self.moving = asyncio.Lock()        # of who enables axes, moves them, or switches the machine on
        self._runtime = runtime
        self._thread = ThreadPoolExecutor(1, "commander")
        self._turn = 0              # how many stops there were
        self._place: pokeys.Commander | None = None
        self._command: pokeys.Command | None = None
        self._opening: asyncio.Task[None] | None = None
        self._beating: asyncio.Task[None] | None = None
        self._leaving: set[asyncio.Task[None]] = set()

    @property
    def held(self) -> bool:
        """The gateway commands the device."""
        return self._command is not None

    def begin(self) -> None:
        """A line is begun, by this task and those that it begins."""
        _TURN.set(self._turn)

    def check(self) -> None:
        """:class:`NotDone` if a stop has come since the line was begun."""
        if _TURN.get() not in (None, self._turn):
            raise NotDone(STOPPED)

    def interrupt(self) -> None:
        """A stop has come: what belongs to lines is not done any more, unless it is done already."""
        self._turn += 1

    async def take(self) -> None:
        """Become the commander, unless the gateway is it. May take three seconds."""
        if not self._command:
            if not self._opening:
                self._opening = begin(self._open())
                self._opening.add_done_callback(self._opened)
            await asyncio.shield(self._opening)
        self.check()

    async def settle(self) -> bool:
        """Until an attempt to become it has ended; whether the gateway is it."""
        if self._opening:
            with contextlib.suppress(NotDone):
                await asyncio.shield(self._opening)
        return self.held

    async def update(self, values: Mapping[str, Any], *, axes: Mapping[int, pokeys.Axis] | None = None,
                     servos: Mapping[int, pokeys.Servo] | None = None) -> None:
        """Command these values."""
        command = self._commanding()
        await self._do(lambda: command.update(values, axes=axes, servos=servos))

    async def wait(self) -> None:
        """Until the daemon has seen what was commanded."""
        await self._do(self._commanding().wait)

    async def stop(self, values: Mapping[str, Any], *, motion: bool) -> None:
        """Command these values, whatever comes meanwhile, and wait until the daemon has seen them.

        ``motion``: also switch off the machine with all axes and servo motors.
        """
        command = self._commanding()
        stands = pokeys.Axis(0, 0, enable=False), pokeys.Servo(0.0, enable=False)
        axes = dict.fromkeys(range(AXES), stands[0]) if motion else None
        servos = dict.fromkeys(range(SERVOS), stands[1]) if motion else None
        first = {"machine-is-on": False} if motion else {}

        def both() -> None:
            try:
                command.update({**first, **values}, axes=axes, servos=servos)
            except (KeyError, ValueError) as error:
                # something that the device does not have must not keep the rest on
                _LOG.warning("%s: while switching all off: %s", self.device, error)
                command.update(first, axes=axes, servos=servos)
                for name, value in values.items():
                    with contextlib.suppress(KeyError, ValueError):
                        command.update({name: value})
            command.wait()
        await self._do(both, always=True)

    async def order(self, operation: pokeys.OneShot, *, index: int = 0, mask: int = 0, flags: int = 0,
                    values: Sequence[int] = (), parameters: Sequence[float] = (), fractions: Sequence[int] = (),
                    seconds: float = OUTCOME_S, always: bool = False) -> pokeys.Outcome:
        """Give a one-shot, and wait for its outcome; ``always``: it belongs to a stop."""
        command = self._commanding()

        def give() -> pokeys.Order:
            order = command.order(operation, index=index, mask=mask, flags=flags, values=values, parameters=parameters,
                                  fractions=fractions)
            command.wait()      # most have an outcome then
            return order
        order = await self._do(give, always=always)
        loop = asyncio.get_running_loop()
        end = loop.time() + seconds
        while not (outcome := await self._do(lambda: order.outcome, always=always)):
            if loop.time() >= end:
                raise NotDone("the daemon does not answer")
            await asyncio.sleep(LOOK_S)
        return outcome

    def release(self) -> asyncio.Task[None] | None:
        """Command nothing any more, from now on."""
        place, self._place, self._command = self._place, None, None
        if self._beating and self._beating is not asyncio.current_task():
            self._beating.cancel()
        self._beating = None
        if not place:
            return None
        leaving = begin(self._leave(place))
        self._leaving.add(leaving)
        leaving.add_done_callback(self._leaving.discard)
        return leaving

    async def close(self) -> None:
        """The gateway ends."""
        self.release()
        if self._leaving:
            await asyncio.wait(self._leaving)
        self._thread.shutdown(wait=False)

    # ---- the thread

    def _commanding(self) -> pokeys.Command:
        if not self._command:
            raise NotDone(f"the gateway does not command {self.device}")
        return self._command

    async def _do(self, work: Callable[[], Result], *, always: bool = False) -> Result:
        turn = None if always else _TURN.get()

        def whole() -> Result:
            if turn not in (None, self._turn):
                raise NotDone(STOPPED)
            return work()
        try:
            return await asyncio.get_running_loop().run_in_executor(self._thread, whole)
        except pokeys.Lapsed as error:
            # it would be taken for commanded again
            self._lose(str(error))
            raise NotDone(str(error)) from None
        except (pokeys.Error, OSError, KeyError, TypeError, ValueError) as error:
            raise NotDone(str(error) or type(error).__name__) from None

    def _enter(self) -> tuple[pokeys.Commander, pokeys.Command]:
        with pokeys.attach(self.device, runtime=self._runtime) as device:
            place = device.command(lease=LEASE_S)
        return place, place.__enter__()

    async def _open(self) -> None:
        place, command = await self._do(self._enter)
        self._place, self._command = place, command
        _LOG.info("%s: the gateway commands it for G-code", self.device)
        self._beating = begin(self._beat(command))

    def _opened(self, opening: asyncio.Task[None]) -> None:
        self._opening = None
        if not opening.cancelled():
            opening.exception()     # whoever waits for it has it

    async def _leave(self, place: pokeys.Commander) -> None:
        await asyncio.get_running_loop().run_in_executor(self._thread, place.__exit__, None, None, None)

    async def _beat(self, command: pokeys.Command) -> None:
        """Renew the lease, as long as it is held."""
        loop = asyncio.get_running_loop()
        while self._command is command:
            try:
                await loop.run_in_executor(self._thread, command.renew)
                if self._command is command:
                    self.on_beat()
            except (pokeys.Error, ValueError) as error:
                if self._command is command:
                    self._lose(str(error))
                return
            except Exception:
                _LOG.exception("watching what is commanded")
            await asyncio.sleep(BEAT_S)

    def _lose(self, why: str) -> None:
        if not self._command:
            return
        _LOG.warning("%s: G-code no longer commands it: %s", self.device, why)
        self.release()
        self.on_lost(why)
