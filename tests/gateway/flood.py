#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Clients that are slow, many, fast or broken: each is ended or refused, nobody else notices, and when all are gone,
nothing is left of them. Deadlines are tried in virtual time."""
import asyncio
import contextlib
import json
import os
import pathlib
import random
import socket
import sys

from rig import PATIENCE, Skip, machine
from house import equal, main, wait_equal, wait_for  # noqa: E402  (rig.py finds it)

try:
    import aiohttp
except ImportError:
    aiohttp = None

SEED = int(os.environ.get("POKEYS_SEED", "20055"))
HANDSHAKE = (b"GET /websocket HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
             b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n")


# ---- the gate alone, in virtual time

class Transport:
    def __init__(self, address="127.0.0.1"):
        self.address, self.written, self.closing, self.reading = address, b"", False, True

    def get_extra_info(self, name):
        return self if name == "socket" else (self.address, 1)

    def setsockopt(self, *how):
        self.how = how

    def write(self, data):
        self.written += data

    def close(self):
        self.closing = True

    abort = close

    def is_closing(self):
        return self.closing

    def pause_reading(self):
        self.reading = False

    def resume_reading(self):
        self.reading = True


class Protocol(asyncio.Protocol):
    """In place of aiohttp's: keeps what it is given."""

    def __init__(self):
        self.data, self.most = b"", 0
        # what aiohttp has
        self._reading_paused, self._messages = False, []

    def data_received(self, data):
        self.data += data
        self.most = max(self.most, len(data))


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


def a_gate():
    if not aiohttp:
        raise Skip("python3-aiohttp is not installed")
    from pokeys_gateway import gate
    clock = Clock()
    made = gate.Gate(clock=clock)
    inner = []
    made.make = lambda: inner.append(Protocol()) or inner[-1]
    return gate, made, clock, inner


def enter(made, address="127.0.0.1"):
    connection, transport = made(loopback=address.startswith("127.")), Transport(address)
    connection.connection_made(transport)
    return connection, transport


def test_each_step_has_a_deadline():
    gate, made, clock, _inner = a_gate()

    def open_after(transport, seconds):
        clock.now += seconds
        made.sweep()
        return not transport.closing
    one, transport = enter(made)
    equal(open_after(transport, gate.REQUEST_S - 1), True)
    equal(open_after(transport, 2), False, "a request that does not come")
    one.connection_lost(None)
    one, transport = enter(made)
    with made.request(transport):
        equal(open_after(transport, gate.ANSWER_S - 1), True)
        equal(open_after(transport, 2), False, "an answer that does not end")
    one.connection_lost(None)
    one, transport = enter(made)
    with made.request(transport):
        for _ in range(100):
            made.took(transport)
            equal(open_after(transport, gate.ANSWER_S - 1), True, "an answer that is taken slowly")
        equal(open_after(transport, 2), False, "an answer that is taken no more")
        made.took(transport)
        equal(open_after(transport, 0), False)
    one.connection_lost(None)
    made.took(transport)
    one, transport = enter(made)
    with made.request(transport):
        made.stream(transport, lambda: False)
        equal(open_after(transport, 1e6), True, "a stream")
    equal(open_after(transport, gate.ANSWER_S - 1), True)
    equal(open_after(transport, 2), False, "the end of an answer")
    one.connection_lost(None)
    equal((len(made), made.late), (0, 4))


def test_there_is_room_for_so_many():
    gate, made, _clock, _inner = a_gate()
    far = [enter(made, "192.0.2.7") for _ in range(gate.OF_AN_ADDRESS)]
    _, transport = enter(made, "192.0.2.7")
    equal((transport.closing, transport.written.split()[1], made.refused), (True, b"503", 1))
    near = [enter(made) for _ in range(gate.CONNECTIONS_MOST - len(far))]
    for address in "127.0.0.1", "192.0.2.8":
        refused, transport = enter(made, address)
        equal((transport.closing, len(made)), (True, gate.CONNECTIONS_MOST))
        refused.data_received(b"GET")
        refused.connection_lost(None)
    far.pop()[0].connection_lost(None)
    _, transport = enter(made, "192.0.2.7")
    equal(transport.closing, False)
    for one, _ in near:
        one.connection_lost(None)
    equal(len(made), gate.OF_AN_ADDRESS)


async def until(test):
    """Let timers of the loop run until it holds."""
    while not test():
        await asyncio.sleep(0.001)


def test_what_comes_too_fast_waits():
    async def feed():
        gate, made, clock, inner = a_gate()
        one, transport = enter(made)
        rng, sent = random.Random(SEED), b""
        while len(sent) < gate.BURST:
            if transport.reading:
                piece = rng.randbytes(rng.randrange(1, 65536))
                sent += piece
                one.data_received(piece)
            await asyncio.sleep(0)
        await until(lambda: inner[0].data == sent)
        assert inner[0].most <= gate.BITE, inner[0].most
        # it has no credit; after a while, it is read again
        equal(transport.reading, len(sent) == gate.BURST)
        await until(lambda: transport.reading)
        one.connection_lost(None)
        # more than is parsed at once, but not too much: it is read on
        one, transport = enter(made)
        for size in 3 * gate.BITE, 10, 5 * gate.BITE + 1:
            before = inner[-1].data
            one.data_received(b"y" * size)
            while not transport.reading:
                await asyncio.sleep(0)
            equal(len(inner[-1].data) - len(before), size)
        one.connection_lost(None)
        # one that sends little is never stopped
        one, transport = enter(made)
        for _ in range(1000):
            clock.now += 0.01
            one.data_received(b"x" * 600)
            assert transport.reading
        one.connection_lost(None)
    asyncio.run(asyncio.wait_for(feed(), PATIENCE))


def test_what_waits_is_not_added_to():
    async def feed():
        gate, made, _clock, inner = a_gate()
        one, transport = enter(made)
        unready = False

        def requests(wait):
            inner[0]._messages = [0] * gate.PIPELINED_MOST if wait else []

        def paused(wait):
            inner[0]._reading_paused = wait

        def stream(wait):
            nonlocal unready
            unready = wait
        with made.request(transport):
            made.stream(transport, lambda: unready)
            for busy in requests, paused, stream:
                busy(True)
                before = inner[0].data
                one.data_received(b"y" * 3 * gate.BITE)
                equal(transport.reading, False)
                # aiohttp says that more may come, and it does
                transport.reading = True
                one.data_received(b"z" * 100)
                equal(transport.reading, False)
                await asyncio.sleep(3 * gate.BUSY_S)
                equal((len(inner[0].data) - len(before), transport.reading), (gate.BITE, False), "one bite")
                busy(False)
                await until(lambda: transport.reading)
                equal(inner[0].data[len(before):], b"y" * 3 * gate.BITE + b"z" * 100)
        one.connection_lost(None)
    asyncio.run(asyncio.wait_for(feed(), PATIENCE))


def test_what_cannot_be_parsed_ends_the_connection():
    async def feed():
        gate, made, _clock, inner = a_gate()
        one, transport = enter(made)
        whole = inner[0].data_received
        inner[0].data_received = lambda data: 1 / 0 if inner[0].data else whole(data)
        one.data_received(b"x" * 2 * gate.BITE)
        await until(lambda: transport.closing)
        one.connection_lost(None)
        equal(len(made), 0)
    asyncio.run(asyncio.wait_for(feed(), PATIENCE))


# ---- the gateway

@contextlib.contextmanager
def flooded():
    """A House and its gateway, of which nothing must be left that a client has done."""
    with machine() as (house, _sim, _daemon, gateway):
        yield house, gateway
        for name, count in ("clients", 0), ("feeds", 0), ("waiting", 0), ("connections", 1):
            wait_equal(name, lambda name=name: gateway.own(name), count)
        equal(gateway.json("/api/devices")["devices"][0]["connected"], True)
        assert "Traceback" not in house.log("gateway.log"), house.log("gateway.log")


def connect(gateway):
    connection = socket.create_connection(("127.0.0.1", gateway.port), timeout=PATIENCE)
    return connection


def rest(connection):
    """What comes until the other side ends it; ours are still open."""
    found = b""
    with contextlib.suppress(ConnectionResetError):
        while part := connection.recv(65536):
            found += part
    return found


def test_slow_and_endless_requests_end():
    with flooded() as (_house, gateway):
        silent, half, body = connect(gateway), connect(gateway), connect(gateway)
        half.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: ")
        body.sendall(b"POST /healthz HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000\r\n\r\nx")
        long = connect(gateway)
        with contextlib.suppress(ConnectionError):
            long.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Long: " + b"x" * 1_000_000 + b"\r\n\r\n")
        assert rest(long).split(b" ")[1:2] in ([b"400"], []), "a header of a megabyte"
        many = connect(gateway)
        with contextlib.suppress(ConnectionError):
            many.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n" + b"X-Many: 1\r\n" * 100_000)
            many.sendall(b"\r\n")
        equal((rest(silent), rest(half)), (b"", b""))
        assert rest(body).startswith(b"HTTP/1.1 405 "), "a method that is not there"
        for one in silent, half, body, long, many:
            one.close()
        assert gateway.own("late_total") >= 2


def test_too_many_connections_are_refused():
    with flooded() as (house, gateway):
        with contextlib.ExitStack() as stack:
            held = []
            # each is asked for something, so that it is there for sure
            while len(held) < 600:
                one = stack.enter_context(connect(gateway))
                one.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
                if one.recv(12) != b"HTTP/1.1 200":
                    break
                held.append(one)
            equal(len(held), 512)
            assert b"too many connections" in rest(one)
        wait_for("the warning", lambda: " connections refused; " in house.log("gateway.log"))


def test_many_requests_are_answered():
    async def ask(gateway):
        async def one(session):
            for _ in range(100):
                async with session.get(f"http://127.0.0.1:{gateway.port}/healthz") as answer:
                    equal((answer.status, (await answer.json())["status"]), (200, "ok"))
        async with aiohttp.ClientSession(connector=aiohttp.TCPConnector(limit=50)) as session:
            await asyncio.gather(*(one(session) for _ in range(30)))
    with flooded() as (_house, gateway):
        asyncio.run(asyncio.wait_for(ask(gateway), 2 * PATIENCE))


def noise(rng):
    """Frames as no client sends them, and some that are nearly right."""
    good = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "objects.subscribe",
                       "params": {"objects": {"mill": None}, "rate": 50}}).encode()
    text = bytearray(rng.choice((good, b"[" * rng.randrange(2000), b"{}", b'"\\ud800"', rng.randbytes(rng.randrange(300)))))
    for _ in range(rng.randrange(4) if text else 0):
        text[rng.randrange(len(text))] = rng.randrange(256)
    first = rng.choice((0x81, 0x81, 0x81, 0x01, 0x00, 0x80, 0x82, 0x88, 0x89, 0x8A, rng.randrange(256)))
    mask = rng.randbytes(4)
    size = rng.choice((len(text), len(text), len(text), rng.randrange(1 << 16), 1 << 62))
    head = bytes([first, 0x80 | size]) if size < 126 else bytes([first, 0xFE]) + size.to_bytes(2, "big") \
        if size < 65536 else bytes([first, 0xFF]) + size.to_bytes(8, "big")
    if rng.random() < 0.05:
        return rng.randbytes(rng.randrange(200))
    return head + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(text))


def test_noise_harms_nobody():
    with flooded() as (_house, gateway):
        rng = random.Random(SEED)
        for i in range(300):
            with connect(gateway) as one:
                if i % 5:
                    one.sendall(HANDSHAKE)
                with contextlib.suppress(ConnectionError):
                    for _ in range(rng.randrange(1, 12)):
                        one.sendall(noise(rng))
                if rng.random() < 0.3:
                    one.settimeout(0.05)
                    with contextlib.suppress(OSError):
                        one.recv(4096)


def test_a_flood_keeps_nobody_waiting():
    async def live(gateway, number):
        async with aiohttp.ClientSession() as session, session.ws_connect(
                f"http://127.0.0.1:{gateway.port}/websocket") as ws:
            await ws.send_json({"jsonrpc": "2.0", "id": 1, "method": "objects.subscribe",
                                "params": {"objects": {"mill": ["cycle"]}, "rate": 20}})
            for _ in range(number):
                await asyncio.wait_for(ws.receive(), PATIENCE)

    def flood(gateway, first, more):
        """Send until nothing is taken any more, and read nothing."""
        with connect(gateway) as one, contextlib.suppress(OSError):
            one.sendall(first)
            one.settimeout(1)
            for _ in range(300):
                one.sendall(more)

    def memory_kb(gateway):
        text = pathlib.Path(f"/proc/{gateway.child.pid}/status").read_text()
        return int(text.partition("VmHWM:")[2].split()[0])

    async def all_of_them(gateway):
        ask = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "events.list", "params": {"device": "mill"}}).encode()
        floods = (HANDSHAKE, (b"\x89\x80abcd" + b"\x81\x80abcd") * 2000),  \
            (HANDSHAKE, b"\x8a\x00" * 10000), \
            (HANDSHAKE, (b"\x81" + bytes([len(ask)]) + ask) * 100 + b"\x89\x00" * 5000), \
            (b"", b"GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n" * 500)
        flooding = [asyncio.to_thread(flood, gateway, *how) for how in floods * 2]
        await asyncio.gather(live(gateway, 60), *flooding)
    with flooded() as (_house, gateway):
        before = memory_kb(gateway)
        asyncio.run(asyncio.wait_for(all_of_them(gateway), 2 * PATIENCE))
        print(f"{(memory_kb(gateway) - before) >> 10} MB more, at most {1e3 * gateway.own('loop_lag_most_seconds'):.0f} ms late")
        # half a megabyte may be read from each at once, and as much is answered; without limits it is hundreds
        assert memory_kb(gateway) - before < 40 << 10, (before, memory_kb(gateway))


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
