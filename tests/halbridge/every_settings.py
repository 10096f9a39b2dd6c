# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for the device's own settings: what it has is shown by both names, what is set
by the canonical one arrives in it.

Phases 0 and 1 change the device and switch it off and on, 2 to 4 set parameters. A
row says where a setting stands in the device, by the protocol's numbers.
"""
import struct
import zlib
from every_name import Act
from every_play import set_all

PHASES = 5
SHOWN = 2       # phases in which the device is changed
SETTINGS = Act("settings", phases=PHASES)


def flag(phase, name, i):
    """Another one than in the phase before."""
    return (zlib.crc32(f"{name}{i}".encode()) >> 4 & 1) ^ (phase & 1)


def number(low, high):
    def value(phase, name, i):
        # five numbers in a row, somewhere in the range
        return low + (zlib.crc32(f"{name}{i}".encode()) + 7 * phase) % (high - low + 1)
    return value


def plain(value):
    return value


class Setting:
    """`place(i)` is (field, index) of its first byte, `raw` makes its number, `pack` the
    bytes of it; `mask` is its part of a byte."""

    def __init__(self, name, old, place, value, raw=plain, mask=0xff, pack=None,
                 old_shown=None):
        self.name, self.old, self.place, self.value = name, old, place, value
        self.raw, self.mask, self.pack, self.old_shown = raw, mask, pack, old_shown

    def numbers(self, value):
        """As they stand in the field."""
        if self.mask is None:
            return [self.raw(value)]
        if self.pack:
            return struct.pack(self.pack, self.raw(value))
        shift = (self.mask & -self.mask).bit_length() - 1
        return [self.raw(value) << shift]

    def rule(self, step, phase, *numbers):
        i = numbers[0] if numbers else 0
        value = self.value(phase, self.name, i)
        field, index = self.place(i)
        if phase < SHOWN:
            for k, byte in enumerate(self.numbers(value)):
                step.poke(field, index + k, byte, self.mask)
            step.shows(value)
            return
        step.set(value)
        if self.beyond(phase, i):
            return
        for k, byte in enumerate(self.numbers(value)):
            step.device(field, index + k, byte, self.mask)

    def beyond(self, phase, i):
        """A pin of a row or a column that the keyboard has not got in this phase."""
        return phase == 3 and ("row-pin" in self.name and i == 15 or
                               "column-pin" in self.name and i == 7)

    def old_rule(self, step, phase, *numbers):
        i = numbers[0] if numbers else 0
        value = self.value(phase, self.name, i)
        step.shows(self.old_shown(value) if self.old_shown else value)


def at(field, first=0, stride=1):
    return lambda i: (field, first + i * stride)


def in_block(byte):
    """A byte of an axis' block, counted from its first; 8 on the wire."""
    return at("axis.block", byte, 55)


def bit_of(name, old, byte, mask):
    return Setting(rf"joint\.(\d\d)\.{name}", rf"PEv2\.(\d)\.{old}", in_block(byte), flag,
                   mask=mask)


def byte_of(name, old, byte, low, high, mask=0xff):
    return Setting(rf"joint\.(\d\d)\.{name}", old and rf"PEv2\.(\d)\.{old}", in_block(byte),
                   number(low, high), mask=mask)


def wide_of(name, old, byte, pack, low, high, raw=plain, old_shown=None):
    return Setting(rf"joint\.(\d\d)\.{name}", old and rf"PEv2\.(\d)\.{old}", in_block(byte),
                   number(low, high), raw, pack=pack, old_shown=old_shown)


# position, velocity, buffered: the device's planner (1), and whether it has positions (2)
MODES = {1: 3, 2: 1, 3: 0}


def mode(phase, name, i):
    return ((1, 2, 3), (3, 2, 1))[i % 2][phase % 3]


def homing(phase, name, i):
    return (zlib.crc32(f"{name}{i}".encode()) + phase) % 9


def unsigned(value):
    return value % 2 ** 32


AXIS = [
    bit_of("axis-enable", "AxisEnabled", 0, 1),
    bit_of("axis-invert", "AxisInverted", 0, 2),
    Setting(r"joint\.(\d\d)\.mode", r"PEv2\.(\d)\.AxisInternalPlanner", in_block(0), mode,
            MODES.__getitem__, mask=12, old_shown=lambda v: v != 3),
    bit_of("homing-invert", "AxisInvertedHome", 0, 16),
    bit_of("soft-limits", "AxisSoftLimitEnabled", 0, 32),
    bit_of("axis-masked", "AxisEnabledMasked", 0, 128),
    bit_of("limit-neg-enable", r"digin\.LimitN\.Enabled", 1, 1),
    bit_of("limit-pos-enable", r"digin\.LimitP\.Enabled", 1, 2),
    bit_of("home-enable", r"digin\.Home\.Enabled", 1, 4),
    bit_of("home-on-limit-neg", r"digin\.Home\.OnLimitN", 1, 8),
    bit_of("home-on-limit-pos", r"digin\.Home\.OnLimitP", 1, 16),
    bit_of("limit-neg-invert", r"digin\.LimitN\.invert", 1, 32),
    bit_of("limit-pos-invert", r"digin\.LimitP\.invert", 1, 64),
    bit_of("home-invert", r"digin\.Home\.invert", 1, 128),
    byte_of("home-pin", r"digin\.Home\.Pin", 2, 1, 18),
    byte_of("limit-neg-pin", r"digin\.LimitN\.Pin", 3, 19, 36),
    byte_of("limit-pos-pin", r"digin\.LimitP\.Pin", 4, 37, 55),
    byte_of("homing-speed", "HomingSpeed", 5, 1, 100),
    byte_of("homing-return-speed", "HomingReturnSpeed", 6, 1, 100),
    byte_of("mpg-encoder", "MPGjogEncoder", 7, 0, 25),
    wide_of("max-velocity", "MaxSpeed", 8, "<f", 1000, 20000, lambda v: v / 1e3),
    wide_of("max-acceleration", "MaxAcceleration", 12, "<f", 1000, 90000, lambda v: v / 1e6),
    wide_of("max-deceleration", "MaxDecceleration", 16, "<f", 1000, 90000, lambda v: v / 1e6),
    wide_of("soft-min", "SoftLimitMinimum", 20, "<i", -90000, -10, old_shown=unsigned),
    wide_of("soft-max", "SoftLimitMaximum", 24, "<i", 10, 90000),
    wide_of("mpg-multiplier", "MPGjogMultiplier", 28, "<h", -30000, 30000, old_shown=unsigned),
    byte_of("enable-pin", r"digout\.AxisEnable\.Pin", 30, 0, 55),
    Setting(r"joint\.(\d\d)\.enable-invert", r"PEv2\.(\d)\.digout\.AxisEnable\.invert",
            in_block(31), flag),
    byte_of("limit-neg-filter", r"digin\.LimitN\.Filter", 32, 0, 254),
    byte_of("limit-pos-filter", r"digin\.LimitP\.Filter", 33, 0, 254),
    byte_of("home-filter", r"digin\.Home\.Filter", 34, 0, 254),
    Setting(r"joint\.(\d\d)\.homing-on-switch", None, in_block(35), homing, mask=0x0f),
    Setting(r"joint\.(\d\d)\.homing-off-switch", None, in_block(35), homing, mask=0xf0),
    wide_of("homing-back-off", "HomeBackOffDistance", 37, "<i", 1, 90000),
    wide_of("mpg-divider", "MPGjogDivider", 41, "<H", 1, 60000),
    Setting(r"joint\.(\d\d)\.step-invert", None, in_block(43), flag, mask=1),
    Setting(r"joint\.(\d\d)\.direction-invert", None, in_block(43), flag, mask=2),
    Setting(r"joint\.(\d\d)\.index-falling", None, in_block(43), flag, mask=4),
    byte_of("probe-filter", r"digin\.Probe\.Filter", 44, 0, 254),
]

SAMPLING = {0: 0, 1: 1, 2: 5, 4: 3}


def sampling(phase, name, i):
    return (1, 4, 2, 0, 4)[(phase + i) % 5]


def other_pin(phase, name, i):
    return (number(0, 54)(phase, r"encoder\.(\d\d)\.pin-a", i) + 1 + i) % 55


def period(phase, name, i):
    return 25e6 / (1250 * (phase + 2))


def one_of(*values):
    return lambda phase, name, i: values[phase % len(values)]


def inverted(value):
    return 1 - value


OTHERS = [
    Setting(r"encoder\.(\d\d)\.sampling", None, at("encoder.option"), sampling,
            SAMPLING.__getitem__, mask=7),
    Setting(r"encoder\.(\d\d)\.pin-a", r"encoder\.([0-9]|1\d|2[0-4])\.channelApin",
            at("encoder.pins"), number(0, 54)),
    Setting(r"encoder\.(\d\d)\.pin-b", r"encoder\.([0-9]|1\d|2[0-4])\.channelBpin",
            at("encoder.pins", 25), other_pin),
    Setting(r"encoder\.fast\.configuration", r"encoder\.FastEncoders\.Configuration",
            at("encoder.fast"), one_of(10, 1, 0, 10, 1), mask=0x0f),
    Setting(r"encoder\.fast\.4x", r"encoder\.FastEncoders\.Disable4xSampling",
            at("encoder.fast"), flag, inverted, mask=0x10, old_shown=lambda v: not v),
    Setting(r"encoder\.fast\.00\.invert", r"encoder\.FastEncoders\.InvertE1",
            at("encoder.fast"), flag, mask=0x20),
    Setting(r"encoder\.fast\.01\.invert", r"encoder\.FastEncoders\.InvertE2",
            at("encoder.fast"), flag, mask=0x40),
    Setting(r"encoder\.fast\.02\.invert", r"encoder\.FastEncoders\.InvertE3",
            at("encoder.fast"), flag, mask=0x80),
    Setting(r"encoder\.fast\.index", None, at("encoder.fast-index"), flag),
    Setting(r"encoder\.ultra\.enable", None, at("encoder.ultra"), flag),
    Setting(r"encoder\.ultra\.invert", r"encoder\.UltraFastEncoder\.Options",
            at("encoder.ultra-options"), flag, mask=1),
    Setting(r"encoder\.ultra\.signal-mode", r"encoder\.UltraFastEncoder\.SignalMode",
            at("encoder.ultra-options"), flag, mask=2),
    Setting(r"encoder\.ultra\.4x", r"encoder\.UltraFastEncoder\.4xSampling",
            at("encoder.ultra-options"), flag, mask=4),
    Setting(r"encoder\.ultra\.filter", r"encoder\.UltraFastEncoder\.Filter",
            at("encoder.ultra-filter"), number(1, 90000), mask=None),
    Setting(r"adc\.filter", None, at("analog.filter"), number(1, 90000), mask=None),
    Setting(r"pwm\.frequency", None, at("pwm.period"), period, lambda v: round(25e6 / v),
            mask=None),
    Setting(r"PoExtBus\.connector", None, at("poextbus.connector"), flag),
    Setting(r"PoExtBus\.crc", None, at("poextbus.no-crc"), flag, inverted),
    Setting(r"matrix\.enable", None, at("keyboard"), one_of(1, 0), mask=1),
    Setting(r"matrix\.rows", None, at("keyboard", 1), one_of(16, 13, 16, 15, 16),
            lambda v: v - 1, mask=0x0f),
    Setting(r"matrix\.columns", None, at("keyboard", 1), one_of(8, 6, 8, 7, 8),
            lambda v: v - 1, mask=0xf0),
    Setting(r"matrix\.row-pin\.(0[0-7])", None, at("keyboard", 2), number(0, 54)),
    Setting(r"matrix\.row-pin\.(0[89]|1\d)", None, at("keyboard", 34 - 8), number(0, 54)),
    Setting(r"matrix\.column-pin\.(\d\d)", None, at("keyboard", 10), number(0, 54)),
    Setting(r"engine\.axes", None, at("engine.axes"), number(1, 8)),
    Setting(r"engine\.charge-pump", r"PEv2\.ChargePumpEnabled", at("engine.charge-pump"),
            number(11, 65)),
    Setting(r"engine\.generator", None, at("engine.generator"), one_of(0, 2),
            mask=0x0f),
    Setting(r"engine\.swap-step-dir", r"PEv2\.PG-swap-stepdir", at("engine.generator"), flag,
            mask=0x40),
    Setting(r"engine\.extended-io", None, at("engine.generator"), flag, mask=0x80),
    Setting(r"engine\.emergency-invert", r"PEv2\.digin\.Emergency\.invert",
            at("engine.emergency-invert"), flag),
    Setting(r"engine\.emergency-pin", r"PEv2\.digin\.Emergency\.Pin", at("engine.emergency-pin"),
            number(11, 65), old_shown=lambda v: v - 10),
    Setting(r"engine\.power-states", None, at("engine.power-states"),
            one_of(1, 6, 0x53, 0x24, 7)),
]

FUNCTIONS = Act("pins' functions", phases=2)
FUNCTIONS_OLD = Act("pins' functions, older names", phases=2, before=lambda m: set_all(
    m, {"PEv2.params.ApplyIniSettings": True}))
INVERT_OLD = Act("pins inverted in the device, older names", phases=4)


# terminals 17, 21 and 22 of a 57CNC can be no inputs, by protocol section 2.4
def function(i, phase):
    return (4 if i + 1 in (17, 21, 22) else 2) | 0x80 * (phase % 2)


@FUNCTIONS.rule(r"pin\.(\d\d)\.function")
def _(step, phase, i):
    step.set(function(i, phase))
    step.device("pin.function", i, function(i, phase))


@FUNCTIONS_OLD.rule(r"pins\.(\d+)\.PinFunction")
def _(step, phase, i):
    step.set(False, f"digin.{i}.invert")     # either is enough
    step.set(False, f"digout.{i}.invert")
    step.set(function(i, phase))
    step.device("pin.function", i, function(i, phase))


# two names for one bit: each has its turn
@INVERT_OLD.rule(r"(digin|digout)\.(\d+)\.invert")
def _(step, phase, kind, i):
    step.set(function(i, 0), f"pins.{i}.PinFunction")
    step.set(phase == (1 if kind == "digin" else 3))
    step.device("pin.function", i, function(i, phase))


@SETTINGS.rule(r"PEv2\.(\d)\.AxisPositionMode")
def _(step, phase, i):
    step.shows(mode(phase, "mode", i) == 1)


for _setting in AXIS + OTHERS:
    SETTINGS.rule(_setting.name)(_setting.rule)
    if _setting.old:
        SETTINGS.rule(_setting.old)(_setting.old_rule)

ACTS = [SETTINGS]
PINS = [FUNCTIONS, FUNCTIONS_OLD, INVERT_OLD]
