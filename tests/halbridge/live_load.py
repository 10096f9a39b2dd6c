#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Loading, refusing to load, unloading, in every order with the daemon.

usage: live_load.py MODULE.so HOST-PROGRAM
"""
import os
import shutil
import signal
import subprocess
import time
import hal_live


def loads_without_daemon_and_device(rig):
    rig.hal.start(f"runtime={rig.runtime}")
    assert rig.hal.get("connected") is False
    assert rig.hal.get("stale") is True
    assert rig.hal.get("attach-state") == 0
    rig.host()
    rig.hal.becomes("connected", True)
    rig.hal.becomes("attach-state", 1)


def a_named_device_may_come_late(rig):
    rig.hal.start(f"runtime={rig.runtime}", "devices=mill")
    rig.host("mill")
    rig.hal.becomes("connected", True)
    rig.hal.becomes("commander", True)


def bad_parameters_are_refused_in_one_line(rig):
    machine = rig.folder / "machine.ini"
    machine.write_text("[EMC]\n[POKEYS]\nRUNTIME_DIRECTORY = run/pokeysd\n", encoding="utf-8")
    cases = {
        "names=upper": "names=upper: must be both, canonical, core, legacy, heaters, servos, "
                       "loops or all",
        "devices=a,,b": "devices=: '' is not a device name",
        "devices=mill,mill": "devices=: 'mill' is named twice",
        "devices=a/b": "devices=: 'a/b' is not a device name",
        "devices=" + "x" * 32: "is not a device name: 1 to 31",
        "devices=a,b,c,d,e,f,g,h,i": "devices=: more than 8 names",
        "runtime=run/pokeysd": "runtime=: runtime folder 'run/pokeysd': give an absolute path",
        "runtime=/" + "x" * 150: "its path has 151 characters, at most",
        "device=mill": "device",
        f"ini={machine}": f"{machine}:3: [POKEYS]RUNTIME_DIRECTORY: runtime folder 'run/pokeysd': give an absolute",
        f"ini={rig.folder}": f"ini={rig.folder}: Is a directory",
        "devices=a,b,c names=both": "pokeys.2: HAL has no room for all names, try names=core",
    }
    rig.hal.ok("halcmd loadrt threads name1=servo-thread period1=1000000")
    for parameter, line in cases.items():
        before = len(rig.hal.said())
        status, _ = rig.hal.run(f"halcmd loadrt pokeys_shm {parameter}")
        rig.hal.says(line, before)
        said = rig.hal.said()[before:]
        ours = [text for text in said.splitlines()
                if text.startswith("pokeys_shm: ") and "rtapi_app_main" not in text]
        assert status != 0, f"{parameter} was taken"
        assert len(ours) <= 1, f"{parameter}: {len(ours)} lines\n{said}"
    assert rig.hal.ok("halcmd -s show pin 'pokeys.*'") == ""


def every_good_parameter_is_taken(rig):
    rig.hal.ok("halcmd loadrt threads name1=servo-thread period1=1000000")
    for parameters in ("", "names=both", "names=canonical", "names=core", "names=legacy", "names=all",
                       "devices=mill", "devices=a,b", "devices=a,b,c names=canonical",
                       f"devices=A-z_9 names=canonical runtime={rig.runtime}"):
        rig.hal.ok(f"halcmd loadrt pokeys_shm {parameters}")
        rig.hal.ok("halcmd unloadrt pokeys_shm")


def parameters_do_not_survive_a_reload(rig):
    rig.host()
    rig.hal.ok(f"halcmd loadrt pokeys_shm devices=other,another runtime={rig.runtime}")
    rig.hal.ok("halcmd unloadrt pokeys_shm")
    rig.hal.start(f"runtime={rig.runtime}")
    rig.hal.becomes("connected", True)
    assert rig.hal.ok("halcmd -s show pin 'pokeys.1.*'") == ""


def several_devices_want_a_name(rig):
    runtime = rig.runtime
    two = subprocess.Popen([rig.program, str(runtime), "mill,panel"], stdin=subprocess.PIPE,
                           stdout=subprocess.PIPE, text=True, bufsize=1)
    assert two.stdout.readline() == "ready\n"
    try:
        rig.hal.start(f"runtime={runtime}")
        rig.hal.becomes("attach-state", 2)
        rig.hal.says("the daemon has 2 devices (mill,panel): name one with devices=")
        rig.hal.ok("halcmd stop; halcmd unloadrt pokeys_shm")
        rig.hal.start(f"runtime={runtime}", "devices=panel,mill", threads=False)
        rig.hal.ok("halcmd addf pokeys.1.read servo-thread")
        rig.hal.becomes("connected", True)
        rig.hal.becomes("connected", True, device=1)
    finally:
        two.kill()
        two.wait()


def another_commander_is_said_in_clear_words(rig):
    rig.host()
    rig.hal.start(f"runtime={rig.runtime}")
    rig.hal.becomes("commander", True)
    second = hal_live.Hal(os.path.abspath(hal_live.sys.argv[1]), rig.folder)
    try:
        second.start(f"runtime={rig.runtime}")
        second.becomes("attach-state", 2)
        second.says("another commander holds device 'mill'")
        assert second.get("commander") is False
        rig.hal.ok("halcmd stop; halcmd unloadrt pokeys_shm")
        second.becomes("commander", True)
    finally:
        second.close()


def growth(rig):
    """What an rtapi_app has: mappings of the module, threads, descriptors, HAL's memory."""
    hal, pid = rig.hal, rig.hal.pid()
    return {
        "mapped": int(hal.run(f"grep -c pokeys_shm /proc/{pid}/maps")[1]),
        "threads": int(hal.ok(f"ls /proc/{pid}/task | wc -l")),
        "descriptors": int(hal.ok(f"ls /proc/{pid}/fd | wc -l")),
        "maps": int(hal.ok(f"wc -l < /proc/{pid}/maps")),
        "rss": int(hal.ok(f"awk '/^VmRSS/ {{print $2}}' /proc/{pid}/status")),
        "files": sum(len(names) for _, _, names in os.walk(rig.runtime)),
        "hal": int(hal.ok("halcmd status mem").split("memory:")[1].split("/")[0]),
    }


def twenty_reloads_leave_nothing(rig):
    rig.host()
    rig.hal.ok("halcmd loadrt threads name1=servo-thread period1=1000000")
    each = []
    for _ in range(20):
        rig.hal.start(f"runtime={rig.runtime}", threads=False)
        rig.hal.becomes("connected", True)
        rig.hal.ok("halcmd stop; halcmd unloadrt pokeys_shm")
        each.append(growth(rig))
    first, last = each[1], each[-1]
    for key in ("mapped", "threads", "descriptors", "maps", "files"):
        # one more at a moment is rtapi_app talking to its own client
        early, late = max(e[key] for e in each[:5]), min(e[key] for e in each[-5:])
        assert late <= early, f"{key}: {[e[key] for e in each]}"
    assert last["mapped"] == 0
    assert last["rss"] - first["rss"] < 1024, f"rss: {first['rss']} -> {last['rss']} kB"
    # HAL never frees what a component had by hal_malloc while others are loaded;
    # it must be the same each time, and far from HAL's 1 MiB
    steps = {b["hal"] - a["hal"] for a, b in zip(each[1:], each[2:])}
    assert len(steps) == 1 and steps.pop() < 32768, f"HAL's memory: {[e['hal'] for e in each]}"
    print(f"reloads: rss {first['rss']} -> {last['rss']} kB, "
          f"HAL's memory {each[-1]['hal'] - each[-2]['hal']} bytes each")


def unloading_under_a_running_thread_is_safe(rig):
    rig.host()
    rig.hal.ok("halcmd loadrt threads name1=servo-thread period1=1000000")
    pid = rig.hal.pid()
    for _ in range(20):
        rig.hal.start(f"runtime={rig.runtime}", threads=False)
        rig.hal.becomes("connected", True)
        rig.hal.ok("halcmd unloadrt pokeys_shm")
    assert rig.hal.pid() == pid


def unloading_under_a_thread_that_only_reads_is_safe(rig):
    """A monitor has no use for the write funct; a fast thread makes a wrong step likely."""
    rig.host()
    rig.hal.ok("halcmd loadrt threads name1=fast period1=50000")
    pid = rig.hal.pid()
    for _ in range(20):
        rig.hal.ok(f"halcmd loadrt pokeys_shm runtime={rig.runtime}")
        rig.hal.ok("halcmd addf pokeys.0.read fast && halcmd start")
        rig.hal.becomes("connected", True)
        rig.hal.ok("timeout -s KILL 60 halcmd unloadrt pokeys_shm")
    assert rig.hal.pid() == pid


def a_killed_rtapi_app_gives_its_place_back(rig):
    host = rig.host()
    rig.hal.start(f"runtime={rig.runtime}")
    rig.hal.becomes("commander", True)
    before = int(host.command()["heartbeat"])
    rig.hal.ok("kill -9 $(pidof rtapi_app)")
    rig.hal.clean_up()

    def stands():
        beat = host.command()["heartbeat"]
        time.sleep(0.1)
        return host.command()["heartbeat"] == beat and int(beat) >= before

    hal_live.wait("the heartbeat stands", stands)
    rig.hal.start(f"runtime={rig.runtime}")
    rig.hal.becomes("commander", True)


def children_of(pid):
    """All processes below this one."""
    out = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True,
                         check=False).stdout.split()
    return out + [below for child in out for below in children_of(child)]


def gone(pids):
    hal_live.wait("the namespace ends with its script",
                  lambda: not any(os.path.exists(f"/proc/{pid}") for pid in pids))


def nothing_is_left_when_all_is_killed(rig):
    rig.host()
    rig.hal.start(f"runtime={rig.runtime}")
    rig.hal.becomes("connected", True)
    inside = children_of(rig.hal.shell.pid)
    assert len(inside) >= 4, inside     # setpriv/unshare, the namespace's first, bash, rtapi_app
    os.kill(rig.hal.shell.pid, signal.SIGKILL)
    rig.hal.shell.wait()
    gone(inside)


def nothing_is_left_after_an_interrupt(rig):
    for number, status in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
        script = subprocess.Popen([str(hal_live.ROOT / "scripts/hal-isolated"), "bash", "-c",
                                   "sleep 100 & sleep 100"],
                                  stdin=subprocess.DEVNULL)
        hal_live.wait("all of it runs", lambda script=script: len(children_of(script.pid)) >= 4)
        inside = children_of(script.pid)
        script.send_signal(number)
        assert script.wait(60) == status
        gone(inside)


def folders_of_odd_names_are_kept(rig):
    for name in ("a:b", "a 'b", 'a"$b'):
        folder = rig.folder / name
        folder.mkdir()
        module = folder / "pokeys_shm.so"
        shutil.copy(hal_live.sys.argv[1], module)
        done = subprocess.run([str(hal_live.ROOT / "scripts/hal-isolated"), "--module", str(module),
                               "bash", "-c", "ls && halcmd loadrt pokeys_shm && halcmd unloadrt all"],
                              cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                              text=True, check=False)
        assert done.returncode == 0, f"{name}: {done.stderr}"


def an_ordinary_user_can_do_it(rig):
    if os.geteuid() != 0:
        return  # then everything here has been done by one
    script, module = rig.folder / "hal-isolated", rig.folder / "pokeys_shm.so"
    shutil.copy(hal_live.ROOT / "scripts/hal-isolated", script)
    shutil.copy(hal_live.sys.argv[1], module)
    commands = "halcmd loadrt pokeys_shm && halcmd getp pokeys.0.stale && halcmd unloadrt pokeys_shm"
    done = subprocess.run(["setpriv", "--reuid", "65534", "--regid", "65534", "--clear-groups",
                           str(script), "--module", str(module), "bash", "-c", commands],
                          cwd="/", capture_output=True, text=True, check=False)
    if done.returncode == 77:
        print(f"not tried as an ordinary user: {done.stderr.strip()}")
        return
    assert done.returncode == 0 and "TRUE" in done.stdout, done.stdout + done.stderr


hal_live.main([
    loads_without_daemon_and_device,
    a_named_device_may_come_late,
    bad_parameters_are_refused_in_one_line,
    every_good_parameter_is_taken,
    parameters_do_not_survive_a_reload,
    several_devices_want_a_name,
    another_commander_is_said_in_clear_words,
    twenty_reloads_leave_nothing,
    unloading_under_a_running_thread_is_safe,
    unloading_under_a_thread_that_only_reads_is_safe,
    a_killed_rtapi_app_gives_its_place_back,
    nothing_is_left_when_all_is_killed,
    nothing_is_left_after_an_interrupt,
    folders_of_odd_names_are_kept,
    an_ordinary_user_can_do_it,
])
