#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A host program of others, Printrun's printcore, prints over telnet and over a serial port, beside other clients,
while the wire to the printer damages lines with numbers: each line is done once, in order.

$POKEYS_HOST_LINES: how many. printcore sends again what the printer asks for.
"""
import contextlib
import os
import random
import select
import subprocess
import sys
import threading
import tty

import moving
import rig
from bridge import PORT, Printer, Telnet, bridge, console, quiet
from house import PATIENCE, main, wait_for

sys.path.insert(1, str(rig.ROOT / "tests"))
import foreign  # noqa: E402  pylint: disable=wrong-import-position

LINES, SEED = int(os.environ.get("POKEYS_HOST_LINES", "400")), int(os.environ.get("POKEYS_SEED", "20062"))
DAMAGED = 31                # each line with such a number
STEPS = ["--no-deps", "printrun==2.2.0"], ["pyserial==3.5"]
PROGRAM = """
import sys, time
from printrun import gcoder
from printrun.printcore import printcore
def wait(holds):
    while not holds():
        time.sleep(0.01)
core = printcore()
core.recvcb = lambda line: print(line, end="", flush=True)
core.connect(sys.argv[1], 115200)
wait(lambda: core.online)
core.startprint(gcoder.LightGCode(open(sys.argv[2]).read().splitlines()))
wait(lambda: not core.printing and not core.print_thread and core.clear)
# it begins its sender again after that, and cannot end one that has not begun
wait(lambda: core.send_thread and core.send_thread.is_alive())
core.disconnect()
"""


class NoisyPrinter(Printer):
    """A printer with a wire that damages lines, which it has sent again, as Marlin does."""

    def __init__(self, name):
        self.rng, self.last, self.numbered, self.damaged = random.Random(SEED), 0, 0, 0
        super().__init__(name)

    def take(self, line):
        if not line.startswith(b"N"):
            if line.startswith(b"G"):
                self.done.append(line)
            super().take(line)
            return
        self.numbered += 1
        if self.numbered % DAMAGED == 0:
            self.damaged += 1
            line = bytearray(line)
            # of the text, so that the checksum says so
            line[self.rng.randrange(3, line.rindex(b"*"))] ^= 1 << self.rng.randrange(7)
        body, _, total = bytes(line).rpartition(b"*")
        words = body.split()
        try:
            number = int(words[0][1:])
            if int(total) != checksum(body):
                raise ValueError
        except (ValueError, IndexError):
            self.ask_again(b"checksum mismatch")
            return
        if words[1] != b"M110" and number != self.last + 1:
            self.ask_again(b"Line Number is not Last Line Number+1")
            return
        self.last = number
        if words[1] != b"M110":
            self.done.append(b" ".join(words[1:]))
        self.say(b"ok\n")

    def ask_again(self, why):
        self.say(b"Error:%s, Last Line: %d\nResend: %d\nok\n" % (why, self.last, self.last + 1))


def checksum(data):
    total = 0
    for byte in data:
        total ^= byte
    return total


def expected():
    return [f"G1 X{i % 200} E{i}".encode() for i in range(LINES)]


@contextlib.contextmanager
def printing(house, port, lines=None):
    """printcore, which prints at a port; its exit status has to be good."""
    part = house.folder / "part.gcode"
    part.write_text("\n".join(lines or [line.decode() for line in expected()]), encoding="utf-8")
    child = subprocess.Popen([os.environ["POKEYS_HOST_PYTHON"], "-c", PROGRAM, str(port), str(part)],
                             stdout=(house.folder / "host.log").open("wb"), stderr=subprocess.STDOUT,
                             env={"HOME": str(house.folder), "PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8"})
    try:
        yield
        assert child.wait(PATIENCE + LINES / 50) == 0, house.log("host.log")
    finally:
        child.kill()
        child.wait()


class Watcher(threading.Thread):
    """Somebody who only looks on, and sees all."""

    def __init__(self, house):
        super().__init__(daemon=True)
        self.telnet, self.seen = Telnet(house), []
        assert self.telnet.ask("[ESP500]") == "user"
        self.start()

    def run(self):
        while not self.seen or self.seen[-1] != "user":
            self.seen.append(self.telnet.line())

    def all(self):
        self.telnet.send(b"[ESP500]\n")
        self.join(PATIENCE)
        self.telnet.close()
        assert not self.is_alive(), len(self.seen)
        return self.seen


def prints_at(port, numbers):
    with bridge(printer=NoisyPrinter) as (house, gateway, printer):
        before = console(gateway, "clients")
        watcher, frozen = Watcher(house), Telnet(house, buffer=2048)
        with printing(house, port(house)):
            pass
        assert printer.done == expected(), (len(printer.done), house.log("host.log")[-500:])
        assert printer.damaged == printer.numbered // DAMAGED and (printer.damaged > 0) == numbers, printer.damaged
        seen = watcher.all()
        assert seen.count("ok") >= LINES + printer.damaged, len(seen)
        assert sum(line.startswith("Resend: ") for line in seen) >= printer.damaged
        frozen.close()
        wait_for("they are gone", lambda: console(gateway, "clients") == before)
        quiet(gateway)


def test_over_telnet():
    """There printcore leaves it to TCP that nothing is damaged, and numbers no lines."""
    prints_at(lambda house: f"{house.console}:{PORT}", False)


def test_over_a_serial_port():
    prints_at(lambda house: house.folder / "pty", True)


def itself(port):
    """It has nothing to print with, and says so for each line; the host gets every answer."""
    with bridge(machine="kind = pokeys\n") as (house, _gateway, _printer):
        watcher = Watcher(house)
        with printing(house, port(house)):
            pass
        said = house.log("host.log").splitlines()
        told = [line for line in said if line.startswith("Error:")]
        assert told == LINES * ["Error:G1: G-code has no device to command; set device in [machine], or operate = yes in [linuxcnc], "
                                "see pokeys-gateway.conf(5)"]
        assert not [line for line in said if "Resend" in line]
        assert watcher.all() == ["user"], "others get no answer of it"


class Wire(threading.Thread):
    """Between a serial port that a program opens, and one that we open: it damages lines with numbers."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self.rng, self.numbered, self.damaged = random.Random(SEED), 0, 0
        self.port, (self.master, self.slave) = os.open(port, os.O_RDWR | os.O_NOCTTY), os.openpty()
        tty.setraw(self.slave)
        self.name = os.ttyname(self.slave)
        self.start()

    def run(self):
        begun = b""
        while True:
            for ready in select.select((self.master, self.port), (), ())[0]:
                data = os.read(ready, 65536)
                if ready == self.port:
                    os.write(self.master, data)
                    continue
                *lines, begun = (begun + data).split(b"\n")
                for line in lines:
                    self.pass_on(line + b"\n")

    def pass_on(self, line):
        if line.startswith(b"N"):
            self.numbered += 1
            if self.numbered % DAMAGED == 0 and b"M110" not in line:
                self.damaged += 1
                damaged = bytearray(line)
                damaged[self.rng.randrange(3, line.rindex(b"*"))] ^= 1 << self.rng.randrange(6)
                line = bytes(damaged).replace(b"\n", b"j").replace(b"\r", b"m")[:-1] + b"\n"
        os.write(self.port, line)


def test_the_gateway_prints_itself():
    """Each line is done once, whatever the wire does: relative moves would end elsewhere."""
    with moving.mill(pty=True) as shop:
        frozen, watcher = Telnet(shop.house, buffer=2048), Telnet(shop.house)
        frozen.send(b"M155 S0.5\n")
        wire = Wire(shop.house.folder / "pty")
        lines = ["G91", "G1 F12000", *(f"G1 X{0.05 if i % 2 else -0.04} E0.01" for i in range(LINES)), "M400"]
        with printing(shop.house, wire.name, lines):
            pass
        said = shop.house.log("host.log")
        assert wire.damaged and wire.damaged >= wire.numbered // DAMAGED - 1, (wire.damaged, wire.numbered)
        assert said.count("Resend: ") >= wire.damaged, said[-500:]
        assert shop.house.state()["moves"]["taken"] == LINES, said[-500:]
        moving.stand(shop)              # printcore ends when its last line is sent, not when M400 is answered
        assert moving.places(shop) == [LINES, 0, 2 * LINES], moving.places(shop)
        assert watcher.ask("[ESP500]") == "user"


def test_the_gateway_itself_over_telnet():
    itself(lambda house: f"{house.console}:{PORT}")


def test_the_gateway_itself_over_a_serial_port():
    itself(lambda house: house.folder / "pty")


if __name__ == "__main__":
    os.environ["POKEYS_HOST_PYTHON"] = str(foreign.environment("printrun", *STEPS))
    sys.exit(main(sys.modules[__name__], beside=3))
