#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""What timing.py says of results it has not measured: near is near, far fails, the
better of two starts counts, a budget that is exceeded fails."""
import json
import pathlib
import struct
import tempfile
import unittest

import timing


CYCLES, HEAD, CYCLE, SENT = 1000, 4096, 4, 1


def slot(kind, tick, woke):
    """Of the recorder, as daemon/recorder/ring.h has it."""
    return struct.pack("<QQQIIHHHBBBB?BI5QQII", 7, tick, 0, 0, 0, 0, 0, 0, kind, 0, 0, 0, False, 0, 7,
                       7, tick, woke, woke, woke, woke, 0, 0).ljust(128, b"\0")


def record(wake_us):
    """A packet between any two cycles; some slots were never written."""
    slots = (slot(CYCLE, 4000000 * i, 4000000 * i + int(us * 1000)) + slot(SENT, 1, 2) for i, us in enumerate(wake_us))
    return bytes(HEAD) + b"".join(slots) + bytes(128 * 9)


def results(folder, wake_p99_us=49.152, read=8000, sleeper_p99=45, late=10):
    out = folder / "out"
    out.mkdir(exist_ok=True)
    for turn, median in ((1, 61), (2, 37)):  # which of them met the kernel's tick is chance
        (out / f"cyclictest-{turn}.histogram").write_text(
            f"# Histogram\n{median:06} 000500\n{median + 1:06} 000480\n{sleeper_p99:06} 000020\n# Total: 000001000\n")
    (out / "recorder-1").write_bytes(record([38.5] * (CYCLES - 20) + [wake_p99_us] * 20))
    (out / "recorder-2").write_bytes(record([62.5] * CYCLES))
    (out / "hal-times").write_text(f"{10 * read} 9000\n{read} 4000\n{read} 4000\n")
    (out / "ages").write_text("700.5 900.0\n" * (990 - late) + "1000.0 900.0\n" * 10 + "4700.0 900.0\n" * late)
    (out / "kernel").write_text("6.1-rt\n")
    return timing.judge(folder)


class Judge(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)

    def failed(self, **given):
        return [line.split(":")[0] for line in results(self.folder, **given) if line.startswith("FAIL")]

    def test_near_passes_and_is_written_down(self):
        self.assertEqual(self.failed(), [])
        found = json.loads((self.folder / "timing.json").read_text())
        self.assertEqual(found["wake_up"]["cyclictest"], {"samples": 1000, "mean_us": 37.64, "p50": 38, "p99": 45})
        self.assertEqual(found["wake_up"]["pokeysd"], {"samples": 1000, "mean_us": 38.713, "p50": 38.5, "p99": 49.152})
        self.assertEqual(found["hal_instructions"], {"read": 1000, "write": 500})
        self.assertIn("| `pokeys.0.read` | 1000 |", (self.folder / "timing.md").read_text())

    def test_far_fails(self):
        self.assertEqual(self.failed(wake_p99_us=54), [])
        self.assertEqual(self.failed(wake_p99_us=54.1), ["FAIL wake_up_p99_near_cyclictest"])

    def test_more_instructions_than_the_budget_fail(self):
        most = timing.HAL_INSTRUCTIONS * timing.NS_PER_INSTRUCTION
        self.assertEqual(self.failed(read=most - 4000), [])
        self.assertEqual(self.failed(read=most), ["FAIL read_and_write_within_their_budget"])

    def test_data_of_the_cycle_before_at_too_many_reads_fail(self):
        self.assertEqual(self.failed(late=20), [])
        self.assertEqual(self.failed(late=21), ["FAIL reads_find_data_just_published"])

    def test_age_is_held_against_the_round_trip(self):
        self.assertEqual(self.failed(late=9), [])
        found = json.loads((self.folder / "timing.json").read_text())["age_at_read"]
        self.assertEqual((found["p50_us"], found["p99_us"], found["beyond_instructions"]), (700.5, 1000, 12500))
        self.assertIn("| p99 | 1000 |", (self.folder / "timing.md").read_text())


unittest.main(verbosity=2)
