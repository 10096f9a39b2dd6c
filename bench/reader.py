# SPDX-License-Identifier: GPL-2.0-or-later
"""What reading costs in Python, beside the C library called through plain ctypes: prints JSON.

usage: reader.py RUNTIME-DIRECTORY DEVICE BATCHES  (POKEYS_SHM_LIBRARY names the library)
"""
import ctypes
import json
import os
import pathlib
import statistics
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "python"))
import pokeys  # noqa: E402
from pokeys import _names  # noqa: E402

CALLS = {"plain": 500, "now": 500, "attribute": 500, "whole": 50}


def plain(runtime, device):
    """The C function and nothing else."""
    library = ctypes.CDLL(os.environ["POKEYS_SHM_LIBRARY"])
    client, image = ctypes.c_void_p(), ctypes.create_string_buffer(_names.STATE_SIZE)
    library.pokeys_client_open(ctypes.byref(client), runtime.encode(), device.encode(), b"bench", 0)
    while library.pokeys_client_poll(client) != 1:
        time.sleep(0.01)
    return lambda: library.pokeys_client_read(client, image)


def timed(call, count):
    """Nanoseconds of one call, of so many."""
    began = time.perf_counter_ns()
    for _ in range(count):
        call()
    return (time.perf_counter_ns() - began) / count


def main():
    runtime, device, batches = sys.argv[1], sys.argv[2], int(sys.argv[3])
    with pokeys.attach(device, runtime=runtime, timeout=10) as there:
        state = there.read(stale_ok=True)
        calls = {
            "plain": plain(runtime, device),
            "now": lambda: there["pin.03.in"],
            "attribute": lambda: state.pin[3].in_,
            "whole": lambda: there.read(stale_ok=True).as_dict(),
        }
        taken = {name: [] for name in calls}
        for _ in range(batches):
            for name, call in calls.items():
                taken[name].append(timed(call, CALLS[name]))
    print(json.dumps({name: {"p50_ns": round(statistics.median(some)), "samples": batches * CALLS[name]}
                      for name, some in taken.items()}))


if __name__ == "__main__":
    main()
