# SPDX-License-Identifier: GPL-2.0-or-later
"""The G-code commands that there are, and what they do. Replies have the form of Marlin's.

Programs treat a line that begins with ``Error:`` as the end of their job, and one that begins with ``ok`` or
``Resend:`` as an answer to their last line. So what is said has ``echo:`` before it, and only a stop that
failed is an ``Error:``. Words that a command does not take are not looked at, as Marlin does it.
"""
from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass

import pokeys

from .. import __version__
from ..hub import Hub
from ..source import Reading
from . import heating, report
from .lane import Job
from .operation import RESUME, Operation

__all__ = ["AUTOREPORT", "COMMANDS", "GIVE_UP", "RENUMBER", "RESUME", "STATE", "Command"]
Work = Callable[[Operation, Job], Awaitable[str]]


def _nothing(_hub: Hub) -> str:
    return ""


@dataclass(frozen=True)
class Command:
    """A command: what it says at once, or what it does, or a method that stops the machine."""

    help: str
    run: Callable[[Hub], str] = _nothing        # lines before the one with ok
    answer: Callable[[Hub], str] = _nothing     # ... and what stands behind it
    stop: str = ""          # a method of LinuxCNC
    work: Work | None = None        # lines before the ok, which comes when it is done
    at_once: bool = False           # it does not wait for lines that came before it


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


def _set(kind: str) -> Work:
    async def work(operation: Operation, job: Job) -> str:
        await operation.heating.set(job, kind, "S")
        return ""
    return work


def _reach(kind: str) -> Work:
    async def work(operation: Operation, job: Job) -> str:
        await operation.heating.reach(job, kind)
        return ""
    return work


async def _resume(operation: Operation, _job: Job) -> str:
    return await operation.resume()


RENUMBER = "M110"
AUTOREPORT = "M155"
GIVE_UP = "M108"
STATE = "?"
COMMANDS = {
    STATE: Command("show the PoKeys devices", _state, at_once=True),
    "M104": Command("S and degrees C: set the target of a hot end, T0 or T and its number", work=_set(heating.HOT_END)),
    "M105": Command("show temperatures, targets and powers of heaters", report.trouble, report.temperatures,
                    at_once=True),
    GIVE_UP: Command("wait for no temperature any more", at_once=True),
    "M109": Command("as M104, and wait while it is colder; R and degrees C: also while it is warmer",
                    work=_reach(heating.HOT_END)),
    RENUMBER: Command("N and a number: set the number of the last line"),
    "M112": Command("emergency stop of LinuxCNC, or of the device that G-code commands", stop="emergency_stop"),
    "M114": Command("show where the axes are, and where they are commanded to be", report.positions, at_once=True),
    "M115": Command("show version, abilities and commands", _firmware),
    "M119": Command("show limit switches and home switches", report.switches, at_once=True),
    "M140": Command("S and degrees C: set the target of the bed", work=_set(heating.BED)),
    "M141": Command("S and degrees C: set the target of the chamber", work=_set(heating.CHAMBER)),
    AUTOREPORT: Command("S and seconds: report temperatures periodically; S0 ends the reports", at_once=True),
    "M190": Command("as M140, and wait while it is colder; R and degrees C: also while it is warmer",
                    work=_reach(heating.BED)),
    "M191": Command("as M141, and wait while it is colder; R and degrees C: also while it is warmer",
                    work=_reach(heating.CHAMBER)),
    "M410": Command("stop LinuxCNC's program and its axes", stop="stop"),
    RESUME: Command("after M112 or a fault: reset heaters, and permit commands", work=_resume),
}
