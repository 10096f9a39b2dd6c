# SPDX-License-Identifier: GPL-2.0-or-later
"""The control socket's server: what users of this computer ask of the proxy itself.

It runs in the proxy's loop and never waits. A peer that sends too long a line, or does not take its answers, is
disconnected. Root and the user of the proxy may do everything, because they could do the same without it; the
configuration lists who else may operate LinuxCNC.
"""
from __future__ import annotations

import array
import contextlib
import fcntl
import functools
import json
import math
import os
import select
import selectors
import socket
import termios
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from . import lines
from .component import Refused
from .sparing import CLIENTS

PEERS_MOST = 64             # of a user
LINES_TURN = 8              # requests of a peer in a turn of the loop
DEAF = 1.0                  # s without new peers, when the system gives none
PARSE_ERROR, INVALID_REQUEST, NO_METHOD, INVALID_PARAMS = -32700, -32600, -32601, -32602


@dataclass(eq=False)
class Peer:
    """A connection."""

    connection: socket.socket
    user: int
    read: bytes = b""
    stale: int = 0                      # bytes of it and of what the kernel has that came before somebody's stop
    open: bool = True

    @property
    def gone(self) -> bool:
        """Has the other end closed it, whatever it has sent before?"""
        hang_up = select.poll()
        hang_up.register(self.connection, 0)
        return not self.open or bool(hang_up.poll(0))

    def sent(self) -> int:
        """Bytes that were not obeyed yet."""
        waiting = array.array("i", [0])
        with contextlib.suppress(OSError):
            fcntl.ioctl(self.connection, termios.FIONREAD, waiting)
        return len(self.read) + waiting[0]

    def send(self, message: dict[str, Any]) -> None:
        """At once, or never: a peer that does not read is one that is not there."""
        if not self.open:
            return
        data = lines.line(message)
        with contextlib.suppress(OSError):
            if self.connection.send(data) == len(data):
                return
        self.open = False

    def fail(self, identity: Any, code: int, text: str) -> None:
        """Answer with an error."""
        self.send({"id": identity, "error": {"code": code, "message": text}})


@dataclass(eq=False)
class Call:
    """A request whose form is right. It is answered once, now or later."""

    peer: Peer
    name: str
    identity: Any
    params: dict[str, Any]
    stale: bool = False                 # somebody's stop came after it was sent

    @property
    def open(self) -> bool:
        """Does anybody wait for the answer?"""
        return self.peer.open

    def answer(self) -> None:
        """It is done."""
        self.peer.send({"id": self.identity, "result": True})

    def refuse(self, text: str, code: int = lines.REFUSED) -> None:
        """It is not done, and why."""
        self.peer.fail(self.identity, code, text)


@dataclass(frozen=True)
class Method:
    """What can be asked for. ``run`` answers the call, or keeps it; or it raises :class:`Refused`."""

    run: Callable[[Call, float], None]
    params: Mapping[str, type]
    operates: bool = False              # is it for those who may only operate as well?


@dataclass(eq=False)
class Control:
    """Serves the peers of a listening socket. ``operators`` are the numbers of users who may only operate."""

    listener: socket.socket
    operators: frozenset[int] = frozenset()
    methods: dict[str, Method] = field(default_factory=dict)
    peers: set[Peer] = field(default_factory=set)

    def __post_init__(self) -> None:
        self._selector = selectors.EpollSelector()
        self._deaf_until = -math.inf
        self._listens = self._late = False
        self._listen(-math.inf)

    def fileno(self) -> int:
        """Readable when :meth:`serve` has something to do."""
        return self._selector.fileno()

    def serve(self, now: float) -> None:
        """Take new peers and answer requests."""
        self._listen(now)
        # new peers last: those that are gone make room for them
        for key, _ in sorted(self._selector.select(0), key=lambda ready: ready[0].fileobj is self.listener):
            key.data(now)
        for peer in [peer for peer in self.peers if not peer.open]:
            self._drop(peer)

    def watch(self, readable: socket.socket, call: Callable[[float], Any]) -> None:
        """Call it in :meth:`serve` when there is something to read."""
        self._selector.register(readable, selectors.EVENT_READ, call)

    def unwatch(self, readable: socket.socket) -> None:
        """Before it is closed."""
        self._selector.unregister(readable)

    def pass_over(self, stopping: Peer, now: float) -> None:
        """What all others have sent until now came before a stop, although it was not read yet."""
        self._accept_all(now)
        # the system may just have refused a file for one of them
        self._late = not self._listens
        for peer in self.peers:
            if peer is not stopping:
                peer.stale = peer.sent()

    def close(self) -> None:
        """All peers see the end of their connections."""
        for peer in list(self.peers):
            self._drop(peer)
        self._selector.close()

    def _listen(self, now: float) -> None:
        """Take new peers, unless the system gave none just now."""
        if not self._listens and now >= self._deaf_until:
            self.watch(self.listener, self._accept)
            self._listens = True
            if self._late:
                # a stop came while nobody could connect
                self._accept_all(now)
                self._late = False

    def _accept_all(self, now: float) -> None:
        """All that the kernel has at this time; who connects on and on keeps nobody waiting."""
        for _ in range(lines.BACKLOG + 1):
            if not self._accept(now):
                break

    def _accept(self, now: float) -> bool:
        """False if there is none."""
        if not self._listens:
            return False                # a stop in this turn has found that the system gives none
        try:
            made, _ = self.listener.accept()
        except (BlockingIOError, ConnectionAbortedError):
            return False                # it is gone already
        except OSError as error:
            # without files or memory, the same would happen in each turn
            CLIENTS.error("the control socket takes no connections for %.0f s: %s", DEAF, error.strerror)
            self._deaf_until = now + DEAF
            self._listens = False
            self.unwatch(self.listener)
            return False
        made.setblocking(False)
        process, user = lines.peer(made)
        peer = Peer(made, user)
        if not _owns(user) and user not in self.operators:
            CLIENTS.warning("process %d of user %d may not use the control socket", process, user)
            peer.fail(None, lines.REFUSED, f"user {user} may not command the proxy of user {os.geteuid()}")
        elif sum(one.open and one.user == user for one in self.peers) >= PEERS_MOST:
            peer.fail(None, lines.BUSY, f"{PEERS_MOST} connections are open already, which is the most")
        else:
            self.peers.add(peer)
            if self._late:
                peer.stale = peer.sent()
            self.watch(made, functools.partial(self._hear, peer))
            return True
        made.close()
        return True

    def _drop(self, peer: Peer) -> None:
        peer.open = False
        self.peers.discard(peer)
        self.unwatch(peer.connection)
        peer.connection.close()

    def _hear(self, peer: Peer, now: float) -> None:
        try:
            data = self._some(peer)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            peer.open = False
            return
        *whole, peer.read = (peer.read + data).split(b"\n")
        # only the first one can be too long, because no more is read at once
        if len((*whole, peer.read)[0]) >= lines.LINE_MOST:
            peer.fail(None, INVALID_REQUEST, f"a line has at most {lines.LINE_MOST} bytes")
            peer.open = False
            return
        for one in whole:
            stale = peer.stale > 0
            peer.stale = max(0, peer.stale - len(one) - 1)
            # also if it takes no answers any more: it may be a stop
            if not self._answer(peer, one, stale, now):
                return

    @staticmethod
    def _some(peer: Peer) -> bytes:
        """What it sent, up to so many lines; the rest has to wait in the kernel for the next turn."""
        seen = peer.connection.recv(lines.LINE_MOST, socket.MSG_PEEK)
        *whole, _ = seen.split(b"\n", LINES_TURN)
        some = sum(len(one) + 1 for one in whole) if len(whole) == LINES_TURN else len(seen)
        return peer.connection.recv(some) if some else b""

    def _answer(self, peer: Peer, data: bytes, stale: bool, now: float) -> bool:
        """False if no more is to be read from it."""
        try:
            request = json.loads(data)
        except (ValueError, RecursionError):
            peer.fail(None, PARSE_ERROR, "this is not JSON")
            peer.open = False           # a flood of short lines would be work for a long time
            return False
        identity = request.get("id") if isinstance(request, dict) else None
        if not isinstance(request, dict) or request.get("jsonrpc") != "2.0" or not isinstance(identity, int | str):
            peer.fail(None, INVALID_REQUEST, "this is not a request of JSON-RPC 2.0 with an id")
            return True
        name, params = request.get("method"), request.get("params", {})
        method = self.methods.get(name) if isinstance(name, str) else None
        if not method:
            peer.fail(identity, NO_METHOD, f"there is no such method; there are {', '.join(self.methods)}")
        elif not isinstance(params, dict) or not _fit(params, method.params):
            wanted = ", ".join(f"{key} ({kind.__name__})" for key, kind in method.params.items())
            peer.fail(identity, INVALID_PARAMS, f"{name} needs exactly these parameters: {wanted}")
        elif not method.operates and not _owns(peer.user):
            peer.fail(identity, lines.REFUSED, f"user {peer.user} may operate LinuxCNC, and nothing else")
        else:
            call = Call(peer, str(name), identity, params, stale)
            try:
                method.run(call, now)
            except Refused as refused:
                call.refuse(str(refused))
        return True


def _owns(user: int) -> bool:
    return user in (0, os.geteuid())


def _fit(params: Mapping[str, Any], wanted: Mapping[str, type]) -> bool:
    # JSON has one type of number
    return params.keys() == wanted.keys() and all(
        type(params[key]) is kind or (kind is float and type(params[key]) is int) for key, kind in wanted.items())
