# SPDX-License-Identifier: GPL-2.0-or-later
"""States for many clients: read and encoded once, and never waited for.

Clients with the same wish share a feed. At its rate, a feed compares the values with those before
and encodes the difference once; all feeds that are due at one moment share one reading of each
device. Each client has one slot for the newest state: a client that is slow finds a newer one there,
the skipped ones are counted, and it gets a whole state instead of a difference that would not fit
what it has. Only half a second's states, that the client has not answered for, are on their way: what the
kernel's buffers hold would be old when it is read. So the memory that a client may take does not
depend on how slow it is.
"""
from __future__ import annotations

import asyncio
import fnmatch
import functools
import json
import logging
import math
import re
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from .source import Source

FULL_S = 5.0                # after this time a whole state comes, though nothing was skipped
ANSWERS_MOST, ANSWER_BYTES_MOST = 64, 256 << 10
UNHEARD_MOST, UNHEARD_S = 8, 0.5        # states that a client has not answered for yet, or those of this time
PATTERNS_MOST = 32
WILDCARD = re.compile(r"[*?\[]")
NO_NAME = "no value is named '{}'; pokeysctl names lists the names"
BEAT_S = 0.01               # periods of feeds are multiples of it
WORK_S = 0.005              # of a beat; what takes longer leaves the rest to the next one
RATE_LEAST, RATE_MOST = 0.1, 50.0       # a second
_LOG = logging.getLogger("pokeys-gateway")
Status = dict[str, dict[str, Any] | None]


class Part(NamedTuple):
    """What is wanted of one device."""

    device: str
    names: tuple[str, ...] | None       # None: all of the state
    diagnostics: bool = False           # some of the names are of the diagnostics


Objects = tuple[Part, ...]
Read = Callable[[str, bool], dict[str, Any] | None]


@dataclass(frozen=True)
class Wish:
    """What a client wants to see, and how often. Feeds are shared by equal wishes."""

    objects: Objects
    beats: int                  # from one state to the next

    @classmethod
    def at(cls, rate: float, objects: Objects) -> Wish:
        """At most `rate` times a second, as often as the beats allow."""
        return cls(objects, math.ceil(1 / (rate * BEAT_S) - 1e-6))

    @property
    def rate(self) -> float:
        """States in a second."""
        return 1 / (self.beats * BEAT_S)


def encode(document: Any) -> str:
    """The one encoder of this gateway: what is not a number is not JSON."""
    return json.dumps(document, separators=(",", ":"), allow_nan=False)


def whole(source: Source, device: str, diagnostics: bool) -> dict[str, Any] | None:
    """A device with all of its values; None if it is not there."""
    reading = source.read(device, diagnostics=diagnostics)
    if not reading:
        return None
    values = reading.state.as_dict() if reading.state else {}
    if reading.diagnostics:
        values |= reading.diagnostics.as_dict()
    return {"connected": reading.connected, "reason": reading.reason, "values": values}


def look(read: Read, objects: Objects) -> Status:
    """What was asked for, of that which `read` gives."""
    found: Status = {}
    for part in objects:
        one = read(part.device, part.diagnostics)
        if one and part.names is not None:
            values = one["values"]
            one = one | {"values": {name: values[name] for name in part.names if name in values}}
        found[part.device] = one
    return found


async def expand(patterns: list[str] | None, known: dict[str, int]) -> tuple[str, ...] | None:
    """Names for patterns with the wildcards of fnmatch, in the order of `known`; None = all.

    Others have their turn after each pattern. ValueError for a pattern that fits nothing, or too many of them.
    """
    if patterns is None:
        return None
    names = {pattern for pattern in patterns if pattern in known}
    wild = set(patterns) - names
    longest = max(map(len, known))
    for pattern in wild:
        if len(pattern) > longest or not WILDCARD.search(pattern):
            raise ValueError(NO_NAME.format(pattern[:longest]))
    if len(wild) > PATTERNS_MOST:
        raise ValueError(f"at most {PATTERNS_MOST} names with wildcards")
    for pattern in wild:
        # not fnmatch.filter, which would keep 32768 of them for ever
        fits = list(filter(re.compile(fnmatch.translate(pattern)).match, known))
        if not fits:
            raise ValueError(NO_NAME.format(pattern))
        names.update(fits)
        await asyncio.sleep(0)
    return tuple(sorted(names, key=known.__getitem__))


def difference(before: Status, now: Status) -> Status:
    """What has changed; a device with nothing new is not in it."""
    found: Status = {}
    for device, one in now.items():
        last = before[device]
        if one is None or last is None:
            if one != last:
                found[device] = one and one | {"whole": True}
            continue
        part: dict[str, Any] = {key: one[key] for key in ("connected", "reason") if one[key] != last[key]}
        had = last["values"]
        if had.keys() != one["values"].keys():
            found[device] = one | {"whole": True}       # a client has to forget what it had
            continue
        values = {name: value for name, value in one["values"].items() if value != had[name]}
        if values:
            part["values"] = values
        if part:
            found[device] = part
    return found


class Tick:
    """One moment of a feed, encoded when the first client wants it."""

    def __init__(self, serial: int, status: Status, changed: Status, full: bool, read_at: float) -> None:
        self.serial = serial
        self.full = full
        self.time = read_at         # seconds since 1970
        self._status, self._changed = status, changed
        self._texts: dict[bool, str] = {}

    def text(self, whole: bool) -> str:
        """The notification: all values, or those that differ from the tick before."""
        if whole not in self._texts:
            status = self._status if whole else self._changed
            self._texts[whole] = encode({"jsonrpc": "2.0", "method": "notify_status_update", "params": [
                status, self.time, {"serial": self.serial, "full": whole}]})
        return self._texts[whole]


class Subscriber:
    """What waits to be sent to one client: answers in their order, and the newest state."""

    def __init__(self, count_skipped: Callable[[], None] = lambda: None) -> None:
        self.skipped = 0
        self._count_skipped = count_skipped
        self._answers: deque[str] = deque()
        self._size = 0              # of the answers
        self._slot: Tick | None = None
        self._other: Callable[[], str] | None = None
        self._other_was_last = False
        self._last: int | None = None
        self._ended = False
        self._sent = 0              # states
        self.heard = 0              # of these, the client has read
        self.window = UNHEARD_MOST  # so many may be on their way
        self._wake, self._room = asyncio.Event(), asyncio.Event()

    def begin(self, serial: int | None) -> None:
        """It has the whole state of this serial number; None: it has none."""
        self._slot, self._last = None, serial

    @property
    def lacks(self) -> bool:
        """It has no state that a difference fits, and none waits for it."""
        return self._last is None and not self._slot

    def offer(self, tick: Tick) -> None:
        """A newer state. Never waits."""
        if self._slot:
            self.skipped += 1
            self._count_skipped()
        self._slot = tick
        self._wake.set()

    def offer_other(self, fetch: Callable[[], str]) -> None:
        """Another state, which is fetched when the client has room for it. Never waits."""
        self._other = fetch
        self._wake.set()

    @property
    def waiting(self) -> int:
        """How many messages wait to be sent."""
        return len(self._answers) + bool(self._slot) + bool(self._other)

    @property
    def full(self) -> bool:
        """So much waits that no more requests are to be read."""
        return len(self._answers) >= ANSWERS_MOST or self._size >= ANSWER_BYTES_MOST

    def answer(self, text: str) -> None:
        """An answer to a request; see :attr:`full`."""
        self._answers.append(text)
        self._size += len(text)
        self._wake.set()

    def hear(self, number: int) -> None:
        """The client has read the state of this number, see :meth:`next`."""
        if self.heard < number <= self._sent:
            self.heard = number
            self._wake.set()

    @property
    def unheard(self) -> int:
        """States that are on their way."""
        return self._sent - self.heard

    def end(self) -> None:
        """Nothing is sent any more."""
        self._ended = True
        self._room.set()

    async def room(self) -> None:
        """Wait until more may be answered. ConnectionResetError if nothing is sent any more."""
        while self.full and not self._ended:
            self._room.clear()
            await self._room.wait()
        if self._ended:
            raise ConnectionResetError

    async def next(self) -> tuple[str, int | None]:
        """The next text to be sent, and if it is a state, its number. Answers come first."""
        while not self._answers and not ((self._slot or self._other) and self.unheard < self.window):
            self._wake.clear()
            await self._wake.wait()
        if self._answers:
            text = self._answers.popleft()
            self._size -= len(text)
            self._room.set()
            return text, None
        # on a slow way, there is always one of each
        self._other_was_last = not self._slot or (bool(self._other) and not self._other_was_last)
        self._sent += 1
        if self._other_was_last:
            assert self._other
            fetch, self._other = self._other, None
            return fetch(), self._sent
        tick, self._slot = self._slot, None
        assert tick
        whole = tick.full or self._last is None or tick.serial != self._last + 1
        self._last = tick.serial
        return tick.text(whole), self._sent


class Feed:
    """The states of one wish. Belongs to the event loop's thread."""

    def __init__(self, wish: Wish, status: Status, clock: Callable[[], float] = time.monotonic) -> None:
        self.wish = wish
        self.serial = 0
        self.due = 0                # the beat of the next state
        self.status = status
        self.subscribers: set[Subscriber] = set()
        self._clock = clock
        self._full_at = clock() + FULL_S

    def wait(self, now: int) -> None:
        """It is due at the next of its beats; equal rates are due together, what was missed is skipped."""
        self.due = now - now % self.wish.beats + self.wish.beats

    def tick(self, now: Status) -> Tick | None:
        """Take the values of this moment. None if nothing has changed and no whole state is due."""
        changed = difference(self.status, now)
        full = self._clock() >= self._full_at
        self.status = now
        # who has joined in between may have been shown a value that is gone again
        full = full or (not changed and any(one.lacks for one in self.subscribers))
        if not changed and not full:
            return None
        if full:
            self._full_at = self._clock() + FULL_S
        self.serial += 1
        return Tick(self.serial, now, changed, full, time.time())


class Feeds:
    """All feeds, by their wish, and the timer that they share. A feed ends with its last subscriber."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._feeds: dict[Wish, Feed] = {}
        self._timer: asyncio.TimerHandle | None = None

    def join(self, wish: Wish, subscriber: Subscriber) -> tuple[Feed, Status]:
        """Subscribe: the feed, and the state of this moment."""
        status = look(functools.partial(whole, self._source), wish.objects)
        feed = self._feeds.get(wish)
        if feed:
            # its next difference may be to an older state than this one
            subscriber.begin(feed.serial if status == feed.status else None)
        else:
            feed = Feed(wish, status)
            feed.wait(self._now())
            self._feeds[wish] = feed
            subscriber.begin(feed.serial)
            if not self._timer or feed.due * BEAT_S < self._timer.when():
                self._plan()
        feed.subscribers.add(subscriber)
        subscriber.window = max(UNHEARD_MOST, math.ceil(wish.rate * UNHEARD_S))
        return feed, status

    def leave(self, feed: Feed, subscriber: Subscriber) -> None:
        """End a subscription."""
        feed.subscribers.discard(subscriber)
        subscriber.begin(None)
        if not feed.subscribers and self._feeds.get(feed.wish) is feed:
            del self._feeds[feed.wish]
            if not self._feeds:
                self._plan()

    def __len__(self) -> int:
        return len(self._feeds)

    def close(self) -> None:
        """End all."""
        self._feeds.clear()
        self._plan()

    @staticmethod
    def _now() -> int:
        return int(asyncio.get_running_loop().time() / BEAT_S)

    def _plan(self, soonest: float = 0.0) -> None:
        if self._timer:
            self._timer.cancel()
            self._timer = None
        if self._feeds:
            due = min(feed.due for feed in self._feeds.values()) * BEAT_S
            self._timer = asyncio.get_running_loop().call_at(max(due, soonest), self._beat)

    def _beat(self) -> None:
        clock = asyncio.get_running_loop().time
        now, end_at = self._now(), clock() + WORK_S
        read = functools.cache(functools.partial(whole, self._source))
        done: list[Feed] = []
        failed: set[Wish] = set()
        for feed in sorted((feed for feed in self._feeds.values() if feed.due <= now), key=lambda feed: feed.due):
            if done and clock() > end_at:
                break
            done.append(feed)
            try:
                if tick := feed.tick(look(read, feed.wish.objects)):
                    for one in feed.subscribers:
                        one.offer(tick)
            except Exception:
                _LOG.exception("reading for clients")
                failed.add(feed.wish)
        after = self._now()
        for feed in done:
            feed.wait(after + (int(FULL_S / BEAT_S) if feed.wish in failed else 0))
        # however late it is, others get their turn
        self._plan(clock() + BEAT_S / 2)
