# SPDX-License-Identifier: GPL-2.0-or-later
"""What a device has set up: the values that mean something, and the terminals that they belong to.

What the device does not have, or has not set up, is a zero that means nothing. No door shows it.
"""
from __future__ import annotations

from dataclasses import dataclass

import pokeys

from .model import FIRST_ANALOG, Model, Row

# in a pin's function (docs/protocol.md)
DIGITAL_INPUT, DIGITAL_OUTPUT, ANALOG_INPUT, COUNTER = 0x02, 0x04, 0x08, 0x40
KINDS = {"pin.NN.in": "input", "pin.NN.out-fb": "output", "external.NN.out-fb": "external", "adc.NN.volts": "analog",
         "pwm.NN.duty": "pwm", "counter.NN.value": "counter"}


@dataclass(frozen=True)
class Terminal:
    """A terminal of the board with the value that it has."""

    name: str       # of the value
    terminal: str   # its number as printed on the board; "" if it has only a label
    label: str      # such as OC1, or ""
    kind: str       # of KINDS


def is_set_up(row: Row, state: pokeys.State) -> bool:
    """Does the device have what this name stands for, and is it set up as that?"""
    name, number = row.name, f"{row.number:02}"
    if row.kind in ("pin", "analog") or name.startswith("counter."):
        terminal = row.number + FIRST_ANALOG - 1 if row.kind == "analog" else row.number
        function = state[f"pin.{terminal:02}.function-in-effect"] if terminal < state.info.PinCount else 0
        wanted = {"in": DIGITAL_INPUT, "out-fb": DIGITAL_OUTPUT, "volts": ANALOG_INPUT,
                  "value": COUNTER}[name.rpartition(".")[2]]
        return bool(function & wanted)
    if row.kind == "pwm":
        return bool(state[f"pwm.{number}.enabled"])
    if name.startswith("encoder."):
        return bool(state[f"encoder.{number}.enabled"])
    if name.startswith(("heater.", "servo.")):
        return bool(state[f"{name.partition('.')[0]}.{number}.state"])
    if name.startswith("joint.") and ".postep." in name:
        return bool(state[f"joint.{number}.postep.updates"])
    if name.startswith("joint."):
        return row.number < state.info.Axes
    if row.kind == "output":
        return state.info.pulse_engine_version > 0
    return True


def terminals(model: Model, state: pokeys.State) -> list[Terminal]:
    """The terminals that are set up, in the order of their numbers; those that have none come last."""
    hardware = state.info.DeviceTypeID
    found = []
    for pattern, kind in KINDS.items():
        for row in model.family(pattern):
            if not is_set_up(row, state):
                continue
            terminal, label = model.terminal(row, hardware), model.label(row, hardware)
            # a PWM channel may be on no terminal
            if terminal or label:
                found.append(Terminal(row.name, terminal, label, kind))
    return sorted(found, key=lambda one: (not one.terminal, int(one.terminal or 0)))
