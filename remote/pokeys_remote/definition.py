# SPDX-License-Identifier: GPL-2.0-or-later
"""What a remote component is: names, types and directions of its pins, and what happens without its clients.

The numbers of types and directions are the protocol's, and HAL's.
"""
from __future__ import annotations

import enum
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

Value = bool | int | float

NAME_MOST = 47              # HAL_NAME_LEN, in bytes
PINS_MOST = 256             # of a component
INTERVAL_LEAST, INTERVAL_MOST = 0.01, 10.0      # s
LEASE_LEAST, LEASE_MOST = 0.05, 3600.0          # s
EPSILON = 1e-5              # machinekit's
OWN = ("link-ok", "bound", "clients", "age", "heartbeat")       # pins that each component has besides
COMPONENT_MOST = NAME_MOST - max(len(f".{name}") for name in OWN)
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_PIN = re.compile(r"[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*")


class Kind(enum.IntEnum):
    """HAL's types."""

    BIT = 1
    FLOAT = 2
    S32 = 3
    U32 = 4


class Direction(enum.IntEnum):
    """As the component has it: an OUT pin is set by a client, and the machine reads it."""

    IN = 16
    OUT = 32
    IO = 48


RANGES = {Kind.S32: (-2**31, 2**31 - 1), Kind.U32: (0, 2**32 - 1)}


def value_of(kind: Kind, text: str) -> Value:
    """A value as text. ValueError says what is allowed."""
    if kind is Kind.BIT:
        words = {"0": False, "1": True, "false": False, "true": True}
        if text.lower() not in words:
            raise ValueError("0, 1, false, true")
        return words[text.lower()]
    try:
        if kind is Kind.FLOAT:
            number = float(text)
            if not math.isfinite(number):
                raise ValueError
            return number
        whole = int(text, 0)
    except ValueError:
        raise ValueError("a number" if kind is Kind.FLOAT else "a whole number") from None
    least, most = RANGES[kind]
    if not least <= whole <= most:
        raise ValueError(f"a whole number from {least} to {most}")
    return whole


def differs(kind: Kind, old: Value | None, new: Value, epsilon: float) -> bool:
    """Is a value something else than the one that clients have, if they have one?"""
    if old is None or kind is not Kind.FLOAT:
        return new != old
    if math.isfinite(old) and math.isfinite(new):
        return abs(new - old) > epsilon
    return not (old == new or (math.isnan(old) and math.isnan(new)))


def component_name(text: str) -> str:
    """The name of a component. ValueError says what is allowed."""
    # a name with a dot ends machinekit's client: it takes what follows the first dot as the pin's name
    if not _NAME.fullmatch(text) or len(text) > COMPONENT_MOST:
        raise ValueError(f"a letter, then letters, digits, - and _ (no dot), at most {COMPONENT_MOST} characters")
    return text


def pin_name(text: str) -> str:
    """The name of a pin, with that of its component in front. ValueError says what is allowed."""
    component, dot, pin = text.partition(".")
    if not dot or not _NAME.fullmatch(component) or not _PIN.fullmatch(pin) or len(text) > NAME_MOST:
        raise ValueError(f"COMPONENT.PIN of letters, digits, -, _ and dots, at most {NAME_MOST} characters")
    if pin in OWN:
        raise ValueError(f"other pins than {', '.join(OWN)}, which each remote component has besides")
    return text


def pin_fault(component: str, name: str) -> str | None:
    """Why a component cannot have a pin with this name; None if it can."""
    if not name.startswith(f"{component}."):
        return f'pin "{name}" is not of component {component}; its name has to begin with "{component}."'
    try:
        pin_name(name)
    except ValueError as error:
        return f'the name of pin "{name}" is not allowed; allowed: {error}'
    return None


@dataclass(frozen=True)
class Pin:
    """A pin, as a client or a HAL file describes it."""

    name: str               # with the component's
    kind: Kind
    direction: Direction

    def __str__(self) -> str:
        return f"{self.name} ({self.kind.name.lower()}, {self.direction.name})"


@dataclass(frozen=True)
class Care:
    """What the configuration says of a pin."""

    epsilon: float = EPSILON            # smaller changes of a float are not sent
    failsafe: str | None = None         # the value without its setter; None: it keeps the last one
    lease: str = ""                     # of which lease it is; "": of the component's own


@dataclass(frozen=True)
class Rules:
    """What the configuration says of a component."""

    interval: float = 0.1               # s between looks at the pins
    lease: float = 6.0                  # s without a message of the setter, of pins without a lease
    pins: Mapping[str, Care] = field(default_factory=dict)      # by full name
    leases: Mapping[str, float] = field(default_factory=dict)   # s


@dataclass(frozen=True)
class Watched:
    """A group of signals, as the configuration has it."""

    signals: tuple[str, ...]            # names, with * and ?
    interval: float = 0.1               # s between looks at them
    epsilon: float = EPSILON


@dataclass(frozen=True)
class Definition:
    """A component. ValueError if the names do not make one."""

    name: str
    pins: tuple[Pin, ...]

    def differences(self, other: Definition, there: str) -> list[str]:
        """Why another description, such as that "in the request", is not of this component; empty if it is."""
        mine, others = ({pin.name: pin for pin in one.pins} for one in (self, other))
        found = [f"pin {name} is {mine[name].kind.name.lower()} and {mine[name].direction.name} here, and "
                 f"{pin.kind.name.lower()} and {pin.direction.name} {there}"
                 for name, pin in others.items() if name in mine and mine[name] != pin]
        found += [f"component {self.name} has no pin {name}" for name in others if name not in mine]
        found += [f"pin {name} is missing {there}" for name in mine if name not in others]
        return found
