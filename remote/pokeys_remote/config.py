# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeys-remote.conf(5): one table of keys."""
from __future__ import annotations

import ipaddress
import itertools
import math
import pwd
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pokeys._ini import Faults, File, Key, Named, yes_or_no

from .definition import (
    INTERVAL_LEAST,
    INTERVAL_MOST,
    LEASE_LEAST,
    LEASE_MOST,
    Care,
    Kind,
    Rules,
    Watched,
    component_name,
    pin_name,
    value_of,
)
from .keys import judge_folder, secret_of

SOCKET_MOST = 107           # bytes of a socket's path (unix(7))
PORTS = {"command": 6202, "update": 6201, "group": 6200}
_WORD = re.compile(r"[A-Za-z0-9_-]{1,32}")
_PATTERN = re.compile(r"[A-Za-z0-9_.*?\[\]-]+")


def endpoints(one: Callable[[str], str]) -> Callable[[str], tuple[str, ...]]:
    """Where a socket listens, for ZeroMQ: a list of what ``one`` converts."""
    def convert(text: str) -> tuple[str, ...]:
        found = tuple(one(word.strip()) for word in text.split(","))
        if len(set(found)) < len(found):
            raise ValueError("each address once")
        return found
    return convert


def here(text: str) -> str:
    """A place that only this computer reaches."""
    allowed = "127.0.0.1:PORT, [::1]:PORT or a path from / of a unix socket"
    if text.startswith("/"):
        if len(text.encode()) > SOCKET_MOST or not text.isprintable():
            raise ValueError(f"{allowed} (at most {SOCKET_MOST} bytes)")
        return f"ipc://{text}"
    address = _address(text)
    if not address or not address.is_loopback:
        raise ValueError(allowed)
    return f"tcp://{text}"


def in_the_network(text: str) -> str:
    """A place of an encrypted socket."""
    address = _address(text)
    address = getattr(address, "ipv4_mapped", None) or address
    if not address or address.is_unspecified or address.is_multicast:
        raise ValueError("ADDRESS:PORT or [ADDRESS]:PORT, with an address of this computer in the network")
    return f"tcp://{text}"


def _address(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """That of ADDRESS:PORT, if it is one."""
    found = re.fullmatch(r"(?:\[([^]]+)\]|([^:]+)):(\d{1,5})", text)
    if not found or not 1 <= int(found[3]) <= 65535:
        return None
    try:
        return ipaddress.ip_address(found[1] or found[2])
    except ValueError:
        return None


def milliseconds(least: float, most: float) -> Callable[[str], float]:
    """A time in whole ms, as s."""
    def convert(text: str) -> float:
        if not re.fullmatch(r"\d{1,9}", text) or not least <= int(text) / 1000 <= most:
            raise ValueError(f"a whole number from {least * 1000:.0f} to {most * 1000:.0f}")
        return int(text) / 1000
    return convert


def epsilon(text: str) -> float:
    """A difference that is not worth a message."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0 <= number < math.inf:
        raise ValueError("a number from 0")
    return number


def failsafe(text: str) -> str:
    """A value; of which type is known when the pin is."""
    for kind in (Kind.BIT, Kind.FLOAT):
        try:
            value_of(kind, text)
            return text
        except ValueError:
            continue
    raise ValueError("a number, true, false")


def word(text: str) -> str:
    """The name of a lease or a group."""
    if not _WORD.fullmatch(text):
        raise ValueError("at most 32 letters, digits, - and _")
    return text


def patterns(text: str) -> tuple[str, ...]:
    """Names of HAL with * and ?."""
    found = tuple(one.strip() for one in text.split(",") if one.strip())
    if not all(_PATTERN.fullmatch(one) for one in found):
        raise ValueError("names of HAL, in which * stands for any characters, separated by commas")
    return found


def users(text: str) -> frozenset[int]:
    """Numbers of users by name."""
    found = set()
    for name in text.split(","):
        try:
            found.add(pwd.getpwnam(name.strip()).pw_uid)
        except KeyError:
            raise ValueError("names of users of this computer, separated by commas") from None
    return frozenset(found)


def file(text: str) -> Path:
    """A path."""
    if not text:
        raise ValueError("a path")
    return Path(text)


KEYS = (
    Key("remote", "command", endpoints(here)),
    Key("remote", "update", endpoints(here)),
    Key("remote", "group", endpoints(here)),
    Key("remote", "create", yes_or_no),
    Key("secure", "command", endpoints(in_the_network)),
    Key("secure", "update", endpoints(in_the_network)),
    Key("secure", "group", endpoints(in_the_network)),
    Key("secure", "key", file),
    Key("secure", "clients", file),
    Key("secure", "announce", yes_or_no),
    Key("component", "interval-ms", milliseconds(INTERVAL_LEAST, INTERVAL_MOST)),
    Key("component", "lease-ms", milliseconds(LEASE_LEAST, LEASE_MOST)),
    Key("pin", "failsafe", failsafe),
    Key("pin", "lease", word),
    Key("pin", "epsilon", epsilon),
    Key("lease", "timeout-ms", milliseconds(LEASE_LEAST, LEASE_MOST)),
    Key("group", "signals", patterns),
    Key("group", "interval-ms", milliseconds(INTERVAL_LEAST, INTERVAL_MOST)),
    Key("group", "epsilon", epsilon),
    Key("operate", "users", users),
    Key("operate", "messages", yes_or_no),
    Key("offer", "read", patterns),
    Key("offer", "write", patterns),
)
NAMED = (
    Named("component", component_name, "[component NAME]"),
    Named("pin", pin_name, "[pin COMPONENT.PIN]"),
    Named("lease", word, "[lease NAME]"),
    Named("group", word, "[group NAME]"),
)


@dataclass(frozen=True)
class Secure:
    """The sockets of the network."""

    command: tuple[str, ...]
    update: tuple[str, ...]
    secret: bytes               # key of this proxy
    clients: Path               # folder of the keys of clients
    group: tuple[str, ...] = ()
    announce: bool = False


@dataclass(frozen=True)
class Config:
    """All settings."""

    command: tuple[str, ...] = (f"tcp://127.0.0.1:{PORTS['command']}",)
    update: tuple[str, ...] = (f"tcp://127.0.0.1:{PORTS['update']}",)
    group: tuple[str, ...] = (f"tcp://127.0.0.1:{PORTS['group']}",)
    secure: Secure | None = None
    create: bool = True
    read: tuple[str, ...] = ()
    write: tuple[str, ...] = ()
    operators: frozenset[int] = frozenset()
    messages: bool = False
    components: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    pins: Mapping[str, Care] = field(default_factory=dict)
    leases: Mapping[str, float] = field(default_factory=dict)
    groups: Mapping[str, Watched] = field(default_factory=dict)

    def rules(self, component: str) -> Rules:
        """What is set for a component."""
        pins = {name: care for name, care in self.pins.items() if name.startswith(f"{component}.")}
        return Rules(pins=pins, leases={care.lease: self.leases[care.lease] for care in pins.values() if care.lease},
                     **self.components.get(component, {}))


def read(path: Path | None) -> Config:
    """The configuration of a file. :class:`Faults`."""
    if not path:
        return Config()
    try:
        found = File(path, KEYS, NAMED).read()
    except FileNotFoundError as error:
        raise Faults([f"{path}: {error.strerror}"]) from None
    by_kind: dict[str, dict[str, dict[str, Any]]] = {}
    for (kind, name), values in found.values.items():
        by_kind.setdefault(kind, {})[name] = values
    leases = {name: values.get("timeout_ms") for name, values in by_kind.get("lease", {}).items()}
    faults = [f"{found.places['lease', name, '']}: timeout-ms is missing" for name, time in leases.items() if not time]
    faults += [f"{found.places['pin', name, 'lease']}: there is no section [lease {values['lease']}]"
               for name, values in by_kind.get("pin", {}).items() if values.get("lease", "") not in {"", *leases}]
    groups = by_kind.get("group", {})
    faults += [f"{found.places['group', name, '']}: signals is missing" for name, values in groups.items()
               if not values.get("signals")]
    # ZeroMQ compares the beginning of a topic
    faults += [f"{found.places['group', long, '']}: clients of group {short} would also get its messages; choose a "
               f"name that does not begin with {short}" for short in groups for long in groups
               if short != long and long.startswith(short)]
    used: dict[str, str] = {}
    for section, key in itertools.product(("remote", "secure"), PORTS):
        for place in by_kind.get(section, {}).get("", {}).get(key, ()):
            if other := used.get(place):
                faults.append(f"{found.places[section, '', key]}: {place.partition('://')[2]} is used by {other} "
                              "already")
            used[place] = f"[{section}] {key}"
    secure, wrong = _secure(path, by_kind.get("secure", {}).get(""), found.places)
    if faults := faults + wrong:
        raise Faults(faults)
    operate = by_kind.get("operate", {}).get("", {})
    names = {"interval_ms": "interval", "lease_ms": "lease"}
    return Config(
        components={name: {names[key]: value for key, value in values.items()}
                    for name, values in by_kind.get("component", {}).items()},
        pins={name: Care(**values) for name, values in by_kind.get("pin", {}).items()},
        leases={name: time for name, time in leases.items() if time is not None},
        groups={name: Watched(**{{"interval_ms": "interval"}.get(key, key): value for key, value in values.items()})
                for name, values in groups.items()},
        secure=secure,
        operators=operate.get("users", frozenset()), messages=operate.get("messages", False),
        **by_kind.get("remote", {}).get("", {}), **by_kind.get("offer", {}).get("", {}))


def _secure(path: Path, values: dict[str, Any] | None,
            places: Mapping[tuple[str, str, str], str]) -> tuple[Secure | None, list[str]]:
    """What the section says, and what is wrong with it."""
    if values is None:
        return None, []
    faults = [f"{places['secure', '', '']}: {key} is missing" for key in ("command", "update", "key", "clients")
              if key not in values]
    # files are found from where the configuration is
    key, clients = (path.parent / values[name] if name in values else None for name in ("key", "clients"))
    secret = b""
    if key:
        try:
            secret = secret_of(key)
        except ValueError as error:
            faults.append(f"{places['secure', '', 'key']}: {error}")
    if clients:
        try:
            judge_folder(clients)
        except ValueError as error:
            faults.append(f"{places['secure', '', 'clients']}: {error}")
    if faults or not clients:
        return None, faults
    return Secure(values["command"], values["update"], secret, clients, values.get("group", ()),
                  values.get("announce", False)), []
