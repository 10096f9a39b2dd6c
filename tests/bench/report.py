#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The report of ./run bench: what is beyond its target is said and fails nothing,
what could not be measured is named, docs/measurements.md shows the same figures.

Argument: the source folder."""
import contextlib
import io
import json
import pathlib
import random
import sys
import tempfile
import types
import unittest

ROOT = pathlib.Path(sys.argv[1])
sys.path.insert(0, str(ROOT / "bench"))
# pylint: disable=wrong-import-position,import-error
import figures
import measure
from bench import Bench
from figures import Figure, Skip, ratios
from rig import Fault
from sections import ORDER

MACHINE = {"processor": "abacus", "cores": 2, "virtual": True, "kernel": "6.1", "realtime": False,
           "isolated": "", "date": "2026-01-01", "load": 0.5}


class FakeBench:
    quick, ended = True, 0

    def say(self, text):
        pass

    def end_all(self):
        self.ended += 1


def section(raised=None, rows=()):
    def take(_bench):
        if raised:
            raise raised
        return {"number": 1}
    return types.SimpleNamespace(TITLE="Something", SECONDS=1, measure=take, figures=lambda found: list(rows),
                                 report=lambda found: [f"number {found['number']}"])


class Report(unittest.TestCase):
    def setUp(self):
        self.sections, self.real = {}, measure.section
        measure.section = self.sections.__getitem__
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.addCleanup(setattr, measure, "section", self.real)

    def written(self, **sections):
        """report.md and report.json of these sections."""
        self.sections.update(sections)
        bench = FakeBench()
        entries = {name: measure.measure_section(bench, name) for name in sections}
        self.assertEqual(bench.ended, len(sections))
        folder = pathlib.Path(self.folder.name)
        with contextlib.redirect_stdout(io.StringIO()):
            measure.write(folder, {"machine": MACHINE, "quick": False, "seconds": 3, "sections": entries})
        return (folder / "report.md").read_text(encoding="utf-8"), json.loads((folder / "report.json").read_text())

    def test_target_and_spread_stand_in_the_row(self):
        text, report = self.written(a=section(rows=[
            Figure("good", 0.25, "", 10, 0.2, 0.3, most=0.3), Figure("bad", 0.5, "", 10, 0.4, 0.6, most=0.3),
            Figure("without", 12.345, "µs", 10)]))
        self.assertIn("| good | 0.25 | 0.20 to 0.30 | 10 | ≤ 0.30 | met |", text)
        self.assertIn("| bad | 0.50 | 0.40 to 0.60 | 10 | ≤ 0.30 | **not met** |", text)
        self.assertIn("| without | 12.3 µs |  | 10 |  |  |", text)
        self.assertEqual([f["verdict"] for f in report["sections"]["a"]["figures"]], ["met", "not met", None])

    def test_skipped_and_failed_are_named_and_the_rest_is_there(self):
        text, report = self.written(a=section(Skip("no AF_XDP here")), b=section(Fault("it died")), c=section())
        self.assertIn("- Something: skipped: no AF_XDP here", text)
        self.assertIn("- Something: failed: it died", text)
        self.assertIn("number 1", text)
        self.assertEqual(report["sections"]["b"]["failed"], "it died")

    def test_machine_stands_at_the_head(self):
        text, _ = self.written(a=section())
        self.assertIn("abacus, 2 cores, a virtual machine; Linux 6.1, not PREEMPT_RT, no core isolated", text)

    def test_published_are_the_named_figures_only(self):
        _, report = self.written(a=section(rows=[Figure("long", 1, "µs", 7, 0.5, 2, 3, readme="short"),
                                                 Figure("other", 2, "", 1)]), b=section(Skip("no AF_XDP here")))
        text = "\n".join(measure.published(report))
        self.assertIn("| short | 1.00 µs | 0.50 to 2.00 | 7 | ≤ 3.00 |", text)
        self.assertIn("abacus, 2 cores", text)
        self.assertIn("no AF_XDP here", text)
        self.assertNotIn("other", text)

    def test_publishing_replaces_the_generated_part_only(self):
        _, report = self.written(a=section(rows=[Figure("long", 1, "µs", 7, readme="short")]))
        page = pathlib.Path(self.folder.name) / "page.md"
        page.write_text(f"before\n{measure.BEGIN}\nold\n{measure.END}\nafter\n", encoding="utf-8")
        for _ in range(2):
            measure.publish(report, page)
            text = page.read_text(encoding="utf-8")
            self.assertEqual(text.count("| short |"), 1)
            self.assertNotIn("old", text)
            self.assertTrue(text.startswith("before\n") and text.endswith("\nafter\n"))
        page.write_text("no place\n", encoding="utf-8")
        with self.assertRaises(ValueError):
            measure.publish(report, page)
        self.assertEqual(page.read_text(encoding="utf-8"), "no place\n")

    def test_the_page_has_its_place(self):
        text = measure.PAGE.read_text(encoding="utf-8")
        self.assertLess(text.index(measure.BEGIN), text.index(measure.END))

    def test_no_quick_run_and_no_part_of_one_is_published(self):
        path = pathlib.Path(self.folder.name) / "report.json"
        before = measure.PAGE.read_text(encoding="utf-8")
        for report, why in (({"quick": True, "sections": dict.fromkeys(ORDER, {})}, "quick run"),
                            ({"quick": False, "sections": dict.fromkeys(ORDER[1:], {})}, f"{ORDER[0]} missing")):
            path.write_text(json.dumps(report), encoding="utf-8")
            with contextlib.redirect_stderr(io.StringIO()) as said:
                self.assertEqual(measure.publish_last(path), 1)
            self.assertIn(why, said.getvalue())
            self.assertEqual(measure.PAGE.read_text(encoding="utf-8"), before)

    def test_round_without_answer_is_left_out(self):
        runs, bases = [{"p": 2}, {"p": 0}, {"p": 6}], [{"p": 1}, {"p": 1}, {"p": 2}]
        self.assertEqual(ratios(runs, bases, "p"), (2.5, 2, 3))
        self.assertEqual(ratios([{"p": 0}], [{"p": 1}], "p"), (None, None, None))
        self.assertEqual(Figure("f", None, "µs", 0, most=1).cells()[1], "no answer")
        self.assertIsNone(Figure("f", None, "µs", 0, most=1).verdict)

    def test_a_target_is_decided_by_the_interval(self):
        for low, high, most, verdict in ((1, 2, 3, "met"), (1, 3, 3, "met"), (4, 5, 3, "not met"), (2, 4, 3, "undecided"),
                                         (3, 4, 3, "undecided"), (2, 2, 3, "undecided"), (None, None, 3, "undecided"),
                                         (1, 2, None, None)):
            figure = Figure("f", 2.5, "µs", 9, low, high, most)
            self.assertEqual(figure.verdict, verdict, (low, high, most))
            self.assertEqual(figure.cells()[5], {"not met": "**not met**", None: ""}.get(verdict, verdict))

    def test_the_interval_is_that_of_the_median(self):
        self.assertEqual(figures.interval([]), (None, None, None))
        self.assertEqual(figures.interval([7]), (7, 7, 7))
        self.assertEqual(figures.interval([1, 3]), (2, 1, 3))
        # one slow round of many is no reason for a wide one; the same values give the same interval
        many = [10 + i % 3 for i in range(20)] + [500]
        self.assertEqual(figures.interval(many), figures.interval(many))
        value, low, high = figures.interval(many)
        self.assertTrue(10 <= low <= value <= high <= 12)
        # it nearly always has the median of what the rounds are drawn from
        draw, right = random.Random(1), 0
        for _ in range(100):
            _, low, high = figures.interval([draw.gauss(50, 10) for _ in range(15)])
            right += low <= 50 <= high
        self.assertGreater(right, 85)

    def test_numbers_have_three_digits(self):
        self.assertEqual([figures.number(v) for v in (0, 0.123, 9.876, 45.67, 1234.5)],
                         ["0", "0.12", "9.88", "45.7", "1234"])

    def test_contests_take_everybody_and_turn_round(self):
        rig = Bench.__new__(Bench)
        rig.rounds, rig.section_end = 3, None
        with contextlib.redirect_stdout(io.StringIO()):
            self.assertEqual(list(rig.contests("x", ("a", "b"))), ["a", "b", "b", "a", "a", "b"])
        for module in (self.real(name) for name in ORDER):
            if hasattr(module, "ORDER"):
                self.assertEqual(sorted(module.ORDER), sorted(module.NAMES), module.TITLE)

    def test_every_section_keeps_the_contract(self):
        for name in ORDER:
            module = self.real(name)
            self.assertTrue(module.TITLE and module.SECONDS > 0, name)
            for function in (module.measure, module.figures, module.report):
                self.assertTrue(callable(function), name)


unittest.main(argv=sys.argv[:1], verbosity=2)
