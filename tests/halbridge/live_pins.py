#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Pins in a real HAL against images that are moved by hand, both ways.

usage: live_pins.py MODULE.so HOST-PROGRAM
"""
import math
import re
import time
import hal_live

LOST = ("connection to 'mill' lost: nothing new from pokeysd; it was held up, or does not run (pokeysctl status)",
        "connection to 'mill' lost: data ")
ARM_INDEX = 2
DONE, REFUSED = 1, 4


def connected(rig, *parameters):
    host = rig.host()
    rig.hal.start(f"runtime={rig.runtime}", *parameters)
    rig.hal.becomes("connected", True)
    rig.hal.becomes("commander", True)
    return rig.hal, host


def inputs_reach_their_pins(rig):
    hal, host = connected(rig)
    for pin in (0, 7, 8, 54):
        assert hal.get(f"pin.{pin:02}.in") is False
        host.say(f"set in {pin} 1")
        hal.becomes(f"pin.{pin:02}.in", True)
        hal.becomes(f"pin.{pin:02}.in-not", False)
        host.say(f"set in {pin} 0")
        hal.becomes(f"pin.{pin:02}.in-not", True)


def outputs_follow_pins_that_are_outputs(rig):
    hal, host = connected(rig)
    hal.set("pin.03.out", 1)
    hal.set("pin.04.out", 1)
    host.beats(hal_live.PIN_TURNS)
    assert host.command()["mask"] == "00" * 8
    host.say("set own 3 1")
    host.say("set own 30 1")
    host.sees("mask", "0800004000000000")
    host.sees("out", "0800000000000000")
    hal.set("pin.30.out", 1)
    host.sees("out", "0800004000000000")
    hal.set("pin.03.out", 0)
    host.sees("out", "0000004000000000")


def outputs_follow_linked_pins(rig):
    hal, host = connected(rig)
    host.say("set own 11 1")
    host.say("set in 2 1")
    hal.ok("halcmd net through pokeys.0.pin.02.in pokeys.0.pin.11.out")
    host.sees("out", "0008000000000000")
    host.say("set in 2 0")
    host.sees("out", "0000000000000000")


def analog_values_are_scaled(rig):
    hal, host = connected(rig)
    host.say("set analog 6 2048")
    hal.becomes("adc.06.raw", 2048)
    hal.becomes("adc.06.value", lambda have: math.isclose(have, 1.65))
    hal.set("adc.06.scale", 100)
    hal.set("adc.06.offset", 5)
    hal.becomes("adc.06.value", 160)


def encoders_count_reset_and_take_the_index(rig):
    hal, host = connected(rig)
    hal.set("encoder.25.scale", 100)
    host.say("set encoder 25 4000")
    hal.becomes("encoder.25.count", 4000)
    hal.becomes("encoder.25.position", 40)
    hal.set("encoder.25.reset", 1)
    hal.becomes("encoder.25.count", 0)
    hal.set("encoder.25.reset", 0)
    host.beats(2)       # it has been seen
    host.say("set encoder 25 4007")
    hal.becomes("encoder.25.count", 7)
    hal.set("encoder.25.index-enable", 1)
    host.sees("head", "1")
    host.say(f"ack 0 {DONE}")
    host.beats(20)
    assert hal.get("encoder.25.index-enable") is True
    host.say("set encoder 25 3")
    host.say("set index 25 1")
    hal.becomes("encoder.25.index-enable", False)
    hal.becomes("encoder.25.count", 3)


def a_refused_index_is_said(rig):
    hal, host = connected(rig)
    hal.set("encoder.02.index-enable", 1)
    host.sees("head", "1")
    host.say(f"ack 0 {REFUSED}")
    hal.becomes("one-shot-failed-count", 1)
    host.sees("head", "2")      # and tries again
    assert hal.get("encoder.02.index-enable") is True
    hal.says("pokeys.0.encoder.02.index-enable")


def joints_move_both_ways(rig):
    hal, host = connected(rig)
    hal.set("joint.01.scale", -200)
    hal.set("joint.01.pos-cmd", 12.5)
    hal.set("joint.01.vel-cmd", 2)
    hal.set("joint.01.enable", 1)
    host.sees("axis1", "-2500,-400,1,1")
    host.say("axis 1 position -2500")
    hal.becomes("joint.01.pos-fb", 12.5)
    assert hal.get("joint.01.in-position") is False
    host.say("axis 1 reference -2500")
    host.say("axis 1 in-position 1")
    hal.becomes("joint.01.in-position", True)
    for field, pin in (("error", "error"), ("enabled", "enabled"), ("homed", "homed"),
                       ("limit-minus", "limit-neg"), ("limit-plus", "limit-pos"),
                       ("home", "home-sw"), ("soft-limit", "soft-limit")):
        assert hal.get(f"joint.01.{pin}") is False
        host.say(f"axis 1 {field} 1")
        hal.becomes(f"joint.01.{pin}", True)
    host.say("axis 1 state 30")
    hal.becomes("joint.01.state", 30)


def machine_on_and_its_answers(rig):
    hal, host = connected(rig)
    hal.set("machine-is-on", 1)
    host.sees("flags", "1")
    host.say("set flags 0x12")      # commander, needs edge
    hal.becomes("needs-edge", True)
    host.say("set flags 0x0a")      # commander, machine on
    hal.becomes("machine-on-permitted", True)
    hal.becomes("needs-edge", False)
    host.say("set flags 0x86")      # commander, safe, bad command
    hal.becomes("safe-state", True)
    hal.becomes("command-refused", True)
    hal.set("machine-is-on", 0)
    host.sees("flags", "0")


def bad_numbers_are_refused_and_named_once(rig):
    hal, host = connected(rig)
    hal.ok("halcmd loadrt mux2 count=1 && halcmd addf mux2.0 servo-thread 1")
    hal.set("joint.00.scale", 10)
    hal.ok("halcmd setp mux2.0.in0 3 && halcmd net cmd mux2.0.out pokeys.0.joint.00.pos-cmd")
    host.sees("axis0", "30,0,1,0")
    hal.ok("halcmd setp mux2.0.in1 nan && halcmd setp mux2.0.sel 1")
    hal.becomes("input-refused", True)
    hal.says("pokeys.0.joint.00.pos-cmd = nan")
    host.beats(200)
    assert host.command()["axis0"] == "30,0,1,0"
    assert hal.get("joint.00.refused") is True
    assert hal.get("input-refused-count") == 1
    hal.ok("halcmd setp mux2.0.sel 0")
    hal.becomes("input-refused", False)
    hal.set("encoder.00.scale", 0)
    hal.becomes("input-refused-count", 2)
    hal.says("pokeys.0.encoder.00.scale = 0: must not be 0")
    # what is refused later is said later
    assert hal.said().count("pokeys.0.joint.00.pos-cmd = nan") == 1, hal.said()


def identity_is_shown(rig):
    hal, host = connected(rig)
    host.say("set serial 53386")
    host.say("set hardware 32")
    host.say("set pins 55")
    hal.becomes("devSerial", 53386)
    hal.becomes("info.DeviceTypeID", 32)
    hal.becomes("info.PinCount", 55)
    hal.becomes("info.SerialNumber", 53386)


def packet_errors_do_not_latch(rig):
    hal, host = connected(rig)
    hal.becomes("packet-error-level", 0)
    host.say("set missed 5")
    hal.becomes("packet-error-total", 5)
    host.say("silent 1")
    hal.becomes("packet-error-exceeded", True)
    hal.becomes("stale", True)
    host.say("silent 0")
    hal.becomes("packet-error-exceeded", False)
    hal.becomes("packet-error-level", 0)


def record(hal):
    """stale, age-us and the cycle of each servo period, until samples()."""
    hal.ok("halcmd loadrt sampler depth=20000 cfg=bfu && halcmd addf sampler.0 servo-thread")
    hal.ok("halcmd net s0 pokeys.0.stale sampler.0.pin.0")
    hal.ok("halcmd net s1 pokeys.0.age-us sampler.0.pin.1")
    hal.ok("halcmd net s2 pokeys.0.cycle sampler.0.pin.2")
    hal.ok(f"halsampler -t >{hal.folder}/samples & sampling=$!")
    hal_live.wait("samples", lambda: hal.value("sampler.0.curr-depth") > 0)


def samples(hal):
    hal.ok("halcmd setp sampler.0.enable 0")
    hal_live.wait("the samples are read", lambda: hal.value("sampler.0.curr-depth") == 0)
    hal.ok("kill $sampling; wait $sampling; true")
    rows = [line.split() for line in (hal.folder / "samples").read_text().splitlines()]
    return [(row[1] == "1", float(row[2]), int(row[3])) for row in rows if len(row) == 4]


def a_killed_daemon_is_stale_in_time_and_the_next_one_fresh(rig):
    began = time.monotonic()
    hal, host = connected(rig)
    pid = hal.pid()
    host.say("set encoder 1 777")
    host.say("set in 5 1")
    hal.becomes("encoder.01.count", 777)
    hal.becomes("pin.05.in", True)
    record(hal)
    host.beats(2000)    # whoever says what was lost looks ten times a second, and has seen it work
    host.kill()
    hal.becomes("daemon-alive", False)
    hal.becomes("connected", False)
    assert hal.get("encoder.01.count") == 777 and hal.get("pin.05.in") is True
    # while it lasts, for a short one goes unseen; a machine that was late just before has
    # said the other line, and says one in ten seconds
    hal_live.wait("it says what was lost", lambda: any(line in hal.said() for line in LOST))
    host = rig.host()
    took = hal.becomes("connected", True)
    hal.becomes("commander", True)
    rows = samples(hal)
    unflagged = [age for stale, age, _ in rows if not stale]
    assert rows and unflagged and any(stale for stale, _, _ in rows)
    # no period in which old data were not said to be old, whatever the scheduler did
    assert max(unflagged) <= 10000, f"{max(unflagged)} us old and not stale"
    assert hal.pid() == pid
    # a link that comes and goes, as on a busy machine, is said once in ten seconds
    times = hal.said().count("connection to 'mill' lost: ")
    assert times <= 1 + (time.monotonic() - began) // 10, hal.said()
    print(f"daemon killed: oldest data not called stale {max(unflagged):.0f} us, "
          f"fresh {took:.2f} s after the next one was ready")


def a_daemon_of_another_version_is_refused_in_words(rig):
    host = rig.host()
    manifests = list(rig.runtime.glob("e.*/manifest*"))
    assert len(manifests) == 1, [path.name for path in rig.runtime.glob("e.*/*")]
    text = manifests[0].read_text()
    other = re.sub(r"(?m)^state \d+ ", "state 99 ", text)
    assert other != text
    manifests[0].write_text(other)
    rig.hal.start(f"runtime={rig.runtime}", "devices=mill")
    rig.hal.becomes("attach-state", 2)
    rig.hal.says("state layout 99")
    assert rig.hal.get("connected") is False
    said = [line for line in rig.hal.said().splitlines()
            if line.startswith("pokeys.0: ") and "read and write took" not in line]
    assert len(said) == 1 and "state layout 9" in said[0], said
    print(f"another layout: {said[0]}")
    manifests[0].write_text(text)
    rig.hal.becomes("connected", True)
    host.close()


def a_foreign_writer_is_refused_and_the_pins_keep_theirs(rig):
    hal, host = connected(rig)
    host.say("set encoder 1 777")
    hal.becomes("encoder.01.count", 777)
    host.say("foreign 1")
    hal.becomes("attach-state", 2)
    hal.becomes("stale", True)
    assert hal.get("encoder.01.count") == 777
    hal.says("what is in shared memory is not a state image")
    host.say("foreign 0")
    hal.becomes("connected", True)


hal_live.main([
    inputs_reach_their_pins,
    outputs_follow_pins_that_are_outputs,
    outputs_follow_linked_pins,
    analog_values_are_scaled,
    encoders_count_reset_and_take_the_index,
    a_refused_index_is_said,
    joints_move_both_ways,
    machine_on_and_its_answers,
    bad_numbers_are_refused_and_named_once,
    identity_is_shown,
    packet_errors_do_not_latch,
    a_killed_daemon_is_stale_in_time_and_the_next_one_fresh,
    a_daemon_of_another_version_is_refused_in_words,
    a_foreign_writer_is_refused_and_the_pins_keep_theirs,
])
