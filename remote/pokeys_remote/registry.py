# SPDX-License-Identifier: GPL-2.0-or-later
"""The remote components of a proxy."""
from __future__ import annotations

import itertools
import logging
import os
from collections.abc import Iterator, Mapping

from .component import Client, Component, LivePin, Refused
from .config import Config
from .definition import Definition, Pin, Value
from .halsession import Hal, HalError
from .sparing import CLIENTS

COMPONENTS_MOST = 32
_LOG = logging.getLogger("pokeys-remote")


class Registry:
    """Components by name, and pins by handle."""

    def __init__(self, config: Config, session: Hal) -> None:
        self.config, self.hal = config, session
        self.components: dict[str, Component] = {}
        self.drafts: dict[str, dict[str, Pin]] = {}     # components that HAL files have begun, and their pins by name
        self.pins: dict[int, tuple[Component, LivePin]] = {}
        # other numbers than those of the proxy before, so that a setting by an old one is refused
        self._handles: Iterator[int] = itertools.count(int.from_bytes(os.urandom(3), "big") << 7 | 1)

    def handle(self) -> int:
        """A number that nothing else has."""
        return next(self._handles)

    def create(self, definition: Definition, values: Mapping[str, Value] | None = None) -> Component:
        """A component in HAL, with values of its pins by full name. :class:`Refused`."""
        self.judge(definition.name)
        # what is refused leaves nothing in HAL
        made = Component(definition, self.config.rules(definition.name), self._handles)
        try:
            made.attach(self.hal.create(definition, values))
        except HalError as error:
            raise Refused([str(error)]) from None
        for text in self.hal.relink(made.name):
            _LOG.error("cannot link pin %s", text)
        # of an I/O pin, the signal may have brought the value that it had before
        made.fail()
        self.components[made.name] = made
        self.pins.update((pin.handle, (made, pin)) for pin in made.pins)
        return made

    def judge(self, name: str) -> None:
        """May there be a component with this name, besides the others? :class:`Refused`."""
        others = {*self.components, *self.drafts} - {name}
        if len(others) >= COMPONENTS_MOST:
            raise Refused([f"there are {COMPONENTS_MOST} remote components already, which is the most"])
        for other in others:
            short, long = sorted((other, name), key=len)
            if long.startswith(short):
                # ZeroMQ compares the beginning of a topic
                raise Refused([f"clients of component {short} would also get the messages of {long}; "
                               f"choose a name that does not begin with {short}"])

    def adopt(self) -> list[str]:
        """Take over components of a proxy that is gone, with their links; their names."""
        taken = []
        for definition, values in self.hal.remains():
            try:
                made = self.create(definition, values)
            except Refused as refused:
                _LOG.error("component %s of a proxy that is gone is not taken over: %s", definition.name, refused)
                continue
            _LOG.warning("component %s is taken over from a proxy that is gone", made.name)
            taken.append(made.name)
        return taken

    def lose(self, client: Client) -> list[Component]:
        """A client's connection ended; the components that it had."""
        had = [component for component in self.components.values() if client in component.clients]
        for component in had:
            failed = component.lose(client)
            CLIENTS.info("component %s: the client at %s is gone", component.name, client.place)
            tell_failed(component, failed)
        return had


def tell_failed(component: Component, pins: list[str]) -> None:
    """Say which pins have their failsafe values now."""
    if pins:
        _LOG.warning("component %s: no sign of life of the setter; failsafe values for %s", component.name,
                     ", ".join(pins))

