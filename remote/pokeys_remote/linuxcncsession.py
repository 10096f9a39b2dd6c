# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC's task, as far as pokeys-remote commands it: the two processes that talk to it.

LinuxCNC's module waits for task to take a command, for as long as five seconds if task hangs. So the proxy has a
process that gives commands, and one that stops the machine and reports its state, which never waits behind the
first. Each reads packets of JSON from its standard input, a socket, and ends with it.

A jog is given as short increments while somebody holds it, never more than 0.3 s of way ahead of where the axis is.
If all processes die, the axis goes that way at most and stands: nobody has to stop it.
"""
from __future__ import annotations

import contextlib
import json
import math
import os
import select
import signal
import socket
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import linuxcnc

PACKET_MOST = 64 * 1024
AGE_MOST = 2.0              # s that a command may be on its way here
ANSWER_TIME = 0.5           # s in which LinuxCNC finds most faults of a command
STATE_PERIOD = 0.1          # s
JOG_PERIOD = 0.05           # s between increments
JOG_AHEAD = 0.3             # s of way that an axis is ahead of who holds it
JOG_HOLD = 0.5              # s after which a jog ends unless it is asked for again
AXES = "xyzabcuvw"
MODES = {"manual": linuxcnc.MODE_MANUAL, "mdi": linuxcnc.MODE_MDI, "auto": linuxcnc.MODE_AUTO}
TASK = {linuxcnc.STATE_ESTOP: "estop", linuxcnc.STATE_ESTOP_RESET: "off", linuxcnc.STATE_OFF: "off",
        linuxcnc.STATE_ON: "on"}
INTERPRETER = {linuxcnc.INTERP_IDLE: "idle", linuxcnc.INTERP_READING: "reading", linuxcnc.INTERP_PAUSED: "paused",
               linuxcnc.INTERP_WAITING: "waiting"}
MOTION = {linuxcnc.TRAJ_MODE_FREE: "joints", linuxcnc.TRAJ_MODE_COORD: "programme", linuxcnc.TRAJ_MODE_TELEOP: "axes"}


class Wrong(Exception):
    """The machine is not in a state for the command."""


@dataclass
class _Jog:
    """An axis or joint that somebody holds."""

    owner: int
    axis: str                   # as its owner calls it
    press: int                  # of its key
    speed: float                # units/s
    until: float                # s, monotonic
    begin: float                # where it was
    given: float = 0.0          # way that LinuxCNC was given, units


class Commands:
    """Gives commands, one after the other."""

    def __init__(self) -> None:
        self._command, self._stat = linuxcnc.command(), linuxcnc.stat()
        self._jogs: dict[tuple[bool, int], _Jog] = {}
        self._ended: dict[tuple[int, tuple[bool, int]], int] = {}      # the newest press that ended, by owner and place
        self._most = _most_overrides()
        self._do: Mapping[str, Callable[..., None]] = {
            "mode": self._mode, "mdi": self._mdi, "run": self._run, "pause": self._pause, "resume": self._resume,
            "home": self._home, "override": self._override, "jog": self._jog}
        # what takes something back is never too old
        self._take_back: Mapping[str, Callable[..., None]] = {
            "up": self._up, "release": self._release, "stop": self._abort}

    def serve(self, link: socket.socket) -> None:
        """Until the proxy is gone."""
        try:
            while True:
                waits = select.select([link], [], [], JOG_PERIOD if self._jogs else None)[0]
                asked = []
                while waits:
                    packet = link.recv(PACKET_MOST)
                    if not packet:
                        return
                    asked.append(json.loads(packet))
                    waits = select.select([link], [], [], 0)[0]
                while asked:
                    one = asked.pop(0)
                    link.send(self._obey(one, any(later["do"] == "stop" for later in asked)))
                # what came meanwhile may take back a jog
                if not select.select([link], [], [], 0)[0]:
                    self._go_on()
        finally:
            with contextlib.suppress(linuxcnc.error, SystemError):
                self._release(None)

    def _obey(self, asked: dict[str, Any], stopped: bool) -> bytes:
        fault = None
        try:
            self._stat.poll()
            if asked["do"] in self._take_back:
                self._take_back[asked["do"]](**asked["params"])
            elif stopped:
                raise Wrong("it was stopped")
            elif time.monotonic() - asked["sent"] > AGE_MOST:
                raise Wrong("LinuxCNC did not take commands for so long that this one is too old")
            elif asked["do"] == "jog":
                self._jog(until=asked["sent"] + JOG_HOLD, **asked["params"])
            else:
                self._do[asked["do"]](**asked["params"])
        except Wrong as wrong:
            fault = str(wrong)
        except (linuxcnc.error, SystemError) as error:
            fault = _why(error)
        except Exception:  # pylint: disable=broad-exception-caught
            # the others' commands and jogs go on
            traceback.print_exc()
            fault = "this should not happen; please report what pokeys-remote printed"
        return json.dumps({"number": asked["number"], "error": fault}).encode()

    def _complete(self) -> None:
        _taken(self._command, self._stat)
        if self._command.wait_complete(ANSWER_TIME) == linuxcnc.RCS_ERROR:
            raise Wrong("LinuxCNC refuses it; its message says why")

    def _on(self) -> None:
        if self._stat.task_state != linuxcnc.STATE_ON:
            raise Wrong("the machine is not on")

    def _idle(self) -> None:
        if self._stat.interp_state != linuxcnc.INTERP_IDLE:
            raise Wrong("a programme or an MDI line runs")

    def _none_held(self) -> None:
        if self._jogs:
            raise Wrong("an axis is jogged")

    def _mode(self, mode: str) -> None:
        self._idle()
        self._none_held()
        self._command.mode(MODES[mode])
        self._complete()

    def _mdi(self, line: str) -> None:
        self._on()
        if self._stat.task_mode != linuxcnc.MODE_MDI:
            raise Wrong("the mode is not MDI")
        self._command.mdi(line)
        self._complete()

    def _run(self) -> None:
        self._on()
        self._idle()
        if self._stat.task_mode != linuxcnc.MODE_AUTO:
            raise Wrong("the mode is not auto")
        if not self._stat.file:
            raise Wrong("no programme is loaded")
        self._command.auto(linuxcnc.AUTO_RUN, 0)
        self._complete()

    def _pause(self) -> None:
        self._command.auto(linuxcnc.AUTO_PAUSE)
        self._complete()

    def _resume(self) -> None:
        self._on()
        self._command.auto(linuxcnc.AUTO_RESUME)
        self._complete()

    def _home(self, joint: int) -> None:
        self._on()
        self._manual()
        self._none_held()
        if not -1 <= joint < self._stat.joints:
            raise Wrong(f"there is no joint {joint}")
        if self._stat.motion_mode != linuxcnc.TRAJ_MODE_FREE:
            self._command.teleop_enable(0)
            self._complete()
        self._command.home(joint)
        self._complete()

    def _override(self, what: str, value: float) -> None:
        most = self._most[what]
        if not 0 <= value <= most:
            raise Wrong(f"{what} override is from 0 to {most:g}")
        if what == "feed":
            self._command.feedrate(value)
        elif what == "rapid":
            self._command.rapidrate(value)
        else:
            self._command.spindleoverride(value)
        self._complete()

    # jogging

    def _manual(self) -> None:
        if self._stat.task_mode != linuxcnc.MODE_MANUAL:
            raise Wrong("the mode is not manual")

    def _jog(self, owner: int, axis: str, speed: float, press: int, until: float) -> None:
        place = self._place(axis)
        held = self._jogs.get(place)
        if held and held.owner != owner:
            raise Wrong(f"somebody else jogs {axis}")
        if self._ended.get((owner, place)) == press:
            # a network that was slow brings requests for a key that is up since
            raise Wrong("this press has ended")
        if time.monotonic() >= until:
            raise Wrong("this came too late")
        self._on()
        self._manual()
        # LinuxCNC goes no faster, and would go the way of the higher speed after the end of its owner
        speed = math.copysign(min(abs(speed), self._limit(place)), speed)
        if not held or (held.press, held.speed) != (press, speed):
            self._stop(place)
            self._ended.pop((owner, place), None)
            held = self._jogs[place] = _Jog(owner, axis, press, speed, until, self._where(place))
        held.until = until

    def _place(self, axis: str) -> tuple[bool, int]:
        """Joint or axis, and its number."""
        joints = self._stat.motion_mode == linuxcnc.TRAJ_MODE_FREE
        if joints != axis.isdigit():
            raise Wrong("joints are jogged now, by number" if joints else "axes are jogged now, by letter")
        if joints:
            if int(axis) >= self._stat.joints:
                raise Wrong(f"there is no joint {axis}")
            return True, int(axis)
        number = AXES.find(axis)
        if len(axis) != 1 or number < 0 or not self._stat.axis_mask >> number & 1:
            raise Wrong(f"there is no axis {axis}")
        return False, number

    @staticmethod
    def _limit(place: tuple[bool, int]) -> float:
        """Of its speed, in units/s."""
        section = f"JOINT_{place[1]}" if place[0] else f"AXIS_{AXES[place[1]].upper()}"
        try:
            return float(_ini(section, "MAX_VELOCITY") or "")
        except ValueError:
            raise Wrong(f"it cannot be jogged, because LinuxCNC's INI file has no [{section}]MAX_VELOCITY") from None

    def _where(self, place: tuple[bool, int]) -> float:
        positions = self._stat.joint_actual_position if place[0] else self._stat.actual_position
        return float(positions[place[1]])

    def _go_on(self) -> None:
        """Move what is held on, and stop what is not."""
        for place, held in list(self._jogs.items()):
            try:
                self._stat.poll()
                if time.monotonic() >= held.until or not self._may_go_on(place):
                    self._stop(place)
                    continue
                gone = (self._where(place) - held.begin) * math.copysign(1.0, held.speed)
                way = abs(held.speed) * JOG_AHEAD - (held.given - gone)
                if way > 0:
                    held.given += way
                    self._command.jog(linuxcnc.JOG_INCREMENT, place[0], place[1], held.speed, way)
                    _taken(self._command, self._stat)
            except (Wrong, linuxcnc.error, SystemError):
                self._jogs.pop(place, None)         # it stands at the end of what it was given
                self._ended[held.owner, place] = held.press

    def _may_go_on(self, place: tuple[bool, int]) -> bool:
        return bool(self._stat.task_state == linuxcnc.STATE_ON and self._stat.task_mode == linuxcnc.MODE_MANUAL
                    and place[0] == (self._stat.motion_mode == linuxcnc.TRAJ_MODE_FREE))

    def _stop(self, place: tuple[bool, int]) -> None:
        if held := self._jogs.pop(place, None):
            self._ended[held.owner, place] = held.press
            self._command.jog(linuxcnc.JOG_STOP, *place)

    def _up(self, owner: int, axis: str) -> None:
        """The key is up."""
        for place in [place for place, held in self._jogs.items() if (held.owner, held.axis) == (owner, axis)]:
            self._stop(place)

    def _release(self, owner: int | None) -> None:
        """All that an owner holds, who is gone; None: all."""
        for place in [place for place, held in self._jogs.items() if owner in (None, held.owner)]:
            self._stop(place)
        for one in [one for one in self._ended if one[0] == owner]:
            del self._ended[one]

    def _abort(self) -> None:
        self._release(None)
        self._command.abort()


class Watch:
    """Reports the state, and stops the machine."""

    def __init__(self, errors: bool) -> None:
        self._command, self._stat = linuxcnc.command(), linuxcnc.stat()
        self._most = {f"max_{what}_override": most for what, most in _most_overrides().items()}
        self._errors = linuxcnc.error_channel() if errors else None
        self._reported: dict[str, Any] = {}
        self._said: bytes | None = None     # a message that the proxy has not got

    def serve(self, link: socket.socket) -> None:
        """Until the proxy is gone."""
        while True:
            if select.select([link], [], [], STATE_PERIOD)[0]:
                packet = link.recv(PACKET_MOST)
                if not packet:
                    return
                self._obey(link, json.loads(packet))
            self._report(link)

    def _obey(self, link: socket.socket, asked: dict[str, Any]) -> None:
        fault = None
        try:
            if asked["do"] == "emergency_stop":
                self._command.state(linuxcnc.STATE_ESTOP)
            elif asked["do"] == "stop":
                self._command.abort()
            _taken(self._command, self._stat)
        except Wrong as wrong:
            fault = str(wrong)
        except (linuxcnc.error, SystemError) as error:
            fault = _why(error)
        link.send(json.dumps({"stopped": asked["number"], "error": fault}).encode())

    def _report(self, link: socket.socket) -> None:
        self._stat.poll()
        state = {**state_of(self._stat), **self._most}
        changed = {key: value for key, value in state.items() if self._reported.get(key) != value}
        # a proxy that is stopped gets it later
        with contextlib.suppress(BlockingIOError):
            if changed:
                link.send(json.dumps({"state": changed}).encode(), socket.MSG_DONTWAIT)
                self._reported = state
            while message := self._said or self._message():
                self._said = message
                link.send(message, socket.MSG_DONTWAIT)
                self._said = None

    def _message(self) -> bytes | None:
        said = self._errors.poll() if self._errors else None
        if not said:
            return None
        kind = "error" if said[0] in (linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR) else "text"
        return json.dumps({"said": {"kind": kind, "text": said[1]}}).encode()


def _taken(command: Any, stat: Any) -> None:
    """LinuxCNC's module waits for task, and does not say if it waited in vain."""
    stat.poll()
    if stat.echo_serial_number < command.serial:
        raise Wrong("LinuxCNC has not taken it within 5 s; it may do so later")


def state_of(stat: Any) -> dict[str, Any]:
    """What clients see of LinuxCNC's status. Positions in machine units, speeds in units/s."""
    axes = [letter for number, letter in enumerate(AXES) if stat.axis_mask >> number & 1]
    modes = {number: name for name, number in MODES.items()}
    return {
        "task": TASK.get(stat.task_state, "unknown"), "mode": modes.get(stat.task_mode, "unknown"),
        "interpreter": INTERPRETER.get(stat.interp_state, "unknown"), "paused": bool(stat.paused),
        "file": stat.file, "line": stat.motion_line, "motion": MOTION.get(stat.motion_mode, "unknown"),
        "moving": not stat.inpos, "joints": stat.joints, "axes": axes,
        "position": {letter: _finite(stat.actual_position[AXES.index(letter)]) for letter in axes},
        "homed": [bool(one) for one in stat.homed[:stat.joints]],
        "feed_override": _finite(stat.feedrate), "rapid_override": _finite(stat.rapidrate),
        "spindle_override": _finite(stat.spindle[0]["override"]), "spindle_speed": _finite(stat.spindle[0]["speed"]),
    }


def _finite(number: float) -> float | None:
    # JSON has no other ones
    return round(number, 6) if math.isfinite(number) else None


def _why(error: Exception) -> str:
    # the module does not always say what is wrong, which Python calls a SystemError
    return f"LinuxCNC's task does not answer{f' ({error})' if isinstance(error, linuxcnc.error) else ''}"


def _ini(section: str, key: str) -> str | None:
    path = os.environ.get("INI_FILE_NAME")
    if not path:
        return None
    found: str | None = linuxcnc.ini(path).find(section, key)
    return found


def _most_overrides() -> dict[str, float]:
    """As LinuxCNC's screens limit them."""
    most = {"rapid": 1.0}
    for what in ("feed", "spindle"):
        try:
            most[what] = float(_ini("DISPLAY", f"MAX_{what.upper()}_OVERRIDE") or 1.0)
        except ValueError:
            most[what] = 1.0
    return most


def main() -> int:
    """Argument: ``commands``, ``watch`` or ``watch-errors``."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)        # of a terminal, for the proxy
    link = socket.socket(fileno=os.dup(0))
    try:
        if nml := _ini("EMC", "NML_FILE"):
            linuxcnc.nmlfile = nml
        served: Commands | Watch = (Commands() if sys.argv[1] == "commands" else
                                    Watch(errors=sys.argv[1] == "watch-errors"))
        served.serve(link)
    except (linuxcnc.error, SystemError) as error:
        with contextlib.suppress(OSError):
            link.send(json.dumps({"fatal": _why(error)}).encode())
        return 1
    except (BrokenPipeError, ConnectionResetError):
        pass                        # the proxy is gone
    return 0


if __name__ == "__main__":
    sys.exit(main())
