# SPDX-License-Identifier: GPL-2.0-or-later
"""What the console of a gateway has to do: a printer, and clients that send too much or read nothing. Prints JSON:
how many lines there were.

usage: talkers.py ADDRESS TELNET_PORT PAGE_PORT LINK WAY SECONDS

WAY: idle, machine (the printer talks without a pause), client (10,000 lines a second from one client), pages (the
printer talks, and 100 web sockets read nothing). The printer is a pseudoterminal; LINK is its name.
"""
import json
import multiprocessing
import os
import pathlib
import socket
import sys
import time
import tty

PATIENCE_S = 20
RATE, PAGES = 10_000, 100
LINE = b"echo: a line of a printer that talks without a pause\n"


def printer(slave, master, talks, said):
    """Talks until it is ended, or only hears."""
    os.set_blocking(master, not talks)
    while True:
        try:
            os.read(master, 65536)
        except BlockingIOError:
            pass
        if talks:
            data = LINE * 64
            while data:
                try:
                    data = data[os.write(master, data):]
                except BlockingIOError:
                    time.sleep(0.0005)
            said.value += 64


def sender(where, said, end_at):
    """A client that sends 10,000 lines a second, as far as they are taken."""
    with socket.create_connection(where) as one:
        while time.monotonic() < end_at:
            one.sendall(b"G1 X1 Y1\n" * (RATE // 100))
            said.value += RATE // 100
            time.sleep(0.01)


def reader(where):
    """A client that reads everything."""
    with socket.create_connection(where) as one:
        while one.recv(65536):
            pass


def half_dead(where, number):
    one = socket.socket()
    one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
    one.connect(where)
    request = (f"GET / HTTP/1.1\r\nHost: {where[0]}:{where[1]}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
               "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: webui-v3\r\n"
               "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n").encode()
    one.sendall(request if number % 2 else request[:number])
    return one


def wait_for_machine(where):
    end_at = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_at:
        with socket.create_connection(where, PATIENCE_S) as one:
            one.sendall(b"[ESP420]json\n")
            answer = b""
            while b"}]}" not in answer and (data := one.recv(65536)):
                answer += data
        if b", lines sent: " in answer.partition(b'"id":"machine"')[2].partition(b"}")[0]:
            return
        time.sleep(0.1)
    sys.exit("the gateway does not find the printer")


def main(address, telnet, pages, link, way, seconds):
    where, seconds = (address, int(telnet)), float(seconds)
    said = multiprocessing.Value("q", 0)
    master, slave = os.openpty()
    tty.setraw(slave)
    pathlib.Path(link).unlink(missing_ok=True)
    os.symlink(os.ttyname(slave), link)
    talks = way in ("machine", "pages")
    children = []

    def start(function, *words):
        children.append(multiprocessing.Process(target=function, args=words, daemon=True))
        children[-1].start()
    start(printer, slave, master, talks, said)
    wait_for_machine(where)
    start(reader, where)
    sockets = [half_dead((address, int(pages) + 1), i) for i in range(PAGES)] if way == "pages" else []
    if way == "client":
        start(sender, where, said, time.monotonic() + seconds)
    before = said.value
    time.sleep(seconds)
    print(json.dumps({"lines": said.value - before, "seconds": seconds}))
    for one in children:
        one.kill()
        one.join()
    for one in sockets:
        one.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
