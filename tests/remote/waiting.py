#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Clients that bind a component before its HAL file has made it, in virtual time and without HAL."""
import pathlib
import sys
import types

from libraries import need

need("google.protobuf")
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "remote"))
from pokeys_machinetalk_pb2 import Container  # noqa: E402
from pokeys_remote.component import Client  # noqa: E402
from pokeys_remote.config import Config  # noqa: E402
from pokeys_remote.message import Type  # noqa: E402
from pokeys_remote.registry import COMPONENTS_MOST  # noqa: E402
from pokeys_remote.requests import Requests  # noqa: E402

LONG = 1e6              # s


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
        self.drafts = {name: {} for name in drafts}
        registry = types.SimpleNamespace(components={}, drafts=self.drafts, config=Config(create=create), pins={})
        self.requests = Requests(registry, None)

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


def it_waits_as_long_as_its_connection_lasts():
    case, one = Case(False), client()
    assert case.asks(one, bind("panel")) == [] and case.later(one, LONG) == []


def a_draft_is_waited_for_by_those_who_may_create_too():
    case, one = Case(True, "panel"), client()
    assert case.asks(one, bind("panel")) == [] == case.asks(one, bind("panel", no_create=True))
    assert case.later(one, LONG) == []
    case.drafts.clear()
    assert case.later(one, 0.1) == [(
        Type.BIND_REJECT, "there is no component panel, and the request says that it is not to be created")]
    assert case.asks(one, bind("panel", no_create=True))[0][0] is Type.BIND_REJECT and case.later(one, LONG) == []


def who_asks_again_is_answered_once():
    case, one = Case(True, "panel", "pedal"), client()
    assert case.asks(one, bind("panel", no_create=True)) == []
    assert case.asks(one, bind("panel", "pedal", no_create=True)) == []
    case.drafts.clear()
    assert [kind for kind, *_ in case.later(one, LONG)] == [Type.BIND_REJECT] * 2


def a_request_that_is_refused_replaces_the_one_that_waits():
    case, one = Case(True, "panel"), client()
    assert case.asks(one, bind("panel", no_create=True)) == []
    wrong = Container(type=int(Type.BIND))
    wrong.comp.add(name=b"panel").pin.add(name=b"panel.start")
    assert case.asks(one, wrong.SerializeToString())[0][0] is Type.BIND_REJECT
    case.drafts.clear()
    assert case.later(one, LONG) == []


def who_is_gone_is_not_answered():
    case, one, other = Case(True, "panel"), client(), client(1)
    assert case.asks(one, bind("panel", no_create=True)) == [] == case.asks(other, bind("panel", no_create=True))
    case.requests.forget(one)
    case.drafts.clear()
    assert len(case.later(other, LONG)) == 1


def nobody_waits_for_nonsense():
    case, one = Case(False), client()
    assert case.asks(one, bind("a.b"))[0][0] is Type.BIND_REJECT


def each_client_is_limited():
    case, one, other = Case(False), client(), client(1)
    names = [f"c{number}x" for number in range(COMPONENTS_MOST + 1)]
    assert case.asks(one, bind(*names)) == [(Type.BIND_REJECT, "the request names more than 32 components")]
    assert case.asks(one, bind(*names[1:])) == []
    assert case.asks(one, bind(*names[:1])) == [(
        Type.BIND_REJECT,
        "component c0x is not there, and this client waits for 32 components already, which is the most")]
    assert case.asks(other, bind(*names[:1])) == []


for test in (it_waits_as_long_as_its_connection_lasts, a_draft_is_waited_for_by_those_who_may_create_too,
             who_asks_again_is_answered_once, a_request_that_is_refused_replaces_the_one_that_waits,
             who_is_gone_is_not_answered, nobody_waits_for_nonsense, each_client_is_limited):
    test()
    print(f"ok: {test.__name__}")
