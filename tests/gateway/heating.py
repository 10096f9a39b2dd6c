#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Heaters commanded by G-code, on a simulated printer with its physics: targets, waits, stops, and who switches them off."""
import contextlib
import os
import re
import signal
import subprocess
import sys
import types

from bridge import PORT, Telnet
from house import House, free_address, main, wait_for
from rig import environment, machine

SENSOR, BED_SENSOR = 43, 44
HOT, WARM = 45, 35          # degrees C, which the simulated heaters reach soon


@contextlib.contextmanager
def printer(**keys):
    """House, simulator, daemon, gateway, and a client."""
    where = free_address()
    more = f"[machine]\nkind = pokeys\ndevice = mill\n[telnet]\nlisten = {where}:{PORT}\n[console]\nlevel = user\n"
    common = {"sensor": "thermistor", "max-age-ms": 2000}
    with machine("--preset", "printer", more=more, heaters={
            "hotend": {"sensor-pin": SENSOR, "pwm": 0, "max-temperature": 280, **common},
            "bed": {"sensor-pin": BED_SENSOR, "pwm": 1, "max-temperature": 120, **common}},
            **{"pwm-period": 2500000, "heartbeat-timeout-ms": 3000, **keys}) as (house, sim, daemon, gateway):
        house.console = where
        one = Client(house)
        wait_for("the temperatures", lambda: re.match(r"ok T:\S+ /0.00 B:", one.ask("M105")[-1]), say=lambda: one.ask("M105"))
        yield types.SimpleNamespace(house=house, sim=sim, daemon=daemon, gateway=gateway, one=one)


class Client(Telnet):
    """Somebody at the console."""

    def until(self, end):
        """The lines up to one that begins so."""
        found = [self.line()]
        while not found[-1].startswith(end):
            found.append(self.line())
        return found

    def ask(self, line):
        self.send(f"{line}\n".encode())
        return self.until("ok")


def power(shop, sensor=SENSOR):
    return float(re.search(r"power=(\S+)", shop.house.ask_sim(shop.sim, "heat", sensor))[1])


def heats(shop, yes=True, sensor=SENSOR):
    wait_for(f"power is {'on' if yes else 'off'}", lambda: (power(shop, sensor) > 0) == yes,
             say=lambda: shop.house.ask_sim(shop.sim, "heat", sensor) + shop.house.log())


def nobody_commands(shop):
    wait_for("nobody commands it", lambda: not shop.house.state()["flags"]["commander"], say=shop.house.log)


def test_targets_and_waits():
    with printer() as shop:
        one, other = shop.one, Client(shop.house)
        assert one.ask(f"M104 S{HOT}") == ["ok"]
        heats(shop)
        assert one.ask(f"M140 S{WARM}") == ["ok"]
        heats(shop, sensor=BED_SENSOR)
        wait_for("targets", lambda: f"/{HOT}.00" in one.ask("M105")[0] and f"/{WARM}.00" in one.ask("M105")[0])
        one.send(f"M109 S{HOT}\nM104 S0\nM105\n".encode())
        assert one.line().startswith("ok T:"), "at once, although lines before it wait"
        assert other.ask("M105")[0].startswith("ok T:") and other.ask("M119")[-1] == "ok"
        waited = one.until("ok")
        assert waited[-1] == "ok" and "echo:busy: processing" in waited, waited
        assert any(re.match(r" T:\d", line) for line in waited), waited
        assert one.until("ok") == ["ok"]
        heats(shop, False)
        # warmer than that already; cooling down takes long, and can be given up
        assert one.ask(f"M109 S{HOT - 15}") == ["ok"]
        one.send(b"M109 R30\n")
        assert "echo:busy: processing" in one.until("echo:busy")
        assert other.ask("M108") == ["ok"] and one.until("ok")[-1] == "ok"
        assert one.ask("M190 S0") == ["ok"] and one.ask("M104 S0") == ["ok"]
        heats(shop, False, BED_SENSOR)
        # the place is free for others
        nobody_commands(shop)
        # gains, in Marlin's units
        assert one.ask("M301") == ["echo: p:22.20 i:1.08 d:114.00", "ok"]
        assert one.ask("M301 E0 I0 P30.5") == ["ok"] and one.ask("M304 D270") == ["ok"]
        assert one.ask("M301 E1")[0] == "Error:M301: there is no hot end T1"
        assert one.ask("M301 P-1")[0] == "Error:M301: P needs a number that is not negative"
        assert one.ask("M301 P0")[0] == "Error:M301: the daemon refused P0"
        wait_for("they are shown", lambda: one.ask("M301")[0] == "echo: p:30.50 i:0.00 d:114.00", say=lambda: one.ask("M301"))
        said = one.ask("M503")
        assert {"echo:M301 E0 P30.50 I0.00 D114.00", "echo:M304 P22.20 I1.08 D270.00", "echo:M220 S100"} < {*said}, said
        # a hot end that is selected, for this client
        assert one.ask("T0") == ["ok"] and one.ask("T1")[0] == "Error:T: there is no hot end T1"
        # a search begins, and another client's stop ends it
        one.send(b"M303 S100\n")
        heats(shop)
        assert other.ask("M104 S50")[0].startswith("Error:M104: the gains of heater hotend are being searched for; M104 S0")
        assert other.ask("M410")[-1] == "ok"
        heats(shop, False)
        nobody_commands(shop)


def test_a_stop_while_it_waits():
    with printer() as shop:
        one, other = shop.one, Client(shop.house)
        one.send(b"M109 S200\nM140 S60\nG4 P1\n")
        heats(shop)
        other.send(b"M112\nM410\n")
        assert other.until("ok")[0].startswith("[stop by telnet"), "confirmed"
        # confirmed is: the daemon has switched it off
        assert shop.house.state()["heaters"][0]["target"] == 0
        heats(shop, False)
        assert other.until("ok")[-1] == "ok", "of the second one"
        assert "lines not sent: 3]" in one.until("[stop by")[-1]
        # nothing is commanded any more, and everything is still answered
        assert other.ask("M104 S100") == ["Error:M104: stopped by M112; M999 permits commands again", "ok"]
        assert other.ask("M105")[-1].startswith("ok T:") and power(shop) == power(shop, BED_SENSOR) == 0
        assert other.ask("?")[-2:] == ["echo:stopped by M112; M999 permits commands again", "ok"]
        assert other.ask("M999") == ["ok"] and other.ask("M104 S100") == ["ok"]
        heats(shop)
        # M410 stops what moves, and leaves heaters on
        assert other.ask("M410")[-1] == "ok" and power(shop) > 0
        assert other.ask("M104 S0") == ["ok"]


def test_a_sensor_breaks_while_it_waits():
    with printer() as shop:
        one, other = shop.one, Client(shop.house)
        one.send(b"M109 S200\nM104 S220\n")
        heats(shop)
        shop.house.ask_sim(shop.sim, "heat", SENSOR, "open")
        why = "heater hotend is off by a fault: sensor open"
        assert one.until("Error:")[-1] == other.until("Error:")[-1] == f"Error:{why}; M999 permits commands again"
        assert other.ask("M104 S200") == [f"Error:M104: {why}; M999 permits commands again", "ok"]
        assert other.ask("M999") == ["echo:heater hotend: the cause of its fault is still present: sensor open", "ok"]
        assert other.ask("M104 S200") == ["Error:M104: heater hotend is off by a fault: sensor open", "ok"]
        assert other.ask("M140 S40") == ["ok"], "the bed is as good as before"
        shop.house.ask_sim(shop.sim, "heat", SENSOR, "good")
        wait_for("the cause is gone", lambda: shop.house.state()["heaters"][0]["condition"] == "none")
        assert other.ask("M999") == ["ok"] and other.ask("M104 S200") == ["ok"]
        heats(shop)
        # the bed has kept its target
        assert shop.house.state()["heaters"][1]["target"] == 40
        # the daemon takes no such targets, nor are there such heaters
        assert other.ask("M104 S300") == ["Error:M104: the target of heater hotend must be 0 to 265 degrees C", "ok"]
        assert other.ask("M104 T1 S30") == ["Error:M104: there is no hot end T1", "ok"]
        assert other.ask("M141 S30") == ["Error:M141: there is no chamber", "ok"]
        assert other.ask("M104") == ["Error:M104: needs S with a temperature in degrees C", "ok"]
        assert other.ask("M109 T0") == ["Error:M109: needs S or R with a temperature in degrees C", "ok"]


def test_the_gateway_dies():
    for number in signal.SIGKILL, signal.SIGSTOP:
        with printer() as shop:
            assert shop.one.ask("M104 S200") == ["ok"] and shop.one.ask("M140 S60") == ["ok"]
            heats(shop)
            heats(shop, sensor=BED_SENSOR)
            shop.gateway.child.send_signal(number)
            heats(shop, False)
            heats(shop, False, BED_SENSOR)
            # what lives again knows that it was away
            shop.gateway.child.send_signal(signal.SIGCONT)
            if number == signal.SIGSTOP:
                assert "the lease had run out" in shop.one.until("Error:")[-1]
                assert shop.one.ask("M104 S200")[0].startswith("Error:M104: "), "not before M999"
            assert power(shop) == power(shop, BED_SENSOR) == 0


def test_another_program_commands_it():
    with printer() as shop:
        other = subprocess.Popen([House.programs["python"], "-B", "-c", f"""
import sys, time, pokeys
with pokeys.attach("mill", runtime={str(shop.house.runtime)!r}) as mill, mill.command(lease=60) as command:
    print("there", flush=True)
    sys.stdin.read()
"""], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env={**os.environ, **environment()})
        shop.house.children.append(other)
        assert other.stdout.readline() == b"there\n"
        said = shop.one.ask("M104 S50")
        assert re.fullmatch(r"Error:M104: another commander holds device 'mill': process \d+ \(python3?\); end it first", said[0]), said
        assert "Error:M112: the stop is not confirmed: another program commands mill" in "\n".join(shop.one.ask("M112"))
        other.stdin.close()
        other.wait()
        assert shop.one.ask("M999") == ["ok"]
        assert shop.one.ask("M112")[-1] == "ok", "nobody commands it: it is in the safe state"
        assert shop.one.ask("M999") == ["ok"] and shop.one.ask("M104 S50") == ["ok"]
        heats(shop)
        # the daemon is gone
        shop.daemon.kill()
        said = shop.one.until("Error:")[-1]
        assert re.match("Error:.*(no daemon|daemon not publishing)", said), said


def test_a_flood_of_lines_waits_for_its_client_alone():
    with printer() as shop:
        flood, other = shop.one, Client(shop.house)
        flood.send(b"M109 R45\n" + b"".join(b"M140 S%d\n" % (number % 30 + 10) for number in range(500)) + b"M140 S0\n")
        heats(shop)
        assert other.ask("M105")[-1].startswith("ok T:")
        assert other.ask("M108") == ["ok"]
        assert sum(flood.until("ok")[-1] == "ok" for _ in range(502)) == 502
        wait_for("the last one counts", lambda: shop.house.state()["heaters"][1]["target"] == 0)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=2))
