# SPDX-License-Identifier: GPL-2.0-or-later
"""Stops of a machine that moves by G-code: from when a client has sent one until the daemon has taken it. Prints JSON: for
each way in, milliseconds.

usage: stoppers.py DEVICE RUNTIME TELNET-PORT PTY PAGE-PORT STOPS
"""
import asyncio
import contextlib
import json
import os
import random
import statistics
import sys
import time

import aiohttp
import pokeys

PATIENCE_S = 20
LOOK_S = 0.0002
MOVING = 1  # moves.state
WAYS = ("telnet", "serial", "page")


class Lines:
    """A client of the console, over telnet or a pseudoterminal."""

    def __init__(self, reader, write):
        self.reader, self.send = reader, write

    async def confirmed(self):
        while not (await self.reader.readline()).startswith(b"ok"):
            pass

    async def ask(self, line):
        self.send(f"{line}\n".encode())
        await asyncio.wait_for(self.confirmed(), PATIENCE_S)


async def serial(path):
    port = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    reader = asyncio.StreamReader()
    await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), open(port, "rb", 0))
    return Lines(reader, lambda data: os.write(port, data))


async def page(ws, line):
    """The page's button."""
    await ws.send_json({"jsonrpc": "2.0", "id": 1, "method": "console.send", "params": {"line": line}})


async def until(device, test):
    """A state for which it holds, looked for often, but so that the gateway has the core as well."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        with contextlib.suppress(pokeys.Stale):     # a machine that others use
            if test(state := device.read()):
                return state
        await asyncio.sleep(LOOK_S)
    raise TimeoutError


async def stop(device, host, sends, to):
    """How long one takes, in ms."""
    await host.ask(f"G1 X{to} F6000")
    await until(device, lambda state: state["moves.state"] == MOVING and state["moves.speed"] > 10)
    await asyncio.sleep(random.uniform(0, 0.05))
    begun = time.monotonic()
    await sends()
    # the state is published once a cycle
    await until(device, lambda state: state["moves.state"] != MOVING)
    return (time.monotonic() - begun) * 1e3


async def main(name, runtime, telnet, pty, port, count):
    found = {way: [] for way in WAYS}
    reader, writer = await asyncio.open_connection("127.0.0.1", int(telnet))
    host, wire = Lines(reader, writer.write), await serial(pty)
    async with aiohttp.ClientSession() as session, session.ws_connect(f"http://127.0.0.1:{port}/websocket") as ws:
        with pokeys.attach(name, runtime=runtime) as device:
            for i in range(int(count) * len(WAYS)):
                way = WAYS[i % len(WAYS)]

                async def sends(way=way):
                    if way == "page":
                        await page(ws, "M410")
                    else:
                        {"telnet": host, "serial": wire}[way].send(b"M410\n")
                found[way].append(await stop(device, host, sends, 100 if i % 2 else -100))
                # confirmed, and nothing of it is left
                if way != "page":
                    await asyncio.wait_for({"telnet": host, "serial": wire}[way].confirmed(), PATIENCE_S)
                await asyncio.sleep(0.3)
                await host.ask("M400")
    print(json.dumps({way: {"p50_ms": statistics.median(values), "stops": len(values)} for way, values in found.items()}))


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
