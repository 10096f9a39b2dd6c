#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""What timing.py says of results it has not measured: near is near, far fails, a bucket's
width fails nothing, a budget that is exceeded does."""
import json
import pathlib
import tempfile
import unittest

import timing


def results(folder, wake_p99_us=49.152, read=8000, sleeper_p99=45, late=10):
    out = folder / "out"
    out.mkdir(exist_ok=True)
    (out / "cyclictest.histogram").write_text("# Histogram\n000037 000500\n000038 000480\n"
                                              f"{sleeper_p99:06} 000020\n# Total: 000001000\n")
    wakeup = {"count": 5000, "mean": 40.5, "p50": 40.96, "p99": wake_p99_us}
    met = {"count": 5000, "mean": 62.5, "p50": 65.536, "p99": 81.92}
    for turn, start in ((1, met), (2, wakeup)):
        (out / f"status-{turn}.json").write_text(json.dumps({"devices": [{"diag": {"latency_us": {"wakeup": start}}}]}))
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
        self.assertEqual(found["wake_up"]["p50"], {"cyclictest_us": 37, "pokeysd_from_us": 32.768, "pokeysd_to_us": 40.96})
        self.assertEqual(found["hal_instructions"], {"read": 1000, "write": 500})
        self.assertIn("| `pokeys.0.read` | 1000 |", (self.folder / "timing.md").read_text())

    def test_bucket_that_reaches_over_the_limit_is_not_certainly_beyond_it(self):
        self.assertEqual(self.failed(wake_p99_us=57.344), [])

    def test_far_fails(self):
        self.assertEqual(self.failed(wake_p99_us=81.92), ["FAIL wake_up_p99_near_cyclictest"])

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
