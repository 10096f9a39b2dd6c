#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl events: what the log says of the devices, for whoever may not read the log; also after the daemon has
died, and on over its restart."""
import datetime
import json
import os
import re
import signal
import sys
import time

from house import House, end, equal, main, wait_for


LEVELS = {3: "error", 4: "warning", 5: "notice", 6: "info"}


def rows(text):
    return [json.loads(line) for line in text.splitlines()]


def links(house):
    """What was said of mill's link."""
    return [row["text"] for row in rows(house.ctl("events", "mill", "--json").stdout) if row["kind"] == "link"]


def wait_link(house, link):
    """Until this is the last that was said of the link."""
    wait_for(link, lambda: links(house)[-1:] and links(house)[-1].startswith(link),
             say=lambda: house.ctl("events").stdout)


def printed(row):
    """The line for a person, without the date."""
    name = f"{row['device']}: " if row["device"] else ""
    held = f" ({row['held']} more of this kind were not written)" if row["held"] else ""
    return name + row["text"] + held


def stop(process):
    """SIGSTOP, and when it is back the process does nothing any more."""
    process.send_signal(signal.SIGSTOP)
    os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOWAIT)


def test_events_are_those_of_the_log():
    with House() as house:
        sim = house.start_sim()
        before = time.time_ns()
        daemon = house.start_daemon()
        wait_link(house, "running")
        # what concerns no device: cycles that were missed
        stop(daemon)
        time.sleep(0.3)
        daemon.send_signal(signal.SIGCONT)
        wait_for("missed cycles", lambda: "cycles-skipped" in house.ctl("events", "--json").stdout)
        sim.kill()
        wait_link(house, "lost")
        stop(daemon)
        found, text = rows(house.ctl("events", "--json").stdout), house.ctl("events", "mill")
        log = house.log()
        daemon.send_signal(signal.SIGCONT)
        equal([row["number"] for row in found], list(range(1, len(found) + 1)))
        equal({row["device"] for row in found}, {"mill", None})
        equal({row["format"] for row in found}, {1})
        for row in found:
            assert f"pokeysd: {printed(row)}\n" in log, (row, log)
            assert before <= row["time_ns"] <= time.time_ns(), row
            assert re.fullmatch("[a-z]+(-[a-z]+)*", row["kind"]), row
        lost = next(row for row in found if row["text"].startswith("lost"))
        equal((lost["kind"], "check power, cable and address" in lost["text"]), ("link", True))
        dates = [datetime.datetime.fromtimestamp(row["time_ns"] // 1_000_000 / 1000) for row in found]
        equal(text.stdout.splitlines(),
              [f"{date:%Y-%m-%d %H:%M:%S}.{date.microsecond // 1000:03}  {LEVELS[row['level']]:7}  {printed(row)}"
               for date, row in zip(dates, found, strict=True)])


def test_they_stay_when_the_daemon_has_died_and_go_on_with_the_next():
    with House() as house:
        house.start_sim()
        daemon = house.start_daemon()
        wait_link(house, "running")
        watchers = [house.spawn("pokeysctl", "-r", house.runtime, "events", "--follow", *words, log=name)
                    for words, name in ((["--json"], "watch.log"), ([], "text.log"))]

        def watched():
            # and what is said while no daemon is there
            lines = [line for line in house.log("watch.log").splitlines(True) if line[-1] == "\n"]
            equal([line for line in lines if not line.startswith(("{", "pokeysctl: mill: "))], [])
            return rows("".join(line for line in lines if line[0] == "{"))
        wait_for("what has been", lambda: any(row["text"].startswith("running") for row in watched()))
        wait_for("what has been", lambda: "mill: running" in house.log("text.log"))
        daemon.send_signal(signal.SIGKILL)
        daemon.wait()
        died = house.tells("not publishing", "events")
        equal((died.returncode, "mill: running" in died.stdout), (0, True), died)
        epochs = {row["epoch"] for row in watched()}
        equal(len(epochs), 1)
        house.start_daemon(wait=False)
        wait_for("the next daemon's", lambda: any(row["epoch"] not in epochs and row["text"].startswith("running")
                                                  for row in watched()))
        found = watched()
        equal(len({(row["epoch"], row["number"]) for row in found}), len(found))
        wait_for("the restart", lambda: "(mill: pokeysd was started again)\n" in house.log("text.log"))
        for watcher in watchers:
            equal(end(watcher, signal.SIGINT), 0)


def test_several_devices_are_told_apart_and_in_order():
    with House() as house:
        house.device_keys["lathe"] = {"address": "127.9.9.9"}
        house.start_sim()
        daemon = house.start_daemon()
        wait_link(house, "running")
        wait_for("the other's", lambda: "lathe: " in house.ctl("events", "lathe").stdout)
        stop(daemon)
        time.sleep(0.3)
        daemon.send_signal(signal.SIGCONT)
        wait_for("missed cycles", lambda: "cycles-skipped" in house.ctl("events", "--json").stdout)
        stop(daemon)
        found, alone = (rows(house.ctl("events", *words, "--json").stdout) for words in ([], ["lathe"]))
        daemon.send_signal(signal.SIGCONT)
        equal({row["device"] for row in found}, {"mill", "lathe", None})
        for name in ("mill", "lathe"):
            numbers = [row["number"] for row in found if row["device"] == name]
            equal(numbers, sorted(numbers))
        first = {name: next(i for i, row in enumerate(found) if row["device"] == name) for name in ("mill", "lathe")}
        equal(first["mill"] < first["lathe"], found[first["mill"]]["monotonic_ns"] < found[first["lathe"]]["monotonic_ns"])
        equal({row["device"] for row in alone}, {"lathe", None})
        # once, and not once for each device
        equal([row["text"] for row in found if not row["device"]], [row["text"] for row in alone if not row["device"]])
        gone = house.ctl("events", "gantry")
        equal((gone.returncode, 'no device "gantry"; it has: mill, lathe' in gone.stderr), (1, True), gone.stderr)


def test_what_ends_a_watcher():
    with House() as house:
        ran = house.ctl("events")
        equal((ran.returncode, ran.stdout, "no daemon runs in" in ran.stderr), (1, "", True), ran.stderr)
        house.start_sim()
        daemon = house.start_daemon()
        wait_link(house, "running")
        # who reads leaves
        watcher = house.spawn("pokeysctl", "-r", house.runtime, "events", "-f", stderr=None)
        watcher.stdout.readline()
        watcher.stdout.close()
        watcher.wait(60)
        # the daemon leaves: said, and no end
        watcher = house.spawn("pokeysctl", "-r", house.runtime, "events", "-f", log="watch.log")
        wait_for("what has been", lambda: "mill: running" in house.log("watch.log"))
        equal(end(daemon), 0)
        wait_for("its end", lambda: "pokeysctl: mill: no daemon in" in house.log("watch.log"))
        equal((watcher.poll(), end(watcher, signal.SIGTERM)), (None, 0))


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
