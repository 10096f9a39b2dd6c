# SPDX-License-Identifier: GPL-2.0-or-later
"""Values on their way to clients: the XPUB socket, with the component's name as the topic.

A subscription takes effect when it is confirmed here, so that the first message of a subscriber is a full
update. Machinekit's client would end its thread at an incremental one, whose handles it does not know.
"""
from __future__ import annotations

import contextlib
import math

import zmq
from pokeys_machinetalk_pb2 import Container

from . import message
from .component import Component
from .message import Type
from .registry import Registry, tell_failed

KEEPALIVE = 2.0             # s between messages to subscribers
LEASE_LOOK = 0.1            # s between looks at the leases, at most
TOPIC_MOST = 256            # bytes
TOPICS_MOST = 256


class Updates:
    """Who listens, and what they get."""

    def __init__(self, registry: Registry, publisher: zmq.Socket[bytes]) -> None:
        publisher.setsockopt(zmq.XPUB_MANUAL, 1)
        self._registry, self._publisher = registry, publisher
        self._topics: dict[bytes, int] = {}             # subscriptions
        self._due: dict[str, float] = {}
        self._said: dict[str, float] = {}

    def listen(self, now: float) -> None:
        """Subscriptions that came and went."""
        with contextlib.suppress(zmq.Again):
            while True:
                said = self._publisher.recv(zmq.NOBLOCK)
                topic, begins = said[1:], said[:1] == b"\x01"
                # a client may send anything here
                if said[:1] not in (b"\x00", b"\x01"):
                    continue
                if len(topic) > TOPIC_MOST or (topic not in self._topics and len(self._topics) >= TOPICS_MOST):
                    continue
                self._publisher.setsockopt(zmq.SUBSCRIBE if begins else zmq.UNSUBSCRIBE, topic)
                count = self._topics.pop(topic, 0) + (1 if begins else -1)
                if count > 0:
                    self._topics[topic] = count
                name = topic.decode(errors="replace")
                component = self._registry.components.get(name)
                if component:
                    component.subscribers = max(count, 0)
                    if begins:
                        self.full(component, now)
                elif begins:
                    self._send(topic, message.answer(Type.ERROR, [f"there is no component {name}; bind it first"]))

    def begin(self, component: Component, now: float) -> None:
        """There is a new component; somebody may have waited for it."""
        component.subscribers = self._topics.get(component.name.encode(), 0)
        self._due[component.name] = now
        self.full(component, now)

    def soon(self, component: Component) -> None:
        """Look at a component's pins in this turn."""
        self._due[component.name] = -math.inf

    def full(self, component: Component, now: float) -> None:
        """All values, to all subscribers."""
        update = message.answer(Type.FULL)
        update.serial = component.next_serial()
        message.describe(update, component, component.everything())
        update.pparams.keepalive_timer = int(KEEPALIVE * 1000)
        update.pparams.rcomp_timer = int(component.rules.interval * 1000)
        update.pparams.group_timer = update.pparams.rcomp_timer
        self._publish(component, update, now)

    def look(self, now: float) -> float:
        """End leases, and send changes of components whose time has come; the time of the next one."""
        for component in self._registry.components.values():
            if failed := component.expire(now):
                tell_failed(component, failed)
                self.soon(component)
            if now < self._due[component.name]:
                continue
            # from now on, not from when it was due: what was missed is not caught up
            self._due[component.name] = now + component.rules.interval
            component.look(now)
            changes = component.changes()
            if changes:
                update = message.answer(Type.INCREMENTAL)
                update.serial = component.next_serial()
                for pin, value in changes:
                    item = update.pin.add()
                    item.handle, item.type = pin.handle, int(pin.pin.kind)
                    message.put_value(item, pin.pin.kind, value)
                self._publish(component, update, now)
            elif now - self._said[component.name] >= KEEPALIVE:
                self._publish(component, message.answer(Type.PING), now)
        return min((*self._due.values(), now + LEASE_LOOK))

    def _publish(self, component: Component, update: Container, now: float) -> None:
        self._said[component.name] = now
        self._send(component.name.encode(), update)

    def _send(self, topic: bytes, update: Container) -> None:
        # a subscriber that does not read loses messages, and nobody waits for it
        with contextlib.suppress(zmq.Again):
            self._publisher.send_multipart([topic, update.SerializeToString()], zmq.NOBLOCK)
