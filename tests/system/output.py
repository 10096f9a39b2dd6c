#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl output and pwm: a relay or a fan is tried without LinuxCNC, and is off again whatever becomes of the
program."""
import contextlib
import re
import signal
import sys

from house import House, end, equal, main, wait_for

OUTPUTS = "31-34"


@contextlib.contextmanager
def house_with_outputs(**keys):
    with House() as house:
        # a busy computer is late at times, and that would be a loss
        house.device_keys["mill"] |= {"digital-outputs": OUTPUTS, "safe-on": 34, "heartbeat-timeout-ms": 1000,
                                      "lost-after-ms": 5000, "failsafe-timeout-ms": 9000, **keys}
        sim = house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        yield house, sim


def hold(house, *words, seconds=600):
    """pokeysctl output, in the background."""
    return house.spawn("pokeysctl", "-r", house.runtime, "output", "mill", *words, "--for", seconds, log="ctl.log")


def latched(house, sim, *terminals):
    return [int("latch=1" in house.ask_sim(sim, "pin", terminal)) for terminal in terminals]


def become(house, sim, wanted):
    wait_for(f"outputs {wanted}", lambda: latched(house, sim, 31, 32, 33, 34) == wanted,
             say=lambda: (latched(house, sim, 31, 32, 33, 34), house.log("ctl.log"), house.log()))


def test_outputs_are_held_as_long_as_was_asked_for():
    with house_with_outputs() as (house, sim):
        become(house, sim, [0, 0, 0, 1])
        ran = hold(house, "31,33", "on", seconds=1)
        become(house, sim, [1, 0, 1, 1])
        equal(ran.wait(60), 0, house.log("ctl.log"))
        become(house, sim, [0, 0, 0, 1])
        equal(house.log("ctl.log"), "mill: terminals 31 and 33 on for 1 s; Ctrl-C ends it sooner\n")


def test_one_that_is_on_in_the_safe_state_can_be_switched_off():
    with house_with_outputs() as (house, sim):
        become(house, sim, [0, 0, 0, 1])
        ran = hold(house, "34", "off")
        become(house, sim, [0, 0, 0, 0])
        equal(end(ran, signal.SIGINT), 0, house.log("ctl.log"))
        become(house, sim, [0, 0, 0, 1])


def test_killed_or_stopped_they_go_to_the_safe_state():
    for number in (signal.SIGKILL, signal.SIGSTOP):
        with house_with_outputs() as (house, sim):
            become(house, sim, [0, 0, 0, 1])
            ran = hold(house, "31-33", "on")
            become(house, sim, [1, 1, 1, 1])
            wait_for("it to know", lambda: "on for 600 s" in house.log("ctl.log"), say=lambda: house.log("ctl.log"))
            ran.send_signal(number)
            become(house, sim, [0, 0, 0, 1])
            if number == signal.SIGSTOP:
                house.tells("no commander", "status")
                ran.send_signal(signal.SIGCONT)
                equal(ran.wait(60), 1)
                last = house.log("ctl.log").splitlines()[-1]
                assert "went to the safe state" in last or "do not follow any more" in last, last
                equal(latched(house, sim, 31, 32, 33, 34), [0, 0, 0, 1])


def test_one_that_the_safe_state_holds_is_put_back():
    with house_with_outputs(**{"safe-hold": 31}) as (house, sim):
        become(house, sim, [0, 0, 0, 1])
        ran = hold(house, "31", "on", seconds=1)
        become(house, sim, [1, 0, 0, 1])
        equal(ran.wait(60), 0, house.log("ctl.log"))
        become(house, sim, [0, 0, 0, 1])
        # ... and one that somebody has left on stays on while another is tried
        house.spawn("commander", house.runtime, "mill", 31, log="commander.log")
        become(house, sim, [1, 0, 0, 1])
        end(house.children[-1], signal.SIGKILL)
        equal(hold(house, "32", "on", seconds=0.5).wait(60), 0, house.log("ctl.log"))
        become(house, sim, [1, 0, 0, 1])


def test_a_daemon_that_dies_is_no_success():
    with house_with_outputs() as (house, sim):
        become(house, sim, [0, 0, 0, 1])
        ran = hold(house, "31", "on")
        wait_for("it to know", lambda: "on for 600 s" in house.log("ctl.log"), say=lambda: house.log("ctl.log"))
        end(next(child for child in house.children if "pokeysd" in str(child.args[0])), signal.SIGKILL)
        equal(ran.wait(60), 1)
        last = house.log("ctl.log").splitlines()[-1]
        assert "do not follow any more" in last or "pokeysd was away" in last, last


def test_the_next_one_may_command_again():
    # its end need not be concluded from its silence
    with house_with_outputs(**{"heartbeat-timeout-ms": 3000}) as (house, sim):
        for times, (terminal, number) in enumerate(((31, signal.SIGTERM), (32, signal.SIGHUP)), 1):
            ran = hold(house, terminal, "on")
            wait_for("it", lambda t=terminal: latched(house, sim, t) == [1], say=lambda: house.log("ctl.log"))
            wait_for("it to know", lambda: "on for 600 s" in house.log("ctl.log"), say=lambda: house.log("ctl.log"))
            equal(end(ran, number), 0, house.log("ctl.log"))
            wait_for("its end", lambda n=times: house.log().count("mill: the commander has ended") == n, say=house.log)
            become(house, sim, [0, 0, 0, 1])
        assert "heartbeat is" not in house.log(), house.log()


def pwm(house, sim):
    """Channels that are on, their period, and the duty of each in the device."""
    fields = dict(line.split("=") for line in house.ask_sim(sim, "pwm").splitlines() if "=" in line)
    on = int(fields["enabled"], 16)
    return on, int(fields["period"]), [int(fields[f"duty.{i}"]) for i in range(6) if on >> i & 1]


def become_pwm(house, sim, wanted):
    wait_for(f"PWM {wanted}", lambda: (pwm(house, sim)[0], pwm(house, sim)[2]) == wanted,
             say=lambda: (pwm(house, sim), house.log("ctl.log"), house.log()))


def hold_pwm(house, *words, seconds=600):
    return house.spawn("pokeysctl", "-r", house.runtime, "pwm", "mill", *words, "--for", seconds, log="ctl.log")


def test_a_pwm_output_is_held_at_its_duty():
    with house_with_outputs() as (house, sim):
        ran = hold_pwm(house, "17,20", "12.5 %", seconds=1)
        become_pwm(house, sim, (0b100100, [3125, 3125]))
        equal(ran.wait(60), 0, house.log("ctl.log"))
        become_pwm(house, sim, (0, []))
        equal(house.log("ctl.log"), "mill: terminals 17 and 20 at 12.5 % of 1000 Hz for 1 s; Ctrl-C ends it sooner\n")
        # the period that is set stays
        ran = hold_pwm(house, "20", "100")
        become_pwm(house, sim, (0b000100, [25000]))
        ran.send_signal(signal.SIGKILL)
        become_pwm(house, sim, (0, []))
        equal(pwm(house, sim)[1], 25000)


def test_what_cannot_be_pwm_is_told_in_one_line():
    with house_with_outputs() as (house, _):
        def refused(*words, status=1):
            ran = house.ctl("pwm", *words)
            equal((ran.returncode, ran.stdout, ran.stderr.count("\n")), (status, "", 1), ran.stderr)
            return ran.stderr
        told = refused("mill", "7,20,30", "50%")
        assert re.search(r"mill: terminals 7 and 30: no PWM output of a (\w+); pokeysctl terminals \1 lists them",
                         told), told
        for duty in ("101", "x", "50 % %", "nan", ""):
            assert "the duty is a percentage from 0 to 100" in refused("mill", "17", duty, status=64)
        assert "pwm needs a device, terminals, and a duty" in refused("mill", "17", status=64)
        assert "terminals are numbers from 1 to 55" in refused("mill", "pwm0", "5", status=64)


def test_a_pwm_output_that_follows_an_axis_is_refused():
    with house_with_outputs(**{"axes": 3, "axis.1.mode": "buffered", "synced-pwm": "on", "synced-pwm-axis": 1,
                               "synced-pwm-channel": 5}) as (house, sim):
        ran = house.says("pwm", "mill", "17", "50%", returncode=1, stdout="")
        equal(ran.stderr, "pokeysctl: mill: terminal 17: this PWM output follows axis 1; switch synced-pwm off in "
              "pokeysd.conf first\n")
        # another one is free
        ran = house.spawn("pokeysctl", "-r", house.runtime, "pwm", "mill", "20,17", "50%", log="ctl.log")
        equal((ran.wait(60), "follows axis 1" in house.log("ctl.log")), (1, True))
        ran = house.spawn("pokeysctl", "-r", house.runtime, "pwm", "mill", "20", "50%", "--for", 600, log="ctl2.log")
        wait_for("the other", lambda: "terminal 20 at 50 %" in house.log("ctl2.log"), say=lambda: house.log("ctl2.log"))
        equal(end(ran, signal.SIGINT), 0)


def test_what_cannot_be_is_told_in_one_line():
    with house_with_outputs() as (house, sim):
        def refused(*words, status=1):
            ran = house.ctl("output", *words)
            equal((ran.returncode, ran.stdout), (status, ""), ran.stderr)
            equal(ran.stderr.count("\n"), 1, ran.stderr)
            return ran.stderr
        assert "terminal 7: no digital output of this device; add it to digital-outputs in" in refused("mill", "7,31", "on")
        assert "the daemon has no device 'lathe'; it has: mill" in refused("lathe", "31", "on")
        for words in (("mill", "0", "on"), ("mill", "31-", "on"), ("mill", "56", "on"), ("mill", "33-31", "on"),
                      ("mill", "x", "on"), ("mill", "31,", "on")):
            assert "terminals are numbers from 1 to 55" in refused(*words, status=64)
        for words in (("mill",), ("mill", "31"), ("mill", "31", "up")):
            assert "output needs a device, terminals, and on or off" in refused(*words, status=64)
        house.spawn("commander", house.runtime, "mill", 32, log="commander.log")
        wait_for("the commander", lambda: "commanding" in house.log("commander.log"))
        assert re.search(r"another commander holds device 'mill': process \d+ \(commander\); end it first",
                         refused("mill", "31", "on"))
        become(house, sim, [0, 1, 0, 1])


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=3))
