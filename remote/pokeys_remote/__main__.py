# SPDX-License-Identifier: GPL-2.0-or-later
"""The command line of pokeys-remote(1), and its life."""
from __future__ import annotations

import argparse
import contextlib
import logging
import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import NoReturn

from pokeys._ini import Faults

from . import __version__, config
from .definition import component_name

PROGRAM = "pokeys-remote"
STATUS_FAILED, STATUS_USAGE, STATUS_CRASHED, STATUS_CONFIG = 1, 64, 70, 78      # sysexits.h
ENDING = signal.SIGTERM, signal.SIGINT
RESTART_PAUSE = 0.2         # s
RESTARTS_MOST, RESTARTS_TIME = 5, 30.0      # so often within so many s
_LOG = logging.getLogger(PROGRAM)


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        print(f"{PROGRAM}: {message}; {PROGRAM} --help lists the options", file=sys.stderr)
        sys.exit(STATUS_USAGE)


def _options(words: list[str]) -> argparse.Namespace:
    parser = _Parser(prog=PROGRAM, allow_abbrev=False, description=(
        "Components of LinuxCNC's HAL whose code runs elsewhere: clients of machinekit's protocol create them, set "
        "their outputs and watch their inputs. Start it with loadusr -W pokeys-remote in a HAL file."))
    parser.add_argument("--config", type=Path, metavar="FILE", help="addresses, failsafe values and leases; without "
                        "it, clients of this computer may create components")
    parser.add_argument("--check-config", action="store_true", help="say what is wrong with the configuration, and end")
    parser.add_argument("--name", default=PROGRAM, help=f"of the proxy's own component in HAL ({PROGRAM})")
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    found = parser.parse_args(words)
    try:
        component_name(found.name)
    except ValueError as error:
        parser.error(f'--name: "{found.name}" is not allowed; allowed: {error}')
    return found


def _serve(name: str, settings: config.Config, brief: bool) -> int:
    """One life of the proxy; its exit status. A ``brief`` one gives outputs their failsafe values and ends."""
    # here, so that the process that watches this one has nothing of HAL
    from . import halsession, proxy
    ending: list[int] = []

    def end(number: int, _frame: FrameType | None) -> None:
        ending.append(number)
    for number in ENDING:
        signal.signal(number, end)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
    try:
        session = halsession.Hal(name)
    except halsession.HalError as error:
        _LOG.error("%s", error)
        return STATUS_FAILED
    served = None
    try:
        served = proxy.Proxy(settings, session)
        served.begin()
        session.ready()
        served.run(lambda: brief or bool(ending))
    except halsession.NoHal as error:
        _LOG.info("%s", error)
    except OSError as error:
        _LOG.error("%s", error)
        return STATUS_FAILED
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


def main(words: list[str] | None = None) -> int:
    """The program; its exit status."""
    options = _options(sys.argv[1:] if words is None else words)
    logging.basicConfig(level=logging.INFO, format=f"{PROGRAM}: %(message)s")
    try:
        settings = config.read(options.config)
    except Faults as faults:
        for line in faults.lines:
            print(f"{PROGRAM}: {line}", file=sys.stderr)
        return STATUS_CONFIG
    if options.check_config:
        print(f"{PROGRAM}: {options.config} is valid" if options.config else f"{PROGRAM}: no --config; defaults apply")
        return 0
    return _Watch(lambda brief: _serve(options.name, settings, brief)).run()


if __name__ == "__main__":
    sys.exit(main())
