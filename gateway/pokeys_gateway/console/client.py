# SPDX-License-Identifier: GPL-2.0-or-later
"""One end of the console: a connection, or the machine. What it sends is framed here, and routed by the router."""
from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from ..access import Access, Who
from .framing import Framer
from .message import Ledger, Message
from .outbox import Outbox

# the beginning of [ESP, also behind an echo:
_MAY_BE_COMMAND = re.compile(rb"(?:echo: )?\[(?:E(?:S(?:P\d{0,3})?)?)?|e(?:c(?:h(?:o(?:: ?)?)?)?)?")
INCOMING_MOST = 16 << 10    # bytes that are not routed yet; a door that has so many reads no more


class Client:
    """What the router knows of it. Belongs to the event loop's thread.

    A door calls :meth:`receive` with what has come, and reads no more while :attr:`full`; it sends what it
    takes from :attr:`outbox`.
    """

    def __init__(self, ledger: Ledger, kind: str, name: str, *, most: int, level: Callable[[], str],
                 address: str = "127.0.0.1", outbox: Outbox | None = None) -> None:
        """`most` is the longest part of a line; `level` gives what it may do without a log-in, "" is nothing."""
        self.kind, self.name, self.address = kind, name, address
        self.here = "127.0.0.1"     # the address at which it reaches us
        self.who: Who | None = None     # has logged in
        self.outbox = Outbox(ledger) if outbox is None else outbox
        self.hears = True           # gets what the machine says
        self.connected = True
        self.held: Message | None = None        # the next one, which has to wait
        self.refused = False        # something that it wanted needs another level
        self.busy = False           # a command of it is under way; what comes after it waits
        self.due = 0                # replies to it that take time, and are still to come
        self.failed = False         # a stop of it was not confirmed
        self.flushed = False        # its last message was passed on without the line's end, as nothing came
        self.skips = False          # the rest of a line that was refused is not looked at
        self.continues = False      # the rest of a line whose beginning was a command is none
        self.lines = 0              # that it has sent
        # of the machine: forget what is under way, and count the lines; those of clients that it knows by clients
        self.on_stop: Callable[[], Mapping[Client | None, int]] = dict
        self.on_forgotten: Callable[[Client], None] = lambda client: None       # ... lines that it never had
        self.on_data: Callable[[Client], None] = lambda client: None
        self.take_urgent: Callable[[Client, bytes], bytes] = lambda client, data: data
        self.on_room: Callable[[], None] = lambda: None
        self.on_close: Callable[[], None] = lambda: None        # end its connection
        self.on_end: Callable[[], None] = lambda: None          # it is gone
        self.last_at = 0.0          # when something came
        self.deaf_until = 0.0       # nothing of it is taken, as somebody has stopped the machine
        self.framer = Framer(most)
        self._level = level
        self._ledger = ledger
        self._was_full = False

    def __str__(self) -> str:
        return f"{self.kind} {self.name}"

    def level(self, access: Access) -> str:
        """What it may do now; "": it may not even read."""
        return self.who.level if self.who and access.holds(self.who) else self._level()

    def receive(self, data: bytes, now: float) -> None:
        """It has sent this. Never waits."""
        self.last_at = now
        self.framer.feed(self.take_urgent(self, data))
        self._was_full = self.full
        self.on_data(self)

    @property
    def full(self) -> bool:
        """No more is to be read."""
        return len(self.framer) >= INCOMING_MOST

    @property
    def flush_at(self) -> float | None:
        """When a line without an end is passed on; not if it may become a command, which could have a password."""
        patience = self.framer.patience
        if patience is None or self.held or self.busy or _MAY_BE_COMMAND.fullmatch(self.framer.begun):
            return None
        return self.last_at + patience

    @property
    def pending(self) -> bool:
        """Something that it has sent is not routed yet, or not answered."""
        return bool(len(self.framer) or self.held or self.busy or self.due)

    def next(self, now: float, level: str) -> Message | None:
        """The next message, which belongs to the caller; None: nothing is there, or it has to wait."""
        if self.busy:
            return None
        if self.held:
            message, self.held = self.held, None
            return message
        found = self.framer.next()
        if not found and (at := self.flush_at) is not None and at <= now:
            found = self.framer.flush()
            self.flushed = bool(found and found[0][-1:] not in (b"\r", b"\n"))
        elif found:
            self.flushed = False
        if self._was_full and not self.full:
            self._was_full = False
            self.on_room()
        if not found:
            return None
        data, part = found
        self.lines += part.last
        return self._ledger.message(data, part, self, level=level, request=self.lines)

    def forget(self) -> int:
        """What it has sent so far is not carried out, and neither is the rest of a line; how many lines that are."""
        self.skips = self.skips or self.framer.open
        return self.framer.cut(0, len(self.framer)) + self.skips + self.forget_held()

    def forget_held(self) -> int:
        """The message that waits is not carried out; how many lines that are."""
        if not self.held:
            return 0
        lines = int(self.held.part.last)
        self.held.release()
        self.held = None
        return lines

    def end(self) -> None:
        """It is gone: nothing of it is obeyed any more, and nothing is sent."""
        self.connected = False
        self.on_end()
        self.forget()
        self.outbox.clear()
