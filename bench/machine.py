# SPDX-License-Identifier: GPL-2.0-or-later
"""What was measured on: figures without it mean nothing."""
import os
import pathlib
import platform
import time


def text_of(path):
    try:
        return pathlib.Path(path).read_text(encoding="utf-8").strip()
    except OSError:
        return ""


def processor():
    fields = dict(line.split(":", 1) for line in text_of("/proc/cpuinfo").splitlines() if ":" in line)
    return {key.strip(): value.strip() for key, value in fields.items()}


def machine():
    fields = processor()
    return {"processor": fields.get("model name", platform.machine()), "cores": os.cpu_count(),
            "mhz": float(fields.get("cpu MHz", 0)), "kernel": platform.release(),
            "version": platform.version(),
            "realtime": text_of("/sys/kernel/realtime") == "1",
            "isolated": text_of("/sys/devices/system/cpu/isolated"),
            "virtual": "hypervisor" in fields.get("flags", "").split(),
            "load": os.getloadavg()[0],
            "date": time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime())}


def describe(m):
    kind = "a virtual machine" if m["virtual"] else "no virtual machine"
    realtime = "PREEMPT_RT" if m["realtime"] else "not PREEMPT_RT"
    isolated = f"cores {m['isolated']} isolated" if m["isolated"] else "no core isolated"
    return (f"{m['processor']}, {m['cores']} cores, {kind}; Linux {m['kernel']}, {realtime}, {isolated};"
            f" {m['date']}, load average {m['load']:.1f} before.")
