# SPDX-License-Identifier: GPL-2.0-or-later
"""What the machinist does at the pendant: a hand wheel and a kbd48CNC at the device."""
import hal
import linuxcnc
from safety import safety

KEYBOARD = 0  # its place on PoNET
CLICK = 4  # counts
COUNT_PULSES = 4  # device-jog.hal: pulses a count
STEP = 0.1  # mm a click, with the key for it held
TRIES = 5


def key(m, number, pressed):
    m.sim(f"kbd {KEYBOARD} {number // 4} {number % 4} {int(pressed)}")
    m.until(f"key {number} seen",
            lambda _: hal.get_value(f"pokeys.0.kbd48CNC.{number:02}.Button") == pressed, 60)


def speed(m, joint):
    return float(m.sim(f"axis {joint}")["speed"])


def stands(m, joint, why):
    m.until(f"LinuxCNC jogging no more, {why}", lambda _: not hal.get_value("motion.jog-is-active"))
    with safety():
        m.until(f"axis {joint} standing, {why}", lambda _: speed(m, joint) == 0)
    m.settled()
    m.stays(why, *m.pulses())


def keys_jog_while_they_are_pressed(m):
    begun = m.pulses()[0]
    for joint, minus, plus in ((0, 0, 4), (1, 1, 5), (2, 2, 6), (3, 3, 7)):
        away, back = (minus, plus) if joint == 2 else (plus, minus)
        sign = -1 if joint == 2 else 1
        key(m, away, True)
        m.until(f"axis {joint} jogging", lambda _, j=joint, s=sign: speed(m, j) * s > 0, 60)
        key(m, away, False)
        stands(m, joint, "key released")
        gone = m.pulses()[0]
        assert (gone[joint] - begun[joint]) * sign > 0
        with safety():
            assert all(gone[j] == begun[j] for j in m.joints if j > joint), f"another axis has moved: {begun} -> {gone}"
        key(m, back, True)
        m.until(f"axis {joint} jogging back", lambda _, j=joint, s=sign: speed(m, j) * s < 0, 60)
        key(m, back, False)
        stands(m, joint, "key released")
    m.tell("keys: each axis jogs to and fro while its key is pressed, and stands when it is up")


def select_wheel(m, number, axis):
    key(m, number, True)
    m.until(f"wheel on {axis}", lambda _: hal.get_value(f"axis.{axis}.jog-enable"), 60)
    key(m, number, False)


def wheel_moves_to_the_count(m):
    """Clicks times the step, exactly, however fast the wheel is turned."""
    for number, axis, joint, clicks in ((8, "x", 0, 73), (9, "y", 1, 41), (10, "z", 2, -52)):
        select_wheel(m, number, axis)
        key(m, 12, True)
        begun = m.pulses()[0]
        want = list(begun)
        want[joint] += round(clicks * STEP * m.scale[joint])
        for _ in range(abs(clicks)):
            m.sim(f"encoder 0 turn {CLICK if clicks > 0 else -CLICK}")
        m.until(f"{axis} where the wheel is", lambda _, w=want: m.pulses()[0] == w, 60)
        key(m, 12, False)
        m.stays("the wheel stands", *m.pulses())
        m.tell(f"wheel: {clicks} clicks moved {axis} by {clicks * STEP:.1f} mm, to the pulse")
    m.until("the lamp of the wheel on Z", lambda _: m.sim(f"lamp {KEYBOARD} 2 2")["lit"] == "1")


def a_lost_keyboard_stops(m):
    """Its plug is pulled while a jog key is held."""
    key(m, 4, True)
    m.until("X jogging", lambda _: speed(m, 0) > 0, 60)
    m.sim(f"module {KEYBOARD} off")
    m.until("the key counts as up", lambda _: not hal.get_value("pokeys.0.kbd48CNC.04.Button"), 60)
    stands(m, 0, "keyboard lost")
    assert m.look().task_state == linuxcnc.STATE_ON, f"switched off: {m.said}"
    m.sim(f"kbd {KEYBOARD} 1 0 0")
    m.sim(f"module {KEYBOARD} on 128")
    m.until("the keyboard back", lambda _: hal.get_value("pokeys.0.kbd48CNC.present"), 60)
    m.tell(f"keyboard lost with X+ held: X stands at {m.pulses()[0][0]} pulses")


def a_lost_connection_does_not_jog_on(m):
    key(m, 4, True)
    m.until("X jogging", lambda _: speed(m, 0) > 0, 60)
    m.sim("silence 3600000")
    m.until("LinuxCNC stopped", lambda s: s.task_state == linuxcnc.STATE_ESTOP)
    with safety():
        m.until("the axis standing", lambda _: speed(m, 0) == 0)
    pulses = m.pulses()
    m.cable_in()
    m.until("the fault gone", lambda _: not hal.get_value("estop.fault-in"))
    m.stays("with the cable in again", *pulses)
    m.switch_on()
    m.stays("switched on with the key still held", *pulses)
    key(m, 4, False)
    m.tell("cable out with X+ held: it stands, also when it is switched on again")


def the_device_follows_its_wheel(m):
    """device-jog.hal: a switch, while LinuxCNC is off. LinuxCNC knows where it went."""
    m.sim("fault off")
    m.command.state(linuxcnc.STATE_OFF)
    m.until("the machine off", lambda s: s.task_state != linuxcnc.STATE_ON)
    begun = m.pulses()[0][0]
    m.sim(f"encoder 0 turn {5 * CLICK}")
    m.stays("the wheel turned with its switch open", *m.pulses())
    for _ in range(TRIES):      # who closes it while data are stale closes it again
        m.sim("pin 6 0")
        if m.within(10, lambda _: hal.get_value("pokeys.0.engine-state") == 10):
            break
        m.sim("pin 6 1")
    m.until("the device jogging", lambda _: hal.get_value("pokeys.0.engine-state") == 10)
    for _ in range(30):
        m.sim(f"encoder 0 turn {CLICK}")
    want = begun + 30 * CLICK * COUNT_PULSES
    m.until("X where the wheel is", lambda _: m.pulses()[0][0] == want)
    m.sim("pin 6 1")
    m.until("the device standing", lambda _: hal.get_value("pokeys.0.engine-state") == 0)
    m.sim(f"encoder 0 turn {5 * CLICK}")
    m.stays("the wheel turned with its switch open again", *m.pulses())
    m.switch_on()
    m.stays("switched on behind the wheel", *m.pulses())
    m.settled()
    assert m.pulses()[0][0] == want
    m.tell(f"device jogs: 30 clicks moved X by {30 * CLICK * COUNT_PULSES} pulses, LinuxCNC agrees")


def off_a_limit_switch(m):
    """Not homed: the joint jogs into its limit, and off it with the override."""
    m.sim("switch 0 plus -2000000 -1900000")
    m.sim(f"switch 0 plus {m.pulses()[1][0] + 800} 2000000")
    m.mode(linuxcnc.MODE_MANUAL)
    m.command.teleop_enable(0)
    m.command.wait_complete()
    m.command.jog(linuxcnc.JOG_CONTINUOUS, True, 0, 5)
    m.until("LinuxCNC stopped by the limit switch", lambda s: s.task_state != linuxcnc.STATE_ON, 60)
    stood = m.pulses()[1][0]
    m.override_limits()
    m.switch_on()
    m.command.teleop_enable(0)
    m.command.wait_complete()
    m.command.jog(linuxcnc.JOG_CONTINUOUS, True, 0, -5)
    m.until("the switch left", lambda _: not hal.get_value("joint.0.pos-lim-sw-in"), 60)
    m.command.jog(linuxcnc.JOG_STOP, True, 0)
    m.until("limits to count again",
            lambda _: not hal.get_value("pokeys.0.engine.limit-override-active") and
            not hal.get_value("halui.joint.0.override-limits"), 60)
    assert m.look().task_state == linuxcnc.STATE_ON, f"switched off: {m.said}"
    m.tell(f"limit switch: stopped at machine {stood}, jogged off to {m.pulses()[1][0]}")


def jogging(m):
    m.switch_on()
    m.home()
    m.settled()
    m.command.teleop_enable(1)
    m.command.wait_complete()
    m.until("the keyboard", lambda _: hal.get_value("pokeys.0.kbd48CNC.present"), 60)
    keys_jog_while_they_are_pressed(m)
    wheel_moves_to_the_count(m)
    a_lost_keyboard_stops(m)
    the_device_follows_its_wheel(m)
    m.home()
    m.command.teleop_enable(1)
    m.command.wait_complete()
    m.lossy()
    wheel_moves_to_the_count(m)
    m.tell(f"lossy: {m.lost()}")
    m.sim("fault off")
    a_lost_connection_does_not_jog_on(m)
    off_a_limit_switch(m)
