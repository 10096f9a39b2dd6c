# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for the matrix keyboard and the outputs of the engine's connector."""
from every_io import coded
from every_name import Act
from every_play import set_all

MATRIX = Act("matrix keyboard", phases=8, before=lambda m: set_all(
    m, {"matrix.rows": 16, "matrix.columns": 8, "matrix.enable": 1}
    | {f"matrix.row-pin.{i:02d}": i for i in range(16)}
    | {f"matrix.column-pin.{i:02d}": 20 + i for i in range(8)}))
MATRIX_OFF = Act("matrix keyboard off", phases=1)


@MATRIX.rule(r"matrix\.(\d\d)\.(\d\d|\d)")
def _(step, phase, row, column):
    i = 8 * row + column
    step.sim(f"key {i} {coded(i, phase):d}")
    step.shows(coded(i, phase))


@MATRIX.rule(r"matrix\.enabled")
def _(step, phase):
    step.shows(True)


@MATRIX_OFF.rule(r"matrix\.enabled")
def _(step, phase):
    step.set(0, "matrix.enable")
    step.shows(False)


EXTERNAL = Act("outputs of the engine's connector", phases=4)
EXTERNAL_OLD = Act("outputs of the engine's connector, older names", phases=4)
# of a 57CNC: SSR2, Relay2, Relay1, OC1 to OC4, SSR1
RELAY_BITS = {0: 0x80, 1: 0x01, 2: 0x04, 3: 0x02}


@EXTERNAL.rule(r"external\.(\d\d)\.out")
def _(step, phase, i):
    step.set(coded(i, phase))
    step.device("engine.outputs", 0, coded(i, phase) << i, 1 << i)


@EXTERNAL.rule(r"external-relay\.(\d\d)\.out")
def _(step, phase, i):
    step.set(coded(7 - i, phase))
    step.device("engine.relays", 0, coded(7 - i, phase) << i, 1 << i)


@EXTERNAL.rule(r"external\.(\d\d)\.out-fb")
def _(step, phase, i):
    step.shows(coded(i, phase))


@EXTERNAL.rule(r"external-relay\.(\d\d)\.out-fb")
def _(step, phase, i):
    step.shows(coded(7 - i, phase))


@EXTERNAL.rule(r"PEv2\.ExternalOCOutputs")
def _(step, phase):
    step.shows(sum(coded(i, phase) << i for i in range(8)))


@EXTERNAL.rule(r"PEv2\.ExternalRelayOutputs")
def _(step, phase):
    step.shows(sum(coded(7 - i, phase) << i for i in range(8)))


def _external(step, phase, i, bit):
    value = coded(i, phase)
    step.set(value)
    step.device("engine.outputs", 0, bit if value else 0, bit)


@EXTERNAL_OLD.rule(r"PEv2\.digout\.ExternalRelay-(\d)\.out")
def _(step, phase, i):
    _external(step, phase, i, RELAY_BITS[i])


@EXTERNAL_OLD.rule(r"PEv2\.digout\.ExternalOC-(\d)\.out")
def _(step, phase, i):
    _external(step, phase, i + 4, 8 << i)


def clear_external(m):
    set_all(m, {f"external.{i:02d}.out": False for i in range(8)})


EXTERNAL_OLD.before = clear_external

ACTS = [MATRIX, MATRIX_OFF, EXTERNAL, EXTERNAL_OLD]
