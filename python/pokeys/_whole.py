# SPDX-License-Identifier: MIT
"""All values of an image at once.

Reading the 1,700 values of a state one by one takes about a millisecond. Therefore all
numbers and flags are unpacked in one call, in the order of the image, and all bits are looked
up in a table by their byte. Only computed values are read one by one.
"""
from __future__ import annotations

import struct
from collections.abc import Iterable
from itertools import chain
from operator import itemgetter
from typing import Any

from ._values import AHEAD_MOST_NS, Age, Bit, Flag, Image, Integer, Real, Stored, Value

_BITS = [tuple(byte >> i & 1 == 1 for i in range(8)) for byte in range(256)]
_SIZES = {code: struct.calcsize("<" + code) for code in "?BHIQhiqfd"}


class Whole:
    """How a dict of all values is made of an image of this size; names ``before`` are the caller's."""

    def __init__(self, values: tuple[Value[Any], ...], size: int, before: Iterable[str] = ()) -> None:
        fields: dict[int, tuple[str, str]] = {}         # by place: code and name
        bits: dict[int, str] = {}                       # by bit: name
        self._scaled: list[tuple[str, float]] = []                  # by its factor
        self._ages: list[tuple[str, float]] = []
        self._computed: list[tuple[str, Stored[Any]]] = []          # in another way
        self._single: list[tuple[str, Value[Any], int]] = []        # taken by itself
        for value in values:
            code = "?" if isinstance(value, Flag) else value.code if isinstance(value, Stored) else ""
            for i, name in enumerate(value.names()):
                at = value.offset + value.stride * i
                if isinstance(value, Bit):
                    if at in bits:
                        self._single.append((name, value, i))
                    bits.setdefault(at, name)
                elif not code or at in fields:
                    self._single.append((name, value, i))
                else:
                    fields[at] = code, name
                    self._note(name, value)
        self._unpack = struct.Struct(self._format(fields, size)).unpack
        used = sorted({bit // 8 for bit in bits})
        place = {byte: 8 * i for i, byte in enumerate(used)}
        self._bytes = itemgetter(*used) if used else None
        self._bits = itemgetter(*(place[bit // 8] + bit % 8 for bit in sorted(bits))) if used else None
        self._keys = [fields[at][1] for at in sorted(fields)] + [bits[bit] for bit in sorted(bits)]
        # every dict is a copy of this one, so the names are in the order of the table
        self._template: dict[str, Any] = dict.fromkeys(
            chain(before, chain.from_iterable(value.names() for value in values)))

    def _note(self, name: str, value: Value[Any]) -> None:
        """What is to be done with the number of this name."""
        if isinstance(value, Age):
            self._ages.append((name, value.factor))
        elif isinstance(value, Real):
            self._scaled.append((name, value.factor))
        elif isinstance(value, Stored) and not isinstance(value, Integer):
            self._computed.append((name, value))

    @staticmethod
    def _format(fields: dict[int, tuple[str, str]], size: int) -> str:
        text, end = "<", 0
        for at in sorted(fields):
            code = fields[at][0]
            assert at >= end, fields[at]
            text += f"{at - end}x{code}"
            end = at + _SIZES[code]
        return text + f"{size - end}x"

    def take(self, image: Image) -> dict[str, Any]:
        """The values by their names; None = not known."""
        numbers = self._unpack(image.image)
        taken = self._template.copy()
        if self._bytes and self._bits:
            bits = self._bits(tuple(chain.from_iterable(map(_BITS.__getitem__, self._bytes(image.image)))))
            taken.update(zip(self._keys, chain(numbers, bits), strict=True))
        else:
            taken.update(zip(self._keys, numbers, strict=True))
        for name, factor in self._scaled:
            taken[name] *= factor
        now, soonest = image.now_ns, image.now_ns + AHEAD_MOST_NS
        for name, factor in self._ages:
            then = taken[name]
            taken[name] = max(0, now - then) * factor if 0 < then <= soonest else None
        for name, value in self._computed:
            taken[name] = value.shown(taken[name], image)
        for name, single, i in self._single:
            taken[name] = single.take(image, i)
        return taken
