# SPDX-License-Identifier: GPL-2.0-or-later
"""From bytes to lines: up to CR or LF, or until the client's limit is reached.

The bytes of all messages together are the bytes that came. CR LF is one end: a CR that came last waits for
its LF, a moment.
"""
from __future__ import annotations

import re

from .message import Part

IDLE_S = 1.5                # then what there is of a line is passed on
CR_S = 0.02                 # then a CR was an end by itself
_END = re.compile(rb"\r\n|\r|\n")


class Framer:
    """The bytes of one client. `most` is the longest part of a line, with its end, in bytes."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._data = bytearray()
        self._inside = False        # a part of this line was passed on, and its last one was not

    def __len__(self) -> int:
        return len(self._data)

    def feed(self, data: bytes) -> None:
        """More has come."""
        self._data += data

    def next(self) -> tuple[bytes, Part] | None:
        """The next line, or part of one; None: there is none yet."""
        found = _END.search(self._data, 0, self._most)
        if not found:
            return self._take(self._most, False) if len(self._data) >= self._most else None
        if found[0] == b"\r" and found.end() == len(self._data):
            return None
        return self._take(found.end(), True)

    @property
    def patience(self) -> float | None:
        """How long to wait for more before :meth:`flush`, in seconds; None: for nothing."""
        return (CR_S if self._data.endswith(b"\r") else IDLE_S) if self._data else None

    def flush(self) -> tuple[bytes, Part] | None:
        """What there is of a line that nothing more came for. The next byte begins another one."""
        return self._take(len(self._data), True) if self._data else None

    def find(self, line: re.Pattern[bytes], at: int = 0) -> re.Match[bytes] | None:
        """The first whole line that fits, from a place on, of those that are here from their beginning."""
        begun = _END.search(self._data) if self._inside else None
        if self._inside and not begun:
            return None
        return line.search(self._data, max(at, begun.end() if begun else 0))

    def cut(self, start: int, end: int) -> int:
        """Forget these bytes, from the beginning of a line to an end; how many lines that were."""
        lines = len(_END.findall(self._data, start, end))
        del self._data[start:end]
        self._inside = self._inside and start > 0
        return lines

    def cut_begun(self) -> None:
        """Forget the line that has no end yet, as far as it is here."""
        del self._data[len(self._data) - len(self.begun):]

    @property
    def begun(self) -> bytes:
        """The line that has no end yet, as far as it is here."""
        return bytes(self._data[max(self._data.rfind(b"\n"), self._data.rfind(b"\r")) + 1:])

    @property
    def open(self) -> bool:
        """Is the rest of a line still to come?"""
        return bool(self.begun) or (self._inside and not self._data)

    def _take(self, size: int, last: bool) -> tuple[bytes, Part]:
        data = bytes(self._data[:size])
        del self._data[:size]
        part = {(False, True): Part.UNIQUE, (False, False): Part.HEAD, (True, False): Part.CORE,
                (True, True): Part.TAIL}[self._inside, last]
        self._inside = not last
        return data, part
