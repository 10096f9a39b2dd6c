#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The console's commands, levels and stops, without doors, in virtual time."""
import asyncio
import json
import pathlib
import socket

from desk import CLIENT_LINE, Table, anybody, hub_of
from pokeys_gateway import access
from pokeys_gateway.console import router
from pokeys_gateway.console.console import Console
from pokeys_gateway.console.framing import IDLE_S
from pokeys_gateway.console.table import SETTINGS, TABLE
from pokeys_gateway.gate import host_of


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
        table.machine.on_stop = lambda: {None: 3}
        table.send(c, b"G4 P1\n" + text + b"M105\n")
        assert table.take(table.machine) == b"\n" + text + b"M105\n"
        said = f"[stop by telnet c; lines not sent: {200 + 1 + 1 + 3 + 1}]\n".encode()
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
    # the same again in one go is one
    table.send(b, 100 * b"M112\n")
    assert table.router.stops == 2 and table.take(table.machine) == b"\nM112\n"
    # many of them, and a machine that takes nothing
    for _ in range(100):
        table.send(b, b"M112\n")
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
    table.send(b, b"G2\nG3 X\x18\x18$X\n?")
    assert table.take(table.machine) == b"\x18?$X\n"
    lines = int(table.take(a).split()[-1][:-1])
    assert table.take(b) == f"[stop by telnet b; lines not sent: {lines}]\n".encode() and 100 < lines < 204
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
    table.send(guest, b"!\x18?")
    assert table.take(guest).startswith(b"error: not sent: this needs level user"), "at once"
    table.send(guest, b"[ESP500]\n")
    assert table.take(guest) == b"guest\n", "it is not in the next line"
    table.send(guest, b"[ESP500]?!\n")
    assert table.take(guest).startswith(b"error: [ESP500] takes")
    assert table.machine.outbox.empty and table.take(b).startswith(b"error: [ESP500] takes")
    # G-code of another firmware is no stop
    table.send(b, b"M112\n")
    assert table.take(table.machine) == b"M112\n" and table.router.stops == 1
    for one in (a, guest):
        table.take(one)
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
    for test in (who_may_not_command_reads, commands_answer, who_is_gone_at_once_is_not_obeyed,
                 passwords_are_not_for_the_machine, whoever_is_no_user_any_more_has_no_line_waiting,
                 a_stop_goes_past_all_that_came_before, bytes_that_grbl_obeys_at_once, addresses_of_this_computer,
                 commands_are_described):
        test()
        print(f"ok: {test.__name__}")
    asyncio.run(a_command_that_takes_time_holds_up_its_client())


if __name__ == "__main__":
    main()
