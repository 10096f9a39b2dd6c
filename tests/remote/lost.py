#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Clients, proxies and HAL that stop, die and come again: no output stays on by itself."""
import os
import pathlib
import re
import signal
import subprocess
import time

import rig
from rig import halcmd, wait

CONFIG = """\
[component panel]
interval-ms = 20

[lease jog]
timeout-ms = 400

[pin panel.start]
failsafe = 0

[pin panel.jog]
failsafe = 0
lease = jog
"""
# A client in another process, so that a test can stop and kill it. It sets the pin to what each line says, and
# prints a line when the proxy has read that.
OTHER = """
import sys, time
sys.path.insert(0, sys.argv[1])
import rig
one = rig.Client().connect()
one.set(start=True)
print("set", flush=True)
for line in sys.stdin:
    one.send(259, pin=[one.pin("start", line.strip() == "1")])
    one.quiet()
    print("sent", flush=True)
"""


class Other:
    """A client in another process."""

    def __init__(self):
        self.child = subprocess.Popen(["/usr/bin/python3", "-B", "-c", OTHER, os.path.dirname(os.path.abspath(__file__))],
                                      stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        assert self.child.stdout.readline() == "set\n"

    def say(self, line):
        self.child.stdin.write(line + "\n")
        assert self.child.stdout.readline() == "sent\n"

    def kill(self):
        self.child.kill()
        self.child.wait()
        self.child.stdin.close()
        self.child.stdout.close()


def a_client_that_is_killed(machine):
    machine.proxy(CONFIG)
    other = Other()
    halcmd("net", "s", "panel.start")
    machine.becomes("panel.link-ok", True)
    other.kill()
    machine.becomes("panel.start", False)
    machine.becomes("panel.link-ok", False)
    machine.becomes("panel.bound", False)
    assert halcmd("gets", "s").strip() == "FALSE"
    assert "failsafe values for panel.start" in machine.said()
    # another one takes over
    machine.client().connect().set(start=True)
    machine.becomes("panel.link-ok", True)
    machine.becomes("panel.start", True)


def a_client_that_stops_and_goes_on(machine):
    machine.proxy(CONFIG)
    other, watcher = Other(), machine.client().connect()
    try:
        os.kill(other.child.pid, signal.SIGSTOP)
        machine.becomes("panel.start", False)
        watcher.sees("start", False)
        machine.becomes("panel.link-ok", False)
        machine.becomes("panel.clients", 1)
        # what it wanted to say meanwhile comes too late
        other.child.stdin.write("1\n")
        os.kill(other.child.pid, signal.SIGCONT)
        assert other.child.stdout.readline() == "sent\n"
        assert machine.get("panel.start") is False
        # what it says later is obeyed
        wait("it is settled", lambda: (time.sleep(0.2), other.say("1"), machine.get("panel.start"))[2])
        machine.becomes("panel.link-ok", True)
    finally:
        other.kill()


def a_setter_that_says_nothing_more(machine):
    machine.proxy(CONFIG)
    one = machine.client().connect()
    one.set(jog=1.5, start=True)
    machine.becomes("panel.jog", 0)
    assert machine.get("panel.start") is True or "could not run" in machine.said(), "it has a longer lease"
    machine.becomes("panel.link-ok", False)
    # a PING is a sign of life
    def stays():
        """Or None, if a busy machine kept us from sending one in time."""
        one.set(jog=1.0)
        begin = last = time.monotonic()
        while last < begin + 1.0:
            time.sleep(0.02)
            one.quiet()
            if time.monotonic() - last > 0.2:
                return None
            last = time.monotonic()
        assert machine.get("panel.jog") == 1.0 or "could not run" in machine.said()
        return True
    wait("PINGs in time", stays)


def a_proxy_that_is_killed(machine):
    proxy = machine.proxy(CONFIG)
    one = machine.client().connect()
    halcmd("net", "s", "panel.start")
    halcmd("net", "v", "panel.speed")
    halcmd("sets", "v", 2.5)
    one.sees("speed", 2.5)
    one.set(start=True, count=-7, mask=9)
    before = dict(one.handles)
    pid = proxy.pid
    os.kill(pid, signal.SIGKILL)
    wait("another one serves", lambda: rig.listed().get("pokeys-remote") not in (pid, None))
    # the client knows nothing of it: its library connects and subscribes again
    while one.handles == before:
        one.update()
    machine.becomes("panel.bound", True)
    assert (machine.get("panel.start"), machine.get("panel.link-ok")) == (False, False)
    assert one.values == {"start": False, "jog": 0, "count": -7, "mask": 9, "speed": 2.5}
    # everything is linked as before
    halcmd("sets", "v", 3.5)
    one.sees("speed", 3.5)
    wait("its settings count", lambda: one.ask(259, pin=[one.pin("start", True)], reply_required=True).type == 263
         if one.ask(210).type == 215 and time.sleep(0.6) is None else False)
    assert halcmd("gets", "s").strip() == "TRUE"
    machine.becomes("panel.link-ok", True)
    assert "is taken over from a proxy that is gone" in proxy.said()
    proxy.end()


def a_proxy_that_is_killed_again_and_again(machine):
    proxy = machine.proxy(CONFIG)
    one = machine.client().connect()
    for life in range(5):
        wait("it serves", proxy.ready)
        pid = proxy.pid
        if life == 4:
            handles = machine.client().connect().handles
            one.handles = handles
            wait("its settings count", lambda: one.ask(259, pin=[one.pin("start", True)], reply_required=True).type == 263)
            machine.becomes("panel.link-ok", True)
        os.kill(pid, signal.SIGKILL)
        if life < 4:
            wait("another one", lambda pid=pid: rig.listed().get("pokeys-remote") not in (pid, None))
    assert proxy.child.wait(rig.PATIENCE) == 1
    assert "not begun again after 5 times" in proxy.said()
    assert (machine.get("panel.start"), machine.get("panel.link-ok")) == (False, False)


def a_proxy_that_ends_and_another_one(machine):
    first = machine.proxy(CONFIG)
    one = machine.client().connect()
    halcmd("net", "s", "panel.start")
    one.set(start=True, mask=5)
    machine.becomes("panel.link-ok", True)
    first.end()
    assert "pokeys-remote" not in rig.listed()
    assert [machine.get(f"panel.{name}") for name in ("start", "link-ok", "bound", "clients")] == [False, False, False, 0]
    before = dict(one.handles)
    # bound again without its doing
    machine.proxy(CONFIG)
    while one.handles == before:
        one.update()
    assert one.values["mask"] == 5 and one.values["start"] is False
    assert "==> s" in halcmd("show", "pin", "panel.start")


def a_proxy_that_is_stopped(machine):
    proxy = machine.proxy(CONFIG)
    one = machine.client().connect()
    one.set(start=True)
    beat = machine.get("panel.heartbeat")
    machine.becomes("panel.heartbeat", not beat)
    os.kill(proxy.pid, signal.SIGSTOP)
    one.send(259, pin=[one.pin("mask", 77)])
    time.sleep(1.5)
    os.kill(proxy.pid, signal.SIGCONT)
    machine.becomes("panel.start", False)
    one.sees("start", False)
    assert machine.get("panel.mask") == 0, "it was set before the pause"
    assert "what clients sent meanwhile is not obeyed" in proxy.said()
    wait("its settings count", lambda: one.ask(259, pin=[one.pin("mask", 78)], reply_required=True).type == 263)
    assert machine.get("panel.mask") == 78


def what_the_manual_says_of_the_watchdog(machine):
    page = (rig.ROOT / "man/pokeys-remote.1.scd").read_text(encoding="utf-8")
    lines = re.search(r"^```\n(loadrt watchdog.*?)^```$", page, re.M | re.S)[1]
    assert "=> halui.mode.auto halui.program.run" in lines
    proxy = machine.proxy(CONFIG)
    one = machine.client().connect()
    path = pathlib.Path(machine.folder.name, "watchdog.hal")
    path.write_text(lines.replace("=> halui.mode.auto halui.program.run", ""), encoding="utf-8")
    # by a shell, because what loadrt starts would hold a pipe open
    assert subprocess.run(["halcmd", "-f", path], stdout=subprocess.DEVNULL, check=False).returncode == 0
    machine.becomes("watchdog.ok-out", True)
    assert machine.get("panel-start.out") is False
    one.set(start=True)
    machine.becomes("panel-start.out", True)
    proxy.close()               # both of its processes, at once
    machine.becomes("watchdog.ok-out", False)
    machine.becomes("panel-start.out", False)
    assert machine.get("panel.start") is True and machine.get("panel.link-ok") is True, "HAL keeps what it had"
    # for a moment, the component is not there
    proxy = machine.proxy(CONFIG)
    wait("it is taken over", lambda: "component panel is taken over from a proxy that is gone" in proxy.said())
    machine.becomes("panel.start", False)
    assert machine.get("watchdog.ok-out") is False
    machine.client().connect().set(start=True)
    machine.becomes("panel-start.out", True)


def a_second_proxy(machine):
    machine.proxy(CONFIG)
    one = machine.client().connect()
    second = machine.proxy(CONFIG, ready=False)
    assert second.child.wait(rig.PATIENCE) == 1
    assert re.search(r"a proxy with the name pokeys-remote runs already \(process \d+ of user \d+\)", second.said())
    third = machine.proxy(CONFIG, "--name", "other", ready=False)
    assert third.child.wait(rig.PATIENCE) == 1
    assert "cannot listen at 127.0.0.1:6202: Address already in use" in third.said()
    fourth = machine.proxy(CONFIG, "--name", "panel", ready=False)
    assert fourth.child.wait(rig.PATIENCE) == 1
    assert "HAL has a component panel already, which belongs to process" in fourth.said()
    one.set(start=True)
    assert rig.listed().keys() & {"other", "panel"} == {"panel"}


def hal_that_ends(machine):
    proxy = machine.proxy(CONFIG)
    machine.client().connect()
    # as LinuxCNC does it
    subprocess.run(["halrun", "-U"], capture_output=True, check=False, timeout=rig.PATIENCE)
    assert proxy.child.wait(rig.PATIENCE) == 0, proxy.said()
    assert "Traceback" not in proxy.said(), proxy.said()


def subscribers_that_do_not_read(machine):
    proxy = machine.proxy(CONFIG)
    frozen = [machine.client() for _ in range(4)]
    for each in frozen:
        each.sub.setsockopt(each.zmq.RCVHWM, 2)
        each.sub.setsockopt(each.zmq.RCVBUF, 4096)
        each.subscribe()
    one = machine.client().connect()
    for number in range(2000):
        halcmd("setp", "panel.count", number) if number % 100 == 0 else one.set(mask=number)
    one.sees("mask", 1999)
    assert proxy.child.poll() is None


def two_components_and_their_links_survive(machine):
    proxy = machine.proxy(CONFIG)
    for number in range(3):
        machine.client(f"c{number}x", (("a", rig.BIT, rig.OUT), ("b", rig.FLOAT, rig.IN))).connect()
        halcmd("net", f"s{number}", f"c{number}x.a")
        halcmd("net", f"v{number}", f"c{number}x.b")
    for _ in range(2):
        pid = proxy.pid
        os.kill(pid, signal.SIGKILL)
        wait("another one serves", lambda pid=pid: rig.listed().get("pokeys-remote") not in (pid, None) and
             proxy.ready())
    shown = halcmd("show", "pin")
    for number in range(3):
        assert f"c{number}x.a ==> s{number}" in shown and f"c{number}x.b <== v{number}" in shown, shown
    proxy.end()


if __name__ == "__main__":
    rig.main([a_client_that_is_killed, a_client_that_stops_and_goes_on, a_setter_that_says_nothing_more,
              a_proxy_that_is_killed, a_proxy_that_is_killed_again_and_again,
              a_proxy_that_ends_and_another_one, a_proxy_that_is_stopped,
              what_the_manual_says_of_the_watchdog, a_second_proxy,
              hal_that_ends, subscribers_that_do_not_read, two_components_and_their_links_survive])
