# SPDX-License-Identifier: GPL-2.0-or-later
"""The names of a device's values, and which terminal of the board each belongs to.

Nothing is listed here: the one table of names is that of pokeysctl (names.json), and doors go by
it. They know no device.
"""
from __future__ import annotations

import json
import os
import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

FIRST_ANALOG = 41
PATIENCE_S = 30


class NoNames(Exception):
    """Why there is no table of names."""


@dataclass(frozen=True)
class Row:
    """What names.json says of one name."""

    name: str
    type: str
    unit: str
    help: str
    writable: bool
    diagnostic: bool        # of the counters and latencies, not of the device's state
    kind: str       # of its terminal: "pin", "analog", "pwm", "output", or ""
    number: int     # the first number in it, -1 = none
    words: dict[int, str]       # what its numbers mean; empty = it is not a code


def _expand(row: dict[str, Any]) -> Iterator[Row]:
    pattern = str(row["name"])
    inner = row.get("inner") or 1
    words = {int(number): word for number, word in (row.get("words") or {}).items()}
    for i in range(row["count"]):
        for j in range(inner):
            name = pattern % ((i, j) if pattern.count("%") == 2 else (i,) if "%" in pattern else ())
            yield Row(name, row["type"], row["unit"], row["help"], row["writable"],
                      row["image"] == "diag", row.get("terminal") or "", i if "%" in pattern else -1, words)


class Model:
    """All names, by name, and the boards."""

    def __init__(self, document: dict[str, Any]) -> None:
        self._parts = document["names"]
        self.rows = {row.name: row for part in self._parts for row in _expand(part)}
        self._boards = {board["hardware"]: board for board in document["boards"]}

    def family(self, pattern: str) -> list[Row]:
        """The rows whose names fit, in the order of their numbers; NN stands for a number."""
        fits = re.compile(re.escape(pattern).replace("NN", r"\d\d")).fullmatch
        return [row for row in self.rows.values() if fits(row.name)]

    def patterns(self) -> Iterator[tuple[str, Row]]:
        """The names with %02u for numbers, and the first row of each."""
        for part in self._parts:
            yield part["name"], next(_expand(part))

    def terminal(self, row: Row, hardware: int) -> str:
        """The number of a value's terminal as the board has it printed; "" if it has none."""
        if row.kind == "pin":
            return str(row.number + 1)
        if row.kind == "analog":
            return str(row.number + FIRST_ANALOG)
        if row.kind == "pwm":
            channels = self._board(hardware).get("pwm", [])
            return str(channels[row.number]) if row.number < len(channels) and channels[row.number] else ""
        return ""

    def label(self, row: Row, hardware: int) -> str:
        """What is printed beside the terminal, such as OC1; "" if nothing is known."""
        board = self._board(hardware)
        if row.kind == "output":
            outputs = board.get("outputs", [])
            return str(outputs[row.number]) if row.number < len(outputs) else ""
        return str(board.get("labels", {}).get(self.terminal(row, hardware), ""))

    def _board(self, hardware: int) -> dict[str, Any]:
        found: dict[str, Any] = self._boards.get(hardware, {})
        return found


def program() -> str:
    """The pokeysctl to run: $POKEYSCTL, or the one of $PATH."""
    return os.environ.get("POKEYSCTL", "pokeysctl")


def load() -> Model:
    """The names that this version of pokeysd has. Blocks for some milliseconds. :class:`NoNames`."""
    try:
        ran = subprocess.run([program(), "names", "--json"], capture_output=True, text=True, timeout=PATIENCE_S,
                             check=True)
        return Model(json.loads(ran.stdout))
    except OSError as error:
        raise NoNames(f"{program()}: {error.strerror}; install pokeys-tools, or set POKEYSCTL to its path") from error
    except (subprocess.SubprocessError, ValueError, LookupError) as error:
        raise NoNames(f"{program()} names --json: {error}; install pokeysd and the gateway of one version") from error
