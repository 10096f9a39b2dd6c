#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Frames that no socket sends, put on the wire as they are, and how the guard judges
them: tags of VLANs, headers that do not fit the frame, IP's oddities. Each counter is
looked at, and in a socket what has arrived.
Arguments: as guard.py.
"""
import dataclasses
import json
import socket
import struct
import sys

from guard import DEVICE, HERE, OUR_PORT, PORT, STRANGER, far, main, run_far, sh

LACP = bytes.fromhex("0180c2000002") + bytes(6) + b"\x88\x09" + bytes(110)
VLAN, PROVIDER, PRIORITY = 0x8100, 0x88a8, 0xe000
ROUNDS = 40


@dataclasses.dataclass
class Frame:
    """A datagram of 64 bytes of the device's, but for what is said otherwise."""
    source: str = DEVICE
    port: int = PORT
    payload: bytes = dataclasses.field(default=bytes(64), repr=False)
    tags: tuple = ()             # (type, control) from the outside
    options: bytes = b""         # IP's
    version: int = 4
    words: int = 0               # of IP's header; 0 = as many as there are
    fragment: int = 0
    protocol: int = 17
    total: int = -1              # what IP says; -1 = what is true
    length: int = -1             # what UDP says
    cut: int = 0                 # bytes that are missing at the end
    padding: int = 0

    def bytes(self):
        length = 8 + len(self.payload)
        header = 20 + len(self.options)
        first = self.version << 4 | (self.words or header // 4)
        ip = struct.pack("!BBHHHBBH4s4s", first, 0, header + length if self.total < 0 else self.total, 7, self.fragment,
                         64, self.protocol, 0, socket.inet_aton(self.source), socket.inet_aton(HERE)) + self.options
        total = sum(struct.unpack(f"!{len(ip) // 2}H", ip))
        while total >> 16:
            total = (total & 0xffff) + (total >> 16)
        ip = ip[:10] + struct.pack("!H", ~total & 0xffff) + ip[12:]
        udp = struct.pack("!HHHH", self.port, OUR_PORT, length if self.length < 0 else self.length, 0) + self.payload
        tags = b"".join(struct.pack("!HH", *tag) for tag in self.tags)
        whole = bytes.fromhex(OURS) + bytes.fromhex("020000000007") + tags + b"\x08\x00" + ip + udp
        return whole[:len(whole) - self.cut] + bytes(self.padding)


OURS = ""


def put(*frames):
    """On the wire over there, ROUNDS times."""
    raw = [f if isinstance(f, bytes) else f.bytes() for f in frames]
    run_far(f"""
import socket
with socket.socket(socket.AF_PACKET, socket.SOCK_RAW) as s:
    s.bind(("pk1", 0))
    for round_ in range({ROUNDS}):
        for frame in {raw!r}:
            s.send(frame)
        if round_ % 8 == 7:
            all_is_through()
all_is_through()
""")


def expect(w, frames, arrive=0, **counters):
    """So many times ROUNDS in each counter, and in the socket."""
    what = [f.hex()[:80] if isinstance(f, bytes) else f for f in frames]
    w.arrived()
    got = w.counted(lambda: put(*frames), **{name: times * ROUNDS for name, times in counters.items()})
    # the kernel of the other end says something by itself now and then
    noise = ("pass_arp", "pass_icmp", "pass_else")
    for name, times in counters.items():
        least = name in noise or name == "drop_else"
        assert got.get(name, 0) >= times * ROUNDS if least else got.get(name) == times * ROUNDS, (name, what, got)
    for name in got:
        assert name in counters or name in noise or name == "drop_else", (name, what, got)
    count = w.arrived(arrive * ROUNDS)
    assert count == arrive * ROUNDS, (count, what, got)


def begin(w, **keys):
    global OURS
    w.write_conf(f"address = {DEVICE}\n", **keys)
    w.start_guard()
    OURS = json.loads(sh("ip", "-json", "link", "show", "pk0").stdout)[0]["address"].replace(":", "")


def priority_tag_changes_nothing(w):
    """VLAN 0 is no VLAN (802.1Q, 9.6): the kernel takes such frames for untagged ones."""
    for guard in ("shared", "dedicated"):
        begin(w, guard=guard)
        for kind in (VLAN, PROVIDER):
            tag = ((kind, PRIORITY),)
            expect(w, [Frame(tags=tag)], arrive=1, pass_device=1)
            expect(w, [Frame(tags=tag, source=STRANGER)], drop_foreign=1)
            expect(w, [Frame(tags=tag, port=80)], arrive=1, pass_device_else=1)
        other = Frame(tags=((VLAN, PRIORITY),), source=STRANGER, port=5000)
        if guard == "shared":
            expect(w, [other], arrive=1, pass_else=1)
        else:
            expect(w, [other], drop_else=1)
        w.end_guard()


def what_is_in_a_vlan_is_judged_as_if_it_were_not(w):
    """No VLAN is set up here, so nothing of it arrives; that is not the guard's doing."""
    for guard in ("shared", "dedicated"):
        begin(w, guard=guard)
        for tags in (((VLAN, 5),), ((PROVIDER, 5),), ((PROVIDER, 5), (VLAN, 7)), ((VLAN, 5), (VLAN, 7))):
            expect(w, [Frame(tags=tags)], pass_device=1)
            expect(w, [Frame(tags=tags, source=STRANGER)], drop_foreign=1)
            expect(w, [Frame(tags=tags, payload=bytes(65))], drop_length=1)
            expect(w, [Frame(tags=tags, fragment=0x2000)], drop_fragment=1)
            expect(w, [Frame(tags=tags).bytes()[:16]],
                   drop_malformed=1)
        # deeper than anybody looks
        deep = Frame(tags=((VLAN, 5),) * 3)
        if guard == "shared":
            expect(w, [deep], pass_else=1)
        else:
            expect(w, [deep], drop_else=1)
        w.end_guard()


def ends_of_a_cable_may_speak(w):
    """LACP and the like: without, a dedicated bond would have no link."""
    for guard in ("shared", "dedicated"):
        begin(w, guard=guard)
        expect(w, [LACP], pass_link=1)
        expect(w, [LACP[:5] + b"\x10" + LACP[6:]], **{"pass_else" if guard == "shared" else "drop_else": 1})
        w.end_guard()


def lengths_have_to_fit_into_one_another(w):
    begin(w)
    # Ethernet pads what is short
    expect(w, [Frame(padding=6)], arrive=1, pass_device=1)
    expect(w, [Frame(cut=1), Frame(cut=30)], drop_malformed=2)
    expect(w, [Frame(total=91), Frame(total=0), Frame(total=28)], drop_malformed=3)
    expect(w, [Frame(length=73), Frame(length=65535), Frame(length=7), Frame(length=0)], drop_malformed=4)
    expect(w, [Frame(length=71), Frame(length=8)], drop_length=2)
    expect(w, [Frame(payload=bytes(63)), Frame(payload=bytes(65))], drop_length=2)
    # a stranger's are not looked at that closely by anybody but the kernel
    expect(w, [Frame(source=STRANGER, port=5000, cut=1)], drop_malformed=1)
    w.end_guard()


def headers_have_to_be_there(w):
    for guard in ("shared", "dedicated"):
        begin(w, guard=guard)
        whole = Frame().bytes()
        expect(w, [whole[:size] for size in (15, 33, 34, 41)], drop_malformed=4)
        expect(w, [Frame(words=n) for n in (1, 4)], drop_malformed=2)
        expect(w, [Frame(words=15, payload=bytes(10)), Frame(version=6), Frame(version=0)], drop_malformed=3)
        w.end_guard()


def options_of_ip_are_read_over(w):
    begin(w)
    for options in (bytes(4), b"\x01" * 8, b"\x01" * 40):
        expect(w, [Frame(options=options)], arrive=1, pass_device=1)
        expect(w, [Frame(options=options, source=STRANGER)], drop_foreign=1)
        expect(w, [Frame(options=options, cut=1)], drop_malformed=1)
    w.end_guard()


def fragments_of_a_device_are_dropped_and_others_pass(w):
    begin(w)
    fragments = [Frame(fragment=0x2000), Frame(fragment=0x2001), Frame(fragment=0x0001), Frame(fragment=0x1fff)]
    expect(w, fragments, drop_fragment=4)
    expect(w, [dataclasses.replace(f, source=STRANGER) for f in fragments], drop_foreign=1, pass_else=3)
    # its header says how long the whole is, which the first part is not
    expect(w, [Frame(source=STRANGER, port=5000, fragment=0x2000, length=4008)], pass_else=1)
    w.end_guard()
    begin(w, guard="dedicated")
    expect(w, [dataclasses.replace(f, source=STRANGER) for f in fragments], drop_fragment=4)
    w.end_guard()


def other_protocols_are_nobodys_or_the_devices(w):
    ipv6 = bytes(12) + b"\x86\xdd" + bytes(60)
    begin(w)
    expect(w, [Frame(protocol=6, source=STRANGER), Frame(protocol=132, source=STRANGER), ipv6], pass_else=3)
    expect(w, [Frame(protocol=6), Frame(protocol=2)], pass_device_else=2)
    w.end_guard()
    begin(w, guard="dedicated")
    expect(w, [Frame(protocol=6, source=STRANGER), ipv6, bytes(12) + b"\x00\x30" + bytes(60)], drop_else=3)
    w.end_guard()


def jumbo_frames_are_judged_too(w):
    """No driver has XDP of its own for them on veth: then the kernel runs the program."""
    sh("ip", "link", "set", "pk0", "mtu", 9000)
    far("ip", "link", "set", "pk1", "mtu", 9000)
    begin(w)
    text = w.guard.log.read_text()
    assert "generic" in text and "MTU" in text and "has no XDP" not in text, text
    expect(w, [Frame(payload=bytes(8000))], drop_length=1)
    expect(w, [Frame(payload=bytes(8000), source=STRANGER)], drop_foreign=1)
    expect(w, [Frame(payload=bytes(8000), source=STRANGER, port=5000)], arrive=1, pass_else=1)
    expect(w, [Frame()], arrive=1, pass_device=1)
    w.end_guard()
    far("ip", "link", "set", "pk1", "mtu", 1500)
    sh("ip", "link", "set", "pk0", "mtu", 1500)


CHECKS = [
    priority_tag_changes_nothing,
    what_is_in_a_vlan_is_judged_as_if_it_were_not,
    ends_of_a_cable_may_speak,
    lengths_have_to_fit_into_one_another,
    headers_have_to_be_there,
    options_of_ip_are_read_over,
    fragments_of_a_device_are_dropped_and_others_pass,
    other_protocols_are_nobodys_or_the_devices,
    jumbo_frames_are_judged_too,
]

if __name__ == "__main__":
    sys.exit(main(CHECKS))
