# SPDX-License-Identifier: GPL-2.0-or-later
"""machinekit's messages: protobuf containers, and what goes into them."""
from __future__ import annotations

import enum
import os
import warnings
from collections.abc import Iterable

from google.protobuf.message import DecodeError
from pokeys_machinetalk_pb2 import Component as Description
from pokeys_machinetalk_pb2 import Container, Pin, Signal

from .component import Component, LivePin
from .definition import PINS_MOST, Definition, Direction, Kind, Value, component_name, pin_fault
from .definition import Pin as PinDefinition

MOST = 65536                    # bytes of a message
REMOTE = 3                      # Component.type
SIGNAL = 2                      # Member.mtype
UNBOUND, BOUND = 2, 3           # Component.state
PROCESS = os.urandom(16)        # tells clients that this is another proxy than before
_FIELDS = {Kind.BIT: "halbit", Kind.FLOAT: "halfloat", Kind.S32: "hals32", Kind.U32: "halu32"}


class Type(enum.IntEnum):
    """Container.type."""

    NO_GROUP = 27
    PING = 210
    PING_ACK = 215
    BIND = 256
    BIND_CONFIRM = 257
    BIND_REJECT = 258
    SET = 259
    SET_REJECT = 260
    ACK = 263
    COMMAND_SET = 265
    COMMAND_SET_REJECT = 266
    COMMAND_GET = 267
    COMMAND_GET_REJECT = 268
    COMMAND_ACK = 273
    COMMAND_ERROR = 274
    COMMAND_DESCRIBE = 276
    COMMAND_DESCRIPTION = 277
    FULL = 288
    INCREMENTAL = 289
    ERROR = 290
    GROUP_FULL = 297
    GROUP_INCREMENTAL = 298


def decode(data: bytes) -> Container | None:
    """A message, if it is one."""
    if len(data) > MOST:
        return None
    container = Container()
    try:
        # there is one for data after the end
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            container.ParseFromString(data)
    except DecodeError:
        return None
    return None if said else container


def text(name: bytes) -> str:
    """A name in a request. What is not UTF-8 has a replacement character, and so is not a valid name."""
    return name.decode(errors="replace")


def answer(kind: Type, notes: Iterable[str] = ()) -> Container:
    """An answer of this proxy."""
    container = Container()
    container.type, container.uuid = int(kind), PROCESS
    container.note.extend(note.encode() for note in notes)
    return container


def put_value(item: Pin | Signal, kind: Kind, value: Value) -> None:
    """Its value."""
    setattr(item, _FIELDS[kind], value)


def value_of(item: Pin | Signal) -> tuple[Value | None, Kind | None]:
    """The value of a request and its type; a type that does not fit the value is none."""
    kinds = [kind for kind, name in _FIELDS.items() if item.HasField(name)]
    if len(kinds) != 1 or (item.HasField("type") and item.type != kinds[0]):
        return None, None
    value: Value = getattr(item, _FIELDS[kinds[0]])
    return value, kinds[0]


def timers(container: Container, keepalive: float, interval: float) -> None:
    """Say how often the sender looks, in s, and how long it is silent at most."""
    container.pparams.keepalive_timer = int(keepalive * 1000)
    container.pparams.group_timer = container.pparams.rcomp_timer = int(interval * 1000)


def describe(container: Container, component: Component, values: Iterable[tuple[LivePin, Value]]) -> None:
    """Put a component with these pins into a message."""
    part = container.comp.add()
    part.name, part.type, part.pid = component.name.encode(), REMOTE, os.getpid()
    part.state = BOUND if component.bound else UNBOUND
    part.timer = int(component.rules.interval * 1000)
    for pin, value in values:
        item = part.pin.add()
        item.name, item.handle, item.epsilon = pin.pin.name.encode(), pin.handle, pin.care.epsilon
        item.type, item.dir = int(pin.pin.kind), int(pin.pin.direction)
        put_value(item, pin.pin.kind, value)


def definition(request: Description) -> tuple[Definition | None, list[str]]:
    """The component that a BIND describes; or everything that is wrong with the description."""
    name, items, instances = text(request.name), request.pin, max(1, request.ninst)
    notes: list[str] = []
    try:
        component_name(name)
    except ValueError as error:
        notes.append(f'the component\'s name "{name}" is not allowed; allowed: {error}')
    pins: dict[str, PinDefinition] = {}
    if len(items) * instances > PINS_MOST:
        return None, [*notes, f"component {name} has more than {PINS_MOST} pins"]
    for item in items:
        pattern = text(item.name)
        for number in range(instances if "%d" in pattern else 1):
            full = pattern.replace("%d", str(number))
            fault = _fault(name, full, item) or (f"pin {full} is there twice" if full in pins else None)
            if fault:
                notes.append(fault)
            else:
                pins[full] = PinDefinition(full, Kind(item.type), Direction(item.dir))
    return (None, notes) if notes else (Definition(name, tuple(pins.values())), [])


def _fault(component: str, name: str, item: Pin) -> str | None:
    if not item.HasField("name"):
        return f"a pin of component {component} has no name"
    if fault := pin_fault(component, name):
        return fault
    if item.type not in list(Kind):
        return f"pin {name} has the type {item.type}; there are {_choice(Kind)}"
    if item.dir not in list(Direction):
        return f"pin {name} has the direction {item.dir}; there are {_choice(Direction)}"
    return None


def _choice(kinds: type[enum.IntEnum]) -> str:
    return ", ".join(f"{one.value} ({one.name})" for one in kinds)
