# SPDX-License-Identifier: GPL-2.0-or-later
"""The command line of pokeys-gateway(8), and its life."""
from __future__ import annotations

import argparse
import asyncio
import contextlib
import fcntl
import getpass
import grp
import logging
import os
import signal
import socket
import ssl
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import pokeys
from pokeys._ini import Faults

from . import __version__, access, config, model
from .console.console import Console
from .doors.esp3d import Esp3d
from .doors.http import Http, endpoint_of
from .doors.pty import Pty
from .doors.serial import NoSerial, Port
from .doors.telnet import Telnet
from .gcode.machine import Machine
from .hub import Hub

PROGRAM = "pokeys-gateway"
STATUS_FAILED, STATUS_USAGE, STATUS_AGAIN, STATUS_CONFIG = 1, 64, 75, 78      # sysexits.h
ANSWER_S = 0.2              # for the answer to who wants it to begin again
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
    users = parser.add_mutually_exclusive_group()
    users.add_argument("--set-user", metavar="NAME",
                       help="make a user, or change its password, which is asked for, and end")
    users.add_argument("--remove-user", metavar="NAME", help="remove a user and end")
    parser.add_argument("--level", choices=access.LEVELS, help="what the user may do (guest)")
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    found = parser.parse_args(words)
    if found.level and found.set_user is None:
        parser.error("--level is for --set-user")
    return found


def _configuration(options: argparse.Namespace) -> tuple[config.Config, dict[str, str]]:
    """The file's, what the command line has instead, and where each is from. :class:`Faults`."""
    found, places = config.read(options.config)
    for name, convert, text in (("runtime_directory", config.directory, options.runtime_directory),
                                ("listen", config.endpoints, ",".join(options.listen or []) or None)):
        if text is None:
            continue
        places[name] = f"--{name.replace('_', '-')}"
        try:
            changed: dict[str, Any] = {name: convert(text)}
            found = replace(found, **changed)
        except ValueError as error:
            raise Faults([f'{places[name]}: "{text}" is not allowed; allowed: {error}']) from None
    return found, places


def _judged(settings: config.Config, places: dict[str, str]) -> dict[str, access.User] | None:
    """The users, if all goes together. :class:`Faults`, with all of them."""
    users, faults = None, []
    try:
        users = config.read_users(settings)
        faults = [f"{places.get(name, 'a socket that was given')}: {text}" for name, text in
                  config.judge(settings, users)]
    except Faults as found:
        faults = found.lines
    try:
        config.tls(settings)
    except Faults as found:
        faults += [f"{places['certificate']}: {line}" for line in found.lines]
    if faults:
        raise Faults(faults)
    return users


def _password() -> str:
    """Asked for twice at a terminal; otherwise a line of standard input. ValueError."""
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\r\n")
    try:
        password = getpass.getpass("password: ")
        if getpass.getpass("the same again: ") != password:
            raise ValueError("these were two passwords")
    except (EOFError, KeyboardInterrupt):
        raise ValueError("nothing was changed") from None
    return password


@contextlib.contextmanager
def _alone(path: Path) -> Iterator[None]:
    """While nobody else of us changes a file. OSError."""
    folder = os.open(path.resolve().parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        yield
    finally:
        os.close(folder)


def _change_users(settings: config.Config, options: argparse.Namespace) -> int:
    """--set-user and --remove-user."""
    removed, path = options.set_user is None, settings.users
    name = options.remove_user if removed else options.set_user
    try:
        if not removed and not access.NAME.fullmatch(name):
            raise ValueError(f'"{name}" is not allowed; allowed: a to z, 0 to 9, _ and -, at most 32')
        secret = "" if removed else access.make_secret(_password())
        with _alone(path):
            users = config.read_users(settings) or {}
            if not removed:
                level = options.level or (users[name].level if name in users else access.LEVELS[0])
                users[name] = access.User(name, level, secret)
            elif not users.pop(name, None):
                raise ValueError(f"there is no user {name} in {path}")
            owner = None
            if os.geteuid() == 0:
                # the service reads it, and cannot write it
                with contextlib.suppress(KeyError):
                    owner = 0, grp.getgrnam(PROGRAM).gr_gid
            access.write_users(path, users, owner)
    except Faults as faults:
        print(f"{PROGRAM}: {faults.lines[0]}", file=sys.stderr)
        return STATUS_CONFIG
    except (OSError, ValueError) as error:
        print(f"{PROGRAM}: {f'{path}: {error.strerror}' if isinstance(error, OSError) else error}", file=sys.stderr)
        return STATUS_FAILED
    print(f"{PROGRAM}: {name} is {'removed' if removed else users[name].level}; a gateway that runs needs "
          f"systemctl reload {PROGRAM}, and its log says whether it has read this")
    if not users:
        print(f"{PROGRAM}: that was the last user: nobody can log in. Without {path}, everybody here may read.")
    return 0


def _inherited() -> tuple[list[socket.socket], list[socket.socket]]:
    """Sockets of systemd or of another starter (sd_listen_fds_with_names(3)): for pages, and for telnet."""
    count, pid = os.environ.pop("LISTEN_FDS", "0"), os.environ.pop("LISTEN_PID", "")
    names = os.environ.pop("LISTEN_FDNAMES", "").split(":")
    pages: list[socket.socket] = []
    telnet: list[socket.socket] = []
    if pid == str(os.getpid()) and count.isdigit():
        for i in range(int(count)):
            (telnet if names[i:i + 1] == ["telnet"] else pages).append(socket.socket(fileno=FIRST_SOCKET + i))
    return pages, telnet


def _notify(state: str) -> None:
    """Tell the service manager, if there is one (sd_notify(3))."""
    path = os.environ.get("NOTIFY_SOCKET")
    if not path:
        return
    with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as to:
        to.sendto(state.encode(), "\0" + path[1:] if path.startswith("@") else path)


def _reload(settings: config.Config, users: access.Access, tls: ssl.SSLContext | None) -> None:
    """SIGHUP: the users, and a certificate that was renewed. What is wrong is logged, and stays as it was."""
    try:
        found = config.read_users(settings)
        users.reload(found)
        _LOG.info("users read again: %d", len(users.users))
        for _, text in config.judge(settings, found):
            _LOG.error("%s", text)
    except Faults as faults:
        for line in faults.lines:
            _LOG.error("%s; the users stay as they were", line)
    try:
        if tls:
            config.load_certificate(tls, settings)
            _LOG.info("certificate read again")
    except Faults as faults:
        _LOG.error("%s; the certificate stays as it was", faults.lines[0])


async def _serve(settings: config.Config, names: model.Model, users: dict[str, access.User] | None,
                 sockets: list[socket.socket], for_telnet: list[socket.socket]) -> bool:
    """Until it is to end; True: to begin again."""
    end = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, end.set)
    hub = Hub(settings, names)
    who, tls = access.Access(users, settings.guests), config.tls(settings)
    console = Console(who, hub)
    again = False

    def restart() -> None:
        nonlocal again
        again = True
        loop.call_later(ANSWER_S, end.set)
    console.commands.on_restart = restart
    telnet, esp3d, pty = Telnet(console), Esp3d(hub, who, console), Pty(console)
    port = Port(console, settings.machine_port, settings) if settings.machine_port else None
    machine = Machine(console, hub) if settings.machine_kind == config.POKEYS else None
    door = Http(hub, who, console, tls)
    loop.add_signal_handler(signal.SIGHUP, _reload, settings, who, tls)
    try:
        await hub.start()
        if port:
            port.open()
        if machine:
            machine.open()
        if settings.pty_path:
            _LOG.info("the console is at %s", pty.open(settings.pty_path, settings.pty_group))
        for address in await telnet.open(settings.telnet_listen, for_telnet) + await esp3d.open(settings.esp3d_listen):
            _LOG.info("the console is at %s", address)
        for address in await door.open(sockets):
            _LOG.info("the page is at %s", address)
        if settings.plaintext and not settings.certificate and not all(one.loopback for one in settings.listen):
            _LOG.warning("plaintext = yes: passwords and values can be read on the network")
        if not all(one.loopback for one in settings.telnet_listen + settings.esp3d_listen):
            _LOG.warning("the console has no encryption: passwords and commands can be read and changed on the network")
        _notify("READY=1")
        await end.wait()
        _notify("STOPPING=1")
        _LOG.info("ending")
    finally:
        await door.close()
        await asyncio.gather(telnet.close(), esp3d.close(), pty.close())
        if port:
            await port.close()
        if machine:
            await machine.close()
        console.close()
        await hub.close()
    return again


def main(words: list[str] | None = None) -> int:
    """The program; its exit status."""
    options = _options(sys.argv[1:] if words is None else words)
    handler = logging.StreamHandler()
    handler.setFormatter(_Formatter())
    logging.basicConfig(level=logging.INFO, handlers=[handler])
    # what is no HTTP would fill the log; errors of ours are logged by the door
    logging.getLogger("aiohttp.server").setLevel(logging.CRITICAL)
    try:
        settings, places = _configuration(options)
        if options.set_user is not None or options.remove_user is not None:
            return _change_users(settings, options)
        sockets, for_telnet = ([], []) if options.check_config else _inherited()
        for name, given in ("listen", sockets), ("telnet_listen", for_telnet):
            if given:
                passed: dict[str, Any] = {name: tuple(map(endpoint_of, given))}
                settings = replace(settings, **passed)
                places.pop(name, None)
        users = _judged(settings, places)
    except ValueError as error:
        _LOG.error("%s", error)
        return STATUS_FAILED
    except Faults as faults:
        for line in faults.lines:
            print(f"{PROGRAM}: {line}", file=sys.stderr)
        return STATUS_USAGE if faults.lines[0].startswith("--") else STATUS_CONFIG
    if options.check_config:
        path = options.config or config.PATH
        print(f"{PROGRAM}: {path} {'is valid' if path.exists() else 'does not exist; defaults apply'}")
        return 0
    try:
        again = asyncio.run(_serve(settings, model.load(), users, sockets, for_telnet))
    except (OSError, ValueError, NoSerial, model.NoNames, pokeys.LibraryMissing) as error:
        _LOG.error("%s", error.strerror if isinstance(error, OSError) and error.strerror else error)
        return STATUS_FAILED
    if again and (sockets or for_telnet):
        return STATUS_AGAIN         # whoever has opened them has to do it again
    if again:
        os.execv(sys.executable, sys.orig_argv)
    return 0


if __name__ == "__main__":
    sys.exit(main())
