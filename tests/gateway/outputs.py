#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Fans and a spindle at outputs of a simulated device, commanded by G-code: speeds, stops, and who switches them off."""
import contextlib
import os
import re
import signal
import sys
import time
import types

from bridge import PORT
from heating import Client, nobody_commands
from house import free_address, main, wait_for
from rig import machine

FAN, SPINDLE, REVERSE = 33, 31, 32      # terminals
SPEED = 2                   # channel of PWM


@contextlib.contextmanager
def shop(*lines, folder=None, **keys):
    """With these lines in [machine]."""
    where = free_address()
    more = "[machine]\nkind = pokeys\ndevice = mill\n" + "".join(f"{line}\n" for line in lines)
    more += f"folder = {folder}\n" * bool(folder) + f"[telnet]\nlisten = {where}:{PORT}\n[console]\nlevel = user\n"
    axis = {"axes": 1, "generator": "external", "axis.0.mode": "position", "axis.0.pulses-per-unit": 200, "axis.0.name": "x",
            "axis.0.max-speed": 20000, "axis.0.max-acceleration": 200000, "axis.0.invert": "off"}
    with machine(more=more, **{"digital-outputs": "31-34", "pwm-period": 2500, "heartbeat-timeout-ms": 2000, **axis, **keys}) as (
            house, sim, _daemon, gateway):
        house.console = where
        yield types.SimpleNamespace(house=house, sim=sim, gateway=gateway, one=Client(house))


MILL = f"spindle = pin {SPINDLE}", f"spindle-speed = pwm {SPEED}", f"spindle-reverse = pin {REVERSE}", "spindle-max = 24000", \
    f"fan = pin {FAN}, pwm 0"


def is_on(one, terminal):
    """At the device: an output that is on pulls its terminal low."""
    return re.search(r"latch=(\d)", one.house.ask_sim(one.sim, "pin", terminal))[1] == "1"


def duty(one, channel):
    """The part of the time that the device has it on."""
    said = dict(line.split("=") for line in one.house.ask_sim(one.sim, "pwm").split())
    return int(said[f"duty.{channel}"]) / int(said["period"]) if int(said["enabled"], 16) >> channel & 1 else 0.0


def outputs(one):
    return is_on(one, SPINDLE), is_on(one, REVERSE), is_on(one, FAN), round(duty(one, SPEED), 3), round(duty(one, 0), 3)


def become(one, *wanted):
    wait_for(f"outputs {wanted}", lambda: outputs(one) == wanted, say=lambda: f"{outputs(one)} {one.house.log()}")


def test_any_digital_output():
    lamp, free = 34, 35
    with shop(*MILL, **{"digital-outputs": "31-36"}, heaters={"oven": {
            "sensor": "thermistor", "sensor-pin": 43, "output-pin": 36, "max-temperature": 120}}) as one:
        ask = one.one.ask

        def lit(wanted):
            wait_for(f"terminal {lamp} is {wanted}", lambda: is_on(one, lamp) == wanted, say=one.house.log)
        # off is no reason to command the device
        assert ask(f"M42 P{lamp} S0") == ["ok"] and not one.house.state()["flags"]["commander"]
        assert ask(f"M42 P{lamp} S255") == ["ok"] and is_on(one, lamp), "the reply comes when it is so"
        assert ask(f"M42 P{free} S1") == ["ok"] and ask(f"M42 P{free} S0") == ["ok"]
        assert is_on(one, lamp) and not is_on(one, free)
        for line, said in ((f"M42 P{FAN} S1", f"terminal {FAN} is switched by M106 and M107"),
                           (f"M42 P{REVERSE} S0", f"terminal {REVERSE} is switched by M3, M4 and M5"),
                           ("M42 P40 S1", "terminal 40 of mill is no digital output; see digital-outputs in pokeysd.conf(5)"),
                           ("M42 P36 S1", "terminal 36 of mill is no digital output; see digital-outputs in pokeysd.conf(5)"),
                           *((line, "needs P with a terminal, 1 to 55, or R with an output of the board, 0 to 7, and S with 0 for off, or more for on")
                             for line in ("M42", "M42 P31 R1 S1", "M42 R8 S1", "M42 P34", "M42 S1", "M42 P56 S1", "M42 P1.5 S1", "M42 P34 S-1"))):
            assert ask(line) == [f"Error:M42: {said}", "ok"], (line, ask(line))
        assert is_on(one, lamp) and not is_on(one, 36)
        # the last one counts, although the first one has not seen its own yet
        other = Client(one.house)
        one.house.ask_sim(one.sim, "silence", 500)
        one.one.send(f"M42 P{lamp} S0\n".encode())
        time.sleep(0.1)
        assert other.ask(f"M42 P{lamp} S1") == ["ok"] and one.one.until("ok") == ["ok"]
        time.sleep(1.5)
        assert is_on(one, lamp)
        # a relay of the board
        def relays():
            found = int(re.search(r"^outputs=0x(\w+)", one.house.ask_sim(one.sim, "engine"), re.M)[1], 16)
            return [number for number in range(8) if found >> number & 1]
        assert ask("M42 R3 S1") == ask("M42 R5 S1") == ask("M42 R5 S0") == ["ok"]
        wait_for("a relay", lambda: relays() == [3], say=relays)
        assert ask("M410")[-1] == "ok" and is_on(one, lamp), "it stops axes"
        assert ask("M112")[-1] == "ok"
        lit(False)
        assert ask(f"M42 P{lamp} S1")[0] == "Error:M42: stopped by M112; M999 permits commands again"
        assert ask("M999") == ["ok"] and not is_on(one, lamp), "nothing comes back by itself"
        assert ask(f"M42 P{lamp} S1") == ["ok"]
        lit(True)
        os.kill(one.gateway.child.pid, signal.SIGKILL)
        lit(False)


def test_what_the_device_does_not_have_keeps_nothing_on():
    """The configuration names an output that was one when it was written."""
    with shop("fan = pin 40", "spindle = pin 31") as one:
        ask = one.one.ask
        assert ask("M106")[0].startswith("Error:M106: terminal 40 of mill is no digital output")
        assert ask("M3") == ask("M42 P34 S1") == ask("G1 X500 F600") == ["ok"]
        # the fan was commanded while it was one
        assert "Error" not in "".join(ask("M112")) and not one.house.state()["flags"]["machine_on"]
        assert not is_on(one, 31) and not is_on(one, 34)
        wait_for("the event", lambda: "emergency stop from the commander" in one.house.log())


def test_fans_and_a_spindle():
    with shop(*MILL) as one:
        ask = one.one.ask
        off = False, False, False, 0.0, 0.0
        assert ask("M106") == ["ok"]
        become(one, False, False, True, 0.0, 0.0)
        assert ask("M106 P1 S51") == ["ok"]
        become(one, False, False, True, 0.0, 0.2)
        assert ask("M107") == ["ok"] and ask("M107 P1") == ["ok"]
        become(one, *off)
        nobody_commands(one)
        # the place was left, which is a loss for the daemon: outputs are held off until the machine is on again
        assert ask("M3")[0] == "Error:M3: needs S with revolutions per minute"
        assert ask("M3 S12000") == ["ok"]
        become(one, True, False, False, 0.5, 0.0)
        assert ask("M4 S12000")[0] == "Error:M4: the spindle turns already, by M3; M5 stops it"
        assert ask("M3 S6000") == ["ok"]
        become(one, True, False, False, 0.25, 0.0)
        # a move and its end change nothing of it
        assert ask("G1 X1 F6000") == ["ok"] and ask("M18") == ["ok"]
        become(one, True, False, False, 0.25, 0.0)
        assert ask("M5") == ["ok"] and ask("M4") == ["ok"]
        become(one, True, True, False, 0.25, 0.0)
        # M410 stops axes
        assert ask("M410")[-1] == "ok"
        become(one, True, True, False, 0.25, 0.0)
        assert ask("M112")[-1] == "ok"
        become(one, *off)
        assert ask("M3 S1")[0] == "Error:M3: stopped by M112; M999 permits commands again"
        assert ask("M999") == ["ok"] and ask("M106 S1") == ["ok"]
        become(one, False, False, True, 0.0, 0.0)
        for line, said in (("M106 P2", "Error:M106: there is no fan P2; fan in [machine] has 2"),
                           ("M106 S-1", "Error:M106: S must be 0 to 255"),
                           ("M3 S24001", "Error:M3: the spindle's speed must be 0 to 24000 revolutions per minute")):
            assert ask(line)[0] == said, ask(line)
        # more than all of it, as of some slicers
        assert ask("M106 P1 S300") == ["ok"]
        become(one, False, False, True, 0.0, 1.0)
        assert ask("M3 S100") == ["ok"]
        os.kill(one.gateway.child.pid, signal.SIGKILL)
        become(one, *off)


def test_a_program_ends():
    with shop(*MILL, folder="@folder@") as one:
        (one.house.folder / "part.ngc").write_text("M3 S24000\nM106\nG1 X1 F6000\nM2\nM4\n", encoding="utf-8")
        assert one.one.ask("M32 part.ngc")[-1] == "ok"
        one.one.until("Done printing file")
        become(one, False, False, True, 0.0, 0.0)


def test_what_is_not_there():
    with shop(**{"digital-outputs": "34"}) as one:
        assert one.one.ask("M106") == ["echo:no fan is set; see fan in [machine] in pokeys-gateway.conf(5)", "ok"]
        assert one.one.ask("M5") == ["ok"]
        assert one.one.ask("M3 S1")[0].startswith("Error:M3: no spindle is set; see spindle in [machine]")
    with shop("spindle = pin 31", "fan = pin 34", **{"digital-outputs": "34"}) as one:
        assert one.one.ask("M3")[0] == ("Error:M3: terminal 31 of mill is no digital output; see digital-outputs in "
                                        "pokeysd.conf(5)")
        assert one.one.ask("M4")[0].startswith("Error:M4: the spindle has one direction; see spindle-reverse")
        # texts, and lines that look like answers
        other = Client(one.house)
        assert one.one.ask("M117 layer 3 of 6 (M112)") == ["ok"]
        one.one.send(b"M118 A1 action:pause\nM118 ok\n")
        assert other.until("echo:")[-2:] == ["//action:pause", "echo:ok"]


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=3))
