# SPDX-License-Identifier: GPL-2.0-or-later
"""The proxy's process, and the one that watches it.

The process that watches also has the control socket, so that who asks while the proxy starts again waits in it.
"""
from __future__ import annotations

import contextlib
import logging
import os
import resource
import signal
import socket
import time
from collections.abc import Callable
from types import FrameType

from . import lines
from .config import Config

STATUS_FAILED, STATUS_CRASHED = 1, 70       # sysexits.h
ENDING = signal.SIGTERM, signal.SIGINT
FILES = 65536
RESTART_PAUSE = 0.2         # s
RESTARTS_MOST, RESTARTS_TIME = 5, 30.0      # so often within so many s
_LOG = logging.getLogger("pokeys-remote")


def live(name: str, settings: Config) -> int:
    """Be the proxy with this name, until LinuxCNC or a signal ends it; the exit status."""
    try:
        listener = lines.listen(name)
    except OSError as error:
        _LOG.error("%s", error)
        return STATUS_FAILED
    with listener:
        return _Watch(lambda brief: _serve(name, settings, listener, brief)).run()


def _serve(name: str, settings: Config, listener: socket.socket, brief: bool) -> int:
    """One life of the proxy; its exit status. A ``brief`` one gives outputs their failsafe values and ends."""
    # here, so that the process that watches this one has nothing of HAL
    from . import halsession, proxy
    # whoever connects from now on learns of this process: the one that watches may be killed, and this one goes on
    listener.listen(lines.BACKLOG)
    ending: list[int] = []

    def end(number: int, _frame: FrameType | None) -> None:
        ending.append(number)
    for number in ENDING:
        signal.signal(number, end)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
    # connections of strangers, who are known only later, take files too
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most if most != resource.RLIM_INFINITY else FILES, most))
    try:
        session = halsession.Hal(name)
    except halsession.HalError as error:
        _LOG.error("%s", error)
        return STATUS_FAILED
    served = None
    try:
        served = proxy.Proxy(settings, session, listener)
        try:
            served.begin()
        except OSError as error:
            _LOG.error("%s", error)
            return STATUS_FAILED
        session.ready()
        served.run(lambda: brief or bool(ending))
    except halsession.NoHal as error:
        _LOG.info("%s", error)
    finally:
        if served:
            served.close()
        session.exit()
    return 0


class _Watch:
    """Begins the proxy, and begins it again if it is killed or crashes."""

    def __init__(self, serve: Callable[[bool], int]) -> None:
        self._serve = serve
        self._child = 0
        self._ending = False

    def _end(self, number: int, _frame: FrameType | None) -> None:
        self._ending = True
        if self._child:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self._child, number)

    def run(self) -> int:
        """Until the proxy ends by itself; its exit status."""
        for number in ENDING:
            signal.signal(number, self._end)
        begun: list[float] = []
        while True:
            begun = [one for one in begun if time.monotonic() - one < RESTARTS_TIME] + [time.monotonic()]
            gives_up = len(begun) > RESTARTS_MOST
            # after a proxy that failed, outputs have the values that it set: another one has to end well
            status = self._life(brief=gives_up or self._ending)
            if gives_up:
                _LOG.error("the proxy is not begun again after %d times in %.0f s", RESTARTS_MOST, RESTARTS_TIME)
                return STATUS_FAILED
            if os.WIFEXITED(status) and os.WEXITSTATUS(status) != STATUS_CRASHED:
                return os.WEXITSTATUS(status)
            killed = f"was killed by signal {os.WTERMSIG(status)}"
            _LOG.error("the proxy %s", killed if os.WIFSIGNALED(status) else "failed")
            time.sleep(RESTART_PAUSE)

    def _life(self, brief: bool) -> int:
        """A proxy in a process of its own; what waitpid() says of it."""
        # a signal waits until whom it is for is known, and in the child until there is a handler
        signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
        self._child = os.fork()
        if not self._child:
            os._exit(self._guarded(brief))
        signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
        _, status = os.waitpid(self._child, 0)
        self._child = 0
        return status

    def _guarded(self, brief: bool) -> int:
        try:
            status = self._serve(brief)
        except Exception:  # pylint: disable=broad-exception-caught
            _LOG.exception("this should not happen; please report it")
            status = STATUS_CRASHED
        logging.shutdown()
        return status
