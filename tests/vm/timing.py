# SPDX-License-Identifier: GPL-2.0-or-later
"""What the virtual machine that counts instructions has measured: into timing.md and
timing.json, and judged.

An instruction is 8 ns there and nothing else takes time, so these are counts of
instructions, and a change in them is a change of the code (ours, the kernel's or the
emulator's), never the host's mood. The daemon's wake-up is known by its histogram,
whose buckets are a fifth wide: it is judged by the lower end of the bucket, so that
only what is certainly beyond the limit fails.
"""
import json
import statistics

SHIFT = 3
NS_PER_INSTRUCTION = 1 << SHIFT
WAKE_UP_RATIO = 1.2
# 12,242 and 7,725 measured (Linux 6.1-rt, gcc 12), and a tenth more: names=both, a 57CNC
# with the preset demo, nothing linked.
HAL_INSTRUCTIONS = 22000
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
    daemon = json.loads((out / "status.json").read_text(encoding="utf-8"))["devices"][0]["diag"]["latency_us"]["wakeup"]
    return {name: {"cyclictest_us": histogram_percentile(out / "cyclictest.histogram", part),
                   "pokeysd_from_us": bucket_begin(daemon[name]), "pokeysd_to_us": daemon[name]}
            for name, part in PARTS.items()} | {"samples": daemon["count"], "mean_us": daemon["mean"]}


def hal_instructions(out):
    """Medians; the first calls after loading do more than the others."""
    rows = [line.split() for line in (out / "hal-times").read_text(encoding="utf-8").splitlines()]
    return {funct: round(statistics.median(int(row[i]) for row in rows) / NS_PER_INSTRUCTION)
            for i, funct in enumerate(("read", "write"))}


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
        *(f"- {line}" for line in lines), ""])


def judge(folder):
    """Lines as the guest's; timing.md and timing.json are left in the folder."""
    out = folder / "out"
    found = {"kernel": (out / "kernel").read_text(encoding="utf-8").strip(), "wake_up": wake_ups(out),
             "hal_instructions": hal_instructions(out)}
    lines = list(lines_of(found))
    (folder / "timing.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    (folder / "timing.md").write_text(report(found, lines), encoding="utf-8")
    return lines
