# SPDX-License-Identifier: GPL-2.0-or-later
"""Gains of heaters: shown, set and searched for, as M301, M303 and M304 do it. They last until the daemon ends."""
from __future__ import annotations

import asyncio
import contextlib

import pokeys
from pokeys import OneShot, Outcome

from ..hub import Hub
from ..wire import NotDone
from . import report
from .heating import BED, HOT_END, Heating
from .holder import Holder
from .lane import Job
from .parser import BadWords

GAINS = "PID"               # in the order of enum pokeys_gain
USUAL = {HOT_END: 150.0, BED: 60.0}     # degrees C, at which M303 searches
RUNS, DONE = 1, 2           # heater.NN.tuning
REPORT_S, LOOK_S = 1.0, 0.1
SEARCH_S = 7200.0           # the daemon ends it before


class Tuning:
    """Belongs to the event loop's thread."""

    def __init__(self, hub: Hub, holder: Holder, heating: Heating) -> None:
        self._hub, self._holder, self._heating = hub, holder, heating

    async def gains(self, job: Job, kind: str) -> str:
        """M301: E and a hot end; M304: the bed. P, I and D in 1/255 of the full power, as Marlin has them; without
        them, they are shown."""
        words = job.line.words()
        index = self._heating.find(kind, words.get("E")).index
        given = {letter: words[letter] for letter in GAINS if letter in words}
        for letter, value in given.items():
            if value is None or value < 0:
                raise BadWords(f"{letter} needs a number that is not negative")
        if not given:
            return "echo: " + " ".join(f"{letter.lower()}:{self._gain(index, letter):.2f}" for letter in GAINS)
        await self._set(index, {letter: value or 0.0 for letter, value in given.items()})
        return ""

    async def search(self, job: Job) -> str:
        """M303: E and a hot end, or E-1 for the bed; S and degrees C; U1: use what is found."""
        words = job.line.words()
        tool = words.get("E")
        kind = BED if tool == -1 else HOT_END
        heater = self._heating.find(kind, None if kind == BED else tool)
        celsius = words.get("S") or USUAL[kind]
        if not 0 < celsius <= heater.most:
            raise NotDone(f"the temperature must be above 0, and at most {heater.most:g} degrees C")
        if heater.trouble or heater.target:
            raise NotDone(f"heater {heater.title}{f': {heater.trouble}' if heater.trouble else ' has to be off'}")
        if self._heating.searching:
            raise NotDone("the gains of a heater are being searched for already")
        self._heating.searching.add(heater.index)
        self._heating.used_at = asyncio.get_running_loop().time()
        try:
            await self._holder.take()
            # the daemon heats only who was off
            await self._holder.update({f"heater.{heater.index:02}.target": 0.0})
            await self._holder.wait()
            found = await self._search(job, heater.index, celsius)
        finally:
            self._heating.searching.discard(heater.index)
        if words.get("U"):
            await self._set(heater.index, found)
        prefix = "bed" if kind == BED else ""
        return "\n".join(("PID Autotune finished!",
                          *(f"#define DEFAULT_{prefix}K{letter.lower()} {found[letter]:.2f}" for letter in GAINS)))

    # ---- one step

    def _state(self) -> pokeys.State:
        return self._holder.seen()

    def _gain(self, index: int, letter: str, source: str = "pid") -> float:
        return float(self._state()[f"heater.{index:02}.{source}-{letter.lower()}"] or 0.0)

    async def _set(self, index: int, gains: dict[str, float]) -> None:
        await self._holder.take()
        # those that get greater first: P and I are never both 0 in between
        for letter in sorted(gains, key=lambda letter: self._gain(index, letter) - gains[letter]):
            if await self._holder.order(OneShot.HEATER_GAIN, index=index, mask=GAINS.index(letter),
                                        parameters=[gains[letter]]) != Outcome.DONE:
                raise NotDone(f"the daemon refused {letter}{gains[letter]:g}")

    async def _search(self, job: Job, index: int, celsius: float) -> dict[str, float]:
        tuning = f"heater.{index:02}.tuning"
        loop = asyncio.get_running_loop()
        end, reported = loop.time() + SEARCH_S, loop.time()
        try:
            # it may begin although nobody waits for that any more
            if await self._holder.order(OneShot.HEATER_TUNE, index=index, parameters=[celsius]) != Outcome.DONE:
                raise NotDone("the daemon refused the search; pokeysctl events may show the reason")
            job.tell("PID Autotune start")
            while (state := self._state())[tuning] == RUNS and not job.gone:
                self._holder.check()
                if index not in self._heating.searching:
                    raise NotDone("the search was ended")
                if loop.time() >= end:
                    raise NotDone("the search does not end")
                if loop.time() - reported >= REPORT_S:
                    reported = loop.time()
                    job.tell(f" {report.temperatures(self._hub)}")
                await asyncio.sleep(LOOK_S)
        finally:
            # also after a stop; of one that has ended, it is nothing
            with contextlib.suppress(NotDone):
                await self._holder.order(OneShot.HEATER_TUNE, index=index, parameters=[0.0], always=True)
        if state[tuning] != DONE:
            raise NotDone("no gains were found; pokeysctl events may show the reason")
        return {letter: self._gain(index, letter, "tuned") for letter in GAINS}
