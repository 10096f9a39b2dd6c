#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The gateway's hub: it goes on whatever happens while it looks for devices; late loops are counted."""
import asyncio
import logging
import pathlib
import sys
import tempfile
import threading
import time
import types
import unittest.mock


class Lines(logging.Handler):
    def __init__(self):
        super().__init__()
        self.lines = []

    def emit(self, record):
        self.lines.append(record.getMessage())


async def looking_goes_on():
    hub.LOOK_S = 0.01
    one = hub.Hub(config.Config(runtime_directory="/nowhere"), model.Model({"names": [], "boards": []}))
    looks = []

    def look():
        looks.append(len(looks))
        if len(looks) in (2, 3):
            raise OSError(24, "Too many open files") if len(looks) == 2 else RuntimeError("anything")
    one.source.look = look
    await one.start()
    while len(looks) < 6:
        await asyncio.sleep(0.01)
    await one.close()
    assert [line for line in heard.lines if "looking for devices" in line] == 2 * ["looking for devices"], heard.lines


def a_device_that_cannot_be_read_keeps_nobody_from_the_others():
    names, broken = ["a", "b", "c"], {"b"}

    def attach(name, runtime):
        if name in broken:
            raise pokeys.Refused(f"{name}: another version")
        return types.SimpleNamespace(name=name, close=lambda: None)
    with unittest.mock.patch.multiple(pokeys, devices=lambda runtime: list(names), attach=attach):
        one = source.Source("/nowhere")
        one.look()
        assert (one.names(), one.trouble) == (["a", "c"], "b: another version"), (one.names(), one.trouble)
        # one that has gone is forgotten meanwhile
        names.remove("a")
        one.look()
        assert one.names() == ["c"]
        broken.clear()
        one.look()
        assert (one.names(), one.trouble) == (["c", "b"], "")
        names.clear()
        one.look()
        assert one.names() == ["c", "b"] and one.trouble == "no daemon in /nowhere; is pokeysd running?"


def only_a_proxy_itself_is_one():
    """Of IPv6, a whole network counts as one client, and none of its other hosts is the proxy."""
    one = gate.Gate(("fd00:0::2", "192.0.2.2"))
    for address, taken in (("fd00::2", True), ("fd00::3", False), ("fd00::2%eth0", True), ("::ffff:192.0.2.2", True),
                           ("192.0.2.3", False)):
        assert one.admit(types.SimpleNamespace(loopback=False, address=address, transport=object())) == taken, address
    who = session.Session(config.Config(behind_proxy=("fd00:0::2",)), None)
    for peer, seen in (("fd00::2", "192.0.2.7"), ("fd00::3", "fd00::/64")):
        request = types.SimpleNamespace(remote=peer, headers=multidict.CIMultiDict({"X-Forwarded-For": "192.0.2.7"}))
        assert who.address(request) == seen, (peer, who.address(request))


def a_process_is_measured_where_the_rest_of_proc_is_hidden():
    """As in the unit, of which ProcSubset= leaves nothing but processes."""
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "self").symlink_to("/proc/self")
        found = {one.name: one.samples[0].value for one in metrics.OwnProcess(proc=folder, registry=None).collect()}
    assert found["process_resident_memory_bytes"] > 1e6 and found["process_open_fds"] > 2, found
    assert abs(found["process_start_time_seconds"] - time.time()) < 3600, found


def lag_is_told_once_in_a_while():
    now = 0.0
    lag = hub.Lag(lambda: now)
    heard.lines.clear()
    for i in range(100):
        now = float(i)
        lag.take(0.06 if i % 2 else 0.001)
    assert (lag.late, lag.most, round(lag.total, 9)) == (50, 0.06, 3.05), vars(lag)
    lag.take(0.03)      # counted, and not worth a line
    lag.take(0.6)
    assert lag.counts == [50, 0, 0, 0, 0, 1, 50, 0, 1] and lag.late == 52, lag.counts
    assert len(heard.lines) == 10 and "60 ms late" in heard.lines[0], heard.lines


async def few_wait_for_a_disk():
    """What a disk does not answer has its place until it does, whoever waits for it."""
    few, go = aside.Few(2), threading.Event()
    work = [few(go.wait, 60), few(go.wait, 60)]
    for one in work[0], None:
        try:
            few(int)
        except OSError as error:
            assert "too much to do" in str(error), error
        else:
            raise AssertionError("a third one")
        if one:
            one.cancel()
            await asyncio.sleep(0)
    go.set()
    assert await work[1] is True
    while True:
        try:
            assert await few(int) == 0
            break
        except OSError:
            await asyncio.sleep(0.01)


if __name__ == "__main__":
    try:
        import multidict
        import pokeys
        from pokeys_gateway import aside, config, gate, hub, model, source
        from pokeys_gateway.doors import metrics, session
    except ImportError as error:
        print(f"not tried: {error} (Debian: python3-aiohttp, python3-prometheus-client)", file=sys.stderr)
        sys.exit(77)
    heard = Lines()
    logging.getLogger("pokeys-gateway").addHandler(heard)
    asyncio.run(asyncio.wait_for(looking_goes_on(), 60))
    asyncio.run(asyncio.wait_for(few_wait_for_a_disk(), 60))
    a_device_that_cannot_be_read_keeps_nobody_from_the_others()
    only_a_proxy_itself_is_one()
    a_process_is_measured_where_the_rest_of_proc_is_hidden()
    lag_is_told_once_in_a_while()
