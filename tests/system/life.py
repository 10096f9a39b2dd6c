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
import select
import signal
import struct
import subprocess
import sys
import termios
import time

from house import PATIENCE, House, end, equal, free_address, main, rng, run, shared_memory, wait_equal, wait_for
from safety import safety


def test_the_device_may_be_there_first():
    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()


def test_the_daemon_may_be_there_first():
    with House() as house:
        house.start_daemon()
        wait_for("images", lambda: house.device()["publishing"])
        time.sleep(0.3)  # long enough to be wrong about it
        assert not house.fresh(), house.device()
        house.says("status", returncode=2)
        house.start_sim()
        house.wait_fresh()
        house.says("status", returncode=0)


def test_the_mode_fits_the_transport_that_is_taken_instead():
    """AF_XDP cannot poll a card, and there is none on the loopback; the ring perhaps can."""
    with House(transport="xdp", interface="lo", mode="napi") as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        text = house.log()
        assert "transport is io_uring, for AF_XDP" in text or "transport is socket, for AF_XDP" in text, text
        assert "for io_uring only" not in text, text
        assert re.search("mode is (napi|sleep instead of napi: (this kernel|there is no io_uring))", text), text
        assert text.count("mode is ") == 1, text


def test_the_device_may_go_and_come_again():
    with House() as house:
        sim = house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        end(sim)
        wait_equal("the device lost", lambda: house.state().get("link"), "lost")
        wait_for("the reason", lambda: house.device()["reason"].startswith("no answer"), say=house.device)
        house.start_sim()
        house.wait_fresh()
        equal(daemon.poll(), None, house.log())


def test_sigterm_leaves_the_device_in_its_safe_state():
    with House() as house:
        # a link or a commander that is lost at the wrong moment is another test's matter
        house.device_keys["mill"] |= {"digital-outputs": "31-34", "safe-on": "32", "safe-hold": "33",
                                      "lost-after-ms": 60000, "heartbeat-timeout-ms": 60000}
        sim = house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        house.spawn("commander", house.runtime, "mill", 31, 33, log="commander.log")
        on = lambda: {i + 1 for i, bit in enumerate(house.state().get("outputs", [])) if bit}
        wait_for("the commander's outputs", lambda: {31, 33} <= on(), say=on)
        equal(end(daemon), 0, house.log())
        # a device that is held itself does what it was told when it comes to it
        with safety():
            wait_equal("the latches",
                       lambda: {pin: "latch=1" in house.ask_sim(sim, "pin", pin) for pin in (31, 32, 33, 34)},
                       {31: False, 32: True, 33: True, 34: False})
        assert not any(house.runtime.iterdir()), list(house.runtime.iterdir())


def test_a_safe_state_that_is_not_acknowledged_is_told_at_the_end():
    with House() as house:
        house.device_keys["mill"] |= {"digital-outputs": 31, "lost-after-ms": 60000, "heartbeat-timeout-ms": 60000,
                                      "failsafe-timeout-ms": 700}
        sim = house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        house.spawn("commander", house.runtime, "mill", 31, log="commander.log")
        wait_for("the commander's output", lambda: "latch=1" in house.ask_sim(sim, "pin", 31))
        house.ask_sim(sim, "silence", 600000)
        equal(end(daemon), 0, house.log())
        said = [line for line in house.log().splitlines() if "the safe state was not acknowledged" in line]
        assert len(said) == 1 and "mill: " in said[0] and "acts 700 ms after the last packet;" in said[0], house.log()


def test_sigterm_ends_it_without_a_device_too():
    with House() as house:
        daemon = house.start_daemon()
        equal(end(daemon), 0, house.log())


def test_a_killed_daemon_is_noticed_and_replaced():
    with House() as house:
        house.start_sim()
        for _ in range(5):
            daemon = house.start_daemon()
            house.wait_fresh()
            before = house.device()["state"]["epoch"]
            end(daemon, signal.SIGKILL)
            wait_for("the silence", lambda: not house.device()["publishing"])
            device = house.device()
            assert re.search(r"daemon not publishing for \d+\.\d s", device["reason"]), device
            text = house.ctl("status").stdout
            assert "stale (daemon not publishing for " in text, text
            daemon = house.start_daemon()
            house.wait_fresh()
            after = house.device()["state"]["epoch"]
            assert after != before, f"epoch {after} as before"
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
        grown = shared_memory() - before
        assert not grown, grown

        def descriptors():
            found = []
            for entry in os.scandir(f"/proc/{daemon.pid}/fd"):
                try:
                    found.append(os.readlink(entry.path))
                except FileNotFoundError:
                    pass  # closed meanwhile
            return sorted(found)
        # everything it opens after its start is open when nothing has come for a second
        before = []
        while before != (before := descriptors()):
            time.sleep(1)
        for _ in range(20):
            house.device()
        # what it opens to look for the dead is closed again
        wait_for("as many descriptors as before", lambda: len(descriptors()) <= len(before),
                 say=lambda: (before, descriptors()))


def test_a_second_daemon_is_refused_with_the_first_ones_pid():
    with House() as house:
        house.start_sim()
        first = house.start_daemon()
        second = house.start_daemon(wait=False, log="second.log")
        equal(second.wait(PATIENCE), 75, house.log("second.log"))
        said = house.complaint("second.log")
        assert str(first.pid) in said and str(house.runtime) in said, said
        house.wait_fresh()


def test_a_device_that_another_daemon_drives_is_waited_for():
    # both driving it would switch each other's outputs off
    with House() as one, House() as other:
        other.address, other.device_keys = one.address, {"mill": {"address": one.address}}
        one.start_sim()
        first = one.start_daemon()
        one.wait_fresh()
        second = other.start_daemon()
        wait_for("who has it", lambda: f"driven by another pokeysd (process {first.pid} of user " in other.log(), say=other.log)
        device = other.device()
        assert device["state"]["link"] == "searching" and not device["state"]["statistics"]["sent"], device
        # that, and nothing of the network or of an address that is not known
        wait_equal("the fault", lambda: other.state()["fault"], "in use")
        assert "another pokeysd" in other.device()["reason"], other.device()
        said = [line for line in other.log().splitlines() if "mill: " in line]
        equal(len(said), 1, said)
        one.wait_fresh()
        end(first)
        other.wait_fresh()
        equal(second.poll(), None, other.log())


def test_one_device_is_not_driven_by_two_sections():
    # by address and by serial number it is the same one
    with House() as house:
        serial = rng.randrange(100000, 2**31)
        house.daemon_keys |= {"discovery-address": house.address, "discovery-interval-ms": 100}
        house.device_keys["lathe"] = {"serial": serial}
        house.start_sim("--serial", serial)
        house.start_daemon()
        wait_for("the complaint", lambda: "lathe: the device at " in house.log(), say=house.log)
        assert "is that of [device mill]" in house.log(), house.log()
        # for whoever may not read the log as well
        house.tells("is that of [device mill]; it is driven as mill only", "events", "lathe")
        wait_equal("the fault", lambda: house.state("lathe")["fault"], "in use")
        house.wait_fresh("mill")
        equal(house.state("lathe")["statistics"]["sent"], 0)


def test_two_daemons_run_beside_each_other():
    with House() as one, House() as other:
        for house in (one, other):
            house.start_sim()
            house.start_daemon()
        one.wait_fresh()
        other.wait_fresh()
        one.says("devices", stdout="mill\n")


def test_a_second_commander_is_refused():
    with House() as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        first = house.spawn("commander", house.runtime, "mill", log="first.log")
        wait_for("the first", lambda: "commanding" in house.log("first.log"))
        second = house.spawn("commander", house.runtime, "mill", log="second.log")
        equal(second.wait(PATIENCE), 1, house.log("second.log"))
        assert "another commander holds device" in house.log("second.log"), house.log("second.log")
        # the dead one's place is free again within a second
        end(first, signal.SIGKILL)
        third = []

        def commands():
            if not third or third[-1].poll() is not None:
                third.append(house.spawn("commander", house.runtime, "mill", log="third.log"))
            return "commanding" in house.log("third.log")
        wait_for("a third", commands)


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
        house.wait_fresh()
        equal(house.device()["state"]["identity"]["address"], house.address)
        end(sim)
        wait_for("the device lost", lambda: house.state().get("link") in ("lost", "searching"))
        house.start_sim("--serial", serial, address=elsewhere)
        house.wait_fresh()
        equal(house.device()["state"]["identity"]["address"], elsewhere)
        equal(daemon.poll(), None, house.log())


def test_another_device_at_the_address_is_left_alone():
    with House() as house:
        house.device_keys["mill"] |= {"serial": 11, "digital-outputs": 31, "safe-on": 31}
        sim = house.start_sim("--serial", 12)
        house.start_daemon()
        wait_equal("the refusal", lambda: house.state().get("fault"), "wrong serial number")
        # status sends people to the log, which names both
        house.tells('"pokeysctl events" says which one answers', "status")
        wait_for("both numbers", lambda: "mill: serial number 12 answers, but 11 is configured" in house.log(), say=house.log)
        house.says("status", returncode=2)
        pin = house.ask_sim(sim, "pin", 31)
        with safety():
            assert "latch=0" in pin, pin
        house.ask_sim(sim, "serial", 11)
        house.wait_fresh()


def test_a_dead_device_does_not_disturb_the_others():
    with House() as house:
        house.device_keys["dead"] = {"address": free_address()}
        house.device_keys["nowhere"] = {"serial": 4}
        house.start_sim()
        house.start_daemon()
        house.wait_fresh("mill")
        # while the finder searches: if cycles waited for the searches, a thousand would take minutes
        first = house.state("mill")["cycle"]
        wait_for("a thousand cycles", lambda: house.state("mill")["cycle"] >= first + 1000)
        equal(house.ctl("devices").stdout.split(), ["mill", "dead", "nowhere"])
        house.says("status", "mill", returncode=0)
        house.says("status", returncode=2)
        house.tells('not found in the network; run "pokeysctl discover" to see why', "status", "nowhere")
        page = house.ctl("top", "nowhere", "--count", 1).stdout
        assert "(not identified yet)" in page and "0.0.0" not in page, page
        rows = house.ctl("top", "--count", 1).stdout
        nowhere = [row for row in rows.splitlines() if row.startswith("nowhere ")]
        assert len(nowhere) == 1 and "0 ns" not in nowhere[0], rows  # nothing was measured there


def test_sighup_is_answered_in_the_log_and_changes_nothing():
    with House() as house:
        daemon = house.start_daemon()
        daemon.send_signal(signal.SIGHUP)
        wait_for("the answer", lambda: "SIGHUP" in house.log())
        equal(daemon.poll(), None, house.log())


def test_pokeysctl_top_draws_pages_and_lines():
    with House() as house:
        house.start_sim("--preset", "demo")
        house.start_daemon()
        house.wait_fresh()
        wait_for("the histograms", lambda: ((house.device()["diag"] or {}).get("latency_us") or {}).get("round_trip", {}).get("p50"))
        pages = house.ctl("top", "--count", 3, "--interval", 0.05)
        assert pages.returncode == 0 and pages.stdout.count("round trip ") == 3, pages.stdout
        assert max(map(len, pages.stdout.splitlines())) <= 80, pages.stdout
        assert max(len(page.splitlines()) for page in pages.stdout.split("\n\n")) <= 24, pages.stdout

        def cycles():
            lines = house.ctl("top", "--json", "--count", 3, "--interval", 0.05).stdout.splitlines()
            return [json.loads(line)["devices"][0]["state"]["cycle"] for line in lines]
        # a daemon that was held publishes nothing new; it goes on
        wait_for("three cycles, one after the other", lambda: len(set(seen := cycles())) == 3 and seen == sorted(seen),
                 say=cycles)


def test_pokeysctl_top_draws_80_by_24_and_gives_the_terminal_back():
    with House() as house:
        house.device_keys["mill"] |= {"lost-after-ms": 60000}  # a page of one that is lost has no axes
        house.start_sim("--preset", "demo")
        house.start_daemon()
        house.wait_fresh()
        wait_for("the histograms", lambda: (house.device()["diag"] or {}).get("transport"))
        ours, theirs = pty.openpty()
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        top = house.spawn("pokeysctl", "-r", house.runtime, "top", "--interval", 0.05, stdout=theirs)
        os.close(theirs)
        seen = b""
        while seen.count(b"\x1b[H") < 4:
            assert select.select([ours], [], [], PATIENCE)[0], seen
            seen += os.read(ours, 65536)
        top.send_signal(signal.SIGINT)
        equal(top.wait(PATIENCE), 0)
        os.set_blocking(ours, False)
        try:
            seen += os.read(ours, 65536)
        except OSError:
            pass
        os.close(ours)
        page = re.sub(rb"\x1b\[[?0-9]*[A-Za-z]", b"", seen.split(b"\x1b[H")[2]).decode("ascii")
        lines = page.split("\r\n")
        assert len(lines) <= 24 and max(map(len, lines)) <= 80, page
        assert "round trip" in page and "axis" in page and "\n" not in lines[-1], page
        assert b"\x1b[?25h" in seen, "the cursor stays hidden"


def test_q_ends_pokeysctl_top_and_gives_the_keyboard_back():
    with House() as house:
        house.start_sim("--preset", "demo")
        house.start_daemon()
        house.wait_fresh()
        ours, theirs = pty.openpty()
        before = termios.tcgetattr(theirs)
        # the terminal's foreground job, as below a shell
        top = house.spawn("pokeysctl", "-r", house.runtime, "top", "--interval", 3600, stdin=theirs, stdout=theirs,
                          stderr=theirs, start_new_session=True,
                          preexec_fn=lambda: fcntl.ioctl(theirs, termios.TIOCSCTTY, 0))
        seen = b""
        while b"q: quit" not in seen:
            assert select.select([ours], [], [], PATIENCE)[0], seen
            seen += os.read(ours, 65536)
        os.write(ours, b"x")
        wait_for("the key to be taken", lambda: not struct.unpack(
            "i", fcntl.ioctl(theirs, termios.FIONREAD, b"\0" * 4))[0])
        equal(top.poll(), None, seen)
        os.write(ours, b"q")
        equal(top.wait(PATIENCE), 0)
        equal(termios.tcgetattr(theirs), before)
        os.close(theirs)
        os.close(ours)


def test_pokeysctl_discover_shows_the_simulator():
    with House() as house:
        serial = rng.randrange(100000, 2**31)
        house.start_sim("--serial", serial)
        discover = "discover", "--address", house.address, "--timeout"

        # a search that nobody answered in its time is made again, with more of it
        def answers(*options):
            for timeout in (300, 3000, 10000):
                out = run(house.programs["pokeysctl"], *discover, timeout, *options)
                if str(serial) in out.stdout:
                    break
            return out
        out = answers("--json")
        found = [d for d in json.loads(out.stdout)["devices"] if d["serial"] == serial]
        assert len(found) == 1 and found[0]["address"] == house.address, (found, out)
        equal((found[0]["type"], found[0]["firmware"]), ("PoKeys57CNC", "4.7.15"))
        table = answers()
        assert str(serial) in table.stdout and table.returncode == 0, table


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
        equal((child.wait(PATIENCE), child.stderr.read()), (1, b""))
        child.stderr.close()


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
