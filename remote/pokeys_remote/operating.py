# SPDX-License-Identifier: GPL-2.0-or-later
"""Operating LinuxCNC over the control socket: commands that are queued, and its state for those who subscribe.

A command is answered when it is queued. What LinuxCNC makes of it comes later, as a notification, because task may
take seconds for it. To stop never waits in the queue: it empties it, and another process does it.
"""
from __future__ import annotations

import json
import logging
import math
import re
import socket
import subprocess
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from . import beside
from .component import Refused
from .control import Call, Control, Method, Peer

QUEUE_MOST = 32
STOP_LIMIT = 6.0            # s; LinuxCNC's module waits for 5
GIVEN_LIMIT = 8.0           # s; besides, it may do two things for a command
STOPPING_LIMIT = 20.0       # s; three stops may be behind each other
LINE_MOST = 255             # bytes of an MDI line, as in LinuxCNC
SPEED_MOST = 1e6            # units/s; LinuxCNC has a limit for each axis
RESTART_PAUSE = 5.0         # s
PACKET_MOST = 64 * 1024
MODES, OVERRIDES = ("manual", "mdi", "auto"), ("feed", "rapid", "spindle")
_AXIS = re.compile(r"[a-z]|[0-9]{1,2}")
_LOG = logging.getLogger("pokeys-remote")


@dataclass(eq=False)
class _Session:
    """A process that talks to LinuxCNC (linuxcncsession.py), started when it is needed."""

    role: str
    control: Control
    hear: Callable[[dict[str, Any]], None]
    lost: Callable[[str], None]
    link: socket.socket | None = None
    process: subprocess.Popen[bytes] | None = None
    ending: list[subprocess.Popen[bytes]] = field(default_factory=list)
    why: str = ""

    def send(self, message: Mapping[str, Any]) -> None:
        """:class:`Refused` if there is no such process, or it takes no more."""
        data = json.dumps(message).encode()
        try:
            if self.link:
                try:
                    self.link.send(data)
                    return
                except (BrokenPipeError, ConnectionResetError):
                    self._end()
            self._start().send(data)
        except OSError as error:
            raise Refused([f"LinuxCNC cannot be commanded: {error}"]) from None

    def _start(self) -> socket.socket:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        ours.setblocking(False)
        with theirs:
            try:
                self.process = beside.start("linuxcncsession", self.role, stdin=theirs.fileno())
            except OSError:
                ours.close()
                raise
        self.link, self.why = ours, ""
        self.control.watch(ours, self._heard)
        return ours

    def _heard(self, _now: float) -> None:
        if not self.link:
            return                      # it ended in this turn
        try:
            packet = self.link.recv(PACKET_MOST)
        except BlockingIOError:
            return
        except OSError:
            packet = b""
        if packet:
            said = json.loads(packet)
            self.why = said.get("fatal", self.why)
            self.hear(said)
            return
        self._end()

    def _end(self) -> None:
        self.close()
        self.lost(self.why or "the process for it has ended")

    def close(self) -> None:
        """It ends by itself at the end of the link."""
        if self.link:
            self.control.unwatch(self.link)
            self.link.close()
            self.link = None
        if self.process:
            self.ending.append(self.process)
            self.process = None

    def reap(self) -> None:
        """Forget processes that have ended."""
        self.ending = [one for one in self.ending if one.poll() is None]


@dataclass(eq=False)
class _Command:
    """A command that waits, or that LinuxCNC has."""

    peer: Peer
    identity: Any
    do: str
    params: dict[str, Any]
    number: int
    sent: float                 # when it was queued
    given: float = math.inf     # when LinuxCNC's process got it

    def done(self, fault: str | None) -> None:
        """Tell its peer."""
        _tell_done(self.peer, self.identity, fault)


@dataclass(eq=False)
class _Stop:
    """A stop that LinuxCNC's process has not confirmed."""

    do: str
    asked: list[tuple[Call, float]]     # and until when each is answered
    given: float
    again: bool = False                 # it was sent to a second process


@dataclass(eq=False)
class Operating:
    """The queue, and the subscribers."""

    control: Control
    errors: bool = False
    old_until: float = -math.inf        # what comes before this time may be old
    _queue: deque[_Command] = field(default_factory=deque)
    _given: _Command | None = None
    _subscribers: list[Peer] = field(default_factory=list)
    _owners: dict[Peer, int] = field(default_factory=dict)
    _state: dict[str, Any] = field(default_factory=dict)
    _number: int = 0
    _stops: dict[int, _Stop] = field(default_factory=dict)      # one of a kind
    _more: dict[str, list[tuple[Call, float]]] = field(default_factory=dict)    # stops that came since
    _over: dict[tuple[Peer, str], int] = field(default_factory=dict)    # presses that do not begin again, by axis
    _stopping: str = ""                 # how to stop again after the command that LinuxCNC has
    _retry: float = math.inf

    def __post_init__(self) -> None:
        self._commands = _Session("commands", self.control, self._answered, self._no_commands)
        self._watch = _Session("watch-errors" if self.errors else "watch", self.control, self._reported, self._no_watch)

    @property
    def methods(self) -> Mapping[str, Method]:
        """Of the control socket."""
        named: dict[str, tuple[Callable[[Call, float], None], dict[str, type]]] = {
            "stop": (self._stop, {}), "emergency_stop": (self._stop, {}), "subscribe": (self._subscribe, {}),
            "mode": (self._mode, {"mode": str}), "mdi": (self._mdi, {"line": str}), "run": (self._plain, {}),
            "pause": (self._plain, {}), "resume": (self._plain, {}), "home": (self._plain, {"joint": int}),
            "override": (self._override, {"what": str, "value": float}),
            "jog": (self._jog, {"axis": str, "speed": float, "press": int}),
        }
        return {f"linuxcnc.{name}": Method(run, params, operates=True) for name, (run, params) in named.items()}

    def look(self, now: float) -> None:
        """Forget peers that are gone, and begin again what has failed. Call it in each turn."""
        for peer in [peer for peer in self._owners if not peer.open]:
            self._forget(peer)
        self._subscribers = [peer for peer in self._subscribers if peer.open]
        for asked in (*(stop.asked for stop in self._stops.values()), *self._more.values()):
            for call, _ in [one for one in asked if now >= one[1]]:
                call.refuse("LinuxCNC does not answer")
            asked[:] = [one for one in asked if now < one[1]]
        # the ends of these are noticed
        if self._given and now - self._given.given > GIVEN_LIMIT and self._commands.process:
            self._commands.process.kill()
        if self._watch.process and any(now - stop.given > STOPPING_LIMIT for stop in self._stops.values()):
            self._watch.process.kill()
        self._commands.reap()
        self._watch.reap()
        if now >= self._retry and self._subscribers:
            self._retry = math.inf
            self._ask_watch("state")

    def close(self) -> None:
        """The processes end."""
        self._commands.close()
        self._watch.close()

    # what is asked for

    def _mode(self, call: Call, now: float) -> None:
        _one_of("mode", call.params["mode"], MODES)
        self._plain(call, now)

    def _mdi(self, call: Call, now: float) -> None:
        line = call.params["line"]
        if not line.strip() or not line.isprintable() or len(line.encode()) > LINE_MOST:
            raise Refused([f"line: one line of G-code, at most {LINE_MOST} bytes"])
        self._plain(call, now)

    def _override(self, call: Call, now: float) -> None:
        _one_of("what", call.params["what"], OVERRIDES)
        if not 0 <= call.params["value"] <= 10:
            raise Refused(["value: a factor such as 0.8"])
        self._plain(call, now)

    def _jog(self, call: Call, now: float) -> None:
        speed = call.params["speed"]
        if not _AXIS.fullmatch(call.params["axis"]):
            raise Refused(["axis: the letter of an axis, such as x, or the number of a joint"])
        if not -SPEED_MOST <= speed <= SPEED_MOST:
            raise Refused([f"speed: units/s, at most {SPEED_MOST:.0f}"])
        if not speed:
            self._up(call)
            return
        if self._over.get((call.peer, call.params["axis"])) == call.params["press"]:
            call.answer()
            _tell_done(call.peer, call.identity, "this press has ended")
            return
        waits = next((one for one in self._queue if one.peer is call.peer and one.do == "jog"
                      and one.params["axis"] == call.params["axis"]), None)
        try:
            self._plain(call, now)
        except Refused:
            self._end_press(call.peer, call.params)
            raise
        if waits and waits in self._queue:
            # this one is newer
            self._queue.remove(waits)
            waits.done(None)

    def _up(self, call: Call) -> None:
        """A key is up: before all that waits."""
        axis = call.params["axis"]
        self._drop(lambda one: one.peer is call.peer and one.do == "jog" and one.params["axis"] == axis, None)
        if self._commands.link:
            self._take_back("up", owner=self._owner(call.peer), axis=axis)
        call.answer()
        _tell_done(call.peer, call.identity, None)

    def _plain(self, call: Call, now: float) -> None:
        if now < self.old_until:
            raise Refused(["this may be old; send it again"])
        if call.stale:
            raise Refused(["it was stopped"])
        if call.peer.gone:
            raise Refused(["its connection has ended"])
        if len(self._queue) >= QUEUE_MOST:
            raise Refused([f"{QUEUE_MOST} commands wait already, which is the most"])
        self._number += 1
        do = call.name.partition(".")[2]
        params, owner = dict(call.params), self._owner(call.peer)
        if do == "jog":
            params["owner"] = owner
        self._queue.append(_Command(call.peer, call.identity, do, params, self._number, time.monotonic()))
        call.answer()
        self._next()

    def _owner(self, peer: Peer) -> int:
        self._number += 1
        return self._owners.setdefault(peer, self._number)

    def _stop(self, call: Call, now: float) -> None:
        """Before all that waits, and instead of it."""
        do = call.name.partition(".")[2]
        self._drop(lambda _: True, "it was stopped")
        if self._commands.link:
            self._take_back("stop")
        if self._given:
            self._stopping = do
        asked = call, now + STOP_LIMIT
        if any(stop.do == do for stop in self._stops.values()):
            # that one may have been before what LinuxCNC was given since; this one is not
            self._more.setdefault(do, []).append(asked)
        else:
            self._give_stop(do, [asked])
        self.control.pass_over(call.peer, now)

    def _give_stop(self, do: str, asked: list[tuple[Call, float]]) -> None:
        self._number += 1
        self._stops[self._number] = _Stop(do, asked, time.monotonic())
        self._ask_watch(do, self._number)

    def _subscribe(self, call: Call, _now: float) -> None:
        self._watch.send({"do": "state", "number": 0})
        call.answer()
        if call.peer not in self._subscribers:
            self._subscribers.append(call.peer)
            self._owner(call.peer)
            if self._state:
                call.peer.send({"method": "linuxcnc.state", "params": self._state})

    # what happens

    def _next(self) -> None:
        while not self._given and self._queue:
            command = self._queue.popleft()
            command.given = time.monotonic()
            # a key that is held is held since it was said
            sent = command.sent if command.do == "jog" else command.given
            try:
                self._commands.send({"number": command.number, "do": command.do, "params": command.params,
                                     "sent": sent})
            except Refused as refused:
                self._done(command, str(refused))
                continue
            self._given = command

    def _done(self, command: _Command, fault: str | None) -> None:
        command.done(fault)
        if fault and command.do == "jog":
            self._end_press(command.peer, command.params)
        if fault and command.do != "jog":
            # what follows counted on it
            self._drop(lambda one: one.peer is command.peer and one.do != "jog",
                       "the command before it was not carried out")

    def _answered(self, said: dict[str, Any]) -> None:
        if self._given and said.get("number") == self._given.number:
            given, self._given = self._given, None
            self._done(given, said["error"])
            self._stop_again()
            self._next()

    def _stop_again(self) -> None:
        """LinuxCNC may have got a command after the stop."""
        if self._stopping:
            stopping, self._stopping = self._stopping, ""
            self._ask_watch(stopping)

    def _no_commands(self, why: str) -> None:
        self._drop(lambda _: True, why)
        if self._given:
            given, self._given = self._given, None
            self._done(given, why)
        self._stop_again()

    def _reported(self, said: dict[str, Any]) -> None:
        if "said" in said:
            self._tell({"method": "linuxcnc.said", "params": said["said"]})
        elif "stopped" in said:
            self._stopped(said["stopped"], said["error"])
        elif "state" in said:
            changed = said["state"] if self._state else {"connected": True, **said["state"]}
            self._state.update(changed)
            self._tell({"method": "linuxcnc.state", "params": changed})

    def _no_watch(self, why: str) -> None:
        self._state = {}
        self._tell({"method": "linuxcnc.state", "params": {"connected": False, "why": why}})
        self._retry = time.monotonic() + RESTART_PAUSE
        for number, stop in list(self._stops.items()):
            if stop.again:
                self._stopped(number, why)
            else:
                stop.again, stop.given = True, time.monotonic()
                self._ask_watch(stop.do, number)

    def _stopped(self, number: int, fault: str | None) -> None:
        stop = self._stops.pop(number, None)
        if not stop:
            return
        for call, _ in stop.asked:
            if fault:
                call.refuse(fault)
            else:
                call.answer()
        # also if nobody waits for it any more
        if (more := self._more.pop(stop.do, None)) is not None:
            self._give_stop(stop.do, more)

    def _ask_watch(self, do: str, number: int = 0) -> None:
        try:
            self._watch.send({"do": do, "number": number})
        except Refused as refused:
            self._no_watch(str(refused))

    def _tell(self, message: dict[str, Any]) -> None:
        for peer in self._subscribers:
            peer.send(message)

    def _forget(self, peer: Peer) -> None:
        """It is gone: what it asked for and has not begun is dropped, and what it holds stops."""
        self._drop(lambda command: command.peer is peer, "")
        owner = self._owners.pop(peer)
        self._over = {key: press for key, press in self._over.items() if key[0] is not peer}
        if self._commands.link:
            self._take_back("release", owner=owner)

    def _take_back(self, do: str, **params: Any) -> None:
        # not in the queue; its answer has no number
        try:
            self._commands.send({"number": 0, "do": do, "params": params})
        except Refused as refused:
            _LOG.warning("%s", refused)

    def _drop(self, which: Callable[[_Command], bool], why: str | None) -> None:
        for command in [command for command in self._queue if which(command)]:
            self._queue.remove(command)
            command.done(why)
            if why and command.do == "jog":
                self._end_press(command.peer, command.params)

    def _end_press(self, peer: Peer, params: Mapping[str, Any]) -> None:
        """A key whose jog was refused or stopped moves nothing until it is pressed again."""
        if peer.open:
            self._owner(peer)
            self._over[peer, params["axis"]] = params["press"]


def _tell_done(peer: Peer, identity: Any, fault: str | None) -> None:
    peer.send({"method": "linuxcnc.done", "params": {"id": identity, "error": fault}})


def _one_of(what: str, text: str, words: tuple[str, ...]) -> None:
    if text not in words:
        raise Refused([f"{what}: one of {', '.join(words)}"])
