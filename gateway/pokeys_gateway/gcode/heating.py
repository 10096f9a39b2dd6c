# SPDX-License-Identifier: GPL-2.0-or-later
"""Targets of the daemon's heaters, as G-code sets them and waits for them.

The daemon watches the heaters. What is here notices that the daemon has switched one off, so that a host does not
print on with it.
"""
from __future__ import annotations

import asyncio
import contextlib
import math

import pokeys

from ..hub import Hub
from ..wire import NotDone
from . import report
from .holder import Holder
from .lane import Job
from .parser import BadWords, Line
from .report import Heater
from .waits import Waits

LOOK_S = 0.1
REPORT_S = 1.0              # temperatures, while somebody waits for them
REACHED_S = 2.0             # it has to be there for so long
REACH_S = 3600.0            # and has so much time to get there
FOLLOW_S = 2.0              # the daemon takes a target within this time
NEAR_K = 0.01               # of a target that is a float of 32 bits
HOT_END, BED, CHAMBER = "T", "B", "C"
KINDS = {HOT_END: "hot end", BED: "bed", CHAMBER: "chamber"}


class Heating:
    """The heaters of the device that G-code commands. Belongs to the event loop's thread."""

    def __init__(self, hub: Hub, holder: Holder, waits: Waits) -> None:
        self._hub = hub
        self._holder, self._waits = holder, waits
        self._targets: dict[int, float] = {}        # commanded, by the device's numbers
        self._since: dict[int, float] = {}          # when
        self.searching: set[int] = set()            # those whose gains are searched for
        self._seen = 0.0            # when the device was connected
        self.used_at = 0.0          # when a target was commanded last
        self._order = asyncio.Lock()
        self._giving: set[asyncio.Task[None]] = set()

    @property
    def commanded(self) -> bool:
        """A heater has a target, or is about to get one, or heats to find its gains."""
        return bool(self._targets or self.searching) or self._order.locked()

    @property
    def faulty(self) -> bool:
        """A heater is off by a fault."""
        return any(heater.fault for heater in self.all())

    # ---- commands

    async def set(self, job: Job, kind: str, *letters: str) -> tuple[int, bool]:
        """Set the target that stands behind the first of these letters. Which heater, and is it that letter?"""
        heater, celsius, letter = self.judge(job.line, kind, letters, job.modes.tool)
        return await self._set(heater, celsius), letter == letters[0]

    def judge(self, line: Line, kind: str, letters: tuple[str, ...], tool: float) -> tuple[Heater, float, str]:
        """Which heater a line is for, its target and the letter before that; `tool` is selected. :class:`BadWords`,
        :class:`NotDone` for what the heater cannot have at any time."""
        words = line.words()
        letter = next((letter for letter in letters if words.get(letter) is not None), "")
        celsius = words.get(letter)
        if celsius is None:
            raise BadWords(f"needs {' or '.join(letters)} with a temperature in degrees C")
        number = words.get("T")
        heater = self.find(kind, tool if number is None else number)
        if not 0 <= celsius <= heater.most:
            raise NotDone(f"the target of heater {heater.title} must be 0 to {heater.most:g} degrees C")
        return heater, celsius, letter

    async def reach(self, job: Job, kind: str) -> None:
        """Set a target and wait for it: after S only while the heater is colder, after R also while it is warmer."""
        index, heats = await self.set(job, kind, "S", "R")
        heater = self._of(index)
        if heats and heater.celsius > self._targets.get(index, 0.0):
            return
        with self._waits.one() as given_up:
            await self._reach(job, index, given_up)

    def forget(self) -> dict[str, float]:
        """They are to be switched off, by these values."""
        indices = {*self._targets, *(heater.index for heater in self.all())}
        self._targets.clear()
        self.searching.clear()
        self._since.clear()
        return {_name(index): 0.0 for index in sorted(indices)}

    async def reset(self) -> list[str]:
        """Clear the faults; what could not be cleared, and why."""
        left = []
        for heater in [heater for heater in self.all() if heater.fault]:
            await self._holder.update({_name(heater.index): 0.0})
            outcome = await self._holder.order(pokeys.OneShot.HEATER_RESET, index=heater.index)
            if outcome != pokeys.Outcome.DONE:
                left.append(f"heater {heater.title}: the cause of its fault is still present: "
                            f"{self._of(heater.index).trouble}")
        return left

    # ---- what the daemon does

    def trouble(self, now: float) -> str:
        """Why a heater does not have the target that it should have; "": all have theirs."""
        reading = self._hub.source.read(self._holder.device)
        if (reading and reading.connected) or not self._targets:
            self._seen = now
        elif now - self._seen > FOLLOW_S:
            return reading.reason if reading else self._hub.no_such_device(self._holder.device)
        else:
            return ""
        for index, celsius in self._targets.items():
            heater = self._of(index)
            if heater.fault:
                return f"heater {heater.title} is off by a fault: {heater.trouble}"
            if abs(heater.target - celsius) > NEAR_K and now - self._since[index] > FOLLOW_S:
                why = heater.refusal or heater.trouble or "pokeysctl events may show the reason"
                return f"heater {heater.title} was switched off: {why}"
        return ""

    def off(self) -> bool:
        """The daemon heats nothing."""
        return not any(heater.target for heater in self.all())

    # ---- one heater

    def all(self) -> list[Heater]:
        """Those of the device."""
        return [heater for heater in report.heaters(self._hub) if heater.device == self._holder.device]

    def _of(self, index: int) -> Heater:
        nothing = Heater(self._holder.device, index, "", "", math.nan, 0.0, 0.0, False, 0.0, False, "", "")
        return next((heater for heater in self.all() if heater.index == index), nothing)

    def find(self, kind: str, number: float | None) -> Heater:
        """The hot end with this number, or the bed or the chamber. :class:`NotDone`."""
        letter = kind if kind != HOT_END else f"{kind}{number or 0:g}"
        for heater in report.heaters(self._hub):
            if heater.letter == letter:
                if heater.device != self._holder.device:
                    raise NotDone(f"heater {heater.title} belongs to {heater.device}, which G-code does not command")
                return heater
        reading = self._hub.source.read(self._holder.device)
        if not reading or not reading.state:
            raise NotDone(reading.reason if reading else self._hub.no_such_device(self._holder.device))
        raise NotDone(f"there is no {KINDS[kind]}{letter[1:] and ' ' + letter}")

    async def _set(self, heater: Heater, celsius: float) -> int:
        if celsius and heater.trouble:
            what = "off by a fault" if heater.fault else "not ready"
            raise NotDone(f"heater {heater.title} is {what}: {heater.trouble}")
        if celsius and heater.index in self.searching:
            raise NotDone(f"the gains of heater {heater.title} are being searched for; M104 S0 or M140 S0 ends that")
        self.searching.discard(heater.index)
        # a stop ends the wait for it, and not what is half done
        giving = asyncio.get_running_loop().create_task(self._give(heater.index, celsius))
        self._giving.add(giving)
        giving.add_done_callback(self._given)
        await asyncio.shield(giving)
        return heater.index

    def _given(self, giving: asyncio.Task[None]) -> None:
        self._giving.discard(giving)
        if not giving.cancelled():
            giving.exception()      # whoever waits for it has it

    async def _give(self, index: int, celsius: float) -> None:
        name = _name(index)
        async with self._order:
            self._holder.check()
            if not celsius and not self._holder.held and not self._of(index).target:
                return
            self.used_at = asyncio.get_running_loop().time()
            await self._holder.take()
            if celsius and index not in self._targets:
                # the daemon heats only who was off
                await self._holder.update({name: 0.0})
                await self._holder.wait()
            before = self._targets.get(index), self._since.get(index)
            self._targets[index] = celsius
            self._since[index] = asyncio.get_running_loop().time()
            try:
                await self._holder.update({name: celsius})
            except NotDone:
                self._restore(index, *before)
                raise
            if not celsius:
                self._targets.pop(index, None)

    def _restore(self, index: int, celsius: float | None, since: float | None) -> None:
        """It is still commanded, unless a stop has come meanwhile."""
        self._targets.pop(index, None)
        with contextlib.suppress(NotDone):
            self._holder.check()
            if celsius is not None and since is not None:
                self._targets[index], self._since[index] = celsius, since

    async def _reach(self, job: Job, index: int, given_up: asyncio.Event) -> None:
        loop = asyncio.get_running_loop()
        end, reported = loop.time() + REACH_S, loop.time()
        since: float | None = None
        while (celsius := self._targets.get(index, 0.0)) and not job.gone and not given_up.is_set():
            heater, now = self._of(index), loop.time()
            if not heater.reached or abs(heater.target - celsius) > NEAR_K:
                since = None
            elif since is None:
                since = now
            elif now - since >= REACHED_S:
                return
            if now >= end:
                raise NotDone(f"heater {heater.title} is not at {celsius:g} degrees C after {REACH_S / 60:.0f} minutes")
            if now - reported >= REPORT_S:
                reported = now
                job.tell(f" {report.temperatures(self._hub)}")
            await asyncio.sleep(LOOK_S)


def _name(index: int) -> str:
    """Of its target in the command image."""
    return f"heater.{index:02}.target"
