#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Groups of signals, in virtual time and without HAL."""
import itertools
import math
import pathlib
import sys

from libraries import need

need("google.protobuf")
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "remote"))
from pokeys_remote.definition import Kind, Watched  # noqa: E402
from pokeys_remote.groups import SIGNALS_MOST, Groups  # noqa: E402
from pokeys_remote.message import Type  # noqa: E402
from pokeys_remote.updates import KEEPALIVE  # noqa: E402


class Case:
    """HAL, and what is sent to those who subscribe."""

    def __init__(self, **groups):
        self.there, self.subscribed, self.came, self.sent, self.looks = {}, {}, [], [], 0
        self.groups = Groups(groups, self, self, itertools.count(1).__next__)

    def signals(self):
        self.looks += 1
        return dict(self.there)

    def put(self, name, value, kind=Kind.FLOAT):
        self.there[name] = kind, value

    def count(self, name):
        return self.subscribed.get(name, 0)

    def listen(self):
        came, self.came = self.came, []
        return came

    def send(self, name, message):
        self.sent.append((name, message))

    def subscribe(self, name):
        self.subscribed[name] = self.count(name) + 1
        self.came.append((name, True))

    def at(self, now):
        """What is sent: topic, type, and the values."""
        self.groups.listen()
        self.next = self.groups.look(now)
        sent, self.sent = self.sent, []
        return [(name, Type(one.type), [(signal.name.decode() or signal.handle, signal.halfloat) for signal in (
            [member.signal for member in one.group[0].member] if one.group else one.signal)]) for name, one in sent]


def changes_are_sent_when_their_time_has_come():
    case = Case(dro=Watched(("x", "y"), interval=0.1, epsilon=0.01))
    case.put("y", 2.0)
    case.put("x", 1.0)
    case.put("other", 3.0)
    assert case.at(0.0) == [] and case.next == math.inf and not case.looks, "nobody sees it"
    case.subscribe("dro")
    assert case.at(1.0) == [("dro", Type.GROUP_FULL, [("x", 1.0), ("y", 2.0)])] and case.next == 1.1
    case.put("x", 1.5)
    case.put("y", 2.005)
    assert case.at(1.05) == [] and case.next == 1.1
    assert case.at(1.1) == [("dro", Type.GROUP_INCREMENTAL, [(1, 1.5)])]
    # small steps add up
    case.put("y", 2.011)
    assert case.at(1.3) == [("dro", Type.GROUP_INCREMENTAL, [(2, 2.011)])]
    case.put("x", math.nan)
    assert len(case.at(1.5)) == 1 and case.at(1.7) == []
    assert case.at(1.6 + KEEPALIVE) == [("dro", Type.PING, [])] and case.at(1.8 + KEEPALIVE) == []
    # another subscriber: all get everything
    case.subscribe("dro")
    assert case.at(5.0)[0][1] is Type.GROUP_FULL
    case.subscribed.clear()
    case.put("y", 9.0)
    assert case.at(6.0) == [] and case.next == math.inf


def serial_numbers_have_no_gaps():
    case = Case(dro=Watched(("x",)))
    case.subscribe("dro")
    serials = []
    for step in range(5):
        case.put("x", float(step))
        case.groups.listen()
        case.groups.look(float(step))
        serials += [one.serial for _, one in case.sent]
        case.sent = []
    assert serials == [1, 2, 3, 4, 5], serials


def signals_come_and_go():
    case = Case(dro=Watched(("z", "axis-*", "axis-y")))
    case.subscribe("dro")
    assert case.at(0.0) == [("dro", Type.GROUP_FULL, [])]
    case.put("axis-y", 1.0)
    case.put("axis-x", 2.0)
    assert case.at(1.0) == [("dro", Type.GROUP_FULL, [("axis-x", 2.0), ("axis-y", 1.0)])]
    case.put("axis-x", 3.0)
    assert case.at(2.0) == [("dro", Type.GROUP_INCREMENTAL, [(1, 3.0)])]
    # one goes, and is there again as another one: never an incremental update of what nobody knows
    del case.there["axis-x"]
    assert case.at(3.0) == [("dro", Type.GROUP_FULL, [("axis-y", 1.0)])]
    case.put("axis-x", 4.0)
    assert case.at(4.0)[0][1] is Type.GROUP_FULL
    case.put("axis-x", True, Kind.BIT)
    assert case.at(5.0)[0][1] is Type.GROUP_FULL


def who_comes_and_goes_is_not_answered_faster():
    case = Case(dro=Watched(("x",), interval=0.1))
    case.put("x", 1.0)
    case.subscribe("dro")
    assert case.at(0.0)[0][1] is Type.GROUP_FULL
    for step in range(1, 10):
        case.subscribe("dro")
        assert case.at(step / 100) == [] and case.looks == 1
    assert case.at(0.11)[0][1] is Type.GROUP_FULL and case.looks == 2


def who_wants_everything_gets_it():
    case = Case(a=Watched(("x",)), b=Watched(("y",)))
    case.put("x", 1.0)
    case.put("y", 2.0)
    case.subscribe("")
    assert [(name, kind) for name, kind, _ in case.at(0.0)] == [("a", Type.GROUP_FULL), ("b", Type.GROUP_FULL)]
    case.put("y", 3.0)
    assert case.at(1.0) == [("b", Type.GROUP_INCREMENTAL, [(2, 3.0)])]
    case.subscribe("c")
    assert case.at(1.5) == [("c", Type.NO_GROUP, [])]


def a_group_has_only_so_many():
    case = Case(dro=Watched(("s-*",)))
    for number in range(SIGNALS_MOST + 5):
        case.put(f"s-{number:03}", 1.0)
    case.subscribe("dro")
    ((_, _, values),) = case.at(0.0)
    assert [name for name, _ in values] == [f"s-{number:03}" for number in range(SIGNALS_MOST)]


for test in (changes_are_sent_when_their_time_has_come, serial_numbers_have_no_gaps, signals_come_and_go,
             who_comes_and_goes_is_not_answered_faster, who_wants_everything_gets_it, a_group_has_only_so_many):
    test()
    print(f"ok: {test.__name__}")
