#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The console under floods, and beside clients that are stopped: each line is there in its order, or counted.

$POKEYS_SOAK_S: how long each of them lasts, in seconds.
"""
import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
import time

from bridge import PAGES, PORT, Printer, Telnet, bridge, console, quiet
from house import PATIENCE, Skip, main, wait_for

SECONDS = float(os.environ.get("POKEYS_SOAK_S", "1"))
RATE = 10_000               # lines a second of a client
HALF_DEAD = 100
UPGRADE = ("GET / HTTP/1.1\r\nHost: {0}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
           "Sec-WebSocket-Protocol: webui-v3\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n")


def account(lines):
    """Of "flood 0" to "end N": how many were seen, and how many were said to be dropped; nothing else is missing."""
    seen = dropped = gap = 0
    for line in lines:
        if line.startswith("[dropped "):
            gap += int(line[9:-1])
        elif line.startswith(("flood ", "end ")):
            number = int(line.split()[1])
            assert number == seen + dropped + gap, (line, seen, dropped, gap)
            dropped, gap = dropped + gap, 0
            if line.startswith("end "):
                return seen, dropped
            seen += 1
    raise AssertionError(f"no end after {seen} lines")


class Flood(threading.Thread):
    """The printer says lines without a pause."""

    def __init__(self, printer):
        super().__init__(daemon=True)
        self.printer, self.count, self.over = printer, 0, threading.Event()
        self.start()

    def run(self):
        while not self.over.is_set():
            self.printer.say(b"".join(b"flood %d\n" % number for number in range(self.count, self.count + 64)))
            self.count += 64
        self.printer.say(b"end %d\n" % self.count)

    def stop(self):
        self.over.set()
        self.join(PATIENCE)


class Witness(threading.Thread):
    """Somebody who reads as fast as it can."""

    def __init__(self, house):
        super().__init__(daemon=True)
        self.telnet, self.found = Telnet(house), None
        self.start()

    def run(self):
        try:
            self.found = account(iter(self.telnet.line, None))
        except Exception as error:
            self.found = error

    def total(self):
        self.join(PATIENCE)
        assert isinstance(self.found, tuple), self.found
        return sum(self.found)


@contextlib.contextmanager
def watched(**how):
    """A bridge with two who read everything; at the end, nobody has a message any more."""
    with bridge(**how) as (house, gateway, printer):
        before = console(gateway, "clients")
        witnesses = [Witness(house) for _ in range(2)]
        gateway.wait("they are there", lambda: console(gateway, "clients") == before + 2)
        yield house, gateway, printer, witnesses
        for one in witnesses:
            one.telnet.socket.shutdown(socket.SHUT_RDWR)
            one.join(PATIENCE)
            one.telnet.close()
        gateway.wait("they are gone", lambda: console(gateway, "clients") == before)
        quiet(gateway)


def test_a_machine_that_talks_without_pause():
    with watched() as (house, gateway, printer, witnesses):
        frozen = Telnet(house, buffer=2048)
        assert frozen.ask("[ESP500]") == "user"
        flood = Flood(printer)
        time.sleep(SECONDS)
        # lines and a stop get through meanwhile
        frozen.send(b"M106\nM112\n")
        wait_for("the stop", lambda: b"M112" in printer.lines)
        flood.stop()
        assert [one.total() for one in witnesses] == 2 * [flood.count]
        assert sum(account(iter(frozen.line, None))) == flood.count
        frozen.close()
        assert console(gateway, "dropped_total") >= sum(one.found[1] for one in witnesses)


def test_clients_that_send_without_pause():
    with watched(printer=Silent) as (house, _gateway, printer, _witnesses):
        one, other = Telnet(house), Telnet(house)
        end, count = time.monotonic() + SECONDS, {b"F": 0, b"H": 0}
        while time.monotonic() < end:
            for client, name, size in (one, b"F", RATE // 100), (other, b"H", 1):
                client.send(b"".join(b"G1 %s%d\n" % (name, i) for i in range(count[name], count[name] + size)))
                count[name] += size
            time.sleep(0.01)
        wait_for("all lines", lambda: len(printer.lines) == sum(count.values()), PATIENCE + 10 * SECONDS)
        for name, lines in count.items():
            assert [line for line in printer.lines if line[3:4] == name] == [b"G1 %s%d" % (name, i) for i in range(lines)]
        one.close()
        other.close()


def test_half_dead_pages():
    with watched() as (house, gateway, printer, witnesses):
        half = []
        for number in range(HALF_DEAD):
            one = socket.socket()
            one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            one.connect((house.console, PAGES + 1))
            request = UPGRADE.format(f"{house.console}:{PAGES + 1}").encode()
            one.sendall(request if number % 2 else request[:number])
            half.append(one)
        gateway.wait("half of them are pages", lambda: console(gateway, "clients") >= HALF_DEAD // 2)
        flood = Flood(printer)
        time.sleep(SECONDS)
        # it answers others meanwhile
        assert gateway.ask("/metrics")[0] == 200
        flood.stop()
        assert [one.total() for one in witnesses] == 2 * [flood.count]
        for one in half:
            one.close()


STOPPED = """
import asyncio, os, socket, sys
from soak import account
kind, host, port, path = sys.argv[1:]
def lines(read):
    rest = b""
    while data := read():
        *found, rest = (rest + data).split(b"\\n")
        yield from (one.decode() for one in found)
async def web():
    import websockets
    async with websockets.connect(f"ws://{host}:{int(port)}/", subprotocols=[kind], ping_interval=None) as one:
        print(flush=True)
        text, at = "", 0
        found = []
        while not found or not found[-1].startswith("end "):
            data = await one.recv()
            if isinstance(data, str) and kind == "webui-v3":
                continue        # currentID and activeID
            *more, text = (text + (data if isinstance(data, str) else data.decode())).split("\\n")
            found += more
        return account(found)
if kind == "telnet":
    one = socket.create_connection((host, int(port)))
    print(flush=True)
    found = account(lines(lambda: one.recv(4096)))
elif kind == "pty":
    fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
    os.write(fd, b"M105\\n")
    print(flush=True)
    found = account(lines(lambda: os.read(fd, 4096)))
else:
    found = asyncio.run(web())
print(*found, flush=True)
"""


def test_clients_that_are_stopped():
    try:
        import websockets  # noqa: F401
    except ImportError as error:
        raise Skip(f"{error} (Debian: python3-websockets)") from None
    with watched() as (house, _gateway, printer, witnesses):
        children = []
        for kind, port in ("telnet", PORT), ("pty", 0), ("webui-v3", PAGES + 1), ("arduino", PAGES):
            children.append(subprocess.Popen(
                [sys.executable, "-B", "-c", STOPPED, kind, house.console, str(port), str(house.folder / "pty")],
                stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, sys.path))}))
        house.children += children
        for child in children:
            child.stdout.readline()
            child.send_signal(signal.SIGSTOP)
        # an upload that stands still
        upload = socket.create_connection((house.console, PAGES))
        upload.sendall(f"POST /files HTTP/1.1\r\nHost: {house.console}:{PAGES}\r\nContent-Length: 100000\r\n"
                       "Content-Type: multipart/form-data; boundary=x\r\n\r\n--x\r\n".encode())
        wait_for("the pty's line", lambda: printer.lines == [b"M105"])
        flood = Flood(printer)
        time.sleep(SECONDS)
        flood.stop()
        # these have lost nothing by it
        assert [one.total() for one in witnesses] == 2 * [flood.count]
        for child in children:
            child.send_signal(signal.SIGCONT)
            said = child.communicate(timeout=PATIENCE)[0].split()
            assert sum(map(int, said)) == flood.count, (child.args[4], said, flood.count)
        upload.close()


class Silent(Printer):
    """Answers nothing, so that nothing is dropped for those who do not read."""

    def take(self, line):
        self.lines.append(line)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=2))
