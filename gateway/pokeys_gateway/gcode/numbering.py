# SPDX-License-Identifier: GPL-2.0-or-later
"""The numbers of the lines of each client, by which a host sees that a line was lost or damaged."""
from __future__ import annotations

from weakref import WeakKeyDictionary

from ..console.client import Client
from .parser import BadLine, BadWords, Line


class Numbering:
    """Belongs to the event loop's thread."""

    def __init__(self) -> None:
        self._last: WeakKeyDictionary[Client, int] = WeakKeyDictionary()

    def __contains__(self, asker: Client) -> bool:
        """It has numbered a line."""
        return asker in self._last

    def count(self, asker: Client, number: int | None) -> None:
        """The number of its next line. :class:`BadLine`."""
        if number is not None:
            if number != self._last.get(asker, 0) + 1:
                raise BadLine("Line Number is not Last Line Number+1")
            self._last[asker] = number

    def set(self, asker: Client, number: int | None) -> None:
        """The last line had this number, whatever comes before it; None: no number."""
        if number is not None:
            self._last[asker] = number

    def renumber(self, asker: Client, line: Line) -> None:
        """M110: the number of the last line is N. :class:`BadWords`."""
        number = line.words().get("N", line.number)
        if number is None:
            return
        if abs(number) >= 1e9 or number != int(number):
            raise BadWords(f"{line.name} takes a whole number of at most 9 digits")
        self._last[asker] = int(number)

    def resend(self, asker: Client, why: BadLine) -> str:
        """The reply to a line that has to come again."""
        last = self._last.get(asker, 0)
        return f"Error:{why}, Last Line: {last}\nResend: {last + 1}\nok"
