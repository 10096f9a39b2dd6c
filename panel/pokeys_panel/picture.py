# SPDX-License-Identifier: GPL-2.0-or-later
"""What the panel shows of a device, without a screen."""
from __future__ import annotations

import math
from dataclasses import dataclass, replace

import pokeys

DIGITAL_INPUT, DIGITAL_OUTPUT = 0x02, 0x04      # in a pin's function
HEATERS, SERVOS, AXES, PWM = 7, 6, 8, 6
GOOD, WARNING, BAD = "good", "warning", "bad"
_AXIS_BAD = (20, 30)                            # error, limit
_HEATER_FAULT, _SERVO_FAULT, _SETTINGS_REFUSED = 4, 3, 4


@dataclass(frozen=True)
class Lamp:
    """An input or output: the name on the board, and whether it is on."""

    name: str
    on: bool


@dataclass(frozen=True)
class Line:
    """An axis, motor or heater: its name, its value and its state in words."""

    name: str
    value: str
    words: str
    bad: bool = False


@dataclass(frozen=True)
class Picture:
    """A device at one moment."""

    device: str
    word: str       # such as "running"
    level: str      # GOOD, WARNING or BAD
    age: str = ""
    old: bool = False               # what follows was so when there was data last
    notes: tuple[str, ...] = ()     # what is wrong, or stops it, in words
    inputs: tuple[Lamp, ...] = ()
    outputs: tuple[Lamp, ...] = ()
    lines: tuple[Line, ...] = ()


def duration(age_us: float | None) -> str:
    """An age as a person reads it: "0.8 ms", "12 s"."""
    if age_us is None or not math.isfinite(age_us):
        return ""
    if age_us < 1e6:
        return f"{age_us / 1e3:.1f} ms"
    seconds = age_us / 1e6
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"


def _number(value: float | None, text: str) -> str:
    """A measured value, of which the device may have none."""
    return "not known" if value is None or not math.isfinite(value) else text.format(value)


def _lamps(state: pokeys.State, function: int, value: str) -> list[Lamp]:
    """The terminals that are set up for this."""
    return [Lamp(str(number + 1), bool(state[f"pin.{number:02}.{value}"]))
            for number in range(min(state.info.PinCount, 55))
            if state[f"pin.{number:02}.function-in-effect"] & function]


def _external(state: pokeys.State) -> list[Lamp]:
    """The board's own outputs and relays."""
    return [Lamp(label, bool(state[f"external.{number:02}.out-fb"]))
            for number, label in enumerate(pokeys.board_outputs(state.info.DeviceTypeID))]


def _pwm(state: pokeys.State) -> list[Line]:
    return [Line(f"PWM channel {number}", _number(state[f"pwm.{number:02}.duty"], "{:.0%}"), "")
            for number in range(PWM) if state[f"pwm.{number:02}.enabled"]]


def _axes(state: pokeys.State) -> list[Line]:
    found = []
    for number in range(min(state.info.Axes, AXES)):
        axis = f"joint.{number:02}."
        if not state[axis + "mode-in-effect"]:
            continue
        switches = [name for name, pin in (("limit switch -", "limit-neg"), ("limit switch +", "limit-pos"),
                                           ("soft limit", "soft-limit"), ("error of its driver", "error"))
                    if state[axis + pin]]
        words = ", ".join([state.word(axis + "state"), *(["homed"] if state[axis + "homed"] else []), *switches])
        name = state[axis + "name"].removeprefix("axis.")
        found.append(Line(f"axis {name}", f"{state[axis + 'counts']} pulses", words,
                          bool(switches) or state[axis + "state"] in _AXIS_BAD))
    return found


def _loop(state: pokeys.State, where: str, kind: str, value: str, fault: int) -> Line:
    """A motor or heater; `fault` is the state in which it has one."""
    faulty = state[where + "state"] == fault
    words = f"fault: {state.word(where + 'fault-code')}" if faulty else state.word(where + "state")
    return Line(f"{kind} {state[where + 'name']}", value, words, faulty)


def _servos(state: pokeys.State) -> list[Line]:
    return [_loop(state, motor, "motor", _number(state[motor + "pos-fb"], "{:.3f}"), _SERVO_FAULT)
            for motor in (f"servo.{number:02}." for number in range(SERVOS)) if state[motor + "state"]]


def _temperature(state: pokeys.State, heater: str) -> str:
    target = state[heater + "target-in-effect"]
    return _number(state[heater + "temperature"], "{:.1f} °C") + (f", target {target:.0f}" if target else "")


def _heaters(state: pokeys.State) -> list[Line]:
    return [_loop(state, heater, "heater", _temperature(state, heater), _HEATER_FAULT)
            for heater in (f"heater.{number:02}." for number in range(HEATERS)) if state[heater + "state"]]


def _notes(state: pokeys.State) -> list[str]:
    """What is wrong with a device that runs, or keeps it from working."""
    found = []
    if state["emergency"]:
        found.append("emergency stop")
    if state["outputs-held"]:
        found.append("outputs are held in the safe state until the machine is switched on again")
    elif state["needs-edge"]:
        found.append("the machine has to be switched off and on")
    if not state["commander-alive"]:
        found.append("no program commands the device")
    elif state["safe-state"] and not state["outputs-held"]:
        found.append("outputs and axes are in the safe state")
    if state["config.state"] == _SETTINGS_REFUSED:
        found.append("the device refused settings; pokeysctl config diff lists them")
    return found


def of(device: str, state: pokeys.State) -> Picture:
    """What a device looks like now."""
    lines = (*_axes(state), *_servos(state), *_heaters(state), *_pwm(state))
    seen = Picture(device, "", BAD, duration(state.age_us), False, (), tuple(_lamps(state, DIGITAL_INPUT, "in")),
                   (*_lamps(state, DIGITAL_OUTPUT, "out-fb"), *_external(state)), lines)
    if not state.connected:
        return replace(seen, word=state.word("link-state") if state.daemon_alive else "pokeysd is silent",
                       notes=(state.reason,), old=True)
    notes = _notes(state) + [f"{line.name}: {line.words}" for line in lines if line.bad]
    bad = state["emergency"] or any(line.bad for line in lines)
    return replace(seen, word="running, machine on" if state["machine-on-permitted"] else "running, machine off",
                   level=BAD if bad else WARNING if notes else GOOD, notes=tuple(notes))


def without(device: str, why: Exception) -> Picture:
    """A device that cannot be read, and why."""
    word = {pokeys.NoDaemon: "no daemon", pokeys.NoSuchDevice: "no such device"}.get(type(why), "cannot be read")
    return Picture(device, word, BAD, "", True, (str(why),))
