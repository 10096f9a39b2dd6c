# SPDX-License-Identifier: GPL-2.0-or-later
"""What the lines of a file before a place have set. A job that begins there goes on with it: with other units, or
with positions that are absolute instead of relative, its first move would go elsewhere. Belongs into a thread."""
from __future__ import annotations

import re

from .lane import Modes
from .lines import whole_lines
from .member import INCH, LETTERS

# comments, and numbers of lines
_NO_WORDS = re.compile(rb";[^\n]*|\([^()\n]*\)|^[ \t]*N[ \t]*\d+", re.I | re.M)
# what stands behind them is a text, or a name
_TEXT = re.compile(rb"M[ \t]*0*(?:0|1|6|23|28|32|117|118|226)(?!\d)", re.I)
_WORD = re.compile(rb"([GMTF])[ \t]*0*(\d+(?:\.\d*)?|\.\d+)", re.I)
_OF_MOVES = (LETTERS + "F").encode()
_MOVES = {b"0": "G0", b"1": "G1", b"2": "G2", b"3": "G3", b"80": ""}


def modes_before(file: int, end: int) -> Modes:
    """Of an open file."""
    modes, at = Modes(), 0
    while at < end and (data := whole_lines(file, at)):
        for line in _NO_WORDS.sub(b"", data[:end - at]).splitlines():
            _take(modes, line.strip())
        at += len(data)
    return modes


def _take(modes: Modes, line: bytes) -> None:
    if _TEXT.match(line):
        return
    words = [(letter.upper(), number.removesuffix(b".")) for letter, number in _WORD.findall(line)]
    first = line[:1].upper()
    # a tool belongs to T, and a speed to a move; other commands have such words of their own
    moves = any(letter == b"G" for letter, _ in words) or first in _OF_MOVES
    for letter, number in words:
        if letter == b"T":
            modes.tool = int(float(number)) if first == b"T" else modes.tool
        elif letter == b"F":
            modes.set_feed(float(number) if moves else 0.0)
        elif letter == b"M":
            modes.relative_extruder = modes.relative_extruder if number not in (b"82", b"83") else number == b"83"
        elif number in (b"20", b"21"):
            modes.scale = INCH if number == b"20" else 1.0
        elif number in (b"90", b"91"):
            modes.relative = modes.relative_extruder = number == b"91"
        elif number in _MOVES:
            modes.motion = _MOVES[number]
    if any(word in ((b"M", b"2"), (b"M", b"30")) for word in words):        # the program ends
        modes.relative, modes.relative_extruder, modes.motion = False, False, ""
