# SPDX-License-Identifier: GPL-2.0-or-later
"""The sockets of the protocol: those of this computer, and those of the network, which are encrypted.

A socket of ZeroMQ is either one or the other, so there are two sets of them. Who may connect to those of the network
is asked over ZAP (ZeroMQ RFC 27), before a message of the client is read.
"""
from __future__ import annotations

import contextlib
from dataclasses import dataclass

import zmq

from .clients import Clients, watch
from .config import Secure
from .keys import Known
from .message import MOST
from .sparing import CLIENTS

HANDSHAKE = 3000            # ms that a connection may take until its client is known
DOMAIN = b"pokeys-remote"
ZAP_ENFORCE_DOMAIN = 93     # zmq_setsockopt(3); the module has no name for it
QUESTIONS = 64              # that are answered in a turn
ZAP = "inproc://zeromq.zap.01"


@dataclass(eq=False)
class Way:
    """One set of sockets."""

    router: zmq.Socket[bytes]
    publisher: zmq.Socket[bytes]        # of components
    watched: zmq.Socket[bytes]          # of groups
    clients: Clients
    places: tuple[tuple[zmq.Socket[bytes], tuple[str, ...]], ...]

    @property
    def readable(self) -> tuple[zmq.Socket[bytes], ...]:
        """For a poller."""
        return self.router, self.publisher, self.watched, self.clients.monitor

    def close(self) -> None:
        """Nobody is connected any more."""
        for one in (self.clients.monitor, self.router, self.publisher, self.watched):
            one.close()


def make(context: zmq.Context[zmq.Socket[bytes]], command: tuple[str, ...], update: tuple[str, ...],
         group: tuple[str, ...], secure: Secure | None = None) -> Way:
    """Sockets for these places, where they listen when the caller binds them."""
    router, publisher, watched = (_socket(context, kind, secure) for kind in (zmq.ROUTER, zmq.XPUB, zmq.XPUB))
    return Way(router, publisher, watched, Clients(router, named=secure is not None),
               ((router, command), (publisher, update), (watched, group)))


def _socket(context: zmq.Context[zmq.Socket[bytes]], kind: int, secure: Secure | None) -> zmq.Socket[bytes]:
    made = context.socket(kind)
    made.setsockopt(zmq.LINGER, 0)
    made.setsockopt(zmq.MAXMSGSIZE, MOST)
    made.setsockopt(zmq.IPV6, 1)
    made.setsockopt(zmq.HANDSHAKE_IVL, HANDSHAKE)
    watch(made)
    if secure:
        made.setsockopt(zmq.CURVE_SERVER, 1)
        made.setsockopt(zmq.CURVE_SECRETKEY, secure.secret)
        made.setsockopt(zmq.ZAP_DOMAIN, DOMAIN)
        # without an answer of ours, nobody is let in
        made.setsockopt(ZAP_ENFORCE_DOMAIN, 1)
    return made


class Doorman:
    """Answers ZeroMQ's questions who may connect to the sockets of the network."""

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], known: Known) -> None:
        self.socket = context.socket(zmq.REP)
        self.socket.setsockopt(zmq.LINGER, 0)
        self.socket.bind(ZAP)
        self._known = known

    def serve(self) -> None:
        """Answer questions that are there."""
        with contextlib.suppress(zmq.Again):
            for _ in range(QUESTIONS):
                self._answer(self.socket.recv_multipart(zmq.NOBLOCK))

    def _answer(self, question: list[bytes]) -> None:
        version, number, _domain, address, _identity, mechanism, *credentials = question
        name = self._known.name(credentials[0]) if mechanism == b"CURVE" and credentials else None
        where = address.decode(errors="replace").removeprefix("::ffff:")
        if name is None:
            CLIENTS.warning("a client at %s is refused: its key is not in %s", where, self._known.folder)
        # a temporary error, after which a client tries again: its key may be brought meanwhile
        status = (b"300", b"the key is not known", b"") if name is None else (b"200", b"", name.encode())
        self.socket.send_multipart([version, number, *status, b""])
