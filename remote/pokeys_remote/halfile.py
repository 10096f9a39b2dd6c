# SPDX-License-Identifier: GPL-2.0-or-later
"""What HAL files ask for: components described pin by pin, and to wait for clients.

A component of a HAL file is in HAL before its clients are, so that the file can link its pins. From ``newcomp`` to
``ready`` it is a draft, and clients that bind it are answered when it is ready.
"""
from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from .component import Refused
from .control import Call, Method
from .definition import PINS_MOST, Definition, Direction, Kind, Pin, component_name, pin_fault
from .lines import TOO_LATE
from .registry import Registry
from .updates import Updates

WAIT_MOST = 86400.0                     # s
WAITS_MOST = 64
RETURN = 3.0                            # s that the clients of a proxy that is gone may take to subscribe again
_KINDS = {kind.name.lower(): kind for kind in Kind}
_DIRECTIONS = {direction.name.lower(): direction for direction in Direction}
_LOG = logging.getLogger("pokeys-remote")


@dataclass(eq=False)
class _Wait:
    """A call that is answered when the component is so."""

    call: Call
    component: str
    missing: Callable[[str, float], str | None]
    until: float


@dataclass(eq=False)
class HalFile:
    """The components that HAL files describe, and those who wait."""

    registry: Registry
    updates: Updates
    _waits: list[_Wait] = field(default_factory=list)
    _return: dict[str, float] = field(default_factory=dict)     # until when, by the component's name

    @property
    def methods(self) -> Mapping[str, Method]:
        """Of the control socket."""
        one: dict[str, type] = {"component": str}
        wait: dict[str, type] = {"component": str, "seconds": float}
        return {"newcomp": Method(self._newcomp, one),
                "newpin": Method(self._newpin, {**one, "pin": str, "type": str, "direction": str}),
                "ready": Method(self._ready, one),
                "waitacquired": Method(self._waiting(self._unacquired), wait),
                "waitbound": Method(self._waiting(self._unbound), wait),
                "waitunbound": Method(self._waiting(self._bound), wait)}

    def adopted(self, components: Iterable[str], now: float) -> None:
        """These were taken over, and do not know their clients yet."""
        self._return.update((name, now + RETURN) for name in components)

    def look(self, now: float) -> None:
        """Answer those for whom something has happened, or whose time is over."""
        waiting = []
        for wait in self._waits:
            missing = wait.missing(wait.component, now)
            if not missing:
                wait.call.answer()
            elif now >= wait.until:
                wait.call.refuse(missing, TOO_LATE)
            elif wait.call.open:
                waiting.append(wait)
        self._waits = waiting

    # components

    def _newcomp(self, call: Call, _now: float) -> None:
        name = call.params["component"]
        try:
            component_name(name)
        except ValueError as error:
            raise Refused([f'the component\'s name "{name}" is not allowed; allowed: {error}']) from None
        self.registry.judge(name)
        # the one of a file that has failed, which is corrected and loaded again
        if (former := self.registry.drafts.get(name)) is not None:
            _LOG.warning("component %s: newcomp came again before ready; %d pins of the first one are dropped", name,
                         len(former))
        self.registry.drafts[name] = {}
        call.answer()

    def _newpin(self, call: Call, _now: float) -> None:
        component, name = call.params["component"], call.params["pin"]
        draft = self._draft(component)
        kind, direction = _KINDS.get(call.params["type"]), _DIRECTIONS.get(call.params["direction"])
        if fault := pin_fault(component, name):
            raise Refused([fault])
        if not kind:
            raise Refused([f"pin {name}: there is no such type; there are {', '.join(_KINDS)}"])
        if not direction:
            raise Refused([f"pin {name}: there is no such direction; there are {', '.join(_DIRECTIONS)}"])
        if name in draft:
            raise Refused([f"pin {name} is there twice"])
        if len(draft) >= PINS_MOST:
            raise Refused([f"component {component} has {PINS_MOST} pins already, which is the most"])
        draft[name] = Pin(name, kind, direction)
        call.answer()

    def _ready(self, call: Call, now: float) -> None:
        name = call.params["component"]
        definition = Definition(name, tuple(self._draft(name).values()))
        del self.registry.drafts[name]
        there = self.registry.components.get(name)
        if not there:
            self.updates.begin(self.registry.create(definition), now)
            _LOG.info("component %s: created for a HAL file", name)
        elif faults := there.definition.differences(definition, "in the HAL file"):
            raise Refused([f"there is another component {name} already: {'; '.join(faults)}"])
        call.answer()

    def _draft(self, component: str) -> dict[str, Pin]:
        if component not in self.registry.drafts:
            raise Refused([f"component {component} is ready already; its pins come between newcomp and ready"
                           if component in self.registry.components else
                           f"there is no component {component}; newcomp {component} begins it, and again if the proxy "
                           "has failed since"])
        return self.registry.drafts[component]

    # waiting

    def _waiting(self, missing: Callable[[str, float], str | None]) -> Callable[[Call, float], None]:
        def run(call: Call, now: float) -> None:
            seconds = call.params["seconds"]
            if not 0 <= seconds <= WAIT_MOST:
                raise Refused([f"seconds: a number from 0 to {WAIT_MOST:.0f}"])
            if len(self._waits) >= WAITS_MOST:
                raise Refused([f"{WAITS_MOST} wait already, which is the most"])
            self._waits.append(_Wait(call, call.params["component"], missing, now + seconds))
        return run

    def _unacquired(self, name: str, _now: float) -> str | None:
        if name in self.registry.components:
            return None
        return f"component {name} is not ready" if name in self.registry.drafts else f"there is no component {name}"

    def _unbound(self, name: str, now: float) -> str | None:
        component = self.registry.components.get(name)
        if component and not component.bound:
            return f"no client receives the values of component {name}"
        return self._unacquired(name, now)

    def _bound(self, name: str, now: float) -> str | None:
        component = self.registry.components.get(name)
        if component and component.bound:
            return f"a client receives the values of component {name}"
        if now < self._return.get(name, -math.inf):
            return f"component {name} was taken over just now, and its clients may come back"
        return self._unacquired(name, now)
