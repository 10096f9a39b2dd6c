#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The Python package against a running daemon and the simulated device.

All its values are compared with those of pokeysctl, which reads the images by a table in C;
what it raises is compared with what is wrong."""
import asyncio
import contextlib
import json
import math
import os
import pathlib
import pickle
import signal
import sys
import threading
import time
from datetime import datetime, timezone

sys.path.insert(0, str(pathlib.Path(sys.argv[1]).parent))
from house import PATIENCE, House, Skip, end, equal, main, wait_equal, wait_for  # noqa: E402

from rig import raises  # noqa: E402

os.environ["POKEYSCTL"] = next(str(pathlib.Path(path).resolve()) for path in sys.argv if path.endswith("pokeysctl"))
import pokeys  # noqa: E402


def attach(house, name="mill", **options):
    return pokeys.attach(name, runtime=str(house.runtime), timeout=PATIENCE, **options)


@contextlib.contextmanager
def machine(**keys):
    """A daemon with a device that runs; a late answer of a busy computer is not a loss here."""
    with House() as house:
        house.device_keys["mill"] |= {"digital-inputs": "4,9", "digital-outputs": "31-34", "analog-inputs": "43",
                                      "pwm-period": 25000, "lost-after-ms": 5000, "stale-after-ms": 4000, **keys}
        sim = house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        yield house, sim, daemon


def now(mill):
    """The values there are; a busy computer may be late at any moment."""
    return mill.read(stale_ok=True)


def soon(mill, name):
    """One value, as soon as it is fresh."""
    while True:
        with contextlib.suppress(pokeys.Stale):
            return mill[name]


def same(found, wanted):
    if isinstance(wanted, float) and isinstance(found, (int, float)) and not isinstance(found, bool):
        return math.isclose(found, wanted, rel_tol=1e-6)
    return found == wanted and isinstance(found, bool) == isinstance(wanted, bool)


def test_all_values_are_those_of_pokeysctl():
    with machine() as (house, sim, daemon):
        house.ask_sim(sim, "analog", 43, 2000)
        house.says("get", "mill", "adc.02.raw", stdout="2000\n")
        wait_for("the diagnostic image", lambda: house.ctl("get", "mill", "latency.wakeup-count").stdout != "-\n")
        with attach(house) as mill:
            daemon.send_signal(signal.SIGSTOP)
            try:
                house.says("get", "mill", "stale", stdout="true\n")
                wanted = json.loads(house.ctl("get", "mill", "--json").stdout)
                state, diagnostics = now(mill), mill.diagnostics(stale_ok=True)
            finally:
                daemon.send_signal(signal.SIGCONT)
        whole = state.as_dict() | diagnostics.as_dict()
        equal(set(whole) ^ set(wanted["values"]), set())
        equal(set(pokeys.names()) ^ set(wanted["values"]), set())
        for name, value in wanted["values"].items():
            single = diagnostics[name] if name not in state.as_dict() else state[name]
            if name.startswith("age") or "age-" in name:
                assert (whole[name] is None) == (value is None) == (single is None), name
                continue
            assert same(whole[name], value) and same(single, value), (name, value, whole[name], single)
        for name, word in wanted["words"].items():
            equal(state.word(name), word)


def test_values_are_attributes():
    with machine() as (house, sim, _daemon), attach(house) as mill:
        for level in (1, 0):
            house.ask_sim(sim, "pin", 4, level)
            wait_equal("the input", lambda: now(mill).pin[3].in_, bool(level))
            equal(soon(mill, "pin.03.in"), bool(level))
        house.ask_sim(sim, "analog", 43, 4095)
        wait_equal("the analog input", lambda: round(now(mill).adc[2].volts, 4), 3.2992)
        state = fresh_one(mill)
        equal((state.link_state, state.info.type, state.info.SerialNumber), (3, "PoKeys57CNC", 65432))
        equal([pin.is_output for pin in state.pin], [30 <= i <= 33 for i in range(55)])
        equal((len(state.joint), len(state.matrix), len(state.matrix[0]), list(state.matrix[15])),
              (8, 16, 8, [False] * 8))
        state = fresh_one(mill)
        equal((state.connected, state.stale, state.reason), (True, False, ""))
        assert state.age_us is not None and state.age_us < 4e6
        for wrong in (-1, 55):
            with raises(IndexError, "there are 0 to 54"):
                state.pin[wrong]
        with raises(AttributeError):
            state.pin[3].in_ = True
        for wrong in ("pin.55.in", "joint.00.pos-fb"):
            for ask in (lambda name: mill[name], lambda name: now(mill)[name], pokeys.describe):
                with raises(KeyError, f"no value is named '{wrong}'; pokeysctl names lists the names"):
                    ask(wrong)
        with raises(KeyError, "'pin.30.out' can be commanded, but not read"):
            mill["pin.30.out"]
        with raises(TypeError, "give several names one after the other"):
            mill.changes(["pin.03.in"])
        equal(type(soon(mill, "latency.wakeup-count")), int)
        # the names of a later moment are of that moment, and this one stays what it was
        cycle = state.cycle
        wait_for("another cycle", lambda: now(mill).cycle > cycle)
        equal(state.cycle, cycle)


def fresh_one(mill):
    """Values that are fresh."""
    found = now(mill)
    while not found.connected:
        found = now(mill)
    return found


def test_what_is_wrong_is_said():
    with House() as house:
        with raises(pokeys.NoDaemon, "no daemon in"):
            pokeys.attach("mill", runtime=str(house.runtime))
        equal(pokeys.devices(str(house.runtime)), [])
    with machine() as (house, sim, daemon):
        equal(pokeys.devices(str(house.runtime)), ["mill"])
        with raises(pokeys.NoSuchDevice, "no device 'lathe'; it has: mill"):
            pokeys.attach("lathe", runtime=house.runtime)
        for wrong in ("", "a b", "x" * 32):
            with raises(ValueError, "1 to 31"):
                pokeys.attach(wrong, runtime=str(house.runtime))
        with attach(house) as mill:
            fresh_one(mill)
            before = datetime.now(timezone.utc)
            sim.kill()
            wait_for("the loss", lambda: now(mill).stale and now(mill).age_us > 4e6)
            last = now(mill)
            equal((mill["stale"], mill["connected"]), (True, False))
            try:
                mill.read()
                raise AssertionError("old values were given")
            except pokeys.Stale as stale:
                assert stale.age > 3.9 and abs((stale.since - before).total_seconds()) < PATIENCE, stale
                again = pickle.loads(pickle.dumps(stale))
                equal((str(again), again.age, again.since), (str(stale), stale.age, stale.since))
                assert str(stale).startswith("mill: ") and now(mill).reason, stale
            equal(last.info.type, "PoKeys57CNC")
            wait_for("the reason", lambda: "no answer; check power" in now(mill).reason)
            end(daemon)
            wait_for("the end", lambda: not_there(mill))
            # the next daemon is found by itself
            house.start_sim()
            house.start_daemon(wait=False)
            wait_for("the next daemon", lambda: fresh(mill))
        with raises(ValueError, "closed"):
            mill.read()
        mill.close()


def not_there(mill):
    try:
        mill.read(stale_ok=True)
    except pokeys.NoDaemon:
        return True
    return False


def fresh(mill):
    try:
        return mill.read().connected
    except (pokeys.NoDaemon, pokeys.Stale):
        return False


def test_who_may_not_read_is_told_so():
    if os.geteuid():
        raise Skip("only root can be somebody else")
    with machine() as (house, _sim, _daemon):
        reader, writer = os.pipe()
        child = os.fork()
        if not child:
            try:
                os.setgroups([])
                os.setresgid(65534, 65534, 65534)
                os.setresuid(65534, 65534, 65534)
                pokeys.attach("mill", runtime=str(house.runtime))
            except pokeys.Refused as error:
                os.write(writer, str(error).encode())
            finally:
                os._exit(0)
        os.close(writer)
        said = os.read(reader, 1000).decode()
        os.close(reader)
        os.waitpid(child, 0)
        assert "permission denied" in said, said


def test_a_child_of_a_fork_attaches_for_itself():
    with machine() as (house, _sim, _daemon), attach(house) as mill:
        events = mill.events()
        reader, writer = os.pipe()
        child = os.fork()
        if not child:
            try:
                for call in (mill.read, mill.recent_events, mill.events, lambda: asyncio.run(anext(events))):
                    try:
                        call()
                    except ValueError as error:
                        os.write(writer, f"{error}; ".encode())
                mill.close()
                with attach(house) as again:
                    os.write(writer, now(again).info.type.encode())
            finally:
                os._exit(0)
        os.close(writer)
        os.waitpid(child, 0)
        said = os.read(reader, 1000).decode()
        os.close(reader)
        assert said.count("is closed; call attach() again (a child process as well); ") == 4 and said.endswith("PoKeys57CNC"), said
        equal(now(mill).info.type, "PoKeys57CNC")


def test_it_may_be_closed_beside_readers():
    with machine() as (house, _sim, _daemon):
        for _ in range(20):
            mill, ended = attach(house), []

            def read(mill=mill, ended=ended):
                try:
                    while True:
                        now(mill)
                except ValueError as error:
                    ended.append(str(error))
            readers = [threading.Thread(target=read) for _ in range(3)]
            for one in readers:
                one.start()
            mill.close()
            for one in readers:
                one.join(PATIENCE)
            equal(len(ended), 3)


def test_changes_are_given_once_and_in_order():
    async def watch(house, sim, mill):
        seen = []

        async def look():
            async for state in mill.changes("pin.03.in", rate=200):
                seen.append((state.connected, state.pin[3].in_))

        def levels():
            return [level for i, (_, level) in enumerate(seen) if not i or level != seen[i - 1][1]]
        task = asyncio.create_task(look())
        for count in range(1, 8):
            end_at = time.monotonic() + PATIENCE
            while len(levels()) < count:
                assert time.monotonic() < end_at and not task.done(), seen
                await asyncio.sleep(0.005)
            await asyncio.to_thread(house.ask_sim, sim, "pin", 4, count % 2 ^ 1)
        task.cancel()
        equal(levels()[:7], [True, False] * 3 + [True])
        assert all(one != other for one, other in zip(seen, seen[1:], strict=False)), seen
        with raises(KeyError, "no value of the state is named 'no.such'"):
            mill.changes("no.such")
        with raises(KeyError, "is in diagnostics()"):
            mill.changes("latency.wakeup-*")
        with raises(ValueError, "rate"):
            mill.changes(rate=0)

    with machine() as (house, sim, _daemon), attach(house) as mill:
        house.ask_sim(sim, "pin", 4, 1)
        wait_equal("the input", lambda: now(mill).pin[3].in_, True)
        asyncio.run(watch(house, sim, mill))


def test_changes_survive_the_device_and_the_daemon():
    async def watch(house, sim, daemon, mill):
        seen = asyncio.Queue()

        async def look():
            async for state in mill.changes("link-state", rate=100):
                await seen.put((state.connected, state.daemon.epoch))
        task = asyncio.create_task(look())
        try:
            first = await asyncio.wait_for(seen.get(), PATIENCE)
            equal(first[0], True)
            sim.kill()
            while (await asyncio.wait_for(seen.get(), PATIENCE))[0]:
                pass
            await asyncio.to_thread(end, daemon)
            house.start_sim()
            await asyncio.to_thread(house.start_daemon, wait=False)
            while not (now := await asyncio.wait_for(seen.get(), PATIENCE))[0]:
                pass
            assert now[1] != first[1], "the same daemon"
        finally:
            task.cancel()

    with machine(**{"stale-after-ms": 500, "lost-after-ms": 600}) as (house, sim, daemon), attach(house) as mill:
        asyncio.run(watch(house, sim, daemon, mill))


def test_the_end_of_a_daemon_is_a_change():
    async def watch(daemon, mill):
        seen = asyncio.Queue()

        async def look():
            async for state in mill.changes("pin.03.in", rate=1.5):
                await seen.put((state.connected, state.reason))
        task = asyncio.create_task(look())
        while not (await asyncio.wait_for(seen.get(), PATIENCE))[0]:
            pass
        await asyncio.to_thread(end, daemon)
        while (now := await asyncio.wait_for(seen.get(), PATIENCE))[0]:
            pass
        task.cancel()
        assert now[1], now

    with machine() as (house, _sim, daemon), attach(house) as mill:
        asyncio.run(watch(daemon, mill))


def test_events_are_those_of_pokeysctl():
    with machine() as (house, _sim, daemon), attach(house) as mill:
        wait_for("running", lambda: any(event.text.startswith("running") for event in mill.recent_events()))
        daemon.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, daemon.pid, os.WSTOPPED | os.WNOWAIT)
        try:
            found = mill.recent_events()
            wanted = [json.loads(line) for line in house.ctl("events", "--json").stdout.splitlines()]
            lines = house.ctl("events").stdout.splitlines()
        finally:
            daemon.send_signal(signal.SIGCONT)
        keys = ("device", "epoch", "number", "kind", "text", "held")
        equal([tuple(getattr(event, key) for key in keys) for event in found],
              [tuple(row[key] for key in keys) for row in wanted])
        words = {3: "error", 4: "warning", 5: "notice", 6: "info"}
        equal([str(event) for event in found], lines)
        equal([event.level for event in found], [words[row["level"]] for row in wanted])
        equal([round(event.time.timestamp() * 1e6) for event in found], [row["time_ns"] // 1000 for row in wanted])
    for call in (mill.recent_events, mill.events, mill.changes, mill.command, mill.settings):
        with raises(ValueError, "is closed"):
            call()


def test_events_come_as_they_happen_and_over_a_restart():
    async def watch(house, sim, daemon, mill):
        seen, all_of_them = asyncio.Queue(), []

        async def look(events):
            async for event in events:
                all_of_them.append(event)
                await seen.put(event)

        async def until(beginning):
            while True:
                event = await asyncio.wait_for(seen.get(), PATIENCE)
                if event.kind == "link" and event.text.startswith(beginning):
                    return event
        before, events = mill.recent_events(), mill.events()
        sim.kill()
        await asyncio.to_thread(wait_for, "the loss", lambda: mill.recent_events()[-1].number > before[-1].number)
        task = asyncio.create_task(look(events))
        lost = await until("lost")
        assert before[-1].number < all_of_them[0].number <= lost.number, (before[-1], all_of_them[0])
        await asyncio.to_thread(end, daemon)
        house.start_sim()
        await asyncio.to_thread(house.start_daemon, wait=False)
        running = await until("running")
        assert running.epoch != lost.epoch and task.done() is False
        task.cancel()
        async for event in mill.events(past=True):
            equal((event.number, event.epoch), (1, running.epoch))
            break

    with machine(**{"stale-after-ms": 500, "lost-after-ms": 600}) as (house, sim, daemon), attach(house) as mill:
        fresh_one(mill)
        asyncio.run(watch(house, sim, daemon, mill))


def test_the_last_events_of_a_daemon_come_however_slow_one_is():
    async def watch(house, sim, daemon, mill):
        events = mill.events()
        sim.kill()
        seen = [await asyncio.wait_for(anext(events), PATIENCE)]
        # busy with this one, while more come and until another daemon is there
        last = await asyncio.to_thread(wait_for, "the loss", lambda: next(
            (event for event in mill.recent_events() if event.text.startswith("lost")), None))
        await asyncio.to_thread(end, daemon)
        await asyncio.to_thread(house.start_daemon)
        while seen[-1].epoch == seen[0].epoch:
            seen.append(await asyncio.wait_for(anext(events), PATIENCE))
        equal([event.number for event in seen], [*range(seen[0].number, seen[0].number + len(seen) - 1), 1])
        assert last in seen, (last, seen)
        mill.close()
        with raises(ValueError, "is closed"):
            while True:
                await asyncio.wait_for(anext(events), PATIENCE)

    with machine(**{"stale-after-ms": 500, "lost-after-ms": 2000}) as (house, sim, daemon), attach(house) as mill:
        fresh_one(mill)
        asyncio.run(watch(house, sim, daemon, mill))


def test_histograms_are_those_of_pokeysctl():
    with machine() as (house, _sim, daemon), attach(house) as mill:
        wait_for("some durations", lambda: mill.diagnostics(stale_ok=True).histograms()["wakeup"].count > 100)
        daemon.send_signal(signal.SIGSTOP)
        try:
            wait_for("its silence", lambda: not now(mill).daemon_alive)
            found = mill.diagnostics(stale_ok=True).histograms()
            with raises(pokeys.Stale, "diagnostics are"):
                while True:
                    mill.diagnostics()
            wanted = house.device()["diag"]["latency_us"]
        finally:
            daemon.send_signal(signal.SIGCONT)
        equal(len(found), len(wanted))
        names = {"data": "fresh", "age": "age_at_read"}
        for name, histogram in found.items():
            other = wanted[names.get(name, name.replace("-", "_"))]
            equal(histogram.count, other["count"], name)
            for mine, theirs in ((histogram.mean_us, "mean"), (histogram.min_us, "min"), (histogram.max_us, "max"),
                                 (histogram.percentile_us(0.99), "p99")):
                assert mine == other[theirs] or math.isclose(mine, other[theirs], rel_tol=1e-6), (name, theirs)
            equal(sum(number for _lower, number in histogram.buckets()), histogram.count)


def test_pokeysctl_is_asked_for_the_rest():
    with machine() as (house, _sim, _daemon), attach(house) as mill:
        equal(mill.settings()["digital-outputs"], "31-34")
        assert isinstance(mill.settings()["pwm-period"], int), mill.settings()["pwm-period"]
        found = pokeys.discover(timeout=0.1)
        assert all(isinstance(one, pokeys.Found) for one in found), found
        with raises(pokeys.ToolFailed, "no such interface"):
            pokeys.discover(interface="nowhere0")
        os.environ["POKEYSCTL"], before = "/nowhere/pokeysctl", os.environ["POKEYSCTL"]
        with raises(pokeys.ToolFailed, "install pokeys-tools"):
            pokeys.discover()
        os.environ["POKEYSCTL"] = before


def test_another_version_of_the_library_is_refused():
    from pokeys import _library, _names  # pylint: disable=import-outside-toplevel
    with raises(pokeys.LibraryMissing, "of the same version"):
        _library.check_layouts({0: _names.STATE_HASH ^ 1})
    with raises(pokeys.LibraryMissing, "install pokeysd, or set POKEYS_SHM_LIBRARY"):
        _library.Library("/nowhere/libpokeys_shm.so.0")


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
