# SPDX-License-Identifier: MIT
"""Read and command PoKeys devices through a running pokeysd.

    import pokeys

    with pokeys.attach("mill") as mill:
        state = mill.read()
        print(state.pin[3].in_, state.joint[0].counts, state["engine-state"])

Values have the names of LinuxCNC's HAL (``pokeysctl names`` lists them). The package needs
libpokeys_shm.so.0 and no other Python package; the user must be in group pokeys-monitor.
"""
from .client import Device, attach, devices
from .commander import Axis, Command, Commander, Order, Servo
from .errors import Error, Lapsed, LibraryMissing, NoDaemon, NoSuchDevice, Refused, Stale, ToolFailed
from .events import Event
from .one_shot import MovesControl, OneShot, Outcome
from .pokeysctl import Found, discover
from .snapshot import Diagnostics, Histogram, State, board_outputs, describe, names

__all__ = ["Axis", "Command", "Commander", "Device", "Diagnostics", "Error", "Event", "Found", "Histogram", "Lapsed",
           "LibraryMissing", "MovesControl", "NoDaemon", "NoSuchDevice", "OneShot", "Order", "Outcome", "Refused",
           "Servo", "Stale", "State", "ToolFailed", "attach", "board_outputs", "describe", "devices", "discover",
           "names"]
