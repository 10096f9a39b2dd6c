# SPDX-License-Identifier: GPL-2.0-or-later
"""The sections of the report, in the order in which they are measured and shown.

A section is a module of this folder with

    TITLE       its heading
    SECONDS     how long it takes at most on a quiet machine; later no round of it begins
    measure(bench) -> found
                what was found, as plain JSON. Processes are started and ended by the
                bench (bench/bench.py); it has ended all of them before the next section.
                Raises Skip with the reason where something is missing, Fault where
                something that has to work does not.
    figures(found) -> [Figure, ...]
                its rows of the summary, each with the target, if there is one
    report(found) -> [line, ...]
                its part of the Markdown, below the heading

and a name in ORDER. figures() and report() read nothing but `found`, so a report can
be written again from report.json. Contenders are measured in turns (bench.rounds), so
that a drift of the machine's speed touches all of them; compare with ratios().
"""
ORDER = (
    "round_trip",
    "everything",
    "devices",
    "loss",
    "motion",
    "loops",
    "control",
    "shared_memory",
    "readers",
    "python",
    "gateway",
    "console",
    "stops",
    "exchange",
    "hal",
    "remote",
    "age",
    "flood",
)
