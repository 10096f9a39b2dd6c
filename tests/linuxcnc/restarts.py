# SPDX-License-Identifier: GPL-2.0-or-later
"""Positions are lost while the machine is homed. For machinist.py.

The device is switched off and on: it counts from 0, and answers again sooner or later than LinuxCNC's
patience lasts. Or another client sets a position, another device takes its address, or what was to be
played is not there in time.
"""
import socket
import struct
import time

import hal
import linuxcnc
from safety import safety

BOOT_MS = (0, 15, 100, 1000)
STRANGER = 4711                 # serial number of another device
DRY_MS = 700                    # longer than what a buffer holds, shorter than lost-after-ms
SET_POSITIONS = 0xBB, 0x85, 3   # sets the positions of the axes whose bits follow
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


def is_known(m):
    """LinuxCNC has stopped, and trusts no position."""
    with safety():
        m.until("LinuxCNC stopped", lambda s: s.task_state == linuxcnc.STATE_ESTOP)
        m.until("no joint homed", lambda s: not any(s.homed[j] for j in m.joints))
    m.until("the device is back", lambda _: hal.get_value("pokeys.0.connected"))
    m.until("the loss is known", lambda _: hal.get_value("pokeys.0.position-lost"))


def stays_there(m, what, back):
    """It is switched on, and moves nowhere until it is homed."""
    machine = m.pulses()[1]
    m.switch_on()
    # as an operator does who has seen nothing
    m.mode(linuxcnc.MODE_MDI)
    m.command.mdi(f"G53 G0 {back}")
    m.stays(f"{what}, switched on and not homed,", *m.pulses())
    with safety():
        assert m.pulses()[1] == machine, f"it stood at {machine}, and is at {m.pulses()[1]}"
        assert hal.get_value("pokeys.0.position-lost"), "nobody has homed it"
    said = sorted({text.strip() for text in m.said})
    m.tell(f"{what}: {len(said)} messages, the last is {m.said[-1].strip() if said else None!r}")


def lost_at_rest(m, what, lose):
    """`lose` does it while the machine stands at its place."""
    at_work(m, PLACE[m.name])
    stood, machine = places(m), m.pulses()[1]
    m.said.clear()
    lose()
    is_known(m)
    now = places(m)
    with safety():
        assert all(abs(a - b) < 0.01 for a, b in zip(now, stood)), f"positions jumped from {stood} to {now}"
        assert m.pulses()[1] == machine, f"it stood at {machine}, and is at {m.pulses()[1]}"
    stays_there(m, what, BACK[m.name])


def homed_again(m):
    at_work(m, BACK[m.name])
    assert not hal.get_value("pokeys.0.position-lost"), "it has been homed"
    m.tell(f"homed again each time, ends at machine {m.pulses()[1]}")


def restarts(m):
    for boot_ms in BOOT_MS:
        lost_at_rest(m, f"away for {boot_ms} ms", lambda ms=boot_ms: m.sim(f"reboot keep-config {ms}"))
    homed_again(m)


def set_elsewhere(m, axis, counts):
    """As a program of the vendor's does that knows nothing of us."""
    request = bytearray(64)
    request[:4] = *SET_POSITIONS, 1 << axis
    struct.pack_into("<i", request, 8 + 4 * axis, counts)
    request[7] = sum(request[:7]) & 0xff
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.sendto(request, m.device)


def replaced(m, serial):
    m.sim(f"serial {serial}")
    m.sim("reboot keep-config 1000")


def losses(m):
    """What takes positions, besides a restart."""
    lost_at_rest(m, "a position set by another client", lambda: set_elsewhere(m, 0, -123456))
    lost_at_rest(m, "another device at its address", lambda: replaced(m, STRANGER))
    homed_again(m)


def dry(m):
    """A motion buffer that runs dry: nobody knows how many steps that has cost."""
    at_work(m, PLACE[m.name])
    begin = places(m)[0]
    m.said.clear()
    m.command.mdi(f"G53 G1 {BACK[m.name]} F600")
    # a motor loses no steps in a stop from almost nothing
    m.until("X on its way", lambda _: abs(places(m)[0] - begin) > 5)
    m.sim(f"silence {DRY_MS}")
    is_known(m)
    m.until("the axes standing", lambda _: not any(m.turns(a) for a in m.joints))
    stays_there(m, "the buffer ran dry", BACK[m.name])
    homed_again(m)
