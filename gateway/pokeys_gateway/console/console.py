# SPDX-License-Identifier: GPL-2.0-or-later
"""The console in the event loop: calls the router when there is something to do, a few messages a turn."""
from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, Any

from ..access import LEVELS, Access
from ..gate import host_of, is_loopback
from ..hub import Hub
from ..wire import NotDone
from . import urgent
from .client import Client
from .commands import Commands
from .message import Ledger
from .outbox import Outbox
from .router import MACHINE_BYTES, MACHINE_LINES, Router
from .table import TABLE

if TYPE_CHECKING:
    from ..gcode.card import Storing

_LOG = logging.getLogger("pokeys-gateway")


def _no_files(_name: str) -> Storing:
    raise NotDone("the machine has no folder of files")


async def _no_axes(_owner: object, _axis: str, _speed: float) -> None:
    raise NotDone("G-code commands no axes here")


class Console:
    """What the doors of the console share. Belongs to the event loop's thread."""

    def __init__(self, access: Access, hub: Hub) -> None:
        self.ledger = Ledger()
        self.configured = bool(hub.config.machine_port or hub.config.machine_kind)     # a machine
        self.refused = 0            # connections, because there were too many
        self.closed_slow = 0        # connections that took nothing
        self.connections = 0        # how often the machine was found
        # what can be said of the machine, besides its lines
        self.about: Callable[[], dict[str, Any]] = dict
        # move an axis for a moment, at so many units/s; NotDone
        self.jog: Callable[[object, str, float], Awaitable[None]] = _no_axes
        # a file that is to be written for the machine; NotDone if it has none
        self.store: Callable[[str], Storing] = _no_files
        self._access = access
        self._level = hub.config.console_level      # of clients of this computer; None: as for HTTP
        self.commands = Commands(access, TABLE, hub)
        self.router = Router(access, self.commands.execute, self.ledger, urgent.of(hub.config.machine_firmware))
        self.commands.router = self.router
        self.router.on_work = self._wake
        self._next: asyncio.Handle | None = None
        self._ended = False

    def client(self, kind: str, name: str, most: int, address: str, at_least: str = "") -> Client:
        """A new client, which hears the machine from now on.

        `address` is the other end's, `at_least` a level that it has anyway.
        """
        near = is_loopback(address)
        def level() -> str:
            here = self._level if self._level and near else "" if self._access.required else LEVELS[0]
            return max(here, at_least, key=("", *LEVELS).index)
        client = Client(self.ledger, kind, name, most=most, level=level,
                        address=address if near else host_of(address))
        self.router.join(client)
        return client

    def level(self, client: Client) -> str:
        """What it may do; "": it may not even read."""
        return client.level(self._access)

    def may_send(self, client: Client) -> bool:
        """Its lines go to the machine."""
        return self.level(client) in LEVELS[1:]

    def machine(self, name: str, most: int) -> Client:
        """The machine, which is there from now on."""
        outbox = Outbox(self.ledger, MACHINE_LINES, MACHINE_BYTES, drops=False)
        client = Client(self.ledger, "machine", name, most=most, level=lambda: LEVELS[0], outbox=outbox)
        self.router.connect(client)
        return client

    def _wake(self) -> None:
        """Something is to be routed."""
        if self._ended or (self._next and not isinstance(self._next, asyncio.TimerHandle)):
            return
        if self._next:
            self._next.cancel()
        self._next = asyncio.get_running_loop().call_soon(self._turn)

    def _turn(self) -> None:
        self._next = None
        loop = asyncio.get_running_loop()
        at: float | None = None
        try:
            at = self.router.run(loop.time())
        except Exception:
            _LOG.exception("routing a message")
            at = 0
        # if it was woken meanwhile, it is called at once
        if at is not None and not self._next and not self._ended:
            self._next = loop.call_soon(self._turn) if not at else loop.call_at(at, self._turn)

    def close(self) -> None:
        """Route nothing more."""
        self._ended = True
        self.commands.close()
        if self._next:
            self._next.cancel()
