# SPDX-License-Identifier: GPL-2.0-or-later
"""Where messages go.

There are three cases. A command of ours, whatever its origin, is carried out, and the answer goes to the
origin. Anything else from a client goes to the machine. Anything else from the machine goes to all clients,
a copy each.

Nothing here waits for a client. What clients send to the machine is not dropped: if the machine has no
room, the message stays with its client, whose door reads no more. What the machine says is dropped for a
client that does not read it, which is counted and said.

A line that a client has begun and not ended yet (somebody types, or it is longer than the client's limit)
must not be joined with a line of another client: "G1 X1" and "M105" would be "G1 X1M105". So the machine
belongs to that client until the line ends, OPEN_S at most; then its end is put there, and its rest is not sent.

A stop (see :mod:`.urgent`) goes past all of it, and all lines that came before it are forgotten, whoever has
sent them: a machine must not go on when it has stopped. A client whose lines were forgotten may be in the
middle of a programme; what it sends is not taken until it has sent nothing for DEAF_S.
"""
from __future__ import annotations

import logging
import re
from collections import deque
from collections.abc import Callable, Iterable

from ..access import LEVELS, Access
from .client import Client
from .message import Ledger, Message
from .urgent import Urgent

TICK_MOST = 10              # messages in one turn of the event loop
COPIES_MOST = 128           # for those who hear the machine; those of a message that has begun are all made
OPEN_S = 10.0
DEAF_S = 2.0
MACHINE_LINES, MACHINE_BYTES = 64, 8 << 10      # on their way to the machine
NOT_ALLOWED = "not sent: this needs level user; log in with [ESP500]user=NAME pwd=PASSWORD"
ENDED = f"error: your line had no end for {OPEN_S:.0f} s, and was ended; its rest is not sent"
DEAF = f"error: your lines are not taken until you have sent none for {DEAF_S:.0f} s"
URGENT_MOST = 64            # messages that go past these
ANSWERS_MOST = 16           # for a machine that takes nothing
COMMAND_BEGINS = re.compile(rb"(?:echo: )?\[ESP")
COMMAND = re.compile(rb"(?:echo: )?\[ESP(\d{0,3})\](.*)", re.S)
# carries out a command of a client: its number, its words, and what takes the answer, once, now or later
Execute = Callable[[Client, int, str, Callable[[str], None]], None]
_LOG = logging.getLogger("pokeys-gateway")


class Router:
    """All clients and the machine. Pure: `now` is a parameter, :attr:`on_work` says that run() has to be called."""

    def __init__(self, access: Access, execute: Execute, ledger: Ledger, urgent: Urgent) -> None:
        self.ledger = ledger
        self.clients: dict[Client, None] = {}       # in the order of their coming
        self.machine: Client | None = None
        self.why_no_machine = "no machine is configured; see [machine] in pokeys-gateway.conf(5)"
        self.on_work: Callable[[], None] = lambda: None
        self.ended = 0              # lines whose end was put by us
        self.routed = 0             # messages
        self.stops = 0
        self._copies = 0            # in this turn
        self._dropped = 0           # lines, for clients that are gone
        self._access = access
        self._execute = execute
        self._urgent = urgent
        # in the order of their turns
        self._ready: dict[Client, None] = {}        # may have a message
        self._waiting: dict[Client, None] = {}      # have one for the machine, which takes none now
        self._owner: Client | None = None           # the line that the machine gets is its
        self._owned_at = 0.0
        self._answers: deque[str] = deque(maxlen=ANSWERS_MOST)      # for the machine

    @property
    def dropped(self) -> int:
        """Lines that slow clients did not get."""
        return self._dropped + sum(client.outbox.dropped for client in tuple(self.clients))

    def join(self, client: Client) -> None:
        """A new client."""
        self.clients[client] = None
        client.on_data = self._came
        client.take_urgent = self._take_urgent

    def leave(self, client: Client, *, at_once: bool = False) -> None:
        """It is gone; `at_once`: its lines that wait for the machine are not sent."""
        if client not in self.clients:
            return
        del self.clients[client]
        self._dropped += client.outbox.dropped
        self._waiting.pop(client, None)
        self._ready.pop(client, None)
        client.end()
        if at_once and self.machine:
            self.machine.outbox.forget(client)
        if self._owner is client:
            self._end_line()

    def connect(self, machine: Client) -> None:
        """The machine is there."""
        self.machine = machine
        machine.on_data = self._wake
        machine.outbox.on_room = self._go_on
        self._go_on()

    def disconnect(self, why: str) -> int:
        """It is not there any more; how many lines it did not get."""
        lost = 0
        if self.machine:
            lost = self.machine.outbox.clear()
            self._ready.pop(self.machine, None)
            self.machine.end()
        if self._owner:
            self._owner.skips = True        # the next machine must not get the rest
        self.machine, self._owner, self.why_no_machine = None, None, why
        self._answers.clear()
        self._go_on()
        return lost

    def tell(self, client: Client, text: str, request: int = 0) -> None:
        """A line of ours."""
        client.outbox.put(self.ledger.message(text.encode("utf-8", "replace") + b"\n", target=client,
                                              request=request))

    def tell_all(self, text: str) -> None:
        """A line of ours, for all who hear the machine."""
        for client in self._hearers():
            self.tell(client, text)

    def run(self, now: float) -> float | None:
        """Route some messages. When to be called again: 0 is at once, None when there is something new."""
        if self._owner and not self._owner.held and now >= self._owned_at + OPEN_S:
            self._owner.skips = True
            self.tell(self._owner, ENDED)
            self._end_line()
        for client in self._all():
            if (at := client.flush_at) is not None and at <= now:
                self._wake(client)
        budget, self._copies = TICK_MOST, 0
        while budget and self._copies < COPIES_MOST and self._ready:
            client = next(iter(self._ready))
            del self._ready[client]
            if client in self._waiting:
                continue
            resumed = client.held is not None
            message = client.next(now, client.level(self._access))
            if not message:
                continue
            budget -= 1
            self.routed += not resumed
            if resumed and client is self._owner:
                self._owned_at = now        # it was not its fault
            try:
                more = self._route(client, message, now)
            except Exception:
                _LOG.exception("routing a message of %s", client)
                message.discard()
                more = True
            if more and client.connected:
                self._ready[client] = None
        if self._ready:
            return 0
        times = [client.flush_at for client in self._all() if client not in self._waiting]
        times.append(self._owned_at + OPEN_S if self._owner and not self._owner.held else None)
        return min((at for at in times if at is not None), default=None)

    def _all(self) -> Iterable[Client]:
        return (*self.clients, self.machine) if self.machine else tuple(self.clients)

    def hold(self, client: Client, held: bool) -> None:
        """Route nothing of it but stops, until it is let go: what it has sent already takes time."""
        client.busy = held
        if not held and client.connected:
            self._wake(client)

    def hears(self, client: Client) -> bool:
        """It stays, and may read what is not asked for."""
        return client.connected and client.hears and bool(client.level(self._access))

    def _hearers(self) -> Iterable[Client]:
        return (client for client in self.clients if self.hears(client))

    def _wake(self, client: Client) -> None:
        if client not in self._ready:
            self._ready[client] = None
            self.on_work()

    def _go_on(self) -> None:
        """Those that waited for the machine try again, and it gets its answers."""
        while self._answers and self.machine and not self._owner and not self.machine.outbox.full:
            self.tell(self.machine, self._answers.popleft())
        if self._waiting:
            self._ready |= self._waiting
            self._waiting.clear()
            self.on_work()

    # ---- what goes past all

    def _came(self, client: Client) -> None:
        """A client has sent something, which is in its framer now."""
        line, at, last = self._urgent.line, 0, b""
        while line and self._may_send(client) and (found := client.framer.find(line, at)):
            data, (start, end) = found[0], found.span()
            if data == last and not start:
                client.framer.cut(0, end)       # the same stop again
            elif self._is_stop(data):
                at, last = 0, data
                # what came behind it is to be done
                self._stop(client, client.framer.cut(0, end) - 1, b"\n" + data)
            elif self._owner:
                break       # it would be joined with a line that is begun
            else:
                client.framer.cut(start, end)
                self._past_all(client, data)
                at = start
        if client.last_at < client.deaf_until:
            client.deaf_until = client.last_at + DEAF_S
            if client.forget() and self.machine:
                self.machine.on_forgotten(client)
        self._wake(client)

    def _take_urgent(self, client: Client, data: bytes) -> bytes:
        """Send the bytes that the machine obeys at once; the others."""
        byte = self._urgent.byte
        if not byte or not byte.search(data):
            return data
        if not self._may_send(client):
            return self._refuse_urgent(client, data, byte)
        rest, last = bytearray(), b""
        line = client.framer.begun
        for piece in data.splitlines(keepends=True):
            line += piece
            if COMMAND_BEGINS.match(line):
                rest += piece       # of a password, for example
            else:
                at = 0
                for found in byte.finditer(piece):
                    rest += piece[at:found.start()]
                    at = found.end()
                    if found[0] == last and not rest:
                        continue        # the same stop again
                    if self._is_stop(found[0]):
                        last = found[0]
                        lines = rest.count(b"\n") + client.forget()
                        rest.clear()
                        self._stop(client, lines, found[0])
                    else:
                        self._past_all(client, found[0])
                # of "?" and an end nothing is left: grbl would say ok to an empty line
                if not (at and not client.framer.begun.strip() and not rest.rpartition(b"\n")[2].strip() and
                        not piece[at:].strip()):
                    rest += piece[at:]
            line = b"" if piece[-1:] in (b"\r", b"\n") else line
        return bytes(rest)

    def _refuse_urgent(self, client: Client, data: bytes, byte: re.Pattern[bytes]) -> bytes:
        """Say so at once; what is left has none of these bytes."""
        rest, line = b"", client.framer.begun
        for piece in data.splitlines(keepends=True):
            line += piece
            rest += piece if COMMAND_BEGINS.match(line) else byte.sub(b"", piece)
            line = b"" if piece[-1:] in (b"\r", b"\n") else line
        if rest != data:
            client.refused = True
            self.tell(client, f"error: {NOT_ALLOWED if self.machine else self.why_no_machine}")
        return rest

    @property
    def takes_bytes(self) -> bool:
        """The firmware obeys single bytes, which other characters have too."""
        return self._urgent.byte is not None

    def _is_stop(self, data: bytes) -> bool:
        return bool(self._urgent.stop and self._urgent.stop.match(data))

    def _may_send(self, client: Client) -> bool:
        return self.machine is not None and client.level(self._access) in LEVELS[1:]

    def _stop(self, client: Client, lines: int, data: bytes) -> None:
        """Send a stop, and forget what came before it: `lines` of this client, and all of the others."""
        self.halt(client, lines)
        self._past_all(client, data)

    def halt(self, client: Client | None, lines: int = 0, by: str = "", now: float = 0.0) -> None:
        """A stop has come: what came before it is forgotten, `lines` of this client already. Without a client, it has
        come another way, just now, and ``by`` says whose it is."""
        assert self.machine
        self.stops += 1
        under_way = self.machine.on_stop()
        lines += client.forget_held() if client else 0
        if client and lines:
            self.machine.on_forgotten(client)
        lines += sum(under_way.values()) + self.machine.outbox.clear(urgent=False)
        for one in self.clients:
            if one is client:
                continue
            forgotten = one.forget()
            lines += forgotten
            if forgotten:
                self.machine.on_forgotten(one)
            if forgotten or under_way.get(one):
                one.deaf_until = (client.last_at if client else now) + DEAF_S
                self.tell(one, DEAF)
        if client:
            client.deaf_until = 0.0
        if self._owner and self._owner is not client:
            self._owner.skips = True        # the rest of its line
        self._owner = None
        self._go_on()
        self.tell_all(f"[stop by {client or by}; lines not sent: {lines}]")

    def _past_all(self, client: Client, data: bytes) -> None:
        """Send something urgent."""
        assert self.machine
        outbox = self.machine.outbox
        if outbox.urgent < URGENT_MOST:
            outbox.put_first(self.ledger.message(data, origin=client, target=self.machine))
        else:
            self.tell(client, "error: not sent: the machine takes nothing")

    # ---- what has its turn

    def _route(self, client: Client, message: Message, now: float) -> bool:
        """False: the client has to wait."""
        if client.skips:
            client.skips = not message.ended
            message.release()
            return True
        # the rest of a long line is no command, whatever it looks like
        found = COMMAND.match(message.data) if message.part.first else None
        if found:
            return self._command(client, message, found)
        if client.continues:
            client.continues = not message.ended
            if message.data.strip():
                self.tell(client, "error: not sent: it continues a command", message.request)
            message.release()
            return True
        if client is not self.machine:
            return self._to_machine(client, message, now)
        for hearer in self._hearers():
            hearer.outbox.put(message.copy(hearer))
            self._copies += 1
        message.release()
        return True

    def _command(self, client: Client, message: Message, found: re.Match[bytes]) -> bool:
        request = message.request

        def answer(text: str) -> None:
            client.busy = False
            if client is self.machine:
                # not into a line that somebody has begun
                self._answers.append(text)
                self._go_on()
            elif client.connected:
                self.tell(client, text, request)
                self._wake(client)
        # without the line's end, more of it may come, such as a password
        client.continues = client.flushed
        if not message.part.last:
            client.skips = True
            message.release()
            answer("error: this command is too long")
            return True
        number, words = int(found[1] or b"0"), found[2].decode("utf-8", "replace").strip()
        message.release()
        client.busy = True
        self._execute(client, number, words, answer)
        return not client.busy

    def _refuse(self, client: Client, message: Message, why: str) -> bool:
        client.skips = not message.part.last
        if message.data.strip():
            self.tell(client, f"error: {why}", message.request)
        message.release()
        return True

    def _to_machine(self, client: Client, message: Message, now: float) -> bool:
        # it may have changed while the message was held
        if client.level(self._access) not in LEVELS[1:]:
            client.refused = True
            return self._refuse(client, message, NOT_ALLOWED)
        machine = self.machine
        if not machine:
            return self._refuse(client, message, self.why_no_machine)
        if machine.outbox.full or (self._owner and self._owner is not client):
            client.held = message
            self._waiting[client] = None
            return False
        message.target = machine
        ended = message.ended
        machine.outbox.put(message)
        if ended:
            owner, self._owner = self._owner, None
            if owner:
                self._go_on()
        elif self._owner is not client:
            self._owner, self._owned_at = client, now
        return True

    def _end_line(self) -> None:
        """The machine's line was not ended by who began it."""
        self._owner = None
        if self.machine:
            self.ended += 1
            self.machine.outbox.put(self.ledger.message(b"\n", target=self.machine))
        self._go_on()
