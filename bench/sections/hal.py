# SPDX-License-Identifier: GPL-2.0-or-later
"""What a servo thread of LinuxCNC sees: age of the data, time of the functions."""
import statistics
import time

from figures import Figure, us

TITLE = "In LinuxCNC: servo thread of 1 kHz, free-running"
SECONDS = 12


def measure(bench):
    seconds = 1 if bench.quick else 5
    bench.start_fast_simulator()
    bench.start_daemon({"cpu": bench.cpu_client}, {})
    bench.start_hal()
    reader = bench.hal.component("bench")  # HAL lets only components read
    reader.ready()
    bench.halcmd("start")
    bench.wait_for("pokeys.0.connected", lambda: bench.get("connected"), 10)
    ages, ticks = [], {"read": [], "write": []}
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        ages.append(bench.get("age-us") * 1000)
        for funct, found in ticks.items():
            found.append(bench.get(f"{funct}.time"))
        time.sleep(0.001)
    reader.exit()
    ages.sort()
    return {"samples": len(ages), "p50_ns": ages[len(ages) // 2], "p99_ns": ages[len(ages) * 99 // 100],
            "read_ticks_p50": statistics.median(ticks["read"]),
            "write_ticks_p50": statistics.median(ticks["write"])}


def figures(found):
    return [Figure("age of the fast data at pokeys.0.read, p99", found["p99_ns"] / 1000, "µs", found["samples"])]


def report(found):
    return [f"POSIX threads. Age of the fast data at `pokeys.0.read`: p50 {us(found['p50_ns'])} µs,"
            f" p99 {us(found['p99_ns'])} µs ({found['samples']} samples). `pokeys.0.read.time` p50"
            f" {found['read_ticks_p50']:.0f} and `pokeys.0.write.time` p50 {found['write_ticks_p50']:.0f}"
            " ticks of the processor's counter."]
