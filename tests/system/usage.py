#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A wrong word on the command line of any of our programs: one line that says what is
wrong and what to do, nothing else, and status 64. And help that could not be written is
no success. argv: the programs."""
import pathlib
import re
import subprocess
import sys

# words; what is said of them
WRONG = {
    "pokeysd": ((["-x"], "there is no option -x"), (["-xh"], "there is no option -x"),
                (["--bogus"], "there is no option --bogus"), (["--bogus=3"], "there is no option --bogus"),
                (["--conf", "x"], "there is no option --conf"),
                (["--config"], "--config needs a value"), (["-c"], "-c needs a value"),
                (["--config="], "--config needs a value, not an empty one"),
                (["-c", ""], "-c needs a value, not an empty one"),
                (["--runtime-directory", ""], "--runtime-directory needs a value, not an empty one"),
                (["--clear=/run/x"], "--clear takes no value"), (["--check-config=yes"], "--check-config takes no value"),
                (["bogus"], '"bogus" is not an option')),
    "pokeys-guard": ((["-x"], "there is no option -x"), (["--bogus"], "there is no option --bogus"),
                     (["--conf=x", "run"], "there is no option --conf"),
                     (["run", "--config"], "--config needs a value"),
                     (["--config", "", "run"], "--config needs a value, not an empty one"), ([], "a command is missing"),
                     (["bogus"], 'there is no command "bogus"'), (["run", "bogus"], 'there is no command "bogus"')),
    "pokeys-sim": ((["-x"], "there is no option -x"), (["--bogus"], "there is no option --bogus"),
                   (["--bogus=3"], "there is no option --bogus"), (["bogus"], "there is no option bogus"),
                   (["--control", ""], "--control: needs a value"), (["--script="], "--script: needs a value"),
                   (["--seed"], "--seed: needs a value"),
                   (["--ctl", "", "stat"], "--ctl needs a socket and a command"),
                   (["--ctl"], "--ctl needs a socket and a command")),
    "pokeysctl": ((["-x"], "there is no option -x"), (["--bogus"], "there is no option --bogus"),
                  (["status", "--js"], "there is no option --js"), (["status", "-r"], "-r needs a value"),
                  (["status", "-r", ""], "-r needs a value, not an empty one"),
                  (["discover", "--address", ""], "--address needs a value, not an empty one"),
                  (["discover", "--interface="], "--interface needs a value, not an empty one"),
                  (["status", "--json=1"], "--json takes no value"), (["status", "-c"], "there is no option -c"), ([], "a command is missing"),
                  (["bogus"], 'there is no command "bogus"')),
    "pokeys": ((["-x"], "there is no option -x"), (["--bogus"], "there is no option --bogus"),
               (["bogus"], "there is no option bogus")),
}


def main():
    tried = 0
    for program in map(pathlib.Path, sys.argv[1:]):
        for words, wrong in WRONG[program.name]:
            ran = subprocess.run([program.resolve(), *words], capture_output=True, text=True, timeout=60,
                                 check=False, stdin=subprocess.DEVNULL)
            line = rf"{program.name}: {re.escape(wrong)}; {program.name} --help lists .*\n"
            assert (ran.returncode, ran.stdout) == (64, "") and re.fullmatch(line, ran.stderr), (words, ran)
            tried += 1
        for word in "--help", "--version":
            with open("/dev/full", "w", encoding="ascii") as full:
                ran = subprocess.run([program.resolve(), word], stdout=full, stderr=subprocess.PIPE, text=True,
                                     timeout=60, check=False)
            told = f"{program.name}: standard output: No space left on device\n"
            assert (ran.returncode, ran.stderr) == (1, told), (program, word, ran)
    assert tried
    print(f"{tried} mistakes")


if __name__ == "__main__":
    main()
