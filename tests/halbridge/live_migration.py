#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The older names and the examples, the whole way: simulator, daemon, LinuxCNC.

usage: live_migration.py MODULE.so POKEYSD POKEYS-SIM POKEYS-PROGRAM [PATTERN]
"""
import os
import pathlib
import shutil
import subprocess
import sys
import hal_live
import hal_machine
from safety import safety

POKEYS, POKEYSCTL = pathlib.Path(sys.argv.pop(4)).resolve(), pathlib.Path(sys.argv.pop(4)).resolve()
os.environ["PATH"] = f"{POKEYS.parent}:{os.environ['PATH']}"
EXAMPLES = hal_live.ROOT / "examples/linuxcnc"

PANEL = """
[device panel]
address = {address}
digital-outputs = 31-32
heartbeat-timeout-ms = 3000
lost-after-ms = 1000
"""

INI = """\
[POKEYS]
RUNTIME_DIRECTORY = {run}
DEVICE_ID = 65432
{keys}
"""


def loadusr(m, *keys):
    path = m.folder / "machine.ini"
    path.write_text(INI.format(run=m.folder / "run", keys="\n".join(keys)), encoding="utf-8")
    m.hal.ok(f"INI_FILE_NAME={path} halcmd loadusr -W pokeys")
    m.hal.becomes("connected", True)


def settings_of_the_ini_file_reach_the_device(m):
    m.device()
    m.daemon()
    loadusr(m, "ApplyIniSettings = 1", "Pin_21_Function = 4", "DigIn_40_invert = 1",
            "PEv2_AxisEnabled_5 = 1", "PEv2_AxisInverted_5 = 1", "PEv2_MaxSpeed_5 = 12000",
            "PEv2_MaxAcceleration_5 = 50000", "PEv2_MaxDecceleration_5 = 50000",
            "PEv2_PinLimitPSwitch_5 = 9", "PEv2_EnableLimitP_5 = 1")
    m.taken()
    m.hal.becomes("joint.05.axis-invert", 1)
    m.hal.becomes("joint.05.limit-pos-pin", 9)
    m.hal.becomes("joint.05.max-velocity", 12000)
    m.hal.set("digout.21.out", 1)
    m.sim_shows("pin 22", "latch", "1")
    # another session that applies nothing sees what the device has
    m.hal.ok("halcmd unloadusr pokeys; while pidof pokeys >/dev/null; do sleep 0.02; done")
    loadusr(m)
    m.hal.becomes("PEv2.5.AxisInverted", 1)
    m.hal.becomes("PEv2.5.MaxSpeed", 12000)
    m.hal.becomes("PEv2.5.digin.LimitP.Pin", 9)
    m.hal.becomes("PEv2.5.AxesSwitchConfig", 2)
    m.hal.becomes("pins.21.PinFunction", 4)


def an_axis_moves_by_its_older_names(m):
    m.device()
    m.daemon()
    loadusr(m, "ApplyIniSettings = 1", "PEv2_AxisEnabled_0 = 1")
    m.hal.set("PEv2.0.stepgen.STEP-SCALE", 100)
    for line in ("net x-cmd pokeys.0.PEv2.0.joint-pos-cmd",
                 "net on pokeys.0.machine-is-on"):
        m.hal.ok(f"halcmd {line}")
    m.hal.becomes("PEv2.0.PositionScale", 100)
    m.taken()
    m.hal.ok(f"halcmd sets x-cmd {m.hal.get('PEv2.0.joint-pos-fb')}")
    m.permit(lambda on: m.hal.ok(f"halcmd sets on {on}"))
    m.hal.ok("halcmd sets x-cmd 3")
    m.hal.becomes("PEv2.0.joint-pos-fb", 3)
    m.hal.becomes("PEv2.0.CurrentPosition", 300)
    m.hal.becomes("joint.00.pos-fb", 3)


def what_only_the_ini_file_says_is_taken_by_loadrt_as_well(m):
    m.device()
    m.sim("field engine.charge-pump 0 1")
    m.daemon()
    path = m.folder / "machine.ini"
    path.write_text(INI.format(run=m.folder / "run", keys="ApplyIniSettings = 1\n"
                               "PEv2_EmergencyInputPin = 52\nPEv2_EmergencyInput_invert = 1\n"
                               "encoder.7.enable = 1\nencoder.7.x4_sampling = 1\n"
                               "encoder.7.channelApin = 4\nencoder.7.channelBpin = 5\n"
                               "PEv2_AxisEnabeld_0 = 1"), encoding="utf-8")
    m.hal.ok(f"export INI_FILE_NAME={path}")
    m.hal.start("ini=auto")
    m.hal.becomes("connected", True)
    m.taken()
    m.hal.becomes("engine.emergency-invert", 1)
    m.hal.becomes("engine.emergency-pin", 62)
    m.hal.becomes("encoder.07.sampling", 4)
    m.hal.becomes("pin.51.function", 2)
    m.hal.says("keys of [POKEYS] that only a HAL file can use, or that are misspelt (1): "
               "PEv2_AxisEnabeld_0 (line 11)")
    assert m.sim("field engine.charge-pump") == {"engine.charge-pump": "0x01"}
    assert m.hal.get("legacy.encoder-factor") is True
    status, _ = m.hal.run("halcmd unloadrt pokeys_shm; halcmd loadrt pokeys_shm ini=/none.ini")
    assert status and "ini=/none.ini: No such file" in m.hal.said(), m.hal.said()[-500:]


TWO_PASSES = """\
loadrt pokeys_shm ini=auto
loadrt and2 names=door
addf pokeys.0.read servo-thread
addf door servo-thread
setp pokeys.0.PEv2.0.stepgen.STEP-SCALE [JOINT_0]STEP_SCALE
setp pokeys.0.PEv2.0.AxesSwitchConfig [POKEYS](PEv2_AxesSwitchConfig_0)
net closed <= pokeys.0.digin.39.in => door.in0 door.in1
net x-config <= pokeys.0.PEv2.0.AxesConfig
"""
SECOND_FILE = """\
loadrt and2 names=lamp
addf lamp servo-thread
addf pokeys.0.write servo-thread
net lit door.out => pokeys.0.digout.30.out
foreach axis {0 1} {
    setp pokeys.0.PEv2.$axis.stepgen.STEPGEN-MAXVEL $::JOINT_0(MAX_VELOCITY)
    setp pokeys.0.PEv2.$axis.AxisEnabled 1
    net on => pokeys.0.PEv2.$axis.digout.AxisEnable.out
}
"""


def a_machine_of_two_passes_and_tcl_works(m):
    """[HAL]TWOPASS collects all loadrt and addf of .hal and .tcl files before the rest; and a
    name that was a pin until 2024, a parameter since, is both."""
    m.device()
    m.daemon()
    path = m.folder / "machine.ini"
    path.write_text(INI.format(run=m.folder / "run", keys="ApplyIniSettings = 1\n"
                               "PEv2_AxesSwitchConfig_0 = 5\nPin_39_Function = 2\n"
                               "[JOINT_0]\nSTEP_SCALE = 400\nMAX_VELOCITY = 25\n"
                               "[HAL]\nTWOPASS = ON\nHALFILE = mill.hal\nHALFILE = more.tcl"),
                    encoding="utf-8")
    (m.folder / "mill.hal").write_text(TWO_PASSES, encoding="utf-8")
    (m.folder / "more.tcl").write_text(SECOND_FILE, encoding="utf-8")
    m.hal.ok(f"export INI_FILE_NAME={path}; halcmd loadrt threads name1=servo-thread "
             "period1=1000000")
    m.hal.ok(f"cd {m.folder} && LINUXCNC_TCL_DIR=/usr/lib/tcltk/linuxcnc "
             "HALLIB_DIR=/usr/share/linuxcnc/hallib HALLIB_PATH=.:/usr/share/linuxcnc/hallib "
             f"haltcl -i {path} /usr/lib/tcltk/linuxcnc/twopass.tcl 1>&2")
    m.hal.ok("halcmd start")
    m.hal.becomes("connected", True)
    m.taken()
    m.hal.becomes("PEv2.0.MaxSpeed", 25 * 400)
    assert m.hal.get("PEv2.0.digin.LimitN.Enabled") and m.hal.get("PEv2.0.digin.Home.Enabled")
    m.sim("pin 40 0")
    m.sim_shows("pin 31", "latch", "0")
    m.sim("pin 40 1")
    m.sim_shows("pin 31", "latch", "1")
    m.hal.set("PEv2.0.AxesConfig", 5)
    assert m.hal.get("PEv2.0.AxesConfig") == 5
    hal_live.wait("the pin shows the parameter",
                  lambda: int(m.hal.ok("halcmd gets x-config"), 0) == 5)


def further_devices_of_an_older_machine_have_the_older_names(m):
    (m.folder / "run").mkdir()
    path = m.folder / "machine.ini"
    path.write_text(INI.format(run=m.folder / "run", keys=""), encoding="utf-8")
    m.hal.ok(f"export INI_FILE_NAME={path}; halcmd loadrt pokeys_shm devices=mill,panel ini=auto")
    for line in ("net hold pokeys.1.digin.0.in pokeys.1.digout.5.out",
                 "setp pokeys.1.pins.5.PinFunction 4", "getp pokeys.0.pin.00.in"):
        m.hal.ok(f"halcmd {line}")
    m.hal.ok("halcmd unloadrt pokeys_shm")
    m.hal.ok(f"halcmd loadrt pokeys_shm devices=mill,panel runtime={m.folder}/run")
    m.hal.ok("halcmd getp pokeys.1.pin.00.in")
    assert m.hal.run("halcmd getp pokeys.1.digin.0.in")[0]


def a_machine_wired_as_before_march_2025_is_permitted_by_the_button(m):
    m.device()
    m.daemon()
    loadusr(m, "ApplyIniSettings = 1", "PEv2_EmergencyInputPin = 52")
    m.hal.ok("halcmd net ok pokeys.0.PEv2.digin.Emergency.in")
    m.hal.set("legacy.old-emergency", 1)
    m.taken()
    m.hal.becomes("engine.emergency-pin", 62)
    for contact in ("pressed", "released"):
        m.sim(f"emergency {contact}")
        permitted = m.sim("emergency")["active"] == "0"
        m.hal.becomes("PEv2.digin.Emergency.in", permitted)
        m.hal.becomes("PEv2.digin.Emergency.in-not", not permitted)
    m.kill("sim")
    m.hal.becomes("PEv2.digin.Emergency.in", False)


def an_axis_that_is_not_enabled_does_not_move(m):
    m.device()
    m.daemon()
    loadusr(m, "ApplyIniSettings = 1", "PEv2_AxisEnabled_0 = 1", "PEv2_AxisEnabled_1 = 0")
    for axis in (0, 1):
        m.hal.set(f"PEv2.{axis}.stepgen.STEP-SCALE", 100)
        m.hal.set(f"PEv2.{axis}.stepgen.STEPGEN-MAXVEL", 100)
        m.hal.ok(f"halcmd net cmd pokeys.0.PEv2.{axis}.joint-pos-cmd")
    m.hal.ok("halcmd net on pokeys.0.machine-is-on")
    m.hal.becomes("PEv2.1.PositionScale", 100)
    m.taken()
    m.hal.ok(f"halcmd sets cmd {m.hal.get('PEv2.0.joint-pos-fb')}")
    m.permit(lambda on: m.hal.ok(f"halcmd sets on {on}"))
    m.hal.ok("halcmd sets cmd 3")
    m.hal.becomes("PEv2.0.CurrentPosition", 300)
    other = m.sim("axis 1")
    with safety():
        assert other["machine"] == "0", f"an axis that is not enabled moved: {other}"


def keyboard_buses_and_analog_outputs_by_their_older_names(m):
    m.device()
    m.sim("module 0 on 100")
    m.daemon()
    loadusr(m)
    hal = m.hal
    hal.becomes("kbd48CNC.available", True)
    hal.becomes("kbd48CNC.lightValue", 100)
    m.sim("kbd 0 2 1 1")
    hal.becomes("kbd48CNC.9.Button", True)
    m.sim("kbd 0 2 1 0")
    hal.becomes("kbd48CNC.9.Button", False)
    hal.set("kbd48CNC.9.LED", 1)
    m.sim_shows("lamp 0 2 1", "lit", "1")
    hal.becomes("kbd48CNC.KeyBrightness", 155)
    hal.set("PoExtBus.9.digout.8.out", 1)      # bit 0 of byte 0
    hal.becomes("PoExtBus.9.digin.byte", 1)
    hal.becomes("PoExtBus.9.digin.8.in", True)
    hal.set("PoExtBus.0.digout.1.out", 1)      # bit 7 of byte 9
    hal.becomes("PoExtBus.0.digin.byte", 128)
    m.sim_shows("poext", "data", "01" + 8 * "00" + "80")
    hal.set("adcout.0.value", 5)
    hal.set("adcout.0.enable", 1)
    hal.set("legacy.adcout-follows", 1)
    m.sim_shows("pwm", "duty.5", "1250")        # 5 of 10 V, of 2500 ticks
    hal.becomes("adcout.0.deb.out", 1250)
    hal.set("adcout.0.enable", 0)
    m.sim_shows("pwm", "duty.5", "0")


def a_dead_device_does_not_disturb_the_other(m):
    m.device()
    other = m.address.rsplit(".", 1)[0] + ".251"
    with open(m.folder / "conf", "a", encoding="utf-8") as conf:
        conf.write(PANEL.format(address=other))
    m.daemon()
    hal = m.hal
    hal.start(f"runtime={m.folder}/run", "devices=mill,panel")
    hal.ok("halcmd addf pokeys.1.read servo-thread && halcmd addf pokeys.1.write servo-thread")
    hal.becomes("connected", True)
    assert hal.get("connected", 1) is False
    m.sim("pin 13 0")
    hal.becomes("pin.12.in", False)
    m.sim("pin 13 1")
    hal.becomes("pin.12.in", True)
    lost = hal.get("packet-error-total")
    m.cycles(1000)
    print(f"{hal.get('packet-error-total') - lost:g} packets lost beside a dead device")
    hal.becomes("connected", True)
    m.spawn("panel", hal_machine.SIM, "--model", "57E", "--address", other, "--no-discovery",
            "--serial", "27295", "--quiet")
    hal.becomes("connected", True, device=1)
    hal.becomes("devSerial", 27295, device=1)
    m.kill("panel")
    hal.becomes("link-state", lambda have: have != hal_machine.RUNNING, device=1)
    hal.becomes("connected", True)


def copy(m, folder, *edits):
    """An example as it is, but for what a test must have of its own."""
    to = m.folder / folder
    shutil.copytree(EXAMPLES / folder, to)
    to.chmod(0o777)
    for name, old, new in edits:
        path = to / name
        text = path.read_text(encoding="utf-8")
        assert old in text, f"{name} has no {old!r}"
        path.write_text(text.replace(old, new), encoding="utf-8")
    return to


def the_panel_of_the_examples_works(m):
    m.device()
    m.daemon()
    to = copy(m, "57e-panel", ("panel.hal", "loadrt pokeys_shm\n",
                               f"loadrt pokeys_shm runtime={m.folder}/run\n"))
    m.hal.ok(f"halcmd -f {to}/panel.hal")
    m.hal.becomes("connected", True)
    m.sim("pin 13 1")
    m.sim_shows("pin 31", "latch", "1")
    m.sim("pin 13 0")
    m.sim_shows("pin 31", "latch", "0")


# The G1 of mill_ui.py goes at FEED, mm/s. An axis that is heard of is at most STALE_MS behind, or the
# emergency chain opens; then it has to speed up as mill.ini's MAX_ACCELERATION lets it.
FEED, STALE_MS, ACCELERATION = 10, 1500, 200
FERROR = FEED * STALE_MS / 1000 + FEED ** 2 / (2 * ACCELERATION)


def session(m, *edits, restarted=False, migrated=False):
    """LinuxCNC as the example's mill, with nobody as its user (mill_ui.py)."""
    ini = "mill.pokeysd.ini" if migrated else "mill.ini"
    restart = f"MILL_UI_SIM='{hal_machine.SIM} --ctl {m.folder}/sim' " if restarted else ""
    # a machine without realtime keeps everybody waiting at times; it must not stop for that
    with open(m.folder / "conf", "a", encoding="utf-8") as conf:
        conf.write(f"stale-after-ms = {STALE_MS}\n")
    m.device()
    m.daemon()
    ui = pathlib.Path(__file__).with_name("mill_ui.py")
    to = copy(m, "older-mill", ("mill.ini", "DISPLAY = axis\n", f"DISPLAY = {ui}\n"),
              ("mill.ini", "FERROR = 5\nMIN_FERROR = 2\n", f"FERROR = {FERROR}\nMIN_FERROR = {FERROR}\n"),
              *edits)
    if migrated:
        out = subprocess.run([POKEYSCTL, "migrate", to / "mill.ini", "--write"], capture_output=True, text=True,
                             check=True, timeout=120).stdout
        assert "written: " in out, out
    status, _ = m.hal.run(f"cd {to} && {restart}timeout 300 linuxcnc -r {ini} > {m.folder}/cnc.log 2>&1", 330)
    log = (m.folder / "cnc.log").read_text(errors="replace")
    assert ("restarted" if restarted else "moved") in log.splitlines(), f"status {status}\n{log[-3000:]}"
    print("\n".join(line for line in log.splitlines() if "axes stand" in line or "switched off" in line))
    return log


RUNTIME = ("mill.ini", "[POKEYS]\n", "[POKEYS]\nRUNTIME_DIRECTORY = {run}\n")


def nothing_is_refused(log):
    """pokeys refuses nothing. LinuxCNC itself refuses commands while it is off, which a busy machine may cause."""
    said = [line for line in log.splitlines()
            if line.startswith("pokeys") and ("refused" in line or "cannot" in line)]
    assert not said, said


def the_older_mill_homes_and_moves_with_loadusr(m):
    name, old, new = RUNTIME
    log = session(m, (name, old, new.format(run=m.folder / "run")))
    nothing_is_refused(log)
    assert m.sim("axis 0")["machine"] == "2000", m.sim("axis 0")


def the_older_mill_homes_and_moves_when_it_was_migrated(m):
    name, old, new = RUNTIME
    log = session(m, (name, old, new.format(run=m.folder / "run")), restarted=True, migrated=True)
    nothing_is_refused(log)
    assert m.sim("axis 0")["machine"] == "2000", m.sim("axis 0")


if __name__ == "__main__":
    sys.exit(hal_machine.main([
        settings_of_the_ini_file_reach_the_device,
        an_axis_moves_by_its_older_names,
        what_only_the_ini_file_says_is_taken_by_loadrt_as_well,
        a_machine_of_two_passes_and_tcl_works,
        further_devices_of_an_older_machine_have_the_older_names,
        a_machine_wired_as_before_march_2025_is_permitted_by_the_button,
        an_axis_that_is_not_enabled_does_not_move,
        keyboard_buses_and_analog_outputs_by_their_older_names,
        a_dead_device_does_not_disturb_the_other,
        the_panel_of_the_examples_works,
        the_older_mill_homes_and_moves_with_loadusr,
        the_older_mill_homes_and_moves_when_it_was_migrated,
    ]))
