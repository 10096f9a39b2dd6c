#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The gateway's own G-code: lines as hosts send them to Marlin, replies to who has asked, and nothing waits."""
import asyncio
import os
import pathlib
import random
import re
import tempfile
import types

import desk
from operators import Fake, until
from pokeys_gateway.console.router import OPEN_S
from pokeys_gateway.gcode import blocks, commands
from pokeys_gateway.gcode.machine import DUE_MOST, JOIN_S, KEPT, Machine
from pokeys_gateway.gcode.parser import LINE_MOST, BadLine, BadWords, checksum, is_summed, number_of, parse
from pokeys_gateway.gcode.prefix import modes_before
from pokeys_gateway.operate import Operators
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
    (b"T0", None, "T", {"T": 0.0}), (b"t 2 ; hot end", None, "T", {"T": 2.0}),
    (b"?", None, "?", {}),
)
ODD = ((b"M117 5 * 3 is 15", "M117", "5 * 3 is 15"), (b"M117Hello N1", "M117", "Hello N1"), (b"$$", "", ""),
       (b"hello", "", ""), (b"G", "", ""), (b"G123456 X1", "", ""), (b"X10", "", ""), (b"\xff\xfe", "", ""))
BAD = (
    (b"N10 G1 X1*81", "checksum mismatch"),
    (b"N10 G1 X1", "No Checksum with line number"),
    (b"N10000000000 G1*1", "a line number has at most 9 digits"),
    (b"N10 G1 X1*", "No Checksum with line number"),
    (b"N10 G1 X1*80x", "No Checksum with line number"),
)
WORDS = ((b"G1 X20 Y2O F6000", '"2O F6000" is not a number'), (b"M104 S6O", '"6O" is not a number'),
         (b"G1 X1 X2", "X occurs twice"), (b"G1 X1 Y--2", '"--2" is not a letter with a number'),
         (b"G1 X1,5", '",5" is not a letter with a number'), (b"G1 X1 (a", '"(a" is not a letter with a number'))


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
    for data, number in ((b" N12 M117 x", 12), (b"n-3G1", -3), (b"M105", None), (b"N", None), (b"N99999999999", None)):
        assert number_of(data) == number, data
    for data, summed in ((b"G1 X5*80", True), (b"G1 X5 * 80 ; there", True), (b"G1 X5", False), (b"M117 5*3", False), (b"G1 ; *80", False)):
        assert is_summed(data) == summed, data


def refusal(kind, call, *words):
    try:
        found = call(*words)
    except kind as why:
        return str(why)
    raise AssertionError(f"this was taken: {words}, as {found}")


# a line; the names of its commands with their words, in the order in which they are carried out
BLOCKS = (
    (b"G1 X5", "G1 X5"), (b"G28 X", "G28 X"), (b"M155 S2", "M155 S2"), (b"T1", "T T1"), (b"G4 P5 S1", "G4 P5 S1"),
    (b"G90 G1 X5 F600", "G90; G1 X5 F600"), (b"g1x5g91", "G91; G1 X5"),
    (b"G17 G21 G40 G49 G80 G90 G94", "G94; G17; G21; G40; G49; G90; G80"),
    (b"M3 S1000 G0 X1 Y2", "M3 S1000; G0 X1 Y2"), (b"S1000 M3", "M3 S1000"), (b"X1 G1", "G1 X1"), (b"G1. X1", "G1 X1"),
    (b"G0 (fast) X1 M5", "M5; G0 X1"), (b"M5 M30", "M5; M2"), (b"G92 X0 G90", "G90; G92 X0"), (b"M9 M5", "M5; M9"),
    (b"X5 Y-2.5", " X5 Y-2.5"), (b"X5 F600", " X5 F600"), (b"I1 J1", " I1 J1"), (b"F600", "F F600"), (b"M0 M5", "M5; M0"), (b"G1 X5 M0 P500", "G1 X5; M0 P500"), (b"G43 H1 Z5", "G43 H1;  Z5"), (b"G90 G94 G91.1", "G94; G90; G91.1"), (b"G91 X5", "G91;  X5"),
    (b"T1 M6", "M6 T1"), (b"M6 T2", "M6 T2"), (b"M5 M6 T3", "M6 T3; M5"), (b"T1 G0 X5", "T T1; G0 X5"), (b"G90 F600", "G90; F F600"), (b"N5 G90 G0 X1*%d" % checksum(b"N5 G90 G0 X1"), "G90; G0 X1"),
)
BAD_BLOCKS = (
    (b"G0 G1 X5", "G0 and G1 cannot be in one line"), (b"G90 G91", "G90 and G91 cannot be in one line"),
    (b"G92 X0 G1", "G92 and G1 cannot be in one line"), (b"G28 X G90", "G28 needs a line of its own"), (b"G90 G28", "G28 needs a line of its own"),
    (b"G1 X5 M112", "M112 needs a line of its own"), (b"G4 P1 M5", "G4 needs a line of its own"),
    (b"G1 X5 M104 S200", "M104 needs a line of its own"), (b"G90 G1 X", "X needs a number"), (b"G90 G1 X5 S100", "no command in this line takes S"),
    (b"G90 G1 X1 X2", "X occurs twice"), (b"G90 G1 X2O", '"2O" is not a number'), (b"M5 G1 X5 Q1", "no command in this line takes Q"), (b"G80 X5", "G80 and a move without a command cannot be in one line"), (b"G1 X5 G", '"G" is not a command'),
    (b"G-.5 X1", '"G-.5" is not a command'),
)
NO_BLOCKS = (b"M486 ACube G2", b"M5 I", b"M3 I S100", b"M0 turn it", b"M0 X5", b"M30 G1", b"M108 M5", b"M104 S200 G1 X5", b"hello", b"X", b"he G28", b"S1000", b"XE", b"G", b"X5 Q1", b"M155 S2", b"M115 what is it", b"G38.2 Z-5", b"?", b"M862.3 P \"MK3S\"")


def lines_have_several_commands_or_none():
    for data, wanted in BLOCKS:
        line = parse(data)
        found = blocks.parts(line)
        assert "; ".join(f"{one.name} {one.argument}".rstrip() for one in found) == wanted, (data, found)
        assert blocks.is_block(line) == (found != [line]), data
    for data, why in BAD_BLOCKS:
        assert refusal(BadWords, blocks.parts, parse(data)) == why, data
    for data in NO_BLOCKS:
        assert not blocks.is_block(parse(data)), data
    # what is carried out for a client that is gone switches off, and does nothing else
    for data in (b"M5", b"M104 S0", b"M5 M9", b"M9 M5", b"M5 M30", b"M5 G90", b"M5 I"):
        assert commands.switches_off(parse(data)), data
    for data in (b"M5 G0 Z5", b"M5 Z5", b"M3 S0 G90", b"M9", b"G90 G21", b"M5 M0", b"M104 S0 G0 X1"):
        assert not commands.switches_off(parse(data)), data
    rng = random.Random(SEED)
    for _ in range(LINES // 10):
        line = parse(bytes(rng.choices(b"GMGMXYFS0123456789. -(", k=rng.randrange(30))))
        if line and blocks.is_block(line):
            try:
                found = blocks.parts(line)
            except BadWords:
                continue
            assert found and all(one.name in (*commands.COMMANDS, blocks.MODAL, blocks.SPEED, "M7", "M8", "M9") and one.words() is not None
                                 for one in found), (line, found)


# the beginning of a file; relative, relative_extruder, mm for a unit, mm/s, the tool, the last move
BEFORE = (
    (b"", (False, False, 1, None, 0, "")),
    (b"G21\nM83\nG1 X1 F1200\nG0 Y1\n", (False, True, 1, 20, 0, "G0")),
    (b"G20 G91 G01X1.F60\nG21\nT2\n", (True, True, 1, 25.4, 2, "G1")),
    (b"G91\nG90\nM83\nM82 ; M83\n(G91) ; G20\nM117 G91 M83 T5\nN5 M118 G20*7\nG90.1 G91.1\n", (False, False, 1, None, 0, "")),
    (b"g91\nf600 g3 x1 i1\nf0\n", (True, True, 1, 10, 0, "G3")), (b"G1 X1\nG91\nG80", (True, True, 1, None, 0, "")),
    (b"T0\nM104 T1 S150\nM207 F5\nM0 G91 F5\nM6 T3\nM30\n", (False, False, 1, None, 0, "")),
    (b"t1\nx1 f60\nM3 S5 G91 F120\n M05 g0 x1 M30\n", (False, False, 1, 2, 1, "")), (b"M104 S200 ; F6\nM4 F3\nF60\n", (False, False, 1, 1, 0, "")),
    (b"G91\nM83\nG1 X1 F60\nM2\n", (False, False, 1, 1, 0, "")), (b"G1 X2 F60 " + 70000 * b" " + b"\n" + 9000 * b"G1 X1\n" + b"G0 Y1\n", (False, False, 1, 1, 0, "G0")),
)


def modes_of_the_lines_before_a_place():
    with tempfile.TemporaryFile() as file:
        for data, wanted in BEFORE:
            file.truncate(0)
            file.seek(0)
            # what comes behind the place does not count
            file.write(data + b"G20 G91 M83 T7 F6\n")
            file.flush()
            modes = modes_before(file.fileno(), len(data))
            feed = modes.feed and modes.feed * modes.feed_scale
            found = (modes.relative, modes.relative_extruder, modes.scale, feed, modes.tool, modes.motion)
            assert found[:3] + found[4:] == wanted[:3] + wanted[4:] and (feed == wanted[3] or abs(feed - wanted[3]) < 1e-9), (data[:60], found)


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
        assert not line or line.name in ("?", "$J") or re.fullmatch(r"(?:[GM]\d+(?:\.\d+)?|T)?", line.name), (data, line)
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

    def __init__(self, operate=True, stops=None, **settings):
        self.table = table = desk.Table(machine=False)
        self.stops = []
        self.hub = desk.hub_of(operate=operate, **settings)
        self.hub.operators.begin_stop = stops or self.begin_stop
        show(self, a=State())       # a device without heaters

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


def numbered(number, text, good=True):
    body = f"N{number} {text}".encode()
    return body + b"*%d\n" % (checksum(body) ^ (not good))


UNKNOWN = 'echo:Unknown command: "{}"; M115 lists the commands\nok\n'
LONG = 'echo:not carried out: a line has at most 256 characters: "{}"\nok\n'


async def the_asker_gets_the_reply():
    shop = Shop(operate=False)
    one, other = shop.table.client(), shop.table.client("b")
    show(shop)
    shop.hub.source.trouble = "no daemon in /nowhere; is pokeysd running?"
    assert shop.ask(one, b"?\n") == shop.ask(one, b"M105\n") == "echo:no daemon in /nowhere; is pokeysd running?\nok\n"
    show(shop)
    assert shop.ask(one, b"?\n") == "echo:no device\nok\n"
    show(shop, a=State())
    assert shop.ask(one, b"M105\nM105\r\n; nothing\n\n") == "ok\nok\n"
    assert shop.ask(one, b"G999 X1\n") == UNKNOWN.format("G999 X1")
    assert shop.ask(one, b"$$\n") == UNKNOWN.format("$$")
    # what other firmwares have behind these is no fault: programs would end their job
    for line in b"M104 S200", b"M109 R20", b"M999":
        assert re.fullmatch(r"Error:[MG]\d+: G-code has no device to command; .*\nok\n",
                            shop.ask(one, line + b"\n")), line
    assert shop.ask(one, b"M503\n") == "echo:G-code commands no device\nok\n"
    for line in b"M105 T0 R", b"M105*37", b"M108 all", b"M110":
        assert shop.ask(one, line + b"\n") == "ok\n", line
    assert shop.ask(one, b"M115 U3.1.0\n").endswith("\nok\n")
    for line in b"M110 N1.5", b"M110 N" + 200 * b"9", b"M110 N-9999999999", b"M110 Nx N":
        assert re.fullmatch(r"echo:not carried out: .*\nok\n", shop.ask(one, line + b"\n")), line
    assert shop.ask(one, b"M117" + LINE_MOST * b"x" + b"\n") == LONG.format("M117" + 60 * "x")
    # longer than any part, and than what is kept; nothing of it is carried out, nor taken for something else
    assert shop.ask(one, b"M117" + 5000 * b"x" + b"\nM105\n") == LONG.format("M117" + 60 * "x") + "ok\n"
    assert shop.ask(one, b"M117" + (KEPT - 3) * b"x" + b"\nM105\n") == LONG.format("M117" + 60 * "x") + "ok\n"
    assert shop.ask(one, 1199 * b" " + b";M112\nM105\n") == LONG.format("") + "ok\n" and not shop.stops
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
    shop = Shop(operate=False)
    one, other = shop.table.client(), shop.table.client("b")

    def send(number, text, to=one, good=True):
        return shop.ask(to, numbered(number, text, good))
    assert send(-1, "M110") == "ok\n"
    assert send(0, "M105") == "ok\n" and send(1, "M105") == "ok\n"
    assert send(2, "M105", good=False) == "Error:checksum mismatch, Last Line: 1\nResend: 2\nok\n"
    assert send(3, "M105") == "Error:Line Number is not Last Line Number+1, Last Line: 1\nResend: 2\nok\n"
    assert send(2, "M998") == UNKNOWN.format("M998") and send(3, "M105") == "ok\n"
    # each client counts for itself
    assert send(1, "M105", other) == "ok\n" and send(4, "M105") == "ok\n"
    assert shop.ask(one, b"M110 N99\n") == "ok\n" and send(100, "M105") == "ok\n"
    assert send(101, "M110 N5") == "ok\n" and send(6, "M105") == "ok\n"
    assert shop.ask(one, b"N7 M105\n") == "Error:No Checksum with line number, Last Line: 6\nResend: 7\nok\n"
    assert "at most 9 digits, Last Line: 6\nResend: 7\n" in send(99999999999, "M105")
    # what is too long counts: it would be sent again for ever
    assert send(7, "M117 " + 300 * "x") == LONG.format("M117 " + 59 * "x") and send(8, "M105") == "ok\n"
    shop.table.quiet()


async def what_is_too_long_or_has_no_end_is_not_carried_out():
    shop = Shop(operate=False)
    one, other = shop.table.client(), shop.table.client("b")
    # it counts, however long it is, or it would be sent again for ever
    assert shop.ask(one, numbered(1, "M117 " + 3000 * "x")) == LONG.format("N1 M117 " + 56 * "x")
    assert shop.ask(one, numbered(2, "M105")) == "ok\n"
    # noise has ended a line: its rest has a checksum, and no number
    assert shop.ask(one, b"M105*%d\n" % checksum(b"N3 M105")) == "Error:No Line Number with checksum, Last Line: 2\nResend: 3\nok\n"
    assert shop.ask(other, b"M105*37\n") == "ok\n", "who does not number has none"
    # the network, or a person, keeps the rest of a line: half a number is another number
    for who, text, said in ((other, b"M117 he", 'echo:not carried out, as it has no end: "M117 he"\nok\n'),
                            (one, b"N3 M10", "Error:the line has no end, Last Line: 2\nResend: 3\nok\n")):
        shop.table.send(who, text)
        shop.table.run(OPEN_S + 3)
        found = shop.table.take(who).decode()
        assert found.endswith(said), found
        assert shop.ask(who, b"5*1\nM105\n") == "ok\n", "only the next line"
    # who goes away in the middle of one
    shop.table.send(other, b"M999")
    shop.table.run(2)
    shop.table.router.leave(other)
    shop.table.run()
    assert shop.ask(one, numbered(3, "M105")) == "ok\n"
    # but a stop is one
    shop = Shop()
    one = shop.table.client()
    shop.table.send(one, b"M112")
    shop.table.run(OPEN_S + 3)
    assert [method for method, _ in shop.stops] == ["emergency_stop"]


async def a_request_goes_on_with_the_modes_of_the_last_one():
    """Over HTTP, each is a client of its own."""
    shop = Shop(operate=False)

    def lane(name, address, hears=False):
        client = shop.table.client(name)
        client.address, client.hears = address, hears
        return shop.machine._lane(client)
    lane("1", "192.0.2.1").modes.relative = True
    shop.table.router.leave(list(shop.table.router.clients)[-1])
    assert lane("2", "192.0.2.1").modes.relative and not lane("3", "192.0.2.2").modes.relative
    assert not lane("4", "192.0.2.1", hears=True).modes.relative, "a connection has its own"
    # two requests of somebody at once change nothing for each other, and what each has set is kept
    one, other = lane("6", "192.0.2.3").modes, lane("7", "192.0.2.3").modes
    other.relative, one.tool = True, 2
    assert not one.relative and not lane("8", "192.0.2.3").modes.relative
    shop.table.router.leave(next(client for client in shop.table.router.clients if client.name == "7"))
    third = lane("9", "192.0.2.3").modes
    assert (third.relative, third.tool) == (True, 0)
    for client in list(shop.table.router.clients):
        shop.table.router.leave(client)
    last = lane("10", "192.0.2.3").modes
    assert (last.relative, last.tool) == (True, 2)
    for i in range(100):
        lane(str(i), f"192.0.2.{i % 90 + 100}")
    assert not lane("5", "192.0.2.1").modes.relative, "they are not kept for ever"


async def turn():
    """Callbacks have their turns."""
    for _ in range(3):
        await asyncio.sleep(0)


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
    await turn()
    assert shop.table.take(one) == b"ok\n" and shop.table.take(other) == b"" and not one.pending
    shop.table.send(one, b"M410\n")
    assert shop.stops[1][0] == "stop"
    shop.stops[1][1].set_exception(NotDone("pokeys-remote does not answer"))
    await turn()
    why = "the stop is not confirmed: pokeys-remote does not answer; use the machine's own switch"
    assert shop.table.take(one).decode() == f"{stopped}[{why}]\nError:M410: {why}\nok\n" and one.failed
    assert shop.table.take(other).decode() == f"{stopped}[{why}]\n", "it has heard of the stop"
    # in the middle of a line of somebody else, which is not carried out
    shop.table.send(other, b"M105 T")
    shop.table.run(2)
    shop.table.send(one, b"M112\n")
    assert len(shop.stops) == 3
    assert shop.table.take(one).decode() == "[stop by telnet a; lines not sent: 1]\n"
    # who is gone gets nothing, and no message stays
    shop.table.router.leave(one)
    shop.stops[2][1].set_result(None)
    await turn()
    shop.table.router.leave(other)
    shop.table.quiet()
    # without LinuxCNC: what is said last is that nothing has stopped
    shop = Shop(operate=False)
    one, other = shop.table.client(), shop.table.client("b")
    said = shop.ask(one, b"M112\n").splitlines()
    assert [line[:6] for line in said] == ["[stop ", "[not s", "Error:", "ok"] and not shop.stops, said
    assert shop.table.take(other).decode().splitlines() == said[:2] and one.failed
    shop.table.quiet()


async def nothing_is_wrong_with_a_stop():
    """Its number, its checksum, what stands behind it, other stops under way: it is obeyed, once."""
    good = numbered(2, "M112")
    for data in (b"M112 P1\n", b"M112 now!\n", b"M112abc\n", b"M112*5\n", b"M 112\n", b"m0112\n", b"N3 M112\n",
                 numbered(9, "M112"), numbered(9, "M112", good=False), numbered(-1, "M112"), b"M112" + 5000 * b"x" + b"\n",
                 numbered(1, "M105") + good, b"  N99999999999999999999 M112*1\n", b"M112;\n", b"\tM112\n"):
        shop = Shop()
        one, other = shop.table.client(), shop.table.client("b")
        shop.table.send(other, b"M105 T")
        shop.table.run(2)
        shop.table.send(one, data)
        assert [method for method, _ in shop.stops] == ["emergency_stop"], data
        assert shop.table.take(other).decode().startswith("[stop by telnet a; "), data
        shop.stops[0][1].set_result(None)
        await turn()
        assert shop.table.take(one).decode().endswith("]\nok\n"), data
        if data.endswith(good):
            assert shop.ask(one, numbered(3, "M105")) == "ok\n", "it goes on behind its number"
        shop.table.run(10)
        shop.table.quiet()
    for data in b"M1120\n", b"M112.1\n", b"; M112\n", b"M117 M112\n", b"(M112)\n", b"N5 M117 M112*3\n", b"M 1 12\n":
        shop = Shop()
        shop.ask(shop.table.client(), data)
        assert not shop.stops, data
    # typed slowly: the line's end comes when it was passed on already
    shop = Shop()
    one, other = shop.table.client(), shop.table.client("b")
    shop.table.send(one, b"M112")
    shop.table.run(5)
    assert not shop.stops
    shop.table.send(other, b"M105\n")
    shop.table.send(one, b"\n")
    assert len(shop.stops) == 1 and shop.table.take(other).endswith(b"[stop by telnet a; lines not sent: 1]\n")


async def many_stops():
    """A flood of them is bounded, and is no way to keep another one from being obeyed."""
    shop = Shop()
    one, other = shop.table.client(), shop.table.client("b")
    for _ in range(DUE_MOST + 10):
        shop.table.send(one, b"M410\nM105\n")
    assert 1 <= len(shop.stops) < DUE_MOST and one.due == DUE_MOST
    assert shop.table.take(one).decode().count("echo:busy: stopping\nok\n") == 10
    shop.table.send(other, b"M112\n")
    assert shop.stops[-1][0] == "emergency_stop"
    # later, it is another one: something may have been begun meanwhile
    count = len(shop.stops)
    await asyncio.sleep(2 * JOIN_S)
    shop.table.send(other, b"M112\n")
    assert len(shop.stops) == count + 1
    for _, done in shop.stops:
        done.set_result(None)
    await turn()
    assert not one.pending and not other.pending
    shop.table.take(one)
    shop.table.take(other)
    shop.table.quiet()


async def a_stop_gets_through():
    """To pokeys-remote, also if the gateway ends."""
    async with Fake() as fake:
        shared = Operators(fake.name)
        shop = Shop(stops=shared.begin_stop)
        one = shop.table.client()
        shop.table.send(one, b"M410\n")
        await until("the stop", lambda: not one.pending)
        assert shop.table.take(one).decode().endswith("]\nok\n") and fake.methods() == ["stop"]
        shop.table.send(one, b"M112\n")
        await shop.machine.close()
        assert fake.methods() == ["stop", "emergency_stop"] and not one.pending
        fake.errors["linuxcnc.emergency_stop"] = "LinuxCNC does not answer"
        shop.table.send(one, b"M112\n")
        await until("the answer", lambda: not one.pending)
        assert "Error:M112: the stop is not confirmed: LinuxCNC does not answer" in shop.table.take(one).decode()
        shared.close()
        shop.table.quiet()


class State(dict):
    """Of a device: what is not given is 0."""

    heater, servo, joint = range(7), range(6), range(8)

    @property
    def connected(self):
        return bool(self["connected"])

    def __missing__(self, name):
        return "" if name.endswith(".name") else 0

    def word(self, name):
        return f"word {self[name]}"


def heater(i, name, **values):
    return {f"heater.{i:02}.{key.replace('_', '-')}": value
            for key, value in {"name": name, "state": 2, "temperature": 20.0, **values}.items()}


def show(shop, away=(), **states):
    """Devices of the gateway; None: one that has not been read."""
    readings = {name: types.SimpleNamespace(name=name, state=state, connected=state is not None and name not in away,
                                            reason="no cable") for name, state in states.items()}
    shop.hub.source.trouble = ""
    shop.hub.source.names = lambda: list(readings)
    shop.hub.source.read = readings.get


async def temperatures_are_those_of_heaters():
    shop = Shop(operate=False)
    one, other = shop.table.client(), shop.table.client("b")
    show(shop)
    assert shop.ask(one, b"M105\n") == "echo:no device\nok\n"
    bed = heater(0, "bed", temperature=59.96, target_in_effect=60.0, power=0.5)
    show(shop, a=State(bed))
    assert shop.ask(one, b"M105\n") == "ok B:59.96 /60.00 B@:64\n"
    assert "EXTRUDER_COUNT:0\n" in shop.ask(one, b"M115\n")
    show(shop, a=State(bed | heater(1, "hotend", temperature=200.126, target_in_effect=210.0, power=1.0)))
    assert shop.ask(one, numbered(1, "M105")) == "ok T:200.13 /210.00 B:59.96 /60.00 @:127 B@:64\n"
    assert "EXTRUDER_COUNT:1\nCap:EMERGENCY_PARSER:1\nCap:AUTOREPORT_TEMP:1\n" in shop.ask(one, b"M115\n").replace("\r", "")
    # several hot ends, of several devices; two beds
    show(shop, b=State(bed), a=State(bed | heater(1, "left") | heater(2, "Chamber") | heater(3, "none", state=0) |
                                     heater(4, "right", temperature=21.0)))
    assert shop.ask(one, b"M105\n") == ("ok T:20.00 /0.00 B:59.96 /60.00 C:20.00 /0.00 T0:20.00 /0.00 T1:21.00 /0.00 "
                                       "T2:59.96 /60.00 @:0 B@:64 C@:0 T0@:0 T1@:0 T2@:64\n")
    # the heaters of a device that is away keep their numbers, and T is never another hot end than the first
    show(shop, away="a", b=State(bed), a=State(bed | heater(1, "left")))
    assert shop.ask(one, b"M105\n") == "echo:a: no cable\nok T1:59.96 /60.00 T1@:64\n"
    assert "EXTRUDER_COUNT:2\n" in shop.ask(one, b"M115\n")
    # what is not known is left out, and said; a fault has a temperature
    show(shop, a=State(bed | heater(1, "hotend", temperature=None, condition=4)), b=None)
    assert shop.ask(one, b"M105\n") == "echo:b: no cable\necho:heater hotend: word 4\nok B:59.96 /60.00 B@:64\n"
    show(shop, a=State(heater(0, "hotend", temperature=None)))
    assert shop.ask(one, b"M105\n") == "echo:heater hotend: no temperature yet\nok\n"
    show(shop, a=State(heater(0, "bed", state=4, fault_code=7, power=None)))
    assert shop.ask(one, b"M105\n") == "echo:heater bed: word 7\nok B:20.00 /0.00 B@:0\n"
    # again and again, to who has asked
    for line in b"M155", b"M155 S", b"M155 S0.1", b"M155 S61", b"M155 S-1":
        assert shop.ask(one, line + b"\n") == "echo:not carried out: M155 takes S and seconds, 0.5 to 60, or 0\nok\n", line
    assert shop.ask(one, b"M155 S0.5\n") == "ok\n"
    found = ""
    while found.count("\n") < 2:
        await asyncio.sleep(0.05)
        found += shop.table.take(one).decode()
    assert set(found.splitlines()) == {" B:20.00 /0.00 B@:0"}, found
    brief, gone = shop.table.client("c"), shop.table.client("d")
    brief.hears = False         # a request
    assert "M155 needs a lasting connection" in shop.ask(brief, b"M155 S1\n")
    assert shop.ask(gone, b"M155 S0.5\n") == "ok\n"
    gone._level = lambda: ""    # its log-in has ended
    await asyncio.sleep(0.6)
    assert shop.table.take(gone) == b"" and gone not in shop.machine._reports._next
    assert shop.ask(one, b"M155 S60\n").endswith("ok\n") and shop.ask(one, b"M155 S0\n") == "ok\n"
    assert shop.ask(other, b"M155 S0.5\n") == "ok\n"
    await shop.machine.close()
    assert shop.table.take(one) == shop.table.take(other) == b""
    shop.table.quiet()


async def places_are_measured():
    shop = Shop(operate=False)
    one = shop.table.client()
    show(shop, a=State({"servo.00.name": "x", "servo.00.state": 2, "servo.00.pos-fb": 9.9975, "servo.00.commanded": 10.0,
                        "servo.00.counts-per-unit": 400.0, "servo.00.limit-minus": True,
                        "servo.01.name": "feed", "servo.01.state": 1, "servo.01.pos-fb": -1.0, "servo.01.commanded": -1.0,
                        "servo.01.counts-per-unit": -100.0,
                        "engine.axes-enabled": 3, "joint.00.name": "z", "joint.00.pulses-per-unit": 200.0,
                        "joint.00.counts": 1999, "joint.00.counts-cmd": 2000, "joint.00.home-sw": True,
                        "joint.00.mode-in-effect": 1, "joint.00.enabled": True,
                        "joint.02.name": "s", "joint.02.pulses-per-unit": -10.0, "joint.02.counts-cmd": 5000,
                        "joint.02.mode-in-effect": 2, "joint.02.enabled": True,
                        "joint.01.name": "axis.1", "joint.01.counts": 7, "joint.01.limit-pos": True}))
    assert shop.ask(one, b"M114\n") == ("X:9.9975 feed:-1.0000 Z:9.9950 S:0.0000 Count X:3999 feed:100 Z:1999 axis.1:7 S:0\n"
                                       "echo:commanded X:10.0000 feed:-1.0000 Z:10.0000 S:0.0000\nok\n")
    assert shop.ask(one, b"M119\n") == (
        "Reporting endstops status\nx_min: TRIGGERED\nx_max: open\nx_home: open\nfeed_min: open\nfeed_max: open\n"
        "feed_home: open\nz_min: open\nz_max: open\nz_home: TRIGGERED\naxis.1_min: open\naxis.1_max: TRIGGERED\n"
        "axis.1_home: open\ns_min: open\ns_max: open\ns_home: open\nok\n")
    show(shop, a=None)
    assert shop.ask(one, b"M114\n") == "echo:a: no cable\nok\n"
    assert shop.ask(one, b"M119\n") == "echo:a: no cable\nReporting endstops status\nok\n"
    show(shop, a=State({"engine.axes-enabled": 200}))
    assert shop.ask(one, b"M114\n").endswith(" axis.7:0\nok\n")
    show(shop)
    assert shop.ask(one, b"M114\n") == "echo:no device\nok\n"
    shop.table.quiet()


def the_manual_page_has_them_all():
    page = pathlib.Path(__file__).resolve().parents[2] / "man/pokeys-gateway.8.scd"
    section = re.search(r"^# G-CODE\n(.*?)^# ", page.read_text(encoding="utf-8"), re.M | re.S)[1]
    listed = {name for line in re.findall(r"^(\*(?:\?|\$J|[GM][\d.]+|T)\*.*)$", section, re.M)
              for name in re.findall(r"\*(\?|\$J|[GM][\d.]+|T)\*", line)}
    assert listed == set(commands.COMMANDS), listed ^ set(commands.COMMANDS)


def main():
    the_manual_page_has_them_all()
    lines_are_taken_apart()
    lines_have_several_commands_or_none()
    any_bytes_are_a_line_or_refused()
    modes_of_the_lines_before_a_place()
    for test in (the_asker_gets_the_reply, numbers_are_in_order, what_is_too_long_or_has_no_end_is_not_carried_out,
                 a_request_goes_on_with_the_modes_of_the_last_one, a_stop_is_confirmed_or_said_not_to_be,
                 nothing_is_wrong_with_a_stop, many_stops, a_stop_gets_through, temperatures_are_those_of_heaters,
                 places_are_measured):
        asyncio.run(test())
    print(f"{LINES} lines; POKEYS_SEED={SEED}")


if __name__ == "__main__":
    main()
