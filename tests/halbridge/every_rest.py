# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for the device's failsafe, what it is, outputs by the older names, and names
that are nobody's to move here."""
from hal_live import wait
from every_axis import AXES, place_axes, prepare
from every_io import TICKS, coded
from every_motion import near
from every_name import Act
from every_play import set_all

FAILSAFE = Act("failsafe", phases=3)


@FAILSAFE.rule(r"failsafe\.timeout-ms")
def _(step, phase):
    value = (3000, 700, 25500)[phase]
    step.set(value)
    step.device("failsafe.timeout", 0, value // 100)


@FAILSAFE.rule(r"failsafe\.(digital|PoExtBus|pwm|engine)")
def _(step, phase, part):
    bit = ("digital", "PoExtBus", "pwm", "engine").index(part)
    value = int(coded(bit, phase))
    step.set(value)
    step.device("failsafe.parts", 0, value << bit, 1 << bit)


@FAILSAFE.rule(r"failsafe\.pin\.(\d\d)")
def _(step, phase, i):
    value = int(coded(i, phase) if phase < 2 else not coded(i, 1))
    step.set(value)
    step.device("failsafe.outputs", i // 8, value << i % 8, 1 << i % 8)


@FAILSAFE.rule(r"failsafe\.PoExtBus-byte\.(\d\d)")
def _(step, phase, i):
    step.set((17 * i + 90 * phase + 1) % 256)
    step.device("failsafe.poextbus", i, (17 * i + 90 * phase + 1) % 256)


@FAILSAFE.rule(r"failsafe\.pwm-duty\.(\d\d)")
def _(step, phase, i):
    step.set(10 * i + phase + 1)
    step.device("failsafe.pwm", i, 10 * i + phase + 1)


FAILSAFE_OFF = Act("failsafe off", phases=2)


@FAILSAFE_OFF.rule(r"failsafe\.state")
def _(step, phase):
    step.set((0, 500)[phase], "failsafe.timeout-ms")
    step.shows((1, 2)[phase])


def follow(m):
    set_all(m, {"pwm.frequency": 25e6 / TICKS, "legacy.adcout-follows": True}
            | {f"adcout.{i}.{name}": value for i in range(6)
               for name, value in (("max-v", 100.0), ("enable", True))})


ADCOUT = Act("analog outputs, older names", phases=4, before=follow)
# value, offset, scale, least and most, full value
STEPS = [(10, 3, 2, 0, 100, 100), (20, 5.31, 1.5, 0, 100, 200), (1, 0, 1, 40, 60, 100),
         (90, 0, 1, 40, 60, 80)]


def output(i, phase):
    value, offset, scale, least, most, full = STEPS[phase]
    value += i if phase < 2 else 0
    return round(TICKS * min(max(value * scale + offset, least), most) / full)


def _adcout(step, phase, i, value):
    step.set(float(value))
    step.device("pwm.duty", 5 - i, output(i, phase))


@ADCOUT.rule(r"adcout\.(\d)\.(value|offset|scale|low-limit|high-limit|max-v)")
def _(step, phase, i, what):
    k = ("value", "offset", "scale", "low-limit", "high-limit", "max-v").index(what)
    _adcout(step, phase, i, STEPS[phase][k] + (i if not k and phase < 2 else 0))


@ADCOUT.rule(r"adcout\.(\d)\.deb\.(?:out|setval)")
def _(step, phase, i):
    step.shows(output(i, phase))


ADCOUT_ON = Act("analog outputs on, older names", phases=3)


@ADCOUT_ON.rule(r"adcout\.(\d)\.enable")
def _(step, phase, i):
    step.set(coded(i, phase))
    step.device("pwm.duty", 5 - i, output(i, 3) if coded(i, phase) else 0)


FOLLOWED = Act("analog outputs followed or not", phases=2)


@FOLLOWED.rule(r"legacy\.adcout-follows")
def _(step, phase):
    step.set(bool(phase))
    step.set(50.0 + phase, "adcout.2.value")
    step.set(True, "adcout.2.enable")
    step.device("pwm.duty", 3, (lambda have: have != round(TICKS * 50 / 80)) if not phase
                else round(TICKS * 51 / 80))


def link(m):
    """An axis whose command is connected to nothing is not the older names'."""
    prepare(m)
    for i in range(AXES):
        m.link(f"cmd-{i}", f"PEv2.{i}.joint-pos-cmd")


def switch_on(m):
    set_all(m, {f"PEv2.{i}.AxisEnabled": 1 for i in range(AXES)})
    set_all(m, {"machine-is-on": True})


def link_and_place(m):
    link(m)
    place_axes(m, {2: 2100})


WHOLE = Act("the whole part of a scale", phases=3, before=link_and_place)
MOVE = Act("axes by their older names", phases=3, before=switch_on)


@WHOLE.rule(r"legacy\.whole-scale")
def _(step, phase):
    step.set((10.5, 10.5, 100.0)[phase], "joint.02.scale")
    step.set(phase == 1)
    step.shows((200.0, 210.0, 21.0)[phase], "PEv2.2.joint-pos-fb")


@MOVE.rule(r"PEv2\.(\d)\.joint-pos-cmd")
def _(step, phase, i):
    value = (i + 1.0) * (1, -2, 0.5)[phase]
    step.set(value)
    step.device("axis.reference", i, round(100 * value))
    step.device("axis.pulses", i, round(100 * value))


SPEED = Act("speed by its older name", phases=2)


@SPEED.rule(r"PEv2\.(\d)\.joint-vel-cmd")
def _(step, phase, i):
    value = 3.0 + i + 4 * phase
    step.set(value if not phase else -value)
    step.set(-1e5 if phase else 1e5, f"PEv2.{i}.joint-pos-cmd")
    step.device("axis.speed", i, near((-1 if phase else 1) * value / 10), state=phase)


PERMIT = Act("axes that follow their enable pins", phases=4, before=lambda m: set_all(
    m, {"legacy.axis-enable-follows": True} |
    {f"PEv2.{i}.joint-pos-cmd": 0.0 for i in range(AXES)}))
PERMIT_OTHER = Act("axes that follow their other enable pins", phases=5)
FOLLOW = Act("enable pins followed or not", phases=2)


def permit(step, i, value):
    step.set(value)
    step.shows(value, f"joint.{i:02d}.enabled")


@PERMIT.rule(r"PEv2\.(\d)\.digout\.AxisEnable\.out")
def _(step, phase, i):
    permit(step, i, coded(i, phase))


@PERMIT_OTHER.rule(r"PEv2\.(\d)\.digout\.AxisEnabled\.out")
def _(step, phase, i):
    step.set(False, f"PEv2.{i}.digout.AxisEnable.out")
    permit(step, i, coded(i, phase) if phase < 4 else not coded(i, 0))


@FOLLOW.rule(r"legacy\.axis-enable-follows")
def _(step, phase):
    step.set(not phase)
    step.set(False, "PEv2.3.digout.AxisEnabled.out")
    step.shows(bool(phase), "joint.03.enabled")


# accepted, and without function, for the reason in docs/compatibility.md
def stands(m):
    wait("all axes stand", lambda: not any(m.inside.inside()["axis.speed"]))


NOTHING = Act("without function", phases=2, before=stands)


@NOTHING.rule(r"enum-f?usb-dev", r"connected\.(?:usb|fusb|net)",
              r"encoder\.2[678]\.(?:count|position|velocity)")
def _(step, phase):
    step.fixed(0)


@NOTHING.rule(r"encoder\.2[678]\.(?:reset|index-enable|scale|enable|encoderOptions"
              r"|[24]x_sampling|channel[AB]pin)",
              r"encoder\.25\.channel[AB]pin",
              r"PEv2\.\d\.(?:joint-out-home|joint-in-homing|joint-in-position|joint-kb-jog-active"
              r"|joint-wheel-jog-active"
              r"|stepgen\.(?:TYPE|ENCODER-SCALE|HOME-IGNORE-LIMITS|DEADBAND|MAX-OUTPUT)"
              r"|params\.Feedback-Encoder-Id)")
def _(step, phase):
    step.in_vain(phase)


ACTS = [FAILSAFE, FAILSAFE_OFF, ADCOUT, ADCOUT_ON, FOLLOWED]
OLD_MOTION = [WHOLE, MOVE, SPEED, PERMIT, PERMIT_OTHER, FOLLOW, NOTHING]
