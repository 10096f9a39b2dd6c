#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl migrate: what concerns a machine of the older component, and nothing else of it.

usage: migrate.py POKEYSCTL POKEYSD EXAMPLES
"""
import pathlib
import os
import re
import subprocess
import sys
import tempfile

POKEYSCTL, POKEYSD, EXAMPLES = (pathlib.Path(path).resolve() for path in sys.argv[1:4])
INI = """[EMC]
MACHINE = old
[HAL]
HALUI = halui
HALFILE = {files}
POSTGUI_HALFILE = post.hal
[POKEYS]
DEVICE_ID = 27295
ApplyIniSettings = 1
PEv2_EmergencyInputPin = 54
PEv2_EmergencyInput_invert = 1
PEv2_linked_joint_0 = 0
PEv2_MaxSpeed_0 = 20000
Pin_31_Function = 4
[JOINT_0]
STEP_SCALE = 200.5
"""
HAL = """loadrt [KINS]KINEMATICS
loadusr -W pokeys   # the device
addf motion-command-handler   servo-thread
addf motion-controller        servo-thread
"""


class Machine:
    """An INI file and HAL files in a folder."""

    def __init__(self, folder, ini=INI, **files):
        self.folder = pathlib.Path(folder)
        files = {"mill.hal": HAL, "post.hal": "", **{name.replace("_", "."): text for name, text in files.items()}}
        self.ini = self.folder / "old.ini"
        self.ini.write_text(ini.format(files="mill.hal"), encoding="utf-8")
        for name, text in files.items():
            (self.folder / name).write_text(text, encoding="utf-8")

    def migrate(self, *options, status=0):
        ran = subprocess.run([POKEYSCTL, "migrate", self.ini, *options], capture_output=True, text=True, timeout=120,
                             check=False)
        assert ran.returncode == status, ran
        return ran.stdout if status == 0 else ran.stderr

    def conf(self, text):
        """The keys of the device in what was printed, accepted by the daemon."""
        part = text.split("\npokeysd.conf:\n", 1)[1].split("\n\nwritten:", 1)[0].split("\n\nNext steps:", 1)[0]
        path = self.folder / "judged.conf"
        path.write_text(part, encoding="utf-8")
        ran = subprocess.run([POKEYSD, "--check-config", "--config", path], capture_output=True, text=True, timeout=120,
                             check=False)
        assert ran.returncode == 0, (ran.stdout, ran.stderr, part)
        return dict(re.findall(r"^([a-z0-9.-]+) = (.*)$", part, re.MULTILINE))


def part(text, title):
    """The part of the report below a title."""
    found = re.search(rf"^{re.escape(title)}.*?\n(.*?)(?=^\S[^\n]*:\n|\Z)", text, re.MULTILINE | re.DOTALL)
    return found[1] if found else ""


def the_component_moves_into_the_servo_thread(folder):
    machine = Machine(folder, mill_hal=HAL + "net x joint.0.motor-pos-cmd => pokeys.0.PEv2.0.joint-pos-cmd\n")
    text = machine.migrate("--write")
    changed = (machine.folder / "mill.pokeysd.hal").read_text(encoding="utf-8")
    lines = [line for line in changed.splitlines() if line and not line.startswith("#")]
    assert lines == ["loadrt [KINS]KINEMATICS", "loadrt pokeys_shm ini=auto", "addf pokeys.0.read servo-thread",
                     "addf motion-command-handler   servo-thread", "addf motion-controller        servo-thread",
                     "addf pokeys.0.write servo-thread",
                     "net x joint.0.motor-pos-cmd => pokeys.0.PEv2.0.joint-pos-cmd"], changed
    assert "HALFILE = mill.pokeysd.hal\n" in (machine.folder / "old.pokeysd.ini").read_text(encoding="utf-8")
    assert "POSTGUI_HALFILE = post.hal\n" in (machine.folder / "old.pokeysd.ini").read_text(encoding="utf-8")
    assert (machine.folder / "mill.hal").read_text(encoding="utf-8").startswith(HAL)
    assert "serial = 27295\n" in (machine.folder / "old.pokeysd.conf").read_text(encoding="utf-8"), text


def a_late_loadusr_is_loaded_before_its_functs(folder):
    machine = Machine(folder, mill_hal="addf motion-command-handler servo-thread\naddf motion-controller servo-thread\n"
                      "loadusr -W pokeys\nnet x pokeys.0.PEv2.0.joint-pos-fb\n")
    machine.migrate("--write")
    changed = (machine.folder / "mill.pokeysd.hal").read_text(encoding="utf-8")
    lines = [line for line in changed.splitlines() if not line.startswith("#")]
    assert lines[:3] == ["loadrt pokeys_shm ini=auto", "addf pokeys.0.read servo-thread",
                         "addf motion-command-handler servo-thread"], changed


def without_a_known_thread_loadusr_stays(folder):
    text = "loadusr -W pokeys\nnet x pokeys.0.PEv2.0.joint-pos-fb\n"
    for more in ("", "addf motion-command-handler servo-thread 1\naddf motion-controller servo-thread\n",
                 "addf motion-controller servo-thread\naddf motion-command-handler servo-thread\n",
                 "addf motion-command-handler base-thread\naddf motion-controller servo-thread\n"):
        said = re.sub(r"\s+", " ", Machine(folder, mill_hal=text + more).migrate())
        assert "the loadusr line is kept" in said and '"addf pokeys.0.read servo-thread" before the first' in said, said
        assert "becomes" not in said, said


def only_the_component_is_replaced(folder):
    machine = Machine(folder, mill_hal="loadusr -Wn pokeys gladevcp -c pokeys panel.ui\n"
                      "loadusr -W /usr/bin/pokeys#old\nwaitusr pokeys\n" + HAL.replace("loadusr", "#loadusr") +
                      "net x pokeys.0.PEv2.0.joint-pos-fb\nloadusr -w pokeys")
    machine.migrate("--write")
    changed = (machine.folder / "mill.pokeysd.hal").read_text(encoding="utf-8")
    lines = [line for line in changed.splitlines() if not line.startswith("#")]
    assert lines == ["loadusr -Wn pokeys gladevcp -c pokeys panel.ui", "loadrt pokeys_shm ini=auto",
                     "loadrt [KINS]KINEMATICS", "addf pokeys.0.read servo-thread",
                     "addf motion-command-handler   servo-thread", "addf motion-controller        servo-thread",
                     "addf pokeys.0.write servo-thread", "net x pokeys.0.PEv2.0.joint-pos-fb"], changed


def two_devices_are_named(folder):
    machine = Machine(folder, ini=INI.replace("DEVICE_ID = 27295", "DEVICE_ID = 1\nDEVICE_ID_1 = 2"),
                      mill_hal=HAL + "net a pokeys.0.digin.3.in\nnet b pokeys.1.digin.3.in\n")
    text = machine.migrate()
    assert "loadrt pokeys_shm ini=auto devices=old,old-2\n" in text, text
    assert "      addf pokeys.0.read servo-thread\n      addf pokeys.1.read servo-thread\n" in text, text
    assert "[device old]\nserial = 1\n" in text and "[device old-2]\nserial = 2\n" in text, text


def a_machine_in_realtime_already_keeps_its_lines(folder):
    text = Machine(folder, mill_hal=HAL.replace("loadusr -W pokeys", "loadrt pokeys_shm") +
                   "addf pokeys.0.read servo-thread\nnet a pokeys.0.digin.3.in\n").migrate()
    assert "Lines to change" not in text, text


def commands_of_the_ini_file_are_changed_there(folder):
    machine = Machine(folder, mill_hal="net a pokeys.0.digin.3.in\n", more_hal="net v pokeys.0.PEv2.0.MaxSpeed\n",
                      ini=INI.replace("POSTGUI_HALFILE", "HALCMD = loadusr -W pokeys\n"
                                      "HALCMD = addf motion-command-handler servo-thread\n"
                                      "HALCMD = addf motion-controller servo-thread\nHALCMD = source more.hal\n"
                                      "SHUTDOWN = down.hal\nPOSTGUI_HALFILE"),
                      down_hal="net w pokeys.0.PEv2.0.MaxSpeed\n")
    machine.migrate("--write")
    changed = (machine.folder / "old.pokeysd.ini").read_text(encoding="utf-8")
    lines = [line for line in changed.splitlines() if re.match("HALCMD|SHUTDOWN|.*HALFILE", line)]
    assert lines == ["HALFILE = mill.hal", "HALCMD = loadrt pokeys_shm ini=auto",
                     "HALCMD = addf pokeys.0.read servo-thread", "HALCMD = addf motion-command-handler servo-thread",
                     "HALCMD = addf motion-controller servo-thread", "HALCMD = addf pokeys.0.write servo-thread",
                     "HALCMD = source more.pokeysd.hal",
                     "SHUTDOWN = down.pokeysd.hal", "POSTGUI_HALFILE = post.hal"], changed


def files_of_similar_names_are_others(folder):
    machine = Machine(folder, mill_hal=HAL + "source [FILES]MORE\n", custom_post_hal="net v pokeys.0.PEv2.0.MaxSpeed",
                      ini=INI + "[FILES]\nMORE = custom.post.hal\n")
    machine.migrate("--write")
    assert "POSTGUI_HALFILE = post.hal\n" in (machine.folder / "old.pokeysd.ini").read_text(encoding="utf-8")
    assert "\nsource custom.post.pokeysd.hal\n" in (machine.folder / "mill.pokeysd.hal").read_text(encoding="utf-8")
    assert (machine.folder / "custom.post.pokeysd.hal").read_text(encoding="utf-8").startswith("# net v")


def words_are_read_as_halcmd_reads_them(folder):
    machine = Machine(folder, mill_hal=HAL + "setp pokeys.0.PEv2.digin.Emergency.Pin#c 5\n"
                      "setp pokeys.0.PEv2.0.AxisInverted 1#x\nsetp \"pokeys.0.PEv2.0.digin.LimitN.Enabled\" 1\n"
                      "setp pokeys.0.PEv2.0.MaxSpeed [NOPE]KEY\nnet long " + " ".join(f"p{i}.in" for i in range(300)) +
                      " pokeys.0.PEv2.0.MaxSpeed\nnet x joint.0.motor-pos-cmd => pokeys.0.PEv2.0.joint-pos-cmd\n")
    text = machine.migrate("--write")
    assert "Unknown names" not in text and "MaxSpeed at mill.hal:8: [NOPE]KEY" in text, text
    assert machine.conf(text)["axis.0.invert"] == "on", text
    changed = (machine.folder / "mill.pokeysd.hal").read_text(encoding="utf-8")
    assert f"\nnet long {' '.join(f'p{i}.in' for i in range(300))}\n" in changed, changed


def odd_files_do_no_harm(folder):
    machine = Machine(folder, mill_hal="\\\n\"\n[\n" + "x" * 100000 + "\nnet\nnet a\nsetp\nsource\n= =\n")
    (machine.folder / "post.hal").unlink()
    os.mkfifo(machine.folder / "post.hal")
    text = machine.migrate()
    assert "post.hal: cannot be read" in text and "no line that loads the component" in text, text
    ran = subprocess.run([POKEYSCTL, "migrate", folder], capture_output=True, text=True, timeout=120, check=False)
    assert ran.returncode == 1 and "it is no file" in ran.stderr, ran


def several_ini_files_share_their_hal_files(folder):
    machine = Machine(folder, mill_hal=HAL + "net a pokeys.0.digin.3.in\n")
    machine.migrate("--write")
    machine.ini = machine.ini.rename(machine.folder / "other.ini")
    text = machine.migrate("--write")
    assert "written: " in text and re.search(r"^unchanged: .*mill.pokeysd.hal$", text, re.MULTILINE), text
    # another text is left alone, and nothing else is written
    (machine.folder / "mill.pokeysd.hal").write_text("mine\n", encoding="utf-8")
    (machine.folder / "other.pokeysd.ini").unlink()
    said = machine.migrate("--write", status=1)
    assert "mill.pokeysd.hal: the file exists with other contents, so nothing was written; move or delete it" in said, said
    assert not (machine.folder / "other.pokeysd.ini").exists()


def settings_become_keys(folder):
    machine = Machine(folder, mill_hal=HAL + "setp pokeys.0.PEv2.0.AxisInverted true\n"
                      "setp pokeys.0.PEv2.0.digin.LimitN.Enabled 1\n"
                      "net x joint.0.motor-pos-cmd => pokeys.0.PEv2.0.joint-pos-cmd\n")
    keys = machine.conf(machine.migrate())
    assert (keys["serial"], keys["axis.0.invert"], keys["axis.0.limit-minus"]) == ("27295", "on", "on"), keys
    assert (keys["axis.0.max-speed"], keys["digital-outputs"]) == ("20000", "32"), keys
    assert keys["emergency-invert"] == "on" and keys["emergency-pin"] == "54", keys


def what_it_does_not_use_is_not_mentioned(folder):
    machine = Machine(folder, mill_hal=HAL + "net a pokeys.0.digin.3.in\n", ini=INI.replace("ApplyIniSettings", "X"))
    text = machine.migrate()
    for word in ("kbd48CNC", "PoExtBus", "old-emergency", "LimitN", "stepgen"):
        assert word not in text, (word, text)
    assert "digin.3.in at mill.hal:5" in part(text, "Names with a different effect:"), text


def choices_depend_on_what_is_connected(folder):
    text = Machine(folder, mill_hal=HAL + "net e joint.0.amp-enable-out => pokeys.0.PEv2.0.digout.AxisEnable.out\n"
                   "setp pokeys.0.PEv2.0.stepgen.STEP-SCALE [JOINT_0]STEP_SCALE\n").migrate()
    choices = part(text, "Choices")
    assert "legacy.axis-enable-follows" in choices and "legacy.whole-scale" in choices, text
    assert "legacy.emergency" not in choices and "legacy.old-switches" not in choices, text


def an_emergency_of_the_other_sense_is_found(folder):
    machine = Machine(folder, mill_hal=HAL + "net estop pokeys.0.PEv2.digin.Emergency.in\n",
                      post_hal="net estop => iocontrol.0.emc-enable-in\n")
    text = machine.migrate()
    assert "legacy.old-emergency" in part(text, "Choices"), text
    earlier = part(text, "Names with another meaning in earlier versions:")
    assert "PEv2.digin.Emergency.in at mill.hal:5" in earlier, text
    assert "VOLATILE_HOME = 1" in text, text


def another_output_of_a_bus_is_found(folder):
    text = Machine(folder, mill_hal=HAL + "net r x.out => pokeys.0.PoExtBus.0.digout.1.out\n").migrate()
    earlier = part(text, "Names with another meaning in earlier versions:")
    assert "PoExtBus.0.digout.1.out at mill.hal:5" in earlier and "a different output is switched" in earlier, text


def parameters_are_linked_no_more(folder):
    machine = Machine(folder, mill_hal=HAL + "net v pokeys.0.PEv2.0.MaxSpeed speed.out\n"
                      "net w pokeys.0.PEv2.0.HomingSpeed\nnet z \\\n  pokeys.0.PEv2.0.MaxSpeed \\\n  other.out\n")
    machine.migrate("--write")
    changed = (machine.folder / "mill.pokeysd.hal").read_text(encoding="utf-8")
    lines = [line for line in changed.splitlines() if line.startswith("net ")]
    assert lines == ["net v speed.out", "net z other.out"], changed


def names_that_do_not_exist_are_told(folder):
    text = Machine(folder, mill_hal=HAL + "net a pokeys.0.PEv2.0.nosuch.in\n").migrate()
    assert "- pokeys.0.PEv2.0.nosuch.in at mill.hal:5" in text, text


def files_in_other_files_are_read(folder):
    machine = Machine(folder, mill_hal=HAL + "source more.hal\n",
                      more_hal="net w pokeys.0.PEv2.0.HomingSpeed\nsource gone.hal\n")
    text = machine.migrate("--write")
    assert "gone.hal: cannot be read" in text, text
    assert "source more.pokeysd.hal\n" in (machine.folder / "mill.pokeysd.hal").read_text(encoding="utf-8")


def files_without_end_are_told(folder):
    said = Machine(folder, mill_hal="source mill.hal\n").migrate(status=1)
    assert "load each other without end" in said, said


def tcl_is_read_as_far_as_it_goes(folder):
    machine = Machine(folder, mill_tcl="loadusr -W pokeys\nfor {set i 0} {$i < 3} {incr i} {\n"
                      "  net e$i => pokeys.0.PEv2.$i.digout.AxisEnable.out\n}\n")
    machine.ini.write_text(INI.format(files="mill.tcl"), encoding="utf-8")
    text = machine.migrate()
    assert "legacy.axis-enable-follows" in part(text, "Choices"), text
    # a line of several commands is changed by hand
    (machine.folder / "mill.tcl").write_text("loadusr -W pokeys\naddf motion-command-handler servo-thread\n"
                                             "addf motion-controller servo-thread\n"
                                             "foreach i {0 1} { net m$i pokeys.0.PEv2.$i.MaxSpeed }\n"
                                             "net m pokeys.0.PEv2.$i.MaxSpeed; net n x.out\n", encoding="utf-8")
    text = machine.migrate("--write")
    assert "mill.tcl:5 contains more than one command; change it by hand to:" in text, text
    changed = (machine.folder / "mill.pokeysd.tcl").read_text(encoding="utf-8")
    assert "\nnet m pokeys.0.PEv2.$i.MaxSpeed; net n x.out\n" in changed, changed


def who_is_no_older_machine_is_told(folder):
    said = Machine(folder, mill_hal="loadrt threads\n", ini=INI.replace("[POKEYS]", "[OTHER]")).migrate(status=1)
    assert "is a name of the older component" in said, said
    ran = subprocess.run([POKEYSCTL, "migrate"], capture_output=True, text=True, timeout=120, check=False)
    assert ran.returncode == 64 and "needs the machine's INI file" in ran.stderr, ran
    ran = subprocess.run([POKEYSCTL, "migrate", "/nowhere.ini"], capture_output=True, text=True, timeout=120,
                         check=False)
    assert ran.returncode == 1 and ran.stderr == "pokeysctl: /nowhere.ini: No such file or directory\n", ran


def the_example_of_an_older_machine(folder):
    machine = Machine(folder)
    machine.ini = EXAMPLES / "older-mill/mill.ini"
    text = machine.migrate()
    assert "loadrt pokeys_shm ini=auto" in text and "Unknown names" not in text, text
    machine.conf(text.replace("; serial = 12345", "serial = 12345"))


TESTS = [value for name, value in list(globals().items())
         if callable(value) and value.__module__ == __name__ and getattr(value, "__code__", None)
         and value.__code__.co_varnames[:1] == ("folder",)]


def main():
    for test in TESTS:
        with tempfile.TemporaryDirectory() as folder:
            test(folder)
            print(f"ok {test.__name__}")
    assert len(TESTS) > 12


if __name__ == "__main__":
    main()
