# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for what hangs on the pulse engine: backlash, PoStep drivers, what follows an axis."""
from every_axis import AXES, SCALE, prepare
from every_name import Act, more
from every_play import set_all

SYNCED = Act("outputs that follow an axis", phases=2)


@SYNCED.rule(r"synced-(pwm|out)\.(enable|axis|channel)")
def _(step, phase, what, part):
    values = {"enable": (1, 0), "axis": (3, 5), "channel": (2, 4)}
    step.set(values[part][phase])
    step.device({"pwm": "engine.synced-pwm", "out": "engine.synced-outputs"}[what],
                list(values).index(part), values[part][phase])


@SYNCED.rule(r"synced-out\.pin\.(\d\d)")
def _(step, phase, i):
    value = 30 + i if phase else 92 + i
    step.set(value)
    step.device("engine.synced-pins", i, value)


PLAY = Act("backlash", phases=2, before=prepare)
PLAY_OLD = Act("backlash, older names", phases=2, before=lambda m: set_all(
    m, {"PEv2.params.ApplyIniSettings": True}))


def half(step, i, pulses):
    """Half of the play stands in the device."""
    step.device("engine.backlash", 4 * i, pulses % 256)
    step.device("engine.backlash", 4 * i + 1, pulses // 256)


@PLAY.rule(r"engine\.backlash")
def _(step, phase):
    step.set(1 - phase)
    step.device("engine.backlash-enable", 0, 1 - phase)


@PLAY.rule(r"rate\.backlash")
def _(step, phase):
    step.shows(0 if phase else (lambda have: have > 0), state="some")


@PLAY.rule(r"engine\.backlash-speed")
def _(step, phase):
    step.set(50 + phase)
    step.device("engine.backlash-speed", 0, 50 + phase)


@PLAY.rule(r"joint\.(\d\d)\.backlash-width")
def _(step, phase, i):
    pulses = 300 + i + 100 * phase
    step.set(2 * pulses / SCALE)
    half(step, i, pulses)


@PLAY.rule(r"joint\.(\d\d)\.backlash-acceleration")
def _(step, phase, i):
    value = 1 + i + 20 * phase
    step.set(value * 1e6 / SCALE)
    step.device("engine.backlash", 4 * i + 2, value)


@PLAY_OLD.rule(r"PEv2\.BacklashCompensationEnabled")
def _(step, phase):
    step.set(phase)
    step.device("engine.backlash-enable", 0, phase)


@PLAY_OLD.rule(r"PEv2\.(\d)\.BacklashWidth")
def _(step, phase, i):
    step.set(20 + i + 10 * phase)
    half(step, i, 20 + i + 10 * phase)


@PLAY_OLD.rule(r"PEv2\.(\d)\.BacklashAcceleration")
def _(step, phase, i):
    step.set(3 + i + 10 * phase)
    step.device("engine.backlash", 4 * i + 2, 3 + i + 10 * phase)


def switch_on(m):
    set_all(m, {f"joint.{i:02d}.enable": True for i in range(AXES)})
    set_all(m, {"machine-is-on": True})
    m.hal.becomes("joint.07.enabled", True)


# as they were set last, half to either side
TAKEN = Act("backlash that is taken up", phases=2, before=switch_on)


@TAKEN.rule(r"joint\.(\d\d)\.backlash-taken")
def _(step, phase, i):
    step.set(-3.0 if phase else 3.0, f"joint.{i:02d}.pos-cmd")
    step.shows((30 + i) * (-1 if phase else 1))


@TAKEN.rule(r"PEv2\.(\d)\.BacklashRegister")
def _(step, phase, i):
    step.shows((30 + i) * (-1 if phase else 1) % 2 ** 32)


# none; drivers; others at other addresses, which say something else
DRIVERS = Act("PoStep drivers", phases=3)


@DRIVERS.rule(r"engine\.postep")
def _(step, phase):
    step.set(min(phase, 1))
    step.device("engine.postep", 0, min(phase, 1))


@DRIVERS.rule(r"rate\.postep(?:-rare)?")
def _(step, phase):
    step.shows(0 if not phase else (lambda have: have > 0), state="some")


@DRIVERS.rule(r"joint\.(\d\d)\.postep\.(type|address|step-mode|temperature-limit)")
def _(step, phase, i, what):
    if not phase:
        return
    value, (field, index) = {
        "type": (phase, ("engine.postep-drivers", 3 * i)),
        "address": (33 + i + 20 * (phase - 1), ("engine.postep-drivers", 3 * i + 1)),
        "step-mode": ((i + phase) % 9, ("postep.step", i)),
        "temperature-limit": (60 + i + 10 * phase, ("postep.limit", i))}[what]
    if what == "address":
        step.sim(f"field postep.address {i} {value}")
    step.set(value)
    step.device(field, index, value)


# what the driver has, in its own units: field, number in it, and value
TOLD = {"supply": ("supply", 0, lambda i, phase: 90 + 3 * i + phase),
        "temperature": ("temperature", 0, lambda i, phase: 30 + 3 * i + phase),
        "state": ("state", 0, lambda i, phase: (i + phase) % 5 + 1),
        "inputs": ("inputs", 0, lambda i, phase: (17 * i + 64 * phase) % 256),
        "faults": ("faults", 0, lambda i, phase: 0x55 + i if phase == 1 else ~(0x55 + i) & 0xff),
        "current-raw": ("current", 0, lambda i, phase: 3000 + 10 * i + phase),
        "current-idle-raw": ("current", 1, lambda i, phase: 2000 + 10 * i + phase),
        "current-overheat-raw": ("current", 2, lambda i, phase: 1000 + 10 * i + phase)}
WIDTH = {"current": 3}


@DRIVERS.rule(r"joint\.(\d\d)\.postep\.(" + "|".join(TOLD) + ")")
def _(step, phase, i, what):
    if phase:
        field, k, value = TOLD[what]
        step.sim(f"field postep.{field} {WIDTH.get(field, 1) * i + k} {value(i, phase)}")
        step.shows(value(i, phase) / (4 if what == "supply" else 1))


@DRIVERS.rule(r"joint\.(\d\d)\.postep\.fault")
def _(step, phase, i):
    step.shows(phase > 0)


@DRIVERS.rule(r"joint\.(\d\d)\.postep\.(hardware|firmware)")
def _(step, phase, i, what):
    first = 4 * i + 2 * (what == "firmware")
    if phase:
        step.sim(f"field postep.version {first} {phase + i}")
        step.sim(f"field postep.version {first + 1} {3 * phase + i}")
        step.shows(100 * (phase + i) + 3 * phase + i)


@DRIVERS.rule(r"joint\.(\d\d)\.postep\.updates")
def _(step, phase, i):
    if phase:
        step.changes(more)


@DRIVERS.rule(r"joint\.(\d\d)\.postep\.age-ms")
def _(step, phase, i):
    step.shows((lambda have: have >= 0) if phase else -1, state="some")


ACTS = [SYNCED, PLAY, PLAY_OLD, TAKEN]
POSTEP = [DRIVERS]
