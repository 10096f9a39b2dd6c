# SPDX-License-Identifier: GPL-2.0-or-later
"""What a bad wire does to the path: programmes that come with LinuxCNC, over several wires.

They are run faster than they are written, because LinuxCNC's examples are for machines
that are slower than this one. Each ends where it would without the device, to the pulse.
"""
import pathlib
import re

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
    """One programme over one wire; what it says of the path."""
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


def all_wires(m, folder):
    m.switch_on()
    m.home()
    m.sim("probe off")  # the programmes go deeper than the example's work lies
    before = [p - k for p, k in zip(*m.pulses())]
    for programme in PROGRAMMES:
        if not pathlib.Path(programme[1]).exists():
            m.tell(f"{programme[0]}: not tried, as there is no {programme[1]}")
            continue
        for way in WIRES:
            cut(m, folder, programme, way)
            assert [p - k for p, k in zip(*m.pulses())] == before, f"{programme[0]}, {way[0]}: steps were lost"
    wire(m, ())
    highest = max(joint["ferror_highmark"] for joint in m.look().joint[:3])
    m.tell(f"the highest following error that LinuxCNC has seen: {highest:.4f} mm")
    m.tell(m.lost())
    m.tell(f"buffer: {hal.get_value('pokeys.0.engine.buffer-underruns')} underruns, "
           f"{hal.get_value('pokeys.0.engine.buffer-resyncs')} times read back")
