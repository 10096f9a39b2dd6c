# SPDX-License-Identifier: GPL-2.0-or-later
"""The G-code commands that there are, and what they do. Replies have the form of Marlin's.

A command returns at once: the text of its reply, or something to wait for, whose reply comes later.
"""
from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass

import pokeys

from .. import __version__
from ..hub import Hub
from ..source import Reading
from ..wire import NotDone
from .parser import Line

Reply = str | Awaitable[str]    # lines; "" is only an ok


class NotPossible(Exception):
    """Why a command is not carried out."""


class NotStopped(NotPossible):
    """Why a stop has no effect, as far as is known."""


@dataclass(frozen=True)
class Command:
    """A command; `takes` are the letters of its words."""

    takes: str
    help: str
    run: Callable[[Hub, dict[str, float | None]], Reply]


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


def _state(hub: Hub, _words: dict[str, float | None]) -> str:
    readings = [reading for name in sorted(hub.source.names()) if (reading := hub.source.read(name))]
    return "\n".join(line for reading in readings for line in _device(reading)) or hub.source.trouble


def _nothing(_hub: Hub, _words: dict[str, float | None]) -> str:
    return ""


def _firmware(_hub: Hub, _words: dict[str, float | None]) -> str:
    return "\n".join((
        f"FIRMWARE_NAME:pokeys-gateway {__version__} PROTOCOL_VERSION:1.0 MACHINE_TYPE:PoKeys EXTRUDER_COUNT:0",
        "Cap:EMERGENCY_PARSER:1", "Cap:AUTOREPORT_TEMP:0",
        *(f"echo:{' '.join((name, *one.takes))} - {one.help}" for name, one in COMMANDS.items())))


def _stop(method: str) -> Callable[[Hub, dict[str, float | None]], Reply]:
    """LinuxCNC stops, the one that moves the machine; the reply comes when it has."""
    def run(hub: Hub, _words: dict[str, float | None]) -> Awaitable[str]:
        if not hub.config.operate:
            raise NotStopped("the gateway may not operate LinuxCNC ([linuxcnc] operate = no); "
                             "use the machine's own switch")
        return _confirmed(hub.operators.begin_stop(method))
    return run


async def _confirmed(stop: asyncio.Future[None]) -> str:
    try:
        await stop
    except NotDone as why:
        raise NotStopped(f"the stop is not confirmed: {why}; use the machine's own switch") from None
    return ""


COMMANDS = {
    "?": Command("", "show the PoKeys devices", _state),
    "M105": Command("T", "show temperatures, of which there are none yet: ok", _nothing),
    "M108": Command("", "wait no more; nothing waits: ok", _nothing),
    "M110": Command("N", "set the number of the last line", _nothing),
    "M112": Command("", "emergency stop of LinuxCNC", _stop("emergency_stop")),
    "M115": Command("", "show version, abilities and commands", _firmware),
    "M410": Command("", "stop LinuxCNC's program and its axes", _stop("stop")),
}


def run(hub: Hub, line: Line) -> Reply:
    """Carry it out. :class:`NotPossible`, :class:`BadWords`; KeyError if there is no such command."""
    command = COMMANDS[line.name]
    words = line.words()
    if unknown := [letter for letter in words if letter not in command.takes]:
        raise NotPossible(f"{line.name} takes {' and '.join(command.takes) or 'no words'}, and not {unknown[0]}")
    return command.run(hub, words)
