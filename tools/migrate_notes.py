#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The tables of docs/compatibility.md as C, so that pokeysctl migrate says what the page says.

usage: migrate_notes.py compatibility.md >migrate_notes.c

The first cell of a row has whole names after "pokeys.0.", each in backticks, and perhaps a condition after
them; N, B and M stand for numbers, * for anything.
"""
import pathlib
import re
import sys

# heading: (kind, header of its table)
TABLES = {
    "Configurations for earlier versions": ("EARLIER", ["name", "then", "now", "what to do"]),
    "Choices": ("CHOICE", ["parameter", "default", "if 1", "reason for the default"]),
    "Pins and parameters with a different effect": ("DIFFERENT", ["name", "before", "now"]),
    "Accepted without function": ("NOTHING", ["name", "why it has no function"]),
}


# What migrate_report.c understands behind the names. The last three cannot be checked; they apply whenever the
# name is used.
CONDITIONS = {"", "negative", "with a fraction", "true", "false", "together with other flags", "set to 0",
              "above the maximum of the pulse generator", "of an axis that is driven", "linked to a signal",
              "at the start", "after a restart of the device",
              "after half a second or more without the device"}


def plain(text):
    """Markdown without marks."""
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"\*\*?([^*]+)\*\*?", r"\1", text)
    return re.sub(r"\s+", " ", text.replace("`", "").replace("\\_", "_")).strip()


def quoted(text):
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def rows(page):
    """(kind, cells) of each row."""
    for heading, (kind, header) in TABLES.items():
        part = re.search(rf"^## {re.escape(heading)}\n(.*?)(?=^## |\Z)", page, re.MULTILINE | re.DOTALL)
        if not part:
            sys.exit(f"docs/compatibility.md has no section \"{heading}\"")
        lines = [line for line in part[1].splitlines() if line.startswith("|")]
        cells = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]
        if not cells or [plain(cell) for cell in cells[0]] != header:
            sys.exit(f"docs/compatibility.md, \"{heading}\": the table's header is not {' | '.join(header)}")
        for row in cells[2:]:
            if len(row) != len(header):
                sys.exit(f"docs/compatibility.md, \"{heading}\": {len(row)} cells: {row}")
            yield kind, row


def main():
    page = pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")
    print("/* SPDX-License-Identifier: GPL-2.0-or-later */\n/* Made from docs/compatibility.md by migrate_notes.py. */")
    print('#include "tools/migrate.h"\n\nconst struct migrate_note migrate_notes[] = {')
    for kind, (names, *cells) in rows(page):
        condition = plain(re.sub(r"`[^`]*`,?", "", names))
        named = re.findall("`([^`]*)`", names)
        if named and condition not in CONDITIONS:
            sys.exit(f"docs/compatibility.md: {names}: the condition \"{condition}\" is not known here")
        texts = [plain(cell) for cell in cells] + [""] * (3 - len(cells))
        print(f"\t{{ MIGRATE_{kind}, {quoted(' '.join(named))}, {quoted(condition)},")
        print("\t  { " + ",\n\t    ".join(quoted(text) for text in texts) + " } },")
    print("};\n\nconst size_t migrate_note_count = sizeof(migrate_notes) / sizeof(migrate_notes[0]);")


if __name__ == "__main__":
    main()
