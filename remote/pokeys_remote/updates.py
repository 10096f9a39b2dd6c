# SPDX-License-Identifier: GPL-2.0-or-later
"""Values of components on their way to clients, with the component's name as the topic."""
from __future__ import annotations

import math

from pokeys_machinetalk_pb2 import Container

from . import message
from .component import Component
from .message import Type
from .registry import Registry, tell_failed
from .topics import Topics

KEEPALIVE = 2.0             # s between messages to subscribers
LEASE_LOOK = 0.1            # s between looks at the leases, at most


class Updates:
    """Who listens, and what they get."""

    def __init__(self, registry: Registry, topics: Topics) -> None:
        self._registry, self._topics = registry, topics
        self._due: dict[str, float] = {}
        self._said: dict[str, float] = {}

    def listen(self, now: float) -> None:
        """Subscriptions that came and went."""
        for name, begins in self._topics.listen():
            component = self._registry.components.get(name)
            if component:
                component.subscribers = self._topics.count(name)
                if begins:
                    self.full(component, now)
            elif begins:
                self._topics.send(name, message.answer(Type.ERROR, [f"there is no component {name}; bind it first"]))

    def begin(self, component: Component, now: float) -> None:
        """There is a new component; somebody may have waited for it."""
        component.subscribers = self._topics.count(component.name)
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
        message.timers(update, KEEPALIVE, component.rules.interval)
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
        self._topics.send(component.name, update)
