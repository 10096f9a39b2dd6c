# SPDX-License-Identifier: GPL-2.0-or-later
"""A simulated device, the real daemon over UDP and a real LinuxCNC HAL, for the tests that
need the whole way. Arguments of such a test: MODULE.so POKEYSD POKEYS-SIM [PATTERN]."""
import os
import random
import re
import shutil
import signal
import pathlib
import subprocess
import sys
import tempfile
import time
import traceback
import hal_live

MODULE, POKEYSD, SIM = (os.path.abspath(path) for path in sys.argv[1:4])
# long timeouts: on a busy machine without realtime everything is late at times. That of the
# device's own failsafe as well: it stops the engine, and then motion needs another edge
CONFIG = """\
[daemon]
runtime-directory = {folder}/run
realtime = optional

[device mill]
address = {address}
digital-outputs = 31-34
heartbeat-timeout-ms = 3000
failsafe-timeout-ms = 10000
lost-after-ms = {lost_ms}
"""
SCALE = 100  # pulses a millimetre
RUNNING = 3  # link-state
SOON = 100  # cycles of the daemon in which something would have happened


class Machine:
    names = "both"
    preset = "demo"
    options = ()        # of the simulator, besides
    lost_ms = 10000     # a short time without a processor must not count as a loss

    def __init__(self):
        # a tmpfs, as /run is; short, for sockets live below it
        where = "/dev/shm" if os.access("/dev/shm", os.W_OK) else "/tmp"
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="pokeys-hal-", dir=where))
        self.folder.chmod(0o755)
        self.address = "127.{}.{}.{}".format(*(random.randint(2, 250) for _ in range(3)))
        (self.folder / "conf").write_text(CONFIG.format(folder=self.folder, address=self.address,
                                                        lost_ms=self.lost_ms))
        self.children = {}
        try:
            self.hal = hal_live.Hal(MODULE, self.folder)
        except BaseException:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise

    def spawn(self, name, *command):
        log = open(self.folder / f"{name}.log", "ab")
        with log:
            self.children[name] = subprocess.Popen(command, stdout=log, stderr=log,
                                                   stdin=subprocess.DEVNULL)

    def device(self):
        self.spawn("sim", SIM, "--model", "57CNC", "--address", self.address, "--no-discovery",
                   "--control", str(self.folder / "sim"), "--preset", self.preset,
                   "--quiet", *self.options)
        end = time.monotonic() + 60
        while not (self.folder / "sim").exists():
            assert time.monotonic() < end and self.children["sim"].poll() is None, self.log("sim")
            time.sleep(0.01)

    def daemon(self):
        self.spawn("pokeysd", POKEYSD, "--config", str(self.folder / "conf"))

    def load(self):
        self.hal.start(f"runtime={self.folder}/run names={self.names}")
        self.hal.set("joint.00.scale", SCALE)
        self.hal.set("encoder.00.scale", SCALE)
        self.hal.set("encoder-keep-count", 0)       # a busy machine may be silent for 0.5 s

    def all(self):
        self.device()
        self.daemon()
        self.load()
        self.hal.becomes("connected", True)
        self.hal.becomes("commander", True)
        return self.hal

    def sim(self, command):
        """A command to the simulator; its answer as a dict."""
        done = subprocess.run([SIM, "--ctl", str(self.folder / "sim"), *command.split()],
                              capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{command}: {done.stderr}"
        return dict(line.split("=", 1) for line in done.stdout.split("\n") if "=" in line)

    def sim_shows(self, command, key, value):
        return hal_live.wait(f"{command}: {key} is {value}",
                             lambda: self.sim(command)[key] == value)

    def cycles(self, count):
        """The daemon has gone on by so many, as the HAL sees it."""
        begin = self.hal.get("cycle")
        hal_live.wait(f"{count} cycles", lambda: self.hal.get("cycle") >= begin + count)

    def passes(self):
        """What is set now has been told to the daemon, and what comes of it has come."""
        self.hal.periods()
        self.cycles(SOON)

    def press(self, pin, done):
        """Until it is done. A press in a moment without fresh data is refused, and counted, and
        such moments are many on a busy machine; one that is not counted is done, or this fails."""
        def refused():
            return self.hal.get("one-shot-failed-count") > failed

        for _ in range(60):
            failed = self.hal.get("one-shot-failed-count")
            self.hal.set(pin, 1)
            hal_live.wait(f"what {pin} is pressed for", lambda: done() or refused())
            self.hal.set(pin, 0)
            self.hal.periods()
            if done():
                return
        raise AssertionError(f"{pin} is always refused")

    def machine_on(self):
        """The edge that motion needs, with the command where the axis stands."""
        self.hal.set("machine-is-on", 0)
        self.hal.set("joint.00.pos-cmd", self.hal.get("joint.00.pos-fb"))
        self.hal.set("joint.00.enable", 1)
        self.permit(lambda on: self.hal.set("machine-is-on", on))
        self.hal.becomes("joint.00.enabled", True)

    def permit(self, switch):
        """Off and on, until the low has been seen, however late that is."""
        for off in (5, 50, 500, 5000):
            switch(0)
            self.hal.periods()
            self.cycles(off)
            switch(1)
            until = time.monotonic() + 10
            while not self.hal.get("machine-on-permitted") and time.monotonic() < until:
                time.sleep(0.01)
            if self.hal.get("machine-on-permitted"):
                break
        self.hal.becomes("machine-on-permitted", True)

    def applied(self, name, value):
        """A setting of the device, until it is one. The component looks at its parameters ten
        times a second: before it has, all that is known to it is applied already."""
        before = self.hal.get("config.generation")
        self.hal.set(name, value)
        self.taken(before)

    def taken(self, before=0):
        """What is wished of the device's settings since that generation it has."""
        self.hal.becomes("config.generation", lambda have: have > before)
        self.cycles(2 * SOON)       # and what was set while the component looked
        hal_live.wait("the settings are taken", lambda: self.hal.get("config.generation") ==
                      self.hal.get("config.generation-applied"))
        self.hal.becomes("config.state", 3)

    def move(self, to):
        self.hal.set("joint.00.pos-cmd", to)
        self.hal.becomes("joint.00.pos-fb", to)
        self.hal.becomes("joint.00.in-position", True)

    def kill(self, name):
        child = self.children.pop(name)
        child.kill()
        child.wait()

    def hold(self, name, seconds):
        """It gets no processor for so long."""
        self.children[name].send_signal(signal.SIGSTOP)
        time.sleep(seconds)
        self.children[name].send_signal(signal.SIGCONT)

    def log(self, name, last=2000):
        """So many of the last characters that it printed."""
        path = self.folder / f"{name}.log"
        return path.read_text(errors="replace")[-last:] if path.exists() else ""

    def close(self):
        self.hal.close()
        for name in list(self.children):
            self.kill(name)
        shutil.rmtree(self.folder, ignore_errors=True)


def main(tests):
    faults = []
    for test in tests:
        if not re.search(sys.argv[4] if len(sys.argv) > 4 else "", test.__name__):
            continue
        machine = Machine()
        try:
            test(machine)
            print(f"ok: {test.__name__}")
        except (AssertionError, EOFError) as fault:
            faults.append(fault)
            print(f"FAILED: {test.__name__}: {fault}\n{traceback.format_exc()}{machine.hal.said()[-2000:]}\n"
                  f"{machine.log('pokeysd')}\n{machine.log('sim')}")
        finally:
            machine.close()
    return hal_live.safety.status(faults)
