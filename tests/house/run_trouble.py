#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""./run in trouble: a word that it does not know is refused before anything is installed,
built or removed, half a build folder is configured anew, one that was copied here
is refused, results of an earlier run are not counted, nor half a run as a whole one, ^C ends the run and not
one suite, and where there is no apt whoever has all installed may go on.

meson and ninja are stand-ins that do what the real ones were seen to do.
"""
import os
import pathlib
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
        self.environment = {**os.environ, "CALLS": str(self.calls),
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
    for words in ("build x", "clean x", "demo x", "demo --seconds x", "test x", "bench --lits",
                  "bench --only x", "bench --only=", "bench --readme", "x", "", "help", "demo --help", "bench --help", "bench --list"):
        ran = subprocess.run([fake.folder / "run", *words.split()], env=fake.environment, text=True,
                             capture_output=True, timeout=120, check=False)
        right = "help" in words or "list" in words
        assert (ran.returncode == 0) == right, f"{words}: {ran}"
        assert ran.stdout if right else ran.stderr and not ran.stdout, f"{words}: {ran}"
        assert not fake.calls.exists(), f"{words}: {fake.calls.read_text()}"
        assert (fake.folder / "build").is_dir(), words


def half_a_build_folder(fake):
    private = fake.folder / "build/meson-private"
    private.mkdir(parents=True)
    (private / "coredata.dat").touch()
    child = fake.start("build_main")
    said = child.communicate(timeout=120)[0]
    assert child.returncode == 0, said


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
    (logs / "log-unit.json").write_text('{"name": "x", "result": "OK"}\n')
    child = fake.start(f"TEST_LOGS=(); suite_run build unit 1 unit; "
                       f"'{fake.root}/scripts/count-tests' \"${{TEST_LOGS[@]}}\"")
    said = child.communicate(timeout=120)[0]
    assert child.returncode == 1 and "0 passed" in said, said


def counted(fake, *arguments):
    said = subprocess.run([f"{fake.root}/scripts/count-tests", *arguments], text=True, capture_output=True,
                          timeout=120, check=False)
    return said.returncode, said.stdout.splitlines()[-1:], said


def half_a_log(fake):
    log = fake.folder / "build/meson-logs/log-unit.json"
    log.parent.mkdir(parents=True)
    log.write_text('{"name": "x", "result": "OK"}\n')
    for status, text, told in (("0", "", (0, ["1 passed, 0 failed, 0 skipped"])),
                               ("137", "", (1, ["1 passed, 1 failed, 0 skipped"])),
                               ("0", '{"name": "y", "res', (1, ["1 passed, 1 failed, 0 skipped"]))):
        log.write_text('{"name": "x", "result": "OK"}\n' + text)
        found = counted(fake, f"{log}={status}")
        assert found[:2] == told and not found[2].stderr, (status, text, found)
    # a suite that was not run at all is seen
    log.write_text('{"name": "x", "result": "OK"}\n')
    found = counted(fake, f"{log}=0", f"{fake.folder}/build/meson-logs/log-hal.json=0")
    assert found[:2] == (0, ["1 passed, 0 failed, 1 skipped"]), found


def a_meson_that_is_killed(fake):
    (fake.folder / "build/meson-logs").mkdir(parents=True)
    (fake.folder / "bin/meson").write_text(
        """#!/bin/bash
        echo '{"name": "x", "result": "OK"}' >build/meson-logs/log-unit.json; exit 137""")
    child = fake.start(f"TEST_LOGS=(); suite_run build unit 1 unit; "
                       f"'{fake.root}/scripts/count-tests' \"${{TEST_LOGS[@]}}\"")
    said = child.communicate(timeout=120)[0]
    assert child.returncode == 1 and "1 passed, 1 failed" in said and "ended with 137" in said, said


def interrupt(fake):
    (fake.folder / "build").mkdir()
    (fake.folder / "build/build.ninja").write_text("fuzz-wire\n")
    slow = fake.folder / "slow"
    child = fake.start("run_tests unit sim net", SLOW=str(slow))
    while not slow.exists() and child.poll() is None:
        time.sleep(0.02)
    os.killpg(child.pid, signal.SIGINT)
    said = child.communicate(timeout=120)[0]
    tests = [line for line in fake.calls.read_text().splitlines() if line.startswith("test ")]
    assert child.returncode == 130 and len(tests) == 1, f"{child.returncode} {tests} {said}"


def main():
    for check in (a_wrong_word, half_a_build_folder, a_copied_build_folder, no_apt, old_results, half_a_log,
                  a_meson_that_is_killed, interrupt):
        with tempfile.TemporaryDirectory() as folder:
            check(Fake(sys.argv[1], folder))
        print(f"ok: {check.__name__}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
