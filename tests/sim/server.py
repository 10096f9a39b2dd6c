#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeys-sim over real sockets, with a client of its own which does what the
vendor's library does: one outstanding request, and not one reply too many
(protocol sections 1.6 to 1.9 and 7.1). Only the standard library is used, and
nothing of the project's own encoders.

usage: server.py POKEYS-SIM [TEST...]"""
import os
import pathlib
import random
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

SIM = None
PATIENCE = 60.0

CONNECT = ((0x00, ()), (0x03, ()), (0xE0, (0,)), (0x06, (0,)), (0x8F, (0,)))


def loopback_address():
    return f"127.{random.randint(1, 250)}.{random.randint(0, 250)}.{random.randint(2, 250)}"


def request(op, params=(), payload=b"", ident=1):
    head = bytearray((0xBB, op)) + bytearray(params) + bytearray(4 - len(params))
    head.append(ident & 0xFF)
    head.append(sum(head) & 0xFF)
    return bytes(head) + payload + bytes(56 - len(payload))


def fill(slots, axes, ident):
    """A multi-part fill: eight parts, an id for each."""
    parts = []
    for i in range(8):
        mark = i | (0x08 if i == 0 else 0) | (0x10 if i == 7 else 0)
        parts.append(request(0xB0, (mark, 0xFF, slots, axes), bytes(56), ident + i))
    return b"".join(parts)


class Client:
    """One outstanding request; keeps what it received beyond the replies it waited for."""

    def __init__(self, address, port, kind):
        self.sock = socket.socket(socket.AF_INET, kind)
        self.sock.settimeout(PATIENCE)
        self.sock.connect((address, port))
        self.kind = kind
        self.ident = random.randint(0, 255)

    def receive(self):
        if self.kind == socket.SOCK_DGRAM:
            return self.sock.recv(2048)
        got = b""
        while len(got) < 64:
            more = self.sock.recv(64 - len(got))
            if not more:
                raise ConnectionError("closed")
            got += more
        return got

    def ask(self, op, params=(), payload=b""):
        self.ident = (self.ident + 1) & 0xFF
        self.sock.send(request(op, params, payload, self.ident))
        return self.check(self.receive(), op, self.ident)

    @staticmethod
    def check(reply, op, ident):
        assert len(reply) == 64, f"{len(reply)} bytes"
        assert reply[0] == 0xAA and reply[1] == op and reply[6] == ident, reply[:8].hex()
        assert reply[7] == sum(reply[:7]) & 0xFF, "checksum"
        return reply

    def stray(self, wait=0.05):
        """Whatever comes without having been asked for."""
        ready, _, _ = select.select([self.sock], [], [], wait)
        return self.sock.recv(2048) if ready else b""

    def close(self):
        self.sock.close()


class Simulator:
    def __init__(self, folder, *options, address=None, port=0):
        self.address = address or loopback_address()
        self.control = str(folder / f"c{random.getrandbits(32):x}")
        ready, theirs = os.pipe()
        self.child = subprocess.Popen(
            [SIM, "--address", self.address, "--port", str(port), "--control", self.control,
             "--ready-fd", str(theirs), *options],
            pass_fds=(theirs,), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        os.close(theirs)
        with os.fdopen(ready) as line:
            words = line.readline().split()
        if not words:
            raise RuntimeError(self.child.communicate(timeout=PATIENCE)[1])
        self.port = int(words[2])

    def ctl(self, *words):
        return subprocess.run([SIM, "--ctl", self.control, *words], capture_output=True,
                              text=True, timeout=PATIENCE, check=False)

    def must(self, *words):
        done = self.ctl(*words)
        assert done.returncode == 0, done.stderr
        return dict(line.split("=", 1) for line in done.stdout.splitlines())

    def cpu_seconds(self):
        words = pathlib.Path(f"/proc/{self.child.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")

    def stop(self, how=signal.SIGTERM):
        self.child.send_signal(how)
        out, err = self.child.communicate(timeout=PATIENCE)
        return self.child.returncode, out, err


class Base(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="pokeys-sim-"))
        self.open = []

    def tearDown(self):
        for thing in self.open:
            if isinstance(thing, Client):
                thing.close()
            elif thing.child.poll() is None:
                thing.stop()
            for pipe in () if isinstance(thing, Client) else (thing.child.stdout,
                                                              thing.child.stderr):
                pipe.close()
        shutil.rmtree(self.folder)

    def simulator(self, *options, **places):
        sim = Simulator(self.folder, *options, **places)
        self.open.append(sim)
        return sim

    def wait_for_requests(self, sim, count):
        until = time.monotonic() + PATIENCE
        while int(sim.must("stat")["requests"]) < count:
            time.sleep(0.01)
            self.assertLess(time.monotonic(), until, f"{count} requests have not come")

    def client(self, sim, kind=socket.SOCK_DGRAM):
        client = Client(sim.address, sim.port, kind)
        self.open.append(client)
        return client


class Requests(Base):
    def test_the_vendors_connect_sequence_twice_on_each_transport(self):
        sim = self.simulator("--serial", "4711", "--name", "Mill")
        for kind in (socket.SOCK_DGRAM, socket.SOCK_STREAM):
            client = self.client(sim, kind)
            for op, params in CONNECT * 2:
                client.ask(op, params)
            data = client.ask(0x00)
            self.assertEqual(data[8:12], b"PKEx")
            self.assertEqual(struct.unpack_from("<I", data, 12)[0], 4711)
            self.assertEqual(client.ask(0x06, (0,))[8:13], b"Mill\0")
            self.assertEqual(client.stray(), b"")

    def test_a_thousand_requests_have_a_thousand_replies(self):
        sim = self.simulator()
        client = self.client(sim)
        for i in range(1000):
            client.ask(0xCC if i % 2 else 0x85, (0,))
        self.assertEqual(client.stray(), b"")
        stat = sim.must("stat")
        self.assertEqual((stat["requests"], stat["replies"]), ("1000", "1000"))

    def test_parallel_requests_are_answered_in_order(self):
        sim = self.simulator("--service-us", "500")
        client = self.client(sim)
        for i in range(30):
            client.sock.send(request(0x05, ident=i))
        for i in range(30):
            Client.check(client.receive(), 0x05, i)
        self.assertEqual(client.stray(), b"")

    def test_a_fill_of_512_bytes_has_one_reply(self):
        sim = self.simulator()
        for kind in (socket.SOCK_DGRAM, socket.SOCK_STREAM):
            client = self.client(sim, kind)
            client.sock.send(fill(20, 3, 10))
            reply = Client.check(client.receive(), 0xB0, 17)
            self.assertEqual(reply[2], 20)
            self.assertEqual(client.stray(), b"")

    def test_garbage_is_survived(self):
        sim = self.simulator()
        client = self.client(sim)
        chance = random.Random(int(os.environ.get("POKEYS_SEED", "1")))
        for _ in range(100):
            for _ in range(20):     # few enough for the socket's buffer
                client.sock.send(chance.randbytes(chance.choice((1, 63, 64, 65, 128, 512, 1400))))
            client.ask(0x00)
        self.assertEqual(client.stray(), b"")

    def test_two_clients_get_their_own_replies(self):
        sim = self.simulator("--delay-us", "500-1500")
        clients = [self.client(sim) for _ in range(8)]
        for round_ in range(20):
            for i, client in enumerate(clients):
                client.sock.send(request(0x19, (i,), ident=round_))
            for i, client in enumerate(clients):
                self.assertEqual(Client.check(client.receive(), 0x19, round_)[2], i)


    def test_replies_find_their_client_however_many_there_are(self):
        sim = self.simulator("--delay-us-reply", "2000000")
        clients = [self.client(sim) for _ in range(400)]
        for i, client in enumerate(clients):
            client.sock.send(request(0x19, (i % 25,), ident=i))
            if i % 100 == 99:       # a socket's buffer does not hold them all
                self.wait_for_requests(sim, i + 1)
        for i, client in enumerate(clients):
            self.assertEqual(Client.check(client.receive(), 0x19, i & 0xFF)[2], i % 25)
        self.assertEqual([client.stray(0) for client in clients], [b""] * len(clients))


class Stream(Base):
    def set_idle_limit(self, sim, tenths):
        payload = bytearray(20)
        struct.pack_into("<H", payload, 9, tenths)
        self.client(sim).ask(0xE0, (10,), bytes(payload))

    def test_frames_are_put_together_however_they_were_cut(self):
        sim = self.simulator()
        client = self.client(sim, socket.SOCK_STREAM)
        client.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        stream = b"".join((request(0x05, ident=1), fill(5, 3, 20), request(0x03, ident=3),
                           request(0xCF, ident=4)))
        at = 0
        for cut in (1, 6, 57, 3, 100, 400, 60, len(stream)):
            client.sock.send(stream[at:at + cut])
            at += cut
            time.sleep(0.005)
        for op, ident in ((0x05, 1), (0xB0, 27), (0x03, 3), (0xCF, 4)):
            Client.check(client.receive(), op, ident)

    def test_a_silent_connection_is_closed_and_an_active_one_is_not(self):
        sim = self.simulator()
        busy, idle = (self.client(sim, socket.SOCK_STREAM) for _ in range(2))
        self.set_idle_limit(sim, 30)
        idle.ask(0x05)
        until = time.monotonic() + PATIENCE
        while not select.select([idle.sock], [], [], 0.05)[0] and time.monotonic() < until:
            busy.ask(0x05)
        self.assertEqual(idle.sock.recv(64), b"")
        busy.ask(0x05)

    def test_a_reboot_drops_connections(self):
        sim = self.simulator()
        client = self.client(sim, socket.SOCK_STREAM)
        client.ask(0x05)
        sim.must("reboot")
        self.assertEqual(client.sock.recv(64), b"")
        self.client(sim, socket.SOCK_STREAM).ask(0x05)

    def test_nothing_is_lost_however_much_is_sent_at_once(self):
        for service in ("0", "100"):
            sim = self.simulator("--service-us", service)
            client = self.client(sim, socket.SOCK_STREAM)
            asked = b"".join(request(0x05, ident=i & 0xFF) for i in range(3000))
            sender = threading.Thread(target=client.sock.sendall, args=(asked,))
            sender.start()
            for i in range(3000):
                Client.check(client.receive(), 0x05, i & 0xFF)
            sender.join()
            self.assertEqual(client.stray(), b"")

    def test_what_was_asked_is_answered_though_the_client_has_ended_its_sending(self):
        sim = self.simulator("--service-us", "2000")
        client = self.client(sim, socket.SOCK_STREAM)
        client.sock.sendall(b"".join(request(0x05, ident=i) for i in range(20)))
        client.sock.shutdown(socket.SHUT_WR)
        for i in range(20):
            Client.check(client.receive(), 0x05, i)
        self.assertEqual(client.sock.recv(64), b"")

    def test_who_has_ended_is_let_go_while_others_wait_for_their_replies(self):
        sim = self.simulator("--service-us", "100000")
        self.set_idle_limit(sim, 0)     # it is not that which lets him go
        busy, done = (self.client(sim, socket.SOCK_STREAM) for _ in range(2))
        done.sock.sendall(request(0x05, ident=1))
        busy.sock.sendall(request(0x05) * 1000)     # for longer than our patience
        done.sock.shutdown(socket.SHUT_WR)
        Client.check(done.receive(), 0x05, 1)
        self.assertEqual(done.sock.recv(64), b"")

    def test_who_waits_for_replies_is_not_silent(self):
        sim = self.simulator("--service-us", "1200000")
        self.set_idle_limit(sim, 10)
        clients = [self.client(sim, socket.SOCK_STREAM) for _ in range(2)]
        for client in clients:
            client.sock.sendall(request(0x05, ident=1) + request(0x05, ident=2))
        clients[0].sock.shutdown(socket.SHUT_WR)
        for client in clients:
            for i in (1, 2):
                Client.check(client.receive(), 0x05, i)
            self.assertEqual(client.sock.recv(64), b"")

    def test_who_has_waited_for_as_long_as_one_may_be_silent_is_not(self):
        sim = self.simulator("--service-us", "100000")
        self.set_idle_limit(sim, 1)
        for patience in reversed(range(20)):
            try:
                client = self.client(sim, socket.SOCK_STREAM)
                client.ask(0x05)
                client.ask(0x05)
                break
            except ConnectionError:     # on a busy machine it is we who are silent
                self.assertTrue(patience)

    def test_who_asks_little_is_heard_beside_one_who_asks_much(self):
        sim = self.simulator("--service-us", "200000")
        self.set_idle_limit(sim, 10)
        busy = self.client(sim, socket.SOCK_STREAM)
        busy.sock.sendall(request(0x05) * 1000)     # for longer than our patience
        self.wait_for_requests(sim, 3)
        other = self.client(sim, socket.SOCK_STREAM)
        other.sock.sendall(request(0x05, ident=7))
        Client.check(other.receive(), 0x05, 7)

    def test_all_that_a_client_asked_is_done_though_it_is_gone(self):
        sim = self.simulator("--service-us", "20000")
        client = Client(sim.address, sim.port, socket.SOCK_STREAM)
        client.sock.send(request(0x05))
        select.select([client.sock], [], [], PATIENCE)
        client.sock.sendall(request(0x05) * 100)
        client.close()      # with a reply unread: a reset
        self.wait_for_requests(sim, 101)

    def test_who_is_gone_costs_no_processor_while_its_requests_wait(self):
        sim = self.simulator("--service-us", "100000")
        self.set_idle_limit(sim, 20)
        client = Client(sim.address, sim.port, socket.SOCK_STREAM)
        client.sock.send(request(0x05))
        select.select([client.sock], [], [], PATIENCE)
        client.sock.sendall(request(0x05) * 100)    # more than it has places for
        client.close()      # with a reply unread: a reset
        self.wait_for_requests(sim, 25)     # for longer than the limit
        began, spent = time.monotonic(), sim.cpu_seconds()
        self.wait_for_requests(sim, 30)
        self.assertLess(sim.cpu_seconds() - spent, (time.monotonic() - began) / 2)

    def test_what_a_client_asked_is_done_though_it_reads_no_reply(self):
        sim = self.simulator("--preset", "loopback")
        for value in (1, 0) * 10:
            client = Client(sim.address, sim.port, socket.SOCK_STREAM)
            client.sock.send(request(0x05))
            select.select([client.sock], [], [], PATIENCE)
            client.sock.send(request(0x40, (31, value)))
            client.close()      # with a reply unread: a reset on the heels of the request
            until = time.monotonic() + PATIENCE
            while sim.must("pin", "32")["latch"] != str(value) and time.monotonic() < until:
                time.sleep(0.01)
            self.assertEqual(sim.must("pin", "32")["latch"], str(value))

    def test_a_client_which_reads_nothing_is_held_up_and_harms_nobody(self):
        sim = self.simulator()
        deaf = self.client(sim, socket.SOCK_STREAM)
        deaf.sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        deaf.sock.settimeout(0.2)
        with self.assertRaises(TimeoutError):
            for i in range(200000):
                deaf.sock.sendall(request(0x05, ident=i & 0xFF))
        self.client(sim, socket.SOCK_STREAM).ask(0x05)
        self.client(sim).ask(0x05)
        deaf.sock.settimeout(PATIENCE)
        for i in range(100):
            Client.check(deaf.receive(), 0x05, i)

    def test_many_connections_come_and_go(self):
        sim = self.simulator()
        for _ in range(60):
            client = Client(sim.address, sim.port, socket.SOCK_STREAM)
            client.ask(0x05)
            client.close()


class Search(Base):
    def search(self, address, port, expected=0, content=b""):
        """Replies by the address they came from: of so many, or of none in a while."""
        found = {}
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            sock.sendto(content, (address, port))
            # when all are in, or where none is to come: whoever answers twice does it soon
            while select.select([sock], [], [], 0.4 if len(found) >= expected else PATIENCE)[0]:
                reply, sender = sock.recvfrom(100)
                self.assertNotIn(sender[0], found, "answered twice")
                found[sender[0]] = reply
        return found

    def pair(self, **first):
        one = self.simulator("--serial", "1001", **first)
        two = self.simulator("--serial", "1002", "--model", "57E", port=one.port)
        return one, two

    def check(self, found, *sims):
        self.assertEqual(set(found), {sim.address for sim in sims})
        for sim, serial in zip(sims, (1001, 1002)):
            reply = found[sim.address]
            self.assertEqual(len(reply), 19)
            self.assertEqual(struct.unpack_from("<I", reply, 14)[0], serial)
            self.assertEqual(socket.inet_ntoa(reply[5:9]), sim.address)

    def test_a_broadcast_finds_all(self):
        one, two = self.pair()
        self.check(self.search("127.255.255.255", one.port, 2), one, two)

    def test_a_broadcast_of_some_words_finds_all(self):
        one, two = self.pair()
        self.check(self.search("127.255.255.255", one.port, 2, b"Who is there?"), one, two)

    def test_words_sent_to_one_and_a_frame_sent_to_all_are_no_search(self):
        one, _ = self.pair()
        self.assertEqual(self.search(one.address, one.port, 0, b"Who is there?"), {})
        self.assertEqual(self.search("127.255.255.255", one.port, 0, request(0x00)), {})

    def test_the_vendors_search_on_loopback_finds_all(self):
        one, two = self.pair()
        self.check(self.search("127.0.0.1", one.port, 2), one, two)

    def test_the_vendors_search_finds_all_when_one_is_at_127_0_0_1(self):
        one, two = self.pair(address="127.0.0.1")
        self.check(self.search("127.0.0.1", one.port, 2), one, two)

    def test_a_search_sent_to_one_finds_that_one(self):
        one, _ = self.pair()
        self.check(self.search(one.address, one.port, 1), one)

    def test_nobody_answers_for_another_address(self):
        one, _ = self.pair()
        self.assertEqual(self.search(loopback_address(), one.port), {})

    def test_searching_can_be_switched_off(self):
        sim = self.simulator("--no-discovery")
        self.assertEqual(self.search("127.255.255.255", sim.port), {})
        self.assertEqual(self.search(sim.address, sim.port), {})

    def test_a_silent_device_is_not_found(self):
        sim = self.simulator()
        sim.must("silence", "60000")
        self.assertEqual(self.search(sim.address, sim.port), {})


class Bench(Base):
    def test_inputs_are_driven_and_outputs_read(self):
        sim = self.simulator("--preset", "loopback")
        client = self.client(sim)
        sim.must("unwire", "9")
        sim.must("pin", "9", "0")
        self.assertEqual(client.ask(0x30, (8,))[3], 0)
        sim.must("pin", "9", "1")
        self.assertEqual(client.ask(0x30, (8,))[3], 1)
        client.ask(0x40, (31, 1))
        self.assertEqual(sim.must("pin", "32")["latch"], "1")
        self.assertEqual(client.ask(0x30, (9,))[3], 0)

    def test_a_refusal_says_why_and_ends_with_1(self):
        sim = self.simulator()
        done = sim.ctl("pin", "56", "1")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(done.stderr, "pokeys-sim: pin: '56' is not 1..55; "
                                      "usage: pin N [0|1]\n")

    def test_nobody_there_ends_with_2(self):
        done = subprocess.run([SIM, "--ctl", str(self.folder / "nobody"), "stat"],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertEqual(len(done.stderr.splitlines()), 1)
        self.assertIn("nobody: No such file or directory; give the socket", done.stderr)

    def test_nonsense_on_the_control_socket_is_survived(self):
        sim = self.simulator()
        for junk in (b"\0" * 100 + b"\n", b"x" * 5000, os.urandom(300) + b"\n", b"pin 1 0"):
            with socket.socket(socket.AF_UNIX) as sock:
                sock.connect(sim.control)
                try:
                    sock.sendall(junk)
                except OSError:
                    pass
        sim.must("stat")

    def test_only_the_owner_may_command(self):
        sim = self.simulator()
        self.assertEqual(os.stat(sim.control).st_mode & 0o777, 0o600)

    def test_faults_come_and_go_while_running(self):
        sim = self.simulator()
        client = self.client(sim)
        sim.must("fault", "request", "loss", "1")
        client.sock.send(request(0x05))
        until = time.monotonic() + PATIENCE
        while sim.must("stat")["link.request.lost"] != "1" and time.monotonic() < until:
            time.sleep(0.01)
        self.assertEqual(client.stray(0.1), b"")
        sim.must("fault", "off")
        client.ask(0x05)
        self.assertEqual(sim.must("stat")["link.request.lost"], "1")
        sim.must("stray", "200")
        self.assertEqual([len(client.stray(PATIENCE)) for _ in range(200)], [64] * 200)
        self.assertEqual(client.stray(), b"")

    def test_an_axis_moves_in_real_time(self):
        sim = self.simulator("--preset", "demo")
        client = self.client(sim)
        client.ask(0x85, (0x02, 3, 0, 0xFF))
        client.ask(0x85, (0x20,), struct.pack("<8i", 2000, -1000, 0, 0, 0, 0, 0, 0))
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            status = client.ask(0x85, (0x00,))
            if struct.unpack_from("<2i", status, 24) == (2000, -1000):
                break
            time.sleep(0.01)
        self.assertEqual(struct.unpack_from("<2i", status, 24), (2000, -1000))
        self.assertEqual(struct.unpack_from("<2i", client.ask(0xCD, (0,)), 8), (2000, -1000))


class Process(Base):
    def test_it_ends_well_on_either_signal(self):
        for how in (signal.SIGTERM, signal.SIGINT):
            sim = self.simulator()
            status, out, err = sim.stop(how)
            self.assertEqual((status, err), (0, ""))
            self.assertIn("seed 1", out)
            self.assertFalse(os.path.exists(sim.control))

    def test_a_taken_address_is_one_line_and_status_1(self):
        sim = self.simulator()
        for more in ((), ("--no-tcp",)):
            with self.assertRaises(RuntimeError) as raised:
                self.simulator(*more, address=sim.address, port=sim.port)
            self.assertRegex(str(raised.exception),
                             rf"^pokeys-sim: TCP {sim.address}:{sim.port}: Address already in "
                             r"use; give another --address or --port\n$")
        self.client(sim).ask(0x05)

    def test_a_taken_udp_port_is_one_line_and_status_1(self):
        address = loopback_address()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
            sock.bind((address, 0))
            port = sock.getsockname()[1]
            with self.assertRaises(RuntimeError) as raised:
                self.simulator(address=address, port=port)
        self.assertIn(f"pokeys-sim: UDP {address}:{port}: Address already in use",
                      str(raised.exception))

    def test_bad_options_are_one_line_and_status_64(self):
        self.refused(64, ["--serial", "x"], ["--nonsense"], ["--loss"], ["word"],
                     ["--model", "56E", "--serial", "19999"],
                     ["--serial", "65535", "--model", "56E"])

    def test_what_is_not_there_is_one_line_and_status_1(self):
        # who waits for the line of --ready-fd would wait for ever
        self.refused(1, ["--script", str(self.folder / "none")], ["--cpu", "1000"],
                     ["--ready-fd", "99"])

    def test_a_script_that_is_none_is_told(self):
        script = self.folder / "script"
        for text, told in (b"pin 9 0\n\0\nnothing\n", "it is no text"), (b"#" * 1048577, "File too large"):
            script.write_bytes(text)
            self.assertIn(f"--script {script}: {told}", self.told("--script", str(script)))
        self.assertIn("Is a directory", self.told("--script", str(self.folder)))

    def test_a_control_path_that_is_taken_is_told(self):
        taken = self.folder / "taken"
        taken.write_text("kept")
        self.assertIn(f"--control {taken}: Address already in use: it is no socket",
                      self.told("--control", str(taken)))
        self.assertEqual(taken.read_text(), "kept")

    def told(self, *options):
        done = subprocess.run([SIM, "--address", loopback_address(), *options],
                              capture_output=True, text=True, check=False, timeout=PATIENCE)
        self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (1, "", 1), done)
        return done.stderr

    def test_an_answer_that_cannot_be_written_is_no_success(self):
        sim = self.simulator()
        for words in ["stat"], ["pin", "9"]:
            with open("/dev/full", "w", encoding="ascii") as full:
                done = subprocess.run([SIM, "--ctl", sim.control, *words], stdout=full, text=True,
                                      stderr=subprocess.PIPE, check=False, timeout=PATIENCE)
            self.assertEqual((done.returncode, done.stderr),
                             (1, "pokeys-sim: standard output: No space left on device\n"))

    def refused(self, status, *cases):
        for options in cases:
            done = subprocess.run([SIM, "--address", loopback_address(), *options],
                                  capture_output=True, text=True, check=False, timeout=PATIENCE)
            self.assertEqual(done.returncode, status, options)
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
            self.assertEqual(done.stdout, "")

    def test_a_left_over_control_socket_is_replaced_and_a_live_one_is_not(self):
        sim = self.simulator()
        with self.assertRaises(RuntimeError):
            self.take_control(sim.control)
        sim.child.kill()
        sim.child.wait()
        self.assertTrue(os.path.exists(sim.control))
        self.take_control(sim.control)

    def test_a_control_socket_that_is_there_is_listened_at(self):
        for number in range(40):
            path = str(self.folder / f"at{number}")
            with subprocess.Popen([SIM, "--address", loopback_address(), "--port", "0",
                                   "--no-discovery", "--control", path, "--quiet"]) as child:
                try:
                    self.connect_as_soon_as_it_is_there(path, child)
                finally:
                    child.terminate()
            self.assertFalse(os.path.exists(path + ".new"))

    def connect_as_soon_as_it_is_there(self, path, child):
        while True:     # without a pause: it is about microseconds
            with socket.socket(socket.AF_UNIX) as control:
                try:
                    control.connect(path)
                    return
                except FileNotFoundError:
                    self.assertIsNone(child.poll())

    def take_control(self, path):
        other = self.simulator("--control", path)
        other.control = path
        other.must("stat")

    def test_a_script_runs_and_may_end_the_simulator(self):
        script = self.folder / "script"
        script.write_text("# as an operator would\npin 9 0\nwait 200 pin 9 1\nat 400 exit\n")
        sim = self.simulator("--script", str(script), "--preset", "loopback")
        self.assertEqual(sim.child.wait(PATIENCE), 0)

    def test_a_bad_script_names_file_and_line(self):
        script = self.folder / "script"
        script.write_text("pin 9 0\nwait 100\npin 99 0\n")
        sim = self.simulator("--script", str(script))
        _, err = sim.child.communicate(timeout=PATIENCE)
        self.assertEqual(sim.child.returncode, 1)
        self.assertTrue(err.startswith(f"pokeys-sim: {script}: line 3: error: pin: '99'"), err)

    def test_spinning_serves_as_well(self):
        sim = self.simulator("--spin")
        client = self.client(sim)
        for _ in range(200):
            client.ask(0xCC, (0,))
        self.client(sim, socket.SOCK_STREAM).ask(0x05)
        sim.must("stat")
        self.assertEqual(sim.stop()[0], 0)


if __name__ == "__main__":
    SIM = os.path.abspath(sys.argv.pop(1))
    unittest.main(verbosity=2)
