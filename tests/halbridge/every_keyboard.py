# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for a kbd48CNC, the keyboard on PoNET."""
from every_bus import MODULES, replug, types
from every_io import coded
from every_name import Act
from every_play import set_all

KEYBOARD = Act("keyboard on PoNET", phases=6, before=replug(types(15)))
LAMPS = Act("lamps of the keyboard", phases=6,
            before=lambda m: set_all(m, {"legacy.pressed-key-lights": False,
                                         "legacy.key-brightness": False}))
LAMPS_OLD = Act("lamps of the keyboard, older names", phases=7)
LIGHT = Act("light of the keyboard", phases=3)
BRIGHTNESS = Act("brightness of the keyboard", phases=2,
                 before=lambda m: set_all(m, {"kbd48CNC.brightness": 33,
                                              "kbd48CNC.auto-brightness": False}))


def key(i):
    """Byte and bit of key 4 * column + row, by protocol section 3.13."""
    column, row = divmod(i, 4)
    return 16 * 15 + (column // 2 ^ 1), row if column % 2 else 7 - row


@KEYBOARD.rule(r"kbd48CNC\.(\d+)\.Button")
def _(step, phase, i):
    step.sim(f"kbd 15 {i // 4} {i % 4} {coded(i, phase):d}")
    step.shows(coded(i, phase))


@KEYBOARD.rule(r"kbd48CNC\.module", r"kbd48CNC\.PoNetID")
def _(step, phase):
    step.shows(15)


@KEYBOARD.rule(r"kbd48CNC\.present", r"kbd48CNC\.available")
def _(step, phase):
    step.shows(True)


def lamp(step, i, value):
    byte, bit = key(i)
    step.set(value)
    step.device("ponet.out", byte, value << bit, 1 << bit)


@LAMPS.rule(r"kbd48CNC\.(0\d|[1-4]\d)\.LED")
def _(step, phase, i):
    lamp(step, i, coded(i, phase))


@LAMPS_OLD.rule(r"kbd48CNC\.(\d)\.LED")
def _(step, phase, i):
    lamp(step, i, coded(i, phase - 1) if phase else True)


@LIGHT.rule(r"kbd48CNC\.(?:light|lightValue)")
def _(step, phase):
    step.sim(f"module 15 on {(40, 90, 200)[phase]}")
    step.sim("field ponet.type 15 16")
    step.shows((40, 90, 200)[phase])


@LIGHT.rule(r"kbd48CNC\.auto-brightness")
def _(step, phase):
    step.set(phase > 0)
    if phase:
        step.shows(255 - (40, 90, 200)[phase], "kbd48CNC.brightness-sent")
    step.device("ponet.brightness", 15, 255 - (40, 90, 200)[phase] if phase else 0)


@LIGHT.rule(r"kbd48CNC\.(?:brightness-sent|KeyBrightness)")
def _(step, phase):
    if phase:
        step.shows(255 - (40, 90, 200)[phase])


@LIGHT.rule(r"kbd48CNC\.prevBrightness")
def _(step, phase):
    if phase == 2:
        step.shows(255 - 90)


@BRIGHTNESS.rule(r"kbd48CNC\.brightness")
def _(step, phase):
    step.set((33, 77)[phase])
    step.device("ponet.brightness", 15, (33, 77)[phase])


@BRIGHTNESS.rule(r"kbd48CNC\.prevBrightness")
def _(step, phase):
    step.shows((255 - 200, 33)[phase])


PRESSED = Act("a pressed key lights", phases=2)
AMBIENT = Act("the keyboard's brightness is what the light wants", phases=2)


@PRESSED.rule(r"legacy\.pressed-key-lights")
def _(step, phase):
    byte, bit = key(5)
    step.set(False, "kbd48CNC.05.LED")
    step.set(False, "kbd48CNC.5.LED")
    step.sim("kbd 15 1 1 1")
    step.set(not phase)
    step.device("ponet.out", byte, 0 if phase else 1 << bit, 1 << bit)


@AMBIENT.rule(r"legacy\.key-brightness")
def _(step, phase):
    step.set(77 if not phase else -1, "kbd48CNC.brightness")
    step.set(bool(phase))
    step.device("ponet.brightness", 15, 255 - 200 if phase else 77)


NO_KEYBOARD = Act("a keyboard that is gone", phases=1, before=replug(
    [f"module {i} off" for i in range(MODULES)]))


@NO_KEYBOARD.rule(r"kbd48CNC\.PoNetID")
def _(step, phase):
    step.shows(0)


@NO_KEYBOARD.rule(r"kbd48CNC\.module")
def _(step, phase):
    step.shows(255)


@NO_KEYBOARD.rule(r"kbd48CNC\.present", r"kbd48CNC\.available")
def _(step, phase):
    step.shows(False)


ACTS = [KEYBOARD, LAMPS, LAMPS_OLD, LIGHT, BRIGHTNESS, PRESSED, AMBIENT, NO_KEYBOARD]
