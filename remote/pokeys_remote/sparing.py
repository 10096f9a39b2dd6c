# SPDX-License-Identifier: GPL-2.0-or-later
"""A log that clients cannot flood: what they cause is printed so often and no more, and the rest is counted."""
from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable

LINES_MOST, LINES_TIME = 20, 10.0       # so many in so many s


class Sparing(logging.Filter):
    """For the logger of what clients cause."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._now = now
        self._printed: deque[float] = deque()
        self._left_out = 0

    def filter(self, record: logging.LogRecord) -> bool:
        """May it be printed?"""
        now = self._now()
        while self._printed and now - self._printed[0] >= LINES_TIME:
            self._printed.popleft()
        if len(self._printed) >= LINES_MOST:
            self._left_out += 1
            return False
        self._printed.append(now)
        if self._left_out:
            record.msg = f"{record.getMessage()} ({self._left_out} lines like this were left out before it)"
            record.args = None
            self._left_out = 0
        return True


CLIENTS = logging.getLogger("pokeys-remote.clients")
CLIENTS.addFilter(Sparing())
