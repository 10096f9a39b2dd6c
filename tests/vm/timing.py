# SPDX-License-Identifier: GPL-2.0-or-later
"""What the virtual machine that counts instructions has measured: into timing.md and
timing.json, and judged.

An instruction is 8 ns there and nothing else takes time, so these are counts of
instructions, and a change in them is a change of the code (ours, the kernel's or the
emulator's), never the host's mood. The daemon's wake-ups are those in its recorder,
each to the nanosecond. cyclictest counts whole microseconds, rounded down.

How old data are when LinuxCNC reads them is held against the device's round trip and
100 us of a processor that does a thousand million instructions a second, eight times
this one's pace. One read in a hundred may find older ones; two in a hundred fail, for a
machine that is a few cycles from a limit must not fail one day with a new kernel.
"""
import json
import statistics
import struct

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
# daemon/recorder/ring.h: the file's head, then slots of a fixed size; of a cycle's the tick and the wake-up
RECORDER_HEAD, RECORDER_SLOT, RECORDER_KIND, RECORDER_CYCLE = 4096, 128, 38, 4
RECORDER_TIMES = struct.Struct("<56x2Q")


def percentile(values, part):
    return sorted(values)[min(len(values) - 1, int(part * len(values)))]


def cyclictest_ns(path):
    """Of --histfile: lines "MICROSECONDS COUNT", comments begin with #."""
    rows = [line.split() for line in path.read_text(encoding="utf-8").splitlines() if line and line[0] != "#"]
    return [int(micros) * 1000 for micros, count in rows for _ in range(int(count))]


def pokeysd_ns(path):
    """From each tick to the thread, of a copy of the recorder's file."""
    record = path.read_bytes()
    slots = (record[at:at + RECORDER_SLOT] for at in range(RECORDER_HEAD, len(record), RECORDER_SLOT))
    times = (RECORDER_TIMES.unpack_from(slot) for slot in slots if slot[RECORDER_KIND] == RECORDER_CYCLE)
    return [woke - tick for tick, woke in times]


def wake_ups(out):
    """Of either's two starts that one whose ticks did not meet the kernel's."""
    def better(read, pattern):
        return min((read(path) for path in out.glob(pattern)), key=statistics.mean)

    found = {"cyclictest": better(cyclictest_ns, "cyclictest-*.histogram"), "pokeysd": better(pokeysd_ns, "recorder-*")}
    return {name: {"samples": len(values), "mean_us": round(statistics.mean(values) / 1000, 3),
                   **{part: percentile(values, where) / 1000 for part, where in PARTS.items()}}
            for name, values in found.items()}


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
    p99 = percentile(age, PARTS["p99"])
    limit = round_trip + AGE_BEYOND_INSTRUCTIONS * NS_PER_INSTRUCTION / 1000
    return {"samples": len(age), "round_trip_us": round_trip, "p50_us": statistics.median(age), "p99_us": p99,
            "most_us": age[-1], "beyond_instructions": round((p99 - round_trip) * 1000 / NS_PER_INSTRUCTION),
            "late": sum(value > limit for value in age) / len(age)}


def verdict(name, good, why):
    return f"ok {name}: {why}" if good else f"FAIL {name}: {why}"


def lines_of(found):
    theirs, ours = found["wake_up"]["cyclictest"], found["wake_up"]["pokeysd"]
    for name in PARTS:
        ratio = ours[name] / theirs[name]
        yield verdict(f"wake_up_{name}_near_cyclictest", ratio <= WAKE_UP_RATIO,
                      f"cyclictest {theirs[name]:.0f} us, pokeysd {ours[name]:.1f} us, {ratio:.2f} of it"
                      f" (limit {WAKE_UP_RATIO})")
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
        " cycles of 4 ms. No model of a real processor: what is far apart here is far apart there, and nothing more.", "",
        "| from the timer's expiry to the thread, µs | p50 | p99 | mean | samples |", "|---|---|---|---|---|",
        *(f"| {name} | {row['p50']:.1f} | {row['p99']:.1f} | {row['mean_us']:.1f} | {row['samples']} |"
          for name, row in found["wake_up"].items()), "",
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
