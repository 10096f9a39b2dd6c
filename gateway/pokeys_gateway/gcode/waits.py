# SPDX-License-Identifier: GPL-2.0-or-later
"""Lines that wait for something that a person may give up: a temperature, or the person."""
from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterator


class Waits:
    """All waits that M108 ends. Belongs to the event loop's thread."""

    def __init__(self) -> None:
        self._all: set[asyncio.Event] = set()

    @contextlib.contextmanager
    def one(self) -> Iterator[asyncio.Event]:
        """A wait, and the event that says that it is to end."""
        given_up = asyncio.Event()
        self._all.add(given_up)
        try:
            yield given_up
        finally:
            self._all.discard(given_up)

    def end(self) -> None:
        """M108: those that are under way."""
        for event in self._all:
            event.set()
