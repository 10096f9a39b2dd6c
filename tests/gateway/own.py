#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The console whose machine is the gateway itself, beside a daemon with a device: over telnet and over HTTP."""
import json
import re
import sys
import types
import urllib.error
import urllib.parse
import urllib.request

from bridge import PAGES, PORT, Telnet
from house import PATIENCE, free_address, main, wait_for
from rig import machine


def until_ok(one):
    """The lines of an answer."""
    found = []
    while (line := one.line()) != "ok":
        found.append(line)
    return found


def test_it_shows_the_device():
    where = free_address()
    more = f"[machine]\nkind = pokeys\n[telnet]\nlisten = {where}:{PORT}\n[esp3d]\nlisten = {where}:{PAGES}\n" \
        "[console]\nlevel = user\n"
    with machine(more=more) as (house, sim, _daemon, _gateway):
        one = Telnet(types.SimpleNamespace(console=where))

        def status():
            one.send(b"?\n")
            return until_ok(one)

        def command(text):
            with urllib.request.urlopen(f"http://{where}:{PAGES}/command?cmd={urllib.parse.quote(text)}",
                                        timeout=PATIENCE) as answer:
                return answer.read().decode()
        assert re.fullmatch(r"echo:mill: connected, inputs \d+\.\d ms old, motion not permitted, safe state", status()[0]), status()
        assert status()[1:] == [f"echo:mill: axes at {', '.join('0' * 8)} pulses"], status()
        # over HTTP the answer is that of the request, and only that
        assert re.fullmatch(r"echo:mill: connected, .*\nok\n", command("?"), re.S), command("?")
        assert command("G999") == 'echo:Unknown command: "G999"; M115 lists what there is\nok\n'
        assert command("M105") == "ok\n"
        shown = {row["id"]: row["value"] for row in json.loads(command("[ESP420]json"))["data"]}
        assert shown["machine"].startswith("PoKeys devices, lines sent: ") and "baud" not in shown, shown
        for number in 900, 901:
            assert command(f"[ESP{number}]") == "error: the machine has no port: the gateway itself takes its lines\n"
        # a stop that is none is no success
        try:
            command("M112")
        except urllib.error.HTTPError as error:
            assert error.code == 503 and "Error:M112: the gateway may not operate LinuxCNC" in error.read().decode()
        else:
            raise AssertionError("nothing can be stopped here")
        sim.terminate()
        wait_for("it is lost", lambda: not status()[0].startswith("echo:mill: connected"))
        assert re.match(r"echo:mill: .*(no answer|ms old)", status()[0]), status()
        assert house.log("gateway.log").count("error") == 0, house.log("gateway.log")


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
