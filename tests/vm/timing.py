# SPDX-License-Identifier: GPL-2.0-or-later
"""What the virtual machine that counts instructions has measured: into timing.md and
timing.json, and judged.

An instruction is 8 ns there and nothing else takes time, so these are counts of
instructions, and a change in them is a change of the code (ours, the kernel's or the
emulator's), never the host's mood. The daemon's wake-up is known by its histogram,
whose buckets are a fifth wide: it is judged by the lower end of the bucket, so that
only what is certainly beyond the limit fails.

How old data are when LinuxCNC reads them is held against the device's round trip and
100 us of a processor that does a thousand million instructions a second, eight times
this one's pace. One read in a hundred may find older ones; two in a hundred fail, for a
machine that is a few cycles from a limit must not fail one day with a new kernel.
"""
import json
import statistics

SHIFT = 3
NS_PER_INSTRUCTION = 1 << SHIFT
WAKE_UP_RATIO = 1.2
# 12,128 and 8,020 measured (Linux 6.1-rt, gcc 12), and a tenth more: names=both, a 57CNC
# with the preset demo, nothing linked.
HAL_INSTRUCTIONS = 22000
AGE_BEYOND_INSTRUCTIONS = 100_000
AGES = {"round_trip_us": "round trip, median", "p50_us": "age of the data at a read, p50", "p99_us": "p99", "most_us": "most"}
LATE_TARGET, LATE_LIMIT = 0.01, 0.02
PARTS = {"p50": 0.5, "p99": 0.99}
# a bucket of the daemon's histograms: a quarter of an octave
BUCKETS = [64 * 2 ** octave * (4 + quarter) / 4 / 1000 for octave in range(26) for quarter in range(4)]


def histogram_percentile(path, part):
    """Of cyclictest's --histfile: lines "MICROSECONDS COUNT", comments begin with #."""
    rows = [line.split() for line in path.read_text(encoding="utf-8").splitlines() if line and line[0] != "#"]
    counts = [(int(row[0]), int(row[1])) for row in rows]
    wanted, seen = part * sum(count for _, count in counts), 0
    for value, count in counts:
        seen += count
        if seen >= wanted:
            return value
    return counts[-1][0]


def bucket_begin(upper_us):
    """Where the bucket begins that ends there; a percentile of pokeysctl is such an end."""
    return max(begin for begin in [0, *BUCKETS] if begin < upper_us * 0.999)


def wake_ups(out):
    """The daemon's are of that start whose ticks did not meet the kernel's."""
    daemon = min((json.loads(path.read_text(encoding="utf-8"))["devices"][0]["diag"]["latency_us"]["wakeup"]
                  for path in out.glob("status-*.json")), key=lambda start: start["mean"])
    return {name: {"cyclictest_us": histogram_percentile(out / "cyclictest.histogram", part),
                   "pokeysd_from_us": bucket_begin(daemon[name]), "pokeysd_to_us": daemon[name]}
            for name, part in PARTS.items()} | {"samples": daemon["count"], "mean_us": daemon["mean"]}


def hal_instructions(out):
    """Medians; the first calls after loading do more than the others."""
    rows = [line.split() for line in (out / "hal-times").read_text(encoding="utf-8").splitlines()]
    return {funct: round(statistics.median(int(row[i]) for row in rows) / NS_PER_INSTRUCTION)
            for i, funct in enumerate(("read", "write"))}


def ages(out):
    """Of the data at each read, and the round trip that the daemon last had; halsampler's lines."""
    rows = [[float(word) for word in line.split()]
            for line in (out / "ages").read_text(encoding="utf-8").splitlines() if not line.startswith("overrun")]
    age, round_trip = sorted(row[0] for row in rows), statistics.median(row[1] for row in rows)
    p99 = age[min(len(age) - 1, int(PARTS["p99"] * len(age)))]
    limit = round_trip + AGE_BEYOND_INSTRUCTIONS * NS_PER_INSTRUCTION / 1000
    return {"samples": len(age), "round_trip_us": round_trip, "p50_us": statistics.median(age), "p99_us": p99,
            "most_us": age[-1], "beyond_instructions": round((p99 - round_trip) * 1000 / NS_PER_INSTRUCTION),
            "late": sum(value > limit for value in age) / len(age)}


def verdict(name, good, why):
    return f"ok {name}: {why}" if good else f"FAIL {name}: {why}"


def lines_of(found):
    for name in PARTS:
        row = found["wake_up"][name]
        ratio = row["pokeysd_from_us"] / row["cyclictest_us"]
        yield verdict(f"wake_up_{name}_near_cyclictest", ratio <= WAKE_UP_RATIO,
                      f"cyclictest {row['cyclictest_us']} us, pokeysd {row['pokeysd_from_us']:.0f} to"
                      f" {row['pokeysd_to_us']:.0f} us, at least {ratio:.2f} of it (limit {WAKE_UP_RATIO})")
    count = sum(found["hal_instructions"].values())
    yield verdict("read_and_write_within_their_budget", count <= HAL_INSTRUCTIONS,
                  f"read {found['hal_instructions']['read']} and write {found['hal_instructions']['write']}"
                  f" instructions, budget {HAL_INSTRUCTIONS}")
    row = found["age_at_read"]
    yield verdict("reads_find_data_just_published", row["late"] <= LATE_LIMIT,
                  f"p99 {row['p99_us']:.0f} us, the round trip {row['round_trip_us']:.0f} us and"
                  f" {row['beyond_instructions']} instructions; {100 * row['late']:.1f} % of {row['samples']} reads found"
                  f" data older than the round trip and {AGE_BEYOND_INSTRUCTIONS} instructions (target"
                  f" {100 * LATE_TARGET:g} %, limit {100 * LATE_LIMIT:g} %)")


def report(found, lines):
    return "\n".join([
        "# Timing on PREEMPT_RT, by counted instructions", "",
        f"Linux {found['kernel']}, one emulated processor, {NS_PER_INSTRUCTION} ns an instruction, stress-ng on it;"
        f" {found['wake_up']['samples']} cycles of 4 ms. No model of a real processor: what is far apart here is far"
        " apart there, and nothing more.", "",
        "| from the timer's expiry to the thread | cyclictest µs | pokeysd µs |", "|---|---|---|",
        *(f"| {name} | {found['wake_up'][name]['cyclictest_us']} | {found['wake_up'][name]['pokeysd_from_us']:.0f} to"
          f" {found['wake_up'][name]['pokeysd_to_us']:.0f} |" for name in PARTS), "",
        "| function | instructions |", "|---|---|",
        *(f"| `pokeys.0.{funct}` | {count} |" for funct, count in found["hal_instructions"].items()), "",
        f"Phase lock, the machine idle, {found['age_at_read']['samples']} reads:", "",
        "| | µs |", "|---|---|", *(f"| {title} | {found['age_at_read'][key]:.0f} |" for key, title in AGES.items()), "",
        *(f"- {line}" for line in lines), ""])


def judge(folder):
    """Lines as the guest's; timing.md and timing.json are left in the folder."""
    out = folder / "out"
    found = {"kernel": (out / "kernel").read_text(encoding="utf-8").strip(), "wake_up": wake_ups(out),
             "hal_instructions": hal_instructions(out), "age_at_read": ages(out)}
    lines = list(lines_of(found))
    (folder / "timing.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    (folder / "timing.md").write_text(report(found, lines), encoding="utf-8")
    return lines
