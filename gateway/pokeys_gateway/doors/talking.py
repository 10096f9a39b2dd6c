# SPDX-License-Identifier: GPL-2.0-or-later
"""The console as a part of a JSON-RPC connection: lines, jogs and files of one client."""
from __future__ import annotations

import re
import time
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Any

from ..access import Who
from ..console.console import Console
from ..console.talk import LINE_MOST, Talk
from ..console.urgent import STOP
from ..gcode.card import Storing
from ..wire import NotDone
from .request import AGE_MOST_S, BEAT_S, INVALID_PARAMS, NOT_ALLOWED, NOT_DONE, TOO_MUCH, TOO_OLD, RpcError, Way, only

JOG_AGE_MOST_S = BEAT_S + 0.2       # of a wish to jog
SPEED_MOST = 1e6            # units/s
PRESSES = 16                # of an axis, that are remembered


def stop_of(message: Any) -> str:
    """The stop that a request sends to the console's machine, whatever else is in it; "": none."""
    if isinstance(message, dict) and message.get("method") == "console.send" and isinstance(
            params := message.get("params"), dict) and isinstance(line := params.get("line"), str) and (
                stop := STOP.match(line.encode("utf-8", "replace"))):
        return f"M{stop[1].decode()}"
    return ""


def ends_jog(message: Any) -> bool:
    """A request that says that a button is up."""
    return isinstance(message, dict) and message.get("method") == "console.jog" and isinstance(
        params := message.get("params"), dict) and params.get("speed") == 0


class Talking:
    """Belongs to the event loop's thread."""

    def __init__(self, console: Console, who: Who, address: str,
                 tell: Callable[[dict[str, Any]], Awaitable[None]]) -> None:
        """``tell`` sends a notification and waits for room."""
        self._console, self._who, self._address, self._tell = console, who, address, tell
        self.way = Way(0.0, 0)              # of the request that is being answered
        self._talk: Talk | None = None      # its part in the console
        self._storing: Storing | None = None        # a file that it sends
        # by axis, the newest press of a jog, and how many stops came before it
        self._presses: dict[str, tuple[int, int]] = {}
        self._over: dict[str, deque[int]] = {}      # presses that do not begin any more
        self._ended = False
        self.methods: dict[str, Callable[[dict[str, Any]], Any]] = {
            "console.info": self._console_info,
            "console.subscribe": self._console_subscribe,
            "console.send": self._console_send,
            "console.jog": self._console_jog,
            "files.begin": self._files_begin,
            "files.write": self._files_write,
            "files.finish": self._files_finish,
        }

    @property
    def may_send(self) -> bool:
        """Its lines go to the machine."""
        return self._talk is not None and self._talk.may_send

    def end(self) -> None:
        """The client is gone."""
        self._ended = True
        if self._talk:
            self._talk.close()
        if self._storing:
            self._storing.spoil("its client is gone")

    def stop(self, name: str) -> None:
        """Before all that came before it."""
        self._console_subscribe({})
        assert self._talk
        self._talk.send(name)

    def _console_info(self, params: dict[str, Any]) -> dict[str, Any]:
        only(params)
        console, machine = self._console, self._console.router.machine
        return {"machine": machine.name if machine else None, "why": "" if machine else console.router.why_no_machine,
                "send": self.may_send, **console.about()}

    def _console_subscribe(self, params: dict[str, Any]) -> dict[str, Any]:
        only(params)
        if not self._talk:
            self._talk = Talk(self._console, self._who, self._address, self._said)
        return {}

    def _console_send(self, params: dict[str, Any]) -> dict[str, Any]:
        only(params, "line")
        line = params.get("line")
        if not isinstance(line, str) or len(line.encode("utf-8", "replace")) > LINE_MOST or not line.isprintable():
            raise RpcError(INVALID_PARAMS, f"line has to be one line of text, of at most {LINE_MOST} bytes")
        if not self._talk:
            raise RpcError(NOT_ALLOWED, "console.subscribe comes before it")
        self._judge_way()
        if not line.isascii() and self._console.router.takes_bytes and not line.startswith("[ESP"):
            raise RpcError(INVALID_PARAMS, "line has to be of ASCII characters: the firmware obeys bytes of others")
        if self._talk.client.full:
            raise RpcError(TOO_MUCH, "the machine takes nothing more of this client now; stops are taken")
        self._talk.send(line)
        return {}

    async def _console_jog(self, params: dict[str, Any]) -> dict[str, Any]:
        only(params, "axis", "speed", "press")
        axis, speed, press = params.get("axis"), params.get("speed"), params.get("press")
        if not isinstance(axis, str) or not re.fullmatch("[A-Za-z]", axis) or isinstance(speed, bool) or not isinstance(
                speed, int | float) or not abs(speed) <= SPEED_MOST or type(press) is not int:
            raise RpcError(INVALID_PARAMS, f"a jog needs axis, a letter, speed, at most {SPEED_MOST:g} units/s, and "
                                           "press, a number")
        stops, axis = self._console.router.stops, axis.upper()
        over = self._over.setdefault(axis, deque(maxlen=PRESSES))
        known = self._presses.get(axis)
        if speed == 0:
            # not while it goes on by another press
            if known and known[0] == press and press not in over:
                await self._console.jog((self, axis), axis, 0)
            over.append(press)
            return {}
        if not self.may_send:
            raise RpcError(NOT_ALLOWED, "this needs level user, and console.subscribe before it")
        # what was stopped or refused does not begin while the key is still down
        if self.way.stops != stops or (known and known[0] == press and known[1] != stops):
            over.append(press)
        self._judge_way(JOG_AGE_MOST_S)
        if press in over:
            raise RpcError(NOT_DONE, "this press has ended")
        self._presses[axis] = press, stops
        try:
            await self._console.jog((self, axis), axis, speed)
        except NotDone as error:
            over.append(press)
            raise RpcError(NOT_DONE, str(error)) from None
        return {}

    def _judge_way(self, age: float = AGE_MOST_S) -> None:
        """What comes late, or came before a stop, is not done."""
        if self.way.stops != self._console.router.stops:
            raise RpcError(NOT_DONE, "it was stopped")
        if time.monotonic() > self.way.until - AGE_MOST_S + age:
            raise RpcError(NOT_DONE, TOO_OLD)

    async def _files_begin(self, params: dict[str, Any]) -> dict[str, Any]:
        only(params, "name")
        if not isinstance(name := params.get("name"), str) or not name.strip("/"):
            raise RpcError(INVALID_PARAMS, "name has to be the name of a file")
        if self._ended or not self.may_send:
            raise RpcError(NOT_ALLOWED, "this needs level user, and console.subscribe before it")
        if self._storing:
            self._storing.spoil("another file is begun")
        try:
            self._storing = self._console.store(name)
            await self._storing.begin()
        except NotDone as error:
            raise RpcError(NOT_DONE, str(error)) from None
        return {}

    async def _files_write(self, params: dict[str, Any]) -> dict[str, Any]:
        only(params, "data")
        if not isinstance(data := params.get("data"), str):
            raise RpcError(INVALID_PARAMS, "data has to be text")
        raw = data.encode("utf-8", "replace")
        return await self._store(lambda storing: storing.add(raw))

    async def _files_finish(self, params: dict[str, Any]) -> dict[str, Any]:
        only(params)
        return await self._store(lambda storing: storing.finish())

    async def _store(self, work: Callable[[Storing], Awaitable[None]]) -> dict[str, Any]:
        if not self._storing:
            raise RpcError(NOT_ALLOWED, "files.begin comes before it")
        if self._ended or not self.may_send:
            self._storing.spoil("its client may not write it any more")
            raise RpcError(NOT_ALLOWED, "this needs level user")
        try:
            await work(self._storing)
        except NotDone as error:
            raise RpcError(NOT_DONE, str(error)) from None
        return {}

    async def _said(self, lines: list[str]) -> None:
        await self._tell({"jsonrpc": "2.0", "method": "console.said", "params": {"lines": lines}})
