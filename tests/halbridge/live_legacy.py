#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Machines of the older userspace component: their HAL files, their INI files.

Every name that such machines have in their HAL files (legacy_used.tsv) is set
or connected, once with "loadusr -W pokeys" as it stands there, once with
pokeys_shm and two addf lines instead.

usage: live_legacy.py MODULE.so HOST-PROGRAM POKEYS-PROGRAM LIST-NAMES [PATTERN]
"""
import os
import pathlib
import shutil
import subprocess
import sys
import time
import hal_live

POKEYS = pathlib.Path(sys.argv.pop(3)).resolve()
LIST_NAMES = sys.argv.pop(3)
os.environ["PATH"] = f"{POKEYS.parent}:{os.environ['PATH']}"
USED = pathlib.Path(__file__).with_name("legacy_used.tsv")

LOADUSR = ["loadusr -W pokeys"]
LOADRT = ["loadrt threads name1=servo-thread period1=1000000",
          "loadrt pokeys_shm runtime={run}",
          "addf pokeys.0.read servo-thread", "addf pokeys.0.write servo-thread"]

INI = """\
[EMC]
MACHINE = mill
[POKEYS]
RUNTIME_DIRECTORY = {run}
{keys}
[JOINT_1]
STEP_SCALE = 200.5
STEPGEN_MAXVEL = 20
MIN_LIMIT = -10.5
MAX_LIMIT = 100
TYPE = LINEAR
HOME_IGNORE_LIMITS = YES
"""


def used():
    """Each name with its indices, and how it is used."""
    for line in USED.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            continue
        name, indices, use = line.split("\t")
        for index in indices.split(","):
            parts = iter(index.split("/"))
            words = [next(parts) if word == "N" else word for word in name.split(".")]
            words = [word.replace("-N", f"-{index}") for word in words]
            yield "pokeys.0." + ".".join(words), use


def hal_file(load):
    lines = list(load)
    for number, (name, use) in enumerate(used()):
        if use == "net":
            lines.append(f"net signal-{number} {name}")
        else:
            lines.append(f"setp {name} 1")
    return "\n".join(lines) + "\n"


def ini(rig, *keys):
    path = rig.folder / "machine.ini"
    path.write_text(INI.format(run=rig.runtime, keys="\n".join(keys)), encoding="utf-8")
    return path


def loadusr(rig, *keys):
    rig.hal.ok(f"INI_FILE_NAME={ini(rig, *keys)} halcmd loadusr -W pokeys")


def unloadusr(rig):
    """halcmd sends the signal and does not wait."""
    rig.hal.ok("halcmd unloadusr pokeys; while pidof pokeys >/dev/null; do sleep 0.02; done")


def load_file(rig, load):
    path = rig.folder / "machine.hal"
    path.write_text(hal_file(load).replace("{run}", str(rig.runtime)), encoding="utf-8")
    rig.hal.ok(f"INI_FILE_NAME={ini(rig)} halcmd -f {path}")
    names = list(used())
    assert len(names) > 400
    shown = {line.split()[4] for kind in ("pin", "param")
             for line in rig.hal.ok(f"halcmd -s show {kind} 'pokeys.0.*'").splitlines()
             if len(line.split()) > 4}
    assert not {name for name, _ in names} - shown


def a_machines_hal_file_loads_with_loadusr(rig):
    load_file(rig, LOADUSR)


def a_machines_hal_file_loads_with_loadrt_and_two_addf(rig):
    load_file(rig, LOADRT)


def it_has_the_names_of_both_schemes(rig):
    loadusr(rig)
    have = []
    for kind in ("pin", "param"):
        for line in rig.hal.ok(f"halcmd -s show {kind} 'pokeys.*'").splitlines():
            words = line.split()
            if words:
                have.append(f"{words[4]} {kind} {words[1]} {words[2]}")
    want = [line for schemes in ("both", "former")
            for line in subprocess.run([LIST_NAMES, "names", schemes], capture_output=True,
                                       text=True, check=True).stdout.splitlines()]
    differ = sorted(set(have) ^ set(want))
    assert not differ and len(have) == len(want), differ[:20]


def without_a_daemon_it_says_so_and_comes_alive_with_it(rig):
    loadusr(rig)
    assert rig.hal.get("connected") is False
    assert rig.hal.get("PEv2.digin.Emergency.in") is True
    rig.hal.says(f"no daemon in {rig.runtime}; is pokeysd running?")
    host = rig.host()
    rig.hal.becomes("connected", True)
    rig.hal.becomes("alive", True)
    host.say("set in 5 1")
    rig.hal.becomes("digin.5.in", True)
    rig.hal.becomes("pin.05.in", True)
    rig.hal.becomes("digin.5.in-not", False)


def without_an_ini_file_it_runs(rig):
    rig.hal.ok("unset INI_FILE_NAME; halcmd loadusr -W pokeys")
    rig.hal.says("INI_FILE_NAME is not set")
    assert rig.hal.get("PEv2.params.ApplyIniSettings") is False


def keys_of_the_ini_file_are_set(rig):
    loadusr(rig, "ApplyIniSettings=1", "  Pin_11_Function = 4   # output", "adcout_0_max_v = 10",
            "PEv2_PinLimitNSwitch_3 = 7", "PEv2_PinLimitMSwitch_4 = 8",
            "pev2_homingalgorithm_outhome_reversedirection_2 = 1",
            "PEv2_linked_joint_6 = 1", "encoder.12.scale = 0.5", "encoder.3.scale = 0.25",
            "PEv2_AxisSoftLimitEnabled_0 = 1", "AdcOut_2_offset = 1.5")
    want = {
        "PEv2.params.ApplyIniSettings": True, "pins.11.PinFunction": 4, "adcout.0.max-v": 10,
        "PEv2.3.digin.LimitN.Pin": 7, "PEv2.4.digin.LimitN.Pin": 8,
        "PEv2.2.HomeAlg.OutHome.RevDirection": True, "PEv2.6.stepgen.STEP-SCALE": 200.5,
        "PEv2.6.stepgen.MIN-LIMIT": -10.5, "PEv2.6.stepgen.HOME-IGNORE-LIMITS": 1,
        "encoder.12.scale": 0.5, "encoder.3.scale": 0.25, "PEv2.0.AxisSoftLimitEnabled": 1,
        "PEv2.0.AxisInvertedHome": 0, "adcout.2.offset": 1.5, "adcin.2.offset": 0,
    }
    for name, value in want.items():
        assert rig.hal.get(name) == value, f"{name} is {rig.hal.get(name)}"
    rig.hal.becomes("PEv2.6.PositionOffset", 110)
    rig.hal.becomes("PEv2.6.MaxSpeed", 4010)
    rig.hal.becomes("PEv2.6.AxisEnabled", 1)


def a_bad_key_is_refused_with_file_line_and_range(rig):
    loadusr(rig, "PEv2_AxisInverted_0 = 7", "encoder.1.scale = abc", "Pin_3_Function = 1.5",
            "DEVICE_ID = -4", "COMM_TIMEOUT = soon")
    path = rig.folder / "machine.ini"
    for line, text in ((5, "[POKEYS]PEv2_AxisInverted_0 = 7: must be a whole number from 0 to 1"),
                       (6, "[POKEYS]encoder.1.scale = abc: must be a number from -1e+12 to 1e+12"),
                       (7, "[POKEYS]Pin_3_Function = 1.5: must be a whole number from 0 to 255"),
                       (8, "[POKEYS]DEVICE_ID = -4: must be a whole number from 0"),
                       (9, "[POKEYS]COMM_TIMEOUT = soon: must be a whole number from 0")):
        rig.hal.says(f"{path}:{line}: {text}")
    assert rig.hal.get("PEv2.0.AxisInverted") == 0
    assert rig.hal.get("encoder.1.scale") == 1


def a_bad_parameter_is_refused_and_keeps_its_value(rig):
    loadusr(rig)

    def keeps():
        rig.hal.set("PEv2.3.digin.LimitP.Pin", 9)
        time.sleep(0.3)     # it looks ten times a second; a later look has not seen the 9
        rig.hal.set("PEv2.3.digin.LimitP.Pin", 56)
        rig.hal.becomes("PEv2.3.digin.LimitP.Pin", lambda have: have != 56)
        return rig.hal.get("PEv2.3.digin.LimitP.Pin") == 9

    hal_live.wait("it keeps its 9", keeps)
    rig.hal.says("pokeys.0.PEv2.3.digin.LimitP.Pin = 56: must be 0 to 55; it is 9 again")


def a_device_is_found_by_its_serial_number(rig):
    host = rig.host()
    host.say("set serial 53386")
    loadusr(rig, "DEVICE_ID = 53386")
    rig.hal.becomes("connected", True)
    rig.hal.becomes("devSerial", 53386)
    unloadusr(rig)
    loadusr(rig, "DEVICE_ID = 27295")
    rig.hal.says("no device of the daemon has the serial number 27295 yet (mill 53386)")
    assert rig.hal.get("connected") is False
    host.say("set serial 27295")
    rig.hal.becomes("connected", True)


def it_ends_by_signal_and_loads_again(rig):
    rig.host()
    for _ in range(5):
        loadusr(rig)
        rig.hal.becomes("connected", True)
        pid = rig.hal.ok("pidof pokeys")
        rig.hal.ok(f"kill -TERM {pid}; while kill -0 {pid} 2>/dev/null; do sleep 0.02; done")
        assert rig.hal.ok("halcmd -s show pin 'pokeys.*'") == ""


def alone_in_hal_it_ends_with_status_0(rig):
    """The last to leave takes HAL's memory with it."""
    rig.host()
    rig.hal.ok(f"INI_FILE_NAME={ini(rig)} pokeys >/dev/null & ended=$!")
    rig.hal.ok("until halcmd getp pokeys.0.connected 2>/dev/null | grep -q TRUE; do sleep 0.02; done")
    rig.hal.ok("kill -TERM $ended; wait $ended")


def a_device_id_that_is_none_drives_no_device(rig):
    rig.host()
    loadusr(rig, "DEVICE_ID = 2729S")
    rig.hal.says("[POKEYS]DEVICE_ID = 2729S: must be a whole number")
    rig.hal.says("no device is driven, for its DEVICE_ID is no serial number")
    rig.hal.becomes("attach-state", 2)
    assert rig.hal.get("connected") is False and rig.hal.get("commander") is False


def names_and_count_are_options(rig):
    rig.hal.ok("halcmd loadusr -Wn pokeys pokeys names=mill,panel")
    assert rig.hal.ok("halcmd getp mill.connected") == "FALSE"
    assert rig.hal.ok("halcmd getp panel.PEv2.0.AxesState") == "0"
    rig.hal.ok("halcmd setp panel.PEv2.0.AxisInverted 2")
    rig.hal.says("panel.PEv2.0.AxisInverted = 2: must be 0 to 1")
    unloadusr(rig)
    for loops, there, elsewhere in (("heaters", "heater.00.target", "servo.00.enable"), ("servos", "servo.00.enable", "heater.00.target"),
                                    ("all", "heater.00.pid-p", None), ("all", "servo.00.velocity-gain", None)):
        rig.hal.ok(f"halcmd loadusr -Wn pokeys pokeys loops={loops} count=2")
        rig.hal.ok(f"halcmd getp pokeys.0.{there} && halcmd getp pokeys.0.PEv2.0.AxesState")
        assert not elsewhere or rig.hal.run(f"halcmd getp pokeys.0.{elsewhere}")[0]
        assert rig.hal.run(f"halcmd getp pokeys.1.{there}")[0], "only the first one has them"
        unloadusr(rig)
    for option, text in (("count=9", "count=9: must be 1 to 8"), ("loops=yes", "loops=yes: must be heaters, servos or all"),
                         ("names=much-too-long", "names=much-too-long: at most"),
                         ("names=mill,mill", "names=mill,mill: 'mill' is there twice"),
                         ("'names=a b'", "names=a b: at most"),
                         ("speed=3", "there is no option speed=3")):
        status, _ = rig.hal.run(f"pokeys {option}")
        assert status == 64
        rig.hal.says(text)


def a_runtime_folder_that_cannot_be_names_its_line(rig):
    path = rig.folder / "machine.ini"
    path.write_text("[POKEYS]\nRUNTIME_DIRECTORY = run/pokeysd\n", encoding="utf-8")
    status, _ = rig.hal.run(f"INI_FILE_NAME={path} timeout 60 pokeys")
    assert status == 1, status
    rig.hal.says(f"{path}:2: [POKEYS]RUNTIME_DIRECTORY: runtime folder 'run/pokeysd': give an absolute path")
    assert "not loaded" not in rig.hal.said()


def an_axis_is_driven_by_its_connected_name(rig):
    host = rig.host()
    loadusr(rig, "ApplyIniSettings=1", "PEv2_AxisEnabled_0 = 1")
    rig.hal.set("PEv2.0.stepgen.STEP-SCALE", 100)
    rig.hal.set("machine-is-on", 1)
    rig.hal.becomes("connected", True)
    assert host.command()["axis0"].endswith(",0")
    rig.hal.ok("halcmd net x pokeys.0.PEv2.0.joint-pos-cmd; halcmd sets x 2.5")
    host.sees("axis0", "250,0,1,1")
    rig.hal.set("legacy.axis-enable-follows", 1)
    host.sees("axis0", "250,0,1,0")
    rig.hal.set("PEv2.0.digout.AxisEnable.out", 1)
    host.sees("axis0", "250,0,1,1")


def either_name_of_an_input_may_be_used(rig):
    host = rig.host()
    host.say("set own 31 1")
    loadusr(rig)
    rig.hal.becomes("connected", True)
    rig.hal.set("digout.31.out", 1)
    host.sees("out", "00000080" + 8 * "0")
    rig.hal.set("pin.31.out", 1)
    host.beats(hal_live.PIN_TURNS)      # pins that are not linked are looked at in turn
    rig.hal.set("pin.31.out", 0)
    host.sees("out", 16 * "0")


def beats_a_second(host):
    begin, before = time.monotonic(), int(host.command()["heartbeat"])
    time.sleep(0.5)
    rate = (int(host.command()["heartbeat"]) - before) / (time.monotonic() - begin)
    print(f"{rate:.0f} periods a second")
    return rate


def the_loop_runs_at_the_rate_that_is_asked_for(rig):
    host = rig.host()
    loadusr(rig)
    rig.hal.becomes("connected", True)
    rig.hal.set("rtc.loop-frequ-demand", 5)
    rig.hal.says("rtc.loop-frequ-demand = 5: must be 100 to 2000")
    rig.hal.set("rtc.loop-frequ-demand", 200)
    # on a busy machine not in every half second; without the demand in none
    hal_live.wait("200 periods a second", lambda: 100 < beats_a_second(host) < 300)


def an_ordinary_user_can_do_it(rig):
    if os.geteuid() != 0:
        return  # then everything here has been done by one
    for source in (hal_live.ROOT / "scripts/hal-isolated", POKEYS,
                   pathlib.Path(hal_live.sys.argv[1])):
        shutil.copy(source, rig.folder / source.name)
    commands = f"halcmd loadusr -W pokeys runtime={rig.runtime} && halcmd getp pokeys.0.alive"
    done = subprocess.run(
        ["setpriv", "--reuid", "65534", "--regid", "65534", "--clear-groups",
         rig.folder / "hal-isolated", "--module", rig.folder / "pokeys_shm.so", "bash", "-c",
         commands], cwd="/", capture_output=True, text=True, check=False,
        env={**os.environ, "PATH": f"{rig.folder}:{os.environ['PATH']}"})
    if done.returncode == 77:
        print(f"not tried as an ordinary user: {done.stderr.strip()}")
        return
    assert done.returncode == 0 and "FALSE" in done.stdout, done.stdout + done.stderr


hal_live.main([
    a_machines_hal_file_loads_with_loadusr,
    a_machines_hal_file_loads_with_loadrt_and_two_addf,
    it_has_the_names_of_both_schemes,
    without_a_daemon_it_says_so_and_comes_alive_with_it,
    without_an_ini_file_it_runs,
    keys_of_the_ini_file_are_set,
    a_bad_key_is_refused_with_file_line_and_range,
    a_bad_parameter_is_refused_and_keeps_its_value,
    a_device_is_found_by_its_serial_number,
    it_ends_by_signal_and_loads_again,
    alone_in_hal_it_ends_with_status_0,
    a_device_id_that_is_none_drives_no_device,
    names_and_count_are_options,
    a_runtime_folder_that_cannot_be_names_its_line,
    an_axis_is_driven_by_its_connected_name,
    either_name_of_an_input_may_be_used,
    the_loop_runs_at_the_rate_that_is_asked_for,
    an_ordinary_user_can_do_it,
])
