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
from ..wire import NotDone
from . import heating, report
from .arcs import arc
from .blocks import is_block, parts
from .lane import Job
from .member import INCH, LETTERS, axes_in
from .operation import RESUME, TOOL, Operation
from .parser import BadWords, Line

__all__ = ["AUTOREPORT", "COMMANDS", "END_JOB", "RENUMBER", "RESUME", "STATE", "STORE", "STORED", "Command",
           "switches_off"]
# These may share a line with a command that switches something off: they switch nothing on.
_QUIET = ("G17", "G20", "G21", "G40", "G49", "G54", "G80", "G90", "G91", "G91.1", "G94", "M2", "M9", "M82", "M83")
NO_SETTINGS = "echo:G-code commands no device"
Work = Callable[[Operation, Job], Awaitable[str]]
Judge = Callable[[Operation, Line], object]
Show = Callable[[Hub, Operation | None], str]


def _nothing(_hub: Hub, _operation: Operation | None) -> str:
    return ""


def _of(show: Callable[[Hub], str]) -> Show:
    return lambda hub, _operation: show(hub)


def _positions(hub: Hub, operation: Operation | None) -> str:
    if not operation:
        return report.positions(hub, "", {})
    return report.positions(hub, operation.holder.device, operation.motion.shifts)


@dataclass(frozen=True)
class Command:
    """A command: what it says at once, or what it does, or a method that stops the machine."""

    help: str
    run: Show = _nothing        # lines before the one with ok
    answer: Show = _nothing     # ... and what stands behind it
    stop: str = ""          # a method of LinuxCNC
    work: Work | None = None        # lines before the ok, which comes when it is done
    at_once: bool = False           # it does not wait for lines that came before it
    act: Callable[[Operation], None] | None = None      # it does this at once
    commands: bool = True           # it is not done after a stop or a fault
    in_files: bool = True           # a file may have it
    text: bool = False              # what stands behind it are no words
    moves: bool = False             # nobody may do it beside a job of a file
    judge: Judge | None = None      # raises what is known before a job begins: the line can never be carried out


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


def _does(work: Callable[[Operation, Job], Awaitable[object]]) -> Work:
    """A command whose lines before the ok are the text that its work returns, if it returns one."""
    async def whole(operation: Operation, job: Job) -> str:
        text = await work(operation, job)
        return text if isinstance(text, str) else ""
    return whole


def _mode(**modes: bool | float) -> Work:
    async def work(_operation: Operation, job: Job) -> str:
        for name, value in modes.items():
            setattr(job.modes, name, value)
        return ""
    return work


def switches_off(line: Line) -> bool:
    """It switches something off, and does nothing else but set modes."""
    if not is_block(line):
        return _is_off(line)
    try:
        found = parts(line)
    except BadWords:
        return False
    return any(map(_is_off, found)) and all(one.name in _QUIET or _is_off(one) for one in found)


def _is_off(line: Line) -> bool:
    if line.name in ("M5", "M18", "M84", "M107"):
        return True
    try:
        words = line.words()
    except BadWords:
        return False
    return (line.name in ("M104", "M109", "M140", "M141", "M190", "M191") and words.get("S", words.get("R")) == 0 and
            not {"G", "M"} & words.keys())


async def _begin_at(operation: Operation, job: Job) -> None:
    words = job.line.words()
    await operation.card.begin_at(words.get("S"), words.get("L"))


def _refused(_operation: Operation, _line: Line) -> None:
    raise NotDone("there is none of that here; what follows would be carried out in another way")


async def _refuse(operation: Operation, job: Job) -> None:
    job.modes.motion = ""       # words of axes that follow belong to it
    _refused(operation, job.line)


def _tool_of(operation: Operation, line: Line) -> int:
    tool = line.words().get("T") or 0.0
    # the tools of other machines are for people
    if tool and any(heater.letter.startswith(heating.HOT_END) for heater in operation.heating.all()):
        operation.heating.find(heating.HOT_END, tool)
    return int(tool)


async def _tool(operation: Operation, job: Job) -> None:
    job.modes.tool = _tool_of(operation, job.line)


def _axes_of(operation: Operation, line: Line) -> None:
    operation.motion.logical({letter for letter in LETTERS if letter in line.words()})


def _searches_of(operation: Operation, line: Line) -> None:
    operation.motion.logical(axes_in(line.words(), operation.motion.letters()))


def _heat(kind: str, what: str) -> Command:
    """Set a heater's target."""
    return Command(what, work=_does(lambda operation, job: operation.heating.set(job, kind, "S")),
                   judge=lambda operation, line: operation.heating.judge(line, kind, ("S",), 0))


def _reach(kind: str, like: str) -> Command:
    """... and wait for it."""
    return Command(f"as {like}, and wait until it is warm; with R instead of S also until it has cooled down",
                   work=_does(lambda operation, job: operation.heating.reach(job, kind)),
                   judge=lambda operation, line: operation.heating.judge(line, kind, ("S", "R"), 0))


def _fan(what: str, *, on: bool) -> Command:
    return Command(what, work=_does(lambda operation, job: operation.outputs.fan(job, on=on)),
                   judge=lambda operation, line: operation.outputs.fan_of(line))


def _turn(way: str) -> Command:
    return Command(f"S and revolutions/min: turn the spindle {way}, when all moves have ended", moves=True,
                   work=_does(lambda operation, job: _when_still(operation, lambda: operation.outputs.turn(job))),
                   judge=lambda operation, line: operation.outputs.speed_of(line, 0.0))


def _wait(what: str) -> Command:
    return Command(what, work=_does(lambda operation, job: operation.wait(job)), commands=False, text=True)


async def _end_program(operation: Operation, job: Job) -> None:
    """M2, as RS274/NGC has it: the spindle stands, and positions are absolute."""
    await _when_still(operation, operation.outputs.stand)
    job.modes.relative = job.modes.relative_extruder = job.modes.doubt = False
    job.modes.motion = ""


async def _remove(operation: Operation, job: Job) -> str:
    """M30: of a host, it deletes a file; without a name, it is a program's end."""
    if job.line.arguments:
        return await operation.card.remove(job.line.argument)
    await _end_program(operation, job)
    return ""


async def _when_still(operation: Operation, work: Callable[[], Awaitable[None]]) -> None:
    await operation.motion.finish()
    await work()


async def _show(operation: Operation, job: Job) -> None:
    operation.show(job.line.argument)


async def _change(operation: Operation, job: Job) -> None:
    await _when_still(operation, operation.outputs.stand)
    await operation.wait(job)


async def _tell(operation: Operation, job: Job) -> None:
    operation.tell(job.line.argument)


def _settings(hub: Hub, operation: Operation | None) -> str:
    return report.settings(hub, operation.holder.device, operation.motion.percent) if operation else NO_SETTINGS


def _name(job: Job) -> str:
    if not job.line.argument:
        raise BadWords("needs the name of a file")
    return job.line.argument


async def _store(_operation: Operation, _job: Job) -> str:
    raise NotDone("nothing is being written")


def _files(_hub: Hub, operation: Operation | None) -> str:
    """Hosts look for these words."""
    return "echo:SD card ok" if operation and operation.files else "echo:No SD card"


def _progress(_hub: Hub, operation: Operation | None) -> str:
    try:
        return operation.card.progress() if operation else "Not SD printing"
    except NotDone as error:
        return f"echo:{error}"


def _pause(operation: Operation) -> None:
    operation.card.pause()


def _no_job(operation: Operation) -> None:
    if not operation.running:
        raise NotDone("no job is under way")


RENUMBER, AUTOREPORT = "M110", "M155"
STORE, STORED = "M28", "M29"
END_JOB = "M524"
STATE = "?"
COMMANDS = {
    STATE: Command("show the PoKeys devices", _of(_state), at_once=True),
    "G0": Command("axes and positions: move there, as fast as the axes can unless F was given",
                  work=_does(lambda operation, job: operation.motion.move(job, rapid=True)),
                  moves=True, judge=_axes_of),
    "G1": Command("axes and positions, F and units/min: move there in a straight line at this speed",
                  work=_does(lambda operation, job: operation.motion.move(job, rapid=False)),
                  moves=True, judge=_axes_of),
    "G2": Command("X and Y, I and J or R, and F: move there on an arc, clockwise; other axes at the same time",
                  work=_does(lambda operation, job: arc(operation.motion, job, clockwise=True)),
                  moves=True, judge=_axes_of),
    "G3": Command("as G2, counterclockwise",
                  work=_does(lambda operation, job: arc(operation.motion, job, clockwise=False)),
                  moves=True, judge=_axes_of),
    "$J": Command("=, axes and F: as G1, with G90, G91, G20 and G21 for this line only",
                  work=_does(lambda operation, job: operation.motion.jog(job)), text=True, moves=True),
    "T": Command("and a number: this client's M104 and M109 without T are for this hot end", work=_does(_tool),
                 judge=_tool_of),
    "M0": _wait("wait until M108, or for P milliseconds or S seconds; of a file: until M24"),
    "M1": _wait("as M0"),
    "M2": Command("the program ends: stop the spindle when all moves have ended; positions are absolute",
                  work=_does(_end_program)),
    "M3": _turn("clockwise"),
    "M4": _turn("counterclockwise"),
    "M5": Command("stop the spindle, when all moves have ended",
                  work=_does(lambda operation, _job: _when_still(operation, operation.outputs.stand))),
    "G4": Command("P and milliseconds, S and seconds: wait this long after all moves have ended",
                  work=_does(lambda operation, job: operation.motion.dwell(job))),
    # they have work, so that other commands in their line are not ignored
    **{name: Command(f"{what}: it is so, ok", work=_mode(), commands=False) for name, what in (
        ("G17", "arcs are in the XY plane"), ("G40", "no compensation of a tool's radius"),
        ("G49", "no offset for a tool's length"), ("G54", "the first coordinate system"), ("G80", "no canned cycle"),
        ("G91.1", "centres of arcs are relative"), ("G94", "speeds are in units/min"))},
    # what follows them would be carried out in another way than they say, or from another place
    **{name: Command(f"{what}: refused", work=_does(_refuse), judge=_refused) for name, what in (
        ("G18", "arcs are in the XZ plane"), ("G19", "arcs are in the YZ plane"), ("G41", "a tool's radius"),
        ("G42", "a tool's radius"), ("G43", "a tool's length"), ("G55", "another coordinate system"),
        ("G56", "another coordinate system"), ("G57", "another coordinate system"),
        ("G58", "another coordinate system"),
        ("G59", "another coordinate system"), ("G90.1", "centres of arcs are absolute"),
        ("G93", "times in place of speeds"), ("G95", "speeds for each revolution"),
        ("G10", "places of coordinate systems and tools"), ("G33", "a thread"), ("G38.2", "a probe"),
        ("G38.3", "a probe"), ("G38.4", "a probe"), ("G38.5", "a probe"), ("G52", "another coordinate system"),
        ("G53", "positions of the machine"), ("G73", "a canned cycle"), ("G76", "a thread"),
        *((f"G{number}", "a canned cycle") for number in range(81, 90)),
        ("M98", "a subprogram"), ("M600", "change the filament"))},
    TOOL: Command("stop the spindle when all moves have ended, and wait as M0: for another tool", text=True,
                  work=_does(_change)),
    "G20": Command("units are inches", work=_mode(scale=INCH)),
    "G21": Command("units are millimetres", work=_mode(scale=1.0)),
    "G28": Command("axes: find their home switches, one after the other; without axes: all but E; O: not if homed",
                   work=_does(lambda operation, job: operation.motion.home(job)),
                   moves=True, judge=_searches_of),
    "G90": Command("positions are absolute", work=_mode(relative=False, relative_extruder=False, doubt=False)),
    "G91": Command("positions are relative", work=_mode(relative=True, relative_extruder=True, doubt=False)),
    "G92": Command("axes and numbers: these are their positions from now on",
                   work=_does(lambda operation, job: operation.motion.set_place(job)),
                   moves=True, judge=_axes_of),
    "M17": Command("enable all axes, or those that are named",
                   work=_does(lambda operation, job: operation.motion.enable(job)), moves=True),
    "M18": Command("wait until all axes stand still, then disable them, or those that are named",
                   work=_does(lambda operation, job: operation.motion.disable(job.line.words())), moves=True),
    "M20": Command("list the files",
                   work=_does(lambda operation, _job: operation.card.listing()), commands=False, in_files=False),
    "M21": Command("show whether there is a folder of files", _files),
    "M22": Command("nothing has to be done for files: ok"),
    "M23": Command("a name: select a file",
                   work=_does(lambda operation, job: operation.card.select(_name(job))),
                   commands=False, in_files=False, text=True),
    "M24": Command("begin the job of the selected file, or go on with it",
                   work=_does(lambda operation, job: operation.card.start(job)), in_files=False),
    "M25": Command("the job waits until M24", at_once=True, act=_pause),
    "M26": Command("S and a byte, or L and a line: the job begins there", work=_does(_begin_at), commands=False,
                   in_files=False),
    "M27": Command("show how far the job has come", _progress, at_once=True),
    STORE: Command("a name: write this client's lines into a file, until M29", work=_store, in_files=False, text=True),
    STORED: Command("the file is complete", work=_store, in_files=False),
    "M30": Command("a name: delete a file; without a name: as M2", work=_does(_remove), commands=False, in_files=False,
                   text=True),
    "M32": Command("a name: select a file, and begin its job",
                   work=_does(lambda operation, job: operation.card.select_and_start(job, _name(job).strip("!#"))),
                   in_files=False, text=True),
    "M42": Command("P and a terminal, or R and an output of the board, S: it is off (0) or on (more)",
                   work=_does(lambda operation, job: operation.outputs.switch(job)),
                   judge=lambda operation, line: operation.outputs.switch_of(line)),
    "M82": Command("positions of E are absolute", work=_mode(relative_extruder=False)),
    "M83": Command("positions of E are relative", work=_mode(relative_extruder=True)),
    "M84": Command("as M18", work=_does(lambda operation, job: operation.motion.disable(job.line.words())), moves=True),
    "M104": _heat(heating.HOT_END, "S and degrees C: set the target of a hot end, T0 or T and its number"),
    "M105": Command("show temperatures, targets and powers of heaters", _of(report.trouble), _of(report.temperatures),
                    at_once=True),
    "M106": _fan("S and 0 to 255: a fan, P and its number", on=True),
    "M107": _fan("a fan is off, P and its number", on=False),
    "M108": Command("end all waits for temperatures, and M0", at_once=True, commands=False,
                    act=lambda operation: operation.waits.end()),
    "M109": _reach(heating.HOT_END, "M104"),
    RENUMBER: Command("N and a number: set the number of the last line"),
    "M112": Command("emergency stop of LinuxCNC, or of the device that G-code commands", stop="emergency_stop"),
    "M114": Command("show where the axes are, and where they are commanded to be", _positions, at_once=True),
    "M117": Command("a text: show it on the page", work=_does(_show), commands=False, text=True),
    "M118": Command("a text: show it to all clients", work=_does(_tell), commands=False, text=True),
    "M115": Command("show version, abilities and commands", _of(_firmware)),
    "M119": Command("show limit switches and home switches", _of(report.switches), at_once=True),
    "M140": _heat(heating.BED, "S and degrees C: set the target of the bed"),
    "M141": _heat(heating.CHAMBER, "S and degrees C: set the target of the chamber"),
    AUTOREPORT: Command("S and seconds: report temperatures periodically; S0 ends the reports", at_once=True),
    "M190": _reach(heating.BED, "M140"),
    "M191": _reach(heating.CHAMBER, "M141"),
    "M220": Command("S and percent, 0 to 200: set the feed override; without S: show it",
                    work=_does(lambda operation, job: operation.motion.override(job))),
    "M226": _wait("as M0"),
    "M301": Command("P, I, D and numbers: set the gains of a hot end, E and its number; without P, I, D: show them",
                    work=_does(lambda operation, job: operation.tuning.gains(job, heating.HOT_END))),
    "M303": Command("E and a hot end, or E-1 for the bed, S and degrees C: search for its gains; U1: use them",
                    work=_does(lambda operation, job: operation.tuning.search(job))),
    "M304": Command("as M301, for the bed",
                    work=_does(lambda operation, job: operation.tuning.gains(job, heating.BED))),
    "M503": Command("show the settings of axes and heaters", _settings),
    "M400": Command("wait until all moves have ended", work=_does(lambda operation, _job: operation.motion.finish())),
    "M410": Command("stop LinuxCNC's program and axes, or the axes of the device that G-code commands", stop="stop"),
    END_JOB: Command("end the job, and stop the axes", stop="stop", at_once=True, act=_no_job),
    RESUME: Command("after M112 or a fault: reset faults and permit commands again",
                    work=_does(lambda operation, _job: operation.resume()), commands=False,
                    in_files=False),
}
