#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeys-remote.conf: every fault in one line with its place, and nothing happens before all is judged."""
import pathlib
import subprocess
import sys
import tempfile

from libraries import need

need("google.protobuf", "zmq.auth")
PROGRAM = pathlib.Path(sys.argv[1])
GOOD = """# a panel
[remote]
command = 127.0.0.1:6202, /run/user/1000/command
update = [::1]:6201
group = 127.0.0.1:6200, /run/user/1000/group
create = no

[component panel]
interval-ms = 50
lease-ms = 3000

[lease jog]
timeout-ms = 250

[pin panel.start]
failsafe = 0
[pin panel.jog.x]
failsafe = -0.5
lease = jog     ; as long as somebody holds it
epsilon = 0.001

[group dro]
signals = x-pos, axis-*, spindle-?
interval-ms = 20
epsilon = 0
[group tools]
signals = tool-number

[offer]
read = halui.*, axis.?.pos-fb
write =
"""
BAD = (
    ("command = 127.0.0.1:1\n", 1, "a section such as [remote] has to come first"),
    ("[pin]\nfailsafe = 0\n", 1, "there is no section [pin]; there are [remote], [secure], [component NAME], [pin COMPONENT.PIN], [lease NAME], [group NAME]"),
    ("[remote x]\n", 1, "there is no section [remote x]"),
    ("[pin start]\n", 1, '[pin start]: the name "start" is not allowed; allowed: COMPONENT.PIN'),
    ("[pin panel.age]\n", 1, "other pins than link-ok"),
    ("[component a.b]\n", 1, "no dot"),
    ("[remote]\ncommand = 192.168.1.1:6202\n", 2, "allowed: 127.0.0.1:PORT, [::1]:PORT or a path from /"),
    ("[remote]\ncommand = 0.0.0.0:6202\n", 2, "allowed: 127.0.0.1:PORT"),
    ("[remote]\nupdate = 127.0.0.1:0\n", 2, "allowed: 127.0.0.1:PORT"),
    ("[remote]\nupdate = 127.0.0.1:1, 127.0.0.1:1\n", 2, "allowed: each address once"),
    ("[remote]\nupdate = /" + 107 * "x" + "\n", 2, "at most 107 bytes"),
    ("[remote]\ncreate = true\n", 2, "allowed: yes, no"),
    ("[remote]\nport = 1\n", 2, "[remote] port: there is no such key; there are command, update, group, create"),
    ("[component p]\ninterval-ms = 9\n", 2, "allowed: a whole number from 10 to 10000"),
    ("[component p]\nlease-ms = 0.5\n", 2, "allowed: a whole number from 50 to 3600000"),
    ("[component p]\nlease-ms = 50\n[component q]\n[component p]\nlease-ms = 60\n", 5,
     "[component p] lease-ms: is there already"),
    ("[lease jog]\n", 1, "[lease jog]: timeout-ms is missing"),
    ("[pin p.a]\nlease = jog\n", 2, "[pin p.a] lease: there is no section [lease jog]"),
    ("[pin p.a]\nfailsafe = off\n", 2, 'failsafe: "off" is not allowed; allowed: a number, true, false'),
    ("[pin p.a]\nfailsafe = nan\n", 2, "allowed: a number, true, false"),
    ("[pin p.a]\nepsilon = -1\n", 2, "allowed: a number from 0"),
    ("[group dro]\ninterval-ms = 20\n", 1, "[group dro]: signals is missing"),
    ("[group dro]\nsignals = \n", 1, "[group dro]: signals is missing"),
    ("[group dro]\nsignals = a b\n", 2, "allowed: names of HAL"),
    ("[group a.b]\nsignals = a\n", 1, "at most 32 letters, digits, - and _"),
    ("[group dro]\nsignals = a\n[group dro-2]\nsignals = b\n", 3,
     "[group dro-2]: clients of group dro would also get its messages; choose a name that does not begin with dro"),
    ("[offer]\nread = a b\n", 2, "allowed: names of HAL"),
)


def run(*words):
    return subprocess.run(["/usr/bin/python3", "-B", PROGRAM, *words], capture_output=True, text=True, timeout=60,
                          check=False)


def main():
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "remote.conf")
        for text, line, said in (*BAD, (GOOD, 0, "is valid")):
            path.write_text(text, encoding="utf-8")
            ran = run("--check-config", "--config", path)
            if not line:
                assert (ran.returncode, ran.stderr, ran.stdout) == (0, "", f"pokeys-remote: {path} is valid\n"), ran
                continue
            assert (ran.returncode, ran.stdout) == (78, ""), (text, ran)
            assert ran.stderr.startswith(f"pokeys-remote: {path}:{line}: ") and said in ran.stderr, (text, ran)
            assert ran.stderr.count("\n") == 1, (text, ran)
        path.write_text("[remote]\nx = 1\n?\n[y]\n[pin p.a]\nfailsafe = z\n", encoding="utf-8")
        lines = run("--config", path).stderr.splitlines()
        assert [int(line.split(":")[2]) for line in lines] == [2, 3, 4, 6], lines
        ran = run("--config", path.with_name("none"))
        assert (ran.returncode, ran.stderr) == (78, f"pokeys-remote: {path.with_name('none')}: No such file or "
                                                    "directory\n"), ran
        for words, said in ((["--conf", "x"], "there is no option --conf;"), (["--name", "a.b"], '--name: "a.b"'),
                            (["start"], "invalid choice: 'start'")):
            ran = run(*words)
            assert ran.returncode == 64 and said in ran.stderr and ran.stderr.count("\n") == 1, ran
        assert run("--version").stdout.startswith("pokeys-remote ")
        assert "loadusr -W pokeys-remote" in run("--help").stdout
    print(f"{len(BAD)} mistakes")


main()
