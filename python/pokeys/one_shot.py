# SPDX-License-Identifier: MIT
"""One-shots: orders to the daemon that happen once, each with an outcome. See <pokeys/command.h>."""
from __future__ import annotations

import enum
import struct
from collections.abc import Sequence

SLOTS, RESULTS = 64, 16     # in the command image, and in the state image
SIZE, RESULT_SIZE = 64, 8
VALUES, PARAMETERS = 8, 4
# flags, by their operations
HOME_FINISH_ITSELF, PROBE_ACTIVE_HIGH, PROBE_HYBRID = 1, 1, 2
SERVO_HOMED, SERVO_END_HOMING = 1, 2
MOVE_BEGINS = 1
_LAYOUT = struct.Struct("<IBBBB8i4f8B")
_RESULT = struct.Struct("<IBBxx")


class OneShot(enum.IntEnum):
    """What can be ordered; pokeys/command.h says what each does, and what its numbers mean."""

    NOP = 0
    SET_ENCODER = 1
    ARM_INDEX = 2
    SET_POSITION = 3
    CLEAR_FAULT = 4
    HOME = 5
    HOME_CANCEL = 6
    HOME_FINISH = 7
    PROBE = 8
    PROBE_FINISH = 9
    RESET_COUNTERS = 10
    SAVE_CONFIG = 11
    SET_RTC = 12
    REBOOT = 13
    JOG = 14
    JOG_END = 15
    THREAD_PREPARE = 16
    THREAD_FORCE = 17
    THREAD_ARM = 18
    THREAD_RELEASE = 19
    THREAD_CANCEL = 20
    HEATER_RESET = 21
    HEATER_TUNE = 22
    SERVO_RESET = 23
    SERVO_PLACE = 24
    HEATER_GAIN = 25
    SERVO_GAIN = 26
    SERVO_HOME = 27
    MOVE = 28
    MOVES_CONTROL = 29
    SERVO_TUNE = 30


class MovesControl(enum.IntEnum):
    """``index`` of MOVES_CONTROL."""

    HOLD = 0
    RESUME = 1
    FEED = 2
    ABORT = 3
    STOP = 4


class Outcome(enum.IntEnum):
    """How a one-shot has ended."""

    DONE = 1
    FAILED = 2              # the device has refused it, or it certainly has not happened
    UNKNOWN = 3             # nobody knows if it has happened
    REFUSED = 4             # never sent: invalid, or not permitted now


def pack(number: int, operation: OneShot, index: int, mask: int, flags: int, values: Sequence[int],
         parameters: Sequence[float], fractions: Sequence[int]) -> bytes:
    """A one-shot as it is in the image. ValueError if a number does not fit."""
    if len(values) > VALUES or len(fractions) > VALUES or len(parameters) > PARAMETERS:
        raise ValueError(f"a one-shot has at most {VALUES} values and fractions, and {PARAMETERS} parameters")
    try:
        return _LAYOUT.pack(number, operation, index, mask, flags, *values, *[0] * (VALUES - len(values)),
                            *parameters, *[0.0] * (PARAMETERS - len(parameters)),
                            *fractions, *[0] * (VALUES - len(fractions)))
    except (struct.error, OverflowError) as error:
        raise ValueError(f"one-shot {operation.name}: {error}") from None


def outcome(results: bytes, number: int) -> Outcome | None:
    """Of the one-shot with this number, among the daemon's last ones; None: not yet, or too old."""
    found, _operation, code = _RESULT.unpack_from(results, number % RESULTS * RESULT_SIZE)
    return Outcome(code) if found == number and code else None
