#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl doctor --fix and --undo on the made-up computers of doctor.py: which files are written, what
they say, what is left to a person, and that --undo leaves every byte as it was."""
import os
import pathlib
import pty
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from doctor import BAD, CORE, GOOD, ROUTE, plant  # noqa: E402  pylint: disable=wrong-import-position

CONF = "[daemon]\nperiod-us = 1000\n[device mill]\naddress = 10.0.0.2\n"
ARP = "IP address HW type Flags\n10.0.0.2   0x1 0x6 02:00:00:00:00:01 * enp1\n"

# four cores, nothing chosen and nothing set; core 2 is the one to take
FRESH = GOOD | {
    "etc/pokeysd/pokeysd.conf": CONF,
    "etc/default/grub": "  # isolcpus=7 is an example\nGRUB_CMDLINE_LINUX=\"quiet\"\n",
    "usr/sbin/update-grub": "",
    "etc/tmpfiles.d/other.conf": "", "etc/sysctl.d/other.conf": "",
    "proc/cmdline": "quiet", "proc/sys/kernel/timer_migration": "1",
    f"{CORE}/isolated": "", f"{CORE}/nohz_full": "(null)",
    **{f"{CORE}/cpu{n}/topology/thread_siblings_list": str(n) for n in range(4)},
    f"{CORE}/cpu2/online": "1",
    f"{CORE}/cpu2/cpufreq/scaling_governor": "powersave",
    f"{CORE}/cpu2/cpuidle/state0/latency": "0", f"{CORE}/cpu2/cpuidle/state1/latency": "2",
    f"{CORE}/cpu2/cpuidle/state2/latency": "300", f"{CORE}/cpu2/cpuidle/state2/disable": "0",
    "dev/cpu_dma_latency": (2000000000).to_bytes(4, "little"),
    "proc/irq/30/effective_affinity_list": "2", "proc/irq/30/smp_affinity_list": "0-3",
    "proc/500/comm": None, "proc/500/task/500/stat": None, "proc/500/task/501/stat": None,
}
WRITTEN = {
    "etc/pokeysd/pokeysd.conf.d/90-doctor-cpu.conf": "[daemon]\ncpu = 2\n",
    "etc/default/grub.d/pokeysd-isolation.cfg":
        'GRUB_CMDLINE_LINUX="$GRUB_CMDLINE_LINUX isolcpus=managed_irq,domain,2,3 nohz_full=2,3 rcu_nocbs=2,3"\n',
    "etc/default/grub.d/pokeysd-interrupts.cfg": 'GRUB_CMDLINE_LINUX="$GRUB_CMDLINE_LINUX irqaffinity=0,1"\n',
    "etc/tmpfiles.d/pokeysd-idle-states.conf": f"w /{CORE}/cpu2/cpuidle/state2/disable - - - - 1\n",
    "etc/tmpfiles.d/pokeysd-governor.conf": f"w /{CORE}/cpu2/cpufreq/scaling_governor - - - - performance\n",
    "etc/sysctl.d/90-pokeysd-timers.conf": "kernel.timer_migration = 0\n",
}
MADE = {"etc/pokeysd/pokeysd.conf.d", "etc/default/grub.d"}
NOW = {f"{CORE}/cpu2/cpuidle/state2/disable": "1", f"{CORE}/cpu2/cpufreq/scaling_governor": "performance",
       "proc/irq/30/smp_affinity_list": "0,1", "proc/sys/kernel/timer_migration": "0"}


class Computer:
    """Its files in a folder."""

    def __init__(self, program, root, tree):
        self.program, self.root = program, pathlib.Path(root)
        plant(self.root, tree)

    def files(self):
        """All of them with their content; folders as None."""
        return {str(path.relative_to(self.root)): path.read_bytes() if path.is_file() else None
                for path in sorted(self.root.rglob("*"))}

    def run(self, *options, status=0, stdin=subprocess.DEVNULL):
        out = subprocess.run([self.program, "doctor", "--root", str(self.root), *options], stdin=stdin,
                             capture_output=True, text=True, timeout=120, check=False)
        assert out.returncode == status, (options, out.returncode, out.stdout, out.stderr)
        return out.stdout + out.stderr

    def text(self, name):
        return (self.root / name).read_text(encoding="utf-8")

    def lines(self, name):
        """Those that are no comments."""
        return "".join(line + "\n" for line in self.text(name).splitlines() if not line.startswith("#"))


def answer(computer, option, word):
    """At a terminal; what it printed."""
    outer, inner = pty.openpty()
    os.write(outer, word.encode() + b"\n")
    try:
        return computer.run(option, stdin=inner, status=0 if word == "y" else 1)
    finally:
        os.close(inner)
        os.close(outer)


def check_all_is_written_and_taken_back(computer):
    before = computer.files()
    said = computer.run("--fix", status=1)
    assert "there is no terminal for the question; use --yes to skip it" in said, said
    assert computer.files() == before, "something was written without an answer"
    assert "nothing was changed" in answer(computer, "--fix", "n")
    assert computer.files() == before

    said = answer(computer, "--fix", "y")
    for name, lines in WRITTEN.items():
        assert computer.lines(name) == lines, (name, computer.text(name))
        assert computer.text(name).startswith("# Written by pokeysctl doctor --fix. To undo it: "), name
        assert f"written: {computer.root}/{name}" in said, said
    for name, value in NOW.items():
        assert computer.text(name).rstrip("\n") == value, (name, computer.text(name))
    assert set(computer.files()) - set(before) == set(WRITTEN) | MADE
    assert "# isolcpus: no core is isolated: other programs run on core 2 as well" in \
        computer.text("etc/default/grub.d/pokeysd-isolation.cfg")
    assert "restart the daemon: systemctl restart pokeysd" in said and "update-grub" in said, said

    after = computer.files()
    again = computer.run("--fix", "--yes")
    assert "(is there already)" in again and computer.files() == after, again

    assert "nothing was changed" in answer(computer, "--undo", "n") and computer.files() == after
    said = answer(computer, "--undo", "y")
    left = {name: (old, before.get(name)) for name, old in computer.files().items() if before.get(name) != old}
    # a file of the kernel gets its value without the newline
    left = {name: pair for name, pair in left.items() if pair[1] is None or pair[0] != pair[1].rstrip(b"\n")}
    assert not left and set(computer.files()) == set(before), (left, said)
    assert "there is nothing to undo" in computer.run("--undo")


def check_what_was_there_first_comes_back(computer):
    """Written twice, with another core the second time."""
    computer.run("--fix", "--yes")
    conf = computer.root / "etc/pokeysd/pokeysd.conf.d/90-doctor-cpu.conf"
    assert "cpu = 2" in conf.read_text(encoding="utf-8")
    (computer.root / "proc/sys/kernel/timer_migration").write_text("1", encoding="utf-8")
    (computer.root / "etc/sysctl.d/90-pokeysd-timers.conf").write_text(
        "# Written by pokeysctl doctor --fix.\n# before: /proc/sys/kernel/timer_migration 7\nold = 1\n", encoding="utf-8")
    before = computer.files()
    computer.run("--fix", "--yes", "--cpu", "1")
    assert "cpu = 1" in conf.read_text(encoding="utf-8")
    assert "domain,1,3 " in computer.text("etc/default/grub.d/pokeysd-isolation.cfg")
    assert "# before: /proc/sys/kernel/timer_migration 7\n" in computer.text("etc/sysctl.d/90-pokeysd-timers.conf")
    computer.run("--undo", "--yes")
    assert computer.text("proc/sys/kernel/timer_migration") == "7"
    assert set(before) - set(computer.files()) == set(WRITTEN) | MADE


def check_another_core_gets_back_what_it_had(computer):
    governor = f"{CORE}/cpu2/cpufreq/scaling_governor"
    for name in ("scaling_governor", "scaling_available_governors"):
        (computer.root / f"{CORE}/cpu1/cpufreq").mkdir(parents=True, exist_ok=True)
        (computer.root / f"{CORE}/cpu1/cpufreq/{name}").write_text("powersave performance"[:9 if "av" not in name else 99],
                                                                   encoding="utf-8")
    computer.run("--fix", "--yes")
    assert computer.text(governor) == "performance"
    computer.run("--fix", "--yes", "--cpu", "1")
    assert computer.text(governor) == "powersave"
    assert computer.text(f"{CORE}/cpu1/cpufreq/scaling_governor") == "performance"
    computer.run("--undo", "--yes")
    assert computer.text(f"{CORE}/cpu1/cpufreq/scaling_governor") == "powersave"


def check_interrupts_of_an_earlier_boot_stay(computer):
    """Their numbers are others now."""
    boot = computer.root / "proc/sys/kernel/random/boot_id"
    boot.parent.mkdir(parents=True)
    boot.write_text("first\n", encoding="utf-8")
    computer.run("--fix", "--yes")
    irq = computer.root / "proc/irq/30/smp_affinity_list"
    # sent elsewhere: with another core, the file still knows where it was
    (computer.root / "proc/irq/30/effective_affinity_list").write_text("0", encoding="utf-8")
    computer.run("--fix", "--yes", "--cpu", "1")
    name = "etc/default/grub.d/pokeysd-interrupts.cfg"
    assert computer.lines(name).endswith('irqaffinity=0,2"\n') and "smp_affinity_list 0-3\n" in computer.text(name)
    assert irq.read_text(encoding="utf-8") == "0,1"
    boot.write_text("second\n", encoding="utf-8")
    computer.run("--undo", "--yes")
    assert irq.read_text(encoding="utf-8") == "0,1"


def check_what_is_not_in_effect_is_done_again(computer):
    computer.run("--fix", "--yes")
    governor = computer.root / f"{CORE}/cpu2/cpufreq/scaling_governor"
    governor.write_text("powersave", encoding="utf-8")
    said = computer.run("--fix", "--yes")
    assert "changes to performance (before: powersave)" in said and "written: " not in said, said
    assert governor.read_text(encoding="utf-8") == "performance"


def check_a_strict_umask_hides_nothing_from_the_daemon(computer):
    before = os.umask(0o077)
    try:
        computer.run("--fix", "--yes")
    finally:
        os.umask(before)
    folder = computer.root / "etc/pokeysd/pokeysd.conf.d"
    assert folder.stat().st_mode & 0o777 == 0o755, oct(folder.stat().st_mode)
    assert {path.stat().st_mode & 0o777 for path in folder.iterdir()} == {0o644}


def check_a_folder_with_something_else_in_it_stays(computer):
    computer.run("--fix", "--yes")
    own = computer.root / "etc/default/grub.d/mine.cfg"
    own.write_text("mine", encoding="utf-8")
    computer.run("--undo", "--yes")
    assert [path.name for path in own.parent.iterdir()] == ["mine.cfg"]


def left_to_you(said):
    return said.split("Left to you:\n", 1)[1] if "Left to you:" in said else ""


# (what the computer has besides, options, what is left to a person, files that are not written)
LEFT = [
    ({"etc/default/grub": 'GRUB_CMDLINE_LINUX="quiet isolcpus=1"\n'}, (),
     "/etc/default/grub has isolcpus= already; change it there: isolcpus=managed_irq,domain,2,3", "isolation.cfg"),
    ({"proc/cmdline": "quiet irqaffinity=0"}, (),
     "the kernel command line has irqaffinity=0 already; change it where it is set: irqaffinity=0,1",
     "interrupts.cfg"),
    ({"etc/default/grub": None}, (), "GRUB is not installed; add these parameters to the kernel command line "
     "in your boot loader: isolcpus=managed_irq,domain,2,3", ".cfg"),
    ({"etc/pokeysd/pokeysd.conf": None}, (), "etc/pokeysd/pokeysd.conf does not exist yet", "doctor-cpu.conf"),
    ({f"{CORE}/online": "0"}, (), "there is no core to spare", ".cfg"),
    ({f"{CORE}/cpu2/cpufreq/scaling_available_governors": "powersave userspace"}, (),
     "no governor performance, only powersave userspace", "pokeysd-governor"),
    ({"etc/tmpfiles.d/pokeysd-governor.conf": "w /mine - - - - 1"}, (),
     "pokeysd-governor.conf is there, and was not written by this command", None),
    ({"etc/default/grub.d/mine.cfg": 'GRUB_CMDLINE_LINUX="nohz_full=1"'}, (),
     "/etc/default/grub.d/mine.cfg has nohz_full= already", "isolation.cfg"),
    ({"etc/pokeysd/pokeysd.conf.d/mill.conf": "[daemon]\ncpu = any"}, (),
     "/etc/pokeysd/pokeysd.conf.d/mill.conf sets cpu =, and is read after the file that would be written", "doctor-cpu"),
    ({"etc/pokeysd/pokeysd.conf.d/a.conf/x": ""}, (), "a file in the folder .d beside pokeysd.conf cannot be read",
     "doctor-cpu"),
    ({f"{CORE}/online": "0-1", "etc/pokeysd/pokeysd.conf": "[daemon]\ncpu = 2\n"}, (),
     "core: another cpu in pokeysd.conf, or echo 1 >", "pokeysd-i"),
    ({}, ("--cpu", "3"), "LinuxCNC takes the isolated core with the highest number, which would be the daemon's",
     "isolation.cfg"),
    ({f"{CORE}/online": "0-7", **{f"{CORE}/cpu{n}/topology/thread_siblings_list": f"{n % 4},{n % 4 + 4}"
                                  for n in range(8)}}, ("--cpu", "7"),
     "LinuxCNC takes the isolated core with the highest number, which would be the daemon's", "isolation.cfg"),
    ({}, ("--cpu", "0"), "core 0 does the kernel's own work and cannot be freed from it; choose another cpu",
     "doctor-cpu"),
    ({"proc/version": "Linux version 6.1.0-amd64 (a@b) #1 SMP PREEMPT_DYNAMIC"}, (),
     "kernel: apt install linux-image-rt-amd64", None),
]

# (what the computer has besides, options, a file, its lines)
OTHERS = [
    # hyperthreads: two cores with two threads each; the sibling of the daemon's is switched off
    ({f"{CORE}/cpu{n}/topology/thread_siblings_list": f"{n % 2},{n % 2 + 2}" for n in range(4)} |
     {f"{CORE}/cpu1/cpufreq/scaling_governor": "performance", f"{CORE}/cpu3/online": "1"}, (),
     "etc/tmpfiles.d/pokeysd-sibling.conf", f"w /{CORE}/cpu3/online - - - - 0\n"),
    ({f"{CORE}/online": "0-1"}, (), "etc/default/grub.d/pokeysd-isolation.cfg",
     WRITTEN["etc/default/grub.d/pokeysd-isolation.cfg"].replace("2,3", "1")),
    # what is isolated already counts: LinuxCNC takes core 3, and core 2 is the daemon's
    ({f"{CORE}/isolated": "3", "proc/cmdline": "isolcpus=3"}, (), "etc/pokeysd/pokeysd.conf.d/90-doctor-cpu.conf",
     "[daemon]\ncpu = 2\n"),
    ({"etc/pokeysd/pokeysd.conf": CONF.replace("[daemon]", "[daemon]\ncpu = 1")}, (),
     "etc/default/grub.d/pokeysd-isolation.cfg", WRITTEN["etc/default/grub.d/pokeysd-isolation.cfg"].replace("2,3", "1,3")),
    ({"proc/sys/kernel/sched_rt_runtime_us": "0"}, (), "etc/sysctl.d/90-pokeysd-throttling.conf",
     "kernel.sched_rt_runtime_us = 950000\n"),
    # very many cores: as ranges; those that somebody else has isolated get no interrupts
    ({f"{CORE}/online": "0-127", f"{CORE}/cpu126/topology/thread_siblings_list": "126",
      **{f"{CORE}/cpu{n}/topology/thread_siblings_list": f"{n}" for n in range(128)}}, (),
     "etc/default/grub.d/pokeysd-interrupts.cfg", WRITTEN["etc/default/grub.d/pokeysd-interrupts.cfg"].replace("0,1", "0-125")),
    ({f"{CORE}/online": "0-7", f"{CORE}/isolated": "4-5", f"{CORE}/nohz_full": "3",
      **{f"{CORE}/cpu{n}/topology/thread_siblings_list": f"{n}" for n in range(8)}}, ("--cpu", "2"),
     "etc/default/grub.d/pokeysd-interrupts.cfg", WRITTEN["etc/default/grub.d/pokeysd-interrupts.cfg"].replace("0,1", "0,1,6")),
    # a device without a known interface does not count
    ({"etc/pokeysd/pokeysd.conf": "[daemon]\n[device other]\nserial = 5\n[device mill]\naddress = 10.0.0.2\n",
      "proc/net/arp": ARP.replace("enp1", "enp2"),
      "proc/net/route": ROUTE + "enp1\t0000000A\t00000000\t0001\t0\t0\t0\t00FFFFFF\t0\t0\t0\n"
                                "enp2\t0000000A\t00000000\t0001\t0\t0\t9\t00FFFFFF\t0\t0\t0\n"}, (),
     "etc/pokeysd/pokeysd.conf.d/90-doctor-interface.conf", "[daemon]\ninterface = enp2\n"),
    # two interfaces in one network
    ({"proc/net/arp": ARP.replace("enp1", "enp2"),
      "proc/net/route": ROUTE + "enp1\t0000000A\t00000000\t0001\t0\t0\t0\t00FFFFFF\t0\t0\t0\n"
                                "enp2\t0000000A\t00000000\t0001\t0\t0\t9\t00FFFFFF\t0\t0\t0\n"}, (),
     "etc/pokeysd/pokeysd.conf.d/90-doctor-interface.conf", "[daemon]\ninterface = enp2\n"),
]


def check_every_bad_finding_is_mended_or_left(program):
    """A computer with everything wrong: nothing that the doctor finds is passed over in silence."""
    with tempfile.TemporaryDirectory() as folder:
        computer = Computer(program, folder, BAD)
        found = {line.split()[1] for line in computer.run(status=1).splitlines()
                 if line.startswith(("advice ", "problem "))} - {"advice", "problem"}
        said = computer.run("--fix", status=1)
    assert len(found) > 15, found
    for check in found:
        assert re.search(rf"^(  )?([a-z-]+, )*{check}\b.*: ", said, re.M), (check, said)


def main():
    program = sys.argv[1]
    for check in (check_all_is_written_and_taken_back, check_what_was_there_first_comes_back,
                  check_a_folder_with_something_else_in_it_stays, check_another_core_gets_back_what_it_had,
                  check_interrupts_of_an_earlier_boot_stay, check_what_is_not_in_effect_is_done_again,
                  check_a_strict_umask_hides_nothing_from_the_daemon):
        with tempfile.TemporaryDirectory() as folder:
            check(Computer(program, folder, FRESH))
    with tempfile.TemporaryDirectory() as folder:
        said = Computer(program, folder, GOOD).run("--fix", "--yes")
        assert "there is nothing to write" in said, said
    for changes, options, wanted, unwritten in LEFT:
        with tempfile.TemporaryDirectory() as folder:
            computer = Computer(program, folder, FRESH | changes)
            said = computer.run("--fix", "--yes", *options)
            assert wanted in left_to_you(said), (changes, said)
            assert not unwritten or not [name for name in computer.files() if unwritten in name], (changes, said)
    for changes, options, name, lines in OTHERS:
        with tempfile.TemporaryDirectory() as folder:
            computer = Computer(program, folder, FRESH | changes)
            said = computer.run("--fix", "--yes", *options)
            assert computer.lines(name) == lines, (changes, said)
    check_every_bad_finding_is_mended_or_left(program)
    with tempfile.TemporaryDirectory() as folder:
        computer = Computer(program, folder, FRESH)
        assert "do not go together" in computer.run("--fix", "--undo", status=64)
        assert "--json does not go together" in computer.run("--fix", "--json", status=64)
    print(f"{len(WRITTEN)} files, {len(LEFT)} left to a person, {len(OTHERS)} other computers")
    return 0


if __name__ == "__main__":
    sys.exit(main())
