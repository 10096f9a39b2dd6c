#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Clients that bind a component before its HAL file has made it, in virtual time and without HAL."""
import pathlib
import sys
import types

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "remote"))
from pokeys_machinetalk_pb2 import Container  # noqa: E402
from pokeys_remote.component import Client  # noqa: E402
from pokeys_remote.config import Config  # noqa: E402
from pokeys_remote.message import Type  # noqa: E402
from pokeys_remote.requests import BIND_WAIT, WAITING_MOST, Requests  # noqa: E402


def client(number=0):
    return Client(bytes([number]), 0.0, 0.0)


def bind(*names, **fields):
    made = Container(type=int(Type.BIND))
    for name in names:
        made.comp.add(name=name.encode(), **fields)
    return made.SerializeToString()


class Case:
    """A proxy without components; what a client is answered."""

    def __init__(self, create, *drafts):
        registry = types.SimpleNamespace(components={}, config=Config(create=create), pins={})
        self.drafts = set(drafts)
        self.requests = Requests(registry, None, self.drafts)

    def asks(self, who, data, now=0.0):
        return self.told([(who, answer) for answer in self.requests.answer(who, data, now, False)], who)

    def later(self, who, now):
        return self.told(self.requests.late(now), who)

    @staticmethod
    def told(answers, who):
        told = []
        for receiver, answer in answers:
            assert receiver is who
            told.append((Type(answer.type), *(note.decode() for note in answer.note)))
        return told


def it_waits_for_its_time_and_no_longer():
    case, one = Case(False), client()
    assert case.asks(one, bind("panel")) == [] and case.later(one, BIND_WAIT - 0.1) == []
    assert case.later(one, BIND_WAIT) == [
        (Type.BIND_REJECT, "there is no component panel, and only HAL files create components (create = no)")]
    assert case.later(one, 2 * BIND_WAIT) == []


def a_draft_is_waited_for_by_those_who_may_create_too():
    case, one = Case(True, "panel"), client()
    assert case.asks(one, bind("panel")) == [] == case.asks(one, bind("panel", no_create=True))
    assert case.later(one, BIND_WAIT) == [
        (Type.BIND_REJECT, "component panel is not ready; a HAL file has begun it by newcomp")]
    # the file failed
    assert case.asks(one, bind("panel", no_create=True)) == []
    case.drafts.clear()
    assert case.later(one, 0.1) == [(
        Type.BIND_REJECT, "there is no component panel, and the request says that it is not to be created")]
    assert case.asks(one, bind("panel", no_create=True))[0][0] is Type.BIND_REJECT


def who_asks_again_is_answered_once():
    case, one = Case(False), client()
    assert case.asks(one, bind("panel")) == [] == case.asks(one, bind("panel", "pedal"), now=5.0)
    assert case.later(one, BIND_WAIT) == [], "the second request is newer"
    assert len(case.later(one, BIND_WAIT + 5.0)) == 2


def who_is_gone_is_not_answered():
    case, one, other = Case(False), client(), client(1)
    assert case.asks(one, bind("panel")) == [] == case.asks(other, bind("panel"))
    case.requests.forget(one)
    assert len(case.later(other, BIND_WAIT)) == 1


def nobody_waits_for_nonsense():
    case, one = Case(False), client()
    assert case.asks(one, bind("a.b"))[0][0] is Type.BIND_REJECT


def the_waiting_are_limited():
    case, one = Case(False), client()
    names = [f"c{number}x" for number in range(WAITING_MOST + 2)]
    told = case.asks(one, bind(*names))
    assert [kind for kind, *_ in told] == [Type.BIND_REJECT] * 2


for test in (it_waits_for_its_time_and_no_longer, a_draft_is_waited_for_by_those_who_may_create_too,
             who_asks_again_is_answered_once, who_is_gone_is_not_answered, nobody_waits_for_nonsense,
             the_waiting_are_limited):
    test()
    print(f"ok: {test.__name__}")
