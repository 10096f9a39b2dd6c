#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A gateway that is asked, flooded, stopped, killed and started again, for as long as LinuxCNC runs beside it.

usage: harass.py BUILD RUNTIME PORT
Prints a line for each deed; ends with SIGTERM. POKEYS_SEED repeats the order of deeds.
"""
import contextlib
import http.client
import json
import os
import pathlib
import random
import signal
import socket
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
HANDSHAKE = (b"GET /websocket HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
             b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n")
READY_S, STOPPED_S, FROZEN, REQUESTS = 20, 1.5, 10, 200


class Harasser:
    def __init__(self, build, runtime, port):
        self.port = port
        self.words = ["/usr/bin/python3", "-B", ROOT / "gateway/pokeys-gateway", "--runtime-directory", runtime,
                      "--listen", f"127.0.0.1:{port}"]
        self.env = {**os.environ, "PYTHONPATH": f"{ROOT / 'gateway'}:{ROOT / 'python'}",
                    "POKEYS_SHM_LIBRARY": str(build / "shm/libpokeys_shm.so.0"),
                    "POKEYSCTL": str(build / "tools/pokeysctl")}
        self.child, self.frozen = None, []
        self.start()

    def start(self):
        self.child = subprocess.Popen(self.words, env=self.env, stdin=subprocess.DEVNULL)
        end_at = time.monotonic() + READY_S
        while not self.ask("/healthz"):
            assert self.child.poll() is None, f"the gateway ended with {self.child.returncode}"
            assert time.monotonic() < end_at, "the gateway does not answer"
            time.sleep(0.05)

    def ask(self, path):
        """Is the answer a good one?"""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=READY_S)
        with contextlib.suppress(OSError, http.client.HTTPException):
            connection.request("GET", path)
            answer = connection.getresponse()
            return answer.read() and answer.status == 200
        return False

    def end(self, number):
        self.child.send_signal(number)
        self.child.wait(READY_S)
        self.start()

    # ---- deeds

    def kill(self):
        """As the kernel does it when there is no memory."""
        self.end(signal.SIGKILL)

    def restart(self):
        """As systemd does it."""
        self.end(signal.SIGTERM)

    def stop(self):
        """As a debugger does it."""
        self.child.send_signal(signal.SIGSTOP)
        time.sleep(STOPPED_S)
        self.child.send_signal(signal.SIGCONT)

    def flood(self):
        """As fast as it answers."""
        for _ in range(REQUESTS):
            assert self.ask("/api/devices"), "no answer"

    def freeze(self):
        """Clients that want everything, and read nothing."""
        for client in self.frozen:
            client.close()
        self.frozen = []
        text = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "objects.subscribe",
                           "params": {"objects": {"mill": None}, "rate": 50}}).encode()
        frame = b"\x81\xfe" + len(text).to_bytes(2, "big") + bytes(4) + text
        for _ in range(FROZEN):
            client = socket.create_connection(("127.0.0.1", self.port), READY_S)
            client.sendall(HANDSHAKE + frame)
            self.frozen.append(client)

    def record(self):
        """What the flight recorder holds."""
        assert self.ask("/api/devices/mill/record"), "no record"


def main():
    build, runtime, port = pathlib.Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])
    seed = int(os.environ.get("POKEYS_SEED") or random.SystemRandom().randrange(1 << 30))
    print(f"POKEYS_SEED={seed}", flush=True)
    rng = random.Random(seed)
    harasser = Harasser(build, runtime, port)
    deeds = [harasser.kill, harasser.restart, harasser.stop, harasser.flood, harasser.freeze, harasser.record]
    try:
        while True:
            # each of them, before one comes again
            for deed in rng.sample(deeds, len(deeds)):
                deed()
                print(f"deed {deed.__name__}", flush=True)
                time.sleep(rng.random())
    finally:
        harasser.child.kill()


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    main()
