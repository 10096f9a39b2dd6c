# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for the pulse engine and its axes: what they tell, and what drives them."""
from every_io import coded
from every_name import Act, Step
from every_play import carry_out, set_all

AXES = 8
SCALE = 100.0
POSITION = 1


def prepare(m):
    """Eight axes with switches at their own inputs, none of them tripped."""
    values = {"engine.axes": AXES, "engine.generator": 0, "engine.emergency-pin": 0}
    for i in range(AXES):
        values |= {f"joint.{i:02d}.{name}": value for name, value in {
            "scale": SCALE, "axis-enable": 1, "mode": POSITION,
            "max-velocity": 200, "max-acceleration": 4000, "max-deceleration": 4000,
            "limit-neg-enable": 1, "limit-pos-enable": 1, "home-enable": 1,
            "limit-neg-invert": 0, "homing-speed": 50, "homing-return-speed": 50,
            "homing-on-switch": 3, "homing-off-switch": 8}.items()}
    set_all(m, values)
    for i in range(AXES):
        for what in ("minus", "plus", "home"):
            m.inside.ask(f"raw {i} {what} 0")
    step = Step({})
    step.device("engine.emergency-pin", 0, 0)
    for i in range(AXES):
        step.device("axis.block", 55 * i, 13, 15)       # enabled, planner, position
        step.device("axis.block", 55 * i + 35, 0x83)
    carry_out(m, step)
    m.hal.becomes("config.state", 3, limit=60)


def place_axes(m, places):
    """Where each axis is, in pulses: told by the commander, so that it is the device's own count."""
    set_all(m, {f"PEv2.{i}.PositionSetup": place for i, place in places.items()})
    for i, place in places.items():
        m.hal.becomes(f"PEv2.{i}.CurrentPosition", place)


STANDING = Act("an engine that stands", phases=4, before=prepare)


def state(i, phase):
    """Of an axis: each is homing once, and has probed once."""
    return (8, 14, 1, 20, 12, 14, 30, 16)[(i + phase) % 8]


@STANDING.rule(r"joint\.(\d\d)\.state", r"PEv2\.(\d)\.AxesState")
def _(step, phase, i):
    step.sim(f"field axis.state {i} {state(i, phase)}")
    step.shows(state(i, phase))


@STANDING.rule(r"PEv2\.(\d)\.deb\.ishoming")
def _(step, phase, i):
    step.shows(8 <= state(i, phase) <= 13)


@STANDING.rule(r"PEv2\.(\d)\.digin\.Probe\.in")
def _(step, phase, i):
    step.shows(state(i, phase) == 14)


@STANDING.rule(r"PEv2\.(\d)\.digin\.Probe\.in-not")
def _(step, phase, i):
    step.shows(state(i, phase) != 14)


RAW = {"limit-neg": "minus", "limit-pos": "plus", "home-sw": "home", "LimitN": "minus",
       "LimitP": "plus", "Home": "home", "home": "home"}
TURN = {"minus": 0, "plus": 1, "home": 2}


def raw(i, phase, which):
    return coded((i + TURN[which]) % AXES, phase)


@STANDING.rule(r"joint\.(\d\d)\.(limit-neg|limit-pos|home-sw)",
               r"joint\.(\d\d)\.(limit-neg|limit-pos|home)-dedicated")
def _(step, phase, i, name):
    level = raw(i, phase, RAW[name])
    step.sim(f"raw {i} {RAW[name]} {level:d}")
    step.shows(level)


@STANDING.rule(r"PEv2\.(\d)\.digin\.(LimitN|LimitP|Home)\.(in|in-not|DedicatedInput)")
def _(step, phase, i, name, what):
    step.shows(raw(i, phase, RAW[name]) != (what == "in-not"))


@STANDING.rule(r"joint\.(\d\d)\.error", r"PEv2\.(\d)\.digin\.Error\.in")
def _(step, phase, i):
    step.sim(f"driver-error {i} {coded(i, phase):d}")
    step.shows(coded(i, phase))


@STANDING.rule(r"PEv2\.(\d)\.digin\.Error\.in-not")
def _(step, phase, i):
    step.shows(not coded(i, phase))


def eight(phase):
    return sum(coded(i, phase) << i for i in range(8))


@STANDING.rule(r"joint\.(\d\d)\.soft-limit", r"PEv2\.(\d)\.digin\.SoftLimit\.in")
def _(step, phase, i):
    step.sim(f"field engine.soft-limited 0 {eight(phase)}")
    step.shows(coded(i, phase))


@STANDING.rule(r"engine\.misc\.(\d\d)\.in", r"PEv2\.digin\.Misc-(\d)\.in")
def _(step, phase, i):
    step.sim(f"input {i + 1} {coded(i, phase):d}")
    step.shows(coded(i, phase))


@STANDING.rule(r"engine\.misc\.(\d\d)\.in-not", r"PEv2\.digin\.Misc-(\d)\.in-not")
def _(step, phase, i):
    step.shows(not coded(i, phase))


@STANDING.rule(r"PEv2\.MiscInputStatus")
def _(step, phase):
    step.shows(eight(phase))


ENGINE = {"engine.power-states-in-effect": ("engine.power-in-effect", (1, 6, 0x50, 7)),
          "engine.charge-pump-state": ("engine.charge-pump", (1, 20, 0, 44)),
          "engine.buffer-slots": ("engine.slots", (128, 64, 100, 128)),
          "PEv2.bufferDepth": ("engine.slots", (128, 64, 100, 128)),
          "PEv2.slotTiming": ("engine.slot-time", (10, 20, 5, 10)),
          "PEv2.AxisEnabledStatesMask": ("engine.power-in-effect", (1, 6, 0x50, 7))}


@STANDING.rule(*(f"({name})".replace(".", r"\.") for name in ENGINE))
def _(step, phase, name):
    field, values = ENGINE[name]
    step.sim(f"field {field} 0 {values[phase]}")
    step.shows(values[phase])


@STANDING.rule(r"engine\.slot-us")
def _(step, phase):
    step.shows(100 * ENGINE["PEv2.slotTiming"][1][phase])


@STANDING.rule(r"engine\.generator-state")
def _(step, phase):
    step.sim(f"field engine.generator-in-effect 0 {(0, 0x42, 0x82, 0)[phase]}")
    step.shows((0, 0x42, 0x82, 0)[phase])


FEWER = Act("an engine with fewer axes", phases=2)


@FEWER.rule(r"engine\.axes-enabled")
def _(step, phase):
    step.sim(f"field engine.axes 0 {(5, 8)[phase]}")
    step.shows((5, 8)[phase])


REBOOTING = Act("the engine starts anew", phases=2)


@REBOOTING.rule(r"engine\.activated")
def _(step, phase):
    step.sim(f"field engine.reboot-ms 0 {0 if phase else 3600000}")
    step.shows(bool(phase))


@REBOOTING.rule(r"PEv2\.PulseEngineActivated")
def _(step, phase):
    step.shows(phase)


STOPPED = Act("an engine that was stopped", phases=3)
ENGINE_STATES = (100, 101, 0)


@STOPPED.rule(r"engine-state", r"PEv2\.PulseEngineState")
def _(step, phase):
    step.sim(f"field engine.state 0 {ENGINE_STATES[phase]}")
    step.shows(ENGINE_STATES[phase])


@STOPPED.rule(r"emergency")
def _(step, phase):
    step.shows(phase == 1)


@STOPPED.rule(r"emergency-not")
def _(step, phase):
    step.shows(phase != 1)


# without a pin: as legacy.emergency-without-pin says
@STOPPED.rule(r"PEv2\.digin\.Emergency\.in")
def _(step, phase):
    step.set(False, "legacy.emergency-without-pin")
    step.shows(phase == 1)


@STOPPED.rule(r"PEv2\.digin\.Emergency\.in-not")
def _(step, phase):
    step.shows(phase != 1)


@STOPPED.rule(r"PEv2\.deb\.estop")
def _(step, phase):
    step.shows(8 if phase == 1 else 12)


NO_PIN = Act("no emergency pin", phases=2)


@NO_PIN.rule(r"legacy\.emergency-without-pin")
def _(step, phase):
    step.set(0, "engine.emergency-pin")
    step.set(bool(phase))
    step.shows(bool(phase), "PEv2.digin.Emergency.in")


TRIPPED = Act("out of an emergency stop", phases=2)


@TRIPPED.rule(r"engine\.clear-fault")
def _(step, phase):
    if not phase:
        step.sim("field engine.state 0 101")
    step.press(bool(phase))
    step.device("engine.state", 0, 0 if phase else 101)


OLD_SWITCHES = Act("switches as the older component turned them", phases=2)


# a switch at a pin that the device was not told of: it says not tripped
@OLD_SWITCHES.rule(r"legacy\.old-switches")
def _(step, phase):
    step.sim("field axis.state 0 1")
    step.set(0, "PEv2.params.ApplyIniSettings")
    step.set(27, "PEv2.0.digin.LimitN.Pin")
    step.set(bool(phase))
    step.shows(bool(phase), "PEv2.0.digin.LimitN.in")


OLD_EMERGENCY = Act("emergency as the older component told it", phases=3)


@OLD_EMERGENCY.rule(r"legacy\.old-emergency")
def _(step, phase):
    step.set(0, "engine.emergency-pin")
    step.set(False, "legacy.emergency-without-pin")
    step.set(phase == 1)
    step.shows(phase == 1, "PEv2.digin.Emergency.in")


ACTS = [STANDING, FEWER, REBOOTING, NO_PIN, STOPPED, TRIPPED, OLD_SWITCHES, OLD_EMERGENCY]
