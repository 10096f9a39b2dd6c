# SPDX-License-Identifier: GPL-2.0-or-later
"""The daemon beside clients that ask the same two questions of the same simulator."""
from bench import PERIOD_US
from figures import Figure, Skip, middle, number, ratios, table, total, us
from guarded import guard, mounts, need_guard, whole_checksums

TITLE = f"Round trip: 0xCC and pulse engine status, once every {PERIOD_US} µs"
SECONDS = 170
CLIENTS = {"blocking": "sendto, select, recvfrom, one question after the other (as the vendor's library)",
           "sleeping": "all at once, poll, recv", "spinning": "all at once, recv in a tight loop",
           "batching": "sendmmsg, recvmmsg in a tight loop",
           "ring": "bare io_uring, sleeping", "ring-spin": "bare io_uring, spinning",
           "ring-napi": "bare io_uring, NAPI registered", "xdp": "bare AF_XDP (copy mode), spinning"}
DAEMONS = {"sleep": ("pokeysd, mode sleep", {"mode": "sleep"}),
           "spin": ("pokeysd, mode spin", {"mode": "spin"}),
           "socket": ("pokeysd, mode sleep, transport socket", {"mode": "sleep", "transport": "socket"}),
           "spin-socket": ("pokeysd, mode spin, transport socket", {"mode": "spin", "transport": "socket"})}
HANDED = {"spin-xdp": ("pokeysd, mode spin, transport xdp", {"mode": "spin", "transport": "xdp"})}
POLLED = {"sleep-napi": ("pokeysd, mode napi, busy-poll-us 50", {"mode": "napi", "busy_poll_us": 50})}
ORDER = ("spinning", "spin", "spin-socket", "spin-xdp", "xdp", "ring-spin", "batching",
         "blocking", "sleep", "ring", "socket", "sleeping", "sleep-napi", "ring-napi")
NAMES = {**CLIENTS, **{name: text for name, (text, _) in {**DAEMONS, **HANDED, **POLLED}.items()}}


def behind_guard(bench, keys):
    """The guard makes the socket and hands it over, so it is there first."""
    need_guard(bench)
    keys = {**keys, "interface": bench.interface}
    with mounts(), whole_checksums(bench):
        bench.configure(keys, {bench.device: {"address": bench.address}})
        with guard(bench):
            return bench.daemon(**keys)


def one(bench, name):
    if name in CLIENTS:
        return bench.client(name)
    if name in DAEMONS:
        return bench.daemon(**DAEMONS[name][1])
    if name in HANDED:
        return behind_guard(bench, HANDED[name][1])
    with bench.polled_interface():
        return bench.daemon(**POLLED[name][1])


def measure(bench):
    runs, missing = {name: [] for name in NAMES}, {}
    bench.start_fast_simulator()
    for name in bench.contests("round trips", ORDER):
        if name in missing:
            continue
        try:
            runs[name].append(one(bench, name))
        except Skip as why:
            missing[name] = str(why)
            bench.say(f"without {NAMES[name]}: {why}")
    return {"runs": {name: found for name, found in runs.items() if name not in missing}, "missing": missing}


def against(runs, name, base, path, what, most=None, readme=""):
    """A contender's figure to another's, if both were there."""
    if name not in runs or base not in runs:
        return []
    value, low, high = ratios(runs[name], runs[base], path, "p50_ns")
    return [Figure(f"{NAMES[name]}, {what}: ratio to {NAMES[base]}", value, "",
                   total(runs[name], path, "samples"), low, high, most, readme)]


def figures(found):
    runs = found["runs"]
    spin, low, high = middle(runs["spin"], "all", "p50_ns")
    asleep = middle(runs["sleep"], "all", "p50_ns")
    samples = total(runs["spin"], "all", "samples")
    return [
        Figure("pokeysd, mode spin: from the start of the cycle to both fast answers published", spin and spin / 1000,
               "µs", samples, low and low / 1000, high and high / 1000,
               readme="start of the cycle to both fast replies, mode `spin`"),
        *against(runs, "spin", "spinning", "round_trip", "one round trip", 1.10,
                 "one round trip, mode `spin`: ratio to a bare socket in a tight loop"),
        *against(runs, "spin-socket", "spinning", "round_trip", "one round trip", 1.10,
                 "the same with `transport = socket`"),
        *against(runs, "spin-xdp", "spinning", "round_trip", "one round trip", 1.10,
                 "the same with `transport = xdp`"),
        *against(runs, "spin", "spinning", "all", "from the start of the cycle"),
        *against(runs, "spin", "ring-spin", "all", "from the start of the cycle"),
        *against(runs, "spin", "xdp", "all", "from the start of the cycle"),
        Figure("pokeysd, mode sleep: from the start of the cycle to both fast answers published",
               asleep[0] and asleep[0] / 1000, "µs", total(runs["sleep"], "all", "samples"), asleep[1] and asleep[1] / 1000,
               asleep[2] and asleep[2] / 1000, readme="start of the cycle to both fast replies, mode `sleep`"),
        *against(runs, "sleep", "sleeping", "round_trip", "one round trip", 1.10),
        *against(runs, "sleep", "blocking", "all", "from the start of the cycle", 1.10,
                 "the same: ratio to a blocking client that sends one request after the other"),
        *against(runs, "sleep", "ring", "all", "from the start of the cycle"),
        *against(runs, "sleep-napi", "ring-napi", "all", "from the start of the cycle", 1.10),
        Figure("pokeysd, mode sleep: processor time a cycle", middle(runs["sleep"], "cpu_ns")[0] / 1000, "µs",
               total(runs["sleep"], "cycles"), readme="CPU time per cycle, mode `sleep`"),
    ]


def report(found):
    rows = []
    runs = found["runs"]
    for name, contender in runs.items():
        whole, ratio = middle(contender, "all", "p50_ns"), ratios(contender, runs["spinning"], "all", "p50_ns")
        rows.append((NAMES[name], us(middle(contender, "round_trip", "p50_ns")[0]), us(whole[0]),
                     f"{us(whole[1])} to {us(whole[2])}", number(ratio[0]),
                     us(middle(contender, "all", "p99_ns")[0]), us(middle(contender, "cpu_ns")[0]),
                     total(contender, "all", "samples"), total(contender, "lost")))
    missing = [f"- without {NAMES[name]}: {why}" for name, why in found["missing"].items()]
    return ["Same simulator (service time 0, spinning on the other core) behind a veth pair. From the start of the cycle:"
            " until a client has all answers in its hands, until pokeysd has published them. Who sleeps pays for his"
            " wake-up in it; who spins is awake before the tick. A round trip is that of the cycle's last answer, since it"
            " was asked for: of two that are on their way together, or of one alone where a client asks one after the"
            " other; pokeysd's ends with the kernel's receive stamp, a client's when it has the answer. A cycle that pokeysd published without an answer counts"
            " as one of a whole period.", "",
            *table(("contender", "round trip p50 µs", "from the start of the cycle p50 µs", "95 % interval",
                    "ratio to spinning socket", "from the start of the cycle p99 µs", "processor µs a cycle",
                    "samples", "lost"), rows), *(["", *missing] if missing else [])]
