#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The daemon from outside, over real sockets: started in every order, stopped,
killed, started twice, searched for."""
import fcntl
import json
import os
import pathlib
import pty
import re
import signal
import struct
import subprocess
import sys
import termios
import time

from house import House, end, free_address, main, rng, run, shared_memory, wait_for


def test_the_device_may_be_there_first():
    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()


def test_the_daemon_may_be_there_first():
    with House() as house:
        house.start_daemon()
        time.sleep(0.3)
        device = house.device()
        assert device["publishing"] and not device["fresh"], device["reason"]
        assert house.ctl("status").returncode == 2
        house.start_sim()
        house.wait_fresh(limit=5)
        assert house.ctl("status").returncode == 0


def test_the_device_may_go_and_come_again():
    with House() as house:
        sim = house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        end(sim)
        wait_for("the device lost", lambda: house.device()["state"]["link"] == "lost", 5)
        assert house.device()["reason"].startswith("no answer")
        house.start_sim()
        house.wait_fresh(limit=5)
        assert daemon.poll() is None


def test_sigterm_leaves_the_device_in_its_safe_state_in_under_a_second():
    with House() as house:
        house.device_keys["mill"] |= {"digital-outputs": "31-34", "safe-on": "32", "safe-hold": "33"}
        sim = house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        house.spawn("commander", house.runtime, "mill", 31, 33, log="commander.log")
        on = lambda: {i + 1 for i, bit in enumerate(house.device()["state"]["outputs"]) if bit}
        wait_for("the commander's outputs", lambda: {31, 33} <= on())
        status, seconds = end(daemon)
        assert status == 0, f"status {status}: {house.log()}"
        assert seconds < 1, f"{seconds:.2f} s"
        latches = {pin: "latch=1" in house.ask_sim(sim, "pin", pin) for pin in (31, 32, 33, 34)}
        assert latches == {31: False, 32: True, 33: True, 34: False}, latches
        assert not any(house.runtime.iterdir()), list(house.runtime.iterdir())


def test_sigterm_ends_it_in_under_a_second_without_a_device_too():
    with House() as house:
        status, seconds = end(house.start_daemon())
        assert status == 0 and seconds < 1, f"status {status} after {seconds:.2f} s"


def test_a_killed_daemon_is_noticed_and_replaced():
    with House() as house:
        house.start_sim()
        for _ in range(5):
            daemon = house.start_daemon()
            house.wait_fresh()
            before = house.device()["state"]["epoch"]
            end(daemon, signal.SIGKILL)
            time.sleep(0.3)
            device = house.device()
            assert not device["publishing"] and "daemon not publishing for 0." in device["reason"], device
            text = house.ctl("status").stdout
            assert "stale (daemon not publishing for 0." in text, text
            begin = time.monotonic()
            daemon = house.start_daemon()
            house.wait_fresh()
            seconds = time.monotonic() - begin
            assert seconds < 1, f"fresh after {seconds:.2f} s"
            assert house.device()["state"]["epoch"] != before
            roots = [p.name for p in house.runtime.iterdir() if p.name.startswith("e.")]
            assert len(roots) == 1, roots
            end(daemon)


def test_a_killed_daemon_leaves_no_descriptor_and_nothing_in_dev_shm():
    with House() as house:
        house.start_sim()
        before = shared_memory()
        for _ in range(10):
            daemon = house.start_daemon()
            wait_for("cycles", lambda: (house.device() or {}).get("publishing"))
            end(daemon, signal.SIGKILL)
        daemon = house.start_daemon()
        grown = [name for name in shared_memory() - before if "iox" in name]
        assert not grown, grown
        time.sleep(1)  # everything it opens after its start is open
        descriptors = lambda: sorted(os.readlink(f.path) for f in os.scandir(f"/proc/{daemon.pid}/fd"))
        before = descriptors()
        for _ in range(20):
            house.device()
        time.sleep(0.6)
        assert len(descriptors()) == len(before), (before, descriptors())


def test_a_second_daemon_is_refused_with_the_first_ones_pid():
    with House() as house:
        house.start_sim()
        first = house.start_daemon()
        second = house.start_daemon(wait=False, log="second.log")
        assert second.wait(10) == 75, second.returncode
        said = house.complaint("second.log")
        assert str(first.pid) in said and str(house.runtime) in said, said
        house.wait_fresh()


def test_two_daemons_run_beside_each_other():
    with House() as one, House() as other:
        for house in (one, other):
            house.start_sim()
            house.start_daemon()
        one.wait_fresh()
        other.wait_fresh()
        assert one.ctl("devices").stdout == "mill\n"


def test_a_second_commander_is_refused():
    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        first = house.spawn("commander", house.runtime, "mill", log="first.log")
        wait_for("the first", lambda: "commanding" in house.log("first.log"))
        second = house.spawn("commander", house.runtime, "mill", log="second.log")
        assert second.wait(10) == 1
        assert len(house.log("second.log").strip()) > 10
        # the dead one's place is free again within a second
        end(first, signal.SIGKILL)
        third = []

        def commands():
            if not third or third[-1].poll() is not None:
                third.append(house.spawn("commander", house.runtime, "mill", log="third.log"))
            return "commanding" in house.log("third.log")
        wait_for("a third", commands, 3)


def test_a_device_is_found_by_its_serial_number_wherever_it_goes():
    with House() as house:
        serial = rng.randrange(100000, 2**31)
        elsewhere = free_address()
        house.daemon_keys |= {"discovery-address": f"{house.address}, {elsewhere}",
                              "discovery-interval-ms": 100}
        house.device_keys = {"mill": {"serial": serial}}
        daemon = house.start_daemon()
        time.sleep(0.2)
        sim = house.start_sim("--serial", serial)
        house.wait_fresh(limit=5)
        assert house.device()["state"]["identity"]["address"] == house.address
        end(sim)
        wait_for("the device lost", lambda: not house.fresh())
        house.start_sim("--serial", serial, address=elsewhere)
        house.wait_fresh(limit=10)
        assert house.device()["state"]["identity"]["address"] == elsewhere
        assert daemon.poll() is None


def test_another_device_at_the_address_is_left_alone():
    with House() as house:
        house.device_keys["mill"] |= {"serial": 11, "digital-outputs": 31, "safe-on": 31}
        sim = house.start_sim("--serial", 12)
        house.start_daemon()
        wait_for("the refusal", lambda: house.device()["reason"] == "wrong serial number", 5)
        assert house.ctl("status").returncode == 2
        assert "latch=0" in house.ask_sim(sim, "pin", 31)
        house.ask_sim(sim, "serial", 11)
        house.wait_fresh(limit=10)


def test_a_dead_device_does_not_disturb_the_others():
    with House() as house:
        house.device_keys["dead"] = {"address": free_address()}
        house.device_keys["nowhere"] = {"serial": 4}
        house.start_sim()
        house.start_daemon()
        house.wait_fresh("mill")
        first = house.device("mill")["state"]
        time.sleep(1)
        last = house.device("mill")["state"]
        assert last["cycle"] - first["cycle"] > 500
        assert house.ctl("devices").stdout.split() == ["mill", "dead", "nowhere"]
        assert house.ctl("status", "mill").returncode == 0
        assert house.ctl("status").returncode == 2
        assert "not found; check power and cable" in house.ctl("status", "nowhere").stdout
        page = house.ctl("top", "nowhere", "--count", 1).stdout
        assert "(not identified yet)" in page and "0.0.0" not in page, page


def test_sighup_is_answered_in_the_log_and_changes_nothing():
    with House() as house:
        daemon = house.start_daemon()
        daemon.send_signal(signal.SIGHUP)
        wait_for("the answer", lambda: "SIGHUP" in house.log())
        assert daemon.poll() is None


def test_pokeysctl_top_draws_pages_and_lines():
    with House() as house:
        house.start_sim("--preset", "demo")
        house.start_daemon()
        wait_for("the histograms", lambda: (house.device()["diag"] or {}).get("transport"))
        pages = house.ctl("top", "--count", 3, "--interval", 0.05)
        assert pages.returncode == 0 and pages.stdout.count("round trip ") == 3, pages.stdout
        assert max(map(len, pages.stdout.splitlines())) <= 80
        assert max(len(page.splitlines()) for page in pages.stdout.split("\n\n")) <= 24
        lines = house.ctl("top", "--json", "--count", 3, "--interval", 0.05).stdout.splitlines()
        cycles = [json.loads(line)["devices"][0]["state"]["cycle"] for line in lines]
        assert len(cycles) == 3 and cycles == sorted(set(cycles)), cycles


def test_pokeysctl_top_draws_80_by_24_and_gives_the_terminal_back():
    with House() as house:
        house.start_sim("--preset", "demo")
        house.start_daemon()
        wait_for("the histograms", lambda: (house.device()["diag"] or {}).get("transport"))
        ours, theirs = pty.openpty()
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        top = house.spawn("pokeysctl", "-r", house.runtime, "top", "--interval", 0.05, stdout=theirs)
        os.close(theirs)
        seen = b""
        while seen.count(b"\x1b[H") < 4:
            seen += os.read(ours, 65536)
        top.send_signal(signal.SIGINT)
        assert top.wait(5) == 0
        os.set_blocking(ours, False)
        try:
            seen += os.read(ours, 65536)
        except OSError:
            pass
        os.close(ours)
        page = re.sub(rb"\x1b\[[?0-9]*[A-Za-z]", b"", seen.split(b"\x1b[H")[2]).decode("ascii")
        lines = page.split("\r\n")
        assert len(lines) <= 24 and max(map(len, lines)) <= 80, page
        assert "round trip" in page and "axis" in page and "\n" not in lines[-1]
        assert b"\x1b[?25h" in seen, "the cursor stays hidden"


def test_pokeysctl_discover_shows_the_simulator():
    with House() as house:
        serial = rng.randrange(100000, 2**31)
        house.start_sim("--serial", serial)
        out = run(house.programs["pokeysctl"], "discover", "--json", "--address", house.address, "--timeout", 300)
        found = [d for d in json.loads(out.stdout)["devices"] if d["serial"] == serial]
        assert len(found) == 1 and found[0]["address"] == house.address, found
        assert found[0]["type"] == "PoKeys57CNC" and found[0]["firmware"] == "4.7.15"
        table = run(house.programs["pokeysctl"], "discover", "--address", house.address, "--timeout", 300)
        assert str(serial) in table.stdout and table.returncode == 0


def test_pokeysctl_without_a_daemon_is_one_line_and_status_one():
    with House() as house:
        for words in (("status",), ("top",), ("devices",), ("status", "--json")):
            out = house.ctl(*words)
            assert out.returncode == 1 and not out.stdout, out
            assert len(out.stderr.strip().splitlines()) == 1 and str(house.runtime) in out.stderr, out.stderr


def test_pokeysctl_names_the_devices_there_are():
    with House() as house:
        house.start_daemon()
        out = house.ctl("status", "mil")
        assert out.returncode == 1 and '"mil"' in out.stderr and "mill" in out.stderr, out.stderr


def test_pokeysctl_ends_quietly_when_nobody_reads():
    with House() as house:
        house.start_daemon()
        child = subprocess.Popen([house.programs["pokeysctl"], "-r", house.runtime, "top", "--interval", "0.01"],
                                 stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        child.stdout.readline()
        child.stdout.close()
        assert child.wait(10) == 1 and not child.stderr.read()
        child.stderr.close()


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
