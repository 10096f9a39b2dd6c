#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl heater: heat, find gains and clear a fault without LinuxCNC; the heater is off whatever happens to the
program."""
import contextlib
import os
import pty
import re
import signal
import sys
import threading

from house import House, end, equal, main, wait_equal, wait_for

# Readings of a thermistor of 100 kohm with 4.7 kohm: 25 C, 0.6 K less, 0.6 K more, and none
AT_25, COLDER, WARMER, OPEN = 3911, 3915, 3907, 4095
PIN, CHANNEL = 12, 2


@contextlib.contextmanager
def machine(**keys):
    """A daemon with a bed that is switched, and a hot end by PWM; the temperatures do not change."""
    with House() as house:
        # a late answer of a busy computer is neither a loss nor a fault here
        house.device_keys["mill"] |= {"lost-after-ms": 5000, "stale-after-ms": 4000, "heartbeat-timeout-ms": 1000,
                                      "failsafe-timeout-ms": 5000, "pwm-period": 25000}
        common = {"sensor": "thermistor", "max-temperature": 120, "watch-window-s": 600, "max-age-ms": 2000, **keys}
        house.heater_keys = {"bed": {"sensor-pin": 44, "output-pin": PIN, **common},
                             "hotend": {"sensor-pin": 43, "pwm": CHANNEL, **common}}
        sim = house.start_sim()
        for pin in (43, 44):
            house.ask_sim(sim, "analog", pin, AT_25)
        house.start_daemon()
        house.wait_fresh()
        wait_for("both to be ready", lambda: [heater["condition"] for heater in heaters(house)] == ["none"] * 2)
        yield house, sim


def heaters(house):
    return house.state().get("heaters", [])


def shown(house, key, index=1):
    return heaters(house)[index][key]


def heater(house, *words, log="ctl.log"):
    return house.spawn("pokeysctl", "-r", house.runtime, "heater", "mill", *words, log=log)


def ended(house, *words):
    """Status and text of a command that ends by itself."""
    log = f"ctl{len(house.children)}.log"
    return heater(house, *words, log=log).wait(60), house.log(log)


def powered(house, sim):
    """Whether the device has power on the hot end."""
    pwm = dict(line.split("=") for line in house.ask_sim(sim, "pwm").splitlines() if "=" in line)
    return int(pwm["enabled"], 16) >> CHANNEL & 1 == 1 and int(pwm[f"duty.{CHANNEL}"]) > 0


def heated(house, sim, ran):
    def is_so():
        assert ran.poll() is None, house.log("ctl.log")
        return powered(house, sim)
    wait_for("power", is_so, say=lambda: (house.log("ctl.log"), house.log()))


def test_it_heats_until_ctrl_c():
    with machine() as (house, sim):
        ran = heater(house, "hotend", "heat", "100.5")
        heated(house, sim, ran)
        equal((shown(house, "state"), shown(house, "target")), ("heating", 100.5))
        wait_for("a line", lambda: "hotend: 2" in house.log("ctl.log"))
        equal(end(ran, signal.SIGINT), 0, house.log("ctl.log"))
        wait_equal("no power", lambda: powered(house, sim), False)
        equal(shown(house, "state"), "off")
        assert re.fullmatch(r"(hotend: 2[45]\.\d C, target 100\.5 C, power \d+ %\n)+", house.log("ctl.log")), house.log("ctl.log")


def test_it_heats_as_long_as_was_asked_for():
    with machine() as (house, sim):
        status, text = ended(house, "0", "heat", "40", "--for", "1")
        equal(status, 0, text)
        assert text.startswith("bed: 25"), text
        equal((shown(house, "state", 0), shown(house, "target", 0)), ("off", 0))
        equal(ended(house, "bed", "heat", "0"), (0, ""))
        equal(powered(house, sim), False)


def test_killed_or_stopped_the_heater_is_off():
    for number in (signal.SIGKILL, signal.SIGSTOP):
        with machine() as (house, sim):
            ran = heater(house, "hotend", "heat", "60")
            heated(house, sim, ran)
            ran.send_signal(number)
            wait_equal("no power", lambda: powered(house, sim), False)
            if number == signal.SIGSTOP:
                house.tells("no commander", "status")
                ran.send_signal(signal.SIGCONT)
                equal(ran.wait(60), 1)
                assert "switched off" in house.log("ctl.log"), house.log("ctl.log")
                equal(powered(house, sim), False)


def test_a_fault_ends_it_and_is_reset():
    with machine() as (house, sim):
        equal(ended(house, "hotend", "reset"), (0, "mill: heater hotend: no fault\n"))
        ran = heater(house, "hotend", "heat", "60")
        heated(house, sim, ran)
        house.ask_sim(sim, "analog", 43, OPEN)
        equal(ran.wait(60), 1)
        equal(house.log("ctl.log").splitlines()[-1],
              "pokeysctl: mill: heater hotend: off by a fault: sensor open; when its cause is gone: pokeysctl heater "
              "mill hotend reset")
        equal(powered(house, sim), False)
        equal(ended(house, "hotend", "reset"),
              (1, "pokeysctl: mill: heater hotend: the cause of its fault is still present: sensor open\n"))
        house.ask_sim(sim, "analog", 43, AT_25)
        wait_equal("the cause gone", lambda: shown(house, "condition"), "none")
        status, text = ended(house, "hotend", "heat", "60")
        equal(status, 1)
        assert "off by a fault: sensor open" in text, text
        equal(ended(house, "hotend", "reset"), (0, "mill: heater hotend: reset; it accepts targets again\n"))
        equal(shown(house, "fault"), "none")
        heated(house, sim, heater(house, "hotend", "heat", "60"))


def test_gains_are_found():
    with machine() as (house, sim):
        ran = heater(house, "hotend", "tune", "25")

        def oscillate():
            house.ask_sim(sim, "analog", 43, WARMER if powered(house, sim) else COLDER)
            return ran.poll() is not None
        wait_for("the end", oscillate, limit=180, say=lambda: (house.log("ctl.log"), heaters(house)))
        equal(ran.returncode, 0, house.log("ctl.log"))
        found = re.search(r"^mill: heater hotend: gains found; write them into \[heater hotend\] in pokeysd\.conf, and restart "
                          r"pokeysd:\npid-p = (\S+)\npid-i = (\S+)\npid-d = (\S+)\n\Z", house.log("ctl.log"), re.MULTILINE)
        assert found, house.log("ctl.log")
        tuned = shown(house, "tuned")
        for gain, text in zip("pid", found.groups()):
            assert abs(tuned[gain] / float(text) - 1) < 0.001, (tuned, text)
        assert ", searching for gains at 25.0 C, oscillation 0, power" in house.log("ctl.log"), house.log("ctl.log")
        equal((shown(house, "state"), powered(house, sim)), ("off", False))


def test_a_search_ends_with_ctrl_c():
    with machine() as (house, sim):
        ran = heater(house, "hotend", "tune", "60")
        heated(house, sim, ran)
        equal(shown(house, "state"), "tuning")
        equal(end(ran, signal.SIGINT), 1)
        equal(house.log("ctl.log").splitlines()[-1], "pokeysctl: mill: heater hotend: the search was ended; no gains found")
        equal((shown(house, "state"), powered(house, sim)), ("off", False))


def test_what_cannot_be_is_said():
    with machine() as (house, sim):
        for words, status, text in (
            (["nozzle", "heat", "60"], 1, 'mill: there is no heater "nozzle"; its heaters: bed, hotend'),
            (["2", "reset"], 1, 'mill: there is no heater "2"; its heaters: bed, hotend'),
            (["hotend", "heat", "106"], 1, "mill: heater hotend: 106 C is above its highest target, 105 C; see max-target in "
                                           "pokeysd.conf(5)"),
            (["bed", "tune", "200"], 1, "mill: heater bed: 200 C is above its highest target, 105 C; see max-target in "
                                        "pokeysd.conf(5)"),
        ):
            equal(ended(house, *words), (status, f"pokeysctl: {text}\n"))
        house.ask_sim(sim, "analog", 43, OPEN)
        wait_equal("it not ready", lambda: shown(house, "condition"), "sensor open")
        for verb in ("heat", "tune"):
            equal(ended(house, "hotend", verb, "60"), (1, "pokeysctl: mill: heater hotend: not ready: sensor open\n"))
        ran = heater(house, "bed", "heat", "60")
        wait_equal("it heating", lambda: shown(house, "state", 0), "heating")
        status, text = ended(house, "bed", "reset")
        equal(status, 1)
        assert "pokeysctl" in text.removeprefix("pokeysctl: "), text
        end(ran, signal.SIGTERM)


def test_a_device_without_heaters():
    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        equal(ended(house, "bed", "heat", "60"),
              (1, "pokeysctl: mill: this device has no heaters; see [heater NAME] in pokeysd.conf(5)\n"))


def test_a_terminal_has_one_line():
    with machine() as (house, sim):
        master, slave = pty.openpty()
        text = bytearray()

        def read():
            with contextlib.suppress(OSError):
                while part := os.read(master, 4096):
                    text.extend(part)
        reader = threading.Thread(target=read)
        reader.start()
        ran = house.spawn("pokeysctl", "-r", house.runtime, "heater", "mill", "hotend", "heat", "60", stdout=slave, stderr=slave)
        os.close(slave)
        wait_for("the line drawn again", lambda: text.count(b"\r\x1b[Khotend: ") > 2, say=lambda: bytes(text))
        equal(end(ran, signal.SIGINT), 0, bytes(text))
        reader.join()
        os.close(master)
        assert text.endswith(b" %\r\n") and text.count(b"\n") == 1, bytes(text)
        equal(powered(house, sim), False)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=4))
