#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The panel in AXIS, by one line of the INI file, on a virtual screen: the example mill in LinuxCNC.

What is on the screen is judged by its colours, and left as build/panel/*.png for a person.

usage: axis.py POKEYS_SHM.so POKEYS_HOMECOMP.so POKEYSD POKEYS-SIM POKEYSCTL"""
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE.parent / "linuxcnc"), str(ROOT / "scripts"), str(ROOT / "tests")]
from first_cut import Fault, Machine  # noqa: E402  pylint: disable=wrong-import-position

SCREEN, LIMIT_S = ":77", 60
ON, WARNING, BAD = (0x2D, 0xA4, 0x4E), (0x9A, 0x67, 0x00), (0xCF, 0x22, 0x2E)
# in a process of its own: GTK reads DISPLAY once
SHOT = """
import sys, gi
gi.require_version("Gdk", "3.0")
from gi.repository import Gdk
root = Gdk.get_default_root_window()
Gdk.pixbuf_get_from_window(root, 0, 0, root.get_width(), root.get_height()).savev(sys.argv[1], "png", [], [])
"""


def missing():
    """What has to be installed, by its Debian package."""
    packages = [package for program, package in (("Xvfb", "xvfb"), ("axis", "linuxcnc-uspace")) if
                not shutil.which(program)]
    if subprocess.run(["/usr/bin/python3", "-c", "import gi; gi.require_version('Gtk', '3.0')"], capture_output=True,
                      check=False).returncode:
        packages.append("gir1.2-gtk-3.0")
    if subprocess.run(["/usr/bin/python3", "-c", "from PIL import Image"], capture_output=True, check=False).returncode:
        packages.append("python3-pil")
    return packages


class Screen(Machine):
    """The example mill with AXIS, which has the panel beside it."""

    def __init__(self, *programs):
        super().__init__("first_cut", *programs)
        self.out = self.build / "panel"
        self.out.mkdir(exist_ok=True)
        self.change({"mill.ini": [("[DISPLAY]\n", "[DISPLAY]\nGLADEVCP = -u pokeys_gladevcp.py -U runtime="
                                                  f"{self.run}/pokeysd pokeys_panel.ui\n")]})
        for name in ("pokeys_gladevcp.py", "pokeys_panel.ui"):
            shutil.copy(ROOT / "panel" / name, self.folder)
        axis = self.run / "machinist"
        axis.write_text('#!/bin/sh\nexec axis "$@"\n', encoding="utf-8")
        os.environ.update({"DISPLAY": SCREEN, "PYTHONDONTWRITEBYTECODE": "1", "GTK_CSD": "0", "NO_AT_BRIDGE": "1",
                           "PYTHONPATH": f"{ROOT}/panel:{ROOT}/python", "HOME": str(self.run)})

    def look(self, name):
        """How many pixels of each colour that counts are on the screen."""
        path = self.out / f"{name}.png"
        ran = subprocess.run(["/usr/bin/python3", "-c", SHOT, path], capture_output=True, text=True, check=False)
        if ran.returncode:
            return None
        from PIL import Image  # pylint: disable=import-outside-toplevel
        colours = {colour: count for count, colour in Image.open(path).convert("RGB").getcolors(1 << 24)}
        return {colour: colours.get(colour, 0) for colour in (ON, WARNING, BAD)}

    def becomes(self, name, condition):
        end, seen = time.monotonic() + LIMIT_S, None
        while time.monotonic() < end:
            seen = self.look(name)
            if seen and condition(seen):
                print(f"{name}: {seen}")
                return
            if self.started["linuxcnc"].poll() is not None:
                break
            time.sleep(1)
        raise Fault(f"the screen never showed {name}: {seen}")

    def run_it(self):
        self.start()
        self.spawn("Xvfb", "Xvfb", SCREEN, "-screen", "0", "1280x900x24", "-nolisten", "tcp")
        self.wait_for("the screen", pathlib.Path("/tmp/.X11-unix/X77").exists, 60, "Xvfb")
        self.spawn("linuxcnc", "linuxcnc", "-r", self.folder / "mill.ini")
        self.becomes("running", lambda seen: seen[ON] and seen[WARNING] and not seen[BAD])
        self.ask("probe 2 -2000000 2000000 no pin 4")     # it closes to ground
        self.becomes("input-off", lambda seen: seen[WARNING] and not seen[ON])
        self.ask("probe 2 -2000000 -8000 no pin 4")
        self.becomes("input-on", lambda seen: seen[ON] and seen[WARNING])
        self.stop("pokeysd")
        self.becomes("no-daemon", lambda seen: seen[BAD] and not seen[WARNING])
        self.start_again()
        self.becomes("again", lambda seen: seen[WARNING] and not seen[BAD])

    def start_again(self):
        """The panel finds the next daemon."""
        self.spawn("pokeysd", self.pokeysd, "--config", self.folder / "pokeysd.conf")

    def ask(self, words):
        subprocess.run([self.sim, "--ctl", self.run / "sim.sock", *words.split()], check=True, capture_output=True)

    def end(self):
        """LinuxCNC ends by itself when its user interface does."""
        child = self.started.pop("linuxcnc", None)
        if child:
            subprocess.run(["axis-remote", "--quit"], timeout=30, check=False)
            try:
                child.wait(60)
            except subprocess.TimeoutExpired:
                os.killpg(child.pid, signal.SIGKILL)
                child.wait()


def inside(programs):
    screen = Screen(*programs)
    try:
        screen.run_it()
        return 0
    except Fault as fault:
        print(f"FAILED: {fault}\n{screen.text('linuxcnc.log')[-6000:]}\n{screen.text('pokeysd.log')[-2000:]}")
        return 1
    finally:
        screen.end()
        screen.close()


def main():
    if sys.argv[1] == "--inside":
        return inside([pathlib.Path(word) for word in sys.argv[2:]])
    if packages := missing():
        print(f"not tried: not installed: {' '.join(packages)}", file=sys.stderr)
        return 77
    module, homecomp, *programs = (pathlib.Path(word).resolve() for word in sys.argv[1:])
    os.execv(ROOT / "scripts/hal-isolated",
             ["hal-isolated", "--module", str(module), "--module", str(homecomp), "--network",
              *(word for path in programs for word in ("--keep", str(path.parent))),
              "/usr/bin/python3", "-B", __file__, "--inside", *map(str, programs)])
    return 1


if __name__ == "__main__":
    sys.exit(main())
