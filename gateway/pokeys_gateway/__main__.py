# SPDX-License-Identifier: GPL-2.0-or-later
"""The command line of pokeys-gateway(8), and its life."""
from __future__ import annotations

import argparse
import asyncio
import contextlib
import logging
import os
import signal
import socket
import sys
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import pokeys

from . import __version__, config, model
from .doors.http import Http
from .hub import Hub

PROGRAM = "pokeys-gateway"
STATUS_FAILED, STATUS_USAGE, STATUS_CONFIG = 1, 64, 78      # sysexits.h
FIRST_SOCKET = 3            # sd_listen_fds(3)
_LEVELS = {logging.DEBUG: 7, logging.INFO: 6, logging.WARNING: 4, logging.ERROR: 3, logging.CRITICAL: 2}
_LOG = logging.getLogger(PROGRAM)


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        print(f"{PROGRAM}: {message}; {PROGRAM} --help lists the options", file=sys.stderr)
        sys.exit(STATUS_USAGE)


class _Formatter(logging.Formatter):
    """Under systemd a line begins with its level, as sd-daemon(3) wants it."""

    def __init__(self) -> None:
        super().__init__(f"{PROGRAM}: %(message)s")
        status = os.fstat(sys.stderr.fileno())
        self._journal = os.environ.get("JOURNAL_STREAM") == f"{status.st_dev}:{status.st_ino}"

    def format(self, record: logging.LogRecord) -> str:
        text = super().format(record)
        return f"<{_LEVELS.get(record.levelno, 5)}>{text}" if self._journal else text


def _options(words: list[str]) -> argparse.Namespace:
    parser = _Parser(prog=PROGRAM, allow_abbrev=False,
                     description="Show the devices of a running pokeysd in a browser and to Prometheus.")
    parser.add_argument("--config", metavar="FILE", type=Path, help=f"configuration, instead of {config.PATH}")
    parser.add_argument("--check-config", action="store_true", help="judge the configuration and end")
    parser.add_argument("--runtime-directory", metavar="DIR", help=f"folder of the daemon ({config.RUNTIME})")
    parser.add_argument("--listen", metavar="ADDRESS:PORT", action="append",
                        help=f"where to listen (127.0.0.1:{config.PORT}); may be given several times")
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    return parser.parse_args(words)


def _configuration(options: argparse.Namespace) -> config.Config:
    """The file's, and what the command line has instead. :class:`config.Faults`."""
    found = config.read(options.config)
    for name, convert, text in (("runtime_directory", config.directory, options.runtime_directory),
                                ("listen", config.endpoints, ",".join(options.listen or []) or None)):
        if text is None:
            continue
        try:
            found = replace(found, **{name: convert(text)})
        except ValueError as error:
            raise config.Faults([f'--{name.replace("_", "-")}: "{text}" is not allowed; allowed: {error}']) from None
    return found


def _inherited() -> list[socket.socket]:
    """Sockets of systemd or of another starter (sd_listen_fds(3))."""
    count, pid = os.environ.pop("LISTEN_FDS", "0"), os.environ.pop("LISTEN_PID", "")
    if pid != str(os.getpid()) or not count.isdigit():
        return []
    return [socket.socket(fileno=FIRST_SOCKET + i) for i in range(int(count))]


def _notify(state: str) -> None:
    """Tell the service manager, if there is one (sd_notify(3))."""
    path = os.environ.get("NOTIFY_SOCKET")
    if not path:
        return
    with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as to:
        to.sendto(state.encode(), "\0" + path[1:] if path.startswith("@") else path)


async def _serve(settings: config.Config, names: model.Model, sockets: list[socket.socket]) -> None:
    end = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, end.set)
    hub = Hub(settings, names)
    door = Http(hub)
    try:
        await hub.start()
        for address in await door.open(sockets):
            _LOG.info("the page is at %s", address)
        _notify("READY=1")
        await end.wait()
        _notify("STOPPING=1")
        _LOG.info("ending")
    finally:
        await door.close()
        await hub.close()


def main(words: list[str] | None = None) -> int:
    """The program; its exit status."""
    options = _options(sys.argv[1:] if words is None else words)
    handler = logging.StreamHandler()
    handler.setFormatter(_Formatter())
    logging.basicConfig(level=logging.INFO, handlers=[handler])
    # what is no HTTP would fill the log; errors of ours are logged by the door
    logging.getLogger("aiohttp.server").setLevel(logging.CRITICAL)
    try:
        settings = _configuration(options)
    except config.Faults as faults:
        for line in faults.lines:
            print(f"{PROGRAM}: {line}", file=sys.stderr)
        return STATUS_USAGE if faults.lines[0].startswith("--") else STATUS_CONFIG
    if options.check_config:
        path = options.config or config.PATH
        print(f"{PROGRAM}: {path} {'is valid' if path.exists() else 'does not exist; defaults apply'}")
        return 0
    try:
        asyncio.run(_serve(settings, model.load(), _inherited()))
    except (OSError, ValueError, model.NoNames, pokeys.LibraryMissing) as error:
        _LOG.error("%s", error.strerror if isinstance(error, OSError) and error.strerror else error)
        return STATUS_FAILED
    return 0


if __name__ == "__main__":
    sys.exit(main())
