# SPDX-License-Identifier: GPL-2.0-or-later
"""The proxy's loop: sockets on one side, HAL's components on the other.

The loop waits for its sockets and for the next look at the pins, and for nothing else. If it could not run for a
while, nobody looked after the leases, and the requests that wait in its socket are old: all leases have lapsed,
and what was to be set is not set any more.
"""
from __future__ import annotations

import contextlib
import logging
import math
import socket
import time
from collections.abc import Callable

import zmq
from pokeys_machinetalk_pb2 import Container

from .clients import SETTLE, Clients, watch
from .config import Config
from .control import Control
from .halfile import HalFile
from .halsession import Hal, NoHal
from .message import MOST
from .operating import Operating
from .registry import Registry, tell_failed
from .requests import Requests
from .updates import Updates

STALL = 0.5                 # s that a look at the pins is late, after which requests count as old
SESSION = 1.0               # s between looks at HAL itself
BATCH, BATCH_TIME = 64, 0.05            # requests in a turn, and s after which no more are begun
_LOG = logging.getLogger("pokeys-remote")


class Proxy:
    """All remote components of a HAL."""

    def __init__(self, config: Config, session: Hal, listener: socket.socket,
                 now: Callable[[], float] = time.monotonic) -> None:
        self._hal, self._now = session, now
        self._context = zmq.Context()
        self._router = self._socket(zmq.ROUTER)
        self._publisher = self._socket(zmq.XPUB)
        self.clients = Clients(self._router)
        self.registry = Registry(config, session)
        self.updates = Updates(self.registry, self._publisher)
        self.hal_file = HalFile(self.registry, self.updates)
        self.control = Control(listener, config.operators)
        self.operating = Operating(self.control, config.messages)
        self.control.methods.update({**self.hal_file.methods, **self.operating.methods})
        self.requests = Requests(self.registry, self.updates)
        self._due = math.inf
        self._old_until = -math.inf
        self._places = (self._router, config.command), (self._publisher, config.update)

    def _socket(self, kind: int) -> zmq.Socket[bytes]:
        made: zmq.Socket[bytes] = self._context.socket(kind)
        made.setsockopt(zmq.LINGER, 0)
        made.setsockopt(zmq.MAXMSGSIZE, MOST)
        made.setsockopt(zmq.IPV6, 1)
        watch(made)
        return made

    def begin(self) -> None:
        """Take over what a proxy left that is gone, then listen. :class:`OSError` if an address is taken."""
        self.hal_file.adopted(self.registry.adopt(), self._now())
        for component in self.registry.components.values():
            self.updates.begin(component, self._now())
        for made, places in self._places:
            for place in places:
                try:
                    made.bind(place)
                except zmq.ZMQError as error:
                    raise OSError(f"cannot listen at {place.partition('://')[2]}: {error}") from None

    def run(self, ends: Callable[[], bool]) -> None:
        """Until ``ends`` says so. :class:`NoHal` if LinuxCNC has ended."""
        poller = zmq.Poller()
        for one in (self._router, self._publisher, self.clients.monitor, self.control):
            poller.register(one, zmq.POLLIN)
        self._due = looked = self._now()
        while not ends():
            poller.poll(math.ceil(max(0.0, self._due - self._now()) * 1000))
            self.turn()
            if self._now() - looked >= SESSION:
                looked = self._now()
                if self._hal.gone:
                    raise NoHal("LinuxCNC's HAL has ended")

    def turn(self) -> None:
        """Serve what is there, and look at the pins if their time has come."""
        now = self._now()
        if now - self._due > STALL:
            self._recover(now - self._due)
        # what a client said before it left counts
        self._read(now, BATCH, old=now < self._old_until)
        self._leave()
        self.updates.listen(now)
        self.control.serve(now)
        self.hal_file.look(now)
        self.operating.look(now)
        for client, answer in self.requests.late(now):
            self._send(client.identity, answer)
        if (pause := self._now() - now) > STALL:
            self._recover(pause)
        self._due = self.updates.look(self._now())

    def _leave(self) -> None:
        for client in self.clients.gone():
            self.requests.forget(client)
            for component in self.registry.lose(client):
                self.updates.soon(component)

    def _read(self, now: float, most: int, old: bool) -> None:
        """Answer requests. What an ``old`` one asks to set is not set."""
        for _ in range(most):
            if self._now() - now > BATCH_TIME:
                return
            try:
                frames = self._router.recv_multipart(zmq.NOBLOCK, copy=False)
            except zmq.Again:
                return
            if not self.clients.knows(frames):
                # the end of an earlier connection with the same number has to be known
                self._leave()
            client = self.clients.of(frames, now)
            if not client:
                continue
            for answer in self.requests.answer(client, frames[-1].bytes, now, old):
                self._send(client.identity, answer)

    def _send(self, identity: bytes, answer: Container) -> None:
        # a client that does not read loses answers, and nobody waits for it
        with contextlib.suppress(zmq.Again, zmq.ZMQError):
            self._router.send_multipart([identity, answer.SerializeToString()], zmq.NOBLOCK)

    def _recover(self, pause: float) -> None:
        _LOG.warning("could not run for %.1f s; what clients sent meanwhile is not obeyed", pause)
        for component in self.registry.components.values():
            tell_failed(component, component.lapse_all())
        # what waited in the kernel comes a moment later
        self._old_until = self.operating.old_until = self._now() + SETTLE

    def close(self) -> None:
        """Listen no more. The components stay in HAL, unbound, until another proxy takes them over."""
        for component in self.registry.components.values():
            component.leave()
        self.operating.close()
        self.control.close()
        self.clients.monitor.close()
        self._router.close()
        self._publisher.close()
        self._context.term()
