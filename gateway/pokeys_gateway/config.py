# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeys-gateway.conf(5): one table of keys.

Every fault is found in one reading and reported in one line with file and line number, as pokeysd
does it. configparser stops at the first fault of syntax, and knows no line numbers afterwards.
"""
from __future__ import annotations

import ipaddress
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

PATH = Path("/etc/pokeysd/gateway.conf")
RUNTIME, PORT = "/run/pokeysd", 8580
DIRECTORY_MOST = 49         # pokeysd's sockets lie below it
_NAME = re.compile(r"[a-z0-9]([a-z0-9.-]{0,252}[a-z0-9])?")


class Faults(Exception):
    """What is wrong with the configuration, a line each."""

    def __init__(self, lines: list[str]) -> None:
        super().__init__("\n".join(lines))
        self.lines = lines


@dataclass(frozen=True)
class Endpoint:
    """An address to listen on."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


@dataclass(frozen=True)
class Config:
    """All settings."""

    runtime_directory: str = RUNTIME
    listen: tuple[Endpoint, ...] = (Endpoint("127.0.0.1", PORT),)
    host_names: tuple[str, ...] = field(default=())


def directory(text: str) -> str:
    """An absolute path that is short enough. ValueError says what is allowed."""
    try:
        size = len(text.encode())
    except UnicodeEncodeError:
        size = DIRECTORY_MOST + 1
    if not text.startswith("/") or size > DIRECTORY_MOST or not text.isprintable():
        raise ValueError(f"a path from / of at most {DIRECTORY_MOST} characters (bytes of UTF-8)")
    return text


def endpoint(text: str) -> Endpoint:
    """ADDRESS:PORT of this computer's loopback interface. ValueError says what is allowed."""
    found = re.fullmatch(r"(?:\[([^]]+)\]|([^:]+)):(\d{1,5})", text)
    try:
        if not found or not 1 <= int(found[3]) <= 65535:
            raise ValueError
        address = ipaddress.ip_address(found[1] or found[2])
    except ValueError:
        raise ValueError(f"ADDRESS:PORT, such as 127.0.0.1:{PORT} or [::1]:{PORT}") from None
    return loopback(str(address), int(found[3]))


def loopback(host: str, port: int) -> Endpoint:
    """An endpoint that only this computer reaches: whoever opens the page sees the machine. ValueError."""
    if not ipaddress.ip_address(host).is_loopback:
        raise ValueError("addresses of this computer alone (127.0.0.1, ::1): there is no access control yet")
    return Endpoint(host, port)


def endpoints(text: str) -> tuple[Endpoint, ...]:
    """One or several endpoints, separated by commas."""
    found = tuple(endpoint(word.strip()) for word in text.split(","))
    if len(set(found)) < len(found):
        raise ValueError("each address once")
    return found


def host_names(text: str) -> tuple[str, ...]:
    """Names of this computer, separated by commas."""
    names = tuple(word.strip().lower() for word in text.split(",") if word.strip())
    if not all(_NAME.fullmatch(name) for name in names):
        raise ValueError("names of this computer, such as mill.local")
    return names


@dataclass(frozen=True)
class Key:
    """A key of the file."""

    section: str
    name: str
    convert: Callable[[str], Any]

    @property
    def attribute(self) -> str:
        """Its name in :class:`Config`."""
        return self.name.replace("-", "_")


KEYS = (
    Key("gateway", "runtime-directory", directory),
    Key("http", "listen", endpoints),
    Key("http", "host-names", host_names),
)


class _Reader:
    """A file, line by line."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.values: dict[str, Any] = {}
        self.faults: list[str] = []
        self._section: str | None = None
        self._seen: set[tuple[str, str]] = set()
        self._line = 0

    def read(self, text: str) -> None:
        """All of it."""
        for self._line, line in enumerate(text.split("\n"), 1):
            # a comment begins the line, or follows a space
            bare = re.sub(r"(?:^|(?<=\s))[#;].*", "", line).strip()
            if found := re.fullmatch(r"\[([^][]*)\]", bare):
                self._begin(found[1].strip())
            elif found := re.fullmatch(r"([^=]*?)\s*=\s*(.*)", bare):
                self._take(found[1], found[2])
            elif bare:
                self._complain("neither a section in brackets nor KEY = VALUE")

    def _complain(self, text: str) -> None:
        self.faults.append(f"{self.path}:{self._line}: {text}")

    def _begin(self, section: str) -> None:
        names = list(dict.fromkeys(key.section for key in KEYS))
        self._section = section
        if section not in names:
            self._complain(f"there is no section [{section}]; there are {', '.join(f'[{name}]' for name in names)}")

    def _take(self, name: str, text: str) -> None:
        if self._section is None:
            self._complain("a section such as [http] has to come first")
            return
        of_section = {key.name: key for key in KEYS if key.section == self._section}
        if not of_section:
            return      # the section itself is a fault
        where = f"[{self._section}] {name}"
        if name not in of_section:
            self._complain(f"{where}: there is no such key; there are {', '.join(of_section)}")
        elif (self._section, name) in self._seen:
            self._complain(f"{where}: is there already")
        else:
            self._seen.add((self._section, name))
            key = of_section[name]
            try:
                self.values[key.attribute] = key.convert(text)
            except ValueError as error:
                self._complain(f'{where}: "{text}" is not allowed; allowed: {error}')


def read(path: Path | None) -> Config:
    """The configuration of a file; without one, PATH if it is there. :class:`Faults`."""
    wanted = path or PATH
    try:
        text = wanted.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        if not path:
            return Config()
        raise Faults([f"{wanted}: {error.strerror}"]) from None
    except OSError as error:
        raise Faults([f"{wanted}: {error.strerror}"]) from None
    except UnicodeDecodeError:
        raise Faults([f"{wanted}: not a text file (UTF-8)"]) from None
    reader = _Reader(wanted)
    reader.read(text)
    if reader.faults:
        raise Faults(reader.faults)
    return replace(Config(), **reader.values)
