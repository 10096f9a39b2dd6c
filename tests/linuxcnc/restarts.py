# SPDX-License-Identifier: GPL-2.0-or-later
"""The device is switched off and on while the machine is homed and stands somewhere: it counts
from 0, and answers again sooner or later than LinuxCNC's patience lasts. For machinist.py."""
import time

import hal
import linuxcnc
from safety import safety

BOOT_MS = (0, 15, 100, 1000)
PLACE = {"mill": "X80 Y20 Z-5 A10", "gantry": "X80 Y60 Z-5", "lathe": "X-30 Z-42",
         "printer-bed": "X80 Y60 Z-20"}
BACK = {"mill": "X30 Y40 Z-4 A45", "gantry": "X30 Y40 Z-4", "lathe": "X-20 Z-20",
        "printer-bed": "X30 Y40 Z-10"}


def arrived(m):
    """By LinuxCNC's own count: the device's began again with each restart."""
    return all(abs(hal.get_value(f"joint.{j}.motor-pos-cmd") - hal.get_value(f"joint.{j}.motor-pos-fb")) *
               abs(m.scale[j]) < 0.5 for j in m.joints)


def at_work(m, place):
    """Homed, and there. A busy computer is late at times, and then the machine has to be switched on again."""
    end = time.monotonic() + 240
    while True:
        m.switch_on()
        if not m.all_homed():
            m.home()
        if m.look().task_state == linuxcnc.STATE_ON:
            m.mode(linuxcnc.MODE_MDI)
            m.command.mdi(f"G53 G0 {place}")
            m.until(f"{place}, or switched off", lambda s: s.task_state != linuxcnc.STATE_ON or (
                s.echo_serial_number >= m.command.serial and s.inpos and
                s.interp_state == linuxcnc.INTERP_IDLE and s.state == linuxcnc.RCS_DONE))
        if m.within(5, lambda s: s.task_state == linuxcnc.STATE_ON and m.all_homed() and arrived(m)):
            return
        assert time.monotonic() < end, f"switched off again and again: {m.said}"


def places(m):
    return m.look().joint_actual_position[:len(m.joints)]


def is_restarted(m, boot_ms, back):
    stood, machine = places(m), m.pulses()[1]
    m.said.clear()
    m.sim(f"reboot keep-config {boot_ms}")
    with safety():
        m.until("LinuxCNC stopped", lambda s: s.task_state == linuxcnc.STATE_ESTOP)
        m.until("no joint homed", lambda s: not any(s.homed[j] for j in m.joints))
    m.until("the device is back", lambda _: hal.get_value("pokeys.0.connected"))
    m.until("the loss is known", lambda _: hal.get_value("pokeys.0.position-lost"))
    now = places(m)
    with safety():
        assert all(abs(a - b) < 0.01 for a, b in zip(now, stood)), f"positions jumped from {stood} to {now}"
    m.switch_on()
    # as an operator does who has seen nothing
    m.mode(linuxcnc.MODE_MDI)
    m.command.mdi(f"G53 G0 {back}")
    m.stays(f"after {boot_ms} ms, switched on and not homed,", *m.pulses())
    with safety():
        assert m.pulses()[1] == machine, f"it stood at {machine}, and is at {m.pulses()[1]}"
        assert hal.get_value("pokeys.0.position-lost"), "nobody has homed it"
    said = sorted({text.strip() for text in m.said})
    m.tell(f"away for {boot_ms} ms: {len(said)} messages, the last is {m.said[-1].strip() if said else None!r}")


def restarts(m):
    for boot_ms in BOOT_MS:
        at_work(m, PLACE[m.name])
        is_restarted(m, boot_ms, BACK[m.name])
    at_work(m, BACK[m.name])
    assert not hal.get_value("pokeys.0.position-lost"), "it has been homed"
    m.tell(f"homed again each time, ends at machine {m.pulses()[1]}")
