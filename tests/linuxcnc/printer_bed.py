# SPDX-License-Identifier: GPL-2.0-or-later
"""What the machinist does at the machine with a heated bed: a programme waits for it, and what
stops the machine switches it off. What heats is asked of the simulator.
"""
import hal
import linuxcnc
from safety import safety

HOME = ((-4000, 0), (-4000, 0), (4000, 0))  # bench.sim's edges, HOME_OFFSET
TARGET = 30  # of warm-up.ngc, as the test has it: a bed takes minutes to 60 degrees
SENSOR = 44


def bed(m):
    return {key: float(value) for key, value in m.sim(f"heat {SENSOR}").items() if key in ("block", "power")}


def shown(name):
    return hal.get_value(f"pokeys.0.heater.00.{name}")


def is_cold(m, when):
    """It gets no power, for some hundred of the daemon's cycles."""
    with safety():
        m.until(f"{when}: no power", lambda _: bed(m)["power"] == 0)
    begin = hal.get_value("pokeys.0.cycle")
    while hal.get_value("pokeys.0.cycle") - begin < 500:
        power = bed(m)["power"]
        with safety():
            assert power == 0, f"{when}: it heats with {power}"


def heats(m, when):
    m.until(f"{when}: power", lambda _: bed(m)["power"] > 0)


def in_the_corner(m):
    """Where warm-up.ngc waits, and ends."""
    return m.pulses()[0][:2] == [round((20 + hal.get_value(f"joint.{j}.motor-offset")) * m.scale[j]) for j in range(2)]


def waits(m):
    """Is it warm? The axes do not go on before."""
    assert in_the_corner(m) or shown("temperature") > TARGET - 3, f"the axes went on to {m.pulses()[0]}"
    return shown("at-temperature")


def the_programme_waits_for_it(m):
    m.begin("warm-up.ngc")
    heats(m, "begun")
    m.until("the axes where they wait", lambda _: in_the_corner(m), 60)
    before = bed(m)["block"]
    assert not shown("at-temperature") and before < TARGET - 1, f"it is {before} degrees warm"
    m.until("the bed warm", lambda _: waits(m), 120)
    m.done()
    m.settled()
    assert in_the_corner(m), m.pulses()
    assert shown("target-in-effect") == 0, shown("target-in-effect")
    is_cold(m, "done")
    m.tell(f"the bed was {before:.1f} degrees warm when the axes waited, {bed(m)['block']:.1f} at the end")


def an_emergency_stop_switches_it_off(m):
    m.move(f"M68 E0 Q{TARGET + 10}")
    heats(m, "commanded")
    m.command.state(linuxcnc.STATE_ESTOP)
    is_cold(m, "emergency stop")
    m.switch_on()
    is_cold(m, "reset")
    m.home()
    m.move("M68 E0 Q0")
    m.until("the target 0", lambda _: hal.get_value("motion.analog-out-00") == 0)
    m.move(f"M68 E0 Q{TARGET + 10}")
    heats(m, "commanded again")
    m.tell("emergency stop: off, and on again only after a target of 0")


def a_broken_sensor_stops_the_machine(m):
    m.said.clear()
    m.sim(f"heat {SENSOR} open")
    with safety():
        m.until("LinuxCNC stopped", lambda s: s.task_state == linuxcnc.STATE_ESTOP)
    is_cold(m, "sensor open")
    m.until("a message for the operator", lambda _: any("fault of the heated bed" in text for text in m.said))
    # not before the cable is in again
    m.command.state(linuxcnc.STATE_ESTOP_RESET)
    m.command.wait_complete()
    m.until("still in emergency stop", lambda s: s.task_state == linuxcnc.STATE_ESTOP)
    m.sim(f"heat {SENSOR} good")
    m.until("a temperature", lambda _: shown("temperature") > 0)
    m.switch_on()
    is_cold(m, "mended and reset")
    assert not shown("fault")
    m.tell(f"sensor open: the operator sees {[text.strip() for text in m.said[:2]]}; off, and reset when mended")


def printer_bed(m):
    m.switch_on()
    m.homes_at("homed", HOME)
    the_programme_waits_for_it(m)
    an_emergency_stop_switches_it_off(m)
    a_broken_sensor_stops_the_machine(m)
