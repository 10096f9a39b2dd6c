# SPDX-License-Identifier: MIT
"""A device of a running pokeysd."""
from __future__ import annotations

import asyncio
import contextlib
import ctypes
import errno
import os
import time
from collections.abc import AsyncIterator, Callable
from fnmatch import fnmatchcase
from types import TracebackType
from typing import Any, NoReturn

from . import _library, _names, pokeysctl
from .commander import Commander
from .errors import NoDaemon, NoSuchDevice, Refused, Stale
from .snapshot import Diagnostics, Shot, State, is_diagnostic, is_fresh, names, place, published_ns

FOLLOW_MS = 100         # how often the library looks for another daemon
ATTACH_S = 0.05
RUNTIME = "/run/pokeysd"
# these change all the time: names with these prefixes do not count as a change
_RESTLESS = ("age.", "packets.", "phase", "rtt-", "cycle", "deadline-us", "daemon.", "command.heartbeat",
             "device.load", "device.tick", "rate.", "rtc.sec")


class Device:
    """An attached device. Create it with :func:`attach`, in a ``with`` statement.

    Any number of programs may attach; none can disturb the machine. After a restart of the
    daemon, the object attaches to it by itself. Several threads may use the same object.
    """

    def __init__(self, name: str, runtime: str | None) -> None:
        self.name = name
        self._runtime = runtime
        self._client = ctypes.c_void_p()
        self._state = ctypes.create_string_buffer(_names.STATE_SIZE)
        self._diag = ctypes.create_string_buffer(_names.DIAG_SIZE)
        self._lib = _library.library()
        result = self._lib.cold.pokeys_client_open(
            ctypes.byref(self._client), runtime.encode() if runtime else None, name.encode(), b"python", 0)
        if result == -errno.EINVAL:
            raise ValueError(f"device {name!r}, runtime {runtime or RUNTIME!r}: a device's name has 1 to 31 "
                             "characters of A-Z a-z 0-9 _ -, and runtime must be an absolute path")
        if result:
            raise OSError(-result, os.strerror(-result))

    def close(self) -> None:
        """Detach. May be called more than once, but not while another thread reads."""
        client, self._client = self._client, ctypes.c_void_p()
        self._lib.cold.pokeys_client_close(client)

    def __enter__(self) -> Device:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    def __del__(self) -> None:
        with contextlib.suppress(AttributeError):
            self.close()

    def __repr__(self) -> str:
        return f"<Device {self.name}>"

    def _why(self) -> str:
        text = ctypes.create_string_buffer(256)
        self._lib.cold.pokeys_client_status(self._client, text, len(text))
        return text.value.decode(errors="replace")

    def _attach(self) -> bool:
        """Look for the daemon once, then let the library do it."""
        if not self._client:
            raise ValueError(f"{self.name} is closed")
        found = self._lib.cold.pokeys_client_poll(self._client)
        if found == _library.REFUSED:
            with contextlib.suppress(OSError):
                there = _library.devices(self._runtime)
                if self.name not in there:
                    raise NoSuchDevice(self._why(), there)
            raise Refused(self._why())
        if found == _library.ATTACHED:
            result = self._lib.cold.pokeys_client_follow(self._client, FOLLOW_MS)
            if result:
                raise OSError(-result, os.strerror(-result))
        return bool(found == _library.ATTACHED)

    def _read(self, read: Callable[[Any, Any], int], into: ctypes.Array[ctypes.c_char]) -> Shot:
        if not self._client:
            raise ValueError(f"{self.name} is closed")
        before = time.monotonic_ns()
        result = read(self._client, into)
        if result == 0:
            return Shot(into.raw, before)
        if result == -errno.ENOTCONN:
            raise NoDaemon(self._why())
        raise Refused(f"{self.name}: the shared memory cannot be read: {os.strerror(-result)}")

    def read(self, *, stale_ok: bool = False) -> State:
        """Return the values of this moment.

        Raises :class:`Stale` if they are old, unless ``stale_ok`` is true; :class:`NoDaemon`
        if no daemon is running; :class:`Refused` if the memory cannot be read. Takes a few
        microseconds and never waits.
        """
        shot = self._read(self._lib.fast.pokeys_client_read, self._state)
        if not is_fresh(shot):
            # the image may have been written between the two: the clock was read before it
            shot.now_ns = max(shot.now_ns, min(published_ns(shot), time.monotonic_ns()))
            if not stale_ok and not is_fresh(shot):
                self._complain(State(shot))
        return State(shot)

    def _complain(self, state: State) -> NoReturn:
        age = state.age_us
        raise Stale(f"{self.name}: {state.reason}", None if age is None else age / 1e6)

    def diagnostics(self) -> Diagnostics:
        """Return latencies and counters of the daemon, which it updates about ten times a second.

        Raises :class:`NoDaemon` and :class:`Refused`, but not :class:`Stale`: if the daemon
        hangs, these are its last ones.
        """
        return Diagnostics(self._read(self._lib.fast.pokeys_client_read_diag, self._diag))

    def __getitem__(self, name: str) -> Any:
        """Read one value by its name. Raises KeyError, and the exceptions of :meth:`read`."""
        found = place(name)
        if not found:
            return self.diagnostics()[name] if is_diagnostic(name) else self.read()[name]
        shot = self._read(self._lib.fast.pokeys_client_read, self._state)
        return found[0].take(shot, found[1]) if is_fresh(shot) else self.read()[name]

    async def changes(self, *patterns: str, rate: float = 20) -> AsyncIterator[State]:
        """Yield the state now, and again whenever one of the values has changed.

        Values are compared ``rate`` times a second. ``patterns`` are names, with the wildcards
        of fnmatch; without patterns, all values are compared except those that change all the
        time, such as ages and packet counters. Does not raise :class:`Stale`: it also yields a
        state when the values become old or fresh again (``state.connected``). While no daemon
        is running, it yields nothing, and continues when there is one. Raises KeyError if a
        pattern matches no name of :class:`State`, and :class:`Refused`.
        """
        if not rate > 0:
            raise ValueError(f"rate={rate}: must be more than 0")
        look = _chosen(patterns)
        seen: Any = None
        while True:
            state = self._newest()
            if state:
                now = (state.connected, look(state))
                if now != seen:
                    seen = now
                    yield state
            await asyncio.sleep(1 / rate)

    def _newest(self) -> State | None:
        try:
            return self.read(stale_ok=True)
        except NoDaemon:
            return None

    def command(self, *, lease: float = 0.5) -> Commander:
        """Command the device, in a ``with``; see :class:`Commander`. ``lease`` is in seconds, 0.01 to 60."""
        return Commander(self.name, self._runtime, lease)

    def settings(self) -> dict[str, str]:
        """Return the device's own settings, by the keys of pokeysd.conf(5).

        Runs pokeysctl and blocks for some milliseconds. Raises :class:`ToolFailed`.
        """
        return pokeysctl.settings(self.name, self._runtime)


def _chosen(patterns: tuple[str, ...]) -> Callable[[State], Any]:
    """A function that takes what is to be compared."""
    known = [name for name in names() if not is_diagnostic(name)]
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in known):
            raise KeyError(f"no value of the state is named {pattern!r}; pokeysctl names lists the names")
    chosen = [name for name in known
              if (any(fnmatchcase(name, pattern) for pattern in patterns) if patterns else
                  not name.startswith(_RESTLESS) and "age-" not in name)]

    def look(state: State) -> list[Any]:
        values = state.as_dict()
        return [values[name] for name in chosen]
    return look


def devices(runtime: str | None = None) -> list[str]:
    """Return the names of the running daemon's devices; empty if no daemon is running.

    Raises :class:`Refused` if the user may not read.
    """
    try:
        return _library.devices(runtime)
    except OSError as error:
        raise Refused(f"{runtime or RUNTIME}: {error.strerror}; add the user to group pokeys-monitor "
                      "and log in again") from None


def attach(device: str, *, runtime: str | None = None, timeout: float = 0) -> Device:
    """Attach to a device by its name in pokeysd.conf.

    ``runtime`` is the daemon's runtime folder (default /run/pokeysd); ``timeout`` is the
    number of seconds to wait for a daemon (default: do not wait). Raises :class:`NoDaemon`,
    :class:`NoSuchDevice`, :class:`Refused`, :class:`LibraryMissing`, and ValueError if the
    name or the folder is not valid. Blocks for some milliseconds, or up to the timeout.
    """
    _library.check_layouts({0: _names.STATE_HASH, 1: _names.DIAG_HASH})
    end = time.monotonic() + timeout
    found = Device(device, runtime)
    try:
        while not found._attach():  # pylint: disable=protected-access
            if time.monotonic() >= end:
                raise NoDaemon(f"no daemon runs in {runtime or RUNTIME}; start it "
                               "(systemctl start pokeysd), or pass its folder as runtime")
            time.sleep(ATTACH_S)
    except BaseException:
        found.close()
        raise
    return found
