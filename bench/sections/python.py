# SPDX-License-Identifier: GPL-2.0-or-later
"""What reading costs a program in Python."""
import os
import pathlib
import sys

from figures import Figure, middle, ratios, table, total

TITLE = "Reading in Python"
SECONDS = 20
BATCHES = 20
READER = pathlib.Path(__file__).resolve().parents[1] / "reader.py"
WHAT = {"now": "one value, read now", "attribute": "one more value of a state that was read",
        "whole": "all values, read now, as a dict"}


def measure(bench):
    bench.start_simulator()
    bench.start_daemon({}, {})
    os.environ["POKEYS_SHM_LIBRARY"] = str(bench.build / "shm/libpokeys_shm.so.0")
    return [bench.output(sys.executable, "-B", READER, bench.run / "pokeysd", bench.device, BATCHES)
            for _ in bench.turns("python")]


def figures(runs):
    rows = []
    for name, text in WHAT.items():
        value, low, high = middle(runs, name, "p50_ns")
        rows.append(Figure(text, value / 1000, "us", total(runs, name, "samples"), low / 1000, high / 1000,
                           100 if name == "whole" else 2, f"Python: {text}"))
    return rows


def report(runs):
    rows = []
    for name, text in {"plain": "pokeys_client_read() through plain ctypes", **WHAT}.items():
        value, low, high = middle(runs, name, "p50_ns")
        ratio = ratios([run[name] for run in runs], [run["plain"] for run in runs], "p50_ns")
        rows.append((text, f"{value / 1000:.2f}", f"{low / 1000:.2f} to {high / 1000:.2f}", f"{ratio[0]:.1f}"))
    return table(("what", "p50 us", "95 % interval", "ratio to plain ctypes"), rows)
