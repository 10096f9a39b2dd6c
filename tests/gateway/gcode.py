#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The gateway's own G-code: lines as hosts send them to Marlin, replies to who has asked, and nothing waits."""
import asyncio
import os
import pathlib
import random
import re
import types

import desk
from pokeys_gateway.gcode import commands
from pokeys_gateway.gcode.machine import KEPT, UNDER_WAY_MOST, Machine
from pokeys_gateway.gcode.parser import LINE_MOST, BadLine, BadWords, checksum, parse
from pokeys_gateway.wire import NotDone

SEED, LINES = int(os.environ.get("POKEYS_SEED", "20281")), int(os.environ.get("POKEYS_FUZZ_LINES", "20000"))

# a line; its number, its command, its words
GOOD = (
    (b"G1 X10 Y-2.5 F1500\n", None, "G1", {"X": 10, "Y": -2.5, "F": 1500}),
    (b"g01x10y-2.5f1500\r\n", None, "G1", {"X": 10, "Y": -2.5, "F": 1500}),
    (b"  G 1 X 10 Y.5 Z+3. ; to the right: X99 *1", None, "G1", {"X": 10, "Y": 0.5, "Z": 3}),
    (b"G28 X Y", None, "G28", {"X": None, "Y": None}),
    (b"G38.2 Z-5 (down) F10", None, "G38.2", {"Z": -5, "F": 10}),
    (b"N10 G1 X1*80", 10, "G1", {"X": 1}),
    (b"N10 G1 X1*80 ; a comment is not in the checksum *3", 10, "G1", {"X": 1}),
    (b"N-1 M110*15", -1, "M110", {}),
    (b"M110 N7", None, "M110", {"N": 7}),
    (b"T0", None, "T0", {}),
    (b"?", None, "?", {}),
)
ODD = ((b"M117 5 * 3 is 15", "M117", "5 * 3 is 15"), (b"M117Hello N1", "M117", "Hello N1"), (b"$$", "", ""),
       (b"hello", "", ""), (b"G", "", ""), (b"G123456 X1", "", ""), (b"X10", "", ""), (b"\xff\xfe", "", ""))
BAD = (
    (b"N10 G1 X1*81", "checksum mismatch"),
    (b"N10 G1 X1", "No Checksum with line number"),
    (b"N10 G1 X1*", "No Checksum with line number"),
    (b"N10 G1 X1*80x", "No Checksum with line number"),
)
WORDS = ((b"G1 X1 X2", "X is there twice"), (b"G1 X1 Y--2", '"--2" is no letter with a number'),
         (b"G1 X1,5", '",5" is no letter with a number'), (b"G1 X1 (a", '"(a" is no letter with a number'))


def lines_are_taken_apart():
    for data, number, name, words in GOOD:
        line = parse(data)
        assert (line.number, line.name, line.words()) == (number, name, words), (data, line)
    for data, name, argument in ODD:
        line = parse(data)
        assert (line.number, line.name, line.argument) == (None, name, argument), (data, line)
    for data in (b"", b"\n", b" \r\n", b"; G1", b"(only this) ; and that"):
        assert parse(data) is None, data
    for data, why in BAD:
        assert refusal(BadLine, parse, data) == why, data
    for data, why in WORDS:
        assert refusal(BadWords, parse(data).words) == why, data


def refusal(kind, call, *words):
    try:
        found = call(*words)
    except kind as why:
        return str(why)
    raise AssertionError(f"this was taken: {words}, as {found}")


def any_bytes_are_a_line_or_refused():
    rng = random.Random(SEED)
    taken = 0
    for _ in range(LINES):
        data = bytes(rng.choices(b"NnGgMmXT0123456789.+-* ;()?\t\xff\x00", k=rng.randrange(40)))
        if rng.random() < 0.3:
            data = b"N%d %s" % (rng.randrange(1000), data.replace(b"*", b"").replace(b";", b""))
            data = data.strip()
            data += b"*%d" % checksum(data)
        try:
            line = parse(data)
            words = line.words() if line else {}
        except (BadLine, BadWords):
            continue
        taken += 1
        assert all(re.fullmatch("[A-Z]", letter) for letter in words), (data, words)
        assert not line or line.name == "?" or re.fullmatch(r"(?:[GMT]\d+(?:\.\d+)?)?", line.name), (data, line)
    assert taken > LINES / 10, taken
    # one bit of a line with a checksum: never taken as another line
    good = b"N10 G1 X10.5 Y20 E3"
    good += b"*%d" % checksum(good)
    for bit in range(8 * (good.index(b"*") - 3)):
        data = bytearray(good)
        data[3 + bit // 8] ^= 1 << bit % 8
        try:
            line = parse(bytes(data))
        except BadLine:
            continue
        assert line.number != 10 or b";" in data, bytes(data)


class Shop:
    """A router whose machine is the gateway, in virtual time; LinuxCNC is one that confirms when it is said to."""

    def __init__(self, operate=True, firmware="marlin"):
        self.table = table = desk.Table(machine=False, firmware=firmware)
        self.stops = []
        self.hub = desk.hub_of(operate=operate)
        self.hub.operators.begin_stop = self.begin_stop
        self.hub.source.trouble = "no daemon in /nowhere; is pokeysd running?"

        def machine(_name, most):
            one = table.connect()
            one.framer = type(one.framer)(most)
            return one
        self.machine = Machine(types.SimpleNamespace(router=table.router, machine=machine), self.hub)

    def begin_stop(self, method):
        self.stops.append((method, asyncio.get_running_loop().create_future()))
        return self.stops[-1][1]

    def ask(self, one, data):
        self.table.send(one, data)
        return self.table.take(one).decode()


async def the_asker_gets_the_reply():
    shop = Shop()
    one, other = shop.table.client(), shop.table.client("b")
    assert shop.ask(one, b"?\n") == "no daemon in /nowhere; is pokeysd running?\nok\n"
    assert shop.ask(one, b"M105\nM105\r\n; nothing\n\n") == "ok\nok\n"
    assert shop.ask(one, b"G999 X1\n") == 'echo:Unknown command: "G999 X1"; M115 lists what there is\nok\n'
    assert shop.ask(one, b"$$\n").startswith('echo:Unknown command: "$$"; ')
    assert shop.ask(one, b"M105 X1\n") == "Error:M105: M105 takes T, and not X\nok\n"
    assert shop.ask(one, b"M105 T\xff\n").startswith("Error:M105: \"\ufffd\" is no letter with a number")
    assert shop.ask(one, b"M117" + LINE_MOST * b"x" + b"\n") == "Error:M117: a line has at most 256 characters\nok\n"
    # longer than any part, and than what is kept
    assert shop.ask(one, b"M117" + 5000 * b"x" + b"\nM105\n").endswith("a line has at most 256 characters\nok\nok\n")
    assert shop.ask(one, b"M117" + (KEPT - 4) * b"x" + b"\nM105\n").endswith("at most 256 characters\nok\nok\n")
    firmware = shop.ask(one, b"M115\n").splitlines()
    assert firmware[0].startswith("FIRMWARE_NAME:pokeys-gateway ") and firmware[-1] == "ok", firmware
    for name in commands.COMMANDS:
        assert any(line.startswith(f"echo:{name} ") for line in firmware), (name, firmware)
    assert shop.table.take(other) == b"", "nobody else gets it"
    # a line that is begun and ended by another send
    shop.table.send(one, b"M1")
    shop.table.run(2)
    assert shop.ask(other, b"M105\n") == "", "the line of one is begun"
    assert shop.ask(one, b"05\n") == "ok\n"
    assert shop.table.take(other) == b"ok\n"
    guest = shop.table.client("c", level="guest")
    assert "needs level user" in shop.ask(guest, b"?\n")
    shop.table.quiet()


async def numbers_are_in_order():
    shop = Shop()
    one, other = shop.table.client(), shop.table.client("b")

    def send(number, text, to=one, good=True):
        body = f"N{number} {text}".encode()
        return shop.ask(to, body + b"*%d\n" % (checksum(body) ^ (not good)))
    assert send(-1, "M110") == "ok\n"
    assert send(0, "M105") == "ok\n" and send(1, "M105") == "ok\n"
    assert send(2, "M105", good=False) == "Error:checksum mismatch, Last Line: 1\nResend: 2\nok\n"
    assert send(3, "M105") == "Error:Line Number is not Last Line Number+1, Last Line: 1\nResend: 2\nok\n"
    assert send(2, "M999").startswith('echo:Unknown command: "M999"') and send(3, "M105") == "ok\n"
    # each client counts for itself
    assert send(1, "M105", other) == "ok\n" and send(4, "M105") == "ok\n"
    assert shop.ask(one, b"M110 N99\n") == "ok\n" and send(100, "M105") == "ok\n"
    assert send(101, "M110 N5") == "ok\n" and send(6, "M105") == "ok\n"
    assert shop.ask(one, b"N7 M105\n") == "Error:No Checksum with line number, Last Line: 6\nResend: 7\nok\n"
    # what cannot be carried out counts: it would be sent again for ever
    assert send(7, "M105 X1").startswith("Error:M105: ") and send(8, "M105") == "ok\n"
    shop.table.quiet()


async def until(task, holds):
    """Other tasks have their turns."""
    for _ in range(100):
        if holds():
            return
        await asyncio.sleep(0)
    raise AssertionError(task)


async def a_stop_is_confirmed_or_said_not_to_be():
    shop = Shop()
    one, other = shop.table.client(), shop.table.client("b")
    shop.table.send(one, b"M112\n")
    assert [method for method, _ in shop.stops] == ["emergency_stop"]
    stopped = "[stop by telnet a; lines not sent: 0]\n"
    assert shop.table.take(one).decode() == shop.table.take(other).decode() == stopped
    assert one.pending and not other.pending
    # others are answered meanwhile, and so is who waits
    assert shop.ask(other, b"M105\n") == "ok\n" and shop.ask(one, b"M105\n") == "ok\n"
    shop.stops[0][1].set_result(None)
    await until("the reply", lambda: not one.pending)
    assert shop.table.take(one) == b"ok\n" and shop.table.take(other) == b""
    shop.table.send(one, b"M410\n")
    assert shop.stops[1][0] == "stop"
    shop.stops[1][1].set_exception(NotDone("pokeys-remote does not answer"))
    await until("the reply", lambda: not one.pending)
    why = "the stop is not confirmed: pokeys-remote does not answer; use the machine's own switch"
    assert shop.table.take(one).decode().endswith(f"[not stopped: {why}]\nError:M410: {why}\nok\n")
    assert shop.table.take(other).decode().endswith(f"\n[not stopped: {why}]\n"), "it has heard of the stop"
    # in the middle of a line of somebody else, which is not carried out
    shop.table.send(other, b"M105 T")
    shop.table.run(2)
    shop.table.take(other)
    shop.table.send(one, b"M112\n")
    assert len(shop.stops) == 3
    assert shop.table.take(one).decode() == "[stop by telnet a; lines not sent: 1]\n"
    # who is gone gets nothing, and no message stays
    shop.table.router.leave(one)
    shop.stops[2][1].set_result(None)
    await until("its end", lambda: not one.due)
    await asyncio.sleep(0)
    shop.table.take(other)
    # a flood of them has an end
    for _ in range(UNDER_WAY_MOST + 10):
        shop.table.send(other, b"M112\nM105\n")
    assert len(shop.stops) == 3 + UNDER_WAY_MOST, len(shop.stops)
    assert shop.table.take(other).decode().count("Error:M112: 64 commands are under way, which is the most\n") == 10
    await asyncio.sleep(0)
    shop.machine.close()
    await until("its end", lambda: not other.due)
    shop.table.router.leave(other)
    shop.table.quiet()
    # without LinuxCNC
    shop = Shop(operate=False)
    one = shop.table.client()
    assert "\nError:M112: the gateway may not operate LinuxCNC" in shop.ask(one, b"M112\n") and not shop.stops
    shop.table.take(one)
    shop.table.quiet()


def the_manual_page_has_them_all():
    page = pathlib.Path(__file__).resolve().parents[2] / "man/pokeys-gateway.8.scd"
    section = re.search(r"^# G-CODE\n(.*?)^# ", page.read_text(encoding="utf-8"), re.M | re.S)[1]
    listed = {name for line in re.findall(r"^(\*(?:\?|[GMT]\d+)\*.*)$", section, re.M)
              for name in re.findall(r"\*(\?|[GMT]\d+)\*", line)}
    assert listed == set(commands.COMMANDS), listed ^ set(commands.COMMANDS)


def main():
    the_manual_page_has_them_all()
    lines_are_taken_apart()
    any_bytes_are_a_line_or_refused()
    for test in (the_asker_gets_the_reply, numbers_are_in_order, a_stop_is_confirmed_or_said_not_to_be):
        asyncio.run(test())
    print(f"{LINES} lines; POKEYS_SEED={SEED}")


if __name__ == "__main__":
    main()
