# SPDX-License-Identifier: GPL-2.0-or-later
"""The device that G-code commands: what is commanded, what stops it, and when the gateway is its commander.

The gateway takes the commander's place with the first command that needs it, and leaves it when nothing is
commanded any more, so that others can have it. After an emergency stop, a fault or the loss of the place,
nothing is commanded until M999: a host that goes on sending lines must not go on with its job.
"""
from __future__ import annotations

import asyncio
import contextlib
import logging
import math
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from typing import Any

from ..hub import Hub
from ..wire import NotDone
from . import report
from .card import Card, Storing
from .heating import Heating
from .holder import Holder, begin
from .jog import Jog
from .lane import Job
from .motion import Motion
from .outputs import Outputs
from .parser import BadWords, Line
from .seen import Seen
from .tuning import Tuning
from .waits import Waits

IDLE_S = 5.0                # commanding nothing
OFF_AFTER_S = 600.0         # without a move: motors and axes are switched off
COLD_AFTER_S = 1800.0       # without a line that commands something: everything is switched off
STOP_S = 5.0                # to be confirmed: what moves needs its time
LOOK_S = 0.005
PERSON_S = 0.1              # to look for M108
EMERGENCY = "emergency_stop"
RESUME, TOOL = "M999", "M6"
PAUSED = "echo:busy: paused for user"       # as Marlin says it
_LOG = logging.getLogger("pokeys-gateway")


def _pause_of(line: Line) -> tuple[float | None, str]:
    """Of M0: seconds, None: until M108; a text. Who changes a tool has no hurry."""
    if line.name == TOOL:
        return None, line.argument
    try:
        words = line.words()
    except BadWords:
        return None, line.argument
    given = [(words.get(letter), scale) for letter, scale in (("P", 0.001), ("S", 1.0)) if letter in words]
    if words.keys() - {"P", "S"} or any(value is None for value, _ in given):
        return None, line.argument
    seconds = sum((value or 0.0) * scale for value, scale in given)
    if seconds < 0:
        raise BadWords("its time must not be negative")
    return seconds or None, ""


class Operation:
    """Belongs to the event loop's thread."""

    def __init__(self, hub: Hub, device: str, failed: Callable[[str], None], say: Callable[[str], None]) -> None:
        """``failed`` takes the reason when nothing is commanded any more; ``say`` sends a line to all clients."""
        self._hub = hub
        self._failed, self._say = failed, say
        self.busy: Callable[[], bool] = lambda: False       # lines are being carried out
        self.holder = Holder(device, hub.config.runtime_directory, Seen(hub, device))
        self.holder.on_beat = self._look
        self.holder.on_lost = self._fail
        self.waits = Waits()
        self.heating = Heating(hub, self.holder, self.waits)
        self.motion = Motion(hub, self.holder)
        self.outputs = Outputs(hub, self.holder)
        self.tuning = Tuning(hub, self.holder, self.heating)
        self.message = ""           # of M117
        self._jog = Jog(self.motion, self.holder, lambda: self.begin_stop("stop"))
        folder = hub.config.machine_folder
        self._card = Card(folder, say) if folder else None
        self._looking: asyncio.Task[None] | None = None
        self.halted = ""            # why nothing is commanded; "": it may be
        self._emergency = False     # it is commanded, until M999
        self._resuming = 0
        self._idle_since: float | None = None
        self._worked_at = 0.0       # when a line was carried out that took time
        self._tasks: set[asyncio.Task[None]] = set()
        self._stops: set[asyncio.Task[None]] = set()

    async def ready(self) -> None:
        """When no stop is under way; :class:`NotDone` if nothing may be commanded."""
        while self._stops:
            await asyncio.wait(set(self._stops))
        if self.halted:
            raise NotDone(f"{self.halted}; {RESUME} permits commands again")

    @property
    def card(self) -> Card:
        """:class:`NotDone` if there is none."""
        if not self._card:
            raise NotDone("no folder of files is set; see folder in [machine] in pokeys-gateway.conf(5)")
        return self._card

    def about(self) -> dict[str, Any]:
        """For a page: what is commanded."""
        return {"device": self.holder.device, "axes": self.motion.letters(), "halted": self.halted,
                "message": self.message,
                "heaters": [{"name": one.title, "index": one.index, "letter": one.letter, "most": one.most}
                            for one in self.heating.all()],
                "outputs": self._outputs(), "files": self._card is not None,
                "job": self._card.about() if self._card else None}

    def _outputs(self) -> list[dict[str, str]]:
        with contextlib.suppress(NotDone):
            return [{"word": f"{'P' if one.kind == 'pin' else 'R'}{one.number}", "name": f"{one.place}.out-fb"}
                    for one in self.outputs.switches()]
        return []

    @property
    def files(self) -> bool:
        """There is a folder of files."""
        return self._card is not None

    @property
    def running(self) -> bool:
        """A job of a file is under way, or waits."""
        return self._card is not None and self._card.running

    @property
    def prints(self) -> bool:
        """A job of a file is under way, and does not wait."""
        return self._card is not None and self._card.goes_on

    def show(self, text: str) -> None:
        """M117: on the page."""
        self.message = text

    def tell(self, text: str) -> None:
        """M118: to all clients."""
        self._say(report.message(text))

    async def wait(self, job: Job) -> None:
        """M0, when all moves have ended: until M108, or for a time; all clients are told its text."""
        seconds, text = _pause_of(job.line)
        await self.motion.finish()
        if text:
            self.show(text)
        if seconds is None and not job.asker:
            self.card.pause(f"{job.line.name} {text}".strip())
            return
        if seconds is None:
            self._say(f"echo:{f'{job.line.name} {text}'.strip()}: it waits; M108 lets it go on")
            job.tell(PAUSED)
        loop = asyncio.get_running_loop()
        end = math.inf if seconds is None else loop.time() + seconds
        with self.waits.one() as given_up:
            while not given_up.is_set() and not job.gone and loop.time() < end:
                await asyncio.sleep(PERSON_S)

    def store(self, name: str) -> Storing:
        """A file that is to be written; :class:`NotDone` if there is no folder."""
        return Storing(self.card, name)

    def open(self, judge: Callable[[Line], list[tuple[Line, bool]]],
             run: Callable[[Job], Awaitable[None]]) -> None:
        """``judge`` gives the commands of a line of a file, each with whether it exists, or raises why it cannot be
        carried out; ``run`` carries a command out."""
        if self._card:
            self._card.judge, self._card.run, self._card.axes = judge, run, self.motion.letters
            # the disk may hang
            self._looking = begin(self._card.open())

    async def jog(self, owner: object, axis: str, speed: float) -> None:
        """Units/s, to be repeated as long as `owner`, who differs for each client and axis, holds it; 0: it is up."""
        if speed == 0:
            self._jog.end(owner)
            return
        if self._stops:
            raise NotDone("a stop is under way")
        if self.prints:
            raise NotDone("a job is under way")
        if self.busy():
            raise NotDone("lines of G-code are being carried out")
        await self.ready()
        self.holder.begin()
        await self._jog.wish(owner, axis.upper(), speed)

    def abort(self, why: str) -> int:
        """End the job of a file; how many that were."""
        return self._card.abort(why) if self._card else 0

    def begin_stop(self, method: str) -> asyncio.Future[None]:
        """It is under way from now on, and done when the daemon has confirmed it; or :class:`NotDone`."""
        emergency = method == EMERGENCY
        self.holder.interrupt()
        self._jog.forget()
        if emergency:
            self.halted, self._emergency = "stopped by M112", True
        stop = self._begin(self._stop(emergency))
        self._stops.add(stop)
        stop.add_done_callback(self._stops.discard)
        stop.add_done_callback(lambda done: done.cancelled() or done.exception())
        return stop

    async def resume(self) -> str:
        """After a stop or a fault: reset what has one, and permit commands. What is still wrong, as lines."""
        with contextlib.suppress(NotDone):
            await self.ready()
        self.holder.begin()
        self._resuming += 1
        try:
            left: list[str] = []
            if self.holder.held:
                await self.holder.update({"emergency-stop": False})
                await self.holder.wait()
            if self.heating.faulty or self.motion.faulty:
                await self.holder.take()
                left = await self.heating.reset() + await self.motion.reset()
            self.holder.check()
            self.halted, self._emergency = "", False
        finally:
            self._resuming -= 1
        return "\n".join(f"echo:{line}" for line in left)

    async def close(self) -> None:
        """The gateway ends: everything is switched off."""
        self.holder.interrupt()
        if await self.holder.settle():
            with contextlib.suppress(NotDone):
                await self.holder.stop(self._forget(), motion=True)
        await self.holder.close()
        # the disk may hang
        if self._card:
            await self._card.close()

    # ---- what happens

    def _forget(self) -> dict[str, float | bool]:
        """Heaters and outputs are to be switched off, by these values."""
        return {**self.heating.forget(), **self.outputs.forget()}

    def _begin(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = begin(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    def _look(self) -> None:
        """While the place is held."""
        now = asyncio.get_running_loop().time()
        idle = not (self.heating.commanded or self.motion.commanded or self.outputs.commanded or
                    self._tasks or self._resuming or self._emergency)
        # what a stop is about to end is not judged
        if not self._stops and (why := self.heating.trouble(now) or self.motion.trouble()):
            self._fail(why)
        elif self.busy() or self.running:
            self._worked_at = now
        elif (self.heating.commanded or self.outputs.commanded) and max(
                self._worked_at, self.motion.used_at, self.heating.used_at, self.outputs.used_at) < now - COLD_AFTER_S:
            # a host that goes on after that would print with a cold hot end
            self._fail(f"no line has moved or heated for {COLD_AFTER_S / 60:.0f} minutes, so everything was "
                       "switched off")
        if not self.halted and self.motion.commanded:
            if self.busy() or self.running:
                self.motion.use()
            self._begin(self._motors_off() if self.motion.unused_since(now - OFF_AFTER_S) else self._follow())
        if not idle:
            self._idle_since = None
        elif self._idle_since is None:
            self._idle_since = now
        elif now - self._idle_since >= IDLE_S:
            self._idle_since = None
            self.motion.forget()
            self.holder.release()

    async def _follow(self) -> None:
        try:
            await self.motion.follow()
        except NotDone as error:
            _LOG.debug("%s: %s", self.holder.device, error)

    async def _motors_off(self) -> None:
        """Nobody needs them: they would be held for ever."""
        try:
            await self.motion.disable({})
            self._say(f"echo:motors and axes are disabled: no move came for {OFF_AFTER_S / 60:.0f} minutes")
        except NotDone as error:
            _LOG.debug("%s: %s", self.holder.device, error)

    def _fail(self, why: str) -> None:
        """Nothing is commanded from now on."""
        _LOG.error("%s: %s", self.holder.device, why)
        self.halted = self.halted or why
        self.holder.interrupt()
        self._jog.forget()
        values = self._forget()
        self.motion.forget()
        self._begin(self._all_off(values))
        self._failed(why)

    async def _all_off(self, values: Mapping[str, float | bool]) -> None:
        """Also if the place was lost: a heater with hold-s goes on without a commander."""
        try:
            if not self.holder.held and not self.heating.off():
                await self.holder.take()
            if self.holder.held:
                await self.holder.stop(values, motion=True)
        except NotDone as error:
            _LOG.warning("%s: %s", self.holder.device, error)

    # ---- stops

    async def _stop(self, emergency: bool) -> None:
        await self.holder.settle()
        if emergency:
            values = self._forget()
            self.motion.forget()
            if not self.holder.held and self._is_free():
                await self.holder.take()
            if self.holder.held:
                await self.holder.stop({"emergency-stop": True, **values}, motion=True)
        elif self.holder.held:
            await self.motion.stop()
        loop = asyncio.get_running_loop()
        end = loop.time() + STOP_S
        while not self._stopped(emergency):
            if loop.time() >= end:
                raise NotDone(self._still_on(emergency))
            await asyncio.sleep(LOOK_S)

    def _is_free(self) -> bool:
        """Nobody commands the device, and somebody could."""
        reading = self._hub.source.read(self.holder.device)
        return bool(reading and reading.state is not None and reading.connected and not reading.state.commander_alive)

    def _stopped(self, emergency: bool) -> bool:
        reading = self._hub.source.read(self.holder.device)
        if not reading or reading.state is None:
            raise NotDone(reading.reason if reading else self._hub.no_such_device(self.holder.device))
        if not self.holder.held and reading.state.commander_alive:
            return False
        return self.heating.off() and self.outputs.off() and self.motion.off() if emergency else self.motion.still()

    def _still_on(self, emergency: bool) -> str:
        if not self.holder.held and not self._is_free():
            return f"another program commands {self.holder.device}"
        if not emergency:
            return "something still moves"
        if not self.outputs.off():
            return "the spindle is still on"
        return "a motor or an axis is still on" if self.heating.off() else "a heater is still on"
