#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The console with programs that people have: telnet at a terminal, curl and nc, as docs/console.md has them."""
import os
import pathlib
import re
import shutil
import subprocess
import sys

from bridge import PAGES, PORT, bridge, quiet
from house import PATIENCE, Skip, main, wait_for

PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs/console.md"


def need(name, package):
    if not shutil.which(name):
        raise Skip(f"{name} is not installed (Debian: {package})")


def test_telnet_at_a_terminal():
    need("telnet", "inetutils-telnet")
    with bridge() as (house, gateway, printer):
        master, slave = os.openpty()
        child = subprocess.Popen(["telnet", house.console, str(PORT)], stdin=slave, stdout=slave, stderr=slave,
                                 start_new_session=True)
        house.children.append(child)
        os.close(slave)
        os.set_blocking(master, False)
        shown = b""

        def shows(text):
            nonlocal shown
            try:
                shown += os.read(master, 4096)
            except BlockingIOError:
                pass
            except OSError:         # it has ended, and its terminal with it
                assert text in shown, shown
            return text in shown
        wait_for("it is connected", lambda: shows(b"Connected to"), say=lambda: shown)
        os.write(master, b"M105\r")
        wait_for("the printer's answer", lambda: shows(b"ok T:21.3 /0.0\r\n"), say=lambda: shown)
        os.write(master, b"[ESP500]\r")
        wait_for("the gateway's answer", lambda: shows(b"user\r\n"), say=lambda: shown)
        assert printer.lines == [b"M105"], printer.lines
        os.write(master, b"\x1dquit\r")
        wait_for("its end", lambda: shows(b"Connection closed"), say=lambda: shown)
        assert child.wait(PATIENCE) == 0
        os.close(master)
        quiet(gateway)


def test_the_commands_of_the_page():
    need("curl", "curl")
    need("nc", "netcat-openbsd")
    text = PAGE.read_text(encoding="utf-8")
    nc, = re.findall(r"`(printf [^`]*\\\| nc [^`]*)`", text)
    curl, spaces, upload = re.findall(r"`(curl [^`]*)`", text)
    with bridge() as (house, gateway, printer):
        def run(command):
            command = command.replace("\\|", "|").replace("\n", " ").replace("127.0.0.1 2323", f"{house.console} {PORT}").replace(
                "127.0.0.1:8581", f"{house.console}:{PAGES}")
            ran = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=PATIENCE, check=False)
            assert ran.returncode == 0, (command, ran)
            return ran.stdout
        assert run(nc) == "ok T:21.3 /0.0\n"
        assert re.search(rf"^machine: {house.port}, lines sent: ", run(curl), re.M), run(curl)
        assert run(curl.replace("[ESP420]", "M105")) == "ESP3D says: command forwarded"
        assert run(spaces) == "ESP3D says: command forwarded"
        (house.folder / "part.gcode").write_text("G28\n", encoding="utf-8")
        assert '"status": "part.gcode uploaded"' in run(f"cd {house.folder}; {upload}")
        assert (house.folder / "files/part.gcode").read_text(encoding="utf-8") == "G28\n"
        gateway.wait("it has them", lambda: printer.lines == [b"M105", b"M105", b"G1 X1"])
        quiet(gateway)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=2))
