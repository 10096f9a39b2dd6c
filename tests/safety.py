# SPDX-License-Identifier: GPL-2.0-or-later
"""What must hold on every machine, however busy: nothing moves without a permission, no
output stays on in the safe state.

An assertion of that kind stands under `with safety():`. If it fails, its test ends with a
status of its own, and ./run test does not run it again: once is once too often.
"""
import contextlib

FAILED, UNSAFE = 1, 3


class Unsafe(AssertionError):
    """A safety assertion that failed."""


@contextlib.contextmanager
def safety():
    try:
        yield
    except AssertionError as fault:
        raise Unsafe(f"UNSAFE: {fault}") from fault


def status(faults):
    """What a test program ends with after these exceptions."""
    if any(isinstance(fault, Unsafe) for fault in faults):
        return UNSAFE
    return FAILED if faults else 0
