# SPDX-License-Identifier: GPL-2.0-or-later
"""What the sections measure with: a rig (scripts/rig.py), a network, the programs of
this folder, and how long to measure."""
import contextlib
import json
import os
import pathlib
import subprocess
import time

from figures import Skip
from network import HERE, Network
from rig import Fault, Rig

PORT, PERIOD_US = 20055, 1000
UNAVAILABLE = 77  # status of a program of ours that lacks something; it says what


class Bench(Rig):
    def __init__(self, build, quick):
        super().__init__(build, "bench")
        cpus = sorted(os.sched_getaffinity(0))
        self.cpu_sim, self.cpu_client = cpus[0], cpus[-1]
        self.quick = quick
        self.rounds, self.cycles = (2, 300) if quick else (10, 500)
        self.network = Network()
        self.address, self.there = self.network.device, self.network.there
        self.interface = self.network.interface
        self.here = HERE
        self.section_end = None  # no further round begins after it

    def say(self, text):
        print(f"bench: {text}", flush=True)

    def turns(self, what, rounds=None):
        """The rounds, one after the other, said; fewer where the section's time is over."""
        rounds = rounds or self.rounds
        for number in range(rounds):
            if number and self.section_end and time.monotonic() > self.section_end:
                self.say(f"{what}: its time is over after {number} of {rounds} rounds")
                return
            self.say(f"{what}, round {number + 1} of {rounds}")
            yield number

    def contests(self, what, order, rounds=None):
        """Rounds of contenders: those that are compared stand beside one another in `order`, for
        a shared machine is another one some seconds later; every second round runs backwards."""
        for number in self.turns(what, rounds):
            yield from order if number % 2 == 0 else order[::-1]

    def output(self, *command):
        """What a program of ours prints as JSON. Skip with its reason if it lacks something."""
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
        if done.returncode == UNAVAILABLE:
            raise Skip(done.stderr.strip().splitlines()[-1])
        if done.returncode:
            raise Fault(f"{pathlib.Path(command[0]).name}: {done.stderr.strip() or done.returncode}")
        return json.loads(done.stdout)

    def program(self, name, *words):
        return self.output(self.build / "bench" / f"bench-{name}", *words)

    def client(self, way, questions="fast", cycles=None):
        """One of the ways of bench/client*.c; `questions` are "fast" or "all"."""
        return self.program("client", self.address, PORT, way, questions, cycles or self.cycles,
                            PERIOD_US, self.cpu_client)

    @contextlib.contextmanager
    def polled_interface(self):
        """Packets of our interface have a NAPI id meanwhile, as those of a network card have."""
        command = [self.build / "bench/bench-client", self.address, str(PORT), "hold"]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True) as child:
            if child.stdout.readline().strip() != "held":
                raise Skip(child.stderr.read().strip())
            try:
                yield
            finally:
                child.stdin.close()

    def start_fast_simulator(self, *options):
        """One that never sleeps, on a core of its own: what is measured is not the device."""
        self.start_simulator("--spin", "--cpu", self.cpu_sim, *options)
        self.prefer("pokeys-sim")

    def start_servo_thread(self):
        """LinuxCNC's HAL with a device in a thread of 1 kHz that runs, and a component that may read it."""
        self.start_fast_simulator()
        self.start_daemon({"cpu": self.cpu_client}, {})
        self.start_hal()
        reader = self.hal.component("bench")  # HAL lets only components read
        reader.ready()
        self.halcmd("start")
        self.wait_for("pokeys.0.connected", lambda: self.get("connected"), 10)
        return reader

    def prefer(self, name):
        """The first of its core, where that is permitted."""
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, self.started[name].pid, -20)

    def thread_ns(self):
        """Processor time of the daemon's busiest thread, which is the realtime one."""
        tasks = pathlib.Path(f"/proc/{self.started['pokeysd'].pid}/task").iterdir()
        return max(int((task / "schedstat").read_text().split()[0]) for task in tasks)

    def watch(self, cycles=None, device=None, words=()):
        """The daemon that runs, watched cycle by cycle; with processor time a cycle."""
        device = device or self.device
        cycle, spent = self.status(device)["state"]["cycle"], self.thread_ns()
        result = self.program("watch", self.run / "pokeysd", device, cycles or self.cycles, *words)
        result["cpu_ns"] = (self.thread_ns() - spent) / (self.status(device)["state"]["cycle"] - cycle)
        return result

    def daemon(self, device=None, cycles=None, **keys):
        """A daemon with these keys of [daemon] and [device], watched, and ended again."""
        keys = {name.replace("_", "-"): value for name, value in keys.items()}
        self.start_daemon({"cpu": self.cpu_client, "period-us": PERIOD_US, **keys}, device or {})
        result = self.watch(cycles)
        self.stop("pokeysd")
        return result

    def end_all(self):
        """Everything that a section started."""
        self.end_hal()
        for name in reversed(list(self.started)):
            self.stop(name)

    def close(self):
        super().close()
        self.network.close()
