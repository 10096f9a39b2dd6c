# SPDX-License-Identifier: GPL-2.0-or-later
"""Temperatures, positions and switches of the PoKeys devices, as Marlin reports them.

All of it is measured. What is not known is left out, and :func:`trouble` says why, because hosts show a number that
is none as a temperature.
"""
from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import pokeys

from ..hub import Hub
from ..source import Reading
from .member import members

POWER = 127                 # of M105, at full power
BY_PLACE = 1, 3             # joint.NN.mode-in-effect: positions, motion buffer
_FLAGS = re.compile(r"((?:[AEP]\d?(?:\s+|\Z))+)", re.I)    # in front of the text of M118
LETTERS = {"bed": "B", "chamber": "C"}      # by their names in pokeysd.conf; all other heaters are hot ends


@dataclass(frozen=True)
class Heater:
    """One that has a place in pokeysd.conf."""

    device: str
    index: int              # among the device's heaters
    title: str              # for a person
    letter: str             # B, C, or T and its number
    celsius: float          # NaN: not known
    target: float           # which the daemon controls to
    most: float             # its highest one
    reached: bool           # it has a target, and is there
    power: float            # 0 to 1
    fault: bool             # it is off until it is reset
    trouble: str            # what is wrong with it; "": nothing
    refusal: str            # why the daemon has not taken its last target; "": it has


@dataclass(frozen=True)
class _Axis:
    """A servo motor, or an axis of the pulse engine."""

    name: str
    counts: float           # NaN: not known
    measured: float         # units; NaN: it has no scale
    commanded: float
    switches: tuple[tuple[str, bool], ...]


def _number(value: object) -> float:
    """NaN: it is not known."""
    return float(value) if isinstance(value, int | float) else math.nan


def _known(number: float) -> float:
    return number if math.isfinite(number) else 0.0


def _readings(hub: Hub) -> list[Reading]:
    return [reading for name in sorted(hub.source.names()) if (reading := hub.source.read(name))]


def _fresh(hub: Hub) -> Iterator[tuple[str, pokeys.State]]:
    """Of devices that run; old values would be taken for those of now."""
    for reading in _readings(hub):
        if reading.state is not None and reading.connected:
            yield reading.name, reading.state


def _heater(reading: Reading, state: pokeys.State, index: int, letter: str) -> Heater:
    connected, at = reading.connected, f"heater.{index:02}."
    celsius = _number(state[at + "temperature"]) if connected else math.nan
    word = at + ("fault-code" if state[at + "fault-code"] else "condition")
    trouble = state.word(word) if state[word] else "" if math.isfinite(celsius) else "no temperature yet"
    return Heater(reading.name, index, str(state[at + "name"]), letter, celsius,
                  _known(_number(state[at + "target-in-effect"])), _known(_number(state[at + "max-target"])),
                  bool(state[at + "at-temperature"]), _known(_number(state[at + "power"])),
                  connected and bool(state[at + "fault"]), trouble if connected else "",
                  state.word(at + "refused") if state[at + "refused"] else "")


def heaters(hub: Hub) -> list[Heater]:
    """Also of a device that is away, so that the others keep their letters."""
    found: list[Heater] = []
    hot_ends = 0
    for reading in _readings(hub):
        state = reading.state
        for i in range(len(state.heater)) if state is not None else ():
            at = f"heater.{i:02}."
            if state is None or not state[at + "state"]:
                continue
            letter = LETTERS.get(str(state[at + "name"]).lower(), "")
            if not letter or any(heater.letter == letter for heater in found):
                letter, hot_ends = f"T{hot_ends}", hot_ends + 1
            found.append(_heater(reading, state, i, letter))
    return found


def hot_ends(hub: Hub) -> int:
    """How many heaters are neither bed nor chamber."""
    return sum(heater.letter[0] == "T" for heater in heaters(hub))


def temperatures(hub: Hub) -> str:
    """Such as ``T:200.1 /200.0 B:60.0 /60.0 @:45 B@:12``; "" without heaters."""
    found = heaters(hub)
    named = [(heater.letter, heater) for heater in found if math.isfinite(heater.celsius)]
    # a hot end that is the only one is shown as T, the first of several as T and T0
    named += [("T", heater) for letter, heater in named if letter == "T0"]
    if sum(heater.letter[0] == "T" for heater in found) == 1:
        named = [(letter, heater) for letter, heater in named if letter != "T0"]
    named.sort(key=lambda one: "TBC".find(one[0]) % 4)      # T0, T1, ... are the last ones
    powers = (("" if letter == "T" else letter, round(heater.power * POWER)) for letter, heater in named)
    return " ".join([*(f"{letter}:{heater.celsius:.2f} /{heater.target:.2f}" for letter, heater in named),
                     *(f"{letter}@:{power}" for letter, power in powers)])


def _missing(hub: Hub) -> list[str]:
    """Devices that are left out, and why."""
    readings = _readings(hub)
    if not readings or hub.source.trouble:
        return [f"echo:{hub.source.trouble or 'no device'}"]
    return [f"echo:{reading.name}: {reading.reason}" for reading in readings if not reading.connected]


def trouble(hub: Hub) -> str:
    """Why a device or a heater is left out of the temperatures, or is off by a fault."""
    return "\n".join([*_missing(hub), *(f"echo:heater {heater.title}: {heater.trouble}" for heater in heaters(hub)
                                        if heater.trouble)])


def _motors(state: pokeys.State) -> Iterator[_Axis]:
    for i in range(len(state.servo)):
        at = f"servo.{i:02}."
        if state[at + "state"]:
            place = _number(state[at + "pos-fb"])
            yield _Axis(str(state[at + "name"]), place * _number(state[at + "counts-per-unit"]), place,
                        _number(state[at + "commanded"]),
                        tuple((word, bool(state[at + name])) for word, name in
                              (("min", "limit-minus"), ("max", "limit-plus"), ("home", "home-switch"))))


def _axes(state: pokeys.State) -> Iterator[_Axis]:
    for i in range(min(int(state["engine.axes-enabled"]), len(state.joint))):
        at = f"joint.{i:02}."
        scale, counts = _number(state[at + "pulses-per-unit"]), _number(state[at + "counts"])
        by_place = state[at + "mode-in-effect"] in BY_PLACE and state[at + "enabled"]
        yield _Axis(str(state[at + "name"]) or f"axis.{i}", counts, counts / scale if scale else math.nan,
                    (_number(state[at + "counts-cmd"]) if by_place else counts) / scale if scale else math.nan,
                    tuple((word, bool(state[at + name])) for word, name in
                          (("min", "limit-neg"), ("max", "limit-pos"), ("home", "home-sw"))))


def _all_axes(state: pokeys.State) -> list[_Axis]:
    return [*_motors(state), *_axes(state)]


def _name(axis: _Axis) -> str:
    """As G-code has it: x is X."""
    return axis.name.upper() if len(axis.name) == 1 else axis.name


def _rounded(number: float, digits: int) -> str:
    """Without a -0."""
    return f"{round(number, digits) + 0.0:.{digits}f}"


def _places(state: pokeys.State, shifts: Mapping[str, float]) -> Iterator[str]:
    axes = [replace(axis, measured=axis.measured - shifts.get(axis.name.upper(), 0.0),
                    commanded=axis.commanded - shifts.get(axis.name.upper(), 0.0)) for axis in _all_axes(state)]
    scaled = [axis for axis in axes if math.isfinite(axis.measured)]
    if axes:
        yield " ".join([*(f"{_name(axis)}:{_rounded(axis.measured, 4)}" for axis in scaled), "Count",
                        *(f"{_name(axis)}:{_rounded(axis.counts, 0)}" for axis in axes if math.isfinite(axis.counts))])
    if scaled:
        yield "echo:commanded " + " ".join(f"{_name(axis)}:{_rounded(axis.commanded, 4)}" for axis in scaled)


def positions(hub: Hub, device: str, shifts: Mapping[str, float]) -> str:
    """Where the encoders and the pulse engine have the axes, and beside it where they are commanded to be.

    ``shifts`` are those of the device's axes, from their positions to the logical ones.
    """
    return "\n".join([*_missing(hub), *(line for name, state in _fresh(hub)
                                        for line in _places(state, shifts if name == device else {}))])


def message(text: str) -> str:
    """What M118 shows to all clients. A line that looks like an answer would be taken for one."""
    words = _FLAGS.match(text)
    flags, rest = (words[1].upper(), text[words.end():]) if words else ("", text)
    return f"//{rest}" if "A1" in flags else f"echo:{rest}"


def settings(hub: Hub, device: str, percent: float) -> str:
    """As M503 shows them, in the form of commands: scales, speeds and accelerations of axes, gains of heaters."""
    reading = hub.source.read(device)
    state = reading.state if reading else None
    if not reading or state is None or not reading.connected:
        return f"echo:{reading.reason if reading else hub.no_such_device(device)}"
    lines = []
    axes = members(state)
    for name, what, values in (
            ("M92", "counts or pulses per unit", {letter: abs(one.scale) for letter, one in axes.items()}),
            ("M203", "highest speeds, units/s", {letter: one.speed for letter, one in axes.items()}),
            ("M201", "accelerations, units/s^2", {letter: one.acceleration for letter, one in axes.items()})):
        words = [f"{letter}{value:.2f}" for letter, value in values.items() if math.isfinite(value)]
        if words:
            lines += [f"; {what}:", " ".join((name, *words))]
    for heater in heaters(hub):
        if heater.device == device and heater.letter != LETTERS["chamber"]:
            name = f"M301 E{heater.letter[1:]}" if heater.letter[0] == "T" else "M304"
            at = f"heater.{heater.index:02}.pid-"
            lines += [f"; gains of heater {heater.title}:",
                      " ".join((name, *(f"{gain}{_known(_number(state[at + gain.lower()])):.2f}" for gain in "PID")))]
    return "\n".join(f"echo:{line}" for line in (*lines, "; feed override, percent:", f"M220 S{percent:g}"))


def switches(hub: Hub) -> str:
    """Of each axis: both ends, and its home switch."""
    lines = [f"{axis.name}_{word}: {'TRIGGERED' if pressed else 'open'}"
             for _, state in _fresh(hub) for axis in _all_axes(state) for word, pressed in axis.switches]
    return "\n".join([*_missing(hub), "Reporting endstops status", *lines])
