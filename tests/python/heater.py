#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A heater of a running daemon, commanded from Python, with the simulated device.

Its physics are tested in virtual time (device / heating). Here are the ways of the target and of what is
shown, and who switches the output off when the daemon itself cannot."""
import contextlib
import pathlib
import signal
import sys
import time

sys.path.insert(0, str(pathlib.Path(sys.argv[1]).parent))
from house import PATIENCE, House, equal, main, wait_equal, wait_for  # noqa: E402

from rig import raises  # noqa: E402

import pokeys  # noqa: E402

COLD, OPEN = 3911, 4095     # a thermistor of 100 kohm at 25 C, and none, at 4.7 kohm
PIN, CHANNEL = 12, 2


@contextlib.contextmanager
def machine(**keys):
    """A daemon with a bed that is switched, and a hot end by PWM; the temperatures do not change."""
    with House() as house:
        # a late answer of a busy computer is neither a loss nor a fault here
        house.device_keys["mill"] |= {"lost-after-ms": 5000, "stale-after-ms": 4000, "heartbeat-timeout-ms": 20000,
                                      "pwm-period": 25000, **keys}
        common = {"sensor": "thermistor", "max-temperature": 120, "watch-window-s": 600,
                  "max-age-ms": 2000}
        house.heater_keys = {"bed": {"sensor-pin": 44, "output-pin": PIN, **common},
                             "hotend": {"sensor-pin": 43, "pwm": CHANNEL, **common}}
        sim = house.start_sim()
        for pin in (43, 44):
            house.ask_sim(sim, "analog", pin, COLD)
        daemon = house.start_daemon()
        house.wait_fresh()
        with pokeys.attach("mill", runtime=str(house.runtime), timeout=PATIENCE) as mill:
            wait_for("both to be ready", lambda: [heater["condition"] for heater in heaters(house)] == ["none"] * 2)
            yield house, sim, daemon, mill


def heaters(house):
    return house.state().get("heaters", [])


def heated(house, sim):
    """Whether the device has power on the bed and on the hot end."""
    pwm = dict(line.split("=") for line in house.ask_sim(sim, "pwm").splitlines() if "=" in line)
    pin = dict(line.split("=") for line in house.ask_sim(sim, "pin", PIN).splitlines() if "=" in line)
    return pin["latch"] == "1", int(pwm["enabled"], 16) >> CHANNEL & 1 == 1 and int(pwm[f"duty.{CHANNEL}"]) > 0


@contextlib.contextmanager
def heating(house, sim, mill):
    """Both heaters have a target. Whoever stale readings have switched off on a busy computer begins again."""
    with mill.command(lease=60) as command:
        command.update({"heater.00.target": 0.0, "heater.01.target": 0.0})

        def on():
            command.renew()
            if any(heater["state"] != "heating" for heater in heaters(house)):
                command.update({"heater.00.target": 0, "heater.01.target": 0})
                time.sleep(0.3)
                command.update({"heater.00.target": 80, "heater.01.target": 100.5})
                time.sleep(0.3)
            return heated(house, sim) == (True, True)
        wait_for("power on both", on, say=lambda: heaters(house))
        yield command


def test_a_target_heats_and_is_shown():
    with machine() as (house, sim, _daemon, mill), heating(house, sim, mill) as command:
        state = mill.read(stale_ok=True)
        equal((state.heater[0].name, state.heater[1].name), ("bed", "hotend"))
        assert abs(state.heater[0].temperature - 25) < 0.2, state.heater[0].temperature
        equal((state.heater[1].target_in_effect, state.heater[1].max_target), (100.5, 105))
        assert 0 < state.heater[1].power <= 1
        house.tells("hotend: 25.", "status", "mill")
        house.tells(", target 100.5 C, power ", "status", "mill")
        equal([heater["name"] for heater in heaters(house)], ["bed", "hotend"])
        equal(state.heater[2].name, "")
        with raises(ValueError, "heater.00.target: 3000 is out of range; allowed: 0 to 2000"):
            command.heater[0].target = 3000
        command.heater[0].target = 106
        wait_equal("the refusal", lambda: heaters(house)[0]["refused"], "target out of range")
        equal(heaters(house)[0]["target"], 80)
        wait_for("the log", lambda: "heater 0: target 106.0 C refused: target out of range" in house.log())
        command.update({"heater.00.target": 0, "heater.01.target": 0})
        wait_equal("both off", lambda: heated(house, sim), (False, False))


def test_a_fault_is_reset_by_an_order():
    with machine() as (house, sim, _daemon, mill), heating(house, sim, mill) as command:
        def reset():
            order = command.order(pokeys.OneShot.HEATER_RESET, index=1)
            wait_for("the outcome", lambda: order.outcome)
            return order.outcome
        house.ask_sim(sim, "analog", 43, OPEN)
        wait_equal("the fault", lambda: heaters(house)[1]["state"], "fault")
        command.heater[1].target = 0
        equal(reset(), pokeys.Outcome.REFUSED)
        house.ask_sim(sim, "analog", 43, COLD)
        wait_equal("the cause gone", lambda: heaters(house)[1]["condition"], "none")
        equal(reset(), pokeys.Outcome.DONE)
        wait_equal("it off", lambda: heaters(house)[1]["state"], "off")


def test_a_printer_gets_hot():
    with House() as house:
        house.device_keys["mill"] |= {"lost-after-ms": 5000, "stale-after-ms": 4000, "heartbeat-timeout-ms": 20000,
                                      "pwm-period": 2500000}
        house.heater_keys = {"hotend": {"sensor-pin": 43, "sensor": "thermistor", "pwm": 0, "max-temperature": 280,
                                        "max-age-ms": 2000}}
        sim = house.start_sim("--preset", "printer")
        house.start_daemon()
        house.wait_fresh()
        with pokeys.attach("mill", runtime=str(house.runtime), timeout=PATIENCE) as mill, mill.command(lease=60) as command:
            command.heater[0].target = 0
            wait_equal("it ready", lambda: [heater["condition"] for heater in heaters(house)], ["none"])
            time.sleep(0.3)
            command.heater[0].target = 40

            def hot():
                command.renew()
                return heaters(house)[0]["at_temperature"]
            wait_for("40 C", hot, say=lambda: heaters(house))
            assert "block=3" in house.ask_sim(sim, "heat", 43) or "block=4" in house.ask_sim(sim, "heat", 43)
            house.ask_sim(sim, "heat", 43, "open")
            wait_equal("the fault", lambda: heaters(house)[0]["fault"], "sensor open")
            assert "power=0.000" in house.ask_sim(sim, "heat", 43)


def test_a_sensor_that_breaks_switches_its_heater_off():
    with machine() as (house, sim, _daemon, mill), heating(house, sim, mill) as command:
        house.ask_sim(sim, "analog", 43, OPEN)
        wait_equal("it off", lambda: heated(house, sim)[1], False)
        wait_equal("the reason", lambda: heaters(house)[1]["state"], "fault")
        house.tells("FAULT: sensor open, off until it is reset", "status", "mill")
        wait_for("the log", lambda: "heater 1: fault: sensor open" in house.log())
        house.ask_sim(sim, "analog", 43, COLD)
        wait_equal("the cause gone", lambda: heaters(house)[1]["condition"], "none")
        command.update({"heater.01.target": 0})
        time.sleep(0.3)
        command.update({"heater.01.target": 90})
        time.sleep(0.5)
        equal((heaters(house)[1]["state"], heated(house, sim)[1]), ("fault", False))


def test_the_end_of_the_command_switches_them_off():
    with machine() as (house, sim, _daemon, mill):
        with heating(house, sim, mill):
            pass
        wait_equal("both off", lambda: heated(house, sim), (False, False))


def test_the_device_switches_them_off_when_the_daemon_is_killed_or_hangs():
    for number in (signal.SIGKILL, signal.SIGSTOP):
        with machine() as (house, sim, daemon, mill), heating(house, sim, mill):
            daemon.send_signal(number)
            wait_equal("both off", lambda: heated(house, sim), (False, False))


def test_a_device_without_its_failsafe_heats_nothing():
    with House() as house:
        house.device_keys["mill"] |= {"pwm-period": 25000, "failsafe": "off"}
        house.heater_keys = {"bed": {"sensor-pin": 44, "sensor": "pt1000", "pwm": 0, "max-temperature": 99}}
        daemon = house.start_daemon(wait=False)
        equal(daemon.wait(PATIENCE), 78)
        assert "[heater bed]: the failsafe of its device is off: the heater would stay on" in house.log(), house.log()


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
