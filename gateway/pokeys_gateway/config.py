# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeys-gateway.conf(5): one table of keys.

Every fault is found in one reading and told in one line with file and line number, as pokeysd
does it. configparser knows no lines once it has parsed, so they are looked up by section and key.
"""
from __future__ import annotations

import configparser
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
    if not text.startswith("/") or len(text) > DIRECTORY_MOST or "\0" in text:
        raise ValueError(f"a path from / of at most {DIRECTORY_MOST} characters")
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
    # whoever may open the page sees the machine: without users and encryption that is this computer's users
    if not address.is_loopback:
        raise ValueError("addresses of this computer alone (127.0.0.1, ::1): there is no access control yet")
    return Endpoint(str(address), int(found[3]))


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


class _Lines:
    """Where sections and keys are in a file."""

    def __init__(self, text: str) -> None:
        self.sections: dict[str, int] = {}
        self.keys: dict[tuple[str, str], int] = {}
        section = ""
        for number, line in enumerate(text.splitlines(), 1):
            if found := re.match(r"\[([^]]*)\]", line):
                section = found[1]
                self.sections.setdefault(section, number)
            elif found := re.match(r"([^#;\s=][^=]*?)\s*=", line):
                self.keys.setdefault((section, found[1]), number)


def _parse(path: Path, text: str) -> configparser.ConfigParser:
    parser = configparser.ConfigParser(interpolation=None, delimiters=("=",), comment_prefixes=("#", ";"),
                                       inline_comment_prefixes=(" #", " ;"), empty_lines_in_values=False,
                                       default_section="\0")
    parser.optionxform = str    # type: ignore[assignment]
    try:
        parser.read_string(text)
    except configparser.DuplicateOptionError as error:
        raise Faults([f"{path}:{error.lineno}: [{error.section}] {error.option}: is there already"]) from None
    except configparser.DuplicateSectionError as error:
        raise Faults([f"{path}:{error.lineno}: [{error.section}] is there already"]) from None
    except configparser.MissingSectionHeaderError as error:
        raise Faults([f"{path}:{error.lineno}: a section such as [http] has to come first"]) from None
    except configparser.ParsingError as error:
        raise Faults([f"{path}:{line}: neither a section nor KEY = VALUE" for line, _ in error.errors]) from None
    return parser


def _judge(path: Path, parser: configparser.ConfigParser, lines: _Lines) -> tuple[dict[str, Any], list[str]]:
    known = {(key.section, key.name): key for key in KEYS}
    values: dict[str, Any] = {}
    faults = []
    for section in parser.sections():
        if not any(key.section == section for key in KEYS):
            names = ", ".join(f"[{name}]" for name in dict.fromkeys(key.section for key in KEYS))
            faults.append(f"{path}:{lines.sections[section]}: there is no section [{section}]; there are {names}")
            continue
        for name, text in parser[section].items():
            where = f"{path}:{lines.keys.get((section, name), lines.sections[section])}: [{section}] {name}"
            key = known.get((section, name))
            if not key:
                names = ", ".join(key.name for key in KEYS if key.section == section)
                faults.append(f"{where}: there is no such key; there are {names}")
                continue
            try:
                values[key.attribute] = key.convert(text)
            except ValueError as error:
                faults.append(f'{where}: "{text}" is not allowed; allowed: {error}')
    return values, faults


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
    values, faults = _judge(wanted, _parse(wanted, text), _Lines(text))
    if faults:
        raise Faults(faults)
    return replace(Config(), **values)
