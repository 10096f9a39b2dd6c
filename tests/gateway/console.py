#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The console without doors, in virtual time: lines, routes, bounded queues, and no message is lost or kept."""
import os
import random

from desk import Table
from pokeys_gateway.console import router
from pokeys_gateway.console.client import INCOMING_MOST
from pokeys_gateway.console.framing import CR_S, IDLE_S, Framer
from pokeys_gateway.console.message import Part
from pokeys_gateway.doors.telnet import Terminal

SEED = int(os.environ.get("POKEYS_SEED", "20055"))


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


def lines_that_end_in_cr_are_counted_too():
    """All that waited is taken, so nothing waits any more: otherwise the outbox would be full for ever."""
    table = Table(lines=100)
    one = table.client()
    for number in range(500):
        for _ in range(50):
            table.send(table.machine, b"ok\r" if number % 2 else b"ok\r\n")
            table.run(0.05)
        assert len(one.outbox) == 50, (number, len(one.outbox))
        assert len(table.take(one).split()) == 50 and not len(one.outbox) and not one.outbox.dropped, number
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


def many_hearers_do_not_make_a_turn_long():
    table = Table()
    clients = [table.client(str(number)) for number in range(50)]
    table.machine.receive(b"".join(b"line %d\n" % number for number in range(1000)), table.now)
    table.router.run(table.now)
    copies = sum(len(one.outbox) for one in clients)
    assert router.COPIES_MOST <= copies < router.COPIES_MOST + len(clients), copies
    # and those who read nothing do not have thousands of messages, which would all end at once
    table.run()
    assert table.ledger.live < 50 * 20, table.ledger.live
    assert [table.take(one).count(b"\n") for one in clients] == 50 * [1000]
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
    assert two.decode(b"M105\r\0M112\r") + two.decode(b"\0M114\r\0") == b"M105\rM112\rM114\r"
    assert two.decode(b"a\0b\r") + two.decode(b"\n\0") == b"a\0b\r\n\0"
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


def main():
    for test in (lines_are_cut_where_they_end, what_comes_out_is_what_came_in, messages_go_three_ways,
                 without_a_machine_it_is_said, a_line_without_an_end_is_passed_on_later,
                 lines_of_two_clients_are_not_joined, a_line_that_waits_for_the_machine_is_not_ended,
                 another_machine_gets_no_rest, a_machine_without_room_holds_up_who_sends,
                 who_does_not_read_misses_lines_and_is_told, lines_that_end_in_cr_are_counted_too, long_lines_are_dropped_whole,
                 a_turn_is_short_and_fair, many_hearers_do_not_make_a_turn_long, terminals_negotiate, any_bytes_do_no_harm):
        test()
        print(f"ok: {test.__name__}")


if __name__ == "__main__":
    main()
