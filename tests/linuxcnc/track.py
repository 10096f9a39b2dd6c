# SPDX-License-Identifier: GPL-2.0-or-later
"""Commands and step counts of every servo period: how far apart, and off which path.

A line of the sampler is a number and for each of four joints the command and the
feedback. Following error is their difference in one period; path error is the
distance of the feedback from the nearest piece of the commanded path, in X Y Z,
and is what a part shows of it.
"""
import math

WINDOW = 400  # periods back in which the nearest piece of path is looked for
EVERY = 5  # feedback points judged: one in so many
MOST_DELAY = 250  # periods; a delay of one less may be a longer one


def read(path):
    """([command...], [feedback...]) of each period, and the number of gaps."""
    commands, feedback, gaps = [], [], 0
    for line in path.read_text(encoding="ascii", errors="replace").splitlines():
        words = line.split()
        if len(words) != 9:
            gaps += line == "overrun"
            continue
        values = [float(word) for word in words[1:]]
        commands.append(values[0::2])
        feedback.append(values[1::2])
    return commands, feedback, gaps


def to_piece(point, a, b):
    """Distance of a point from the straight piece a..b."""
    along = [q - p for p, q in zip(a, b)]
    length = sum(d * d for d in along)
    part = sum(d * (x - p) for d, x, p in zip(along, point, a)) / length if length else 0
    part = min(1, max(0, part))
    return math.dist(point, [p + part * d for p, d in zip(a, along)])


def thinned(commands):
    """The corners of the path, with the period of each: pieces of at least 0.02 mm."""
    path = [(0, commands[0][:3])]
    for period, command in enumerate(commands):
        if math.dist(command[:3], path[-1][1]) >= 0.02:
            path.append((period, command[:3]))
    return path


def path_errors(commands, feedback):
    path = thinned(commands)
    errors, last = [], 0
    for period in range(0, len(feedback), EVERY):
        while last + 2 < len(path) and path[last + 1][0] <= period:
            last += 1
        first = last
        while first > 0 and path[first][0] > period - WINDOW:
            first -= 1
        pieces = [point for _, point in path[first:last + 2]] or [path[0][1]]
        pieces.append(commands[period][:3])
        errors.append(min(to_piece(feedback[period][:3], a, b) for a, b in zip(pieces, pieces[1:])))
    return errors


def spread(values):
    ordered = sorted(values)
    return (f"median {ordered[len(ordered) // 2]:.4f}, 99 % below {ordered[int(len(ordered) * 0.99)]:.4f},"
            f" most {ordered[-1]:.4f}")


def behind(commands, feedback, periods):
    """Distances in X Y Z of the feedback from the command of so many periods before."""
    return [math.dist(f[:3], c[:3]) for c, f in zip(commands[:len(commands) - periods], feedback[periods:])]


def delay(commands, feedback):
    """The delay in periods that leaves the least between command and feedback."""
    return min(range(MOST_DELAY), key=lambda periods: sum(behind(commands, feedback, periods)[::EVERY]))


def describe(samples, joints="XYZA"):
    """Lines for a report."""
    commands, feedback, gaps = samples
    assert len(commands) > 1000, f"only {len(commands)} periods recorded"
    yield f"{len(commands)} servo periods recorded, {gaps} gaps"
    late = delay(commands, feedback)
    yield f"delay: {late} periods; apart from that: {spread(behind(commands, feedback, late))} mm"
    for joint, name in enumerate(joints):
        moving = [abs(c[joint] - f[joint]) for c, f in zip(commands, feedback)]
        yield f"following error {name}: {spread(moving)} {'degrees' if name == 'A' else 'mm'}"
    yield f"path error X Y Z: {spread(path_errors(commands, feedback))} mm"
