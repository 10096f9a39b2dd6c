#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl discover --config writes a pokeysd.conf that the daemon takes as it is, and with which it
changes no setting of the device. The devices are alone in a network of the test's own."""
import re
import sys

from house import House, equal, run, wait_for
from spaces import begin, ip

SERIAL = 54321


def draft(house, *options, status=0):
    """What is printed, and what is said besides."""
    out = run(house.programs["pokeysctl"], "discover", "--config", "--timeout", "500", "--address", house.address, *options)
    equal(out.returncode, status, out)
    return out.stdout, out.stderr


def sections(text):
    return re.findall(r"^\[(.*)\]$", text, re.MULTILINE)


def judged(house, text, *options):
    (house.folder / "draft.conf").write_text(text, encoding="utf-8")
    return run(house.programs["pokeysd"], "--check-config", "--config", house.folder / "draft.conf", *options)


def settings_change_nothing(preset):
    with House() as house:
        house.start_sim("--serial", SERIAL, "--preset", preset)
        text, said = draft(house)
        equal((sections(text), said), (["daemon", "device SimPoKeys57CNC"], ""), text)
        assert f"\nserial = {SERIAL}\n" in text and f"\naddress = {house.address}\n" in text, text
        equal(judged(house, text).returncode, 0, text)
        house.write_conf()
        text = text.replace("[daemon]\n", house.conf.read_text(encoding="utf-8").split("[device")[0])
        house.write_conf = lambda: house.conf.write_text(text, encoding="utf-8")
        house.start_daemon()
        house.wait_fresh("SimPoKeys57CNC")
        house.says("config", "diff", "SimPoKeys57CNC", returncode=0)
        written = re.findall(r"SimPoKeys57CNC: (.*) \(not saved in the device\)", house.log())
        assert set(written) <= {"failsafe configured"}, house.log()  # a net that pokeysd sets up by itself
        shown = house.ctl("config", "show", "SimPoKeys57CNC").stdout.splitlines()[2:]
        named = {line.removeprefix("; ").split(" = ")[0] for line in text.splitlines() if " = " in line}
        missing = [line for line in shown if not line.startswith(";") and line.split(" = ")[0] not in named]
        missing = [line for line in missing if not line.split(" = ")[0].endswith(("microsteps", "temperature-limit"))]
        equal(missing, [], text)


def test_a_mill():
    settings_change_nothing("demo")


def test_a_device_as_it_is_sold():
    settings_change_nothing("factory")


def test_a_machine_with_servo_motors():
    settings_change_nothing("servo-mill")


def test_two_of_one_name_and_their_network_card():
    with House() as house:
        house.start_sim("--serial", SERIAL, "--name", "Fräse (alt)")
        house.start_sim("--serial", SERIAL + 1, "--name", "Fräse (alt)", address="10.77.0.2")
        text, _ = draft(house, "--address", "10.77.0.2")
        names = [name.removeprefix("device ") for name in sections(text)[1:]]
        equal(len(set(names)), 2, text)
        assert all(re.fullmatch(r"[A-Za-z0-9_-]{1,31}", name) for name in names), names
        equal(judged(house, text).returncode, 0, text)


def test_a_device_of_another_type_is_left_out():
    with House() as house:
        house.start_sim("--serial", SERIAL, "--model", "56E")
        text, said = draft(house, status=1)
        assert f"{SERIAL} at {house.address}: pokeysd does not drive devices of this type" in said, said
        equal(sections(text), ["daemon"], text)
        assert f"; serial = {SERIAL}" in text, text


def test_nobody_is_found():
    with House() as house:
        text, said = draft(house, status=1)
        assert not text and "no device answered" in said, (text, said)


def test_config_is_an_option_of_its_own_here():
    with House() as house:
        house.start_sim("--serial", SERIAL)
        program = house.programs["pokeysctl"]
        out = run(program, "--timeout", "500", "--address", house.address, "discover", "--config")
        assert out.returncode == 0 and "[daemon]" in out.stdout, out
        out = run(program, "--config", "discover", "doctor")
        assert "--config: discover: No such file" in out.stderr, out
        out = run(program, "discover", "--config=x")
        assert out.returncode == 64 and "--config" in out.stderr, out
        out = run(program, "doctor", "--config")
        assert out.returncode == 64 and "--config" in out.stderr, out
        out = run(program, "discover", "--config", "x")
        assert out.returncode == 64 and "takes no argument: x" in out.stderr, out
        out = run(program, "discover", "--config", "--json", "--address", house.address)
        assert out.returncode == 64 and "--json" in out.stderr, out


def make_network():
    ip("link", "set", "lo", "up")
    ip("link", "add", "v0", "type", "veth", "peer", "name", "v1")
    ip("link", "set", "v1", "up")
    ip("address", "add", "10.77.0.2/24", "dev", "v0")
    ip("link", "set", "v0", "up")


if __name__ == "__main__":
    sys.exit(begin(make_network, sys.modules[__name__]))
