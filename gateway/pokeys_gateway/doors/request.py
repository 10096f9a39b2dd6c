# SPDX-License-Identifier: GPL-2.0-or-later
"""What the parts of the JSON-RPC door share: errors, and how a request has come."""
from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import Any

PARSE_ERROR, INVALID_REQUEST, NO_METHOD, INVALID_PARAMS, INTERNAL = -32700, -32600, -32601, -32602, -32603
NO_DEVICE, TOO_MUCH, NOT_ALLOWED, NOT_DONE = -32001, -32002, -32003, -32004
# between pings to clients that may operate, and the age that a command of theirs may have
BEAT_S, AGE_MOST_S = 0.4, 1.5
SHOWN = 80                  # characters of a client's text in an error
TOO_OLD = f"this may have been on its way for more than {AGE_MOST_S:g} s; send it again"


class RpcError(Exception):
    """The error of an answer."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


@dataclass(frozen=True)
class Way:
    """How a request that operates LinuxCNC came."""

    until: float                # when it is too old
    turn: int                   # how many stops came before it
    stop: asyncio.Future[None] | None = None    # the last stop before it in a batch, or itself
    stops: int = 0              # of the console, that came before it


def only(params: dict[str, Any], *known: str) -> None:
    """:class:`RpcError` for a parameter that is none of these."""
    unknown = [name for name in params if name not in known]
    if unknown:
        has = f"there are: {', '.join(known)}" if known else "there are none"
        raise RpcError(INVALID_PARAMS, f"there is no parameter {unknown[0][:SHOWN]}; {has}")
