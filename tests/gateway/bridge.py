#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The console over telnet, with a printer behind a serial port: a pseudoterminal, which is unplugged and comes back."""
import contextlib
import fcntl
import functools
import os
import pathlib
import re
import select
import signal
import socket
import subprocess
import sys
import threading
import time
import tty
import warnings

import rig
from house import PATIENCE, House, free_address, main, wait_for

PORT, PAGES = 2323, 8581
NO_END = "error: not sent: the last line has no end"


class Printer(threading.Thread):
    """Marlin's end of the wire: takes numbered lines in their order, and answers each."""

    def __init__(self, name, locked=False):
        super().__init__(daemon=True)
        self.master, slave = os.openpty()
        tty.setraw(slave)
        if locked:
            fcntl.flock(slave, fcntl.LOCK_EX)
        name.unlink(missing_ok=True)
        name.symlink_to(os.ttyname(slave))
        self.slave = slave          # as long as it is open, the port is plugged in
        self.lines, self.done, self.faults = [], [], []
        self.reading = threading.Event()
        self.reading.set()
        self.end = False
        self.start()

    def run(self):
        rest = b""
        while not self.end:
            if not self.reading.wait(0.05) or not select.select([self.master], [], [], 0.05)[0]:
                continue
            try:
                rest += os.read(self.master, 4096)
            except OSError:
                return
            while b"\n" in rest:
                line, _, rest = rest.partition(b"\n")
                self.take(line.rstrip(b"\r"))

    def take(self, line):
        self.lines.append(line)
        found = re.fullmatch(rb"N(\d+) (.*)\*(\d+)", line)
        if found:
            body = line[:line.rindex(b"*")]
            if functools.reduce(lambda one, two: one ^ two, body) != int(found[3]) or int(found[1]) != len(self.done) + 1:
                self.faults.append(line)
            self.done.append(int(found[1]))
        if line == b"M105":
            self.say(b"ok T:21.3 /0.0\n")
        elif line == b"M503":
            self.say(b"".join(b"echo: setting %d of a long list\n" % number for number in range(10_000)))
        elif line.strip():
            self.say(b"ok\n")

    def say(self, data):
        while data:
            data = data[os.write(self.master, data):]

    def unplug(self):
        self.end = True
        self.join(PATIENCE)
        os.close(self.slave)
        os.close(self.master)


class Telnet:
    """A plain socket to the console."""

    def __init__(self, house, buffer=None):
        self.socket = socket.socket()
        if buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
        self.socket.settimeout(PATIENCE)
        self.socket.connect((house.console, PORT))
        self.rest = b""

    def send(self, data):
        self.socket.sendall(data)

    def line(self):
        """The next line."""
        while b"\n" not in self.rest:
            data = self.socket.recv(65536)
            assert data, f"the connection ended; what came: {self.rest}"
            self.rest += data
        line, _, self.rest = self.rest.partition(b"\n")
        return line.decode()

    def ask(self, text):
        self.send(text.encode() + b"\n")
        return self.line()

    def level(self):
        """What it may do, among answers of the printer to others."""
        self.send(b"[ESP500]\n")
        while (line := self.line()) == "ok":
            pass
        return line

    def close(self):
        self.socket.close()

    def reset(self):
        """As if its computer had been switched off and on."""
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        self.socket.close()


@contextlib.contextmanager
def bridge(*, level="user", users=None, machine=None, printer=Printer):
    """A gateway with a printer and no device: house, gateway, printer. With a `machine` of another kind, no printer."""
    rig.need_libraries()
    with House() as house:
        house.runtime.mkdir()
        house.console, house.port = free_address(), house.folder / "by-id-printer"
        (folder := house.folder / "files").mkdir()
        conf = f"[machine]\n{machine or f'port = {house.port}'}\n[telnet]\nlisten = {house.console}:{PORT}\n" \
            f"[pty]\npath = {house.folder / 'pty'}\n[esp3d]\nlisten = {house.console}:{PAGES}\nfolder = {folder}\n"
        if level:
            conf += f"[console]\nlevel = {level}\n"
        if users:
            (path := house.folder / "users").write_text(users, encoding="utf-8")
            path.chmod(0o600)
            conf += f"[access]\nusers = {path}\n"
        (house.folder / "gateway.conf").write_text(conf, encoding="utf-8")
        there = None if machine else printer(house.port)
        gateway = rig.Gateway(house, "--config", house.folder / "gateway.conf")
        gateway.wait("it listens", lambda: gateway.child.poll() is not None or "page is at" in house.log("gateway.log"))
        assert gateway.child.poll() is None, house.log("gateway.log")
        if there:
            wait_for("the printer is found", lambda: "115200 baud" in house.log("gateway.log"),
                     say=lambda: house.log("gateway.log"))
        try:
            yield house, gateway, there
        finally:
            if there:
                there.end = True


def is_free(fd):
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    fcntl.flock(fd, fcntl.LOCK_UN)
    return True


def numbered(number):
    body = b"N%d G1 X%d.%d E%d" % (number, number % 200, number % 10, number)
    return body + b"*%d\n" % functools.reduce(lambda one, two: one ^ two, body)


def prints(one, lines, seen=lambda line: None):
    """A host program: sends a line, waits for its ok."""
    for number in range(1, lines + 1):
        one.send(numbered(number))
        while (line := one.line()) != "ok":
            seen(line)


def console(gateway, name, kind=None):
    """A value of the console."""
    want = f'{{kind="{kind}"}}' if kind else ""
    text = gateway.ask("/metrics")[2].decode()
    return next((float(line.split()[-1]) for line in text.splitlines()
                 if line.startswith(f"pokeys_gateway_console_{name}{want} ")), None)


def quiet(gateway):
    """Nobody has a message any more."""
    gateway.wait("no message is left", lambda: console(gateway, "messages") == 0)


def test_a_program_prints_beside_others():
    with bridge() as (house, gateway, printer):
        host, other, frozen = Telnet(house), Telnet(house), Telnet(house, buffer=2048)
        assert other.ask("M105") == "ok T:21.3 /0.0"
        assert host.line() == "ok T:21.3 /0.0"
        prints(host, 1500)
        assert printer.done == list(range(1, 1501)) and not printer.faults
        assert [other.line() for _ in range(1500)] == 1500 * ["ok"]
        # a command of ours is not the printer's business, and no one else's
        assert host.ask("[ESP500]") == "user" and b"[ESP500]" not in printer.lines
        status = host.ask("[ESP420]json")
        assert '"id":"machine"' in status and f"{house.port}, lines sent" in status, status
        host.send(b"M114\n")
        assert other.line() == "ok"
        for one in host, other, frozen:
            one.close()
        gateway.wait("they are gone", lambda: console(gateway, "clients") == 0)
        quiet(gateway)


def test_a_long_answer_and_a_frozen_client():
    with bridge() as (house, gateway, _printer):
        frozen, *others = Telnet(house, buffer=2048), Telnet(house), Telnet(house), Telnet(house)
        assert [one.ask("[ESP500]") for one in (frozen, *others)] == 4 * ["user"]
        expected = [f"echo: setting {number} of a long list" for number in range(10_000)]
        found = {}

        def listen(one):
            found[one] = []
            while len(found[one]) < 20_000:
                line = one.line()
                if not line.startswith("[dropped"):
                    found[one].append(line)
                else:
                    found[one] += int(line[9:-1]) * [None]
        threads = [threading.Thread(target=listen, args=(one,), daemon=True) for one in others]
        for one in threads:
            one.start()
        others[0].send(b"M503\nM503\n")
        for one in threads:
            one.join(PATIENCE)
        for one in others:
            assert found[one] == 2 * expected, f"{len(found[one])} lines, {found[one].count(None)} of them dropped"
        # it goes on, and knows how many it has missed
        listen(frozen)
        missed = found[frozen].count(None)
        assert missed == console(gateway, "dropped_total"), (missed, console(gateway, "dropped_total"))
        assert missed > 1000, missed
        at = found[frozen].index(None)
        assert found[frozen] == (2 * expected)[:at] + missed * [None] + (2 * expected)[at + missed:]
        assert frozen.ask("[ESP500]") == "user"
        quiet(gateway)


def test_the_port_is_unplugged_and_comes_back():
    with bridge() as (house, gateway, printer):
        one = Telnet(house)
        assert one.ask("M105") == "ok T:21.3 /0.0"
        printer.unplug()
        said = one.line()
        assert re.fullmatch(r"\[machine disconnected: unplugged; lines not sent: 0\]", said), said
        # a second later, it is looked for
        assert re.fullmatch(f"error: {house.port}: (unplugged|No such file or directory)", one.ask("M105"))
        house.port.unlink()
        gateway.wait("it is looked for", lambda: "No such file" in house.log("gateway.log"))
        assert one.ask("M105") == f"error: {house.port}: No such file or directory"
        assert console(gateway, "machine_up") == 0
        printer = Printer(house.port)
        assert one.line() == "[machine connected]"
        assert one.ask("M105") == "ok T:21.3 /0.0" and printer.lines == [b"M105"]
        assert (console(gateway, "machine_up"), console(gateway, "machine_connections_total")) == (1, 2)
        quiet(gateway)
        # the log says each of it once
        log = house.log("gateway.log")
        assert log.count("No such file") == 1 and log.count("unplugged") == 1, log
        # another program has it
        printer.unplug()
        one.line()
        printer = Printer(house.port, locked=True)
        gateway.wait("it is taken", lambda: "another program has opened it" in house.log("gateway.log"))
        printer.end = True


def test_a_machine_that_takes_nothing():
    with bridge() as (house, gateway, printer):
        flood, other = Telnet(house), Telnet(house)
        assert other.ask("M105") == "ok T:21.3 /0.0"
        printer.reading.clear()
        flood.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 16384)
        flood.socket.settimeout(1)
        sent = 0
        with contextlib.suppress(TimeoutError):
            while sent < 4 << 20:
                sent += flood.socket.send((100 * b"M106 S1\n")[sent % 8:])
        assert sent < 4 << 20, "nothing slowed it down"
        # who asks us is answered
        assert other.level() == "user"
        assert gateway.ask("/healthz")[0] == 200 and console(gateway, "dropped_total") == 0
        printer.reading.set()
        flood.socket.settimeout(PATIENCE)
        flood.send(b"M106 S1\n"[sent % 8:] + b"M114\n")
        gateway.wait("it gets all of it", lambda: b"M114" in printer.lines)
        assert printer.lines == [b"M105"] + (sent // 8 + 1) * [b"M106 S1"] + [b"M114"]
        flood.close()
        other.close()
        quiet(gateway)


def test_whoever_is_gone_is_not_obeyed():
    with bridge() as (house, gateway, printer):
        printer.reading.clear()
        # 64 whose lines wait, and who then are gone: there is room for others, and their lines are not sent
        many = [Telnet(house) for _ in range(64)]
        for one in many:
            one.socket.settimeout(0.02)
            with contextlib.suppress(TimeoutError):
                while True:
                    one.send(1000 * b"G1 X1\n")
            one.reset()
        gateway.wait("they are gone", lambda: console(gateway, "clients") == 0)
        one = Telnet(house)
        assert one.ask("[ESP500]") == "user"
        printer.reading.set()
        one.send(b"M115\n")
        gateway.wait("it reads again", lambda: b"M115" in printer.lines)
        # what the port and the queue had
        assert len(printer.lines) < 5000, len(printer.lines)
        quiet(gateway)


def test_the_port_is_left_to_others_and_the_gateway_begins_again():
    with bridge(level="admin") as (house, gateway, printer):
        one, two = Telnet(house), Telnet(house)
        assert one.ask("[ESP900]") == f"ENABLED - {house.port}"
        assert one.ask("[ESP131]") == str(PORT) and one.ask("[ESP111]") == house.console
        one.send(b"[ESP900]DISABLE\n")
        assert sorted((one.line(), one.line())) == [
            "[machine disconnected: given free by [ESP900]DISABLE, until [ESP900]ENABLE; lines not sent: 0]", "ok"]
        gateway.wait("it is given free", lambda: is_free(printer.slave))
        assert one.ask("M105") == f"error: {house.port}: given free by [ESP900]DISABLE, until [ESP900]ENABLE"
        assert one.ask("[ESP900]") == f"DISABLED - {house.port}"
        assert one.ask("[ESP900]ENABLE") == "ok" and one.line() == "[machine connected]"
        assert one.ask("M105") == "ok T:21.3 /0.0"
        one.send(b"[ESP130]CLOSE\n")
        while two.socket.recv(100):
            pass
        one = Telnet(house)
        assert one.ask("[ESP444]RESTART") == "Now restarting..."
        # its sockets are ours
        assert gateway.child.wait(PATIENCE) == 75


def test_a_program_that_wants_a_serial_port():
    import serial
    with bridge(level=None) as (house, gateway, printer):
        path, other = house.folder / "pty", Telnet(house)
        assert other.ask("[ESP500]") == "guest" and console(gateway, "clients") == 1

        class Port:
            """What prints() needs, over pyserial."""
            def __init__(self):
                self.port = serial.Serial(str(path), 115200, timeout=PATIENCE)
                self.send = self.port.write

            def line(self):
                line = self.port.readline()
                assert line.endswith(b"\n"), line
                return line[:-1].decode()
        one = Port()
        prints(one, 300)
        assert printer.done == list(range(1, 301)) and not printer.faults
        one.send(b"[ESP500]\n")
        assert one.line() == "user" and [other.line() for _ in range(300)] == 300 * ["ok"]
        one.send(b"M106\nM107\n")
        one.port.close()
        gateway.wait("it is gone", lambda: console(gateway, "clients") == 1)
        assert [other.line(), other.line()] == ["ok", "ok"]
        # who opens it next does not get what was for another one
        printer.say(b"nobody is there\n")
        assert other.line() == "nobody is there"
        one = Port()
        gateway.wait("it is there", lambda: console(gateway, "clients") == 2)
        one.send(b"M105\n")
        assert one.line() == "ok T:21.3 /0.0"
        # and a program that does not read costs nobody anything
        printer.say(b"".join(b"line %d of many\n" % number for number in range(20_000)))
        while other.line() != "line 19999 of many":
            pass
        one.port.close()
        gateway.wait("it is gone", lambda: console(gateway, "clients") == 1)

        def second(link=None):
            """What another gateway says, which was started by mistake; with another link in the place of ours."""
            name = "second.log"
            (house.folder / name).unlink(missing_ok=True)
            if link:
                path.with_name("other").symlink_to(link)
            conf = house.folder / "second.conf"
            where = path.with_name("other") if link else path
            conf.write_text(f"[http]\nlisten = {free_address()}:8580\n[pty]\npath = {where}\n", encoding="utf-8")
            child = house.spawn("python", "-B", House.programs["pokeys-gateway"], "--config", conf, "--runtime-directory",
                                house.runtime, log=name, env={**os.environ, **rig.environment()})
            assert child.wait(PATIENCE) == 1
            return house.log(name)
        before = path.readlink()
        assert f"[pty] path: another gateway has {path}" in second() and path.readlink() == before
        assert "is a link to /dev/ttyS0, and is not replaced" in second("/dev/ttyS0")
        assert path.with_name("other").readlink() == pathlib.Path("/dev/ttyS0")
        gateway.child.send_signal(signal.SIGTERM)
        gateway.child.wait(PATIENCE)
        assert not path.is_symlink()


def test_a_stop():
    with bridge() as (house, gateway, printer):
        host, other = Telnet(house), Telnet(house)
        printer.reading.clear()
        host.send(9000 * b"G1 X1\n")
        gateway.wait("the port is full", lambda: console(gateway, "waiting", "machine") == 64)
        other.send(b"M112\n")
        while not (line := other.line()).startswith("[stop by telnet"):
            assert line == "ok"
        printer.reading.set()
        gateway.wait("it has it", lambda: b"M112" in printer.lines)
        # a pseudoterminal keeps what it has got
        assert printer.lines.index(b"M112") + int(line.split()[-1][:-1]) < 9000
        assert console(gateway, "stops_total") == 1


def test_clients_that_stop_or_go():
    with bridge() as (house, gateway, printer):
        # nc: sends, says that this was all, and wants the answer
        for text, said in (("M105\n", ["ok T:21.3 /0.0"]), ("[ESP500]\nM105", ["user", NO_END]), ("G", [NO_END])):
            one = Telnet(house)
            one.send(text.encode())
            one.socket.shutdown(socket.SHUT_WR)
            assert [one.line() for _ in said] == said and one.socket.recv(1) == b""
            one.close()
        assert printer.lines == [b"M105"]
        # much that was sent, and is read later than usual
        one = Telnet(house, buffer=2048)
        one.send(b"M503\n")
        one.socket.shutdown(socket.SHUT_WR)
        time.sleep(3)
        count = 0
        while count < 10_000:
            line = one.line()
            count += int(line[9:-1]) if line.startswith("[dropped") else 1
        assert (count, line, one.socket.recv(1)) == (10_000, "echo: setting 9999 of a long list", b"")
        one.close()
        # gone before the end of a line: nothing of it reaches the printer
        one = Telnet(house)
        assert one.level() == "user"
        one.send(b"G1 X1")
        one.reset()
        gateway.wait("it is gone", lambda: console(gateway, "clients") == 0)
        # stopped in the middle: nobody notices
        child = subprocess.Popen([sys.executable, "-c", "import socket, sys, time\n"
                                  f"one = socket.create_connection(({house.console!r}, {PORT}))\n"
                                  "print(flush=True)\n"
                                  "while True: one.recv(100)"], stdout=subprocess.PIPE)
        house.children.append(child)
        child.stdout.readline()
        child.send_signal(signal.SIGSTOP)
        host = Telnet(house)
        prints(host, 200)
        assert printer.done == list(range(1, 201)) and not any(b"X1" == line[-2:] for line in printer.lines)
        child.kill()
        gateway.wait("it is gone", lambda: console(gateway, "clients") == 1)
        # sixteen of another address at most are not to be tried here; of this computer, 64
        many = [Telnet(house) for _ in range(63)]
        assert many[-1].ask("[ESP500]") == "user"
        late = Telnet(house)
        assert late.line() == "error: too many clients are connected; try again later"
        for one in many:
            one.close()
        gateway.wait("there is room", lambda: console(gateway, "clients") == 1)
        assert Telnet(house).ask("[ESP500]") == "user"
        # a page of any site can make a browser send this
        one = Telnet(house)
        one.send(b"POST / HTTP/1.1\r\nContent-Type: text/plain\r\n\r\nM104 S300\r\n")
        assert one.line() == "HTTP/1.1 400 Bad Request\r"
        assert not any(b"M104" in line or b"HTTP" in line for line in printer.lines)
        quiet(gateway)


def test_a_telnet_program():
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            import telnetlib
    except ImportError:
        print("not tried: a_telnet_program: telnetlib is missing (Debian 13: python3-zombie-telnetlib)", file=sys.stderr)
        return
    with bridge() as (house, gateway, printer):
        one = telnetlib.Telnet(house.console, PORT, PATIENCE)
        offered = []
        one.set_option_negotiation_callback(lambda _, verb, option: offered.append((verb, option)))
        one.sock.sendall(b"\xff\xfb\x1f\xff\xfd\x01")
        one.write(b"M105\r\n")
        assert one.read_until(b"\n", PATIENCE) == b"ok T:21.3 /0.0\r\n"
        one.write(b"M117 \xff\r\n")
        assert one.read_until(b"\n", PATIENCE) == b"ok\r\n"
        assert printer.lines == [b"M105", b"M117 \xff"] and offered == [(b"\xfe", b"\x1f"), (b"\xfc", b"\x01")]
        one.close()
        quiet(gateway)


def test_who_has_to_log_in():
    secret = subprocess.run([rig.PYTHON, "-c", "from pokeys_gateway.access import make_secret as make\n"
                             "print(make('printer!!'))"], capture_output=True, text=True, check=True,
                            env={**os.environ, **rig.environment()}).stdout.strip()
    with bridge(level=None) as (house, _gateway, printer):
        one = Telnet(house)
        assert one.ask("[ESP500]") == "guest" and one.ask("M105").startswith("error: not sent: this needs level user")
        assert not printer.lines
    users = f"anna:user:{secret}\nadmin:admin:{secret}\n"
    with bridge(level=None, users=users) as (house, gateway, printer):
        one, two = Telnet(house), Telnet(house)
        assert one.ask("[ESP500]") == "Not authenticated" and one.ask("M105").startswith("error: not sent: this needs level user")
        assert one.ask("[ESP500]user=anna pwd=nothing") == "error: wrong user name or password"
        assert one.ask("[ESP500]user=anna pwd=printer!!") == "user"
        assert one.ask("M105") == "ok T:21.3 /0.0"
        # what the machine says is not for those who may not read
        assert two.ask("[ESP500]pwd=printer!!") == "admin"
        assert two.ask("[ESP420]") == "Configuration:"
        # a user who is removed is none any more, at once
        (house.folder / "users").write_text(users.splitlines()[1] + "\n", encoding="utf-8")
        gateway.child.send_signal(signal.SIGHUP)
        gateway.wait("the users are read again", lambda: "users read again" in house.log("gateway.log"))
        assert one.ask("M105").startswith("error: not sent: this needs level user") and printer.lines == [b"M105"]


def test_what_is_configured():
    rig.need_libraries()
    with House() as house:
        def judged(text):
            (conf := house.folder / "gateway.conf").write_text(text, encoding="utf-8")
            return subprocess.run([House.programs["pokeys-gateway"], "--check-config", "--config", conf],
                                  capture_output=True, text=True, check=False, env={**os.environ, **rig.environment()})

        def fails(text, said):
            ran = judged(text)
            assert (ran.returncode, ran.stderr.count("\n")) == (78, 1) and said in ran.stderr, ran
        # what the chapter says
        page = (rig.ROOT / "docs/console.md").read_text(encoding="utf-8")
        examples = re.findall(r"^```\n(\[machine\].*?)^```$", page, re.M | re.S)
        assert len(examples) == 4 and not any(judged(one).returncode for one in examples), list(map(judged, examples))
        fails("[telnet]\nlisten = 192.168.1.5:23\n", "gateway.conf:2: [telnet] listen: 192.168.1.5:23 is reached from other "
              "computers, and telnet has no encryption")
        fails("[telnet]\nlisten = 192.168.1.5:23\nplaintext = yes\n", "this needs a user, which pokeys-gateway")
        fails("[telnet]\nlisten = 127.0.0.1:8582\n[esp3d]\nlisten = 127.0.0.1:8581\n",
              "127.0.0.1:8582 is used by [telnet] already (esp3d needs the port behind its own too)")
        # an address that is taken: one line, and the program ends
        taken = socket.create_server((free_address(), PORT))
        (house.folder / "gateway.conf").write_text(f"[telnet]\nlisten = {taken.getsockname()[0]}:{PORT}\n", encoding="utf-8")
        gateway = rig.Gateway(house, "--config", house.folder / "gateway.conf")
        assert gateway.child.wait(PATIENCE) == 1
        assert f"{taken.getsockname()[0]}:{PORT}: Address already in use" in house.log("gateway.log"), house.log("gateway.log")


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=3))
