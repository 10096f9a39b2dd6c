# SPDX-License-Identifier: GPL-2.0-or-later
"""One switch is home and limit: a homing passes over it, everything else is stopped by it."""
import hal
import linuxcnc
from safety import safety

FAR = 200  # mm: beyond any switch
JOINT = 0


def jogs_onto_the_switch(m, edge):
    """A jog of an axis that nobody has homed, so no software limit is in its way."""
    m.mode(linuxcnc.MODE_MANUAL)
    m.command.teleop_enable(0)
    m.command.wait_complete()
    m.command.unhome(-1)
    m.until("no joint homed", lambda s: not any(s.homed[j] for j in m.joints), 60)
    start = m.pulses()[1][JOINT]
    assert start > edge, "it stands on the switch already"
    m.said.clear()
    m.command.jog(linuxcnc.JOG_INCREMENT, True, JOINT, -5, FAR)
    m.until("LinuxCNC stopped by the switch", lambda s: s.task_state != linuxcnc.STATE_ON, 60)
    with safety():
        m.until("the axis standing", lambda _: float(m.sim(f"axis {JOINT}")["speed"]) == 0)
    m.until("a message for the operator", lambda _: any("limit switch" in text for text in m.said))
    stood, machine = m.pulses()
    m.stays("on the switch", stood, machine)
    with safety():
        assert start - FAR * m.scale[JOINT] / 2 < machine[JOINT] <= edge, \
            f"stopped at {machine[JOINT]} pulses, the switch is at {edge}"
    assert m.look().joint[JOINT]["min_hard_limit"], "it stands on no limit switch"
    m.tell(f"one switch: a jog from {start} is stopped at {machine[JOINT]} pulses, the switch is at {edge}")


def homes_from_the_switch(m):
    m.off_the_limit_switches()
    m.until("off the switch", lambda s: not s.joint[JOINT]["min_hard_limit"])
    m.switch_on()
    m.home()
