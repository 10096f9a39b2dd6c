#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measure, contenders side by side in one run, and write report.md and report.json.

Never judges: on a virtual machine with two cores medians and ratios mean
something, maxima do not. Contenders take turns in rounds, so that a drift of
the machine's speed touches all of them.
"""
import argparse
import json
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import time

from rig import ADDRESS, Fault, Rig

ROUNDS, CYCLES, PERIOD_US = 3, 3000, 1000
HAL_SECONDS = 5.0
CLIENTS = {"blocking": "sendto, select, recvfrom, one after the other (as the vendor's library)",
           "sleeping": "both at once, poll, recv", "spinning": "both at once, recv in a tight loop"}
DAEMONS = {"sleep": "pokeysd, mode sleep", "spin": "pokeysd, mode spin"}


def us(nanoseconds):
    return f"{nanoseconds / 1000:.1f}"


class Bench(Rig):
    def __init__(self, build):
        super().__init__(build, "bench")
        cpus = sorted(os.sched_getaffinity(0))
        self.cpu_sim, self.cpu_client = cpus[0], cpus[-1]

    def output(self, *command):
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
        if done.returncode:
            raise Fault(f"{pathlib.Path(command[0]).name}: {done.stderr.strip() or done.returncode}")
        return json.loads(done.stdout)

    def client(self, mode):
        return self.output(self.build / "bench/bench-client", ADDRESS, 20055, mode, CYCLES, PERIOD_US,
                           self.cpu_client)

    def thread_ns(self):
        """Processor time of the daemon's busiest thread, which is the realtime one."""
        tasks = pathlib.Path(f"/proc/{self.started['pokeysd'].pid}/task").iterdir()
        return max(int((task / "schedstat").read_text().split()[0]) for task in tasks)

    def daemon(self, mode):
        self.start_daemon({"mode": mode, "cpu": self.cpu_client, "period-us": PERIOD_US}, {})
        time.sleep(0.5)
        cycle, spent = self.status()["state"]["cycle"], self.thread_ns()
        result = self.output(self.build / "bench/bench-watch", self.run / "pokeysd", self.device, CYCLES)
        result["cpu_ns"] = (self.thread_ns() - spent) / (self.status()["state"]["cycle"] - cycle)
        self.stop("pokeysd")
        return result

    def round_trips(self):
        found = {name: [] for name in (*CLIENTS, *DAEMONS)}
        self.start_simulator("--spin", "--cpu", self.cpu_sim)
        for number in range(ROUNDS):
            print(f"bench: round trips, round {number + 1} of {ROUNDS}", flush=True)
            for name in CLIENTS:
                found[name].append(self.client(name))
            for name in DAEMONS:
                found[name].append(self.daemon(name))
        self.stop("pokeys-sim")
        (self.run / "sim.sock").unlink(missing_ok=True)
        return found

    def hal_age(self):
        print("bench: age at the HAL read", flush=True)
        self.start_simulator("--spin", "--cpu", self.cpu_sim)
        self.start_daemon({"cpu": self.cpu_client}, {})
        self.start_hal()
        reader = self.hal.component("bench")  # HAL lets only components read
        reader.ready()
        self.halcmd("start")
        self.wait_for("pokeys.0.connected", lambda: self.get("connected"), 10)
        ages, ticks = [], {"read": [], "write": []}
        end = time.monotonic() + HAL_SECONDS
        while time.monotonic() < end:
            ages.append(self.get("age-us") * 1000)
            for funct, found in ticks.items():
                found.append(self.get(f"{funct}.time"))
            time.sleep(0.001)
        reader.exit()
        ages.sort()
        return {"samples": len(ages), "p50_ns": ages[len(ages) // 2], "p99_ns": ages[len(ages) * 99 // 100],
                "read_ticks_p50": statistics.median(ticks["read"]),
                "write_ticks_p50": statistics.median(ticks["write"])}

    def measure(self):
        return {
            "machine": machine(),
            "round_trips": self.round_trips(),
            "exchange": {n: self.output(self.build / "bench/bench-exchange", n) for n in ("0", "4", "26")},
            "shared_memory": self.output(self.build / "bench/bench-shm", self.run / "shm"),
            "hal": self.hal_age(),
        }


def machine():
    info = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8")
    fields = dict(line.split(":", 1) for line in info.splitlines() if ":" in line)
    fields = {key.strip(): value.strip() for key, value in fields.items()}
    return {"processor": fields.get("model name", platform.machine()), "cores": os.cpu_count(),
            "mhz": float(fields.get("cpu MHz", 0)), "kernel": platform.release(),
            "virtual": "hypervisor" in fields.get("flags", ""),
            "date": time.strftime("%Y-%m-%d")}


def table(heads, rows):
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]


def middle(runs, *path):
    """Median over the rounds of one figure."""
    def pick(run):
        for key in path:
            run = run[key]
        return run
    return statistics.median(pick(run) for run in runs)


def report_round_trips(found):
    base = middle(found["spinning"], "both", "p50_ns")
    rows = []
    for name, text in {**CLIENTS, **DAEMONS}.items():
        runs = found[name]
        both = middle(runs, "both", "p50_ns")
        rows.append((text, us(middle(runs, "round_trip", "p50_ns")), us(both), f"{both / base:.2f}",
                     us(middle(runs, "both", "p99_ns")), us(middle(runs, "cpu_ns")),
                     sum(run["lost"] for run in runs)))
    return [f"## Round trip: 0xCC and pulse engine status, once every {PERIOD_US} µs", "",
            f"Same simulator (service time 0, spinning on the other core), {ROUNDS} rounds of {CYCLES} cycles"
            " each, medians of the rounds. A daemon's figures count from its tick.", "",
            *table(("contender", "round trip p50 µs", "both answers p50 µs", "ratio to spinning",
                    "both p99 µs", "processor µs a cycle", "lost"), rows), ""]


def report(found):
    m, shm, hal = found["machine"], found["shared_memory"], found["hal"]
    lines = ["# Measured", "",
             f"{m['processor']}, {m['cores']} cores{', a virtual machine' if m['virtual'] else ''},"
             f" Linux {m['kernel']}, {m['date']}. Maxima are not given: they mean nothing here.", ""]
    lines += report_round_trips(found["round_trips"])
    names = ("memcpy", "seqlock_write", "shm_write", "shm_loan", "seqlock_read", "shm_read")
    lines += [f"## Shared memory: one state image, {shm['bytes']} bytes", "",
              f"{shm['memcpy']['samples']} batches of 64, one thread, contenders in turn.", "",
              *table(("what", "p50 ns", "p99 ns", "ratio to memcpy"),
                     ((n.replace("_", " "), shm[n]["p50_ns"], shm[n]["p99_ns"],
                       f"{shm[n]['p50_ns'] / shm['memcpy']['p50_ns']:.2f}") for n in names)), ""]
    lines += ["## HAL component: exchange of read and write", "",
              "Without LinuxCNC; memcpy is of one state and one command image together.", "",
              *table(("encoders moving", "read p50 ns", "write p50 ns", "memcpy p50 ns"),
                     ((n, e["read"]["p50_ns"], e["write"]["p50_ns"], e["memcpy"]["p50_ns"])
                      for n, e in found["exchange"].items())), ""]
    ns = 1000 / m["mhz"] if m["mhz"] else 0
    lines += ["## In LinuxCNC (POSIX, not realtime here), servo thread 1 kHz, free-running", "",
              f"Age of the fast data at `pokeys.0.read`: p50 {us(hal['p50_ns'])} µs, p99 {us(hal['p99_ns'])} µs"
              f" ({hal['samples']} samples). `pokeys.0.read.time` p50 {hal['read_ticks_p50'] * ns:.0f} ns,"
              f" `pokeys.0.write.time` p50 {hal['write_ticks_p50'] * ns:.0f} ns.", ""]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", required=True)
    bench = Bench(parser.parse_args().build)
    folder = bench.build / "bench"
    try:
        found = bench.measure()
    except Fault as fault:
        print(f"bench: failed: {fault}", file=sys.stderr)
        return 1
    finally:
        bench.close()
    (folder / "report.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    (folder / "report.md").write_text(report(found), encoding="utf-8")
    print(report(found))
    print("bench: written to build/bench/report.md and report.json")
    return 0


if __name__ == "__main__":
    sys.exit(main())
