# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves of servo motors and axes along paths that the daemon computes, as G-code describes them.

A motor or an axis takes part if its name in pokeysd.conf is one of :data:`LETTERS`. The daemon queues up to
32 moves; a line that finds no room waits, and its client with it. The gateway only adds moves: if it is late, the
machine slows down on its path.

Positions: what a line says is logical, and G92 shifts it against the position of the machine. Where the next move
begins is where the last one ends, which may be in the future.
"""
from __future__ import annotations

import asyncio
import contextlib
import functools
from collections.abc import AsyncGenerator, Iterable, Mapping
from dataclasses import replace

import pokeys
from pokeys import MovesControl, OneShot, Outcome
from pokeys.one_shot import HOME_FINISH_ITSELF, MOVE_BEGINS, SERVO_END_HOMING

from ..hub import Hub
from ..wire import NotDone
from .holder import Holder, each
from .lane import Job, Modes
from .member import EXTRUDER, LETTERS, LINEAR, TRIPPED, Member, axes_in, modes_of, nudge_of, numbers, path_speed
from .member import members as members_of
from .parser import BadWords
from .patience import Patience

QUEUE = 32                  # moves, with the one under way
FRACTIONS = 256             # parts of a count
PULSES_MOST, COUNTS_MOST = 2_100_000_000, 2**31 - 2
FEED_MOST = 200.0           # percent
LOOK_S = 0.005
ENABLE_S = 3.0
NO_FEED = "no feed rate yet; add F with units/min"
REST_S = 1.0                # what was enabled just now is at rest then
CANCEL_S = END_S = 5.0
HOME_S = 125.0              # the device's own limit is 120 s
DWELL_MOST_S = 3600.0
ENDED_WELL = 1              # moves.end
COMMANDED = 6               # moves.refusal


class Motion:
    """The motors and axes of the device that G-code commands. Belongs to the event loop's thread."""

    def __init__(self, hub: Hub, holder: Holder) -> None:
        self._hub = hub
        self._holder = holder
        self._order = holder.moving
        self._on: set[str] = set()          # letters of those that we have enabled, or are enabling
        self._changing: set[str] = set()    # ... that are being enabled or homed
        self._homing: Member | None = None  # until that has ended, or a stop has ended it
        self._ends: dict[str, float] = {}   # where the queued moves end, units
        self._begins = True                 # the next move need not follow another one
        self._moved = False                 # a path is under way, as far as we know
        self.percent = 100.0        # feed override
        self._fed = False                   # the daemon has the override
        self.used_at = 0.0         # when something was commanded last
        self.shifts: dict[str, float] = {}  # position of the machine - logical position

    @property
    def commanded(self) -> bool:
        """Something is enabled, or about to be."""
        return bool(self._on) or self._order.locked()

    def unused_since(self, then: float) -> bool:
        """What is enabled stands, and nothing was commanded since then."""
        return bool(self._on) and not self._order.locked() and self.used_at < then and not self._moved

    def use(self) -> None:
        """Somebody is at work: they stay enabled."""
        self.used_at = asyncio.get_running_loop().time()

    # ---- commands

    async def move(self, job: Job, *, rapid: bool) -> None:
        """G0 and G1."""
        await self._go(numbers(job), job.modes, rapid=rapid)

    async def jog(self, job: Job) -> None:
        """$J=: its modes are those of this line."""
        modes, rest = modes_of(job.line.arguments)
        line = replace(job.line, argument=rest)
        await self._go(numbers(replace(job, line=line)), modes, rapid=False)

    async def _go(self, words: dict[str, float], modes: Modes, *, rapid: bool) -> None:
        if "F" in words:
            modes.set_feed(words["F"])
        given = {letter: words[letter] * (modes.scale if letter in LINEAR + EXTRUDER else 1.0)
                 for letter in LETTERS if letter in words}
        if not given:
            return
        if modes.feed is None and not rapid:
            raise NotDone(NO_FEED)
        await self.go(given, modes)

    async def go(self, given: Mapping[str, float], modes: Modes) -> None:
        """A move to these positions or by these ways, in mm; it waits for room in the queue."""
        if modes.doubt:
            raise NotDone("lines of G91 were not carried out: send G90 or G91 before the next move")
        await self._holder.take()
        # others must not wait for room in the queue because this one does
        while True:
            await self._room()
            async with self._order:
                if int(self._state()["moves.waiting"]) < QUEUE:
                    await self._move(given, modes)
                    return

    def logical(self, letters: Iterable[str]) -> dict[str, float]:
        """Where the next move begins, as G-code says it, in mm."""
        state = self._state()
        members = members_of(state)
        return {letter: self._begin_of(state, self._member(members, letter)) - self.shifts.get(letter, 0.0)
                for letter in letters}

    async def nudge(self, letter: str, speed: float, until: float) -> int | None:
        """A short move of a jog, at so many units/s. The daemon's count of moves then; None: nothing was queued.

        Not after ``until``, as it may not be held any more, and not while somebody else gives moves.
        """
        if self.percent == 0:
            raise NotDone("the feed override is 0 %")
        if self._order.locked():
            return None
        async with self._order:
            await self._enable([self._member(members_of(self._state()), letter)])
            if asyncio.get_running_loop().time() > until:
                return None
            state = self._state()
            member = self._member(members_of(state), letter)
            await self._move(*nudge_of(member, self._begin_of(state, member), speed, self.percent / 100))
            return int(self._state()["moves.taken"])

    def waiting(self) -> int:
        """Moves in the daemon's queue."""
        return int(self._state()["moves.waiting"])

    def is_idle(self, moves: int | None) -> bool:
        """Nothing moves but what was queued up to this count of moves."""
        state = self._state()
        return not self._homing and (not state["moves.waiting"] or int(state["moves.taken"]) == moves)

    async def end_path(self, moves: int) -> None:
        """Slow down on the path, and drop the rest, unless others' moves follow those up to this count."""
        # a move that comes meanwhile waits: the daemon takes none while a path ends
        async with self._order:
            if not self._holder.held or not self.waiting() or not self.is_idle(moves):
                return
            # it does not end early
            self.halt()
            await self._holder.order(OneShot.MOVES_CONTROL, index=MovesControl.ABORT)
            loop = asyncio.get_running_loop()
            end = loop.time() + END_S
            while self.waiting():
                if loop.time() >= end:
                    raise NotDone("the path does not end")
                await asyncio.sleep(LOOK_S)
            self.halt()

    async def dwell(self, job: Job) -> None:
        """G4: P and milliseconds, or S and seconds."""
        words = numbers(job)
        seconds = words.get("S", words.get("P", 0.0) / 1000)
        if not 0 <= seconds <= DWELL_MOST_S:
            raise BadWords(f"the dwell must be 0 to {DWELL_MOST_S:g} seconds")
        await self.finish()
        await asyncio.sleep(seconds)

    async def finish(self) -> None:
        """M400: until all moves that there are have ended; if no others have come, until everything stands."""
        if not self._holder.held:
            return
        progress = Patience(self._holder.check, lambda: self.percent)
        moves = int(self._state()["moves.taken"])
        while True:
            state = self._state()
            waiting = int(state["moves.waiting"])
            if int(state["moves.taken"]) - waiting >= moves and (waiting or self._stands(state)):
                return
            progress(state)
            await asyncio.sleep(LOOK_S)

    async def set_place(self, job: Job) -> None:
        """G92: what the logical position is now."""
        async with self._order:
            self._set_place(numbers(job), job.modes)

    def _set_place(self, words: Mapping[str, float], modes: Modes) -> None:
        state = self._state()
        members = members_of(state)
        given = [letter for letter in LETTERS if letter in words] or [letter for letter in LETTERS if letter in members]
        for letter in given:
            member = self._member(members, letter)
            factor = modes.scale if letter in LINEAR + EXTRUDER else 1.0
            self.shifts[letter] = self._begin_of(state, member) - words.get(letter, 0.0) * factor

    async def home(self, job: Job) -> None:
        """G28: one after the other, in the order in which they are named; O: those that are not homed yet."""
        words = job.line.words()
        await self._holder.take()
        async with self._standing():
            members = members_of(self._state())
            named = axes_in(words, members) or [letter for letter in members if letter != EXTRUDER]
            for letter in named:
                self._member(members, letter)
            for letter in named:
                member = self._member(members_of(self._state()), letter)
                if not (member.homed and "O" in words):
                    await self._home(member)

    async def enable(self, job: Job) -> None:
        """M17: those that are named, or all."""
        await self._holder.take()
        async with self._order:
            members = members_of(self._state())
            named = axes_in(job.line.words(), members)
            await self._enable([self._member(members, letter) for letter in named or members])

    async def disable(self, words: Mapping[str, object]) -> str:
        """M18, M84: those that are named, or all, when they stand."""
        if words.keys() == {"S"}:
            return "echo:S is not kept: what is not used is switched off by itself"
        if not self._holder.held:
            return ""
        async with self._standing():
            members = members_of(self._state())
            named = {*axes_in(words, members)}
            if not named or named >= self._on:
                self.forget()
                await self._holder.stop({}, motion=True)
            else:
                self._on -= named
                self.halt()     # somebody may move them by hand
                await self._command([members[letter] for letter in members if letter in named], enable=False)
        return ""

    @contextlib.asynccontextmanager
    async def _standing(self) -> AsyncGenerator[None, None]:
        """While nobody moves anything. Others go on while it is waited for."""
        while True:
            await self.finish()
            async with self._order:
                if self.still():
                    yield
                    return

    async def override(self, job: Job) -> str:
        """M220: S and percent; without it, what it is."""
        percent = numbers(job).get("S")
        if percent is None:
            return f"FR:{self.percent:g}%"
        if not 0 <= percent <= FEED_MOST:
            raise BadWords(f"the feed override must be 0 to {FEED_MOST:g} percent")
        self.percent, self._fed = percent, False
        if self._on:
            await self._feed()
        return ""

    # ---- stops

    def forget(self) -> None:
        """They are off, and no path is under way."""
        self._on.clear()
        self._changing.clear()
        self._homing = None
        self.halt()
        self._fed = False

    def halt(self) -> None:
        """No path is under way any more; they stay enabled."""
        self._ends.clear()
        self._begins, self._moved = True, False

    async def stop(self) -> None:
        """M410: as soon as they can; they stay enabled, but those that were being enabled or homed."""
        self.halt()
        homing, self._homing = self._homing, None
        try:
            await each(
                self._end_path,
                # whatever was given before is taken then
                functools.partial(self._holder.order, OneShot.NOP, always=True),
                self._end_path,         # of that
                functools.partial(self._end_homing, homing),
                self._keep_enabled)
        finally:
            self._changing.clear()

    async def _end_path(self) -> None:
        if self._state()["moves.waiting"]:
            await self._holder.order(OneShot.MOVES_CONTROL, index=MovesControl.STOP, always=True)

    async def _end_homing(self, homing: Member | None) -> None:
        if homing and not homing.motor:
            await self._holder.order(OneShot.HOME_CANCEL, always=True, seconds=CANCEL_S)
        state = self._state()
        for index in range(len(state.servo)):
            if state[f"servo.{index:02}.home-state"]:
                await self._holder.order(OneShot.SERVO_HOME, index=index, flags=SERVO_END_HOMING, always=True)

    async def _keep_enabled(self) -> None:
        """Those that are off stay off."""
        members = members_of(self._state())
        off = {letter for letter in self._on if not (letter in members and members[letter].enabled)}
        self._on -= off
        await self._command([members[letter] for letter in off if letter in members], enable=False)

    def off(self) -> bool:
        """Nothing is enabled or moves."""
        state = self._state()
        return not any(member.enabled for member in members_of(state).values()) and not state["moves.waiting"]

    def still(self) -> bool:
        """Nothing moves."""
        return self._stands(self._state())

    def _stands(self, state: pokeys.State) -> bool:
        # old values may be from before a move
        enabled = [member for member in members_of(state).values() if member.enabled]
        return state.connected and not (state["moves.waiting"] or self._homing) and all(one.still for one in enabled)

    async def reset(self) -> list[str]:
        """Clear the faults; what could not be cleared, and why."""
        state, left = self._state(), []
        for index in range(len(state.servo)):
            if state[f"servo.{index:02}.fault-code"] and \
                    await self._holder.order(OneShot.SERVO_RESET, index=index) != Outcome.DONE:
                at = f"servo.{index:02}."
                left.append(f"motor {state[at + 'name']}: the cause of its fault is still present: "
                            f"{state.word(at + 'condition')}")
        if state["engine-state"] in TRIPPED and await self._holder.order(OneShot.CLEAR_FAULT) != Outcome.DONE:
            left.append(f"the pulse engine is {state.word('engine-state')}")
        return left

    @property
    def faulty(self) -> bool:
        """Something is off by a fault."""
        reading = self._hub.source.read(self._holder.device)
        state = reading.state if reading else None
        return state is not None and (state["engine-state"] in TRIPPED or
                                      any(state[f"servo.{i:02}.fault-code"] for i in range(len(state.servo))))

    def letters(self) -> list[str]:
        """Of what can be moved."""
        reading = self._hub.source.read(self._holder.device)
        return list(members_of(reading.state)) if reading and reading.state is not None else []

    # ---- what the daemon does

    def trouble(self) -> str:
        """Why something that is enabled is off now, or a path has ended; "": nothing is wrong."""
        reading = self._hub.source.read(self._holder.device)
        state = reading.state if reading else None
        if state is None or not self._on:
            return ""
        if why := self._off(state):
            return why
        if self._moved and not state["moves.waiting"]:
            self._moved = False
            if state["moves.end"] != ENDED_WELL:
                return f"the path has ended early: {state.word('moves.end')}"
        return ""

    def _off(self, state: pokeys.State) -> str:
        """Which axis is off that has to be enabled, and why; "": none."""
        members = members_of(state)
        enabled = {letter for letter, member in members.items() if member.enabled}
        off = [letter for letter in LETTERS if letter in self._on - self._changing - enabled]
        if off:
            # an axis on its limit switch has stopped all the others
            letter = next((one for one in off if one in members and members[one].on_limit), off[0])
            why = members[letter].trouble if letter in members else ""
            return f"{letter} was switched off: {why or 'pokeysctl events may show the reason'}"
        return ""

    async def follow(self) -> None:
        """Command the positions that the daemon holds, so that it goes on holding them when a path has ended."""
        reading = self._hub.source.read(self._holder.device)
        if not reading or reading.state is None or not reading.connected:
            return
        members = members_of(reading.state)
        # one that still moves is on the daemon's path, and is behind it
        await self._command([members[letter] for letter in self._on - self._changing
                             if letter in members and members[letter].still], enable=True)

    # ---- one step

    def _state(self) -> pokeys.State:
        return self._holder.seen()

    def _member(self, members: Mapping[str, Member], letter: str) -> Member:
        if letter not in members:
            raise NotDone(f"{self._holder.device} has no axis {letter}; there are: {' '.join(members) or 'none'}")
        return members[letter]

    def _begin_of(self, state: pokeys.State, member: Member) -> float:
        """Where its next move begins."""
        end = self._ends.get(member.letter)
        # what the device was commanded last may be from before the end; what ends a path early forgets the ends
        return member.place if end is None or not (member.enabled or state["moves.waiting"]) else end

    async def _command(self, members: Iterable[Member], *, enable: bool, **values: bool) -> None:
        members = list(members)
        await self._holder.update(
            {name.replace("_", "-"): value for name, value in values.items()},
            axes={one.index: pokeys.Axis(one.counts, one.mode, enable) for one in members if not one.motor},
            servos={one.index: pokeys.Servo(one.place, enable) for one in members if one.motor})

    async def _until(self, what: str, holds: Iterable[str] = (), *, machine_on: bool | None = None,
                     still: bool = False) -> None:
        """Until these are enabled, or the machine is on or off, or the pulse engine stands."""
        loop = asyncio.get_running_loop()
        end = loop.time() + ENABLE_S
        while True:
            self._holder.check()
            state = self._state()
            members = members_of(state)
            if all(members[letter].enabled for letter in holds) and \
                    (machine_on is None or bool(state["machine-on-permitted"]) == machine_on) and \
                    (not still or state["engine-state"] in (0, *TRIPPED)):
                return
            if loop.time() >= end:
                why = next((members[letter].trouble for letter in holds if members[letter].trouble), "")
                raise NotDone(f"{what}: {why or 'pokeysctl events may show the reason'}")
            await asyncio.sleep(LOOK_S)

    async def _enable(self, wanted: Iterable[Member]) -> None:
        """Switch on those that are off, where they are."""
        letters = [member.letter for member in wanted if not (member.enabled and member.letter in self._on)]
        if not letters:
            return
        members = members_of(self._state())
        for letter in letters:
            if members[letter].trouble:
                hint = "; pokeysctl axis can move it off" if members[letter].on_limit else ""
                raise NotDone(f"{letter} cannot move: {members[letter].trouble}{hint}")
        self._changing |= set(letters)
        self._on |= set(letters)
        try:
            await self._switch_on(letters)
        except Exception:
            self._holder.check()    # a stop switches off what is half on
            self._on -= set(letters)
            self._changing -= set(letters)
            with contextlib.suppress(NotDone):
                await self._command([members[letter] for letter in letters], enable=False)
            raise
        self._changing -= set(letters)
        self.use()

    async def _switch_on(self, letters: list[str]) -> None:
        """The daemon's steps: off, where they are; the machine on; on."""
        state = self._state()
        members = members_of(state)
        axes = [letter for letter in letters if not members[letter].motor]
        if axes and not state["machine-on-permitted"]:
            await self._command((), enable=False, machine_is_on=False)
            await self._holder.wait()
            await self._until("the pulse engine does not stop", machine_on=False, still=True)
        members = members_of(self._state())
        await self._command([members[letter] for letter in letters], enable=False)
        await self._holder.wait()
        if axes and not state["machine-on-permitted"]:
            await self._command((), enable=False, machine_is_on=True)
            await self._until("the daemon does not permit motion", machine_on=True)
        members = members_of(self._state())
        await self._command([members[letter] for letter in letters], enable=True)
        await self._until(f"the daemon does not enable {', '.join(letters)}", letters)

    async def _move(self, given: Mapping[str, float], modes: Modes) -> None:
        members = members_of(self._state())
        await self._enable([self._member(members, letter) for letter in given])
        if not self._fed:
            await self._feed()
        if why := self._off(self._state()):
            raise NotDone(why)
        state = self._state()
        members = members_of(state)
        ends: dict[str, float] = {}
        lengths: dict[str, float] = {}
        moved = False
        for letter, number in given.items():
            member = self._member(members, letter)
            begin = self._begin_of(state, member)
            relative = modes.relative_extruder if letter == EXTRUDER else modes.relative
            ends[letter] = begin + number if relative else number + self.shifts.get(letter, 0.0)
            if not abs(ends[letter] * member.scale) <= (COUNTS_MOST if member.motor else PULSES_MOST):
                raise NotDone(f"{letter}{number:g} is further than the device can count")
            parts = round(ends[letter] * member.scale * FRACTIONS) - round(begin * member.scale * FRACTIONS)
            moved = moved or parts != 0
            # what is less than a count has no direction
            lengths[letter] = parts / FRACTIONS / member.scale if abs(parts) >= FRACTIONS else 0.0
        if not moved:
            return
        await self._queue([members[letter] for letter in members if letter in ends], ends, path_speed(lengths, modes))
        self._holder.check()
        self._ends |= ends
        self._begins, self._moved = False, True
        self.use()

    async def _queue(self, members: list[Member], ends: Mapping[str, float], speed: float) -> None:
        """Motors first, each in the order of the daemon's numbers."""
        members = sorted(members, key=lambda member: (not member.motor, member.index))
        parts = [round(ends[member.letter] * member.scale * FRACTIONS) for member in members]
        loop = asyncio.get_running_loop()
        end = loop.time() + REST_S
        while await self._holder.order(
                OneShot.MOVE, mask=sum(1 << member.index for member in members if member.motor),
                index=sum(1 << member.index for member in members if not member.motor),
                flags=MOVE_BEGINS if self._begins else 0, values=[part // FRACTIONS for part in parts],
                fractions=[part % FRACTIONS for part in parts], parameters=[speed]) != Outcome.DONE:
            state = self._state()
            if state["moves.refusal"] != COMMANDED or not self._begins or loop.time() >= end:
                self._begins = True
                raise NotDone(f"the daemon refused this move: {state.word('moves.refusal')}")
            # where it is commanded to be has changed just now
            now = members_of(state)
            await self._command([now[member.letter] for member in members], enable=True)
            await asyncio.sleep(LOOK_S)

    async def _room(self) -> None:
        """Until the daemon's queue has a place."""
        progress = Patience(self._holder.check, lambda: self.percent)
        while int((state := self._state())["moves.waiting"]) >= QUEUE:
            progress(state)
            await asyncio.sleep(LOOK_S)

    async def _feed(self) -> None:
        outcome = await self._holder.order(OneShot.MOVES_CONTROL, index=MovesControl.FEED,
                                           parameters=[self.percent / 100])
        if outcome != Outcome.DONE:
            raise NotDone("the daemon refused the feed override")
        self._fed = True

    async def _home(self, member: Member) -> None:
        await self._enable([member])
        self.shifts.pop(member.letter, None)
        self._ends.pop(member.letter, None)
        # the daemon drives no axis while the pulse engine finds a switch
        axes = {} if member.motor else members_of(self._state())
        # ... and then goes to where they are commanded to be, which may be from before their last move
        await self._command([one for letter, one in axes.items() if letter in self._on], enable=True)
        self._homing = member
        self._changing |= {member.letter, *(letter for letter in self._on if letter in axes and not axes[letter].motor)}
        try:
            await self._seek(member)
            self._homing = None
            await self._settle(member.letter)
            await self._until("the daemon does not drive all axes again", self._on)
        except Exception:
            self._homing = None
            with contextlib.suppress(NotDone):
                await self._keep_enabled()
            raise
        finally:
            # a stop has its own way
            if not self._homing:
                self._changing.clear()
        self.use()

    async def _seek(self, member: Member) -> None:
        """Find its home switch."""
        if not member.motor:
            outcome = await self._holder.order(OneShot.HOME, mask=1 << member.index, flags=HOME_FINISH_ITSELF,
                                               seconds=HOME_S)
            if outcome == Outcome.REFUSED:
                raise NotDone(f"{member.letter} cannot be homed: it has no home switch (axis.{member.index}.home), "
                              "or the pulse engine is busy")
            if outcome != Outcome.DONE:
                raise NotDone(f"{member.letter} was not homed: {self._state().word('engine-state')}; "
                              "pokeysctl events may show the reason")
            return
        if await self._holder.order(OneShot.SERVO_HOME, index=member.index) != Outcome.DONE:
            raise NotDone(f"{member.letter} was not homed: pokeysd.conf has no home-search-speed for it, or it moves")
        end = f"servo.{member.index:02}.home-end"
        while not (state := self._state())[end]:
            self._holder.check()
            if not members_of(state)[member.letter].enabled:
                break
            await asyncio.sleep(LOOK_S)
        if state.word(end) != "done":
            raise NotDone(f"{member.letter} was not homed: {state.word(end)}")

    async def _settle(self, letter: str) -> None:
        """Command the position at which the daemon holds it after homing, until it follows that."""
        loop = asyncio.get_running_loop()
        end = loop.time() + ENABLE_S
        while not ((member := members_of(state := self._state())[letter]).enabled and member.still and state.connected):
            self._holder.check()
            if loop.time() >= end:
                raise NotDone(f"{letter} does not come to rest")
            await self._command([member], enable=True)
            await asyncio.sleep(LOOK_S)
