# SPDX-License-Identifier: GPL-2.0-or-later
"""The command line of pokeys-remote(1): the proxy, and the commands of HAL files."""
from __future__ import annotations

import argparse
import logging
import sys
from pathlib import Path
from typing import NoReturn

from . import __version__, commands
from .commands import PROGRAM
from .definition import Direction, Kind, component_name

STATUS_FAILED, STATUS_USAGE, STATUS_NO_PROXY, STATUS_LATE, STATUS_CONFIG = 1, 64, 69, 75, 78     # sysexits.h
SECONDS_MOST = 86400
OPTIONS = "--config", "--check-config", "--make-key", "--name", "--timeout", "--version", "--help"
COMMANDS = {
    "newcomp": ("begin a component of a HAL file", 10.0),
    "newpin": ("add a pin to a component that was begun", 10.0),
    "ready": ("put the component into HAL, with its pins", 10.0),
    "waitacquired": ("wait until a component is in HAL", 30.0),
    "waitbound": ("wait until a client receives its values", 30.0),
    "waitunbound": ("wait until no client receives its values", 30.0),
}


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        print(f"{PROGRAM}: {message}; {self.prog} --help lists what is allowed", file=sys.stderr)
        sys.exit(STATUS_USAGE)


def _seconds(text: str) -> float:
    try:
        if 0 <= (number := float(text)) <= SECONDS_MOST:
            return number
    except ValueError:
        pass
    raise argparse.ArgumentTypeError(f'"{text}" is not a number of seconds from 0 to {SECONDS_MOST}')


def _options(words: list[str]) -> argparse.Namespace:
    parser = _Parser(prog=PROGRAM, allow_abbrev=False, description=(
        "Components of LinuxCNC's HAL whose code runs elsewhere: clients of machinekit's protocol create them, set "
        "their outputs and watch their inputs. Start it with loadusr -W pokeys-remote in a HAL file. Other lines of "
        "the file can make components and wait for clients, with loadusr -w pokeys-remote COMMAND."))
    parser.add_argument("--config", type=Path, metavar="FILE", help="addresses, failsafe values and leases; without "
                        "it, clients of this computer may create components")
    parser.add_argument("--check-config", action="store_true", help="say what is wrong with the configuration, and end")
    parser.add_argument("--make-key", type=Path, metavar="NAME", help="make NAME.key and NAME.key_secret, keys "
                        "of a proxy or a client for encrypted connections, and end")
    parser.add_argument("--name", default=PROGRAM, help=f"of the proxy's own component in HAL ({PROGRAM})")
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    made = parser.add_subparsers(dest="command", metavar="COMMAND", title="commands, with a running proxy",
                                 description=f"{PROGRAM} COMMAND --help says more.")
    for name, (does, limit) in COMMANDS.items():
        one = made.add_parser(name, help=does, description=f"{does[0].upper()}{does[1:]}.", allow_abbrev=False)
        one.add_argument("component", metavar="COMPONENT")
        if name == "newpin":
            one.add_argument("pin", metavar="PIN", help="with the component's name, such as panel.start")
            one.add_argument("type", metavar="TYPE", choices=[kind.name.lower() for kind in Kind], help="%(choices)s")
            one.add_argument("direction", metavar="DIRECTION", choices=[way.name.lower() for way in Direction],
                             help="%(choices)s; a client sets an out pin")
        one.add_argument("--timeout", type=_seconds, default=limit, metavar="SECONDS", help=f"time limit ({limit:g})")
    # argparse would say that the word behind a mistyped option is no command
    if unknown := [word for word in words if word.startswith("--") and word.partition("=")[0] not in OPTIONS]:
        parser.error(f"there is no option {unknown[0]}")
    found = parser.parse_args(words)
    try:
        component_name(found.name)
    except ValueError as error:
        parser.error(f'--name: "{found.name}" is not allowed; allowed: {error}')
    if found.command and (found.config or found.check_config or found.make_key):
        parser.error(f"{found.command} reads no configuration; the proxy does")
    return found


def _command(options: argparse.Namespace) -> int:
    """One line of a HAL file; its exit status."""
    params = {key: value for key, value in vars(options).items() if key in ("component", "pin", "type", "direction")}
    try:
        commands.ask(options.name, options.command, params, options.timeout)
    except commands.Failed as failed:
        time = f"; waited for {options.timeout:g} s" if failed.late else ""
        print(f"{PROGRAM} {options.command}: {failed}{time}", file=sys.stderr)
        if isinstance(failed, commands.NoProxy):
            return STATUS_NO_PROXY
        return STATUS_LATE if failed.late else STATUS_FAILED
    return 0


def _make_key(path: Path) -> int:
    from . import keys
    try:
        public, secret = keys.make(path)
    except OSError as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return STATUS_FAILED
    print(f"{PROGRAM}: {secret} is secret and stays where it is used; {public} is for the other side")
    return 0


def main(words: list[str] | None = None) -> int:
    """The program; its exit status."""
    options = _options(sys.argv[1:] if words is None else words)
    if options.command:
        return _command(options)
    # the commands need nothing of this, and have to be quick
    from pokeys._ini import Faults

    from . import config, life
    if options.make_key:
        return _make_key(options.make_key)
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
    return life.live(options.name, settings)


if __name__ == "__main__":
    sys.exit(main())
