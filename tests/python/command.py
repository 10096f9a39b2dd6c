#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Commanding from Python: what is set happens in the device, and is over whatever becomes of the
program."""
import contextlib
import ctypes
import os
import pathlib
import signal
import struct
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(sys.argv[1]).parent))
from house import PATIENCE, House, end, equal, main, wait_equal, wait_for  # noqa: E402

from rig import PACKAGE, raises  # noqa: E402

import pokeys  # noqa: E402

ENABLED = 2     # servo.NN.state


@contextlib.contextmanager
def machine(*sim_words, servos=None, **keys):
    with House() as house:
        house.servo_keys = servos or {}
        house.device_keys["mill"] |= {"digital-outputs": "31-34", "safe-on": 34, "heartbeat-timeout-ms": 1000,
                                      "stale-after-ms": 4000, "lost-after-ms": 5000, "failsafe-timeout-ms": 9000, **keys}
        sim = house.start_sim(*sim_words)
        house.start_daemon()
        house.wait_fresh()
        become(house, sim, [0, 0, 0, 1])
        with pokeys.attach("mill", runtime=str(house.runtime), timeout=PATIENCE) as mill:
            yield house, sim, mill


def latched(house, sim):
    return [int("latch=1" in house.ask_sim(sim, "pin", terminal)) for terminal in (31, 32, 33, 34)]


def become(house, sim, wanted):
    wait_equal(f"outputs {wanted}", lambda: latched(house, sim), wanted)


def renewed(command, what, test):
    """Until test() is true, with a lease that is renewed meanwhile."""
    def tried():
        command.renew()
        return test()
    wait_for(what, tried)


class Slow:
    """A library whose daemon shows other heartbeats first, and then that it has seen the command."""

    def __init__(self):
        self.fast = self.cold = self
        self.reads, self.given_ns = 0, 0

    def pokeys_client_command(self, _client, _image):
        self.given_ns = time.monotonic_ns()
        return 0

    def pokeys_client_renew(self, _client):
        return 0

    def pokeys_client_read(self, _client, state):
        self.reads += 1
        names = pokeys._names
        alive, heartbeat = names.StateValues.commander_alive.offset, names.StateCommand.heartbeat.offset
        state[alive // 8] = bytes([1 << alive % 8])
        struct.pack_into("<Q", state, heartbeat, self.reads)
        written_ns = 0 if self.reads < 20 else self.given_ns - 1 if self.reads < 40 else time.monotonic_ns()
        struct.pack_into("<Q", state, names.STATE_COMMAND_TIME, written_ns)
        return 0


def test_what_is_seen_is_the_command_and_no_heartbeat_before_it():
    library = Slow()
    held = pokeys.commander._Held(library, ctypes.c_void_p(1), pokeys.commander.Lock(), "mill", 1000)
    held.begin()
    assert library.reads >= 40, library.reads
    library.reads = 0
    held.wait()
    assert library.reads >= 40, library.reads
    # axes and servo motors: those that are there, with numbers that fit
    held.change([], {7: pokeys.Axis(-5, 1, True)}, {5: pokeys.Servo(2.5, True)})
    before = bytes(held.image)
    for axes, servos, text in (({8: pokeys.Axis(0, 1, True)}, {}, "the numbers are 0 to 7"),
                               ({0: pokeys.Axis(1, 1, True)}, {-1: pokeys.Servo(0.0, True)}, "the numbers are 0 to 5"),
                               ({0: pokeys.Axis(1 << 31, 1, True)}, {}, "format requires")):
        with raises(ValueError, text):
            held.change([], axes, servos)
        equal(bytes(held.image), before)


def test_outputs_are_what_is_set_and_safe_at_the_end():
    with machine() as (house, sim, mill):
        with mill.command(lease=30) as command:
            command.pin[30].out = True
            become(house, sim, [1, 0, 0, 1])
            equal((command.pin[30].out, command.pin[31].out), (True, False))
            command.update({"pin.31.out": True, "pin.33.out": False})
            become(house, sim, [1, 1, 0, 0])
            command["pin.30.out"] = False
            become(house, sim, [0, 1, 0, 0])
            wait_for("it to be seen", lambda: mill.read(stale_ok=True).commander_alive and mill.read(stale_ok=True).pin[31].out_fb)
            # what cannot be changes nothing, of several nothing
            for wrong, kind, text in (({"pin.30.out": True, "pin.31.out": 1}, TypeError, "pin.31.out: 1 is not True or False"),
                                      ({"pin.30.out": True, "pwm.00.value": 1.5}, ValueError, "pwm.00.value: 1.5 is out of range; allowed: 0 to 1"),
                                      ({"pin.30.out": True, "PoNET.00.brightness": 256}, ValueError, "0 to 255"),
                                      ({"pin.30.out": True, "PoNET.00.out-0": 1 << 32}, ValueError, "0 to 4294967295"),
                                      ({"pin.30.out": True, "pin.03.out": True}, ValueError,
                                       "pin.03.out: terminal 4 is not a digital output of this device; add it to digital-outputs"),
                                      ({"pin.30.out": True, "pin.30.in": True}, KeyError,
                                       "no value named 'pin.30.in' can be commanded")):
                with raises(kind, text):
                    command.update(wrong)
                equal(command.pin[30].out, False)
            with raises(TypeError):
                command.pin[30].out = "on"
            command.renew()
            become(house, sim, [0, 1, 0, 0])
        become(house, sim, [0, 0, 0, 1])
        with raises(ValueError, "not commanded any more"):
            command.pin[30].out = True
        # and again
        with mill.command(lease=30) as command:
            command.pin[32].out = True
            become(house, sim, [0, 0, 1, 1])


def pwm(house, sim):
    fields = dict(line.split("=") for line in house.ask_sim(sim, "pwm").splitlines() if "=" in line)
    return int(fields["enabled"], 16), int(fields["period"]), int(fields["duty.0"])


def test_the_pwm_period_is_touched_only_by_who_wants_pwm():
    with machine() as (house, sim, mill):
        before = pwm(house, sim)
        with mill.command(lease=30) as command:
            command.pin[30].out = True
            become(house, sim, [1, 0, 0, 1])
            equal(pwm(house, sim), before)
            command.pwm[0].value = 0.25
            wait_equal("a quarter of 1 kHz", lambda: pwm(house, sim), (1, 25000, 6250))
            renewed(command, "it to be seen", lambda: abs(mill.read(stale_ok=True).pwm[0].duty - 0.25) < 1e-6)
        wait_equal("the end", lambda: pwm(house, sim)[0], 0)


def test_other_outputs_and_the_machine():
    with machine() as (house, sim, mill):
        with mill.command(lease=30) as command:
            command.external[0].out = True
            command.PoExtBus[79].out = True
            command.kbd48CNC[5].LED = True
            command.machine_is_on = True
            renewed(command, "they", lambda: mill.read(stale_ok=True).external[0].out_fb and mill.read(stale_ok=True).PoExtBus[79].in_ and
                    mill.read(stale_ok=True).machine_on_permitted)
            command.emergency_stop = True
            renewed(command, "the stop", lambda: not mill.read(stale_ok=True).machine_on_permitted)


class Late:
    """The library of a computer that is busy for a moment just before the machine, an axis or a motor is switched on;
    or just after, in which case something happens."""

    def __init__(self, library):
        self.fast, self.cold = library.fast, self
        self.real = library.cold
        self.late = True
        self.meanwhile = None

    def pokeys_client_renew(self, client):
        return self.real.pokeys_client_renew(client)

    def pokeys_client_command(self, client, image):
        names = pokeys._names
        axis = int.from_bytes(image[names.COMMAND_AXES + 9:names.COMMAND_AXES + 10])
        servo = int.from_bytes(image[names.COMMAND_SERVOS + 12:names.COMMAND_SERVOS + 13])
        machine = names.CommandValues.machine_is_on.offset
        late = self.late and (axis or servo or image[machine // 8][0] >> machine % 8 & 1)
        if late:
            self.late = False
            time.sleep(0 if self.meanwhile else 0.3)
        result = self.real.pokeys_client_command(client, image)
        if late and self.meanwhile:
            self.meanwhile()
        return result


def test_what_is_switched_on_by_old_positions_is_switched_on_again():
    axis = {"mode": "position", "max-speed": 20000, "max-acceleration": 200000, "limit-minus": "off", "limit-plus": "off"}
    with machine(axes=1, generator="external", **{f"axis.0.{key}": value for key, value in axis.items()}) as (
            house, _, mill), mill.command(lease=30) as command:
        held = command._image
        held._library = late = Late(held._library)
        command.machine_is_on = True
        equal((late.late, mill.read(stale_ok=True).machine_on_permitted), (False, True))
        late.late = True
        position = mill.read(stale_ok=True)["joint.00.counts"]
        command.update({}, axes={0: pokeys.Axis(position, 1, True)})
        renewed(command, "the axis", lambda: mill.read(stale_ok=True)["joint.00.enabled"])
        equal(late.late, False)
        # both had been refused; what is refused for another reason is not tried again
        refused = "positions known to the commander are"
        wait_for("the event", lambda: refused in house.log("pokeysd.log"))
        times = house.log("pokeysd.log").count(refused)
        command.emergency_stop = True
        renewed(command, "the stop", lambda: not mill.read(stale_ok=True).machine_on_permitted)
        command.machine_is_on = False
        command.machine_is_on = True
        equal(mill.read(stale_ok=True).machine_on_permitted, False)
        equal(house.log("pokeysd.log").count(refused), times)


def test_a_motor_that_is_switched_on_by_old_positions_is_switched_on_again():
    motor = {"encoder": 0, "pwm": 0, "direction-pin": 31, "enable-pin": 35, "counts-per-unit": 400, "max-speed": 300,
             "pid-p": 1, "max-age-ms": 100}
    with machine("--preset", "servo-mill", servos={"x": motor}, **{
            "digital-outputs": "32-34", "failsafe-timeout-ms": 1000, "pwm-period": 1250, "encoder.0.enable": "on", "encoder.0.pins": "1, 2",
            "encoder.0.sampling": 4}) as (_, _, mill), mill.command(lease=30) as command:
        wait_for("it", lambda: mill.read(stale_ok=True)["servo.00.condition"] == 0)
        position = mill.read(stale_ok=True)["servo.00.pos-fb"]
        command.update({}, servos={0: pokeys.Servo(position, False)})
        command.wait()
        held = command._image
        held._library = late = Late(held._library)
        command.update({}, servos={0: pokeys.Servo(position, True)})
        renewed(command, "the motor", lambda: mill.read(stale_ok=True)["servo.00.state"] == ENABLED)
        equal(late.late, False)


def test_what_a_loss_has_ended_is_not_switched_on_again():
    axis = {"mode": "position", "max-speed": 20000, "max-acceleration": 200000, "limit-minus": "off", "limit-plus": "off"}
    with machine(axes=1, generator="external", **{
            "stale-after-ms": 1000, "lost-after-ms": 2000, **{f"axis.0.{key}": value for key, value in axis.items()}}) as (
            house, sim, mill), mill.command(lease=60) as command:
        held = command._image
        held._library = late = Late(held._library)

        def cable_out():
            """It is over before the library looks again, which is more than 100 ms after it had looked last."""
            wait_for("the axis", lambda: mill.read(stale_ok=True)["joint.00.enabled"])
            sim.send_signal(signal.SIGSTOP)
            wait_for("the loss", lambda: not mill.read(stale_ok=True).machine_on_permitted)
            sim.send_signal(signal.SIGCONT)
            wait_for("the device", lambda: mill.read(stale_ok=True).connected)
        late.meanwhile = cable_out
        begun, pokeys.commander.RISE_S = pokeys.commander.RISE_S, 2 * PATIENCE
        try:
            command.update({"machine-is-on": True},
                           axes={0: pokeys.Axis(mill.read(stale_ok=True)["joint.00.counts"], 1, True)})
        finally:
            pokeys.commander.RISE_S = begun
        state = mill.read(stale_ok=True)
        equal((late.late, state.machine_on_permitted, state["joint.00.enabled"]), (False, False, False))
        command.machine_is_on = False
        command.machine_is_on = True
        renewed(command, "the permission", lambda: mill.read(stale_ok=True).machine_on_permitted)
        # the one that was withdrawn, and the one that was asked for now
        wait_equal("two", lambda: house.log("pokeysd.log").count("motion is permitted"), 2)


def test_a_lease_that_runs_out_is_told():
    with machine() as (house, sim, mill):
        with mill.command(lease=2) as command:
            command.machine_is_on = True
            command.pin[33].out = False
            command.pin[30].out = True
            renewed(command, "they", lambda: latched(house, sim) == [1, 0, 0, 0])
            # it hangs for longer than that: the daemon lets go
            wait_for("the end of the lease", lambda: not mill.read(stale_ok=True).commander_alive and
                     mill.read(stale_ok=True).safe_state)
            become(house, sim, [0, 0, 0, 1])
            for _ in range(2):
                with raises(pokeys.Lapsed, "safe state"):
                    command.renew()
            equal(command.pin[30].out, False)
            # it may go on, if it wants to, and begins with nothing
            command.pin[31].out = True
            renewed(command, "the daemon to hold them", lambda: mill.read(stale_ok=True).outputs_held)
            command.machine_is_on = True
            renewed(command, "the output", lambda: latched(house, sim) == [0, 1, 0, 1])
            # off and on again at once is an edge as well
            command.emergency_stop = True
            renewed(command, "the stop", lambda: not mill.read(stale_ok=True).machine_on_permitted)
            command.emergency_stop = False
            command.machine_is_on = False
            command.machine_is_on = True
            renewed(command, "the permission", lambda: mill.read(stale_ok=True).machine_on_permitted)


class Blind:
    """The library, but renewing never says that the lease had run out."""

    def __init__(self, library):
        self.fast, self.cold = library.fast, self
        self.pokeys_client_command = library.cold.pokeys_client_command

    @staticmethod
    def pokeys_client_renew(_client):
        return 0


def test_a_lease_that_runs_out_at_the_last_moment_commands_nothing():
    with machine() as (house, sim, mill):
        with mill.command(lease=1) as command:
            command.pin[30].out = True
            wait_for("the end of the lease", lambda: not mill.read(stale_ok=True).commander_alive)
            command._image._library = Blind(command._image._library)  # pylint: disable=protected-access
            with raises(pokeys.Lapsed, "safe state"):
                command.pin[31].out = True
            equal((command.pin[30].out, command.pin[31].out), (False, False))
            wait_for("the command", lambda: mill.read(stale_ok=True).commander_alive)
            equal(latched(house, sim)[:2], [0, 0])
        # closed while it is lapsed: no crash
        with raises(ValueError, "not commanded any more"):
            command.pin[30].out = True
        with raises(ValueError, "not commanded any more"):
            command.renew()


def test_another_commander_is_named():
    with machine() as (house, sim, mill):
        other = house.spawn("pokeysctl", "-r", house.runtime, "output", "mill", "32", "on", "--for", 600, log="ctl.log")
        become(house, sim, [0, 1, 0, 1])
        with raises(pokeys.Refused, "(pokeysctl)"), mill.command():
            pass
        become(house, sim, [0, 1, 0, 1])
        end(other, signal.SIGINT)
        with mill.command(lease=30) as command:
            command.pin[30].out = True
            become(house, sim, [1, 0, 0, 1])
            with raises(pokeys.Refused, "another commander holds device 'mill'"), mill.command():
                pass
        for wrong in (0, 0.001, 61):
            with raises(ValueError, "lease"):
                mill.command(lease=wrong)


HOLDER = """
import sys, time
sys.path.insert(0, sys.argv[1])
import pokeys
with pokeys.attach("mill", runtime=sys.argv[2], timeout=30) as mill, mill.command(lease=2) as command:
    command.pin[30].out = True
    try:
        while True:
            command.renew()
            time.sleep(0.05)
    except pokeys.Lapsed as error:
        print("lapsed:", error, flush=True)
"""


def test_killed_stopped_or_hanging_it_is_safe():
    for number in (signal.SIGKILL, signal.SIGSTOP):
        with machine() as (house, sim, _mill):
            child = subprocess.Popen([sys.executable, "-B", "-c", HOLDER, PACKAGE, house.runtime],
                                     stdout=subprocess.PIPE, text=True)
            house.children.append(child)
            become(house, sim, [1, 0, 0, 1])
            child.send_signal(number)
            become(house, sim, [0, 0, 0, 1])
            if number == signal.SIGSTOP:
                time.sleep(2)   # longer than its lease, or it does not lapse
                child.send_signal(signal.SIGCONT)
                assert child.stdout.readline().startswith("lapsed: mill: the lease had run out"), "not told"
                equal(child.wait(PATIENCE), 0)
                become(house, sim, [0, 0, 0, 1])
            child.stdout.close()


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
