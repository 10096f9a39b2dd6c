# SPDX-License-Identifier: GPL-2.0-or-later
"""What a bad wire does to the path: programmes that come with LinuxCNC, over several wires.

They are run faster than they are written, because LinuxCNC's examples are for machines
that are slower than this one. Each ends where it would without the device, to the pulse.
"""
import pathlib
import re
import subprocess

import hal

import track

PROGRAMMES = (
    # name, file, its first lines, times as fast; a corner of it is put where the machine has room
    ("tort", "/usr/share/linuxcnc/ncfiles/tort.ngc", 35, 4),
    ("axis", "/usr/share/axis/images/axis.ngc", 45, 6),
)
MOST_FEED = 3000  # mm/min: the 50 mm/s of the example's X and Y
ROOM = "G10 L2 P1 X100 Y90 Z-60"
WIRES = (
    ("clean", ()),
    ("1 %, 0-2 ms", ("loss 0.01", "delay-us 0-2000")),
    ("5 %, 0-5 ms", ("loss 0.05", "delay-us 0-5000")),
    ("bursts of 10 ms", ("burst-every-us 500000", "burst-length-us 10000", "burst-loss 1")),
)


def part_of(text, lines, times):
    """The first lines of a programme, without its pauses and messages, and times as fast."""
    def faster(feed):
        return f"F{min(times * float(feed[1]), MOST_FEED):.0f}"

    kept = [line for line in text.splitlines() if not re.match(r"\s*(m0|m1|\(msg)\b", line, re.IGNORECASE)][:lines]
    return "\n".join([ROOM, "G54", *(re.sub(r"F([0-9.]+)", faster, line) for line in kept), "M5", "M2", ""])


def wire(m, faults):
    m.sim("fault off")
    for words in faults:
        m.sim(f"fault both {words}")


def cut(m, folder, programme, way):
    """One programme over one wire; the samples, and what they say of the path is in the report."""
    name, path, lines, times = programme
    text = part_of(pathlib.Path(path).read_text(encoding="utf-8"), lines, times)
    (folder / f"{name}.ngc").write_text(text, encoding="utf-8")
    m.move("G53 G0 Z-10")
    m.move("G53 G0 X20 Y20")
    wire(m, way[1])
    samples = m.sampled(f"{name}", lambda: m.run(f"{name}.ngc"))
    m.settled()
    for line in track.describe(samples, "XYZ"):
        m.tell(f"{name}, {way[0]}: {line}")
    return samples


def undelayed(m, folder):
    """With motion-type, what LinuxCNC sees is without the delay of the buffer, on a bad wire too."""
    m.switch_on()
    m.home()
    m.sim("probe off")
    lags = []
    for words in ((), ("halcmd", "net", "motion-type", "motion.motion-type", "pokeys.0.motion-type")):
        subprocess.run(words or ("true",), check=True)
        commands, feedback, _ = cut(m, folder, PROGRAMMES[0], WIRES[1])
        lags.append(track.delay(commands, feedback))
    m.tell(f"{PROGRAMMES[0][0]}, {WIRES[1][0]}: LinuxCNC sees {lags[1]} periods of delay with motion-type, {lags[0]} without")
    assert lags[1] < lags[0] / 2, lags


def all_wires(m, folder):
    m.switch_on()
    m.home()
    m.sim("probe off")  # the programmes go deeper than the example's work lies
    before = [p - k for p, k in zip(*m.pulses())]
    # the daemon remembers bad wires for a minute, so the better ones come first
    for way in WIRES:
        for programme in PROGRAMMES:
            if not pathlib.Path(programme[1]).exists():
                m.tell(f"{programme[0]}: not tried, as there is no {programme[1]}")
                continue
            cut(m, folder, programme, way)
            assert [p - k for p, k in zip(*m.pulses())] == before, f"{programme[0]}, {way[0]}: steps were lost"
    wire(m, ())
    m.tell(m.lost())
    m.tell(f"buffer: {hal.get_value('pokeys.0.engine.buffer-underruns')} underruns, "
           f"{hal.get_value('pokeys.0.engine.buffer-resyncs')} times read back")
