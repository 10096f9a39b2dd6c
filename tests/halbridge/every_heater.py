# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for heaters: each has a sensor and an output of its own, heats, has a fault, and is reset."""
from every_name import Act

HEATERS = 7
# 1 V at 0 C and 20 mV for each kelvin. From one phase to the next a temperature changes by less
# than is a jump in whatever time; and no moment without a processor, which HAL may have as well
# as the daemon, is as long as hold-s: the heaters go on.
CONFIG = "".join(f"""
[heater h{i}]
sensor-pin = {41 + i}
sensor = linear
volts-at-0 = 1
volts-per-kelvin = 0.02
output-pin = {1 + i}
min-switch-s = 0.1
control = bang-bang
hysteresis = 0.2
at-temperature-k = 0.4
hold-s = 20
min-temperature = -10
without-failsafe = yes
max-temperature = 90
max-rate = 200
max-age-ms = 2000
watch-window-s = 600
""" for i in range(HEATERS))
HEAT = Act("heaters", phases=7)
# a fault is reset when its cause is gone, and that is seen: before, it would be refused
COLD, WARM, HOT, BROKEN, MENDED, RESET, TOO_HIGH = range(7)
OPEN, OUT_OF_RANGE = 4, 1


def temperature(i, phase):
    """The device has another one in each phase, and no two sensors the same."""
    return 20 + i + (1.3 if phase == HOT else 0)


def target(i, phase):
    return 0 if phase in (COLD, MENDED, RESET) else 1000 if phase == TOO_HIGH else 21 + i


def reading(i, phase):
    return 4095 if phase == BROKEN else round((1 + 0.02 * temperature(i, phase)) / 3.3 * 4095)


@HEAT.rule(r"heater\.(\d\d)\.temperature")
def _(step, phase, i):
    step.sim(f"analog {41 + i} {reading(i, phase)}")
    if phase != BROKEN:
        step.shows(lambda have: abs(have - temperature(i, phase)) < 0.1, state=temperature(i, phase))


@HEAT.rule(r"heater\.(\d\d)\.target")
def _(step, phase, i):
    step.set(float(target(i, phase)))
    step.device("latch", i, phase == WARM)


@HEAT.rule(r"heater\.(\d\d)\.(target-in-effect|power)")
def _(step, phase, i, what):
    if phase < HOT:
        step.shows(float(phase == WARM and (1 if what == "power" else target(i, phase))))


@HEAT.rule(r"heater\.(\d\d)\.at-temperature")
def _(step, phase, _i):
    step.shows(phase == HOT)


@HEAT.rule(r"heater\.(\d\d)\.fault")
def _(step, phase, _i):
    step.shows(phase in (BROKEN, MENDED))


@HEAT.rule(r"heater\.(\d\d)\.(fault-code|condition)")
def _(step, phase, _i, what):
    step.shows(OPEN if phase == BROKEN or phase == MENDED and what == "fault-code" else 0)


@HEAT.rule(r"heater\.(\d\d)\.refused")
def _(step, phase, _i):
    if phase in (WARM, TOO_HIGH):
        step.shows(OUT_OF_RANGE if phase == TOO_HIGH else 0)


@HEAT.rule(r"heater\.(\d\d)\.reset")
def _(step, phase, i):
    step.press(phase == RESET)
    if phase in (MENDED, RESET):
        step.shows(phase == MENDED, f"heater.{i:02d}.fault")


ACTS = [HEAT]
