#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC operated through pokeys-gateway and pokeys-remote, by a client in the network (python3-websockets)."""
import asyncio
import base64
import inspect
import json
import os
import pathlib
import signal
import subprocess
import sys

import rig
from linuxcncrig import LinuxCNC, position, stands, switch_on
from rig import halcmd, wait

PORT, TELNET = 8580, 2323
BUILD = pathlib.Path(sys.argv[2]).resolve().parents[1]
PROGRAM = rig.ROOT / "gateway/pokeys-gateway"
ENVIRONMENT = {**os.environ, "PYTHONPATH": f"{rig.ROOT}/gateway:{rig.ROOT}/python",
               "POKEYS_GATEWAY_WEB": str(BUILD / "gateway/web"), "POKEYSCTL": str(BUILD / "tools/pokeysctl"), "POKEYS_SHM_LIBRARY": str(BUILD / "shm/libpokeys_shm.so.0")}
NOT_ALLOWED, NOT_DONE = -32003, -32004


class Gateway:
    """A gateway with a guest and a user."""

    def __init__(self, machine, operate="yes"):
        folder = machine.folder
        self.log = folder / "gateway.log"
        conf = folder / "gateway.conf"
        conf.write_text(f"[http]\nlisten = 127.0.0.1:{PORT}\n[access]\nusers = {folder}/users\n[linuxcnc]\n"
                        f"operate = {operate}\n" + "hotend = 1\n" * (operate == "yes") +
                        f"[gateway]\nruntime-directory = {folder}/run\n[machine]\nkind = pokeys\n"
                        f"[telnet]\nlisten = 127.0.0.1:{TELNET}\n[console]\nlevel = user\n", encoding="utf-8")
        words = ["/usr/bin/python3", "-B", PROGRAM, "--config", conf]
        for name, level in (("gus", "guest"), ("ulla", "user")):
            # the file has to be there if the configuration names it
            (folder / "users").touch(mode=0o600)
            subprocess.run([*words, "--set-user", name, "--level", level], input="secret, and long\n", text=True,
                           capture_output=True, check=True, env=ENVIRONMENT)
        with open(self.log, "wb") as log:
            self.child = subprocess.Popen(words, stdout=log, stderr=log, stdin=subprocess.DEVNULL, env=ENVIRONMENT)
        wait("the gateway", lambda: "the page is at" in self.said() or self.child.poll() is not None)

    def said(self):
        return self.log.read_text(encoding="utf-8")

    def close(self):
        self.child.terminate()
        self.child.wait(rig.PATIENCE)
        assert "Traceback" not in self.said(), self.said()


class Client:
    """A client over the WebSocket, which judges what comes by the gateway's own schema."""

    def __init__(self, ws, judge):
        self.ws, self.judge, self.number, self.state, self.done = ws, judge, 0, {}, {}

    async def hear(self):
        message = json.loads(await asyncio.wait_for(self.ws.recv(), rig.PATIENCE))
        faults = [error.message for error in self.judge.iter_errors(message)]
        assert not faults, (message, faults)
        if message.get("method") == "linuxcnc.done":
            self.done[message["params"]["id"]] = message["params"]["error"]
        elif message.get("method") == "linuxcnc.state":
            if "connected" in message["params"]:
                self.state = {}
            self.state.update(message["params"])
        return message

    async def ask(self, method, **params):
        """The result, or the error's code and text."""
        self.number += 1
        await self.ws.send(json.dumps({"jsonrpc": "2.0", "id": self.number, "method": method, "params": params}))
        while (message := await self.hear()).get("id") != self.number:
            pass
        return message["result"] if "result" in message else (message["error"]["code"], message["error"]["message"])

    async def do(self, method, **params):
        """Until LinuxCNC has said what it made of it."""
        taken = await self.ask(f"linuxcnc.{method}", **params)
        assert taken == {}, taken
        number = self.number
        while number not in self.done:
            await self.hear()
        return self.done[number]

    async def until(self, test):
        while not test(self.state):
            await self.hear()

    async def hold(self, axis, speed, press, until):
        while not until():
            fault = await self.do("jog", axis=axis, speed=speed, press=press)
            if fault:
                assert fault == "this press has ended", fault
                press += 1000


def connect(name, **place):
    import websockets
    secret = base64.b64encode(f"{name}:secret, and long".encode()).decode()
    # websockets 14 renamed extra_headers to additional_headers
    headers = next(key for key in inspect.signature(websockets.connect).parameters if key.endswith("_headers"))
    return websockets.connect(f"ws://127.0.0.1:{PORT}/websocket", **{headers: {"Authorization": f"Basic {secret}"}},
                              **place)


def schema():
    import urllib.request

    import jsonschema
    asked = urllib.request.Request(f"http://127.0.0.1:{PORT}/api/schema.json", headers={
        "Authorization": "Basic " + base64.b64encode(b"gus:secret, and long").decode()})
    with urllib.request.urlopen(asked, timeout=rig.PATIENCE) as answer:
        document = json.load(answer)
    return jsonschema.Draft202012Validator(document)


async def operates(machine):
    judge = await asyncio.to_thread(schema)
    async with connect("gus") as ws:
        guest = Client(ws, judge)
        assert (await guest.ask("server.info"))["operate"] is False
        for method in ("emergency_stop", "linuxcnc.stop", "linuxcnc.subscribe"):
            code, text = await guest.ask(method)
            assert code == NOT_ALLOWED and "level is user or admin" in text, text
    async with connect("ulla") as ws:
        one = Client(ws, judge)
        assert (await one.ask("server.info"))["operate"] is True
        found = await one.ask("linuxcnc.subscribe")
        assert found == {}, found
        await one.until(lambda seen: seen.get("task") == "estop" and seen["connected"])
        assert await one.do("mdi", line="G0 X1") == "the machine is not on"
        code, text = await one.ask("linuxcnc.mdi", line="G0\nX1")
        assert code == NOT_DONE and "one line of G-code" in text
        assert (await one.ask("linuxcnc.mdi", line="x" * 5000))[1] == "the request is too long"
        assert "needs exactly these parameters" in (await one.ask("linuxcnc.mdi"))[1]
        screen = machine.control()
        screen.asked("subscribe")
        await asyncio.to_thread(switch_on, screen)
        await one.until(lambda seen: seen["task"] == "on")
        assert await one.do("home", joint=-1) is None
        await one.until(lambda seen: all(seen["homed"]) and seen["motion"] == "axes")
        await one.hold("x", 20, 1, lambda: position(0) > 2)
        there = position(0)
    # its WebSocket has ended
    assert await asyncio.to_thread(stands, 0) < there + 20
    async with connect("ulla") as ws:
        one = Client(ws, judge)
        found = await one.ask("linuxcnc.subscribe")
        assert found == {}, found
        assert await one.do("mode", mode="mdi") is None
        assert await one.do("mdi", line="G1 X90 F300") is None
        begun = position(0)
        await asyncio.to_thread(wait, "it moves", lambda: position(0) > begun + 0.5)
        assert await one.ask("linuxcnc.stop") == {}
        assert await asyncio.to_thread(stands, 0) < 80
        # pokeys-remote hangs, ends, and comes again
        proxy = rig.listed()["pokeys-remote"]
        os.kill(proxy, signal.SIGSTOP)
        there = position(0)
        # nothing else waits for it
        await one.ws.send(json.dumps({"jsonrpc": "2.0", "id": "mdi", "method": "linuxcnc.mdi", "params": {"line": "G1 X0"}}))
        assert (await one.ask("server.info"))["operate"] is True
        while (answer := await one.hear()).get("id") != "mdi":
            pass
        assert answer["error"] == {"code": NOT_DONE, "message": "pokeys-remote does not answer"}, answer
        await one.until(lambda seen: not seen["connected"])
        assert one.state == {"connected": False, "why": "pokeys-remote does not answer"}
        os.kill(proxy, signal.SIGCONT)
        assert await asyncio.to_thread(stands, 0) == there
        # what it sees comes back by itself
        await one.until(lambda seen: seen["connected"])
        os.kill(rig.listed()["pokeys-remote"], signal.SIGKILL)
        await one.until(lambda seen: seen.get("connected") is False)
        await one.until(lambda seen: seen.get("task") == "on")
        assert await one.ask("emergency_stop") == {}
        await one.until(lambda seen: seen["task"] == "estop")


class Relay:
    """A network between a client and the gateway, which can be slow in one direction."""

    def __init__(self):
        self.passes = asyncio.Event()
        self.passes.set()

    async def __aenter__(self):
        self.server = await asyncio.start_server(self.serve, "127.0.0.1", PORT + 1)
        return self

    async def __aexit__(self, *_):
        self.server.close()

    async def serve(self, reader, writer):
        there, to = await asyncio.open_connection("127.0.0.1", PORT)

        async def carry(source, target, gate):
            while data := await source.read(65536):
                if gate:
                    await self.passes.wait()
                target.write(data)
            target.close()
        await asyncio.gather(carry(reader, to, True), carry(there, writer, False))


async def does_not_obey_what_is_old(machine):
    """What a network holds back for a while comes when nobody expects it any more."""
    judge = await asyncio.to_thread(schema)
    async with Relay() as relay, connect("ulla", host="127.0.0.1", port=PORT + 1) as ws, connect("ulla") as near:
        one, two = Client(ws, judge), Client(near, judge)
        found = await one.ask("linuxcnc.subscribe")
        assert found == {}, found
        screen = machine.control()
        screen.asked("subscribe")
        await asyncio.to_thread(switch_on, screen)
        await one.until(lambda seen: seen.get("task") == "on")
        assert await one.do("mode", mode="mdi") is None
        begun = await asyncio.to_thread(stands, 0)

        async def held_back(*requests):
            """What is answered to requests that the network delivers late."""
            relay.passes.clear()
            await asyncio.sleep(0.5)
            for number, (method, params) in enumerate(requests):
                await one.ws.send(json.dumps({"jsonrpc": "2.0", "id": f"old{number}", "method": f"linuxcnc.{method}",
                                              "params": params}))
            await asyncio.sleep(2)
            relay.passes.set()
            answers = {}
            while len(answers) < len(requests):
                if str((answer := await one.hear()).get("id")).startswith("old"):
                    answers[answer["id"]] = answer.get("error", {}).get("message")
            return [answers[f"old{number}"] for number in range(len(requests))]
        old = "this may have been on its way for more than 1.5 s; send it again"
        assert await held_back(("mdi", {"line": "G1 X90 F3000"}), ("override", {"what": "feed", "value": 1}),
                               ("subscribe", {})) == [old, old, None]
        # a stop is never too old, and overtakes what was sent just before it
        first, second = await held_back(("mdi", {"line": "G1 X90 F3000"}), ("stop", {}))
        assert first in (old, "it was stopped") and second is None
        assert await asyncio.to_thread(stands, 0) == begun
        # and after that, it is obeyed as before
        await asyncio.to_thread(wait, "it is new again", lambda: True)
        while (fault := await one.ask("linuxcnc.mdi", line="G1 X5 F3000")) != {}:
            assert "send it again" in fault[1], fault
            await asyncio.sleep(0.1)
        await one.until(lambda seen: seen["position"]["x"] == 5)
        # a stop ends what is before it in a batch, and nothing behind it
        batch = [{"jsonrpc": "2.0", "id": f"b{number}", "method": f"linuxcnc.{method}", "params": params}
                 for number, (method, params) in enumerate((("mdi", {"line": "G1 X90 F3000"}), ("stop", {}),
                                                            ("mode", {"mode": "manual"})))]
        await one.ws.send(json.dumps(batch))
        while not isinstance(answer := json.loads(await one.ws.recv()), list):
            pass
        assert [each.get("error", {}).get("message") for each in answer] == ["it was stopped", None, None], answer
        await two.ask("linuxcnc.subscribe")
        await two.until(lambda seen: seen.get("mode") == "manual")
        assert await asyncio.to_thread(stands, 0) == 5


async def obeys_g_code(_machine):
    """Of a program at the console."""
    reader, writer = await asyncio.open_connection("127.0.0.1", TELNET)

    async def ask(line):
        writer.write(line.encode() + b"\n")
        said = []
        while not said or not said[-1].startswith("ok"):
            said.append((await asyncio.wait_for(reader.readline(), rig.PATIENCE)).decode().rstrip())
        return [one for one in said if not one.startswith("echo:")]     # busy, and what LinuxCNC says
    assert await ask("G0 X12") == ["ok"] and await ask("M400") == ["ok"]
    assert position(0) == 12, position(0)
    assert (await ask("M114"))[0].startswith("X:12.0000 Y:"), await ask("M114")
    # moves wait for each other, and are where they should be in the end
    for i in range(5):
        assert await ask(f"G1 X{12 + i} F3000 (move {i})") == ["ok"]
    assert await ask("M400") == ["ok"] and position(0) == 16
    # what LinuxCNC says of a line is in its answer
    said = await ask("G1 X1 Q5")
    assert any(line.startswith("Error:G1: LinuxCNC refuses it: ") and "q" in line.lower() for line in said), said
    assert await ask("M104 S200") == ["ok"]
    await asyncio.to_thread(wait, "the target", lambda: float(halcmd("getp", "motion.analog-out-01")) == 200)
    assert await ask("M220 S50") == ["ok"]
    while await ask("M220") != ["FR:50%", "ok"]:
        await asyncio.sleep(0.05)
    assert await ask("M220 S100") == ["ok"]
    said = await ask("M24")
    assert said[-2:] == ["Error:M24: no programme is loaded", "ok"], said
    # the mode is auto now
    said = await ask("G1 X90 F300")
    assert said == ["ok"], said
    begun = position(0)
    await asyncio.to_thread(wait, "it moves", lambda: position(0) > begun + 0.5)
    said = await ask("M410")
    assert said[0].startswith("[stop by telnet") and await asyncio.to_thread(stands, 0) < 80, said
    writer.close()


async def refuses(_machine):
    """Nobody operates unless it is configured."""
    async with connect("ulla") as ws:
        one = Client(ws, await asyncio.to_thread(schema))
        assert (await one.ask("server.info"))["operate"] is False
        code, text = await one.ask("linuxcnc.stop")
        assert code == NOT_ALLOWED and "[linuxcnc] operate = no" in text


def one_machine(machine):
    """All of it with one LinuxCNC, whose start takes longest."""
    for operate, tests in (("yes", (operates, does_not_obey_what_is_old, obeys_g_code)), ("no", (refuses,))):
        gateway = Gateway(machine, operate)
        try:
            for test in tests:
                asyncio.run(test(machine))
                print(f"ok: {test.__name__}")
        finally:
            gateway.close()


if __name__ == "__main__":
    ran = subprocess.run(["/usr/bin/python3", "-c", "import aiohttp, prometheus_client, websockets, jsonschema"],
                         capture_output=True, text=True, check=False)
    if ran.returncode:
        print(f"skipped: {ran.stderr.strip().splitlines()[-1]} (Debian: python3-aiohttp, python3-prometheus-client, "
              "python3-websockets, python3-jsonschema)")
        sys.exit(77)
    rig.main([one_machine], LinuxCNC)
