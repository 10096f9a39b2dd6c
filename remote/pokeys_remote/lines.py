# SPDX-License-Identifier: GPL-2.0-or-later
"""The control socket, as both of its ends know it: JSON-RPC 2.0, a line for each request and each answer.

It is a unix stream socket without a file (an abstract one, see unix(7)): nothing of it is left over when a
proxy is killed, and nobody can move it away. Who may use it is judged by the user of the other end.
"""
from __future__ import annotations

import errno
import json
import socket
import struct
from typing import Any

LINE_MOST = 4096                        # bytes, with the newline
REFUSED = -32000                        # by the proxy; the other codes are those of JSON-RPC
TOO_LATE = -32001                       # what was waited for did not happen in time
BUSY = -32002                           # so many connections are open that this one is not taken; try again
_CREDENTIALS = struct.Struct("3i")      # struct ucred
BACKLOG = 128                           # connections that wait; more are refused


def address(name: str) -> str:
    """Of the proxy with this name."""
    return f"\0pokeys-remote/{name}"


def peer(connection: socket.socket) -> tuple[int, int]:
    """Process and user of the other end, when it connected or began to listen."""
    process, user, _ = _CREDENTIALS.unpack(
        connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size))
    return process, user


def listen(name: str) -> socket.socket:
    """Take the name. :class:`OSError` says who has it."""
    made = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK)
    try:
        made.bind(address(name))
        made.listen(BACKLOG)
    except OSError as error:
        made.close()
        raise OSError(f"a proxy with the name {name} runs already{_owner(name)}; --name gives this one another name"
                      if error.errno == errno.EADDRINUSE else str(error)) from None
    return made


def _owner(name: str) -> str:
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK) as asking:
            asking.connect(address(name))
            process, user = peer(asking)
            return f" (process {process} of user {user})"
    except OSError:
        return ""


def line(message: dict[str, Any]) -> bytes:
    """As it is sent."""
    return json.dumps({"jsonrpc": "2.0", **message}, separators=(",", ":")).encode() + b"\n"
