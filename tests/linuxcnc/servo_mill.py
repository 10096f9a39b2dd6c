# SPDX-License-Identifier: GPL-2.0-or-later
"""What the machinist does at the mill with servo motors: the daemon closes their loops.

A computer that is late by a tenth of a second stops a motor, as it must; then the machine
is off, and the operator resets it, homes it and begins again. What is tested is where the
motors of the simulator are in the end, and that they have no voltage when something is wrong.
"""
import time

import hal
import linuxcnc
from safety import safety

SCALE = 400  # counts per millimetre
HOME = ((-4000, 0), (-4000, 0), (4000, 0))  # bench.sim's edges, HOME_OFFSET
END = (30.125, 41.7, -5)  # of arcs.ngc, machine units
NEAR = 8  # counts, 0.02 mm
LIMIT = -6000  # bench.sim: X's limit switch
FAR = 200  # mm: beyond any switch, and less than the range that an axis may be jogged
PATIENCE_S = 200


def motors(m):
    return [m.sim(f"motor {j}") for j in m.joints]


def counts(m):
    """Of the motors themselves."""
    return [int(motor["count"]) for motor in motors(m)]


def apart(m):
    return max(abs(is_ - wanted) for is_, wanted in zip(counts(m), m.commanded()))


def settled(m):
    """At rest: a motor that follows well is where it is commanded to be at any time."""
    m.until("the motors where they were sent", lambda s: s.inpos and not s.queue and apart(m) <= NEAR, 60)


def voltage(m):
    return [float(motor["output"]) for motor in motors(m)]


def no_voltage(m, when):
    with safety():
        m.until(f"{when}: no voltage", lambda _: voltage(m) == [0.0] * len(m.joints))


def faults(m):
    return [hal.get_value(f"pokeys.0.servo.{j:02}.fault-code") for j in m.joints]


def reset(m):
    """Faults of motors are cleared by the reset of an emergency stop; that ends an override of limits."""
    if any(faults(m)):
        m.command.state(linuxcnc.STATE_ESTOP)
        m.command.wait_complete()
        m.command.state(linuxcnc.STATE_ESTOP_RESET)
        m.within(20, lambda _: not any(faults(m)))
        if any(m.look().joint[j][end] for j in m.joints for end in ("min_hard_limit", "max_hard_limit")):
            m.override_limits()


def homed(m):
    m.switch_on()
    m.home()


def stays_off(m, when):
    """For some hundred of the daemon's cycles."""
    begin, end = hal.get_value("pokeys.0.cycle"), time.monotonic() + 60
    while hal.get_value("pokeys.0.cycle") - begin < 200:
        with safety():
            assert m.look().task_state != linuxcnc.STATE_ON, f"{when}: it came on"
            assert not any(hal.get_value(f"pokeys.0.servo.{j:02}.enabled") for j in m.joints), f"{when}: enabled"
            assert voltage(m) == [0.0] * len(m.joints), f"{when}: voltage"
        assert time.monotonic() < end, "the daemon's cycles stand still"


def is_unhomed(m, when):
    with safety():
        m.until(f"{when}: no joint homed", lambda s: not any(s.homed[j] for j in m.joints))


def again(m, what, work):
    """Until nobody has switched it off on the way."""
    end, tries = time.monotonic() + PATIENCE_S, 1
    while True:
        try:
            return work()
        except AssertionError:
            if m.look().task_state == linuxcnc.STATE_ON or time.monotonic() > end:
                raise
            tries += 1
            m.tell(f"{what}: switched off ({m.said[-1:]}, faults {faults(m)}), try {tries}")
            m.until("the motors standing", lambda _: not any(voltage(m)))
            m.off_the_limit_switches()
            homed(m)


def homing_finds_the_switches(m):
    m.switch_on()
    m.homes_at("homed", HOME, NEAR)


def the_programme_runs(m, name):
    samples = again(m, name, lambda: m.sampled(name, lambda: m.run("arcs.ngc")))
    settled(m)
    want = [round((END[j] + hal.get_value(f"joint.{j}.motor-offset")) * SCALE) for j in m.joints]
    have = counts(m)
    assert all(abs(a - b) <= NEAR for a, b in zip(have, want)), f"ends at {have} counts, should be {want}"
    commands, feedback, _ = samples
    behind = sorted(max(abs(a - b) for a, b in zip(*period)) for period in zip(commands, feedback))
    m.tell(f"{name}: ends at {have} counts, wanted {want}; in half of the periods at most "
           f"{behind[len(behind) // 2]:.4f} mm from the command")


def a_stalled_motor_stops_the_machine(m):
    again(m, "a way", lambda: m.move("G53 G0 X100 Y40 Z-10"))
    m.said.clear()
    m.sim("motor 0 stalled")
    m.mdi("G53 G1 F3000 X20")
    m.until("LinuxCNC switched off", lambda s: s.task_state != linuxcnc.STATE_ON)
    no_voltage(m, "a stalled motor")
    assert hal.get_value("pokeys.0.servo.00.fault"), "no fault is shown"
    m.until("a message for the operator", lambda _: any("amplifier fault" in text for text in m.said))
    # not switched on by itself, and not without a reset
    m.command.state(linuxcnc.STATE_ON)
    m.command.wait_complete()
    m.until("LinuxCNC switched off again", lambda s: s.task_state != linuxcnc.STATE_ON)
    stays_off(m, "switched on without a reset")
    m.sim("motor 0 good")
    homed(m)
    again(m, "the way back", lambda: m.move("G53 G0 X30.125 Y41.7 Z-5"))
    settled(m)
    m.tell(f"a stalled motor: the operator sees {[text.strip() for text in m.said[:2]]}; homed again")


def a_limit_switch_stops_and_lets_return(m):
    m.mode(linuxcnc.MODE_MANUAL)
    m.command.teleop_enable(0)
    m.command.wait_complete()
    m.command.unhome(-1)
    m.until("no joint homed", lambda s: not any(s.homed[j] for j in m.joints), 60)
    m.command.jog(linuxcnc.JOG_INCREMENT, True, 0, -10, FAR)
    m.until("LinuxCNC stopped", lambda s: s.task_state != linuxcnc.STATE_ON, 60)
    no_voltage(m, "on the limit switch")
    at = counts(m)[0]
    with safety():
        assert LIMIT - 2 * SCALE < at <= LIMIT, f"stands at {at} counts, the switch is at {LIMIT}"
    m.tell(f"a limit switch at {LIMIT} counts: stands at {at}")
    m.off_the_limit_switches()
    homed(m)
    settled(m)


def cable_out_stops_for_good(m):
    again(m, "a way", lambda: m.move("G53 G0 X20 Y20 Z-5"))
    m.mdi("G53 G1 F2400 X200")
    start = counts(m)[0]
    m.until("the axis moving", lambda _: counts(m)[0] > start + 4000 or m.stat.task_state != linuxcnc.STATE_ON)
    m.sim("silence 3600000")
    m.until("LinuxCNC stopped", lambda s: s.task_state == linuxcnc.STATE_ESTOP)
    no_voltage(m, "the cable out")  # by the device's own failsafe
    with safety():
        m.until("the axis standing", lambda _: abs(float(m.sim("motor 0")["rpm"])) < 1)
    stood = counts(m)
    m.cable_in()
    m.command.state(linuxcnc.STATE_ON)          # without a reset: no
    stays_off(m, "switched on without a reset")
    with safety():
        assert counts(m) == stood, f"it moves from {stood} to {counts(m)}"
        assert m.look().task_state == linuxcnc.STATE_ESTOP, "it came on by itself"
    is_unhomed(m, "cable out")
    homed(m)
    again(m, "the way back", lambda: m.move("G53 G0 X30.125 Y41.7 Z-5"))
    settled(m)
    m.tell(f"cable out: X stood at {stood[0]} counts; homed again")


def a_restart_is_never_a_position(m):
    """The device is back at once, and where its axes are nobody knows."""
    again(m, "a way", lambda: m.move("G53 G0 X40 Y20 Z-5"))
    m.sim("reboot keep-config")
    m.until("LinuxCNC stopped", lambda s: s.task_state != linuxcnc.STATE_ON)
    no_voltage(m, "restarted")
    m.until("the device is back", lambda _: hal.get_value("pokeys.0.connected"))
    is_unhomed(m, "restarted")
    homed(m)
    again(m, "the way back", lambda: m.move("G53 G0 X30.125 Y41.7 Z-5"))
    # the daemon's positions have gone on from those before, so only the switches say where 0 is
    want = [edge + END[j] * SCALE for j, (edge, _) in enumerate(HOME)]
    m.until(f"the motors at {want}",
            lambda _: all(abs(is_ - wanted) <= 2 * NEAR for is_, wanted in zip(counts(m), want)), 60)
    m.tell(f"restarted: unhomed, homed again, ends at {counts(m)} counts, wanted {want}")


def the_button_stops_and_has_to_be_reset(m):
    again(m, "a way", lambda: m.move("G53 G0 X20 Y20 Z-5"))
    m.mdi("G53 G1 F800 X60")
    m.sim("pin 23 1")
    m.until("LinuxCNC stopped", lambda s: s.task_state == linuxcnc.STATE_ESTOP)
    no_voltage(m, "the button")
    m.sim("pin 23 0")
    m.command.state(linuxcnc.STATE_ON)          # without a reset: no
    stays_off(m, "released")
    is_unhomed(m, "the button")
    homed(m)


def servo_mill(m):
    again(m, "homing", lambda: homing_finds_the_switches(m))
    the_programme_runs(m, "clean")
    m.sim("fault both loss 0.01")
    the_programme_runs(m, "lossy")
    m.tell(f"lossy: {m.lost()}")
    m.sim("fault off")
    a_stalled_motor_stops_the_machine(m)
    a_limit_switch_stops_and_lets_return(m)
    cable_out_stops_for_good(m)
    a_restart_is_never_a_position(m)
    the_button_stops_and_has_to_be_reset(m)
