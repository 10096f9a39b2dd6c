#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Messages as machinekit's own definitions encode them: what clients send is understood, and what the proxy
sends is the same, byte for byte."""
import itertools
import pathlib
import sys
import types

from libraries import need

need("google.protobuf")
from pokeys_remote import message  # noqa: E402
from pokeys_remote.component import Component  # noqa: E402
from pokeys_remote.definition import Definition, Direction, Kind, Pin, Rules, Watched  # noqa: E402
from pokeys_remote.groups import Groups  # noqa: E402
from pokeys_remote.message import Type  # noqa: E402

HERE = pathlib.Path(__file__).parent
PINS = (Pin("panel.start", Kind.BIT, Direction.OUT), Pin("panel.speed", Kind.FLOAT, Direction.IN),
        Pin("panel.count", Kind.S32, Direction.IO), Pin("panel.mask", Kind.U32, Direction.OUT))
VALUES = (True, 2.5, -7, 2**32 - 1)
GOLDEN = {name: bytes.fromhex(data) for name, data in
          (line.split() for line in (HERE / "golden.txt").read_text(encoding="ascii").splitlines() if line[0] != "#")}


def same(name, made):
    made.uuid = bytes(range(16))
    assert made.SerializeToString() == GOLDEN[name], f"{name}: {made} is not {message.decode(GOLDEN[name])}"


def main():
    assert message.decode(GOLDEN["ping"]).type == Type.PING
    bind = message.decode(GOLDEN["bind"])
    assert bind.type == Type.BIND and bind.comp[0].no_create and bind.comp[0].timer == 50
    found, faults = message.definition(bind.comp[0])
    assert found == Definition("panel", PINS) and not faults, (found, faults)
    assert tuple(message.value_of(pin) for pin in bind.comp[0].pin) == tuple(
        (value, pin.kind) for value, pin in zip(VALUES, PINS, strict=True))
    asked = message.decode(GOLDEN["set"])
    assert asked.type == Type.SET and asked.reply_required
    assert [(pin.handle, message.value_of(pin)) for pin in asked.pin] == [
        (129, (True, Kind.BIT)), (4026531841, (-0.125, Kind.FLOAT)), (131, (-2**31, Kind.S32)),
        (132, (2**32 - 1, Kind.U32))]
    asked = message.decode(GOLDEN["get"])
    assert (asked.type, asked.pin[0].name, asked.signal[0].name) == (Type.COMMAND_GET, b"motion.enabled", b"x")
    for data in (b"\xff\xff", GOLDEN["bind"][:-3], b"\x08" + b"\xff" * 20, GOLDEN["ping"] + b"\x0c", bytes(message.MOST + 1)):
        assert message.decode(data) is None, data

    component = Component(Definition("panel", PINS), Rules(), itertools.count(129))
    component.attach({pin.name[6:]: value for pin, value in zip(PINS, VALUES, strict=True)} | {})
    component.subscribers = 1
    full = message.answer(Type.FULL)
    full.serial = component.next_serial()
    message.describe(full, component, zip(component.pins, VALUES, strict=True))
    full.comp[0].pid = 1234
    full.pparams.keepalive_timer, full.pparams.group_timer, full.pparams.rcomp_timer = 2000, 100, 100
    same("full", full)
    change = message.answer(Type.INCREMENTAL)
    change.serial = component.next_serial()
    for pin, value in ((component.pins[1], 3.0), (component.pins[2], 8)):
        item = change.pin.add()
        item.handle, item.type = pin.handle, int(pin.pin.kind)
        message.put_value(item, pin.pin.kind, value)
    same("incremental", change)
    same("reject", message.answer(Type.BIND_REJECT, ["no", "not so"]))
    same("set-reject", message.answer(Type.SET_REJECT, ["no"]))
    same("pong", message.answer(Type.PING_ACK))

    sent = []
    topics = types.SimpleNamespace(count=lambda name: name == "dro", listen=lambda: [("dro", True), ("x", True)],
                                   send=lambda name, made: sent.append((name, made)))
    values = {"x-pos": 2.5, "spindle-on": True, "count": -7, "mask": 2**32 - 1}
    kinds = dict(zip(values, (Kind.FLOAT, Kind.BIT, Kind.S32, Kind.U32), strict=True))
    groups = Groups({"dro": Watched(tuple(values), epsilon=0.001)}, types.SimpleNamespace(
        signals=lambda: {name: (kinds[name], value) for name, value in values.items()}), topics, itertools.count(129).__next__)
    groups.listen()
    assert sent[0][1].note == [b"there is no group x; there are: dro"]
    sent[0][1].note[0] = b"no"
    groups.look(0.0)
    values.update({"x-pos": 3.0, "count": 8, "mask": 2**32 - 1})
    groups.look(1.0)
    assert [name for name, _ in sent] == ["x", "dro", "dro"]
    for name, (_, made) in zip(("no-group", "group-full", "group-incremental"), sent, strict=True):
        same(name, made)
    print(f"{len(GOLDEN)} messages")


main()
