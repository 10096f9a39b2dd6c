# SPDX-License-Identifier: MIT
"""A device of a running pokeysd."""
from __future__ import annotations

import asyncio
import contextlib
import ctypes
import errno
import os
import threading
import time
import weakref
from collections.abc import AsyncGenerator, Callable
from fnmatch import fnmatchcase
from types import TracebackType
from typing import Any, NoReturn

from . import _library, _names, pokeysctl
from .commander import Commander
from .errors import Error, NoDaemon, NoSuchDevice, Refused, Stale
from .events import Event, Reader
from .snapshot import JUDGED, Diagnostics, Shot, State, is_diagnostic, is_fresh, names, place, published_ns, unknown

FOLLOW_MS = 100         # how often the library looks for another daemon
ATTACH_S, REFUSED_S = 0.05, 5.0
DIAGNOSTICS_OLD_US = 2e6
EVENTS_S = 0.1
FEW = 100               # so many values are taken one by one
RUNTIME = "/run/pokeysd"
# these change all the time: names with these prefixes do not count as a change
_RESTLESS = ("age.", "packets.", "phase", "rtt-", "cycle", "deadline-us", "daemon.", "command.heartbeat",
             "device.load", "device.tick", "rate.", "rtc.sec")


_OPEN: weakref.WeakSet[Device] = weakref.WeakSet()


def _forget_all() -> None:
    for device in _OPEN:
        device._forget()  # pylint: disable=protected-access


os.register_at_fork(after_in_child=_forget_all)


class Device:
    """An attached device. Create it with :func:`attach`, in a ``with`` statement.

    Any number of programs may attach; none can disturb the machine. After a restart of the
    daemon, the object attaches to it by itself. Several threads may use the same object.
    """

    def __init__(self, name: str, runtime: str | None) -> None:
        self.name = name
        self._runtime = runtime
        self._client = ctypes.c_void_p()
        self._lock = threading.RLock()      # a signal's handler may read as well
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
        _OPEN.add(self)

    def close(self) -> None:
        """Detach. May be called more than once, and in any thread."""
        with self._lock:
            client, self._client = self._client, ctypes.c_void_p()
            self._lib.cold.pokeys_client_close(client)

    def _forget(self) -> None:
        """In the child of a fork: the library's thread is not there, so nothing can be closed."""
        self._client, self._lock = ctypes.c_void_p(), threading.RLock()

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

    def _missing(self) -> Error:
        """Why it is not attached."""
        text = ctypes.create_string_buffer(256)
        found = self._lib.cold.pokeys_client_status(self._client, text, len(text))
        why = text.value.decode(errors="replace")
        if found != _library.REFUSED:
            return NoDaemon(why)
        with contextlib.suppress(OSError):
            there = _library.devices(self._runtime)
            if self.name not in there:
                return NoSuchDevice(why, there)
        return Refused(why)

    def _attach(self) -> Error | None:
        """Look for the daemon once, then let the library do it. Why there is none, or None."""
        if self._lib.cold.pokeys_client_poll(self._client) != _library.ATTACHED:
            return self._missing()
        result = self._lib.cold.pokeys_client_follow(self._client, FOLLOW_MS)
        if result:
            raise OSError(-result, os.strerror(-result))
        return None

    def _read(self, read: Callable[[Any, Any], int], into: ctypes.Array[ctypes.c_char]) -> Shot:
        with self._lock:
            client, before = self._open_client(), time.monotonic_ns()
            result = read(client, into)
            if result == 0:
                return Shot(into.raw, before)
            if result == -errno.ENOTCONN:
                raise self._missing()
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

    def diagnostics(self, *, stale_ok: bool = False) -> Diagnostics:
        """Return latencies and counters of the daemon, which it updates about ten times a second.

        Raises what :meth:`read` raises; they are stale if they are older than two seconds.
        """
        found = Diagnostics(self._read(self._lib.fast.pokeys_client_read_diag, self._diag))
        age = found.age.diagnostics_us
        if not stale_ok and (age is None or age > DIAGNOSTICS_OLD_US):
            why = "no diagnostics yet" if age is None else f"diagnostics are {age / 1e6:.1f} s old"
            raise Stale(f"{self.name}: {why}", None if age is None else age / 1e6)
        return found

    def __getitem__(self, name: str) -> Any:
        """Read one value by its name. Raises KeyError, and the exceptions of :meth:`read`."""
        found = place(name)
        if not found:
            if not is_diagnostic(name) and name not in JUDGED:
                raise unknown(name)
            return self.diagnostics()[name] if is_diagnostic(name) else self.read(stale_ok=True)[name]
        shot = self._read(self._lib.fast.pokeys_client_read, self._state)
        return found[0].take(shot, found[1]) if is_fresh(shot) else self.read()[name]

    def changes(self, *patterns: str, rate: float = 20) -> AsyncGenerator[State, None]:
        """Yield the state now, and again whenever one of the values has changed.

        Values are compared ``rate`` times a second. ``patterns`` are names, with the wildcards
        of fnmatch; without patterns, all values are compared except those that change all the
        time, such as ages and packet counters. Does not raise :class:`Stale`: it also yields a
        state when the values become old or fresh again (``state.connected``), and the last one
        when the daemon ends. It continues when there is a daemon again. Raises KeyError if a
        pattern matches no name of :class:`State`, and :class:`Refused` or
        :class:`NoSuchDevice` if that is so for some seconds.
        """
        self._open_client()
        if not rate > 0:
            raise ValueError(f"rate={rate}: must be more than 0")
        return self._changes(_chosen(patterns), 1 / rate)

    async def _changes(self, look: Callable[[State], Any], interval: float) -> AsyncGenerator[State, None]:
        last: State | None = None
        seen: Any = None
        refused_at: float | None = None
        while True:
            try:
                last, refused_at = self.read(stale_ok=True), None
            except NoDaemon:
                last = last and State(last.of_the_past())
            except (NoSuchDevice, Refused) as why:
                refused_at = _since(refused_at, why)
                last = last and State(last.of_the_past())
            if last:
                now = (last.connected, look(last))
                if now != seen:
                    seen = now
                    yield last
            await asyncio.sleep(interval)

    def _open_client(self) -> Any:
        if not self._client:
            raise ValueError(f"{self.name} is closed; call attach() again (a child process as well)")
        return self._client

    def recent_events(self) -> list[Event]:
        """Return what has happened since the start of the daemon, oldest first; it keeps the last 128 events.

        Raises :class:`NoDaemon` and :class:`Refused`.
        """
        with self._lock:
            found = Reader(self.name).take(self._open_client())
            if found is None:
                raise self._missing()
        return found

    def events(self, *, past: bool = False) -> AsyncGenerator[Event, None]:
        """Yield what happens to the device from this call on, within about a tenth of a second.

        With ``past``, it begins with the events that the daemon has kept. It continues after a
        restart of the daemon, and waits while there is none. Raises :class:`Refused` or
        :class:`NoSuchDevice` if that is so for some seconds.
        """
        self._open_client()
        # a client that attaches to the next daemon only when the events of this one have been read
        own, reader = Device(self.name, self._runtime), Reader(self.name)
        if self._lib.cold.pokeys_client_poll(own._client) == _library.ATTACHED and not past:
            reader.take(own._client)
        return self._events(own, reader)

    async def _events(self, own: Device, reader: Reader) -> AsyncGenerator[Event, None]:
        refused_at: float | None = None
        with own:
            while True:
                while found := reader.take(own._open_client()):
                    for event in found:
                        yield event
                refused_at = own._look(refused_at)
                self._open_client()
                await asyncio.sleep(EVENTS_S)

    def _look(self, refused_at: float | None) -> float | None:
        """Look for the daemon. Since when it is refused (by time.monotonic()); raises why after some seconds."""
        if self._lib.cold.pokeys_client_poll(self._client) == _library.ATTACHED:
            return None
        why = self._missing()
        if isinstance(why, NoDaemon):
            return None
        return _since(refused_at, why)

    def command(self, *, lease: float = 0.5) -> Commander:
        """Command the device, in a ``with``; see :class:`Commander`. ``lease`` is in seconds, 0.01 to 60."""
        self._open_client()
        return Commander(self.name, self._runtime, lease)

    def settings(self) -> dict[str, str | float | None]:
        """Return the device's own settings, by the keys of pokeysd.conf(5).

        Runs pokeysctl and blocks for some milliseconds. Raises :class:`ToolFailed`.
        """
        self._open_client()
        return pokeysctl.settings(self.name, self._runtime)


def _since(before: float | None, why: Error) -> float:
    """Since when there is an obstacle (by time.monotonic()). Raises it after some seconds: a daemon may be starting."""
    now = time.monotonic()
    if before and now - before > REFUSED_S:
        raise why
    return before or now


def _chosen(patterns: tuple[str, ...]) -> Callable[[State], Any]:
    """A function that takes what is to be compared."""
    known = [name for name in names() if not is_diagnostic(name)]
    for pattern in patterns:
        if not isinstance(pattern, str):
            raise TypeError(f"{pattern!r} is not a name; give several names one after the other")
        if not any(fnmatchcase(name, pattern) for name in known):
            there = any(fnmatchcase(name, pattern) for name in names())
            raise KeyError(f"{pattern!r} is in diagnostics(), which has no changes" if there else
                           f"no value of the state is named {pattern!r}; pokeysctl names lists the names")
    chosen = [name for name in known
              if (any(fnmatchcase(name, pattern) for pattern in patterns) if patterns else
                  not name.startswith(_RESTLESS) and "age-" not in name)]

    if len(chosen) < FEW:
        return lambda state: [state[name] for name in chosen]

    def look(state: State) -> list[Any]:
        values = state.as_dict()
        return [values[name] for name in chosen]
    return look


def devices(runtime: str | os.PathLike[str] | None = None) -> list[str]:
    """Return the names of the running daemon's devices; empty if no daemon is running.

    Raises :class:`Refused` if the user may not read.
    """
    try:
        return _library.devices(None if runtime is None else os.fspath(runtime))
    except PermissionError as error:
        raise Refused(f"{runtime or RUNTIME}: permission denied; the user must be in the group that monitor-group in "
                      "pokeysd.conf(5) names (pokeys-monitor)") from error
    except OSError as error:
        if error.errno == errno.EINVAL:
            raise ValueError(f"runtime {runtime!r}: must be an absolute path") from error
        raise Refused(f"{runtime or RUNTIME}: {error.strerror}") from error


def attach(device: str, *, runtime: str | os.PathLike[str] | None = None, timeout: float = 0) -> Device:
    """Attach to a device by its name in pokeysd.conf.

    ``runtime`` is the daemon's runtime folder (default /run/pokeysd); ``timeout`` is the
    number of seconds to wait for a daemon (default: do not wait). Raises :class:`NoDaemon`,
    :class:`NoSuchDevice`, :class:`Refused`, :class:`LibraryMissing`, and ValueError if the
    name or the folder is not valid. Blocks for some milliseconds, or up to the timeout.
    """
    _library.check_layouts({0: _names.STATE_HASH, 1: _names.DIAG_HASH})
    end = time.monotonic() + timeout
    found = Device(device, None if runtime is None else os.fspath(runtime))
    try:
        while why := found._attach():  # pylint: disable=protected-access
            if time.monotonic() >= end:
                raise why
            time.sleep(ATTACH_S)
    except BaseException:
        found.close()
        raise
    return found
