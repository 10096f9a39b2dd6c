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


def begin(one, name):
    said = one.ask(f"M23 {name}")
    assert said[0].startswith(f"File opened: {name} Size: ") and said[1:] == ["File selected", "ok"], said
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
        do(one, "M400")
        assert places(shop)[:2] == [0, 0] and shop.house.state()["moves"]["taken"] == 4
        assert not (shop.folder / ".job").exists()
        # from a line, and from a byte in it
        for words in "L6", f"S{SQUARE.index(b'to the right')}":
            do(one, "G90", "G0 X1 Y1", "M400", f"M26 {words}", "M24")
            one.until("Done printing")
            do(one, "M400")
            assert places(shop)[:2] == [0, 0], words
        # what was set before that is not set
        do(one, "M26 L8", "M24")
        assert one.until("Error:")[-1] == "Error:square.gcode, line 8: no feed rate yet; add F with units/min; the job has ended"
        assert one.ask("M26 L13")[0] == "Error:M26: the file has 11 lines"
        assert one.ask("M26 S9999")[0].startswith("Error:M26: takes S and a byte")


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
        # half of it comes: nothing stays
        assert one.ask("M28 half.gcode")[-1] == "ok"
        one.send(b"G1 X1\n" * 20)
        one.reset()
        wait_for("nothing is left", lambda: not list(shop.folder.iterdir()))


def test_a_job_waits_and_needs_no_client():
    with shop_with(long=LONG, wrong=b"G91\nG1 X1 F6000\nG1 Z5\nG1 X1\n", stop=b"M112\n") as shop:
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
        said = other.ask("M524")
        assert re.match(r"echo:long.gcode has ended at line \d+ \(byte \d+ of \d+\): ended by M524", said[0]), said
        assert other.ask("M524")[0] == "Error:M524: no job is under way"
        do(other, "M400")
        # a line that cannot be carried out ends it, and is said
        before = places(shop)[0]
        begin(other, "wrong.gcode")
        assert other.until("Error:")[-1] == "Error:wrong.gcode, line 3: mill has no axis Z; there are: X Y E; the job has ended"
        do(other, "M400")
        assert places(shop)[0] == before + 200
        begin(other, "stop.gcode")
        assert other.until("Error:")[-1] == "Error:stop.gcode, line 1: M112 cannot be in a file; the job has ended"
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
        wait_for("its note", lambda: '"line": 0' not in (shop.folder / ".job").read_text(encoding="utf-8"))
        shop.gateway.child.send_signal(signal.SIGKILL)
        shop.gateway.child.wait()
        wait_for("the machine is off", lambda: not shop.house.state()["flags"]["machine_on"])
        stand(shop)
        before = places(shop)
        gateway = Gateway(shop.house, "--config", shop.house.folder / "gateway.conf")
        gateway.wait_running()
        one = Client(shop.house)
        said = one.ask("M27")
        assert said[0] == "Not SD printing" and re.match(
            r"echo:long.gcode was under way when the gateway ended, at line [1-9]\d* \(byte \d+ of \d+\); to go on when axes "
            "and heaters are ready: M23 long.gcode, M26 and M24", said[1]), said
        assert places(shop) == before
        begin(one, "long.gcode")
        under_way(one, 2)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=2))
