# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for the modes of axes: position, velocity and the motion buffer."""
from every_axis import prepare
from every_name import Act, more
from every_settings import MODES as BITS


# the machine is off in each phase in which a mode is set
MODES = Act("modes", phases=6, before=prepare)
BUFFER = Act("the motion buffer", phases=3)


ORDER = (2, 1, 3)


def mode(step, phase, i):
    value = ORDER[phase // 2]
    step.set(bool(phase % 2), f"joint.{i:02d}.enable")
    step.press(bool(phase % 2), "machine-is-on")
    step.set(value, f"joint.{i:02d}.mode")
    step.device("axis.block", 55 * i, BITS[value] << 2, 12)
    step.shows(bool(phase % 2), f"joint.{i:02d}.enabled")


@MODES.rule(r"PEv2\.(\d)\.deb\.axxisout")
def _(step, phase, i):
    mode(step, phase, i)
    step.shows(ORDER[phase // 2])


@MODES.rule(r"PEv2\.(\d)\.deb\.PosModeAct")
def _(step, phase, i):
    step.shows(ORDER[phase // 2] == 1)


@MODES.rule(r"PEv2\.(\d)\.deb\.posmode-count")
def _(step, phase, i):
    if phase == 2:
        step.changes(more)


@MODES.rule(r"PEv2\.(\d)\.deb\.velmode-count")
def _(step, phase, i):
    if phase == 0:
        step.changes(more)


# too far to arrive, and a daemon that has no processor for longer than the buffer lasts
@BUFFER.rule(r"engine\.buffer-level")
def _(step, phase):
    if phase == 0:
        step.shows(0)
    if phase == 1:
        step.set(1e5, "joint.00.pos-cmd")
        step.changes(more)


@BUFFER.rule(r"engine\.buffer-underruns")
def _(step, phase):
    if phase == 1:
        step.pause = 0.5
        step.changes(more)


@BUFFER.rule(r"engine\.buffer-resyncs")
def _(step, phase):
    if phase == 2:
        step.sim("fault both loss 0.2")
        step.changes(more)


ACTS = [MODES, BUFFER]
