# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for pins, counters, analog values, PWM, PoExtBus and keyboards.

Where there are many of a kind, phase k shows bit k of each one's number, so that
no two of them could be exchanged.
"""
from every_name import Act
from every_play import set_all

VOLT = 3.3 / 4096
TICKS = 2500


def coded(i, phase):
    return bool((i + 1) >> phase & 1)


def functions(function):
    def before(m):
        set_all(m, {f"pin.{i:02d}.function": function for i in range(55)})
    return before


INPUTS = Act("digital inputs", phases=6, before=functions(2))
OUTPUTS = Act("digital outputs", phases=6, before=functions(4))
OLD_OUTPUTS = Act("digital outputs, older names", phases=7)
INVERTED = Act("outputs inverted here", phases=6)
COUNTERS = Act("counters", before=functions(0x42))
RESET = Act("counters zeroed")
ANALOG = Act("analog inputs", phases=4, before=functions(8))


@INPUTS.rule(r"pin\.(\d\d)\.in", r"digin\.(\d+)\.in")
def _(step, phase, i):
    step.sim(f"pin {i + 1} {coded(i, phase):d}")
    step.shows(coded(i, phase))


@INPUTS.rule(r"pin\.(\d\d)\.in-not", r"digin\.(\d+)\.in-not")
def _(step, phase, i):
    step.sim(f"pin {i + 1} {coded(i, phase):d}")
    step.shows(not coded(i, phase))


@OUTPUTS.rule(r"pin\.(\d\d)\.out")
def _(step, phase, i):
    step.set(coded(i, phase))
    step.device("latch", i, coded(i, phase))


@OUTPUTS.rule(r"pin\.(\d\d)\.out-fb")
def _(step, phase, i):
    step.shows(coded(i, phase))


# of two names the one that changed last counts: all are true first
@OLD_OUTPUTS.rule(r"digout\.(\d+)\.out")
def _(step, phase, i):
    value = coded(i, phase - 1) if phase else True
    step.set(value)
    step.device("latch", i, value)


@INVERTED.rule(r"pin\.(\d\d)\.out-invert")
def _(step, phase, i):
    step.set(False, f"pin.{i:02d}.out")
    step.set(False, f"digout.{i}.out")
    step.set(coded(i, phase))
    step.device("latch", i, coded(i, phase))


@COUNTERS.rule(r"counter\.(\d+)\.value")
def _(step, phase, i):
    # two names a counter, and it is moved once
    step.sim(f"field pin.counter {i} {1000 * phase + i + 1}")
    step.shows(1000 * phase + i + 1)


@RESET.rule(r"counter\.reset")
def _(step, phase):
    step.press(not phase)
    if phase:
        step.sim("field pin.counter 7 44")
    step.shows(44 if phase else 0, "counter.07.value")


def analog(i, phase):
    return 100 + 300 * i + 700 * (phase % 2)


def analog_value(i, phase):
    return analog(i, phase) * VOLT * (i + 2 + phase) - (i + 0.5 * phase)


@ANALOG.rule(r"adc\.(\d\d)\.raw")
def _(step, phase, i):
    step.sim(f"analog {41 + i} {analog(i, phase)}")
    step.shows(analog(i, phase))


@ANALOG.rule(r"adcin\.(\d+)\.value-raw")
def _(step, phase, i):
    step.shows(analog(i, phase) * VOLT)


@ANALOG.rule(r"(?:adc|adcin)\.(\d+)\.value")
def _(step, phase, i):
    step.shows(analog_value(i, phase))


# two names on one value: each has its turn
def _turn(step, phase, old, i, value):
    if phase // 2 == old:
        step.set(value)
        step.shows(analog_value(i, phase), f"adc.{i:02d}.value")


@ANALOG.rule(r"adc\.(\d\d)\.scale")
def _(step, phase, i):
    _turn(step, phase, False, i, i + 2.0 + phase)


@ANALOG.rule(r"adcin\.(\d+)\.scale")
def _(step, phase, i):
    _turn(step, phase, True, i, i + 2.0 + phase)


@ANALOG.rule(r"adc\.(\d\d)\.offset")
def _(step, phase, i):
    _turn(step, phase, False, i, i + 0.5 * phase)


@ANALOG.rule(r"adcin\.(\d+)\.offset")
def _(step, phase, i):
    _turn(step, phase, True, i, i + 0.5 * phase)


def enable_pwm(m):
    set_all(m, {f"pwm.{i:02d}.enable": True for i in range(6)})


PWM = Act("PWM", phases=4, before=enable_pwm)


# value, scale, offset, least and most in the four phases; what comes of them in ticks
PWM_STEPS = [(10, 100, 0, 0, 1), (20, 50, 0.125, 0, 1), (5, 100, 0, 0.5, 0.75),
             (95, 100, 0, 0.5, 0.75)]


def duty(i, phase):
    value, scale, offset, least, most = PWM_STEPS[phase]
    value += i if phase < 2 else 0
    return min(max(value / scale + offset, least), most)


def _pwm(step, phase, i, value):
    step.set(value)
    step.device("pwm.duty", i, round(TICKS * duty(i, phase)))


@PWM.rule(r"pwm\.(\d\d)\.value")
def _(step, phase, i):
    _pwm(step, phase, i, float(PWM_STEPS[phase][0] + (i if phase < 2 else 0)))


@PWM.rule(r"pwm\.(\d\d)\.scale")
def _(step, phase, i):
    _pwm(step, phase, i, float(PWM_STEPS[phase][1]))


@PWM.rule(r"pwm\.(\d\d)\.offset")
def _(step, phase, i):
    _pwm(step, phase, i, float(PWM_STEPS[phase][2]))


@PWM.rule(r"pwm\.(\d\d)\.min-dc")
def _(step, phase, i):
    _pwm(step, phase, i, float(PWM_STEPS[phase][3]))


@PWM.rule(r"pwm\.(\d\d)\.max-dc")
def _(step, phase, i):
    _pwm(step, phase, i, float(PWM_STEPS[phase][4]))


@PWM.rule(r"pwm\.(\d\d)\.duty")
def _(step, phase, i):
    step.shows(round(TICKS * duty(i, phase)) / TICKS)


PWM_OFF = Act("PWM channels that nobody has enabled", phases=1)


@PWM_OFF.rule(r"pwm\.(\d\d)\.enabled", r"adcout\.deb\.outv")
def _(step, phase, i=None):
    step.shows(0 if i is None else False)


def prepare_pwm(m):
    value, scale, offset, least, most = PWM_STEPS[3]
    values = {"pwm.frequency": 25e6 / TICKS}
    for i in range(6):
        values |= {f"pwm.{i:02d}.value": value, f"pwm.{i:02d}.scale": scale,
                   f"pwm.{i:02d}.offset": offset, f"pwm.{i:02d}.min-dc": least,
                   f"pwm.{i:02d}.max-dc": most}
    set_all(m, values)


PWM_ON = Act("PWM enabled", phases=3, before=prepare_pwm)


# once enabled a channel stays so, with duty 0
@PWM_ON.rule(r"pwm\.(\d\d)\.enable")
def _(step, phase, i):
    on = coded(i, phase)
    step.set(on)
    step.device("pwm.duty", i, round(TICKS * duty(i, 3)) if on else 0)


@PWM_ON.rule(r"pwm\.(\d\d)\.enabled")
def _(step, phase, i):
    step.shows(any(coded(i, k) for k in range(phase + 1)))


@PWM_ON.rule(r"adcout\.deb\.outv")
def _(step, phase):
    step.shows(sum(any(coded(i, k) for k in range(phase + 1)) << i for i in range(6)))


ACTS = [INPUTS, OUTPUTS, OLD_OUTPUTS, INVERTED, COUNTERS, RESET, ANALOG, PWM_OFF, PWM_ON, PWM]
