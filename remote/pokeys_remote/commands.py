# SPDX-License-Identifier: GPL-2.0-or-later
"""The commands for HAL files: each asks the proxy at its control socket, and ends.

A HAL file starts one such process for each line, so this imports little.
"""
from __future__ import annotations

import contextlib
import json
import socket
import time
from typing import Any

from . import lines

ANSWER_LIMIT = 5.0          # s that the proxy may take besides what it was asked to wait for
RETRY_PAUSE = 0.05          # s
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
                            left + (ANSWER_LIMIT if waits else 0.0))
            break
        except TimeoutError:
            raise Failed(f"{proxy} does not answer", late=True) from None
        except ConnectionRefusedError:
            raise NoProxy(f"there is no proxy with the name {proxy}; loadusr -W pokeys-remote starts it") from None
        except (EOFError, OSError) as error:
            if not waits:
                raise Failed(f"{proxy} failed meanwhile ({error}); see what it printed") from None
            if not left:
                raise Failed(f"{proxy} failed, and does not answer", late=True) from None
            time.sleep(min(left, RETRY_PAUSE))
    if "error" in answer:
        raise Failed(answer["error"]["message"], answer["error"]["code"] == lines.TOO_LATE)


def _asked(proxy: str, method: str, params: dict[str, Any], limit: float) -> dict[str, Any]:
    """The answer of a connection of its own."""
    end = time.monotonic() + limit
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asking:
        asking.settimeout(max(limit, RETRY_PAUSE))
        while True:
            try:
                asking.connect(lines.address(proxy))
                break
            except BlockingIOError:
                # so many others wait that the kernel takes no more
                if time.monotonic() >= end:
                    raise TimeoutError from None
                time.sleep(RETRY_PAUSE)
        # a proxy that refuses a connection does not read from it
        with contextlib.suppress(BrokenPipeError):
            asking.sendall(lines.line({"id": 1, "method": method, "params": params}))
        read = b""
        while not read.endswith(b"\n"):
            asking.settimeout(max(end - time.monotonic(), RETRY_PAUSE))
            data = asking.recv(lines.LINE_MOST)
            if not data:
                raise EOFError("it closed the connection")
            read += data
    answer: dict[str, Any] = json.loads(read)
    return answer
