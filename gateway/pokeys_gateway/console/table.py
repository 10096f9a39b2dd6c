# SPDX-License-Identifier: GPL-2.0-or-later
"""The commands of ESP3D 3.0 that there are, and what they do."""
from __future__ import annotations

import asyncio
import re

from .. import __version__
from .client import Client
from .commands import Command, Commands, Refused, Words

PAUSE_MOST_MS = 60_000
Pairs = list[dict[str, str]]


def _pairs(*rows: tuple[str, object]) -> Pairs:
    return [{"id": name, "value": str(value)} for name, value in rows]


def _help(commands: Commands, _client: Client, words: Words) -> str:
    table = commands.table
    if not words.plain:
        return "\n".join(f"[ESP{number}]{one.usage} - {one.help}" for number, one in table.items())
    number = int(words.plain[0]) if re.fullmatch(r"[0-9]{1,3}", words.plain[0]) else -1
    if not (one := table.get(number)):
        raise Refused(f"there is no command [ESP{words.plain[0][:16]}]; [ESP0] lists them")
    return f"[ESP{number}]{one.usage} - {one.help}"


async def _pause(_commands: Commands, _client: Client, words: Words) -> str:
    text = words.plain[0] if len(words.plain) == 1 else ""
    if not re.fullmatch(r"[0-9]{1,5}", text) or int(text) > PAUSE_MOST_MS:
        raise Refused(f"[ESP290] takes the milliseconds to wait, 0 to {PAUSE_MOST_MS}")
    await asyncio.sleep(int(text) / 1000)
    return "ok"


def _queue(client: Client) -> str:
    outbox = client.outbox
    return f"lines sent: {client.lines}, waiting: {len(outbox)}, most waiting: {outbox.most}, dropped: {outbox.dropped}"


def _status(commands: Commands, client: Client, _words: Words) -> Pairs:
    router = commands.router
    assert router
    machine = router.machine
    return _pairs(
        ("FW ver", f"pokeys-gateway {__version__}"),
        ("machine", f"{machine.name}, {_queue(machine)}" if machine else router.why_no_machine),
        ("stops", router.stops),
        ("messages", f"in memory: {router.ledger.live}, since the start: {router.ledger.made}"),
        *(("this client" if one is client else "client",
           f"{one}, {one.level(commands.access) or 'not logged in'}, {_queue(one)}") for one in router.clients))


def _level(commands: Commands, client: Client, words: Words) -> str:
    if words.plain:
        raise Refused("[ESP500] takes user=NAME and pwd=PASSWORD, or nothing")
    return client.level(commands.access) or "Not authenticated"


TABLE = {
    0: Command("", "[NUMBER]", "list the commands, or explain one", _help),
    290: Command("user", "MILLISECONDS", "wait before the next command of this client", _pause),
    420: Command("guest", "", "show the machine, the clients and what waits for them", _status),
    500: Command("", "[user=NAME pwd=PASSWORD]", "show what this client may do; log in", _level),
}
