#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The console without doors, in virtual time: lines, routes, bounded queues, and no message is lost or kept."""
import asyncio
import functools
import json
import os
import pathlib
import random
import socket

from pokeys_gateway import access, config, hub, model
from pokeys_gateway.console import commands, router, urgent
from pokeys_gateway.console.console import Console
from pokeys_gateway.console.client import INCOMING_MOST, Client
from pokeys_gateway.console.framing import CR_S, IDLE_S, Framer
from pokeys_gateway.console.message import Ledger, Part
from pokeys_gateway.console.outbox import Outbox
from pokeys_gateway.console.table import SETTINGS, TABLE
from pokeys_gateway.doors.telnet import Terminal
from pokeys_gateway.gate import host_of

SEED = int(os.environ.get("POKEYS_SEED", "20055"))
MACHINE_LINE, CLIENT_LINE = 1024, 1200


@functools.cache
def anybody():
    """Nobody has to log in; it takes a tenth of a second to make."""
    return access.Access(None, False)


def hub_of(**settings):
    """Without devices; nothing of it goes on."""
    return hub.Hub(config.Config(runtime_directory="/nowhere", **settings), model.Model({"names": [], "boards": []}))


class Table:
    """A router with clients; `now` goes on when it is said to."""

    def __init__(self, users=None, machine=True, lines=8192, size=256 << 10, firmware="marlin"):
        self.now = 100.0
        self.ledger = Ledger()
        self.access = access.Access(users, False) if users else anybody()
        self.commands = commands.Commands(self.access, TABLE, hub_of())
        self.router = router.Router(self.access, self.commands.execute, self.ledger, urgent.of(firmware))
        self.commands.router = self.router
        self.lines, self.size = lines, size
        self.machine = self.connect() if machine else None
        self.got = {}

    def connect(self):
        outbox = Outbox(self.ledger, router.MACHINE_LINES, router.MACHINE_BYTES, drops=False)
        self.machine = Client(self.ledger, "machine", "printer", most=MACHINE_LINE, level=lambda: "guest", outbox=outbox)
        self.router.connect(self.machine)
        return self.machine

    def client(self, name="a", level="user"):
        one = Client(self.ledger, "telnet", name, most=CLIENT_LINE, level=lambda: level,
                     outbox=Outbox(self.ledger, self.lines, self.size))
        self.router.join(one)
        return one

    def run(self, seconds=0.0):
        """Until nothing is to be done, and then so long; time passes only if nothing is to be done."""
        end = self.now + seconds
        while True:
            at = self.router.run(self.now)
            if at == 0:
                continue
            if at is None or at > end:
                self.now = end
                return
            assert at > self.now, "called again for nothing"
            self.now = at

    def send(self, one, data):
        one.receive(data, self.now)
        self.run()

    @staticmethod
    def take(one, size=1 << 30):
        """What would be sent to it."""
        found = one.outbox.take(size)
        data = b"".join(message.data for message in found)
        for message in found:
            message.release()
        return data

    def quiet(self):
        """Nobody has a message any more."""
        assert self.ledger.live == 0, self.ledger.live


def lines_are_cut_where_they_end():
    framer = Framer(10)
    framer.feed(b"ab\r\ncd\nef\r\n\r\n\rgh")
    found = []
    while one := framer.next():
        found.append(one)
    assert [data for data, _ in found] == [b"ab\r\n", b"cd\n", b"ef\r\n", b"\r\n", b"\r"]
    assert {part for _, part in found} == {Part.UNIQUE} and framer.next() is None
    assert framer.flush() == (b"gh", Part.UNIQUE) and framer.flush() is None
    framer.feed(25 * b"x" + b"\nyy")
    found = [framer.next() for _ in range(4)]
    assert found == [(10 * b"x", Part.HEAD), (10 * b"x", Part.CORE), (b"xxxxx\n", Part.TAIL), None]
    framer.feed(b"\n" + 10 * b"z" + b"rest")
    assert [framer.next() for _ in range(3)] == [(b"yy\n", Part.UNIQUE), (10 * b"z", Part.HEAD), None]
    assert framer.flush() == (b"rest", Part.TAIL)
    # an end that begins within the limit and ends behind it
    framer.feed(9 * b"w" + b"\r\n")
    assert framer.next() == (9 * b"w" + b"\r", Part.UNIQUE) and framer.next() == (b"\n", Part.UNIQUE)
    # CR waits for its LF, but not for long
    framer.feed(b"ok\r")
    assert framer.next() is None and framer.patience == CR_S
    framer.feed(b"\n")
    assert framer.next() == (b"ok\r\n", Part.UNIQUE) and framer.patience is None
    framer.feed(b"ok\r")
    assert framer.flush() == (b"ok\r", Part.UNIQUE)


def what_comes_out_is_what_came_in():
    rng = random.Random(SEED)
    for _ in range(300):
        most = rng.randrange(1, 40)
        framer = Framer(most)
        sent, found = bytearray(), []
        for _ in range(rng.randrange(30)):
            data = bytes(rng.choices(b"ab\r\n", (8, 8, 1, 1), k=rng.randrange(60)))
            sent += data
            framer.feed(data)
            while one := framer.next():
                found.append(one)
            if rng.random() < 0.2 and (one := framer.flush()):
                found.append(one)
        if one := framer.flush():
            found.append(one)
        assert b"".join(data for data, _ in found) == sent and all(0 < len(data) <= most for data, _ in found)
        inside = False
        for data, part in found:
            assert part.first != inside, "a part without its beginning"
            inside = not part.last
            assert b"\n" not in data[:-1] and (b"\r" not in data[:-1] or data[-2:] == b"\r\n")


def messages_go_three_ways():
    table = Table()
    a, b = table.client("a"), table.client("b")
    table.send(a, b"M105\nG28\n")
    assert table.take(table.machine) == b"M105\nG28\n" and a.outbox.empty and b.outbox.empty
    table.send(table.machine, b"ok T:20\r\nstart\n")
    assert table.take(a) == table.take(b) == b"ok T:20\r\nstart\n" and table.machine.outbox.empty
    table.send(a, b"[ESP500]\n[ESP500]json\n[ESP0]500\n[ESP999]\n[ESP]290 json\n")
    assert table.take(a).decode().splitlines() == [
        "user", '{"cmd":"500","status":"ok","data":"user"}',
        "[ESP500][user=NAME pwd=PASSWORD] - show what this client may do; log in",
        "error: there is no command [ESP999]; [ESP0] lists them",
        '{"cmd":"0","status":"ok","data":"[ESP290]MILLISECONDS - wait before the next line of this client"}']
    assert b.outbox.empty and table.machine.outbox.empty
    # whoever asks is answered: also the machine, and if the command is echoed
    table.send(table.machine, b"echo: [ESP500]\n")
    assert table.take(table.machine) == b"guest\n" and a.outbox.empty
    # no commands: not at the beginning, no number, or the rest of a long line
    table.send(a, b" [ESP500]\n[ESPx]\n[ESP1234]\n" + 1200 * b"x" + b"[ESP500]\n")
    assert table.take(table.machine) == b" [ESP500]\n[ESPx]\n[ESP1234]\n" + 1200 * b"x" + b"[ESP500]\n"
    table.send(a, b"[ESP500]" + 2000 * b" " + b"\nM105\n")
    assert table.take(a) == b"error: this command is too long\n" and table.take(table.machine) == b"M105\n"
    table.quiet()


def who_may_not_command_reads():
    secret = access.make_secret("long enough")
    table = Table({"anna": access.User("anna", "user", secret)})
    guest, nobody, user = table.client("g", "guest"), table.client("n", ""), table.client("u", "")
    user.who = access.Who(table.access.users["anna"])
    for one, said in ((guest, "error: not sent: t"), (nobody, "error: not sent: t")):
        table.send(one, b"M105\n\r\n" + 3000 * b"x" + b"\n")
        assert [line[:18] for line in table.take(one).decode().splitlines()] == 2 * [said]
    table.send(user, b"M105\n")
    assert table.take(table.machine) == b"M105\n"
    table.send(table.machine, b"ok\n")
    assert table.take(guest) == table.take(user) == b"ok\n" and nobody.outbox.empty
    table.send(nobody, b"[ESP420]\n[ESP420] json\n")
    assert table.take(nobody).count(b"level guest") == 2
    # who is no user any more
    table.access.reload({})
    table.send(user, b"M106\n")
    assert table.take(user).startswith(b"error: not sent: t") and table.machine.outbox.empty
    table.quiet()


def without_a_machine_it_is_said():
    table = Table(machine=False)
    a = table.client()
    table.send(a, b"M105\n" + 3000 * b"x" + b"\nM106\n")
    assert table.take(a).decode().splitlines() == 3 * [f"error: {table.router.why_no_machine}"]
    machine = table.connect()
    table.send(a, b"M105\n")
    assert len(machine.outbox) == 1
    # what waited for it is not sent to it when it comes back
    assert table.router.disconnect("the port is gone") == 1
    table.send(a, b"M105\n")
    assert table.take(a) == b"error: the port is gone\n"
    table.connect()
    assert table.machine.outbox.empty
    table.quiet()


def a_line_without_an_end_is_passed_on_later():
    table = Table()
    a = table.client()
    table.send(a, b"ab")
    table.run(IDLE_S - 0.1)
    assert table.machine.outbox.empty
    table.send(a, b"c")
    table.run(IDLE_S - 0.1)
    assert table.machine.outbox.empty
    table.run(0.2)
    assert table.take(table.machine) == b"abc"
    table.send(table.machine, b"Password: ")
    table.run(IDLE_S)
    assert table.take(a) == b"Password: "
    table.send(a, b"\n")
    assert table.take(table.machine) == b"\n"
    table.quiet()


def lines_of_two_clients_are_not_joined():
    table = Table()
    a, b = table.client("a"), table.client("b")
    table.send(a, b"G1 X1")
    table.run(IDLE_S)
    table.send(b, b"M105\nM114\n")
    assert table.take(table.machine) == b"G1 X1" and b.pending
    table.send(a, b"0\nG4\n")
    got = table.take(table.machine).splitlines()
    assert got[0] == b"0" and sorted(got[1:]) == [b"G4", b"M105", b"M114"]
    # a long line; also one that begins as a comment, or with nothing
    for first in b"; ", b"  ", b"$", b"(":
        table.send(a, first + (2002 - len(first)) * b"x")
        table.send(b, b"M105\n")
        assert table.take(table.machine) == first + (1200 - len(first)) * b"x"
        table.send(a, b"\n")
        assert table.take(table.machine) == 802 * b"x" + b"\nM105\n"
    # who does not go on leaves the machine to the others, however slowly it types; the rest is not sent
    table.send(a, b"G1 X2")
    table.run(IDLE_S)
    table.send(b, b"M105\n")
    for _ in range(4):
        table.run(router.OPEN_S / 4 - 0.1)
        table.send(a, b"2")
    table.run(IDLE_S)
    assert table.take(table.machine).endswith(b"\nM105\n") and table.router.ended == 1
    table.send(a, b"0\nM114\n")
    assert table.take(table.machine) == b"M114\n" and table.take(a).startswith(b"error: your line had no end for 10 s")
    # the rest of a long line neither
    table.send(a, b";" + 1199 * b"x")
    table.run(router.OPEN_S)
    table.send(a, b"G28\nM114\n")
    assert table.take(table.machine) == b";" + 1199 * b"x" + b"\nM114\n" and table.take(a).count(b"\n") == 1
    # who goes away
    table.send(a, b"G1 X3")
    table.run(IDLE_S)
    table.send(b, b"M105\n")
    table.router.leave(a)
    table.run()
    assert table.take(table.machine) == b"G1 X3\nM105\n"
    # but what is not passed on yet is not
    c = table.client("c")
    table.send(c, b"G1 X4")
    table.router.leave(c)
    table.run(IDLE_S)
    assert table.machine.outbox.empty
    # an answer to the machine waits for the line's end
    c = table.client("c")
    table.send(c, b"G1 X1")
    table.run(IDLE_S)
    table.send(table.machine, b"[ESP500]\n[ESP290]60000\n[ESP500]pwd=x\nok\n")
    assert table.take(b) == table.take(c) == b"ok\n" and table.take(table.machine) == b"G1 X1"
    table.send(c, b"0\n")
    assert table.take(table.machine) == b"0\nguest\nerror: not for the machine\nerror: not for the machine\n"
    table.quiet()


def a_line_that_waits_for_the_machine_is_not_ended():
    table = Table()
    a, b = table.client("a"), table.client("b")
    table.send(b, (router.MACHINE_LINES - 1) * b"M105\n")
    table.send(a, b"G1 X1")
    table.run(IDLE_S)
    table.send(a, b"00\n")
    table.run(5 * router.OPEN_S)
    assert len(table.machine.outbox) == router.MACHINE_LINES and a.held
    assert table.take(table.machine).endswith(b"M105\nG1 X1")
    table.run()
    assert table.take(table.machine) == b"00\n" and not table.router.ended
    table.quiet()


def another_machine_gets_no_rest():
    table = Table()
    a = table.client()
    for begun in b"G1 X1", b";" + 1199 * b"x":
        table.send(a, begun)
        table.run(IDLE_S)
        table.router.disconnect("unplugged")
        table.connect()
        table.send(a, b"0\nM105\n")
        assert table.take(table.machine) == b"M105\n"
    table.quiet()


def commands_answer():
    table = Table()
    a = table.client("a", "admin")

    def ask(text):
        table.send(a, text.encode() + b"\n")
        return table.take(a).decode()[:-1]
    assert ask("[ESP111]") == "127.0.0.1" and ask("[ESP111]ALL") == "ip: 127.0.0.1"
    assert ask("[ESP111] json=yes ALL") == '{"cmd":"111","status":"ok","data":{"ip":"127.0.0.1"}}'
    assert ask("[ESP112]") == socket.gethostname() and "hostnamectl" in ask("[ESP112]mill")
    assert (ask("[ESP130]"), ask("[ESP131]"), ask("[ESP120]")) == ("OFF", "none", "OFF")
    assert ask("[ESP130]ON") == "error: this is set with listen in [telnet] in /etc/pokeysd/gateway.conf; " \
        "restart the gateway then"
    closed = []
    a.on_close = lambda: closed.append(a)
    assert ask("[ESP130]CLOSE") == "ok" and closed == [a]
    assert ask("[ESP201]P=1") == ask("[ESP220]") == "error: not looked for a daemon yet"
    assert ask("[ESP201]P=1 V=1") == "error: the gateway only reads devices" and "P=TERMINAL" in ask("[ESP201]")
    assert ask("[ESP410]") == "Start Scan\nEnd Scan" and ask("[ESP410]json") == '{"cmd":"410","status":"ok","data":[]}'
    rows = json.loads(ask("[ESP400]json"))["data"]
    assert all({"F", "P", "T", "V", "H"} <= row.keys() and all(isinstance(value, (str, list)) for value in row.values())
               for row in rows), rows
    assert {row["P"] for row in rows} <= set(SETTINGS)
    assert "system/system/baud: 115200" in ask("[ESP400]").splitlines()
    assert ask("[ESP401]P=112 T=I V=9600 json") == (
        '{"cmd":"401","status":"error","data":"this is set with baud in [machine] in /etc/pokeysd/gateway.conf; '
        'restart the gateway then"}')
    assert ask("[ESP401]T=I V=1") == "error: Invalid parameter P" and "unknown" in ask("[ESP401]P=9 T=I V=1")
    restarts = []
    table.commands.on_restart = lambda: restarts.append(1)
    assert ask("[ESP444]RESTART") == "Now restarting..." and restarts and "RESTART" in ask("[ESP444]")
    assert ask("[ESP510]") == "720" and ask("[ESP550]") == "********"
    assert ask("[ESP555]new") == "error: the gateway may not change passwords; run: sudo pokeys-gateway --set-user user"
    found = json.loads(ask("[ESP800]json=yes time=2026-11-28T12:00:00 tz=+01:00 version=3.0.0-a11"))["data"]
    assert (found["FWTarget"], found["FWTargetID"], found["Authentication"]) == ("marlin", "20", "Disabled")
    assert ask("[ESP800]").startswith("Capabilities:\nFWVersion: pokeys-gateway ")
    assert ask("[ESP900]").startswith("error: no machine is configured") and ask("[ESP901]") == "115200"
    assert ask("[ESP420]").startswith("Configuration:\nFW ver: ")
    guest = table.client("guest", "guest")
    for text in b"[ESP444]RESTART", b"[ESP130]CLOSE", b"[ESP550]x", b"[ESP401]P=112 T=I V=1":
        table.send(guest, text + b"\n")
        assert table.take(guest) == b"error: this needs level admin; log in with [ESP500]user=NAME pwd=PASSWORD\n", text
    table.quiet()


def who_is_gone_at_once_is_not_obeyed():
    table = Table()
    a, b = table.client("a"), table.client("b")
    table.send(a, b";" + 2000 * b"x" + b"\nG1 X1\n")
    table.send(b, b"G1 Y1\n")
    table.send(a, b"G1 X2\n")
    assert table.take(table.machine, 1) == b";" + 1199 * b"x"
    # the line that the machine has begun to get is ended, the others are not sent
    table.router.leave(a, at_once=True)
    assert table.take(table.machine) == 801 * b"x" + b"\nG1 Y1\n"
    table.send(b, b"G1 Z")
    table.run(IDLE_S)
    table.router.leave(b, at_once=True)
    assert table.take(table.machine) == b"\n"
    table.quiet()


def passwords_are_not_for_the_machine():
    table = Table()
    a = table.client()
    # typed slowly
    for piece in b"[E", b"SP5", b"00", b"]user=anna", b" pwd=secret", b"\n":
        table.send(a, piece)
        table.run(2 * IDLE_S)
    assert table.take(a) == b"user\nerror: not sent: it continues a command\n" and table.machine.outbox.empty
    table.send(a, b"M105\n[ESP500]")
    table.run(IDLE_S)
    table.send(a, b"\nM114\n")
    assert table.take(table.machine) == b"M105\nM114\n" and table.take(a) == b"user\n"
    # without line ends at all
    for _ in range(2):
        table.send(a, b"[ESP500]")
        table.run(IDLE_S)
    assert table.take(a) == b"user\nuser\n"
    table.quiet()


def whoever_is_no_user_any_more_has_no_line_waiting():
    secret = access.make_secret("long enough")
    table = Table({"anna": access.User("anna", "user", secret)})
    a = table.client("a", "")
    a.who = access.Who(table.access.users["anna"])
    table.send(a, 80 * b"M104 S200\n")
    assert a.held
    table.access.reload({})
    assert table.take(table.machine).count(b"M104") == router.MACHINE_LINES
    table.run()
    assert table.machine.outbox.empty and table.take(a).count(b"level user") == 80 - router.MACHINE_LINES
    table.quiet()


def a_machine_without_room_holds_up_who_sends():
    table = Table()
    a, b = table.client("a"), table.client("b")
    lines = b"".join(b"N%d\n" % number for number in range(3000))
    reads = True

    def room():
        nonlocal reads
        reads = True
    a.on_room = room
    sent = taken = b""
    while len(taken) < len(lines):
        while len(sent) < len(lines) and reads:
            table.send(a, lines[len(sent):len(sent) + 4096])
            sent = lines[:len(sent) + 4096]
            reads = not a.full
        table.send(b, b"[ESP500]\n")            # the others notice nothing
        assert table.take(b) == b"user\n"
        assert len(table.machine.outbox) <= router.MACHINE_LINES and len(sent) - len(taken) < INCOMING_MOST + 8192
        taken += table.take(table.machine, 500)
        table.run()
    assert taken == lines and not table.machine.outbox.dropped
    # who goes away is not obeyed
    table.send(a, 200 * b"M105\n")
    table.router.leave(a)
    assert table.take(table.machine).count(b"M105") == router.MACHINE_LINES
    table.run()
    assert table.machine.outbox.empty
    table.quiet()


def who_does_not_read_misses_lines_and_is_told():
    table = Table(lines=100)
    live, frozen = table.client("live"), table.client("frozen")
    heard = b""
    for number in range(10_000):
        table.send(table.machine, b"line %d\n" % number)
        heard += table.take(live)
    assert heard == b"".join(b"line %d\n" % number for number in range(10_000)) and not live.outbox.dropped
    got = table.take(frozen).splitlines()
    assert got[0] == b"[dropped 9900]" and got[1:] == [b"line %d" % number for number in range(9900, 10_000)]
    assert table.router.dropped == frozen.outbox.dropped == 9900
    table.send(table.machine, b"more\n")
    assert table.take(frozen) == b"more\n"
    table.router.leave(frozen)
    assert table.router.dropped == 9900
    table.take(live)
    table.quiet()


def long_lines_are_dropped_whole():
    rng = random.Random(SEED)
    for _ in range(100):
        table = Table(lines=rng.randrange(1, 12))
        one = table.client()
        sent, got = [], b""
        for number in range(rng.randrange(60)):
            line = b"%d:" % number + rng.choice((0, 0, 900, 1100, 2500, 6000)) * b"x"
            sent.append(line)
            data = line + b"\n"
            while data:
                size = rng.randrange(1, 3000)
                table.send(table.machine, data[:size])
                data = data[size:]
                if rng.random() < 0.1:
                    got += table.take(one, rng.randrange(1, 4000))
                if rng.random() < 0.1:
                    table.send(one, b"[ESP500]\n")
        got += table.take(one)
        told = sum(int(line[9:-1]) for line in got.splitlines() if line.startswith(b"[dropped"))
        whole = [line for line in got.splitlines() if line in sent]
        # answers are lines too, and may be in the middle of one that comes in parts
        assert told == one.outbox.dropped and [line for line in sent if line in whole] == whole
        assert len(whole) + told + got.count(b"user") >= len(sent), (len(whole), told, len(sent))
        table.quiet()


def a_stop_goes_past_all_that_came_before():
    for text in (b"M112\n", b"m410 ; now\r\n", b" N7 M112*33\n"):
        table = Table()
        a, b, c = table.client("a"), table.client("b"), table.client("c")
        a.receive(200 * b"G1 X1\n", table.now)
        table.run()
        b.receive(b"G28\nG1 Y2", table.now)
        table.run()
        assert len(table.machine.outbox) == router.MACHINE_LINES and a.pending and b.pending
        # the rest of the wire's lines are forgotten too
        table.machine.on_stop = lambda: 3
        table.send(c, b"G4 P1\n" + text + b"M105\n")
        assert table.take(table.machine) == b"\n" + text + b"M105\n"
        said = f"[stopped by telnet c; lines not sent: {200 + 1 + 1 + 3 + 1}]\n".encode()
        deaf = router.DEAF.encode() + b"\n"
        assert [table.take(one) for one in (a, b, c)] == [deaf + said, deaf + said, said] and table.router.stops == 1
        # who is in the middle of a programme goes on sending it: until it pauses, not even a rest is taken
        for _ in range(10):
            table.run(router.DEAF_S - 0.1)
            table.send(a, b"G1 X2\nG1 X")
        table.send(b, b"0\nG1 Z1\n")
        assert table.take(table.machine) == b"G1 Z1\n"
        table.run(router.DEAF_S)
        table.send(a, b"3\nG1 X4\n")
        assert table.take(table.machine) == b"G1 X4\n"
        # but a stop is taken at any time
        table.send(a, 200 * b"G1 X1\n")
        table.send(b, b"M112\n")
        table.send(a, b"G1\nM112\nM105\n")
        assert table.take(table.machine) == b"\nM112\n\nM112\nM105\n" and table.router.stops == 3
        for one in (a, b, c):
            table.take(one)
        table.quiet()
    table = Table()
    a, b = table.client("a"), table.client("b")
    # a line is begun, and stopped by somebody else
    table.send(a, b"G1 X1")
    table.run(IDLE_S)
    assert table.take(table.machine) == b"G1 X1"
    table.send(b, b"M1")
    table.send(b, b"12\n")
    table.send(a, b"0\nM105\n")
    assert table.take(table.machine) == b"\nM112\nM105\n" and not a.skips
    # M108 stops nothing, and waits for a line that is begun
    for one in a, b:
        table.take(one)
    table.send(a, 200 * b"G1 X1\n")
    table.send(b, b"M108\n")
    assert table.take(table.machine, 1).startswith(b"M108\nG1 X1\n") and a.pending
    table.router.leave(a)
    table.take(table.machine)
    # no stops: not at the beginning of a line, other numbers, of a guest, a long line's rest
    guest = table.client("guest", "guest")
    table.send(b, b"G1 X1 M112\nM1120\nM112.1\nM11\n;M112\n" + 1200 * b"x" + b"M112\n")
    table.send(guest, b"M112\n")
    assert table.router.stops == 1 and b"level user" in table.take(guest)
    table.take(table.machine)
    # many of them, and a machine that takes nothing
    table.send(b, 100 * b"M112\n")
    said = table.take(b)
    assert said.count(b"the machine takes nothing") == 100 - router.URGENT_MOST
    assert table.take(table.machine) == router.URGENT_MOST * b"\nM112\n"
    table.take(guest)
    table.quiet()


def bytes_that_grbl_obeys_at_once():
    table = Table(firmware="grbl")
    a, b = table.client("a"), table.client("b")
    table.send(a, 200 * b"G1 X1\n")
    table.send(b, b"G1?Y1!\n\x85~")
    assert table.take(table.machine, 1).startswith(b"?!\x85~G1 X1\n")
    table.send(b, b"G2\nG3 X\x18$X\n?")
    assert table.take(table.machine) == b"\x18?$X\n"
    lines = int(table.take(a).split()[-1][:-1])
    assert table.take(b) == f"[stopped by telnet b; lines not sent: {lines}]\n".encode() and 100 < lines < 204
    a.deaf_until = 0.0
    # nothing is left of a line that had only these
    table.send(b, b"?\n?\r\n\n")
    table.send(b, b"G4")
    table.send(b, b"?\n")
    assert table.take(table.machine) == b"???\nG4\n"
    # of a command of ours they are none, also if it comes in parts, and a guest has none
    guest = table.client("guest", "guest")
    table.send(b, b"[ESP5")
    table.send(b, b"00]?!x\n")
    table.send(guest, b"!\n")
    assert table.machine.outbox.empty and table.take(b).startswith(b"error: [ESP500] takes")
    # G-code of another firmware is no stop
    table.send(b, b"M112\n")
    assert table.take(table.machine) == b"M112\n" and table.router.stops == 1
    for one in (a, guest):
        table.take(one)
    table.quiet()


def a_turn_is_short_and_fair():
    table = Table()
    noisy, quiet = table.client("noisy"), table.client("quiet")
    noisy.receive(1000 * b"[ESP500]\n", table.now)
    quiet.receive(b"[ESP500]\n", table.now)
    assert table.router.run(table.now) == 0 and len(noisy.outbox) + len(quiet.outbox) == router.TICK_MOST
    assert len(quiet.outbox) == 1
    # two who have the same to say have the same turns
    other = table.client("other")
    for client in noisy, other:
        client.receive(100 * b"[ESP500]\n", table.now)
    before = len(noisy.outbox)
    for _ in range(4):
        table.router.run(table.now)
    assert abs(len(noisy.outbox) - before - len(other.outbox)) <= 1
    table.run()
    assert len(noisy.outbox) == 1100
    for client in noisy, quiet, other:
        table.take(client)
    table.quiet()


async def a_command_that_takes_time_holds_up_its_client():
    secret = access.make_secret("long enough")
    table = Table({"anna": access.User("anna", "user", secret)})
    a, b = table.client("a", ""), table.client("b", "user")

    async def until(test):
        while not test():
            await asyncio.sleep(0.001)
            table.run()
    table.send(a, b"[ESP500]user=anna pwd=long\\ enough\nM105\n[ESP290]1\nM106\n")
    table.send(b, b"[ESP500]\n")
    assert table.take(b) == b"user\n" and table.machine.outbox.empty
    await until(lambda: len(table.machine.outbox) == 2)
    assert table.take(a) == b"user\nok\n" and table.take(table.machine) == b"M105\nM106\n"
    b.address = "127.0.0.2"
    table.send(b, b"[ESP500]pwd=wrong json\n[ESP290]x\n[ESP290]60001\n")
    await until(lambda: len(b.outbox) == 3)
    said = table.take(b).decode().splitlines()
    assert said[0] == '{"cmd":"500","status":"error","data":"wrong user name or password"}'
    assert said[1] == said[2] == "error: [ESP290] takes the milliseconds to wait, 0 to 60000"
    # who is gone gets no answer, and nothing is left of it
    table.send(a, b"[ESP290]1\nM105\n")
    table.router.leave(a)
    await asyncio.sleep(0.01)
    table.run()
    assert table.machine.outbox.empty
    table.commands.close()
    table.quiet()


def terminals_negotiate():
    one = Terminal()
    assert one.decode(b"M105\r\n\0\xf0") == b"M105\r\n\0\xf0" and one.encode(b"a\n\xf0") == b"a\n\xf0"
    # what PuTTY sends first: each refused once, and then lines are those of a terminal
    assert one.decode(b"\xff\xfb\x1f\xff\xfb\x18\xff\xfd\x01\xff\xfe\x03\xff\xfc\x03") == b"" and one.virtual
    assert one.replies == b"\xff\xfe\x1f\xff\xfe\x18\xff\xfc\x01"
    assert one.decode(b"a\r\nb\r\0c\r") == b"a\nb\rc" and one.decode(b"\nd\rx") == b"\nd\rx"
    assert one.decode(b"\xff\xff\xff\xfa\x18\0ab\xff\xffc\xff\xf0e\xff\xf6") == b"\xffe"
    assert one.replies.endswith(b"[yes]\r\n")
    # a plain socket's data, and the beginning of a negotiation that comes in parts
    two = Terminal()
    assert two.decode(b"M117 \xff\nM105\n\xff\xff") == b"M117 \xff\nM105\n\xff\xff" and not two.virtual
    assert two.decode(b"a\xff") + two.decode(b"\xfb") + two.decode(b"\x1fM105\r") + two.decode(b"\n") == b"aM105\n"
    assert two.virtual and two.replies == b"\xff\xfe\x1f"
    assert one.encode(b"ok\nT:1\r\n\xff\r") == b"ok\r\nT:1\r\n\xff\xff\r\0"
    rng = random.Random(SEED)
    for _ in range(300):
        one = Terminal()
        one.decode(b"\xff\xfb\x01")
        data = bytes(rng.choices((10, 65, 66, 255), k=rng.randrange(200)))
        wire, got = one.encode(data), b""
        while wire:
            size = rng.randrange(1, 20)
            got += one.decode(wire[:size])
            wire = wire[size:]
        assert got == data


def any_bytes_do_no_harm():
    rng = random.Random(SEED)
    words = (b"[ESP", b"[ESP0]", b"[ESP420]json", b"]", b"json=", b"pwd", b"\\", b" ", b"\n", b"\r", b"\xff", b"\0",
             b"echo: ", b"\xe4", 1300 * b"y", b"G1 X1", b"M112\n", b"M410", b"?", b"\x18")
    for _ in range(200):
        table = Table(machine=rng.random() < 0.8, lines=rng.randrange(1, 50), firmware=rng.choice(("marlin", "grbl")))
        clients = [table.client(str(number), rng.choice(("", "guest", "user", "admin"))) for number in range(3)]
        for _ in range(rng.randrange(60)):
            one = rng.choice([*clients, *([table.machine] if table.machine else [])])
            table.send(one, b"".join(rng.choices(words, k=rng.randrange(1, 8))))
            table.run(rng.choice((0, 0, 0.1, 2, 11)))
            if rng.random() < 0.3:
                table.take(rng.choice(clients), rng.randrange(1, 3000))
            if table.machine and rng.random() < 0.5:
                table.take(table.machine)
            if table.machine and rng.random() < 0.03:
                table.router.disconnect("gone")
                table.machine = None
        for one in clients:
            table.router.leave(one)
        table.router.disconnect("gone")
        table.run(100)
        table.quiet()


def addresses_of_this_computer():
    one = Console(anybody(), hub_of(console_level="user"))
    for address, level in (("127.0.0.1", "user"), ("::1", "user"), ("192.168.1.5", "guest"), ("fe80::1", "guest")):
        client = one.client("telnet", "x", CLIENT_LINE, address)
        assert one.level(client) == level and client.address == (address if level == "user" else host_of(address))


def commands_are_described():
    root = pathlib.Path(__file__).resolve().parents[2]
    for path in "docs/console.md", "man/pokeys-gateway.8.scd":
        text = (root / path).read_text(encoding="utf-8").replace("\\[", "[").replace("\\]", "]")
        missing = [number for number in TABLE if f"[ESP{number}]" not in text]
        assert not missing, f"{path}: {missing}"


def main():
    for test in (commands_are_described, addresses_of_this_computer, lines_are_cut_where_they_end, what_comes_out_is_what_came_in, messages_go_three_ways,
                 who_may_not_command_reads, without_a_machine_it_is_said, a_line_without_an_end_is_passed_on_later,
                 lines_of_two_clients_are_not_joined, a_line_that_waits_for_the_machine_is_not_ended,
                 another_machine_gets_no_rest, who_is_gone_at_once_is_not_obeyed, commands_answer, passwords_are_not_for_the_machine,
                 whoever_is_no_user_any_more_has_no_line_waiting, a_machine_without_room_holds_up_who_sends,
                 who_does_not_read_misses_lines_and_is_told, long_lines_are_dropped_whole,
                 a_stop_goes_past_all_that_came_before, bytes_that_grbl_obeys_at_once, a_turn_is_short_and_fair,
                 terminals_negotiate, any_bytes_do_no_harm):
        test()
        print(f"ok: {test.__name__}")
    asyncio.run(a_command_that_takes_time_holds_up_its_client())


if __name__ == "__main__":
    main()
