# SPDX-License-Identifier: GPL-2.0-or-later
"""A line of G-code, as hosts send it to Marlin: number, checksum, command, words, comment. Pure, without state.

"N10 G1 X1*80 ; comment": N and the checksum, which is the exclusive or of all bytes before *, belong
together. Letters may be small, and spaces are optional, but in texts (M117).
"""
from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

LINE_MOST = 256             # characters, without the end
DIGITS_MOST = 10            # of a line number, with its sign
_NUMBER = re.compile(rb"[Nn][ \t]*([+-]?\d+)")
_SUM = re.compile(rb"\*[ \t]*(\d{1,3})\Z")
_COMMAND = re.compile(r"([GMT])\s*(\d{1,5})(?:\.(\d{1,2}))?(?![\d.])", re.I | re.A)
_WORD = re.compile(r"([A-Z])\s*([+-]?(?:\d+\.?\d*|\.\d+))?\s*", re.I | re.A)
_TEXT = re.compile(rb"[Mm][ \t]*(?:117|118)(?!\d)")        # commands that take a text
_JOG = re.compile(r"\$J\s*=", re.I)         # as grbl has it
_PARENTHESES = re.compile(r"\([^()]*\)")


class BadLine(Exception):
    """What is wrong; a host that numbers its lines has to send it again."""


class BadWords(Exception):
    """What is wrong with what stands behind a command."""


@dataclass(frozen=True)
class Line:
    """A line that is as it was sent."""

    number: int | None      # None: its sender does not number
    name: str               # such as G1, M105, G38.2, T, $J or ?; "": no command
    argument: str           # what stands behind it
    text: str               # both, for messages

    @property
    def arguments(self) -> str:
        """The argument without comments."""
        return _PARENTHESES.sub(" ", self.argument).strip()

    @property
    def code(self) -> str:
        """All of it without comments."""
        return _PARENTHESES.sub(" ", self.text).strip()

    def words(self) -> dict[str, float | None]:
        """The argument's letters and their numbers, None if a letter stands alone. :class:`BadWords`."""
        found: dict[str, float | None] = {}
        for letter, number in tokens(self.arguments):
            if letter in found:
                raise BadWords(f"{letter} occurs twice")
            found[letter] = float(number) if number else None
        return found


def tokens(text: str) -> Iterator[tuple[str, str]]:
    """Letters and their numbers as they are written, "" if a letter stands alone. :class:`BadWords`."""
    at = 0
    while at < len(text):
        word = _WORD.match(text, at)
        if not word:
            raise BadWords(f'"{text[at:at + 16]}" is not a letter with a number')
        # an O in place of a 0 would make another number of it
        if not word[2] and at and (text[at - 1].isdigit() or text[at - 1] == "."):
            raise BadWords(f'"{text[at - 1:at + 15]}" is not a number')
        yield word[1].upper(), word[2] or ""
        at = word.end()


def parse(data: bytes) -> Line | None:
    """A line, with or without its end; None if nothing is in it but a comment. :class:`BadLine`."""
    body = data.partition(b";")[0].strip()
    number = None
    if found := _NUMBER.match(body):
        if len(found[1]) > DIGITS_MOST:
            raise BadLine(f"a line number has at most {DIGITS_MOST - 1} digits")
        number = int(found[1])
        total = _SUM.search(body)
        if not total:
            raise BadLine("No Checksum with line number")
        if int(total[1]) != checksum(body[:total.start()]):
            raise BadLine("checksum mismatch")
        body = body[found.end():total.start()].strip()
    elif not _TEXT.match(body):
        body = _SUM.sub(b"", body).strip()      # it says nothing without a number
    text = body.decode("utf-8", "replace")
    if not _PARENTHESES.sub("", text).strip():
        text = ""
    if not text and number is None:
        return None
    if text == "?":
        return Line(number, text, "", text)
    if jog := _JOG.match(text):
        return Line(number, "$J", text[jog.end():].strip(), text)
    command = _COMMAND.match(text)
    if not command:
        return Line(number, "", "", text)
    name = f"{command[1].upper()}{int(command[2])}" + (f".{command[3]}" if command[3] else "")
    if name[0] == "T":
        return Line(number, "T", text, text)        # its number is a word
    return Line(number, name, text[command.end():].strip(), text)


def number_of(data: bytes) -> int | None:
    """The number of a line, of which only the beginning may be there."""
    found = _NUMBER.match(data.strip())
    return int(found[1]) if found and len(found[1]) <= DIGITS_MOST else None


def is_summed(data: bytes) -> bool:
    """Has the line a checksum?"""
    body = data.partition(b";")[0].strip()
    return not _TEXT.match(body) and _SUM.search(body) is not None


def checksum(data: bytes) -> int:
    """The exclusive or of all bytes."""
    total = 0
    for byte in data:
        total ^= byte
    return total
