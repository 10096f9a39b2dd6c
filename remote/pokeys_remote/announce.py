# SPDX-License-Identifier: GPL-2.0-or-later
"""Announces the sockets of the network over mDNS (RFC 6762, 6763), as machinekit's clients look for them.

The library has threads and timers of its own, and waits; so this is a process of its own, which ends when its
standard input does.
"""
from __future__ import annotations

import json
import logging
import re
import signal
import socket
import subprocess
import sys
from dataclasses import dataclass, field
from typing import Any

from . import beside

TYPE = "_machinekit._tcp.local."
LABEL_MOST = 63             # bytes of a name's part
_PLACE = re.compile(r"tcp://(?:\[([^]]+)\]|([^:]+)):(\d+)")
_LOG = logging.getLogger("pokeys-remote")


@dataclass(eq=False)
class Announcer:
    """The process that announces, from the proxy's side."""

    _process: subprocess.Popen[bytes] | None = field(default=None)

    def begin(self, name: str, uuid: str, places: dict[str, tuple[str, ...]]) -> None:
        """Announce places by the name of the service, such as "halrcmd". Never waits."""
        said = json.dumps({"name": name, "uuid": uuid, "places": places}).encode() + b"\n"
        try:
            self._process = beside.start("announce", stdin=subprocess.PIPE)
            assert self._process.stdin
            # less than what a pipe takes without a reader
            self._process.stdin.write(said)
            self._process.stdin.flush()
        except OSError as error:
            _LOG.error("the proxy is not announced: %s", error)

    def close(self) -> None:
        """It takes the announcement back, and ends."""
        if self._process and self._process.stdin:
            self._process.stdin.close()


def services(name: str, uuid: str, places: dict[str, list[str]]) -> list[dict[str, Any]]:
    """What is announced: the arguments of zeroconf.ServiceInfo, one for each address."""
    host = socket.gethostname().partition(".")[0]
    found = []
    for service, endpoints in places.items():
        for number, place in enumerate(endpoints):
            parts = _PLACE.fullmatch(place)
            assert parts, place
            address = (parts[1] or parts[2]).partition("%")[0]
            again = f" {number + 1}" if number else ""
            label = f"{name} {service}{again} on {host}".encode()[:LABEL_MOST].decode(errors="ignore")
            found.append({
                "type_": TYPE, "name": f"{label}.{TYPE}", "port": int(parts[3]), "parsed_addresses": [address],
                "server": f"{name}-{host}.local.",
                "properties": {"service": service, "dsn": place, "uuid": uuid, "instance": uuid, "version": "1"}})
    return found


def main() -> int:
    """Announce what the first line of standard input says, until its end."""
    logging.basicConfig(level=logging.INFO, format="pokeys-remote: %(message)s")
    signal.signal(signal.SIGINT, signal.SIG_IGN)        # of a terminal, for the proxy
    line = sys.stdin.readline()
    if not line:
        return 0
    try:
        from zeroconf import Error, ServiceInfo, Zeroconf
    except ImportError as error:
        _LOG.error("the proxy is not announced: %s (Debian: python3-zeroconf)", error)
        return 1
    infos = [ServiceInfo(**arguments) for arguments in services(**json.loads(line))]
    addresses = sorted({address for info in infos for address in info.parsed_addresses()})
    try:
        with_network = Zeroconf(interfaces=addresses)
        for info in infos:
            with_network.register_service(info, allow_name_change=True)
        _LOG.info("announced over mDNS at %s", ", ".join(addresses))
        # the proxy's end is the end of this
        sys.stdin.read()
        with_network.close()
    except (OSError, Error) as error:
        _LOG.error("the proxy is not announced: %s", error)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
