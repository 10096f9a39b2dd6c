# SPDX-License-Identifier: GPL-2.0-or-later
"""What must not wait behind other lines: stops, and what the machine's firmware obeys in the middle of others.

Marlin and its kin obey M112 (emergency stop), M410 (stop moving) and M108 (wait no more) as soon as they
have come. grbl has single bytes for that, which may be in the middle of a line: ? (state), ! (hold), ~ (go on),
Ctrl-X (stop), and those from 0x80 on (overrides, cancel a jog).
"""
from __future__ import annotations

import re
from dataclasses import dataclass

# with ESP3D's numbers
FIRMWARES = {"marlin": 20, "grbl": 10, "grblhal": 80, "smoothieware": 40, "repetier": 50, "reprap": 70}


@dataclass(frozen=True)
class Urgent:
    """What a firmware obeys at once, as patterns."""

    line: re.Pattern[bytes] | None = None       # a whole line with its end
    stop: re.Pattern[bytes] | None = None       # of such a line, or of such a byte: what came before is not to be done
    byte: re.Pattern[bytes] | None = None


# whatever its number and its checksum are: that they are wrong must not keep a machine from stopping
_M = rb"[ \t]*(?:[Nn][ \t]*[+-]?\d+[ \t]*)?[Mm][ \t]*0*"
STOP = re.compile(_M + rb"(112|410)(?![\d.])")
_LINES = Urgent(re.compile(rb"(?:\A|(?<=[\r\n]))" + _M + rb"(?:112|410|108)(?![\d.])[^\r\n]*(?:\r\n|\r|\n)"), STOP)
_BYTES = Urgent(stop=re.compile(rb"\x18"), byte=re.compile(rb"[?!~\x18\x80-\xff]"))
OF_FIRMWARE = {"grbl": _BYTES, "grblhal": _BYTES}


def of(firmware: str) -> Urgent:
    """For one of FIRMWARES."""
    return OF_FIRMWARE.get(firmware, _LINES)
