#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The protocol of remote components against LinuxCNC's HAL."""
import math
import os
import pathlib
import random

import rig
from rig import BIT, FLOAT, IN, IO, OUT, PANEL, S32, halcmd

CONFIG = """\
[component panel]
interval-ms = 20

[component narrow]
interval-ms = 10

[pin panel.speed]
epsilon = 0.5

[offer]
read = threads.*, servo-thread.*, pokeys-test.*, panel-*
write = pokeys-test.*
"""
GOLDEN = pathlib.Path(__file__).parent / "golden.txt"


def pins_of(answer):
    return {pin.name: pin for pin in answer.comp[0].pin}


def a_component_is_created_bound_and_described(machine):
    machine.proxy(CONFIG)
    one = machine.client()
    assert one.ask(210).type == 215
    answer = one.bind(no_create=True)
    assert (answer.type, list(answer.note)) == (258, ["there is no component panel, and the request says that it is "
                                                      "not to be created"]), answer
    answer = one.bind()
    assert answer.type == 257 and len(answer.uuid) == 16, answer
    found = pins_of(answer)
    assert set(found) == {f"panel.{name}" for name, _, _ in PANEL}, found
    assert len({pin.handle for pin in found.values()}) == len(PANEL), found
    assert {(pin.name, pin.type, pin.dir) for pin in found.values()} == \
        {(f"panel.{name}", kind, direction) for name, kind, direction in PANEL}
    assert answer.comp[0].state == 2 and answer.comp[0].type == 3
    rows = [line.split() for line in halcmd("show", "pin", "panel.").splitlines() if line.strip()]
    assert {(words[4], words[1], words[2]) for words in rows} >= {
        ("panel.start", "bit", "OUT"), ("panel.count", "s32", "I/O"), ("panel.speed", "float", "IN")}, rows
    machine.becomes("panel.bound", False)
    one.subscribe()
    full = one.until(288)
    assert full.pparams.keepalive_timer == 2000 and full.comp[0].state == 3 and full.serial > 0, full
    assert one.values == {"start": False, "jog": 0, "count": 0, "mask": 0, "speed": 0}
    machine.becomes("panel.bound", True)
    machine.becomes("panel.link-ok", True)
    assert machine.get("panel.clients") == 1
    # again, and by another one: nothing changes
    assert {pin.name: pin.handle for pin in one.bind().comp[0].pin} == {name: pin.handle for name, pin in found.items()}
    two = machine.client().connect()
    assert two.handles == one.handles
    machine.becomes("panel.clients", 2)
    for client in (one, two):
        client.close()
    machine.becomes("panel.bound", False)
    machine.becomes("panel.clients", 0)
    machine.becomes("panel.link-ok", False)


def values_go_both_ways(machine):
    machine.proxy(CONFIG)
    one, two = machine.client().connect(), machine.client().connect()
    halcmd("net", "s", "panel.start")
    halcmd("net", "v", "panel.speed")
    one.set(start=True, jog=-0.125, count=-2**31, mask=2**32 - 1)
    assert [machine.get(f"panel.{name}") for name in ("start", "jog", "count", "mask")] == \
        [True, -0.125, -2**31, 2**32 - 1]
    assert halcmd("gets", "s").strip() == "TRUE"
    # every other client sees it
    for name, value in (("start", True), ("jog", -0.125), ("count", -2**31), ("mask", 2**32 - 1)):
        two.sees(name, value)
    halcmd("sets", "v", 2.25)
    for client in (one, two):
        client.sees("speed", 2.25)
    # the machine sets an I/O pin
    halcmd("setp", "panel.count", 7)
    one.sees("count", 7)
    # a change of less than epsilon is no message: a later change comes first
    halcmd("sets", "v", 2.5)
    machine.becomes("panel.speed", 2.5)
    two.set(start=False)
    one.sees("start", False)
    assert one.values["speed"] == 2.25
    halcmd("sets", "v", 2.9)
    one.sees("speed", 2.9)
    # by name as well, and without an answer
    one.send(259, pin=[one.pb.Pin(name="panel.jog", halfloat=1.5)])
    machine.becomes("panel.jog", 1.5)
    one.quiet()
    assert one.serials == sorted(set(one.serials)), one.serials
    # a subscriber gets a message also if nothing changes
    one.until(210)


def what_is_wrong_is_said_and_changes_nothing(machine):
    machine.proxy(CONFIG)
    one = machine.client()
    answer = one.ask(256)
    assert answer.type == 258 and "names no component" in answer.note[0]
    for name, text in (("", "the component's name"), ("a.b", "no dot"), ("x" * 38, "at most 37"), ("1a", "a letter")):
        one.name = name
        answer = one.bind(pins=())
        assert answer.type == 258 and text in answer.note[0], answer
    one.name = "panel"
    bad = one.pb.Component(name="panel")
    for item in ({"type": BIT, "dir": OUT}, {"name": "other.pin", "type": BIT, "dir": OUT},
                 {"name": "panel.a b", "type": BIT, "dir": OUT}, {"name": "panel.x", "type": 9, "dir": OUT},
                 {"name": "panel.y", "type": BIT, "dir": 7}, {"name": "panel.link-ok", "type": BIT, "dir": OUT},
                 {"name": "panel.z", "type": BIT, "dir": OUT}, {"name": "panel.z", "type": BIT, "dir": OUT}):
        bad.pin.add(**item)
    answer = one.ask(256, comp=[bad])
    assert answer.type == 258 and len(answer.note) == 7, answer
    for note, text in zip(answer.note, ("has no name", 'has to begin with "panel."', "is not allowed", "has the type 9",
                                        "has the direction 7", "each remote component has besides", "there twice"),
                          strict=True):
        assert text in note, (note, text)
    assert "panel" not in rig.listed()
    one.connect()
    # every difference in one answer
    answer = machine.client().bind(pins=(("start", FLOAT, OUT), ("jog", FLOAT, IN), ("new", BIT, OUT), ("count", S32, IO)))
    assert answer.type == 258 and sorted(answer.note) == [
        "component panel has no pin panel.new",
        "pin panel.jog is float and OUT here, and float and IN in the request",
        "pin panel.mask is missing in the request", "pin panel.speed is missing in the request",
        "pin panel.start is bit and OUT here, and float and OUT in the request"], answer
    # one bad value, and nothing is set
    for pin, text in ((one.pin("speed", 1.0), "the machine sets it"), (one.pin("start", 1.0, FLOAT), "is bit"),
                      (one.pin("jog", math.nan), "is not set to nan"), (one.pin("jog", math.inf), "is not set to inf"),
                      (one.pb.Pin(handle=1, type=BIT, halbit=True), "no pin has the handle 1"),
                      (one.pb.Pin(name="x.y", type=BIT, halbit=True), "no remote component has a pin x.y"),
                      (one.pb.Pin(handle=one.handles["start"], type=BIT), "needs a value of this type")):
        answer = one.ask(259, pin=[one.pin("mask", 5), pin])
        assert answer.type == 260 and text in answer.note[0], (answer, text)
        assert machine.get("panel.mask") == 0
    # ZeroMQ compares the beginning of a topic
    other = machine.client("panel2")
    assert "does not begin with panel" in other.bind().note[0]
    # what HAL has already, or has no place for
    threads = machine.client("threads")
    assert "HAL has a component threads already, which belongs to a realtime module" in threads.bind().note[0]
    # a subscription of what is not there
    one.subscribe("nothing")
    assert one.until(290).note[0] == "there is no component nothing; bind it first"
    assert one.ask(999).type == 274
    one.quiet()


def a_subscription_may_come_first(machine):
    machine.proxy(CONFIG)
    one = machine.client()
    one.subscribe()
    assert one.update().type == 290
    assert one.bind().type == 257
    one.until(288)
    machine.becomes("panel.bound", True)


def several_components_and_instances(machine):
    machine.proxy(CONFIG)
    one = machine.client("narrow", (("%d.in", BIT, IN), ("%d.out", BIT, OUT), ("all", BIT, OUT)))
    answer = one.ask(256, comp=[one.description(ninst=3), machine.client().description()])
    assert [pin.name for pin in answer.comp[0].pin] == [
        "narrow.0.in", "narrow.1.in", "narrow.2.in", "narrow.0.out", "narrow.1.out", "narrow.2.out", "narrow.all"]
    answer = one.answer()
    assert answer.type == 257 and answer.comp[0].name == "panel"
    answer = one.ask(276)
    assert answer.type == 277 and [comp.name for comp in answer.comp] == ["narrow", "panel"], answer
    answer = one.ask(276, comp=[one.pb.Component(name="other"), one.pb.Component(name="panel")])
    assert [comp.name for comp in answer.comp] == ["panel"] and list(answer.note) == ["there is no remote component other"]
    many = machine.client("many", tuple((f"p{number}", BIT, IN) for number in range(257)))
    assert "more than 256 pins" in many.bind().note[0]


def single_pins_are_offered_by_the_configuration(machine):
    import hal
    ours = hal.component("pokeys-test")
    for name, kind, direction in (("free", hal.HAL_FLOAT, hal.HAL_IN), ("linked", hal.HAL_BIT, hal.HAL_IN),
                                  ("out", hal.HAL_S32, hal.HAL_OUT)):
        ours.newpin(name, kind, direction)
    ours.ready()
    ours["out"] = -3
    hal.new_sig("panel-signal", hal.HAL_BIT)
    hal.connect("pokeys-test.linked", "panel-signal")
    machine.proxy(CONFIG)
    early = machine.client()
    answer = early.ask(265, pin=[early.pb.Pin(name="pokeys-test.free", halfloat=9)], reply_required=True)
    assert answer.type == 266 and "may be old" in answer.note[0] and ours["free"] == 0, answer
    one = machine.client().connect()
    pb = one.pb

    def get(*names, signal=()):
        request = one.message(267, pin=[pb.Pin(name=name) for name in names])
        request.signal.extend(pb.Signal(name=name) for name in signal)
        one.dealer.send(request.SerializeToString())
        return one.answer()
    answer = get("pokeys-test.out", "pokeys-test.free", signal=["panel-signal"])
    assert answer.type == 273 and [pin.hals32 for pin in answer.pin][:1] == [-3], answer
    assert answer.pin[1].HasField("halfloat") and answer.signal[0].HasField("halbit"), answer
    ours["out"] = 4
    answer = one.ask(267, pin=[pb.Pin(handle=answer.pin[0].handle)])
    assert answer.pin[0].hals32 == 4, answer
    answer = get("pokeys-test.none", "pokeys-remote.none")
    assert answer.type == 268 and list(answer.note) == ["HAL has no pin pokeys-test.none",
                                                        "pokeys-remote.none is not offered (see [offer] read)"], answer

    def put(name, **value):
        return one.ask(265, pin=[pb.Pin(name=name, **value)], reply_required=True)
    assert put("pokeys-test.free", halfloat=2.5).type == 273 and ours["free"] == 2.5
    for name, value, text in (("pokeys-test.out", {"hals32": 1}, "is not an input"),
                              ("pokeys-test.linked", {"halbit": True}, "is not set: "),
                              ("pokeys-test.free", {"halbit": True}, "needs a value of its type, float"),
                              ("servo-thread.time", {"hals32": 1}, "is not offered for writing"),
                              ("pokeys-test.free", {"halfloat": math.nan}, "is not set to nan")):
        answer = put(name, **value)
        assert answer.type == 266 and text in answer.note[0], (name, answer)
    assert ours["free"] == 2.5
    answer = one.ask(276, pin=[pb.Pin(name="pokeys-test.out")])
    assert answer.type == 277 and answer.pin[0].hals32 == 4 and not answer.comp, answer
    ours.exit()


def it_listens_at_unix_sockets_too(machine):
    folder = machine.folder.name
    proxy = machine.proxy(f"[remote]\ncommand = {folder}/command, 127.0.0.1:6202\nupdate = {folder}/update\n"
                          "[pin panel.start]\nfailsafe = 0\n")
    one = machine.client(places=(f"ipc://{folder}/command", f"ipc://{folder}/update")).connect()
    one.set(start=True)
    assert "created for the client at a unix socket" in proxy.said()
    one.close()
    machine.becomes("panel.start", False)
    machine.becomes("panel.clients", 0)


def nonsense_disturbs_nobody(machine):
    proxy = machine.proxy(CONFIG)
    one = machine.client().connect()
    one.set(start=True)
    pid, seed = proxy.pid, int(os.environ.get("POKEYS_SEED", "20055"))
    chance = random.Random(seed)
    golden = [bytes.fromhex(line.split()[1]) for line in GOLDEN.read_text(encoding="ascii").splitlines()
              if not line.startswith("#")]
    bad = machine.client("bad")
    for _ in range(1500):
        data = bytearray(chance.choice(golden))
        for _ in range(chance.randrange(1, 6)):
            data[chance.randrange(len(data))] = chance.randrange(256)
        data = bytes(data[:chance.randrange(1, len(data) + 1)] if chance.random() < 0.3 else data)
        if chance.random() < 0.1:
            bad.dealer.send_multipart([data, chance.randbytes(9), b""])
        else:
            bad.dealer.send(data)
    # longer than a message may be: its connection ends
    long = machine.client("long")
    long.dealer.send(b"x" * 70000)
    one.set(start=False)
    # all of it has been read when this is answered
    bad.send(276, comp=[bad.pb.Component(name="after-all")])
    while list(bad.answer().note) != ["there is no remote component after-all"]:
        pass
    machine.becomes("panel.start", False)
    assert proxy.pid == pid and "Traceback" not in proxy.said(), f"seed {seed}: {proxy.said()[-2000:]}"
    one.quiet()


def groups_of_signals(machine):
    import zmq
    machine.proxy("[group dro]\nsignals = speed, dro-*\ninterval-ms = 20\nepsilon = 0.01\n")
    halcmd("newsig", "speed", "float")
    halcmd("sets", "speed", 2.5)
    one = machine.client()
    group = one.context.socket(zmq.SUB)
    group.setsockopt(zmq.RCVTIMEO, rig.PATIENCE * 1000)
    group.connect("tcp://127.0.0.1:6200")
    group.subscribe(b"dro")
    got = []

    def update(kind):
        """The next one of this type; its signals by name."""
        while True:
            topic, data = group.recv_multipart()
            got.append(one.pb.Container.FromString(data))
            assert topic == b"dro"
            if got[-1].type == kind:
                return {signal.name or signal.handle: signal for signal in (
                    [member.signal for member in got[-1].group[0].member] if kind == 297 else got[-1].signal)}
    seen = update(297)
    assert seen.keys() == {"speed"} and (seen["speed"].type, seen["speed"].halfloat) == (FLOAT, 2.5)
    assert got[-1].pparams.group_timer == 20 and len(got[-1].uuid) == 16 and got[-1].group[0].name == "dro"
    handle = seen["speed"].handle
    halcmd("sets", "speed", 2.505)
    halcmd("sets", "speed", 3)
    assert update(298)[handle].halfloat == 3
    # one that a HAL file makes later
    halcmd("newsig", "dro-on", "bit")
    seen = update(297)
    assert seen.keys() == {"speed", "dro-on"} and seen["speed"].handle == handle and seen["dro-on"].halbit is False
    halcmd("sets", "dro-on", 1)
    assert update(298)[seen["dro-on"].handle].halbit is True
    halcmd("delsig", "speed")
    assert update(297).keys() == {"dro-on"}
    # nothing changes
    while got[-1].type != 210:
        got.append(one.pb.Container.FromString(group.recv_multipart()[1]))
    serials = [each.serial for each in got if each.type != 210]
    assert serials == list(range(serials[0], serials[0] + len(serials))), serials
    group.unsubscribe(b"dro")
    group.subscribe(b"none")
    answer = one.pb.Container.FromString(group.recv_multipart()[1])
    while answer.type != 27:
        answer = one.pb.Container.FromString(group.recv_multipart()[1])
    assert list(answer.note) == ["there is no group none; there are: dro"]


if __name__ == "__main__":
    rig.main([a_component_is_created_bound_and_described, values_go_both_ways,
              what_is_wrong_is_said_and_changes_nothing, a_subscription_may_come_first,
              several_components_and_instances, single_pins_are_offered_by_the_configuration,
              it_listens_at_unix_sockets_too, groups_of_signals, nonsense_disturbs_nobody])
