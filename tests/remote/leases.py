#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Leases and change tracking of a remote component, in virtual time and without HAL."""
import itertools
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "remote"))
from pokeys_remote.component import Client, Component, Refused, own_pins  # noqa: E402
from pokeys_remote.definition import Care, Definition, Direction, Kind, Pin, Rules  # noqa: E402
from pokeys_remote.sparing import LINES_MOST, LINES_TIME, Sparing  # noqa: E402

PINS = (Pin("panel.start", Kind.BIT, Direction.OUT), Pin("panel.jog", Kind.FLOAT, Direction.OUT),
        Pin("panel.feed", Kind.FLOAT, Direction.OUT), Pin("panel.count", Kind.S32, Direction.IO),
        Pin("panel.speed", Kind.FLOAT, Direction.IN))
CARES = {"panel.start": Care(failsafe="0"), "panel.jog": Care(failsafe="0.5", lease="jog"),
         "panel.speed": Care(epsilon=0.1)}


def component(cares=None, **rules):
    made = Component(Definition("panel", PINS), Rules(pins=CARES if cares is None else cares, leases={"jog": 0.25},
                                                      **rules), itertools.count(1))
    storage = {pin.name.partition(".")[2]: 0 for pin in PINS} | dict.fromkeys(own_pins(), 0)
    made.attach(storage)
    return made, storage, {pin.local: pin for pin in made.pins}


def look(made, now):
    """What the proxy does in each turn."""
    failed = made.expire(now)
    made.look(now)
    return failed


def put(made, client, **values):
    pins = {pin.local: pin for pin in made.pins}
    made.set(client, [(pins[name], value) for name, value in values.items()])


def client(now=0.0):
    return Client(b"", now, now)


def a_new_component_has_its_failsafe_values():
    _, storage, _ = component()
    assert storage["jog"] == 0.5 and storage["start"] is False and storage["feed"] == 0


def each_lease_ends_by_itself():
    made, storage, _ = component()
    one, two = client(), client()
    made.join(one)
    put(made, one, start=True, feed=9.0)
    put(made, two, jog=3.0)
    one.seen = two.seen = 10.0
    assert look(made, 10.25) == [] and storage["jog"] == 3.0 and storage["link-ok"] is True
    assert look(made, 10.26) == ["panel.jog"] and storage["jog"] == 0.5
    assert storage["start"] is True and storage["link-ok"] is False
    assert look(made, 10.3) == [], "once"
    # whoever sets it has it again
    one.seen = 11.0
    put(made, one, jog=1.0)
    assert look(made, 11.1) == [] and storage["link-ok"] is True and storage["jog"] == 1.0
    # the component's own lease: 6 s
    one.seen = 20.0
    assert look(made, 20.2) == [] and look(made, 25.9) == ["panel.jog"]
    assert look(made, 26.1) == ["panel.start"] and storage["start"] is False
    assert storage["feed"] == 9.0, "no failsafe value"


def a_lost_client_loses_what_it_holds_and_no_more():
    made, storage, _ = component()
    one, two = client(), client()
    for each in (one, two):
        made.join(each)
    put(made, one, start=True)
    put(made, two, jog=1.0)
    assert made.lose(two) == ["panel.jog"] and storage["start"] is True
    look(made, 0.1)
    assert (storage["link-ok"], storage["clients"]) == (False, 1)
    # another one took over before: nothing happens
    put(made, one, jog=2.0)
    three = client()
    put(made, three, start=True, jog=2.5)
    assert made.lose(one) == [] and (storage["start"], storage["jog"]) == (True, 2.5)
    assert sorted(made.lapse_all()) == ["panel.jog", "panel.start"] and made.lapse_all() == []


def another_setter_does_not_keep_a_lost_one_s_output_on():
    made, storage, _ = component()
    panel, other = client(), client()
    put(made, panel, start=True)
    put(made, other, feed=1.0)
    assert made.lose(panel) == ["panel.start"] and storage["start"] is False
    put(made, panel, start=True)
    put(made, other, feed=2.0)
    other.seen = 7.0
    assert made.expire(7.0) == ["panel.start"]


def status_pins_tell():
    made, storage, _ = component()
    beats = []
    for _ in range(4):
        look(made, 0.0)
        beats.append(storage["heartbeat"])
    assert beats in ([True, False, True, False], [False, True, False, True])
    assert (storage["link-ok"], storage["bound"], storage["clients"], storage["age"]) == (False, False, 0, 0.0)
    one, watcher = client(5.0), client(0.0)
    made.join(one)
    made.join(watcher)
    made.subscribers = 1
    put(made, one, feed=1.0)
    look(made, 6.5)
    assert (storage["link-ok"], storage["bound"], storage["clients"], storage["age"]) == (True, True, 2, 1.5)
    made.leave()
    assert (storage["link-ok"], storage["bound"], storage["clients"], storage["jog"]) == (False, False, 0, 0.5)


def changes_are_reported_once():
    made, storage, pins = component()
    assert len(made.everything()) == len(PINS) and made.changes() == []
    storage["speed"] = 0.09
    assert made.changes() == []
    storage["speed"] = 0.11         # against what was reported, not against what it was
    storage["count"] = -1
    assert [(pin.local, value) for pin, value in made.changes()] == [("count", -1), ("speed", 0.11)]
    for value, times in ((math.nan, 1), (math.inf, 1), (-math.inf, 1), (0.0, 1)):
        storage["speed"] = value
        assert [len(made.changes()) for _ in range(2)] == [times, 0], value
    assert pins["speed"].reported == 0.0


def rules_that_do_not_fit_are_refused():
    for cares, text in (({"panel.start": Care(failsafe="0.5")}, "is bit; allowed: 0, 1, false, true"),
                        ({"panel.count": Care(failsafe="1e99")}, "allowed: a whole number"),
                        ({"panel.speed": Care(failsafe="0")}, "which no client sets"),
                        ({"panel.strat": Care(failsafe="0")}, "has no such pin"),
                        ({"panel.jog": Care(lease="none")}, "no section [lease none]")):
        try:
            component(cares)
        except Refused as refused:
            assert text in str(refused), refused
        else:
            raise AssertionError(cares)


def a_log_is_not_flooded():
    now = [0.0]
    sparing = Sparing(lambda: now[0])

    def record():
        import logging
        return logging.LogRecord("x", logging.INFO, "", 0, "no %d", (7,), None)
    assert [sparing.filter(record()) for _ in range(LINES_MOST + 3)] == [True] * LINES_MOST + [False] * 3
    now[0] = LINES_TIME
    last = record()
    assert sparing.filter(last) and last.getMessage() == "no 7 (3 lines like this were left out before it)"


for test in (a_new_component_has_its_failsafe_values, each_lease_ends_by_itself,
             a_lost_client_loses_what_it_holds_and_no_more,
             another_setter_does_not_keep_a_lost_one_s_output_on, status_pins_tell, changes_are_reported_once,
             rules_that_do_not_fit_are_refused, a_log_is_not_flooded):
    test()
    print(f"ok: {test.__name__}")
