#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Write pokeys/_names.py, from names.json (pokeysctl names --json).

The output has a class for each part of a name, with a typed attribute for each value, so that
editors complete the names and mypy checks them. The names are HAL's: a dash becomes _, and a
Python keyword gets a trailing _ (state.pin[3].in_ is pin.03.in).

usage: generate.py names.json > pokeys/_names.py
"""
from __future__ import annotations

import json
import keyword
import pathlib
import sys
import textwrap
from typing import Any

HEADER = '''\
# SPDX-License-Identifier: MIT
"""The names of all values, as classes. Made by generate.py: do not edit."""
from __future__ import annotations

from typing import Any

from ._values import (
    Address,
    Age,
    Bit,
    Bits,
    Duty,
    Flag,
    Integer,
    Level,
    Measured,
    Part,
    Parts,
    Quantile,
    Ratio,
    Real,
    Setpoint,
    Switch,
    Text,
    Value,
    Word,
)
'''
SHORT, BITS_EACH = 80, 8
WRITABLE = {"Bit": "Switch", "Integer": "Level", "Ratio": "Duty", "Measured": "Setpoint"}
CODES = {("unsigned", 1): "B", ("unsigned", 2): "H", ("unsigned", 4): "I", ("unsigned", 8): "Q",
         ("signed", 2): "h", ("signed", 4): "i", ("signed", 8): "q", ("float", 4): "f", ("float", 8): "d"}


class Node:
    """What follows on one beginning of names."""

    def __init__(self, title: str, name: str) -> None:
        self.title = title                      # of the class
        self.name = name                        # as in HAL
        self.values: dict[str, str] = {}
        self.parts: dict[str, Node] = {}
        self.each: Node | None = None           # the numbered ones
        self.count = 0
        self.bit = ""                           # numbered bits

    def part(self, name: str) -> Node:
        """The node for the next word of a name."""
        if name not in self.parts:
            whole = f"{self.name}.{name}" if self.name else name
            self.parts[name] = Node(self.title + title_of(name), whole)
        return self.parts[name]

    def numbered(self, count: int) -> Node:
        """The node for the number behind this name."""
        if not self.each:
            self.each = Node(self.title + "Item", self.name + ".NN")
        self.count = max(self.count, count)
        return self.each


def title_of(name: str) -> str:
    return "".join(word[:1].upper() + word[1:] for word in name.split("-"))


def attribute_of(name: str) -> str:
    word = name.replace("-", "_")
    return word + "_" if keyword.iskeyword(word) else word


def quoted(text: str) -> str:
    return json.dumps(text)


def mask_of(row: dict[str, Any]) -> tuple[int, int] | None:
    """The bit that says that it is commanded, and from one number to the next."""
    return (8 * row["mask_offset"] + row["mask_bit"], row["mask_stride"]) if "mask_offset" in row else None


def value_of(row: dict[str, Any], name: str, offset: int, count: int | None = None) -> str:
    """The expression that makes the descriptor, on as many lines as it needs."""
    storage = row["storage"]
    more: list[str] = []
    kind = {"bit": "Bit", "flag": "Flag", "text": "Text", "ipv4": "Address", "timestamp": "Age",
            "histogram": "Quantile"}.get(storage, "Integer")
    if kind == "Integer":
        more.append(f"code={quoted(CODES[storage, row['size']])}")
        if "divisor_offset" in row:
            kind = "Ratio"
            more.append(f"whole={row['divisor_offset']}")
        elif "factor" in row or storage == "float":
            kind = "Measured" if storage == "float" else "Real"
            more.append(f"factor={row.get('factor', 1)!r}")
        elif "words" in row:
            kind = "Word"
            words = "".join(f"\n            {number}: {quoted(word)}," for number, word in row["words"].items())
            more.append(f"words={{{words}\n        }}")
    elif kind == "Text":
        more.append(f"size={row['size']}")
    elif kind in ("Age", "Quantile"):
        more.append(f"factor={row['factor']!r}")
        more += [f"quantile={row['quantile']!r}"] if kind == "Quantile" else []
    if row["writable"]:
        kind = WRITABLE[kind]
        more.append(f"mask={mask_of(row)}")
        if kind != "Switch":
            more.append(f"low={row['low']}, high={row['high']}")
    place = 8 * offset + row["bit"] if storage == "bit" else offset
    stride = row.get("inner_stride", row.get("stride", 0)) if count else row.get("stride", 0)
    text = textwrap.wrap(row["help"], 90, drop_whitespace=False)
    parts = [f"{quoted(name)}, {count or row['count']}, ({place}, {stride})",
             "\n        ".join(quoted(line) for line in text)]
    parts += [quoted(row["unit"])] if row["unit"] else []
    parts += more
    line = f"{kind}({', '.join(parts)})"
    if len(line) < SHORT and "\n" not in line:
        return line
    return f"{kind}(\n        {(',' + chr(10) + ' ' * 8).join(parts)})"


def add(root: Node, row: dict[str, Any]) -> list[str]:
    """Put a row's values to their places, which are returned."""
    node, words = root, row["name"].split(".")
    for word in words[:-1]:
        node = node.numbered(row["count"]) if word == "%02u" else node.part(word)
    last = words[-1]
    if last == "%02u":          # the second number: matrix.%02u.%02u
        assert row["inner"] == row["stride"] == BITS_EACH and row["inner_stride"] == 1, row
        node.count = row["inner"]
        node.bit = value_of(row, row["name"], row["offset"], row["count"] * row["inner"])
        return [f"{node.title}._bit"]
    if not last.endswith("%u"):
        node.values[attribute_of(last)] = value_of(row, row["name"], row["offset"])
        return [f"{node.title}.{attribute_of(last)}"]
    places = []
    for i in range(row["inner"]):
        attribute = attribute_of(last.removesuffix("%u") + str(i))
        node.values[attribute] = value_of(row, row["name"].removesuffix("%u") + str(i),
                                          row["offset"] + i * row["inner_stride"])
        places.append(f"{node.title}.{attribute}")
    return places


def class_of(node: Node) -> list[str]:
    """The classes of what follows, then its own."""
    lines: list[str] = []
    for part in [*node.parts.values(), *([node.each] if node.each else [])]:
        lines += class_of(part)
    base = f"Parts[{node.each.title}]" if node.each else "Bits" if node.bit else "Part"
    lines += ["", "", f"class {node.title}({base}):", f'    """{node.name or "All values of the image."}"""', "",
              "    __slots__ = ()"]
    if node.each:
        lines += [f"    _kind = {node.each.title}"]
    if node.count:
        lines += [f"    _count = {node.count}"]
    if node.bit:
        lines += [f"    _bit = {node.bit}"]
    lines += [f"    {attribute} = {value}" for attribute, value in node.values.items()]
    for name, part in node.parts.items():
        lines += ["", "    @property", f"    def {attribute_of(name)}(self) -> {part.title}:",
                  f'        """{part.name}"""', f"        return {part.title}(self._image, self._index)"]
    return lines


def main() -> None:
    model = json.loads(pathlib.Path(sys.argv[1]).read_text(encoding="ascii"))
    lines = HEADER.splitlines()
    for image, title in (("state", "State"), ("diag", "Diagnostic"), ("command", "Command")):
        known = model["images"][image]
        root, places = Node(title, ""), []
        for row in model["names"]:
            if row["image"] == image:
                places += add(root, row)
        root.title = title + "Values"
        lines += class_of(root)
        places = [place if place.split(".")[0] != title else root.title + "." + place.split(".")[1]
                  for place in places]
        offsets = [key for key in known if key.endswith("_offset")]
        if offsets:
            lines += ["", ""]
        lines += [f"{image.upper()}_{key.removesuffix('_offset').upper()} = {known[key]}" for key in offsets]
        lines += ["", "", f"{image.upper()}_HASH, {image.upper()}_SIZE = {known['hash']}, {known['size']}",
                  f"{image.upper()}_VALUES: tuple[Value[Any], ...] = ("]
        lines += textwrap.wrap(", ".join(places) + ")", 110, initial_indent=" " * 4, subsequent_indent=" " * 4)
    lines += ["", "", "BOARD_OUTPUTS: dict[int, tuple[str, ...]] = {"]
    lines += [f"    {board['hardware']}: ({', '.join(quoted(label) for label in board['outputs'])}),"
              for board in model["boards"] if board["outputs"]]
    lines += ["}"]
    print("\n".join(lines))


if __name__ == "__main__":
    main()
