# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for the settings of encoders by their older names: bits, and bytes of bits."""
from every_name import Act
from every_settings import OTHERS, SETTINGS


def setting_of(name):
    return next(setting for setting in OTHERS if setting.name == name)


@SETTINGS.rule(r"encoder\.([0-9]|1\d|2[0-4])\.(encoderOptions|enable|[24]x_sampling)")
def _(step, phase, i, what):
    counts = setting_of(r"encoder\.(\d\d)\.sampling").value(phase, "", i)
    bits = {"enable": counts > 0, "4x_sampling": counts == 4, "2x_sampling": counts == 2}
    if what == "encoderOptions":
        step.shows(bits["enable"] + 2 * bits["4x_sampling"] + 4 * bits["2x_sampling"])
    else:
        step.shows(bits[what])


@SETTINGS.rule(r"encoder\.FastEncoders\.(Enable|AlternativeConfig|Options)")
def _(step, phase, what):
    configuration, plain, *turned = (
        setting_of(rf"encoder\.fast\.{name}").value(phase, rf"encoder\.fast\.{name}", 0)
        for name in ("configuration", "4x", r"00\.invert", r"01\.invert", r"02\.invert"))
    if what == "Options":
        step.shows(16 * (1 - plain) + sum(32 * bit << k for k, bit in enumerate(turned)))
    else:
        step.shows(configuration == 10 if what == "AlternativeConfig" else configuration > 0)


ENCODERS = Act("encoders by their bits", phases=4)
COUNTS = (1, 4, 2, 0)


# the byte beside counts while all bits are false
def _counts(step, phase, i):
    counts = COUNTS[(phase + i) % 4]
    step.set(0, f"encoder.{i}.encoderOptions")
    if i == 25:
        step.set(False, "encoder.25.4x_sampling")
        step.device("encoder.ultra", 0, counts > 0)
        return counts
    step.device("encoder.option", i, {0: 0, 1: 1, 2: 5, 4: 3}[counts], 7)
    return counts


@ENCODERS.rule(r"encoder\.(1?\d|2[0-5])\.enable")
def _(step, phase, i):
    step.set(_counts(step, phase, i) > 0)


@ENCODERS.rule(r"encoder\.([0-9]|1\d|2[0-4])\.4x_sampling")
def _(step, phase, i):
    step.set(_counts(step, phase, i) == 4)


@ENCODERS.rule(r"encoder\.([0-9]|1\d|2[0-4])\.2x_sampling")
def _(step, phase, i):
    step.set(_counts(step, phase, i) == 2)


ENCODER_BYTE = Act("encoders by their byte", phases=2)


@ENCODER_BYTE.rule(r"encoder\.([0-9]|1\d|2[0-4])\.encoderOptions")
def _(step, phase, i):
    for what in ("enable", "4x_sampling", "2x_sampling"):
        step.set(False, f"encoder.{i}.{what}")
    value = 3 if (phase + i) % 2 else 5
    step.set(value)
    step.device("encoder.option", i, value, 7)


FAST = Act("fast encoders by their bits", phases=3)


@FAST.rule(r"encoder\.FastEncoders\.(Enable|AlternativeConfig|Configuration)")
def _(step, phase, what):
    on, other = phase > 0, phase == 2
    step.set({"Enable": on, "AlternativeConfig": other,
              "Configuration": 10 * other or int(on)}[what])
    step.device("encoder.fast", 0, (0, 1, 10)[phase], 15)


FAST_BYTE = Act("fast encoders by their byte", phases=2)
ULTRA_BYTE = Act("the ultra-fast encoder by its byte", phases=3)


@FAST_BYTE.rule(r"encoder\.FastEncoders\.Options")
def _(step, phase):
    value = (16 + 64, 32 + 128)[phase]
    for what in ("Disable4xSampling", "InvertE1", "InvertE2", "InvertE3"):
        step.set(False, f"encoder.FastEncoders.{what}")
    step.set(value)
    step.device("encoder.fast", 0, value, 0xf0)


@ULTRA_BYTE.rule(r"encoder\.25\.encoderOptions")
def _(step, phase):
    for what in ("enable", "4x_sampling", "2x_sampling"):
        step.set(False, f"encoder.25.{what}")
    step.set((0, 1, 3)[phase])
    step.device("encoder.ultra", 0, int(phase > 0))
    if phase:
        step.device("encoder.ultra-options", 0, 4 * (phase - 1), 4)


ULTRA = Act("the ultra-fast encoder by its bits", phases=2)


@ULTRA.rule(r"encoder\.25\.4x_sampling")
def _(step, phase):
    step.set(True, "encoder.25.enable")
    step.set(not phase)
    step.device("encoder.ultra-options", 0, 0 if phase else 4, 4)


# it counts each line or each edge
@ULTRA.rule(r"encoder\.25\.2x_sampling")
def _(step, phase):
    step.set(not phase)
    step.fixed(not phase)
    step.device("encoder.ultra-options", 0, 0 if phase else 4, 4)


ACTS = [ENCODERS, ENCODER_BYTE, FAST, FAST_BYTE, ULTRA_BYTE, ULTRA]
