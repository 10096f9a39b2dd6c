# SPDX-License-Identifier: GPL-2.0-or-later
"""What must hold on every machine, however busy: nothing moves without permission, and no
output stays on in the safe state.

Write such assertions under `with safety():`, and read what they compare before it. If one
fails, the test ends with status 3, and ./run test does not run it again, because one such
failure is too many. The line on standard error counts even if the test does not reach its end.
"""
import contextlib
import sys

FAILED, UNSAFE = 1, 3
WORD = "UNSAFE: "


class Unsafe(AssertionError):
    """A safety assertion that failed."""


@contextlib.contextmanager
def safety():
    try:
        yield
    except AssertionError as fault:
        print(f"{WORD}{fault}", file=sys.stderr, flush=True)
        raise Unsafe(f"{WORD}{fault}") from fault


def status(faults):
    """The exit status of a test program after these exceptions."""
    if any(isinstance(fault, Unsafe) for fault in faults):
        return UNSAFE
    return FAILED if faults else 0
