# SPDX-License-Identifier: GPL-2.0-or-later
"""The bytes of a file of G-code: lines, places, and which lines have to be judged before a job begins. These
functions read an open file, which may hang, and so belong into a thread."""
from __future__ import annotations

import errno
import os
import re

from .parser import LINE_MOST, BadLine

CHUNK = 64 << 10            # bytes that are read at once
LONGEST = 1 << 20           # a line with its comment
OF_MOVES = "FIJR"           # letters besides the axes
ALL = re.compile(rb"^(?![ \t]*(?:;.*)?\r?$).+$", re.M)        # finds all lines but comments and empty ones


def good(code: bytearray) -> bytes:
    """A line without its comment. :class:`BadLine`."""
    line = bytes(code).removesuffix(b"\r")
    if len(line) > LINE_MOST:
        raise BadLine(f"a line has at most {LINE_MOST} characters")
    if b"\r" in line.strip():
        raise BadLine("a carriage return is in the middle of it")
    return line


def find(file: int, lines: int | None, byte: int) -> tuple[int, int]:
    """In an open file: the place behind so many lines, or at the beginning of the line that this byte is in."""
    at = start = count = 0
    while data := os.pread(file, CHUNK, at):
        begin = 0
        while (end := data.find(b"\n", begin)) >= 0:
            if (lines is not None and count >= lines) or (lines is None and at + end >= byte):
                return start, count
            count, begin = count + 1, end + 1
            start = at + begin
        at += len(data)
    if lines is not None and count < lines:
        raise OSError(errno.EINVAL, f"the file has {count + (at > start)} lines")
    return start, count


def unusual_of(axes: str) -> re.Pattern[bytes]:
    """Finds all lines but comments, empty ones and moves of these axes: those are most of a file, and have nothing to
    be judged."""
    letters = f"[{OF_MOVES}{axes}]".encode()
    usual = (rb"(?:G0*[0-3])?(?:[ \t]*" + letters + rb"[ \t]*[+-]?(?:\d+(?:\.\d*)?|\.\d+))*[ \t]*(?:;.*)?\r?")
    return re.compile(rb"^(?!" + usual + rb"$).+$", re.M)


def whole_lines(file: int, at: int) -> bytes:
    """Some lines from there on; nothing at the file's end."""
    data = os.pread(file, CHUNK, at)
    end = data.rfind(b"\n") + 1
    while not end and len(data) < LONGEST and (more := os.pread(file, CHUNK, at + len(data))):
        data += more
        end = data.rfind(b"\n") + 1
    return data[:end or len(data)]


def unusual(file: int, at: int, pattern: re.Pattern[bytes]) -> tuple[list[tuple[int, bytes]], int, int]:
    """Lines from there on that have to be judged, without comments and the first of each kind, with their numbers from
    1; how far that goes, and how many lines that are: 0 at the file's end."""
    data = whole_lines(file, at)
    found: dict[bytes, int] = {}
    counted = counted_to = 0
    for line in pattern.finditer(data):
        counted += data.count(b"\n", counted_to, line.start())
        counted_to = line.start()
        found.setdefault(line[0].partition(b";")[0], counted + 1)
    return [(number, line) for line, number in found.items()], at + len(data), data.count(b"\n") or int(bool(data))
