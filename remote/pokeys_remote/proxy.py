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
from uuid import UUID

import zmq
from pokeys_machinetalk_pb2 import Container

from .announce import Announcer
from .clients import SETTLE
from .component import Client
from .config import Config
from .control import Control
from .groups import ALL, Groups
from .halfile import HalFile
from .halsession import Hal, NoHal
from .keys import Known
from .message import PROCESS
from .operating import Operating
from .registry import Registry, tell_failed
from .requests import Requests
from .topics import Topics
from .updates import Updates
from .ways import Doorman, Way, make

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
        self._secure, self._announcer = config.secure, Announcer()
        self._doorman = Doorman(self._context, Known(config.secure.clients)) if config.secure else None
        self._ways = [make(self._context, config.command, config.update, config.group if config.groups else ())]
        if config.secure:
            self._ways.append(make(self._context, config.secure.command, config.secure.update,
                                   config.secure.group if config.groups else (), config.secure))
        self.registry = Registry(config, session)
        self.updates = Updates(self.registry, Topics(
            self.registry.components.__contains__, *(way.publisher for way in self._ways)))
        self.groups = Groups(config.groups, session, Topics(
            {*config.groups, ALL}.__contains__, *(way.watched for way in self._ways)), self.registry.handle)
        self.hal_file = HalFile(self.registry, self.updates)
        self.control = Control(listener, config.operators)
        self.operating = Operating(self.control, config.messages)
        self.control.methods.update({**self.hal_file.methods, **self.operating.methods})
        self.requests = Requests(self.registry, self.updates)
        self._due = math.inf
        self._old_until = -math.inf

    def begin(self) -> None:
        """Take over what a proxy left that is gone, then listen. :class:`OSError` if an address is taken."""
        self.hal_file.adopted(self.registry.adopt(), self._now())
        for component in self.registry.components.values():
            self.updates.begin(component, self._now())
        for made, places in (one for way in self._ways for one in way.places):
            for place in places:
                try:
                    made.bind(place)
                except zmq.ZMQError as error:
                    raise OSError(f"cannot listen at {place.partition('://')[2]}: {error}") from None
        if self._secure and self._secure.announce:
            groups = {"halgroup": self._secure.group} if self._secure.group else {}
            self._announcer.begin(self._hal.name, str(UUID(bytes=PROCESS)), {
                "halrcmd": self._secure.command, "halrcomp": self._secure.update, **groups})

    def run(self, ends: Callable[[], bool]) -> None:
        """Until ``ends`` says so. :class:`NoHal` if LinuxCNC has ended."""
        poller = zmq.Poller()
        for one in (*(one for way in self._ways for one in way.readable), self.control):
            poller.register(one, zmq.POLLIN)
        if self._doorman:
            poller.register(self._doorman.socket, zmq.POLLIN)
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
        if self._doorman:
            self._doorman.serve()
        # each of them is the first one in its turn, and so has the time for a batch
        self._ways.reverse()
        for way in self._ways:
            # what a client said before it left counts
            self._read(way, now, BATCH, old=now < self._old_until)
            self._leave(way)
        self.updates.listen(now)
        self.control.serve(now)
        self.hal_file.look(now)
        self.operating.look(now)
        for client, answer in self.requests.late(now):
            for way in self._ways:
                if way.clients.has(client):
                    _send(way, client, answer)
        if (pause := self._now() - now) > STALL:
            self._recover(pause)
        self.groups.listen()
        self._due = min(self.updates.look(self._now()), self.groups.look(self._now()))

    def _leave(self, way: Way) -> None:
        for client in way.clients.gone():
            self.requests.forget(client)
            for component in self.registry.lose(client):
                self.updates.soon(component)

    def _read(self, way: Way, now: float, most: int, old: bool) -> None:
        """Answer requests. What an ``old`` one asks to set is not set."""
        for _ in range(most):
            if self._now() - now > BATCH_TIME:
                return
            try:
                frames = way.router.recv_multipart(zmq.NOBLOCK, copy=False)
            except zmq.Again:
                return
            if not way.clients.knows(frames):
                # the end of an earlier connection with the same number has to be known
                self._leave(way)
            client = way.clients.of(frames, now)
            if not client:
                continue
            for answer in self.requests.answer(client, frames[-1].bytes, now, old):
                _send(way, client, answer)

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
        self._announcer.close()
        self.operating.close()
        self.control.close()
        for way in self._ways:
            way.close()
        if self._doorman:
            self._doorman.socket.close()
        self._context.term()


def _send(way: Way, client: Client, answer: Container) -> None:
    # a client that does not read loses answers, and nobody waits for it
    with contextlib.suppress(zmq.Again, zmq.ZMQError):
        way.router.send_multipart([client.identity, answer.SerializeToString()], zmq.NOBLOCK)
