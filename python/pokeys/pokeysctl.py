# SPDX-License-Identifier: MIT
"""Functions that run pokeysctl(1): search the network, show settings."""
from __future__ import annotations

import json
import logging
import os
import subprocess
from dataclasses import dataclass
from typing import Any

from .errors import ToolFailed

PATIENCE_S = 60
_LOG = logging.getLogger("pokeys")


@dataclass(frozen=True)
class Found:
    """A device that answered the search."""

    serial: int
    type: str
    hardware: int
    firmware: str
    address: str
    dhcp: bool
    user_id: int


def _ask(*words: str, patience: float = PATIENCE_S) -> Any:
    command = [os.environ.get("POKEYSCTL", "pokeysctl"), *words, "--json"]
    try:
        ran = subprocess.run(command, capture_output=True, text=True, timeout=patience, check=False)
    except OSError as error:
        why = f"{command[0]}: {error.strerror}; install pokeys-tools, or set POKEYSCTL to its path"
        raise ToolFailed(why) from error
    except subprocess.TimeoutExpired:
        raise ToolFailed(f"{command[0]} {words[0]}: no answer within {patience:g} s") from None
    try:
        answer = json.loads(ran.stdout)
    except ValueError:
        raise ToolFailed(ran.stderr.strip() or f"{command[0]} {words[0]}: status {ran.returncode}") from None
    # why nothing was found, or of when the answer is
    for line in ran.stderr.splitlines():
        _LOG.warning("%s", line)
    return answer


def discover(*, timeout: float = 0.5, interface: str | None = None) -> list[Found]:
    """Search the network for devices for ``timeout`` seconds; needs no daemon.

    Raises :class:`ToolFailed`. Blocks; in a coroutine, use
    ``await asyncio.to_thread(pokeys.discover)``.
    """
    words = ["discover", "--timeout", str(max(1, round(timeout * 1000)))]
    if interface:
        words += ["--interface", interface]
    rows = _ask(*words, patience=timeout + PATIENCE_S)["devices"]
    return [Found(**{key: row[key] for key in Found.__dataclass_fields__}) for row in rows]


def settings(device: str, runtime: str | None) -> dict[str, str | float | None]:
    """The settings of a device, by the keys of pokeysd.conf(5)."""
    words = ["config", "show", device]
    if runtime:
        words += ["--runtime-directory", runtime]
    found: dict[str, str | float | None] = _ask(*words)["settings"]
    return found
