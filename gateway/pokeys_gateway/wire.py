# SPDX-License-Identifier: GPL-2.0-or-later
"""A connection to the control socket of pokeys-remote(1): JSON-RPC, a line for each message."""
from __future__ import annotations

import asyncio
import json
import socket
import time
from collections.abc import Awaitable, Callable
from typing import Any

LINE_MOST = 4096            # bytes of a request
HEARD_MOST = 1 << 20        # bytes of what pokeys-remote says
CONNECT_S, RETRY_S = 2.0, 0.02


class NotDone(Exception):
    """It was not done, and why."""


def encode(number: int, method: str, params: dict[str, Any]) -> bytes:
    """A request. :class:`NotDone` if it is too long."""
    asked = {"jsonrpc": "2.0", "id": number, "method": f"linuxcnc.{method}", "params": params}
    line = json.dumps(asked).encode() + b"\n"
    if len(line) > LINE_MOST:
        raise NotDone("the request is too long")
    return line


class Wire:
    """It is open until :attr:`ended`. Belongs to the event loop's thread."""

    def __init__(self, proxy: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter,
                 heard: Callable[[dict[str, Any]], Awaitable[None]], lost: Callable[[Wire], None]) -> None:
        self._proxy, self._reader, self._writer = proxy, reader, writer
        self._heard, self._lost = heard, lost
        self._answers: dict[int, asyncio.Future[None]] = {}
        self.ended = False
        self.why = f"{proxy} has ended"     # and why it ended
        self._reading = asyncio.get_running_loop().create_task(self._read())

    @classmethod
    async def open(cls, proxy: str, heard: Callable[[dict[str, Any]], Awaitable[None]],
                   lost: Callable[[Wire], None]) -> Wire:
        """``heard`` takes notifications, and nothing more is read meanwhile; ``lost`` is called once.

        :class:`NotDone` if there is no pokeys-remote.
        """
        end = time.monotonic() + CONNECT_S
        made = None
        try:
            made = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK)
            while True:
                try:
                    made.connect(f"\0pokeys-remote/{proxy}")
                    break
                except BlockingIOError:
                    # so many wait that the kernel takes no more; asyncio would take this for a connection
                    if time.monotonic() > end:
                        raise NotDone(f"{proxy} does not answer") from None
                    await asyncio.sleep(RETRY_S)
            return cls(proxy, *await asyncio.open_unix_connection(sock=made, limit=HEARD_MOST), heard, lost)
        except BaseException as error:
            if made:
                made.close()
            if isinstance(error, ConnectionRefusedError):
                raise NotDone(
                    f"{proxy} does not run; a HAL file of LinuxCNC starts it by loadusr -W pokeys-remote") from None
            if isinstance(error, OSError):
                raise NotDone(f"{proxy} cannot be reached: {error.strerror}") from None
            raise

    @property
    def unsent(self) -> bool:
        """Is there something that the kernel has not taken?"""
        return self._writer.transport.get_write_buffer_size() > 0

    def send(self, number: int, line: bytes) -> asyncio.Future[None]:
        """A request of this number; its answer, or :class:`NotDone`."""
        answer = asyncio.get_running_loop().create_future()
        if self.ended:
            answer.set_exception(NotDone(self.why))
        else:
            self._answers[number] = answer
            self._writer.write(line)
        # who has asked may be gone
        answer.add_done_callback(lambda done: done.cancelled() or done.exception())
        return answer

    async def _read(self) -> None:
        try:
            while line := await self._reader.readline():
                said = json.loads(line, parse_constant=lambda _: None)
                if "method" in said:
                    await self._heard(said)
                elif said.get("id") is None:
                    # it refuses the connection itself, and closes it
                    self.why = f"{self._proxy}: {said['error']['message']}"
                elif (answer := self._answers.pop(said["id"], None)) and not answer.done():
                    if "error" in said:
                        answer.set_exception(NotDone(said["error"]["message"]))
                    else:
                        answer.set_result(None)
        except OSError:
            pass                        # as if it had ended
        except (ValueError, LookupError, TypeError, AttributeError):
            self.why = f"what {self._proxy} says cannot be understood"
        finally:
            self.close(self.why)

    def close(self, why: str) -> None:
        """At once: what the kernel has not taken is not sent."""
        if self.ended:
            return
        self.ended, self.why = True, why
        self._reading.cancel()
        self._writer.transport.abort()
        for answer in self._answers.values():
            if not answer.done():
                answer.set_exception(NotDone(why))
        self._answers.clear()
        self._lost(self)
