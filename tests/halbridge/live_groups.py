#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Each group of names the whole way: simulated device, real daemon, real LinuxCNC HAL.

Settings of the device included: set as a parameter, seen in the device.

usage: live_groups.py MODULE.so POKEYSD POKEYS-SIM [PATTERN]
"""
import sys
import hal_live
import hal_machine


def settings_are_shown_and_one_that_is_set_reaches_the_device(m):
    hal = m.all()
    hal.becomes("config.state", 3, limit=60)
    hal.becomes("pin.30.function", 4)      # digital-outputs of the configuration
    before = m.sim("pin 44")["function"]
    assert hal.get("config.generation") == 0
    hal.set("pin.43.function", 4)
    took = m.sim_shows("pin 44", "function", "0x04")
    print(f"a pin's function: {before} -> 0x04 in {took:.2f} s")
    hal.becomes("config.generation-applied", 1)
    hal.becomes("config.state", 3, limit=60)
    hal.set("pin.43.out", 1)
    m.sim_shows("pin 44", "latch", "1")
    hal.becomes("pin.43.out-fb", True)
    assert m.sim("pin 44")["function"] == "0x04"


def a_setting_that_the_daemon_does_not_take_is_told(m):
    hal = m.all()
    hal.becomes("config.state", 3, limit=60)
    hal.set("joint.01.soft-min", 10)
    hal.set("joint.01.soft-max", 5)
    hal.becomes("config.refused", 8)
    hal.becomes("config.refused-index", 1)


def a_setting_out_of_range_is_named_and_not_sent(m):
    hal = m.all()
    hal.becomes("config.state", 3, limit=60)
    before = m.sim("pin 11")["function"]
    hal.set("pin.10.function", 256)
    hal.says("pokeys.0.pin.10.function = 256: must be 0 to 255")
    hal.becomes("input-refused", True)
    m.applied("pin.20.function", 4)             # another one, beside it
    assert hal.get("config.generation") == 1
    assert m.sim("pin 11")["function"] == before
    hal.set("pin.10.function", -1)
    hal.becomes("input-refused", False)


def pwm_has_its_frequency_and_duty(m):
    hal = m.all()
    hal.becomes("config.state", 3, limit=60)
    hal.set("pwm.frequency", 5000)
    m.sim_shows("pwm", "period", "5000")
    hal.set("pwm.00.scale", 24000)
    hal.set("pwm.00.value", 6000)
    hal.set("pwm.00.enable", 1)
    m.sim_shows("pwm", "duty.0", "1250")
    hal.becomes("pwm.00.duty", 0.25)
    hal.becomes("pwm.00.enabled", True)
    hal.set("pwm.00.enable", 0)
    m.sim_shows("pwm", "duty.0", "0")


def a_bus_output_is_shifted_out_and_shown(m):
    hal = m.all()
    hal.set("PoExtBus.13.out", 1)
    m.sim_shows("poext", "data", "0020" + 16 * "0")
    hal.becomes("PoExtBus.13.in", True)
    hal.becomes("PoExtBus.13.in-not", False)
    hal.set("PoRelay8.00.relay-1", 1)
    m.sim_shows("poext", "data", "0020" + 14 * "0" + "01")


def a_keyboard_has_keys_and_lamps(m):
    hal = m.all()
    m.sim("module 0 on 100")
    hal.becomes("kbd48CNC.present", True, limit=60)
    m.sim("kbd 0 2 1 1")
    hal.becomes("kbd48CNC.09.Button", True)
    m.sim("kbd 0 2 1 0")
    hal.becomes("kbd48CNC.09.Button", False)
    hal.set("kbd48CNC.13.LED", 1)
    m.sim_shows("lamp 0 3 1", "lit", "1")
    hal.becomes("kbd48CNC.light", 100)


def counters_count_and_are_reset(m):
    hal = m.all()
    hal.becomes("config.state", 3, limit=60)
    hal.set("pin.18.function", 66)
    m.sim_shows("pin 19", "function", "0x42")

    def is_reset():
        m.sim("counter 19 7")
        hal.becomes("counter.18.value", 7)
        failed = hal.get("one-shot-failed-count")
        m.press("counter.reset", lambda: hal.get("counter.18.value") == 0)
        return hal.get("one-shot-failed-count") == failed

    hal_live.wait("a reset that is not counted as failed", is_reset)


def the_clock_is_set(m):
    hal = m.all()
    for name, value in (("year", 2031), ("month", 2), ("dom", 28), ("hour", 13), ("min", 5),
                        ("sec", 6)):
        hal.set(f"rtc.set-{name}", value)
    m.press("rtc.set", lambda: hal.get("rtc.set-outcome") == 1)
    for name, value in (("year", 2031), ("month", 2), ("dom", 28), ("hour", 13), ("dow", 5),
                        ("doy", 59)):
        hal.becomes(f"rtc.{name}", value)


def matrix_keys_are_seen(m):
    m.names = "canonical"   # both schemes have no room for the terminals' names
    hal = m.all()
    hal.becomes("config.state", 3, limit=60)
    for name, value in (("row-pin.00", 23), ("column-pin.00", 27), ("column-pin.01", 28),
                        ("rows", 1), ("columns", 2), ("enable", 1)):
        hal.set(f"matrix.{name}", value)
    hal.becomes("matrix.enabled", True, limit=60)
    m.sim("key 1 1")
    hal.becomes("matrix.00.01", True)


def rates_are_measured(m):
    m.names = "canonical"   # both schemes have no room for the rates of clock and load
    hal = m.all()
    for name in ("PoExtBus", "rtc", "load"):
        hal_live.wait(f"rate.{name} is measured", lambda name=name: hal.get(f"rate.{name}") >= 0.1)
        print(f"rate.{name}: {hal.get('rate.' + name):.1f} Hz")
    hal.becomes("packets.sent", lambda have: have > 100)
    for name in ("wakeup", "round-trip", "data"):       # the image they are in comes later
        for what in ("p99", "max"):
            hal.becomes(f"latency.{name}-{what}-us", lambda have: have > 0)
            print(f"latency.{name}-{what}: {hal.get(f'latency.{name}-{what}-us'):.0f} us")


LOOPS = """
pwm-period = 1250
encoder.4.enable = on
encoder.4.sampling = 4
encoder.4.pins = 23, 24

[heater bed]
sensor-pin = 44
sensor = thermistor
pwm = 1
max-temperature = 100
pid-p = 20

[servo x]
encoder = 4
counts-per-unit = 400
pwm = 0
direction-pin = 36
max-speed = 100
impossible-speed = 9000
pid-p = 0.25
min-following-error = 1
max-following-error = 2
"""


def gains_reach_the_daemon_and_the_next_one(m):
    m.names = "loops"
    conf = m.folder / "conf"
    conf.write_text(conf.read_text().replace("failsafe-timeout-ms = 10000", "failsafe-timeout-ms = 1000") + LOOPS)
    hal = m.all()
    hal.becomes("servo.00.pid-p", 0.25)
    hal.becomes("heater.00.pid-p", 20)
    hal.set("servo.00.pid-p", 0.35)
    hal.set("heater.00.pid-i", 0.7)
    set_here = "servo 0: pid-p = 0.35 until the daemon ends", "heater 0: pid-i = 0.7 until the daemon ends"

    def wait_set(times):
        hal_live.wait(f"set {times} times",
                      lambda: [m.log("pokeysd", 9000).count(text) for text in set_here] == [times] * 2)
    wait_set(1)
    m.kill("pokeysd")
    m.daemon()
    wait_set(2)
    hal.set("servo.00.pid-p", 2e6)
    hal.says("pokeys.0.servo.00.pid-p = 2e+06: the daemon refuses this gain")
    hal.becomes("servo.00.pid-p", lambda have: abs(have - 0.35) < 1e-6)
    assert hal.get("servo.00.pid-i") == 0
    wait_set(2)


TESTS = [
    settings_are_shown_and_one_that_is_set_reaches_the_device,
    a_setting_that_the_daemon_does_not_take_is_told,
    a_setting_out_of_range_is_named_and_not_sent,
    pwm_has_its_frequency_and_duty,
    a_bus_output_is_shifted_out_and_shown,
    a_keyboard_has_keys_and_lamps,
    counters_count_and_are_reset,
    the_clock_is_set,
    matrix_keys_are_seen,
    rates_are_measured,
    gains_reach_the_daemon_and_the_next_one,
]


if __name__ == "__main__":
    sys.exit(hal_machine.main(TESTS))
