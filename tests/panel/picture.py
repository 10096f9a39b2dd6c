#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""What the panel shows of a simulated device: what runs, what is on, and what is wrong, in words."""
import pathlib
import signal
import sys

sys.path[:0] = [str(pathlib.Path(sys.argv[1]).parent),
                *(str(pathlib.Path(__file__).resolve().parents[n] / name) for n, name in
                  ((1, "python"), (2, "panel")))]
from house import PATIENCE, House, main, wait_for  # noqa: E402

import rig  # noqa: E402,F401  pylint: disable=unused-import

import pokeys  # noqa: E402
from pokeys._names import STATE_SIZE  # noqa: E402
from pokeys.snapshot import Shot  # noqa: E402
from pokeys_panel import picture  # noqa: E402

KEYS = {"digital-inputs": "1-3", "digital-outputs": "31-32", "axes": 1, "axis.0.mode": "position",
        "axis.0.limit-plus": "on", "axis.0.name": "x", "axis.0.pulses-per-unit": 100, "lost-after-ms": 3000, "stale-after-ms": 2000}
HEATER = {"bed": {"sensor": "thermistor", "sensor-pin": 44, "output-pin": 12, "max-temperature": 120,
                  "max-age-ms": 2000}}


class Shop:
    """A machine and its picture."""

    def __init__(self, house):
        self.house = house
        house.device_keys["mill"] |= KEYS
        house.heater_keys = HEATER
        self.sim = house.start_sim()
        house.ask_sim(self.sim, "switch", 0, "plus", 1000, 2000)
        house.ask_sim(self.sim, "analog", 44, 3911)
        self.daemon = house.start_daemon()
        house.wait_fresh()
        self.mill = pokeys.attach("mill", runtime=str(house.runtime), timeout=PATIENCE)

    def look(self):
        try:
            return picture.of("mill", self.mill.read(stale_ok=True))
        except pokeys.Error as error:
            return picture.without("mill", error)

    def becomes(self, what, condition):
        wait_for(what, lambda: condition(self.look()), say=self.look)


def named(lamps):
    return {lamp.name: lamp.on for lamp in lamps}


def test_inputs_and_outputs_have_the_names_on_the_board():
    with House() as house:
        shop = Shop(house)
        seen = shop.look()
        assert list(named(seen.inputs)) == ["1", "2", "3"], seen
        assert list(named(seen.outputs)) == ["12", "31", "32", "SSR2", "Relay 2", "Relay 1", "OC1", "OC2", "OC3",
                                             "OC4", "SSR1"], seen
        for level in (0, 1):
            house.ask_sim(shop.sim, "pin", 2, level)
            shop.becomes(f"input 2 is {level}", lambda now, level=level: named(now.inputs)["2"] == level)
        with shop.mill.command(lease=30) as command:
            command.update({"pin.30.out": True, "machine-is-on": True})
            shop.becomes("output 31 is on", lambda now: named(now.outputs)["31"] and not named(now.outputs)["32"])
            shop.becomes("the machine is on", lambda now: now.word == "running, machine on")
        shop.becomes("axis and heater", lambda now: {line.name: line.value for line in now.lines} ==
                     {"axis x": "0 pulses", "heater bed": "25.0 °C"})


def test_what_is_wrong_is_said_in_words():
    with House() as house:
        shop = Shop(house)
        shop.becomes("nobody commands it", lambda now: now.notes == ("no program commands the device",)
                     and now.level == picture.WARNING and now.word == "running, machine off")
        house.ask_sim(shop.sim, "switch", 0, "plus", -10, 10)
        shop.becomes("the limit switch", lambda now: now.level == picture.BAD and
                     any("limit switch +" in note for note in now.notes))
        house.ask_sim(shop.sim, "silence", 60000)
        shop.becomes("no answer", lambda now: now.level == picture.BAD and now.old and
                     now.notes == ('no answer; check power and cable, then run "sudo pokeysctl discover"',))
        house.ask_sim(shop.sim, "silence", 0)
        shop.becomes("it runs again", lambda now: now.word.startswith("running"))
        shop.daemon.send_signal(signal.SIGKILL)
        shop.becomes("the daemon is silent", lambda now: now.level == picture.BAD and now.word == "pokeysd is silent"
                     and now.notes[0].startswith("daemon not publishing for "))


def test_a_device_of_which_nothing_is_known():
    """Whatever an image says, it can be shown: before the device answers, and with values that are no numbers."""
    for byte in (0x00, 0xFF, 0x7F):
        state = pokeys.State(Shot(bytes([byte]) * STATE_SIZE, 1))
        seen = picture.of("mill", state)
        assert seen.old and seen.level == picture.BAD and seen.notes, seen


def test_ages_are_readable():
    for age_us, text in ((None, ""), (float("inf"), ""), (840, "0.8 ms"), (12_345, "12.3 ms"), (1.2e6, "1 s"),
                         (119e6, "119 s"), (600e6, "10 min")):
        assert picture.duration(age_us) == text, (age_us, picture.duration(age_us))


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
