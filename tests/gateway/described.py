#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""What is served is what /api/openapi.json and /api/schema.json say, and nothing that they do not say. The client is
python3-websockets', the judge python3-jsonschema."""
import asyncio
import json
import sys

from rig import PATIENCE, ROOT, Skip, machine
from house import equal, main, wait_for  # noqa: E402  (rig.py finds it)

try:
    import jsonschema
    import websockets
except ImportError as missing:
    LACKING = f"{missing} (Debian: python3-jsonschema, python3-websockets)"
else:
    LACKING = ""

OPERATING = (
    ("emergency_stop", True, {}), ("linuxcnc.stop", True, {}), ("linuxcnc.subscribe", True, {}),
    ("linuxcnc.mode", True, {"mode": "mdi"}), ("linuxcnc.mode", False, {"mode": "x"}),
    ("linuxcnc.mdi", True, {"line": "G0 X1"}), ("linuxcnc.mdi", False, {}), ("linuxcnc.run", True, {}),
    ("linuxcnc.pause", True, {}), ("linuxcnc.resume", True, {}), ("linuxcnc.home", True, {"joint": -1}),
    ("linuxcnc.override", True, {"what": "feed", "value": 0.5}), ("linuxcnc.override", False, {"what": "x", "value": 1}),
    ("linuxcnc.jog", True, {"axis": "x", "speed": -2.5, "press": 1}), ("linuxcnc.jog", False, {"axis": "x", "speed": 1}))
ERRORS = "#/components/schemas/Error"


def strict(schema):
    """The same, but an object may have no keys that it does not name."""
    if isinstance(schema, list):
        return [strict(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    found = {key: strict(value) for key, value in schema.items()}
    if isinstance(schema.get("properties"), dict) and schema.get("type") == "object":
        found.setdefault("additionalProperties", False)
    return found


def judge(document, schema):
    """A validator of a part of a document, with the document's references."""
    judging = jsonschema.Draft202012Validator
    judging.check_schema(schema)
    return judging(strict(schema), resolver=jsonschema.RefResolver("", strict(document)))


def references(document):
    """All references of a document."""
    if isinstance(document, dict):
        mine = {document["$ref"]} if isinstance(document.get("$ref"), str) else set()
        return mine.union(*map(references, document.values()))
    return set().union(*map(references, document)) if isinstance(document, list) else set()


def filled(path, device):
    """A path with the name of a device, or of a record, which is there if the device is mill."""
    name = "pokeysd-20300101T000000Z-late.pcapng" if device == "mill" else "other"
    return path.replace("{device}", device).replace("{name}", name)


def workshop():
    """A device that moves."""
    if LACKING:
        raise Skip(LACKING)
    return machine("--preset", "demo", **{"digital-inputs": "4,9", "axes": 2})


def test_http_is_as_openapi_says():
    with workshop() as (house, _sim, _daemon, gateway):
        (house.folder / "records/pokeysd-20300101T000000Z-late.pcapng").write_bytes(b"a record")
        document = gateway.json("/api/openapi.json")
        equal(document["openapi"], "3.1.0")
        for reference in references(document):
            jsonschema.RefResolver("", document).resolve(reference)
        # what aiohttp itself says that there is
        from pokeys_gateway.access import Access
        from pokeys_gateway.config import Config
        from pokeys_gateway.console.console import Console
        from pokeys_gateway.doors.http import Http
        from pokeys_gateway.hub import Hub
        from pokeys_gateway.model import load
        hub, access = Hub(Config(), load()), Access({}, False)
        routes = Http(hub, access, Console(access, hub)).application().router.routes()
        served = {(route.resource.canonical, route.method.lower()) for route in routes if route.method != "HEAD"}
        equal(served, {(path, method) for path, item in document["paths"].items() for method in item})
        for path, item in document["paths"].items():
            if "get" not in item:
                continue        # users.py tries most of them
            responses = item["get"]["responses"]
            for device in ("mill", "lathe") if "{" in path else ("",):
                status, headers, body = gateway.ask(filled(path, device))
                kind = headers["Content-Type"].split(";")[0]
                content = responses[str(status)]["content"]
                assert kind in content, (path, status, kind)
                equal(status, {"lathe": 404}.get(device, 400 if path == "/websocket" else 200), path)
                if kind == "application/json":
                    problems = list(judge(document, content[kind]["schema"]).iter_errors(json.loads(body)))
                    equal(problems, [], path)
            status, _headers, body = gateway.ask(filled(path, "mill"), Host="evil.example")
            equal((status, "403" in responses), (403, True), path)
            judge(document, {"$ref": ERRORS}).validate(json.loads(body))
        for path in ("/api/doctor",):
            status, _headers, body = gateway.ask(path, "POST")
            schema = document["paths"][path]["post"]["responses"][str(status)]["content"]["application/json"]["schema"]
            equal((status, list(judge(document, schema).iter_errors(json.loads(body)))), (200, []))
        # it would see one that is wrong
        wrong = gateway.json("/api/devices/mill")
        wrong["values"]["pin.03.in"] = 3
        wrong["more"] = 1
        equal(len(list(judge(document, {"$ref": "#/components/schemas/Device"}).iter_errors(wrong))), 2)


class Client:
    """A client that judges every message, in both directions."""

    def __init__(self, ws, document):
        self.ws, self.number, self.updates = ws, 0, []
        self.document = document
        self.sent = judge(document, document)
        # as it is published
        self.asked = jsonschema.Draft202012Validator({**document, "anyOf": [{"$ref": "#/$defs/request"}]})

    async def read(self):
        message = json.loads(await asyncio.wait_for(self.ws.recv(), PATIENCE))
        equal([error.message[:200] for error in self.sent.iter_errors(message)], [])
        return message

    async def ask(self, method, good=True, valid=None, **params):
        """A request that is as the document says, unless ``valid`` or ``good`` says otherwise; what is good gets a result."""
        for _ in range(100):
            self.number += 1
            request = {"jsonrpc": "2.0", "id": self.number, "method": method, "params": params}
            equal(self.asked.is_valid(request), good if valid is None else valid, request)
            await self.ws.send(json.dumps(request))
            while (message := await self.read()).get("id") != self.number:
                self.updates.append(message)
            # while something is judged, on a busy computer, no ping is answered, and the next one comes after 0.4 s
            if "send it again" not in message.get("error", {}).get("message", ""):
                break
            await asyncio.sleep(0.1)
        equal("result" in message, good, message)
        if good:
            judge(self.document, {"$ref": f"#/$defs/{method}.result"}).validate(message["result"])
        return message


def test_messages_are_as_the_schema_says():
    async def watch(house, sim, gateway):
        document = await asyncio.to_thread(gateway.json, "/api/schema.json")
        for reference in references(document):
            jsonschema.RefResolver("", document).resolve(reference)
        tried = set()
        async with websockets.connect(f"ws://127.0.0.1:{gateway.port}/websocket", max_size=None) as ws:
            client = Client(ws, document)
            for method, good, params in (
                    ("server.info", True, {}), ("objects.list", True, {}),
                    ("objects.query", True, {"objects": {"mill": None}}),
                    ("objects.query", True, {"objects": {"mill": ["latency.*", "cycle"]}}),
                    ("objects.query", False, {"objects": {}}), ("objects.query", False, {"objects": {"mill": "cycle"}}),
                    ("events.list", True, {"device": "mill"}),
                    ("events.list", True, {"device": "mill", "since": {"epoch": 1, "number": 2}}),
                    ("events.list", False, {"device": "mill", "since": {"epoch": 1}}), ("events.list", False, {"device": 3}),
                    ("console.info", True, {}), ("console.send", False, {}),
                    ("console.subscribe", True, {}), ("console.send", True, {"line": "M105"}), ("files.begin", False, {}),
                    ("console.jog", False, {"axis": "x"}), ("console.jog", True, {"axis": "x", "speed": 0, "press": 1}),
                    ("files.write", False, {}), ("files.finish", False, {"name": "x"}),
                    ("console.send", False, {"line": 3}),
                    # last: on a busy computer, judging all that comes takes so long that a jog would be too old
                    ("objects.subscribe", False, {"objects": {"mill": None}, "rate": 51}),
                    ("objects.subscribe", False, {"objects": {"mill": None}, "how": 1}),
                    ("objects.unsubscribe", True, {}),
                    ("objects.subscribe", True, {"objects": {"mill": None}, "rate": 2}),
                    ("objects.subscribe", True, {"objects": {"mill": ["pin.03.in"]}, "rate": 30})):
                await client.ask(method, good, **params)
                tried.add(method)
            # without LinuxCNC; the rest is in tests/remote/gateway.py
            for method, valid, params in OPERATING:
                equal((await client.ask(method, False, valid, **params))["error"]["code"], -32003)
                tried.add(method)
            equal({f"{name}.{part}" for name in tried for part in ("params", "result")} <= set(document["$defs"]), True)
            equal({name.removesuffix(".params") for name in document["$defs"] if name.endswith(".params")}, tried)
            unknown = (await client.ask("frob", False))["error"]["message"]
            equal(set(unknown.partition("there are: ")[2].split(", ")), tried)
            # differences, and a whole state
            client.updates.clear()
            for level in (0, 1, 0):
                await asyncio.to_thread(house.ask_sim, sim, "pin", 4, level)
                while not any(values.get("pin.03.in") == bool(level) for update in client.updates
                              for values in [(update["params"][0].get("mill") or {}).get("values", {})]):
                    client.updates.append(await client.read())
                client.updates.clear()
            while not (await client.read())["params"][2]["full"]:
                pass
            # a batch, and what is no request
            await ws.send(json.dumps([{"jsonrpc": "2.0", "id": "a", "method": "objects.list"}, 3]))
            equal([answer.get("id") for answer in await client.read()], ["a", None])
            equal(client.sent.is_valid({"jsonrpc": "2.0"}), False)
            for wrong in ({"method": "objects.query"}, {"method": "events.list"}, {"method": "objects.subscribe",
                          "params": {"objects": {"mill": None}}}):
                equal(client.asked.is_valid({"jsonrpc": "2.0", **wrong}), False, wrong)
            # the device is lost, and comes back
            await client.ask("objects.subscribe", objects={"mill": ["link-state"]}, rate=10)
            client.updates.clear()
            sim.kill()
            while not any((update["params"][0].get("mill") or {}).get("connected") is False
                          for update in client.updates):
                client.updates.append(await client.read())
    with workshop() as (house, sim, _daemon, gateway):
        asyncio.run(asyncio.wait_for(watch(house, sim, gateway), 2 * PATIENCE))


def test_the_example_of_the_documentation_runs():
    with workshop() as (house, sim, _daemon, gateway):
        text = (ROOT / "docs/gateway.md").read_text(encoding="utf-8")
        example = next(part.partition("```")[0] for part in text.split("```python\n")[1:] if "websockets" in part)
        (path := house.folder / "example.py").write_text(example.replace(":8580", f":{gateway.port}"), encoding="utf-8")
        child = house.spawn("python", "-Bu", path, log="example.log")
        log = lambda: house.log("example.log")  # noqa: E731
        wait_for("the first state", lambda: "{'mill':" in log(), say=log)
        for level in (0, 1, 0, 1):
            before = len(log())
            house.ask_sim(sim, "pin", 4, level)
            wait_for("the input", lambda: f"'pin.03.in': {bool(level)}" in log()[before:], say=log)
        equal(child.poll(), None)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
