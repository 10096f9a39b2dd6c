# SPDX-License-Identifier: GPL-2.0-or-later
"""The machine that the console has if it has no serial port: the gateway itself, which carries out G-code.

A reply goes to who has asked, and to nobody else. Nothing waits: a stop gets its ``ok`` when it is confirmed,
and other lines are taken meanwhile, also of the same client.

A stop is obeyed whatever is wrong with its line: its number, its checksum, what stands behind it.
"""
from __future__ import annotations

import asyncio
import functools
import logging
import re
from collections import deque
from dataclasses import dataclass, field, replace
from weakref import ReferenceType, WeakKeyDictionary, ref

from ..console.client import Client
from ..console.console import Console
from ..console.message import Message
from ..console.urgent import STOP
from ..hub import Hub
from ..wire import NotDone
from . import report
from .blocks import CANCEL, MODAL, MOTION, SPEED, is_block, parts
from .card import Storing
from .commands import (
    AUTOREPORT,
    COMMANDS,
    END_JOB,
    RENUMBER,
    RESUME,
    STATE,
    STORE,
    STORED,
    switches_off,
)
from .holder import STOPPED
from .lane import Job, Kept, Lane, Modes
from .linuxcnc import PAUSE, RUN, LinuxCnc
from .numbering import Numbering
from .operation import Operation
from .parser import LINE_MOST, BadLine, BadWords, Line, is_summed, number_of, parse
from .reports import Reports

NAME = "PoKeys devices"
TAKE = 1 << 20              # bytes at once: all that the router lets wait
KEPT = 4 * LINE_MOST        # of a line that is too long
SHOWN = 64                  # characters of a line in a message
JOIN_S = 0.1                # a stop so soon after the same one is the same
NOW_MOST = 64               # lines that go past others
DUE_MOST = 64               # replies to stops that a client can wait for
LAST_S = 2.0                # for stops under way when the gateway ends
TOO_LONG = f"echo:not carried out: a line has at most {LINE_MOST} characters: "
NO_STOP = ("the gateway may not operate LinuxCNC ([linuxcnc] operate = no), and commands no device ([machine] device); "
           "use the machine's own switch")
NO_DEVICE = ("G-code has no device to command; set device in [machine], or operate = yes in [linuxcnc], see "
             "pokeys-gateway.conf(5)")
_END = re.compile(rb"\r\n|\r|\n")
_LOG = logging.getLogger("pokeys-gateway")


def _unknown(text: str) -> str:
    return f'echo:Unknown command: "{text[:SHOWN]}"; M115 lists the commands'


def _parts(line: Line) -> list[Line]:
    """The commands of a line, one after the other. :class:`BadWords`."""
    command = COMMANDS.get(line.name)
    return [line] if command and command.text and not is_block(line) else parts(line)


def _named(line: Line, modes: Modes) -> Line:
    """One of them; a move without a command gets the last one's."""
    if line.name == MODAL and not modes.motion:
        raise BadWords(f'"{line.argument}" needs a G0, G1, G2 or G3 before it')
    return replace(line, name={MODAL: modes.motion, SPEED: "G1"}.get(line.name, line.name))


def _remember(part: Line, modes: Modes) -> None:
    """It has been carried out, or cannot be."""
    if part.name in MOTION:
        modes.motion = part.name
    elif part.name == CANCEL or (part.name[:1] == "G" and part.name not in COMMANDS):
        modes.motion = ""       # what follows belongs to another command


def _shown(data: bytes) -> str:
    return data.decode("utf-8", "replace").strip()[:SHOWN]


@dataclass
class _Stop:
    """One that is under way."""

    at: float
    done: asyncio.Future[None]
    askers: list[tuple[Client, str, int]] = field(default_factory=list)      # who, the command, the request's number


class Machine:
    """Takes lines from the console and answers them, from now on. Belongs to the event loop's thread."""

    def __init__(self, console: Console, hub: Hub) -> None:
        self._router = console.router
        self._client = console.machine(NAME, KEPT)
        self._client.on_stop = self._forget
        self._client.on_forgotten = self._forgotten
        self._client.outbox.on_put = self._take
        self._hub = hub
        self._taken: deque[Message] = deque()
        self._begun = bytearray()       # a line that has no end yet
        self._long = False              # more of it came than is kept
        self._asker: Client | None = None       # whose it is
        self._numbers = Numbering()
        self._stops: dict[str, _Stop] = {}      # the last one of each kind
        self._under_way: set[asyncio.Future[None]] = set()
        self._reports = Reports(self._router.hears, self._report)
        self._lanes: WeakKeyDictionary[Client, Lane] = WeakKeyDictionary()
        self._kept = Kept()
        device = hub.config.machine_device
        self._operation = Operation(hub, device, self._halt, self._router.tell_all) if device else None
        self._linuxcnc = LinuxCnc(hub, self._router.tell_all) if hub.config.operate and not device else None
        self._now: dict[asyncio.Task[None], Job] = {}       # lines that wait for no other
        self._own_stop = False          # a stop of ours is being begun
        if self._linuxcnc:
            hub.operators.on_stop = self._stopped_elsewhere
        if self._operation:
            console.about = self._operation.about
            console.store = self._operation.store
            console.jog = self._operation.jog

    def open(self) -> None:
        """Look for what another gateway has left."""
        if self._operation:
            # a disk that hangs keeps nobody waiting
            self._operation.busy = lambda: any(lane.busy for lane in self._lanes.values())
            self._operation.open(self._judge, self._run)

    async def close(self) -> None:
        """Stops that are under way have a moment to get through."""
        self._reports.close()
        for task in self._now:
            task.cancel()
        if self._under_way:
            await asyncio.wait(self._under_way, timeout=LAST_S)
        for lane in self._lanes.values():
            lane.clear(STOPPED)
        if self._operation:
            await self._operation.close()
        if self._linuxcnc:
            self._linuxcnc.close()

    def _forget(self) -> dict[Client | None, int]:
        """A stop has come: lines that are here are not carried out; how many that are."""
        lines: dict[Client | None, int] = {None: len(self._taken) + bool(self._begun)}
        lines |= self._clear_lanes(STOPPED)
        for task, job in self._now.items():
            if task.cancel() and job.asker and not self._router.hears(job.asker):
                job.tell(f"Error:{STOPPED}\nok")
        if self._operation:
            self._operation.abort(STOPPED)
        while self._taken:
            message = self._taken.popleft()
            self._forgotten(message.origin)
            message.release()
        if self._begun:
            self._forgotten(self._asker)
        self._begun.clear()
        self._long = False
        return lines

    def _forgotten(self, asker: Client | None) -> None:
        """Lines of it are not carried out."""
        if asker and (lane := self._lanes.get(asker)):
            lane.modes.interrupt()

    def _clear_lanes(self, why: str) -> dict[Client | None, int]:
        """Discard the lines that wait, and count them. A client that does not hear the stop gets a reply."""
        lines: dict[Client | None, int] = {}
        for asker, lane in self._lanes.items():
            if lane.storing:
                lane.storing.spoil(why)
            if not lane.busy:
                continue
            asker.failed = True
            if not self._router.hears(asker):
                lane.tell(f"Error:{why}\nok")
            lines[asker] = lane.clear(why)
            self._let_go(asker, lane)
        return lines

    def _let_go(self, asker: Client, lane: Lane) -> None:
        if lane.held and not lane.full:
            lane.held = False
            self._router.hold(asker, False)

    def _take(self) -> None:
        self._taken += self._client.outbox.take(TAKE)
        while self._taken:
            message = self._taken.popleft()
            try:
                self._feed(message)
            finally:
                message.release()

    def _feed(self, message: Message) -> None:
        """Join the parts of a line. The router sends no other line between them, and may end the line itself."""
        data = message.data
        if message.origin is None and data == b"\n":
            self._cut()
            return
        if not self._begun:
            self._asker = message.origin
        # the router has told of it, and has ended a line that was begun
        told = STOP.match(data.removeprefix(b"\n")) is not None and data.startswith(b"\n")
        while end := _END.search(data):
            self._keep(data[:end.start()])
            data = data[end.end():]
            line, too_long = bytes(self._begun), self._long
            self._begun.clear()
            self._long = False
            if self._asker and line:
                self._line(self._asker, line, too_long, told, message.request)
        self._keep(data)

    def _cut(self) -> None:
        """The router has ended a line, as its sender has not: half a number is another number."""
        line, asker = bytes(self._begun), self._asker
        self._begun.clear()
        self._long = False
        if not asker or not line:
            return
        if STOP.match(line):
            self._line(asker, line, False, False, 0)
            return
        self._spoil(asker, "a line has no end")
        if asker in self._numbers:
            self._tell(asker, self._numbers.resend(asker, BadLine("the line has no end")), 0)
        else:
            self._tell(asker, f'echo:not carried out, as it has no end: "{_shown(line)}"\nok', 0)

    def _keep(self, data: bytes) -> None:
        """More of the line that is begun."""
        room = KEPT - len(self._begun)
        self._begun += data[:room]
        self._long = self._long or len(data) > room

    # ---- a whole line

    def _line(self, asker: Client, data: bytes, too_long: bool, told: bool, request: int) -> None:
        try:
            if found := STOP.match(data):
                self._stop(asker, f"M{found[1].decode()}", data, told, request)
            elif too_long:
                # its checksum is not known, and the same line would be as long again
                self._numbers.count(asker, number_of(data))
                self._spoil(asker, "a line is too long")
                self._tell(asker, f'{TOO_LONG}"{_shown(data)}"\nok', request)
            elif line := parse(data):
                if line.number is None and asker in self._numbers and is_summed(data):
                    raise BadLine("No Line Number with checksum")
                self._carry_out(asker, line, request)
        except BadLine as why:
            self._tell(asker, self._numbers.resend(asker, why), request)
        except Exception as why:
            self._tell(asker, self._reason(asker, why), request)

    @staticmethod
    def _reason(asker: Client, why: Exception, name: str = "") -> str:
        """The reply to a line that was not carried out; `name` is that of a command without which a job is spoilt."""
        if isinstance(why, BadWords) and not name:
            return f"echo:not carried out: {why}\nok"
        asker.failed = True
        if isinstance(why, NotDone | BadWords):
            return f"Error:{name}: {why}\nok"
        _LOG.error("a line of %s", asker, exc_info=why)
        return "Error:internal error of the gateway; see its log\nok"

    def _carry_out(self, asker: Client, line: Line, request: int) -> None:
        if line.name != RENUMBER:
            self._numbers.count(asker, line.number)
        if len(line.text) > LINE_MOST:
            self._spoil(asker, "a line is too long")
            self._tell(asker, f'{TOO_LONG}"{_shown(line.text.encode())}"\nok', request)
            return
        if line.name == RENUMBER:
            self._numbers.renumber(asker, line)
        command = COMMANDS.get(line.name)
        linuxcnc = self._linuxcnc if self._linuxcnc and self._linuxcnc.takes(line) else None
        if line.name == END_JOB and (self._linuxcnc or (self._operation and self._operation.running)):
            self._stop(asker, END_JOB, b"", False, request)
            return
        if command and (command.work or (command.act and command.commands)) and not self._operation and not linuxcnc:
            self._tell(asker, self._reason(asker, NotDone(NO_DEVICE), line.name), request)
            return
        lane = self._lane(asker)
        storing = self._storing(asker, lane, line)
        works = self._works(line)
        tell = functools.partial(self._tell, asker, request=request)
        job = Job(asker, line, lane.modes, tell, storing, is_block(line))
        if linuxcnc and self._goes_past(linuxcnc, lane, line.name):
            job.owe(1)
            task = asyncio.get_running_loop().create_task(self._pause(linuxcnc, job, linuxcnc.begin(line.name)))
            self._now[task] = job
            task.add_done_callback(self._paused)
            return
        if storing or linuxcnc or works or (lane.busy and not (command and command.at_once)):
            lane.put(job)
            if lane.full and not lane.held:
                lane.held = True
                self._router.hold(asker, True)
            return
        self._tell(asker, self._reply(asker, line), request)

    def _lane(self, asker: Client) -> Lane:
        lane = self._lanes.get(asker)
        if not lane:
            lane = self._lanes[asker] = Lane(self._work, functools.partial(self._room, ref(asker)))
            if not self._router.hears(asker):
                lane.modes = self._kept.of(asker)
        return lane

    def _goes_past(self, linuxcnc: LinuxCnc, lane: Lane, name: str) -> bool:
        """A pause and its end do not wait for the line that is paused."""
        return lane.busy and len(self._now) < NOW_MOST and ((name == PAUSE and not lane.holds(RUN)) or
                                                           (name == RUN and linuxcnc.paused))

    async def _pause(self, linuxcnc: LinuxCnc, job: Job, turn: int) -> None:
        assert job.asker
        try:
            await linuxcnc.pause(job, turn)
            job.tell("ok")
        except Exception as why:
            job.tell(self._reason(job.asker, why, job.line.name))

    def _paused(self, done: asyncio.Task[None]) -> None:
        # also if it was cancelled before it began
        job = self._now.pop(done)
        job.owe(-1)
        if self._linuxcnc:
            self._linuxcnc.end(job.line.name)

    def _storing(self, asker: Client, lane: Lane, line: Line) -> Storing | None:
        """The file that this line is a part of: from M28 to M29, or to M999."""
        storing = lane.storing
        if line.name == STORE and self._operation:
            if storing:
                storing.spoil("another M28 has come")
            # without a folder, its lines must not be carried out either
            storing = lane.storing = self._operation.store(line.argument) if self._operation.files else Storing(
                None, line.argument)
            asker.on_end = functools.partial(self._spoil_of, ref(lane))
        elif line.name in (STORED, RESUME):
            lane.storing = None
            if storing and line.name == RESUME:
                storing.spoil("M999 has come")
                return None
        return storing

    def _spoil(self, asker: Client, why: str) -> None:
        """A line is missing, perhaps of its file."""
        self._forgotten(asker)
        lane = self._lanes.get(asker)
        if lane and lane.storing:
            lane.storing.spoil(why)

    @staticmethod
    def _spoil_of(whose: ReferenceType[Lane]) -> None:
        lane = whose()
        if lane and lane.storing:
            lane.storing.spoil("its client is gone")

    def _reply(self, asker: Client, line: Line) -> str:
        """To a command that takes no time."""
        if line.name == AUTOREPORT:
            self._reports.begin(asker, line)
        if self._linuxcnc and line.name in ("M27", "M108", "M114"):
            return self._of_linuxcnc(self._linuxcnc, line.name)
        if not line.text:
            return "ok"
        if line.name not in COMMANDS:
            _remember(line, self._lanes[asker].modes)
            return f"{_unknown(line.text)}\nok"
        command = COMMANDS[line.name]
        if command.act and self._operation:
            try:
                command.act(self._operation)
            except NotDone as why:
                return f"echo:{line.name}: {why}\nok"      # there was nothing to do
        if line.name == STATE and self._operation and self._operation.halted:
            return f"{command.run(self._hub, None)}\necho:{self._operation.halted}; {RESUME} permits commands again\nok"
        before, behind = command.run(self._hub, self._operation), command.answer(self._hub, self._operation)
        return f"{before}\n" * bool(before) + f"ok {behind}".rstrip()

    @staticmethod
    def _of_linuxcnc(linuxcnc: LinuxCnc, name: str) -> str:
        if name == "M108":
            linuxcnc.give_up()
            return "ok"
        linuxcnc.watch()
        return f"{linuxcnc.positions() if name == 'M114' else linuxcnc.progress()}\nok"

    # ---- commands that take time

    def _room(self, whose: ReferenceType[Client]) -> None:
        """The lane of a client has room again."""
        if asker := whose():
            self._let_go(asker, self._lanes[asker])

    async def _work(self, job: Job) -> None:
        """Carry out a line, with its reply."""
        assert job.asker
        name, operation, lane = job.line.name, self._operation, self._lanes[job.asker]
        linuxcnc = self._linuxcnc if self._linuxcnc and self._linuxcnc.takes(job.line) else None
        try:
            if job.storing:
                job.tell(await self._store(job, job.storing))
            elif job.gone and not switches_off(job.line) and not (operation and is_block(job.line)):
                job.modes.interrupt()
                return      # what switches off is carried out for who is gone, too
            elif lane.skips(job) and not switches_off(job.line):
                raise NotDone("not carried out, as a line before it has failed")
            elif linuxcnc:
                before = await linuxcnc.carry_out(job)
                if lane.has(job):
                    job.tell(f"{before}\n" * bool(before) + "ok")
            elif operation and self._works(job.line):
                said = []
                for part in self._ready(operation, job):
                    name = part.name
                    if not job.gone or switches_off(part):
                        said.append(await self._carry_out_part(operation, job, part))
                if lane.has(job):
                    job.tell("".join(f"{text}\n" for text in said if text) + "ok")
            else:
                job.tell(self._reply(job.asker, job.line))
        except Exception as why:
            if not lane.has(job):
                return      # a fault that it has met itself has ended it already
            failed = bool(job.storing or linuxcnc or self._works(job.line))
            job.tell(self._reason(job.asker, why, (name or "line") if failed else ""))
            if failed and not job.storing and job.asker.connected:
                lines = job.asker.forget()
                lane.skip(lines)
                if lines:
                    self._tell(job.asker, f"echo:not carried out, as a line before them has failed: {lines} lines", 0)

    def _works(self, line: Line) -> bool:
        """It takes time."""
        command = COMMANDS.get(line.name)
        if command and command.work:
            return True
        return self._operation is not None and is_block(line)

    def _ready(self, operation: Operation, job: Job) -> list[Line]:
        """The commands of a line. Raises what is known to be wrong with one of them, before the first is begun."""
        found = _parts(job.line)
        commands = [COMMANDS.get(_named(part, job.modes).name) for part in found]
        for part, command in zip(found, commands, strict=True):
            if len(found) > 1 and command and command.judge:
                command.judge(operation, part)
        if operation.prints and any(command and command.moves for command in commands):
            raise NotDone("a job is under way; M25 lets it wait, and M524 ends it")
        return found

    @staticmethod
    async def _carry_out_part(operation: Operation, job: Job, part: Line) -> str:
        """A command of a line; lines before the ok."""
        line = _named(part, job.modes)
        command = COMMANDS.get(line.name)
        said = _unknown(line.name)
        if command and command.work:
            if command.commands:
                await operation.ready()
            operation.holder.begin()
            said = await command.work(operation, replace(job, line=line))
        _remember(part, job.modes)
        return said

    @staticmethod
    async def _store(job: Job, storing: Storing) -> str:
        """M28, M29, and the lines between them."""
        if job.line.name == STORE:
            await storing.begin()
            return f"Writing to file: {storing.name}\nok"
        if job.line.name == STORED:
            await storing.finish()
            return "Done saving file.\nok"
        await storing.write(job.line.text)
        return "ok"

    def _judge(self, line: Line) -> list[tuple[Line, bool]]:
        """The commands of a line of a file, each with whether it exists. Raises why it can never be carried out."""
        if not self._works(line):
            return [(line, line.name != "" and self._judge_part(line))]
        return [(part, self._judge_part(part)) for part in _parts(line)]

    def _judge_part(self, line: Line) -> bool:
        # all moves are judged alike
        command, operation = COMMANDS.get("G1" if line.name in (MODAL, SPEED) else line.name), self._operation
        if not command or not operation:
            return False
        if command.stop or command.act or (command.work and not command.in_files):
            raise NotDone(f"{line.name} cannot be in a file")
        if command.judge:
            command.judge(operation, line)
        return True

    async def _run(self, job: Job) -> None:
        """Carry out a command of a file, which is judged."""
        line = _named(job.line, job.modes)
        command, operation = COMMANDS.get(line.name), self._operation
        if command and command.work and operation:
            await operation.ready()
            operation.holder.begin()
            await command.work(operation, replace(job, line=line))
        _remember(job.line, job.modes)

    def _halt(self, why: str) -> None:
        """Nothing is commanded any more: hosts end their job at an error."""
        self._clear_lanes(why)
        if self._operation:
            self._operation.abort(why)
        self._router.tell_all(f"Error:{why}; {RESUME} permits commands again")

    def _report(self, asker: Client) -> None:
        """What is missing is said by M105."""
        if text := report.temperatures(self._hub):
            self._tell(asker, f" {text}", 0)

    # ---- stops

    def _stop(self, asker: Client, name: str, data: bytes, told: bool, request: int) -> None:
        if not told:
            self._router.halt(asker)
        try:
            line = parse(data)
            self._numbers.set(asker, line.number if line else None)
        except BadLine:
            pass
        if not self._hub.config.operate and not self._operation:
            self._failed(asker, name, f"[not stopped: {NO_STOP}]", NO_STOP, request)
            return
        stop = self._begin(COMMANDS[name].stop)
        if asker.due >= DUE_MOST:
            self._tell(asker, "echo:busy: stopping\nok", request)
            return
        asker.due += 1
        stop.askers.append((asker, name, request))

    def _begin(self, method: str) -> _Stop:
        """One that is under way from now on, or has just begun."""
        loop = asyncio.get_running_loop()
        last = self._stops.get(method)
        if last and not last.done.done() and loop.time() < last.at + JOIN_S:
            return last
        begin = self._operation.begin_stop if self._operation else self._hub.operators.begin_stop
        self._own_stop = True
        try:
            stop = self._stops[method] = _Stop(loop.time(), begin(method))
        finally:
            self._own_stop = False
        self._under_way.add(stop.done)
        stop.done.add_done_callback(functools.partial(self._stopped, stop))
        return stop

    def _stopped_elsewhere(self) -> None:
        """LinuxCNC was stopped by another way into the gateway: lines that wait here belong to what was stopped."""
        if not self._own_stop:
            self._router.halt(None, by="an operator of LinuxCNC", now=asyncio.get_running_loop().time())

    def _stopped(self, stop: _Stop, done: asyncio.Future[None]) -> None:
        self._under_way.discard(done)
        why = done.exception() if not done.cancelled() else NotDone("the gateway is shutting down")
        said = False
        for asker, name, request in stop.askers:
            asker.due -= 1
            if why:
                text = f"the stop is not confirmed: {why}; use the machine's own switch"
                self._failed(asker, name, "" if said else f"[{text}]", text, request)
                said = True
            else:
                self._tell(asker, "ok", request)
        if why and not isinstance(why, NotDone):
            _LOG.error("a stop", exc_info=why)

    def _failed(self, asker: Client, name: str, to_all: str, why: str, request: int) -> None:
        """Everybody has been told that a stop came."""
        if to_all:
            self._router.tell_all(to_all)
        asker.failed = True
        self._tell(asker, f"Error:{name}: {why}\nok", request)

    def _tell(self, asker: Client, text: str, request: int) -> None:
        if asker.connected:
            self._router.tell(asker, text, request)
