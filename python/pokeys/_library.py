# SPDX-License-Identifier: MIT
"""libpokeys_shm, loaded once.

Reading an image takes less than a microsecond, so these functions are called with the
interpreter's lock held (PyDLL). That is faster, and it prevents two threads from reading
through one client at the same time, which the library forbids. Functions that may block are
called with the lock released (CDLL).
"""
from __future__ import annotations

import ctypes
import functools
import os
from ctypes import CDLL, PyDLL, c_char_p, c_double, c_int, c_size_t, c_uint, c_uint64, c_void_p
from typing import Any

from .errors import LibraryMissing

NAME_SIZE = 32
DEVICES_MOST = 64
DETACHED, ATTACHED, REFUSED = 0, 1, 2
COMMANDER = 1
OTHER_VERSION = "{} is of another version than this package; install pokeysd and the package of the same version"

_COLD: dict[str, list[Any]] = {
    "pokeys_client_open": [c_void_p, c_char_p, c_char_p, c_char_p, c_uint],
    "pokeys_client_close": [c_void_p],
    "pokeys_client_poll": [c_void_p],
    "pokeys_client_follow": [c_void_p, c_uint],
    "pokeys_client_hold": [c_void_p, c_uint, c_uint],
    "pokeys_client_command": [c_void_p, c_void_p],
    "pokeys_client_renew": [c_void_p],
    "pokeys_client_read_events": [c_void_p, c_void_p, c_void_p, c_size_t, c_size_t],
    "pokeys_client_status": [c_void_p, c_char_p, c_size_t],
    "pokeys_shm_devices": [c_char_p, c_void_p, c_size_t],
}
_FAST: dict[str, list[Any]] = {
    "pokeys_client_read": [c_void_p, c_void_p],
    "pokeys_client_read_diag": [c_void_p, c_void_p],
}
_NUMBERS: dict[str, list[Any]] = {
    "pokeys_histogram_percentile": [c_char_p, c_double],
    "pokeys_histogram_lower": [c_uint],
    "pokeys_shm_layout": [c_uint],
}


class Library:
    """The functions of libpokeys_shm, with their types."""

    def __init__(self, name: str) -> None:
        try:
            self.cold, self.fast = CDLL(name), PyDLL(name)
        except OSError as error:
            raise LibraryMissing(
                f"{error}; install pokeysd, or set POKEYS_SHM_LIBRARY to the path of the library "
                "(build/shm/libpokeys_shm.so.0 in a build tree)") from None
        self.name = name
        for library, prototypes, result in ((self.cold, _COLD, c_int), (self.fast, _FAST, c_int),
                                            (self.fast, _NUMBERS, c_uint64)):
            for function, arguments in prototypes.items():
                try:
                    found = getattr(library, function)
                except AttributeError:
                    raise LibraryMissing(OTHER_VERSION.format(name)) from None
                found.argtypes = arguments
                found.restype = result
        self.cold.pokeys_client_close.restype = None


@functools.cache
def library() -> Library:
    """The library: libpokeys_shm.so.0, or the file named by POKEYS_SHM_LIBRARY."""
    return Library(os.environ.get("POKEYS_SHM_LIBRARY", "libpokeys_shm.so.0"))


def check_layouts(known: dict[int, int]) -> None:
    """Refuse a library whose images have other layouts (hashes by number of the image)."""
    for number, layout in known.items():
        if library().fast.pokeys_shm_layout(number) != layout:
            raise LibraryMissing(OTHER_VERSION.format(library().name))


def percentile(histogram: bytes, part: float) -> int:
    """Nanoseconds below which this part (0..1) of a histogram's durations lies; 0 if it is empty."""
    return int(library().fast.pokeys_histogram_percentile(histogram, part))


def bucket_lower(bucket: int) -> int:
    """The shortest duration of a bucket, ns."""
    return int(library().fast.pokeys_histogram_lower(bucket))


def devices(runtime: str | None) -> list[str]:
    """Names of the devices of the running daemon; empty if there is none. OSError if refused."""
    names = (ctypes.c_char * NAME_SIZE * DEVICES_MOST)()
    count = library().cold.pokeys_shm_devices(runtime.encode() if runtime else None, names, DEVICES_MOST)
    if count < 0:
        raise OSError(-count, os.strerror(-count))
    return [names[i].value.decode() for i in range(min(count, DEVICES_MOST))]
