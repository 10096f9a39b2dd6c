# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC, operated through pokeys-remote(1) of its session.

Each client that operates has a connection of its own to pokeys-remote, and it ends with the client: then
pokeys-remote stops what the client jogs. A stop gets one more connection, so nothing is ever before it.
"""
from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import Awaitable, Callable
from typing import Any

METHODS = ("mode", "mdi", "run", "pause", "resume", "home", "override", "jog", "subscribe")
STOPS = ("stop", "emergency_stop")
LINE_MOST = 4096            # bytes of a request
ANSWER_S = 2.0              # pokeys-remote answers at once
UNDER_WAY_MOST = 64


class NotDone(Exception):
    """It was not done, and why."""


class Operator:
    """One client's."""

    def __init__(self, proxy: str, tell: Callable[[dict[str, Any]], Awaitable[None]]) -> None:
        """``tell`` takes notifications for the client, and waits while the client has no room for them."""
        self._proxy, self._tell = proxy, tell
        self._writer: asyncio.StreamWriter | None = None
        self._reading: asyncio.Task[None] | None = None
        self._number = 0
        self._asked: dict[int, asyncio.Future[None]] = {}
        self._commands: dict[int, Any] = {}         # ids of the client by ours, until they are done

    async def ask(self, method: str, params: dict[str, Any], identity: Any) -> None:
        """Until pokeys-remote has taken it. :class:`NotDone`."""
        if method in STOPS:
            await _once(self._proxy, method, params)
            return
        if len(self._asked) + len(self._commands) >= UNDER_WAY_MOST:
            raise NotDone(f"{UNDER_WAY_MOST} commands are under way, which is the most")
        self._number += 1
        number = self._number
        line = _line(number, method, params)
        if not self._writer:
            await self._connect()
        assert self._writer
        answer = self._asked[number] = asyncio.get_running_loop().create_future()
        if method != "subscribe":
            self._commands[number] = identity
        try:
            self._writer.write(line)
            await asyncio.wait_for(answer, ANSWER_S)
        except TimeoutError:
            # what it was asked for must not happen later
            self.close()
            await self._lost("does not answer")
            raise NotDone(f"{self._proxy} does not answer") from None
        except NotDone:
            self._commands.pop(number, None)
            raise
        finally:
            self._asked.pop(number, None)

    async def _connect(self) -> None:
        reader, self._writer = await _connect(self._proxy)
        self._reading = asyncio.get_running_loop().create_task(self._read(reader, self._writer))

    async def _read(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while line := await reader.readline():
                said = json.loads(line)
                if said.get("method") == "linuxcnc.done":
                    said["params"]["id"] = self._commands.pop(said["params"]["id"], None)
                if "method" in said:
                    await self._tell(said)
                elif (answer := self._asked.get(said["id"])) and not answer.done():
                    _settle(answer, said)
        except (OSError, ValueError):
            pass                    # as if it had ended
        finally:
            writer.close()
            if self._writer is writer:
                self._writer = None
                self._forget()
        await self._lost("has ended")

    async def _lost(self, how: str) -> None:
        """The client gets no more of LinuxCNC's state until it subscribes again."""
        with contextlib.suppress(OSError):
            await self._tell({"jsonrpc": "2.0", "method": "linuxcnc.state", "params": {
                "connected": False, "why": f"{self._proxy} {how}"}})

    def _forget(self) -> None:
        self._commands.clear()
        for answer in self._asked.values():
            if not answer.done():
                answer.set_exception(NotDone(f"{self._proxy} has ended"))

    def close(self) -> None:
        """The client is gone: its commands that wait are dropped, and what it jogs stops."""
        if self._reading:
            self._reading.cancel()
        if self._writer:
            self._writer.close()
            self._writer = None
        self._forget()


def _settle(answer: asyncio.Future[None], said: dict[str, Any]) -> None:
    if "error" in said:
        answer.set_exception(NotDone(said["error"]["message"]))
    else:
        answer.set_result(None)


def _line(number: int, method: str, params: dict[str, Any]) -> bytes:
    asked = {"jsonrpc": "2.0", "id": number, "method": f"linuxcnc.{method}", "params": params}
    line = json.dumps(asked).encode() + b"\n"
    if len(line) > LINE_MOST:
        raise NotDone("the request is too long")
    return line


async def _connect(proxy: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    try:
        return await asyncio.wait_for(asyncio.open_unix_connection(f"\0pokeys-remote/{proxy}"), ANSWER_S)
    except TimeoutError:
        raise NotDone(f"{proxy} does not answer") from None
    except OSError:
        raise NotDone(f"{proxy} does not run; a HAL file of LinuxCNC starts it by loadusr -W pokeys-remote") from None


async def _once(proxy: str, method: str, params: dict[str, Any]) -> None:
    reader, writer = await _connect(proxy)
    try:
        writer.write(_line(1, method, params))
        said = json.loads(await asyncio.wait_for(reader.readline(), ANSWER_S) or b"{}")
    except (TimeoutError, OSError, ValueError):
        raise NotDone(f"{proxy} does not answer") from None
    finally:
        writer.close()
    if "result" not in said:
        raise NotDone(said.get("error", {}).get("message", f"{proxy} does not answer"))
