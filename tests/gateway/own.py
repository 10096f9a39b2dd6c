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
from rig import OPEN, WARM, loops, machine


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
        assert command("G999") == 'echo:Unknown command: "G999"; M115 lists the commands\nok\n'
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


def test_it_shows_temperatures_and_places():
    where = free_address()
    more = f"[machine]\nkind = pokeys\n[telnet]\nlisten = {where}:{PORT}\n[console]\nlevel = user\n"
    with loops(more=more, axes=1, **{"axis.0.mode": "position", "axis.0.pulses-per-unit": 200, "axis.0.name": "z"}) as (
            house, sim, _daemon, _gateway):
        for terminal, reading in ((43, WARM), (44, OPEN)):
            house.ask_sim(sim, "analog", terminal, reading)
        one = Telnet(types.SimpleNamespace(console=where))

        def ask(line):
            one.send(f"{line}\n".encode())
            found = [one.line()]
            while not found[-1].startswith("ok"):
                found.append(one.line())
            return found
        wait_for("the temperature", lambda: re.match(r"ok B:2[45]\.", ask("M105")[-1]), say=lambda: ask("M105"))
        assert re.fullmatch(r"ok B:2[45]\.\d\d /0\.00 B@:0", ask("M105")[-1]), ask("M105")
        assert ask("M105")[0].startswith("echo:heater hotend: "), ask("M105")
        assert ask("M114") == ["X:0.0000 Z:0.0000 Count X:0 Z:0", "echo:commanded X:0.0000 Z:0.0000", "ok"], ask("M114")
        assert {"x_min: open", "z_max: open", "z_home: open"} < set(ask("M119")), ask("M119")
        assert ask("M155 S1") == ["ok"]
        assert re.fullmatch(r" B:2[45]\.\d\d /0\.00 B@:0", one.line())


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
