# SPDX-License-Identifier: GPL-2.0-or-later
"""Connections, before there are requests: how many there may be, how slow and how fast.

aiohttp waits for ever for a request that does not end, and reads as fast as a client sends. This
stands between it and the socket: a connection has a deadline for what comes next, bytes that come
faster than any client of ours sends wait in the kernel, and there is a limit of connections.
"""
from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import logging
import socket
import struct
import time
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

CONNECTIONS_MOST = 512
OF_AN_ADDRESS = 32          # but not of this computer, on which a proxy may be
REQUEST_S, ANSWER_S, IDLE_S = 10.0, 60.0, 30.0
RATE, BURST = 64 * 1024, 512 * 1024     # bytes a second that are read, after so many at once
BITE = 8 * 1024             # of them are parsed before others have their turn
LOG_S = 10.0
REFUSAL = (b"HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nRetry-After: 10\r\nContent-Type: text/plain\r\n"
           b"Content-Length: 21\r\n\r\ntoo many connections\n")
_LOG = logging.getLogger("pokeys-gateway")


def cut(transport: Any) -> None:
    """End a connection at once: the kernel, too, forgets what the other side has not taken."""
    with contextlib.suppress(OSError):
        transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    transport.abort()


class _Connection(asyncio.Protocol):
    """One connection; hands everything on to aiohttp's protocol."""

    def __init__(self, gate: Gate) -> None:
        self._gate = gate
        self._inner: Any = None
        self._credit, self._at = float(BURST), 0.0
        self._rest = b""            # what was read and is not parsed yet
        self._pause: asyncio.Handle | None = None      # ends it
        self.transport: Any = None
        self.address = ""
        self.until: float | None = None         # when what comes next has to be there; None: whenever

    def connection_made(self, transport: Any) -> None:
        self.transport = transport
        self.address = str((transport.get_extra_info("peername") or ("",))[0])
        if not self._gate.admit(self):
            transport.write(REFUSAL)
            transport.close()
            return
        self._at = self._gate.clock()
        self.until = self._at + REQUEST_S
        self._inner = self._gate.make()
        self._inner.connection_made(transport)

    def data_received(self, data: bytes) -> None:
        if not self._inner:
            return
        now = self._gate.clock()
        self._credit = min(BURST, self._credit + (now - self._at) * RATE) - len(data)
        self._at = now
        # aiohttp may have ended a pause of ours, too early
        self._rest += data
        if not self._pause:
            self._parse()

    def _parse(self) -> None:
        data, self._rest = self._rest[:BITE], self._rest[BITE:]
        if self._rest or self._credit < 0:
            self.transport.pause_reading()
            self._pause = asyncio.get_running_loop().call_later(
                0 if self._rest else -self._credit / RATE, self._read_on)
        self._inner.data_received(data)

    def _read_on(self) -> None:
        self._pause = None
        if self.transport.is_closing():
            return
        if self._rest:
            self._parse()
        if not self._pause and not self.transport.is_closing():
            self.transport.resume_reading()

    def eof_received(self) -> bool | None:
        return bool(self._inner.eof_received()) if self._inner else None

    def pause_writing(self) -> None:
        if self._inner:
            self._inner.pause_writing()

    def resume_writing(self) -> None:
        if self._inner:
            self._inner.resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        if self._pause:
            self._pause.cancel()
        if self._inner:
            self._gate.leave(self)
            self._inner.connection_lost(exc)


class Gate:
    """All connections of the HTTP door. Belongs to the event loop's thread."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock = clock
        self.make: Callable[[], Any] = asyncio.Protocol     # aiohttp's protocol, when the door is open
        self.refused = 0
        self.late = 0               # connections that were closed because nothing came or was taken
        self._told, self._told_at = 0, -LOG_S
        self._connections: dict[Any, _Connection] = {}
        self._addresses: Counter[str] = Counter()

    def __call__(self) -> asyncio.Protocol:
        """A protocol for a new connection."""
        return _Connection(self)

    def __len__(self) -> int:
        return len(self._connections)

    def admit(self, one: _Connection) -> bool:
        """Is there room for it?"""
        if len(self) >= CONNECTIONS_MOST or (
                self._addresses[one.address] >= OF_AN_ADDRESS and not _is_here(one.address)):
            self.refused += 1
            return False
        self._connections[one.transport] = one
        self._addresses[one.address] += 1
        return True

    def leave(self, one: _Connection) -> None:
        """It is gone."""
        del self._connections[one.transport]
        self._addresses[one.address] -= 1
        if not self._addresses[one.address]:
            del self._addresses[one.address]

    @contextlib.contextmanager
    def request(self, transport: Any) -> Iterator[None]:
        """While a request is answered. A stream has no end: see :meth:`stream`."""
        one = self._connections.get(transport)
        if one:
            one.until = self.clock() + ANSWER_S
        try:
            yield
        finally:
            if one:
                # aiohttp ends connections that are idle; it does not if the answer is not taken
                one.until = self.clock() + IDLE_S + REQUEST_S

    def stream(self, transport: Any) -> None:
        """The answer goes on for ever; who sends it watches it."""
        if one := self._connections.get(transport):
            one.until = None

    def sweep(self) -> None:
        """End what is late, and tell what was refused."""
        now = self.clock()
        for one in [one for one in self._connections.values() if one.until is not None and one.until < now]:
            self.late += 1
            one.until = None
            cut(one.transport)
        if self.refused > self._told and now - self._told_at >= LOG_S:
            _LOG.warning("%d connections refused: there are %d", self.refused - self._told, len(self))
            self._told, self._told_at = self.refused, now

    async def watch(self) -> None:
        """Sweep for ever."""
        while True:
            await asyncio.sleep(1)
            self.sweep()


def _is_here(address: str) -> bool:
    try:
        return ipaddress.ip_address(address.partition("%")[0]).is_loopback
    except ValueError:
        return False
