#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The guard between a daemon and a network, in namespaces of our own: here the
machine with interface pk0, over there (name space "far") a simulated device and
whoever else sends. Every load is a number of packets, none a length of time.

What passes is what arrives in a socket here, what was dropped is what the
guard's counter says; both are looked at.
Arguments: pokeys-guard, pokeysd, pokeysctl, pokeys-sim, guard.bpf.o.
"""
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import time

FOLDER = str(pathlib.Path(__file__).resolve().parent)
HERE, DEVICE, STRANGER, MOVED = "10.77.0.1", "10.77.0.2", "10.77.0.66", "10.77.0.3"
SERIAL, PORT, OUR_PORT = 54321, 20055, 40000
PINS, STATUS = pathlib.Path("/sys/fs/bpf/pokeysd"), pathlib.Path("/run/pokeys-guard/status")
RUN = pathlib.Path("/run/test")
# a device cut off for good is lost all the same; one that a busy machine keeps waiting is not
PATIENT = "lost-after-ms = 3000\n"


def sh(*words, check=True):
    out = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=600, check=False)
    assert not check or out.returncode == 0, f"{words}: {out.returncode}: {out.stdout}{out.stderr}"
    return out


def far(*words, **options):
    return sh("ip", "netns", "exec", "far", *words, **options)


def wait_for(what, test, limit=60):
    end = time.monotonic() + limit
    while not test():
        assert time.monotonic() < end, f"{what}: not within {limit} s"
        time.sleep(0.02)


def ping(address):
    """One echo request; whether it, and no other, was answered within a second."""
    mark = os.urandom(8)
    with socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_ICMP) as s:
        s.settimeout(1)
        request = struct.pack("!BBHHH", 8, 0, 0, os.getpid() & 0xffff, 1) + mark
        total = sum(struct.unpack("!8H", request))
        total = (total >> 16) + (total & 0xffff)
        total = (total >> 16) + (total & 0xffff)
        end = time.monotonic() + 1
        try:
            s.sendto(request[:2] + struct.pack("!H", ~total & 0xffff) + request[4:], (address, 0))
            while time.monotonic() < end:
                packet, source = s.recvfrom(200)
                if source[0] == address and packet[(packet[0] & 15) * 4] == 0 and packet.endswith(mark):
                    return True
        except OSError:
            pass
        return False


def all_is_through():
    """Over there: what was sent before is no longer in any queue, for an echo sent behind it came back."""
    wait_for("an echo", lambda: ping(HERE))


def run_far(code):
    """Python over there, which has all_is_through()."""
    far("/usr/bin/python3", "-B", "-c", f"import sys\nsys.path.insert(0, {FOLDER!r})\n"
        "from guard import all_is_through\n" + code)


def send_far(source, port, count, payload, to_port=OUR_PORT):
    """Runs over there: so many datagrams, a few at a time so that no queue is full."""
    run_far(f"""
import socket
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
s.bind(({source!r}, {port}))
for i in range({count}):
    s.sendto({payload!r}, ({HERE!r}, {to_port}))
    if i % 64 == 63:
        all_is_through()
all_is_through()
""")


def program_on(interface):
    """The number of the XDP program that is on it."""
    return json.loads(sh("ip", "-json", "link", "show", interface).stdout)[0].get("xdp", {}).get("prog", {}).get("id")


def answer(serial):
    return bytes(5) + socket.inet_aton(DEVICE) + bytes(1) + socket.inet_aton(HERE) + struct.pack("<IB", serial, 10)


def whole_checksums():
    """Over there the kernel leaves checksums to a card that is not there; AF_XDP looks at them."""
    far("/usr/bin/python3", "-c", """
import array, fcntl, socket, struct
value = array.array("B", struct.pack("II", 0x17, 0))  # ETHTOOL_STXCSUM off
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
    fcntl.ioctl(s, 0x8946, struct.pack("16sP", b"pk1", value.buffer_info()[0]))
""")


class World:
    def __init__(self, guard, pokeysd, pokeysctl, sim, program):
        self.guard_exe, self.pokeysd, self.pokeysctl, self.sim_exe, self.program = \
            guard, pokeysd, pokeysctl, sim, program
        self.children, self.guard, self.logs = [], None, 0
        RUN.mkdir(exist_ok=True)
        self.conf = RUN / "pokeysd.conf"
        sh("ip", "link", "set", "lo", "up")
        sh("ip", "netns", "add", "far")
        far("ip", "link", "set", "lo", "up")
        self.connect()
        self.ear = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        # SO_RCVBUFFORCE; some kernels count a page and more for each datagram
        self.ear.setsockopt(socket.SOL_SOCKET, 33, 32 << 20)
        self.ear.bind((HERE, OUR_PORT))
        self.ear.setblocking(False)

    def connect(self):
        sh("ip", "link", "add", "pk0", "type", "veth", "peer", "name", "pk1", "netns", "far")
        sh("ip", "addr", "add", f"{HERE}/24", "broadcast", "+", "dev", "pk0")
        sh("ip", "link", "set", "pk0", "up")
        for address in (DEVICE, STRANGER, MOVED):
            far("ip", "addr", "add", f"{address}/24", "broadcast", "+", "dev", "pk1")
        far("ip", "link", "set", "pk1", "up")
        wait_for("the far end", lambda: ping(DEVICE))

    def write_conf(self, device, **daemon):
        keys = {"interface": "pk0", "runtime-directory": RUN / "shm", "realtime": "optional",
                "discovery-interval-ms": 200, **daemon}
        self.conf.write_text("[daemon]\n" + "".join(f"{k} = {v}\n" for k, v in keys.items()) +
                             "[device mill]\n" + device)

    def spawn(self, *words):
        self.logs += 1
        log = RUN / f"log{self.logs}"
        with open(log, "wb") as to:
            child = subprocess.Popen([str(w) for w in words], stdout=to, stderr=subprocess.STDOUT,
                                     stdin=subprocess.DEVNULL)
        child.log = log
        self.children.append(child)
        return child

    def start_guard(self, on=True):
        STATUS.unlink(missing_ok=True)
        self.guard = self.spawn(self.guard_exe, "-c", self.conf, "run")
        if on:
            def there():
                assert self.guard.poll() is None, self.guard.log.read_text()
                return STATUS.exists()
            wait_for("the guard", there)

    def end(self, child, number=signal.SIGTERM):
        child.send_signal(number)
        child.wait(60)
        return child.returncode

    def end_guard(self, number=signal.SIGTERM):
        status = self.end(self.guard, number)
        assert status == (0 if number == signal.SIGTERM else -number), self.guard.log.read_text()

    def guarded_in_mode(self, mode):
        assert f"mode {mode}" in STATUS.read_text(), STATUS.read_text() + self.guard.log.read_text()

    def start_sim(self, address=DEVICE, serial=SERIAL):
        return self.spawn("ip", "netns", "exec", "far", self.sim_exe, "--address", address, "--serial", serial,
                          "--quiet")

    def start_daemon(self):
        return self.spawn(self.pokeysd, "--config", self.conf)

    def counters(self):
        out = sh(self.guard_exe, "status").stdout
        return {k: int(v) for k, v in (line.split() for line in out.splitlines()) if v.isdigit()}

    def counted(self, work, together=0, **expected):
        """What the guard counted during `work`. Waits for the expected counts, and for their sum if `together`
        is given: a busy kernel may be late."""
        before, after = self.counters(), {}
        work()
        end = time.monotonic() + 60
        while time.monotonic() < end:
            after = self.counters()
            grown = {name: after[name] - before[name] for name in expected}
            if all(grown[name] >= times for name, times in expected.items()) and sum(grown.values()) >= together:
                break
            time.sleep(0.01)
        # and to notice any excess: wait until nothing is dropped any more
        drops = None
        while drops != (drops := [v for k, v in after.items() if k.startswith("drop")]):
            time.sleep(0.1)
            after = self.counters()
        return {k: after[k] - before[k] for k in after if k != "time_ns" and after[k] != before[k]}

    def arrived(self, expected=0):
        """How many datagrams came: as soon as there are so many, which a busy kernel delivers late."""
        count, end = 0, time.monotonic() + 60
        while True:
            try:
                self.ear.recv(4096)
                count += 1
            except BlockingIOError:
                if count >= expected or time.monotonic() > end:
                    return count
                time.sleep(0.01)

    def device(self, name):
        out = sh(self.pokeysctl, "-r", RUN / "shm", "status", name, "--json", check=False).stdout
        return json.loads(out)["devices"][0] if out else {}

    def mill(self):
        return self.device("mill")

    def state(self):
        return self.mill()["state"]

    def fresh(self):
        return bool(self.mill().get("fresh"))

    def lost(self, name="mill"):
        """Given up by the daemon; stale data alone may be no more than a busy machine."""
        return self.device(name)["state"]["link"] != "running"

    def close(self):
        for child in reversed(self.children):
            if child.poll() is None:
                child.kill()
                child.wait()


def foreign_packets_are_dropped_and_counted_and_all_else_passes(w):
    w.write_conf(f"address = {DEVICE}\n")
    w.start_guard()
    w.guarded_in_mode("native")
    w.arrived()
    got = w.counted(lambda: send_far(STRANGER, PORT, 5000, bytes(64)), drop_foreign=5000)
    assert got.get("drop_foreign") == 5000 and w.arrived() == 0, got
    got = w.counted(lambda: send_far(STRANGER, 5000, 300, bytes(64)), pass_else=300)
    assert got.get("pass_else", 0) >= 300 and w.arrived(300) == 300, got
    got = w.counted(lambda: send_far(DEVICE, PORT, 300, bytes(64)), pass_device=300)
    assert got.get("pass_device") == 300 and w.arrived(300) == 300, got
    got = w.counted(lambda: send_far(DEVICE, 80, 20, bytes(10)), pass_device_else=20)
    assert got.get("pass_device_else") == 20 and w.arrived(20) == 20, got


def what_no_device_sends_is_dropped_each_for_its_own_reason(w):
    got = w.counted(lambda: [send_far(DEVICE, PORT, 20, bytes(size)) for size in (0, 63, 65, 1400)], drop_length=80)
    assert got.get("drop_length") == 80 and w.arrived() == 0, got
    got = w.counted(lambda: send_far(DEVICE, PORT, 20, bytes(4000)), drop_fragment=40)
    assert got.get("drop_fragment", 0) >= 40 and w.arrived() == 0, got
    # a stranger's are his own business, unless they begin as a device's would
    send_far(STRANGER, 5000, 20, bytes(4000))
    assert w.arrived(20) == 20
    got = w.counted(lambda: send_far(STRANGER, PORT, 20, bytes(4000)), drop_foreign=20)
    assert got.get("drop_foreign") == 20 and w.arrived() == 0, got


def arp_and_icmp_pass(w):
    sh("ip", "neigh", "flush", "dev", "pk0")
    far("ip", "neigh", "flush", "dev", "pk1")
    got = w.counted(lambda: wait_for("echo", lambda: ping(DEVICE)), pass_arp=1)
    assert got.get("pass_arp", 0) >= 1 and got.get("pass_icmp", 0) >= 1, got


def answers_to_a_search_pass_but_no_flood_of_them(w):
    got = w.counted(lambda: send_far(STRANGER, PORT, 20, answer(99)), pass_discovery=20)
    assert got.get("pass_discovery") == 20 and w.arrived(20) == 20, got
    got = w.counted(lambda: send_far(STRANGER, PORT, 5000, answer(99)), 5000, pass_discovery=0, drop_discovery=0)
    assert got.get("pass_discovery", 0) + got.get("drop_discovery", 0) == 5000, got
    assert got.get("drop_discovery", 0) > 0 and w.arrived(got["pass_discovery"]) == got["pass_discovery"], got


def counters_and_filter_outlive_a_killed_guard(w):
    before = w.counters()
    w.end_guard(signal.SIGKILL)
    got = w.counted(lambda: send_far(STRANGER, PORT, 100, bytes(64)), drop_foreign=100)
    assert got.get("drop_foreign") == 100 and w.arrived() == 0, got
    w.start_guard()
    assert w.counters()["drop_foreign"] == before["drop_foreign"] + 100
    got = w.counted(lambda: send_far(STRANGER, PORT, 100, bytes(64)), drop_foreign=100)
    assert got.get("drop_foreign") == 100, got
    second = sh(w.guard_exe, "-c", w.conf, "run", check=False)
    assert second.returncode == 75 and second.stderr.startswith(
        "pokeys-guard: another pokeys-guard"), second
    # what is at work is not taken off from behind
    second = sh(w.guard_exe, "remove", check=False)
    assert second.returncode == 75 and "another pokeys-guard is at work" in second.stderr, second
    got = w.counted(lambda: send_far(STRANGER, PORT, 100, bytes(64)), drop_foreign=100)
    assert got.get("drop_foreign") == 100, got
    for words in ("status",), ("--help",):
        with open("/dev/full", "wb") as full:
            out = subprocess.run([w.guard_exe, *words], stdout=full, stderr=subprocess.PIPE, text=True,
                                 timeout=60, check=False)
        assert out.returncode == 1 and "standard output" in out.stderr, (words, out)
    w.end_guard()
    assert not PINS.exists() and not STATUS.exists()
    send_far(STRANGER, PORT, 10, bytes(64))
    assert w.arrived(10) == 10
    w.start_guard()
    w.end_guard(signal.SIGKILL)
    assert sh(w.guard_exe, "remove").returncode == 0 and not PINS.exists()
    assert sh(w.guard_exe, "status", check=False).returncode == 1


def a_dedicated_interface_lets_nobody_else_in(w):
    w.write_conf(f"address = {DEVICE}\n", guard="dedicated")
    w.start_guard()
    w.arrived()
    got = w.counted(lambda: send_far(STRANGER, 5000, 500, bytes(64)), drop_else=500)
    assert got.get("drop_else", 0) >= 500 and w.arrived() == 0, got
    send_far(DEVICE, PORT, 50, bytes(64))
    send_far(DEVICE, 80, 50, bytes(64))
    assert w.arrived(100) == 100
    arp_and_icmp_pass(w)
    w.end_guard()


def nobody_passes_for_a_device_that_was_not_found_yet(w):
    """Its address is 0.0.0.0 in the guard's table, and that of machines that ask for theirs."""
    w.write_conf(f"serial = {SERIAL}\n", guard="dedicated")
    w.start_guard()

    def send():
        run_far("""
import socket, struct
def frame(port):
    ip = struct.pack("!BBHHHBBH4s4s", 0x45, 0, 92, 0, 0, 64, 17, 0, bytes(4), b"\\xff" * 4)
    total = sum(struct.unpack("!10H", ip))
    total = ~((total >> 16) + (total & 0xffff)) & 0xffff
    udp = struct.pack("!HHHH", port, 40000, 72, 0)
    return b"\\xff" * 6 + bytes(6) + b"\\x08\\x00" + ip[:10] + struct.pack("!H", total) + ip[12:] + udp + bytes(64)
with socket.socket(socket.AF_PACKET, socket.SOCK_RAW) as s:
    s.bind(("pk1", 0))
    for _ in range(50):
        s.send(frame(68))
        s.send(frame(20055))
all_is_through()
""")
    got = w.counted(send, drop_foreign=50)
    assert got.get("drop_foreign") == 50 and got.get("drop_else", 0) >= 50, got
    assert not got.get("pass_device") and not got.get("pass_device_else"), got
    w.end_guard()


def a_running_daemon_does_not_notice_the_guard_come_and_go(w):
    for device in (f"address = {DEVICE}\n", f"serial = {SERIAL}\n"):
        w.write_conf(device + PATIENT)
        sim, daemon = w.start_sim(), w.start_daemon()
        wait_for("the device", w.fresh)
        for round_ in range(3):
            w.start_guard()
            wait_for("the flag", lambda: w.state()["flags"]["guard"])
            before = w.state()["statistics"]["accepted"]
            w.counted(lambda: send_far(STRANGER, PORT, 2000, bytes(64)))
            wait_for("the counters", lambda: (diag := w.mill()["diag"]) and
                     diag["counters"]["guard_dropped"] >= 2000)
            wait_for("packets", lambda: w.state()["statistics"]["accepted"] > before + 100)
            w.end_guard(signal.SIGKILL if round_ == 1 else signal.SIGTERM)
            wait_for("the flag gone", lambda: not w.state()["flags"]["guard"])
        wait_for("fresh data", w.fresh)
        assert not w.state()["statistics"]["reconnects"], daemon.log.read_text()
        assert "guarded (native XDP)" in daemon.log.read_text(), daemon.log.read_text()
        assert w.end(daemon) == 0
        w.end(sim)


def a_device_is_learnt_from_its_answer_and_a_liar_moves_none_that_works(w):
    w.write_conf(f"serial = {SERIAL}\n" + PATIENT)
    w.start_guard()
    daemon = w.start_daemon()
    sim = w.start_sim()
    wait_for("the device, switched on after the guard", w.fresh)
    send_far(STRANGER, PORT, 20, answer(SERIAL))
    got = w.counted(lambda: send_far(STRANGER, PORT, 50, bytes(64)), drop_foreign=50)
    assert got.get("drop_foreign") == 50 and not w.lost(), got
    assert not w.state()["statistics"]["reconnects"], daemon.log.read_text()
    w.end(sim)
    wait_for("the device lost", w.lost)
    sim = w.start_sim(MOVED)
    wait_for("the device at its new address", w.fresh)
    w.end(daemon)
    w.end(sim)
    w.end_guard()


def replies_go_into_a_socket_of_a_daemon_without_rights(w):
    """transport = xdp, with guards that are stopped, killed and started meanwhile."""
    w.write_conf(f"address = {DEVICE}\n" + PATIENT, transport="xdp")
    without = "-net_raw,-bpf,-net_admin,-perfmon,-sys_admin"
    daemon_words = ("setpriv", "--bounding-set", without, "--inh-caps", without, w.pokeysd, "--config", w.conf)

    def growing(counter, least=200):
        before = w.counters()[counter]
        wait_for(f"{counter} to grow", lambda: w.counters()[counter] >= before + least)

    def told(text, times):
        wait_for(f'the daemon to say "{text}" again', lambda: daemon.log.read_text().count(text) == times)

    whole_checksums()
    sim = w.start_sim()
    daemon = w.spawn(*daemon_words)
    wait_for("the device, without a guard", w.fresh)
    text = daemon.log.read_text()
    assert re.search("transport is (io_uring|socket), for pokeys-guard.*does not run", text), text
    assert w.end(daemon) == 0
    w.start_guard()
    daemon = w.spawn(*daemon_words)
    wait_for("the device", w.fresh)
    assert " over xdp in " in daemon.log.read_text(), daemon.log.read_text()
    growing("pass_socket")
    told("pass the kernel's network stack by (AF_XDP, copied", 1)
    wait_for('"xdp copy" in the diagnostic image', lambda: (w.mill()["diag"] or {}).get("transport") == "xdp copy")
    kernel = w.counters()["pass_device"]
    got = w.counted(lambda: send_far(STRANGER, PORT, 500, bytes(64)), drop_foreign=500)
    assert got["drop_foreign"] == 500 and "pass_device" not in got, got
    growing("pass_socket")
    assert w.counters()["pass_device"] == kernel, "some of the daemon's replies went through the kernel"
    for times, number in enumerate((signal.SIGTERM, signal.SIGKILL, signal.SIGTERM), 1):
        w.end_guard(number)
        told("pokeys-guard has ended", times)
        if number == signal.SIGKILL:  # filter and socket are where they were
            growing("pass_socket")
        w.start_guard()
        told("pass the kernel's network stack by", 1 + times)
        growing("pass_socket")
    wait_for("fresh data", w.fresh)
    assert not w.state()["statistics"]["reconnects"], daemon.log.read_text()
    assert w.end(daemon) == 0, daemon.log.read_text()
    daemon = w.spawn(*daemon_words)
    wait_for("the next daemon's device", w.fresh)
    growing("pass_socket")
    w.end(daemon)
    w.end(sim)
    w.end_guard()
    w.write_conf(f"address = {DEVICE}\n", interface="lo", transport="xdp")
    w.start_guard()
    daemon = w.start_daemon()
    wait_for("the fallback", lambda: "ready:" in daemon.log.read_text())
    assert "Ethernet" in daemon.log.read_text(), daemon.log.read_text()
    w.end(daemon)
    w.end_guard()


def an_interface_that_goes_is_waited_for(w):
    w.write_conf(f"address = {DEVICE}\n")
    w.start_guard()
    sh("ip", "link", "del", "pk0")
    wait_for("the guard to see it", lambda: "waiting for interface pk0" in w.guard.log.read_text())
    wait_for("no word of it", lambda: not STATUS.exists())
    assert w.guard.poll() is None, w.guard.log.read_text()
    w.connect()
    wait_for("the guard back", STATUS.exists)
    got = w.counted(lambda: send_far(STRANGER, PORT, 50, bytes(64)), drop_foreign=50)
    assert got.get("drop_foreign") == 50, got
    w.end_guard()


def an_interface_without_driver_support_is_guarded_all_the_same(w):
    w.write_conf(f"address = {DEVICE}\n", interface="lo")
    w.start_guard()
    w.arrived()
    assert "mode generic" in STATUS.read_text() and "generic" in w.guard.log.read_text()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as liar:
        liar.bind(("127.0.0.9", PORT))
        got = w.counted(lambda: [liar.sendto(bytes(64), (HERE, OUR_PORT)) for _ in range(50)], drop_foreign=50)
    assert got.get("drop_foreign") == 50 and w.arrived() == 0, got
    w.end_guard()


CHECKS = [
    foreign_packets_are_dropped_and_counted_and_all_else_passes,
    what_no_device_sends_is_dropped_each_for_its_own_reason,
    arp_and_icmp_pass,
    answers_to_a_search_pass_but_no_flood_of_them,
    counters_and_filter_outlive_a_killed_guard,
    a_dedicated_interface_lets_nobody_else_in,
    nobody_passes_for_a_device_that_was_not_found_yet,
    a_running_daemon_does_not_notice_the_guard_come_and_go,
    a_device_is_learnt_from_its_answer_and_a_liar_moves_none_that_works,
    replies_go_into_a_socket_of_a_daemon_without_rights,
    an_interface_that_goes_is_waited_for,
    an_interface_without_driver_support_is_guarded_all_the_same,
]


def why_not():
    """What is missing to run this, or None. Makes the mounts."""
    if os.geteuid() != 0:
        return "needs root, for name spaces and BPF"
    for command in (("mount", "-t", "tmpfs", "run", "/run"), ("mount", "-t", "sysfs", "sys", "/sys"),
                    ("mount", "-t", "bpf", "bpf", "/sys/fs/bpf"),
                    ("ip", "link", "add", "pkx", "type", "veth", "peer", "name", "pky"),
                    ("ip", "link", "del", "pkx"),
                    ("bpftool", "map", "create", "/sys/fs/bpf/try", "type", "array", "key", "4", "value", "8",
                     "entries", "1", "name", "try"), ("rm", "/sys/fs/bpf/try")):
        try:
            out = sh(*command, check=False)
        except FileNotFoundError as missing:
            return str(missing)
        if out.returncode:
            return f"{' '.join(command)}: {out.stderr.strip()}"
    return None


def main(checks):
    if sys.argv[1] != "--inside":
        os.environ["PATH"] += ":/usr/sbin:/sbin"
        out = sh("unshare", "--mount", "--net", "true", check=False)
        if out.returncode:
            print(f"skipped: no name spaces here: {out.stderr.strip()}", file=sys.stderr)
            return 77
        os.execvp("unshare", ["unshare", "--mount", "--net", sys.executable, "-B", sys.argv[0], "--inside", *sys.argv[1:]])
    reason = why_not()
    if reason:
        print(f"skipped: {reason}", file=sys.stderr)
        return 77
    world = World(*(pathlib.Path(a).resolve() for a in sys.argv[2:7]))
    try:
        for check in checks:
            check(world)
            print(f"ok: {check.__name__}", flush=True)
    finally:
        world.close()
        subprocess.run(["ip", "netns", "del", "far"], check=False)
    return 0


if __name__ == "__main__":
    sys.exit(main(CHECKS))
