# SPDX-License-Identifier: GPL-2.0-or-later
"""Arcs in the XY plane, G2 and G3, as chords that deviate from them by no more than a machine notices.

The daemon's path has straight moves only, and takes the corners between chords as a curve, without stopping.
"""
from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from dataclasses import dataclass

from ..wire import NotDone
from .lane import Job, Modes
from .member import EXTRUDER, LETTERS, LINEAR, numbers
from .motion import NO_FEED, Motion
from .parser import BadWords

DEVIATION = 0.005           # mm, of a chord from the arc
CHORDS_MOST = 10_000
SAME = 0.001                # mm; the end is where it begins
OFF_MOST, OFF_PART = 0.05, 0.005        # of the end from the arc: mm, and part of the radius


@dataclass(frozen=True)
class Arc:
    """In mm and radians."""

    centre: tuple[float, float]
    radii: tuple[float, float]      # where it begins and ends; a file has rounded one of them
    begin: float
    sweep: float                    # above 0: counterclockwise

    def at(self, part: float) -> tuple[float, float]:
        """A point of it, 0 to 1."""
        radius = self.radii[0] + (self.radii[1] - self.radii[0]) * part
        angle = self.begin + self.sweep * part
        return self.centre[0] + radius * math.cos(angle), self.centre[1] + radius * math.sin(angle)

    @property
    def chords(self) -> int:
        """How many are needed."""
        radius = max(*self.radii, DEVIATION)
        step = 2 * math.acos(1 - min(1.0, DEVIATION / radius))
        return min(CHORDS_MOST, max(1, math.ceil(abs(self.sweep) / step)))


def arc_of(begin: tuple[float, float], end: tuple[float, float], words: Mapping[str, float], *, clockwise: bool) -> Arc:
    """From I and J, the way to its centre, or from R, its radius, below 0 for the long way. :class:`BadWords`."""
    wrong = [letter for letter in ("K", "P") if letter in words]
    if wrong or ("R" in words and ("I" in words or "J" in words)):
        raise BadWords(f"an arc takes no {wrong[0]}" if wrong else "needs either I and J, or R")
    if "R" in words:
        centre = _centre(begin, end, words["R"], clockwise=clockwise)
    elif "I" in words or "J" in words:
        centre = begin[0] + words.get("I", 0.0), begin[1] + words.get("J", 0.0)
    else:
        raise BadWords("needs I and J, or R")
    radii = math.dist(begin, centre), math.dist(end, centre)
    if not radii[0] or abs(radii[1] - radii[0]) > OFF_MOST + OFF_PART * radii[0]:
        raise BadWords(f"the end is not on this arc: it is {radii[1]:.3f} mm from the centre, and the beginning "
                       f"{radii[0]:.3f} mm")
    angles = [math.atan2(point[1] - centre[1], point[0] - centre[0]) for point in (begin, end)]
    sweep = (angles[0] - angles[1] if clockwise else angles[1] - angles[0]) % math.tau
    if math.dist(begin, end) < min(SAME, radii[0] / 2):
        sweep = math.tau        # all around
    return Arc(centre, radii, angles[0], -sweep if clockwise else sweep)


def _centre(begin: tuple[float, float], end: tuple[float, float], radius: float, *,
            clockwise: bool) -> tuple[float, float]:
    way = math.dist(begin, end)
    square = radius**2 - (way / 2)**2
    if way < SAME:
        raise BadWords("an arc with R has to end elsewhere")
    if way / 2 - abs(radius) > OFF_MOST + OFF_PART * abs(radius):
        raise BadWords(f"R{radius:g} is too small: the end is {way:.3f} mm away")
    # to the left of the way if the arc is the short one and counterclockwise
    height = math.sqrt(max(0.0, square)) * (1 if (radius > 0) != clockwise else -1)
    return ((begin[0] + end[0]) / 2 - height * (end[1] - begin[1]) / way,
            (begin[1] + end[1]) / 2 + height * (end[0] - begin[0]) / way)


async def arc(motion: Motion, job: Job, *, clockwise: bool) -> None:
    """G2 and G3."""
    words = numbers(job)
    scaled = {letter: number * (job.modes.scale if letter in LINEAR + EXTRUDER + "IJR" else 1.0)
              for letter, number in words.items() if letter != "F"}
    begin = motion.logical({"X", "Y", *(letter for letter in LETTERS if letter in words)})
    ends = {letter: _end(letter, begin[letter], scaled, job.modes) for letter in begin}
    curve = arc_of((begin["X"], begin["Y"]), (ends["X"], ends["Y"]), scaled, clockwise=clockwise)
    if "F" in words:
        job.modes.set_feed(words["F"])
    if job.modes.feed is None:
        raise NotDone(NO_FEED)
    modes = copy.copy(job.modes)
    modes.relative = modes.relative_extruder = False
    modes.scale = 1.0
    shifts = dict(motion.shifts)
    for i in range(1, curve.chords + 1):
        if shifts != motion.shifts:
            raise NotDone("another client has set a position (G92, G28) during the arc")
        part = i / curve.chords
        places = {letter: begin[letter] + (ends[letter] - begin[letter]) * part for letter in begin}
        if i < curve.chords:
            places["X"], places["Y"] = curve.at(part)
        await motion.go(places, modes)


def _end(letter: str, begin: float, words: Mapping[str, float], modes: Modes) -> float:
    if letter not in words:
        return begin
    relative = modes.relative_extruder if letter == EXTRUDER else modes.relative
    return begin + words[letter] if relative else words[letter]
