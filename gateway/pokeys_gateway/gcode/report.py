# SPDX-License-Identifier: GPL-2.0-or-later
"""Temperatures, positions and switches of the PoKeys devices, as Marlin reports them.

All of it is measured. What is not known is left out, and :func:`trouble` says why, because hosts show a number that
is none as a temperature.
"""
from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import pokeys

from ..hub import Hub
from ..source import Reading

POWER = 127                 # of M105, at full power
LETTERS = {"bed": "B", "chamber": "C"}      # by their names in pokeysd.conf; all other heaters are hot ends


@dataclass(frozen=True)
class _Heater:
    """One that has a place in pokeysd.conf."""

    title: str              # for a person
    letter: str             # B, C, or T and its number
    celsius: float          # NaN: not known
    target: float
    power: float            # 0 to 1
    trouble: str            # what is wrong with it; "": nothing


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


def _readings(hub: Hub) -> list[Reading]:
    return [reading for name in sorted(hub.source.names()) if (reading := hub.source.read(name))]


def _fresh(hub: Hub) -> Iterator[pokeys.State]:
    """Of devices that run; old values would be taken for those of now."""
    for reading in _readings(hub):
        if reading.state and reading.connected:
            yield reading.state


def _heaters(hub: Hub) -> list[_Heater]:
    found: list[_Heater] = []
    hot_ends = 0
    for state in _fresh(hub):
        for i in range(len(state.heater)):
            at = f"heater.{i:02}."
            name = str(state[at + "name"])
            if not state[at + "state"]:
                continue
            letter = LETTERS.get(name.lower(), "")
            if not letter or any(heater.letter == letter for heater in found):
                letter, hot_ends = f"T{hot_ends}", hot_ends + 1
            word = at + ("fault-code" if state[at + "fault-code"] else "condition")
            found.append(_Heater(name, letter, _number(state[at + "temperature"]),
                                 _number(state[at + "target-in-effect"]), _number(state[at + "power"]),
                                 state.word(word) if state[word] else ""))
    return found


def _of(letter: str, heaters: list[_Heater]) -> str:
    """T alone is the first hot end, and the only one that is named so if there are no others."""
    alone = sum(heater.letter[0] == "T" for heater in heaters) == 1
    return "T" if letter == "T0" and alone else letter


def hot_ends(hub: Hub) -> int:
    """How many heaters are neither bed nor chamber."""
    return sum(heater.letter[0] == "T" for heater in _heaters(hub))


def temperatures(hub: Hub) -> str:
    """Such as ``T:200.1 /200.0 B:60.0 /60.0 @:45 B@:12``; "" without heaters."""
    heaters = [heater for heater in _heaters(hub) if math.isfinite(heater.celsius)]
    named = [(_of(heater.letter, heaters), heater) for heater in heaters]
    if len(hot := [heater for heater in heaters if heater.letter[0] == "T"]) > 1:
        named.append(("T", hot[0]))
    named.sort(key=lambda one: "TBC".find(one[0]) % 4)      # T0, T1, ... are the last ones
    powers = (("" if letter == "T" else letter, round(heater.power * POWER)) for letter, heater in named)
    return " ".join([*(f"{letter}:{heater.celsius:.2f} /{heater.target:.2f}" for letter, heater in named),
                     *(f"{letter}@:{power}" for letter, power in powers)])


def _missing(hub: Hub) -> list[str]:
    """Devices that are left out, and why."""
    return [f"echo:{reading.name}: {reading.reason}" for reading in _readings(hub) if not reading.connected]


def trouble(hub: Hub) -> str:
    """Why a device or a heater is left out of the temperatures, or is off by a fault."""
    return "\n".join([*_missing(hub), *(f"echo:heater {heater.title}: {heater.trouble}" for heater in _heaters(hub)
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
    for i in range(int(state["engine.axes-enabled"])):
        at = f"joint.{i:02}."
        scale, counts = _number(state[at + "pulses-per-unit"]), _number(state[at + "counts"])
        yield _Axis(str(state[at + "name"]) or f"axis.{i}", counts, counts / scale if scale else math.nan,
                    _number(state[at + "counts-cmd"]) / scale if scale else math.nan,
                    tuple((word, bool(state[at + name])) for word, name in
                          (("min", "limit-neg"), ("max", "limit-pos"), ("home", "home-sw"))))


def _all_axes(state: pokeys.State) -> list[_Axis]:
    return [*_motors(state), *_axes(state)]


def _name(axis: _Axis) -> str:
    """As G-code has it: x is X."""
    return axis.name.upper() if len(axis.name) == 1 else axis.name


def _places(state: pokeys.State) -> Iterator[str]:
    axes = _all_axes(state)
    scaled = [axis for axis in axes if math.isfinite(axis.measured)]
    if axes:
        yield " ".join([*(f"{_name(axis)}:{axis.measured:.4f}" for axis in scaled), "Count",
                        *(f"{_name(axis)}:{axis.counts:.0f}" for axis in axes if math.isfinite(axis.counts))])
    if scaled:
        yield "echo:commanded " + " ".join(f"{_name(axis)}:{axis.commanded:.4f}" for axis in scaled)


def positions(hub: Hub) -> str:
    """Where the encoders and the pulse engine have the axes, and beside it where they are commanded to be."""
    return "\n".join([*_missing(hub), *(line for state in _fresh(hub) for line in _places(state))])


def switches(hub: Hub) -> str:
    """Of each axis: both ends, and its home switch."""
    lines = [f"{axis.name}_{word}: {'TRIGGERED' if pressed else 'open'}"
             for state in _fresh(hub) for axis in _all_axes(state) for word, pressed in axis.switches]
    return "\n".join([*_missing(hub), "Reporting endstops status", *lines])
