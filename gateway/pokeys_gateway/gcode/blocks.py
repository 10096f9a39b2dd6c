# SPDX-License-Identifier: GPL-2.0-or-later
"""Lines with several commands, and moves without a command, as CAM programs write them (RS274/NGC).

"G90 G1 X5 F600 M3 S1000" is carried out in the order of the standard, whatever the order in the line: spindle, units,
distance mode, the move with its speed, the end of the program. "X5" repeats the last G0 to G3. Only commands for
which the order is known may share a line. Pure, without state.
"""
from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

from .member import LETTERS
from .parser import BadWords, Line, tokens

MOTION = ("G0", "G1", "G2", "G3")
CANCEL = "G80"              # cancels the last move command
MODAL = ""                  # in place of a name: repeat the last move command
SPEED = "F"                 # in place of a name: a speed without a move
# One of each may be in a line; they are carried out in this order.
_GROUPS = (
    ("G93", "G94", "G95"), ("T",), ("M6",), ("M3", "M4", "M5"), ("M7", "M8", "M9"), ("G17", "G18", "G19"),
    ("G20", "G21"), ("G40", "G41", "G42"), ("G43", "G49"), ("G54", "G55", "G56", "G57", "G58", "G59"), ("G90", "G91"),
    ("G90.1", "G91.1"), ("M82", "M83"), (CANCEL,), (MODAL, SPEED, *MOTION, "G92"), ("M0", "M1", "M2", "M30"),
)
_RANK = {name: rank for rank, names in enumerate(_GROUPS) for name in names}
_OF_AXES = (*MOTION, "G92")
_TEXTS = ("M0", "M1", "M30")                # alone in a line, what stands behind them is a text
_WAYS = frozenset(LETTERS + "IJKR")         # words that belong to a move
_WORDS = dict.fromkeys((MODAL, *MOTION), LETTERS + "FIJKPR") | {
    SPEED: "F", "T": "T", "M6": "T", "G92": LETTERS, "M3": "S", "M4": "S", "M0": "PS", "M1": "PS",
    "G41": "D", "G42": "D", "G43": "H"}
_CODE = re.compile(r"\+?(\d{1,5})(?:\.(\d*))?", re.A)


def is_block(line: Line) -> bool:
    """Has the line several commands, or a move without one? False if it cannot be taken apart."""
    try:
        names, words = _apart(line)
    except BadWords:
        return False
    if line.name:
        return line.name in _RANK and line.name != "M30" and (names != [line.name] or _moves_too(line.name, words))
    # a text is not taken for a move because its letters are those of axes
    return all(words.values()) and bool(_RANK.keys() & names or (words and words.keys() <= _WAYS | {"F"}))


def parts(line: Line) -> list[Line]:
    """The commands of a line, in the order in which they are carried out. :class:`BadWords`."""
    names, words = _apart(line)
    if line.name and names == [line.name] and not _moves_too(line.name, words):
        return [line]
    if "M6" in names:
        names = [name for name in names if name != "T"]
    for name in names:
        if name not in _RANK:
            raise BadWords(f"{name} needs a line of its own")
    if not set(names) & set(_OF_AXES):
        names += [MODAL] if words.keys() & _WAYS else [SPEED] if "F" in words else []
    names.sort(key=_RANK.__getitem__)
    for one, other in pairwise(names):
        if _RANK[one] == _RANK[other]:
            raise BadWords(f"{one} and {other} cannot be in one line")
    if CANCEL in names and MODAL in names:
        raise BadWords(f"{CANCEL} and a move without a command cannot be in one line")
    takes = {name: _WORDS.get(name, "") for name in names}
    if {"M0", "M1"} & takes.keys():
        takes = {name: letters if name in _TEXTS else letters.replace("P", "") for name, letters in takes.items()}
    for letter, number in words.items():
        if not any(letter in letters for letters in takes.values()):
            raise BadWords(f"no command in this line takes {letter}")
        if not number:
            raise BadWords(f"{letter} needs a number")
    return [_part(line, name, [f"{letter}{number}" for letter, number in words.items() if letter in letters])
            for name, letters in takes.items()]


def _part(line: Line, name: str, words: list[str]) -> Line:
    # M30 with a name, in a line of its own, deletes a file
    name, argument = "M2" if name == "M30" else name, " ".join(words)
    return replace(line, name=name, argument=argument, text=f"{name} {argument}".strip())


def _moves_too(name: str, words: dict[str, str]) -> bool:
    """A command that takes no axes and no speed stands before words of a move, as in "G91 X5"."""
    return (name in _RANK and name not in (*_OF_AXES, *_TEXTS) and
            any(words.get(letter) for letter in (*_WAYS, "F")))


def _apart(line: Line) -> tuple[list[str], dict[str, str]]:
    """Names of commands, and other words. :class:`BadWords`."""
    names: list[str] = []
    words: dict[str, str] = {}
    for letter, number in tokens(line.code):
        if letter in "GM":
            code = _CODE.fullmatch(number)
            if not code:
                raise BadWords(f'"{letter}{number}" is not a command')
            names.append(f"{letter}{int(code[1])}" + (f".{code[2]}" if code[2] else ""))
        elif letter in words:
            raise BadWords(f"{letter} occurs twice")
        else:
            names += [letter] * (letter == line.name)       # T
            words[letter] = number
    return names, words
