#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The package installs into an empty virtual environment, and every example of docs/python.md
runs there."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(sys.argv[1]).parent))
from house import PATIENCE, House, Skip, equal, main, wait_equal  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
OFFLINE = ("No matching distribution found for setuptools", "Failed to establish a new connection",
           "Temporary failure in name resolution")
library = next(str(pathlib.Path(path).resolve()) for path in sys.argv if ".so" in path)


def examples():
    """The Python blocks of the page."""
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    return re.findall(r"^```python\n(.*?)^```$", page, re.M | re.S)


def installed(folder):
    """The Python of an environment with the package in it."""
    made = subprocess.run([sys.executable, "-m", "venv", folder / "venv"], capture_output=True, text=True, check=False)
    if made.returncode:
        raise Skip(f"no virtual environment can be made (python3-venv): {made.stdout.strip()}")
    # pip builds where the sources are
    shutil.copytree(ROOT / "python", folder / "python", ignore=shutil.ignore_patterns("__pycache__"))
    python = folder / "venv" / "bin" / "python"
    ran = subprocess.run([python, "-m", "pip", "install", "--disable-pip-version-check", "./python"], cwd=folder,
                         capture_output=True, text=True, check=False, timeout=4 * PATIENCE)
    if ran.returncode and any(text in ran.stdout + ran.stderr for text in OFFLINE):
        raise Skip("pip reaches no package index, and needs setuptools from there")
    equal(ran.returncode, 0, ran.stdout + ran.stderr)
    return python


def test_it_installs_and_the_examples_run():
    with House() as house:
        house.device_keys["mill"] |= {"digital-inputs": "4", "digital-outputs": "31", "stale-after-ms": 50000, "lost-after-ms": 60000}
        python = installed(house.folder)
        sim = house.start_sim()
        house.start_daemon()
        house.wait_fresh()
        house.ask_sim(sim, "pin", 4, 0)
        wait_equal("the input", lambda: house.ctl("get", "mill", "pin.03.in").stdout, "false\n")
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | {
            "POKEYS_SHM_LIBRARY": library, "POKEYSCTL": str(house.programs["pokeysctl"])}
        ran = []
        for text in examples():
            text = text.replace('attach("mill"', f'attach("mill", runtime="{house.runtime}"')
            # those that go on for ever end when they have shown something
            text = re.sub(r"async for (\w+) in mill\.(\w+)\(", r"async for \1 in once(mill.\2, ", text)
            text = "async def once(of, *words, **options):\n    async for one in of(*words, **options):\n" \
                   "        yield one\n        return\n" + text
            done = subprocess.run([python, "-c", text], capture_output=True, text=True, check=False, cwd=house.folder,
                                  env=environment, timeout=PATIENCE)
            equal((done.returncode, done.stderr), (0, ""), text)
            ran.append(done.stdout)
        assert len(ran) >= 3, ran
        assert ran[0].startswith("False 0 "), ran[0]
        assert json.loads(ran[-1])["link-state"] == 3, ran[-1]
        # the types are found by who checks a program against the installed package
        there = next((house.folder / "venv").glob("lib/python3*/site-packages/pokeys"))
        assert (there / "py.typed").exists(), there


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
