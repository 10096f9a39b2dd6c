#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Moves by G-code, on simulated axes of a pulse engine and simulated servo motors: positions, waits, stops, and who
stops them."""
import contextlib
import random
import re
import signal
import socket
import struct
import sys
import time
import types

from bridge import PORT
from heating import Client, nobody_commands
from house import SEED, free_address, main, wait_for
from rig import machine

AXIS = {"mode": "position", "invert": "off", "max-speed": 20000, "max-acceleration": 200000, "pulses-per-unit": 200,
        "limit-minus": "on", "limit-plus": "on", "home": "on", "limit-minus-invert": "off", "limit-plus-invert": "off",
        "home-invert": "off", "limit-minus-pin": "dedicated", "limit-plus-pin": "dedicated", "home-pin": "dedicated",
        "homing-invert": "off", "homing-speed": 24, "homing-return-speed": 15, "homing-algorithm": 131,
        "homing-back-off": 0, "soft-limits": "off"}
MOTOR = {"encoder": 0, "pwm": 0, "direction-pin": 31, "enable-pin": 35, "counts-per-unit": 400, "max-speed": 300, "pid-p": 1,
         "pid-i": 10, "pid-d": 0.01, "velocity-gain": 0.0026, "smooth-s": 0.001, "min-following-error": 20,
         "max-following-error": 40, "max-age-ms": 100, "stall-s": 3, "silent-s": 1, "home-pin": 7, "home-search-speed": -50,
         "home-position": 5, "home-distance": 30}


@contextlib.contextmanager
def mill(servos=None, folder=None, pty=False, **keys):
    """Axes x, y and e of the pulse engine, and motors."""
    where = free_address()
    more = f"[machine]\nkind = pokeys\ndevice = mill\n[telnet]\nlisten = {where}:{PORT}\n[console]\nlevel = user\n"
    if pty:
        more += "[pty]\npath = @folder@/pty\n"
    if folder:
        more = more.replace("[telnet]", f"folder = {folder}\n[telnet]")
    axes = {f"axis.{i}.{key}": value for i, name in enumerate("xye") for key, value in {**AXIS, "name": name}.items()}
    with machine("--preset", "servo-mill", more=more, servos=servos,
                 **{"axes": 3, "generator": "external", "pwm-period": 1250, "heartbeat-timeout-ms": 2000, **axes, **keys}) as (
            house, sim, daemon, gateway):
        house.console = where
        for i in range(3):
            house.ask_sim(sim, "switch", i, "home", -2000000, -4000)
            house.ask_sim(sim, "switch", i, "minus", -2000000, -6000)
            house.ask_sim(sim, "switch", i, "plus", 60000, 2000000)
        yield types.SimpleNamespace(house=house, sim=sim, daemon=daemon, gateway=gateway, one=Client(house))


def do(one, *lines):
    """Each of them is done, without anything to be said."""
    for line in lines:
        said = one.ask(line)
        assert said == ["ok"], (line, said)


def places(shop):
    return [axis["position"] for axis in shop.house.state()["engine"]["axes"][:3]]


def moves(shop):
    before = places(shop)
    wait_for("it moves", lambda: places(shop) != before)


def stand(shop):
    """They stand, and stay there."""
    wait_for("they stand", lambda: not shop.house.state()["moves"]["waiting"], say=shop.house.log)
    last = []

    def still():
        last.append(places(shop))
        return last[-3:] == 3 * [last[-1]]
    wait_for("they stand", still)


def test_positions():
    with mill() as shop:
        one, other = shop.one, Client(shop.house)
        assert one.ask("G1 X10") == ["Error:G1: no feed rate yet; add F with units/min", "ok"]
        do(one, "G1 X10 Y-5 F6000", "M400")
        assert places(shop) == [2000, -1000, 0]
        assert one.ask("M114")[:2] == ["X:10.0000 Y:-5.0000 E:0.0000 Count X:2000 Y:-1000 E:0",
                                       "echo:commanded X:10.0000 Y:-5.0000 E:0.0000"]
        # relative ones, of which none is lost by rounding; of another client they are absolute
        do(one, "G91")
        for _ in range(100):
            do(one, "G1 X0.001")
        do(other, "G0 Y1")
        do(one, "G1 Y1 E2", "M400")
        assert places(shop) == [2020, 400, 400], places(shop)
        # the logical position is another one
        do(one, "G92 X0 E0", "G90", "M83")
        do(one, "G1 X-1 E1 F3000", "G1 E1", "M400")
        assert places(shop) == [1820, 400, 800], places(shop)
        assert one.ask("M114")[0].startswith("X:-1.0000 Y:2.0000 E:2.0000 Count X:1820 ")
        do(one, "G20", "G1 X1 F100", "M400")
        assert places(shop)[0] == 2020 + 5080
        do(one, "G4 P1")
        # a jog has modes of its own
        do(one, "$J=G91 X1 F6000", "$j = g20 g90 Y0.1 F100", "M400")
        assert places(shop)[:2] == [2020 + 5080 + 200, 508]
        do(one, "G1 X0 F100", "M400")
        assert places(shop)[0] == 2020, "inches, as before"
        do(one, "G1 X1", "M400")
        # what is not there, and what is odd
        assert one.ask("G1 Z1") == ["Error:G1: mill has no axis Z; there are: X Y E", "ok"]
        assert one.ask("G1 X F1") == ["Error:G1: X needs a number", "ok"]
        do(one, "G1 F0")
        assert one.ask("G1 F-1") == ["Error:G1: F must be greater than 0", "ok"]
        assert re.match("Error:G1: .* further than the device can count", one.ask("G1 X999999999")[0])
        do(one, "M220 S50")
        assert one.ask("M220") == ["FR:50%", "ok"]
        assert one.ask("M220 S201")[0].startswith("Error:M220: the feed override must be 0 to 200 percent")
        # those that are named
        do(one, "M84 X", "M400")
        assert [axis["enabled"] for axis in shop.house.state()["engine"]["axes"][:3]] == [False, True, True]
        assert one.ask("M84 S60") == ["echo:S is not kept: what is not used is switched off by itself", "ok"]
        do(one, "M18 A X", "M84 Y E")
        nobody_commands(shop)


def test_lines_of_cam_programs():
    """Several commands in a line, and moves without one."""
    with mill() as shop:
        one, other = shop.one, Client(shop.house)
        assert one.ask("X1") == ['Error:line: "X1" needs a G0, G1, G2 or G3 before it', "ok"]
        do(one, "G17 G21 G40 G49 G80 G90 G94", "G1 X1 G91 F6000", "X1 Y0.5", "F3000", "G90 X5", "M400")
        assert places(shop) == [1000, 100, 0], places(shop)
        # another client has modes of its own
        assert other.ask("X1")[0].startswith("Error:line: ")
        do(one, "G3 X0 Y5.5 I-5", "X-5 Y0.5 J-5", "M400")
        assert places(shop) == [-1000, 100, 0], places(shop)
        for line, why in (("G0 G1 X1", "G0 and G1 cannot be in one line"), ("G90 G28", "G28 needs a line of its own"),
                          ("G1 X1 M112", "M112 needs a line of its own"), ("G90 G1 X1 S5", "no command in this line takes S")):
            assert one.ask(line) == [f"Error:{line.split()[0]}: {why}", "ok"], one.ask(line)
        assert one.ask("G0 X0 M8 Y0") == ['echo:Unknown command: "M8"; M115 lists the commands', "ok"]
        assert one.ask("hello X") == ['echo:Unknown command: "hello X"; M115 lists the commands', "ok"]
        # a speed is no move, and what follows a command that does not exist does not belong to the last move
        do(one, "G2 X1 Y1 I1", "F5000", "X0 Y0 I-1", "M400")
        assert places(shop) == [0, 0, 0], places(shop)
        for line in "G38.2 X9", "G81 X9", "G999 X9":
            do(one, "G0 X0")
            assert one.ask(line)[0].startswith("echo:Unknown command" if "999" in line else f"Error:{line.split()[0]}: there is none of that here")
            assert one.ask("X9")[0].startswith("Error:line: "), line
        # a tool is changed by a person
        for line, shown in (b"T2 M6\n", "M6 T2"), (b"M6 S1\n", "M6 S1"):
            one.send(line)
            assert one.until("echo:busy: paused")[0] == f"echo:{shown}: it waits; M108 lets it go on"
            assert other.ask("M108")[-1] == "ok"
            one.until("ok")
        # nothing of a line is done if something of it cannot be
        assert one.ask("G91 G1 Z1") == ["Error:G91: mill has no axis Z; there are: X Y E", "ok"]
        do(one, "G0 X0.5", "X1", "G80", "M400")
        assert places(shop) == [200, 0, 0], places(shop)
        assert one.ask("X2")[0].startswith("Error:line: ") and places(shop) == [200, 0, 0]
        # the end of a program, in the same line as its last move
        do(one, "G91 G1 X1 M30", "G0 X0", "M400")
        assert places(shop) == [0, 0, 0], places(shop)


def test_the_rest_of_a_line_is_not_for_a_client_that_is_gone():
    """It goes while the first command of its line waits: what that switches off is off, and nothing moves any more."""
    with mill() as shop:
        other = Client(shop.house)
        other.send(b"G1 X20 F600\nM5 G0 Y5\n")
        assert other.line() == "ok"
        moves(shop)
        # one that only has nothing more to send is still served
        other.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        other.socket.close()
        stand(shop)
        # the same order of lines, of somebody who stays
        do(shop.one, "G4 P1")
        assert places(shop) == [4000, 0, 0], places(shop)


def test_an_axis_without_a_home_switch():
    with mill(**{"axis.2.home": "off"}) as shop:
        before = places(shop)
        assert shop.one.ask("G28 E")[-2].startswith("Error:G28: E cannot be homed: it has no home switch (axis.2.home)")
        assert places(shop) == before and shop.one.ask("G28 X")[-1] == "ok" and places(shop)[2] == before[2]


def test_a_search_moves_nothing_else():
    """Axes that have moved just before it stay where they are."""
    with mill() as shop:
        do(shop.one, "G1 X5 F6000", "G91")
        for i in range(1, 5):
            shop.one.send(b"G1 E-5 F3000\nG28 X\nM400\n")
            said = [shop.one.until("ok") for _ in range(3)]
            assert places(shop)[2] == -1000 * i, (i, places(shop), said)


def test_arcs():
    """A quarter, the rest of the circle, and helices, in both modes; where they pass is seen at the motors."""
    with mill() as shop:
        one = shop.one
        do(one, "G1 X10 F6000", "G3 X0 Y10 I-10 F6000", "M400")
        assert places(shop) == [0, 2000, 0], places(shop)
        do(one, "G91", "G2 X10 Y-10 R10 E1", "M400")
        assert places(shop) == [2000, 0, 200], places(shop)
        # the long way, far outside of the straight one
        do(one, "G90", "G1 F400")
        one.send(b"G3 X10 Y0 I-10 E3\n")
        seen = []

        def went_around():
            seen.append(tuple(places(shop)[:2]))
            return min(x for x, _ in seen) < -1900 and max(y for _, y in seen) > 1900 and min(y for _, y in seen) < -1900
        wait_for("it goes around", went_around, say=lambda: seen[-3:])
        one.until("ok")
        one.send(b"M400\n")
        one.until("ok")
        assert places(shop) == [2000, 0, 600], places(shop)
        # axes whose references are late on a busy computer leave the circle for a moment
        off = sorted(abs((x * x + y * y) ** 0.5 - 2000) for x, y in seen)
        assert off[len(off) * 9 // 10] < 8 and off[-1] < 400, seen
        do(one, "G20", "G92 X0 Y0", "G2 X1 Y0 I0.5 F240", "M400")
        assert places(shop)[:2] == [2000 + 5080, 0], places(shop)
        for line, why in (("G2 X1", "needs I and J, or R"), ("G2 I1 P2", "an arc takes no P"), ("G2 X1 R1 I1", "needs either"),
                          ("G18", "there is none of that here"), ("G3 X5 Y5 I1", "the end is not on this arc"),
                          ("G2 X9 R1", "R25.4 is too small: ")):
            assert one.ask(line)[0].startswith(f"Error:{line.split()[0]}: {why}"), one.ask(line)
        # a stop in the middle of it
        do(one, "G21", "G91")
        one.send(b"G2 I500 F600\n")
        moves(shop)
        assert one.ask("M410")[-1] == "ok"
        stand(shop)
        assert not shop.house.state()["moves"]["waiting"]


def test_a_job_waits_for_room_and_is_stopped():
    with mill() as shop:
        job, other = shop.one, Client(shop.house)
        sides = [f"G1 X{x} Y{y} F6000\n".encode() for _ in range(25) for x, y in ((10, 0), (10, 10), (0, 10), (0, 0))]
        job.send(b"".join(sides))
        wait_for("the queue is full", lambda: shop.house.state()["moves"]["waiting"] == 32)
        do(other, "M105")
        assert other.ask("M114")[0].startswith("X:")
        assert other.ask("M410")[-1] == "ok"
        assert shop.house.state()["moves"]["waiting"] == 0
        stand(shop)
        assert shop.house.state()["moves"]["end"] == "aborted"
        assert job.until("[stop by")[-1].startswith("[stop by telnet")
        # it goes on from where it stands
        do(other, "G0 X3 Y4", "M400")
        assert places(shop)[:2] == [600, 800]
        # a move to the end of a job, and the next one from another client, in the order of their coming
        do(other, "G91", "G1 X5 F600", "G1 X5")
        moves(shop)
        other.send(b"M112\n")
        assert other.until("ok")[-1] == "ok"
        state = shop.house.state()
        assert (state["moves"]["waiting"], state["flags"]["machine_on"]) == (0, False)
        assert [axis["enabled"] for axis in state["engine"]["axes"][:3]] == 3 * [False]
        stand(shop)
        assert other.ask("G1 X1") == ["Error:G1: stopped by M112; M999 permits commands again", "ok"]
        do(other, "M999")
        before = places(shop)[0]
        do(other, "G1 X1 F600", "M400")
        assert places(shop)[0] == before + 200


def test_a_stop_that_is_confirmed_is_one():
    """Whatever was on its way to the daemon just then."""
    with mill() as shop:
        one, other, rng = shop.one, Client(shop.house), random.Random(SEED)
        do(one, "G91", "G1 X0.1 F60")
        for i in range(25):
            one.send(b"G1 X%d F600\n" % (1 - i % 2 * 2))
            time.sleep(rng.uniform(0, 0.006))
            assert other.ask("M410")[-1] == "ok"
            before = places(shop)
            time.sleep(0.03)
            assert places(shop) == before, (i, before, places(shop))


def test_a_refused_move_spoils_what_comes_after_it():
    with mill(**{"axis.0.soft-limits": "on", "axis.0.soft-minimum": -1000, "axis.0.soft-maximum": 4000}) as shop:
        one, other = shop.one, Client(shop.house)
        do(other, "G91")
        one.send(b"G1 X5 F300\nG1 X50\nG1 Y5\nM104 S0\nM400\n")
        said = [one.until("ok") for _ in range(5)]
        assert said[0] == ["ok"] and said[1][0] == "Error:G1: the daemon refused this move: its end is beyond a soft limit", said
        assert said[2][0] == said[4][0].replace("M400", "G1") == "Error:G1: not carried out, as a line before it has failed"
        assert said[3] == ["Error:M104: there is no hot end T0", "ok"], said
        # the path goes on, and the next one begins at its end
        do(other, "G1 X1 F600", "M400")
        assert places(shop)[:2] == [1200, 0], places(shop)


def test_lines_that_are_missing_may_have_ended_g91():
    with mill() as shop:
        one, other = shop.one, Client(shop.house)
        why = ["lines of G91 were not carried out: send G90 or G91 before the next move", "ok"]
        for end in "a mistake", "a stop":
            do(one, "G91")
            one.send(b"G1 Z1 F600\nG90\n" if end == "a mistake" else b"G1 X9 F60\nM400\nG90\n")
            if end == "a stop":
                moves(shop)
                assert other.ask("M410")[-1] == "ok"
                one.until("error: your lines are not taken")
                time.sleep(2.5)     # who may be in the middle of a program is not heard until then
            else:
                assert [one.until("ok")[0][:6] for _ in range(2)] == 2 * ["Error:"]
            before = places(shop)
            assert one.ask("G1 X1 F600")[-2:] == [f"Error:G1: {why[0]}", "ok"], end
            assert places(shop) == before
            do(one, "G91", "G1 X1 F600", "G90", "M400")
            # nothing is missing of who sends one line after the other
            do(one, "G91")
            assert one.ask("G1 Z1")[0].startswith("Error:G1: ")
            do(one, "G1 Y1")
            # but of a line with several commands
            assert one.ask("G1 Z1 G90")[0].startswith("Error:G1: ")
            assert one.ask("G1 X1")[0] == f"Error:G1: {why[0]}"
            do(one, "G90", "M400")


def test_the_gateway_dies():
    for number in signal.SIGKILL, signal.SIGSTOP:
        with mill() as shop:
            shop.one.send(b"".join(b"G1 X%d F600\n" % (100 * (i % 2)) for i in range(20)))
            moves(shop)
            shop.gateway.child.send_signal(number)
            wait_for("the machine is off", lambda: not shop.house.state()["flags"]["machine_on"])
            stand(shop)


def test_a_limit_switch_ends_all():
    with mill() as shop:
        shop.house.ask_sim(shop.sim, "switch", 0, "plus", 1000, 2000000)
        one, other = shop.one, Client(shop.house)
        one.send(b"G91\nG1 X20 Y3 F1200\nG1 X20\n")
        said = other.until("Error:")[-1]
        assert re.match("Error:X was switched off: .*; M999 permits commands again", said), said
        stand(shop)
        assert 1000 <= places(shop)[0] < 1600
        assert other.ask("M119").count("x_max: TRIGGERED") == 1
        shop.house.ask_sim(shop.sim, "switch", 0, "plus", 900000, 2000000)
        do(other, "M999")
        do(other, "G1 Y0 F600", "M400")
        assert places(shop)[1] == 0


def test_home_switches_are_found():
    with mill() as shop:
        one, other = shop.one, Client(shop.house)
        do(one, "G1 X10 Y10 F6000")
        one.send(b"G28 X Y\n")
        assert other.ask("M114")[0].startswith("X:")
        said = one.until("ok")
        assert said[-1] == "ok" and not [line for line in said if line.startswith("Error:")], said
        assert [axis["homed"] for axis in shop.house.state()["engine"]["axes"][:3]] == [True, True, False]
        at = places(shop)[0] / 200
        do(one, f"G1 X{at + 5:.3f} F6000", "M400")
        assert abs(places(shop)[0] / 200 - at - 5) < 0.01
        # those that are homed need no search; what follows of other firmwares is no axis
        before = places(shop)
        do(one, "G28 X Y O", "G28 O R5 X0 Y0")
        assert places(shop) == before
        # a stop ends the search
        one.send(b"G28 X\n")
        moves(shop)
        assert other.ask("M410")[-1] == "ok"
        stand(shop)
        do(other, "G1 Y1 F600", "M400")


def test_motors_move_with_axes():
    """What a busy computer stops is begun again."""
    with mill(servos={"z": MOTOR}) as shop:
        one, tries = shop.one, []

        def moved():
            tries.append([one.ask(line)[-2:] for line in ("M999", "G90", "G1 X2 Z3 F3000", "G91", "G1 Z0.5", "M400")])
            return [said for said in tries[-1] if said != ["ok"]] == []
        wait_for("the moves", moved, say=lambda: tries)
        wait_for("the place", lambda: abs(shop.house.state()["servos"][0]["position"] - 3.5) < 0.1)
        assert places(shop)[0] == 400
        shop.house.ask_sim(shop.sim, "motor", 0, "home", -2000000, -4000, 7)

        def homed():
            tries.append([one.ask(line)[-2:] for line in ("M999", "G28 Z")])
            return tries[-1] == [["ok"], ["ok"]]
        wait_for("the switch", homed, say=lambda: tries)
        assert abs(shop.house.state()["servos"][0]["position"] - 5) < 0.2
        assert shop.house.state()["servos"][0]["homed"]
        do(one, "M18")
        wait_for("it is off", lambda: shop.house.state()["servos"][0]["state"] == "off")


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=2))
