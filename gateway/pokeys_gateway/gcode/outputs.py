# SPDX-License-Identifier: GPL-2.0-or-later
"""Fans, a spindle and other outputs of the device that G-code commands: M106, M107, M3 to M5, M42.

Nothing here is a safety function: the daemon and the device switch outputs off when the gateway is gone.
"""
from __future__ import annotations

import asyncio
from collections.abc import Mapping

import pokeys

from ..config import EXTERNALS, PINS, Output
from ..hub import Hub
from ..wire import NotDone
from .holder import Holder
from .lane import Job
from .parser import BadWords, Line

FULL = 255.0                # of S of M106
PERMIT_S = 3.0
LOOK_S = 0.005
NO_FAN = "echo:no fan is set; see fan in [machine] in pokeys-gateway.conf(5)"
NO_SPINDLE = "no spindle is set; see spindle in [machine] in pokeys-gateway.conf(5)"
FORWARD, REVERSE = "M3", "M4"
SEEN_S = 1.0                # until the device has switched an output


class Outputs:
    """Belongs to the event loop's thread."""

    def __init__(self, hub: Hub, holder: Holder) -> None:
        self._holder = holder
        self._fans = hub.config.machine_fan
        self._switch, self._pwm = hub.config.machine_spindle, hub.config.machine_spindle_speed
        self._reverse, self._most = hub.config.machine_spindle_reverse, hub.config.machine_spindle_max
        self._spindle = [one for one in (self._switch, self._pwm, self._reverse) if one]
        self._order = asyncio.Lock()
        self._on: set[str] = set()      # names of values that are not off
        self._turns = ""                # the command that has begun it
        self._forgotten = 0             # how often all was switched off
        self._speed: float | None = None        # the last S
        self._wanted: dict[Output, float] = {}   # what was commanded last, since all was off
        self.used_at = 0.0              # when something was commanded last
        self._giving: set[asyncio.Task[None]] = set()

    @property
    def commanded(self) -> bool:
        """Something is on, or about to be."""
        return bool(self._on) or self._order.locked()

    async def fan(self, job: Job, *, on: bool) -> str:
        """M106: P and the number of a fan, S and 0 to 255. M107: off."""
        if not self._fans:
            return NO_FAN
        number, speed = self.fan_of(job.line)
        await self._give({self._fans[number]: speed / FULL if on else 0.0})
        return ""

    def fan_of(self, line: Line) -> tuple[int, float]:
        """Of M106: the fan's number, 0 if there are no fans; 0 to 255. :class:`NotDone`, :class:`BadWords`."""
        words = line.words()
        number, speed = words.get("P") or 0.0, FULL if words.get("S") is None else min(words["S"] or 0.0, FULL)
        if not self._fans:
            return 0, speed
        if number not in range(len(self._fans)):
            raise NotDone(f"there is no fan P{number:g}; fan in [machine] has {len(self._fans)}")
        if speed < 0:
            raise BadWords(f"S must be 0 to {FULL:g}")
        return int(number), speed

    async def turn(self, job: Job) -> None:
        """M3 and M4: S and revolutions per minute."""
        name, speed = job.line.name, self.speed_of(job.line, self._speed)
        if self._pwm and speed is None:
            raise BadWords("needs S with revolutions per minute")
        values = {one: 1.0 for one in (self._switch, self._reverse if name == REVERSE else None) if one}
        if self._pwm:
            values[self._pwm] = (speed or 0.0) / self._most
        await self._give(values, name)
        self._speed = speed

    def speed_of(self, line: Line, last: float | None) -> float | None:
        """Of M3 and M4, in revolutions per minute; `last`: without S. :class:`NotDone`."""
        speed = line.words().get("S", last)
        if not self._spindle:
            raise NotDone(NO_SPINDLE)
        if line.name == REVERSE and not self._reverse:
            raise NotDone("the spindle has one direction; see spindle-reverse in pokeys-gateway.conf(5)")
        if self._pwm and not 0 <= (speed or 0.0) <= self._most:
            raise NotDone(f"the spindle's speed must be 0 to {self._most:g} revolutions per minute")
        return speed

    async def stand(self) -> None:
        """M5."""
        await self._give(dict.fromkeys(self._spindle, 0.0), "")

    def switches(self) -> list[Output]:
        """What M42 may switch: digital outputs and those of the board, but those of fans and the spindle."""
        state = self._state()
        there = [Output("pin", number) for number in range(1, PINS + 1) if state[f"pin.{number - 1:02}.is-output"]]
        if state.info.pulse_engine_version > 0:
            there += [Output("external", number) for number in range(EXTERNALS)]
        return [one for one in there if one not in (*self._fans, *self._spindle)]

    async def switch(self, job: Job) -> None:
        """M42: P and a terminal, or R and an output of the board, S and 0 or more."""
        one, on = self.switch_of(job.line)
        await self._give({one: float(on)})
        if self._holder.held:
            await self._holder.wait()
            await self._until(one, on)

    def switch_of(self, line: Line) -> tuple[Output, bool]:
        """Of M42: the output, and whether it is to be on. :class:`NotDone`, :class:`BadWords`."""
        words = line.words()
        terminal, external, level = words.get("P"), words.get("R"), words.get("S")
        good = (terminal in range(1, PINS + 1) if external is None else
                terminal is None and external in range(EXTERNALS))
        if not good or level is None or level < 0:
            raise BadWords(f"needs P with a terminal, 1 to {PINS}, or R with an output of the board, 0 to "
                           f"{EXTERNALS - 1}, and S with 0 for off, or more for on")
        one = Output("pin", int(terminal)) if terminal is not None else Output("external", int(external or 0))
        for what, commands in ((self._fans, "M106 and M107"), (self._spindle, "M3, M4 and M5")):
            if one in what:
                raise NotDone(f"{one.title} is switched by {commands}")
        return one, level > 0

    async def _until(self, one: Output, on: bool) -> None:
        """The daemon refuses the outputs of heaters and motors, and the safe state holds all."""
        loop = asyncio.get_running_loop()
        end = loop.time() + SEEN_S
        # who came later may want something else
        while self._state()[f"{one.place}.out-fb"] != on and self._wanted.get(one) == on:
            self._holder.check()
            if loop.time() >= end:
                await self._give({one: 0.0})
                raise NotDone(f"{one.title} of {self._holder.device} was not switched; pokeysctl events may show the "
                              "reason")
            await asyncio.sleep(LOOK_S)

    def forget(self) -> dict[str, float | bool]:
        """They are to be switched off, by these values."""
        values = dict(_value(one, 0.0) for one in self._wanted)
        self._on.clear()
        self._wanted.clear()
        self._turns = ""
        self._forgotten += 1
        return values

    def off(self) -> bool:
        """The device has the spindle off."""
        state = self._state()
        return not any(state[f"{one.place}.out-fb"] if one.kind != "pwm" else state[f"{one.place}.enabled"] and
                       state[f"{one.place}.duty"] for one in self._spindle)

    # ---- one step

    def _state(self) -> pokeys.State:
        return self._holder.seen()

    async def _give(self, wanted: Mapping[Output, float], turns: str | None = None) -> None:
        """``turns``: the command that the spindle turns by from then on."""
        # a stop ends the wait for it, and not what is half done
        giving = asyncio.get_running_loop().create_task(self._command(wanted, turns))
        self._giving.add(giving)
        giving.add_done_callback(self._given)
        await asyncio.shield(giving)

    def _given(self, giving: asyncio.Task[None]) -> None:
        self._giving.discard(giving)
        if not giving.cancelled():
            giving.exception()      # whoever waits for it has it

    async def _command(self, wanted: Mapping[Output, float], turns: str | None) -> None:
        async with self._order:
            self._holder.check()
            if turns and self._turns not in ("", turns):
                raise NotDone(f"the spindle turns already, by {self._turns}; M5 stops it")
            values = dict(_value(one, part) for one, part in wanted.items())
            if not any(values.values()) and not self._holder.held:
                # all are off
                self._turns = self._turns if turns is None else turns
                return
            for one in wanted:
                self._judge(one)
            self._wanted.update(wanted)
            self.used_at = asyncio.get_running_loop().time()
            await self._holder.take()
            if any(values.values()):
                await self._permit()
            before, forgotten = self._on & values.keys(), self._forgotten
            self._on |= values.keys()
            try:
                await self._holder.update(values)
            except NotDone:
                self._on -= values.keys() - before
                raise
            # it is so now, also if a stop has come meanwhile, which leaves outputs on or has switched them off
            self._on -= {name for name, value in values.items() if not value}
            if turns is not None and forgotten == self._forgotten:
                self._turns = turns

    def _judge(self, one: Output) -> None:
        state, device = self._state(), self._holder.device
        if one.kind == "external" and not state.info.pulse_engine_version:
            raise NotDone(f"{device} has no outputs of this kind")
        if one.kind == "pin" and not state[f"{one.place}.is-output"]:
            raise NotDone(f"terminal {one.number} of {device} is no digital output; see digital-outputs in "
                          "pokeysd.conf(5)")
        if one.kind == "pwm" and not state["pwm.period-ticks"]:
            raise NotDone(f"{device} has no PWM; see pwm-period in pokeysd.conf(5)")

    async def _permit(self) -> None:
        """After a loss, the daemon holds outputs off until the machine is switched on."""
        if not self._state()["outputs-held"]:
            return
        async with self._holder.moving:
            await self._switch_on()

    async def _switch_on(self) -> None:
        # a move may have done it meanwhile
        if not self._state()["outputs-held"]:
            return
        await self._holder.update({"machine-is-on": False})
        await self._holder.wait()
        await self._holder.update({"machine-is-on": True})
        loop = asyncio.get_running_loop()
        end = loop.time() + PERMIT_S
        while self._state()["outputs-held"]:
            self._holder.check()
            if loop.time() >= end:
                raise NotDone("the daemon holds the outputs off; pokeysctl events may show the reason")
            await asyncio.sleep(LOOK_S)


def _value(one: Output, part: float) -> tuple[str, float | bool]:
    """Of the command image."""
    return (f"{one.place}.value", part) if one.kind == "pwm" else (f"{one.place}.out", part > 0)
