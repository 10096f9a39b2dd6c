# SPDX-License-Identifier: GPL-2.0-or-later
"""What the gateway is compared with: aiohttp, sending all values to all clients at a rate, as one writes it first.

usage: broadcast.py PORT RUNTIME-DIRECTORY DEVICE RATE  (POKEYS_SHM_LIBRARY names the library)
"""
import asyncio
import json
import pathlib
import sys

from aiohttp import web

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "python"))
import pokeys  # noqa: E402


async def main():
    port, runtime, device, rate = int(sys.argv[1]), sys.argv[2], sys.argv[3], float(sys.argv[4])
    mill = pokeys.attach(device, runtime=runtime)
    clients = set()

    async def handle(request):
        ws = web.WebSocketResponse()
        await ws.prepare(request)
        clients.add(ws)
        try:
            async for _ in ws:
                pass
        finally:
            clients.discard(ws)
        return ws

    app = web.Application()
    app.router.add_get("/websocket", handle)
    runner = web.AppRunner(app)
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", port).start()
    while True:
        text = json.dumps(mill.read(stale_ok=True).as_dict())
        for ws in list(clients):
            try:
                await ws.send_str(text)
            except ConnectionError:
                pass
        await asyncio.sleep(1 / rate)


asyncio.run(main())
