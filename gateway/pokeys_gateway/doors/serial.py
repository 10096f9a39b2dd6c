# SPDX-License-Identifier: GPL-2.0-or-later
"""The machine behind a serial port: a printer, or grbl. A bridge between the port and the console.

A port that is not there, or has gone, is looked for again and again under the same name, such as
/dev/serial/by-id/..., which stays the same wherever it is plugged in. What waited for it is not sent to
it when it comes back: it may have been switched on a moment ago.
"""
from __future__ import annotations

import asyncio
import contextlib
import errno
import fcntl
import logging
import os
import re
import termios
from pathlib import Path
from typing import Any

from ..aside import aside
from ..config import Config
from ..console.client import Client
from ..console.console import Console

LINE_MOST = 1024
READ = 4096
SEND = 1024
SWITCHED_OFF = "given free by [ESP900]DISABLE"
RETRY_S, FINISH_S = 1.0, 0.3
_ENDS = re.compile(rb"\r\n|\r|\n")
_LOG = logging.getLogger("pokeys-gateway")


class NoSerial(Exception):
    """pyserial is missing."""


def library() -> Any:
    """pyserial. :class:`NoSerial`."""
    try:
        import serial
    except ImportError:
        raise NoSerial("[machine] port: pyserial is not installed (Debian: python3-serial)") from None
    return serial


def _reason(error: Exception) -> str:
    """In words; pyserial repeats name and number in its text."""
    number = getattr(error, "errno", None)
    if number in (errno.EAGAIN, errno.EBUSY):
        return "another program has opened it"
    if number in (errno.EACCES, errno.EPERM):
        return f"{os.strerror(number)}; the gateway's user has to be in its group, which is usually dialout"
    return os.strerror(number) if number else str(error)


class Port:
    """The port, and the machine behind it. Belongs to the event loop's thread."""

    def __init__(self, console: Console, path: Path, config: Config) -> None:
        self._console = console
        self.path, self._baud, self._flow_control = path, config.machine_baud, config.machine_flow_control
        self._enabled = asyncio.Event()
        self._enabled.set()
        self._serial = library()
        self._task: asyncio.Task[None] | None = None
        self._told = ""
        self._link: _Link | None = None

    @property
    def enabled(self) -> bool:
        """Is it used?"""
        return self._enabled.is_set()

    def enable(self, on: bool) -> None:
        """Use it, or give it free for another program."""
        if on:
            self._enabled.set()
        else:
            self._enabled.clear()
            if self._link:
                self._link.fail(SWITCHED_OFF)

    def open(self) -> None:
        """Begin to look for it."""
        self._console.commands.port = self
        self._console.router.disconnect(f"{self.path} is not there yet")
        self._task = asyncio.ensure_future(self._run())

    def _try(self) -> Any:
        """Open it; in another thread, as a driver may take seconds. OSError, ValueError, termios.error."""
        port = self._serial.Serial(str(self.path), self._baud, timeout=0, exclusive=True,
                                   rtscts=self._flow_control == "hardware", xonxoff=self._flow_control == "software")
        # pyserial has 0 there, and then reading gives nothing both if nothing has come and if the port has gone
        settings = termios.tcgetattr(port.fd)
        settings[6][termios.VMIN] = 1
        termios.tcsetattr(port.fd, termios.TCSANOW, settings)
        return port

    async def _run(self) -> None:
        while True:
            if not self.enabled:
                self._console.router.why_no_machine = f"{self.path}: {SWITCHED_OFF}"
                await self._enabled.wait()
            try:
                await self._connect()
            except (OSError, ValueError, termios.error) as error:
                self._say(f"{self.path}: {_reason(error)}")
                self._console.router.why_no_machine = self._told
            except Exception:
                _LOG.exception("%s", self.path)
            await asyncio.sleep(RETRY_S)

    async def _connect(self) -> None:
        """Open it, and pass on what comes until it has gone. OSError, ValueError, termios.error."""
        port = await aside(self._try)
        self._console.connections += 1
        self._told = ""
        _LOG.info("%s: connected, %d baud", self.path, self._baud)
        self._console.router.tell_all("[machine connected]")
        self._link = _Link(self._console, str(self.path), port.fd)
        why = ""
        try:
            why = await self._link.serve()
        finally:
            lost = self._link.forget()
            self._link = None
            if why:
                self._say(f"{self.path}: {why}")
            lost += self._console.router.disconnect(self._told)
            self._console.router.tell_all(f"[machine disconnected: {why}; lines not sent: {lost}]")
            # a driver may take its time
            closing = aside(port.close)
        await closing

    def _say(self, text: str) -> None:
        """Log it, once."""
        if text != self._told:
            self._told = text
            _LOG.warning("%s; trying again every %.0f s", text, RETRY_S)

    async def close(self) -> None:
        """Let it go; what is on its way to it has a moment."""
        if self._link:
            await self._link.finish()
        if self._task:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)


class _Link:
    """A port that is open."""

    def __init__(self, console: Console, name: str, fd: int) -> None:
        self._fd = fd
        self._rest = b""
        self._over: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        self._reads = self._writes = False
        self._client: Client = console.machine(name, LINE_MOST)
        self._client.on_room = self._listen
        self._client.outbox.on_put = self._send
        self._client.on_stop = self.forget

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
            self.fail("unplugged" if error.errno == errno.EIO else os.strerror(error.errno or 0))
            return
        if not data:
            self.fail("unplugged")
            return
        loop = asyncio.get_running_loop()
        self._client.receive(data, loop.time())
        if self._client.full:
            self._reads = False
            loop.remove_reader(self._fd)

    def _send(self) -> None:
        """Write what waits, as far as the port takes it."""
        if self._writes or self._over.done():
            return
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
