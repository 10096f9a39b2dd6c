# SPDX-License-Identifier: GPL-2.0-or-later
"""Operating LinuxCNC over the control socket: commands that are queued, and its state for those who subscribe.

A command is answered when it is queued. What LinuxCNC makes of it comes later, as a notification, because task may
take seconds for it. To stop never waits in the queue: it empties it, and another process does it.
"""
from __future__ import annotations

import json
import logging
import math
import os
import re
import socket
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .component import Refused
from .control import Call, Control, Method, Peer

QUEUE_MOST = 32
LINE_MOST = 255             # bytes of an MDI line, as in LinuxCNC
SPEED_MOST = 1e6            # units/s; LinuxCNC has a limit for each axis
RESTART_PAUSE = 5.0         # s
PACKET_MOST = 64 * 1024
MODES, OVERRIDES = ("manual", "mdi", "auto"), ("feed", "rapid", "spindle")
_AXIS = re.compile(r"[a-z]|[0-9]{1,2}")
_PACKAGES = str(Path(__file__).resolve().parent.parent)
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
        path = os.pathsep.join(filter(None, (_PACKAGES, os.environ.get("PYTHONPATH"))))
        with theirs:
            try:
                # -P: the folder of the machine's configuration is no place for modules
                self.process = subprocess.Popen(
                    [sys.executable, "-B", "-P", "-m", "pokeys_remote.linuxcncsession", self.role],
                    stdin=theirs.fileno(), stdout=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": path})
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


@dataclass(eq=False)
class _Command:
    """A command that waits, or that LinuxCNC has."""

    peer: Peer
    identity: Any
    do: str
    params: dict[str, Any]
    number: int
    sent: float

    def done(self, fault: str | None) -> None:
        """Tell its peer."""
        self.peer.send({"method": "linuxcnc.done", "params": {"id": self.identity, "error": fault}})


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
            "jog": (self._jog, {"axis": str, "speed": float}),
        }
        return {f"linuxcnc.{name}": Method(run, params, operates=True) for name, (run, params) in named.items()}

    def look(self, now: float) -> None:
        """Forget peers that are gone, and begin again what has failed. Call it in each turn."""
        for peer in [peer for peer in self._owners if not peer.open]:
            self._forget(peer)
        self._subscribers = [peer for peer in self._subscribers if peer.open]
        if now >= self._retry and self._subscribers:
            self._retry = math.inf
            self._ask_watch({"do": "state"})

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
        # one that waits is not newer than this one
        waits = next((one for one in self._queue if one.peer is call.peer and one.do == "jog"
                      and one.params["axis"] == call.params["axis"]), None)
        if waits:
            self._queue.remove(waits)
            waits.done(None)
        self._plain(call, now)

    def _plain(self, call: Call, now: float) -> None:
        if now < self.old_until:
            raise Refused(["this may be old; send it again"])
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

    def _stop(self, call: Call, _now: float) -> None:
        """Before all that waits, and instead of it."""
        self._drop(lambda _: True, "it was stopped")
        if self._commands.link:
            self._release(None)
        self._stopping = call.name.partition(".")[2]
        self._watch.send({"do": self._stopping})
        if not self._given:
            self._stopping = ""
        call.answer()

    def _subscribe(self, call: Call, _now: float) -> None:
        self._watch.send({"do": "state"})
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
            try:
                self._commands.send({"number": command.number, "do": command.do, "params": command.params,
                                     "sent": command.sent})
            except Refused as refused:
                command.done(str(refused))
                continue
            self._given = command

    def _answered(self, said: dict[str, Any]) -> None:
        if self._given and said.get("number") == self._given.number:
            given, self._given = self._given, None
            given.done(said["error"])
            if self._stopping:
                # LinuxCNC may have got the command after the stop
                stopping, self._stopping = self._stopping, ""
                self._ask_watch({"do": stopping})
            self._next()

    def _no_commands(self, why: str) -> None:
        self._drop(lambda _: True, why)
        self._stopping = ""
        if self._given:
            given, self._given = self._given, None
            given.done(why)

    def _reported(self, said: dict[str, Any]) -> None:
        if "said" in said:
            self._tell({"method": "linuxcnc.said", "params": said["said"]})
        elif "state" in said:
            changed = said["state"] if self._state else {"connected": True, **said["state"]}
            self._state.update(changed)
            self._tell({"method": "linuxcnc.state", "params": changed})

    def _no_watch(self, why: str) -> None:
        self._state = {}
        self._tell({"method": "linuxcnc.state", "params": {"connected": False, "why": why}})
        self._retry = time.monotonic() + RESTART_PAUSE

    def _ask_watch(self, message: Mapping[str, Any]) -> None:
        try:
            self._watch.send(message)
        except Refused as refused:
            self._no_watch(str(refused))

    def _tell(self, message: dict[str, Any]) -> None:
        for peer in self._subscribers:
            peer.send(message)

    def _forget(self, peer: Peer) -> None:
        """It is gone: what it asked for and has not begun is dropped, and what it holds stops."""
        self._drop(lambda command: command.peer is peer, "")
        owner = self._owners.pop(peer)
        if self._commands.link:
            self._release(owner)

    def _release(self, owner: int | None) -> None:
        # not in the queue; its answer has no number
        try:
            self._commands.send({"number": 0, "do": "release", "params": {"owner": owner}, "sent": time.monotonic()})
        except Refused as refused:
            _LOG.warning("%s", refused)

    def _drop(self, which: Callable[[_Command], bool], why: str) -> None:
        for command in [command for command in self._queue if which(command)]:
            self._queue.remove(command)
            command.done(why)


def _one_of(what: str, text: str, words: tuple[str, ...]) -> None:
    if text not in words:
        raise Refused([f"{what}: one of {', '.join(words)}"])
