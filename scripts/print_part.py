#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A part is printed on a simulated printer, without hardware and without LinuxCNC.

Starts the simulator, the daemon and the gateway with the configuration of examples/printer; is a host program at
the gateway's pseudoterminal that prints a file of its folder; shows how far it has come; judges where the axes are in the
end; prints the part again until Ctrl-C. Started by scripts/demo, inside its isolation.
"""
import argparse
import configparser
import os
import pathlib
import re
import select
import shutil
import sys
import time

from demo import run, say
from rig import PATIENCE_S, Fault, Rig

ROOT = pathlib.Path(__file__).resolve().parents[1]
EXAMPLE = ROOT / "examples/printer"
HOST = "127.0.0.1"
FIRST_SOCKET = 3  # of scripts/listen
SCALES = {"X": 80, "Y": 80, "Z": 400, "E": 100}  # pulses per mm, as in the example
HOME_PULSES = 2  # after a search for its switch, an axis is so far from 0 at most
AGAIN_S = 20.0  # from one part to the next
WORD = re.compile(r"([A-Z])([-+.\d]+)")


def read(name):
    """A file of the example: dicts of keys, by their sections."""
    parser = configparser.ConfigParser(inline_comment_prefixes=(";", "#"), interpolation=None)
    parser.optionxform = str
    parser.read_string((EXAMPLE / name).read_text(encoding="utf-8"))
    return {section: dict(parser[section]) for section in parser.sections()}


class Path:
    """Where the axes are after a file of G-code, from its text alone."""

    def __init__(self, text):
        self.moves, self.places = 0, dict.fromkeys(SCALES, 0.0)
        self._relative = {"E": False}
        self._shifts = dict.fromkeys(SCALES, 0.0)
        for line in text.splitlines():
            name, _, rest = line.partition(";")[0].strip().upper().partition(" ")
            self._take(name, {letter: float(number) for letter, number in WORD.findall(rest)})

    def _take(self, name, words):
        if name in ("G90", "G91"):
            self._relative = dict.fromkeys(SCALES, name == "G91")
        elif name in ("M82", "M83"):
            self._relative["E"] = name == "M83"
        elif name == "G28":
            for letter in words or "XYZ":
                self.places[letter] = self._shifts[letter] = 0.0
        elif name == "G92":
            for letter in words or SCALES:
                self._shifts[letter] = self.places[letter] - words.get(letter, 0.0)
        elif name in ("G0", "G1"):
            self._move({letter: number for letter, number in words.items() if letter in SCALES})

    def _move(self, words):
        before = dict(self.places)
        for letter, number in words.items():
            begin = self.places[letter] if self._relative.get(letter) else self._shifts[letter]
            self.places[letter] = begin + number
        # what is less than a part of a pulse is no move
        self.moves += any(abs(self.places[letter] - before[letter]) * SCALES[letter] > 1 / 256 for letter in SCALES)


class Host:
    """A program at the gateway's pseudoterminal."""

    def __init__(self, path):
        self.port, self.begun, self.told = os.open(path, os.O_RDWR | os.O_NOCTTY), b"", []

    def ask(self, line):
        """The lines of the answer; a Fault if it is an error. What is said to all is kept in `told`."""
        os.write(self.port, f"{line}\n".encode())
        found, until = [], time.monotonic() + PATIENCE_S
        while not found or not found[-1].startswith("ok"):
            found += [one for one in self._lines(until) if not self._is_for_all(one)]
        if wrong := [one for one in found if one.startswith(("Error:", "echo:not carried out"))]:
            raise Fault(f"{line}: {wrong[0]}")
        return found

    def listen(self, seconds):
        """Until something is said to all, or for so long."""
        for one in self._lines(time.monotonic() + seconds, wait=False):
            self._is_for_all(one)

    def _is_for_all(self, line):
        for_all = line.startswith(("[", "Done printing file")) or " has ended" in line or "M999 permits" in line
        self.told += [line] * for_all
        return for_all

    def _lines(self, until, wait=True):
        while b"\n" not in self.begun:
            left = until - time.monotonic()
            if left <= 0 or not select.select([self.port], [], [], left)[0]:
                if wait:
                    raise Fault(f"the gateway's console was silent for {PATIENCE_S} s")
                return []
            try:
                self.begun += os.read(self.port, 65536)
            except OSError as why:
                raise Fault(f"the gateway's console has ended: {why.strerror}") from None
        *lines, self.begun = self.begun.split(b"\n")
        return [line.decode(errors="replace").strip() for line in lines]


class Print(Rig):
    done = False

    def __init__(self, build, part):
        super().__init__(build, "printer")
        self.part, self.text = part, part.read_text(encoding="utf-8", errors="replace")
        self.host = None

    def start(self):
        """The addresses of the page and of telnet."""
        records, parts = self.run / "records", self.run / "parts"
        records.mkdir()
        parts.mkdir()
        shutil.copy(self.part, parts / self.part.name)
        self.start_simulator("--service-us", "100", preset="printer")
        conf = read("pokeysd.conf")
        cpus = sorted(os.sched_getaffinity(0))
        conf["daemon"] |= {"record-folder": records, **({"cpu": cpus[-1]} if len(cpus) > 1 else {})}
        # long, so that a machine that stops for a second or two does not end the print
        conf["device printer"] |= {"address": self.address, "heartbeat-timeout-ms": 5000, "lost-after-ms": 5000}
        heaters = {name: {**keys, "max-age-ms": 2000} for name, keys in conf.items() if name.startswith("heater ")}
        self.start_daemon(conf["daemon"], conf["device printer"], heaters)
        return self.start_gateway(records, parts)

    def start_gateway(self, records, parts):
        conf = read("gateway.conf")
        conf["machine"]["folder"], conf["pty"]["path"] = parts, self.run / "pty"
        conf |= {"gateway": {"record-folder": records, "doctor-socket": self.run / "doctor",
                             "runtime-directory": self.run / "pokeysd"}}
        (path := self.run / "gateway.conf").write_text("".join(
            f"[{section}]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items())
            for section, keys in conf.items()), encoding="utf-8")
        where = {"PYTHONPATH": f"{ROOT / 'gateway'}:{ROOT / 'python'}", "PYTHONDONTWRITEBYTECODE": "1",
                 "POKEYS_SHM_LIBRARY": str(self.build / "shm/libpokeys_shm.so.0"),
                 "POKEYSCTL": str(self.build / "tools/pokeysctl"), "POKEYS_GATEWAY_WEB": str(self.build / "gateway/web")}
        ports = os.environ["LISTEN_PORTS"].split(":")
        self.spawn("gateway", "env", *(f"{name}={value}" for name, value in where.items()), f"LISTEN_FDS={len(ports)}",
                   "sh", "-c", 'LISTEN_PID=$$ exec "$0" "$@"', ROOT / "gateway/pokeys-gateway", "--config", path,
                   inherited=range(FIRST_SOCKET, FIRST_SOCKET + len(ports)))
        self.wait_for("the gateway", lambda: "the page is at" in self.gateway_log(), PATIENCE_S, "gateway")
        self.host = Host(self.run / "pty")
        self.wait_for("temperatures", lambda: re.search(r"T:.*B:", self.host.ask("M105")[-1]), PATIENCE_S, "gateway")
        return f"http://{HOST}:{ports[0]}/", f"{HOST} {ports[1]}"

    def gateway_log(self):
        return (self.run / "gateway.log").read_text(errors="replace")

    def print(self):
        """Print it once, with what is said of it. False: somebody has stopped it, or it has failed."""
        self.host.told.clear()
        self.host.ask(f"M23 {self.part.name}")
        self.host.ask("M24")
        begun, terminal = time.monotonic(), sys.stdout is not None and sys.stdout.isatty()
        while not self.host.told:
            if self.started["gateway"].poll() is not None:
                raise Fault(f"the gateway ended: {self.log_tail('gateway')}")
            say(self.line(time.monotonic() - begun), end="\r" if terminal else "\n")
            self.host.listen(0.2 if terminal else 1.0)
        if terminal:
            say("")
        self.host.listen(0.2)
        return "Done printing file" in self.host.told

    def line(self, elapsed):
        temperatures = re.findall(r"\b([TB]):(\S+) /(\S+)", self.host.ask("M105")[-1])
        places = self.host.ask("M114")[0].partition(" Count")[0]
        done = re.search(r"byte (\d+)/(\d+)", self.host.ask("M27")[0])
        # a job that has ended just now has no bytes
        percent = f"{100 * int(done[1]) // int(done[2]):3}" if done else "100"
        return (f"{elapsed:6.1f} s  " + "  ".join(f"{name} {float(now):5.1f}/{float(wanted):3.0f} C"
                                                 for name, now, wanted in temperatures)
                + "  " + re.sub(r"([A-Z]):(-?\d+\.\d\d)\d*", r"\1 \2", places) + f"  {self.part.name} {percent} %")

    def judge(self):
        """Is everything done, and each line once?"""
        path, state = Path(self.text), self.status()["state"]
        places = [axis["position"] for axis in state["engine"]["axes"][:len(SCALES)]]
        wanted = [round(path.places[letter] * scale) for letter, scale in SCALES.items()]
        near = all(abs(place - there) <= HOME_PULSES for place, there in zip(places, wanted, strict=True))
        if not near or state["moves"]["taken"] != path.moves:
            raise Fault(f"the axes are at {places} pulses after {state['moves']['taken']} moves; "
                        f"the file says {wanted} after {path.moves}")
        statistics = state["statistics"]
        return f"demo: ok moves={path.moves} late={statistics['late']} lost={statistics['lost']}"

    def again(self):
        """Until Ctrl-C, unless somebody has stopped it: then it is theirs."""
        while "Done printing file" in self.host.told:
            self.host.listen(AGAIN_S)
            self.print()
        why = re.sub(r"^(echo|Error):", "", self.host.told[0])
        say(f"demo: {why}; the printer is yours now, until Ctrl-C")
        while self.started["gateway"].poll() is None:
            time.sleep(1)
        raise Fault(f"the gateway ended: {self.log_tail('gateway')}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", required=True)
    parser.add_argument("--file", required=True, type=pathlib.Path)
    parser.add_argument("--judge", action="store_true", help="the file has one command a line, in capitals, and millimetres")
    options = parser.parse_args()
    demo = Print(options.build, options.file)

    def work():
        page, telnet = demo.start()
        say(f"the page is at {page}, the console at telnet {telnet}")
        if demo.print():
            say(demo.judge() if options.judge else "demo: ok")
            say("demo: it is printed again and again; Ctrl-C ends it")
        demo.done = True
        demo.again()
    return run(demo, work)


if __name__ == "__main__":
    sys.exit(main())
