#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""./run when something is wrong. It rejects unknown words before it installs, builds or removes anything.
It configures an incomplete build folder again and rejects one that was copied from elsewhere. It does not
count results of an earlier run, nor an incomplete run as a complete one. It runs a failed test again only if
that test depends on real time. ^C ends the whole run, not one suite. Without apt it goes on with what is installed.

meson and ninja are stand-ins that behave as the real ones do.
"""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

MESON = r"""#!/bin/bash
echo "$*" >>"$CALLS"
case $1 in
setup)	[ -f "$2/meson-private/coredata.dat" ] || touch "$2/build.ninja" ;;
test)	[ -z "${SLOW-}" ] || { trap 'exit 0' INT; touch "$SLOW"; sleep 5 >/dev/null 2>&1 & wait; } ;;
esac
"""
OK = "OK"
PASSED = '{"name": "pokeysd:unit / x", "result": "OK"}\n'
NINJA = '#!/bin/bash\n[ -f "$2/build.ninja" ]\n'


class Fake:
    """A folder with a build folder in it, and our two stand-ins before all others."""

    def __init__(self, root, folder):
        self.root, self.folder, self.calls = root, pathlib.Path(folder), pathlib.Path(folder) / "calls"
        for name, text in (("meson", MESON), ("ninja", NINJA)):
            path = self.folder / "bin" / name
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
            path.chmod(0o755)
        self.environment = {**os.environ, "CALLS": str(self.calls), "XDG_CACHE_HOME": str(self.folder / "cache"),
                            "PATH": f"{path.parent}:{os.environ['PATH']}"}

    def start(self, script, **variables):
        lines = [f". '{self.root}/scripts/{name}.sh'" for name in ("install", "build", "test")]
        lines = ["set -euo pipefail"] + lines + [script]
        return subprocess.Popen(["bash", "-c", "\n".join(lines)], cwd=self.folder, text=True,
                                env={**self.environment, **variables}, start_new_session=True,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def a_wrong_word(fake):
    for name in ("scripts", "bench"):
        shutil.copytree(pathlib.Path(fake.root) / name, fake.folder / name)
    shutil.copy(pathlib.Path(fake.root) / "run", fake.folder)
    for name in ("dpkg-query", "apt-get"):
        (fake.folder / "bin" / name).write_text('#!/bin/bash\necho "$0 $*" >>"$CALLS"; exit 1\n')
        (fake.folder / "bin" / name).chmod(0o755)
    (fake.folder / "build").mkdir()
    for words in ("build x", "clean x", "clean --all x", "demo x", "demo --seconds x", "demo --seconds", "demo --seconds=", "demo --web --file", "demo --web --file=", "test x", "test --repeat", "test --repeat 0", "test --load x", "test --nonsense", "test unit --load=65", "bench --lits",
                  "bench --only x", "bench --only=", "bench --readme", "x", "", "help", "demo --help", "bench --help", "bench --list"):
        ran = subprocess.run([fake.folder / "run", *words.split()], env=fake.environment, text=True,
                             capture_output=True, timeout=120, check=False)
        right = "help" in words or "list" in words
        assert (ran.returncode == 0) == right, f"{words}: {ran}"
        assert ran.stdout if right else ran.stderr and not ran.stdout, f"{words}: {ran}"
        assert not fake.calls.exists(), f"{words}: {fake.calls.read_text()}"
        assert (fake.folder / "build").is_dir(), words
    # and known words do what the help says
    for words, left in (("clean", {"cache"}), ("clean --all", set())):
        for name in ("build", "cache/pokeysd"):
            (fake.folder / name).mkdir(parents=True, exist_ok=True)
        subprocess.run([fake.folder / "run", *words.split()], env=fake.environment, stdout=subprocess.DEVNULL,
                       timeout=120, check=True)
        there = {name for name in ("build", "cache") if (fake.folder / name).exists() and
                 (name == "build" or (fake.folder / "cache/pokeysd").exists())}
        assert there == left, (words, there)


def where_crates_are_built(fake):
    """All build folders share one folder as long as the crates and the compiler are the same. If the user's
    cache cannot be written, cargo builds in the build folder."""
    lock = fake.folder / "shm/rust/Cargo.lock"
    lock.parent.mkdir(parents=True)
    found = []
    for text in ("a", "a", "b"):
        lock.write_text(text)
        child = fake.start("cargo_target")
        found.append(child.communicate(timeout=120)[0].strip())
        assert pathlib.Path(found[-1]).is_dir() and str(fake.folder / "cache/pokeysd") in found[-1], found
    assert found[0] == found[1] != found[2], found
    child = fake.start("cargo_target", XDG_CACHE_HOME="/dev/null/none")
    assert child.communicate(timeout=120)[0] == "" and child.returncode == 0


def half_a_build_folder(fake):
    private = fake.folder / "build/meson-private"
    private.mkdir(parents=True)
    (private / "coredata.dat").touch()
    child = fake.start("build_main")
    said = child.communicate(timeout=120)[0]
    assert child.returncode == 0, said


def two_at_a_time(fake):
    (fake.folder / "bin/ninja").write_text('#!/bin/bash\necho begin >>"$CALLS"\n'
                                           'until [ -e go ]; do sleep 0.05; done\necho end >>"$CALLS"\n')
    one = fake.start("build_main")
    while not fake.calls.exists() or "begin" not in fake.calls.read_text():
        assert one.poll() is None, one.communicate()
        time.sleep(0.05)
    other = fake.start("build_main")
    assert "another ./run is building in build" in other.stdout.readline()
    shutil.copytree(pathlib.Path(fake.root) / "scripts", fake.folder / "scripts")
    shutil.copy(pathlib.Path(fake.root) / "run", fake.folder)
    for words in (["clean"], ["clean", "--all"]):
        clean = subprocess.run([fake.folder / "run", *words], env=fake.environment, text=True, capture_output=True,
                               timeout=120, check=False)
        assert clean.returncode == 1 and "end it first" in clean.stderr, clean
    assert (fake.folder / "build/build.ninja").exists()
    (fake.folder / "go").touch()
    assert [child.communicate(timeout=120) and child.returncode for child in (one, other)] == [0, 0]
    assert re.findall("begin|end", fake.calls.read_text()) == 2 * ["begin", "end"], fake.calls.read_text()


def a_copied_build_folder(fake):
    info = fake.folder / "build/meson-info"
    info.mkdir(parents=True)
    (fake.folder / "build/build.ninja").touch()
    for source, status in (("/elsewhere", 1), (fake.folder, 0)):
        (info / "meson-info.json").write_text(f'{{"directories": {{"source": "{source}", "build": "x"}}}}')
        child = fake.start("build_main")
        said = child.communicate(timeout=120)[0]
        assert child.returncode == status, said
        assert ("./run clean" in said) == bool(status), said


def no_apt(fake):
    child = fake.start("""command() { [ "$2" != dpkg-query ] && builtin command "$@"; }
        install_packages some-thing; echo "went on" """)
    said = child.communicate(timeout=120)[0]
    assert child.returncode == 0 and "some-thing" in said and "went on" in said, said


def old_results(fake):
    logs = fake.folder / "build/meson-logs"
    logs.mkdir(parents=True)
    (logs / "log-unit.json").write_text(PASSED)
    child = fake.start(f"TEST_LOGS=() ROUND= UNDER_LOAD=(); suite_run build unit 1 unit; "
                       f"'{fake.root}/scripts/judge-tests' \"${{TEST_LOGS[@]}}\"")
    said = child.communicate(timeout=120)[0]
    assert child.returncode == 1 and "0 passed" in said, said


def counted(fake, *arguments):
    said = subprocess.run([f"{fake.root}/scripts/judge-tests", *arguments], text=True, capture_output=True,
                          timeout=120, check=False)
    return said.returncode, said.stdout.splitlines()[-1:], said


def half_a_log(fake):
    log = fake.folder / "build/meson-logs/log-unit.json"
    log.parent.mkdir(parents=True)
    late = entry("net", "sys / late", "FAIL", 1)
    for status, text, told in (("0", "", (0, ["1 passed, 0 failed, 0 skipped"])),
                               # it was killed after one had failed: what came after was not run
                               ("137", entry("unit", "y", "FAIL", 1), (1, ["1 passed, 2 failed, 0 skipped"])),
                               ("3", late, (1, ["1 passed, 2 failed, 0 skipped"])),
                               ("137", "", (1, ["1 passed, 1 failed, 0 skipped"])),
                               ("0", '{"name": "y", "res', (1, ["1 passed, 1 failed, 0 skipped"]))):
        log.write_text(PASSED + text)
        found = counted(fake, f"{log}={status}=unit")
        assert found[:2] == told and not found[2].stderr, (status, text, found)
    # a passed test that could not try a part is listed as skipped for that part
    log.write_text(entry("unit", "x", "OK", 0, "ok: this\nnot tried: that: there is none"))
    found = counted(fake, f"{log}=0=unit")
    assert found[:2] == (0, ["1 passed, 0 failed, 1 skipped"]) and "not tried: that" in found[2].stdout, found
    # a suite without a single test run is listed, in a log of its own or together with another suite
    log.write_text(PASSED)
    for words in ([f"{log}=0=unit", f"{fake.folder}/build/meson-logs/log-hal.json=0=hal"], [f"{log}=0=unit+hal"]):
        found = counted(fake, *words)
        assert found[:2] == (0, ["1 passed, 0 failed, 1 skipped"]), found
        assert "skipped: hal (" in found[2].stdout, found


def entry(suites, name, result, returncode, stdout=""):
    return json.dumps({"name": f"pokeysd:{suites} / {name}", "result": result, "returncode": returncode,
                       "stdout": stdout}) + "\n"


def judged_again(fake, entries, results, build="build"):
    """Judge one passed test and these entries; runs again end with these results in turn. Returns the exit
    status, the last line and all the output, and the names of the tests that were run again."""
    queue = fake.folder / "statuses"
    queue.write_text("".join(f"{result}\n" for result in results))
    (fake.folder / "bin/meson").write_text("""#!/bin/bash
        echo "${@: -1}" >>"$CALLS"
        result=$(head -n 1 "$STATUSES"); sed -i 1d "$STATUSES"
        while [ "$1" != --logbase ]; do [ "$1" != -C ] || folder=$2; shift; done
        [ "$result" = none ] || echo '{"name": "pokeysd:net / x", "result": "'$result'"}' >"$folder/meson-logs/$2.json"
        [ "$result" != FAIL ]""")
    fake.calls.unlink(missing_ok=True)
    log = fake.folder / build / "meson-logs/log-net.json"
    log.parent.mkdir(parents=True, exist_ok=True)
    log.write_text(PASSED + "".join(entries))
    ran = subprocess.run([f"{fake.root}/scripts/judge-tests", f"{log}={len(entries)}=unit"], text=True, capture_output=True,
                         env={**fake.environment, "STATUSES": str(queue)}, timeout=120, check=False)
    again = fake.calls.read_text().splitlines() if fake.calls.exists() else []
    return ran.returncode, ran.stdout.splitlines()[-1], ran.stdout, again


def what_is_run_again(fake):
    late = entry("net", "sys / late", "FAIL", 1, "first line\nnot within 60 s")
    hung = entry("hal+linuxcnc", "cnc / hung", "TIMEOUT", -15)
    # if it passes twice in a row, it counts as passed, is listed with the end of its first log, and that is kept
    status, last, text, again = judged_again(fake, [late], [OK, OK])
    assert (status, last, again) == (0, "2 passed, 0 failed, 0 skipped", ["sys / late"] * 2), text
    line = re.search(r"^flaky: pokeysd:net / sys / late .*: failed, then passed 2 of 2; first log: (\S+)$", text, re.M)
    assert line and "    not within 60 s" in text, text
    assert "first line\nnot within" in pathlib.Path(line[1]).read_text(), line
    # two tests may be run again; one that passes only once counts as failed
    assert judged_again(fake, [late, hung], [OK] * 4)[:2] == (0, "3 passed, 0 failed, 0 skipped")
    for results in (["FAIL"], [OK, "FAIL"], ["SKIP"], ["none"]):
        status, last, text, again = judged_again(fake, [late], results)
        assert (status, last, len(again)) == (1, "1 passed, 1 failed, 0 skipped", len(results)), text
        assert "flaky:" not in text and "again when it was run alone" in text, text
    # three are too many, so none is run again
    three = [late, hung, entry("vm", "vm / card", "FAIL", 1)]
    status, last, text, again = judged_again(fake, three, [OK] * 6)
    assert (status, last, again) == (1, "1 passed, 3 failed, 0 skipped", []), text


def what_is_never_run_again(fake):
    for build, *facts in (("build", "unit", "x / y", "FAIL", 1), ("build", "sim", "x / y", "TIMEOUT", -15),
                          ("build", "net+sim", "x / y", "FAIL", 1), ("build", "fuzz", "x / y", "FAIL", 1),
                          ("build", "net", "x / y", "FAIL", -11), ("build", "net", "x / y", "FAIL", 139),
                          ("build", "hal", "x / y", "FAIL", 3), ("build", "net", "x / y", "ERROR", 99),
                          ("build", "net", "x / y", "FAIL", 1, "==7==ERROR: AddressSanitizer: heap-use-after-free"),
                          ("build", "net", "x / y", "FAIL", 1, "a.c:7:2: runtime error: shift exponent"),
                          ("build", "net", "x / y", "FAIL", 1, "pokeysd ended with -11: it said"),
                          ("build", "net", "x / y", "TIMEOUT", -15, "UNSAFE: it moves\nnot within 60 s"),
                          ("build/asan", "net", "x / y", "FAIL", 1)):
        status, last, text, again = judged_again(fake, [entry(*facts)], [OK, OK], build)
        assert (status, last, again) == (1, "1 passed, 1 failed, 0 skipped", []), (facts, text)


def rounds(fake):
    """--repeat N runs everything N times, runs no failed test again, and prints how often each test failed."""
    (fake.folder / "build/meson-logs").mkdir(parents=True)
    (fake.folder / "build/build.ninja").touch()
    (fake.folder / "scripts").symlink_to(f"{fake.root}/scripts")
    for name, value in (("passes", PASSED), ("fails", entry("net", "sys / late", "FAIL", 1))):
        (fake.folder / name).write_text(value)
    (fake.folder / "bin/meson").write_text(
        """#!/bin/bash
        echo "$*" >>"$CALLS"
        while [ "$1" != --logbase ]; do shift; done
        log=build/meson-logs/$2.json
        cp passes "$log"
        [ "$2" != log-net-gateway-2 ] || { cat fails >>"$log"; exit 1; }""")
    child = fake.start("parse_tests unit net --repeat=3; run_tests")
    said = child.communicate(timeout=120)[0].splitlines()
    assert child.returncode == 1 and said[-1] == "6 passed, 1 failed, 0 skipped", said
    assert len(fake.calls.read_text().splitlines()) == 6, said
    rows = [line.split() for line in said[-5:-1]]
    assert rows[0] == ["test", "runs", "failures"] and rows[1][-2:] == ["1", "1"], said
    assert rows[2][-2:] == ["6", "0"] and "log-net-gateway-2.txt" in rows[3][-1], said


def under_load(fake):
    """It ends with the command's status, also if it stopped the command in between, and leaves nothing behind."""
    def groups():
        return [at for at, folders, _ in os.walk("/sys/fs/cgroup") if f"pokeysd-test-{child.pid}" in folders]

    for command, status in (("exit 7", 7), ("kill -TERM $$", 143), ("sleep 2; exit 5", 5)):
        child = subprocess.Popen([f"{fake.root}/scripts/under-load", "--busy", "1", "--between", "0.1",
                                  "sh", "-c", command], stderr=subprocess.PIPE, text=True)
        said = child.communicate(timeout=300)[1]
        assert child.returncode == status, (command, child.returncode, said)
        found = re.search(r"^under-load: (stopped the command (\d+) times, .* s in total|no stops: .+)$", said, re.M)
        assert found, said
        # two seconds without one stop in each tenth of them, then it was never stopped
        assert "sleep" not in command or found[2] != "0", said
        assert not groups(), groups()


def a_safety_assertion(fake):
    """It ends a test with a status of its own, and says so at once, whatever else failed."""
    for body, status in (("assert True", 0), ("assert False, 'it moves'", 3)):
        ran = subprocess.run([sys.executable, "-B", "-c", f"""
import sys
sys.path.insert(0, {fake.root + "/tests"!r})
from safety import safety, status
faults = [ValueError()] if {status} else []
try:
    with safety():
        {body}
except AssertionError as fault:
    faults.append(fault)
sys.exit(status(faults))"""], capture_output=True, text=True, timeout=120, check=False)
        assert (ran.returncode, ran.stderr) == (status, "UNSAFE: it moves\n" if status else ""), ran


def what_is_left_out(fake):
    log = fake.folder / "log-unit.json"
    log.write_text(PASSED)
    lines = counted(fake, "--left-out", "vm tsan", f"{log}=0=unit")[2].stdout.splitlines()
    assert lines[-2:] == ["not run here: vm tsan; ./run test all runs everything",
                          "1 passed, 0 failed, 0 skipped"], lines
    assert "not run" not in counted(fake, "--left-out", "", f"{log}=0=unit")[2].stdout


def tiers(fake):
    """A command runs its suites, each test once, and lists the suites that it leaves out."""
    for words, ran, left in (("", {"unit", "sim", "net", "gateway", "hal"}, "linuxcnc web vm package fuzz soak asan tsan"),
                             ("all", {"unit", "sim", "net", "gateway", "hal", "linuxcnc", "web", "vm", "package", "fuzz", "soak"}, ""),
                             ("hal linuxcnc", {"hal", "linuxcnc"}, "unit sim net gateway web vm package fuzz soak asan tsan")):
        for folder in ("build", "build/asan", "build/tsan"):
            (fake.folder / folder).mkdir(exist_ok=True)
            (fake.folder / folder / "build.ninja").write_text("fuzz-wire\n")
        fake.calls.unlink(missing_ok=True)
        child = fake.start(f"cd {fake.folder}; ln -sfn {fake.root}/scripts scripts; parse_tests {words}; run_tests")
        said = child.communicate(timeout=120)[0]
        calls = [line.split() for line in fake.calls.read_text().splitlines() if line.startswith("test ")]
        suites = [call[i + 1] for call in calls for i, word in enumerate(call) if word == "--suite" and call[2] == "build"]
        assert set(suites) == ran and len(suites) == len(ran), (words, calls)
        assert ("build/tsan" in [call[2] for call in calls]) == (words == "all"), calls
        assert (f"not run here: {left};" if left else "0 passed") in said, said
        # suites that share tests must be in one call of meson, or these tests would run twice
        for pair in ({"unit", "sim"}, {"hal", "linuxcnc"}):
            assert not pair <= ran or any(pair <= set(call) for call in calls), calls


def a_meson_that_is_killed(fake):
    (fake.folder / "build/meson-logs").mkdir(parents=True)
    (fake.folder / "bin/meson").write_text(
        """#!/bin/bash
        echo '{"name": "pokeysd:unit / x", "result": "OK"}' >build/meson-logs/log-unit.json; exit 137""")
    child = fake.start(f"TEST_LOGS=() ROUND= UNDER_LOAD=(); suite_run build unit 1 unit; "
                       f"'{fake.root}/scripts/judge-tests' \"${{TEST_LOGS[@]}}\"")
    said = child.communicate(timeout=120)[0]
    assert child.returncode == 1 and "1 passed, 1 failed" in said and "ended with 137" in said, said


def interrupt(fake):
    (fake.folder / "build").mkdir()
    (fake.folder / "build/build.ninja").write_text("fuzz-wire\n")
    slow = fake.folder / "slow"
    child = fake.start("parse_tests unit sim net; run_tests", SLOW=str(slow))
    while not slow.exists() and child.poll() is None:
        time.sleep(0.02)
    os.killpg(child.pid, signal.SIGINT)
    said = child.communicate(timeout=120)[0]
    tests = [line for line in fake.calls.read_text().splitlines() if line.startswith("test ")]
    assert child.returncode == 130 and len(tests) == 1, f"{child.returncode} {tests} {said}"


def main():
    for check in (a_wrong_word, where_crates_are_built, half_a_build_folder, two_at_a_time, a_copied_build_folder,
                  no_apt, old_results, half_a_log, what_is_left_out, what_is_run_again, what_is_never_run_again, tiers,
                  rounds, under_load, a_safety_assertion, a_meson_that_is_killed, interrupt):
        with tempfile.TemporaryDirectory() as folder:
            check(Fake(sys.argv[1], folder))
        print(f"ok: {check.__name__}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
