# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for encoders: counts, speeds, and what holds or turns them off."""
from every_name import Act, more
from every_play import set_all


def enable(m):
    set_all(m, {f"encoder.{i:02d}.sampling": 4 for i in range(25)}
            | {"encoder.fast.configuration": 0, "encoder.ultra.enable": 1,
               "encoder.ultra.4x": 1})


COUNT = Act("encoders count", phases=2, before=enable)
SET = Act("counters of encoders are set", phases=2, before=enable)
TURN = Act("encoders turn", phases=2)
HOLD = Act("encoders held at zero", phases=2)
HOLD_OLD = Act("encoders held at zero, older names", phases=2)
FACTOR = Act("scale of encoders that have one name", phases=2)
INDEX = Act("encoders wait for their index", phases=3)
OFF = Act("encoders off", phases=1)


def count(i, phase):
    return 1000 * (i + 1) + 77 if phase % 2 else -50 * (i + 1)


@COUNT.rule(r"encoder\.(1?\d|0\d|2[0-5])\.count")
def _(step, phase, i):
    step.sim(f"encoder {i} count {count(i, phase)}")
    step.shows(count(i, phase))


@COUNT.rule(r"encoder\.(0\d|1\d|2[0-5])\.position")
def _(step, phase, i):
    step.shows(count(i, phase) / (2 + i + phase))


@COUNT.rule(r"encoder\.(0\d|1\d|2[0-5])\.scale")
def _(step, phase, i):
    step.set(2.0 + i + phase)
    step.shows(count(i, phase) / (2 + i + phase), f"encoder.{i:02d}.position")


@COUNT.rule(r"encoder\.(\d)\.position")
def _(step, phase, i):
    step.shows(count(i, phase) * (3 + i + phase))


@COUNT.rule(r"encoder\.(\d)\.scale")
def _(step, phase, i):
    step.set(3.0 + i + phase)
    step.shows(count(i, phase) * (3 + i + phase), f"encoder.{i}.position")


def value(i, phase):
    return -100 * (i + 1) - phase


@SET.rule(r"encoder\.(\d\d)\.set-value")
def _(step, phase, i):
    step.set(value(i, phase))
    step.press(bool(phase), f"encoder.{i:02d}.set")
    step.shows(value(i, 1) if phase else lambda have: have != value(i, 1), f"encoder.{i:02d}.count")


@SET.rule(r"encoder\.(\d\d)\.set")
def _(step, phase, i):
    step.press(bool(phase))
    step.set(value(i, phase), f"encoder.{i:02d}.set-value")
    step.shows(value(i, 1) if phase else lambda have: have != value(i, 1), f"encoder.{i:02d}.count")


# a jump that eight bits do not show
@COUNT.rule(r"encoder-resyncs")
def _(step, phase):
    if phase:
        step.changes(more)


@COUNT.rule(r"encoder\.(0\d|1\d|2[0-5])\.enabled")
def _(step, phase, i):
    step.shows(True)


def rate(i, phase):
    return (400 + 100 * i) * (-1 if phase else 1)


class Near(float):
    """Of a number that is measured: the right sign, and not another encoder's by far."""

    def __call__(self, have):
        return 0.5 * abs(self) < abs(have) < 2 * abs(self) and have * self > 0


@TURN.rule(r"encoder\.(0\d|1\d|2[0-5])\.velocity")
def _(step, phase, i):
    step.sim(f"encoder {i} rate {rate(i, phase)}")
    step.shows(Near(rate(i, phase) / (2 + i + 1)), state=phase)


@TURN.rule(r"encoder\.(\d)\.velocity")
def _(step, phase, i):
    step.shows(Near(rate(i, phase) * (3 + i + 1)), state=phase)


def hold(step, phase, i):
    step.set(not phase)
    step.sim(f"encoder {i} rate 1000")
    step.shows((lambda have: have != 0) if phase else 0, f"encoder.{i:02d}.count", state=phase)


@HOLD.rule(r"encoder\.(0\d|1\d|2[0-5])\.reset")
def _(step, phase, i):
    hold(step, phase, i)


@HOLD_OLD.rule(r"encoder\.(\d)\.reset")
def _(step, phase, i):
    hold(step, phase, i)


@FACTOR.rule(r"legacy\.encoder-factor")
def _(step, phase):
    step.sim(f"encoder 12 count {450 + 150 * phase}")
    step.set(not phase)
    step.shows(600 / 15.0 if phase else 450 * 15.0, "encoder.12.position")


# only the ultra-fast one can be told to wait for it; the others are refused, and wait
@INDEX.rule(r"encoder\.(0\d|1\d|2[0-5]|\d)\.index-enable")
def _(step, phase, i):
    if phase == 1:
        step.sim(f"index {i}")
    else:
        step.set(not phase)
    step.shows(not phase or phase == 1 and i != 25)
    if i == 25 and not phase:
        step.device("encoder.ultra-armed", 0, 1)


@INDEX.rule(r"encoder\.25\.count")
def _(step, phase):
    if phase == 0:
        step.sim("encoder 25 rate 0")
        step.sim("encoder 25 count 5000")
    step.shows(0 if phase else (lambda have: have != 0), state="away")


@OFF.rule(r"encoder\.(0\d|1\d|2[0-5])\.enabled")
def _(step, phase, i):
    step.set(0, "encoder.ultra.enable" if i == 25 else f"encoder.{i:02d}.sampling")
    step.shows(False)


ACTS = [COUNT, FACTOR, SET, TURN, HOLD, HOLD_OLD, INDEX, OFF]
