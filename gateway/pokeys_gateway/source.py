# SPDX-License-Identifier: GPL-2.0-or-later
"""The daemon's devices, as the gateway sees them.

Reading one takes microseconds, so the event loop does it. Finding devices opens files and starts
threads, so another thread does that, once a second.
"""
from __future__ import annotations

import contextlib
import threading
import time
from dataclasses import dataclass

import pokeys

RETRY_S = 0.1               # a device that cannot be read costs milliseconds a try


@dataclass(frozen=True)
class Reading:
    """A device at one moment."""

    name: str
    state: pokeys.State | None              # None: nothing can be read
    diagnostics: pokeys.Diagnostics | None
    reason: str                             # why the values are old or missing

    @property
    def connected(self) -> bool:
        """The device runs, and the values are fresh."""
        return self.state is not None and self.state.connected


class Source:
    """All devices of the daemon of one runtime directory."""

    def __init__(self, runtime: str) -> None:
        self.runtime = runtime
        self.trouble = "not looked for a daemon yet"
        self._devices: dict[str, pokeys.Device] = {}
        self._missing: dict[str, tuple[float, Reading]] = {}       # until when, and what is said of it
        self._lock = threading.Lock()

    def look(self) -> None:
        """Find devices that are new, and forget those that the daemon no longer has. May block.

        Raises pokeys.LibraryMissing.
        """
        try:
            names = pokeys.devices(self.runtime)
        except pokeys.LibraryMissing:
            raise
        except (pokeys.Error, OSError) as error:
            self.trouble = str(error)
            return
        troubles = []
        for name in names:
            if name not in self._devices:
                # one that cannot be read keeps nobody from the others
                try:
                    self._attach(name)
                except (pokeys.Error, OSError) as error:
                    troubles.append(str(error))
        if names:
            self._forget(set(self._devices) - set(names))
        else:
            troubles = [f"no daemon in {self.runtime}; is pokeysd running?"]
        self.trouble = "; ".join(troubles)

    def _attach(self, name: str) -> None:
        device = pokeys.attach(name, runtime=self.runtime)
        with self._lock:
            self._devices[name] = device

    def _forget(self, names: set[str]) -> None:
        with self._lock:
            gone = [self._devices.pop(name) for name in names]
            for name in names:
                self._missing.pop(name, None)
        for device in gone:
            device.close()

    def names(self) -> list[str]:
        """Names of the devices."""
        with self._lock:
            return list(self._devices)

    def read(self, name: str, *, diagnostics: bool = False) -> Reading | None:
        """One device, or None if there is none of this name. Takes microseconds.

        One that cannot be read is tried again after :data:`RETRY_S`.
        """
        with self._lock:
            device = self._devices.get(name)
            until, missing = self._missing.get(name, (0.0, None))
        if not device:
            return None
        if missing and time.monotonic() < until:
            return missing
        reading = _read(device, diagnostics)
        with self._lock:
            self._missing.pop(name, None)
            if not reading.state:
                self._missing[name] = time.monotonic() + RETRY_S, reading
        return reading

    def events(self, name: str) -> list[pokeys.Event]:
        """What has happened to a device, as far as the daemon has kept it."""
        with self._lock:
            device = self._devices.get(name)
            until, _missing = self._missing.get(name, (0.0, None))
        try:
            return device.recent_events() if device and time.monotonic() >= until else []
        except (pokeys.Error, ValueError):
            return []

    def close(self) -> None:
        """Detach from all."""
        self._forget(set(self._devices))


def _read(device: pokeys.Device, diagnostics: bool) -> Reading:
    more = None
    try:
        state = device.read(stale_ok=True)
        if diagnostics:
            with contextlib.suppress(pokeys.Error):
                more = device.diagnostics(stale_ok=True)
    except pokeys.Error as error:
        return Reading(device.name, None, None, str(error) or "no daemon")
    except ValueError:      # it was closed this moment
        return Reading(device.name, None, None, f"{device.name} is no longer a device of the daemon")
    return Reading(device.name, state, more, state.reason)
