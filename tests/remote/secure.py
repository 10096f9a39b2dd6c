#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Clients in the network: encrypted, and only those whose keys are known."""
import contextlib
import os
import pathlib
import re
import resource
import signal
import socket
import stat
import subprocess
import sys
import time

import rig
from rig import wait

PLACES = "tcp://127.0.0.2:6202", "tcp://127.0.0.2:6201"
CONFIG = """\
[secure]
command = 127.0.0.2:6202
update = 127.0.0.2:6201
group = 127.0.0.2:6200
key = proxy.key_secret
clients = clients

[group dro]
signals = speed

[pin panel.start]
failsafe = 0

[component panel]
lease-ms = 3600000
"""


def run(folder, *words):
    return subprocess.run(["/usr/bin/python3", "-B", sys.argv[1], *map(str, words)], capture_output=True, text=True,
                          stdin=subprocess.DEVNULL, check=False, timeout=rig.PATIENCE, cwd=folder)


class Keys:
    """Of a proxy and its clients, in the folder of the configuration."""

    def __init__(self, machine):
        self.folder = pathlib.Path(machine.folder.name)
        self.clients = self.folder / "clients"
        self.clients.mkdir(exist_ok=True)
        self.proxy = self.make("proxy")

    def make(self, name):
        """A public and a secret key."""
        import zmq.auth
        ran = run(self.folder, "--make-key", name)
        assert ran.returncode == 0 and ran.stdout == (
            f"pokeys-remote: {name}.key_secret is secret and stays where it is used; {name}.key is for the other side\n"), ran
        return zmq.auth.load_certificate(self.folder / f"{name}.key_secret")

    def know(self, name):
        """The proxy takes it from now on."""
        os.replace(self.folder / f"{name}.key", self.clients / f"{name}.key")

    def client(self, machine, keys, server=None, **options):
        return machine.client(places=PLACES, curve=(server or self.proxy[0], *keys), **options)


def refused(keys, machine, pair):
    """Is it? A key is known for a moment after its file has gone."""
    try:
        silent(keys.client(machine, pair))
    except AssertionError:
        return False
    return True


def silent(client):
    """It gets no answer."""
    client.send(210)
    with contextlib.suppress(client.zmq.Again):
        client.dealer.setsockopt(client.zmq.RCVTIMEO, 400)
        raise AssertionError(client.answer())
    client.dealer.setsockopt(client.zmq.RCVTIMEO, rig.PATIENCE * 1000)


def who_is_known_is_a_client_like_others(machine):
    keys = Keys(machine)
    tablet = keys.make("tablet")
    keys.know("tablet")
    proxy = machine.proxy(CONFIG)
    one, near = keys.client(machine, tablet).connect(), machine.client().connect()
    one.set(start=True, mask=7)
    near.sees("mask", 7)
    near.set(count=-3)
    one.sees("count", -3)
    machine.becomes("panel.clients", 2)
    assert "(tablet)" in proxy.said(), proxy.said()
    # groups, too
    rig.halcmd("newsig", "speed", "float")
    group = one.context.socket(one.zmq.SUB)
    group.setsockopt(one.zmq.RCVTIMEO, rig.PATIENCE * 1000)
    group.curve_serverkey, group.curve_publickey, group.curve_secretkey = keys.proxy[0], *tablet
    group.connect("tcp://127.0.0.2:6200")
    group.subscribe(b"dro")
    assert one.pb.Container.FromString(group.recv_multipart()[1]).type == 297
    # a client that stops answering
    program = ("import sys, zmq\none = zmq.Context().socket(zmq.DEALER)\n"
               f"one.curve_serverkey, one.curve_publickey, one.curve_secretkey = {(keys.proxy[0], *tablet)!r}\n"
               f"one.connect({PLACES[0]!r})\nfor line in sys.stdin:\n    one.send(bytes.fromhex(line))\n")
    with subprocess.Popen(["/usr/bin/python3", "-c", program], stdin=subprocess.PIPE, text=True, bufsize=1) as child:
        for message in (one.message(256, comp=[one.description()]), one.message(259, pin=[one.pin("start", True)])):
            child.stdin.write(message.SerializeToString().hex() + "\n")
        machine.becomes("panel.clients", 3)
        machine.becomes("panel.link-ok", True)
        os.kill(child.pid, signal.SIGSTOP)
        # by heartbeats: the lease is an hour
        machine.becomes("panel.start", False)
        child.kill()
    # what waited while the proxy could not run is not obeyed
    os.kill(proxy.pid, signal.SIGSTOP)
    one.send(259, pin=[one.pin("mask", 77)])
    time.sleep(1)
    os.kill(proxy.pid, signal.SIGCONT)
    wait("it has gone on", lambda: "could not run for" in proxy.said())
    assert one.ask(210).type == 215 and machine.get("panel.mask") == 7
    # another proxy knows the same keys
    before = dict(one.handles)
    os.kill(proxy.pid, signal.SIGKILL)
    while one.handles == before:
        one.update()
    one.set(mask=9)
    machine.becomes("panel.mask", 9)


def the_panel_of_the_example(machine):
    """As docs/remote.md starts it, with keys made as there."""
    page = (rig.ROOT / "docs/remote.md").read_text(encoding="utf-8")
    make = re.search(r"^(/usr/bin/python3 -c 'import zmq.auth.*)$", page, re.M)[1]
    assert "./panel.py 192.168.7.1 proxy.key tablet.key_secret\n" in page
    keys = Keys(machine)
    subprocess.run(["bash", "-c", make], cwd=keys.folder, check=True)
    keys.know("tablet")
    proxy = machine.proxy(CONFIG.partition("[pin")[0])
    with subprocess.Popen([rig.ROOT / "examples/linuxcnc/remote-panel/panel.py", "127.0.0.2", "proxy.key", "tablet.key_secret"],
                          cwd=keys.folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          text=True, bufsize=1) as panel:
        def shows(line):
            while (got := panel.stdout.readline()) != line:
                assert got, panel.stderr.read()
        shows("panel.x 0.0\n")
        rig.halcmd("setp", "panel.x", 2.5)
        shows("panel.x 2.5\n")
        panel.stdin.write("x\n")
        assert panel.stderr.readline() == "the buttons are run and stop\n"
        panel.stdin.write("run\n")
        machine.becomes("panel.run", True)
        machine.becomes("panel.run", False)
        # the proxy ends the connection of a panel that does not answer, which binds again when it goes on
        os.kill(panel.pid, signal.SIGSTOP)
        machine.becomes("panel.clients", 0)
        os.kill(panel.pid, signal.SIGCONT)
        machine.becomes("panel.link-ok", True)
        # another proxy, which it binds
        os.kill(proxy.pid, signal.SIGKILL)
        wait("it has bound again", lambda: "taken over" in proxy.said() and machine.get("panel.link-ok"))
        panel.stdin.close()
        assert panel.wait(rig.PATIENCE) == 0


def others_are_refused(machine):
    keys = Keys(machine)
    tablet, stranger = keys.make("tablet"), keys.make("stranger")
    keys.know("tablet")
    proxy = machine.proxy(CONFIG)
    silent(keys.client(machine, stranger))
    wait("the stranger is seen", lambda: "a client at 127.0.0.1 is refused: its key is not in " in proxy.said())
    # the key of another proxy, and none
    silent(keys.client(machine, tablet, server=stranger[0]))
    silent(machine.client(places=PLACES))
    # keys that come and go while the proxy runs, and files that are none
    public = (keys.folder / "stranger.key").read_bytes()
    for number, content in enumerate((b"public-key", b'public-key = "' + b"#" * 40 + b'"', b"\xff", b"",
                                      b'public-key = "x"\n', public[:-10])):
        (keys.clients / f"broken-{number}.key").write_bytes(content)
    (keys.clients / os.fsdecode(b"\xff.key")).write_bytes(public)
    keys.know("stranger")
    late = keys.client(machine, stranger)
    # it tries again by itself
    late.connect()
    assert "broken-0.key is not used: it has no public key" in proxy.said()
    # written again in its place
    (keys.clients / "tablet.key").write_bytes(public)
    wait("it is known no more", lambda: refused(keys, machine, tablet))
    # nobody is known without the folder
    os.rename(keys.clients, keys.folder / "elsewhere")
    wait("it is known no more", lambda: refused(keys, machine, stranger))
    # who is connected stays
    assert late.ask(210).type == 215
    os.rename(keys.folder / "elsewhere", keys.clients)
    wait("it is known again", lambda: not refused(keys, machine, stranger))
    assert proxy.child.poll() is None and "Traceback" not in proxy.said(), proxy.said()


def a_crowd_of_strangers(machine):
    """They take all files that the proxy may have, and end nothing."""
    keys = Keys(machine)
    keys.know("proxy")
    proxy = machine.proxy(CONFIG)
    near = machine.client().connect()
    before = resource.prlimit(proxy.pid, resource.RLIMIT_NOFILE)
    assert before[0] == before[1], "it takes as many as it may"
    resource.prlimit(proxy.pid, resource.RLIMIT_NOFILE, (len(os.listdir(f"/proc/{proxy.pid}/fd")) + 20, before[1]))
    crowd = [socket.socket() for _ in range(60)]
    for one in crowd:
        one.setblocking(False)
        one.connect_ex(("127.0.0.2", 6202))
    end = time.monotonic() + 3
    while time.monotonic() < end:
        near.set(mask=int(time.monotonic()))
    assert proxy.ready() and "Traceback" not in proxy.said(), proxy.said()
    for one in crowd:
        one.close()
    keys.client(machine, keys.proxy).connect()
    assert proxy.child.poll() is None and "begun" not in proxy.said(), proxy.said()


def names_that_are_no_keys(machine):
    """A client without a key may say of itself what it wants."""
    proxy = machine.proxy()
    with socket.create_connection(("127.0.0.1", 6202)) as one:
        one.settimeout(rig.PATIENCE)
        one.sendall(b"\xff" + bytes(8) + b"\x7f\x03\x00NULL" + bytes(16) + bytes(32))
        # the library closes a connection that does not wait for its greeting
        one.recv(64, socket.MSG_WAITALL)
        properties = b"".join(bytes([len(name)]) + name + len(value).to_bytes(4, "big") + value for name, value in (
            (b"Socket-Type", b"DEALER"), (b"User-Id", b"\xff\xfe")))
        ready = b"\x05READY" + properties
        one.sendall(b"\x04" + bytes([len(ready)]) + ready)
        one.recv(2, socket.MSG_WAITALL)
        ping = machine.client().message(210).SerializeToString()
        one.sendall(b"\x00" + bytes([len(ping)]) + ping)
        got = b""
        while b"\x08\xd7\x01" not in got:
            data = one.recv(4096)
            assert data, "the proxy closed the connection"
            got += data
    machine.client().connect()
    assert proxy.child.poll() is None and "Traceback" not in proxy.said(), proxy.said()


def without_an_answer_nobody_gets_in(machine):
    """Without a ZAP handler, libzmq accepts every client unless ZMQ_ZAP_ENFORCE_DOMAIN is set."""
    sys.path[1:1] = [str(rig.ROOT / "remote")]
    from pokeys_remote import config, ways
    keys = Keys(machine)
    keys.know("proxy")
    import zmq
    path = keys.folder / "lonely.conf"
    path.write_text(CONFIG, encoding="utf-8")
    found = config.read(path)
    context = zmq.Context()
    try:
        way = ways.make(context, found.command, found.update, (), found.secure)
        way.router.bind(PLACES[0])
        client = keys.client(machine, keys.proxy)
        client.send(210)
        assert not way.router.poll(1500), "somebody got in"
        way.close()
    finally:
        context.destroy(0)


def what_is_wrong_is_said(machine):
    keys = Keys(machine)
    secret = keys.folder / "proxy.key_secret"
    assert stat.S_IMODE(secret.stat().st_mode) == 0o600 and stat.S_IMODE(keys.folder.joinpath("proxy.key").stat().st_mode) == 0o644
    before = secret.read_bytes()
    ran = run(keys.folder, "--make-key", "proxy")
    assert (ran.returncode, ran.stderr, secret.read_bytes()) == (
        1, "pokeys-remote: proxy.key is there already, and is not overwritten\n", before), ran
    ran = run(keys.folder, "--make-key", "none/proxy")
    assert (ran.returncode, ran.stderr) == (1, "pokeys-remote: none/proxy.key: No such file or directory\n"), ran
    ran = run(keys.folder, "--make-key", ".")
    assert (ran.returncode, ran.stderr) == (1, "pokeys-remote: .: a name for the keys is missing\n"), ran
    conf = keys.folder / "secure.conf"

    def judged(text, *lines):
        conf.write_text(text, encoding="utf-8")
        ran = run("/", "--check-config", "--config", conf)
        assert (ran.returncode, ran.stderr.replace(str(keys.folder), "F").splitlines()) == (
            78 if lines else 0, [f"pokeys-remote: F/secure.conf:{line}" for line in lines]), ran
    judged(CONFIG)
    judged("[secure]\n", *(f"1: [secure]: {key} is missing" for key in ("command", "update", "key", "clients")))
    allowed = "ADDRESS:PORT or [ADDRESS]:PORT, with an address of this computer in the network"
    for place in ("0.0.0.0:6202", "[::]:6202", "[::ffff:0.0.0.0]:6202", "6202", "a:6202", "10.0.0.1:0", "224.0.0.1:6202", "/run/x", "10.0.0.1"):
        judged(CONFIG.replace("127.0.0.2:6202", place), f'2: [secure] command: "{place}" is not allowed; allowed: {allowed}')
    judged(CONFIG.replace("127.0.0.2:6202", "10.1.1.1:6202, [fe80::1%lo]:6202"))
    judged(CONFIG.replace("= clients", "= none"), "6: [secure] clients: F/none: No such file or directory")
    judged(CONFIG.replace("= clients", "= proxy.key"), "6: [secure] clients: F/proxy.key is no folder")
    judged(CONFIG.replace("127.0.0.2:6201", "127.0.0.2:6202"),
           "3: [secure] update: 127.0.0.2:6202 is used by [secure] command already")
    judged(CONFIG + "[remote]\nupdate = 127.0.0.2:6200\n", "4: [secure] group: 127.0.0.2:6200 is used by [remote] update already")
    keys.clients.chmod(0o775)
    judged(CONFIG, f"6: [secure] clients: F/clients: other users may write into it; it has to belong to user {os.geteuid()} or root, with chmod "
           "755 or less")
    keys.clients.chmod(0o755)
    judged(CONFIG.replace("= proxy.key_secret", "= none"), "5: [secure] key: F/none: No such file or directory")
    judged(CONFIG.replace("= proxy.key_secret", "= proxy.key"),
           "5: [secure] key: F/proxy.key: it has no secret key; pokeys-remote --make-key makes one")
    secret.chmod(0o640)
    judged(CONFIG, "5: [secure] key: F/proxy.key_secret: other users may read it; chmod 600 F/proxy.key_secret")
    # an address that this computer does not have
    secret.chmod(0o600)
    proxy = machine.proxy(CONFIG.replace("127.0.0.2:6201", "192.0.2.1:6201"), ready=False)
    assert proxy.child.wait(rig.PATIENCE) == 1 and "cannot listen at 192.0.2.1:6201: " in proxy.said(), proxy.said()


if __name__ == "__main__":
    rig.main([who_is_known_is_a_client_like_others, the_panel_of_the_example, others_are_refused, a_crowd_of_strangers,
              names_that_are_no_keys, without_an_answer_nobody_gets_in, what_is_wrong_is_said])
