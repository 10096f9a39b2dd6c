# SPDX-License-Identifier: MIT
"""How a value is read from an image.

Each value is a descriptor in a class that represents a part of an image. An object of the
class knows the number in the name: ``state.encoder[3].rawcounts`` is the value ``rawcounts``
of the object for encoder 3. The classes are in ``_names.py``, which is generated.
"""
from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Sequence
from typing import Any, Generic, Protocol, TypeVar, overload

from ._library import percentile

T = TypeVar("T")
HISTOGRAM_SIZE = 8 * (4 + 104)
AHEAD_MOST_NS = 1_000_000
BITS_EACH = 8       # of a part that has numbered bits


class Image(Protocol):
    """What a value is taken from."""

    @property
    def image(self) -> bytes | bytearray:
        """The bytes of the image."""

    @property
    def now_ns(self) -> int:
        """When they were read (CLOCK_MONOTONIC)."""


class Draft:
    """A command image that is being made."""

    now_ns = 0

    def __init__(self, size: int, whole: int) -> None:
        self.image = bytearray(size)
        self.whole = whole      # of which duties are a part

    def change(self, values: Sequence[tuple[Writable[Any], int, Any]]) -> None:
        """Command these values, each with its number, from now on; all of them or none."""
        raise NotImplementedError


def age_ns(t_ns: int, now_ns: int) -> float:
    """Nanoseconds since a time stamp; infinite if it is 0 or in the future.

    Clock readings of two processors may differ a little, so the age is 0 up to 1 ms ahead.
    The rule is that of pokeys_age_ns() in <pokeys/state.h>.
    """
    if t_ns == 0 or t_ns > now_ns + AHEAD_MOST_NS:
        return math.inf
    return max(0, now_ns - t_ns)


class Part:
    """A part of an image: all values whose names begin in the same way."""

    __slots__ = ("_image", "_index")

    def __init__(self, image: Image, index: int = 0) -> None:
        self._image = image
        self._index = index


P = TypeVar("P", bound=Part)


class Parts(Part, Generic[P]):
    """Numbered parts, from 0 as in HAL. Not a Sequence, because a value may be named like a method of it."""

    __slots__ = ()
    _kind: type[P]
    _count: int

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> P:
        if not 0 <= index < self._count:
            raise IndexError(f"{index}: there are 0 to {self._count - 1}")
        return self._kind(self._image, index)

    def __iter__(self) -> Iterator[P]:
        return (self._kind(self._image, i) for i in range(self._count))


class Value(Generic[T]):
    """One value of a part. Accessed through the class, it is the description of the value."""

    __slots__ = ("count", "help", "name", "offset", "stride", "unit")

    def __init__(self, name: str, count: int, place: tuple[int, int], text: str, unit: str = "",
                 **more: Any) -> None:
        self.name = name        # as in HAL, with %02u where a number stands
        self.count = count
        self.offset, self.stride = place
        self.help = text
        self.unit = unit
        for key, value in more.items():
            setattr(self, key, value)

    def names(self) -> Iterator[str]:
        """The name for each number."""
        return (self.named(i) for i in range(self.count))

    def named(self, index: int) -> str:
        """The name for one number."""
        numbers = self.name.count("%")
        return self.name % ((index,) if numbers == 1 else divmod(index, BITS_EACH) if numbers else ())

    def take(self, image: Image, index: int) -> T:
        """The value of this number."""
        raise NotImplementedError

    @overload
    def __get__(self, part: None, owner: type[Part]) -> Value[T]: ...

    @overload
    def __get__(self, part: Part, owner: type[Part]) -> T: ...

    def __get__(self, part: Part | None, owner: type[Part]) -> Value[T] | T:
        if part is None:
            return self
        return self.take(part._image, part._index)  # pylint: disable=protected-access


class Bit(Value[bool]):
    """One bit; offset and stride are in bits."""

    __slots__ = ()

    def take(self, image: Image, index: int) -> bool:
        bit = self.offset + self.stride * index
        return image.image[bit >> 3] >> (bit & 7) & 1 == 1


class Bits(Part):
    """Numbered bits within a numbered part."""

    __slots__ = ()
    _bit: Bit
    _count: int

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> bool:
        if not 0 <= index < self._count:
            raise IndexError(f"{index}: there are 0 to {self._count - 1}")
        return type(self)._bit.take(self._image, self._index * self._count + index)

    def __iter__(self) -> Iterator[bool]:
        return (self[i] for i in range(self._count))


class Flag(Value[bool]):
    """A byte that is not 0."""

    __slots__ = ()

    def take(self, image: Image, index: int) -> bool:
        return image.image[self.offset + self.stride * index] != 0


class Stored(Value[T]):
    """A number of the image, by its code of struct."""

    __slots__ = ("code", "unpack")

    def __init__(self, name: str, count: int, place: tuple[int, int], text: str, unit: str = "", *,
                 code: str = "Q", **more: Any) -> None:
        super().__init__(name, count, place, text, unit, **more)
        self.code = code
        self.unpack = struct.Struct("<" + code).unpack_from

    def stored(self, image: Image, index: int) -> Any:
        """The number as stored in the image."""
        return self.unpack(image.image, self.offset + self.stride * index)[0]

    def shown(self, stored: Any, image: Image) -> T:
        """The value that this number represents."""
        raise NotImplementedError

    def take(self, image: Image, index: int) -> T:
        return self.shown(self.stored(image, index), image)


class Integer(Stored[int]):
    """A number that is shown as stored."""

    __slots__ = ()

    def take(self, image: Image, index: int) -> int:
        number: int = self.unpack(image.image, self.offset + self.stride * index)[0]
        return number

    def shown(self, stored: Any, image: Image) -> int:
        number: int = stored
        return number


class Word(Integer):
    """A number that stands for a word."""

    __slots__ = ("words",)
    words: dict[int, str]

    def word(self, number: int) -> str:
        """The word for a number."""
        return self.words.get(number, "unknown")


class Real(Stored[float]):
    """A number that is shown in another unit."""

    __slots__ = ("factor",)
    factor: float

    def shown(self, stored: Any, image: Image) -> float:
        number: float = stored * self.factor
        return number


class Measured(Stored[float | None]):
    """A floating-point number of the image; None = it is not finite."""

    __slots__ = ("factor",)
    factor: float

    def shown(self, stored: Any, image: Image) -> float | None:
        number: float = stored * self.factor
        return number if math.isfinite(number) else None


class Ratio(Stored[float]):
    """A number that is shown as a fraction of another number of the image."""

    __slots__ = ("whole",)
    whole: int

    def shown(self, stored: Any, image: Image) -> float:
        whole: int = struct.unpack_from("<I", image.image, self.whole)[0]
        number: float = stored / whole if whole else 0.0
        return number


class Age(Stored[float | None]):
    """The time since a time stamp; None = never."""

    __slots__ = ("factor",)
    factor: float

    def shown(self, stored: Any, image: Image) -> float | None:
        age = age_ns(stored, image.now_ns)
        return None if math.isinf(age) else age * self.factor


class Text(Value[str]):
    """Text of at most ``size`` bytes."""

    __slots__ = ("size",)
    size: int

    def take(self, image: Image, index: int) -> str:
        at = self.offset + self.stride * index
        return image.image[at:at + self.size].split(b"\0")[0].decode("latin-1")


class Address(Value[str | None]):
    """An IPv4 address; None = not known."""

    __slots__ = ()

    def take(self, image: Image, index: int) -> str | None:
        at = self.offset + self.stride * index
        address = image.image[at:at + 4]
        return ".".join(str(byte) for byte in reversed(address)) if any(address) else None


class Quantile(Value[float | None]):
    """A duration of a histogram; None = nothing was measured."""

    __slots__ = ("factor", "quantile")
    factor: float
    quantile: float

    def take(self, image: Image, index: int) -> float | None:
        histogram = bytes(image.image[self.offset:self.offset + HISTOGRAM_SIZE])
        if not any(histogram[:8]):
            return None
        return percentile(histogram, self.quantile) * self.factor


class Writable(Value[T]):
    """A value of a command image. Setting it commands it at once."""

    __slots__ = ()
    mask: tuple[int, int] | None        # the bit that says that it is commanded, and from one number to the next

    def put(self, image: bytearray, index: int, value: Any) -> None:
        """Write it; TypeError or ValueError if it cannot be."""
        raise NotImplementedError

    def enter(self, draft: Draft, index: int, value: Any) -> None:
        """Write it, and that it is commanded."""
        self.put(draft.image, index, value)
        if self.mask:
            bit = self.mask[0] + self.mask[1] * index
            draft.image[bit >> 3] |= 1 << (bit & 7)

    def __set__(self, part: Part, value: T) -> None:
        draft = part._image  # pylint: disable=protected-access
        assert isinstance(draft, Draft)
        draft.change([(self, part._index, value)])  # pylint: disable=protected-access


class Switch(Writable[bool], Bit):
    """A bit to be commanded."""

    __slots__ = ("mask",)

    def put(self, image: bytearray, index: int, value: Any) -> None:
        if not isinstance(value, bool):
            raise TypeError(f"{self.named(index)}: {value!r} is not True or False")
        bit = self.offset + self.stride * index
        image[bit >> 3] = image[bit >> 3] & ~(1 << (bit & 7)) | value << (bit & 7)


def _ranged(value: Any, kinds: tuple[type, ...], name: str, low: float, high: float) -> None:
    if type(value) not in kinds:
        raise TypeError(f"{name}: {value!r} is not a number of this kind")
    if not low <= value <= high:
        raise ValueError(f"{name}: {value!r} is out of range; allowed: {low:.15g} to {high:.15g}")


class Level(Writable[int], Integer):
    """An integer to be commanded."""

    __slots__ = ("high", "low", "mask")
    low: float
    high: float

    def put(self, image: bytearray, index: int, value: Any) -> None:
        _ranged(value, (int,), self.named(index), self.low, self.high)
        struct.pack_into("<" + self.code, image, self.offset + self.stride * index, value)


class Duty(Writable[float], Ratio):
    """A part of another number of the image, to be commanded."""

    __slots__ = ("high", "low", "mask")
    low: float
    high: float

    def enter(self, draft: Draft, index: int, value: Any) -> None:
        struct.pack_into("<I", draft.image, self.whole, draft.whole)
        super().enter(draft, index, value)

    def put(self, image: bytearray, index: int, value: Any) -> None:
        _ranged(value, (int, float), self.named(index), self.low, self.high)
        whole: int = struct.unpack_from("<I", image, self.whole)[0]
        struct.pack_into("<" + self.code, image, self.offset + self.stride * index, round(value * whole))


class Setpoint(Writable[float | None], Measured):
    """A floating-point number to be commanded."""

    __slots__ = ("high", "low", "mask")
    low: float
    high: float

    def put(self, image: bytearray, index: int, value: Any) -> None:
        _ranged(value, (int, float), self.named(index), self.low, self.high)
        struct.pack_into("<" + self.code, image, self.offset + self.stride * index, value)
