#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""What the realtime loop is made of can neither allocate, lock, print nor block.

The rooms below daemon/rt are pure by design; this looks at what their objects
ask the C library for. A function that is not on the list fails the test: add it
only if it is bounded, and neither allocates nor makes a system call.
Arguments: nm, then the static libraries.
"""
import subprocess
import sys

PURE = {
    "memcpy", "memset", "memmove", "memcmp", "bcmp", "strlen", "strnlen", "strncmp", "__stack_chk_fail",
    "lround", "lrint", "llround", "llrint", "floor", "ceil", "fabs", "sqrt", "sqrtf", "round", "roundf",
    "rint", "nearbyint", "trunc", "fmod", "lroundf", "fabsf", "fmin", "fmax", "log", "_GLOBAL_OFFSET_TABLE_",
}
# cold functions that share a room with realtime ones: texts for people
COLD = {"event_text.c": {"snprintf", "vsnprintf", "__vsnprintf_chk", "strerror", "terminal_list",
                         "terminal_owner_name"},
        "event_text_loop.c": {"vsnprintf", "__vsnprintf_chk"}}


def symbols(nm, library):
    """(object, symbol, kind) of each line of nm -A: lib.a:dir_object.c.o:[address] kind symbol."""
    out = subprocess.run([nm, "-A", library], capture_output=True, text=True, check=True).stdout
    for line in out.splitlines():
        _, obj, rest = line.split(":", 2)
        *_, kind, symbol = rest.split()
        yield obj.removesuffix(".o").split("/")[-1], symbol, kind


def is_cold(obj, symbol):
    """Whether this object may ask for it; the build puts folders before its name."""
    return any(obj.endswith(name) and symbol in allowed for name, allowed in COLD.items())


def main():
    nm, libraries = sys.argv[1], sys.argv[2:]
    every = [entry for library in libraries for entry in symbols(nm, library)]
    defined = {symbol for _, symbol, kind in every if kind not in "Uw"}
    wanted = [(obj, symbol) for obj, symbol, kind in every if kind in "Uw" and symbol not in defined]
    faults = sorted({f"{obj} calls {symbol}" for obj, symbol in wanted
                     if symbol not in PURE and not is_cold(obj, symbol)})
    print("\n".join(faults) or f"{len(every)} symbols of {len(libraries)} libraries are pure")
    return 1 if faults or not every else 0


if __name__ == "__main__":
    sys.exit(main())
