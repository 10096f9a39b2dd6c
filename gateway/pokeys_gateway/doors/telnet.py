# SPDX-License-Identifier: GPL-2.0-or-later
"""Telnet, or a plain TCP socket: any number of clients up to a limit, each with a queue of its own.

A client that negotiates is a network virtual terminal (RFC 854): its lines end in CR LF, both ways, and the
byte 255 is doubled. To one that does not, the bytes go as they are, so that programs and tunnels can use
the same port. All options are refused; whoever needs them does without.
"""
from __future__ import annotations

import asyncio
import contextlib
import enum
import logging
import re
import socket
from collections import Counter

from ..config import Endpoint
from ..console.client import Client
from ..console.console import Console
from ..gate import cut, host_of, is_loopback, listener, serve

LINE_MOST = 1200
READ, SEND = 4096, 16 << 10
SNDBUF = RCVBUF = 32 << 10          # lines in the kernel cannot be stopped
CLIENTS_MOST, OF_AN_ADDRESS, RESERVED = 64, 16, 16      # the last are for this computer, which may have all
LOG_IN_S = 60.0             # for who may not even read
BLOCKED_S = 60.0            # a client that takes nothing for so long is closed
STUCK_S = 900.0             # lines of a client that sends no more wait for the machine, as long as it takes some
GOODBYE_S, ANSWERS_S = 2.0, 30.0        # for answers, when a client sends no more
REPLIES_MOST = 4096
POLL_S, WATCH_S = 0.05, 0.5
TCP_CLOSE = 7               # in tcp_info: reset (linux/tcp.h)
IAC, DONT, DO, WONT, WILL, SB, AYT, SE = 255, 254, 253, 252, 251, 250, 246, 240
HERE = b"\r\n[yes]\r\n"
_ENDS = re.compile(rb"\r\n|\r|\n")
_ENCODED = {b"\r\n": b"\r\n", b"\n": b"\r\n", b"\r": b"\r\0"}
# a page of any site can make a browser send this, with lines for the machine in its body
_HTTP, _HTTP_BEGINS = re.compile(rb"[A-Z]+ \S+ HTTP/"), re.compile(rb"[A-Z]{1,16}(?: [^\r\n]*)?")
HTTP_ANSWER = (b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\nContent-Type: text/plain\r\n\r\n"
               b"this port is for telnet\n")
_LOG = logging.getLogger("pokeys-gateway")


class _State(enum.Enum):
    DATA = enum.auto()
    CR = enum.auto()
    COMMAND = enum.auto()
    OPTION = enum.auto()
    SUBNEGOTIATION = enum.auto()
    END = enum.auto()


class Terminal:
    """The bytes of one connection, both ways. Pure."""

    def __init__(self) -> None:
        self.virtual = False        # it has negotiated
        self.replies = bytearray()  # to be sent
        self._state = _State.DATA
        self._verb = 0
        self._cr = False            # without a negotiation: the last byte was CR

    def decode(self, data: bytes) -> bytes:
        """The data in what has come."""
        if not self.virtual:
            data = self._without_padding(data)
        if not self.virtual and IAC not in data and self._state is _State.DATA:
            return data
        found = bytearray()
        for byte in data:
            self._take(byte, found)
        return bytes(found)

    def _without_padding(self, data: bytes) -> bytes:
        """telnet sends CR NUL for CR, also if it has not negotiated: M112 behind it would be no stop."""
        if self._cr and data.startswith(b"\0"):
            data = data[1:]
        self._cr = data.endswith(b"\r")
        return data.replace(b"\r\0", b"\r")

    def encode(self, data: bytes) -> bytes:
        """What is sent for data."""
        if not self.virtual:
            return data
        return _ENDS.sub(lambda found: _ENCODED[found[0]], data.replace(b"\xff", b"\xff\xff"))

    def _take(self, byte: int, found: bytearray) -> None:
        state, self._state = self._state, _State.DATA
        if state is _State.CR:
            if byte in b"\n\0":
                found += b"\n" if byte == 10 else b"\r"
                return
            found += b"\r"
            state = _State.DATA
        if state is _State.DATA:
            if byte == IAC:
                self._state = _State.COMMAND
            elif byte == 13 and self.virtual:
                self._state = _State.CR
            else:
                found.append(byte)
        elif state is _State.COMMAND:
            self._command(byte, found)
        elif state is _State.OPTION:
            self._refuse(byte)
        elif state is _State.SUBNEGOTIATION:
            self._state = _State.END if byte == IAC else state
        elif byte != SE:
            self._state = _State.SUBNEGOTIATION

    def _command(self, byte: int, found: bytearray) -> None:
        if byte == IAC and self.virtual:
            found.append(IAC)
        elif byte in (DO, DONT, WILL, WONT):
            self.virtual, self._verb, self._state = True, byte, _State.OPTION
        elif byte == SB:
            self.virtual, self._state = True, _State.SUBNEGOTIATION
        elif byte == AYT:
            self.replies += HERE
        elif not self.virtual:
            found += bytes((IAC, byte))     # no command: data of a plain socket

    def _refuse(self, option: int) -> None:
        # all are off; who switches one off asks for nothing
        if self._verb in (DO, WILL):
            self.replies += bytes((IAC, WONT if self._verb == DO else DONT, option))


class _Connection:
    """One client."""

    def __init__(self, console: Console, reader: asyncio.StreamReader, writer: asyncio.StreamWriter,
                 client: Client) -> None:
        self.client = client
        self._console, self._reader, self._writer = console, reader, writer
        self._socket: socket.socket = writer.get_extra_info("socket")
        self._terminal = Terminal()
        self._wake, self._room = asyncio.Event(), asyncio.Event()
        self._first: bytes | None = b""     # what has come of the first line; None: it is known to be no request
        self._sending = False
        self._sent_at = 0.0
        self.orderly = False        # it has sent all that it wanted, and nobody waits for it
        client.outbox.on_put = self._wake.set
        client.on_room = self._room.set

    async def serve(self) -> None:
        """Until it ends."""
        tasks = [asyncio.ensure_future(work) for work in (self._send(), self._read(), self._watch())]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            for found in await asyncio.gather(*tasks, return_exceptions=True):
                if isinstance(found, Exception) and not isinstance(found, OSError):
                    _LOG.error("%s", self.client, exc_info=found)

    async def _watch(self) -> None:
        """Until it is reset, which nobody notices who does not read, or has not logged in in time."""
        loop = asyncio.get_running_loop()
        until = loop.time() + LOG_IN_S
        while self._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 1)[0] != TCP_CLOSE:
            if loop.time() >= until and not self._console.level(self.client):
                self._writer.write(b"error: not logged in\n")
                return
            await asyncio.sleep(WATCH_S)

    def _beyond_request(self, data: bytes) -> bytes | None:
        """What is to be taken of what has come; None: nothing, as it is a request of HTTP."""
        if self._first is None:
            return data
        self._first += data
        if _HTTP.match(self._first):
            return None
        if len(self._first) < LINE_MOST and _HTTP_BEGINS.fullmatch(self._first):
            return b""      # it may become one
        data, self._first = self._first, None
        return data

    async def _read(self) -> None:
        loop = asyncio.get_running_loop()
        while data := await self._reader.read(READ):
            taken = self._beyond_request(self._terminal.decode(data))
            if taken is None:
                self._writer.write(HTTP_ANSWER)
                return
            if taken:
                self.client.receive(taken, loop.time())
            if self._terminal.replies:
                self._wake.set()
            while self.client.full:
                self._room.clear()
                await self._room.wait()
            while len(self._terminal.replies) >= REPLIES_MOST:
                await asyncio.sleep(POLL_S)
        await self._finish()

    async def _finish(self) -> None:
        """It sends no more, and may still read: what it has sent is carried out, and answered."""
        loop, client, router = asyncio.get_running_loop(), self.client, self._console.router
        if client.framer.begun or self._first:
            client.framer.cut_begun()
            router.tell(client, "error: not sent: the last line has no end")
        progress, since = -1, loop.time()
        while client.pending and loop.time() < since + STUCK_S:
            if progress != client.lines:
                progress, since = client.lines, loop.time()
            await asyncio.sleep(POLL_S)
        self._sent_at = loop.time()
        end = self._sent_at + ANSWERS_S
        while self._sending or not client.outbox.empty or loop.time() < min(end, self._sent_at + GOODBYE_S):
            await asyncio.sleep(POLL_S)
        self.orderly = True

    async def _send(self) -> None:
        outbox, terminal, writer = self.client.outbox, self._terminal, self._writer
        while True:
            while outbox.empty and not terminal.replies:
                self._sending = False
                self._wake.clear()
                await self._wake.wait()
            self._sending = True
            replies, messages = bytes(terminal.replies), outbox.take(SEND)
            terminal.replies.clear()
            try:
                writer.write(replies + b"".join(terminal.encode(one.data) for one in messages))
                if not await self._drain():
                    self._console.closed_slow += 1
                    cut(writer.transport)
                    return
                self._sent_at = asyncio.get_running_loop().time()
            finally:
                for one in messages:
                    one.release()

    async def _drain(self) -> bool:
        """Until there is room for more; False: the client takes nothing. OSError."""
        transport = self._writer.transport
        draining = asyncio.ensure_future(self._writer.drain())
        try:
            left = transport.get_write_buffer_size()
            while not (await asyncio.wait((draining,), timeout=BLOCKED_S))[0]:
                before, left = left, transport.get_write_buffer_size()
                if left >= before:
                    return False
            draining.result()
            return True
        finally:
            draining.cancel()


class Telnet:
    """The door. Belongs to the event loop's thread."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._servers: list[asyncio.Server] = []
        self._addresses: Counter[str] = Counter()
        self._serving: set[asyncio.Task[None]] = set()

    async def open(self, endpoints: tuple[Endpoint, ...], sockets: list[socket.socket]) -> list[str]:
        """Listen: on sockets that were inherited, or on new ones. Where. OSError."""
        for one in sockets or (listener(where) for where in endpoints):
            self._servers.append(await serve(self._protocol, one))
        return [f"telnet {host}:{port}" if ":" not in host else f"telnet [{host}]:{port}"
                for server in self._servers for host, port, *_ in (sock.getsockname() for sock in server.sockets)]

    def _protocol(self) -> asyncio.StreamReaderProtocol:
        return asyncio.StreamReaderProtocol(asyncio.StreamReader(limit=READ), self._accept)

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task
        self._serving.add(task)
        try:
            name = writer.get_extra_info("peername")
            if name:
                await self._admit(reader, writer, str(name[0]), f"{name[0]}:{name[1]}")
        except OSError:
            pass        # it is gone
        finally:
            self._serving.discard(task)
            writer.close()

    async def _admit(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, address: str, name: str) -> None:
        host, near, total = host_of(address), is_loopback(address), self._addresses.total()
        if total >= CLIENTS_MOST or (not near and (self._addresses[host] >= OF_AN_ADDRESS or
                                                   total >= CLIENTS_MOST - RESERVED)):
            self._console.refused += 1
            writer.write(b"error: too many clients are connected; try again later\n")
            return
        self._addresses[host] += 1
        try:
            await self._serve(reader, writer, name, address)
        finally:
            self._addresses[host] -= 1
            if not self._addresses[host]:
                del self._addresses[host]

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, name: str, address: str) -> None:
        peer: socket.socket = writer.get_extra_info("socket")
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SNDBUF)
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RCVBUF)
        # a peer without power would be there for ever
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        writer.transport.set_write_buffer_limits(high=SEND)
        client = self._console.client("telnet", name, LINE_MOST, address)
        client.here = str(peer.getsockname()[0])
        task = asyncio.current_task()
        assert task
        client.on_close = task.cancel  # type: ignore[assignment]
        connection = _Connection(self._console, reader, writer, client)
        try:
            await connection.serve()
        finally:
            self._console.router.leave(client, at_once=not connection.orderly)

    async def close(self) -> None:
        """Listen no more, and end all connections."""
        for server in self._servers:
            server.close()
        for task in self._serving:
            task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await asyncio.gather(*self._serving, return_exceptions=True)
