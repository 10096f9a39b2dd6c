# SPDX-License-Identifier: MIT
"""Command a device from Python.

A device follows its one commander as long as that one's heartbeat comes, many times a second.
A thread of the library makes it, and not the interpreter, which may be busy for longer. But the
thread goes on only as long as the program has renewed its lease: if the program hangs, is
stopped or killed, the device goes to its safe state. This is not for motion.
"""
from __future__ import annotations

import contextlib
import ctypes
import errno
import functools
import os
import struct
import threading
import time
import weakref
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from types import TracebackType
from typing import Any, NoReturn

from . import _library, _names, one_shot
from ._values import Draft, Writable
from .errors import Lapsed, Refused
from .one_shot import OneShot, Outcome
from .snapshot import RUNNING, Shot, State, data_age_ns

PERIOD_MS = 2
ATTACH_S, REFUSED_S, RISE_S, TURN_S = 3.0, 1.0, 1.0, 0.01
USUAL_HZ = 1000
SHORTEST_S, LONGEST_S = 0.01, 60.0
READ_OLD_NS = 100_000_000   # POKEYS_READ_OLD_NS: the daemon switches nothing on that moves by positions older than that
UNREAD = 5                  # POKEYS_SERVO_UNREAD
OUTPUT = "pin.%02u.out"
_AXIS, _SERVO = struct.Struct("<ifBB6x"), struct.Struct("<dfB3x")
AXES, SERVOS = 8, 6


@dataclass(frozen=True)
class Axis:
    """What an axis of the pulse engine is commanded to do, for a program that moves along paths of the daemon.

    ``mode`` is that of its settings: 1 = positions, 3 = motion buffer. ``position`` is in pulses.
    """

    position: int
    mode: int
    enable: bool


@dataclass(frozen=True)
class Servo:
    """... and a servo motor; ``position`` is in its units."""

    position: float
    enable: bool


@functools.cache
def _places() -> dict[str, tuple[Writable[Any], int]]:
    return {name: (value, i) for value in _names.COMMAND_VALUES if isinstance(value, Writable)
            for i, name in enumerate(value.names())}


def _place(name: str) -> tuple[Writable[Any], int]:
    found = _places().get(name)
    if not found:
        raise KeyError(f"no value named {name!r} can be commanded; pokeysctl names marks those that can be")
    return found


class Lock:
    """A lock that the child of a fork can replace, for nobody there would release it."""

    def __init__(self) -> None:
        self.held = threading.RLock()


class _Held(Draft):
    """The command image that the library's thread repeats."""

    def __init__(self, library: _library.Library, client: ctypes.c_void_p, lock: Lock, name: str, period: int) -> None:
        super().__init__(_names.COMMAND_SIZE, period)
        self.name = name
        self._library = library
        self._client = client
        self._lapsed = False
        self._looked_ns = self._given_ns = 0    # when our last command was begun, and given
        self._on: tuple[bool, ...] = ()         # the machine, axes and servo motors
        self._session = _new_session()
        self._head = 0          # one-shots of this session
        self._lock = lock
        self._state = ctypes.create_string_buffer(_names.STATE_SIZE)

    def begin(self) -> None:
        """Command nothing, for the first time or again, and wait until the daemon has seen it.

        So a machine-is-on that follows is a rising edge. :class:`Refused`.
        """
        self._clear()
        self._give()
        self._lapsed, self._on = False, self._switched_on()
        self._wait()

    def _clear(self) -> None:
        """Command nothing. A one-shot that the daemon has not taken yet is refused then, as it is not there."""
        self.image[:] = bytes(len(self.image))
        struct.pack_into("<I", self.image, _names.COMMAND_SESSION, self._session)
        struct.pack_into("<I", self.image, _names.COMMAND_ONE_SHOT_HEAD, self._head)

    def renew(self) -> None:
        """Renew the lease. :class:`Lapsed`, :class:`ValueError` when it is closed."""
        with self._lock.held:
            self._check_open()
            if self._lapsed or self._library.cold.pokeys_client_renew(self._client):
                self._lapse()

    def change(self, values: Sequence[tuple[Writable[Any], int, Any]], axes: Mapping[int, Axis] | None = None,
               servos: Mapping[int, Servo] | None = None) -> None:
        with self._lock.held:
            self._check_open()
            before = bytes(self.image)
            try:
                for value, index, wanted in values:
                    value.enter(self, index, wanted)
                    self._check_output(value, index)
                for index, axis in (axes or {}).items():
                    _fit(index, AXES)
                    _AXIS.pack_into(self.image, _names.COMMAND_AXES + index * _AXIS.size, axis.position, 0.0, axis.mode,
                                    axis.enable)
                for index, servo in (servos or {}).items():
                    _fit(index, SERVOS)
                    _SERVO.pack_into(self.image, _names.COMMAND_SERVOS + index * _SERVO.size, servo.position, 0.0,
                                     servo.enable)
            except struct.error as error:
                self.image[:] = before
                raise ValueError(str(error)) from None
            except BaseException:
                self.image[:] = before
                raise
            self._commit()

    def _check_open(self) -> None:
        if not self._client:
            raise ValueError(f"{self.name} is not commanded any more; the with statement has ended")

    def _check_output(self, value: Writable[Any], index: int) -> None:
        """The daemon would ignore a terminal that is set up as something else."""
        if value.name != OUTPUT or self._library.fast.pokeys_client_read(self._client, self._state):
            return
        state = State(self._shot())
        if state.link_state == RUNNING and not state.pin[index].is_output:
            raise ValueError(f"{value.named(index)}: terminal {index + 1} is not a digital output of this device; add "
                             "it to digital-outputs in pokeysd.conf and restart pokeysd")

    def _switched_on(self) -> tuple[bool, ...]:
        return (bool(_names.CommandValues.machine_is_on.take(self, 0)),
                *(_AXIS.unpack_from(self.image, _names.COMMAND_AXES + i * _AXIS.size)[-1] for i in range(AXES)),
                *(_SERVO.unpack_from(self.image, _names.COMMAND_SERVOS + i * _SERVO.size)[-1] for i in range(SERVOS)))

    def _commit(self) -> None:
        wanted = bytes(self.image)
        if self._lapsed:
            self.begin()
            self.image[:] = wanted
        else:
            self.renew()
        before, self._on = self._on, self._switched_on()
        rises = {n for n, (now, was) in enumerate(zip(self._on, before, strict=True)) if now and not was}
        if rises:
            self._rise(rises)
        else:
            self._offer()

    def _rise(self, rises: Set[int]) -> None:
        """Command the image, which switches these on. What the daemon refuses because the computer was so busy that its
        commander had looked at the positions too long ago is commanded again, for a second at most.
        """
        wanted = bytes(self.image)
        end = time.monotonic() + RISE_S
        try:
            if 0 in rises:
                self._wait()        # off has to be seen before on
            while True:
                self._offer()
                self._wait()
                if not self._refused(rises) or not self._wait_young(end):
                    return
                # only what it still refuses for that: meanwhile, a stop may have come
                for n in self._refused(rises):
                    self._switch_off(n)
                if self.image != wanted:
                    self._offer()
                    self._wait()
                    if time.monotonic() >= end:
                        raise Refused(f"{self.name}: the computer is too busy to switch this on; command it again")
                    self.image[:] = wanted
        finally:
            # what is off now rises when it is commanded again
            self._on = self._switched_on()

    def _refused(self, rises: Set[int]) -> set[int]:
        """Those that the daemon says it has refused for old positions, and axes that it may have refused for that.

        An axis follows an enable that is commanded again whether it was refused or not. The machine and a servo motor
        need an edge, which could undo a stop: the daemon names the reason only until a stop or a loss.
        """
        state = State(self._shot())
        taken_ns = struct.unpack_from("<Q", self._state.raw, _names.STATE_COMMAND_TIME)[0]
        late = taken_ns - self._looked_ns > READ_OLD_NS
        refused = {0} if state.edge_unread else set()
        refused |= {1 + i for i in range(AXES) if late and not state.joint[i].enabled}
        refused |= {1 + AXES + i for i in range(SERVOS) if state.servo[i].refused == UNREAD}
        return refused & rises

    def _switch_off(self, n: int) -> None:
        """One of :meth:`_switched_on`, in the image; an axis remains as it is."""
        if n == 0:
            _place("machine-is-on")[0].enter(self, 0, False)
        elif n > AXES:
            at = _names.COMMAND_SERVOS + (n - 1 - AXES) * _SERVO.size
            _SERVO.pack_into(self.image, at, *_SERVO.unpack_from(self.image, at)[:-1], False)

    def _wait_young(self, end: float) -> bool:
        """Until the positions are young enough; whether they are before ``end``."""
        while time.monotonic() < end:
            if not self._library.fast.pokeys_client_read(self._client, self._state) and \
                    data_age_ns(self._shot()) <= READ_OLD_NS:
                return True
            self._library.cold.pokeys_client_renew(self._client)
            time.sleep(TURN_S / 4)
        return False

    def _offer(self) -> None:
        """Command the image. :class:`Lapsed`."""
        if self._give():
            # it ran out just now, and the library has taken the command
            self._clear()
            self._give()
            self._lapse()

    def _lapse(self) -> NoReturn:
        """Nothing of what was commanded is commanded again by itself."""
        self._clear()
        self._lapsed = True
        raise Lapsed(f"{self.name}: the lease had run out, or pokeysd was away; the device was in its safe state, and "
                     "nothing is commanded until a value is set again")

    def order(self, operation: OneShot, index: int, mask: int, flags: int, values: Sequence[int],
              parameters: Sequence[float], fractions: Sequence[int]) -> int:
        """Queue a one-shot: its number."""
        with self._lock.held:
            self.renew()
            session, taken = self._taken()
            if session != self._session:
                raise Refused(f"{self.name}: the daemon does not take the command")
            if self._head - taken >= one_shot.SLOTS:
                raise Refused(f"{self.name}: {one_shot.SLOTS} one-shots wait for the daemon, which is the most")
            shot = one_shot.pack(self._head, operation, index, mask, flags, values, parameters, fractions)
            at = _names.COMMAND_ONE_SHOTS + self._head % one_shot.SLOTS * one_shot.SIZE
            self.image[at:at + len(shot)] = shot
            struct.pack_into("<I", self.image, _names.COMMAND_ONE_SHOT_HEAD, self._head + 1)
            self._head += 1
            self._commit()
            return self._head - 1

    def _shot(self) -> Shot:
        """What was read last."""
        return Shot(self._state.raw, time.monotonic_ns())

    def _taken(self) -> tuple[int, int]:
        """The session whose one-shots the daemon takes, and how many it has taken."""
        if self._library.fast.pokeys_client_read(self._client, self._state):
            return 0, 0
        return struct.unpack_from("<I", self._state.raw, _names.STATE_SESSION)[0], \
            struct.unpack_from("<I", self._state.raw, _names.STATE_ONE_SHOT_ACK)[0]

    def outcome(self, number: int) -> Outcome | None:
        with self._lock.held:
            self._check_open()
            session, taken = self._taken()
            if session != self._session or taken <= number:
                return None
            size = one_shot.RESULTS * one_shot.RESULT_SIZE
            at = _names.STATE_ONE_SHOTS
            return one_shot.outcome(self._state.raw[at:at + size], number)

    def wait(self) -> None:
        with self._lock.held:
            self.renew()
            self._wait()

    def _give(self) -> bool:
        """Command the image. True if there was a lapse."""
        # the daemon permits nothing to somebody who has not looked
        self._looked_ns = time.monotonic_ns()
        self._library.fast.pokeys_client_read(self._client, self._state)
        struct.pack_into("<Q", self.image, _names.COMMAND_READ_TIME, self._looked_ns)
        whole = (ctypes.c_char * len(self.image)).from_buffer(self.image)
        lapsed = bool(self._library.cold.pokeys_client_command(self._client, whole))
        # what the library's thread writes from now on is this command, whatever it was about to write
        self._given_ns = time.monotonic_ns()
        return lapsed

    def _is_seen(self) -> bool:
        """The daemon has seen what was given last."""
        if self._library.fast.pokeys_client_read(self._client, self._state):
            return False
        written_ns = struct.unpack_from("<Q", self._state.raw, _names.STATE_COMMAND_TIME)[0]
        return State(self._shot()).commander_alive and written_ns >= self._given_ns

    def _wait(self) -> None:
        """Until the daemon has seen what was given last; :class:`Refused` if it does not."""
        end = time.monotonic() + ATTACH_S
        while not self._is_seen():
            if time.monotonic() >= end:
                raise Refused(f"{self.name}: the daemon does not take the command")
            self._library.cold.pokeys_client_renew(self._client)
            time.sleep(TURN_S / 4)


def _fit(index: int, count: int) -> None:
    if not 0 <= index < count:
        raise ValueError(f"{index}: the numbers are 0 to {count - 1}")


def _new_session() -> int:
    """Differs for each start, and from that of another process; never 0."""
    return (time.monotonic_ns() >> 10 ^ os.getpid() << 16) & 0xffffffff | 1


class Order:
    """A one-shot that was given to the daemon."""

    __slots__ = ("_image", "_number")

    def __init__(self, image: _Held, number: int) -> None:
        self._image, self._number = image, number

    @property
    def outcome(self) -> Outcome | None:
        """How it has ended; None = it has not yet, or the daemon has forgotten it: it knows the last 16 outcomes.

        ValueError when the with statement has ended.
        """
        return self._image.outcome(self._number)


class Command(_names.CommandValues):
    """What is commanded, by HAL's names. Setting a value commands it at once, and renews the lease.

    Nothing is commanded that was not set: the daemon leaves it in its safe state.
    """

    __slots__ = ()
    _image: _Held

    def renew(self) -> None:
        """Renew the lease without a change. :class:`Lapsed` if it had run out."""
        self._image.renew()

    def wait(self) -> None:
        """Until the daemon has seen what was commanded last, usually some milliseconds. Renews the lease.

        :class:`Lapsed`, and :class:`Refused` if it has not after three seconds.
        """
        self._image.wait()

    def order(self, operation: OneShot, *, index: int = 0, mask: int = 0, flags: int = 0, values: Sequence[int] = (),
              parameters: Sequence[float] = (), fractions: Sequence[int] = ()) -> Order:
        """Give the daemon a one-shot, such as ``OneShot.HEATER_RESET``. Does not wait, and renews the lease.

        What the numbers mean depends on the operation, see pokeys/command.h. ValueError if one does not fit,
        :class:`Lapsed`, and :class:`Refused` if the daemon takes none.
        """
        return Order(self._image, self._image.order(operation, index, mask, flags, values, parameters, fractions))

    def __setitem__(self, name: str, value: Any) -> None:
        """Command one value by HAL's name. KeyError, TypeError, ValueError, :class:`Lapsed`."""
        self.update({name: value})

    def update(self, values: Mapping[str, Any], *, axes: Mapping[int, Axis] | None = None,
               servos: Mapping[int, Servo] | None = None) -> None:
        """Command several values at once, and axes and servo motors by their numbers.

        Nothing is commanded if one of them cannot be. What switches on the machine, an axis or a servo motor waits
        until the daemon has seen it; :class:`Refused` after three seconds, or if the computer stays too busy for fresh
        positions. Positions of what the daemon moves along a path do not matter until the path has ended; then they
        have to become where it is. See docs/servos.md.
        """
        self._image.change([(*_place(name), value) for name, value in values.items()], axes, servos)


_ALL: weakref.WeakSet[Commander] = weakref.WeakSet()


def _forget_all() -> None:
    """In the child of a fork: the library's threads are not there."""
    for commander in _ALL:
        commander._forget()  # pylint: disable=protected-access
        commander._lock.held = threading.RLock()  # pylint: disable=protected-access


os.register_at_fork(after_in_child=_forget_all)


class Commander:
    """The place of a device's one commander, in a ``with``; made by ``device.command()``.

        with mill.command(lease=2) as command:
            command.pin[30].out = True
            command.renew()         # at least every two seconds

    Entering raises :class:`Refused` while somebody else commands (the text says who), and
    what reading raises. At the end, and when the lease runs out, the device goes to its safe
    state. The user has to be in group pokeys.
    """

    def __init__(self, name: str, runtime: str | None, lease: float) -> None:
        if not SHORTEST_S <= lease <= LONGEST_S:
            raise ValueError(f"lease={lease}: allowed: {SHORTEST_S} to {LONGEST_S} seconds")
        self._name, self._runtime, self._lease = name, runtime, lease
        self._client = ctypes.c_void_p()
        self._lock = Lock()
        self._lib = _library.library()
        _ALL.add(self)

    def __enter__(self) -> Command:
        _library.check_layouts({0: _names.STATE_HASH, 2: _names.COMMAND_HASH})
        if self._client:
            raise ValueError(f"{self._name} is commanded by this object already")
        result = self._lib.cold.pokeys_client_open(
            ctypes.byref(self._client), self._runtime.encode() if self._runtime else None, self._name.encode(),
            b"python", _library.COMMANDER)
        if not result:
            result = self._lib.cold.pokeys_client_hold(self._client, PERIOD_MS, round(self._lease * 1000))
        if result:
            self._close()
            raise OSError(-result, os.strerror(-result))
        try:
            return self._begin(self._attach())
        except BaseException:
            self._close()
            raise

    def _begin(self, state: State) -> Command:
        """With nothing, so that machine-is-on rises when it is set. Waits until the daemon has seen it."""
        # all PWM channels have one period; where none is set it is 1 kHz, and stays so
        period = state.pwm.period_ticks or state.info.PWMinternalFrequency // USUAL_HZ
        held = _Held(self._lib, self._client, self._lock, self._name, period)
        held.begin()
        return Command(held)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._close()

    def _close(self) -> None:
        with self._lock.held:
            client = ctypes.c_void_p(self._client.value)
            self._forget()
            self._lib.cold.pokeys_client_close(client)

    def _forget(self) -> None:
        """Nothing is commanded by this object any more, nor by the command that it has given."""
        self._client.value = None
        self._client = ctypes.c_void_p()

    def __del__(self) -> None:
        with contextlib.suppress(AttributeError):
            self._close()

    def _attach(self) -> State:
        """Until the device runs and nobody else commands it."""
        end, refused = time.monotonic() + ATTACH_S, time.monotonic() + REFUSED_S
        text = ctypes.create_string_buffer(256)
        while True:
            found = self._lib.cold.pokeys_client_status(self._client, text, len(text))
            state = self._read() if found == _library.ATTACHED else None
            if state and state.connected and not state.commander_alive:
                return state
            # the daemon takes a moment to clear the place of a commander that died
            over = refused if found == _library.REFUSED else end
            if time.monotonic() >= over:
                why = text.value.decode(errors="replace")
                if state and found == _library.ATTACHED:
                    why = f"{self._name}: {state.reason or 'the last commander has not gone'}"
                raise Refused(why)
            time.sleep(TURN_S)

    def _read(self) -> State | None:
        image = ctypes.create_string_buffer(_names.STATE_SIZE)
        result = self._lib.fast.pokeys_client_read(self._client, image)
        if result not in (0, -errno.ENOTCONN):
            raise Refused(f"{self._name}: the shared memory cannot be read: {os.strerror(-result)}")
        return None if result else State(Shot(image.raw, time.monotonic_ns()))
