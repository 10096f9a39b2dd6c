# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for probing, by both names. Terminals 13 and 14 are the probe's, and so are the
engine's inputs 1 and 2; axes stand in different places, so that none could be another's."""
from every_axis import AXES, SCALE, place_axes, prepare
from every_motion import near
from every_name import Act
from every_play import set_all

FAR = 1000000     # pulses


def place(i):
    return 1000 * i


def bench(m):
    set_all(m, {"pin.12.function": 2, "pin.13.function": 2})
    prepare(m)
    m.inside.ask("pin 13 0", "pin 14 0")
    place_axes(m, {i: place(i) for i in range(AXES)})
    m.hal.becomes("joint.07.pos-fb", place(7) / SCALE)
    set_all(m, {f"joint.{i:02d}.{name}": value for i in range(AXES)
                for name, value in (("pos-cmd", place(i) / SCALE), ("enable", True))})
    set_all(m, {"machine-is-on": True})
    m.hal.becomes("machine-on-permitted", True)
    m.hal.becomes("joint.07.enabled", True)


# what touches: terminal 13, 14, engine's input 1, 2, and 2 the other way round
CONTACT = Act("what the probe touches with", phases=5, before=bench)
TOUCHES = (True, False, True, False, True)


def contact(step, phase):
    for command in ("pin 13 1", "pin 14 0", "input 1 1", "input 2 0"):
        step.sim(command)
    step.shows(TOUCHES[phase], None if step.name == "probe.contact" else "probe.contact")


@CONTACT.rule(r"probe\.terminal")
def _(step, phase):
    step.set((13, 14, 0, 0, 0)[phase])
    contact(step, phase)


@CONTACT.rule(r"probe\.engine-input")
def _(step, phase):
    step.set((0, 0, 1, 2, 2)[phase])
    contact(step, phase)


@CONTACT.rule(r"probe\.active-high")
def _(step, phase):
    step.set(phase < 4)
    contact(step, phase)


@CONTACT.rule(r"probe\.contact")
def _(step, phase):
    contact(step, phase)


# at rest, under way, cancelled, under way, touched, begun and too late, at rest; axes are
# disabled, and enabled again, for hybrid probing watches them move; watching, touched
PROBE = Act("probing", phases=11)
STARTS = (False, True, False, True, False, True, False, False, False, True, False)
ACTIVE_IN = (1, 3, 9)
TOUCHED, LATE, DISABLED, ENABLED, HYBRID, LAST = 4, 5, 7, 8, 9, 10


# what was asked for in the last of them is seen when its time is over: that is short
def moves(phase):
    return phase in (1, 3, 5)


def ratio(phase):
    return 0.1 if phase < 3 else 0.2


def mask(phase):
    return 0x7f if phase in (3, TOUCHED) else 0xff


@PROBE.rule(r"probe\.start")
def _(step, phase):
    step.set(13, "probe.terminal")
    step.set(True, "probe.active-high")
    step.sim(f"pin 13 {phase in (TOUCHED, LAST):d}")
    if phase in (DISABLED, ENABLED):
        for i in range(AXES):
            step.set(phase == ENABLED, f"joint.{i:02d}.enable")
            step.shows(phase == ENABLED, f"joint.{i:02d}.enabled")
    step.press(STARTS[phase])
    step.shows(phase in ACTIVE_IN, "probe.active")


@PROBE.rule(r"probe\.active")
def _(step, phase):
    step.shows(phase in ACTIVE_IN)


@PROBE.rule(r"probe\.cancel")
def _(step, phase):
    step.set(phase == 2)
    if phase in (1, 2):
        step.shows(phase == 1, "probe.active")


@PROBE.rule(r"probe\.done")
def _(step, phase):
    step.shows(phase in (TOUCHED, LAST))


@PROBE.rule(r"probe\.error")
def _(step, phase):
    step.shows(2 if phase == 2 else 3 if LATE <= phase <= ENABLED else 0)


@PROBE.rule(r"probe\.time-limit")
def _(step, phase):
    step.set(0.5 if TOUCHED < phase < HYBRID else 300.0)
    if phase in (TOUCHED, LATE):
        step.shows(3 if phase == LATE else 0, "probe.error")


@PROBE.rule(r"probe\.hybrid")
def _(step, phase):
    step.set(phase >= HYBRID)
    if phase in (3, HYBRID):
        step.device("engine.state", 0, 3 if phase == HYBRID else 31)


@PROBE.rule(r"probe\.axes")
def _(step, phase):
    step.set(mask(phase))
    if moves(phase):
        step.device("engine.probe-mask", 0, mask(phase))


@PROBE.rule(r"probe\.speed")
def _(step, phase):
    step.set(ratio(phase))
    if phase in (1, 3):
        step.device("axis.speed", 0, near(ratio(phase) * 200 * SCALE / 1000), state=phase)


@PROBE.rule(r"joint\.(\d\d)\.probe-target")
def _(step, phase, i):
    target = place(i) + FAR * (1 if phase < 5 else 2)
    step.set(target / SCALE)
    if moves(phase) and mask(phase) >> i & 1:
        step.device("axis.target", i, target)


@PROBE.rule(r"joint\.(\d\d)\.probed")
def _(step, phase, i):
    if phase in (0, TOUCHED, LAST):
        step.shows(phase == LAST or phase == TOUCHED and i < 7)


@PROBE.rule(r"joint\.(\d\d)\.probe-pos")
def _(step, phase, i):
    if phase in (0, TOUCHED, LAST):
        step.follows("engine.probe-position", i, lambda pulses: pulses / SCALE)


@PROBE.rule(r"engine\.probe-status")
def _(step, phase):
    if phase in (0, TOUCHED, LAST):
        step.shows({0: 0, TOUCHED: 0x7f, LAST: 0xff}[phase])


# two terminals in turn, one that is true when it touches and one that is false
ENGINE = Act("probing by the older names", phases=6, before=bench)
PINS, ACTIVE, MASKS, RATIOS = (13, 14, 13), (1, 0, 1), (0xff, 0x0f, 0xf0), (0.1, 0.2, 0.1)


def old(phase):
    return phase // 2


@ENGINE.rule(r"PEv2\.ProbeStartMaskSetup")
def _(step, phase):
    # a level at which none of the two touches, and then one of them
    step.sim(f"pin 13 {phase in (1, 5):d}")
    step.sim(f"pin 14 {phase == 2:d}")
    step.press(0 if phase % 2 else MASKS[old(phase)])
    step.device("engine.probe-mask", 0, MASKS[old(phase)])
    if phase % 2 == 0:
        step.device("engine.state", 0, 31)
    step.shows(0)


@ENGINE.rule(r"PEv2\.ProbeSpeed")
def _(step, phase):
    step.set(RATIOS[old(phase)])
    if phase in (0, 2):
        step.device("axis.speed", 0, near(RATIOS[old(phase)] * 200 * SCALE / 1000), state=phase)


@ENGINE.rule(r"PEv2\.(\d)\.ProbeMaxPosition")
def _(step, phase, i):
    target = place(i) + FAR * (1 + old(phase))
    step.set(target)
    if phase % 2 == 0 and MASKS[old(phase)] >> i & 1:
        step.device("axis.target", i, target)


@ENGINE.rule(r"PEv2\.digin\.Probe\.Pin")
def _(step, phase):
    step.set(PINS[old(phase)])
    if phase % 2:
        step.shows(MASKS[old(phase)], "PEv2.ProbeStatus")


@ENGINE.rule(r"PEv2\.digin\.Probe\.invert")
def _(step, phase):
    step.set(ACTIVE[old(phase)])
    if phase % 2:
        step.shows(MASKS[old(phase)], "PEv2.ProbeStatus")


@ENGINE.rule(r"PEv2\.ProbeStatus")
def _(step, phase):
    if phase % 2:
        step.shows(MASKS[old(phase)])


@ENGINE.rule(r"PEv2\.(\d)\.ProbePosition")
def _(step, phase, i):
    if phase % 2:
        step.follows("engine.probe-position", i, lambda pulses: pulses % 2 ** 32)


ACTS = [CONTACT, PROBE]
OLD = [ENGINE]
