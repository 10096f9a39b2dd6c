# SPDX-License-Identifier: GPL-2.0-or-later
"""A pseudoterminal for a program that wants a serial port, such as OctoPrint: a client of the console.

Whoever may open it may send. It is one client, whatever opens it; while nobody has it open, it is none.
"""
from __future__ import annotations

import asyncio
import contextlib
import errno
import fcntl
import grp
import logging
import os
import select
import tty
from pathlib import Path

from ..access import LEVELS
from ..console.console import Console
from .link import LINE_MOST, Link

LOOK_S = 0.1
TERMINALS = "/dev/pts/"
_LOG = logging.getLogger("pokeys-gateway")


def _give(terminal: int, group: str) -> None:
    """To a group. OSError, KeyError."""
    try:
        os.fchown(terminal, -1, grp.getgrnam(group).gr_gid)
    except OSError as error:
        why = os.strerror(error.errno or 0)
        raise OSError(error.errno, f"[pty] group: {group}: {why}; the gateway's user has to be in this group "
                                   "(SupplementaryGroups= and PrivateUsers=no of the service)") from None


class Pty:
    """The door. Belongs to the event loop's thread."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._path: Path | None = None
        self._fd = self._lock = -1
        self._task: asyncio.Task[None] | None = None

    def open(self, path: Path, group: str | None) -> str:
        """Make it, and a link to it; where. OSError, KeyError for a group that is not there."""
        self._fd, other = os.openpty()
        try:
            tty.setraw(other)
            os.fchmod(other, 0o660 if group else 0o600)
            if group:
                _give(other, group)
            os.set_blocking(self._fd, False)
            self._link(path, os.ttyname(other))
        finally:
            os.close(other)
        self._path = path
        self._task = asyncio.ensure_future(self._run())
        return f"pseudoterminal {path}"

    def _link(self, path: Path, name: str) -> None:
        """Make a link. That of a gateway that was killed is replaced, and nothing else. OSError."""
        self._lock = os.open(path.with_name(f".{path.name}.lock"), os.O_CREAT | os.O_WRONLY | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise OSError(errno.EBUSY, f"[pty] path: another gateway has {path}") from None
        if path.is_symlink():
            if not (to := str(path.readlink())).startswith(TERMINALS):
                raise FileExistsError(errno.EEXIST, f"[pty] path: {path} is a link to {to}, and is not replaced")
        elif path.exists():
            raise FileExistsError(errno.EEXIST, f"[pty] path: {path} is there, and is not replaced")
        new = path.with_name(f".{path.name}.new")
        new.unlink(missing_ok=True)
        new.symlink_to(name)
        new.replace(path)

    async def _run(self) -> None:
        poll = select.poll()
        poll.register(self._fd, 0)
        while True:
            # it hangs up as long as nobody has it open
            while poll.poll(0):
                await asyncio.sleep(LOOK_S)
            client = self._console.client("pty", str(self._path), LINE_MOST, "127.0.0.1", at_least=LEVELS[1])
            link = Link(client, self._fd)
            client.on_close = lambda link=link: link.fail("closed")     # type: ignore[misc]
            try:
                await link.serve()
                # the program has ended: what it has sent is carried out
                while client.pending and poll.poll(0):
                    await asyncio.sleep(LOOK_S)
            except Exception:
                _LOG.exception("%s", self._path)
            finally:
                link.forget()
                self._console.router.leave(client)

    async def close(self) -> None:
        """Nobody can open it any more."""
        if self._task:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        if self._path:
            with contextlib.suppress(OSError):
                self._path.unlink()
        if self._lock >= 0:
            os.close(self._lock)
        if self._fd >= 0:
            os.close(self._fd)
