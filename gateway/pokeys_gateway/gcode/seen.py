# SPDX-License-Identifier: GPL-2.0-or-later
"""The state of the device that G-code commands, for who has to know what to command next.

A reading that is late for a moment, on a bad wire or a busy computer, is no reason to end a print: the daemon goes on
by itself, and says what it has ended.
"""
from __future__ import annotations

import math
import time

import pokeys

from ..hub import Hub
from ..wire import NotDone

LATE_S = 2.0                # so long a device may be silent


class Seen:
    """Belongs to the event loop's thread."""

    def __init__(self, hub: Hub, device: str) -> None:
        self._hub, self._device = hub, device
        self._fresh_at = -math.inf

    def __call__(self) -> pokeys.State:
        """:class:`NotDone` if there is none, or none for some time."""
        reading, now = self._hub.source.read(self._device), time.monotonic()
        if not reading or reading.state is None:
            raise NotDone(reading.reason if reading else self._hub.no_such_device(self._device))
        if reading.connected:
            self._fresh_at = now
        elif now - self._fresh_at > LATE_S:
            raise NotDone(reading.reason)
        return reading.state
