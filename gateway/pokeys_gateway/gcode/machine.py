# SPDX-License-Identifier: GPL-2.0-or-later
"""The machine that the console has if it has no serial port: the gateway itself, which carries out G-code.

A reply goes to who has asked, and to nobody else. Nothing waits: a command whose reply takes time gets its
``ok`` later, and other lines are taken meanwhile, also of the same client.
"""
from __future__ import annotations

import asyncio
import logging
import re
from collections.abc import Awaitable
from weakref import WeakKeyDictionary

from ..console.client import Client
from ..console.console import Console
from ..console.message import Message
from ..hub import Hub
from . import commands
from .parser import LINE_MOST, BadLine, BadWords, Line, parse

NAME = "PoKeys devices"
TAKE = 1 << 20              # bytes at once: all that the router lets wait
KEPT = 4 * LINE_MOST        # of a line that is too long
UNDER_WAY_MOST = 64         # replies that take time
SHOWN = 64                  # characters of a line in a message
RENUMBER = "M110"
_END = re.compile(rb"\r\n|\r|\n")
_LOG = logging.getLogger("pokeys-gateway")


class Machine:
    """Takes lines from the console and answers them, from now on. Belongs to the event loop's thread."""

    def __init__(self, console: Console, hub: Hub) -> None:
        self._router = console.router
        self._client = console.machine(NAME, KEPT)
        self._client.on_stop = self._forget
        self._client.outbox.on_put = self._take
        self._hub = hub
        self._begun = bytearray()       # a line that has no end yet
        self._asker: Client | None = None       # whose it is
        self._last: WeakKeyDictionary[Client, int] = WeakKeyDictionary()        # number of a client's last line
        self._under_way: set[asyncio.Task[None]] = set()

    def close(self) -> None:
        """Nothing more is answered."""
        for task in self._under_way:
            task.cancel()

    def _forget(self) -> int:
        """A stop has come: the line that is begun is not carried out; how many lines that are."""
        lines = int(bool(self._begun))
        self._begun.clear()
        return lines

    def _take(self) -> None:
        for message in self._client.outbox.take(TAKE):
            try:
                self._feed(message)
            finally:
                message.release()

    def _feed(self, message: Message) -> None:
        """The router lets no line of another client into one that is begun; the end may be its own."""
        if not self._begun:
            self._asker = message.origin
        data = message.data
        while end := _END.search(data):
            line = bytes(self._begun) + data[:end.start()]
            self._begun.clear()
            data = data[end.end():]
            if self._asker:
                self._line(self._asker, line, message.request)
        self._begun += data[:max(0, KEPT - len(self._begun))]

    def _line(self, asker: Client, data: bytes, request: int) -> None:
        """A whole line."""
        last = self._last.get(asker, 0)
        try:
            line = parse(data)
            if not line:
                return
            if line.name == RENUMBER:
                self._renumber(asker, line)
            elif line.number is not None:
                if line.number != last + 1:
                    raise BadLine("Line Number is not Last Line Number+1")
                self._last[asker] = line.number
            reply = self._carry_out(line)
        except BadLine as why:
            self._tell(asker, f"Error:{why}, Last Line: {last}\nResend: {last + 1}\nok", request)
        except commands.NotStopped as why:
            self._not_stopped(asker, line, why, request)
        except (BadWords, commands.NotPossible) as why:
            self._tell(asker, f"Error:{line.name if line else ''}: {why}\nok", request)
        except Exception:
            _LOG.exception("a line of %s", asker)
            self._tell(asker, "Error:an error of the gateway; its log says more\nok", request)
        else:
            if isinstance(reply, str):
                self._tell(asker, _replied(reply), request)
            else:
                self._later(asker, line, reply, request)

    def _renumber(self, asker: Client, line: Line) -> None:
        number = line.words().get("N", line.number)
        if number is not None:
            self._last[asker] = int(number)

    def _carry_out(self, line: Line) -> commands.Reply:
        if not line.text:
            return ""
        if len(line.text) > LINE_MOST:
            raise commands.NotPossible(f"a line has at most {LINE_MOST} characters")
        if len(self._under_way) >= UNDER_WAY_MOST:
            raise commands.NotPossible(f"{UNDER_WAY_MOST} commands are under way, which is the most")
        if line.name not in commands.COMMANDS:
            return f'echo:Unknown command: "{line.text[:SHOWN]}"; M115 lists what there is'
        return commands.run(self._hub, line)

    def _later(self, asker: Client, line: Line, reply: Awaitable[str], request: int) -> None:
        asker.due += 1
        task = asyncio.ensure_future(self._wait(asker, line, reply, request))
        self._under_way.add(task)
        task.add_done_callback(self._under_way.discard)

    async def _wait(self, asker: Client, line: Line, reply: Awaitable[str], request: int) -> None:
        try:
            self._tell(asker, _replied(await reply), request)
        except commands.NotStopped as why:
            self._not_stopped(asker, line, why, request)
        except Exception:
            _LOG.exception("%s", line.name)
            self._tell(asker, f"Error:{line.name}: an error of the gateway; its log says more\nok", request)
        finally:
            asker.due -= 1

    def _not_stopped(self, asker: Client, line: Line | None, why: Exception, request: int) -> None:
        """Everybody has been told that a stop came."""
        self._router.tell_all(f"[not stopped: {why}]")
        self._tell(asker, f"Error:{line.name if line else ''}: {why}\nok", request)

    def _tell(self, asker: Client, text: str, request: int) -> None:
        if asker.connected:
            self._router.tell(asker, text, request)


def _replied(text: str) -> str:
    return f"{text}\nok" if text else "ok"
