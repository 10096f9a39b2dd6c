# SPDX-License-Identifier: GPL-2.0-or-later
"""What LinuxCNC's servo thread notices of a client of pokeys-remote that sets pins as fast as it can."""
import json
import os
import pathlib
import statistics
import subprocess
import sys
import time

from figures import Figure, Skip, middle, ratios, table, total

TITLE = "pokeys-remote: the servo thread beside a client that sets pins without a pause"
SECONDS = 90
HERE = pathlib.Path(__file__).resolve().parents[1]
PROGRAM = "pokeys-remote"
WAYS = {"idle": "nobody sets anything", "busy": "two programs do the same with messages, and touch nothing of HAL",
        "storm": "a client sets 16 pins without a pause"}


def beside(bench, way, seconds):
    """The thread's time meanwhile."""
    pinned, python = ("taskset", "-c", bench.cpu_sim), (sys.executable, "-B")
    # of a storm, the client has a core, and pokeys-remote runs where it can
    storm = (*python, HERE / "storm.py", seconds)
    commands = {"idle": (), "busy": ((*pinned, *storm, "alone"), (*storm, "alone")), "storm": ((*pinned, *storm),)}[way]
    others = [subprocess.Popen([str(word) for word in words], stdout=subprocess.PIPE, text=True) for words in commands]
    ticks, end_at = [], time.monotonic() + seconds
    while time.monotonic() < end_at:
        ticks.append(bench.hal.get_value("servo-thread.time"))
        time.sleep(0.001)
    found = {"ticks_p50": statistics.median(ticks), "samples": len(ticks), "settings": 0, "seconds": seconds}
    for one in others:
        said, _ = one.communicate(timeout=30)
        if one.returncode:
            raise Skip("a program beside the thread has failed")
        if said:
            found["settings"] = json.loads(said)["settings"]
    return found


def measure(bench):
    try:
        import zmq  # noqa: F401
    except ImportError as error:
        raise Skip(f"{error}: pokeys-remote is not measured") from None
    os.environ |= {"PYTHONDONTWRITEBYTECODE": "1",
                   "PYTHONPATH": f"{HERE.parent / 'remote'}:{HERE.parent / 'python'}:{bench.build / 'remote'}"}
    reader = bench.start_servo_thread()
    bench.spawn(PROGRAM, HERE.parent / "remote/pokeys-remote")
    bench.wait_for(PROGRAM, lambda: bench.hal.component_exists(PROGRAM) and bench.hal.component_is_ready(PROGRAM), 20,
                   PROGRAM)
    found = {way: [] for way in WAYS}
    for way in bench.contests("the servo thread", tuple(WAYS)):
        found[way].append(beside(bench, way, 1 if bench.quick else 3))
    reader.exit()
    return found


def figures(found):
    rows = []
    for base, text, most, readme in (
            ("busy", "the same work without HAL", 1.1,
             "pokeys-remote: time of the servo thread beside a storm of settings, ratio to the same work without HAL"),
            ("idle", "an idle computer", None, "")):
        value, low, high = ratios(found["storm"], found[base], "ticks_p50")
        rows.append(Figure(f"servo thread beside a storm of settings: ratio to {text}", value, "",
                           total(found["storm"], "samples"), low, high, most, readme))
    return rows


def report(found):
    rate = total(found["storm"], "settings") / total(found["storm"], "seconds")
    return [f"POSIX threads; `pokeys.0.read` and `pokeys.0.write` are in the thread. The thread has no core"
            " of its own, so whatever computes beside it costs it time. The client shares a core with the"
            f" simulator. It sets 16 pins at once, {rate:.0f} times a second.", "",
            *table(("meanwhile", "servo-thread.time p50, ticks", "samples"),
                   [(text, f"{middle(found[way], 'ticks_p50')[0]:.0f}", total(found[way], "samples"))
                    for way, text in WAYS.items()])]
