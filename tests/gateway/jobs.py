#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Files of G-code in a folder, and jobs that carry them out, on simulated axes: progress, waits, mistakes, stops, and
what is known after the gateway has died."""
import contextlib
import pathlib
import re
import signal
import sys
import tempfile

from gcode import checksum
from heating import Client
from house import main, wait_for
from moving import do, mill, places, stand
from pokeys_gateway.gcode import lines
from rig import Gateway

SQUARE = b"; a square\nG21\nG90\r\nM73 P0\n\nG1 X5 Y0 F6000 ; to the right\nG1 Y5\nN1 G1 X0*97\nM73 P50\nM204 S500\nG1 Y0 (home)"
# 200 moves of 0.1 s
LONG = b"G90\n" + b"".join(b"G1 X%d F300\n" % (i % 2) for i in range(200))


@contextlib.contextmanager
def shop_with(**files):
    """A mill whose gateway has files."""
    with tempfile.TemporaryDirectory() as folder:
        for name, data in files.items():
            pathlib.Path(folder, f"{name}.gcode").write_bytes(data)
        with mill(folder=folder) as shop:
            shop.folder = pathlib.Path(folder)
            yield shop


def begin(one, name, found=""):
    said = one.ask(f"M23 {name}")
    assert said[0].startswith(f"File opened: {found or name} Size: ") and said[1:] == ["File selected", "ok"], said
    do(one, "M24")


def under_way(one, line):
    wait_for(f"line {line}", lambda: int(re.search(r"line (\d+)", one.ask("M27")[1])[1]) >= line, say=lambda: one.ask("M27"))


def test_a_file_is_carried_out():
    number = checksum(b"N1 G1 X0")
    assert number == 97, number
    with shop_with(square=SQUARE) as shop:
        one, other = shop.one, Client(shop.house)
        assert one.ask("M20") == ["Begin file list", f"square.gcode {len(SQUARE)}", "End file list", "ok"]
        assert one.ask("M27") == ["Not SD printing", "ok"]
        assert one.ask("M24") == ["Error:M24: no file is selected; M23 and its name select one", "ok"]
        for name in "none.gcode", "../gateway.conf", ".job", "":
            said = one.ask(f"M23 {name}")
            assert re.fullmatch("Error:M23: .*(No such file or directory|needs the name of a file)", said[0]), (name, said)
        begin(one, "square.gcode")
        for who in one, other:
            assert who.until("echo:square")[-1] == "echo:square.gcode has ended, 11 lines; commands that do not exist: M73, M204"
            assert who.line() == "Done printing file"
        assert places(shop)[:2] == [0, 0] and shop.house.state()["moves"]["taken"] == 4
        assert not (shop.folder / ".job").exists()
        # from a line, and from a byte in it
        for words in "L6", f"S{SQUARE.index(b'to the right')}":
            do(one, "G90", "G0 X1 Y1", "M400", f"M26 {words}", "M24")
            one.until("Done printing")
            assert places(shop)[:2] == [0, 0], words
        # what lines before that have set applies
        do(one, "G0 X1 Y1", "M400", "M26 L8", "M24")
        one.until("Done printing")
        assert places(shop)[:2] == [0, 0]
        assert one.ask("M26 L13")[0] == "Error:M26: square.gcode: the file has 11 lines"
        assert one.ask("M26 S9999")[0].startswith("Error:M26: needs S and a byte")
        # a job that waits is ended by it, as hosts have it
        (shop.folder / "Wait.gcode").write_bytes(b"G1 X1 F600\nM0\nG1 X2\nM2 (end)\nG1 X9\n")
        begin(one, "wait.gcode", "Wait.gcode")
        assert other.until("echo:Wait")[-1] == "echo:Wait.gcode, line 2: M0: it waits; M24 lets it go on"
        assert one.ask("M27")[-2] == "echo:it waits; M24 lets it go on"
        do(one, "M24")
        assert one.until("Done printing")[0] == "echo:Wait.gcode has ended, 4 lines"
        do(one, "M400")
        assert places(shop)[0] == 400
        begin(one, "wait.gcode", "Wait.gcode")
        wait_for("it waits", lambda: len(one.ask("M27")) == 4)
        said = one.ask("M26 S0")
        assert re.match("echo:Wait.gcode has ended at line 2 .*: ended by M26", said[0]), said
        # what must not be left out
        place = places(shop)[0]
        for text, line, why in ((b"G1 X1 F600\nG5 X2 I1\n", 2, '"G5 X2 I1" cannot be carried out: there is no such command'),
                                (b"G90\nX5 Y5\nG1 X6\n", 2, '"X5 Y5" needs a G0, G1, G2 or G3 before it'), (b"G17\nG40\nG49\nG54\nG80\nG94\nG18\n", 7, "there is none of that here; what follows would be carried out in another way"),
                                (b"\0\0G1 X1\n", 1, "cannot be carried out: there is no such command"),
                                (b"G90 G28 X\n", 1, "G28 needs a line of its own"), (b"G90 G1 X5 M600\n", 1, "M600 needs a line of its own"),
                                (b"G28 W R5 O\nM17 W\nG5\n", 3, '"G5" cannot be carried out: there is no such command'), (b"G28 Z\n", 1, "mill has no axis Z; there are: X Y E"),
                                (b"M5 G0 Z5\n", 1, "mill has no axis Z; there are: X Y E"), (b"T0 M104 S0\n", 1, "M104 needs a line of its own"),
                                (b"M104 T0 S0\n", 1, "there is no hot end T0"), (b"T1\nM98 P1\n", 2, "there is none of that here; what follows would be carried out in another way"),
                                (b"G1 X1\rG1 X2\n", 1, "a carriage return is in the middle of it"),
                                (b"; " + 9000 * b"x" + b"\r\nM117 " + 300 * b"x", 2, "a line has at most 256 characters")):
            (shop.folder / "odd.gcode").write_bytes(text)
            assert one.ask("M23 odd.gcode")[-1] == "ok"
            said = one.ask("M24")
            assert said[0].startswith(f"Error:M24: odd.gcode, line {line}: ") and said[0].endswith(f"{why}; the job has not begun"), (text, said)
        assert one.ask("M27") == ["Not SD printing", "ok"] and places(shop)[0] == place


def test_a_file_is_judged_before_its_job_begins():
    """What can never be carried out is said before a heater is warm, wherever it is in the file, and only that."""
    many = b"G1 X1 F600\r\n" + 9000 * b"G1 X1.5 Y-.5 E1 ; there and back\n"
    with shop_with(late=many + b"M600\n", comment=many + b";" + 200000 * b"M600 " + b"\n" + many + b"G4 P0 ; M600\nM600",
                   end=b"G1 X.1 F6000\nM2\nM600\n", low=b"g4 p0\ng5 x1\n",
                   mill=b"%\r\nN10 G21 (mm)\r\nN20 G90\r\nN30 G1 X0.1 F6000\r\nN40 M30\r\n%\r\n") as shop:
        one = shop.one
        assert one.ask("M32 late.gcode")[0] == ("Error:M32: late.gcode, line 9002: there is none of that here; what follows would be "
                                                "carried out in another way; the job has not begun")
        assert one.ask("M32 comment.gcode")[0].startswith("Error:M32: comment.gcode, line 18005: there is none of that here; ")
        assert one.ask("M32 low.gcode")[0].startswith('Error:M32: low.gcode, line 2: "g5 x1" ')
        assert not shop.house.state()["moves"]["taken"] and one.ask("M27") == ["Not SD printing", "ok"]
        # also from there
        assert one.ask("M23 late.gcode")[-1] == "ok"
        do(one, "M26 L9002")
        assert one.ask("M24")[0].startswith("Error:M24: late.gcode, line 9002: ")
        for name in "end", "mill":
            assert one.ask(f"M32 {name}.gcode")[-1] == "ok"
            assert one.until("Done printing")[0] == f"echo:{name}.gcode has ended, {2 if name == 'end' else 5} lines"
        assert places(shop)[0] == 20


def test_judging_takes_no_time():
    """Also of lines that end badly: whoever judges them holds all other threads up, M112 included."""
    pattern = lines.unusual_of("XYE")
    for data in (b"G1" + 28 * b" X1234567" + b"Q", 28 * b"X1234567" + b"!", 100 * b"X1.5Y-.5" + b"Q"):
        assert pattern.findall(data) == [data], data
    for data in (b"X1 Y2", b"G1X1.Y.5E-0.25 F600 ; a\r", b"", b"; x", b"G01 X1"):
        assert not pattern.findall(data), data
    for data in (b"G28", b"M5", b"G90 X1", b"G1.X5", b"X1 Q2"):
        assert pattern.findall(data) == [data], data


def test_programs_of_cam():
    """Several commands in a line, and moves without one; what is wrong is found before the job begins."""
    with shop_with(part=b"%\n(T1 D=3)\nN5 G17 G21 G90 G40 G49 G80 G94\nM9 M5\nG0 X1 Y1\nX2 Y2 (there)\nG1 X3 F6000\nY3\n"
                        b"G91 X-1\nG90\nX0 Y0 M30\nX9\n",
                   first=b"(G1 is not here)\nM400\n x5 y5\nG1 X1\n", comment=b"(one) G0 (two) X0.5\nX0\n",
                   bad=b"G1 X1 F600\n" + 20000 * b"X1.5\n" + b"X1 M600\n") as shop:
        one = shop.one
        assert one.ask("M32 bad.gcode")[0] == "Error:M32: bad.gcode, line 20002: M600 needs a line of its own; the job has not begun"
        assert one.ask("M32 first.gcode")[0] == ('Error:M32: first.gcode, line 3: "X5 Y5" needs a G0, G1, G2 or G3 before it; '
                                                 "the job has not begun")
        assert one.ask("M32 comment.gcode")[-1] == "ok"
        one.until("Done printing")
        assert one.ask("M32 part.gcode")[-1] == "ok"
        assert one.until("Done printing")[0] == "echo:part.gcode has ended, 11 lines; commands that do not exist: M9"
        assert places(shop) == [0, 0, 0] and shop.house.state()["moves"]["taken"] >= 8


def test_waits_for_a_person():
    with shop_with(wait=b"G1 X1 F6000\nM0 turn the part\nG1 X2\nM0 P1\nM1") as shop:
        one, other = shop.one, Client(shop.house)
        # of a client: other clients do not wait, and M108 of anybody ends it
        one.send(b"G91\nG1 X0.1 F600\nM0 turn it\nG1 X0.1\n")
        assert other.until("echo:M0")[-1] == "echo:M0 turn it: it waits; M108 lets it go on"
        assert one.until("echo:busy")[-1] == "echo:busy: paused for user"
        assert places(shop)[0] == 20 and other.ask("M108") == ["ok"]
        assert one.until("ok") == ["ok"] and one.until("ok") == ["ok"]
        do(one, "M400")
        assert places(shop)[0] == 40
        do(one, "M0 S0.01", "M1 P1", "M226 S0.01")
        said = one.ask("M0 S-1")
        assert said == ["Error:M0: its time must not be negative", "ok"], said
        # a program's end: positions are absolute
        for end in "M2", "M30":
            do(one, "G91", end, "G1 X0.2 F600", "M400")
            assert places(shop)[0] == 40
        # of a file: until M24, wherever it is
        assert one.ask("M32 wait.gcode")[-1] == "ok"
        assert other.until("echo:wait")[-1] == "echo:wait.gcode, line 2: M0 turn the part: it waits; M24 lets it go on"
        assert places(shop)[0] == 200
        assert one.ask("M24")[-1] == "ok"
        assert other.until("echo:wait")[-1] == "echo:wait.gcode, line 5: M1: it waits; M24 lets it go on"
        assert places(shop)[0] == 400 and one.ask("M27")[-2] == "echo:it waits; M24 lets it go on"
        assert one.ask("M24")[-1] == "ok"
        assert other.until("Done")[-2] == "echo:wait.gcode has ended, 5 lines"
        # a stop ends the wait of a client
        one.send(b"M0\nG1 X0.1\n")
        other.until("echo:M0")
        assert other.ask("M410")[-1] == "ok"
        stand(shop)
        assert places(shop)[0] == 400


def test_a_file_is_written_by_a_client():
    with shop_with() as shop:
        one, other = shop.one, Client(shop.house)
        assert one.ask("M28 part.gcode") == ["Writing to file: part.gcode", "ok"]
        do(one, "G1 X1 F600", "M104 S300", "M105")
        body = b"N5 G1 X2"
        one.send(b"M110 N4\n%s*%d\n" % (body, checksum(body)))
        assert one.until("ok") == ["ok"] and one.until("ok") == ["ok"]
        assert other.ask("M20") == ["Begin file list", "End file list", "ok"], "not before it is complete"
        assert one.ask("M29") == ["Done saving file.", "ok"]
        assert (shop.folder / "part.gcode").read_bytes() == b"G1 X1 F600\nM104 S300\nM105\nM110 N4\nG1 X2\n"
        assert places(shop) == [0, 0, 0]
        assert one.ask("M29")[0] == "Error:M29: nothing is being written"
        assert one.ask("M30 part.gcode") == ["File deleted: part.gcode", "ok"]
        assert one.ask("M30 part.gcode")[0] == "Error:M30: part.gcode: No such file or directory"
        # a hole in it, and a stop: nothing stays, and nothing is carried out as if it were no part of it
        for spoil, why in ((b"M117 " + 300 * b"x" + b"\n", "a line is too long"), (None, "stopped")):
            assert one.ask("M28 hole.gcode")[-1] == "ok"
            if spoil:
                one.send(spoil)
                assert one.until("ok")[-1] == "ok"
            else:
                assert other.ask("M410")[-1] == "ok"
                one.until("[stop by")
            said = one.ask("G1 X1 F600")
            assert said[0] == f"Error:G1: hole.gcode is not kept: {why}; M29 ends the writing", said
            assert one.ask("M29")[0] == f"Error:M29: hole.gcode is not kept: {why}; M29 ends the writing"
        assert one.ask("M28 again.gcode")[-1] == "ok" and one.ask("M28 again.gcode")[-1] == "ok"
        do(one, "G1 X1")
        assert one.ask("M999") == ["ok"] and one.ask("M20") == ["Begin file list", "End file list", "ok"]
        assert one.ask("M28 x.html")[0] == "Error:M28: this needs level admin" and one.ask("M29")[0].startswith("Error:")
        assert one.ask("M28 idle.gcode")[-1] == "ok"
        idle = Client(shop.house)
        assert idle.ask("M28 gone.gcode")[-1] == "ok"
        idle.reset()
        assert one.ask("M29")[-1] == "ok" and one.ask("M30 idle.gcode")[-1] == "ok"
        # half of it comes: nothing stays
        assert one.ask("M28 half.gcode")[-1] == "ok"
        one.send(b"G1 X1\n" * 20)
        one.reset()
        wait_for("nothing is left", lambda: not list(shop.folder.iterdir()))


def test_a_job_waits_and_needs_no_client():
    with shop_with(long=LONG, wrong=b"G91\nG1 X1 F6000\nG1 X1 F-1\nG1 X1\n", axis=b"G91\nG1 Z5 F6000\n",
                   stop=b"M112\n") as shop:
        one, other = shop.one, Client(shop.house)
        begin(one, "long.gcode")
        one.reset()
        under_way(other, 40)
        do(other, "M25")
        assert other.ask("M27")[2] == "echo:it waits; M24 lets it go on"
        stand(shop)
        line = other.ask("M27")[1]
        assert other.ask("M23 wrong.gcode")[0] == "Error:M23: long.gcode is under way; M524 ends it"
        assert other.ask("M30 long.gcode")[0] == "Error:M30: a job of this file is under way"
        do(other, "M24")
        wait_for("it goes on", lambda: other.ask("M27")[1] != line)
        # as OctoPrint cancels one, while its line waits for room in the queue
        wait_for("the queue is full", lambda: shop.house.state()["moves"]["waiting"] == 32)
        do(other, "M25")
        other.ask("M27")
        said = other.ask("M26 S0")
        assert re.match("echo:long.gcode has ended at line .*: ended by M26", said[0]) and said[-1] == "ok", said
        assert other.ask("M410")[-1] == "ok"
        begin(other, "long.gcode")
        under_way(other, 40)
        said = other.ask("M524")
        assert re.match(r"echo:long.gcode has ended at line \d+ \(byte \d+ of \d+\): stopped", said[0]), said
        assert shop.house.state()["moves"]["waiting"] == 0
        for line in "M524", "M25":
            assert other.ask(line) == [f"echo:{line}: no job is under way", "ok"]
        do(other, "M400")
        # a line that cannot be carried out ends it, and is said
        before = places(shop)[0]
        assert other.ask("M32 axis.gcode")[0] == "Error:M32: axis.gcode, line 2: mill has no axis Z; there are: X Y E; the job has not begun"
        begin(other, "wrong.gcode")
        assert other.until("Error:")[-1] == "Error:wrong.gcode, line 3: F must be greater than 0; the job has ended"
        do(other, "M400")
        assert places(shop)[0] == before + 200
        assert other.ask("M32 stop.gcode")[0] == "Error:M32: stop.gcode, line 1: M112 cannot be in a file; the job has not begun"
        # a stop ends it
        begin(other, "long.gcode")
        under_way(other, 40)
        other.send(b"M112\n")
        said = other.until("ok")
        assert any(re.match(r"echo:long.gcode has ended at line \d+ .*: stopped$", line) for line in said), said
        stand(shop)
        assert other.ask("M24")[0] == "Error:M24: stopped by M112; M999 permits commands again"


def test_the_gateway_dies():
    with shop_with(long=LONG) as shop:
        begin(shop.one, "long.gcode")
        under_way(shop.one, 40)
        # beside it, nobody moves, and what was selected before is not begun by mistake
        for line in "G1 X1 F600", "G92 X0", "G28", "$J=X1 F600":
            assert shop.one.ask(line)[0].endswith(": a job is under way; M25 lets it wait, and M524 ends it"), line
        wait_for("its note", lambda: '"line": 0' not in (shop.folder / ".job").read_text(encoding="utf-8"))
        shop.gateway.child.send_signal(signal.SIGKILL)
        shop.gateway.child.wait()
        wait_for("the machine is off", lambda: not shop.house.state()["flags"]["machine_on"])
        stand(shop)
        before = places(shop)
        gateway = Gateway(shop.house, "--config", shop.house.folder / "gateway.conf")
        gateway.wait_running()
        one = Client(shop.house)
        # it is read from the disk, for which nobody waits
        wait_for("what there was", lambda: len(one.ask("M27")) > 2)
        said = one.ask("M27")
        assert said[0] == "Not SD printing" and re.match(
            r"echo:long.gcode was under way when the gateway ended, at line [1-9]\d* \(byte \d+ of \d+\); to go on when axes "
            "and heaters are ready: M23 long.gcode, M26 and M24", said[1]), said
        assert places(shop) == before
        begin(one, "long.gcode")
        under_way(one, 2)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=2))
