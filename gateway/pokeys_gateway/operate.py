# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC, operated through pokeys-remote(1) of its session.

Each client that operates has a connection of its own to pokeys-remote, and it ends with the client: then
pokeys-remote stops what the client jogs. A stop gets one more connection, so nothing is ever before it.
"""
from __future__ import annotations

import asyncio
import contextlib
import functools
import json
from collections.abc import Awaitable, Callable
from typing import Any

METHODS = ("mode", "mdi", "run", "pause", "resume", "home", "override", "jog", "subscribe")
STOPS = ("stop", "emergency_stop")
LINE_MOST = 4096            # bytes of a request
ANSWER_S = 2.0              # pokeys-remote answers at once
UNDER_WAY_MOST = 64
OPERATORS_MOST = 32         # clients; pokeys-remote has twice as many places, for their stops


class NotDone(Exception):
    """It was not done, and why."""


class Operator:
    """One client's. Its commands keep their order, however many callers wait for answers."""

    _connected = 0              # of all clients

    def __init__(self, proxy: str, tell: Callable[[dict[str, Any]], Awaitable[None]]) -> None:
        """``tell`` takes notifications for the client, and waits while the client has no room for them."""
        self._proxy, self._tell = proxy, tell
        self._writer: asyncio.StreamWriter | None = None
        self._reading: asyncio.Task[None] | None = None
        self._number = 0
        self._order = asyncio.Lock()
        self._stops: dict[str, asyncio.Task[None]] = {}
        self._asked: dict[int, asyncio.Future[None]] = {}
        self._commands: dict[int, Any] = {}         # ids of the client by ours, until they are done

    async def ask(self, method: str, params: dict[str, Any], identity: Any) -> None:
        """Until pokeys-remote has taken it. :class:`NotDone`."""
        if method in STOPS:
            await self._stop(method, params)
            return
        if len(self._asked) + len(self._commands) >= UNDER_WAY_MOST:
            raise NotDone(f"{UNDER_WAY_MOST} commands are under way, which is the most")
        self._number += 1
        number = self._number
        line = _line(number, method, params)
        answer = self._asked[number] = asyncio.get_running_loop().create_future()
        if method != "subscribe":
            self._commands[number] = identity
        try:
            async with self._order:
                writer = self._writer or await self._connect()
                writer.write(line)
            await asyncio.wait_for(answer, ANSWER_S)
        except TimeoutError:
            # what it was asked for must not happen later
            self.close("does not answer")
            await self._lost("does not answer")
            raise NotDone(f"{self._proxy} does not answer") from None
        except NotDone:
            self._commands.pop(number, None)
            raise
        finally:
            self._asked.pop(number, None)

    async def _stop(self, method: str, params: dict[str, Any]) -> None:
        """One that is under way serves whoever asks for it again."""
        if method not in self._stops:
            self._stops[method] = asyncio.get_running_loop().create_task(_once(self._proxy, method, params))
            self._stops[method].add_done_callback(functools.partial(self._stop_done, method))
        # it goes on if this caller is gone
        await asyncio.shield(self._stops[method])

    def _stop_done(self, method: str, task: asyncio.Task[None]) -> None:
        del self._stops[method]
        if not task.cancelled():
            task.exception()            # who asked may be gone

    async def _connect(self) -> asyncio.StreamWriter:
        if Operator._connected >= OPERATORS_MOST:
            raise NotDone(f"{OPERATORS_MOST} clients operate already, which is the most")
        reader, writer = await _connect(self._proxy)
        Operator._connected += 1
        self._writer = writer
        self._reading = asyncio.get_running_loop().create_task(self._read(reader, writer))
        self._reading.add_done_callback(self._disconnected)
        return writer

    @staticmethod
    def _disconnected(_task: asyncio.Task[None]) -> None:
        Operator._connected -= 1

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
                self._forget("has ended")
        await self._lost("has ended")

    async def _lost(self, how: str) -> None:
        """The client gets no more of LinuxCNC's state until it subscribes again."""
        with contextlib.suppress(OSError):
            await self._tell({"jsonrpc": "2.0", "method": "linuxcnc.state", "params": {
                "connected": False, "why": f"{self._proxy} {how}"}})

    def _forget(self, why: str) -> None:
        self._commands.clear()
        for answer in self._asked.values():
            if not answer.done():
                answer.set_exception(NotDone(f"{self._proxy} {why}"))

    def close(self, why: str = "has ended") -> None:
        """End the connection: commands that wait are dropped, and what the client jogs stops."""
        if self._reading:
            self._reading.cancel()
        if self._writer:
            self._writer.close()
            self._writer = None
        self._forget(why)


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
