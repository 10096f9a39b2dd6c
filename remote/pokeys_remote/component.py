# SPDX-License-Identifier: GPL-2.0-or-later
"""A remote component while it lives: what changed, who set what, and what happens if a setter is lost.

Nothing here knows sockets or LinuxCNC, and ``now`` is a parameter (seconds of the monotonic clock), so that
tests run in virtual time.

A *lease* is a group of output pins that fail together. Whoever last set one of its pins holds it. When one of
its holders is lost, or silent for longer than the lease, pins with a failsafe value take it, and stay there
until a client sets them.
"""
from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Protocol

from .definition import OWN, RANGES, Care, Definition, Direction, Kind, Pin, Rules, Value, differs, value_of


class Storage(Protocol):
    """The pins in HAL, by their names without the component's."""

    def __getitem__(self, name: str) -> Value: ...

    def __setitem__(self, name: str, value: Value) -> None: ...


@dataclass(eq=False)
class Client:
    """A connection to the command socket."""

    identity: bytes
    since: float                        # of the first message
    seen: float                         # of the newest message
    place: str = ""                     # for the log
    bound: bool = False                 # it sent a BIND, and so knows that this connection is new


class Refused(Exception):
    """What is wrong with a request, a line each."""

    def __init__(self, notes: list[str]) -> None:
        super().__init__("; ".join(notes))
        self.notes = notes


@dataclass(eq=False)
class LivePin:
    """A pin of a live component."""

    pin: Pin
    handle: int
    care: Care
    failsafe: Value | None
    reported: Value | None = None
    setter: Client | None = None        # who set it last

    @property
    def local(self) -> str:
        """Its name without the component's."""
        return self.pin.name.partition(".")[2]

    def changed(self, value: Value) -> bool:
        """Is it something else than what clients have?"""
        return differs(self.pin.kind, self.reported, value, self.care.epsilon)


@dataclass(eq=False)
class Lease:
    """Output pins that fail together."""

    time: float                         # s that its holder may be silent
    pins: list[LivePin] = field(default_factory=list)
    lapsed: bool = False

    @property
    def holders(self) -> set[Client]:
        """Those who last set one of its pins. It needs all of them."""
        return {pin.setter for pin in self.pins if pin.setter}


class Component:
    """A component that exists in HAL."""

    def __init__(self, definition: Definition, rules: Rules, handles: Iterator[int]) -> None:
        """:class:`Refused` if definition and rules do not go together. The pins come by :meth:`attach`."""
        self.definition, self.rules = definition, rules
        self.name = definition.name
        self.serial = 0
        self.subscribers = 0
        self.clients: set[Client] = set()
        self._storage: Storage = {}
        names = {pin.name for pin in definition.pins}
        if unknown := [name for name in rules.pins if name not in names]:
            raise Refused([f"the configuration has a section [pin {name}], and component {self.name} has no such pin"
                           for name in unknown])
        self.pins = [self._live(pin, next(handles)) for pin in definition.pins]
        self._leases = {"": Lease(rules.lease), **{name: Lease(time) for name, time in rules.leases.items()}}
        self._lease_of: dict[int, Lease] = {}
        for pin in self.pins:
            if pin.pin.direction is not Direction.IN:
                lease = self._leases[pin.care.lease]
                lease.pins.append(pin)
                self._lease_of[pin.handle] = lease

    def attach(self, storage: Storage) -> None:
        """The pins are there; they have their failsafe values until somebody sets them."""
        self._storage = storage
        self.fail()

    def fail(self) -> None:
        """Failsafe values for all outputs that have one."""
        for lease in self._leases.values():
            self._fail(lease)

    def _live(self, pin: Pin, handle: int) -> LivePin:
        care = self.rules.pins.get(pin.name, Care())
        faults = []
        failsafe: Value | None = None
        if care.failsafe is not None:
            try:
                failsafe = value_of(pin.kind, care.failsafe)
            except ValueError as error:
                faults.append(f'the configuration has failsafe = {care.failsafe} for pin {pin.name}, which is '
                              f"{pin.kind.name.lower()}; allowed: {error}")
            if pin.direction is Direction.IN:
                faults.append(f"the configuration has a failsafe value for pin {pin.name}, which no client sets")
        if care.lease and care.lease not in self.rules.leases:
            faults.append(f"the configuration has no section [lease {care.lease}] for pin {pin.name}")
        if faults:
            raise Refused(faults)
        return LivePin(pin, handle, care, failsafe)

    # what clients see

    @property
    def bound(self) -> bool:
        """Does anybody listen?"""
        return self.subscribers > 0

    def value(self, pin: LivePin) -> Value:
        """As it is in HAL."""
        return self._storage[pin.local]

    def next_serial(self) -> int:
        """Of a full or incremental update."""
        self.serial = self.serial + 1 & 0x7fffffff
        return self.serial

    def everything(self) -> list[tuple[LivePin, Value]]:
        """All pins, for a full update."""
        return [(pin, self._report(pin, self.value(pin))) for pin in self.pins]

    def changes(self) -> list[tuple[LivePin, Value]]:
        """Pins that changed since the last report, for an incremental update."""
        return [(pin, self._report(pin, value)) for pin in self.pins if pin.changed(value := self.value(pin))]

    @staticmethod
    def _report(pin: LivePin, value: Value) -> Value:
        pin.reported = value
        return value

    # what clients do

    def join(self, client: Client) -> None:
        """A client bound, so it knows the values as they are."""
        self.clients.add(client)
        for lease in self._leases.values():
            lease.lapsed = False

    def judge(self, settings: Iterable[tuple[LivePin, Value | None, Kind | None]]) -> list[str]:
        """Why a client may not set this."""
        faults = []
        for pin, value, kind in settings:
            if pin.pin.direction is Direction.IN:
                faults.append(f"pin {pin.pin.name} is an input of the component; the machine sets it")
            elif kind is not pin.pin.kind or value is None:
                faults.append(f"pin {pin.pin.name} is {pin.pin.kind.name.lower()}, and needs a value of this type")
            elif not math.isfinite(value):
                faults.append(f"pin {pin.pin.name} is not set to {value}")
            elif pin.pin.kind in RANGES and not RANGES[pin.pin.kind][0] <= value <= RANGES[pin.pin.kind][1]:
                faults.append(f"pin {pin.pin.name} is not set to {value}, which is outside {pin.pin.kind.name.lower()}")
        return faults

    def set(self, client: Client, settings: Iterable[tuple[LivePin, Value]]) -> None:
        """Judged settings. The client holds the leases of these pins from now on."""
        self.clients.add(client)
        for pin, value in settings:
            self._storage[pin.local] = value
            pin.setter = client
            self._lease_of[pin.handle].lapsed = False

    # what happens without them

    def lose(self, client: Client) -> list[str]:
        """A client's connection ended; the pins that took their failsafe values."""
        self.clients.discard(client)
        return [name for lease in self._leases.values() if client in lease.holders
                for name in self._lapse(lease)]

    def lapse_all(self) -> list[str]:
        """Nobody looked after the leases for a while; the pins that took their failsafe values."""
        return [name for lease in self._leases.values() if lease.holders for name in self._lapse(lease)]

    def leave(self) -> None:
        """The proxy ends. The component stays in HAL for the next one, with failsafe values."""
        self.clients.clear()
        self.subscribers = 0
        for lease in self._leases.values():
            self._lapse(lease)
        for name, kind in own_pins().items():
            self._storage[name] = 0.0 if kind is Kind.FLOAT else 0 if kind is Kind.U32 else False

    def expire(self, now: float) -> list[str]:
        """End the leases of clients that are silent; pins as in :meth:`lose`."""
        return [name for lease in self._leases.values()
                if any(now - holder.seen > lease.time for holder in lease.holders) for name in self._lapse(lease)]

    def look(self, now: float) -> None:
        """Update the status pins. After :meth:`expire`."""
        holders = [holder for lease in self._leases.values() for holder in lease.holders]
        seen = [client.seen for client in holders or self.clients]
        ok = bool(self.clients) and not any(lease.lapsed for lease in self._leases.values())
        status = (ok, self.bound, len(self.clients), max(0.0, now - min(seen)) if seen else 0.0,
                  not self._storage["heartbeat"])
        for name, value in zip(OWN, status, strict=True):
            self._storage[name] = value

    def _lapse(self, lease: Lease) -> list[str]:
        lease.lapsed = True
        for pin in lease.pins:
            pin.setter = None
        return self._fail(lease)

    def _fail(self, lease: Lease) -> list[str]:
        failed = [pin for pin in lease.pins if pin.failsafe is not None]
        for pin in failed:
            assert pin.failsafe is not None
            self._storage[pin.local] = pin.failsafe
        return [pin.pin.name for pin in failed]


def own_pins() -> dict[str, Kind]:
    """The pins that each component has besides, all of them outputs."""
    return dict(zip(OWN, (Kind.BIT, Kind.BIT, Kind.U32, Kind.FLOAT, Kind.BIT), strict=True))
