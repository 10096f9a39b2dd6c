#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The whole way of the data, live, without hardware.

Starts the simulator, the daemon and LinuxCNC's HAL with pokeys_shm; drives an
axis, a servo motor, an output and a heater through pins; shows what comes back;
judges it; ends with one line and a status. Started by scripts/demo, inside its
isolation.

/usr/bin/python3 because LinuxCNC's Python module belongs to Debian's Python.
"""
import argparse
import errno
import math
import os
import signal
import sys
import time

from rig import PATIENCE_S, Fault, Rig

SCALE = 200.0  # pulses per millimetre
COUNTS = 1.0  # encoder counts per pulse, as the simulator's preset couples them
STROKE = 20.0  # mm
MOVE_S = 4.0  # one way there and back
REST = 5.0  # mm, where it ends
BEHIND = 5.0  # mm; the median distance of the axis to its command must not exceed this
# HAL numbers: the preset wires terminal 31 to terminal 9. An output that is on
# pulls its terminal low (protocol section 3.3), so the input is its inverse.
OUT_PIN, IN_PIN = 30, f"pin.{8:02}.in-not"
HOT = 40.0  # degrees C; where the simulated hot end is within ten seconds
HEATER_PIN, HEATER_PWM = 44, 1
# terminals for the motor's encoder, direction and enable wire
MOTOR, MOTOR_PWM, MOTOR_ENCODER, MOTOR_DIRECTION, MOTOR_ENABLE = 4, 0, (23, 24), 36, 37
# a screw of 5 mm on the simulator's motor; generous, so that a machine that stops for a moment does not stop the motor
SERVO = {"encoder": MOTOR, "counts-per-unit": 400, "pwm": MOTOR_PWM, "direction-pin": MOTOR_DIRECTION,
         "enable-pin": MOTOR_ENABLE, "max-speed": 100, "impossible-speed": 9000, "pid-p": 1, "pid-i": 10, "pid-d": 0.01,
         "velocity-gain": 0.0026, "smooth-s": 0.001, "min-following-error": 20, "max-following-error": 40,
         "max-age-ms": 100, "stall-s": 3, "silent-s": 1, "runaway-distance": 50}
OFF = 0.1  # mm; as near is the motor to its command in the end
STEP = 0.5  # mm; its command changes by no more at once
# what the daemon's log says where it withdraws the permission to move
WITHDREW = "lost (was", "safe state", "heartbeat is", "stopped by"


def say(text, end="\n"):
    """A Fault if it cannot be written, and then nothing more can be."""
    try:
        print(text, end=end, flush=True)
    except OSError as why:
        raise Unwritten(f"standard output: {why.strerror}") from None


class Unwritten(Fault):
    pass


class Demo(Rig):
    done = False

    def __init__(self, build, seconds):
        super().__init__(build, "demo")
        self.seconds, self.pins, self.followed, self.cold_since = seconds, None, 0.0, 0.0
        self.stood_since, self.begin = 0.0, 0.0  # of the motor; its position less the path

    def start(self):
        cpus = sorted(os.sched_getaffinity(0))
        (records := self.run / "records").mkdir()
        (script := self.run / "bench").write_text(f"heat {HEATER_PIN} hotend pwm {HEATER_PWM}\n"
                                                  f"motor {MOTOR} sign {MOTOR_PWM} {MOTOR_DIRECTION} {MOTOR_ENABLE}\n")
        self.start_simulator("--service-us", "100", "--script", script)
        self.start_daemon({"record-folder": records, **({"cpu": cpus[-1]} if len(cpus) > 1 else {})},
                          {"digital-outputs": OUT_PIN + 1, "axes": 3, "axis.0.mode": "position", "pwm-period": 1250,
                           f"encoder.{MOTOR}.enable": "on", f"encoder.{MOTOR}.sampling": 4,
                           f"encoder.{MOTOR}.pins": "{}, {}".format(*MOTOR_ENCODER),
                           # long, so that a machine that stops for a second or two does not fail the demo
                           "heartbeat-timeout-ms": 20000, "lost-after-ms": 20000},
                          {"heater hotend": {"sensor-pin": HEATER_PIN, "sensor": "thermistor", "pwm": HEATER_PWM,
                                             "max-temperature": 280, "max-age-ms": 2000},
                           "servo motor": SERVO})
        self.start_hal("names=loops")
        self.make_pins()

    def make_pins(self):
        hal = self.hal
        self.pins = hal.component("demo")
        for name, kind in (("machine-on", hal.HAL_BIT), ("enable", hal.HAL_BIT),
                           ("out", hal.HAL_BIT), ("pos", hal.HAL_FLOAT), ("target", hal.HAL_FLOAT),
                           ("reset", hal.HAL_BIT), ("servo-on", hal.HAL_BIT), ("servo-pos", hal.HAL_FLOAT),
                           ("servo-reset", hal.HAL_BIT)):
            self.pins.newpin(name, kind, hal.HAL_OUT)
        self.pins.ready()
        self.halcmd("setp", "pokeys.0.joint.00.scale", str(SCALE))
        self.halcmd("setp", "pokeys.0.encoder.00.scale", str(SCALE * COUNTS))
        for pin, target in (("machine-on", "machine-is-on"), ("enable", "joint.00.enable"),
                            ("out", f"pin.{OUT_PIN:02}.out"), ("pos", "joint.00.pos-cmd"),
                            ("target", "heater.00.target"), ("reset", "heater.00.reset"),
                            ("servo-on", "servo.00.enable"), ("servo-pos", "servo.00.pos-cmd"),
                            ("servo-reset", "servo.00.reset")):
            self.halcmd("net", f"demo-{pin}", f"demo.{pin}", f"pokeys.0.{target}")
        self.halcmd("start")

    def enable(self):
        self.wait_for("pokeys.0.connected", lambda: self.get("connected"), PATIENCE_S)
        # or it is no edge: machine-on has to be seen off by the daemon first
        self.wait_for("pokeys.0.commander", lambda: self.get("commander"), PATIENCE_S)
        self.wait_for("the heater's temperature", lambda: self.get("heater.00.temperature") > 0, PATIENCE_S)
        self.pins["pos"] = self.get("joint.00.pos-fb")
        self.pins["enable"] = True
        self.pins["machine-on"] = True
        self.wait_for("pokeys.0.joint.00.enabled", lambda: self.get("joint.00.enabled"), PATIENCE_S)

    def permitted(self):
        """Motion that was withdrawn comes back by an operator only: nothing would move any more."""
        if self.get("needs-edge"):
            said = [line for line in (self.run / "pokeysd.log").read_text(errors="replace").splitlines()
                    if any(word in line for word in WITHDREW)]
            raise Fault("the daemon has withdrawn the permission to move; is this machine very busy? "
                        f"{said[-1] if said else self.log_tail('pokeysd')}")

    def line(self, elapsed, out):
        g = self.get
        return (f"{elapsed:5.1f} s  cmd {self.pins['pos']:7.3f} mm  pos {g('joint.00.pos-fb'):7.3f} mm"
                f"  motor {g('servo.00.pos-fb'):7.3f} mm  out {out:d} in-not {g(IN_PIN):d}"
                f"  heater {g('heater.00.temperature'):4.1f} C  age {g('age-us'):6.0f} us  rtt {g('rtt-us'):5.0f} us")

    def toggle(self, elapsed):
        """Toggle the output once a second, but not before the input that is wired to it has followed."""
        if self.get(IN_PIN) == self.pins["out"]:
            # at half seconds, so that the lines printed at whole seconds show each change
            self.pins["out"], self.followed = bool(int(elapsed + 0.5) % 2), time.monotonic()
        elif time.monotonic() - self.followed > PATIENCE_S:
            raise Fault(f"{IN_PIN} did not follow pin.{OUT_PIN}.out, which is wired to it, within {PATIENCE_S} s")

    def heat(self):
        """Heat. A heater that a busy computer has switched off needs a reset, and a target of 0 first."""
        now, fault = time.monotonic(), self.get("heater.00.fault")
        if fault or self.get("heater.00.condition"):
            self.cold_since = now
        self.pins["reset"] = fault
        self.pins["target"] = HOT if now - self.cold_since > 0.5 else 0.0

    def follow(self, path):
        """Let the motor follow the path. One that a busy computer has stopped needs a reset, off, and its own position."""
        now, pins = time.monotonic(), self.pins
        if self.get("servo.00.fault") or self.get("servo.00.condition"):
            self.stood_since = now
            pins["servo-on"] = False
        pins["servo-reset"] = bool(self.get("servo.00.fault"))
        if not pins["servo-on"]:
            pins["servo-pos"] = self.get("servo.00.pos-fb")
            self.begin = pins["servo-pos"] - path
            pins["servo-on"] = now - self.stood_since > 0.5
        pins["servo-pos"] += max(-STEP, min(STEP, self.begin + path - pins["servo-pos"]))

    def is_there(self):
        self.follow(self.pins["pos"])
        return (self.get("servo.00.enabled") and
                abs(self.get("servo.00.pos-fb") - self.begin - self.pins["pos"]) < OFF)

    def drive(self, seconds):
        """Drive the axis, which begins at 0, and the output. Yields the time since the start again and again."""
        self.followed = begin = time.monotonic()
        while (elapsed := time.monotonic() - begin) < seconds:
            self.permitted()
            self.pins["pos"] = STROKE / 2 * (1 - math.cos(2 * math.pi * elapsed / MOVE_S))
            self.toggle(elapsed)
            self.heat()
            self.follow(self.pins["pos"])
            yield elapsed
            time.sleep(0.002)

    def play(self):
        """Show what comes back; ages are sampled as often as this loop runs."""
        ages, behind = [], []
        shown = -1.0
        terminal = sys.stdout is not None and sys.stdout.isatty()
        for elapsed in self.drive(self.seconds):
            if not self.get("stale"):
                behind.append(abs(self.get("joint.00.pos-fb") - self.pins["pos"]))
            ages.append(self.get("age-us"))
            if elapsed - shown >= (0.1 if terminal else 1.0):
                shown = elapsed
                say(self.line(elapsed, self.pins["out"]), end="\r" if terminal else "\n")
        if terminal:
            say("")
        return ages, behind

    def go_to(self, target):
        """Move the axis to the target, exact to the pulse; how long it takes is not judged."""
        def arrived():
            self.permitted()
            return self.get("joint.00.in-position") and abs(self.get("joint.00.pos-fb") - target) < 0.5 / SCALE

        counts = round(target * SCALE * COUNTS)
        self.pins["pos"] = target
        self.wait_for(f"the axis coming to rest at {target} mm", arrived, PATIENCE_S)
        # the motor turns the encoder; its count may come one cycle later
        self.wait_for(f"the encoder's arrival at {counts} counts",
                      lambda: abs(self.get("encoder.00.count") - counts) <= COUNTS, PATIENCE_S)

    def is_hot(self):
        self.heat()
        return self.get("heater.00.at-temperature")

    def judge(self, ages, behind):
        """Judge what happened, not when: a busy machine may be late and still correct."""
        for target in (STROKE, REST):
            self.go_to(target)
        self.wait_for("the motor at its commanded position", self.is_there, PATIENCE_S)
        self.wait_for(f"the heater at {HOT} C", self.is_hot, PATIENCE_S)
        self.wait_for(f"{IN_PIN} following the output", lambda: self.get(IN_PIN) == self.pins["out"], PATIENCE_S)
        if not ages or not behind:
            raise Fault("no sample was taken while the data were fresh")
        # a pause of the whole machine raises the maximum, but not the median
        usual = sorted(behind)[len(behind) // 2]
        if usual > BEHIND:
            raise Fault(f"the axis was {usual:.3f} mm or more behind its command half of the time")
        status = self.status()
        state, latency = status["state"], status["diag"]["latency_us"]
        ages.sort()
        return (f"demo: ok cycles={state['cycle']} late={state['statistics']['late']}"
                f" lost={state['statistics']['lost']}"
                f" age_us_p50={ages[len(ages) // 2]:.0f} age_us_p99={ages[len(ages) * 99 // 100]:.0f}"
                f" rtt_us_p50={latency['fast_round_trip']['p50']:.0f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", required=True)
    parser.add_argument("--seconds", type=float, default=20)
    options = parser.parse_args()
    demo = Demo(options.build, options.seconds)

    def work():
        demo.start()
        demo.enable()
        say(f"PoKeys57CNC (simulated) -> pokeysd -> shared memory -> pokeys_shm, for {options.seconds:g} s")
        return demo.judge(*demo.play())
    return run(demo, work)


def run(demo, work):
    """The status. `work` returns the last line; a demo that is `done` has said it, and has none when it is interrupted."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    try:
        last, status = work(), 0
    except Fault as fault:
        last, status = f"demo: failed: {fault}", 1
    except KeyboardInterrupt:
        last, status = None if demo.done else "demo: interrupted", 130
    finally:
        demo.close()
    return end(last, status)


def end(last, status):
    """The last line and the status; a reader that has left needs no reason, any other gets one."""
    try:
        if last:
            say(last)
        return status
    except Unwritten as why:
        # or the interpreter tries once more, and complains in lines of its own
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if os.strerror(errno.EPIPE) not in str(why):
            print(f"demo: {why}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
