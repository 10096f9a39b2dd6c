# SPDX-License-Identifier: GPL-2.0-or-later
"""The commands for HAL files: each asks the proxy at its control socket, and ends.

A HAL file starts one such process for each line, so this imports little.
"""
from __future__ import annotations

import contextlib
import json
import os
import socket
import time
from typing import Any

from . import lines

ANSWER_LIMIT = 5.0          # s that the proxy may take besides what it was asked to wait for
ANSWER_MOST = 1 << 16       # bytes
RETRY_PAUSE = 0.05          # s
PROGRAM = "pokeys-remote"   # and the proxy's name unless it has another one
WAITS = "waitacquired", "waitbound", "waitunbound"


class Failed(Exception):
    """The command did not do its work. :attr:`late` if only the time is over."""

    def __init__(self, text: str, late: bool = False) -> None:
        super().__init__(text)
        self.late = late


class NoProxy(Failed):
    """There is none."""


def ask(proxy: str, method: str, params: dict[str, Any], limit: float) -> None:
    """Until the proxy has done it, for ``limit`` s at most. :class:`Failed`.

    A proxy that fails starts again. Who waits goes on waiting; what else was asked for may have been done or not.
    """
    waits = method in WAITS
    end = time.monotonic() + limit
    while True:
        left = max(0.0, end - time.monotonic())
        try:
            answer = _asked(proxy, method, {**params, "seconds": left} if waits else params,
                            left + ANSWER_LIMIT if waits else max(left, RETRY_PAUSE))
            if answer.get("result") is True:
                return
            code, text = answer["error"]["code"], answer["error"]["message"]
        except TimeoutError:
            raise Failed(f"{proxy} does not answer", late=True) from None
        except ConnectionRefusedError:
            how = f"-W {PROGRAM}" if proxy == PROGRAM else f"-Wn {proxy} {PROGRAM} --name {proxy}"
            raise NoProxy(f"there is no proxy with the name {proxy}; loadusr {how} starts it") from None
        except (EOFError, OSError) as error:
            if not waits:
                raise Failed(f"{proxy} failed meanwhile ({error}); see what it printed") from None
            if not left:
                raise Failed(f"{proxy} failed, and does not answer", late=True) from None
        except (ValueError, KeyError, TypeError, AttributeError):
            raise Failed(f"what {proxy} answers is no answer of a proxy of this version") from None
        else:
            if code != lines.BUSY or not left:
                raise Failed(text, code in (lines.TOO_LATE, lines.BUSY))
        time.sleep(min(left, RETRY_PAUSE))


def _asked(proxy: str, method: str, params: dict[str, Any], limit: float) -> dict[str, Any]:
    """The answer of a connection of its own. :class:`TimeoutError` after ``limit`` s."""
    end = time.monotonic() + limit

    def left() -> float:
        if (time_left := end - time.monotonic()) <= 0:
            raise TimeoutError
        return time_left
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asking:
        while True:
            try:
                asking.settimeout(left())
                asking.connect(lines.address(proxy))
                break
            except BlockingIOError:
                # so many others wait that the kernel takes no more
                time.sleep(min(left(), RETRY_PAUSE))
        _trust(proxy, asking)
        # a proxy that refuses a connection does not read from it
        with contextlib.suppress(BrokenPipeError):
            asking.sendall(lines.line({"id": 1, "method": method, "params": params}))
        read = b""
        while not read.endswith(b"\n"):
            if len(read) >= ANSWER_MOST:
                raise ValueError
            asking.settimeout(left())
            data = asking.recv(ANSWER_MOST)
            if not data:
                raise EOFError("it closed the connection")
            read += data
    answer: dict[str, Any] = json.loads(read)
    return answer


def _trust(proxy: str, asking: socket.socket) -> None:
    """Any user can take a name. :class:`Failed` if it was not root or our own user."""
    process, user = lines.peer(asking)
    if os.geteuid() not in (0, user) and user != 0:
        raise Failed(f"process {process} of user {user} answers with the name {proxy}, and is not trusted; the proxy "
                     f"has to be of user {os.geteuid()} or root")
