#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""pokeysctl --help tells of all commands; after a command, of that one alone."""
import re
import subprocess
import sys


def helped(*words):
    ran = subprocess.run([sys.argv[1], *words], capture_output=True, text=True, timeout=120,
                         check=False)
    assert (ran.returncode, ran.stderr) == (0, ""), (words, ran)
    assert not re.search(r"[ \t]$", ran.stdout, re.M), (words, ran.stdout)
    return ran.stdout, re.findall(r"^  ([a-z]+)", ran.stdout, re.M)


def main():
    _, commands = helped("--help")
    assert {"discover", "status", "top", "trace", "replay"} <= set(commands), commands
    for name in commands:
        for words in ((name, "--help"), ("-h", name)):
            text, told = helped(*words)
            assert told == [name], (words, told)
    assert "--runtime-directory" in helped("status", "-h")[0]
    assert "--runtime-directory" not in helped("replay", "-h")[0]
    ran = subprocess.run([sys.argv[1], "frob", "--help"], capture_output=True, text=True,
                         timeout=120, check=False)
    assert ran.returncode == 64 and 'no command "frob"' in ran.stderr, ran
    print(f"{len(commands)} commands")


if __name__ == "__main__":
    main()
