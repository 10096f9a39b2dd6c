# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for the device's own threading: one thread from beginning to end, one that is
cancelled, one that takes too long."""
from every_axis import prepare
from every_name import Act, more
from every_play import set_all


def one_axis(m):
    """The first one is streamed; the spindle has 1000 lines and stands."""
    prepare(m)
    set_all(m, {"joint.00.mode": 3, "encoder.ultra.enable": 1, "encoder.ultra.4x": 1})
    m.inside.ask("spindle 0 4000")
    m.hal.becomes("config.state", 3)


SET = Act("what threading wants to know", phases=2, before=one_axis)
# where it begins, bytes of it, and its values
SETTINGS = {"mode": (0, 1, (0, 1)), "ticks-per-revolution": (4, 2, (2000, 4000)),
            "target-rpm": (6, 2, (777, 6000)), "speed-gain": (8, 2, (300, 1000)),
            "position-gain": (10, 2, (1020, 50)), "ignore-axes": (12, 1, (3, 0x80))}


@SET.rule(r"threading\.(" + "|".join(SETTINGS) + ")")
def _(step, phase, what):
    at, width, values = SETTINGS[what]
    step.set(values[phase])
    for k in range(width):
        step.device("engine.thread", at + k, values[phase] >> 8 * k & 0xff)


THREAD = Act("a thread", phases=12, before=lambda m: m.hal.becomes("config.state", 3))
(REST, OFF, ON, PREPARE, ARM, TURN, RELEASE, FORCE, CANCEL, OFF_AGAIN, ON_AGAIN, LATE) = range(12)
PRESSED = {"prepare": (OFF, PREPARE, LATE), "arm": (ARM,), "release": (RELEASE,),
           "force": (FORCE,), "cancel": (CANCEL,)}
# what comes of a button that is not pressed yet, and of one that is: phases, and a pin
SEEN = {"prepare": (ON, PREPARE, "prepared"), "arm": (PREPARE, ARM, "waiting"),
        "release": (TURN, RELEASE, "active"), "force": (RELEASE, FORCE, "prepared"),
        "cancel": (FORCE, CANCEL, "prepared")}
STATES = {"prepared": (PREPARE, FORCE), "waiting": (ARM,), "active": (TURN,)}


@THREAD.rule(r"threading\.(prepare|arm|release|force|cancel)")
def _(step, phase, button):
    step.set(phase in (ON, PREPARE, ARM, TURN, RELEASE, FORCE, CANCEL, ON_AGAIN, LATE),
             "machine-is-on")
    step.set(True, "joint.00.enable")
    # so short a way that the device has all of it: nothing runs dry if the daemon is late
    step.set(0.0 if phase < ARM else 0.02, "joint.00.pos-cmd")
    step.press(phase in PRESSED[button])
    if phase in (ON, ON_AGAIN):
        step.shows(3, "engine-state")
    if phase == OFF_AGAIN:
        step.shows(False, "machine-on-permitted")
    if phase in SEEN[button][:2]:
        step.shows(phase in STATES[SEEN[button][2]], f"threading.{SEEN[button][2]}")


@THREAD.rule(r"threading\.(prepared|waiting|active)")
def _(step, phase, state):
    if phase < LATE:
        step.shows(phase in STATES[state])


@THREAD.rule(r"threading\.(refused|reason)")
def _(step, phase, _what):
    step.shows(int(phase in (OFF, ON)))


@THREAD.rule(r"threading\.error")
def _(step, phase):
    step.shows(0 if phase < CANCEL else 2 if phase < LATE else 3)


@THREAD.rule(r"threading\.time-limit")
def _(step, phase):
    step.set(0.5 if phase > CANCEL else 300.0)
    if phase in (CANCEL, LATE):
        step.shows(2 if phase == CANCEL else 3, "threading.error")


@THREAD.rule(r"threading\.behind")
def _(step, phase):
    if phase in (REST, ARM, RELEASE):
        step.shows((lambda have: have > 0) if phase == ARM else 0, state="some")


@THREAD.rule(r"threading\.spindle-rpm")
def _(step, phase):
    if phase == TURN:
        step.sim("spindle 240 4000")
    if phase in (PREPARE, TURN):
        step.shows((lambda have: 200 < have < 280) if phase == TURN else 0, state="turns")


@THREAD.rule(r"threading\.index-count")
def _(step, phase):
    if phase == TURN:
        step.changes(more)


@THREAD.rule(r"threading\.(?:velocity|position-error)")
def _(step, phase):
    if phase == TURN:
        step.changes()


ACTS = [SET, THREAD]
