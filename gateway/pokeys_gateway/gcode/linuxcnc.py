# SPDX-License-Identifier: GPL-2.0-or-later
"""G-code of the console for LinuxCNC, through pokeys-remote(1) of its session.

A line is LinuxCNC's own G-code, and goes to it as MDI: what G28 or M6 do is said by its configuration. A few commands
of hosts have no such line: they pause and continue LinuxCNC's programme, set the override, or have a heater's target go
to an analog output of LinuxCNC (M68), which its HAL files lead to the heater.

A line of MDI is given when the one before it has ended, and has its ``ok`` when LinuxCNC has taken it. So LinuxCNC
has one line at a time, and a stop has nothing to catch up with.
"""
from __future__ import annotations

import asyncio
import functools
import itertools
import math
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Any
from weakref import WeakKeyDictionary

from ..console.client import Client
from ..hub import Hub
from ..operate import Operator
from ..wire import NotDone
from . import report
from .commands import switches_off
from .heating import BED, CHAMBER, HOT_END, KINDS
from .lane import Job
from .parser import BadWords, Line

LOOK_S, SETTLE_S = 0.05, 0.2
STATE_S = 3.0               # until pokeys-remote has said LinuxCNC's state
DONE_S = 30.0               # a command of somebody else's may be before it
SAID_S = 0.3                # LinuxCNC's message about a line comes soon after it was refused
REACH_S, REACHED_S, REPORT_S = 3600.0, 2.0, 1.0
NEAR_K = 0.01
NO_MDI = "the mode is not MDI"      # of pokeys-remote
WHY = "; its message says why"      # of pokeys-remote, about a line that LinuxCNC has refused
TARGETS = {"M104": HOT_END, "M109": HOT_END, "M140": BED, "M190": BED, "M141": CHAMBER, "M191": CHAMBER}
WAITS = ("M109", "M190", "M191")
FANS = ("M106", "M107")
FILES = ("M20", "M21", "M22", "M23", "M26", "M28", "M29", "M30", "M32")
OF_A_DEVICE = ("$J", "M17", "M18", "M84", "M301", "M303", "M304", "M999")
# about devices and the console
OURS = ("?", "M27", "M105", "M108", "M110", "M112", "M114", "M115", "M119", "M155", "M410", "M503", "M524")
RUN, PAUSE, END = "M24", "M25", "M30"       # of a host, M30 deletes a file; without a name, it is a program's end
SAID_MOST = 8               # messages of LinuxCNC about a line


Do = Callable[..., Awaitable[None]]     # a command of LinuxCNC and its parameters, as _Asker.do() in a turn


class _Asker:
    """One client's way to LinuxCNC."""

    def __init__(self, hub: Hub) -> None:
        self._shared = hub.operators
        self._operator = Operator(hub.operators, lambda _fetch: None, lambda _said: None, self._told)
        self._operator.on_lost = self._lost
        self._numbers = itertools.count(1)
        self._waiting: dict[int, asyncio.Future[None]] = {}

    async def do(self, turn: int, method: str, **params: Any) -> None:
        """Until LinuxCNC has done it, or has taken what takes longer; not after a stop that came since this turn.
        :class:`NotDone`."""
        number = next(self._numbers)
        done = self._waiting[number] = asyncio.get_running_loop().create_future()

        def judge(_takes_back: bool) -> None:
            if turn != self._shared.turn:
                raise NotDone("it was stopped")
        try:
            await self._operator.ask(method, params, number, judge)
            async with asyncio.timeout(DONE_S):
                await done
        except TimeoutError:
            # it must not happen later
            why = "LinuxCNC does not say that it has taken it"
            self._operator.abandon(why)
            raise NotDone(why) from None
        finally:
            del self._waiting[number]

    def close(self) -> None:
        """The client is gone."""
        self._operator.close()

    async def _told(self, said: dict[str, Any]) -> None:
        done = self._waiting.get(said["params"]["id"])
        if done and not done.done():
            error = said["params"]["error"]
            if error:
                done.set_exception(NotDone(error))
            else:
                done.set_result(None)

    def _lost(self, why: str) -> None:
        for done in self._waiting.values():
            if not done.done():
                done.set_exception(NotDone(why))
                done.exception()


class LinuxCnc:
    """Belongs to the event loop's thread."""

    def __init__(self, hub: Hub, say: Callable[[str], None]) -> None:
        """``say`` sends a line to all clients."""
        self._hub, self._say = hub, say
        self._askers: WeakKeyDictionary[Client, _Asker] = WeakKeyDictionary()
        self._state: dict[str, Any] = {}
        self._said: deque[str] = deque(maxlen=SAID_MOST)        # LinuxCNC's last errors
        self._order = asyncio.Lock()    # of lines, so that LinuxCNC has one at a time
        self._watch: Operator | None = None
        self._pauses = asyncio.Lock()   # of pauses, and of what goes on
        self._pausing = 0               # pauses that are under way
        self._given_up = 0              # how often all waits for temperatures were ended
        config = hub.config
        self._outputs = {HOT_END: config.hotend, BED: config.bed, CHAMBER: config.chamber}
        self._fan = config.fan

    def takes(self, line: Line) -> bool:
        """A line that is for LinuxCNC, and not only about the devices."""
        return bool(line.text) and line.name not in OURS and not (line.text.startswith("$") and line.name != "$J")

    async def carry_out(self, job: Job) -> str:
        """Lines before the ok. :class:`NotDone`, :class:`BadWords`."""
        turn = self._hub.operators.turn
        if switches_off(job.line):
            # it is carried out although its client is gone
            asker = _Asker(self._hub)
            try:
                return await self._carry_out(functools.partial(asker.do, turn), job)
            finally:
                asker.close()
        return await self._carry_out(functools.partial(self._of(job).do, turn), job)

    def begin(self, name: str) -> int:
        """M25 or M24 has come, and is carried out soon, in the turn that is returned."""
        self._pausing += name == PAUSE
        return self._hub.operators.turn

    async def pause(self, job: Job, turn: int) -> None:
        """... now: pause, or let what is paused go on."""
        await self._connected()
        async with self._pauses:
            await self._of(job).do(turn, "pause" if job.line.name == PAUSE else "resume")
            await asyncio.sleep(SETTLE_S)

    def end(self, name: str) -> None:
        """It has been carried out, or not."""
        self._pausing -= name == PAUSE

    @property
    def paused(self) -> bool:
        """LinuxCNC waits, with a programme or a line, or will do so at once."""
        return bool(self._state.get("paused") or self._pausing)

    def _of(self, job: Job) -> _Asker:
        """The way of its client."""
        assert job.asker
        if job.asker not in self._askers:
            self._askers[job.asker] = asker = _Asker(self._hub)
            # it has no file that is being written
            job.asker.on_end = asker.close
        return self._askers[job.asker]

    async def _carry_out(self, do: Do, job: Job) -> str:
        await self._connected()
        name = job.line.name
        if name in TARGETS:
            await self._target(do, job)
        elif name in FANS:
            await self._blow(do, job.line)
        elif name == "M220":
            return await self._override(do, job.line)
        elif name in (RUN, PAUSE):
            await self._run(do, go_on=name == RUN)
        elif name == "M118":
            self._say(report.message(job.line.argument))
        elif name == "M400":
            await self._idle(still=True)
        elif name in FILES and (name != END or job.line.arguments):
            raise NotDone("LinuxCNC has its own files; load one on its screen, and M24 runs it")
        elif name in OF_A_DEVICE:
            raise NotDone("LinuxCNC moves the machine; this is for a device that G-code commands itself")
        else:
            await self._mdi(do, f"(MSG, {_plain(job.line.argument)})" if name == "M117" else job.line.text)
        return ""

    def give_up(self) -> None:
        """M108: nobody waits for a temperature any more."""
        self._given_up += 1

    def positions(self) -> str:
        """As M114 shows them: of LinuxCNC, in machine units."""
        if not self._state.get("connected"):
            return f"echo:{self._state.get('why') or 'LinuxCNC has not been asked yet'}"
        return " ".join(f"{letter.upper()}:{place:.4f}" for letter, place in self._state["position"].items()
                        if place is not None)

    def progress(self) -> str:
        """As M27 shows it."""
        if not self._state.get("connected") or self._state["interpreter"] == "idle":
            return "Not SD printing"
        paused = ", paused" if self._state["paused"] else ""
        return f"Not SD printing\necho:{self._state['file'] or 'MDI'}, line {self._state['line']}{paused}"

    def watch(self) -> None:
        """Follow LinuxCNC's state from now on."""
        if not self._watch:
            self._watch = Operator(self._hub.operators, self._offered, self._heard, self._nothing)
            task = asyncio.get_running_loop().create_task(self._watch.ask("subscribe", {}, 0, lambda _: None))
            task.add_done_callback(self._watched)

    def close(self) -> None:
        """The gateway ends."""
        for asker in list(self._askers.values()):
            asker.close()
        if self._watch:
            self._watch.close()

    # ---- LinuxCNC's state

    def _watched(self, task: asyncio.Task[None]) -> None:
        if not task.cancelled() and task.exception():
            self._state = {"connected": False, "why": str(task.exception())}
            if self._watch:
                self._watch.close()
            self._watch = None      # the next line tries again

    def _offered(self, fetch: Callable[[], dict[str, Any]]) -> None:
        # there is something to fetch when this has returned
        asyncio.get_running_loop().call_soon(self._fetch, fetch)

    def _fetch(self, fetch: Callable[[], dict[str, Any]]) -> None:
        changed = fetch()["params"]
        self._state = changed if "connected" in changed else {**self._state, **changed}

    def _heard(self, said: dict[str, Any]) -> None:
        kind, text = said["params"]["kind"], str(said["params"]["text"]).replace("\n", " ")
        if kind == "error":
            self._said.append(text)
        self._say(f"echo:LinuxCNC: {text}")

    async def _nothing(self, _said: dict[str, Any]) -> None:
        pass

    async def _connected(self) -> None:
        self.watch()
        loop = asyncio.get_running_loop()
        end = loop.time() + STATE_S
        while "connected" not in self._state and loop.time() < end:
            await asyncio.sleep(LOOK_S)
        if not self._state.get("connected"):
            why = self._state.get("why") or f"{self._hub.config.proxy} does not say LinuxCNC's state"
            if not self._watch:
                self._state = {}
            raise NotDone(why)

    async def _idle(self, *, still: bool = False) -> None:
        """Until the interpreter has nothing to do, and nothing moves if that matters."""
        while self._state.get("interpreter") != "idle" or (still and self._state.get("moving")):
            if not self._state.get("connected"):
                raise NotDone(self._state.get("why") or "LinuxCNC's state is not known")
            if self._state.get("mode") == "auto":
                raise NotDone("LinuxCNC runs a programme")
            await asyncio.sleep(LOOK_S)

    # ---- commands

    async def _mdi(self, do: Do, text: str) -> None:
        async with self._order:
            await self._idle()
            if self._state["mode"] != "mdi":
                await do("mode", mode="mdi")
            try:
                await self._give(do, text)
            except NotDone as error:
                # the state that is known is a moment old
                if str(error) != NO_MDI:
                    raise
                await do("mode", mode="mdi")
                await self._give(do, text)

    async def _give(self, do: Do, text: str) -> None:
        self._said.clear()
        try:
            await do("mdi", line=text)
        except NotDone as error:
            if not str(error).endswith(WHY):
                raise
            await asyncio.sleep(SAID_S)
            raise NotDone(f"{str(error).removesuffix(WHY)}: {' '.join(self._said) or 'its screen says why'}") from None
        # the state that is known is as old as LinuxCNC's period of it, and the way here
        await asyncio.sleep(SETTLE_S)

    async def _run(self, do: Do, *, go_on: bool) -> None:
        async with self._pauses:
            if not go_on:
                await do("pause")
            elif self._state["paused"]:
                await do("resume")
            else:
                if self._state["mode"] != "auto":
                    await do("mode", mode="auto")
                await do("run")
            await asyncio.sleep(SETTLE_S)

    async def _override(self, do: Do, line: Line) -> str:
        percent = line.words().get("S")
        if percent is None:
            return f"FR:{(self._state['feed_override'] or 0.0) * 100:g}%"
        await do("override", what="feed", value=percent / 100)
        return ""

    async def _blow(self, do: Do, line: Line) -> None:
        if self._fan is None:
            raise NotDone("no output of LinuxCNC is set for it; see fan in [linuxcnc] in pokeys-gateway.conf(5)")
        speed = line.words().get("S", 255.0) if line.name == "M106" else 0.0
        if speed is None or not 0 <= speed <= 255:
            raise BadWords("S must be 0 to 255")
        await self._mdi(do, f"M68 E{self._fan} Q{speed / 255:.4f}")

    async def _target(self, do: Do, job: Job) -> None:
        name, words = job.line.name, job.line.words()
        kind = TARGETS[name]
        cools = words.get("S") is None and name in WAITS and words.get("R") is not None
        celsius = words.get("R") if cools else words.get("S")
        if celsius is None or not math.isfinite(celsius) or celsius < 0:
            raise BadWords(f"needs S{' or R' * (name in WAITS)} with a temperature in degrees C")
        if words.get("T"):
            raise NotDone("LinuxCNC has one hot end here")
        output = self._outputs[kind]
        if output is None:
            key = {HOT_END: "hotend", BED: "bed", CHAMBER: "chamber"}[kind]
            raise NotDone(f"no output of LinuxCNC is set for the {KINDS[kind]}; see {key} in [linuxcnc] in "
                          "pokeys-gateway.conf(5)")
        given_up = self._given_up
        await self._mdi(do, f"M68 E{output} Q{celsius:g}")
        if name in WAITS and celsius:
            await self._reach(lambda: job.gone or given_up != self._given_up, job.tell,
                              "T0" if kind == HOT_END else kind, celsius, cools=cools)

    async def _reach(self, given_up: Callable[[], bool], tell: Callable[[str], None], letter: str, celsius: float, *,
                     cools: bool) -> None:
        """Until the heater that the daemon controls has reached it."""
        loop = asyncio.get_running_loop()
        since: float | None = None
        reported, end = loop.time(), loop.time() + REACH_S
        while not given_up():
            heater = next((one for one in report.heaters(self._hub) if one.letter == letter), None)
            now = loop.time()
            if not heater:
                raise NotDone("no device has this heater, so nobody can wait for it")
            if heater.fault or now > end:
                raise NotDone(f"heater {heater.title}: {heater.trouble or 'it does not get there within an hour'}")
            follows = abs(heater.target - celsius) <= NEAR_K
            if follows and not cools and heater.celsius > celsius:
                return
            since = (since or now) if follows and heater.reached else None
            if since is not None and now - since >= REACHED_S:
                return
            if now - reported >= REPORT_S:
                reported = now
                tell(f" {report.temperatures(self._hub)}")
            await asyncio.sleep(LOOK_S)


def _plain(text: str) -> str:
    """For a comment of G-code."""
    return text.replace("(", " ").replace(")", " ")
