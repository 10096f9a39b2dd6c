#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""What is installed is enough: each header that is installed, and the monitor that
docs/programming.md prints, compile with the installed headers alone; each page of docs that a man
page, an example or a header names is installed; and the Python packages as they are installed have
all of their files."""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT, BUILD = (pathlib.Path(argument) for argument in sys.argv[1:3])
CC = sys.argv[3:]


PLAN = json.loads((BUILD / "meson-info/intro-install_plan.json").read_text())


def stage(folder):
    """The installed headers below `folder`, as in /usr/include; their names."""
    names = []
    for source, entry in PLAN["headers"].items():
        name = entry["destination"].removeprefix("{includedir}/")
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).symlink_to(source)
        names.append(name)
    return names


def compile_alone(folder, what, text):
    ran = subprocess.run([*CC, "-fsyntax-only", "-Wall", "-Werror", "-I", folder, "-x", "c", "-"],
                         input=text, text=True, capture_output=True, check=False)
    if ran.returncode:
        print(f"{what} does not compile with what is installed:\n{ran.stderr}")
    return ran.returncode == 0


def pages_are_there():
    """docs/PAGE.md, below the same folder as the examples."""
    named = set()
    for path in [p for room in ("man", "examples", "include") for p in (ROOT / room).rglob("*")]:
        if path.is_file():
            named |= set(re.findall(r"\bdocs/[a-z-]+\.md", path.read_text(encoding="utf-8")))
    assert named, "nothing names a page of docs any more"
    entry = PLAN["install_subdirs"].get(str(ROOT / "docs"), {"destination": "nowhere"})
    installed = entry["destination"] == "{datadir}/doc/pokeysd/docs"
    missing = sorted(page for page in named if not installed or not (ROOT / page).exists())
    for page in missing:
        print(f"{page} is named, and not installed")
    return not missing


def packages_are_whole():
    """Each file of the Python packages is installed; what is imported is then there."""
    here = {path for room in ("python/pokeys", "gateway/pokeys_gateway", "remote/pokeys_remote") for path in (ROOT / room).rglob("*")
            if path.is_file() and "__pycache__" not in path.parts}
    assert len(here) > 20, here
    missing = {str(path) for path in here} - set(PLAN["data"]) - set(PLAN.get("python", {}))
    for path in sorted(missing):
        print(f"{path} is not installed")
    return not missing


def main():
    printed = re.findall(r"^```c\n(.*?)^```$", (ROOT / "docs/programming.md").read_text(), re.M | re.S)
    assert printed, "docs/programming.md has no monitor in C any more"
    with tempfile.TemporaryDirectory() as folder:
        names = stage(pathlib.Path(folder))
        assert "pokeys/shm.h" in names, names
        texts = {f"<{name}>": f"#include <{name}>\n" for name in names}
        texts.update({f"docs/programming.md, program {i + 1}": text for i, text in enumerate(printed)})
        good = [pages_are_there(), packages_are_whole()] + [compile_alone(folder, what, text) for what, text in texts.items()]
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
