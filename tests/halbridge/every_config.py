# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for how settings are taken: refused, counted, saved; and for those that older
names make of something else."""
from every_name import Act, more
from every_play import set_all

TAKEN = Act("settings that are taken, and some that are not", phases=3,
            before=lambda m: set_all(m, {"joint.01.axis-enable": 1}))
FOREIGN = Act("a setting that another program writes", phases=2)
SAVED = Act("settings are saved", phases=2)


@TAKEN.rule(r"config\.generation(?:-applied)?")
def _(step, phase):
    step.set((2, 4, 2)[phase], "pin.30.function")
    step.changes(more)


# one soft limit beyond the other, and then no more
@TAKEN.rule(r"config\.refused")
def _(step, phase):
    if phase:
        step.set(10.0, "joint.01.soft-min")
        step.set((5.0, 20.0)[phase - 1], "joint.01.soft-max")
    step.shows((0, 8, 0)[phase])


@TAKEN.rule(r"config\.refused-index")
def _(step, phase):
    step.shows((0, 1, 0)[phase])


@TAKEN.rule(r"config\.input-refused")
def _(step, phase):
    step.set(256 if phase == 2 else 2, "pin.20.function")
    step.shows(int(phase == 2))


@FOREIGN.rule(r"config\.foreign-count")
def _(step, phase):
    if phase:
        step.sim("field pin.function 30 0")
    step.shows(phase)


@SAVED.rule(r"config\.save")
def _(step, phase):
    step.press(bool(phase))
    step.device("saves", 0, (lambda have: have > 0) if phase else 0, state="saved")


EMERGENCY = Act("an output for the emergency", phases=4, before=lambda m: set_all(
    m, {"PEv2.params.ApplyIniSettings": True, "legacy.emergency-out-follows": True}))
PINS = (31, 33)


def emergency(step, phase):
    """Two pins in turn, each off and on."""
    step.device("latch", PINS[phase // 2] - 1, phase % 2)


@EMERGENCY.rule(r"PEv2\.digout\.Emergency\.Pin")
def _(step, phase):
    step.set(PINS[phase // 2])
    step.device("latch", PINS[1] - 1, int(phase == 3))


@EMERGENCY.rule(r"PEv2\.digout\.Emergency\.out")
def _(step, phase):
    step.set(bool(phase % 2))
    emergency(step, phase)


FOLLOWED = Act("an output for the emergency, followed or not", phases=2)


@FOLLOWED.rule(r"legacy\.emergency-out-follows")
def _(step, phase):
    step.set(bool(phase))
    step.set(True, "PEv2.digout.Emergency.out")
    step.device("latch", PINS[1] - 1, phase)


APPLY = Act("older settings applied or not", phases=2)


@APPLY.rule(r"PEv2\.params\.ApplyIniSettings")
def _(step, phase):
    step.set(bool(phase))
    step.press(4 if phase else 2, "pins.9.PinFunction")
    step.device("pin.function", 9, 4 if phase else 0)
    # it would have gone with this one
    step.press(2 + 2 * phase, "pin.10.function")
    step.device("pin.function", 10, 2 + 2 * phase)


PERIOD = Act("period of analog outputs", phases=2, before=lambda m: set_all(
    m, {"legacy.adcout-follows": True, "adcout.1.enable": True, "adcout.1.value": 1.0}))


@PERIOD.rule(r"adcout\.pwm\.period")
def _(step, phase):
    step.set((2000, 4000)[phase])
    step.device("pwm.period", 0, (2000, 4000)[phase])


ACTS = [TAKEN, FOREIGN, SAVED, EMERGENCY, FOLLOWED, APPLY, PERIOD]
