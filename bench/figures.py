# SPDX-License-Identifier: GPL-2.0-or-later
"""What a report is made of: figures with their spread and target, and tables of them."""
import dataclasses
import statistics


class Skip(Exception):
    """Why something cannot be measured here, in one line: what is missing, what is lost by it."""


@dataclasses.dataclass
class Figure:
    """One row of the summary. `most` is the target, if there is one; a figure above it is
    said to be so and nothing else happens."""
    text: str
    value: float | None  # None: nobody answered
    unit: str
    samples: int
    low: float | None = None  # over the rounds
    high: float | None = None
    most: float | None = None
    readme: str = ""  # its name in docs/measurements.md; without one it is not shown there

    @property
    def met(self):
        return None if self.most is None or self.value is None else self.value <= self.most

    def cells(self):
        spread = "" if self.low is None else f"{number(self.low)} to {number(self.high)}"
        target = "" if self.most is None else f"≤ {number(self.most)}"
        met = {None: "", True: "met", False: "**not met**"}[self.met]
        return self.text, self.show(), spread, self.samples, target, met

    def show(self):
        return f"{number(self.value)} {self.unit if self.value is not None else ''}".strip()


def number(value):
    """Three digits are as many as mean something."""
    if value is None:
        return "no answer"
    if value == 0 or abs(value) >= 100:
        return f"{value:.0f}"
    return f"{value:.2f}" if abs(value) < 10 else f"{value:.1f}"


def us(nanoseconds):
    return number(None if nanoseconds is None else nanoseconds / 1000)


def pick(run, *path):
    for key in path:
        run = run[key]
    return run


def spread(values):
    """(median, least, most); all None where there are none."""
    return (statistics.median(values), min(values), max(values)) if values else (None, None, None)


def middle(runs, *path):
    """The spread of a figure over the rounds; 0 is that of a round without an answer."""
    return spread([pick(run, *path) for run in runs if pick(run, *path)])


def ratios(runs, bases, *path):
    """The spread of the figure's ratio to a base's, each round to its own."""
    pairs = [(pick(run, *path), pick(base, *path)) for run, base in zip(runs, bases)]
    return spread([value / base for value, base in pairs if value and base])


def total(runs, *path):
    return sum(pick(run, *path) for run in runs)


def table(heads, rows):
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
