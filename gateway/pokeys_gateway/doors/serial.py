# SPDX-License-Identifier: GPL-2.0-or-later
"""The machine behind a serial port: a printer, or grbl. A bridge between the port and the console.

A port that is not there, or has gone, is looked for again and again under the same name, such as
/dev/serial/by-id/..., which stays the same wherever it is plugged in. What waited for it is not sent to
it when it comes back: it may have been switched on a moment ago.
"""
from __future__ import annotations

import asyncio
import errno
import logging
import os
import termios
from pathlib import Path
from typing import Any

from ..aside import aside
from ..config import Config
from ..console.console import Console
from .link import LINE_MOST, Link

SWITCHED_OFF = "given free by [ESP900]DISABLE, until [ESP900]ENABLE"
RETRY_S = 1.0
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
        self._link: Link | None = None

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
        machine = self._console.machine(str(self.path), LINE_MOST)
        self._link = link = Link(machine, port.fd)
        machine.on_stop = lambda: {None: link.forget()}
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
            _LOG.warning("%s%s", text, f"; trying again every {RETRY_S:.0f} s" if self.enabled else "")

    async def close(self) -> None:
        """Let it go; what is on its way to it has a moment."""
        if self._link:
            await self._link.finish()
        if self._task:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
