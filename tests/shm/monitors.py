# SPDX-License-Identifier: GPL-2.0-or-later
"""The monitor of examples/, and the Python package, against a daemon that publishes
values known here (peer.c, fill_known)."""
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

PEER, MONITOR, LIBRARY, PACKAGE = sys.argv[1:5]
ENVIRONMENT = dict(os.environ, POKEYS_SHM_LIBRARY=LIBRARY, PYTHONPATH=PACKAGE)
# the monitor's JSON, as far as it does not change by itself, from the package
FACTS = """
import json, sys, pokeys
with pokeys.attach("mill", runtime=sys.argv[1], timeout=60) as device:
    state = device.read(stale_ok=True)
print(json.dumps({
    "device": device.name, "link": state.word("link-state"), "fresh": state.connected,
    "serial": state.info.SerialNumber, "epoch": state.daemon.epoch,
    "inputs": "".join(str(int(pin.in_)) for pin in state.pin),
    "outputs": "".join(str(int(pin.out_fb)) for pin in state.pin),
    "analog": [adc.raw for adc in state.adc], "encoders": [encoder.rawcounts for encoder in state.encoder],
    "positions": [joint.counts for joint in state.joint],
    "late": state.packets.late, "lost": state.packets.lost, "sent": state.packets.sent}))
"""
NOBODY = 65534
BASE = "/dev/shm" if os.access("/dev/shm", os.W_OK) else "/tmp"


def pins(*numbers):
    return "".join("1" if i in numbers else "0" for i in range(55))


class Monitors(unittest.TestCase):
    def setUp(self):
        self.base = tempfile.mkdtemp(prefix="pk.", dir=BASE)
        self.runtime = self.base + "/run"
        self.peer = None

    def tearDown(self):
        self.end()
        shutil.rmtree(self.base)

    def end(self):
        if self.peer:
            self.peer.send_signal(signal.SIGTERM)
            self.peer.wait(60)
            self.peer.stdout.close()
            self.peer = None
            self.assertEqual(os.listdir(self.runtime), [], "something is left")

    def start(self, values="known"):
        self.peer = subprocess.Popen([PEER, values, self.runtime], stdout=subprocess.PIPE, text=True)
        self.assertEqual(self.peer.stdout.readline(), "ready\n")

    def run_monitor(self, *arguments):
        return subprocess.run([MONITOR, "--runtime-directory", self.runtime, *arguments], text=True,
                              capture_output=True, timeout=120, env=ENVIRONMENT, check=False)

    def test_json_shows_what_the_daemon_published(self):
        self.start()
        ran = self.run_monitor("--once", "--json")
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        seen = json.loads(ran.stdout)
        self.assertEqual(seen["device"], "mill")
        self.assertEqual(seen["link"], "running")
        self.assertIs(seen["fresh"], True)
        self.assertEqual(seen["serial"], 12345)
        self.assertEqual(seen["inputs"], pins(0, 7, 54))
        self.assertEqual(seen["outputs"], pins(9))
        self.assertEqual(seen["analog"], [0, 0, 4095, 0, 0, 0, 0])
        self.assertEqual(seen["encoders"], [-7] + [0] * 24 + [1000000])
        self.assertEqual(seen["positions"], [0, -250, 0, 0, 0, 0, 0, 0])
        self.assertEqual((seen["sent"], seen["late"], seen["lost"]), (10, 2, 1))
        self.assertGreater(seen["cycle"], 0)
        self.assertGreaterEqual(seen["age_ms"]["digital"], 0)
        self.assertIn(seen["age_ms"]["motion"], (None, -1))

    def test_the_python_package_says_the_same(self):
        for values in "known", "halted", "future":
            with self.subTest(values=values):
                self.start(values)
                monitor = json.loads(self.run_monitor("--once", "--json").stdout)
                del monitor["age_ms"], monitor["cycle"]
                ran = subprocess.run([sys.executable, "-B", "-c", FACTS, self.runtime], text=True, check=False,
                                     capture_output=True, timeout=120, env=ENVIRONMENT)
                self.assertEqual((ran.returncode, ran.stderr), (0, ""))
                self.assertEqual(json.loads(ran.stdout), monitor)
                self.end()

    def test_text_is_for_people(self):
        self.start()
        ran = self.run_monitor("--once", "mill")
        self.assertEqual(ran.returncode, 0)
        self.assertIn("mill: running, serial 12345", ran.stdout)
        self.assertIn("0:-7 25:1000000", ran.stdout)
        self.assertIn("0:0(off) 1:-250\n", ran.stdout.replace("*", ""))
        self.assertIn("1......1.. ..........", ran.stdout)

    def test_dead_daemon_is_shown_as_stale_by_the_reader_alone(self):
        self.start()
        self.peer.send_signal(signal.SIGSTOP)

        # the images stay fresh for an hour, so only their age shows it
        first = json.loads(self.run_monitor("--once", "--json").stdout)
        second = json.loads(self.run_monitor("--once", "--json").stdout)
        self.assertEqual(first["cycle"], second["cycle"])
        self.assertGreater(second["age_ms"]["cycle"], first["age_ms"]["cycle"])
        self.peer.send_signal(signal.SIGCONT)

    def shown_as_stale(self):
        seen = json.loads(self.run_monitor("--once", "--json").stdout)
        self.assertIs(seen["fresh"], False)
        self.assertIn("(STALE)", self.run_monitor("--once").stdout)
        return seen

    def test_positions_that_are_old_make_it_stale(self):
        self.start("halted")
        self.shown_as_stale()

    def test_positions_of_the_future_make_it_stale(self):
        self.start("future")
        self.assertIn(self.shown_as_stale()["age_ms"]["motion"], (None, -1))

    def test_no_daemon_is_said_in_one_line(self):
        ran = self.run_monitor("--once", "mill")
        self.assertEqual(ran.returncode, 1)
        self.assertEqual(ran.stdout, "")
        self.assertRegex(ran.stderr, r"^mill: no daemon in .*; is pokeysd running\?\n$")
        ran = self.run_monitor("--once")
        self.assertEqual(ran.returncode, 1)
        self.assertEqual(ran.stderr, "no daemon runs; name a DEVICE to wait for it\n")

    @unittest.skipIf(os.geteuid(), "only root can have a folder that is not mine")
    def test_folder_of_others_is_not_called_a_folder_without_daemon(self):
        os.chmod(self.base, 0o711)
        os.mkdir(self.runtime, 0o700)
        # the checkout may be in a folder that only its owner can enter
        with tempfile.TemporaryDirectory(prefix="pk.", dir="/tmp") as folder:
            os.chmod(folder, 0o755)
            library = shutil.copy(LIBRARY, f"{folder}/libpokeys_shm.so.0")
            shutil.copy(MONITOR, folder)
            ran = subprocess.run([f"{folder}/monitor", "--once", "-r", self.runtime], text=True, timeout=120,
                                 capture_output=True, check=False, user=NOBODY, group=NOBODY, extra_groups=[], cwd="/",
                                 env=dict(os.environ, LD_LIBRARY_PATH=folder, POKEYS_SHM_LIBRARY=library))
            self.assertEqual((ran.returncode, ran.stderr),
                             (1, "the runtime folder: Permission denied; this user must be in "
                              "its group, which is pokeys-monitor as a rule\n"))

    def test_unknown_device_is_said_in_one_line(self):
        self.start()
        ran = self.run_monitor("--once", "lathe")
        self.assertEqual(ran.returncode, 1)
        self.assertEqual(ran.stderr, "lathe: the daemon has no device 'lathe'; it has: mill\n")

    def test_bad_use_is_refused(self):
        for words in (["--nonsense"], ["--interval", "0"], ["--interval", "x"],
                      ["--interval", "-1"], ["--interval", "nan"], ["--interval", "5x"],
                      ["mill", "lathe"], ["--once", "no name"], ["--once", "m" * 40],
                      ["--once", "mill", "--runtime-directory", "relative"]):
            ran = self.run_monitor(*words)
            self.assertEqual(ran.returncode, 2, words)
            self.assertNotIn("Traceback", ran.stderr)

    def test_help_is_no_mistake(self):
        ran = self.run_monitor("--help")
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        self.assertIn("--once", ran.stdout)

    def test_interval_is_kept(self):
        self.start()
        began = time.monotonic()
        monitor = subprocess.Popen([MONITOR, "-r", self.runtime, "mill", "--json", "--interval", "0.6"],
                                   stdout=subprocess.PIPE, text=True, env=ENVIRONMENT)
        cycles = [json.loads(monitor.stdout.readline())["cycle"] for _ in range(4)]
        # the daemon notifies ten times in each; a machine that is held makes it longer
        self.assertGreaterEqual(time.monotonic() - began, 1.8)
        self.assertGreater(cycles[3], cycles[0])
        monitor.send_signal(signal.SIGINT)
        monitor.wait(60)
        monitor.stdout.close()

    def test_monitor_may_be_first_and_follows(self):
        monitor = subprocess.Popen([MONITOR, "--runtime-directory", self.runtime, "mill", "--json",
                                    "--interval", "0.02"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                   text=True, env=ENVIRONMENT)
        self.start()
        self.assertEqual(json.loads(monitor.stdout.readline())["serial"], 12345)
        monitor.send_signal(signal.SIGINT)
        self.assertEqual(monitor.wait(60), 0)
        monitor.stdout.close()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
