# SPDX-License-Identifier: GPL-2.0-or-later
"""Rules for PoNET and its modules."""
from every_name import Act
from every_play import set_all

MODULES = 16


def unplugged(m):
    """The bus not ready: modules are looked for anew when it is."""
    m.inside.ask("field ponet.state 0 0")
    m.hal.becomes("PoNET.state", 0, limit=60)


def replug(changes):
    def before(m):
        unplugged(m)
        m.inside.ask(*changes, "field ponet.state 0 10")
        m.hal.becomes("PoNET.state", 10, limit=60)
    return before


def types(keyboard):
    """All modules are something else than a keyboard, but for one."""
    return [f"field ponet.type {i} {16 if i == keyboard else 32 + i}" for i in range(MODULES)]


# the pins of the modules' places, each of its own
def address(i, phase):
    return 100 + i if phase != 1 else 60 + 2 * i


MODULE = Act("PoNET", phases=2, before=replug(
    types(None) + [f"field ponet.address {i} {address(i, 0)}" for i in range(MODULES)]
    + [f"field ponet.size {i} {4 + i % 12}" for i in range(MODULES)]
    + [f"field ponet.version {i} {50 + i}" for i in range(MODULES)]))
MODULE_AGAIN = Act("PoNET, found again", phases=1, before=replug(
    [f"field ponet.type {i} {70 + i}" for i in range(MODULES)]
    + [f"field ponet.address {i} {address(i, 1)}" for i in range(MODULES)]
    + [f"field ponet.size {i} {5 + i % 11}" for i in range(MODULES)]
    + [f"field ponet.options {i} {16}" for i in range(MODULES)]
    + [f"field ponet.version {i} {80 + i}" for i in range(MODULES)]))
GONE = Act("PoNET, modules gone", phases=1, before=replug(
    [f"module {i} off" for i in range(MODULES)]))


def word(i, k, phase):
    return sum((16 * i + 4 * k + byte + 1 + 100 * phase) % 256 << 8 * byte for byte in range(4))


@MODULE.rule(r"PoNET\.(\d\d)\.in-(\d)")
def _(step, phase, i, k):
    for byte in range(4):
        step.sim(f"field ponet.in {16 * i + 4 * k + byte} {word(i, k, phase) >> 8 * byte & 255}")
    step.shows(word(i, k, phase))


@MODULE.rule(r"PoNET\.(\d+)\.digin\.(\d+)\.in")
def _(step, phase, i, k):
    step.shows(word(i, k // 4, phase) >> 8 * (k % 4) & 255)


@MODULE.rule(r"PoNET\.(\d\d)\.out-(\d)")
def _(step, phase, i, k):
    value = word(i, k, phase) ^ 0x01020408
    step.set(value)
    for byte in range(4):
        step.device("ponet.out", 16 * i + 4 * k + byte, value >> 8 * byte & 255)


@MODULE.rule(r"PoNET\.(\d\d)\.brightness")
def _(step, phase, i):
    step.set(20 + 5 * i + phase)
    step.device("ponet.brightness", i, 20 + 5 * i + phase)


@MODULE.rule(r"PoNET\.(\d\d)\.light")
def _(step, phase, i):
    if not phase:
        step.shows(10 + i)


FACTS = {"type": (lambda i: 32 + i, lambda i: 70 + i),
         "address": (lambda i: address(i, 0), lambda i: address(i, 1)),
         "size": (lambda i: 4 + i % 12, lambda i: 5 + i % 11),
         "version": (lambda i: 50 + i, lambda i: 80 + i),
         "options": (lambda i: 0xeb, lambda i: 0xfb)}
OLD_FACTS = {"moduleType": "type", "i2cAddress": "address", "moduleSize": "size",
             "moduleOptions": "options"}


def fact(which):
    def rule(step, phase, i, what):
        step.shows(FACTS[OLD_FACTS.get(what, what)][which](i))
    return rule


for _act, _which in ((MODULE, 0), (MODULE_AGAIN, 1)):
    _act.rule(r"PoNET\.(\d\d)\.(type|address|size|version|options)")(fact(_which))
    _act.rule(r"PoNET\.(\d+)\.(moduleType|i2cAddress|moduleSize|moduleOptions)")(fact(_which))


@MODULE.rule(r"PoNET\.(\d\d)\.present")
def _(step, phase, i):
    step.shows(True)


@MODULE.rule(r"PoNET\.(?:state|PoNETstatus)")
def _(step, phase):
    step.shows(10)


@MODULE.rule(r"PoNET\.(?:count|DevCount)")
def _(step, phase):
    step.shows(16)


FAILING = Act("PoNET, bad data", phases=2)


@FAILING.rule(r"PoNET\.(\d\d)\.status")
def _(step, phase, i):
    value = (40 + i, 0)[phase]
    step.sim(f"field ponet.status {i} {value}")
    step.shows(value)


@FAILING.rule(r"PoNET\.(\d\d)\.failures")
def _(step, phase, i):
    step.shows(0 if phase else (lambda value: value > 2), state="some")


@FAILING.rule(r"PoNET\.(\d\d)\.present")
def _(step, phase, i):
    step.shows(bool(phase))


WORDS_OLD = Act("PoNET outputs, older names", phases=2, before=lambda m: set_all(
    m, {"legacy.ponet-out-follows": True}
    | {f"PoNET.{i:02d}.out-{k}": 0 for i in range(MODULES) for k in range(4)}))
FOLLOWS = Act("PoNET outputs, older names followed or not", phases=2)


@WORDS_OLD.rule(r"PoNET\.(\d+)\.digout\.(\d+)\.out")
def _(step, phase, i, k):
    value = (16 * i + k + 1 + 77 * phase) % 255 + 1
    step.set(value)
    step.device("ponet.out", 16 * i + k, value)


@FOLLOWS.rule(r"legacy\.ponet-out-follows")
def _(step, phase):
    step.set(1 + phase, "PoNET.3.digout.2.out")
    step.set(bool(phase))
    step.device("ponet.out", 50, 2 if phase else 0)


@GONE.rule(r"PoNET\.(?:count|DevCount)")
def _(step, phase):
    step.shows(0)


@GONE.rule(r"PoNET\.(\d\d)\.light")
def _(step, phase, i):
    step.shows(0)


NO_BUS = Act("PoNET not ready", phases=1)


@NO_BUS.rule(r"PoNET\.(?:state|PoNETstatus)")
def _(step, phase):
    step.sim("field ponet.state 0 0")
    step.shows(0)


ACTS = [MODULE, MODULE_AGAIN, FAILING, WORDS_OLD, FOLLOWS, GONE, NO_BUS]
