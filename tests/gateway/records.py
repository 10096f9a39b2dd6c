#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The flight recorder's files: the gateway lists them and sends them complete, and pokeysctl can read them. It sends
no other file, and a slow client does not affect others."""
import asyncio
import contextlib
import json
import os
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse
from datetime import datetime

from rig import PATIENCE, Gateway, House, need_libraries
from house import equal, main, run, wait_equal  # noqa: E402  (rig.py finds it)

NAME = re.compile(r"pokeysd-\d{8}T\d{6}Z-lost\.pcapng")
KIND = "application/x-pcapng"


class Workshop:
    """A House whose daemon writes records, and a gateway that knows where."""

    def __init__(self, house, access=""):
        self.house = house
        (records := house.folder / "records").mkdir()
        self.records = records
        # so that a busy computer loses the device only when the simulator ends
        house.device_keys["mill"] |= {"lost-after-ms": 2000, "stale-after-ms": 1000}
        self.sim = house.start_sim()
        house.daemon_keys["record-folder"] = records
        self.daemon = house.start_daemon()
        house.wait_fresh()
        (conf := house.folder / "gateway.conf").write_text(
            f"[gateway]\nrecord-folder = {records}\n[access]\n{access}", encoding="utf-8")
        self.gateway = Gateway(house, "--config", conf)
        self.gateway.wait("the gateway", lambda: self.gateway.ask("/healthz")[0] == 200)

    def listed(self):
        """The records but for those of missed cycles, which a busy computer adds."""
        return [one for one in self.gateway.json("/api/records")["records"] if one["reason"] != "late"]

    def lose(self):
        """End the simulator. The record that the daemon writes of it."""
        self.sim.kill()
        self.gateway.wait("the record", self.listed)
        return self.listed()[0]

    def replay(self, body):
        """The packets and events that pokeysctl replay finds in a file."""
        (path := self.house.folder / "got.pcapng").write_bytes(body)
        ran = run(House.programs["pokeysctl"], "replay", path, "--json")
        equal(ran.returncode, 0, ran.stderr)
        return [json.loads(line) for line in ran.stdout.splitlines()]


def workshop(work, **keys):
    need_libraries()
    with House() as house:
        work(Workshop(house, **keys))
        assert "Traceback" not in house.log("gateway.log"), house.log("gateway.log")


def test_a_record_of_a_fault_is_there_and_comes_whole():
    def work(shop):
        gateway = shop.gateway
        answer = gateway.json("/api/records")
        equal((answer["folder"], answer["trouble"], shop.listed()), (str(shop.records), "", []))
        began = time.time()
        found = shop.lose()
        name = found["name"]
        equal((len(shop.listed()), found["reason"], found["text"]), (1, "lost", "a device was lost"))
        assert NAME.fullmatch(name), name
        when = datetime.fromisoformat(found["time"])
        equal(when.strftime("pokeysd-%Y%m%dT%H%M%SZ-lost.pcapng"), name)
        assert began - 1 <= when.timestamp() <= time.time() + 1, (began, when)
        status, headers, body = gateway.ask(f"/api/records/{name}")
        equal((status, headers["Content-Type"], headers["Content-Length"], headers["Content-Disposition"]),
              (200, KIND, str(found["bytes"]), f'attachment; filename="{name}"'))
        equal(headers["X-Content-Type-Options"], "nosniff")
        equal(body, (shop.records / name).read_bytes())
        assert len(shop.replay(body)) > 100
        status, headers, body = gateway.ask(f"/api/records/{name}", "HEAD")
        equal((status, headers["Content-Length"], body), (200, str(found["bytes"]), b""))
    workshop(work)


def test_what_is_recorded_now_is_what_pokeysctl_records():
    def work(shop):
        gateway, house = shop.gateway, shop.house
        gateway.wait_running()
        status, headers, body = gateway.ask("/api/devices/mill/record")
        equal((status, headers["Content-Type"]), (200, KIND))
        assert re.fullmatch(r'attachment; filename="pokeysd-\d{8}T\d{6}Z-mill\.pcapng"', headers["Content-Disposition"])
        lines = shop.replay(body)
        assert len(lines) > 100, len(lines)
        equal(gateway.ask("/api/devices/lathe/record")[0], 404)
        equal(gateway.ask("/api/devices/mill/record", "HEAD")[0], 405)
        # the ring of a killed daemon can still be read
        shop.daemon.kill()
        shop.daemon.wait()
        status, _headers, body = gateway.ask("/api/devices/mill/record")
        equal((status, len(shop.replay(body)) > 100), (200, True))
        # without a ring there is no record
        (house.runtime / "recorder").unlink()
        status, _headers, body = gateway.ask("/api/devices/mill/record")
        equal((status, "no recorder in" in json.loads(body)["error"]["message"]), (503, True), body)
    workshop(work)


def test_nothing_else_is_given_away():
    def work(shop):
        gateway, folder = shop.gateway, shop.records
        name = shop.lose()["name"]
        good = (folder / name).read_bytes()
        secret = shop.house.folder / "secret"
        secret.write_text("not for others")
        (folder / "pokeysd-20200101T000000Z-lost.pcapng").symlink_to(secret)
        (folder / "pokeysd-20200102T000000Z-lost.pcapng").mkdir()
        os.mkfifo(folder / "pokeysd-20200103T000000Z-lost.pcapng")
        for other in "notes.txt", "pokeysd-20200104T000000Z-lost.pcapng.new", "pokeysd-20209999T000000Z-lost.pcapng":
            (folder / other).write_text("not for others")
        mine = [one for one in sorted(os.listdir(folder)) if not one.startswith(f"pokeysd-{time.gmtime().tm_year}")]
        equal(len(mine), 6)
        equal([one["name"] for one in shop.listed()], [name])
        for wrong in (*mine, "..", ".", "../secret", "/etc/passwd", "..\\secret",
                      name + "\0", name + "/", "a/../" + name, "pokeysd-20200101T000000Z-gone.pcapng", "x" * 5000, "\n",
                      "\udcff"):
            path = urllib.parse.quote(wrong, safe="", errors="surrogateescape")
            status, _headers, body = gateway.ask(f"/api/records/{path}")
            assert status in (400, 404) and b"not for others" not in body, (wrong, status, body)
        # so is a reason that only a newer daemon knows
        (folder / "pokeysd-20300101T000000Z-quake.pcapng").write_bytes(b"x" * 70000)
        newest = shop.listed()[0]
        equal((newest["reason"], newest["text"], newest["bytes"]), ("quake", "quake", 70000))
        equal(gateway.ask("/api/records/pokeysd-20300101T000000Z-quake.pcapng")[2], b"x" * 70000)
        # an empty one
        (folder / "pokeysd-20300102T000000Z-late.pcapng").touch()
        equal(gateway.ask("/api/records/pokeysd-20300102T000000Z-late.pcapng")[::2], (200, b""))
        equal(gateway.ask(f"/api/records/{name}")[2], good)
        # a folder is no record, whatever its name
        (folder / "pokeysd-20300103T000000Z-late.pcapng").mkdir()
        equal(gateway.ask("/api/records/pokeysd-20300103T000000Z-late.pcapng")[0], 404)
        # why the folder cannot be read
        folder.rename(folder.with_name("gone"))
        for why, make in ("No such file or directory", lambda: None), ("Not a directory", folder.touch):
            make()
            found = gateway.json("/api/records")
            equal((found["trouble"].startswith(f"{folder}: {why}; see record-folder"), found["records"]), (True, []))
            equal(gateway.ask(f"/api/records/{name}")[0], 404)
    workshop(work)


def slow(gateway, path):
    """A client that sends a request and reads the beginning of the answer only."""
    client = socket.socket()
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    client.settimeout(PATIENCE)
    client.connect(("127.0.0.1", gateway.port))
    client.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode())
    assert client.recv(15).startswith(b"HTTP/1.1 200"), path
    return client


def rest(client):
    """How many bytes the client still receives."""
    size = 0
    with contextlib.suppress(ConnectionResetError):
        while part := client.recv(1 << 20):
            size += len(part)
    client.close()
    return size


def children(pid):
    """The processes that a process has started."""
    return subprocess.run(["pgrep", "-P", str(pid)], capture_output=True, text=True, check=False).stdout.split()


def test_slow_clients_harm_nobody():
    def work(shop):
        gateway = shop.gateway
        gateway.wait_running()
        # larger than the buffers of a connection
        (shop.records / "pokeysd-20300101T000000Z-late.pcapng").write_bytes(os.urandom(16 << 20))
        path = "/api/records/pokeysd-20300101T000000Z-late.pcapng"
        clients = [slow(gateway, path) for _ in range(4)]
        for other in path, "/api/devices/mill/record":
            status, _headers, body = gateway.ask(other)
            equal((status, "4 records are being sent" in json.loads(body)["error"]["message"]), (503, True), body)
        gateway.wait_running()
        for client in clients:
            client.close()
        gateway.wait("a place", lambda: gateway.ask(path)[0] == 200)
        # one file goes away, and one becomes shorter, while they are sent
        gone, cut = slow(gateway, path), slow(gateway, path)
        file = shop.records / "pokeysd-20300101T000000Z-late.pcapng"
        file.rename(shop.records / "away")
        assert rest(gone) > 16 << 20
        file = shop.records / "away"
        os.truncate(file, 8 << 20)
        assert rest(cut) < 16 << 20
        wait_equal("connections", lambda: gateway.own("connections"), 1)
    workshop(work)


@contextlib.contextmanager
def recording(script):
    """Gateways that are started meanwhile have a pokeysctl that runs a script to record."""
    real = House.programs["pokeysctl"]
    with tempfile.TemporaryDirectory(prefix="pokeysd-test-") as folder:
        program = pathlib.Path(folder, "pokeysctl")
        program.write_text(f'#!/bin/sh\n[ "$1" = record ] || exec {real} "$@"\n{script}\n')
        program.chmod(0o755)
        House.programs["pokeysctl"] = program
        try:
            yield
        finally:
            House.programs["pokeysctl"] = real


def test_a_recording_that_fails_has_a_reason():
    def work(shop):
        shop.gateway.wait_running()
        for _ in range(5):
            status, _headers, body = shop.gateway.ask("/api/devices/mill/record")
            equal((status, json.loads(body)["error"]["message"]), (503, "the disk is gone"))
    with recording("head -c 100000 /dev/zero; echo 'pokeysctl: the disk is gone' >&2; exit 1"):
        workshop(work)


def alone(work):
    """Work with the modules alone, without a gateway."""
    asyncio.run(asyncio.wait_for(work(), PATIENCE))


def test_a_recording_that_never_ends_is_ended():
    async def work():
        from pokeys_gateway import recorder
        from pokeys_gateway.aside import aside
        recorder.PATIENCE_S = 0.2
        os.environ["POKEYSCTL"] = str(House.programs["pokeysctl"])
        try:
            raise AssertionError(await aside(recorder.Recorder(pathlib.Path("/"), "/run/pokeysd").now, "mill"))
        except recorder.NoRecord as error:
            equal(str(error), "pokeysctl record has not ended in 0 s")
        equal(children(os.getpid()), [])
    with recording("exec sleep 1000"):
        alone(work)


def test_a_disk_that_does_not_answer_holds_up_nobody():
    async def work():
        from pokeys_gateway.aside import aside
        free = threading.Event()
        # more than asyncio has threads for
        waiting = [aside(free.wait) for _ in range(100)]
        equal(await asyncio.to_thread(lambda: "done"), "done")
        equal(await aside(lambda: 3), 3)
        try:
            raise AssertionError(await aside(os.stat, "/no/such/file"))
        except FileNotFoundError:
            pass
        # what nobody waits for any more is done all the same, and harms nothing
        waiting.pop().cancel()
        free.set()
        equal(set(await asyncio.gather(*waiting)), {True})
    alone(work)


def test_who_may_not_read_gets_none():
    def work(shop):
        gateway = shop.gateway
        for path in "/api/records", "/api/records/pokeysd-20300101T000000Z-late.pcapng", "/api/devices/mill/record":
            equal(gateway.ask(path)[0], 401, path)
            equal(gateway.ask(path, Host="evil.example")[0], 403, path)
    need_libraries()
    with House() as house:
        users = house.folder / "users"
        users.touch(0o600)
        work(Workshop(house, access=f"users = {users}\n"))


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
