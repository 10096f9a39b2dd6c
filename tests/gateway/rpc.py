#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""JSON-RPC over a WebSocket, with aiohttp's client: what is subscribed comes, what is wrong is answered, and a
client that reads nothing harms nobody and is closed."""
import asyncio
import contextlib
import errno
import json
import os
import signal
import socket
import sys

from rig import PATIENCE, machine
from house import end, equal, main, wait_equal  # noqa: E402  (rig.py finds it)

try:
    import aiohttp
except ImportError:
    aiohttp = None      # rig.py skips


def workshop(**keys):
    """A device with inputs and outputs."""
    return machine(**{"digital-inputs": "4,9", "digital-outputs": "31-34", **keys})


class Client:
    """A client that keeps what it is told."""

    def __init__(self, ws):
        self.ws, self.number = ws, 0
        self.status, self.serial, self.wholes = {}, None, 0

    async def read(self):
        return json.loads((await asyncio.wait_for(self.ws.receive(), PATIENCE)).data)

    async def ask(self, method, **params):
        """The result or the error of a request; states that come meanwhile are taken."""
        self.number += 1
        await self.ws.send_json({"jsonrpc": "2.0", "id": self.number, "method": method, "params": params})
        while (message := await self.read()).get("id") != self.number:
            self.take(message)
        return message.get("result", message.get("error"))

    def take(self, message):
        equal((message["jsonrpc"], message["method"]), ("2.0", "notify_status_update"))
        status, _time, how = message["params"]
        assert how["full"] or how["serial"] == self.serial + 1, (how, self.serial)
        self.serial, self.wholes = how["serial"], self.wholes + how["full"]
        for device, one in status.items():
            if how["full"] or one is None or one.pop("whole", False):
                self.status[device] = one
                continue
            self.status[device].update({key: one[key] for key in ("connected", "reason") if key in one})
            self.status[device]["values"].update(one.get("values", {}))

    async def subscribe(self, names, rate=20):
        found = await self.ask("objects.subscribe", objects=names, rate=rate)
        self.status, self.serial = found["status"], found["serial"]
        return found

    async def until(self, test):
        while not test(self.status):
            self.take(await self.read())


@contextlib.asynccontextmanager
async def connected(gateway, **options):
    async with aiohttp.ClientSession() as session, session.ws_connect(
            f"http://127.0.0.1:{gateway.port}/websocket", **options) as ws:
        yield Client(ws)


def numbers(answer):
    """Which events it has."""
    return [(one["epoch"], one["number"]) for one in answer["events"]]


def run(work):
    return asyncio.run(asyncio.wait_for(work, 2 * PATIENCE))


class Talker(Client):
    """... that keeps what the console's machine says."""

    def __init__(self, ws):
        super().__init__(ws)
        self.lines = []

    def take(self, message):
        if message["method"] == "console.said":
            self.lines += message["params"]["lines"]
        else:
            super().take(message)

    async def line(self, text, end="ok"):
        """What is said until a line begins so."""
        self.lines.clear()
        equal(await self.ask("console.send", line=text), {})
        while not any(line.startswith(end) for line in self.lines):
            self.take(await self.read())
        return list(self.lines)


def test_the_console():
    async def talk(house, gateway):
        async with connected(gateway) as first, connected(gateway) as second:
            one, other = Talker(first.ws), Talker(second.ws)
            info = await one.ask("console.info")
            equal({"machine": "PoKeys devices", "why": "", "send": False, "device": "mill", "axes": ["X"], "files": False,
                   "halted": "", "message": "", "job": None, "heaters": [],
                   "outputs": [{"word": f"R{i}", "name": f"external.{i:02}.out-fb"} for i in range(8)]}, info)
            equal((await one.ask("console.send", line="M105"))["code"], -32003)
            for client in one, other:
                equal(await client.ask("console.subscribe"), {})
                equal((await client.ask("console.info"))["send"], True)
            for wrong in "G1\nM105", 257 * "x", None, 3, "\x01":
                equal((await one.ask("console.send", line=wrong))["code"], -32602)
            equal(await one.line("M105"), ["ok"])
            assert (await one.line("M114"))[0].startswith("X:0.0000 Count X:0"), one.lines
            assert (await one.line("[ESP500]", "user"))[-1] == "user"
            equal(await one.line("G1 X5 F600"), ["ok"])
            # of a page: for this line only; and what came before a stop is not done after it
            equal(await one.line("$J=G91 G21 X1 F6000"), ["ok"])
            for message in ({"method": "console.send", "params": {"line": "M410\n"}, "id": 7},
                            [{"method": "console.send", "params": {"line": line}, "id": i}
                             for i, line in enumerate(("G1 X9 F600", "M410 now", "G1 X8"))]):
                await other.ws.send_json([{"jsonrpc": "2.0", **request} for request in message] if isinstance(message, list) else
                                         {"jsonrpc": "2.0", **message})
            found = {}
            while len(found) < 4:
                said = await other.read()
                for answer in said if isinstance(said, list) else [said]:
                    if "id" in answer:
                        found[answer["id"]] = answer
                    elif answer["method"] == "console.said":
                        other.lines += answer["params"]["lines"]
            equal(sorted(number for number, answer in found.items() if "error" in answer), [0, 2])
            equal(found[0]["error"]["message"], "it was stopped")
            # a jog, as long as it is asked for; it is counted in pulses how far it goes afterwards
            def place():
                return house.state()["engine"]["axes"][0]["position"]
            await one.line("M400")
            speed, begun = 10.0, await asyncio.to_thread(place)
            for _ in range(20):
                equal(await one.ask("console.jog", axis="x", speed=speed, press=1), {})
                await asyncio.sleep(0.05)
            last = await asyncio.to_thread(place)
            assert last > begun, (begun, last)
            await one.line("M400")
            assert 0 <= await asyncio.to_thread(place) - last <= 0.25 * speed * 200, (last, place())
            # faster than the axis can, and slower by the override: it stands all the same; 100 units/s are its most
            for press, wish, words in (20, 1e6, "M220 S100"), (21, 5.0, "M220 S10"):
                await one.line(words)
                equal(await one.ask("console.jog", axis="x", speed=-wish, press=press), {})
                equal(await one.ask("console.jog", axis="x", speed=-wish, press=press), {})
                last = await asyncio.to_thread(place)
                equal(await one.ask("console.jog", axis="x", speed=0, press=press), {})
                await one.line("M400")
                assert abs(await asyncio.to_thread(place) - last) <= 0.25 * 100 * 200, (wish, last, place())
            await one.line("M220 S0")
            equal((await one.ask("console.jog", axis="x", speed=1, press=23))["message"], "the feed override is 0 %")
            await one.line("M220 S100")
            # nothing is queued behind what somebody else does
            await one.line("G91")
            await one.line("G1 X2 F60")
            equal((await one.ask("console.jog", axis="x", speed=1, press=22))["message"], "something else moves")
            await one.line("M410")
            # moves wait until it has slowed down, and are carried out
            equal(await one.ask("console.jog", axis="x", speed=speed, press=30), {})
            equal(await one.ask("console.jog", axis="x", speed=0, press=30), {})
            equal(await one.line("G1 X0.5 F600"), ["ok"])
            equal(await one.line("M400"), ["ok"])
            # a wish that came before a stop is not done after it, and its press has ended
            way = {"jsonrpc": "2.0", "method": "console.jog", "params": {"axis": "x", "speed": speed, "press": 31}}
            await one.ws.send_json([{**way, "id": 900}, {"method": "console.send", "params": {"line": "M410", "x": 1}, "id": 901}])
            answers = {}
            while len(answers) < 2:
                said = await one.read()
                answers |= {answer["id"]: answer for answer in (said if isinstance(said, list) else [said]) if "id" in answer}
            equal((answers[900]["error"]["message"], answers[901]["result"]), ("it was stopped", {}))
            equal((await one.ask("console.jog", axis="x", speed=speed, press=31))["message"], "this press has ended")
            await one.line("M400")
            # a stop ends the press
            equal(await one.ask("console.jog", axis="x", speed=-speed, press=2), {})
            await one.line("M410")
            equal((await one.ask("console.jog", axis="x", speed=-speed, press=2))["message"], "this press has ended")
            for wrong in ({"axis": "xy", "speed": 1, "press": 3}, {"axis": "x", "speed": "1", "press": 3}, {"axis": "x", "speed": 1}):
                equal((await one.ask("console.jog", **wrong))["code"], -32602)
            assert "no axis Z" in (await one.ask("console.jog", axis="z", speed=1, press=4))["message"]
            # from a client that takes nothing: it is heard all the same
            for _ in range(30):
                await other.ws.send_json({"jsonrpc": "2.0", "id": 1, "method": "objects.query", "params": {"objects": {"mill": None}}})
            await other.ws.send_json({"jsonrpc": "2.0", "id": 2, "method": "console.send", "params": {"line": "M112"}})
            one.lines.clear()
            while not any(line.startswith("[stop by page") for line in one.lines):
                one.take(await one.read())
            while not (await one.ask("console.info"))["halted"]:
                await asyncio.sleep(0.05)
            assert (await one.line("G1 X1", "ok"))[0].startswith("Error:G1: stopped by M112"), one.lines
            await asyncio.to_thread(wait_equal, "the machine off", lambda: house.state()["flags"]["machine_on"], False)
    keys = {"axes": 1, "generator": "external", "axis.0.mode": "position", "axis.0.pulses-per-unit": 200, "axis.0.name": "x",
            "axis.0.max-speed": 20000, "axis.0.max-acceleration": 200000, "axis.0.invert": "off"}
    with machine(more="[machine]\nkind = pokeys\ndevice = mill\n[console]\nlevel = user\n", **keys) as (
            house, _sim, _daemon, gateway):
        run(talk(house, gateway))


def test_the_console_of_a_guest():
    async def talk(gateway):
        async with connected(gateway) as first:
            one = Talker(first.ws)
            equal(await one.ask("console.subscribe"), {})
            equal((await one.ask("console.info"))["send"], False)
            assert "needs level user" in (await one.line("M112", "error: "))[0]
    with machine(more="[machine]\nkind = pokeys\n") as (_house, _sim, _daemon, gateway):
        run(talk(gateway))


def test_what_is_subscribed_comes():
    async def watch(house, sim, gateway):
        async with connected(gateway) as one, connected(gateway) as other:
            info = await one.ask("server.info")
            equal((info["devices"], info["clients"], info["trouble"]), (["mill"], 2, ""))
            equal(await one.ask("objects.list"), {"objects": ["mill"]})
            first = await one.subscribe({"mill": ["pin.03.in", "info.type"]})
            equal(set(first["status"]["mill"]["values"]), {"pin.03.in", "info.type"})
            await other.subscribe({"mill": None})
            for level in (0, 1, 0, 1):
                await asyncio.to_thread(house.ask_sim, sim, "pin", 4, level)
                for client in one, other:
                    await client.until(lambda status: status["mill"]["values"]["pin.03.in"] == bool(level))
            assert len(other.status["mill"]["values"]) > 1500
            query = await one.ask("objects.query", objects={"mill": ["pin.*.in"]})
            equal(len(query["status"]["mill"]["values"]), 55)
            equal(query["status"]["mill"]["values"]["pin.03.in"], True)
            # meanwhile there may be more of them
            events = numbers(await one.ask("events.list", device="mill"))
            equal(numbers(await asyncio.to_thread(gateway.json, "/api/devices/mill/events"))[:len(events)], events)
            # from one on, with it; all, if it is not there
            for i in 0, len(events) // 2, len(events) - 1:
                epoch, number = events[i]
                for since, first in ({"epoch": epoch, "number": number}, i), ({"epoch": epoch + 1, "number": number}, 0):
                    found = numbers(await one.ask("events.list", device="mill", since=since))
                    equal(found[:len(events) - first], events[first:], since)
            equal(await one.ask("objects.unsubscribe"), {})
            await asyncio.to_thread(house.ask_sim, sim, "pin", 4, 0)
            await other.until(lambda status: not status["mill"]["values"]["pin.03.in"])
            serial = one.serial
            await one.ask("server.info")
            equal((one.status["mill"]["values"]["pin.03.in"], one.serial), (True, serial))
    with workshop() as (house, sim, _daemon, gateway):
        run(watch(house, sim, gateway))


def test_a_whole_state_comes_now_and_then():
    async def watch(gateway):
        async with connected(gateway) as one:
            await one.subscribe({"mill": ["info.type"]})
            await one.until(lambda _: one.wholes == 2)
    with workshop() as (_house, _sim, _daemon, gateway):
        run(watch(gateway))


def test_loss_and_return_are_told():
    async def watch(house, sim, daemon, gateway):
        async with connected(gateway) as one:
            await one.subscribe({"mill": ["link-state", "daemon.epoch"]})
            epoch = one.status["mill"]["values"]["daemon.epoch"]
            sim.kill()
            await one.until(lambda status: not status["mill"]["connected"])
            assert "no answer" in one.status["mill"]["reason"] or "old" in one.status["mill"]["reason"], one.status
            await asyncio.to_thread(end, daemon)
            house.start_sim()
            await asyncio.to_thread(house.start_daemon, wait=False)
            await one.until(lambda status: status["mill"] and status["mill"]["connected"])
            assert one.status["mill"]["values"]["daemon.epoch"] != epoch
    with workshop(**{"stale-after-ms": 300, "lost-after-ms": 500}) as (house, sim, daemon, gateway):
        run(watch(house, sim, daemon, gateway))


def test_what_is_wrong_is_answered():
    async def watch(gateway):
        async with connected(gateway) as one:
            for method, params, code, text in (
                    ("frob", {}, -32601, "there is no method frob; there are: server.info, objects.list"),
                    ("server.info", {"x": 1}, -32602, "there is no parameter x; there are none"),
                    ("objects.query", {}, -32602, "objects has to be an object, such as"),
                    ("objects.query", {"objects": {"lathe": None}}, -32001,
                     "there is no device 'lathe'; there are: mill"),
                    ("objects.query", {"objects": {"mill": ["no.such"]}}, -32602, "no value is named 'no.such'"),
                    ("objects.query", {"objects": {"mill": "cycle"}}, -32602, "objects.mill has to be a list of names"),
                    ("objects.subscribe", {"objects": {"mill": None}, "rate": 51}, -32602, "rate has to be 0.1 to 50"),
                    ("objects.subscribe", {"objects": {"mill": None}, "rate": True}, -32602, "rate has to be"),
                    ("objects.subscribe", {"objects": {"mill": ["pin.30.out"]}}, -32602,
                     "no value is named 'pin.30.out'"),
                    ("events.list", {"device": ["mill"]}, -32001, "there is no device"),
                    ("events.list", {"device": "mill", "since": 3}, -32602, "since has to be an event, with epoch"),
                    ("events.list", {"device": "mill", "since": {"epoch": 1, "number": True}}, -32602, "since has to"),
                    ("events.list", {"device": "mill", "since": {"epoch": 1}}, -32602, "since has to be an event")):
                found = await one.ask(method, **params)
                equal((found.get("code"), text in found.get("message", "")), (code, True), (method, params, found))
            for sent, code in (("{", -32700), ("[]", -32600), ("3", -32600), ("[" * 5000, -32700),
                               ('{"jsonrpc": "1.0", "method": "x", "id": 1}', -32600),
                               ('{"jsonrpc": "2.0", "id": 1}', -32600),
                               ('{"jsonrpc": "2.0", "id": NaN, "method": "server.info"}', -32700),
                               ('{"jsonrpc": "2.0", "id": 1e999, "method": "server.info"}', -32600),
                               ('{"jsonrpc": "2.0", "id": true, "method": "server.info"}', -32600)):
                await one.ws.send_str(sent)
                equal((await one.read())["error"]["code"], code, sent[:40])
            # a batch, of which notifications are not answered
            await one.ws.send_json([{"jsonrpc": "2.0", "id": i, "method": "objects.list"} for i in (1, "two")] +
                                   [{"jsonrpc": "2.0", "method": "frob"}])
            equal([answer["id"] for answer in await one.read()], [1, "two"])
            # many at once are answered, each
            for i in range(300):
                await one.ws.send_json({"jsonrpc": "2.0", "id": i, "method": "objects.list"})
            equal([(await one.read())["id"] for _ in range(300)], list(range(300)))
            # one that nobody would see the answer of is no subscription
            await one.ws.send_json({"jsonrpc": "2.0", "method": "objects.subscribe",
                                    "params": {"objects": {"mill": None}}})
            equal((await one.ask("server.info"))["clients"], 1)
            # what is no text ends the connection, and no other
            async with connected(gateway) as other:
                await other.ws.send_bytes(b"\0")
                equal((await other.ws.receive()).data, 1003)
            async with connected(gateway) as other:
                await other.ws.send_str(" " * 70000)
                equal((await other.ws.receive()).data, 1009)
            equal((await one.ask("server.info"))["clients"], 1)
    with workshop() as (house, _sim, _daemon, gateway):
        run(watch(gateway))
        assert "Traceback" not in house.log("gateway.log"), house.log("gateway.log")


def test_a_page_of_another_site_gets_nothing():
    async def watch(gateway):
        for origin, good in (("http://evil.example", False), ("null", False), ("http://[x", False),
                             ("http://localhost:x@evil.example", False), ("http://localhost:8580", False),
                             (f"http://localhost:{gateway.port}", False), (f"https://127.0.0.1:{gateway.port}", True),
                             ("http://127.0.0.1", False), ("file://", False),
                             (f"http://127.0.0.1:{gateway.port}", True)):
            try:
                async with connected(gateway, headers={"Origin": origin}) as one:
                    equal((await one.ask("objects.list"), good), ({"objects": ["mill"]}, True), origin)
            except aiohttp.WSServerHandshakeError as error:
                equal((error.status, good), (403, False), origin)
    with workshop() as (_house, _sim, _daemon, gateway):
        run(watch(gateway))
        # a usual port is left out of both headers, and another one is another site
        for host, origin, status in (
                ("localhost", "http://localhost", 200), ("localhost", "https://localhost", 200),
                ("localhost", "http://localhost:8580", 403), ("localhost", "https://localhost:80", 403),
                ("localhost:80", "http://localhost", 200), ("localhost:81", "http://localhost", 403),
                ("localhost:8580", "http://LOCALHOST:8580", 200),
                ("[::1]", "http://[::1]", 200), ("[::1]", "http://[::1]:81", 403)):
            equal(gateway.ask("/api/devices", Host=host, Origin=origin)[0], status, (host, origin))
        # an image or a script of another site has no origin
        for site, mode, status in (("cross-site", "no-cors", 403), ("cross-site", "navigate", 200),
                                   ("same-origin", "cors", 200), ("none", "navigate", 200)):
            headers = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": mode}
            equal(gateway.ask("/api/devices", **headers)[0], status, headers)


def frame(kind, data):
    """A masked frame of a client."""
    mask = os.urandom(4)
    size = bytes([0x80 | len(data)]) if len(data) < 126 else bytes([0xFE]) + len(data).to_bytes(2, "big")
    return bytes([0x80 | kind]) + size + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(data))


def frozen(gateway):
    """A client that wants everything and reads nothing."""
    client = socket.create_connection(("127.0.0.1", gateway.port))
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    client.sendall(b"GET /websocket HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                   b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n")
    client.sendall(frame(1, json.dumps({"jsonrpc": "2.0", "id": 1, "method": "objects.subscribe",
                                        "params": {"objects": {"mill": None}, "rate": 50}}).encode()))
    return client


def test_who_reads_nothing_is_closed_and_harms_nobody():
    async def watch(gateway):
        # one of them asks for more than there is room for; the last says good-bye, and does not read the answer
        clients = [frozen(gateway) for _ in range(4)]
        for _ in range(300):
            clients[0].sendall(frame(1, b'{"jsonrpc":"2.0","id":1,"method":"events.list","params":{"device":"mill"}}'))
        async with connected(gateway) as one:
            while (await one.ask("server.info"))["clients"] < 5:
                pass
            await one.subscribe({"mill": None}, rate=50)
            # until all of them have taken what they can
            while await asyncio.to_thread(gateway.own, "skipped_total") < 400:
                one.take(await one.read())
            clients[-1].sendall(frame(8, b"\x03\xe8"))
            # it lives on, while the other ones' states are skipped, until those are closed
            while (await one.ask("server.info"))["clients"] > 1:
                one.take(await one.read())
            equal(one.wholes > 0, True)
        await asyncio.to_thread(wait_equal, "those that are there", lambda: gateway.own("connections"), 1)
        # the last has said good-bye; whether what it did not read was in the kernel, or waited here, is chance
        assert gateway.own("closed_total") in (3, 4), gateway.own("closed_total")
        for client in clients[:-1]:
            # though it has not read what came before
            equal(client.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR), errno.ECONNRESET)
            client.close()
        clients[-1].close()
        async with connected(gateway, compress=15) as one:
            await one.subscribe({"mill": ["cycle"]})
            equal((one.ws.compress, await one.until(lambda _: one.serial > 1)), (0, None))
    with workshop() as (house, _sim, _daemon, gateway):
        run(watch(gateway))
        assert "a client that read nothing for 10 s was closed" in house.log("gateway.log"), house.log("gateway.log")
        equal((gateway.own("clients"), gateway.own("feeds")), (0, 0))


def test_a_long_batch_is_cut():
    async def watch(gateway):
        async with connected(gateway, max_msg_size=0) as one:
            await one.ws.send_json([{"jsonrpc": "2.0", "id": i, "method": "objects.query",
                                     "params": {"objects": {"mill": None}}} for i in range(16)])
            text = (await asyncio.wait_for(one.ws.receive(), PATIENCE)).data
            answers = json.loads(text)
            equal([answer["id"] for answer in answers], list(range(16)))
            good = [answer for answer in answers if "result" in answer]
            size = len(json.dumps(good[0], separators=(",", ":")))
            # as many as are needed to be above the limit
            assert 0 <= len(good) - (256 << 10) // size <= 2 and len(good) < 16, (len(good), size)
            assert all(answer["error"]["code"] == -32002 for answer in answers[len(good):]), answers[len(good):]
            await one.ws.send_json([{"jsonrpc": "2.0", "id": 1, "method": "objects.query",
                                     "params": {"objects": {"mill": None}}}] * 15 +
                                   [{"jsonrpc": "2.0", "method": "objects.list"}])
            equal(len(json.loads((await asyncio.wait_for(one.ws.receive(), PATIENCE)).data)), 15, "a notification")
    with workshop() as (_house, _sim, _daemon, gateway):
        run(watch(gateway))


def test_diagnostics_are_given_to_who_names_them():
    async def watch(gateway):
        async with connected(gateway) as one:
            query = (await one.ask("objects.query", objects={"mill": ["latency.wakeup-*", "cycle"]}))["status"]
            values = query["mill"]["values"]
            assert {"latency.wakeup-p50-us", "latency.wakeup-p99-us", "cycle"} <= set(values), values
            theirs = await asyncio.to_thread(gateway.json, "/api/devices/mill/diagnostics")
            assert set(values) - {"cycle"} <= set(theirs["values"]), theirs
            await one.subscribe({"mill": ["latency.wakeup-count"]})
            count = one.status["mill"]["values"]["latency.wakeup-count"]
            await one.until(lambda status: status["mill"]["values"]["latency.wakeup-count"] > count)
    with workshop() as (_house, _sim, _daemon, gateway):
        run(watch(gateway))


def test_the_end_is_said_to_clients():
    async def watch(house, gateway):
        async with connected(gateway) as one:
            await one.subscribe({"mill": None}, rate=50)
            gateway.child.send_signal(signal.SIGTERM)
            message = None
            while not message or message.type is aiohttp.WSMsgType.TEXT:
                # a ping that comes just before the end cannot be answered any more
                with contextlib.suppress(ConnectionResetError):
                    message = await asyncio.wait_for(one.ws.receive(), PATIENCE)
            equal((message.type, message.data), (aiohttp.WSMsgType.CLOSE, 1001))
        equal(await asyncio.to_thread(gateway.child.wait, PATIENCE), 0)
        assert "Traceback" not in house.log("gateway.log"), house.log("gateway.log")
    with workshop() as (house, _sim, _daemon, gateway):
        run(watch(house, gateway))


def test_clients_come_and_go():
    async def watch(gateway):
        for _ in range(30):
            async with connected(gateway) as one:
                await one.subscribe({"mill": ["cycle"]}, rate=50)
                await one.until(lambda _: one.serial > 1)
    with workshop() as (_house, _sim, _daemon, gateway):
        run(watch(gateway))
        wait_equal("the number of clients", lambda: gateway.own("clients"), 0)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
