# SPDX-License-Identifier: GPL-2.0-or-later
"""A serial port or a pseudoterminal that is open: what comes goes to its client, what waits for it is written."""
from __future__ import annotations

import asyncio
import contextlib
import errno
import fcntl
import os
import re
import termios

from ..console.client import Client

LINE_MOST = 1024            # of what comes
READ, SEND = 4096, 1024
FINISH_S = 0.3
UNPLUGGED = "unplugged"
_ENDS = re.compile(rb"\r\n|\r|\n")


class Link:
    """The file descriptor of a terminal, which does not block, and the client at its other end."""

    def __init__(self, client: Client, fd: int) -> None:
        self._fd = fd
        self._rest = b""
        self._over: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        self._reads = self._writes = False
        self._sending = False
        self._client = client
        self._client.on_room = self._listen
        self._client.outbox.on_put = self._send

    async def serve(self) -> str:
        """Until it ends; why it did."""
        loop = asyncio.get_running_loop()
        self._listen()
        self._send()
        try:
            return await self._over
        finally:
            loop.remove_reader(self._fd)
            loop.remove_writer(self._fd)

    async def finish(self) -> None:
        """Until what was taken to be sent is sent, for a moment."""
        loop = asyncio.get_running_loop()
        end = loop.time() + FINISH_S
        with contextlib.suppress(OSError):
            while loop.time() < end and (self._rest or any(fcntl.ioctl(self._fd, termios.TIOCOUTQ, bytes(4)))):
                await asyncio.sleep(0.01)

    def forget(self) -> int:
        """Send nothing of what is under way; how many lines that were, without those that the driver has."""
        lines = len(_ENDS.findall(self._rest))
        self._rest = b""
        # otherwise it would be sent, and closing the port would wait for it; the port may be gone
        with contextlib.suppress(OSError, termios.error):
            termios.tcflush(self._fd, termios.TCOFLUSH)
        return lines

    def fail(self, why: str) -> None:
        """It ends."""
        loop = asyncio.get_running_loop()
        loop.remove_reader(self._fd)
        loop.remove_writer(self._fd)
        if not self._over.done():
            self._over.set_result(why)

    def _listen(self) -> None:
        """Read again, as there is room."""
        if not self._reads and not self._over.done():
            self._reads = True
            asyncio.get_running_loop().add_reader(self._fd, self._read)

    def _read(self) -> None:
        try:
            data = os.read(self._fd, READ)
        except BlockingIOError:
            return
        except OSError as error:
            self.fail(UNPLUGGED if error.errno == errno.EIO else os.strerror(error.errno or 0))
            return
        if not data:
            self.fail(UNPLUGGED)
            return
        loop = asyncio.get_running_loop()
        self._client.receive(data, loop.time())
        if self._client.full:
            self._reads = False
            loop.remove_reader(self._fd)

    def _send(self) -> None:
        """Write what waits, as far as the terminal takes it."""
        if self._sending or self._writes or self._over.done():
            return
        # to take something makes room, and may put something there
        self._sending = True
        try:
            self._write()
        finally:
            self._sending = False

    def _write(self) -> None:
        outbox = self._client.outbox
        while self._rest or not outbox.empty:
            if not self._rest:
                messages = outbox.take(SEND)
                self._rest = b"".join(one.data for one in messages)
                for one in messages:
                    one.release()
            try:
                self._rest = self._rest[os.write(self._fd, self._rest):]
            except BlockingIOError:
                self._writes = True
                asyncio.get_running_loop().add_writer(self._fd, self._go_on)
                return
            except OSError as error:
                self.fail(os.strerror(error.errno or 0))
                return

    def _go_on(self) -> None:
        self._writes = False
        asyncio.get_running_loop().remove_writer(self._fd)
        self._send()
