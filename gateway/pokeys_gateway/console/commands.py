# SPDX-License-Identifier: GPL-2.0-or-later
"""The commands of ESP3D 3.0 that clients of the console have: [ESPnnn]WORDS.

Words are separated by spaces; a backslash takes the special meaning from the next character. ``json``
or ``json=yes`` asks for the answer as {"cmd", "status", "data"}. ``pwd=`` logs in first, with any command,
and holds for the connection (see [ESP500]).
"""
from __future__ import annotations

import asyncio
import json
import logging
import re
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

from ..access import LEVELS, Access, Denied, TooMany
from ..config import Endpoint
from ..folder import Folder
from ..hub import Hub
from ..model import Model
from .client import Client
from .router import Router

USUAL_NAMES = "admin", "user"       # a password without a name is one of these users', as ESP3D has it
_WORD = re.compile(r"(?:\\.|[^\s\\])+", re.S)
_NAMED = re.compile(r"([A-Za-z][A-Za-z0-9_]*)=(.*)", re.S)
_YES = "yes", "true", "1"
_LOG = logging.getLogger("pokeys-gateway")


class MachinePort(Protocol):
    """What commands need of the machine's port."""

    @property
    def path(self) -> Any:
        """Of the port."""

    @property
    def enabled(self) -> bool:
        """Is it used?"""

    def enable(self, on: bool) -> None:
        """Use it, or give it free."""


class Refused(Exception):
    """Why a command is not carried out."""


@dataclass(frozen=True)
class Words:
    """What stands behind a command."""

    plain: tuple[str, ...]
    named: dict[str, str]
    json: bool


def parse(text: str) -> Words:
    """The words of a command."""
    plain, named, as_json = [], {}, False
    for found in _WORD.findall(text):
        word = re.sub(r"\\(.)", r"\1", found, flags=re.S)
        pair = _NAMED.fullmatch(word)
        if word == "json" or (pair and pair[1] == "json"):
            as_json = not pair or pair[2].lower() in _YES
        elif pair:
            named[pair[1]] = pair[2]
        else:
            plain.append(word)
    return Words(tuple(plain), named, as_json)


def _pair(row: dict[str, Any]) -> str:
    return f"{row['id']}: {row['value']}"


@dataclass(frozen=True)
class Listing:
    """Data of several rows, or of several values, for an answer."""

    title: str                                  # of the text; "" = none
    data: list[dict[str, Any]] | dict[str, Any]
    line: Callable[[dict[str, Any]], str] = _pair       # the text of a row
    text: str = ""                              # instead of all that

    def __str__(self) -> str:
        rows = [f"{name}: {value}" for name, value in self.data.items()] \
            if isinstance(self.data, dict) else map(self.line, self.data)
        return self.text or "\n".join(filter(None, (self.title, *rows)))


def answer(number: int, as_json: bool, good: bool, data: Any) -> str:
    """As ESP3D gives it, as text or JSON."""
    if as_json:
        return json.dumps({"cmd": str(number), "status": "ok" if good else "error",
                           "data": data.data if isinstance(data, Listing) else data},
                          separators=(",", ":"), ensure_ascii=False)
    return str(data) if good else f"error: {data}"


Run = Callable[["Commands", Client, Words], "Any | Awaitable[Any]"]


@dataclass(frozen=True)
class Command:
    """A command: who may give it, what it takes, and what it does. `run` gives the data of the answer."""

    level: str          # "": also who may not read
    usage: str
    help: str
    run: Run


class Commands:
    """Carries them out. Belongs to the event loop's thread."""

    def __init__(self, access: Access, table: dict[int, Command], hub: Hub) -> None:
        """`table` has them by their number."""
        self.router: Router | None = None
        self.port: MachinePort | None = None
        self.on_restart: Callable[[], None] = lambda: None
        self.access = access
        self.table = table
        self.config = hub.config
        self._folder = Folder(hub.config.esp3d_folder) if hub.config.esp3d_folder else None
        self._hub = hub
        self._tasks: set[asyncio.Task[None]] = set()

    def execute(self, client: Client, number: int, text: str, take: Callable[[str], None]) -> None:
        """A command; `take` gets the answer, once, now or later. See :class:`Router`."""
        words = parse(text)
        command = self.table.get(number)
        if not command:
            take(answer(number, words.json, False, f"there is no command [ESP{number}]; [ESP0] lists them"))
            return
        if "pwd" not in words.named and not asyncio.iscoroutinefunction(command.run):
            found = command
            self._give(number, words, take, lambda: self._run(client, found, words))
        elif self.router and client is self.router.machine:
            # all clients would wait for what the machine says, and would be shown a password
            take(answer(number, words.json, False, "not for the machine"))
        else:
            self._later(self._in_time(client, number, command, words, take))

    @staticmethod
    def _give(number: int, words: Words, take: Callable[[str], None], work: Callable[[], Any]) -> None:
        """Answer with what `work` returns."""
        try:
            text = answer(number, words.json, True, work())
        except Refused as why:
            text = answer(number, words.json, False, str(why))
        except Exception:
            _LOG.exception("[ESP%d]", number)
            text = answer(number, words.json, False, "an error of the gateway; its log says more")
        take(text)

    def _later(self, work: Awaitable[None]) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def need(self, level: str, client: Client) -> None:
        """:class:`Refused` if it may not do so much."""
        has = client.level(self.access)
        if level and (not has or LEVELS.index(has) < LEVELS.index(level)):
            client.refused = True
            raise Refused(f"this needs level {level}; log in with [ESP500]user=NAME pwd=PASSWORD")

    def _run(self, client: Client, command: Command, words: Words) -> Any:
        self.need(command.level, client)
        return command.run(self, client, replace(words, named={
            name: value for name, value in words.named.items() if name not in ("user", "pwd")}))

    # ---- what commands ask for

    def clients(self) -> list[Client]:
        """Of the console."""
        return list(self.router.clients) if self.router else []

    def listens(self, section: str) -> tuple[Endpoint, ...]:
        """Where the door of a section of the configuration is."""
        return tuple(getattr(self.config, f"{section}_listen"))

    def model(self) -> Model:
        """The names."""
        return self._hub.model

    def folder(self) -> Folder:
        """Of files. :class:`Refused`."""
        if not self._folder:
            raise Refused("no folder is configured; see [esp3d] in pokeys-gateway.conf(5)")
        return self._folder

    def device(self, name: str | None) -> tuple[str, Any]:
        """A device's name and state; the only one, if none is named. :class:`Refused`."""
        names = self._hub.source.names()
        if name is None and len(names) == 1:
            name = names[0]
        if name is None:
            raise Refused(f"D=DEVICE is missing; there are {', '.join(names)}" if names else self._hub.source.trouble)
        reading = self._hub.source.read(name)
        if not reading:
            raise Refused(self._hub.no_such_device(name))
        if not reading.state or not reading.connected:
            raise Refused(f"{name}: {reading.reason}")
        return name, reading.state

    async def _in_time(self, client: Client, number: int, command: Command, words: Words,
                       take: Callable[[str], None]) -> None:
        found: Any = None
        fault: Exception | None = None
        try:
            if "pwd" in words.named:
                await self._log_in(client, words)
            found = self._run(client, command, words)
            if isinstance(found, Awaitable):
                found = await found
        except Exception as error:
            fault = error

        def result() -> Any:
            if fault:
                raise fault
            return found
        self._give(number, words, take, result)

    async def _log_in(self, client: Client, words: Words) -> None:
        """:class:`Refused`."""
        if not self.access.users:
            raise Refused("there are no users; pokeys-gateway --set-user NAME makes one")
        named = words.named.get("user")
        names = [named] if named is not None else [name for name in USUAL_NAMES if name in self.access.users] or \
            [USUAL_NAMES[0]]
        for name in names:
            try:
                client.who = await self.access.check(name, words.named["pwd"], client.address)
                return
            except Denied:
                continue
            except TooMany as error:
                raise Refused(str(error)) from None
        raise Refused("wrong user name or password")

    def close(self) -> None:
        """Nothing more is answered."""
        for task in self._tasks:
            task.cancel()
