#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The flight recorder from outside: a record by command, one at a fault, one of a daemon
that was killed; read by a strict parser of its own, by pokeysctl replay, and by tcpdump and
tshark where they are."""
import json
import os
import shutil
import signal
import socket
import struct
import sys

from house import House, end, main, run, wait_for

SECTION, INTERFACE, PACKET, JOURNAL = 0x0A0D0D0A, 1, 6, 9


def options(data):
    """{code: value} of a list of options, which must end as the format says."""
    found = {}
    while data:
        code, length = struct.unpack_from("<HH", data)
        padded = (length + 3) & ~3
        assert len(data) >= 4 + padded and not any(data[4 + length:4 + padded]), data
        if code == 0:
            assert length == 0 and len(data) == 4, data
            return found
        assert code not in found, code
        found[code] = data[4:4 + length]
        data = data[4 + padded:]
    raise AssertionError("options without an end")


def blocks(data):
    while data:
        kind, length = struct.unpack_from("<II", data)
        assert length % 4 == 0 and 12 <= length <= len(data), (kind, length)
        assert struct.unpack_from("<I", data, length - 4)[0] == length
        yield kind, data[8:length - 4]
        data = data[length:]


def checksum(data):
    data += b"\0" * (len(data) % 2)
    total = sum(struct.unpack(f">{len(data) // 2}H", data))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return total


def judge_frame(frame, length, outbound, address):
    """A whole and right one of a device; its payload."""
    assert len(frame) == length and frame[12:14] == b"\x08\x00"
    ip, udp = frame[14:34], frame[34:]
    assert ip[0] == 0x45 and ip[9] == 17 and struct.unpack(">H", ip[2:4])[0] == len(frame) - 14
    assert checksum(ip) == 0xFFFF
    source, destination, udp_length, _ = struct.unpack(">HHHH", udp[:8])
    assert udp_length == len(udp)
    assert checksum(ip[12:20] + struct.pack(">HH", 17, udp_length) + udp) == 0xFFFF
    device = (ip[16:20], destination) if outbound else (ip[12:16], source)
    own = (ip[12:16], source) if outbound else (ip[16:20], destination)
    assert device == (socket.inet_aton(address), 20055), device
    assert own[0] != bytes(4) and own[1], own
    return udp[8:]


def parse(path, address):
    """(packets, texts): direction, time, payload and comment of each packet; each event's text."""
    whole = list(blocks(path.read_bytes()))
    kind, body = whole[0]
    assert kind == SECTION and struct.unpack_from("<IHHq", body) == (0x1A2B3C4D, 1, 0, -1)
    assert options(body[16:])[4].startswith(b"pokeysd") or options(body[16:])[4].startswith(b"pokeysctl")
    kind, body = whole[1]
    assert kind == INTERFACE and struct.unpack_from("<HH", body) == (1, 0)
    assert options(body[8:])[9] == b"\x09" and options(body[8:])[2] == b"mill"
    packets, texts = [], []
    for kind, body in whole[2:]:
        assert kind in (PACKET, JOURNAL), kind
        if kind == JOURNAL:
            texts.append(body.rstrip(b"\0").decode())
            assert "\nMESSAGE=" in texts[-1] and texts[-1].endswith("\n")
            continue
        interface, high, low, kept, length = struct.unpack_from("<IIIII", body)
        assert interface == 0
        rest = options(body[20 + ((kept + 3) & ~3):])
        outbound = struct.unpack("<I", rest[2])[0] == 2
        payload = judge_frame(body[20:20 + kept], length, outbound, address)
        packets.append((outbound, high << 32 | low, payload, rest[1].decode()))
    return packets, texts


def judge_record(path, address):
    packets, texts = parse(path, address)
    assert len(packets) > 100, len(packets)
    times = [t for _, t, _, _ in packets]
    assert times == sorted(times) and len(set(times)) > 50
    assert all(payload[0] == (0xBB if outbound else 0xAA) and len(payload) == 64
               for outbound, _, payload, _ in packets)
    accepted = sum("accepted" in comment for outbound, _, _, comment in packets if not outbound)
    assert accepted > 40
    return packets, texts


def judge_by_others(path, count):
    """Where they are: a tool that says so itself is worth more than our own parser."""
    if shutil.which("tcpdump"):
        out = run("tcpdump", "-nn", "-vv", "-r", path)
        assert out.returncode == 0 and out.stdout.count("udp sum ok") == count, out.stderr
        assert "bad" not in out.stdout
    if shutil.which("tshark"):
        out = run("tshark", "-r", path, "-o", "udp.check_checksum:TRUE", "-o", "ip.check_checksum:TRUE", "-Y",
                  "udp.checksum.status == 1 && ip.checksum.status == 1 && frame.comment", "-T", "fields",
                  "-e", "udp.port", env={**os.environ, "HOME": str(path.parent)})
        assert out.returncode == 0 and len(out.stdout.splitlines()) == count, out.stderr


def judge_keys(lines):
    """As pokeysctl(1) lists them."""
    every = {"t_ns", "device", "kind"}
    packet = every | {"operation", "id", "length", "round_trip_us", "data", "cycle"}
    kinds = {"event": every | {"level", "text"}, "request": packet | {"try"},
             "reply": packet | {"verdict", "taken_us"}}
    for line in lines:
        again = {"again_us", "answered_us"} & set(line)
        assert set(line) - again == kinds[line["kind"]], line
        assert not again or (len(again) == 2 and line["kind"] == "request"), line


def replay(*words):
    return run(House.programs["pokeysctl"], "replay", *words)


def wait_for_packets(house, path):
    """Until more than 200 answers are recorded; the last record is at `path`."""
    wait_for("packets", lambda: house.ctl("record", "mill", path).returncode == 0 and
             path.read_bytes().count(b"accepted") > 200)


def test_a_record_by_command():
    with House(**{"recorder-seconds": 60}) as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        path = house.folder / "by-command.pcapng"
        wait_for_packets(house, path)
        packets, texts = judge_record(path, house.address)
        judge_by_others(path, len(packets))
        assert any("running" in text for text in texts)
        lines = [json.loads(line) for line in replay(path, "--json").stdout.splitlines()]
        assert len(lines) == len(packets) + len(texts)
        assert [line["data"] for line in lines if "data" in line] == [p[2].hex() for p in packets]
        judge_keys(lines)
        answered = [line for line in lines if line["kind"] == "request" and line["round_trip_us"]]
        assert len(answered) > 40, len(answered)
        assert {"device_io", "pulse_status"} & {line["operation"] for line in lines if "data" in line}
        text = replay(path)
        assert text.returncode == 0 and len(text.stdout.splitlines()) == len(lines)


def test_a_request_that_was_answered_at_a_later_try_is_not_told_as_unanswered():
    with House(**{"recorder-seconds": 60}) as house:
        house.start_sim("--loss-reply", "0.3", "--delay-us", "50")
        house.start_daemon()
        path = house.folder / "lossy.pcapng"
        wait_for_packets(house, path)
        lines = [json.loads(line) for line in replay(path, "--json").stdout.splitlines()]
        judge_keys(lines)
        again = [(line, text) for line, text in zip(lines, replay(path).stdout.splitlines())
                 if line.get("answered_us")]
        assert len(again) > 10, len(again)
        for line, text in again:
            assert f"sent again after {line['again_us']:.1f} us, answered after {line['answered_us']:.1f} us" in text
            assert line["again_us"] > 0 and "no answer" not in text, text


def test_a_record_at_a_fault():
    with House() as house:
        records = house.folder / "records"
        records.mkdir()
        house.daemon_keys["record-folder"] = records
        sim = house.start_sim()
        house.start_daemon()
        wait_for_packets(house, house.folder / "before.pcapng")
        end(sim)
        wait_for("a record", lambda: list(records.glob("pokeysd-*-lost.pcapng")))
        packets, texts = judge_record(next(records.glob("*.pcapng")), house.address)
        assert any("lost (was running)" in text for text in texts), texts
        # what came after it is in it as well: the daemon asked on
        assert packets[-1][0] and "try" in packets[-1][3]
        wait_for("the journal", lambda: "-lost.pcapng" in house.log())


def test_a_daemon_that_was_killed_leaves_its_record():
    with House() as house:
        records = house.folder / "records"
        records.mkdir()
        house.daemon_keys["record-folder"] = records
        house.start_sim()
        daemon = house.start_daemon()
        path = house.folder / "after.pcapng"
        wait_for_packets(house, path)
        daemon.send_signal(signal.SIGKILL)
        daemon.wait()
        assert house.ctl("record", path).returncode == 0
        after, _ = parse(path, house.address)
        assert len(after) > 200, len(after)
        house.start_daemon()
        wait_for("its record", lambda: list(records.glob("pokeysd-*-died.pcapng")))
        packets, _ = parse(next(records.glob("*-died.pcapng")), house.address)
        assert [p[2] for p in packets] == [p[2] for p in after]


def test_a_daemon_that_ends_leaves_none():
    with House() as house:
        house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        assert (house.runtime / "recorder").stat().st_mode & 0o777 == 0o640
        end(daemon)
        assert not list(house.runtime.glob("recorder*"))
        out = house.ctl("record", house.folder / "none.pcapng")
        assert out.returncode == 1 and "no recorder" in out.stderr, out.stderr


def test_nothing_is_recorded_if_nobody_wants_it():
    with House(**{"recorder-seconds": 0}) as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        assert not list(house.runtime.glob("recorder*"))


def test_a_record_of_somebody_elses_commands_no_terminal():
    def block(kind, body):
        length = struct.pack("<I", 12 + len(body))
        return struct.pack("<I", kind) + length + body + length

    text = b"MESSAGE=one\x1b[2Jtwo\nPOKEYS_TIME_NS=1000\n"
    with House() as house:
        path = house.folder / "theirs.pcapng"
        path.write_bytes(block(SECTION, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1)) +
                         block(JOURNAL, text + bytes(-len(text) % 4)))
        out = replay(path)
        assert out.returncode == 0 and "** one?[2Jtwo" in out.stdout and "\x1b" not in out.stdout, out


def test_what_cannot_be_is_said_in_one_line():
    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        for words, status, said in ((("record",), 64, "usage"), (("record", "a", "b", "c"), 64, "usage"),
                                    (("record", "lathe", house.folder / "x"), 1, "it has: mill"),
                                    (("record", "mill"), 1, "mill is a device: name a file"),
                                    (("record", house.folder / "no" / "x"), 1, "No such file"),
                                    (("replay", house.folder / "x"), 1, "No such file"),
                                    (("replay", house.conf), 1, "it is not pcapng"),
                                    (("replay",), 64, "usage")):
            out = replay(*words[1:]) if words[0] == "replay" else house.ctl(*words)
            assert out.returncode == status and said in out.stderr, (words, out)
            assert len(out.stderr.splitlines()) == 1, out.stderr


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
