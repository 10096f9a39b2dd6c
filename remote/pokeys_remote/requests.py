# SPDX-License-Identifier: GPL-2.0-or-later
"""What clients ask for at the command socket, and the answers."""
from __future__ import annotations

import fnmatch
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from pokeys_machinetalk_pb2 import Component as Description
from pokeys_machinetalk_pb2 import Container, Pin, Signal

from . import message
from .clients import settled
from .component import Client, Component, LivePin, Refused
from .definition import Direction, Value
from .halsession import HalError, Item
from .message import Type
from .registry import COMPONENTS_MOST, Registry
from .sparing import CLIENTS
from .updates import Updates

SETTING = {Type.SET: Type.SET_REJECT, Type.COMMAND_SET: Type.COMMAND_SET_REJECT}


@dataclass(frozen=True)
class _Offered:
    """A pin or signal of any component of LinuxCNC."""

    name: str
    item: Item


class _NotYet(Exception):
    """A HAL file is expected to make the component."""


class Requests:
    """Answers requests; knows no sockets."""

    def __init__(self, registry: Registry, updates: Updates) -> None:
        self._registry, self._updates = registry, updates
        # what clients expect of components that are not there yet, by component
        self._waiting: dict[Client, dict[str, Description]] = {}
        self._offered: dict[int, _Offered] = {}
        self._handles: dict[tuple[str, bool], int] = {}
        self._kinds: dict[int, Callable[[Client, Container, float], Iterator[Container]]] = {
            Type.PING: self._ping, Type.BIND: self._bind, Type.SET: self._set, Type.COMMAND_GET: self._get,
            Type.COMMAND_SET: self._command_set, Type.COMMAND_DESCRIBE: self._describe}

    def answer(self, client: Client, data: bytes, now: float, old: bool) -> Iterator[Container]:
        """Answers to a message. What an ``old`` one asks to set is not set."""
        request = message.decode(data)
        if request is None:
            yield message.answer(Type.COMMAND_ERROR, ["this is not a message of machinetalk"])
        elif request.type in SETTING and (old or not (client.bound or settled(client, now))):
            yield from self._too_old(request, now)
        elif request.type in self._kinds:
            yield from self._kinds[request.type](client, request, now)
        else:
            yield message.answer(Type.COMMAND_ERROR, [f"there is no request of type {request.type} here"])

    def _too_old(self, request: Container, now: float) -> Iterator[Container]:
        """Clients see what is the case. Machinekit's client would end at a rejection that it did not ask for."""
        for component in {found[0] for pin in request.pin if (found := self._registry.pins.get(pin.handle))}:
            self._updates.full(component, now)
        if request.reply_required:
            yield message.answer(SETTING[Type(request.type)], ["this may be old; send it again"])

    @staticmethod
    def _ping(_client: Client, _request: Container, _now: float) -> Iterator[Container]:
        yield message.answer(Type.PING_ACK)

    # remote components

    def _bind(self, client: Client, request: Container, now: float) -> Iterator[Container]:
        if not request.comp:
            yield message.answer(Type.BIND_REJECT, ["the request names no component"])
        if len(request.comp) > COMPONENTS_MOST:
            yield message.answer(Type.BIND_REJECT, [f"the request names more than {COMPONENTS_MOST} components"])
            return
        waiting = self._waiting.get(client, {})
        for description in request.comp:
            name = message.text(description.name)
            # a client that asks again needs one answer
            waiting.pop(name, None)
            try:
                yield self._bind_answer(client, description, now, len(waiting) < COMPONENTS_MOST)
            except _NotYet:
                CLIENTS.info("component %s: the client at %s waits for a HAL file to create it", name, client.place)
                waiting[name] = description
        self._waiting[client] = waiting

    def late(self, now: float) -> Iterator[tuple[Client, Container]]:
        """Answers for those who wait, as long as their connections last. Call it in each turn."""
        for client, waiting in self._waiting.items():
            for name in [name for name in waiting if not self._awaited(name)]:
                yield client, self._bind_answer(client, waiting.pop(name), now, False)

    def forget(self, client: Client) -> None:
        """It is gone, and waits no more."""
        self._waiting.pop(client, None)

    def _awaited(self, name: str) -> bool:
        """Is a component not there, and expected from a HAL file?"""
        return name not in self._registry.components and (
            name in self._registry.drafts or not self._registry.config.create)

    def _bind_answer(self, client: Client, description: Description, now: float, waits: bool) -> Container:
        """:class:`_NotYet` if it ``waits`` for a HAL file."""
        try:
            component = self._bound(client, description, now, waits)
        except Refused as refused:
            CLIENTS.warning("the client at %s cannot bind component %s: %s", client.place,
                            message.text(description.name), refused)
            return message.answer(Type.BIND_REJECT, refused.notes)
        confirmed = message.answer(Type.BIND_CONFIRM)
        message.describe(confirmed, component, [(pin, component.value(pin)) for pin in component.pins])
        return confirmed

    def _bound(self, client: Client, description: Description, now: float, waits: bool) -> Component:
        wanted, faults = message.definition(description)
        if not wanted:
            raise Refused(faults)
        component = self._registry.components.get(wanted.name)
        if component:
            if faults := component.definition.differences(wanted, "in the request"):
                raise Refused(faults)
        elif waits and self._awaited(wanted.name):
            raise _NotYet
        elif self._awaited(wanted.name):
            raise Refused([f"component {wanted.name} is not there, and this client waits for {COMPONENTS_MOST} "
                           "components already, which is the most"])
        elif description.no_create:
            raise Refused([f"there is no component {wanted.name}, and the request says that it is not to be created"])
        else:
            component = self._registry.create(wanted)
            self._updates.begin(component, now)
            CLIENTS.info("component %s: created for the client at %s", component.name, client.place)
        component.join(client)
        client.bound = True
        return component

    def _set(self, client: Client, request: Container, now: float) -> Iterator[Container]:
        faults: list[str] = []
        settings: dict[Component, list[tuple[LivePin, Value]]] = {}
        for item in request.pin:
            name = message.text(item.name)
            found = self._registry.pins.get(item.handle) if item.HasField("handle") else self._by_name(name)
            if not found:
                faults.append(f"no pin has the handle {item.handle}; bind again" if item.HasField("handle") else
                              f"no remote component has a pin {name}")
                continue
            component, pin = found
            value, kind = message.value_of(item)
            faults += component.judge([(pin, value, kind)])
            if value is not None:
                settings.setdefault(component, []).append((pin, value))
        if faults:
            CLIENTS.warning("the client at %s cannot set: %s", client.place, "; ".join(faults))
            yield message.answer(Type.SET_REJECT, faults)
            return
        for component, of_it in settings.items():
            component.set(client, of_it)
        if request.reply_required:
            yield message.answer(Type.ACK)

    def _by_name(self, name: str) -> tuple[Component, LivePin] | None:
        component = self._registry.components.get(name.partition(".")[0])
        return next(((component, pin) for pin in component.pins if pin.pin.name == name), None) if component else None

    # anything else in HAL, as far as the configuration offers it

    def _get(self, _client: Client, request: Container, now: float) -> Iterator[Container]:
        answer, faults = message.answer(Type.COMMAND_ACK), []
        for item, add in self._items(request, answer):
            try:
                offered, handle = self._find(item, now)
                value = self._registry.hal.get(offered.name)
            except (Refused, HalError) as error:
                faults.append(str(error))
                continue
            made = add()
            made.handle, made.type, made.name = handle, int(offered.item.kind), offered.name.encode()
            if isinstance(made, Pin) and offered.item.direction:
                made.dir = int(offered.item.direction)
            message.put_value(made, offered.item.kind, value)
        yield message.answer(Type.COMMAND_GET_REJECT, faults) if faults else answer

    def _command_set(self, client: Client, request: Container, now: float) -> Iterator[Container]:
        faults: list[str] = []
        settings: list[tuple[_Offered, Value]] = []
        for item, _ in self._items(request, request):
            value, kind = message.value_of(item)
            try:
                offered, _ = self._find(item, now)
                if not any(fnmatch.fnmatchcase(offered.name, one) for one in self._registry.config.write):
                    raise Refused([f"{offered.name} is not offered for writing (see [offer] write)"])
                if offered.item.direction not in (Direction.IN, Direction.IO):
                    raise Refused([f"{offered.name} is not an input"])
                if kind is not offered.item.kind or value is None:
                    raise Refused([f"{offered.name} needs a value of its type, {offered.item.kind.name.lower()}"])
                if not math.isfinite(value):
                    raise Refused([f"{offered.name} is not set to {value}"])
                settings.append((offered, value))
            except Refused as error:
                faults.append(str(error))
        if not faults:
            for offered, value in settings:
                try:
                    self._registry.hal.set(offered.name, value)
                except HalError as error:
                    faults.append(str(error))
        if faults:
            CLIENTS.warning("the client at %s cannot set: %s", client.place, "; ".join(faults))
            yield message.answer(Type.COMMAND_SET_REJECT, faults)
        elif request.reply_required:
            yield message.answer(Type.COMMAND_ACK)

    def _describe(self, client: Client, request: Container, now: float) -> Iterator[Container]:
        answer = message.answer(Type.COMMAND_DESCRIPTION)
        names = [message.text(one.name) for one in request.comp]
        if not (names or request.pin or request.signal):
            names = list(self._registry.components)
        for name in names:
            component = self._registry.components.get(name)
            if component:
                message.describe(answer, component, [(pin, component.value(pin)) for pin in component.pins])
            else:
                answer.note.append(f"there is no remote component {name}".encode())
        if request.pin or request.signal:
            for found in self._get(client, request, now):
                answer.pin.extend(found.pin)
                answer.signal.extend(found.signal)
                answer.note.extend(found.note)
        yield answer

    @staticmethod
    def _items(request: Container, answer: Container) -> Iterable[tuple[Pin | Signal, Callable[[], Pin | Signal]]]:
        yield from ((pin, answer.pin.add) for pin in list(request.pin))
        yield from ((signal, answer.signal.add) for signal in list(request.signal))

    def _find(self, wanted: Pin | Signal, now: float) -> tuple[_Offered, int]:
        """What a request means. :class:`Refused`."""
        if wanted.HasField("handle") and wanted.handle in self._offered:
            return self._offered[wanted.handle], wanted.handle
        name, signal = message.text(wanted.name), isinstance(wanted, Signal)
        if not name:
            raise Refused([f"nothing that was asked for has the handle {wanted.handle}" if wanted.HasField("handle")
                           else "a pin without name and handle"])
        config = self._registry.config
        if not any(fnmatch.fnmatchcase(name, one) for one in (*config.read, *config.write)):
            raise Refused([f"{name} is not offered (see [offer] read)"])
        item = self._registry.hal.find(name, signal, now)
        if not item:
            raise Refused([f"HAL has no {'signal' if signal else 'pin'} {name}"])
        if (name, signal) not in self._handles:
            self._handles[name, signal] = self._registry.handle()
        handle = self._handles[name, signal]
        self._offered[handle] = _Offered(name, item)
        return self._offered[handle], handle
