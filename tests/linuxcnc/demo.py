#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeys-demo as it is installed: LinuxCNC with AXIS drives the simulated mill, and everything ends with it.

usage: demo.py BUILD POKEYS_SHM.so POKEYS_HOMECOMP.so"""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCREEN, PATIENCE_S = ":76", 60


def wait_for(what, condition, child=None):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, f"not within {PATIENCE_S} s: {what}"
        assert child is None or child.poll() is None, f"ended before: {what}"
        time.sleep(0.2)


def running():
    """Programs of the demo in this namespace."""
    names = {path.read_text(errors="replace").strip() for path in pathlib.Path("/proc").glob("[0-9]*/comm")}
    return names & {"pokeysd", "pokeys-sim", "linuxcnc", "milltask", "rtapi_app", "axis", "gladevcp", "halui", "io",
                    "linuxcncsvr"}


def left():
    """What it has put into folders of the computer."""
    return [path for path in (*pathlib.Path("/dev/shm").glob("pokeys-demo-*"), pathlib.Path("/tmp/linuxcnc.lock"))
            if path.exists()]


def run_demo(place, folder, end, ready=True):
    """Until LinuxCNC drives the device and shows the panel, or at once; then it is ended. Its status and words."""
    env = os.environ | {"DISPLAY": SCREEN, "PATH": f"{place}/usr/bin:{place}/usr/sbin:{os.environ['PATH']}",
                        "LD_LIBRARY_PATH": str(next(place.glob("usr/lib/*/libpokeys_shm.so.0")).parent),
                        "PYTHONPATH": f"{place}/usr/lib/python3/dist-packages", "HOME": str(folder.parent),
                        "PYTHONDONTWRITEBYTECODE": "1"}
    log = folder.parent / "demo.log"
    with open(log, "wb") as to:
        child = subprocess.Popen([place / "usr/bin/pokeys-demo", folder], env=env, stdout=to, stderr=to,
                                 stdin=subprocess.DEVNULL, start_new_session=True)
    child.folder, child.env = folder, env

    def is_driven():
        ran = subprocess.run([place / "usr/bin/pokeysctl", "--runtime-directory",
                              f"/dev/shm/pokeys-demo-{os.getuid()}/pokeysd", "get", "mill", "commander-alive", "--json"], capture_output=True, text=True, env=env,
                             check=False)
        return ran.returncode == 0 and json.loads(ran.stdout)["values"]["commander-alive"] == 1
    try:
        wait_for("LinuxCNC begins", lambda: "linuxcnc" in running() or child.poll() is not None)
        wait_for("LinuxCNC drives the device", lambda: not ready or is_driven(), child)
        # GladeVCP prints its window's number when it is ready, and AXIS goes on then
        wait_for("the panel in AXIS", lambda: not ready or re.search(r"^[0-9]+$", (folder / "linuxcnc.log").read_text(errors="replace"),
                                                        re.MULTILINE), child)
        end(child)
        status = child.wait(60)
    except (AssertionError, subprocess.SubprocessError) as fault:
        child.kill()
        logs = "".join(f"{path.name}:\n{path.read_text(errors='replace')[-1500:]}\n" for path in folder.glob("*.log"))
        raise AssertionError(f"{fault}\n{log.read_text(errors='replace')}\n{logs}") from None
    wait_for("nothing runs any more", lambda: not running())
    assert not left(), left()
    return status, log.read_text(encoding="utf-8")


def refuses_what_is_not_its_own(place, folder):
    """Neither a real device, nor another LinuxCNC, nor a folder of somebody else."""
    def refused(*words):
        ran = subprocess.run([place / "usr/bin/pokeys-demo", *words], capture_output=True, text=True, check=False,
                             env=os.environ | {"DISPLAY": SCREEN, "PATH": f"{place}/usr/bin:{place}/usr/sbin:"
                                                                          f"{os.environ['PATH']}"})
        assert ran.returncode == 1 and ran.stderr.count("\n") == 1, ran
        return ran.stderr
    conf = folder / "pokeysd.conf"
    text = conf.read_text(encoding="utf-8")
    conf.write_text(text.replace("address = 127.0.0.1", "address = 192.168.1.250"), encoding="utf-8")
    assert "address must be 127.0.0.1, and is 192.168.1.250; rename" in refused(folder)
    conf.write_text(text, encoding="utf-8")
    lock = pathlib.Path("/tmp/linuxcnc.lock")
    lock.touch()
    assert "LinuxCNC runs already; close it first" in refused(folder)
    lock.unlink()
    other = pathlib.Path(f"/dev/shm/pokeys-demo-{os.getuid()}")
    other.symlink_to("/tmp")
    assert "somebody else may write to it; remove it" in refused(folder)
    other.unlink()
    assert "demo.log: File exists" in refused(folder.parent / "demo.log" / "no-such")


def close_axis(_child):
    """As somebody in front of it."""
    subprocess.run(["axis-remote", "--quit"], env=os.environ | {"DISPLAY": SCREEN}, check=True, timeout=30)


# LinuxCNC's Python needs the environment of LinuxCNC: it looks for a file in the home folder.
CUT = """
import sys, time
import linuxcnc
command, stat = linuxcnc.command(), linuxcnc.stat()

def until(what, condition, again=lambda: None):
    end = time.monotonic() + 60
    while True:
        again()
        command.wait_complete()
        stat.poll()
        if condition():
            return
        assert time.monotonic() < end, what
        time.sleep(0.1)

until("no emergency stop", lambda: stat.task_state != linuxcnc.STATE_ESTOP, lambda: command.state(linuxcnc.STATE_ESTOP_RESET))
until("on", lambda: stat.task_state == linuxcnc.STATE_ON, lambda: command.state(linuxcnc.STATE_ON))
command.mode(linuxcnc.MODE_MANUAL)
command.wait_complete()
command.teleop_enable(0)
command.wait_complete()
command.home(-1)
until("all joints are homed", lambda: all(stat.homed[:stat.joints]))
command.mode(linuxcnc.MODE_AUTO)
command.wait_complete()
command.program_open(sys.argv[1])
command.auto(linuxcnc.AUTO_RUN, 0)
until("the program moves", lambda: stat.current_vel > 0 and stat.interp_state != linuxcnc.INTERP_IDLE)
"""


def ctrl_c_while_a_program_runs(child):
    """While a program runs, AXIS refuses to close. The demo then ends LinuxCNC through LinuxCNC's own script."""
    subprocess.run(["/usr/bin/python3", "-B", "-c", CUT, child.folder / "first-cut.ngc"], env=child.env, check=True,
                   timeout=280)
    child.send_signal(signal.SIGINT)


def inside(build):
    os.environ.pop("XDG_RUNTIME_DIR", None)
    with tempfile.TemporaryDirectory() as home:
        place, folder = pathlib.Path(home, "installed"), pathlib.Path(home, "mill-demo")
        subprocess.run(["meson", "install", "-C", build, "--no-rebuild", "--quiet", "--destdir", place], check=True,
                       stdout=subprocess.DEVNULL)
        screen = subprocess.Popen(["Xvfb", SCREEN, "-screen", "0", "1280x900x24", "-nolisten", "tcp"],
                                  stderr=subprocess.DEVNULL)
        try:
            wait_for("the screen", pathlib.Path(f"/tmp/.X11-unix/X{SCREEN[1:]}").exists)
            status, said = run_demo(place, folder, lambda child: child.send_signal(signal.SIGINT))
            assert status == 130 and f"its files and logs in {folder}" in said, (status, said)
            status, said = run_demo(place, folder, lambda child: child.send_signal(signal.SIGTERM), ready=False)
            assert status == 143, (status, said)
            # what somebody has changed stays
            conf = folder / "pokeysd.conf"
            conf.write_text(conf.read_text(encoding="utf-8") + "# mine\n", encoding="utf-8")
            status, said = run_demo(place, folder, close_axis)
            assert "# mine" in conf.read_text(encoding="utf-8"), said
            assert status == 0 and "Traceback" not in said, (status, said)
            status, said = run_demo(place, folder, ctrl_c_while_a_program_runs)
            assert status == 130 and "Traceback" not in said, (status, said)
            refuses_what_is_not_its_own(place, folder)
        finally:
            screen.terminate()
            screen.wait()
    return 0


def main():
    if sys.argv[1] == "--inside":
        return inside(pathlib.Path(sys.argv[2]))
    if not shutil.which("Xvfb") or not shutil.which("axis"):
        print("not tried: xvfb or linuxcnc-uspace is not installed", file=sys.stderr)
        return 77
    build, module, homecomp = (pathlib.Path(word).resolve() for word in sys.argv[1:])
    os.execv(ROOT / "scripts/hal-isolated",
             ["hal-isolated", "--module", str(module), "--module", str(homecomp), "--network",
              "/usr/bin/python3", "-B", __file__, "--inside", str(build)])
    return 1


if __name__ == "__main__":
    sys.exit(main())
