# SPDX-License-Identifier: GPL-2.0-or-later
"""What the machinist does at the gantry: the beam is made square, and stays so.

Y and Y2 are told the same by the same packets and have the same speeds in the device,
so their step counts may differ by rounding only, in every period, whatever gets lost.
"""
import hal
import linuxcnc
from safety import safety

Y, Y2 = 1, 2
EDGE = {Y: -1600, Y2: -1440}  # bench.sim: home switches
ZERO = {Y: 0, Y2: 56}  # gantry.ini: ZERO
HOMED = [160, 160, 160, -400]  # gantry.hal: HomePosition
ROUNDING = 2  # pulses


def askew(m):
    """How far Y is ahead of Y2, by the simulated machine, pulses."""
    _, machine = m.pulses()
    return (machine[Y] - EDGE[Y] + ZERO[Y]) - (machine[Y2] - EDGE[Y2] + ZERO[Y2])


def homed_square(m, when):
    m.home()
    m.settled()
    assert m.pulses()[0] == HOMED, f"{when}: homed at {m.pulses()[0]} pulses, should be {HOMED}"
    # each is found within a millisecond's way at the return speed, 0.36 pulses
    assert abs(askew(m)) <= ROUNDING, f"{when}: Y is {askew(m)} pulses ahead of Y2"
    m.tell(f"{when}: homed, Y is {askew(m)} pulses ahead of Y2")


def apart(samples, scale):
    """Most pulses between Y and Y2 in any period: as commanded, and as counted."""
    commands, feedback, _ = samples
    assert len(commands) > 1000, f"only {len(commands)} periods recorded"
    return [max(abs(p[Y] - p[Y2]) * scale for p in points) for points in (commands, feedback)]


def runs_square(m, when):
    samples = m.sampled(when, lambda: m.run("square.ngc"))
    m.settled()
    commanded, counted = apart(samples, m.scale[Y])
    assert commanded < 1 and counted <= ROUNDING, f"{when}: Y and Y2 {counted} pulses apart"
    assert abs(askew(m)) <= ROUNDING, f"{when}: Y is {askew(m)} pulses ahead of Y2"
    want = [50 * 160, 50 * 160, 50 * 160, -5 * 400]
    assert m.pulses()[0] == want, f"{when}: ends at {m.pulses()[0]} pulses, should be {want}"
    m.tell(f"{when}: {len(samples[0])} periods, Y and Y2 at most {counted:.1f} pulses apart; "
           f"ends at {want} pulses")


def under_way(m, line, beyond):
    """Begin a move of Y, and come back while it is going on."""
    m.mdi(line)
    m.until("the beam moving", lambda _: m.pulses()[0][Y] > beyond, 60)


def stands_square(m, what):
    m.until(f"LinuxCNC stopped by {what}", lambda s: s.task_state != linuxcnc.STATE_ON)
    with safety():
        m.until("both ends standing",
                lambda _: all(float(m.sim(f"axis {i}")["speed"]) == 0 for i in (Y, Y2)))
    m.stays(f"after {what}", *m.pulses())
    assert abs(askew(m)) <= ROUNDING, f"{what}: Y is {askew(m)} pulses ahead of Y2"
    m.tell(f"{what}: both ends stand at {m.pulses()[0][Y]} pulses, {askew(m)} apart")


def one_motor_fails(m):
    """The other one must not go on."""
    under_way(m, "G53 G1 F3000 Y400", 12000)
    m.sim(f"driver-error {Y2} 1")
    stands_square(m, "a fault of Y2's motor")
    m.until("nothing homed", lambda s: not any(s.homed[j] for j in m.joints), 60)
    stood = m.pulses()[0][Y]
    with safety():
        assert stood < 400 * 160, "the other motor went on to the end"
    m.sim(f"driver-error {Y2} 0")
    m.switch_on()


def one_end_trips(m):
    """A limit switch of one end stops both."""
    m.sim("switch 2 plus 40000 2000000")
    under_way(m, "G53 G1 F3000 Y400", 12000)
    stands_square(m, "Y2's limit switch")


def home_from_the_switch(m):
    """A beam that is not homed cannot be jogged: it homes away from the switch. Override, switch
    on, home; off the switch the device's override ends."""
    m.until("nothing homed", lambda s: not any(s.homed[j] for j in m.joints), 60)
    assert hal.get_value("joint.2.pos-lim-sw-in"), "it stands on no switch"
    m.override_limits()
    m.switch_on()
    homed_square(m, "from a limit switch")
    m.until("limits to count again",
            lambda _: not hal.get_value("pokeys.0.engine.limit-override-active"), 60)


def one_end_finds_nothing(m):
    """A home switch of one end that is never reached: neither end is homed."""
    m.sim("switch 2 home -2000000 -1900000")
    m.sim(f"switch 2 minus -2000000 {m.pulses()[1][Y2] - 2000}")
    m.begin_homing()
    m.until("LinuxCNC stopped by the limit switch",
            lambda s: s.task_state != linuxcnc.STATE_ON, 60)
    with safety():
        m.until("both ends standing",
                lambda _: all(float(m.sim(f"axis {i}")["speed"]) == 0 for i in (Y, Y2)))
    m.stays("after a homing that failed", *m.pulses())
    assert not m.look().homed[Y] and not m.stat.homed[Y2], "half a beam is homed"
    m.tell(f"one end finds no switch: neither is homed, Y stands {askew(m)} pulses ahead")


def gantry(m):
    m.switch_on()
    assert abs(askew(m)) > 50, "the beam is square before it was homed: this test proves nothing"
    homed_square(m, "clean")
    runs_square(m, "clean")
    m.lossy()
    homed_square(m, "lossy")
    runs_square(m, "lossy")
    m.tell(f"lossy: {m.lost()}")
    m.sim("fault off")
    one_motor_fails(m)
    homed_square(m, "after the fault")
    one_end_trips(m)
    home_from_the_switch(m)
    one_end_finds_nothing(m)
