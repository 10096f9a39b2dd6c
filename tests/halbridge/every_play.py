# SPDX-License-Identifier: GPL-2.0-or-later
"""How the acts of the test of every name are carried out on a machine."""
import math
import re
import time
from every_device import GOES_ON, LIMIT, load, place_of
from every_name import Step

# cycles of the daemon: settings have been looked at; all has been done
TAKEN_IN, DONE = 20, 300
PATIENCE = 5    # seconds until what was refused is pressed anew
# the daemon's log of a moment in which it, HAL or the device had no processor
STALL = re.compile(r"cycles? (?:was|were) missed|heartbeat is \d+ us late|data is stale: \d+ us|"
                   r"lost: it does not answer")


def is_like(have, want):
    if callable(want):
        return bool(want(have))
    if isinstance(have, float) or isinstance(want, float):
        return math.isclose(have, want, rel_tol=1e-4, abs_tol=1e-6)
    return have == want


def values_of(hal):
    """All names and their values, by two calls."""
    out = {}
    for kind in ("pin", "param"):
        for line in hal.ok(f"halcmd -s show {kind} 'pokeys.0.*'").splitlines():
            words = line.split()
            if len(words) > 4:
                text = words[3]
                out[words[4].removeprefix("pokeys.0.")] = (
                    text == "TRUE" if text in ("TRUE", "FALSE") else float(text))
    return out


def format_of(value):
    return int(value) if isinstance(value, bool) else repr(value)


def set_all(machine, values):
    """One after another; those of one signal at once, as a program in the same thread sets them:
    the thread stands meanwhile, for it may be interrupted between two pins that it reads."""
    if not values:
        return
    path = machine.folder / "set.hal"
    lines = [f"setp pokeys.0.{name} {format_of(value)}\n"
             for name, value in values.items() if name not in machine.signals]
    linked = {machine.signals[name]: value for name, value in values.items() if name in machine.signals}
    if linked:
        lines += ["stop\n", *(f"sets {signal} {format_of(value)}\n" for signal, value in linked.items()),
                  "start\n"]
    path.write_text("".join(lines), encoding="utf-8")
    machine.hal.ok(f"halcmd -f {path}")
    machine.hal.periods()


def compared(step, have, fields):
    """(name, has, wants) of all that is shown."""
    for name, want in step.shown.items():
        yield name, have[name], want
    for name, (field, index, convert) in step.same.items():
        yield name, have[name], convert(load(fields, field, index))


def value_at(what, have, fields):
    """Of a name, or of a place in the device."""
    return have[what] if isinstance(what, str) else load(fields, *what)


def asks_inside(step):
    return bool(step.inside or step.same or
                any(not isinstance(what, str) for what in step.changed))


def differences(machine, step, before):
    """What is not as it should be; takes out of step.changed what has changed."""
    have = values_of(machine.hal) if step.shown or step.changed or step.same else {}
    fields = machine.inside.inside() if asks_inside(step) else {}
    found = [f"{name} is {has}, not {want if not callable(want) else 'as wanted'}"
             for name, has, want in compared(step, have, fields) if not is_like(has, want)]
    for key, want in step.inside.items():
        has = load(fields, *key)
        if not is_like(has, want):
            found.append(f"in the device, {key} is {has}, not {want}")
    now = {what: value_at(what, have, fields) for what in step.changed}
    step.changed = {what: sort for what, sort in step.changed.items()
                    if not sort(now[what], before[what])}
    found += [f"{what} is {now[what]} and was {before[what]}" for what in step.changed]
    if not found:
        step.notes += [(name, "shown", (None, have[name])) for name in step.same]
    return found


def poke_all(machine, pokes):
    if not pokes:
        return
    fields = machine.inside.inside()
    commands = []
    for (field, index), (value, mask) in pokes.items():
        values, place = place_of(fields, field, index)
        if mask is not None:
            value |= values[place] & ~mask
        commands.append(f"field {field} {index} {value}")
    machine.inside.ask(*commands, "save", "reboot keep-config")


def still(fields):
    return {key: values for key, values in fields.items() if key not in GOES_ON}


def stays_unmoved(machine, fields):
    """The daemon has had the time to do what it was told, and has done nothing."""
    machine.cycles(DONE)
    after = still(machine.inside.inside())
    changed = {key: after[key] for key, values in still(fields).items() if values != after[key]}
    assert not changed, f"these changed in the device, which should not: {changed}"


def do(machine, step):
    poke_all(machine, step.pokes)
    if step.runs is not None and step.runs != ("pokeysd" in machine.children):
        machine.daemon() if step.runs else machine.kill("pokeysd")
    # with another serial number all the rest is read anew, once: it comes last
    machine.inside.ask(*sorted(step.commands, key=lambda command: command.startswith("serial ")))
    set_all(machine, step.sets)
    if step.presses and step.sets:
        machine.cycles(TAKEN_IN)
    set_all(machine, step.presses)
    if step.beats is not None:
        machine.beat(step.beats)


class PermissionGone(Exception):
    """The machine was off for a moment since an earlier phase switched it on."""


class Presses:
    """What was pressed in a moment without fresh data is refused, and such moments are many
    where the daemon waits for a processor. That is told: by the count of what was not done,
    or, of machine-is-on, by the new edge that is wanted. Then it is pressed again, and only
    then: one that is lost without a word is never done, and fails the test."""

    def __init__(self, machine, step):
        self.machine, self.presses = machine, step.presses
        self.pressed = [name for name, value in step.presses.items() if value]
        self.begin()

    def begin(self):
        self.at = time.monotonic()
        self.failed = self.count()

    def count(self):
        return self.machine.hal.get("one-shot-failed-count") if self.pressed else 0

    def refused(self):
        return (self.count() != self.failed or
                "machine-is-on" in self.pressed and self.machine.hal.get("needs-edge"))

    def again(self):
        if not self.pressed or time.monotonic() - self.at < PATIENCE or not self.refused():
            return
        if "machine-is-on" not in self.pressed and self.machine.hal.get("needs-edge"):
            raise PermissionGone(f"machine-is-on needs a new edge, so {self.pressed} can do nothing")
        self.begin()
        set_all(self.machine, {name: type(value)(0) for name, value in self.presses.items()})
        set_all(self.machine, self.presses)

    def lost(self):
        """For the complaint that not all has come about."""
        if not self.pressed or self.refused():
            return ""
        return f"; pressed, and not told to be refused: {self.pressed}"


def carry_out(machine, step):
    have = values_of(machine.hal) if step.changed else {}
    fields = machine.inside.inside() if step.unmoved or asks_inside(step) else {}
    before = {what: value_at(what, have, fields) for what in step.changed}
    presses = Presses(machine, step)
    do(machine, step)
    count = len(step.shown) + len(step.inside) + len(step.changed) + len(step.same)
    end = time.monotonic() + LIMIT
    while found := differences(machine, step, before):
        assert time.monotonic() < end, \
            f"{len(found)} of {count}: " + "; ".join(found[:30]) + presses.lost()
        if step.pause:      # the daemon misses some cycles
            machine.hold("pokeysd", step.pause)
        time.sleep(0.02)
        presses.again()
    if step.unmoved:
        stays_unmoved(machine, fields)
    step.keep()


def play(machine, act, found, record):
    """All phases of one act."""
    began = time.monotonic()
    if act.before:
        act.before(machine)
    claims = {}
    for phase in range(act.phases):
        step = Step(record)
        for name, rules in found.items():
            for of, rule, match in rules:
                if of is not act:
                    continue
                step.name = name
                before = step.claims
                rule.function(step, phase, *(int(word) if word.isdigit() else word
                                             for word in match.groups()))
                key = name, rule.pattern.pattern
                claims[key] = claims.get(key, 0) + step.claims - before
        try:
            carry_out(machine, step)
        except AssertionError as fault:
            raise AssertionError(f"{act.title}, phase {phase}: {fault}") from fault
    silent = [name for (name, _), count in claims.items() if not count]
    assert not silent, f"{act.title}: rules that assert nothing, for {silent[:30]}"
    print(f"{act.title}: {len(claims)} names, {time.monotonic() - began:.1f} s", flush=True)
