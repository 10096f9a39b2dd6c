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
import os
import socket
import ssl
import struct
import time
from collections import Counter
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .config import Endpoint

CONNECTIONS_MOST = 512
OF_AN_ADDRESS = 32          # but not of this computer, on which a proxy may be
REQUEST_S, ANSWER_S, IDLE_S = 10.0, 60.0, 30.0
RATE, BURST = 64 * 1024, 512 * 1024     # bytes a second that are read, after so many at once
BITE = 4 * 1024             # of them are parsed before others have their turn
CLOSE_S = 1.0
ACCEPTS, BACKLOG = 2, 128       # connections taken in a turn, and those that wait in the kernel
PIPELINED_MOST, BUSY_S = 8, 0.02        # requests that wait; when to look again
LOG_S = 10.0
REFUSAL = (b"HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nRetry-After: 10\r\nContent-Type: text/plain\r\n"
           b"Content-Length: 21\r\n\r\ntoo many connections\n")
_LOG = logging.getLogger("pokeys-gateway")


def plain(address: str) -> str:
    """An address without an interface, and as IPv4 if it is one. ValueError."""
    found = ipaddress.ip_address(address.partition("%")[0])
    return str(getattr(found, "ipv4_mapped", None) or found)


def is_loopback(address: str) -> bool:
    """Is it of this computer?"""
    try:
        return ipaddress.ip_address(plain(address)).is_loopback
    except ValueError:
        return False


def exact(address: str) -> str:
    """The address as it is compared: of two that write the same one differently. Of no address: as it is."""
    try:
        return plain(address)
    except ValueError:
        return address


def host_of(address: str) -> str:
    """What counts as one client: with IPv6, a host has a whole network of addresses."""
    try:
        found = ipaddress.ip_address(plain(address))
    except ValueError:
        return address
    return str(found) if found.version == 4 else str(ipaddress.ip_network((found, 64), strict=False))


def listener(where: Endpoint) -> socket.socket:
    """A socket for an address. OSError, which names it."""
    family, kind, protocol, _, address = socket.getaddrinfo(
        where.host, where.port, type=socket.SOCK_STREAM, flags=socket.AI_NUMERICHOST | socket.AI_PASSIVE)[0]
    one = socket.socket(family, kind | socket.SOCK_CLOEXEC | socket.SOCK_NONBLOCK, protocol)
    try:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            one.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
        one.bind(address)
        return one
    except OSError as error:
        one.close()
        raise OSError(error.errno, f"{where}: {os.strerror(error.errno or 0)}") from error


async def serve(make: Callable[[], asyncio.BaseProtocol], one: socket.socket) -> asyncio.Server:
    """Take connections of a socket; of many that come at once, a few in a turn of the event loop. OSError."""
    # asyncio takes as many at once as it lets wait
    server = await asyncio.get_running_loop().create_server(make, sock=one, backlog=ACCEPTS)
    one.listen(BACKLOG)
    return server


def cut(transport: Any) -> None:
    """End a connection at once: the kernel, too, forgets what the other side has not taken."""
    with contextlib.suppress(OSError, AttributeError):
        transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    transport.abort()


class _Connection(asyncio.Protocol):
    """One connection; hands everything on to aiohttp's protocol."""

    def __init__(self, gate: Gate, loopback: bool, tls: ssl.SSLContext | None) -> None:
        self._gate = gate
        self.loopback = loopback
        self._tls = tls
        self._shaking: asyncio.Task[None] | None = None        # hands
        self._inner: Any = None
        self._credit, self._at = float(BURST), 0.0
        self._rest = bytearray()    # what was read and is not parsed yet
        self._pause: asyncio.Handle | None = None      # ends it
        self.transport: Any = None
        self.address = ""
        self.until: float | None = None         # when what comes next has to be there; None: whenever
        self.unready: Callable[[], bool] = lambda: False       # who reads a stream has enough to do

    def connection_made(self, transport: Any) -> None:
        self.transport = transport
        self.address = str((transport.get_extra_info("peername") or ("",))[0])
        if not self._gate.admit(self):
            if not self._tls:
                transport.write(REFUSAL)
            transport.close()
            return
        self._at = self._gate.clock()
        self.until = self._at + REQUEST_S
        if self._tls:
            # only now, as each takes memory
            transport.pause_reading()
            self._shaking = asyncio.get_running_loop().create_task(self._shake(transport, self._tls))
        else:
            self._begin()

    async def _shake(self, plain_transport: Any, tls: ssl.SSLContext) -> None:
        try:
            transport = await asyncio.get_running_loop().start_tls(
                plain_transport, self, tls, server_side=True, ssl_handshake_timeout=REQUEST_S,
                ssl_shutdown_timeout=CLOSE_S)
        except (OSError, asyncio.CancelledError):
            transport = None
        if not transport or plain_transport.is_closing():
            self._gate.leave(self)
            cut(plain_transport)
            return
        self._gate.moved(self, transport)
        self._begin()

    def _begin(self) -> None:
        self._inner = self._gate.make()
        self._inner.connection_made(self.transport)
        if self._rest:
            self._parse()

    def data_received(self, data: bytes) -> None:
        if not self._inner and not self._shaking:
            return
        now = self._gate.clock()
        self._credit = min(BURST, self._credit + (now - self._at) * self._gate.rate) - len(data)
        self._at = now
        self._rest += data
        if not self._inner:
            return          # it has come with the last of the handshake
        if self._pause:
            self.transport.pause_reading()      # aiohttp has ended a pause of ours
        else:
            self._parse()

    def _parse(self) -> None:
        bite = bytes(self._rest[:BITE])
        del self._rest[:BITE]
        try:
            self._inner.data_received(bite)
        except Exception:
            # called by a timer, nobody else would end it
            _LOG.exception("parsing what a client has sent")
            self._rest.clear()
            cut(self.transport)
            return
        wait = 0 if self._rest else BUSY_S if self._busy() else max(0.0, -self._credit / self._gate.rate)
        if self._rest or wait:
            self.transport.pause_reading()
            self._pause = asyncio.get_running_loop().call_later(wait, self._read_on)

    def _busy(self) -> bool:
        """What has been parsed waits. aiohttp limits the bytes of it, but neither requests nor empty frames."""
        return getattr(self._inner, "_reading_paused", False) or self.unready() or \
            len(getattr(self._inner, "_messages", ())) >= PIPELINED_MOST

    def _read_on(self) -> None:
        self._pause = None
        if self.transport.is_closing():
            return
        if self._busy():
            self._pause = asyncio.get_running_loop().call_later(BUSY_S, self._read_on)
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
        if self._shaking and not self._inner:
            self._shaking.cancel()
        self._gate.leave(self)
        if self._inner:
            self._inner.connection_lost(exc)


class Gate:
    """All connections of the HTTP door. Belongs to the event loop's thread."""

    def __init__(self, proxies: tuple[str, ...] = (), clock: Callable[[], float] = time.monotonic,
                 rate: int = RATE) -> None:
        """`rate`: bytes a second that are read of a connection."""
        self.clock = clock
        self.rate = rate
        self._proxies = frozenset(map(exact, proxies))     # not what counts as one client: neighbours are no proxy
        self.make: Callable[[], Any] = asyncio.Protocol     # aiohttp's protocol, when the door is open
        self.refused = 0
        self.late = 0               # connections that were closed because nothing came or was taken
        self._told, self._told_at = 0, -LOG_S
        self._connections: dict[Any, _Connection] = {}
        self._addresses: Counter[str] = Counter()

    def __call__(self, loopback: bool = True, tls: ssl.SSLContext | None = None) -> asyncio.Protocol:
        """A protocol for a new connection, to an address of the loopback interface or another."""
        return _Connection(self, loopback, tls)

    def __len__(self) -> int:
        return len(self._connections)

    def admit(self, one: _Connection) -> bool:
        """Is there room for it?"""
        near = one.loopback or exact(one.address) in self._proxies
        # behind a proxy, nobody comes past it
        if (self._proxies and not near) or len(self) >= CONNECTIONS_MOST or (
                self._addresses[host_of(one.address)] >= OF_AN_ADDRESS and not near):
            self.refused += 1
            return False
        self._connections[one.transport] = one
        self._addresses[host_of(one.address)] += 1
        return True

    def moved(self, one: _Connection, transport: Any) -> None:
        """It has another transport now."""
        del self._connections[one.transport]
        one.transport = transport
        self._connections[transport] = one

    def leave(self, one: _Connection) -> None:
        """It is gone, if it was ever there."""
        if not self._connections.pop(one.transport, None):
            return
        host = host_of(one.address)
        self._addresses[host] -= 1
        if not self._addresses[host]:
            del self._addresses[host]

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
                # the answer is still to be taken; aiohttp ends connections that are idle
                one.until, one.unready = self.clock() + ANSWER_S, lambda: False

    def took(self, transport: Any) -> None:
        """The client has taken a part of a long answer: the deadline begins again."""
        if (one := self._connections.get(transport)) and one.until is not None:
            one.until = self.clock() + ANSWER_S

    def stream(self, transport: Any, unready: Callable[[], bool]) -> None:
        """The answer goes on for ever; who sends it watches it, and says when no more is to be read."""
        if one := self._connections.get(transport):
            one.until, one.unready = None, unready

    def sweep(self) -> None:
        """End what is late, and tell what was refused."""
        now = self.clock()
        for one in [one for one in self._connections.values() if one.until is not None and one.until < now]:
            self.late += 1
            one.until = None
            cut(one.transport)
        if self.refused > self._told and now - self._told_at >= LOG_S:
            _LOG.warning("%d connections refused; %d are open", self.refused - self._told, len(self))
            self._told, self._told_at = self.refused, now

    async def watch(self) -> None:
        """Sweep for ever."""
        while True:
            await asyncio.sleep(1)
            try:
                self.sweep()
            except Exception:
                _LOG.exception("ending connections")
