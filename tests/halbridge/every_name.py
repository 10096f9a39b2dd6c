# SPDX-License-Identifier: GPL-2.0-or-later
"""What the test of every name is made of: names, rules, steps.

A rule says of the names that fit a pattern how the simulated device is moved, or
how its inside is read, and what is expected. The rules of one act are carried out
together: for each of its phases everything is set at once, then waited for, then
compared (every_play.py). A rule that expects nothing in any phase is a fault of the
test. Afterwards every name must have been seen in two states:

- an output of the HAL (pin OUT, parameter RO) has shown two values, each after the
  device had been moved;
- an input of it (pin IN, parameter RW) has been set to two values, each of which
  was then seen in the device, or in a name that shows the device.

A name without function (docs/compatibility.md) is told apart: it shows what it always
shows, or is set and the device stays as it was.
"""
import re
import subprocess


class Rule:
    def __init__(self, pattern, function):
        self.pattern, self.function = re.compile(pattern), function


class Act:
    """Names that are moved together. Used as a decorator: @ACT.rule(PATTERN)."""

    def __init__(self, title, phases=2, before=None):
        self.title, self.phases, self.before = title, phases, before
        self.rules = []

    def rule(self, *patterns):
        def take(function):
            self.rules += [Rule(pattern, function) for pattern in patterns]
            return function
        return take


class Step:
    """What is done in one phase of an act, and what is expected of it."""

    def __init__(self, record):
        self.record, self.name = record, None
        self.claims = 0         # expectations so far
        self.notes = []         # (name, what, value), for the record once all is as expected
        self.commands, self.sets, self.presses, self.pokes = {}, {}, {}, {}
        self.shown, self.inside, self.changed, self.same = {}, {}, {}, {}
        self.pause, self.runs, self.beats, self.unmoved = 0, None, None, False

    def _note(self, what, value):
        self.claims += 1
        self.notes.append((self.name, what, value))

    # what is done

    def poke(self, field, index, value, mask=None):
        """Change the inside of the device, which is then switched off and on."""
        old, of = self.pokes.get((field, index), (0, 0))
        self.pokes[field, index] = (value, None) if mask is None else (old | value, of | mask)

    def daemon(self, runs):
        """There is a daemon, or it is killed."""
        self.runs = runs

    def heartbeat(self, beats):
        """The HAL's thread writes commands, or does not."""
        self.beats = beats

    def sim(self, command):
        """Move the device."""
        self.commands[command] = True

    def set(self, value, name=None):
        """Set the name the rule is called for, or another one as a condition."""
        self.sets[name or self.name] = value
        if not name:
            self.notes.append((self.name, "set", value))

    def press(self, value, name=None):
        """Likewise, once what is set besides has been taken in."""
        self.set(value, name)
        self.presses[name or self.name] = self.sets.pop(name or self.name)

    # what is expected

    def shows(self, value, name=None, state=None):
        """The HAL shows it. `state` tells apart what a function expects."""
        self.shown[name or self.name] = value
        self._note("shown" if not name else "effect", (name, state if callable(value) else value))

    def device(self, field, index, value, mask=None, state=None):
        """It stands in the device."""
        self.inside[field, index, mask] = value
        self._note("effect", ((field, index, mask), state if callable(value) else value))

    def changes(self, sort=lambda have, before: have != before, where=None):
        """It becomes another one than it was before this phase, if only for a moment;
        the name, or `where`: another one, or (field, index) in the device."""
        self.changed[where or self.name] = sort
        for state in ("before", "after"):
            self._note("shown" if not where else "effect", (where, state))

    def follows(self, field, index, convert=float):
        """It shows what stands in the device, whatever that is."""
        self.same[self.name] = field, index, convert
        self.claims += 1

    def fixed(self, value):
        """The name shows this always: it has no function, or nothing that could move it."""
        self.shown[self.name] = value
        self._note("fixed", value)

    def in_vain(self, value):
        """The name has no function: it is set, and nothing in the device changes."""
        self.set(value)
        self.unmoved = True
        self._note("fixed", value)


    def keep(self):
        """All was as expected. What is seen of an input belongs to what it was set to."""
        for name, what, value in self.notes:
            if what == "set":
                self.record[name, "last"] = value
        for name, what, value in self.notes:
            if what == "effect":
                value = self.record.get((name, "last")), *value
            if what != "set":
                self.record.setdefault((name, what), set()).add(value)


def more(have, before):
    return have > before


def names_of(list_names, schemes="all"):
    """NAME -> (kind, type, direction), without the prefix."""
    out = subprocess.run([list_names, "names", schemes], capture_output=True, text=True,
                         check=True).stdout
    return {words[0].removeprefix("pokeys.0."): tuple(words[1:])
            for words in (line.split() for line in out.splitlines())}


def rules_of(acts, names, elsewhere):
    """Each name with the acts and rules for it; AssertionError if one has none."""
    found = {name: [] for name in names}
    for act in acts:
        for rule in act.rules:
            fits = [(name, match) for name in names
                    if (match := rule.pattern.fullmatch(name)) is not None]
            assert fits, f"{act.title}: no name fits {rule.pattern.pattern}"
            for name, match in fits:
                found[name].append((act, rule, match))
    bare = [name for name, rules in found.items() if not rules and name not in elsewhere]
    assert not bare, f"{len(bare)} names without a rule: {bare[:40]}"
    twice = [name for name in elsewhere if found[name]]
    assert not twice, f"{len(twice)} names have a rule and are said to be elsewhere: {twice[:40]}"
    return found


def has_moved(record, name, direction):
    """In two states, and told apart by them."""
    if (name, "fixed") in record:
        return True
    shown = len(record.get((name, "shown"), ())) >= 2
    # a parameter or an I/O pin that shows, and that nobody sets
    if direction in ("OUT", "RO") or (name, "last") not in record:
        return shown
    return direction == "I/O" and shown or has_effect(record, name)


def has_effect(record, name):
    """Set to one value it was seen somewhere as this, set to another there as that."""
    effects = record.get((name, "effect"), ())
    return any(where == there and value != other and seen != also
               for value, where, seen in effects for other, there, also in effects)
