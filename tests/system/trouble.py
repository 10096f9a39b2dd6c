#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The daemon in trouble: no rights, no folder, nobody who reads its messages, a
configuration that is none. And what the service manager is told."""
import ctypes
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import time

from house import PATIENCE, House, Skip, end, equal, for_everybody, main, run, wait_for

NOBODY = 65534
MONITORS = 4004  # a group that nobody has

def unprivileged():
    """Arguments of Popen for a process without rights to realtime and locked memory."""
    def drop():
        resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
        resource.setrlimit(resource.RLIMIT_MEMLOCK, (65536, 65536))
    if os.geteuid() != 0:
        return {"preexec_fn": drop}
    return {"preexec_fn": drop, "user": NOBODY, "group": NOBODY, "extra_groups": []}


def give(house):
    """A runtime folder that the unprivileged user may write to."""
    house.runtime.mkdir(mode=0o2770)
    house.write_conf()
    house.conf.chmod(0o644)
    if os.geteuid() == 0:
        os.chown(house.runtime, NOBODY, NOBODY)
        os.chmod(house.runtime, 0o2770)
    house.programs = {name: for_everybody(name) for name in house.programs}


def test_without_rights_it_refuses_in_one_line_that_helps():
    with House(realtime="required") as house:
        give(house)
        daemon = house.start_daemon(wait=False, **unprivileged())
        equal(daemon.wait(PATIENCE), 77, house.log())
        said = house.complaint()
        assert "--no-realtime" in said and ("LimitMEMLOCK" in said or "CAP_SYS_NICE" in said), said
        assert not any(house.runtime.iterdir()), list(house.runtime.iterdir())


def test_no_realtime_goes_on_with_a_warning():
    with House(realtime="required") as house:
        give(house)
        house.start_sim()
        daemon = house.start_daemon("--no-realtime", **unprivileged())
        house.wait_fresh()
        device = house.device()
        equal(device["state"]["flags"]["realtime"], False)
        house.tells("NOT REALTIME", "status")
        assert "going on without" in house.log(), house.log()
        equal(end(daemon), 0)


def test_a_mirror_that_somebody_removes_is_told_once():
    # and one line says why the metrics are of no device
    with House(**{"metrics-interval-ms": 100}) as house:
        house.daemon_keys["metrics-file"] = house.folder / "m"
        daemon = house.start_daemon()
        shutil.rmtree(house.runtime / "monitor")
        wait_for("the complaint", lambda: "cannot be read back" in house.log(), say=house.log)
        wait_for("the other", lambda: "was removed by somebody" in house.log(), say=house.log)
        assert "somebody has removed its folder monitor" in house.ctl("status", "mill").stderr, house.ctl("status", "mill")
        wait_for("metrics", (house.folder / "m").exists)
        written = (house.folder / "m").stat().st_mtime_ns
        wait_for("the next", lambda: (house.folder / "m").stat().st_mtime_ns > written + 10**9)
        equal(house.log().count("cannot be read back"), 1, house.log())
        equal(end(daemon), 0, house.log())


def test_a_runtime_folder_that_cannot_be_used_is_named():
    with House() as house:
        if os.geteuid() == 0:
            house.daemon_keys["runtime-directory"] = "/proc/pokeysd"
        else:
            house.daemon_keys["runtime-directory"] = "/pokeysd"
        daemon = house.start_daemon(wait=False)
        equal(daemon.wait(PATIENCE), 1, house.log())
        assert "pokeysd: /p" in house.complaint(), house.log()


def test_a_group_that_does_not_exist_is_named():
    with House(group="nosuchgroup") as house:
        daemon = house.start_daemon(wait=False)
        equal(daemon.wait(PATIENCE), 1, house.log())
        assert "nosuchgroup" in house.complaint(), house.log()


def test_who_may_read_may_not_order():
    if os.geteuid() != 0:
        raise Skip("needs root, to become another user")
    with House(**{"monitor-group": MONITORS}) as house:
        house.start_sim()
        house.start_daemon()
        house.wait_fresh()

        def ctl(*words, groups=(MONITORS,)):
            return run(for_everybody("pokeysctl"), "-r", house.runtime, *words, user=NOBODY, group=NOBODY,
                       extra_groups=groups)
        status = ctl("status")
        assert status.returncode == 0 and "mill" in status.stdout, status
        for order in ("config", "apply", "mill"), ("config", "save", "mill"):
            refused = ctl(*order)
            assert refused.returncode != 0 and "ermission denied" in refused.stderr, refused
        record = ctl("record", "mill", "/dev/null")
        assert record.returncode == 0 and "packets" in record.stdout, record
        for words in ("status",), ("record", "mill", "/dev/null"):
            stranger = ctl(*words, groups=())
            assert f"this user must be in group {MONITORS}" in stranger.stderr, stranger
        # others may pass the folder, so nothing else in it may be for them
        equal([path for path in house.runtime.iterdir() if not path.is_symlink() and path.stat().st_mode & 0o7], [])
        equal(house.runtime.stat().st_mode & 0o7777, 0o2751)


def test_an_interface_that_does_not_come_is_named():
    with House(interface="nosuch0") as house:
        began = time.monotonic()
        daemon = house.start_daemon(wait=False)
        equal(daemon.wait(PATIENCE), 1, house.log())
        # systemd gives up after ten starts in 60 s
        assert time.monotonic() - began > 6, house.log()
        first, last = house.log().splitlines()
        assert "no network interface nosuch0" in first and "waiting for it" in first, first
        assert "nosuch0 has not come" in last, last
        assert not house.runtime.exists(), list(house.runtime.iterdir())


def killed(house):
    """A daemon was killed and has left all that a daemon has in the runtime folder."""
    house.daemon_keys["record-folder"] = house.folder / "records"
    house.daemon_keys["record-folder"].mkdir()
    house.start_sim()
    daemon = house.start_daemon()
    house.wait_fresh()
    end(daemon, signal.SIGKILL)
    left = {path.name for path in house.runtime.iterdir()}
    assert {"lock", "current", "control", "recorder"} < left, left
    (house.folder / "pokeysd.log").unlink()


def has_cleared(house, daemon, status=0, said="ending (SIG"):
    """It has ended before it drove anything, and has put the folder in order all the same."""
    equal(daemon.wait(PATIENCE), status, house.log())
    assert "ready: " not in house.log() and said in house.log(), house.log()
    assert not any(house.runtime.iterdir()), list(house.runtime.iterdir())
    records = [path.name for path in house.daemon_keys["record-folder"].iterdir()]
    assert len(records) == 1 and records[0].endswith("-died.pcapng"), records


def test_whoever_waits_for_an_interface_can_be_ended_in_order():
    for number in signal.SIGTERM, signal.SIGINT:
        with House() as house:
            killed(house)
            house.daemon_keys["interface"] = "nosuch0"
            daemon = house.start_daemon(wait=False)
            wait_for("the wait", lambda: "waiting for it" in house.log(), say=house.log)
            daemon.send_signal(number)
            has_cleared(house, daemon)


def test_what_a_killed_daemon_left_is_cleared_where_no_other_one_comes():
    with House() as house:
        killed(house)
        house.daemon_keys["nonsense"] = 1
        equal(house.start_daemon(wait=False).wait(PATIENCE), 78, house.log())
        house.tells("daemon not publishing", "status")
        # the folder is read from that configuration all the same
        cleared = run(house.programs["pokeysd"], "--clear", "--config", house.conf)
        equal((cleared.returncode, cleared.stdout, cleared.stderr), (0, "", ""))
        house.tells("no daemon runs in", "status")
        # the witness of why it died stays for whoever can read it
        equal([path.name for path in house.runtime.iterdir()], ["recorder"])
        equal(house.ctl("record", house.folder / "trouble.pcapng").returncode, 0)
        del house.daemon_keys["nonsense"]
        equal(end(house.start_daemon()), 0, house.log())
        assert any(house.daemon_keys["record-folder"].glob("*-died.pcapng")), house.log()


def test_what_cannot_be_cleared_is_said_each_time():
    with House() as house:
        killed(house)
        (house.runtime / "current").unlink()
        (house.runtime / "current").mkdir()
        for _ in range(3):
            cleared = run(house.programs["pokeysd"], "--clear", "--config", house.conf)
            equal((cleared.returncode, cleared.stdout), (1, ""))
            assert re.fullmatch(r".*/current: a folder, in the place of .*; remove it\n", cleared.stderr), cleared
        (house.runtime / "current").rmdir()
        cleared = run(house.programs["pokeysd"], "--clear", "--config", house.conf)
        equal((cleared.returncode, cleared.stdout, cleared.stderr), (0, "", ""))
        house.tells("no daemon runs in", "status")


def test_a_folder_that_cannot_be_read_is_not_guessed():
    with House() as house:
        killed(house)
        house.daemon_keys["runtime-directory"] = "run"
        house.write_conf()
        for conf, said in ((house.conf, rf"pokeysd: {house.conf}:\d+: \[daemon\]: no folder can be read from "
                            r"runtime-directory; pokeysd --check-config says why"),
                           (house.folder / "none", r".*/none: there is no such file; .*")):
            cleared = run(house.programs["pokeysd"], "--clear", "--config", conf)
            equal((cleared.returncode, cleared.stdout), (78, ""))
            assert re.fullmatch(said + r"\n", cleared.stderr), cleared
        assert (house.runtime / "current").exists()


def test_nothing_of_a_daemon_that_lives_is_cleared():
    with House() as house:
        house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        there = {path.name for path in house.runtime.iterdir()}
        cleared = run(house.programs["pokeysd"], "--clear", "--runtime-directory", house.runtime)
        equal((cleared.returncode, cleared.stdout), (75, ""))
        assert f"another pokeysd (pid {daemon.pid}) holds {house.runtime}" in cleared.stderr, cleared
        equal({path.name for path in house.runtime.iterdir()}, there)
        house.says("config", "apply", "mill", returncode=0)
        house.wait_fresh()
        equal(end(daemon), 0, house.log())


def own_network():
    if ctypes.CDLL(None, use_errno=True).unshare(0x40000000):  # CLONE_NEWNET
        raise OSError(ctypes.get_errno(), "unshare")


def test_an_interface_that_comes_late_is_waited_for():
    if os.geteuid() != 0 or not shutil.which("nsenter") or run("unshare", "--net", "true").returncode:
        raise Skip("no network name spaces here")
    with House(interface="late0") as house:
        daemon = house.start_daemon(wait=False, preexec_fn=own_network)
        wait_for("the wait", lambda: "waiting for it" in house.log(), say=house.log)
        made = run("nsenter", "--target", daemon.pid, "--net",
                   "ip", "link", "add", "late0", "type", "veth", "peer", "name", "late1")
        equal(made.returncode, 0, made.stderr)
        wait_for("the daemon", (house.runtime / "current").exists, say=house.log)
        assert "late0 is there" in house.log(), house.log()
        equal(end(daemon), 0, house.log())


def test_a_core_that_does_not_exist_is_the_configurations_fault():
    with House(cpu=1000, realtime="required") as house:
        daemon = house.start_daemon(wait=False)
        status = daemon.wait(PATIENCE)
        if status == 77:
            raise Skip("no right to realtime priority here")
        assert status == 78, (status, house.log())
        assert "core 1000" in house.log(), house.log()


def test_closed_standard_descriptors_do_no_harm():
    with House() as house:
        house.start_sim()
        house.write_conf()
        daemon = house.spawn("pokeysd", "--config", house.conf, log="unused.log", close_fds=True,
                             preexec_fn=lambda: [os.close(fd) for fd in (0, 1, 2)])
        house.wait_fresh()
        targets = [os.readlink(f"/proc/{daemon.pid}/fd/{fd}") for fd in (0, 1, 2)]
        assert targets == ["/dev/null"] * 3, targets
        equal(end(daemon), 0)


def test_a_reader_of_messages_that_sleeps_stops_nothing():
    with House(**{"log-level": "debug"}) as house:
        sim = house.start_sim()
        reading, writing = os.pipe()
        os.set_blocking(writing, False)
        try:
            while True:
                os.write(writing, b"x" * 4096)
        except BlockingIOError:
            pass
        os.set_blocking(writing, True)
        environment = house.open_notify()
        daemon = house.start_daemon(log=None, stdout=writing, stderr=writing,
                                    env={**environment, "WATCHDOG_USEC": "400000"})
        house.wait_fresh()
        for _ in range(3):
            house.ask_sim(sim, "silence", "300")
            time.sleep(0.4)
        house.wait_fresh()
        equal(end(daemon), 0)
        # nor does a service manager that does not read: its queue is full by now
        told = drain(house)
        assert told[0].startswith("READY=1") and any("WATCHDOG=1" in t for t in told), told
        os.close(reading)
        os.close(writing)


def drain(house):
    """All that the service manager was told so far."""
    told = []
    house.notify.setblocking(False)
    try:
        while True:
            told.append(house.notify.recv(4096).decode())
    except BlockingIOError:
        return told


def test_the_service_manager_is_told_what_is():
    with House() as house:
        environment = {**house.open_notify(), "WATCHDOG_USEC": "200000"}
        daemon = house.start_daemon(env=environment)
        first = house.notify.recv(4096).decode()
        assert first.startswith("READY=1\nSTATUS=mill searching"), first
        # memory can be attached as soon as it says that it is ready
        wait_for("images", lambda: house.device()["publishing"])
        house.start_sim()
        told = []

        def says(text):
            told.extend(drain(house))
            return any(text in t for t in told)
        wait_for("the device's state in the status", lambda: says("STATUS=mill running"))
        told.clear()
        begin = time.monotonic()
        wait_for("five signs of life", lambda: says("WATCHDOG=1") and told.count("WATCHDOG=1") >= 5)
        # at most one in a quarter of the service manager's patience, and one that waited before
        most = (time.monotonic() - begin) / 0.05 + 2
        assert told.count("WATCHDOG=1") <= most, (most, told)
        equal(end(daemon), 0)
        last = drain(house)
        assert any(t.startswith("STOPPING=1") for t in last), last


def test_the_watchdog_is_not_fed_for_another_process():
    with House() as house:
        daemon = house.start_daemon(env={**house.open_notify(), "WATCHDOG_USEC": "200000",
                                         "WATCHDOG_PID": "1"})
        wait_for("the first word", lambda: any(t.startswith("READY") for t in drain(house)))
        time.sleep(0.5)
        told = drain(house)
        assert not any("WATCHDOG" in t for t in told), told
        end(daemon)


def test_a_daemon_that_is_stopped_gives_no_sign_of_life():
    with House() as house:
        daemon = house.start_daemon(env={**house.open_notify(), "WATCHDOG_USEC": "200000"})
        wait_for("a sign", lambda: any("WATCHDOG" in t for t in drain(house)))
        daemon.send_signal(signal.SIGSTOP)
        wait_for("it stopped", lambda: all(
            stat.read_text().rsplit(")", 1)[1].split()[0] == "T"
            for stat in pathlib.Path(f"/proc/{daemon.pid}/task").glob("*/stat")))
        drain(house)
        time.sleep(0.5)
        told = drain(house)
        assert not told, told
        daemon.send_signal(signal.SIGCONT)
        wait_for("a sign again", lambda: any("WATCHDOG" in t for t in drain(house)))
        equal(end(daemon), 0)


def test_metrics_that_cannot_be_written_are_counted_and_nothing_else():
    with House() as house:
        folder = house.folder / "metrics"
        folder.mkdir()
        path = folder / "pokeysd.prom"
        house.daemon_keys |= {"metrics-file": path, "metrics-interval-ms": 100}
        house.start_sim()
        daemon = house.start_daemon()
        house.wait_fresh()
        wait_for("metrics", lambda: path.exists() and 'device_link{device="mill"} 3' in path.read_text())
        # in one moment: the daemon may be writing there
        folder.rename(house.folder / "gone")
        wait_for("the complaint", lambda: "cannot be written" in house.log())
        house.wait_fresh()
        folder.mkdir()
        wait_for("metrics again", path.exists)
        failed = [line for line in path.read_text().splitlines() if line.startswith("pokeysd_metrics_failed_total ")]
        assert int(failed[0].split()[1]) >= 1, failed
        wait_for("the good news", lambda: "is written again" in house.log())
        said = house.log()
        assert said.count("cannot be written") == 1 and said.count("is written again") == 1, said
        equal(end(daemon), 0)


def test_a_disk_that_hangs_stops_no_sign_of_life():
    with House() as house:
        house.daemon_keys |= {"metrics-file": house.folder / "metrics.prom", "metrics-interval-ms": 100}
        house.start_sim()
        daemon = house.start_daemon(env={**house.open_notify(), "WATCHDOG_USEC": "200000",
                                         "LD_PRELOAD": str(house.programs["hung_disk.so"]),
                                         "HUNG_NAME": "metrics.prom", "HUNG_FOLDER": str(house.folder),
                                         "ASAN_OPTIONS": "verify_asan_link_order=0"})
        wait_for("a disk that hangs", (house.folder / "hung").exists)
        drain(house)
        told = []
        wait_for("five signs of life", lambda: told.extend(drain(house)) or told.count("WATCHDOG=1") >= 5)
        assert not (house.folder / "metrics.prom").exists(), "it did not hang"
        house.wait_fresh()                      # nor does the device wait
        (house.folder / "go").touch()
        wait_for("metrics", (house.folder / "metrics.prom").exists)
        equal(end(daemon), 0)


def test_a_configuration_on_a_disk_that_hangs_stops_nothing():
    with House() as house:
        house.start_sim()
        daemon = house.start_daemon(env={**house.open_notify(), "WATCHDOG_USEC": "200000",
                                         "LD_PRELOAD": str(house.programs["hung_disk.so"]),
                                         "HUNG_NAME": "late.conf", "HUNG_FOLDER": str(house.folder),
                                         "ASAN_OPTIONS": "verify_asan_link_order=0"})
        house.wait_fresh()
        (more := house.folder / "pokeysd.conf.d").mkdir()
        (more / "late.conf").write_text("[device mill]\nfailsafe-timeout-ms = 1700\n")
        daemon.send_signal(signal.SIGHUP)
        wait_for("a disk that hangs", (house.folder / "hung").exists)
        drain(house)
        told = []
        wait_for("five signs of life", lambda: told.extend(drain(house)) or told.count("WATCHDOG=1") >= 5)
        house.wait_fresh()
        asked = house.spawn("pokeysctl", "-r", house.runtime, "config", "apply", "mill", log="ctl.log")
        assert "was read again" not in house.log(), "it did not hang"
        (house.folder / "go").touch()
        wait_for("the reload", lambda: "was read again" in house.log(), say=house.log)
        equal(asked.wait(PATIENCE), 0, house.log("ctl.log"))
        wait_for("the setting", lambda: "failsafe configured" in house.log(), say=house.log)
        equal(end(daemon), 0)


def test_metrics_on_a_full_disk_stop_nothing():
    with House() as house:
        small = house.folder / "small"
        small.mkdir()
        if run("mount", "-t", "tmpfs", "-o", "size=4k", "none", small).returncode:
            raise Skip("a small disk cannot be mounted here")
        try:
            house.daemon_keys |= {"metrics-file": small / "m", "metrics-interval-ms": 100}
            house.start_sim()
            house.start_daemon()
            house.wait_fresh()
            wait_for("the complaint", lambda: "No space left" in house.log())
            house.wait_fresh()
            wait_for("no half file", lambda: not any(small.iterdir()), say=lambda: list(small.iterdir()))
        finally:
            run("umount", "-l", small)


def test_check_config_says_what_is_wrong_and_touches_nothing():
    with House() as house:
        house.write_conf()
        good = run(house.programs["pokeysd"], "--check-config", "--config", house.conf)
        assert good.returncode == 0 and not good.stderr and "in order, 1 device" in good.stdout, good
        with house.conf.open("a") as conf:
            conf.write("[device mill]\nport = 0\n[device lathe]\nserial = x\n")
        bad = run(house.programs["pokeysd"], "--check-config", "--config", house.conf)
        assert bad.returncode == 78 and not bad.stdout, bad
        lines = bad.stderr.splitlines()
        assert len(lines) == 2 and all(line.startswith(f"{house.conf}:") for line in lines), lines
        assert "mill" in lines[0] and "before" in lines[0], lines
        assert not house.runtime.exists(), list(house.runtime.iterdir())


def with_a_service_user(house, *command):
    """Run it where there is a user pokeys, number 12345; files of his and of root are in the house."""
    for name, line in (("passwd", "pokeys:x:12345:12345::/:/bin/false"), ("group", "pokeys:x:12345:")):
        text = pathlib.Path("/etc", name).read_text().splitlines()
        kept = [was for was in text if not was.startswith("pokeys:")]
        (house.folder / name).write_text("\n".join([*kept, line]) + "\n")
    mounts = "".join(f"mount --bind {house.folder / name} /etc/{name} && " for name in ("passwd", "group"))
    return run("unshare", "--mount", "sh", "-c", mounts + 'exec "$@"', "sh", *command)


def test_check_config_judges_as_the_service_will():
    if os.geteuid() != 0 or run("unshare", "--mount", "true").returncode:
        raise Skip("another user's rights can be tried only by root, with namespaces")
    with House() as house:
        check = (for_everybody("pokeysd"), "--check-config", "--config", house.conf)
        bob = ("setpriv", "--reuid=54321", "--regid=54321", "--clear-groups")
        secret = house.folder / "secret"
        secret.write_text("sesame\n")
        secret.chmod(0o600)
        house.write_conf()
        equal(with_a_service_user(house, *check).stdout, f"{house.conf}: in order, 1 device\n")
        house.device_keys["mill"]["password-file"] = secret
        house.write_conf()
        # root may read it, and the service may not
        out = with_a_service_user(house, *check)
        assert out.returncode == 78 and not out.stdout and "make it the daemon's (chown pokeys)" in out.stderr, out
        os.chown(secret, 12345, 12345)
        out = with_a_service_user(house, *check)
        equal((out.returncode, out.stdout, out.stderr), (0, f"{house.conf}: in order, 1 device\n", ""))
        house.conf.chmod(0o600)
        out = with_a_service_user(house, *check)
        assert out.returncode == 78 and "may not be read by user pokeys" in out.stderr, out
        house.conf.chmod(0o644)
        # whoever is neither is told what could not be judged
        out = with_a_service_user(house, *bob, *check)
        assert out.returncode == 0 and "judged for user of this shell, for only root" in out.stdout, out
        assert out.stderr.count("\n") == 1 and f"{secret} may not be opened by this user: not judged" in out.stderr, out
        os.chown(secret, 0, 0)
        out = with_a_service_user(house, *bob, *check)
        assert out.returncode == 78 and "make it the daemon's (chown pokeys)" in out.stderr, out


def test_check_config_says_what_is_not_on_this_machine():
    with House(group="nosuchgroup", interface="nosuch0", cpu=1000) as house:
        house.write_conf()
        bad = run(house.programs["pokeysd"], "--check-config", "--config", house.conf)
        assert bad.returncode == 78, bad
        for word in ("nosuchgroup", "nosuch0", "1000"):
            assert sum(word in line for line in bad.stderr.splitlines()) == 1, bad.stderr


def test_check_config_notes_what_may_surprise():
    heater = ("[heater {0}]\nsensor = thermistor\nsensor-pin = {1}\npwm = {2}\nmax-temperature = 250\n"
              "rated-power-w = 40\n")
    device = "[device mill]\naddress = 127.0.0.1\nmax-heater-power-w = 60\npwm-period = {0}\n"
    two = heater.format("a", 41, 1) + "fan-pwm = 3\n" + heater.format("b", 42, 2)
    with House() as house:
        for period, notes in ((125001, ("[heater a]: fan-pwm: the fan stops", "max-heater-power-w limits the mean power")),
                              (125000, ("[heater a]: fan-pwm: the fan stops",))):
            house.conf.write_text(device.format(period) + two)
            out = run(house.programs["pokeysd"], "--check-config", "--config", house.conf)
            assert out.returncode == 0, out
            said = out.stderr.splitlines() + out.stdout.splitlines()
            for note in notes:
                assert sum(note in line for line in said) == 1, out
            assert ("limits the mean power" in "".join(said)) == (len(notes) == 2), out


def test_the_example_is_in_order():
    example = House.programs["pokeysd.conf.example"]
    with House() as house:
        # where the service's user may read it
        house.conf.write_text(example.read_text())
        out = run(House.programs["pokeysd"], "--check-config", "--config", house.conf)
        assert out.returncode == 0, out.stderr
    # and so is every line of it that is switched off, but for a core that may not be here
    with House() as house:
        text = "\n".join(line[2:] if line.startswith("; ") and " = " in line else line
                         for line in example.read_text().splitlines() if "cpu =" not in line)
        house.conf.write_text(text)
        out = run(House.programs["pokeysd"], "--check-config", "--config", house.conf)
        assert out.returncode == 0, out.stderr
        assert "\naxes = 3" in text, text


def test_a_faulty_configuration_starts_nothing():
    with House(mode="fast") as house:
        daemon = house.start_daemon(wait=False)
        equal(daemon.wait(PATIENCE), 78, house.log())
        assert "mode" in house.log() and "auto | sleep | napi | spin" in house.log(), house.log()
        assert not house.runtime.exists(), list(house.runtime.iterdir())


def test_a_missing_configuration_is_one_clear_line():
    with House() as house:
        out = run(house.programs["pokeysd"], "--config", house.folder / "none.conf")
        assert out.returncode == 78 and "there is no such file" in out.stderr, out
        equal(len(out.stderr.splitlines()), 1, out.stderr)


def test_a_folder_that_cannot_be_is_a_mistake_on_the_command_line():
    pokeysd = House.programs["pokeysd"]
    with House() as house:
        house.write_conf()
        out = run(pokeysd, "--config", house.conf, "--runtime-directory", "relative")
        assert out.returncode == 64 and "relative" in out.stderr, out
        checked = run(pokeysd, "--check-config", "--config", house.conf, "--runtime-directory", "relative")
        equal((checked.returncode, checked.stdout, checked.stderr), (64, "", out.stderr))


def test_what_nobody_could_read_is_not_success():
    # "in order" on a full disk was never read
    with House() as house, open("/dev/full", "w", encoding="ascii") as full:
        house.write_conf()
        for words in (["--check-config", "--config", house.conf], ["--version"], ["--help-config"]):
            out = subprocess.run([house.programs["pokeysd"], *words], stdout=full, stderr=subprocess.PIPE,
                                 text=True, timeout=PATIENCE, check=False)
            equal((out.returncode, out.stderr), (1, "pokeysd: standard output: No space left on device\n"), words)


def test_help_and_version_end_well():
    pokeysd = House.programs["pokeysd"]
    for words, text in ((["--help"], "--check-config"), (["--help-config"], "period-us"), (["--version"], "pokeysd ")):
        out = run(pokeysd, *words)
        assert out.returncode == 0 and text in out.stdout and not out.stderr, (words, out)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
