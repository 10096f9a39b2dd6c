# SPDX-License-Identifier: MIT
"""The configuration files of the programs that are written in Python.

A file is read whole: every fault becomes a line with file and line number, as pokeysd does it. configparser
stops at the first fault of syntax, and knows no line numbers afterwards.
"""
from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any


class Faults(Exception):
    """What is wrong with a configuration, a line each."""

    def __init__(self, lines: list[str]) -> None:
        super().__init__("\n".join(lines))
        self.lines = lines


def yes_or_no(text: str) -> bool:
    """A switch, for a :class:`Key`."""
    if text not in ("yes", "no"):
        raise ValueError("yes, no")
    return text == "yes"


@dataclass(frozen=True)
class Key:
    """A key of the file. ``convert`` raises ValueError, with what is allowed as its text."""

    section: str
    name: str
    convert: Callable[[str], Any]

    @property
    def attribute(self) -> str:
        """Its name in Python."""
        return self.name.replace("-", "_")


@dataclass(frozen=True)
class Named:
    """A kind of section that is there once for each name, such as ``[pin panel.start]``."""

    kind: str
    convert: Callable[[str], str]
    example: str


class File:
    """What a file says: values and places by section, name of the section, and key's attribute.

    The name is empty for sections without one.
    """

    def __init__(self, path: Path, keys: Iterable[Key], named: Iterable[Named] = ()) -> None:
        self.path = path
        self.values: dict[tuple[str, str], dict[str, Any]] = {}
        self.places: dict[tuple[str, str, str], str] = {}
        self.faults: list[str] = []
        self._keys = list(keys)
        self._named = {one.kind: one for one in named}
        self._section: tuple[str, str] | None = None
        self._line = 0
        self._begun = False

    def read(self) -> File:
        """All of it. :class:`Faults`, and FileNotFoundError."""
        try:
            text = self.path.read_text(encoding="utf-8")
        except FileNotFoundError:
            raise
        except OSError as error:
            raise Faults([f"{self.path}: {error.strerror}"]) from None
        except UnicodeDecodeError:
            raise Faults([f"{self.path}: not a text file (UTF-8)"]) from None
        for self._line, line in enumerate(text.split("\n"), 1):
            # a comment begins the line, or follows a space
            bare = re.sub(r"(?:^|(?<=\s))[#;].*", "", line).strip()
            if found := re.fullmatch(r"\[([^][]*)\]", bare):
                self._begin(found[1].strip())
            elif found := re.fullmatch(r"([^=]*?)\s*=\s*(.*)", bare):
                self._take(found[1], found[2])
            elif bare:
                self._complain("neither a section in brackets nor KEY = VALUE")
        if self.faults:
            raise Faults(self.faults)
        return self

    def _complain(self, text: str) -> None:
        self.faults.append(f"{self.path}:{self._line}: {text}")

    def _headings(self) -> list[str]:
        """The sections that there are, as they are written."""
        sections = list(dict.fromkeys(key.section for key in self._keys))
        return [self._named[section].example if section in self._named else f"[{section}]" for section in sections]

    def _begin(self, heading: str) -> None:
        self._begun, self._section = True, None
        kind, _, name = heading.partition(" ")
        named = self._named.get(kind)
        if not any(key.section == kind for key in self._keys) or bool(name) != bool(named):
            self._complain(f"there is no section [{heading}]; there are {', '.join(self._headings())}")
            return
        try:
            self._section = (kind, named.convert(name.strip()) if named else "")
        except ValueError as error:
            self._complain(f'[{heading}]: the name "{name}" is not allowed; allowed: {error}')
            return
        self.values.setdefault(self._section, {})
        self.places.setdefault((*self._section, ""), f"{self.path}:{self._line}: [{heading}]")

    def _take(self, name: str, text: str) -> None:
        if self._section is None:
            if not self._begun:
                self._complain(f"a section such as {self._headings()[0]} has to come first")
            return      # otherwise the section itself is a fault
        of_section = {key.name: key for key in self._keys if key.section == self._section[0]}
        where = f"[{' '.join(filter(None, self._section))}] {name}"
        if name not in of_section:
            near = difflib.get_close_matches(name, of_section, 1)
            self._complain(f"{where}: there is no such key; " +
                           (f"did you mean {near[0]}?" if near else f"there are {', '.join(of_section)}"))
            return
        key = of_section[name]
        if (*self._section, key.attribute) in self.places:
            self._complain(f"{where}: is there already")
            return
        self.places[(*self._section, key.attribute)] = f"{self.path}:{self._line}: {where}"
        try:
            self.values[self._section][key.attribute] = key.convert(text)
        except ValueError as error:
            self._complain(f'{where}: "{text}" is not allowed; allowed: {error}')
