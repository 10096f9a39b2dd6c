# SPDX-License-Identifier: GPL-2.0-or-later
"""Servo motors and axes that G-code can move, as the daemon has them at one moment."""
from __future__ import annotations

import math
import re
from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass

import pokeys

from ..wire import NotDone
from .lane import Job, Modes
from .parser import BadWords

LETTERS = "XYZABCUVWE"      # names in pokeysd.conf, in either case
LINEAR = "XYZUVW"           # the feed rate is that of these, if one of them moves
EXTRUDER = "E"
TRIPPED = 100, 101          # engine-state: by a limit switch, by emergency
POSITION, BUFFERED = 1, 3   # joint.NN.mode-in-effect
ENABLED = 2                 # servo.NN.state
INCH = 25.4
NUDGE_S = 0.1               # of a jog, until the next one
RANGE = -2**31, 2**31 - 1   # soft limits of an axis that has none
_WORDS = re.compile(r"[A-Za-z][^A-Za-z]*")
_MODE = re.compile(r"[Gg]\s*0*(90|91|20|21)\s*")


@dataclass(frozen=True)
class Member:
    """A servo motor or an axis, as the daemon has it now."""

    letter: str
    motor: bool
    index: int
    scale: float            # counts or pulses for each unit
    place: float            # commanded position in units, or the measured one if it is off
    counts: int             # of an axis: where it is
    mode: int
    enabled: bool
    still: bool             # it is where it is commanded to be
    trouble: str            # what prevents it from moving; "": nothing
    on_limit: bool = False
    speed: float = math.inf     # its highest, units/s
    acceleration: float = math.inf      # units/s^2
    least: float = -math.inf    # soft limits, units
    most: float = math.inf
    homed: bool = False


def members(state: pokeys.State) -> dict[str, Member]:
    """By their letters, in the order of :data:`LETTERS`; a motor goes before an axis of the same name."""
    found: dict[str, Member] = {}
    for member in (*_motors(state), *_axes(state)):
        if member.letter in LETTERS and len(member.letter) == 1:
            found.setdefault(member.letter, member)
    return {letter: found[letter] for letter in LETTERS if letter in found}


def axes_in(words: Iterable[str], there: Container[str]) -> list[str]:
    """The axes that a line names. W stands for something else, such as a levelling, where there is no such axis."""
    return [letter for letter in words if letter in LETTERS and (letter != "W" or letter in there)]


def numbers(job: Job) -> dict[str, float]:
    """The words of a line; those of axes need numbers."""
    words = job.line.words()
    missing = [letter for letter in (*LETTERS, "F") if letter in words and words[letter] is None]
    if missing:
        raise BadWords(f"{missing[0]} needs a number")
    return {letter: number for letter, number in words.items() if number is not None}


def modes_of(arguments: str) -> tuple[Modes, str]:
    """Of a $J= line: the modes of this line only, and its other words. :class:`BadWords`."""
    if not arguments[:1].isalpha():
        raise BadWords(f'"{arguments[:16]}" is not a letter with a number')
    modes, rest = Modes(), []
    for word in _WORDS.findall(arguments):
        if mode := _MODE.fullmatch(word):
            if mode[1] in ("90", "91"):
                modes.relative = modes.relative_extruder = mode[1] == "91"
            else:
                modes.scale = INCH if mode[1] == "20" else 1.0
        elif word[0].upper() in "GM":
            raise BadWords(f"{word.strip()} is not for a jog; G20, G21, G90 and G91 are")
        else:
            rest.append(word)
    return modes, " ".join(rest)


def nudge_of(member: Member, begin: float, speed: float, override: float) -> tuple[dict[str, float], Modes]:
    """A short move of a jog at so many units/s, no further than to a soft limit; and its modes. :class:`NotDone`: the
    axis is there."""
    # what two of them need to begin and to end is no more than a moment either
    speed = math.copysign(min(abs(speed), member.speed, member.acceleration * NUDGE_S), speed)
    there = begin + speed * NUDGE_S * min(1.0, override)
    # who is outside may come back
    end = min(there, max(member.most, begin)) if speed > 0 else max(there, min(member.least, begin))
    if end != there and abs(end - begin) * abs(member.scale) < 1:
        raise NotDone(f"{member.letter} is at its soft limit")
    modes = Modes()
    modes.relative = modes.relative_extruder = True
    modes.feed = abs(speed) / max(1.0, override)
    return {member.letter: end - begin}, modes


def _limit(state: pokeys.State, name: str, none: float) -> float:
    """Of a motor, in units. It has them as soon as it is homed."""
    value = state[name]
    return float(value) if state[name.rpartition(".")[0] + ".homed"] and isinstance(value, int | float) else none


def _soft_limits(state: pokeys.State, at: str, scale: float) -> tuple[float, float]:
    """Of an axis, in units."""
    ends = [end if int(end) != none else math.copysign(math.inf, none) for end, none in
            ((float(state[at + "soft-min"] or 0), RANGE[0]), (float(state[at + "soft-max"] or 0), RANGE[1]))]
    if not any(map(math.isfinite, ends)) or ends[0] >= ends[1]:
        return -math.inf, math.inf
    return min(end / scale for end in ends), max(end / scale for end in ends)


def path_speed(lengths: Mapping[str, float], modes: Modes) -> float:
    """Of the path over all axes, so that linear axes have the feed rate; 0 = as fast as they can."""
    if modes.feed is None:
        return 0.0
    # angles have no inches
    feed = modes.feed * (modes.feed_scale if any(letter in LINEAR + EXTRUDER for letter in lengths) else 1.0)
    whole = math.hypot(*lengths.values())
    linear = math.hypot(*(length for letter, length in lengths.items() if letter in LINEAR))
    return feed * whole / linear if linear else feed


def _motors(state: pokeys.State) -> Iterator[Member]:
    for index in range(len(state.servo)):
        at = f"servo.{index:02}."
        if not state[at + "state"]:
            continue
        enabled = state[at + "state"] == ENABLED
        code = at + ("fault-code" if state[at + "fault-code"] else "condition")
        trouble = state.word(code) if state[code] else ""
        if state[at + "fault-code"]:
            trouble = f"off by a fault: {trouble}"
        yield Member(str(state[at + "name"]).upper(), True, index, float(state[at + "counts-per-unit"] or 1.0),
                     float(state[at + ("commanded" if enabled else "pos-fb")] or 0.0), 0, 0, enabled,
                     not state[at + "home-state"], trouble, speed=float(state[at + "max-rate"] or math.inf),
                     acceleration=float(state[at + "max-rate-change"] or math.inf),
                     least=_limit(state, at + "min-position", -math.inf),
                     most=_limit(state, at + "max-position", math.inf), homed=bool(state[at + "homed"]))


def _axes(state: pokeys.State) -> Iterator[Member]:
    for index in range(min(int(state["engine.axes-enabled"]), len(state.joint))):
        at = f"joint.{index:02}."
        scale, counts = float(state[at + "pulses-per-unit"] or 0.0), int(state[at + "counts"])
        mode = int(state[at + "mode-in-effect"])
        if not scale:
            continue
        limits = [word for word, name in (("negative", "limit-neg"), ("positive", "limit-pos")) if state[at + name]]
        troubles = [f"on its {limit} limit switch" for limit in limits]
        if state["engine-state"] in TRIPPED:
            troubles.insert(0, f"the pulse engine is {state.word('engine-state')}")
        trouble = ", ".join(troubles)
        if not trouble and mode not in (POSITION, BUFFERED):
            trouble = "it is not set up for positions (axis.N.mode)"
        enabled = bool(state[at + "enabled"])
        commanded = counts if state[at + "parked"] or not enabled else int(state[at + "counts-cmd"])
        still = bool(state[at + "at-counts-cmd"]) and not state[at + "parked"]
        yield Member(str(state[at + "name"]).upper(), False, index, scale, commanded / scale, counts, mode, enabled,
                     still, trouble, bool(limits), float(state[at + "max-rate"] or math.inf) / abs(scale),
                     float(state[at + "max-rate-change"] or math.inf) / abs(scale), *_soft_limits(state, at, scale),
                     homed=bool(state[at + "homed"]))
