#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The one who stands in front of LinuxCNC: its user interface, for first_cut.py.

Does what a machinist does, and looks at both ends meanwhile: at LinuxCNC over NML
and HAL, at the simulated machine over its control socket. Fails on where the
machine is, never on how fast.
"""
import itertools
import os
import pathlib
import signal
import subprocess
import sys
import time
import traceback

import hal
import linuxcnc

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
# pylint: disable=wrong-import-position
import gantry  # noqa: E402
import jogging  # noqa: E402
import lathe  # noqa: E402
import one_switch  # noqa: E402
import printer_bed  # noqa: E402
import restarts  # noqa: E402
import servo_mill  # noqa: E402
import track  # noqa: E402
import wires  # noqa: E402
from safety import safety, status  # noqa: E402

FOLDER = pathlib.Path(os.environ["MACHINIST_FOLDER"])
SIM = os.environ["MACHINIST_SIM"].split()
PORT = 20055
DRY_LOSES = "pokeys.0.engine.dry-loses-position"
HOME = ((-4000, 0), (-4000, 0), (4000, 0), (-2000, -2))  # bench.sim's edge, mill.ini's HOME_OFFSET
SHARED_HOME = ((-6000, 0), (-6000, 0), (6000, 0), (-2000, -2))  # where limit switches are home switches
DEVICE_HOME = [400, 400, -400, 0]  # device-homing.hal's HomePosition
SURFACE = -8000  # pulses: bench.sim's probe
END = {0: 30.125, 1: 41.7, 3: 45}  # first-cut.ngc's last position, in machine units; Z apart
END_Z = -5
RUNNING = 3  # link-state
BEHIND = 4  # feedback within which a switch shows
LOSSY = ("fault both loss 0.01", "fault both delay-us 0-2000")


class Machinist:
    def __init__(self):
        self.command, self.stat = linuxcnc.command(), linuxcnc.stat()
        self.errors = linuxcnc.error_channel()
        self.said = []
        self.report = open(FOLDER.parent / "report", "w", encoding="utf-8", buffering=1)
        ini = linuxcnc.ini(sys.argv[sys.argv.index("-ini") + 1])
        self.name = FOLDER.name
        self.joints = range(int(ini.find("KINS", "JOINTS")))
        self.scale = [float(ini.find(f"JOINT_{j}", "SCALE") or servo_mill.SCALE) for j in self.joints]
        self.device = os.environ["MACHINIST_DEVICE"], PORT
        self.motor = "servo" if self.name == "servo-mill" else "joint"

    def tell(self, text):
        print(text, file=self.report)

    def look(self):
        self.stat.poll()
        while (error := self.errors.poll()) is not None:
            self.said.append(error[1])
        return self.stat

    def until(self, what, test, limit=60):
        end = time.monotonic() + limit
        while not test(self.look()):
            assert time.monotonic() < end, f"{what}: not within {limit} s; LinuxCNC said {self.said}"
            time.sleep(0.01)

    def mode(self, mode):
        self.command.mode(mode)
        self.command.wait_complete()

    @staticmethod
    def sim(words):
        """A command to the simulator, its answer as a dict."""
        done = subprocess.run(SIM + words.split(), capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"simulator, {words}: {done.stderr}"
        return dict(line.split("=", 1) for line in done.stdout.split("\n") if "=" in line)

    def pulses(self):
        """The device's step counts; the axes must stand."""
        axes = [self.sim(f"axis {j}") for j in self.joints]
        return [int(axis["position"]) for axis in axes], [int(axis["machine"]) for axis in axes]

    def turns(self, axis):
        """Does the motor? The simulator names no speed for what is played from a buffer."""
        before = self.sim(f"axis {axis}")["machine"]
        time.sleep(0.1)
        return self.sim(f"axis {axis}")["machine"] != before

    def commanded(self):
        return [round(hal.get_value(f"joint.{j}.motor-pos-cmd") * self.scale[j]) for j in self.joints]

    def settled(self):
        """All axes stand where LinuxCNC has them, to the pulse; motors with an encoder nearly so."""
        if self.motor == "servo":
            servo_mill.settled(self)
            return
        self.until("the device where it was sent", lambda _: self.pulses()[0] == self.commanded(), 60)

    # ---- what a machinist does

    def switch_on(self):
        """A busy machine may be late just now, and trip: the operator resets it and tries again."""
        end = time.monotonic() + 60
        while not self.comes_on():
            assert time.monotonic() < end, f"the machine does not come on; LinuxCNC said {self.said}"

    def comes_on(self):
        if self.motor == "servo":
            servo_mill.reset(self)
        self.command.state(linuxcnc.STATE_ESTOP_RESET)
        if not self.within(20, lambda s: s.task_state != linuxcnc.STATE_ESTOP):
            return False
        self.command.state(linuxcnc.STATE_ON)
        return self.within(20, lambda s: s.task_state == linuxcnc.STATE_ON and
                           all(hal.get_value(f"pokeys.0.{self.motor}.{j:02}.enabled") for j in self.joints))

    def within(self, limit, test):
        end = time.monotonic() + limit
        while not test(self.look()):
            if time.monotonic() > end:
                return False
            time.sleep(0.01)
        return True

    def begin_homing(self):
        self.mode(linuxcnc.MODE_MANUAL)
        self.command.teleop_enable(0)
        self.command.wait_complete()
        self.command.unhome(-1)
        self.until("no joint homed", lambda s: not any(s.homed[j] for j in self.joints), 60)
        self.command.home(-1)

    def home(self):
        """A busy machine may be late meanwhile, and trip: it is reset and homed from the beginning.
        The later it stops, the farther it runs beyond the home switch, perhaps onto a limit switch."""
        end = time.monotonic() + 180
        while True:
            self.begin_homing()
            self.until("all joints homed", lambda s: self.all_homed() or s.task_state != linuxcnc.STATE_ON, 90)
            if self.all_homed():
                return
            assert time.monotonic() < end, f"switched off again and again: {self.said}"
            self.off_the_limit_switches()
            self.switch_on()

    def off_the_limit_switches(self):
        """As docs/first-cut.md says. An override ends with the jog, so one joint after the other;
        the ends of a gantry cannot be jogged before they are homed, and home from their switches."""
        for joint in self.joints:
            for end, speed in (("min_hard_limit", 15), ("max_hard_limit", -15)):
                if self.look().joint[joint][end]:
                    self.override_limits()
                    self.switch_on()
                    self.command.teleop_enable(0)
                    self.command.wait_complete()
                    self.command.jog(linuxcnc.JOG_INCREMENT, True, joint, speed, 10)
                    self.within(10, lambda s, j=joint, e=end: not s.joint[j][e])
                    self.within(10, lambda s, j=joint: s.joint[j]["inpos"])

    def all_homed(self):
        return all(self.stat.homed[j] for j in self.joints)

    def homes_at(self, name, places, near=0):
        """Each joint where its switch is: (its edge in pulses, HOME_OFFSET). LinuxCNC takes the
        first feedback that shows the switch beyond its edge. How far beyond depends on how fast
        it goes and how late it is told; between which two of the feedback the edge lies is recorded.
        Switches and positions come by packets of their own, so the switch may be a few behind."""
        _, feedback, _ = self.sampled(name, self.home)
        self.settled()
        for joint, (edge, offset) in enumerate(places):
            scale = self.scale[joint]
            seen = round((hal.get_value(f"joint.{joint}.motor-offset") + offset) * scale)
            went = [place for place, _ in itertools.groupby(round(place[joint] * scale) for place in feedback)]
            over = [went[i:i + BEHIND] for i in range(1, len(went))
                    if min(went[i - 1], went[i]) <= edge <= max(went[i - 1], went[i])]
            assert any(abs(seen - place) <= near for places in over for place in places), \
                f"joint {joint} homed at {seen} pulses, its switch is at {edge}, beyond which it was at {over}"
            self.tell(f"{name}: joint {joint} saw its switch at {seen} pulses, it is at {edge}")

    def run(self, programme="first-cut.ngc"):
        self.begin(programme)
        self.done()

    def begin(self, programme):
        self.mode(linuxcnc.MODE_AUTO)
        self.command.program_open(str(FOLDER / programme))
        self.command.wait_complete()
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        self.until("the programme begun", lambda s: s.interp_state != linuxcnc.INTERP_IDLE, 60)

    def done(self):
        self.until("the programme done", lambda s: s.interp_state == linuxcnc.INTERP_IDLE, 120)
        assert self.stat.task_state == linuxcnc.STATE_ON, f"switched off: {self.said}"

    def sampled(self, name, work):
        """Do some work while the sampler records every servo period; its path."""
        path = FOLDER.parent / f"{name}.samples"
        with subprocess.Popen(("halsampler", "-t", str(path)), stdin=subprocess.DEVNULL) as sampler:
            hal.set_p("sampler.0.enable", "1")
            try:
                work()
            finally:
                hal.set_p("sampler.0.enable", "0")
                self.until("the samples read", lambda _: not hal.get_value("sampler.0.curr-depth"))
                sampler.send_signal(signal.SIGINT)
        return track.read(path)

    def mdi(self, line):
        """Returns when task has taken it; before that, what it says is about the line before."""
        self.mode(linuxcnc.MODE_MDI)
        self.command.mdi(line)
        self.until(f"{line} taken", lambda s: s.echo_serial_number >= self.command.serial, 60)

    def move(self, line):
        """To the end of it."""
        self.mdi(line)
        self.until(f"{line} done", lambda s: s.inpos and s.interp_state == linuxcnc.INTERP_IDLE and
                   s.state == linuxcnc.RCS_DONE, 60)

    def override_limits(self):
        """As the box in Axis does."""
        self.mode(linuxcnc.MODE_MANUAL)
        self.command.override_limits()
        self.until("the limits overridden",
                   lambda _: hal.get_value("halui.joint.0.override-limits"), 60)

    def lossy(self):
        for words in LOSSY:
            self.sim(words)

    def lost(self):
        """Packets that the simulator has thrown away, each way."""
        stat = self.sim("stat")
        lost = [int(stat[f"link.{way}.lost"]) for way in ("request", "reply")]
        assert all(lost), "the line has lost nothing"
        return f"{lost[0]} requests and {lost[1]} replies were lost"

    def cable_in(self):
        """Not before the daemon has given the device up: what is given up is found anew."""
        self.until("the device lost", lambda _: hal.get_value("pokeys.0.link-state") != RUNNING)
        self.sim("silence 0")
        self.until("the connection back", lambda _: hal.get_value("pokeys.0.connected"))

    def stays(self, when, pulses, machine):
        """Nothing moves for a while: some hundred cycles, and ten looks."""
        begin, looks, end = hal.get_value("pokeys.0.cycle"), 0, time.monotonic() + 60
        while looks < 10 or hal.get_value("pokeys.0.cycle") - begin < 400:
            looks += 1
            self.look()
            assert time.monotonic() < end, "the daemon's cycles stand still"
            now = self.pulses()
            with safety():
                assert now == (pulses, machine), f"{when} it moves: {pulses} {machine} -> {now}"


def at_the_end(m):
    """first-cut.ngc's end in machine units, and every pulse of it."""
    m.settled()
    offset = [hal.get_value(f"joint.{j}.motor-offset") for j in m.joints]
    want = [round((({**END, 2: END_Z})[j] + offset[j]) * m.scale[j]) for j in m.joints]
    have, _ = m.pulses()
    assert have == want, f"the programme ends at {have} pulses, should be {want}"
    return have


def the_programme_runs(m, name):
    samples = m.sampled(name, m.run)
    have = at_the_end(m)
    m.look()
    # where the probe saw the work, by LinuxCNC's feedback at that moment
    assert m.stat.probe_tripped, "the probe has touched nothing"
    beyond = SURFACE / m.scale[2] - (m.stat.probed_position[2] + hal.get_value("joint.2.motor-offset"))
    # inputs and positions come by two packets: a late one makes it seem too early
    assert -1 < beyond < 5, f"the probe saw the work {beyond} mm behind its surface"
    for line in track.describe(samples):
        m.tell(f"{name}: {line}")
    m.tell(f"{name}: ends at {have} pulses; probe tripped {beyond:.4f} mm behind the surface")
    return have


def homing_finds_the_switches(m):
    m.switch_on()
    m.homes_at("homed", HOME)


def cable_out_stops_for_good(m):
    m.sim("fault off")
    target = 200
    m.mdi(f"G53 G1 F2400 X{target}")
    start = m.pulses()[0][0]
    m.until("the axis moving", lambda _: m.pulses()[0][0] > start + 4000, 60)
    m.said.clear()
    m.sim("silence 3600000")
    m.until("LinuxCNC stopped", lambda s: s.task_state == linuxcnc.STATE_ESTOP)
    assert hal.get_value("estop.fault-out") and hal.get_value("pokeys.0.stale"), "no fault is shown"
    assert hal.get_value("pokeys.0.emergency-stop"), "the device is not in emergency stop"
    m.until("a message for the operator", lambda _: any("no connection" in text for text in m.said))
    with safety():
        m.until("the axis standing", lambda _: not m.turns(0))
    stood, machine = m.pulses()
    with safety():
        assert stood[0] < (target - 5) * m.scale[0], f"it ran on to {stood[0]}"
    m.tell(f"cable out: the operator sees {[text.strip() for text in m.said]}, X stands at {stood[0]} pulses")
    m.stays("with the cable out", stood, machine)
    m.cable_in()
    m.stays("with the cable in again", stood, machine)
    m.command.state(linuxcnc.STATE_ON)          # without a reset: no
    m.stays("switched on without a reset", stood, machine)
    state = m.look().task_state
    with safety():
        assert state == linuxcnc.STATE_ESTOP, "it came on by itself"
    m.switch_on()
    m.stays("switched on", stood, machine)
    assert not any(m.look().homed[j] for j in m.joints), "positions are trusted after a lost connection"
    m.home()
    m.move("G53 G0 X30.125 Y41.7 Z-5 A45")
    m.tell(f"cable in: homed again, ends at {at_the_end(m)} pulses")


def a_restart_is_never_a_position(m):
    """The device is back at once, much sooner than PATIENCE, and counts from 0."""
    m.move("G53 G0 X80 Y20 Z-5 A10")
    m.settled()
    stood = m.look().joint_actual_position[:len(m.joints)]
    machine = m.pulses()[1]
    m.said.clear()
    m.sim("reboot keep-config")
    with safety():
        m.until("LinuxCNC stopped", lambda s: s.task_state == linuxcnc.STATE_ESTOP)
        m.until("no joint homed", lambda s: not any(s.homed[j] for j in m.joints))
        m.until("a message for the operator", lambda _: any("positions are lost" in text for text in m.said))
        now = m.look().joint_actual_position[:len(m.joints)]
        assert all(abs(a - b) < 0.01 for a, b in zip(now, stood)), f"positions jumped from {stood} to {now}"
    m.until("the device is back", lambda _: hal.get_value("pokeys.0.connected"))
    m.switch_on()
    after = m.pulses()[1]
    with safety():
        assert after == machine, f"it moved from {machine} to {after} as it was switched on"
        assert hal.get_value("pokeys.0.position-lost"), "nobody has homed it"
    m.home()
    assert not hal.get_value("pokeys.0.position-lost")
    m.move("G53 G0 X30.125 Y41.7 Z-5 A45")
    m.tell(f"restarted: the operator sees {[text.strip() for text in m.said]}, homed again")


def a_driver_error_unhomes(m):
    """Its motor has no current, whatever LinuxCNC's version does about that."""
    m.said.clear()
    m.mdi("G53 G1 X60 F120")
    m.until("X moving", lambda _: m.turns(0))
    m.sim("driver-error 0 1")
    with safety():
        m.until("LinuxCNC stopped", lambda s: s.task_state == linuxcnc.STATE_ESTOP)
        m.until("no joint homed", lambda s: not any(s.homed[j] for j in m.joints))
        m.until("the cause", lambda _: any("the driver of X has an error" in text for text in m.said))
    m.sim("driver-error 0 0")
    m.until("the error gone", lambda _: not hal.get_value("pokeys.0.joint.00.error"))
    m.switch_on()
    assert not any(m.look().homed[j] for j in m.joints), "positions are trusted after a driver's error"
    m.home()
    m.tell("a driver's error: stopped and unhomed, homed again")


def a_limit_switch_unhomes(m):
    """It stops moving axes without a ramp: their motors may have lost steps."""
    m.move("G53 G0 X20 Y20 Z-5 A10")
    m.said.clear()
    # a work may have said that its motors lose no steps
    loses = hal.get_value(DRY_LOSES)
    hal.set_p(DRY_LOSES, "1")
    m.sim(f"switch 0 plus {m.pulses()[1][0] + 4000} 2000000")
    m.mdi("G53 G1 X60 F1200")
    with safety():
        m.until("LinuxCNC stopped", lambda s: s.task_state != linuxcnc.STATE_ON)
        m.until("no joint homed", lambda s: not any(s.homed[j] for j in m.joints))
        m.until("X standing", lambda _: not m.turns(0))
        m.until("the cause", lambda _: any("limit switch" in text for text in m.said))
        m.until("what follows of it", lambda _: any("positions are lost" in text for text in m.said))
    hal.set_p(DRY_LOSES, str(int(loses)))
    m.sim("switch 0 plus 114000 2000000")
    m.until("off the switch", lambda _: not hal.get_value("joint.0.pos-lim-sw-in"))
    m.switch_on()
    m.home()
    m.tell(f"a limit switch: the operator sees {[text.strip() for text in m.said]}, homed again")


def the_operator_unhomes(m):
    """The emergency stop of LinuxCNC's own screen ends in the same state as every other."""
    assert m.all_homed()
    m.command.state(linuxcnc.STATE_ESTOP)
    with safety():
        m.until("no joint homed", lambda s: not any(s.homed[j] for j in m.joints))


def a_bouncing_probe_touches_once(m):
    """Its contact closes again as it is lifted off."""
    closed, apart = "-2000000 2000000", "-2000000 -8000"
    hal.set_p("touch.off-delay", "3600")
    for way, bounces in ((closed, True), (apart, False), (closed, True), (apart, False)):
        m.sim(f"probe 2 {way} no pin 4")
        m.until("the contact", lambda _, want=bounces: hal.get_value("touch.in") == want)
        m.until("the touch", lambda _: hal.get_value("motion.probe-input"))
    hal.set_p("touch.off-delay", "0.02")
    m.until("lifted off", lambda _: not hal.get_value("motion.probe-input"))


def first_cut(m):
    homing_finds_the_switches(m)
    a_bouncing_probe_touches_once(m)
    before = [p - k for p, k in zip(*m.pulses())]
    clean = the_programme_runs(m, "clean")
    m.lossy()
    lossy = the_programme_runs(m, "lossy")
    assert lossy == clean, f"1 % loss and 2 ms jitter move the end from {clean} to {lossy}"
    m.tell(f"lossy: same end to the pulse, though {m.lost()}")
    assert [p - k for p, k in zip(*m.pulses())] == before, "counts and machine have parted"
    cable_out_stops_for_good(m)
    a_restart_is_never_a_position(m)
    a_driver_error_unhomes(m)
    a_limit_switch_unhomes(m)
    the_operator_unhomes(m)


def lossy_cut(m):
    """The programme alone, over a bad wire."""
    m.switch_on()
    m.home()
    before = [p - k for p, k in zip(*m.pulses())]
    m.lossy()
    the_programme_runs(m, "lossy")
    assert [p - k for p, k in zip(*m.pulses())] == before, "counts and machine have parted"
    m.tell(f"lossy: exact to the pulse, though {m.lost()}")


def one_switch_is_home_and_limit(m):
    homing_finds_the_switches(m)
    one_switch.jogs_onto_the_switch(m, HOME[0][0])
    one_switch.homes_from_the_switch(m)
    m.move("G53 G0 X30.125 Y41.7 Z-5 A45")
    m.tell(f"one switch: homed from it, ends at {at_the_end(m)} pulses")


# ---- homing by the device: device-homing.hal


def the_device_homes(m, switches=HOME):
    m.home()
    m.settled()
    pulses, machine = m.pulses()
    assert pulses == DEVICE_HOME, f"homed at {pulses} pulses, HomePosition is {DEVICE_HOME}"
    for joint, (edge, _) in enumerate(switches):
        zero = machine[joint] - pulses[joint]
        # on the free side of its edge, as far as it runs on at the return speed
        assert abs(zero - edge) < 100, f"joint {joint}: zero is at {zero}, its switch at {edge}"
        m.until("LinuxCNC knows it", lambda s, j=joint: abs(
            s.joint_actual_position[j] - pulses[j] / m.scale[j]) < 0.01)
        m.tell(f"device homing: joint {joint}: zero at {zero} pulses, its switch at {edge}")
    assert int(m.sim("stat")["pe.21"]) >= 3, "it was not the device that homed"


def an_abort_stops_it(m):
    m.begin_homing()
    m.until("X searching", lambda _: m.sim("axis 0")["state"] == "12", 60)
    m.command.abort()
    m.until("homing ended", lambda s: not any(s.joint[j]["homing"] for j in m.joints), 60)
    with safety():
        m.until("the axis standing", lambda _: not m.turns(0))
    m.stays("after an abort", *m.pulses())
    assert not m.look().homed[0], "homed though it was aborted"
    m.tell(f"device homing: aborted, X stands at machine {m.pulses()[1][0]}")


def device_homing(m):
    m.switch_on()
    an_abort_stops_it(m)
    the_device_homes(m)
    m.move("G53 G1 F1800 X20 Y10 Z-5 A30")
    m.settled()
    assert m.pulses()[0] == [8000, 4000, -2000, 6000], m.pulses()
    m.lossy()
    the_device_homes(m)
    m.tell("device homing: the same with 1 % loss and 2 ms jitter")


def one_switch_for_the_device(m):
    m.switch_on()
    the_device_homes(m, SHARED_HOME)
    one_switch.jogs_onto_the_switch(m, SHARED_HOME[0][0])
    one_switch.homes_from_the_switch(m)
    the_device_homes(m, SHARED_HOME)


WORK = {"first_cut": first_cut, "lossy_cut": lossy_cut, "wires": lambda m: wires.all_wires(m, FOLDER),
        "undelayed": lambda m: wires.undelayed(m, FOLDER),
        "device_homing": device_homing,
        "one_switch": one_switch_is_home_and_limit, "one_switch_device_homing": one_switch_for_the_device,
        "jogging": jogging.jogging,
        "gantry": gantry.gantry, "lathe": lathe.lathe,
        "servo_mill": servo_mill.servo_mill, "printer_bed": printer_bed.printer_bed,
        "device_thread": lathe.device_thread, "restarts": restarts.restarts,
        "losses": restarts.losses, "dry": restarts.dry}


def main():
    component = hal.component("machinist")
    component.ready()
    machinist = Machinist()
    try:
        WORK[os.environ["MACHINIST_WORK"]](machinist)
        machinist.tell("the end")
        return 0
    except (AssertionError, OSError, RuntimeError, linuxcnc.error) as fault:
        machinist.tell(f"FAILED: {traceback.format_exc()}\nLinuxCNC said {machinist.said}")
        # LinuxCNC does not pass our exit status on, so the report carries it
        machinist.tell(f"status {status([fault])}")
        return 1


if __name__ == "__main__":
    sys.exit(main())
