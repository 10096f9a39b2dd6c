# SPDX-License-Identifier: GPL-2.0-or-later
"""Who is connected to the command socket.

A ROUTER socket does not say when a client leaves. ZeroMQ's heartbeats end a connection whose other side does
not answer, be it that its process, its computer or the network is gone; the socket's monitor reports the end,
with the number of the connection's file; and each message has this number too.

What a client sends just after its connection was made may be old: its library keeps messages while there is
no connection. Such settings are not obeyed, unless the client bound on this connection.
"""
from __future__ import annotations

import contextlib
import os
import socket
from typing import Any

import zmq
from zmq.utils.monitor import recv_monitor_message

from .component import Client
from .sparing import CLIENTS

HEARTBEAT, HEARTBEAT_LIMIT = 500, 1500      # ms
SETTLE = 0.5                # s after a connection's first message
CLIENTS_MOST = 64
_EVENTS = zmq.EVENT_ACCEPTED | zmq.EVENT_DISCONNECTED


def watch(connection: zmq.Socket[bytes]) -> None:
    """Let ZeroMQ end connections whose other side does not answer. Before the socket is bound."""
    connection.setsockopt(zmq.HEARTBEAT_IVL, HEARTBEAT)
    connection.setsockopt(zmq.HEARTBEAT_TIMEOUT, HEARTBEAT_LIMIT)


class Clients:
    """The clients of a ROUTER socket."""

    def __init__(self, router: zmq.Socket[bytes], named: bool) -> None:
        """They are ``named`` if each is known by its key."""
        self._named = named
        self.monitor = router.get_monitor_socket(_EVENTS)
        self._open: set[int] = set()
        self._clients: dict[bytes, Client] = {}
        self._files: dict[bytes, int] = {}

    def gone(self) -> list[Client]:
        """Clients whose connections have ended since the last call."""
        found = []
        with contextlib.suppress(zmq.Again):
            while True:
                event = recv_monitor_message(self.monitor, zmq.NOBLOCK)
                number = event["value"]
                if event["event"] == zmq.EVENT_ACCEPTED:
                    self._open.add(number)
                    continue
                self._open.discard(number)
                for identity in [one for one, file in self._files.items() if file == number]:
                    del self._files[identity]
                    found.append(self._clients.pop(identity))
        return found

    def has(self, client: Client) -> bool:
        """Is it one of these?"""
        return self._clients.get(client.identity) is client

    def knows(self, frames: list[zmq.Frame]) -> bool:
        """Is a message from a client whose messages came before?"""
        return frames[0].bytes in self._clients

    def of(self, frames: list[zmq.Frame], now: float) -> Client | None:
        """Who sent a message; None for one whose connection has ended, and for one too many. After :meth:`gone`."""
        identity = frames[0].bytes
        try:
            number = int(frames[-1].get(zmq.SRCFD))
        except zmq.ZMQError:
            return None                 # it had ended when it began
        client = self._clients.get(identity)
        if not client:
            if number not in self._open:
                return None
            if len(self._clients) >= CLIENTS_MOST:
                CLIENTS.warning("a client at %s gets no answers: there are %d already", _place(number), CLIENTS_MOST)
                return None
            place = _place(number) + (_name(frames[-1]) if self._named else "")
            client = self._clients[identity] = Client(identity, now, now, place)
        self._files[identity] = number
        client.seen = now
        return client


def settled(client: Client, now: float) -> bool:
    """Is what it sends new?"""
    return now - client.since >= SETTLE


def _name(frame: zmq.Frame) -> str:
    """Of a client that is known by its key."""
    properties: Any = frame             # whose values are numbers or texts
    return f" ({properties.get('User-Id')})"


def _place(number: int) -> str:
    """Where a connection comes from, for the log."""
    try:
        with socket.socket(fileno=os.dup(number)) as end:
            peer = end.getpeername()
            return f"{peer[0].removeprefix('::ffff:')}:{peer[1]}" if isinstance(peer, tuple) else "a unix socket"
    except OSError:
        return "a connection that has ended"
