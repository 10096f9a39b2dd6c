# SPDX-License-Identifier: GPL-2.0-or-later
"""The G-code commands that there are, and what they do. Replies have the form of Marlin's.

Programs treat a line that begins with ``Error:`` as the end of their job, and one that begins with ``ok`` or
``Resend:`` as an answer to their last line. So what is said has ``echo:`` before it, and only a stop that
failed is an ``Error:``. Words that a command does not take are not looked at, as Marlin does it.
"""
from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pokeys

from .. import __version__
from ..hub import Hub
from ..source import Reading
from . import report


def _nothing(_hub: Hub) -> str:
    return ""


@dataclass(frozen=True)
class Command:
    """A command: what it says at once, or a method of :class:`~..operate.Operators` that stops the machine."""

    help: str
    run: Callable[[Hub], str] = _nothing        # lines before the one with ok
    answer: Callable[[Hub], str] = _nothing     # ... and what stands behind it
    stop: str = ""


def _axes(state: pokeys.State) -> str:
    """Where the axes are, and what is set of each."""
    names = [f"joint.{axis:02}." for axis in range(state.info.Axes)]
    signs = [(axis, [word for word in ("enabled", "homed", "limit-neg", "limit-pos", "error") if state[name + word]])
             for axis, name in enumerate(names)]
    return "; ".join((f"axes at {', '.join(str(state[name + 'counts']) for name in names)} pulses",
                      *(f"axis {axis} {' '.join(words)}" for axis, words in signs if words)))


def _device(reading: Reading) -> Iterator[str]:
    state = reading.state
    if not state or not reading.connected:
        yield f"{reading.name}: {reading.reason}"
        return
    words = ["connected", f"inputs {state['age.digital-us'] / 1000:.1f} ms old",
             "motion permitted" if state["machine-on-permitted"] else "motion not permitted"]
    words += [word for name, word in (("emergency", "emergency stop"), ("safe-state", "safe state")) if state[name]]
    yield f"{reading.name}: {', '.join(words)}"
    if state.info.Axes:
        yield f"{reading.name}: {_axes(state)}"


def _state(hub: Hub) -> str:
    readings = [reading for name in sorted(hub.source.names()) if (reading := hub.source.read(name))]
    lines = [line for reading in readings for line in _device(reading)]
    if hub.source.trouble or not lines:
        lines.append(hub.source.trouble or "no device")
    return "\n".join(f"echo:{line}" for line in lines)


def _firmware(hub: Hub) -> str:
    return "\n".join((
        f"FIRMWARE_NAME:pokeys-gateway {__version__} PROTOCOL_VERSION:1.0 MACHINE_TYPE:PoKeys "
        f"EXTRUDER_COUNT:{report.hot_ends(hub)}",
        "Cap:EMERGENCY_PARSER:1", "Cap:AUTOREPORT_TEMP:1",
        *(f"echo:{name} - {one.help}" for name, one in COMMANDS.items())))


RENUMBER = "M110"
AUTOREPORT = "M155"
COMMANDS = {
    "?": Command("show the PoKeys devices", _state),
    "M105": Command("show temperatures, targets and powers of heaters", report.trouble, report.temperatures),
    "M108": Command("wait no more; nothing waits: ok"),
    RENUMBER: Command("N and a number: set the number of the last line"),
    "M112": Command("emergency stop of LinuxCNC", stop="emergency_stop"),
    "M114": Command("show where the axes are, and where they are commanded to be", report.positions),
    "M115": Command("show version, abilities and commands", _firmware),
    "M119": Command("show limit switches and home switches", report.switches),
    AUTOREPORT: Command("S and seconds: report temperatures periodically; S0 ends the reports"),
    "M410": Command("stop LinuxCNC's program and its axes", stop="stop"),
}
