# SPDX-License-Identifier: GPL-2.0-or-later
"""What publishing and reading one image cost."""
from figures import Figure, table

TITLE = "Shared memory: one state image"
SECONDS = 3
NAMES = ("memcpy", "seqlock_write", "shm_write", "shm_loan", "mirror_write", "seqlock_read", "shm_read", "mirror_read")


def measure(bench):
    return bench.program("shm", bench.run / "shm")


def figures(found):
    ratio = found["shm_write"]["p50_ns"] / found["seqlock_write"]["p50_ns"]
    return [Figure(f"publishing one image of {found['bytes']} bytes", found["shm_write"]["p50_ns"], "ns",
                   found["shm_write"]["samples"] * 64, readme=f"publishing one image of {found['bytes']} bytes"),
            Figure("the same: ratio to a bare seqlock", ratio, "", found["shm_write"]["samples"] * 64),
            Figure("the mirror's part of it", found["mirror_write"]["p50_ns"], "ns",
                   found["mirror_write"]["samples"] * 64)]


def report(found):
    rows = ((n.replace("_", " "), found[n]["p50_ns"], found[n]["p99_ns"],
             f"{found[n]['p50_ns'] / found['memcpy']['p50_ns']:.2f}") for n in NAMES)
    return [f"{found['bytes']} bytes, {found['memcpy']['samples']} batches of 64, one thread, contenders in turn.", "",
            *table(("what", "p50 ns", "p99 ns", "ratio to memcpy"), rows)]
