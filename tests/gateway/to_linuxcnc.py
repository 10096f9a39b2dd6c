#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""G-code of the console for LinuxCNC, with a pokeys-remote that plays it. A real LinuxCNC is in tests/remote/gateway.py."""
import asyncio
import json

import gcode
from gcode import Shop, State, heater, show
from operators import Fake, until


class LinuxCnc(Fake):
    """... which does what it is asked for, at once or when it may."""

    def __init__(self):
        super().__init__()
        self.values = {"connected": True, "task": "on", "mode": "manual", "interpreter": "idle", "paused": False, "file": "",
                       "line": 0, "moving": False, "position": {"x": 1.0, "y": -2.5}, "feed_override": 1.0}
        self.done, self.faults, self.watcher, self.really = [], {}, None, "mdi"
        self.free = asyncio.Event()
        self.free.set()

    async def serve(self, reader, writer):
        self.writers.append(writer)
        while line := await reader.readline():
            one = json.loads(line)
            method, params = one["method"].partition(".")[2], one["params"]
            self.send({"id": one["id"], "result": True}, writer)
            if method == "subscribe":
                self.watcher = writer
                self.set()
            elif method not in ("stop", "emergency_stop"):
                self.done.append((method, *params.values()))
                await self.free.wait()
                fault = self.faults.get(params.get("line"))
                if fault:
                    self.send({"method": "linuxcnc.said", "params": {"kind": "error", "text": fault}}, self.watcher)
                error = fault and "LinuxCNC refuses it; its message says why"
                if method == "mode":
                    self.really = params["mode"]
                    self.set(mode=params["mode"])
                elif method == "mdi" and self.really != "mdi":
                    error = "the mode is not MDI"
                self.send({"method": "linuxcnc.done", "params": {"id": one["id"], "error": error}}, writer)

    def set(self, **values):
        self.values |= values
        self.send({"method": "linuxcnc.state", "params": self.values}, self.watcher)


def shop_of(fake, **settings):
    return Shop(proxy=fake.name, machine_kind="pokeys", **settings)


async def asked(shop, one, *lines):
    """What is said until all are answered."""
    shop.table.send(one, b"".join(line.encode() + b"\n" for line in lines))
    await until(f"the answers to {lines}", lambda: not one.pending)
    return shop.table.take(one).decode().splitlines()


async def lines_are_mdi():
    async with LinuxCnc() as fake:
        shop = shop_of(fake)
        one, other = shop.table.client(), shop.table.client("b")
        said = await asked(shop, one, "G0 X1", "g1 y2f100 (there)", "x3")
        assert said == 3 * ["ok"], said
        assert fake.done[:2] == [("mode", "mdi"), ("mdi", "G0 X1")], fake.done
        assert ("mdi", "x3") in fake.done
        # what LinuxCNC says about a line goes to its client's answer, and what came with it is not carried out
        fake.done.clear()
        said = await asked(shop, one, "M104", "G0 X9")
        assert said[0] == "Error:M104: needs S with a temperature in degrees C" and len(said) == 4, said
        fake.faults["M199"] = "Unknown m code used: M199"
        said = await asked(shop, one, "M199", "G0 X9")
        assert "Error:M199: LinuxCNC refuses it: Unknown m code used: M199" in said and said[-1] == "ok", said
        assert "echo:LinuxCNC: Unknown m code used: M199" in shop.table.take(other).decode().splitlines()
        assert fake.done == [("mdi", "M199")], fake.done
        assert await asked(shop, one, "M114", "M27") == ["X:1.0000 Y:-2.5000", "ok", "Not SD printing", "ok"]
        assert await asked(shop, one, "M117 a (b)") == ["ok"] and fake.done[-1] == ("mdi", "(MSG, a  b )")
        for line, why in (("M23 a.ngc", "LinuxCNC has its own files"), ("M84", "LinuxCNC moves the machine"),
                          ("$J=X1 F1", "LinuxCNC moves the machine")):
            assert any(why in text for text in await asked(shop, one, line)), line
        shop.machine._linuxcnc.close()


async def a_line_waits_for_the_one_before_it():
    async with LinuxCnc() as fake:
        shop = shop_of(fake)
        one, other = shop.table.client(), shop.table.client("b")
        assert await asked(shop, one, "G0 X1") == ["ok"]
        fake.set(interpreter="waiting", moving=True)
        await until("it is seen", lambda: shop.machine._linuxcnc._state["moving"])
        shop.table.send(one, b"G0 X2\n")
        shop.table.send(other, b"M400\n")
        await asyncio.sleep(0.3)
        assert one.pending and other.pending and ("mdi", "G0 X2") not in fake.done
        # what asks is answered meanwhile, and a pause goes past it
        assert await asked(shop, shop.table.client("c"), "M114") == ["X:1.0000 Y:-2.5000", "ok"]
        shop.table.send(one, b"M25\n")
        await until("the pause", lambda: fake.done[-1] == ("pause",))
        fake.set(interpreter="idle")
        await until("the next line", lambda: fake.done[-1] == ("mdi", "G0 X2"))
        assert other.pending, "it still moves"
        fake.set(moving=False)
        await until("all", lambda: not one.pending and not other.pending)
        # a program's end is a line, and the deletion of a file is not
        shop.table.take(one)
        said = await asked(shop, one, "M30", "M30 a.gcode")
        assert said == [
            "ok", "Error:M30: LinuxCNC has its own files; load one on its screen, and M24 runs it", "ok"], said
        assert fake.done[-1] == ("mdi", "M30")
        # a pause goes past the line that is paused, and so does its end
        fake.set(interpreter="paused", paused=True)
        await until("it is seen", lambda: shop.machine._linuxcnc.paused)
        shop.table.send(one, b"G0 X2.5\nM24\n")
        await until("it goes on", lambda: fake.done[-1] == ("resume",))
        # at once after a pause, which is not seen yet: it goes on, and no programme begins
        fake.set(paused=False)
        await until("it is seen", lambda: not shop.machine._linuxcnc.paused)
        shop.table.send(one, b"M25\nM24\n")
        await until("it goes on", lambda: fake.done[-2:] == [("pause",), ("resume",)])
        fake.set(interpreter="idle", paused=False)
        await until("the line", lambda: fake.done[-1] == ("mdi", "G0 X2.5") and not one.pending)
        # of two clients, one is first, and the other one waits for its end
        fake.free.clear()
        shop.table.send(one, b"G0 X2.6\n")
        shop.table.send(other, b"G0 X2.7\n")
        await until("one of them", lambda: fake.done[-1] == ("mdi", "G0 X2.6"))
        fake.set(interpreter="waiting")
        fake.free.set()
        await asyncio.sleep(0.5)
        assert fake.done[-1] == ("mdi", "G0 X2.6") and other.pending
        # a stop of the page takes away what waits, and what comes soon after it, however long its client was silent
        assert shop.machine._linuxcnc._order.locked()
        loop, shop.table.now = asyncio.get_running_loop(), asyncio.get_running_loop().time()
        other.last_at = loop.time() - 5
        shop.hub.operators.on_stop()
        shop.table.send(other, b"G0 X7\n")
        fake.set(interpreter="idle")
        await asyncio.sleep(0.3)
        assert fake.done[-1] == ("mdi", "G0 X2.6") and not other.pending, fake.done
        assert any(line.startswith("[stop by an operator of LinuxCNC") for line in shop.table.take(other).decode().splitlines())
        other.deaf_until = one.deaf_until = 0.0
        # a stop takes away what waits
        fake.set(interpreter="waiting")
        await until("it is seen", lambda: shop.machine._linuxcnc._state["interpreter"] == "waiting")
        shop.table.send(one, b"G0 X3\n")
        shop.table.send(other, b"M410\n")
        fake.set(interpreter="idle")
        await asyncio.sleep(0.3)
        assert ("mdi", "G0 X3") not in fake.done
        shop.stops[-1][1].set_result(None)
        await until("the stop", lambda: not other.pending)
        shop.machine._linuxcnc.close()


async def programmes_and_overrides():
    async with LinuxCnc() as fake:
        shop = shop_of(fake)
        one = shop.table.client()
        assert await asked(shop, one, "M220 S50", "M220") == ["ok", "FR:100%", "ok"]
        assert fake.done == [("override", "feed", 0.5)]
        assert await asked(shop, one, "M24") == ["ok"] and fake.done[1:] == [("mode", "auto"), ("run",)]
        fake.set(interpreter="reading", file="/a.ngc", line=7, mode="auto")
        await until("it is seen", lambda: shop.machine._linuxcnc._state["line"] == 7)
        assert await asked(shop, one, "M27") == ["Not SD printing", "echo:/a.ngc, line 7", "ok"]
        assert await asked(shop, one, "G0 X1") == ["Error:G0: LinuxCNC runs a programme", "ok"]
        fake.set(paused=True)
        await until("it is seen", lambda: shop.machine._linuxcnc._state["paused"])
        one.deaf_until = 0.0
        assert await asked(shop, one, "M24") == ["ok"] and fake.done[-1] == ("resume",)
        # somebody has changed the mode, and the state does not say so yet
        fake.set(interpreter="idle", paused=False, mode="mdi")
        await until("it is seen", lambda: shop.machine._linuxcnc._state["mode"] == "mdi")
        fake.really = "auto"
        assert await asked(shop, one, "G0 X5") == ["ok"]
        assert fake.done[-3:] == [("mdi", "G0 X5"), ("mode", "mdi"), ("mdi", "G0 X5")], fake.done
        shop.table.send(one, b"M524\n")
        await until("the stop", lambda: shop.stops and shop.stops[-1][0] == "stop")
        shop.machine._linuxcnc.close()


async def targets_go_to_outputs():
    async with LinuxCnc() as fake:
        shop = shop_of(fake, hotend=1, bed=0, fan=3)
        one, other = shop.table.client(), shop.table.client("b")
        fake.values["mode"] = "mdi"
        assert await asked(shop, one, "M140 S60", "M106 S51") == ["ok", "ok"]
        assert fake.done == [("mdi", "M68 E0 Q60"), ("mdi", "M68 E3 Q0.2000")], fake.done
        assert await asked(shop, one, "M141 S1") == [
            "Error:M141: no output of LinuxCNC is set for the chamber; see chamber in [linuxcnc] in pokeys-gateway.conf(5)", "ok"]
        # it waits for what the daemon measures
        show(shop, a=State(heater(0, "hotend", target_in_effect=0.0) | {"connected": True}))
        shop.table.send(one, b"M109 S200\n")
        await until("the target", lambda: fake.done[-1] == ("mdi", "M68 E1 Q200"))
        show(shop, a=State(heater(0, "hotend", target_in_effect=200.0) | {"connected": True}))
        await asyncio.sleep(0.3)
        assert one.pending
        show(shop, a=State(heater(0, "hotend", target_in_effect=200.0, temperature=200.5) | {"connected": True}))
        await until("it is warm", lambda: not one.pending)
        shop.table.send(one, b"M109 R20\n")
        await until("the target", lambda: fake.done[-1] == ("mdi", "M68 E1 Q20"))
        assert one.pending and await asked(shop, other, "M108") == ["ok"]
        await until("it is given up", lambda: not one.pending)
        shop.machine._linuxcnc.close()


async def who_is_gone_still_switches_off():
    async with LinuxCnc() as fake:
        shop = shop_of(fake, fan=3, hotend=1)
        one = shop.table.client()
        assert await asked(shop, one, "G0 X1") == ["ok"]
        fake.set(interpreter="waiting")
        await until("it is seen", lambda: shop.machine._linuxcnc._state["interpreter"] == "waiting")
        shop.table.send(one, b"G0 X2\nG0 X3\nM107\n")
        shop.table.router.leave(one)
        # ... also if it is gone while this waits
        two = shop.table.client("b")
        shop.table.send(two, b"M104 S0\n")
        await asyncio.sleep(0.2)
        shop.table.router.leave(two)
        fake.set(interpreter="idle")
        await until("they are off", lambda: {("mdi", "M68 E3 Q0.0000"), ("mdi", "M68 E1 Q0")} <= set(fake.done))
        assert ("mdi", "G0 X3") not in fake.done
        await until("its place is free", lambda: not shop.hub.operators.commanding)
        shop.machine._linuxcnc.close()


async def nobody_is_there():
    shop = Shop(proxy="nobody-here", machine_kind="pokeys")
    one = shop.table.client()
    said = await asked(shop, one, "G0 X1")
    assert said[0].startswith("Error:G0: nobody-here does not run; a HAL file of LinuxCNC starts it"), said
    async with LinuxCnc() as fake:
        shop = shop_of(fake)
        one = shop.table.client()
        fake.free.clear()
        shop.table.send(one, b"G0 X1\n")
        await until("it is given", lambda: fake.done)
        for writer in fake.writers:
            writer.close()
        await until("the end", lambda: not one.pending)
        assert shop.table.take(one).decode().startswith("Error:G0: "), shop.table.take(one)
        fake.free.set()
        shop.machine._linuxcnc.close()


def main():
    for test in (lines_are_mdi, a_line_waits_for_the_one_before_it, programmes_and_overrides, targets_go_to_outputs,
                 who_is_gone_still_switches_off, nobody_is_there):
        asyncio.run(asyncio.wait_for(test(), 60))
        print(f"ok: {test.__name__}")
    assert gcode


if __name__ == "__main__":
    main()
