#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The curves of the documentation show what its text says about gains.

    plots.py BENCH_PLOTS
"""
import subprocess
import sys


def curves(plots, word):
    """Blocks of rows of numbers."""
    text = subprocess.run([plots, word], capture_output=True, text=True, timeout=120, check=True).stdout
    blocks = [block.splitlines() for block in text.strip().split("\n\n\n")]
    return [[tuple(map(float, line.split())) for line in block] for block in blocks]


def largest(rows, begin, end):
    return max(abs(error) for time, _speed, error in rows if begin <= time < end)


def spread(rows, begin, end):
    errors = [error for time, _speed, error in rows if begin <= time < end]
    return max(errors) - min(errors)


def check_servo(plots):
    only_p, with_d, with_velocity, with_acceleration, with_i = curves(plots, "servo")
    # while it speeds up: each feed-forward makes the error smaller
    moving = [largest(rows, 0, 0.35) for rows in (with_d, with_velocity, with_acceleration)]
    assert moving[0] > 2 * moving[1] and moving[1] > 1.5 * moving[2], moving
    # without pid-d it oscillates
    assert spread(only_p, 0.12, 0.2) > 3 * spread(with_d, 0.12, 0.2)
    # only pid-i takes away what a steady pull leaves
    assert largest(with_i, 0.65, 0.7) < 0.6 * largest(with_acceleration, 0.65, 0.7)


def check_heater(plots):
    found, much_i, little = curves(plots, "heater")
    overshoot = [max(celsius for _time, celsius, _power in rows) - 60 for rows in (found, much_i)]
    assert overshoot[0] < 1 and overshoot[1] > 2, overshoot
    late = [max(time for time, celsius, _power in rows if abs(celsius - 60) > 1) for rows in (found, little)]
    assert late[0] < 150 and late[1] > 400, late
    assert all(0 <= power <= 100 for rows in (found, much_i, little) for _time, _celsius, power in rows)


if __name__ == "__main__":
    check_servo(sys.argv[1])
    check_heater(sys.argv[1])
