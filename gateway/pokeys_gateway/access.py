# SPDX-License-Identifier: GPL-2.0-or-later
"""Who may do what: users with passwords, sessions, and tickets for WebSockets.

Without a file of users, everybody on this computer may read. With one, even an empty one, nobody may
read without a log-in, wherever they come from, unless guests are allowed. Passwords are kept as
scrypt makes them; it takes 32 MB and a tenth of a second on purpose, so one is checked at a time, in
another thread, and an address has few attempts.
"""
from __future__ import annotations

import asyncio
import base64
import binascii
import hashlib
import hmac
import os
import re
import secrets
import time
from collections import Counter, OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from .gate import is_loopback

LEVELS = "guest", "user", "admin"       # may read, operate, configure
LOG2_N, R, P, SALT, KEY = 15, 8, 1, 16, 32
MEMORY_MOST = 64 << 20
PASSWORD_LEAST, PASSWORD_MOST = 8, 256
ATTEMPTS, OF_AN_ADDRESS, WINDOW_S = 5, 10, 60.0     # log-ins a minute
WAITING_MOST = 8            # log-ins that are being checked
SESSION_S, KNOWN_S, TICKET_S = 12 * 3600.0, 300.0, 30.0
SESSIONS_MOST, ADDRESSES_MOST = 256, 1024
NAME_MOST = 32
NAME = re.compile(r"[a-z_][a-z0-9_-]{0,31}")
_SECRET = re.compile(r"scrypt\$(\d{1,2})\$(\d{1,2})\$(\d{1,2})\$([A-Za-z0-9+/=]+)\$([A-Za-z0-9+/=]+)")


@dataclass(frozen=True)
class User:
    """A user as the file has it."""

    name: str
    level: str
    secret: str


@dataclass(frozen=True)
class Who:
    """Whose request it is."""

    user: User | None = None    # None: a guest
    session: bytes = b""    # its digest; b"": the client shows name and password each time

    @property
    def name(self) -> str:
        """The user's; "" is a guest."""
        return self.user.name if self.user else ""

    @property
    def level(self) -> str:
        """One of LEVELS."""
        return self.user.level if self.user else LEVELS[0]


class Denied(Exception):
    """No such user, or another password."""


class TooMany(Exception):
    """Too many attempts; `after` is when to try again, in seconds."""

    def __init__(self, after: float) -> None:
        super().__init__(f"too many log-ins; try again in {after:.0f} s")
        self.after = after


# ---- passwords

def _scrypt(password: str, salt: bytes, log2_n: int, r: int, p: int) -> bytes:
    return hashlib.scrypt(password.encode("utf-8", "surrogatepass"), salt=salt, n=1 << log2_n, r=r, p=p,
                          maxmem=MEMORY_MOST, dklen=KEY)


def make_secret(password: str) -> str:
    """What the file keeps of a password. ValueError says what is allowed."""
    if not PASSWORD_LEAST <= len(password) <= PASSWORD_MOST:
        raise ValueError(f"a password has {PASSWORD_LEAST} to {PASSWORD_MOST} characters")
    salt = secrets.token_bytes(SALT)
    words = (base64.b64encode(part).decode() for part in (salt, _scrypt(password, salt, LOG2_N, R, P)))
    return f"scrypt${LOG2_N}${R}${P}${'$'.join(words)}"


def _parts(secret: str) -> tuple[int, int, int, bytes, bytes]:
    """ValueError if it is none, or needs more memory than there is for it."""
    found = _SECRET.fullmatch(secret)
    if not found:
        raise ValueError
    log2_n, r, p = int(found[1]), int(found[2]), int(found[3])
    try:
        salt, key = base64.b64decode(found[4], validate=True), base64.b64decode(found[5], validate=True)
    except binascii.Error:
        raise ValueError from None
    if not 1 <= log2_n <= 20 or not 1 <= r <= 16 or not 1 <= p <= 4 or 128 * r << log2_n > MEMORY_MOST // 2 or \
            len(key) != KEY:
        raise ValueError
    return log2_n, r, p, salt, key


def fits(secret: str, password: str) -> bool:
    """Is it the password? Takes a tenth of a second, whatever it is."""
    log2_n, r, p, salt, key = _parts(secret)
    return hmac.compare_digest(_scrypt(password[:PASSWORD_MOST + 1], salt, log2_n, r, p), key)


# ---- the file of users

def parse_users(text: str) -> tuple[dict[str, User], list[tuple[int, str]]]:
    """The users of a file, and what is wrong with it: line and text."""
    users: dict[str, User] = {}
    faults = []
    for number, line in enumerate(text.split("\n"), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        parts = line.strip().split(":")
        if len(parts) != 3 or not NAME.fullmatch(parts[0]) or parts[1] not in LEVELS:
            faults.append((number, f"expected NAME:LEVEL:SECRET, the level one of {', '.join(LEVELS)}; "
                                   "pokeys-gateway --set-user writes such lines"))
            continue
        try:
            _parts(parts[2])
        except ValueError:
            faults.append((number, "the secret is not one that pokeys-gateway --set-user has written"))
            continue
        if parts[0] in users:
            faults.append((number, f"{parts[0]} is there already"))
        users[parts[0]] = User(*parts)
    return users, faults


def write_users(path: Path, users: dict[str, User], owner: tuple[int, int] | None) -> None:
    """Write the file again, for its owner and group alone; who reads it meanwhile has the old one. OSError."""
    path = path.resolve()
    new = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        with open(os.open(new, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600), "w", encoding="utf-8") as file:
            if owner:
                os.fchown(file.fileno(), *owner)
                os.fchmod(file.fileno(), 0o640)
            file.write("# Users of pokeys-gateway: NAME:LEVEL:SECRET. Change it with pokeys-gateway --set-user.\n")
            file.writelines(f"{user.name}:{user.level}:{user.secret}\n" for user in users.values())
            file.flush()
            os.fsync(file.fileno())
        new.replace(path)
    except OSError:
        new.unlink(missing_ok=True)
        raise


# ---- who is there

class _Few:
    """Attempts in the last minute, of an address, and of a user there."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._of: OrderedDict[tuple[str, str], deque[float]] = OrderedDict()

    def take(self, address: str, name: str) -> Callable[[], None]:
        """One more. :class:`TooMany`. What is returned gives it back: it was the right password."""
        now = self._clock()
        found = []
        keys = [((address, name[:NAME_MOST]), ATTEMPTS)]
        if not is_loopback(address):
            # here, a program with a wrong password would keep out everybody
            keys.append(((address, ""), OF_AN_ADDRESS))
        for key, most in keys:
            times = self._of.setdefault(key, deque())
            self._of.move_to_end(key)
            while times and times[0] <= now - WINDOW_S:
                times.popleft()
            if len(times) >= most:
                raise TooMany(times[0] + WINDOW_S - now)
            found.append(times)
        for times in found:
            times.append(now)
        while len(self._of) > ADDRESSES_MOST:
            self._of.popitem(last=False)

        def give_back() -> None:
            for times in found:
                if now in times:
                    times.remove(now)
        return give_back


class Access:
    """Users, sessions and tickets. Belongs to the event loop's thread."""

    def __init__(self, users: dict[str, User] | None, guests: bool,
                 clock: Callable[[], float] = time.monotonic) -> None:
        self.users = users or {}
        self._closed = users is not None
        self.denied = 0
        self._guests = guests
        self._clock = clock
        self._few = _Few(clock)
        self._checking = asyncio.Semaphore(1)
        self._waiting = 0
        # attempts that are being checked; the same one again is no other
        self._together: dict[bytes, asyncio.Future[Who]] = {}
        self._pepper = secrets.token_bytes(32)
        self._nobody = make_secret(secrets.token_urlsafe())
        # by what a client shows: who it is, and until when. Only digests are kept.
        self._sessions: OrderedDict[bytes, tuple[Who, float]] = OrderedDict()
        self._known: OrderedDict[bytes, tuple[Who, float]] = OrderedDict()
        self._tickets: OrderedDict[bytes, tuple[Who, float]] = OrderedDict()

    @property
    def required(self) -> bool:
        """Do clients have to log in to read?"""
        return self._closed and not self._guests

    @property
    def anybody(self) -> Who | None:
        """Who somebody is that has not logged in; None: nobody."""
        return None if self.required else Who()

    def reload(self, users: dict[str, User] | None) -> None:
        """Take other users. Those that are gone, or have changed, have to log in again."""
        # what was closed is not opened by a file that was lost
        self._closed = self._closed or users is not None
        self.users = users or {}
        for table in self._sessions, self._known, self._tickets:
            for token in [token for token, (who, _) in table.items() if self.users.get(who.name) != who.user]:
                del table[token]

    def holds(self, who: Who) -> bool:
        """Is this still true of a connection that is open?"""
        if not who.name:
            return not self.required
        if who.session and self._sessions.get(who.session, (None, 0.0))[1] < self._clock():
            return False
        return self.users.get(who.name) == who.user

    def left(self, who: Who | None) -> float:
        """How long a session goes on without requests, in seconds; whoever has none needs none."""
        return self._sessions[who.session][1] - self._clock() if who and who.session in self._sessions else SESSION_S

    async def log_in(self, name: str, password: str, address: str) -> tuple[str, Who]:
        """A session's token. :class:`Denied`, :class:`TooMany`."""
        who = await self.check(name, password, address)
        token = secrets.token_urlsafe(32)
        who = replace(who, session=self._digest(token))
        self._keep(self._sessions, token, who, SESSION_S)
        return token, who

    async def basic(self, header: str, address: str) -> Who:
        """Who an Authorization header is from (RFC 7617). :class:`Denied`, :class:`TooMany`."""
        kind, _, text = header.partition(" ")
        try:
            name, colon, password = base64.b64decode(text.strip(), validate=True).decode().partition(":")
        except (binascii.Error, UnicodeDecodeError):
            raise Denied from None
        if kind.lower() != "basic" or not colon:
            raise Denied
        shown = f"{name}:{password}"
        # Prometheus asks every few seconds
        if who := self._find(self._known, shown):
            return who
        who = await self.check(name, password, address)
        self._keep(self._known, shown, who, KNOWN_S)
        return who

    def session(self, token: str) -> Who | None:
        """Whose session it is. It goes on as long as it is used."""
        who = self._find(self._sessions, token)
        if who:
            self._keep(self._sessions, token, who, SESSION_S)
        return who

    def log_out(self, token: str) -> None:
        """End a session."""
        self._sessions.pop(self._digest(token), None)

    def ticket(self, who: Who) -> str:
        """What opens one WebSocket, within half a minute."""
        token = secrets.token_urlsafe(32)
        self._keep(self._tickets, token, who, TICKET_S)
        return token

    def redeem(self, ticket: str) -> Who | None:
        """Whose ticket it was."""
        who = self._find(self._tickets, ticket)
        self._tickets.pop(self._digest(ticket), None)
        return who

    async def check(self, name: str, password: str, address: str) -> Who:
        """An attempt, or the same one that another request makes at this moment. :class:`Denied`, :class:`TooMany`."""
        key = self._digest(repr((name, password, address)))

        def end(done: asyncio.Future[Who]) -> None:
            del self._together[key]
            if not done.cancelled():
                done.exception()        # seen, also if nobody waits any more
        if key not in self._together:
            self._together[key] = asyncio.ensure_future(self._attempt(name, password, address))
            self._together[key].add_done_callback(end)
        # a request that is given up does not end it for the others
        return await asyncio.shield(self._together[key])

    async def _attempt(self, name: str, password: str, address: str) -> Who:
        if self._waiting >= WAITING_MOST:
            raise TooMany(1)
        give_back = self._few.take(address, name)
        user = self.users.get(name)
        self._waiting += 1
        try:
            async with self._checking:
                # the same work for a user that is not there
                good = await asyncio.to_thread(fits, user.secret if user else self._nobody, password)
        finally:
            self._waiting -= 1
        # it may have changed meanwhile
        if not good or not user or self.users.get(name) != user:
            self.denied += 1
            raise Denied
        give_back()
        return Who(user)

    def _digest(self, token: str) -> bytes:
        return hmac.digest(self._pepper, token.encode("utf-8", "surrogatepass"), "sha256")

    def _keep(self, table: OrderedDict[bytes, tuple[Who, float]], token: str, who: Who, seconds: float) -> None:
        key = self._digest(token)
        table[key] = who, self._clock() + seconds
        table.move_to_end(key)
        if len(table) > SESSIONS_MOST:
            # who asks for many loses its own, and nobody else's
            most = Counter(one.name for one, _ in table.values()).most_common(1)[0][0]
            del table[next(old for old, (one, _) in table.items() if one.name == most)]

    def _find(self, table: OrderedDict[bytes, tuple[Who, float]], token: str) -> Who | None:
        key = self._digest(token)
        who, until = table.get(key, (None, 0.0))
        if who and until < self._clock():
            del table[key]
            return None
        return who
