#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Stops, faults and losses at any moment of a command: what is commanded then, and what clients get. A fake daemon waits
and fails where a test needs it."""
import asyncio
import contextlib
import math
import random
import threading
import time
import types

import desk
import pokeys
from gcode import Shop, State, heater, show
from operators import until
from pokeys_gateway import config
from pokeys_gateway.gcode import arcs, holder, jog, member, motion, operation, seen
from pokeys_gateway.gcode.lane import Modes
from pokeys_gateway.wire import NotDone

NAME, OFF = "heater.00.target", {"heater.00.target": 0.0}


class Fake:
    """A device that is commanded, by pokeys.attach()."""

    def __init__(self):
        self.updates, self.orders, self.slow = [], [], 0.0
        self.free = threading.Event()       # what is done now may go on
        self.free.set()
        self.began = threading.Event()      # something is being done
        self.places = self.left = self.lapsed = 0       # the first so many have lapsed

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def command(self, lease):
        assert lease <= 1
        return Place(self)

    def pause(self):
        self.began.clear()
        self.free.clear()

    def do(self):
        self.began.set()
        assert self.free.wait(30)


class Place:
    """... and its commander's place."""

    def __init__(self, fake):
        self.fake = fake

    def __enter__(self):
        self.fake.do()
        self.fake.places += 1
        self.number = self.fake.places
        return self

    def __exit__(self, *_):
        self.fake.left += 1

    def update(self, values, axes=None, servos=None):
        self.fake.do()
        self.renew()
        if "pin.39.out" in values:
            raise ValueError("pin.39.out: terminal 40 is not a digital output of this device")
        self.fake.updates.append((dict(values), dict(axes or {}), dict(servos or {})))

    def wait(self):
        pass

    def renew(self):
        if self.number <= self.fake.lapsed:
            raise pokeys.Lapsed("mill: the lease had run out")

    def order(self, shot, **_):
        self.fake.orders.append(shot)
        time.sleep(self.fake.slow)
        return type("Order", (), {"outcome": pokeys.Outcome.DONE})


@contextlib.asynccontextmanager
async def shop(**settings):
    """A console with a client, and the fake device with a hot end."""
    fake, before = Fake(), pokeys.attach
    pokeys.attach = lambda name, runtime: fake
    one = Shop(operate=False, machine_kind="pokeys", machine_device="mill", **settings)
    one.fake, one.client, one.operation = fake, one.table.client(), one.machine._operation
    lit(one, 0.0)
    try:
        yield one
    finally:
        fake.free.set()
        await one.machine.close()
        pokeys.attach = before


def lit(one, target, **values):
    """What the daemon shows of the hot end."""
    state = State(heater(0, "hotend", target_in_effect=target, max_target=250.0, **values) | {"connected": True})
    state.commander_alive = one.operation.holder.held
    show(one, mill=state)


def targets(one):
    """Of the hot end, in the order in which they were commanded."""
    return [values[NAME] for values, _, _ in one.fake.updates if NAME in values]


def said(one, who=None):
    return one.table.take(who or one.client).decode().splitlines()


async def busy(one):
    """The thread does something, and waits."""
    await until("something is done", one.fake.began.is_set)


async def a_stop_while_the_place_is_taken():
    async with shop() as one:
        one.fake.pause()
        one.table.send(one.client, b"M104 S200\n")
        await busy(one)
        one.table.send(one.client, b"M112\n")
        one.fake.free.set()
        await until("the stop", lambda: not one.client.pending)
        assert said(one)[-1] == "ok" and 200 not in targets(one), one.fake.updates
        assert one.fake.updates[-1][0] == {"machine-is-on": False, "emergency-stop": True, **OFF}


async def what_a_device_does_not_have_is_no_part_of_a_stop():
    async with shop() as one:
        await one.operation.holder.take()
        await one.operation.holder.stop({"emergency-stop": True, "pin.39.out": False, "pin.30.out": False}, motion=True)
        found = {name: value for values, _, _ in one.fake.updates for name, value in values.items()}
        assert found == {"machine-is-on": False, "emergency-stop": True, "pin.30.out": False}, one.fake.updates
        assert one.fake.updates[0][1].keys() == set(range(8)), "all axes"


async def a_stop_in_the_middle_of_a_target():
    """The job has begun or not: what is commanded last is off."""
    for name in b"M112\n", b"M410\n":
        async with shop() as one:
            one.table.send(one.client, b"M104 S200\n")
            await until("it heats", lambda: targets(one)[-1:] == [200] and not one.client.pending)
            lit(one, 200.0)
            one.fake.pause()
            one.table.send(one.client, b"M104 S100\nM104 S0\nM104 S210\n")
            await busy(one)
            one.table.send(one.client, name)
            lit(one, 0.0 if name == b"M112\n" else 100.0)
            one.fake.free.set()
            await until("the stop", lambda: not one.client.pending)
            await asyncio.sleep(3 * holder.BEAT_S)
            # what M410 leaves is what was commanded, and is known
            assert targets(one)[-1] == (0 if name == b"M112\n" else 100), targets(one)
            assert one.operation.heating._targets == ({} if name == b"M112\n" else {0: 100.0})
            assert bool(one.operation.halted) == (name == b"M112\n"), one.operation.halted


async def a_lapse_is_no_chance_to_go_on():
    async with shop() as one:
        other = one.table.client("b")
        one.table.send(one.client, b"M109 S200\n")
        await until("it heats", lambda: targets(one)[-1:] == [200])
        lit(one, 200.0)
        one.fake.lapsed = 1
        one.table.send(other, b"M104 S210\n")
        await until("it is noticed", lambda: one.operation.halted)
        assert "Error:mill: the lease had run out; M999 permits commands again" in said(one)
        assert "ok" not in said(one)
        # a heater with hold-s goes on without a commander: it is switched off by the next one
        await until("it is off", lambda: targets(one)[-1] == 0 and one.fake.places == 2)
        one.table.send(other, b"M104 S210\n")
        await until("the answer", lambda: not other.pending)
        assert any(line.startswith("Error:M104: mill: the lease had run out") for line in said(one, other))
        assert 210 not in targets(one)


async def faults_and_what_is_not_seen():
    async with shop() as one:
        one.table.send(one.client, b"M104 S200\n")
        await until("it heats", lambda: targets(one)[-1:] == [200])
        # the state cannot be read any more: what was commanded is switched off all the same
        show(one, mill=None)
        one.operation.heating._seen -= 10
        await until("it is noticed", lambda: one.operation.halted)
        await until("it is off", lambda: targets(one)[-1] == 0)
        assert "Error:no cable; M999 permits commands again" in said(one)
        lit(one, 0.0, fault=True, fault_code=4)
        one.table.send(one.client, b"M999\n")
        await until("the answer", lambda: not one.client.pending)
        assert one.fake.orders == [pokeys.OneShot.HEATER_RESET] and said(one) == ["ok"]


async def a_stop_and_the_permission_after_it():
    async with shop() as one:
        one.table.send(one.client, b"M104 S200\n")
        await until("it heats", lambda: targets(one)[-1:] == [200] and not one.client.pending)
        lit(one, 200.0)
        other = one.table.client("b")
        one.table.send(one.client, b"M112\n")
        one.table.send(other, b"M999\n")
        await asyncio.sleep(3 * holder.BEAT_S)
        assert one.operation.halted and one.client.pending and other.pending, "it waits for the stop"
        lit(one, 0.0)
        await until("both", lambda: not one.client.pending and not other.pending)
        assert not one.operation.halted and one.fake.updates[-1][0] == {"emergency-stop": False}
        # the place is given up when nothing is commanded, but not while the emergency stop is
        operation.IDLE_S, before = 0.2, operation.IDLE_S
        one.table.send(one.client, b"M112\n")
        await until("the stop", lambda: not one.client.pending)
        await asyncio.sleep(5 * holder.BEAT_S)
        assert one.operation.holder.held
        one.table.send(one.client, b"M999\n")
        await until("it is free", lambda: one.fake.left == 1)
        operation.IDLE_S = before


async def others_are_told():
    async with shop() as one:
        request = one.table.client("c")
        request.hears = False       # over HTTP
        one.table.send(request, b"M109 S200\nM104 S210\n")
        await until("it heats", lambda: targets(one)[-1:] == [200])
        lit(one, 200.0)
        one.table.send(one.client, b"M410\n")
        await until("the stop", lambda: not one.client.pending)
        assert said(one, request)[:2] == ["Error:stopped", "ok"] and request.failed and not request.pending
        assert request.deaf_until > one.table.now - 1, "its next lines belong to what was stopped"
    async with shop() as one:
        # who is gone: nothing of it heats any more, and what switches off is done
        gone = one.table.client("d")
        one.table.send(gone, b"M109 S200\nM104 S220\nM104 S0\n")
        await until("it heats", lambda: targets(one)[-1:] == [200])
        lit(one, 200.0)
        one.table.router.leave(gone)
        await until("it is off", lambda: targets(one)[-1] == 0)
        assert 220 not in targets(one)


async def heaters_that_nobody_needs_are_switched_off():
    operation.COLD_AFTER_S, before = 0.5, operation.COLD_AFTER_S
    async with shop() as one:
        one.machine.open()
        one.table.send(one.client, b"M109 S200\n")
        await until("it heats", lambda: targets(one)[-1:] == [200])
        lit(one, 200.0)
        # somebody waits for it
        await asyncio.sleep(1.0)
        assert targets(one)[-1] == 200 and one.client.pending
        lit(one, 200.0, at_temperature=True)
        await until("it is warm", lambda: not one.client.pending)
        await until("it is off", lambda: targets(one)[-1] == 0)
        lit(one, 0.0)
        # a host that was paused must not print on with a cold hot end
        why = "no line has moved or heated for 0 minutes, so everything was switched off"
        assert f"Error:{why}; M999 permits commands again" in said(one) and one.operation.halted == why
    operation.COLD_AFTER_S = before


async def a_stop_while_the_spindle_is_being_switched_on():
    """M410 leaves it on; it is known, and M5 switches it off."""
    async with shop(machine_spindle=config.Output("pin", 31)) as one:
        values = {"pin.30.is-output": 1, "connected": True}
        state = State(values)
        show(one, mill=state)
        await one.operation.holder.take()
        state.commander_alive = True
        one.fake.pause()
        one.table.send(one.client, b"M3\n")
        await busy(one)
        other = one.table.client("b")
        one.table.send(other, b"M410\n")
        one.fake.free.set()
        await until("the stop", lambda: not other.pending)
        given = [values["pin.30.out"] for values, _, _ in one.fake.updates if "pin.30.out" in values]
        assert one.operation.outputs.commanded == any(given), given
        one.table.send(other, b"M5\n")
        await until("it is off", lambda: not other.pending)
        assert [values["pin.30.out"] for values, _, _ in one.fake.updates if "pin.30.out" in values][-1] is False
        assert not one.operation.outputs.commanded and not one.operation.outputs._turns


async def a_move_begins_where_the_last_one_ends():
    """Also if the queue is empty, and what the device was commanded last is from before the end."""
    async with shop() as one:
        motors, values = motion.Motion(one.hub, one.operation.holder), {
            "joint.00.name": "x", "joint.00.pulses-per-unit": 100.0, "joint.00.mode-in-effect": 1, "engine.axes-enabled": 1,
            "joint.00.counts-cmd": 420, "joint.00.counts": 390, "connected": True}
        for on, end, wanted in (1, 5.0, 5.0), (1, None, 4.2), (0, 5.0, 3.9):
            state = State(values | {"joint.00.enabled": on})
            motors._ends = {} if end is None else {"X": end}
            assert motors._begin_of(state, member.members(state)["X"]) == wanted, (on, end)


async def gains_are_searched_for():
    async with shop() as one:
        lit(one, 0.0, tuning=1)
        one.table.send(one.client, b"M303 S100 U1\n")
        await until("it searches", lambda: one.fake.orders == [pokeys.OneShot.HEATER_TUNE])
        assert one.operation.heating.searching == {0} and targets(one) == [0]
        lit(one, 0.0, tuning=2, tuned_p=20.0, tuned_i=1.5, tuned_d=90.25)
        await until("they are found", lambda: not one.client.pending)
        assert said(one) == ["PID Autotune start", "PID Autotune finished!", "#define DEFAULT_Kp 20.00", "#define DEFAULT_Ki 1.50",
                             "#define DEFAULT_Kd 90.25", "ok"]
        assert one.fake.orders[2:] == 3 * [pokeys.OneShot.HEATER_GAIN] and not one.operation.heating.searching
        # a stop ends it, and so does a fault of it
        lit(one, 0.0, tuning=1)
        one.fake.orders.clear()
        one.table.send(one.client, b"M303\n")
        await until("it searches", lambda: one.fake.orders)
        other = one.table.client("b")
        one.table.send(other, b"M410\n")
        await until("it has ended", lambda: not other.pending and len(one.fake.orders) > 1)
        await until("it is stopped", lambda: not one.operation.heating.searching)
        assert one.fake.orders.count(pokeys.OneShot.HEATER_TUNE) == 2
        lit(one, 0.0, tuning=3)
        one.client.deaf_until = 0.0
        one.table.send(one.client, b"M303\n")
        await until("the answer", lambda: "Error:M303: no gains were found; pokeysctl events may show the reason" in said(one))


def speeds_are_those_of_linear_axes():
    """Whatever else moves beside them has to be there at the same time."""
    for lengths, feed, speed in (({"X": 3.0, "Y": 4.0}, 10.0, 10.0), ({"X": 3.0, "E": 4.0}, 6.0, 10.0),
                                 ({"E": 2.0}, 5.0, 5.0), ({"X": 0.0, "E": 2.0}, 5.0, 5.0), ({"X": 3.0}, None, 0.0)):
        modes = Modes()
        modes.feed = feed
        assert math.isclose(member.path_speed(lengths, modes), speed), (lengths, feed)
    modes.feed, modes.feed_scale = 2.0, 25.4
    assert member.path_speed({"A": 90.0}, modes) == 2 and member.path_speed({"X": 1.0}, modes) == 50.8


async def a_fault_is_seen_while_others_move():
    """Somebody always waits for room in the queue then."""
    async with shop() as one:
        motors = motion.Motion(one.hub, one.operation.holder)
        motors._on = {"Z"}
        values = {"servo.00.name": "z", "servo.00.counts-per-unit": 400.0, "connected": True}
        async with motors._order:
            show(one, mill=State(values | {"servo.00.state": 2}))
            assert not motors.trouble()
            show(one, mill=State(values | {"servo.00.state": 3, "servo.00.fault-code": 6}))
            assert motors.trouble() == "Z was switched off: off by a fault: word 6"
            motors._changing = {"Z"}
            assert not motors.trouble(), "it is being enabled"


async def a_stop_while_a_motor_is_being_enabled():
    """A jog is not cancelled by it, as a line is: what it has begun is the stop's."""
    async with shop() as one:
        values = {"servo.00.name": "z", "servo.00.counts-per-unit": 400.0, "servo.00.state": 1, "connected": True}
        state = State(values)
        state.commander_alive = False
        show(one, mill=state)
        one.machine.open()
        jogging = asyncio.create_task(one.operation.jog("a", "z", 1.0))
        await until("it is being enabled", lambda: one.fake.updates and one.fake.updates[-1][2])
        assert one.fake.updates[-1][2][0].enable
        state.commander_alive = True
        one.fake.slow = 0.05
        stop = one.operation.begin_stop("stop")
        await until("it is stopped", stop.done)
        assert stop.exception() is None and not one.fake.updates[-1][2][0].enable, one.fake.updates
        await until("the jog has ended", jogging.done)
        assert isinstance(jogging.exception(), NotDone) and not one.operation.motion._on


class Axis:
    """Motion of one axis, and its holder."""

    def __init__(self):
        self.device, self.held, self.taken, self.nudges, self.ended = "mill", True, 0, [], []
        self.ending = asyncio.Event()
        self.ending.set()

    async def take(self):
        pass

    def is_idle(self, moves):
        return moves is None or moves == self.taken

    def waiting(self):
        return 0

    async def nudge(self, letter, speed, _until):
        self.taken += 1
        self.nudges.append((letter, speed))
        return self.taken

    async def end_path(self, moves):
        await self.ending.wait()
        self.ended.append(moves)


async def a_jog_belongs_to_who_holds_it():
    axis, before = Axis(), jog.QUIET_S
    jog.QUIET_S = 60
    one = jog.Jog(axis, axis, lambda: axis.ended.append("stuck"))
    await one.wish("a", "X", 1.0)
    for owner in "b", "c":
        try:
            await one.wish(owner, "X", -1.0)
        except NotDone as error:
            assert str(error) == "X is jogged already, and one axis at a time"
        else:
            raise AssertionError("it has another owner")
    # an end of somebody else's is none of it
    one.end("b")
    await one.wish("a", "X", 1.0)
    assert axis.nudges == 2 * [("X", 1.0)] and not axis.ended
    # while it slows down, wishes are neither done nor refused
    axis.ending.clear()
    one.end("a")
    await one.wish("b", "Y", 2.0)
    assert len(axis.nudges) == 2
    axis.ending.set()
    await until("its path has ended", lambda: axis.ended == [2])

    async def press():
        """Wishes are left out until the end of the last path is over."""
        nudges = len(axis.nudges)
        while len(axis.nudges) == nudges:
            await one.wish("b", "Y", 2.0)
            await asyncio.sleep(0)
    await press()
    assert axis.nudges[-1] == ("Y", 2.0)
    # nobody says that it is up
    jog.QUIET_S = 0.05
    await press()
    await until("it has ended", lambda: axis.ended == [2, 4])
    # the end fails: it is stopped

    async def fail(_moves):
        raise NotDone("no answer")
    axis.end_path = fail
    await press()
    await until("it is stopped", lambda: axis.ended[-1] == "stuck")
    jog.QUIET_S = before


def a_jog_ends_at_a_soft_limit():
    axis = member.Member("X", False, 0, 200.0, 0.0, 0, 1, True, True, "", speed=100.0, acceleration=500.0, least=-3.0, most=10.0)
    for begin, speed, override, length, feed in (
            (0.0, 10.0, 1.0, 1.0, 10.0), (0.0, -1000.0, 1.0, -3.0, 50.0), (9.5, 20.0, 1.0, 0.5, 20.0), (0.0, 20.0, 0.5, 1.0, 20.0),
            (0.0, 20.0, 2.0, 2.0, 10.0), (12.0, -20.0, 1.0, -2.0, 20.0), (-5.0, 20.0, 1.0, 2.0, 20.0),
            (50.0, -20.0, 1.0, -2.0, 20.0), (0.0, 0.01, 1.0, 0.001, 0.01)):
        found, modes = member.nudge_of(axis, begin, speed, override)
        assert math.isclose(found["X"], length) and math.isclose(modes.feed, feed) and modes.relative, (begin, speed, found, modes.feed)
    for begin, speed in (10.0, 1.0), (10.0, 1000.0), (-3.001, -1.0), (11.0, 1.0):
        try:
            member.nudge_of(axis, begin, speed, 1.0)
        except NotDone as error:
            assert str(error) == "X is at its soft limit"
            continue
        raise AssertionError((begin, speed))


def a_late_reading_is_no_fault():
    readings = []
    hub = types.SimpleNamespace(source=types.SimpleNamespace(read=lambda _name: readings[-1]),
                                no_such_device=lambda name: f"there is no {name}")
    look, state = seen.Seen(hub, "mill"), object()

    def reading(state, connected):
        readings.append(types.SimpleNamespace(state=state, connected=connected, reason="data is 8 ms old"))
    for now, (what, connected), fails in ((0, (state, False), True), (1, (state, True), False), (2.5, (state, False), False),
                                          (3.1, (state, False), True), (4, (state, True), False), (4.1, (None, False), True)):
        seen.time = types.SimpleNamespace(monotonic=lambda now=now: now)
        reading(what, connected)
        try:
            assert look() is state and not fails, now
        except NotDone as error:
            assert fails and str(error) == "data is 8 ms old", now
    seen.time = time


def arcs_are_what_they_should_be():
    """Random ones, from their centre and by their radius; each chord is near enough, and the way has the length of the arc."""
    rng = random.Random(2033)
    for _ in range(2000):
        clockwise, radius = rng.random() < 0.5, 10 ** rng.uniform(-1.5, 3)
        centre, begin = (rng.uniform(-500, 500), rng.uniform(-500, 500)), rng.uniform(-math.pi, math.pi)
        sweep = rng.uniform(0.01, 6.2) * (-1 if clockwise else 1)
        ends = [(centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)) for angle in (begin, begin + sweep)]
        ways = {"I": centre[0] - ends[0][0], "J": centre[1] - ends[0][1]}, {"R": radius if abs(sweep) < math.pi else -radius}
        for words in ways:
            if "R" in words and abs(abs(sweep) - math.pi) < 0.05:
                continue        # half a circle: which side it is on is rounding
            found = arcs.arc_of(*ends, words, clockwise=clockwise)
            assert math.isclose(found.sweep, sweep, abs_tol=1e-5), (found, sweep, words)
            points = [found.at(i / found.chords) for i in range(found.chords + 1)]
            assert math.dist(points[-1], ends[1]) < 1e-5 and math.dist(points[0], ends[0]) < 1e-5
            for one, other in zip(points, points[1:], strict=False):
                middle = (one[0] + other[0]) / 2, (one[1] + other[1]) / 2
                assert radius - math.dist(middle, centre) <= arcs.DEVIATION * 1.01
    # as a file has rounded them
    half = arcs.arc_of((50.0, 0.0), (-50.001, 0.0), {"R": 50.0}, clockwise=False)
    assert math.isclose(half.sweep, math.pi, abs_tol=0.02) and half.at(0.5)[1] > 49
    assert abs(arcs.arc_of((10.0, 0.0), (10.0003, 0.0), {"I": -10.0}, clockwise=False).sweep) == math.tau
    whole = arcs.arc_of((10.0, 0.0), (10.0, 0.0), {"I": -10.0}, clockwise=True)
    assert whole.sweep == -math.tau and whole.chords > 50
    for begin, end, words in (((0, 0), (1, 1), {}), ((0, 0), (1, 0), {"R": 0.3}), ((0, 0), (0, 0), {"R": 1}), ((0, 0), (5, 0), {"I": 1}),
                              ((0, 0), (0, 0), {"I": 0, "J": 0})):
        try:
            arcs.arc_of(begin, end, words, clockwise=True)
        except member.BadWords:
            continue
        raise AssertionError((begin, end, words))


def modes_of_a_jog():
    modes, rest = member.modes_of("g020 G91 X1 F6")
    assert (modes.scale, modes.relative, rest.split()) == (25.4, True, ["X1", "F6"])
    for text in "G53 X0", "M3 X1", "10 X5", "G1 X1", "":
        try:
            member.modes_of(text)
        except member.BadWords:
            continue
        raise AssertionError(text)


def main():
    speeds_are_those_of_linear_axes()
    modes_of_a_jog()
    arcs_are_what_they_should_be()
    a_late_reading_is_no_fault()
    a_jog_ends_at_a_soft_limit()
    for test in (a_stop_while_the_place_is_taken, what_a_device_does_not_have_is_no_part_of_a_stop, a_stop_in_the_middle_of_a_target, a_lapse_is_no_chance_to_go_on,
                 faults_and_what_is_not_seen, a_stop_and_the_permission_after_it, others_are_told,
                 a_fault_is_seen_while_others_move, heaters_that_nobody_needs_are_switched_off,
                 a_stop_while_the_spindle_is_being_switched_on, a_move_begins_where_the_last_one_ends, gains_are_searched_for,
                 a_jog_belongs_to_who_holds_it, a_stop_while_a_motor_is_being_enabled):
        asyncio.run(asyncio.wait_for(test(), 60))
        print(f"ok: {test.__name__}")
    assert desk.hub_of().config.machine_device is None


if __name__ == "__main__":
    main()
