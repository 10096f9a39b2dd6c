#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl events: what the log says of the devices, for whoever may not read the log; also after the daemon has
died, and on over its restart."""
import datetime
import json
import re
import signal
import sys
import time

from house import House, end, equal, main, wait_for


LEVELS = {3: "error", 4: "warning", 5: "notice", 6: "info", 7: "debug"}


def rows(text):
    return [json.loads(line) for line in text.splitlines()]


def of_kind(house, kind, *words):
    return [row["text"] for row in rows(house.ctl("events", "--json", *words).stdout) if row["kind"] == kind]


def wait_link(house, link):
    """Until this is the last that was said of the link."""
    wait_for(link, lambda: of_kind(house, "link", "mill")[-1:] and of_kind(house, "link", "mill")[-1].startswith(link),
             say=lambda: house.ctl("events").stdout)


def test_events_are_those_of_the_log():
    with House() as house:
        sim = house.start_sim()
        before = time.time_ns()
        house.start_daemon()
        wait_link(house, "running")
        sim.kill()
        wait_link(house, "lost")
        found = rows(house.ctl("events", "--json").stdout)
        equal([row["number"] for row in found], list(range(1, len(found) + 1)))
        equal({row["device"] for row in found}, {"mill"})
        equal({row["format"] for row in found}, {1})
        log = house.log()
        for row in found:
            assert row["level"] == 7 or f"mill: {row['text']}" in log or f"\n{row['text']}" in log, (row, log)
            assert before <= row["time_ns"] <= time.time_ns(), row
            assert re.fullmatch("[a-z]+(-[a-z]+)*", row["kind"]), row
        lost = next(row for row in found if row["text"].startswith("lost"))
        equal((lost["kind"], "check power, cable and address" in lost["text"]), ("link", True))
        stamp = datetime.datetime.fromtimestamp(lost["time_ns"] // 1_000_000 / 1000).strftime("%Y-%m-%d %H:%M:%S.%f")
        printed = house.ctl("events", "mill")
        assert f"{stamp[:-3]}  {LEVELS[lost['level']]:7}  mill: {lost['text']}\n" in printed.stdout, (stamp, printed.stdout)
        equal((printed.returncode, printed.stderr), (0, ""))


def test_they_stay_when_the_daemon_has_died_and_go_on_with_the_next():
    with House() as house:
        house.start_sim()
        daemon = house.start_daemon()
        wait_link(house, "running")
        watcher = house.spawn("pokeysctl", "-r", house.runtime, "events", "--follow", "--json", log="watch.log")

        def watched():
            return [row for row in rows(house.log("watch.log")[:house.log("watch.log").rfind("\n") + 1])]
        wait_for("what has been", lambda: any(row["text"].startswith("running") for row in watched()))
        daemon.send_signal(signal.SIGKILL)
        daemon.wait()
        wait_link(house, "running")
        house.start_daemon(wait=False)
        epochs = {row["epoch"] for row in watched()}
        equal(len(epochs), 1)
        wait_for("the next daemon's", lambda: any(row["epoch"] not in epochs and row["text"].startswith("running")
                                                  for row in watched()))
        equal(len({(row["epoch"], row["number"]) for row in watched()}), len(watched()))
        equal(end(watcher, signal.SIGINT), 0)


def test_several_devices_are_told_apart_and_in_order():
    with House() as house:
        house.device_keys["lathe"] = {"address": "127.9.9.9"}
        house.start_sim()
        house.start_daemon()
        wait_link(house, "running")
        wait_for("the other's", lambda: house.ctl("events", "lathe").stdout)
        found = rows(house.ctl("events", "--json").stdout)
        equal({row["device"] for row in found}, {"mill", "lathe"})
        times = [row["monotonic_ns"] for row in found]
        equal(times, sorted(times))
        equal({row["device"] for row in rows(house.ctl("events", "lathe", "--json").stdout)}, {"lathe"})
        gone = house.ctl("events", "gantry")
        equal((gone.returncode, 'no device "gantry"; it has: mill, lathe' in gone.stderr), (1, True), gone.stderr)


def test_without_a_daemon_it_says_so():
    with House() as house:
        ran = house.ctl("events")
        equal((ran.returncode, ran.stdout, "no daemon runs in" in ran.stderr), (1, "", True), ran.stderr)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
