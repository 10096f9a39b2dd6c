#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl(1) lists the words of events that the daemon has, and no others."""
import pathlib
import re
import sys


def main():
    page, names = (pathlib.Path(path).read_text(encoding="utf-8") for path in sys.argv[1:3])
    sources = [path.read_text(encoding="utf-8") for path in pathlib.Path(sys.argv[3]).glob("*.c")]
    section = page[page.index("\n# EVENTS\n"):]
    section = section[:section.index("\n# ", 3)]
    listed = [word for line in re.findall(r"^\*[^\t\n]*$", section, re.M) for word in re.findall(r"\*([a-z-]+)\*", line)]
    known = re.findall(r'\[EVENT_[A-Z_]+\] = "([a-z-]+)"', names[names.index("kind_names["):].split("};", maxsplit=1)[0])
    for source in sources:
        known += re.findall(r'tell_line\((?!const)[^"]*"([^"]*)"', source)
    assert len(known) > 35 and len(sources) > 30, (known, len(sources))
    assert len(set(listed)) == len(listed), listed
    assert set(listed) == set(known), f"only in pokeysctl(1): {set(listed) - set(known)}, " \
        f"not there: {set(known) - set(listed)}"
    print(f"{len(listed)} kinds")


if __name__ == "__main__":
    sys.exit(main())
