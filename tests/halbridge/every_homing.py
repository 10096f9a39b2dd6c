# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for homing, with switches on the bench, and for hand wheels the device follows."""
from every_axis import AXES, SCALE, prepare
from every_motion import near
from every_name import Act, Step
from every_play import carry_out, set_all


def bench(m):
    """Home switches at the lower end."""
    prepare(m)
    for i in range(AXES):
        m.inside.ask(f"switch {i} home -1000000 {-300 - 10 * i}")
    set_all(m, {"machine-is-on": True})
    m.hal.becomes("machine-on-permitted", True, limit=60)


MASK = Act("homing by a mask", phases=2, before=bench)


def bench_at_once(m):
    """As LinuxCNC's homing does it: the command of all axes comes in the same period."""
    bench(m)
    m.link("commands", *(f"PEv2.{i}.AxesCommand" for i in range(AXES)))


COMMAND = Act("homing by commands", phases=7, before=bench_at_once)
PRESET = Act("positions that are set", phases=2, before=prepare)


@MASK.rule(r"PEv2\.HomingStartMaskSetup")
def _(step, phase):
    mask = (0, 0xff)[phase]
    step.press(mask)
    step.device("engine.home-mask", 0, mask)
    step.shows(0)       # told once


@MASK.rule(r"joint\.(\d\d)\.homed")
def _(step, phase, i):
    step.shows(bool(phase))


@MASK.rule(r"PEv2\.(\d)\.HomeOffsets")
def _(step, phase, i):
    step.set(50 + i + 100 * phase)
    step.device("axis.home-offset", i, 50 + i + 100 * phase if phase else 0)


WORDS = (0, 1, 6, 2, 4, 4, 0)
STATUS = (0, 1, 6, 3, 4, 4, 0)


@COMMAND.rule(r"PEv2\.(\d)\.AxesCommand")
def _(step, phase, i):
    step.set(WORDS[phase])
    step.shows(STATUS[phase], f"PEv2.{i}.HomingStatus")
    if phase == 3:      # ZeroPosition
        step.device("axis.pulses", i, 0)


# the home position is too far to arrive
@COMMAND.rule(r"PEv2\.(\d)\.stepgen\.HOME-FINAL-VEL")
def _(step, phase, i):
    speed = 3.0 + i + 8 * (phase == 5)
    step.set(10000000, f"PEv2.{i}.HomePosition")
    step.set(True, f"joint.{i:02d}.enable")
    step.set(speed)
    if phase in (4, 5):
        step.device("axis.speed", i, near(speed * SCALE / 1000), state=phase)


@COMMAND.rule(r"PEv2\.(\d)\.HomingStatus")
def _(step, phase, i):
    step.shows(STATUS[phase])


@COMMAND.rule(r"PEv2\.(\d)\.AxesState")
def _(step, phase, i):
    if 0 < phase < 4:
        step.shows((None, 3, 4, 18)[phase])


@COMMAND.rule(r"PEv2\.(\d)\.deb\.PosMode")
def _(step, phase, i):
    # no reference is sent while an axis is being homed
    if phase in (0, 1):
        step.shows(not phase)


@COMMAND.rule(r"PEv2\.(\d)\.index-enable")
def _(step, phase, i):
    if phase == 2:
        step.set(True)
        step.shows(True)
    if phase == 3:
        step.shows(False)


def preset(i, phase):
    return (1000 * (i + 1) + phase) * (-1 if phase else 1)


@PRESET.rule(r"PEv2\.(\d)\.PositionSetup")
def _(step, phase, i):
    step.press(preset(i, phase))
    step.device("axis.pulses", i, preset(i, phase))


@PRESET.rule(r"PEv2\.(\d)\.CurrentPosition")
def _(step, phase, i):
    step.shows(preset(i, phase))


@PRESET.rule(r"joint\.(\d\d)\.pos-fb", r"PEv2\.(\d)\.joint-pos-fb")
def _(step, phase, i):
    step.shows(preset(i, phase) / SCALE)


def bench_of_one_group(m):
    """All axes are one group, and their switches so far away that nobody finds them."""
    bench(m)
    for i in range(AXES):
        m.inside.ask(f"switch {i} home -2000000000 -8000000",
                     f"switch {i} minus -2000000000 -9000000")
    set_all(m, {f"joint.{i:02d}.home-group": 1 for i in range(AXES)})


def wheels(m):
    """One of them, for the first axis."""
    set_all(m, {"encoder.05.sampling": 4, "joint.00.mpg-encoder": 6,
                "joint.00.mpg-multiplier": 10, "joint.00.mpg-divider": 1})
    step = Step({})
    step.device("axis.block", 7, 6)
    carry_out(m, step)
    bench(m)


BY_PIN = Act("homing by pins, cancelled", phases=3, before=bench_of_one_group)
WHEELS = Act("hand wheels that the device follows", phases=3, before=wheels)


@BY_PIN.rule(r"joint\.(\d\d)\.home")
def _(step, phase, i):
    step.press(phase == 1)
    step.shows(phase == 1, f"joint.{i:02d}.homing")


@BY_PIN.rule(r"joint\.(\d\d)\.home-offset")
def _(step, phase, i):
    step.set(0.5 + i)
    if phase == 1:
        step.device("axis.home-offset", i, round(SCALE * (0.5 + i)))


@BY_PIN.rule(r"joint\.(\d\d)\.homing", r"homing\.active")
def _(step, phase, *_):
    step.shows(phase == 1)


@BY_PIN.rule(r"homing\.phase")
def _(step, phase):
    step.shows(3 if phase == 1 else 0)


@BY_PIN.rule(r"homing\.error")
def _(step, phase):
    if phase != 1:      # begun: it tells how the one before has ended
        step.shows(phase)


@BY_PIN.rule(r"homing\.cancel")
def _(step, phase):
    step.set(phase == 2)
    step.shows(phase == 1, "homing.active")


@WHEELS.rule(r"engine\.mpg-jog")
def _(step, phase):
    step.press(phase == 1)
    step.device("engine.state", 0, 10 if phase == 1 else (lambda have: have != 10))


# all of one number, cancelled, each of its own, too late; begun by the pin of one
GROUPS = Act("homing by groups", phases=4)


@GROUPS.rule(r"joint\.(\d\d)\.home-group")
def _(step, phase, i):
    step.press(phase in (0, 2), "joint.00.home")
    step.set(phase == 1, "homing.cancel")
    step.set(i if phase > 1 else 8)
    if phase % 2 == 0:
        step.device("engine.home-mask", 0, 1 if phase else 0xff)


@GROUPS.rule(r"joint\.(\d\d)\.home-offset")
def _(step, phase, i):
    step.set(2.5 + i)
    if phase == 0:
        step.device("axis.home-offset", i, round(SCALE * (2.5 + i)))


@GROUPS.rule(r"homing\.time-limit")
def _(step, phase):
    step.set(0.5 if phase > 1 else 300.0)
    if phase % 2:
        step.shows(3 if phase > 1 else 2, "homing.error")


# by commands: axes of one number are told at once, one of another number waits
SEQUENCES = Act("homing by sequences", phases=4, before=lambda m: (
    bench_of_one_group(m), m.link("commands", *(f"PEv2.{i}.AxesCommand" for i in range(AXES)))))


@SEQUENCES.rule(r"PEv2\.(\d)\.home-sequence")
def _(step, phase, i):
    step.press((1, 5, 1, 0)[phase], "PEv2.0.AxesCommand")
    step.set(2 + i if phase > 1 else 1)
    if phase % 2 == 0:
        step.device("engine.home-mask", 0, 1 if phase else 0xff)
    else:
        step.shows(0, f"PEv2.{i}.HomingStatus")


ACTS = [PRESET, COMMAND]
MASKS = [MASK]
PINS = [BY_PIN, GROUPS]
GROUPED = [SEQUENCES]
JOG = [WHEELS]
