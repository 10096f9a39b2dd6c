# SPDX-License-Identifier: GPL-2.0-or-later
"""Simulator, daemon and LinuxCNC's HAL of one's own, for the demo and the bench.

To be used inside scripts/hal-isolated: whatever is started here ends with that
namespace, also when this program is interrupted or killed.
"""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import time

ADDRESS = "127.0.0.1"  # the network namespace is ours alone
PATIENCE_S = 60  # when to give up waiting for an event; not a requirement on its speed


class Fault(Exception):
    """What failed, in one line."""


class Rig:
    def __init__(self, build, name):
        self.build, self.device = pathlib.Path(build), name
        # in memory, as /run is: on a disk the daemon would record nothing
        parent = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
        self.run = pathlib.Path(tempfile.mkdtemp(prefix="pokeys-", dir=parent))
        self.run.chmod(0o755)
        self.started = {}
        self.hal = None
        self.address = ADDRESS
        self.there = ()  # before a command that is to run where the device is

    def spawn(self, name, *words, inherited=()):
        """In a session of its own: ^C is for us, and who ends first is for us to say.

        `inherited`: descriptors that the program gets as well."""
        command = [str(word) for word in words]
        with open(self.run / f"{name}.log", "wb") as log:
            try:
                child = subprocess.Popen(command, stdout=log, stderr=log, stdin=subprocess.DEVNULL,
                                         start_new_session=True, pass_fds=inherited)
            except OSError as error:
                raise Fault(f"{name} cannot be started: {error}") from None
        self.started[name] = child
        return child

    def log_tail(self, name):
        lines = (self.run / f"{name}.log").read_text(errors="replace").strip().splitlines()
        return lines[-1] if lines else "it said nothing"

    def wait_for(self, what, test, limit, name=None):
        """Until test() holds; a Fault after `limit` s, or if the named child ends before."""
        end = time.monotonic() + limit
        while time.monotonic() < end:
            if test():
                return
            if name and self.started[name].poll() is not None:
                raise Fault(f"{name} ended with {self.started[name].returncode}: {self.log_tail(name)}")
            time.sleep(0.02)
        raise Fault(f"{what} did not happen within {limit} s")

    def halcmd(self, *words):
        """To a file, not a pipe: rtapi_app, which loadrt starts, keeps the output open."""
        with open(self.run / "halcmd.log", "w+", encoding="utf-8") as log:
            done = subprocess.run(("halcmd",) + words, stdout=log, stderr=log,
                                  stdin=subprocess.DEVNULL, timeout=PATIENCE_S, check=False,
                                  start_new_session=True)
            log.seek(0)
            said = log.read()
        if done.returncode:
            raise Fault(f"halcmd {' '.join(words)}: {said.strip()}")
        return said

    def status(self, device=None):
        """A device's entry of pokeysctl's JSON."""
        done = subprocess.run((self.build / "tools/pokeysctl", "--runtime-directory", self.run / "pokeysd",
                               "status", device or self.device, "--json"),
                              capture_output=True, text=True, check=False)
        try:
            return json.loads(done.stdout)["devices"][0]
        except (ValueError, TypeError, LookupError):
            raise Fault(f"pokeysctl status: {(done.stderr or done.stdout).strip()}") from None

    def is_fresh(self):
        """A daemon that has just begun may have nothing to show yet."""
        try:
            return self.status()["fresh"]
        except Fault:
            return False

    def start_simulator(self, *options, preset="demo"):
        self.start_simulator_at(self.address, "pokeys-sim", *options, preset=preset)

    def start_simulator_at(self, address, name, *options, preset="demo"):
        socket = self.run / f"{name}.sock"
        socket.unlink(missing_ok=True)
        self.spawn(name, *self.there, self.build / "sim/pokeys-sim", "--model", "57CNC",
                   "--address", address, "--control", socket, "--preset", preset, *options)
        self.wait_for("the simulator's control socket", socket.exists, PATIENCE_S, name)

    def start_daemon(self, daemon, device, loops=None):
        """`daemon` and `device` are dicts of keys for the two sections; `loops` has one for each "heater NAME" and "servo NAME"."""
        self.start_daemon_with(daemon, {self.device: {"address": self.address, **device}}, loops)
        self.wait_for("the device running", self.is_fresh, PATIENCE_S, "pokeysd")

    def configure(self, daemon, devices, loops=None):
        """pokeysd.conf; `devices` has a dict of keys for each device's name, `loops` as in start_daemon()."""
        conf = self.run / "pokeysd.conf"
        daemon = {"runtime-directory": self.run / "pokeysd", "realtime": "optional", **daemon}
        sections = {"daemon": daemon, **{f"device {name}": keys for name, keys in devices.items()},
                    **(loops or {})}
        conf.write_text("".join(f"[{section}]\n" + "".join(f"{k} = {v}\n" for k, v in keys.items())
                                for section, keys in sections.items()))
        return conf

    def start_daemon_with(self, daemon, devices, loops=None):
        """As configure(); none of the devices is waited for."""
        conf = self.configure(daemon, devices, loops)
        self.spawn("pokeysd", self.build / "daemon/control/pokeysd", "--config", conf)
        self.wait_for("the daemon's shared memory", (self.run / "pokeysd/current").exists, PATIENCE_S, "pokeysd")

    def start_hal(self, *parameters):
        self.halcmd("loadrt", "threads", "name1=servo-thread", "period1=1000000")
        self.halcmd("loadrt", "pokeys_shm", f"devices={self.device}", f"runtime={self.run}/pokeysd",
                    *parameters)
        self.halcmd("addf", "pokeys.0.read", "servo-thread")
        self.halcmd("addf", "pokeys.0.write", "servo-thread")
        import hal  # pylint: disable=import-outside-toplevel
        self.hal = hal

    def get(self, pin):
        return self.hal.get_value(f"pokeys.0.{pin}")

    def stop(self, name):
        child = self.started.pop(name)
        child.terminate()
        try:
            child.wait(3)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()

    def end_hal(self):
        if self.hal:
            # not "halrun -U": that ends whoever has HAL's memory mapped, us too
            self.halcmd("unloadrt", "all")
        self.hal = None

    def close(self):
        self.end_hal()
        for name in reversed(list(self.started)):
            self.stop(name)
        shutil.rmtree(self.run, ignore_errors=True)
