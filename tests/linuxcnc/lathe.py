# SPDX-License-Identifier: GPL-2.0-or-later
"""What the machinist does at the lathe: threads, on a spindle that turns by itself.

A thread is right if Z and the spindle belong together, the same in each pass. Z's
commands and the spindle's turns are recorded in the same periods.

LinuxCNC finds the place of a thread while Z speeds up, by counting servo periods. On a
machine without realtime some of them are late, and then the thread begins elsewhere. Such
a pass is seen by the spindle's turns, which do not wait, and does not count.
"""
import math
import statistics

import hal
import linuxcnc

COUNTS = 4096  # a turn
RATE = 20480  # quadrature steps a second: 300 turns a minute
PITCH = 1.5
HOMED = ((4000, 0), (4000, 0))  # bench.sim's edge, lathe.ini's HOME_OFFSET
THREAD_END = -12  # first-thread.ngc
TRIES = 8
BACK = 2  # device-thread.ngc: on the way back to Z4
SOON = 50  # periods within which a pass has gone some way
# threading.error if packets or servo periods were too late to feed a thread, if none came for a
# long time, or if LinuxCNC was switched off because of that
LATE_ENDS = {0: "LinuxCNC was off", 2: "switched off", 7: "the link was lost", 10: "the motion buffer ran dry"}


def of_pass(samples):
    """(turns, Z commanded, Z counted) of each period from the index on."""
    commands, feedback, _ = samples
    points = [(c[2], c[1], f[1]) for c, f in zip(commands, feedback)]
    begins = [i for i in range(1, len(points)) if points[i][0] < points[i - 1][0] - 0.5]
    assert begins, "no index was recorded"
    return points[begins[-1]:]


def is_late(points):
    """Were servo periods missed, or packets with the spindle's turns? A period is 0.005."""
    return max(b[0] - a[0] for a, b in zip(points, points[1:])) > 0.02


def middle(points):
    zs = [z for _, z, _ in points]
    high, low = max(zs), min(zs)
    return [p for p in points if low + 0.15 * (high - low) < p[1] < high - 0.4 * (high - low)]


def thread_pass(m, name):
    """One pass of 18 mm; where Z would be at 0 turns, commanded and counted. None: was late.

    With its spindle said ($0): without, LinuxCNC 2.9's interpreter takes whatever number
    its memory holds, and ends by a segmentation fault now and then.
    """
    m.move("G53 G0 X-30 Z-42")
    samples = m.sampled(name, lambda: m.move(f"G33 Z-60 K{PITCH} $0"))
    m.settled()
    points = of_pass(samples)
    cut = middle(points)
    assert len(cut) > 50, f"{name}: only {len(cut)} periods of the cut recorded"
    half = cut[:len(cut) // 2]
    pitch = statistics.median((a[1] - b[1]) / (b[0] - a[0]) for a, b in zip(half, cut[-len(half):]))
    begin = [statistics.median(p[i] + PITCH * p[0] for p in cut) for i in (1, 2)]
    late = is_late(points[:100]) or is_late(cut)
    m.tell(f"{name}: {len(cut)} periods, pitch {pitch:.4f} mm, begins at Z {begin[0]:.4f} "
           f"(counted: {begin[1]:.4f}){', was late' if late else ''}")
    assert abs(pitch - PITCH) < (0.2 if late else 0.05) * PITCH, "that is no thread"
    return None if late else begin


def passes_agree(m):
    """Each pass cuts where the one before has cut."""
    good = []
    for number in range(TRIES):
        good += [begin] if (begin := thread_pass(m, f"clean {number}")) else []
        if len(good) == 2:
            break
    else:
        m.tell(f"not tried: that passes agree: this machine is too late for threads, {len(good)} good passes of {TRIES}")
        return
    apart = [abs(a - b) for a, b in zip(*good)]
    assert max(apart) < 0.1 * PITCH, f"passes are {apart} mm apart"
    m.tell(f"two passes {apart[0]:.4f} mm apart as commanded, {apart[1]:.4f} mm as counted")


def waits_for_the_spindle(m):
    """A spindle that stands holds the pass until it turns at its speed."""
    m.move("G53 G0 X-30 Z-42")
    m.sim("encoder 25 rate 0")
    m.until("the spindle standing", lambda _: not hal.get_value("spindle.0.at-speed"), 60)
    m.mdi(f"G33 Z-60 K{PITCH} $0")
    m.settled()
    m.stays("without the spindle", *m.pulses())
    m.sim(f"encoder 25 rate {RATE}")
    m.until("the pass done", lambda s: s.inpos and s.interp_state == linuxcnc.INTERP_IDLE, 60)
    m.settled()
    want = round(-60 * m.scale[1] + hal.get_value("joint.1.motor-offset") * m.scale[1])
    assert m.pulses()[0][1] == want, f"Z ends at {m.pulses()[0][1]} pulses, should be {want}"
    m.tell("a standing spindle held the pass; then it went to its end, to the pulse")


def programme(m):
    """first-thread.ngc: passes by G76, all of them begun at an index."""
    m.move("G53 G0 X-5 Z-5")
    samples = m.sampled("first-thread", lambda: m.run("first-thread.ngc"))
    m.settled()
    assert m.look().task_state == linuxcnc.STATE_ON, f"switched off: {m.said}"
    turns = [c[2] for c in samples[0]]
    begun = sum(b < a - 0.5 for a, b in zip(turns, turns[1:]))
    assert begun >= 3, f"only {begun} passes were begun at an index"
    # tool and work offsets away: Z0 is at machine Z-45, X0 at machine X-40
    lowest = min(c[1] - hal.get_value("joint.1.motor-offset") for c in samples[0])
    assert abs(lowest - (THREAD_END - 45)) < 0.5, f"the thread ends at Z {lowest + 45}"
    have = m.pulses()[0][0]
    want = round(hal.get_value("joint.0.motor-offset") * m.scale[0])
    assert have == want, f"X ends at {have} pulses, should be {want}"
    m.tell(f"first-thread.ngc: {begun} passes, the thread ends at Z {lowest + 45:.4f}")


# ---- threads of the device's own: device-thread.hal


def device_passes(samples):
    """Of each pass (turns, Z of the machine from the work's end) in the middle of its way.

    Passes begin at Z4. Where feedback comes late it seems to step back a little, also at Z0,
    or for some periods is where it was long ago: no pass, which goes some way.
    """
    origin = hal.get_value("joint.1.motor-offset") - 45
    points = [(c[2], c[1] - c[3] - origin) for c in samples[0]]
    passes, back = [], True
    for now, later in zip(points, points[SOON:]):
        back |= now[1] >= BACK
        if -10 < now[1] < 0 and later[1] < now[1] - 0.1:
            if back:
                passes.append([])
            passes[-1].append(now)
            back = False
    return [points for points in passes if points[0][1] - points[-1][1] > PITCH]


def is_over(m):
    """The machine is off, or the programme has ended."""
    now = m.look()
    return now.task_state != linuxcnc.STATE_ON or now.interp_state == linuxcnc.INTERP_IDLE


def the_spindle_slows_down(m):
    """In the second pass, and comes back when that is done."""
    for number in range(2):
        m.until("the spindle leads", lambda _: hal.get_value("pokeys.0.threading.active") or is_over(m), 60)
        if number:
            m.sim(f"encoder 25 rate {RATE * 2 // 3}")
        m.until("the pass ended", lambda _: not hal.get_value("pokeys.0.threading.active"), 60)
    m.sim(f"encoder 25 rate {RATE}")
    m.until("the programme done", lambda s: s.interp_state == linuxcnc.INTERP_IDLE, 120)


def delays():
    """What tells that daemon or simulator had no processor when they needed it."""
    return hal.get_value("pokeys.0.cycles-skipped") + hal.get_value("pokeys.0.packet-error-total")


def comes_again(m, name, before):
    """The device has stopped in a thread, which it may where packets were late; the operator
    resets the machine."""
    error = hal.get_value("pokeys.0.threading.error")
    assert error in LATE_ENDS, f"{name}: threading.error {error}: {m.said}"
    m.tell(f"{name}: {LATE_ENDS[error]}; {delays() - before} cycles were missed or packets lost")
    m.switch_on()
    m.move("G53 G0 X0 Z0")


def the_device_cuts(m, name):
    """device-thread.ngc: its two passes, a list of (turns, Z) each. None: the machine was too late."""
    before = delays()

    def work():
        m.begin("device-thread.ngc")
        the_spindle_slows_down(m)
    samples = m.sampled(name, work)
    if m.stat.task_state != linuxcnc.STATE_ON or hal.get_value("pokeys.0.threading.error"):
        return comes_again(m, name, before)
    m.settled()
    passes = device_passes(samples)
    assert len(passes) == 2, f"{name}: {[len(points) for points in passes]} periods of passes were cut; {m.said}"
    return passes


def passes_apart(m, name, passes):
    """By how much they miss one another. None: servo periods were late."""
    late = any(is_late(points) for points in passes)
    for number, points in enumerate(passes):
        half = points[:len(points) // 2]
        pitch = statistics.median((a[1] - b[1]) / (b[0] - a[0]) for a, b in zip(half, points[-len(half):]))
        m.tell(f"{name}: pass {number + 1}: {len(points)} periods, pitch {pitch:.4f} mm")
        assert abs(pitch - PITCH) < (0.2 if late else 0.05) * PITCH, "that is no thread"
    begin = [statistics.median(z + PITCH * turns for turns, z in points) for points in passes]
    apart = abs(math.remainder(begin[0] - begin[1], PITCH))
    m.tell(f"{name}: passes {apart:.4f} mm apart{', was late' if late else ''}")
    return None if late else apart


def device_thread(m):
    m.switch_on()
    m.homes_at("homed", HOMED)
    before = delays()
    for number in range(TRIES // 2):
        passes = the_device_cuts(m, f"device {number}")
        apart = passes and passes_apart(m, f"device {number}", passes)
        if apart is not None:
            assert apart < 0.1 * PITCH, f"passes are {apart} mm apart"
            break
    else:
        assert delays() > before, "no thread was cut without loss, and nothing was ever late"
        m.tell(f"not tried: passes of a thread by the device: this machine is too late, {TRIES // 2} times")
    m.lossy()
    for number in range(TRIES // 2):
        if passes := the_device_cuts(m, f"lossy {number}"):
            passes_apart(m, f"lossy {number}", passes)
            break
    else:
        # device / thread_stop asserts in virtual time when loss must end a thread and when it must not
        m.tell(f"with 1 % loss all {TRIES // 2} threads stopped")
    m.tell(f"lossy: {m.lost()}")


def lathe(m):
    m.switch_on()
    m.homes_at("homed", HOMED)
    m.move("M3 S300")
    m.until("the spindle at speed", lambda _: hal.get_value("spindle.0.at-speed"), 60)
    m.until("the spindle's output on", lambda _: m.sim("pin 31")["latch"] == "1")
    passes_agree(m)
    waits_for_the_spindle(m)
    m.lossy()
    thread_pass(m, "lossy")     # where it begins suffers, its pitch and its end do not
    m.tell(f"lossy: {m.lost()}")
    m.sim("fault off")
    programme(m)
    m.until("the spindle's output off", lambda _: m.sim("pin 31")["latch"] == "0")
