#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl config against a running daemon and a simulated device: what the
device has, what is wanted otherwise, applied from the file, saved."""
import json
import re
import signal
import sys

from house import House, main, run, wait_for


def started(house, **keys):
    house.device_keys["mill"] |= keys
    house.start_sim("--preset", "demo")
    daemon = house.start_daemon()
    house.wait_fresh("mill")
    wait_for("the settings", lambda: house.ctl("config", "show", "mill").returncode == 0)
    return daemon


def value(house, key):
    shown = house.ctl("config", "show", "mill").stdout
    found = re.search(rf"^{re.escape(key)} = (.*)$", shown, re.M)
    return found and found[1]


def no_difference(house):
    return house.ctl("config", "diff", "mill").returncode == 0


def test_what_is_shown_can_be_put_into_the_file():
    with House() as house:
        started(house)
        shown = house.ctl("config", "show", "mill")
        assert shown.returncode == 0 and not shown.stderr, shown
        assert shown.stdout.startswith("[device mill]\n"), shown.stdout
        assert value(house, "axis.0.max-speed"), shown.stdout
        copy = house.folder / "copy.conf"
        copy.write_text(shown.stdout.replace("[device mill]", f"[device mill]\naddress = {house.address}"))
        out = run(house.programs["pokeysd"], "--check-config", "--config", copy)
        assert out.returncode == 0, out.stderr + shown.stdout
        document = json.loads(house.ctl("config", "show", "mill", "--json").stdout)
        assert document["format"] == 1 and document["device"] == "mill"
        assert len(document["pin_functions"]) == 55
        assert document["settings"]["axis.0.max-speed"] == float(value(house, "axis.0.max-speed"))


def test_apply_reads_the_file_again_and_diff_tells_when_it_is_done():
    with House() as house:
        daemon = started(house, **{"axis.0.max-speed": 5000})
        wait_for("the first settings", lambda: value(house, "axis.0.max-speed") == "5000")
        house.device_keys["mill"] |= {"axis.0.max-speed": 7000, "digital-outputs": "31,32"}
        house.write_conf()
        out = house.ctl("config", "apply", "mill")
        assert out.returncode == 0 and "mill: the device has all that is wanted" in out.stdout, out
        assert value(house, "axis.0.max-speed") == "7000"
        assert "31" in value(house, "digital-outputs")
        diff = house.ctl("config", "diff", "mill")
        assert diff.returncode == 0 and not diff.stdout, diff
        assert json.loads(house.ctl("config", "diff", "mill", "--json").stdout)["differences"] == []
        # and the same by signal
        house.device_keys["mill"]["axis.0.max-speed"] = 8000
        house.write_conf()
        daemon.send_signal(signal.SIGHUP)
        wait_for("the third value", lambda: value(house, "axis.0.max-speed") == "8000")
        assert "1 of 1 devices get what it wants" in house.log()


def test_a_broken_file_changes_nothing_and_its_faults_come_back():
    with House() as house:
        daemon = started(house, **{"axis.0.max-speed": 5000})
        wait_for("the first settings", lambda: value(house, "axis.0.max-speed") == "5000")
        house.device_keys["mill"]["axis.0.max-speed"] = "999999"
        house.write_conf()
        out = house.ctl("config", "apply", "mill")
        assert out.returncode == 1 and not out.stdout, out
        assert f"{house.conf}:" in out.stderr and "axis.0.max-speed" in out.stderr, out.stderr
        assert "1..125000" in out.stderr, out.stderr
        daemon.send_signal(signal.SIGHUP)
        wait_for("the answer", lambda: "nothing was changed" in house.log())
        assert value(house, "axis.0.max-speed") == "5000"
        assert daemon.poll() is None


def test_save_keeps_the_settings_in_the_device():
    with House() as house:
        started(house)
        out = house.ctl("config", "save", "mill")
        assert out.returncode == 0 and "in its flash memory now" in out.stdout, out


def test_orders_of_a_device_that_is_away():
    with House() as house:
        house.start_daemon()
        out = house.ctl("config", "save", "mill")
        assert out.returncode == 1 and "mill: the device is away" in out.stderr, out
        out = house.ctl("config", "apply", "mill")
        assert out.returncode == 0 and "when it is back" in out.stdout, out
        out = house.ctl("config", "show", "mill")
        assert out.returncode == 1 and "have not been read" in out.stderr, out
        assert house.ctl("config", "diff", "mill").returncode == 2


def test_a_daemon_that_was_killed_is_followed_by_one_that_takes_orders():
    with House() as house:
        daemon = started(house)
        daemon.kill()
        daemon.wait()
        out = house.ctl("config", "save", "mill")
        assert out.returncode == 1 and "no daemon takes orders" in out.stderr, out
        house.start_daemon()
        house.wait_fresh("mill")
        wait_for("an order", lambda: house.ctl("config", "save", "mill").returncode == 0)


def test_the_socket_is_removed_at_a_clean_end():
    with House() as house:
        daemon = started(house)
        assert (house.runtime / "control").is_socket()
        assert (house.runtime / "control").stat().st_mode & 0o777 == 0o660
        daemon.send_signal(signal.SIGTERM)
        assert daemon.wait(10) == 0
        assert not (house.runtime / "control").exists()


def test_mistakes_are_told():
    with House() as house:
        started(house)
        for words in (["config"], ["config", "show"], ["config", "erase", "mill"], ["config", "show", "a", "b"]):
            out = house.ctl(*words)
            assert out.returncode == 64 and "usage: pokeysctl config" in out.stderr, out
        out = house.ctl("config", "show", "lathe")
        assert out.returncode == 1 and 'has no device "lathe"' in out.stderr, out
        out = house.ctl("config", "apply", "lathe")
        assert out.returncode == 1 and 'there is no device "lathe"' in out.stderr, out


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
