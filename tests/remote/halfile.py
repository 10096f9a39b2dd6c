#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""HAL files that make components and wait for clients, and the control socket they use."""
import contextlib
import json
import os
import pathlib
import re
import resource
import signal
import socket
import subprocess
import sys
import time

import rig
from linuxcncrig import ADDRESS, Control
from rig import NOBODY, halcmd, listed, of_other_users, wait


HAL_FILE = """\
loadusr -w pokeys-remote newcomp panel
loadusr -w pokeys-remote newpin panel panel.start bit out
loadusr -w pokeys-remote newpin panel panel.speed float in
loadusr -w pokeys-remote newpin panel panel.count s32 io
loadusr -w pokeys-remote newpin panel panel.jog float out
loadusr -w pokeys-remote newpin panel panel.mask u32 out
loadusr -w pokeys-remote ready panel
net start panel.start
net speed panel.speed
sets speed 2.5
"""


def command(*words):
    """A command of pokeys-remote: its status and what it printed."""
    ran = subprocess.run(["/usr/bin/python3", "-B", sys.argv[1], *map(str, words)], capture_output=True, text=True,
                         stdin=subprocess.DEVNULL, check=False, timeout=rig.PATIENCE)
    assert not ran.stdout, ran.stdout
    assert ran.stderr.count("\n") == (1 if ran.returncode else 0), ran.stderr
    return ran.returncode, ran.stderr.strip()


def fine(*words):
    assert command(*words) == (0, "")


def refused(status, text, *words):
    got, said = command(*words)
    assert got == status and text in said, (words, got, said)


def started(*words):
    """A command that goes on."""
    return subprocess.Popen(["/usr/bin/python3", "-B", sys.argv[1], *map(str, words)], stderr=subprocess.PIPE, text=True,
                            stdin=subprocess.DEVNULL)


def ended(child, status=0, text=""):
    said = child.communicate(timeout=rig.PATIENCE)[1]
    assert child.returncode == status and text in said, (child.args, child.returncode, said)


def asks(machine, number):
    """So many connections wait at the control socket. They are those of the commands that were started."""
    def there():
        rows = pathlib.Path("/proc/net/unix").read_text(encoding="ascii").splitlines()
        # listening, then one line for each connection
        return sum(row.endswith("@pokeys-remote/pokeys-remote") for row in rows) == number + 1
    wait(f"{number} connections: {machine.said()}", there)


def run_hal(machine, text):
    """A HAL file; its status and what was printed."""
    path, log = (pathlib.Path(machine.folder.name, name) for name in ("test.hal", "hal.log"))
    path.write_text(text, encoding="utf-8")
    # into a file, because what it starts goes on and would hold a pipe open
    with open(log, "wb") as to:
        ran = subprocess.run(["halcmd", "-f", path], stdin=subprocess.DEVNULL, stdout=to, stderr=to, check=False,
                             cwd=machine.folder.name, timeout=rig.PATIENCE,
                             env={**os.environ, "PATH": f"{pathlib.Path(sys.argv[1]).parent}:{os.environ['PATH']}"})
    return ran.returncode, log.read_text(encoding="utf-8")


def the_files_of_the_chapter(machine):
    """Configuration and HAL file as docs/remote.md has them, and a panel that is there first."""
    page = (rig.ROOT / "docs/remote.md").read_text(encoding="utf-8")
    conf = re.search(r"^```\n(\[remote\]\ncreate = no\n.*?)^```$", page, re.M | re.S)[1]
    lines = re.search(r"^```\n(loadusr -W pokeys-remote --config panel.conf\nloadusr -w .*?)^```$", page, re.M | re.S)[1]
    pathlib.Path(machine.folder.name, "panel.conf").write_text(conf, encoding="utf-8")
    kinds, ways = {"bit": rig.BIT, "float": rig.FLOAT}, {"in": rig.IN, "out": rig.OUT}
    pins = re.findall(r"newpin +panel panel\.(\S+) +(\S+) +(\S+)", lines)
    panel = machine.client(pins=tuple((name, kinds[kind], ways[way]) for name, kind, way in pins))
    panel.send(256, comp=[panel.description()])
    panel.subscribe()
    assert "halui." in lines and "waitbound panel" in lines
    # without LinuxCNC's user interface
    status, said = run_hal(machine, re.sub(r" +(=> +)?halui\.\S+( +=>)?", "", lines))
    assert status == 0, said
    answer = panel.answer()
    assert answer.type == 257, answer
    panel.until(288)
    assert machine.get("panel.bound") is True
    shown = halcmd("show", "pin", "panel")
    assert all(re.search(rf"panel\.{name} (==>|<==) ", shown) for name, _, _ in pins), shown


def pins_before_the_client(machine):
    machine.proxy("[pin panel.jog]\nfailsafe = 0.5\n")
    status, said = run_hal(machine, HAL_FILE)
    assert status == 0, said
    assert "component panel: created for a HAL file" in machine.said()
    fine("waitacquired", "panel", "--timeout", 0)
    fine("waitunbound", "panel", "--timeout", 0)
    assert machine.get("panel.jog") == 0.5 and machine.get("panel.bound") is False
    one = machine.client().connect()
    assert one.values["speed"] == 2.5
    fine("waitbound", "panel")
    one.set(start=True)
    assert halcmd("gets", "start").strip() == "TRUE"
    refused(75, "waitunbound: a client receives the values of component panel; waited for 0.1 s", "waitunbound", "panel",
            "--timeout", 0.1)
    waiting = started("waitunbound", "panel")
    asks(machine, 1)
    one.sub.unsubscribe(b"panel")
    ended(waiting)


def clients_that_bind_before(machine):
    """Whose component is not there yet: they get an answer when it is."""
    machine.proxy("[remote]\ncreate = no\n")
    one, two, other = machine.client(), machine.client(), machine.client("pedal", rig.PANEL[:1])
    one.send(256, comp=[one.description()])
    one.quiet()
    fine("newcomp", "panel")
    two.send(256, comp=[two.description(rig.PANEL[:2], no_create=True)])
    other.send(256, comp=[other.description()])
    for each in (one, two, other):
        each.quiet()
    # who asks again gets one answer
    one.send(256, comp=[one.description()])
    one.quiet()
    for name, kind, way in rig.PANEL:
        fine("newpin", "panel", f"panel.{name}", {1: "bit", 2: "float", 3: "s32", 4: "u32"}[kind],
             {16: "in", 32: "out", 48: "io"}[way])
    one.quiet()
    fine("ready", "panel")
    assert one.answer().type == 257
    one.quiet()
    assert "pin panel.mask is missing in the request" in two.answer().note
    other.quiet()
    assert "component panel: the client at 127.0.0.1:" in machine.said()


def a_draft_keeps_clients_from_creating(machine):
    machine.proxy()
    one = machine.client()
    fine("newcomp", "panel")
    one.send(256, comp=[one.description()])
    one.quiet()
    fine("newpin", "panel", "panel.start", "bit", "out")
    fine("ready", "panel")
    assert "component panel has no pin panel.jog" in one.answer().note
    assert one.bind(rig.PANEL[:1]).type == 257


def a_client_was_first(machine):
    machine.proxy()
    machine.client().connect()
    status, said = run_hal(machine, HAL_FILE)
    assert status == 0, said
    fine("newcomp", "panel")
    fine("newpin", "panel", "panel.start", "float", "out")
    refused(1, "ready: there is another component panel already: pin panel.start is bit and OUT here, and float and OUT "
            "in the HAL file; pin panel.jog is missing in the HAL file", "ready", "panel")
    refused(1, "component panel is ready already; its pins come between newcomp and ready", "newpin", "panel",
            "panel.x", "bit", "in")


def what_is_refused(machine):
    machine.proxy("[pin panel.gone]\nfailsafe = 0\n")
    refused(1, 'newcomp: the component\'s name "a.b" is not allowed; allowed: a letter', "newcomp", "a.b")
    refused(1, "newpin: there is no component panel; newcomp panel begins it", "newpin", "panel", "panel.a", "bit", "in")
    refused(1, "ready: there is no component panel; newcomp panel begins it", "ready", "panel")
    fine("newcomp", "panel")
    refused(1, 'pin "a" is not of component panel; its name has to begin with "panel."', "newpin", "panel", "a", "bit",
            "in")
    refused(1, "which each remote component has besides", "newpin", "panel", "panel.age", "float", "in")
    fine("newpin", "panel", "panel.a", "bit", "in")
    refused(1, "pin panel.a is there twice", "newpin", "panel", "panel.a", "float", "in")
    refused(75, "waitacquired: component panel is not ready; waited for 0 s", "waitacquired", "panel", "--timeout", 0)
    refused(1, "the configuration has a section [pin panel.gone], and component panel has no such pin", "ready", "panel")
    refused(1, "there is no component panel; newcomp panel begins it", "ready", "panel")
    refused(75, "waitbound: there is no component panel; waited for 0 s", "waitbound", "panel", "--timeout", 0)
    refused(75, "waitunbound: there is no component panel; waited for 0 s", "waitunbound", "panel", "--timeout", 0)
    fine("newcomp", "pan")
    fine("ready", "pan")
    refused(1, "clients of component pan would also get the messages of panel", "newcomp", "panel")
    refused(64, "argument TYPE: invalid choice: 'int'", "newpin", "panel", "panel.a", "int", "in")
    refused(64, '"-1" is not a number of seconds from 0 to 86400', "waitbound", "panel", "--timeout=-1")
    refused(64, "unrecognized arguments: timer=100", "newcomp", "panel", "timer=100")
    refused(64, "newcomp reads no configuration; the proxy does", "--config", "x", "newcomp", "panel")
    refused(69, "there is no proxy with the name other; loadusr -Wn other pokeys-remote --name other starts it", "--name", "other",
            "waitbound", "panel")
    # LinuxCNC does not start then
    status, said = run_hal(machine, "loadusr -w pokeys-remote newpin none none.a bit out\nsetp x.y 1\n")
    assert status != 0 and "newpin: there is no component none; newcomp none begins it" in said and "x.y" not in said, said


def a_file_that_is_loaded_again(machine):
    """What the first one began is dropped, and is not left as a part of the component."""
    machine.proxy()
    fine("newcomp", "panel")
    fine("newpin", "panel", "panel.wrong", "bit", "in")
    status, said = run_hal(machine, HAL_FILE)
    assert status == 0, said
    assert "panel.wrong" not in halcmd("show", "pin", "panel")
    assert "component panel: newcomp came again before ready; 1 pins of the first one are dropped" in machine.said()


def the_name_of_a_draft_is_taken(machine):
    machine.proxy()
    fine("newcomp", "panel")
    refused(1, "clients of component pan would also get the messages of panel", "newcomp", "pan")
    assert "would also get the messages" in machine.client("panel-2").bind().note[0]
    for number in range(31):
        fine("newcomp", f"c{number}x")
    refused(1, "there are 32 remote components already, which is the most", "newcomp", "more")
    fine("ready", "panel")


def a_client_that_stays_while_the_proxy_begins_again(machine):
    """A component that was taken over does not know for a moment that it has clients."""
    proxy = machine.proxy()
    one = machine.client().connect()
    before, pid = dict(one.handles), proxy.pid
    os.kill(pid, signal.SIGKILL)
    wait("another proxy serves the component", lambda: listed().get("panel") not in (None, pid) and proxy.ready())
    refused(75, "waitunbound: component panel was taken over just now", "waitunbound", "panel", "--timeout", 0)
    # ZeroMQ subscribes again when the client looks at its socket
    while one.handles == before:
        one.update()
    refused(75, "waitunbound: a client receives the values", "waitunbound", "panel",
            "--timeout", 4)


def a_killed_watcher(machine):
    proxy = machine.proxy()
    proxy.child.kill()
    proxy.child.wait()
    machine.client().connect()
    fine("waitbound", "panel")
    second = machine.proxy(ready=False)
    assert second.child.wait(rig.PATIENCE) == 1
    assert f"runs already (process {proxy.pid} of user {os.geteuid()});" in second.said(), second.said()
    os.kill(proxy.pid, signal.SIGTERM)


def a_proxy_that_fails_meanwhile(machine):
    proxy = machine.proxy()
    waiting = [started("waitbound", "panel"), started("waitacquired", "panel")]
    asks(machine, 2)
    os.kill(proxy.pid, signal.SIGKILL)
    machine.client().connect()
    for one in waiting:
        ended(one)
    waiting = started("waitunbound", "panel")
    asks(machine, 1)
    proxy.end()
    ended(waiting, 69, "there is no proxy with the name pokeys-remote")


def a_proxy_that_does_not_answer(machine):
    proxy = machine.proxy()
    pid = proxy.pid
    os.kill(pid, signal.SIGSTOP)
    refused(75, "newcomp: pokeys-remote does not answer; waited for 0.2 s", "newcomp", "panel", "--timeout", 0.2)
    os.kill(pid, signal.SIGCONT)
    # it has got the request, and does it although nobody waits any more
    fine("ready", "panel")


def linuxcnc_that_does_not_run(machine):
    """A HAL session without LinuxCNC's task."""
    machine.proxy()
    one = Control()
    assert one.asked("subscribe") is None
    why = one.until(lambda seen: "connected" in seen)["why"]
    assert why.startswith("LinuxCNC's task does not answer"), why
    assert one.do("mdi", line="G0 X1").startswith("LinuxCNC's task does not answer")
    assert one.asked("stop"), "nobody has stopped anything"
    one.close()


def connect():
    made = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    made.setblocking(False)
    # not while so many others connect that the kernel takes no more
    wait("the proxy takes a connection", lambda: made.connect_ex(ADDRESS) == 0)
    made.settimeout(rig.PATIENCE)
    return made


def said(connection, data=b""):
    """The next answer to these bytes; None if there is none."""
    read = b""
    with contextlib.suppress(BrokenPipeError):
        if data:
            connection.sendall(data)
    with contextlib.suppress(ConnectionResetError):
        while (got := connection.recv(1)) not in (b"", b"\n"):
            read += got
    return json.loads(read) if read else None


def all_connections():
    """As many as are allowed; None if those before are not closed yet."""
    made = [connect() for _ in range(64)]
    if all(said(each, b"{}\n")["error"]["code"] == -32600 for each in made):
        return made
    for each in made:
        each.close()
    return None


def bytes_of_all_kinds(machine):
    proxy = machine.proxy()
    for data in (b"\n", b"\xff\xfe\n", b"[" * 4000 + b"\n"):
        one = connect()
        assert said(one, data + b"\n" * 90)["error"]["code"] == -32700, data
        assert said(one) is None
    one = connect()
    for data, code in ((b"[]\n", -32600),
                       (b'{"jsonrpc":"2.0","method":"ready"}\n', -32600), (b'{"id":1,"method":"ready"}\n', -32600),
                       (b'{"jsonrpc":"2.0","id":1}\n', -32601), (b'{"jsonrpc":"2.0","id":1,"method":["ready"]}\n', -32601),
                       (b'{"jsonrpc":"2.0","id":1,"method":"ready"}\n', -32602),
                       (b'{"jsonrpc":"2.0","id":1,"method":"ready","params":{"component":1}}\n', -32602),
                       (b'{"jsonrpc":"2.0","id":1,"method":"ready","params":{"component":"a","b":"c"}}\n', -32602),
                       (b'{"jsonrpc":"2.0","id":1,"method":"waitbound","params":{"component":"a","seconds":true}}\n',
                        -32602),
                       (b'{"jsonrpc":"2.0","id":1,"method":"waitbound","params":{"component":"a","seconds":NaN}}\n',
                        -32000),
                       (b'{"jsonrpc":"2.0","id":1,"method":"waitbound","params":{"component":"a","seconds":1'
                        + b"0" * 3900 + b"}}\n", -32000),
                       (b'{"jsonrpc":"2.0","id":1,"method":"waitbound","params":{"component":"a","seconds":0}}\n',
                        -32001)):
        assert said(one, data)["error"]["code"] == code, data
    # in pieces, and two at once
    for piece in (b'{"jsonrpc":"2.0","id":"x","met', b'hod":"newcomp","params":{"component":"a"}}\n{"jsonrpc":"2.0",'):
        one.sendall(piece)
        time.sleep(0.05)
    assert said(one) == {"jsonrpc": "2.0", "id": "x", "result": True}
    assert said(one, b'"id":2,"method":"ready","params":{"component":"a"}}\n')["result"] is True
    # a line that does not end
    assert said(one, b"x" * 4096)["error"]["message"] == "a line has at most 4096 bytes"
    assert said(one) is None
    # one that waits and does not read, and one that leaves
    for each in (connect(), connect()):
        with contextlib.suppress(OSError):
            each.setblocking(False)
            for _ in range(20000):
                each.sendall(b"\n" * 100)
        each.close()
    many = wait("there is room for as many as are allowed", all_connections)
    assert "64 connections are open already" in said(connect())["error"]["message"]
    refused(75, "newcomp: 64 connections are open already, which is the most; waited for 0.2 s", "newcomp", "b",
            "--timeout", 0.2)
    waiting = started("waitacquired", "a")
    time.sleep(0.2)
    for each in many:
        each.close()
    ended(waiting)
    # many requests at once, all of which are answered
    one = connect()
    one.sendall(b'{"jsonrpc":"2.0","id":1,"method":"no"}\n' * 100)
    assert [said(one)["error"]["code"] for _ in range(100)] == [-32601] * 100
    one.close()
    # a line that is too long, and ends
    one = connect()
    one.sendall(b'{"jsonrpc":"2.0","id":1,"method":"' + b"x" * 4000)
    time.sleep(0.05)
    assert said(one, b"x" * 60 + b'"}\n')["error"]["message"] == "a line has at most 4096 bytes"
    assert proxy.child.poll() is None and "Traceback" not in proxy.said(), proxy.said()


def a_system_without_files(machine):
    """The proxy gets no file for a connection: it says so, works on, and takes the connection later."""
    proxy = machine.proxy()
    pid = proxy.pid
    before = resource.prlimit(pid, resource.RLIMIT_NOFILE)
    resource.prlimit(pid, resource.RLIMIT_NOFILE, (len(os.listdir(f"/proc/{pid}/fd")), before[1]))
    waiting = started("newcomp", "panel")
    wait("it is said", lambda: "takes no connections for 1 s: Too many open files" in proxy.said())
    time.sleep(0.5)
    assert proxy.said().count("takes no connections") == 1, proxy.said()
    resource.prlimit(pid, resource.RLIMIT_NOFILE, before)
    ended(waiting)


def program_of(user, before, after):
    """A program that is another user's between these two parts."""
    return ["/usr/bin/python3", "-Bc", f"import os, socket, sys\nsys.path.insert(0, {str(rig.ROOT / 'remote')!r})\n{before}\n"
            f"os.setgroups([]); os.setgid({user}); os.setuid({user})\n"
            f"one = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)\n{after}"]


def another_user(machine):
    proxy = machine.proxy()
    if not of_other_users():
        return print("not tried: another user (this needs root)")
    ran = subprocess.run(program_of(NOBODY, "", f"one.connect({ADDRESS!r})\nprint(one.recv(4096).decode())"),
                         capture_output=True, text=True, check=True)
    assert f"user {NOBODY} may not command the proxy of user 0" in ran.stdout, ran.stdout
    return wait("it is said", lambda: f"of user {NOBODY} may not use the control socket" in proxy.said())


def an_impostor(_machine):
    """Any user can take the name of a proxy."""
    if not of_other_users():
        return print("not tried: an impostor (this needs root)")
    listens = f"one.bind({ADDRESS!r})\none.listen()\nprint('listens', flush=True)\n"
    asks = ("try:\n    commands.ask('pokeys-remote', 'newcomp', {'component': 'panel'}, 10.0)\n"
            "except commands.Failed as failed:\n    print(failed)")

    def against(user, does, text):
        with subprocess.Popen(program_of(NOBODY, "", listens + does), stdin=subprocess.PIPE, stdout=subprocess.PIPE) as taker:
            assert taker.stdout.readline() == b"listens\n"
            ran = subprocess.run(program_of(user, "from pokeys_remote import commands", asks), capture_output=True, text=True,
                                 check=True)
            taker.stdin.write(b"\n")
            taker.stdin.close()
        assert ran.stdout == text.format(taker=taker.pid) + "\n", ran.stdout
    against(NOBODY - 1, "input()", "process {taker} of user 65534 answers with the name pokeys-remote, and is not trusted; the "
            "proxy has to be of user 65533 or root")
    # a trusted process whose answers are not those of a proxy
    for answer in (b"no\n", b"[1]\n", b'{{"error":1}}\n', b"{{}}\n", b"x" * 70000):
        against(NOBODY, f"two = one.accept()[0]\ntwo.sendall({answer!r})\ninput()",
                "what pokeys-remote answers is no answer of a proxy of this version")
    return None


if __name__ == "__main__":
    rig.main([the_files_of_the_chapter, pins_before_the_client, clients_that_bind_before,
              a_draft_keeps_clients_from_creating, a_client_was_first, what_is_refused, a_file_that_is_loaded_again,
              the_name_of_a_draft_is_taken, a_client_that_stays_while_the_proxy_begins_again, a_killed_watcher,
              a_proxy_that_fails_meanwhile, a_proxy_that_does_not_answer, linuxcnc_that_does_not_run, bytes_of_all_kinds,
              a_system_without_files, another_user, an_impostor])
