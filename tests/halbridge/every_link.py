# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for the connection: how it does, and what is told when there is none."""
from every_encoder import enable
from every_name import Act, more
from every_play import set_all

LOST = Act("a device that is silent", phases=3)
SILENT = {"connected": False, "alive": False, "connected.udp": False, "stale": True, "err": True,
          "packet-error": True, "packet-error-exceeded": True}


@LOST.rule(*(f"({name})".replace(".", r"\.") for name in SILENT))
def _(step, phase, name):
    step.sim("silence 0" if phase == 1 else "silence 3600000")
    step.shows(SILENT[name] != (phase == 1))


@LOST.rule(r"link-state", r"deb\.out")
def _(step, phase):
    step.shows(3 if phase == 1 else (lambda have: have != 3), state="away")


@LOST.rule(r"fault")
def _(step, phase):
    if phase != 1:
        step.shows(2)


@LOST.rule(r"reconnects")
def _(step, phase):
    if phase == 1:
        step.changes(more)


@LOST.rule(r"fault-count", r"packets\.timed-out")
def _(step, phase):
    if phase != 1:
        step.changes(more)


@LOST.rule(r"legacy\.emergency-when-lost")
def _(step, phase):
    step.set(not phase)
    if phase != 1:
        step.shows(11 if not phase else (lambda have: have != 11), "PEv2.deb.estop", phase)


# what an error weighs is seen where the level has just begun to rise, or to fall
LEVEL = Act("errors are weighed", phases=4)
FALLING = Act("what is good is weighed", phases=6)
ALL = 2000000000
PRIMES = (97, 89)


@LEVEL.rule(r"packet-error-limit")
def _(step, phase):
    value = (33, ALL, 55, ALL)[phase]
    step.set(value)
    if phase % 2 == 0:
        step.shows(True, "stale")
        step.shows(value, "packet-error-level")


@LEVEL.rule(r"packet-error-increment")
def _(step, phase):
    first, each = (33, 55)[phase // 2], PRIMES[phase // 2]
    step.set(each)
    if phase % 2:
        step.shows(lambda have: have > first and (have - first) % each == 0,
                   "packet-error-level", phase)


@LEVEL.rule(r"packet-error-level")
def _(step, phase):
    if phase % 2 == 0:
        step.shows((33, ALL, 55, ALL)[phase])


# a press that nobody is there for
@LEVEL.rule(r"one-shot-failed-count")
def _(step, phase):
    step.set(phase == 1, "counter.reset")
    if phase == 1:
        step.changes(more)


# up at once while the device is silent, then down in steps
@FALLING.rule(r"packet-error-decrement")
def _(step, phase):
    each = PRIMES[phase // 3]
    step.set(ALL, "packet-error-increment")
    step.set(ALL, "packet-error-limit")
    step.set(each)
    step.sim("silence 0" if phase % 3 == 1 else "silence 3600000")
    if phase % 3 == 0:
        step.shows(ALL, "packet-error-level")
    else:
        step.shows(lambda have: (ALL - have) % each == 0 and (have < ALL) == (phase % 3 == 1),
                   "packet-error-level", phase)


NO_DAEMON = Act("no daemon", phases=2)


def daemon_ends(m):
    m.inside.ask("silence 0")
    m.hal.becomes("connected", True)
    m.hal.becomes("commander", True)


NO_DAEMON.before = daemon_ends


@NO_DAEMON.rule(r"daemon-alive", r"commander")
def _(step, phase):
    step.daemon(bool(phase))
    step.shows(bool(phase))


@NO_DAEMON.rule(r"cycle")
def _(step, phase):
    step.changes()


# a thread that reads and does not write any more
NO_HEARTBEAT = Act("no heartbeat", phases=3, before=lambda m: set_all(m, {"machine-is-on": True}))


@NO_HEARTBEAT.rule(r"safe-state")
def _(step, phase):
    step.heartbeat(phase != 1)
    step.shows(phase == 1)


@NO_HEARTBEAT.rule(r"needs-edge", r"outputs-held")
def _(step, phase):
    if phase != 1:
        step.shows(phase == 2)


def everything_is_read(m):
    """What is read only if somebody can want it."""
    enable(m)
    set_all(m, {"pin.40.function": 8, "pin.00.function": 0x42, "matrix.rows": 16,
                "matrix.columns": 8, "matrix.enable": 1}
            | {f"matrix.row-pin.{i:02d}": 3 for i in range(16)}
            | {f"matrix.column-pin.{i:02d}": 4 for i in range(8)})
    for group in ("analog", "counters", "matrix", "encoders-low", "encoders-high"):
        m.hal.becomes(f"rate.{group}", lambda have: have > 0)


TROUBLE = Act("packets are lost, doubled, damaged and late", phases=1, before=everything_is_read)
COUNTED = (r"packets\.(?:sent|received|resent|late|lost|duplicate|corrupt|stray)",
           r"packet-error-total", r"cycles-late", r"cycles-skipped", r"device\.tick")
MEASURED = (r"age-us", r"rtt-(?:us|avg-us|jitter-us)", r"deadline-us",
            r"rate\.(?!backlash|postep).*", r"(?:encoder|digin|PoExtBus|PEv2)\.deb\.out",
            r"PoNET\.Deb\.Out", r"packets\.in-flight")


def bother(step):
    step.pause = 0.3
    for fault in ("both loss 0.02", "reply duplicate 0.1", "reply corrupt 0.02",
                  "reply wrong-id 0.02", "reply delay-us heavy:100:5000:1.1"):
        step.sim(f"fault {fault}")


@TROUBLE.rule(*COUNTED)
def _(step, phase):
    bother(step)
    step.changes(more)


@TROUBLE.rule(*MEASURED)
def _(step, phase):
    bother(step)
    step.changes()


# whatever a period takes, it is more than these thresholds
TIMES = Act("how long a period takes")
FOREVER = 1e9


@TIMES.rule(r"(?:read|write)-time-max")
def _(step, phase):
    step.set((FOREVER, 0)[phase])
    step.shows((FOREVER, lambda have: 0 < have < FOREVER)[phase], step.name, state="measured")


@TIMES.rule(r"time-threshold")
def _(step, phase):
    step.set((0.001, 0.002)[phase])
    step.changes(more, "time-exceeded-count")


@TIMES.rule(r"time-exceeded-count")
def _(step, _phase):
    step.changes(more)


STOP = Act("an emergency stop", phases=3)


@STOP.rule(r"emergency-stop")
def _(step, phase):
    step.set(phase == 1)
    step.shows(4 if phase == 1 else 0, "error-code")


@STOP.rule(r"error-code")
def _(step, phase):
    step.shows(4 if phase == 1 else 0)


@STOP.rule(r"error-active")
def _(step, phase):
    step.shows(phase == 1)


@STOP.rule(r"error-count")
def _(step, phase):
    if phase == 1:
        step.changes(more)


ACTS = [TROUBLE, TIMES]
LINK = [LOST, LEVEL, FALLING, NO_DAEMON]
HEART = [NO_HEARTBEAT, STOP]
