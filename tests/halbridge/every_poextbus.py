# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for PoExtBus and the relays on it."""
from every_io import coded
from every_name import Act

BUS_OUT = Act("PoExtBus", phases=7)
BUS_OLD = Act("PoExtBus, older names", phases=8)
BUS_INVERT = Act("PoExtBus inverted here", phases=7)
BUS_INVERT_OLD = Act("PoExtBus inverted here, older names", phases=7)
RELAYS = Act("PoRelay8", phases=8)


@BUS_OUT.rule(r"PoExtBus\.(\d\d)\.out")
def _(step, phase, i):
    step.set(coded(i, phase))
    step.device("poextbus.data", i // 8, bool(coded(i, phase)) << i % 8, 1 << i % 8)


@BUS_OUT.rule(r"PoExtBus\.(\d\d)\.in")
def _(step, phase, i):
    step.shows(coded(i, phase))


@BUS_OUT.rule(r"PoExtBus\.(\d\d)\.in-not")
def _(step, phase, i):
    step.shows(not coded(i, phase))


def old_bit(byte, bit):
    """Bit 8-j of byte 9-i, counted as the canonical names do."""
    return 8 * (9 - byte) + 8 - bit


def _bus_bit(step, i, value):
    step.set(value)
    step.device("poextbus.data", i // 8, value << i % 8, 1 << i % 8)


@BUS_OLD.rule(r"PoExtBus\.(\d)\.digout\.(\d)\.out")
def _(step, phase, byte, bit):
    i = old_bit(byte, bit)
    _bus_bit(step, i, coded(i, phase - 1) if phase else True)


@BUS_OLD.rule(r"PoExtBus\.(\d)\.digin\.(\d)\.in")
def _(step, phase, byte, bit):
    step.shows(coded(old_bit(byte, bit), phase - 1) if phase else True)


@BUS_OLD.rule(r"PoExtBus\.(\d)\.digin\.(\d)\.in_not")
def _(step, phase, byte, bit):
    step.shows(not coded(old_bit(byte, bit), phase - 1) if phase else False)


def old_byte(byte, phase):
    return sum(coded(old_bit(byte, bit), phase - 1) << 8 - bit if phase else 1 << 8 - bit
               for bit in range(1, 9))


@BUS_OLD.rule(r"PoExtBus\.(\d)\.digin\.byte", r"PoExtBus\.(\d)\.digout\.byte")
def _(step, phase, byte):
    step.shows(old_byte(byte, phase))


@RELAYS.rule(r"PoRelay8\.(\d\d)\.relay-(\d)")
def _(step, phase, module, relay):
    i = 8 * (9 - module) + relay - 1
    _bus_bit(step, i, coded(i, phase - 1) if phase else True)


@BUS_INVERT.rule(r"PoExtBus\.(\d\d)\.out-invert")
def _(step, phase, i):
    step.set(False, f"PoExtBus.{i:02d}.out")
    step.set(False, f"PoRelay8.{9 - i // 8:02d}.relay-{i % 8 + 1}")
    step.set(False, f"PoExtBus.{9 - i // 8}.digout.{8 - i % 8}.out")
    _bus_bit(step, i, coded(i, phase))


@BUS_INVERT_OLD.rule(r"PoExtBus\.(\d)\.digout\.(\d)\.invert")
def _(step, phase, byte, bit):
    i = old_bit(byte, bit)
    _bus_bit(step, i, coded(i, phase))


BUS_COUNT = Act("PoExtBus left alone", phases=2)


@BUS_COUNT.rule(r"PoExtBus\.count")
def _(step, phase):
    step.set(0 if not phase else 10)
    step.sim("field poextbus.data 0 0")
    step.set(True, "PoExtBus.9.digout.8.invert")
    step.device("poextbus.data", 0, phase, 1)


ACTS = [BUS_OUT, BUS_OLD, RELAYS, BUS_INVERT, BUS_INVERT_OLD, BUS_COUNT]
