# SPDX-License-Identifier: GPL-2.0-or-later
"""What waits to be sent to one client. Bounded: a client that does not read costs the others nothing."""
from __future__ import annotations

from collections import deque
from collections.abc import Callable

from .message import Ledger, Message, Part

LINES_MOST, BYTES_MOST = 8192, 256 << 10
JOINED_MOST = 1024          # bytes of short lines that become one message: thousands of them would be slow to end
NOTICE = "[dropped {}]\n"


def _joins(last: Message, message: Message) -> bool:
    """Are both whole lines of one origin, and short? Only LF is counted as a line's end (:attr:`Message.lines`)."""
    return (message.origin is not None and last.origin is message.origin and last.size + message.size <= JOINED_MOST and
            message.part is last.part is Part.UNIQUE and message.data.endswith(b"\n") and last.data.endswith(b"\n"))


class Outbox:
    """A FIFO that drops its oldest lines when it is full, and tells the client how many when it reads again.

    A line is dropped as a whole: of a long one that came in parts, all parts that are not sent yet. Without
    `drops`, whoever puts something there looks at :attr:`full` first. Belongs to the event loop's thread.
    """

    def __init__(self, ledger: Ledger, lines: int = LINES_MOST, size: int = BYTES_MOST, *, drops: bool = True) -> None:
        self._ledger = ledger
        self._lines_most, self._bytes_most, self._drops = lines, size, drops
        self._first: deque[Message] = deque()
        self._waiting: deque[Message] = deque()
        self._size = self._lines = 0
        self._untold = 0            # lines that were dropped since the last notice
        self._dropping: set[object] = set()     # origins of lines that were dropped before their last part came
        # of what was taken last: its origin, and whether its line has ended
        self._origin: object = None
        self._ended = True
        self.dropped = 0            # lines, of all time
        self.most = 0               # lines that waited at once
        self.on_put: Callable[[], None] = lambda: None
        self.on_room: Callable[[], None] = lambda: None

    def __len__(self) -> int:
        return self._lines

    @property
    def empty(self) -> bool:
        """Nothing is to be sent."""
        return not (self._waiting or self._untold or self._first)

    @property
    def urgent(self) -> int:
        """How many wait that go past the others."""
        return len(self._first)

    @property
    def full(self) -> bool:
        """One more would drop another one."""
        return self._lines >= self._lines_most or self._size >= self._bytes_most

    def put(self, message: Message) -> None:
        """One more; it belongs to the outbox now."""
        if message.part.first:
            self._dropping.discard(message.origin)
        while self._drops and self._waiting and self.full and message.origin not in self._dropping:
            self._drop()
        if message.origin in self._dropping and not message.part.first:
            if message.part.last:
                self._dropping.discard(message.origin)
            message.release()
            return
        self._dropping.discard(message.origin)
        self._size += message.size
        self._lines += message.lines
        self.most = max(self.most, self._lines)
        if self._drops and self._waiting and _joins(self._waiting[-1], message):
            self._waiting[-1].data += message.data
            message.release()
        else:
            self._waiting.append(message)
        self.on_put()

    def put_first(self, message: Message) -> None:
        """One that goes past all others; whoever does so limits how many there are."""
        self._first.append(message)
        self.on_put()

    def _drop(self) -> None:
        """The oldest line, or what is left of it."""
        message = self._pop()
        self.dropped += message.lines
        self._untold += message.lines
        origin, last = message.origin, message.part.last
        message.release()
        kept = []
        while self._waiting and not last:
            message = self._pop()
            if message.origin is not origin:
                kept.append(message)
                continue
            last = message.part.last
            message.release()
        self._waiting.extendleft(reversed(kept))
        self._count(kept)
        if not last:
            self._dropping.add(origin)

    def _count(self, messages: list[Message]) -> None:
        """These wait again."""
        self._size += sum(message.size for message in messages)
        self._lines += sum(message.lines for message in messages)

    def _pop(self) -> Message:
        message = self._waiting.popleft()
        self._size -= message.size
        self._lines -= message.lines
        return message

    def take(self, size: int) -> list[Message]:
        """The next ones, of about this many bytes together, at least one. They belong to the caller."""
        found = list(self._first)
        self._first.clear()
        taken = 0
        if self._untold:
            self._add(found, self._ledger.message(NOTICE.format(self._untold).encode()))
            self._untold = 0
        while self._waiting and taken < size:
            message = self._pop()
            taken += message.size
            self._add(found, message)
        if found:
            self.on_room()
        return found

    def _add(self, found: list[Message], message: Message) -> None:
        """After what another one has begun, a line begins anyway."""
        if not self._ended and message.origin is not self._origin and self._drops:
            found.append(self._ledger.message(b"\n"))
        self._origin, self._ended = message.origin, message.ended
        found.append(message)

    def forget(self, origin: object) -> None:
        """Nothing more of an origin is sent, but for the rest of a line that has begun."""
        begun = not self._ended and self._origin is origin
        kept = []
        while self._waiting:
            message = self._pop()
            if message.origin is not origin or begun:
                kept.append(message)
                begun = begun and not (message.origin is origin and message.part.last)
            else:
                message.release()
        self._waiting.extend(kept)
        self._count(kept)
        self.on_room()

    def clear(self, *, urgent: bool = True) -> int:
        """Nothing of it is sent any more, but for what is urgent; how many lines of clients that were."""
        lines = sum(message.part.last and message.origin is not None for message in self._waiting)
        for message in self._waiting:
            message.release()
        self._waiting.clear()
        while urgent and self._first:
            self._first.popleft().release()
        self._size = self._lines = self._untold = 0
        self._dropping.clear()
        self._ended = True
        self.on_room()
        return lines
