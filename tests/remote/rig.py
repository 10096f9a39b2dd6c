# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC's HAL, a proxy and clients, in namespaces of their own, for tests.

Arguments of such a test: PROGRAM POKEYS_SHM.so [PATTERN]. It calls main(), which runs it again inside.
"""
import contextlib
import functools
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import types

from libraries import need

ROOT = pathlib.Path(__file__).resolve().parents[2]
PATIENCE = 60           # s; only decides when to give up
COMMAND, UPDATE = "tcp://127.0.0.1:6202", "tcp://127.0.0.1:6201"
INSIDE = "POKEYS_REMOTE_INSIDE"
BIT, FLOAT, S32, U32 = 1, 2, 3, 4
IN, OUT, IO = 16, 32, 48
NOBODY = 65534
VALUES = {BIT: "halbit", FLOAT: "halfloat", S32: "hals32", U32: "halu32"}
PANEL = (("start", BIT, OUT), ("jog", FLOAT, OUT), ("count", S32, IO), ("mask", U32, OUT), ("speed", FLOAT, IN))


def wait(what, condition, limit=PATIENCE):
    """Until it holds, and what it then is."""
    end = time.monotonic() + limit
    while not (found := condition()):
        assert time.monotonic() < end, f"not within {limit} s: {what}"
        time.sleep(0.01)
    return found


def of_other_users():
    """Can a test have processes of other users?"""
    def mapped(user):
        rows = (map(int, row.split()) for row in pathlib.Path("/proc/self/uid_map").read_text("ascii").splitlines())
        return any(first <= user < first + count for first, _, count in rows)
    return os.geteuid() == 0 and mapped(NOBODY) and mapped(NOBODY - 1)


def halcmd(*words):
    ran = subprocess.run(["halcmd", "-s", *map(str, words)], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, f"halcmd {words}: {ran.stdout}{ran.stderr}"
    return ran.stdout


def listed():
    """The components of HAL and their processes."""
    rows = (line.split() for line in halcmd("show", "comp").splitlines() if line.strip())
    return {words[2]: int(words[3]) if words[1] == "User" else None for words in rows}


@functools.cache
def messages():
    """The messages with names as text, as a client has them."""
    import pokeys_machinetalk_pb2
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
    file = descriptor_pb2.FileDescriptorProto()
    pokeys_machinetalk_pb2.DESCRIPTOR.CopyToProto(file)
    file.name, file.package = "client.proto", "client"
    for field in (field for made in file.message_type for field in made.field):
        if field.type == field.TYPE_MESSAGE:
            field.type_name = field.type_name.replace(".pokeys.machinetalk.", ".client.")
        if field.name in ("name", "note"):
            field.type = field.TYPE_STRING
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    made = message_factory.MessageFactory(pool)
    return types.SimpleNamespace(**{one.name: made.GetPrototype(pool.FindMessageTypeByName(f"client.{one.name}"))
                                    for one in file.message_type})


class Proxy:
    """pokeys-remote with a configuration, and what it prints."""

    def __init__(self, folder, config="", *words, ready=True):
        self.folder = pathlib.Path(folder)
        self.log = self.folder / "remote.log"
        path = self.folder / "remote.conf"
        path.write_text(config, encoding="utf-8")
        with open(self.log, "ab") as log:
            self.child = subprocess.Popen(["/usr/bin/python3", "-B", sys.argv[1], "--config", path, *words],
                                          stdout=log, stderr=log, stdin=subprocess.DEVNULL)
        if ready:
            wait(f"the proxy is ready; it says: {self.said()}", self.ready)

    def ready(self):
        assert self.child.poll() is None, self.said()
        return any(line.split()[2:3] == ["pokeys-remote"] and line.split()[-1] == "ready"
                   for line in halcmd("show", "comp").splitlines())

    @property
    def pid(self):
        """Of the process that owns the components."""
        return listed()["pokeys-remote"]

    def said(self):
        return self.log.read_text(encoding="utf-8", errors="replace") if self.log.exists() else ""

    def end(self):
        self.child.send_signal(signal.SIGTERM)
        assert self.child.wait(PATIENCE) == 0, self.said()

    def close(self):
        """Kill it, and the process that would begin it again first."""
        if self.child.poll() is None:
            pid = listed().get("pokeys-remote")
            self.child.kill()
            self.child.wait()
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid or 0, signal.SIGKILL) if pid else None


class Client:
    """A client with both sockets, as machinekit's are."""

    def __init__(self, name="panel", pins=PANEL, places=(COMMAND, UPDATE), curve=None):
        """``curve`` is the public key of the proxy, and both keys of the client."""
        import zmq
        self.pb, self.zmq = messages(), zmq
        self.name, self.pins = name, pins
        self.context = zmq.Context()
        self.dealer, self.sub = self.context.socket(zmq.DEALER), self.context.socket(zmq.SUB)
        for one, place in zip((self.dealer, self.sub), places, strict=True):
            one.setsockopt(zmq.LINGER, 0)
            one.setsockopt(zmq.RCVTIMEO, PATIENCE * 1000)
            if curve:
                one.curve_serverkey, one.curve_publickey, one.curve_secretkey = curve
            one.connect(place)
        self.handles, self.values, self.serials = {}, {}, []

    def send(self, kind, **parts):
        self.dealer.send(self.message(kind, **parts).SerializeToString())

    def message(self, kind, comp=(), pin=(), **fields):
        made = self.pb.Container(type=kind, **fields)
        made.comp.extend(comp)
        made.pin.extend(pin)
        return made

    def ask(self, kind, **parts):
        self.send(kind, **parts)
        return self.answer()

    def answer(self):
        return self.pb.Container.FromString(self.dealer.recv())

    def quiet(self):
        """What came so far is no answer of ours: the answer to a PING is the next message."""
        assert self.ask(210).type == 215

    def description(self, pins=None, **fields):
        made = self.pb.Component(name=self.name, **fields)
        for name, kind, direction in self.pins if pins is None else pins:
            item = made.pin.add(name=f"{self.name}.{name}", type=kind, dir=direction)
            setattr(item, VALUES[kind], 0)
        return made

    def bind(self, pins=None, **fields):
        return self.ask(256, comp=[self.description(pins, **fields)])

    def subscribe(self, topic=None):
        self.sub.subscribe((topic or self.name).encode())

    def connect(self):
        """Bound and subscribed."""
        bound = self.bind()
        assert bound.type == 257, bound
        self.subscribe()
        self.until(288)
        return self

    def update(self):
        """The next one."""
        topic, data = self.sub.recv_multipart()
        got = self.pb.Container.FromString(data)
        if got.type == 288 and topic.decode() == self.name:
            self.handles = {pin.name.partition(".")[2]: pin.handle for pin in got.comp[0].pin}
            self._take(got.comp[0].pin)
        elif got.type == 289:
            self._take(got.pin)
        if got.type in (288, 289):
            self.serials.append(got.serial)
        return got

    def _take(self, pins):
        names = {handle: name for name, handle in self.handles.items()}
        for pin in pins:
            kind = next(kind for kind, field in VALUES.items() if pin.HasField(field))
            self.values[names[pin.handle]] = getattr(pin, VALUES[kind])

    def until(self, kind):
        while (got := self.update()).type != kind:
            pass
        return got

    def sees(self, name, value):
        while self.values.get(name) != value:
            self.update()

    def pin(self, name, value, kind=None, **fields):
        kind = kind or next(one for pin, one, _ in self.pins if pin == name)
        made = self.pb.Pin(type=kind, handle=self.handles.get(name, 0), **fields)
        setattr(made, VALUES[kind], value)
        return made

    def set(self, **values):
        """And wait until it is set; on a busy machine, the proxy may ask for it again."""
        def done():
            got = self.ask(259, pin=[self.pin(name, value) for name, value in values.items()], reply_required=True)
            assert got.type == 263 or "may be old" in got.note[0], got
            return got.type == 263
        wait("it is set", done)

    def close(self):
        self.context.destroy(0)


class Machine:
    """HAL with a thread, and the proxy."""

    def __init__(self):
        self.folder = tempfile.TemporaryDirectory(prefix="pokeys-remote-")
        self.proxies, self.clients = [], []
        # what it starts goes on and would hold a pipe open
        subprocess.run(["halcmd", "loadrt", "threads", "name1=servo-thread", "period1=1000000"], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        halcmd("start")

    def proxy(self, config="", *words, **options):
        self.proxies.append(Proxy(self.folder.name, config, *words, **options))
        return self.proxies[-1]

    def client(self, *words, **options):
        self.clients.append(Client(*words, **options))
        return self.clients[-1]

    @staticmethod
    def get(name):
        text = halcmd("getp", name).strip()
        return {"TRUE": True, "FALSE": False}.get(text) if text in ("TRUE", "FALSE") else float(int(text, 0)) \
            if text.startswith("0x") else float(text)

    def becomes(self, name, value):
        wait(f"{name} is {value}", lambda: self.get(name) == value)

    def said(self):
        return "".join(one.said() for one in self.proxies[-1:])

    def close(self):
        for one in self.clients:
            one.close()
        for one in self.proxies:
            one.close()
        subprocess.run(["halrun", "-U"], capture_output=True, check=False)
        self.folder.cleanup()


def main(tests, kind=Machine):
    if INSIDE not in os.environ:
        sys.path.insert(0, str(ROOT / "tests"))
        os.environ[INSIDE] = "yes"
        os.execv(ROOT / "scripts/hal-isolated", ["hal-isolated", "--network", "--module", sys.argv[2],
                                                 "/usr/bin/python3", "-B", *sys.argv])
    need("google.protobuf", "zmq")
    failed = 0
    for test in tests:
        if not re.search(sys.argv[3] if len(sys.argv) > 3 else "", test.__name__):
            continue
        machine = kind()
        try:
            test(machine)
            print(f"ok: {test.__name__}")
        except Exception as fault:  # pylint: disable=broad-exception-caught
            failed += 1
            print(f"FAILED: {test.__name__}: {fault}\n{traceback.format_exc()}{machine.said()[-3000:]}")
        finally:
            machine.close()
    sys.exit(1 if failed else 0)
