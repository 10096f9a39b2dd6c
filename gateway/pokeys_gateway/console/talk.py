# SPDX-License-Identifier: GPL-2.0-or-later
"""A client of the console that is a part of another connection, such as that of a page."""
from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable

from ..access import Who
from .console import Console

LINE_MOST = 256
TAKE = 16 << 10             # bytes at once
REST_MOST = 1024            # of a line that has no end
_END = re.compile(rb"\r\n|\r(?=.)|\n", re.S)       # a CR at the end may be half of one


class Talk:
    """Belongs to the event loop's thread."""

    def __init__(self, console: Console, who: Who, address: str, tell: Callable[[list[str]], Awaitable[None]]) -> None:
        """``tell`` takes lines, and waits for room; ConnectionResetError if nobody takes any more."""
        self._console, self._tell = console, tell
        self.client = console.client("page", who.name or address, LINE_MOST, address)
        if who.name:
            self.client.who = who
        self._some = asyncio.Event()
        self.client.outbox.on_put = self._some.set
        self._telling = asyncio.get_running_loop().create_task(self._go())

    def send(self, line: str) -> None:
        """A line for the machine."""
        self.client.receive(line.encode() + b"\n", asyncio.get_running_loop().time())

    @property
    def may_send(self) -> bool:
        """Its lines go to the machine."""
        return self._console.may_send(self.client)

    def close(self) -> None:
        """It is gone: what it has sent and what waits is not carried out."""
        self._telling.cancel()
        self._console.router.leave(self.client, at_once=True)

    async def _go(self) -> None:
        rest = b""
        while True:
            await self._some.wait()
            self._some.clear()
            while messages := self.client.outbox.take(TAKE):
                data = rest + b"".join(message.data for message in messages)
                for message in messages:
                    message.release()
                *lines, rest = _END.split(data)
                if len(rest) > REST_MOST:
                    lines, rest = [*lines, rest], b""
                try:
                    if lines:
                        await self._tell([line.decode("utf-8", "replace") for line in lines])
                except ConnectionResetError:
                    return
