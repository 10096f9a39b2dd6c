# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC's HAL, as far as remote components need it.

HAL is memory that LinuxCNC's processes share. A component whose process is gone stays in it, with its pins,
their last values and their links, unless the process has removed it. A proxy does not remove its remote
components when it ends, and the next proxy takes them over: it removes them, makes them again, and links their
pins to the same signals. What else is linked to these signals keeps their value meanwhile.
"""
from __future__ import annotations

import ctypes
import itertools
import subprocess
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import hal

from .component import own_pins
from .definition import Definition, Direction, Kind, Pin, Value

_KEY = 0x48414c32                       # HAL_KEY, of its shared memory
_COMMAND_LIMIT = 10                     # s, for halcmd
SEARCH_PAUSE = 1.0                      # s between searches for a name that is not there


class HalError(Exception):
    """HAL refuses."""


class NoHal(HalError):
    """There is no HAL, or not the same any more."""


@dataclass(frozen=True)
class Listed:
    """A component in HAL."""

    number: int
    name: str
    pid: int | None                     # None: realtime
    ready: bool

    @property
    def orphan(self) -> bool:
        """Its process is gone."""
        if self.pid is None:
            return False
        try:
            # a process that has got the same number since has not mapped HAL's memory
            return f"/SYSV{_KEY:08x}" not in Path(f"/proc/{self.pid}/maps").read_text(encoding="utf-8")
        except FileNotFoundError:
            return True
        except OSError:
            return False                # another user's, who would not be in this HAL's list without being alive


def _halcmd(*words: str) -> Iterator[list[str]]:
    try:
        with subprocess.Popen(["halcmd", "-s", *words], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True) as ran:
            try:
                said = ran.communicate(timeout=_COMMAND_LIMIT)[0]
            except subprocess.TimeoutExpired:
                # never SIGKILL: it may hold HAL's mutex
                ran.terminate()
                raise NoHal(f"halcmd {' '.join(words)} does not end") from None
    except OSError as error:
        raise NoHal(f"halcmd: {error}") from None
    if ran.returncode:
        raise NoHal(f"halcmd {' '.join(words)}: {said.strip()}")
    return (line.split() for line in said.splitlines() if line.strip())


def components() -> list[Listed]:
    """All components that HAL has. :class:`NoHal`."""
    found = []
    for words in _halcmd("show", "comp"):
        user = words[1] == "User"
        found.append(Listed(int(words[0]), words[2], int(words[3]) if user else None, words[-1] == "ready"))
    return found


def session(memories: TextIO) -> tuple[int, ...] | None:
    """What this HAL is and no other one: its memory's number, owner's number and time; None without one."""
    memories.seek(0)
    for line in memories.read().splitlines()[1:]:
        words = line.split()
        if int(words[0]) & 0xffffffff == _KEY:
            return int(words[1]), int(words[4]), int(words[13])
    return None


@dataclass(frozen=True)
class Item:
    """A pin or a signal of any component."""

    kind: Kind
    direction: Direction | None         # None: a signal


class Hal:
    """The components of one proxy."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.links: dict[str, str] = {}         # of pins of components that were taken over
        self._components: dict[str, Any] = {}
        self._items: dict[tuple[str, bool], Item] = {}
        self._listed = -SEARCH_PAUSE
        self._take_over(name)
        self._own = self._new(name)
        # open as long as this is: later, there may be no file for it
        self._memories = Path("/proc/sysvipc/shm").open(encoding="ascii")       # noqa: SIM115
        self.session = session(self._memories)

    def _new(self, name: str) -> Any:
        try:
            return hal.component(name)
        except hal.error as error:
            listed = {one.name: one for one in components()}.get(name)
            if listed:
                owner = f"process {listed.pid}" if listed.pid else "a realtime module"
                raise HalError(f"HAL has a component {name} already, which belongs to {owner}") from None
            raise HalError(f"HAL has no place for component {name}: {error}") from None

    def _take_over(self, name: str) -> None:
        """Remove a component whose process is gone, and keep what its pins are linked to."""
        listed = {one.name: one for one in components()}
        gone = listed.get(name)
        if not gone or not gone.orphan:
            return
        pins = _pins(gone)
        if name != self.name and not _own(name) <= pins.keys():
            return                      # of another program than a proxy
        self.links.update((pin, words[-1]) for pin, words in pins.items() if words[-2] in ("==>", "<==", "<=>"))
        # hal_exit() also counts down what this process has begun, and the last one unmaps HAL
        spare = next(one for number in itertools.count() if (one := f"{self.name}.former-{number}") not in listed)
        library = ctypes.CDLL("liblinuxcnchal.so.0")
        if library.hal_init(spare.encode()) < 0 or library.hal_exit(gone.number) < 0:
            raise HalError(f"component {name}, whose process is gone, cannot be removed")

    def ready(self) -> None:
        """``loadusr -W`` goes on now."""
        self._own.ready()

    @property
    def gone(self) -> bool:
        """Has LinuxCNC ended, or begun again with another HAL?"""
        return session(self._memories) != self.session

    def create(self, definition: Definition, values: Mapping[str, Value] | None) -> Any:
        """A component with its pins, ready; the pins by name. :class:`HalError`, and nothing has changed.

        ``values`` of pins, by full name, are given if the component is to be taken over.
        """
        if values is not None:
            self._take_over(definition.name)
        try:
            made = self._new(definition.name)
        except HalError:
            # a list of HAL's components takes milliseconds, and is seldom needed
            self._take_over(definition.name)
            made = self._new(definition.name)
        try:
            for pin in definition.pins:
                made.newpin(pin.name.partition(".")[2], int(pin.kind), int(pin.direction))
            for name, kind in own_pins().items():
                made.newpin(name, int(kind), int(Direction.OUT))
            # a signal without other pins takes the value of the pin that is linked to it
            for name, value in (values or {}).items():
                made[name.partition(".")[2]] = value
            made.ready()
        except (hal.error, MemoryError) as error:
            made.exit()
            raise HalError(f"HAL has no place for the pins of component {definition.name}: {error}") from None
        self._components[definition.name] = made
        return made

    def relink(self, name: str) -> list[str]:
        """Link the pins of a component that was taken over; those for which it failed, and why."""
        failed = []
        for pin in [pin for pin in self.links if pin.startswith(f"{name}.")]:
            signal = self.links.pop(pin)
            try:
                hal.connect(pin, signal)
            except (hal.error, RuntimeError) as error:
                failed.append(f"{pin} to {signal}: {error}")
        return failed

    def remains(self) -> list[tuple[Definition, dict[str, Value]]]:
        """Components of proxies that are gone, with the values of their pins.

        Of a proxy is whatever has the pins that each remote component has.
        """
        gone = [one for one in components() if one.orphan and one.name != self.name]
        found = []
        for one in gone:
            pins, own = _pins(one), _own(one.name)
            if own <= pins.keys():
                theirs = [_pin(words) for name, words in sorted(pins.items()) if name not in own]
                found.append((Definition(one.name, tuple(theirs)), {pin.name: self.get(pin.name) for pin in theirs}))
        return found

    def get(self, name: str) -> Value:
        """A pin, signal or parameter. :class:`HalError`."""
        try:
            return hal.get_value(name)      # type: ignore[no-any-return]
        except RuntimeError as error:
            raise HalError(str(error)) from None

    def set(self, name: str, value: Value) -> None:
        """An input that is not linked. :class:`HalError`."""
        try:
            hal.set_p(name, str(int(value) if isinstance(value, bool) else value))
        except RuntimeError as error:
            raise HalError(f"{name} is not set: {error}") from None

    def find(self, name: str, signal: bool, now: float) -> Item | None:
        """A pin or signal. The list is long, so it is read again only now and then for names that it lacks."""
        if (name, signal) not in self._items and now - self._listed >= SEARCH_PAUSE:
            self._listed = now
            self._items = {(one["NAME"], False): Item(Kind(one["TYPE"]), Direction(one["DIRECTION"]))
                           for one in hal.get_info_pins() if one["TYPE"] in list(Kind)}
            self._items.update({(name, True): Item(kind, None) for name, (kind, _) in self.signals().items()})
        return self._items.get((name, signal))

    @staticmethod
    def signals() -> dict[str, tuple[Kind, Value]]:
        """All signals, with their types and values."""
        return {one["NAME"]: (Kind(one["TYPE"]), one["VALUE"]) for one in hal.get_info_signals()
                if one["TYPE"] in list(Kind)}

    def exit(self) -> None:
        """Leave HAL. The remote components stay, with their links, until another proxy takes them over."""
        self._own.exit()
        self._memories.close()


def _pins(component: Listed) -> dict[str, list[str]]:
    """What halcmd shows of a component's pins."""
    return {words[4]: words for words in _halcmd("show", "pin", f"{component.name}.") if words[0] == component.name}


def _own(component: str) -> set[str]:
    return {f"{component}.{name}" for name in own_pins()}


def _pin(words: list[str]) -> Pin:
    kinds = {"bit": Kind.BIT, "float": Kind.FLOAT, "s32": Kind.S32, "u32": Kind.U32}
    directions = {"IN": Direction.IN, "OUT": Direction.OUT, "I/O": Direction.IO}
    return Pin(words[4], kinds[words[1]], directions[words[2]])
