#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measure, contenders side by side in one run, and write report.md and report.json.

Never judges: a figure beyond its target is shown as such, and the status is 0. On a
virtual machine with two cores medians and ratios mean something, maxima do not.
"""
import argparse
import importlib
import json
import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "scripts"))
# pylint: disable=wrong-import-position
from bench import UNAVAILABLE, Bench
from figures import Skip, table
from machine import describe, machine
from rig import Fault
from sections import ORDER

LIMIT_S = {False: 480, True: 120}  # of the whole; what does not begin before is left out, said
HEADS = ("figure", "measured", "over the rounds", "samples", "target", "")


def section(name):
    return importlib.import_module(f"sections.{name}")


def measure_section(bench, name):
    """What stands in report.json of one section."""
    module, began = section(name), time.monotonic()
    entry = {}
    bench.section_end = began + module.SECONDS
    bench.say(module.TITLE)
    try:
        entry["found"] = module.measure(bench)
    except Skip as why:
        entry["skipped"] = str(why)
        bench.say(f"skipped: {why}")
    except Fault as fault:
        entry["failed"] = str(fault)
        bench.say(f"failed: {fault}")
    finally:
        bench.end_all()
    entry["seconds"] = round(time.monotonic() - began, 1)
    return entry


def measure(bench, names):
    began, sections = time.monotonic(), {}
    report = {"machine": machine(), "quick": bench.quick, "sections": sections}
    for name in names:
        if time.monotonic() - began > LIMIT_S[bench.quick]:
            sections[name] = {"skipped": f"{LIMIT_S[bench.quick]} s were over before it began", "seconds": 0}
        else:
            sections[name] = measure_section(bench, name)
    report["seconds"] = round(time.monotonic() - began)
    return report


def figures_of(report):
    for name, entry in report["sections"].items():
        if "found" in entry:
            yield from section(name).figures(entry["found"])


def summary(report):
    left_out = [f"- {section(name).TITLE}: {word}: {entry[word]}" for name, entry in report["sections"].items()
                for word in ("skipped", "failed") if word in entry]
    return ["# Measured", "", describe(report["machine"]) +
            f" {report['seconds']} s in all{', a quick run: only to see that it works' if report['quick'] else ''}.",
            "Medians of rounds in which the contenders took turns; maxima are not given, for they mean"
            " nothing on a machine that others use.", "",
            *table(HEADS, (figure.cells() for figure in figures_of(report))), "",
            *(["Not measured:", "", *left_out, ""] if left_out else [])]


def details(report):
    for name, entry in report["sections"].items():
        if "found" in entry:
            yield from (f"## {section(name).TITLE}", "", *section(name).report(entry["found"]), "")


def readme(report):
    """README's table: those figures that have a name there."""
    return [describe(report["machine"]), "", *table(("", ""), (
        (figure.readme, figure.show()) for figure in figures_of(report) if figure.readme))]


def write(folder, report):
    for name, entry in report["sections"].items():
        if "found" in entry:
            entry["figures"] = [{**vars(f), "met": f.met} for f in section(name).figures(entry["found"])]
    text = "\n".join([*summary(report), *details(report)])
    (folder / "report.json").write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    (folder / "report.md").write_text(text, encoding="utf-8")
    print(text)


def options():
    parser = argparse.ArgumentParser(prog="./run bench", description=__doc__.splitlines()[0])
    parser.add_argument("--build", required=True, help=argparse.SUPPRESS)
    parser.add_argument("--quick", action="store_true", help="a short run, to see that everything works")
    parser.add_argument("--only", metavar="SECTION,...", help="measure only these sections")
    parser.add_argument("--list", action="store_true", help="list the sections")
    parser.add_argument("--readme", action="store_true", help="print README's table from the last report")
    return parser.parse_args()


def print_readme(path):
    """README's table of the report that is there; the status to end with."""
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as why:
        print(f"bench: no report to print ({why}); ./run bench writes one", file=sys.stderr)
        return 1
    print("\n".join(readme(report)))
    return 0


def main():
    chosen = options()
    folder = pathlib.Path(chosen.build) / "bench"
    # an empty --only is a mistake, and not all of them
    names = ORDER if chosen.only is None else chosen.only.split(",")
    unknown = [name for name in names if name not in ORDER]
    if unknown:
        print(f"bench: there is no section '{unknown[0]}', one of: {' '.join(ORDER)}", file=sys.stderr)
        return 2
    if chosen.list:
        print("\n".join(f"{name:16} {section(name).SECONDS:3} s  {section(name).TITLE}" for name in names))
        return 0
    if chosen.readme:
        return print_readme(folder / "report.json")
    try:
        bench = Bench(chosen.build, chosen.quick)
    except Fault as why:
        print(f"bench: skipped: {why}", file=sys.stderr)
        return UNAVAILABLE
    try:
        report = measure(bench, names)
    finally:
        bench.close()
    write(folder, report)
    print("bench: written to build/bench/report.md and report.json")
    return 1 if any("failed" in entry for entry in report["sections"].values()) else 0


if __name__ == "__main__":
    sys.exit(main())
