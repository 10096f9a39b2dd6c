# SPDX-License-Identifier: GPL-2.0-or-later
"""What the lines of a file before a place have set. A job that begins there goes on with it: with other units, or
with positions that are absolute instead of relative, its first move would go elsewhere. Belongs into a thread."""
from __future__ import annotations

import re

from .lane import Modes
from .lines import whole_lines
from .member import INCH

# comments, and texts for people
_NO_WORDS = re.compile(rb";[^\n]*|\([^()\n]*\)|^[ \t]*(?:N[ \t]*\d+[ \t]*)?M[ \t]*11[78](?!\d)[^\n]*", re.I | re.M)
_WORD = re.compile(rb"([GMTF])[ \t]*0*(\d+(?:\.\d*)?|\.\d+)", re.I)
_MOVES = {b"0": "G0", b"1": "G1", b"2": "G2", b"3": "G3", b"80": ""}


def modes_before(file: int, end: int) -> Modes:
    """Of an open file."""
    modes, at = Modes(), 0
    while at < end and (data := whole_lines(file, at)):
        for letter, number in _WORD.findall(_NO_WORDS.sub(b"", data[:end - at])):
            _set(modes, letter.upper(), number.removesuffix(b"."))
        at += len(data)
    return modes


def _set(modes: Modes, letter: bytes, number: bytes) -> None:
    if letter == b"F":
        modes.set_feed(float(number))
    elif letter == b"T":
        modes.tool = int(float(number))
    elif letter == b"M":
        if number in (b"2", b"30", b"82", b"83"):
            modes.relative_extruder = number == b"83"
        if number in (b"2", b"30"):
            modes.relative, modes.motion = False, ""
    elif number in (b"20", b"21"):
        modes.scale = INCH if number == b"20" else 1.0
    elif number in (b"90", b"91"):
        modes.relative = modes.relative_extruder = number == b"91"
    elif number in _MOVES:
        modes.motion = _MOVES[number]
