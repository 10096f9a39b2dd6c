# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for the device's settings by their older names: set, they arrive in the device.

That they show what it has is looked at in every_settings, in the same way; here is
what stands in a byte and in bits, and what is made of the joint's numbers.
"""
import struct
from every_name import Act
from every_play import set_all
from every_settings import AXIS, MODES, OTHERS, SETTINGS, flag, mode, unsigned



def apply(machine):
    """A 0 counts when it is set while settings are applied already: that has to have been seen."""
    speed = int(machine.hal.get("joint.00.homing-speed")) % 100 + 1
    set_all(machine, {"PEv2.params.ApplyIniSettings": True, "PEv2.0.HomingSpeed": speed})
    machine.hal.becomes("joint.00.homing-speed", speed)


OLD = Act("settings, older names", phases=2, before=apply)
AFTER = 5       # phases in which the values were used before


def by_old_name(setting):
    def rule(step, phase, *numbers):
        i = numbers[0] if numbers else 0
        value = setting.value(phase + AFTER, setting.name, i)
        field, index = setting.place(i)
        step.set(setting.old_shown(value) if setting.old_shown else value)
        for k, raw in enumerate(setting.numbers(value)):
            step.device(field, index + k, raw, setting.mask)
    return rule


# bit 64 is PG-swap-stepdir, 128 PG-extended-io, which a 57CNC always has
@OLD.rule(r"PEv2\.PulseGeneratorType")
def _(step, phase):
    swap = flag(phase + AFTER, r"engine\.swap-step-dir", 0)
    step.set((2, 0)[phase] | 64 * swap)
    step.device("engine.generator", 0, (2, 0)[phase], 15)


@OLD.rule(r"PEv2\.PG-extended-io")
def _(step, phase):
    step.set(bool(phase))
    step.fixed(True)
    step.device("engine.generator", 0, 128, 128)


# made of bits, below
MADE = {r"encoder\.fast\.configuration"}

for _setting in AXIS + OTHERS:
    if _setting.old and _setting.name not in MADE:
        OLD.rule(_setting.old)(by_old_name(_setting))


@OLD.rule(r"PEv2\.(\d)\.AxisPositionMode")
def _(step, phase, i):
    value = mode(phase + AFTER, "mode", i)
    step.set(value == 1)
    step.device("axis.block", 55 * i, MODES[value] << 2, 12)


def byte_of(byte, axis, phase):
    return sum(setting.numbers(setting.value(phase, setting.name, axis))[0] for setting in AXIS
               if setting.place(0) == ("axis.block", byte))


def homing_of(axis, phase):
    on, off = (setting.value(phase, setting.name, axis) for setting in AXIS
               if setting.place(0) == ("axis.block", 35))
    return on | off << 4


HOMING_BITS = [f"HomeAlg.{when}Home.{what}" for when in ("On", "Out")
               for what in ("ReducedSpeed", "RevDirection", "ArmEncoder", "Stop")]


@SETTINGS.rule(r"PEv2\.(\d)\.AxesConfig")
def _(step, phase, i):
    step.shows(byte_of(0, i, phase))


@SETTINGS.rule(r"PEv2\.(\d)\.AxesSwitchConfig")
def _(step, phase, i):
    step.shows(byte_of(1, i, phase))


@SETTINGS.rule(r"PEv2\.(\d)\.HomingAlgorithm")
def _(step, phase, i):
    step.shows(homing_of(i, phase))


@SETTINGS.rule(r"PEv2\.(\d)\.(HomeAlg\..*)")
def _(step, phase, i, name):
    step.shows(bool(homing_of(i, phase) >> HOMING_BITS.index(name) & 1))


@SETTINGS.rule(r"PEv2\.PulseGeneratorType")
def _(step, phase):
    step.shows(sum(of.value(phase, of.name, 0) * (of.mask & -of.mask) for of in OTHERS
                   if of.place(0) == ("engine.generator", 0)))


@OLD.rule(r"PEv2\.(\d)\.(HomeAlg\..*)")
def _(step, phase, i, name):
    k = HOMING_BITS.index(name)
    on = [bool(flag(phase, bit, i)) for bit in HOMING_BITS]
    if not any(on):     # the byte would count
        on[0] = True
    half = on[k // 4 * 4:k // 4 * 4 + 4]
    step.set(on[k])
    # the device has one code for "stop"
    value = 8 if half[3] else sum(bit << j for j, bit in enumerate(half))
    step.device("axis.block", 35 + 55 * i, value << k // 4 * 4, 15 << k // 4 * 4)


BYTES = Act("bytes of settings, while all their bits are false", phases=2)
ZEROED = {"AxesConfig": (0, [s for s in AXIS if s.place(0) == ("axis.block", 0)]),
          "AxesSwitchConfig": (1, [s for s in AXIS if s.place(0) == ("axis.block", 1)])}


# enabled, inverted, soft limits ...: what the device has may be told by other bits as well
@BYTES.rule(r"PEv2\.(\d)\.(AxesConfig|AxesSwitchConfig)")
def _(step, phase, i, what):
    byte, bits = ZEROED[what]
    for bit in bits:
        step.set(0, f"PEv2.{i}.{bit.old.split(')', 1)[1][2:]}".replace("\\", ""))
    if what == "AxesConfig":
        step.set(0, f"PEv2.{i}.AxisPositionMode")
    mask = sum(bit.mask for bit in bits)
    value = (0x55 + 37 * i + 90 * phase) % 256 & mask | 2
    if what == "AxesConfig" and not value & 4:
        value &= ~8     # positions are the planner's
    step.set(value)
    step.device("axis.block", byte + 55 * i, value, mask)


@BYTES.rule(r"PEv2\.(\d)\.HomingAlgorithm")
def _(step, phase, i):
    for name in HOMING_BITS:
        step.set(False, f"PEv2.{i}.{name}")
    value = (i + 3 * phase) % 7 + 1 | ((i + phase) % 7 + 1) << 4
    step.set(value)
    step.device("axis.block", 35 + 55 * i, value)


STEPGEN = Act("numbers of the joints", phases=2)


def joint(i, phase):
    """[JOINT_i] of this phase: half of them get a negative end only later."""
    low, high = (-(i + 3 + phase), 20 + i + 2 * phase) if i % 2 else \
        ((i + 1, -(i + 2))[phase], 100 + i + phase)
    return {"STEP-SCALE": 10.625 + i + phase, "STEPGEN-MAXVEL": 50.0 + i + 5 * phase,
            "STEPGEN-MAXACCEL": 200.0 + i + 9 * phase, "MIN-LIMIT": low, "MAX-LIMIT": high,
            "HOME": 2 + phase, "HOME-OFFSET": 3.0 + i + phase,
            "HOME-SEARCH-VEL": 10.0 + 7 * phase, "HOME-LATCH-VEL": -(4.0 + phase)}


def whole(value):
    return struct.unpack("<i", struct.pack("<i", round(value)))[0]


def made_of(i, phase):
    j = joint(i, phase)
    scale = j["STEP-SCALE"]
    offset = j["MAX-LIMIT"] - j["MIN-LIMIT"] if j["MIN-LIMIT"] < 0 else 0
    speed, acceleration = j["STEPGEN-MAXVEL"] * scale, j["STEPGEN-MAXACCEL"] * scale
    return {
        "MaxSpeed": speed, "MaxAcceleration": acceleration,
        "MaxDecceleration": 1.5 * acceleration, "PositionOffset": offset,
        "PositionScale": whole(scale), "ZeroPosition": whole(offset * scale),
        "HomePosition": whole((j["HOME"] + offset) * scale),
        "ArmPosition": whole((j["MIN-LIMIT"] + offset) * scale),
        "digin.SoftLimit.PosMin": unsigned(whole((j["MIN-LIMIT"] + offset) * scale)),
        "digin.SoftLimit.PosMax": unsigned(whole((j["MAX-LIMIT"] + offset) * scale)),
        "HomeBackOffDistance": whole(j["HOME-OFFSET"] * scale),
        "HomingSpeed": round(100 * j["HOME-SEARCH-VEL"] / j["STEPGEN-MAXVEL"]),
        "HomingReturnSpeed": round(100 * -j["HOME-LATCH-VEL"] / j["HOME-SEARCH-VEL"]),
    }


def packed(step, i, byte, form, value):
    for k, raw in enumerate(struct.pack(form, value)):
        step.device("axis.block", 55 * i + byte + k, raw)


# where it is seen in the device, or in a name that is made of it
SEEN = {
    "STEPGEN-MAXVEL": lambda step, i, made: packed(step, i, 8, "<f", made["MaxSpeed"] / 1e3),
    "STEPGEN-MAXACCEL": lambda step, i, made: packed(step, i, 12, "<f",
                                                     made["MaxAcceleration"] / 1e6),
    "HOME-OFFSET": lambda step, i, made: packed(step, i, 37, "<i", made["HomeBackOffDistance"]),
    "HOME-SEARCH-VEL": lambda step, i, made: step.device("axis.block", 55 * i + 5,
                                                         made["HomingSpeed"]),
    "HOME-LATCH-VEL": lambda step, i, made: step.device("axis.block", 55 * i + 6,
                                                        made["HomingReturnSpeed"]),
    "STEP-SCALE": lambda step, i, made: step.shows(made["PositionScale"],
                                                   f"PEv2.{i}.PositionScale"),
    "MIN-LIMIT": lambda step, i, made: step.shows(made["ArmPosition"], f"PEv2.{i}.ArmPosition"),
    "MAX-LIMIT": lambda step, i, made: step.shows(made["digin.SoftLimit.PosMax"],
                                                  f"PEv2.{i}.digin.SoftLimit.PosMax"),
    "HOME": lambda step, i, made: step.shows(made["HomePosition"], f"PEv2.{i}.HomePosition"),
}


@STEPGEN.rule(rf"PEv2\.(\d)\.stepgen\.({'|'.join(SEEN)})")
def _(step, phase, i, what):
    step.set(joint(i, phase)[what])
    SEEN[what](step, i, made_of(i, phase))


@STEPGEN.rule(r"PEv2\.(\d)\.(PositionOffset|PositionScale|ZeroPosition|HomePosition"
              r"|ArmPosition|digin\.SoftLimit\.Pos(?:Min|Max))")
def _(step, phase, i, what):
    step.shows(made_of(i, phase)[what])


@STEPGEN.rule(r"joint\.(\d\d)\.scale")
def _(step, phase, i):
    # the same parameter as STEP-SCALE
    step.set(joint(i, phase)["STEP-SCALE"])
    step.shows(made_of(i, phase)["PositionScale"], f"PEv2.{i}.PositionScale")
    step.shows(joint(i, phase)["STEP-SCALE"])


STEPS = Act("the way off the switch in pulses", phases=2)


@STEPS.rule(r"PEv2\.(\d)\.digin\.Home\.Offset")
def _(step, phase, i):
    step.set(0.0, f"PEv2.{i}.stepgen.HOME-OFFSET")
    step.set(100 + i + 50 * phase)
    packed(step, i, 37, "<i", 100 + i + 50 * phase)


ACTS = [OLD, BYTES, STEPGEN, STEPS]
