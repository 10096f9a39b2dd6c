# SPDX-License-Identifier: GPL-2.0-or-later
"""What a report is made of: figures with their interval and target, and tables of them."""
import dataclasses
import random
import statistics

RESAMPLES = 2000
CERTAIN = 0.95


class Skip(Exception):
    """Why something cannot be measured here, in one line: what is missing, what is lost by it."""


@dataclasses.dataclass
class Figure:
    """One row of the summary. `low` to `high` is where the median of many rounds would be, with 95 %
    certainty. `most` is the target, if there is one: it is met, or not, if all of this interval says
    so; otherwise it is undecided. Nothing else happens."""
    text: str
    value: float | None  # None: nobody answered
    unit: str
    samples: int
    low: float | None = None
    high: float | None = None
    most: float | None = None
    readme: str = ""  # its name in docs/measurements.md; without one it is not shown there

    @property
    def verdict(self):
        """None without a target or a value."""
        if self.most is None or self.value is None:
            return None
        if self.low is None or self.low == self.high:  # of one round
            return "undecided"
        return "met" if self.high <= self.most else "not met" if self.low > self.most else "undecided"

    def cells(self):
        where = "" if self.low is None else f"{number(self.low)} to {number(self.high)}"
        target = "" if self.most is None else f"≤ {number(self.most)}"
        verdict = "**not met**" if self.verdict == "not met" else self.verdict or ""
        return self.text, self.show(), where, self.samples, target, verdict

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


def interval(values):
    """(median, low, high) of the rounds, by bootstrap: medians of as many rounds drawn from these, again
    and again, are between low and high in 95 of 100 cases. All are None where there is none. The draws are
    the same each time."""
    if not values:
        return None, None, None
    draw = random.Random(len(values))
    medians = sorted(statistics.median(draw.choices(values, k=len(values))) for _ in range(RESAMPLES))
    tail = round(RESAMPLES * (1 - CERTAIN) / 2)
    return statistics.median(values), medians[tail], medians[-1 - tail]


def middle(runs, *path):
    """A figure's median over the rounds with its interval; 0 is that of a round without an answer."""
    return interval([pick(run, *path) for run in runs if pick(run, *path)])


def ratios(runs, bases, *path):
    """The median of the figure's ratio to a base's, each round to its own, with its interval."""
    pairs = [(pick(run, *path), pick(base, *path)) for run, base in zip(runs, bases)]
    return interval([value / base for value, base in pairs if value and base])


def total(runs, *path):
    return sum(pick(run, *path) for run in runs)


def table(heads, rows):
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
