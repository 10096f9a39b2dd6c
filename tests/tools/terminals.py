#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl terminals: every name that it prints is one of HAL's, every key one of
pokeysd.conf's, every label is there once, and the man page has the same tables.

usage: terminals.py POKEYSCTL LIST-NAMES POKEYSD PAGE.scd [--update]
"""
import json
import pathlib
import re
import subprocess
import sys

POKEYSCTL, LIST_NAMES, POKEYSD, PAGE = sys.argv[1:5]
BEGIN, END = "; the tables begin\n", "; the tables end\n"


def run(*words):
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=30)


def models():
    """Without a model, they are named."""
    done = run(POKEYSCTL, "terminals")
    assert done.returncode == 64 and not done.stdout, done
    found = done.stderr.split("name one model: ")[1].strip().split(", ")
    assert {"PoKeys57CNC", "PoKeys57E", "PoKeys57CNCpro4x25"} <= set(found), found
    assert len(set(found)) == len(found), found
    return found


def table(model):
    done = run(POKEYSCTL, "terminals", model, "--json")
    assert done.returncode == 0, done
    return json.loads(done.stdout)


def judge(model, said, names, keys):
    """One model's table, and what it prints of it."""
    text = run(POKEYSCTL, "terminals", model.removeprefix("PoKeys").lower()).stdout
    assert model in text, text
    for row in said["terminals"]:
        for name in filter(None, row["hal"].split(", ")):
            assert any(known.startswith(name + ".") for known in names), (model, row)
        for key in re.findall(r"\(([a-z-]+)(?: = [a-z]+)?\)", row["also"]):
            assert key in keys, (model, row, key)
        assert re.search(rf"(?m)^  {row['terminal']} .*{re.escape(row['also'])}$", text), (row, text)
    labels = [row["label"] for row in said["outputs"]]
    assert len(set(labels)) == len(labels), labels
    for row in said["outputs"]:
        assert row["hal"] in names and f"{row['label']}  " in text, (row, text)


def page_of(said):
    """The table in scdoc's language."""
    lines = [f"## {said['model']}\n", "][ *Terminal*", ":[ *In HAL*", ":[ *Can be*",
             ":[ *On the board; also, with this key*"]
    for row in said["terminals"]:
        also = "; ".join(filter(None, (row["label"], row["also"])))
        lines += [f"|  {row['terminal']}", f":  {row['hal']}", f":  {row['can_be']}", f":  {also}"]
    if said["outputs"]:
        lines += ["", "Outputs that are no terminals. In *pokeysd.conf*(5), *resume-outputs* calls all of them",
                  "_external_:", "", "][ *Output*", ":[ *In HAL*"]
    for row in said["outputs"]:
        lines += [f"|  {row['label']}", f":  {row['hal']}"]
    return "\n".join(lines) + "\n\n"


def main():
    names = {line.split()[0].removeprefix("pokeys.0.") for line in
             run(LIST_NAMES, "names", "canonical").stdout.splitlines()}
    keys = set(re.findall(r"(?m)^\s*([a-z0-9.#-]+)\b", run(POKEYSD, "--help-config").stdout))
    tables = [table(model) for model in models()]
    for said in tables:
        judge(said["model"], said, names, keys)
    relays = {row["label"]: row["hal"] for said in tables if said["model"] == "PoKeys57CNC" for row in said["outputs"]}
    assert relays["Relay 1"] == "external.02.out" and relays["SSR1"] == "external.07.out", relays
    assert run(POKEYSCTL, "terminals", "57X").returncode == 64
    page = pathlib.Path(PAGE)
    text = page.read_text(encoding="utf-8")
    whole = text.split(BEGIN)[0] + BEGIN + "\n" + "".join(map(page_of, tables)) + END + text.split(END)[1]
    if sys.argv[5:] == ["--update"]:
        page.write_text(whole, encoding="utf-8")
    elif whole != text:
        print("the page has other tables: run terminals.py with --update")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
