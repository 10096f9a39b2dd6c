#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Stops that come from telnet, from a serial port and from the page at the same time, while axes move and heaters heat: each
is confirmed to who has sent it, once, and everything stands and is off. How soon is measured in bench/sections/stops.py."""
import asyncio
import contextlib
import json
import os
import re
import sys
import threading
import time
import types

from bridge import PORT
from heating import Client
from house import PATIENCE, free_address, main, wait_for
from rig import machine

try:
    import aiohttp
except ImportError:
    aiohttp = None      # rig.py skips

ROUNDS = 5


@contextlib.contextmanager
def printer():
    """An axis and a hot end, with the three ways in."""
    where = free_address()
    more = f"[machine]\nkind = pokeys\ndevice = mill\n[telnet]\nlisten = {where}:{PORT}\n[pty]\npath = @folder@/pty\n" \
        "[console]\nlevel = user\n"
    axis = {"axes": 1, "generator": "external", "axis.0.mode": "position", "axis.0.pulses-per-unit": 200, "axis.0.name": "x",
            "axis.0.max-speed": 20000, "axis.0.max-acceleration": 200000, "axis.0.invert": "off"}
    with machine("--preset", "printer", more=more, heaters={"hotend": {
            "sensor-pin": 43, "pwm": 0, "max-temperature": 280, "sensor": "thermistor", "max-age-ms": 2000}},
            **{"pwm-period": 2500000, "heartbeat-timeout-ms": 3000, **axis}) as (house, sim, _daemon, gateway):
        house.console = where
        one = Client(house)
        wait_for("the temperature", lambda: one.ask("M105")[-1].startswith("ok T:"))
        yield types.SimpleNamespace(house=house, sim=sim, gateway=gateway, one=one)


class Serial:
    """A program at the pseudoterminal."""

    def __init__(self, house):
        self.port = os.fdopen(os.open(house.folder / "pty", os.O_RDWR | os.O_NOCTTY), "r+b", buffering=0)

    def stop(self, line):
        self.port.write(line.encode() + b"\n")
        while not (said := self.port.readline().strip()).startswith((b"ok", b"Error")):
            pass
        return said.decode()


class Telnet:
    def __init__(self, house):
        self.client = Client(house)

    def stop(self, line):
        return self.client.ask(line)[-1]


class Page:
    """A browser's WebSocket."""

    def __init__(self, gateway):
        self.loop, self.number = asyncio.new_event_loop(), 0
        threading.Thread(target=self.loop.run_forever, daemon=True).start()
        self.call(self.connect(f"http://127.0.0.1:{gateway.port}/websocket"))

    def call(self, work):
        return asyncio.run_coroutine_threadsafe(work, self.loop).result(PATIENCE)

    async def connect(self, address):
        self.said = asyncio.Queue()
        self.session = aiohttp.ClientSession()
        self.ws = await self.session.ws_connect(address)
        self.reading = asyncio.create_task(self.read())
        await self.ask("console.subscribe")

    async def read(self):
        async for message in self.ws:
            self.said.put_nowait(json.loads(message.data))

    async def ask(self, method, **params):
        self.number += 1
        await self.ws.send_json({"jsonrpc": "2.0", "id": self.number, "method": method, "params": params})
        while (said := await self.said.get()).get("id") != self.number:
            pass
        assert "error" not in said, said

    async def send(self, line):
        await self.ask("console.send", line=line)
        while True:
            said = await self.said.get()
            for text in said["params"]["lines"] if said.get("method") == "console.said" else ():
                if text.startswith(("ok", "Error")):
                    return text

    def stop(self, line):
        return self.call(self.send(line))

    def close(self):
        self.call(self.session.close())


def at_once(ways, line):
    """What each of them is answered."""
    start, answers = threading.Barrier(len(ways)), {}

    def go(way):
        start.wait()
        answers[way] = way.stop(line)
    threads = [threading.Thread(target=go, args=(way,)) for way in ways]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(2 * PATIENCE)
    return [answers.get(way) for way in ways]


def told(shop):
    """Another client got one line for each of the three stops."""
    stops = 0
    shop.one.send(b"M118 that is all\n")
    while (line := shop.one.line()) != "echo:that is all":
        stops += line.startswith("[stop by")
    assert shop.one.until("ok")[-1] == "ok" and stops == 3, stops


def test_three_stops_at_once():
    with printer() as shop:
        ways = [Telnet(shop.house), Serial(shop.house), Page(shop.gateway)]

        def place():
            return int(re.search(r"machine=(-?\d+)", shop.house.ask_sim(shop.sim, "axis", 0))[1])

        def moves():
            before = place()
            wait_for("it moves", lambda: place() != before, say=shop.house.log)
        assert shop.one.ask("G91") == ["ok"] and shop.one.ask("M104 S200") == ["ok"]
        for i in range(ROUNDS):
            # its reply comes when the daemon has it: who has a line under way at a stop is not heard for a while
            assert shop.one.ask(f"G1 X{-50 if i % 2 else 50} F600")[-1] == "ok"
            moves()
            assert at_once(ways, "M410") == 3 * ["ok"], shop.house.log("gateway.log")
            # confirmed is: it stands
            stood = place()
            assert place() == stood and shop.house.state()["moves"]["waiting"] == 0
            told(shop)
            assert shop.house.state()["heaters"][0]["target"] == 200
        for _ in range(ROUNDS):
            assert shop.one.ask("G1 X50 F600")[-1] == "ok"
            moves()
            assert at_once(ways, "M112") == 3 * ["ok"], shop.house.log("gateway.log")
            state = shop.house.state()
            assert not state["flags"]["machine_on"] and state["heaters"][0]["target"] == 0 and not state["moves"]["waiting"]
            # what is off brakes before it stands
            wait_for("it stands", lambda: place() == (time.sleep(0.05), place())[1], say=shop.house.log)
            stood = place()
            assert place() == stood
            told(shop)
            wait_for("commands are permitted", lambda: shop.one.ask("M999")[-1] == "ok" and shop.one.ask("G91") == ["ok"] and
                     shop.one.ask("M104 S200") == ["ok"], say=shop.house.log)
        ways[-1].close()


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
