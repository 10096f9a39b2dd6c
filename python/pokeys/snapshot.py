# SPDX-License-Identifier: MIT
"""The values of one moment.

Whether they are fresh is decided here, by this program's clock and the time stamps: a
daemon that is dead cannot say that its values are old.
"""
from __future__ import annotations

import functools
import math
import struct
import time
from collections.abc import Callable, Iterator
from typing import Any

from . import _library, _names
from ._values import AHEAD_MOST_NS, HISTOGRAM_SIZE, Stored, Value, Word, age_ns
from ._whole import Whole

RUNNING = 3
PULSE_ENGINE_2 = 2
DEAD_PERIODS, DEAD_NS = 20, 100_000_000
JUDGED = {
    "connected": "the device runs and its data are fresh",
    "stale": "the values are old",
    "daemon-alive": "the daemon has published within the last 100 ms or 20 of its cycles",
    "age-us": "age of the fast data",
}

# what to do, where the word alone does not say it
_ADVICE = {
    1: 'not found in the network; run "pokeysctl discover" to see why',
    2: 'no answer; check power and cable, then run "sudo pokeysctl discover"',
    3: 'wrong serial number; "pokeysctl events" says which one answers',
    6: "configuration locked; see password-file in pokeysd.conf(5)",
    9: 'driven by another pokeysd or section; "pokeysctl events" says which',
}


class Shot:
    """An image as bytes, and when it was read (CLOCK_MONOTONIC, ns)."""

    __slots__ = ("gone", "image", "now_ns")

    def __init__(self, image: bytes, now_ns: int, *, gone: bool = False) -> None:
        self.image = image
        self.now_ns = now_ns
        self.gone = gone        # the daemon has ended, and this was its last image


@functools.cache
def _whole_state() -> Whole:
    return Whole(_names.STATE_VALUES, _names.STATE_SIZE, JUDGED)


@functools.cache
def _whole_diagnostics() -> Whole:
    return Whole(_names.DIAG_VALUES, _names.DIAG_SIZE)


def _index(values: tuple[Value[Any], ...]) -> dict[str, tuple[Value[Any], int]]:
    """Where each name is: its value, and the number of it."""
    return {name: (value, i) for value in values for i, name in enumerate(value.names())}


_STATE, _DIAGNOSTICS = _index(_names.STATE_VALUES), _index(_names.DIAG_VALUES)
place = _STATE.get      # of a name of the state image; None if it is not in there


def names() -> list[str]:
    """Return the names of all values of a device."""
    return [*JUDGED, *_STATE, *_DIAGNOSTICS]


def is_diagnostic(name: str) -> bool:
    """Is it a value of :class:`Diagnostics`?"""
    return name in _DIAGNOSTICS


def unknown(name: str) -> KeyError:
    """Why there is no value of this name to be read."""
    if any(name in value.names() for value in _names.COMMAND_VALUES):
        return KeyError(f"{name!r} can be commanded, but not read")
    return KeyError(f"no value is named {name!r}; pokeysctl names lists the names")


def describe(name: str) -> str:
    """Return the description of a value: one line, with its unit. Raises KeyError if there is none."""
    if name in JUDGED:
        return JUDGED[name]
    found = _STATE.get(name) or _DIAGNOSTICS.get(name)
    if not found:
        raise unknown(name)
    value = found[0]
    return f"{value.help} [{value.unit}]" if value.unit else value.help


def board_outputs(hardware: int) -> tuple[str, ...]:
    """Return the names on the board of a device's own outputs and relays (``external.NN.out``), in their order.

    ``hardware`` is ``state.info.DeviceTypeID``. Empty if that board has none.
    """
    return _names.BOARD_OUTPUTS.get(hardware, ())


class State(_names.StateValues):
    """The state of a device at one moment.

    A value is available as an attribute (``state.pin[3].in_``: a dash becomes _, and a Python
    keyword gets a trailing _) and by its name in HAL (``state["pin.03.in"]``).
    """

    __slots__ = ()
    _image: Shot

    def __getitem__(self, name: str) -> Any:
        """The value of a name. KeyError if it has none."""
        found = place(name)
        if found:
            return found[0].take(self._image, found[1])
        if name in JUDGED:
            return getattr(self, name.replace("-", "_"))
        raise unknown(name)

    def __repr__(self) -> str:
        return f"<State: {self.reason or 'running'}>"

    def as_dict(self) -> dict[str, Any]:
        """Return all values by name, for JSON for example; None = not known."""
        taken = _whole_state().take(self._image)
        for name in JUDGED:
            taken[name] = self[name]
        return taken

    def of_the_past(self) -> Shot:
        """The same image, marked as the last one of a daemon that has ended."""
        return Shot(self._image.image, time.monotonic_ns(), gone=True)

    def word(self, name: str) -> str:
        """Return the meaning of a code, such as "running" for link-state.

        Raises KeyError if there is no such name, or if its value is not a code.
        """
        value, i = _STATE[name]
        if not isinstance(value, Word):
            raise KeyError(f"{name}: the value is not a code")
        return value.word(value.take(self._image, i))

    @property
    def age_us(self) -> float | None:
        """Age of the inputs and positions in microseconds; None = no data yet."""
        age = data_age_ns(self._image)
        return None if math.isinf(age) else age / 1e3

    @property
    def daemon_alive(self) -> bool:
        """The daemon published a moment ago."""
        return is_alive(self._image)

    @property
    def connected(self) -> bool:
        """The device runs, and these values were fresh when they were read."""
        return is_fresh(self._image)

    @property
    def stale(self) -> bool:
        """The values were old when they were read."""
        return not is_fresh(self._image)

    @property
    def reason(self) -> str:
        """Why the values are old, in one line; empty if they are fresh."""
        if self.connected:
            return ""
        if self._image.gone:
            return "no daemon is running"
        if is_ahead(self._image):
            return "the time stamps are ahead of this computer's clock"
        if not self.daemon_alive:
            return f"daemon not publishing for {silence_ns(self._image) / 1e9:.1f} s"
        if self.link_state != RUNNING and self.fault:
            return _ADVICE.get(self.fault, self.word("fault"))
        age = self.age_us
        return "no data yet" if age is None else f"data is {age / 1e3:.4g} ms old"


def _judged_by() -> Callable[[bytes], tuple[int, ...]]:
    """A function that unpacks, in one call, the values that decide whether an image is fresh."""
    text, end = "<", 0
    wanted = {"daemon.period-us", "age.publish-us", "age.digital-us", "age.motion-us", "daemon.stale-after-us",
              "link-state", "info.pulse-engine-version"}
    for value in sorted(_names.STATE_VALUES, key=lambda value: value.offset):
        if value.name in wanted and isinstance(value, Stored):
            text += f"{value.offset - end}x{value.code}"
            end = value.offset + struct.calcsize("<" + value.code)
    return struct.Struct(f"{text}{_names.STATE_SIZE - end}x").unpack


_take_judged = _judged_by()


def is_fresh(shot: Shot) -> bool:
    """The device runs, and the values were fresh when they were read."""
    period, published, digital, motion, limit, link, engine = _take_judged(shot.image)
    now = shot.now_ns
    ahead, oldest = now + AHEAD_MOST_NS, now - limit
    return (link == RUNNING and not shot.gone and oldest <= digital <= ahead and digital != 0
            and (engine < PULSE_ENGINE_2 or (oldest <= motion <= ahead and motion != 0))
            and now - max(DEAD_NS, DEAD_PERIODS * period) <= published <= ahead)


def data_age_ns(shot: Shot) -> float:
    """Age of the inputs and positions, ns; infinite if there is no data yet."""
    _, _, digital, motion, _, _, engine = _take_judged(shot.image)
    age = age_ns(digital, shot.now_ns)
    return max(age, age_ns(motion, shot.now_ns)) if engine >= PULSE_ENGINE_2 else age


def published_ns(shot: Shot) -> int:
    """When the daemon published it (CLOCK_MONOTONIC, ns)."""
    return _take_judged(shot.image)[1]


def silence_ns(shot: Shot) -> float:
    """Time since the daemon published; infinite if that is in the future."""
    return age_ns(published_ns(shot), shot.now_ns)


def is_alive(shot: Shot) -> bool:
    """The daemon published a moment ago."""
    return not shot.gone and silence_ns(shot) <= max(DEAD_NS, DEAD_PERIODS * _take_judged(shot.image)[0])


def is_ahead(shot: Shot) -> bool:
    """A time stamp is in the future: no daemon of this boot wrote it."""
    _, published, digital, motion, _, _, engine = _take_judged(shot.image)
    last = shot.now_ns + AHEAD_MOST_NS
    return published > last or digital > last or (engine >= PULSE_ENGINE_2 and motion > last)


class Histogram:
    """Distribution of durations measured since the daemon's start."""

    def __init__(self, name: str, image: bytes) -> None:
        words = memoryview(image).cast("Q")
        self.name = name
        self.count, total, least, most = words[:4]
        self.mean_us = total / self.count / 1e3 if self.count else None
        self.min_us = least / 1e3 if self.count else None
        self.max_us = most / 1e3 if self.count else None
        self._image = image

    def percentile_us(self, part: float) -> float | None:
        """The duration in microseconds that this fraction (0..1) of the samples does not exceed."""
        return _library.percentile(self._image, part) / 1e3 if self.count else None

    def buckets(self) -> Iterator[tuple[float, int]]:
        """Yield the lower bound in microseconds and the number of samples of each bucket."""
        for i, number in enumerate(memoryview(self._image).cast("Q")[4:]):
            yield _library.bucket_lower(i) / 1e3, number

    def __repr__(self) -> str:
        return f"<Histogram {self.name}: {self.count}>"


class Diagnostics(_names.DiagnosticValues):
    """Latencies of the daemon and counters of its transport, updated about ten times a second."""

    __slots__ = ()
    _image: Shot

    def __getitem__(self, name: str) -> Any:
        """The value of a name. KeyError if it has none."""
        found = _DIAGNOSTICS.get(name)
        if not found:
            raise unknown(name)
        return found[0].take(self._image, found[1])

    def as_dict(self) -> dict[str, Any]:
        """All values by their names; None = not known."""
        return _whole_diagnostics().take(self._image)

    def histograms(self) -> dict[str, Histogram]:
        """Return the histograms by name, which is NAME of the value ``latency.NAME-p99-us``."""
        found = {}
        for value in _names.DIAG_VALUES:
            if value.name.endswith("-p50-us"):
                name = value.name.removeprefix("latency.").removesuffix("-p50-us")
                found[name] = Histogram(name, self._image.image[value.offset:value.offset + HISTOGRAM_SIZE])
        return found
