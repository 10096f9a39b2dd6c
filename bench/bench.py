# SPDX-License-Identifier: GPL-2.0-or-later
"""What the sections measure with: a rig (scripts/rig.py), the programs of this folder,
and how long to measure."""
import contextlib
import json
import os
import pathlib
import subprocess
import time

from rig import ADDRESS, Fault, Rig

PORT, PERIOD_US = 20055, 1000


class Bench(Rig):
    def __init__(self, build, quick):
        super().__init__(build, "bench")
        cpus = sorted(os.sched_getaffinity(0))
        self.cpu_sim, self.cpu_client = cpus[0], cpus[-1]
        self.quick = quick
        self.rounds, self.cycles = (2, 400) if quick else (5, 1200)

    def say(self, text):
        print(f"bench: {text}", flush=True)

    def turns(self, what):
        """The rounds, one after the other, said."""
        for number in range(self.rounds):
            self.say(f"{what}, round {number + 1} of {self.rounds}")
            yield number

    def output(self, *command):
        """What a program of ours prints as JSON."""
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
        if done.returncode:
            raise Fault(f"{pathlib.Path(command[0]).name}: {done.stderr.strip() or done.returncode}")
        return json.loads(done.stdout)

    def program(self, name, *words):
        return self.output(self.build / "bench" / f"bench-{name}", *words)

    def client(self, mode):
        return self.program("client", ADDRESS, PORT, mode, self.cycles, PERIOD_US, self.cpu_client)

    def start_fast_simulator(self, *options):
        """One that never sleeps, on a core of its own: what is measured is not the device."""
        self.start_simulator("--spin", "--cpu", self.cpu_sim, *options)
        with contextlib.suppress(OSError):  # as the first of its core, where that is permitted
            os.setpriority(os.PRIO_PROCESS, self.started["pokeys-sim"].pid, -20)

    def thread_ns(self):
        """Processor time of the daemon's busiest thread, which is the realtime one."""
        tasks = pathlib.Path(f"/proc/{self.started['pokeysd'].pid}/task").iterdir()
        return max(int((task / "schedstat").read_text().split()[0]) for task in tasks)

    def daemon(self, cycles, **keys):
        """A daemon with these keys of [daemon], watched cycle by cycle, and ended again."""
        self.start_daemon({"cpu": self.cpu_client, "period-us": PERIOD_US, **keys}, {})
        time.sleep(0.5)
        cycle, spent = self.status()["state"]["cycle"], self.thread_ns()
        result = self.program("watch", self.run / "pokeysd", self.device, cycles)
        result["cpu_ns"] = (self.thread_ns() - spent) / (self.status()["state"]["cycle"] - cycle)
        self.stop("pokeysd")
        return result

    def end_all(self):
        """Everything that a section started."""
        self.end_hal()
        for name in reversed(list(self.started)):
            self.stop(name)
        (self.run / "sim.sock").unlink(missing_ok=True)
