# SPDX-License-Identifier: GPL-2.0-or-later
"""Work that may wait for a disk, aside from the event loop.

The threads of asyncio.to_thread() are few, and shared with log-ins, metrics and the search for devices;
and a process waits for them when it ends. A disk that does not answer must hold up none of these, so each
piece of work gets a thread of its own, for which nobody waits at the end. Whoever uses this limits how many
there are.
"""
from __future__ import annotations

import asyncio
import contextlib
import errno
import threading
from collections.abc import Callable
from typing import Any, TypeVar

Result = TypeVar("Result")


class Few:
    """So many pieces of work at once; the next one is refused, as a disk that does not answer would have them all."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._under_way = 0
        self._lock = threading.Lock()

    def __call__(self, work: Callable[..., Result], *arguments: Any) -> asyncio.Future[Result]:
        """As :func:`aside`. OSError if there are too many."""
        with self._lock:
            if self._under_way >= self._most:
                raise OSError(errno.EBUSY, "the disk has too much to do; try again later")
            self._under_way += 1

        def whole() -> Result:
            try:
                return work(*arguments)
            finally:
                # also if nobody waits for it any more
                with self._lock:
                    self._under_way -= 1
        return aside(whole)


def aside(work: Callable[..., Result], *arguments: Any) -> asyncio.Future[Result]:
    """The result of work in a thread of its own. If nobody waits for it any more, it goes on all the same."""
    loop = asyncio.get_running_loop()
    done: asyncio.Future[Result] = loop.create_future()

    def finish(result: Result | None, error: BaseException | None) -> None:
        if done.done():
            return
        if error:
            done.set_exception(error)
        else:
            done.set_result(result)  # type: ignore[arg-type]

    def run() -> None:
        result, error = None, None
        try:
            result = work(*arguments)
        except BaseException as caught:  # pylint: disable=broad-exception-caught
            error = caught
        # the loop may have ended meanwhile
        with contextlib.suppress(RuntimeError):
            loop.call_soon_threadsafe(finish, result, error)
    threading.Thread(target=run, name="aside", daemon=True).start()
    return done
