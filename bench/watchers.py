# SPDX-License-Identifier: GPL-2.0-or-later
"""Clients of a gateway: some read, some have stopped. Prints JSON: the gaps of those that read, and how long those
that do not were kept.

usage: watchers.py PORT DEVICE LIVE FROZEN RATE SECONDS
"""
import asyncio
import contextlib
import json
import os
import socket
import sys
import time

import aiohttp

HANDSHAKE = (b"GET /websocket HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
             b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n")


def subscription(device, rate):
    return json.dumps({"jsonrpc": "2.0", "id": 1, "method": "objects.subscribe",
                       "params": {"objects": {device: None}, "rate": rate}})


def frozen(port, text):
    """A client that asks for everything and never reads: the kernel takes some of it, as from a stopped tab."""
    client = socket.create_connection(("127.0.0.1", port))
    data, mask = text.encode(), os.urandom(4)
    client.sendall(HANDSHAKE + bytes([0x81, 0xFE]) + len(data).to_bytes(2, "big") + mask +
                   bytes(byte ^ mask[i % 4] for i, byte in enumerate(data)))
    client.setblocking(False)
    return client


async def live(port, text, end_at, gaps):
    async with aiohttp.ClientSession() as session, session.ws_connect(
            f"http://127.0.0.1:{port}/websocket", max_msg_size=0) as ws:
        await ws.send_str(text)
        last = time.monotonic()
        while (now := time.monotonic()) < end_at:
            with contextlib.suppress(asyncio.TimeoutError):
                message = await asyncio.wait_for(ws.receive(), max(0.01, end_at - now))
                if message.type is not aiohttp.WSMsgType.TEXT:
                    break
                now = time.monotonic()
                gaps.append(now - last)
                last = now
        # who has heard nothing to the end, or was thrown out, has waited so long
        gaps.append(end_at - last)


async def kept(clients, end_at):
    """For each that the other side has ended: after how many seconds."""
    began, found = time.monotonic(), []
    waiting = set(clients)
    while waiting and time.monotonic() < end_at:
        await asyncio.sleep(0.1)
        for client in list(waiting):
            try:
                # an error is what an aborted connection has; what is in its buffer is not read
                if client.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) or not client.recv(1, socket.MSG_PEEK):
                    raise ConnectionResetError
            except BlockingIOError:
                continue
            except OSError:
                waiting.discard(client)
                found.append(time.monotonic() - began)
    # a client that the server never ended counts as kept for the whole time
    return found, [time.monotonic() - began] * len(waiting)


async def main():
    port, device = int(sys.argv[1]), sys.argv[2]
    number, stopped, rate, seconds = int(sys.argv[3]), int(sys.argv[4]), float(sys.argv[5]), float(sys.argv[6])
    text, gaps = subscription(device, rate), [[] for _ in range(number)]
    end_at = time.monotonic() + seconds
    clients = [frozen(port, text) for _ in range(stopped)]
    *_, ended = await asyncio.gather(*(live(port, text, end_at, one) for one in gaps), kept(clients, end_at))
    every = sorted(gap for one in gaps for gap in one)
    print(json.dumps({"p50_ms": every[len(every) // 2] * 1e3, "p99_ms": every[len(every) * 99 // 100] * 1e3,
                      "max_ms": every[-1] * 1e3, "messages": len(every), "frozen": stopped, "ended": len(ended[0]),
                      "kept_s": max(ended[0] + ended[1])}))


asyncio.run(main())
