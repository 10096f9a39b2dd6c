# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for what moves an axis: commands, homing, probing, by both names."""
from every_axis import AXES, SCALE, prepare
from every_io import coded
from every_name import Act, more
from every_play import set_all


# the engine runs when there is an axis to drive
def prepare_one(m):
    prepare(m)
    set_all(m, {"joint.00.enable": True})


MACHINE = Act("machine on", phases=2, before=prepare_one)
ENABLE = Act("axes enabled", phases=4)


@MACHINE.rule(r"machine-is-on")
def _(step, phase):
    step.press(bool(phase))
    step.device("engine.state", 0, 3 if phase else 0)


@MACHINE.rule(r"machine-on-permitted")
def _(step, phase):
    step.shows(bool(phase))


@MACHINE.rule(r"PEv2\.PulseEngineStateSetup", r"PEv2\.PulseEngineState", r"engine-state")
def _(step, phase):
    step.shows(3 if phase else 0)


@ENABLE.rule(r"joint\.(\d\d)\.enable")
def _(step, phase, i):
    step.set(coded(i, phase))
    step.shows(coded(i, phase), f"PEv2.{i}.digin.AxisEnabled.in")


@ENABLE.rule(r"joint\.(\d\d)\.enabled", r"PEv2\.(\d)\.digin\.AxisEnabled\.in",
             r"PEv2\.(\d)\.deb\.doMove")
def _(step, phase, i):
    step.shows(coded(i, phase))


@ENABLE.rule(r"PEv2\.AxisEnabledMask")
def _(step, phase):
    step.shows(sum(coded(i, phase) << i for i in range(AXES)))


def enable_all(m):
    set_all(m, {f"joint.{i:02d}.enable": True for i in range(AXES)})


MOVE = Act("axes go to a place", phases=2, before=enable_all)
FAST = Act("axes go at a speed", phases=2)
REFUSED = Act("a command that is no place", phases=2)


def place(i, phase):
    return (i + 1) * (0.5 if phase % 2 else -0.25) + phase


def counts(i, phase):
    return round(SCALE * place(i, phase))


@MOVE.rule(r"joint\.(\d\d)\.pos-cmd")
def _(step, phase, i):
    step.set(place(i, phase))
    step.device("axis.reference", i, counts(i, phase))
    step.device("axis.pulses", i, counts(i, phase))


@MOVE.rule(r"joint\.(\d\d)\.in-position", r"PEv2\.(\d)\.deb\.inposition")
def _(step, phase, i):
    step.shows(True)


@MOVE.rule(r"PEv2\.(\d)\.(?:ReferencePosition|ReferencePositionSpeed)")
def _(step, phase, i):
    step.shows(counts(i, phase) % 2 ** 32)


@MOVE.rule(r"PEv2\.(\d)\.deb\.(?:RefPos|RefPosSpeed)")
def _(step, phase, i):
    step.shows(counts(i, phase))


# a way so long that nobody arrives
def speed(i, phase):
    return 2.0 + i + 5 * phase


@FAST.rule(r"joint\.(\d\d)\.vel-cmd")
def _(step, phase, i):
    step.set(speed(i, phase) * (-1 if phase else 1))
    step.set(-1e5 if phase else 1e5, f"joint.{i:02d}.pos-cmd")
    step.device("axis.speed", i, near(speed(i, phase) * SCALE / 1000 * (-1 if phase else 1)),
                state=phase)


# the device has 65536 parts of the highest speed
def near(value):
    class Near(float):
        def __call__(self, have):
            return abs(have - self) <= 0.002 * abs(self)
    return Near(value)


@FAST.rule(r"joint\.(\d\d)\.in-position", r"PEv2\.(\d)\.deb\.inposition")
def _(step, phase, i):
    step.shows(False)


@MOVE.rule(r"joint\.(\d\d)\.following-error")
def _(step, phase, i):
    step.shows(0)


# the command is far away
@FAST.rule(r"joint\.(\d\d)\.following-error")
def _(step, phase, i):
    step.shows((lambda have: have < -9e4) if phase else (lambda have: have > 9e4), state=phase)


@FAST.rule(r"PEv2\.(\d)\.ReferenceSpeed")
def _(step, phase, i):
    step.shows(round(speed(i, phase) * SCALE))


@FAST.rule(r"PEv2\.(\d)\.deb\.RefSpeed")
def _(step, phase, i):
    step.shows(speed(i, phase) * SCALE * (-1 if phase else 1))


@REFUSED.rule(r"joint\.(\d\d)\.refused")
def _(step, phase, i):
    step.set(0.0, f"joint.{i:02d}.vel-cmd")
    step.set(1.0 if phase else 1e300, f"joint.{i:02d}.pos-cmd")
    step.shows(not phase)


@REFUSED.rule(r"input-refused")
def _(step, phase):
    step.shows(not phase)


@REFUSED.rule(r"input-refused-count")
def _(step, phase):
    if not phase:
        step.changes(more)


FEWER = Act("an axis that the device has not got", phases=2)


@FEWER.rule(r"command-refused")
def _(step, phase):
    step.sim(f"field engine.axes 0 {8 if phase else 5}")
    step.shows(not phase)


@FEWER.rule(r"command-refused-count")
def _(step, phase):
    if not phase:
        step.changes(more)


OVERRIDE = Act("limit override", phases=2)
OVERRIDE_OLD = Act("limit override, older name", phases=2,
                   before=lambda m: set_all(m, {"legacy.limit-override-follows": True}))
OVERRIDE_FOLLOWS = Act("limit override, older name followed or not", phases=2)


@OVERRIDE.rule(r"engine\.limit-override")
def _(step, phase):
    step.set(not phase)
    step.device("engine.override", 0, 1 - phase)


@OVERRIDE.rule(r"engine\.limit-override-active", r"PEv2\.(?:\d)\.digout\.LimitOverride\.out")
def _(step, phase):
    step.shows(not phase)


@OVERRIDE.rule(r"PEv2\.LimitOverride")
def _(step, phase):
    step.shows(1 - phase)


@OVERRIDE_OLD.rule(r"PEv2\.LimitOverrideSetup")
def _(step, phase):
    step.set(1 - phase)
    step.device("engine.override", 0, 1 - phase)


@OVERRIDE_FOLLOWS.rule(r"legacy\.limit-override-follows")
def _(step, phase):
    step.set(1, "PEv2.LimitOverrideSetup")
    step.set(bool(phase))
    step.device("engine.override", 0, phase)



ACTS = [MACHINE, ENABLE, MOVE, FAST, REFUSED, FEWER, OVERRIDE, OVERRIDE_OLD, OVERRIDE_FOLLOWS]
