#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Feeds, without a daemon: who keeps up gets differences, who does not gets a whole state, and what all of
them get together is what was there."""
import asyncio
import functools
import json
import logging
import random
import sys


class State:
    def __init__(self, values):
        self.values = values

    def as_dict(self):
        return dict(self.values)


class Reading:
    def __init__(self, values, reason):
        self.state, self.reason, self.connected, self.diagnostics = State(values), reason, not reason, None


class Source:
    """Devices whose values a test sets."""

    def __init__(self):
        self.devices = {"mill": ({"a": 1, "b": 2, "c": None}, "")}
        self.reads = 0

    def look(self, wish):
        return feeds.look(functools.partial(feeds.whole, self), wish.objects)

    def read(self, name, *, diagnostics):
        self.reads += 1
        return Reading(*self.devices[name]) if name in self.devices else None


def apply(status, change, full):
    """As a client does it."""
    for device, one in change.items():
        if one is None or full or one.get("whole"):
            status[device] = one and {key: value for key, value in one.items() if key != "whole"}
            continue
        mine = status[device]
        mine.update({key: one[key] for key in ("connected", "reason") if key in one})
        mine["values"] = mine["values"] | one.get("values", {})
    return status


async def read(subscriber):
    """What is sent next, by a client that reads it at once."""
    text, number = await subscriber.next()
    subscriber.hear(number or 0)
    return text


async def taken(subscriber):
    """What is to be sent now, or None."""
    return json.loads(await read(subscriber)) if subscriber.waiting else None


async def differences_and_whole_states_give_what_is_there():
    rng = random.Random(20055)
    source, now = Source(), 0.0
    wish = feeds.Wish.at(2, (feeds.Part("lathe", None), feeds.Part("mill", None)))
    feed = feeds.Feed(wish, source.look(wish), lambda: now)
    quick, slow = feeds.Subscriber(), feeds.Subscriber()
    seen = {}
    for one in quick, slow:
        one.begin(feed.serial)
        feed.subscribers.add(one)
        seen[one] = json.loads(json.dumps(feed.status)), feed.serial
    wholes = dict.fromkeys((quick, slow), 0)
    for step in range(3000):
        now += 0.02
        values, _ = source.devices.get("mill", ({}, ""))
        for name in "abc":
            if rng.random() < 0.3:
                values[name] = rng.choice([None, rng.randrange(5)])
        source.devices["mill"] = values, rng.choice(["", "", "", "lost"])
        if rng.random() < 0.02:
            values.pop("c", None) if "c" in values else values.update(c=step)
        if rng.random() < 0.05:
            source.devices["lathe"] = ({"x": step}, "")
        elif rng.random() < 0.05:
            source.devices.pop("lathe", None)
        if tick := feed.tick(source.look(wish)):
            quick.offer(tick)
            slow.offer(tick)
        for one in (quick, slow) if step % 7 == 0 else (quick,):
            while message := await taken(one):
                status, time, how = message["params"]
                mine, serial = seen[one]
                assert how["full"] or how["serial"] == serial + 1, (how, serial)
                wholes[one] += how["full"]
                seen[one] = apply(mine, status, how["full"]), how["serial"]
            if one is quick or step % 7 == 0:
                assert seen[one][0] == feed.status, (step, seen[one][0], feed.status)
    assert quick.skipped == 0 and slow.skipped > 1000, (quick.skipped, slow.skipped)
    # every five seconds for who keeps up, with nearly each for who does not
    assert wholes[quick] == 11 and wholes[slow] > 300, wholes


async def nothing_new_is_not_sent():
    source, now = Source(), 0.0
    wish = feeds.Wish.at(2, (feeds.Part("mill", ("a",)),))
    feed = feeds.Feed(wish, source.look(wish), lambda: now)
    assert feed.tick(source.look(wish)) is None
    source.devices["mill"][0]["b"] = 7
    assert feed.tick(source.look(wish)) is None, "a value that nobody asked for"
    source.devices["mill"][0]["a"] = 7
    tick = feed.tick(source.look(wish))
    assert json.loads(tick.text(False))["params"][0] == {"mill": {"values": {"a": 7}}}, tick.text(False)
    assert tick.text(False) is tick.text(False), "encoded twice"
    now = feeds.FULL_S
    assert feed.tick(source.look(wish)).full and feed.serial == 2


async def answers_come_first_and_are_bounded():
    one = feeds.Subscriber()
    one.begin(0)
    one.offer(feeds.Tick(1, {}, {}, False, 0.0))
    for i in range(feeds.ANSWERS_MOST):
        assert not one.full
        one.answer(str(i))
    room = asyncio.create_task(one.room())
    await asyncio.sleep(0)
    assert one.full and not room.done()
    assert [await taken(one) for _ in range(feeds.ANSWERS_MOST)] == list(range(feeds.ANSWERS_MOST))
    assert (await taken(one))["method"] == "notify_status_update" and not one.waiting and not one.full
    await room
    for _ in range(feeds.ANSWERS_MOST):
        one.answer("")
    room = asyncio.create_task(one.room())
    await asyncio.sleep(0)
    one.end()
    try:
        await room
    except ConnectionResetError:
        pass
    else:
        raise AssertionError("it waits for nothing")
    one = feeds.Subscriber()
    one.answer("x" * feeds.ANSWER_BYTES_MOST)
    assert one.full, "one that is large"


async def neither_of_two_states_keeps_the_other_waiting():
    subscriber = feeds.Subscriber()
    subscriber.window = 1
    sent = []
    for _ in range(6):
        # new ones of both are always there, as on a slow way
        subscriber.offer_other(lambda: "other")
        subscriber.offer(feeds.Tick(1, {}, {}, False, 0.0))
        text, number = await asyncio.wait_for(subscriber.next(), 10)
        assert number == len(sent) + 1
        sent.append("other" if text == "other" else "state")
        subscriber.hear(number)
    assert sent == ["other", "state"] * 3 or sent == ["state", "other"] * 3, sent
    await asyncio.wait_for(subscriber.next(), 10)
    # and no more than may be on their way
    subscriber.offer_other(lambda: "other")
    try:
        await asyncio.wait_for(subscriber.next(), 0.05)
        raise AssertionError("more than may be on their way")
    except TimeoutError:
        pass


async def who_does_not_read_is_sent_no_more():
    one = feeds.Subscriber()
    one.begin(0)
    sent = []
    for serial in range(1, 100):
        one.offer(feeds.Tick(serial, {}, {}, False, 0.0))
        if len(sent) < feeds.UNHEARD_MOST:
            sent.append(await one.next())
    coming = asyncio.create_task(one.next())
    await asyncio.sleep(0)
    assert not coming.done() and one.unheard == feeds.UNHEARD_MOST and one.skipped > 80, one.skipped
    # answers come all the same, and numbers of nothing are not heard
    one.answer("x")
    assert await coming == ("x", None)
    coming = asyncio.create_task(one.next())
    for number in 0, -1, 99, 10 ** 17:
        one.hear(number)
        await asyncio.sleep(0)
        assert not coming.done(), number
    # the newest of all, and whole
    one.hear(sent[2][1])
    text, number = await coming
    assert json.loads(text)["params"][2] == {"serial": 99, "full": True} and number == len(sent) + 1, text
    assert one.unheard == feeds.UNHEARD_MOST - 2, one.unheard


async def clients_with_the_same_wish_share_a_feed():
    source = Source()
    all_of_them = feeds.Feeds(source)
    wish = feeds.Wish.at(50, (feeds.Part("mill", None),))
    clients = [feeds.Subscriber() for _ in range(20)]
    joined = {all_of_them.join(wish, one)[0] for one in clients}
    assert len(joined) == 1
    before = source.reads
    for i in range(5):
        source.devices["mill"][0]["a"] = 100 + i
        texts = await asyncio.gather(*(read(one) for one in clients))
        assert len({id(text) for text in texts}) == 1, "encoded for each"
    assert source.reads - before <= 30, source.reads
    feed = joined.pop()
    for one in clients:
        all_of_them.leave(feed, one)
    await asyncio.sleep(0.1)
    before = source.reads
    await asyncio.sleep(0.1)
    assert source.reads == before, "it goes on with nobody there"
    all_of_them.close()


async def feeds_share_a_reading():
    source = Source()
    all_of_them = feeds.Feeds(source)
    clients = [feeds.Subscriber() for _ in range(20)]
    for i, one in enumerate(clients):
        all_of_them.join(feeds.Wish.at(50, (feeds.Part("mill", ("a", f"no{i}")),)), one)
    assert len(all_of_them) == 20
    before = source.reads
    for i in range(5):
        source.devices["mill"][0]["a"] = 100 + i
        await asyncio.gather(*(read(one) for one in clients))
    # all are due at the same beats, after their first
    assert source.reads - before <= 40, source.reads
    all_of_them.close()


async def rates_are_those_of_the_beats():
    for asked, given in ((0.1, 0.1), (2, 2), (20, 20), (30, 25), (49, 100 / 3), (50, 50)):
        wish = feeds.Wish.at(asked, ())
        assert abs(wish.rate - given) < 1e-9, (asked, wish.rate)


async def names_are_expanded():
    known = {"pin.00.in": 0, "pin.01.in": 1, "cycle": 2}
    assert await feeds.expand(None, known) is None
    # in one order, so that equal wishes are one
    assert await feeds.expand(["cycle", "pin.*.in", "pin.00.in"], known) == ("pin.00.in", "pin.01.in", "cycle")
    for wrong, said in ((["no.*"], "no value is named 'no.*'"), ([f"*{i}" for i in range(40)], "at most 32 names"),
                        ([f"old{i}" for i in range(40)], "no value is named 'old"),
                        (["*i" * 30000], "no value is named '*i*i*i*i*'")):
        try:
            await feeds.expand(wrong, known)
        except ValueError as error:
            assert said in str(error), error
        else:
            raise AssertionError("it was taken")
    # a client that asks for much keeps the others waiting for one pattern at most
    turns = 0

    async def another():
        nonlocal turns
        while True:
            turns += 1
            await asyncio.sleep(0)
    other = asyncio.create_task(another())
    await feeds.expand([f"{i * '?'}*" for i in range(6)], known)
    other.cancel()
    assert turns >= 6, turns


async def a_feed_that_fails_goes_on():
    source, one, tried = Source(), feeds.Subscriber(), []
    feeds.FULL_S, before = 0.02, feeds.FULL_S
    all_of_them = feeds.Feeds(source)
    wish = feeds.Wish.at(50, (feeds.Part("mill", None),))
    all_of_them.join(wish, one)
    good, source.read = source.read, lambda name, **_: tried.append(name) or 1 / 0
    while len(tried) < 2:
        await asyncio.sleep(0.01)
    source.read = good
    source.devices["mill"][0]["a"] = 42
    while json.loads(await read(one))["params"][0].get("mill", {}).get("values", {}).get("a") != 42:
        pass
    feeds.FULL_S = before
    all_of_them.close()


async def who_comes_and_goes_keeps_nobody_waiting():
    source, one, other = Source(), feeds.Subscriber(), feeds.Subscriber()
    all_of_them = feeds.Feeds(source)
    all_of_them.join(feeds.Wish.at(50, (feeds.Part("mill", None),)), one)
    mine = None
    for i in range(20):
        source.devices["mill"][0]["a"] = 100 + i
        coming = asyncio.create_task(read(one))
        while not coming.done():
            if mine:
                all_of_them.leave(mine, other)
            mine, _status = all_of_them.join(feeds.Wish.at(25 + i, (feeds.Part("mill", ("a",)),)), other)
            await asyncio.sleep(0)
        assert '"a":' in coming.result()
    all_of_them.close()


async def who_joins_gets_the_state_of_this_moment():
    source, one, other = Source(), feeds.Subscriber(), feeds.Subscriber()
    all_of_them = feeds.Feeds(source)
    wish = feeds.Wish.at(0.1, (feeds.Part("mill", None),))
    feed, _status = all_of_them.join(wish, one)
    source.devices["mill"] = {"a": 7}, "lost"
    same, status = all_of_them.join(wish, other)
    assert same is feed and status["mill"] == {"connected": False, "reason": "lost", "values": {"a": 7}}, status
    # it has changed back before the next state of the feed, whose difference would not say so
    source.devices["mill"] = {"a": 1, "b": 2, "c": 3}, ""
    tick = feed.tick(source.look(wish))
    for subscriber, whole in (one, False), (other, True):
        subscriber.offer(tick)
        found = json.loads(await read(subscriber))["params"]
        assert (found[2]["full"], found[0]["mill"]["values"].get("a")) == (whole, 1 if whole else None), found
    # or to exactly what the feed has: then there is no difference
    last, before = feeds.Subscriber(), source.devices["mill"]
    source.devices["mill"] = {**before[0], "a": 8}, ""
    _feed, status = all_of_them.join(wish, last)
    source.devices["mill"] = before
    tick = feed.tick(source.look(wish))
    last.offer(tick)
    assert status["mill"]["values"]["a"] == 8 and json.loads(await read(last))["params"][0]["mill"]["values"]["a"] == 1
    assert feed.tick(source.look(wish)) is None, "that was enough"
    all_of_them.close()


async def what_was_left_is_not_sent():
    source, one = Source(), feeds.Subscriber()
    all_of_them = feeds.Feeds(source)
    feed, _status = all_of_them.join(feeds.Wish.at(50, (feeds.Part("mill", None),)), one)
    one.offer(feeds.Tick(1, {}, {}, False, 0.0))
    all_of_them.leave(feed, one)
    assert not one.waiting and len(all_of_them) == 0
    all_of_them.close()


if __name__ == "__main__":
    logging.disable()
    try:
        from pokeys_gateway import feeds
    except ImportError as error:
        print(f"not tried: {error} (Debian: python3-aiohttp, python3-prometheus-client)", file=sys.stderr)
        sys.exit(77)
    for test in (differences_and_whole_states_give_what_is_there, nothing_new_is_not_sent,
                 answers_come_first_and_are_bounded, neither_of_two_states_keeps_the_other_waiting, who_does_not_read_is_sent_no_more,
                 clients_with_the_same_wish_share_a_feed, feeds_share_a_reading,
                 rates_are_those_of_the_beats, names_are_expanded,
                 a_feed_that_fails_goes_on, who_comes_and_goes_keeps_nobody_waiting, who_joins_gets_the_state_of_this_moment,
                 what_was_left_is_not_sent):
        asyncio.run(test())
        print(test.__name__)
