# SPDX-License-Identifier: GPL-2.0-or-later
"""What libpokeys_shm.so shows to others and asks of them, what its realtime
functions call, and that the manual names all of it.

A symbol of Rust's that leaks would meet the one of another library; a library
it needs at run time is one more thing that may be missing where LinuxCNC runs.
The hot functions may call memcpy and nothing else: no lock, no allocation, and
no panic, which would end LinuxCNC.
"""
import re
import subprocess
import sys

NEEDED = {"libc.so.6", "libm.so.6", "libgcc_s.so.1", "ld-linux-x86-64.so.2",
          "ld-linux-aarch64.so.1", "libpthread.so.0", "libdl.so.2"}
HOT = [f"iox_{image}_{what}" for image in ("state", "diag", "command", "report")
       for what in ("loan", "commit", "read")] + [
       "iox_wish_loan", "iox_wish_commit", "iox_wish_news", "iox_diag_count", "iox_report_count"]


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def declared(header):
    text = re.sub(r"/\*.*?\*/", "", open(header, encoding="utf-8").read(), flags=re.S)
    return set(re.findall(r"\b(pokeys_\w+)\(", text))


def symbol_faults(library, header):
    shown = {line.split()[-1].split("@")[0] for line in
             run("nm", "-D", "--defined-only", library).splitlines()}
    for name in sorted(shown - declared(header)):
        yield f"{name} is exported and not in shm.h"
    for name in sorted(declared(header) - shown):
        yield f"{name} is in shm.h and not exported"


def manual_faults(header, manual):
    page = open(manual, encoding="utf-8").read()
    for name in sorted(declared(header)):
        if not re.search(rf"{name}\(", page):
            yield f"{name} is in shm.h and not in the manual page"


def needs_faults(library):
    dynamic = run("readelf", "-d", library)
    if "SONAME" not in dynamic or "[libpokeys_shm.so.0]" not in dynamic:
        yield "the SONAME is not libpokeys_shm.so.0"
    needed = set(re.findall(r"NEEDED.*\[(.*)\]", dynamic))
    for name in sorted(name for name in needed - NEEDED if "san" not in name):
        yield f"needs {name} at run time"


def call_faults(program):
    # by address: functions with the same code are one, under one of the names
    addresses = {line.split()[2]: int(line.split()[0], 16)
                 for line in run("nm", "--defined-only", program).splitlines()}
    text = run("objdump", "-d", "--no-show-raw-insn", program)
    bodies = {int(start, 16): body for start, body in
              re.findall(r"^([0-9a-f]+) <[^\n]*>:\n(.*?)(?:\n\n|\Z)", text, flags=re.S | re.M)}
    for name in HOT:
        body = bodies.get(addresses.get(name))
        if not body:
            yield f"{name} was not found in {program}"
            continue
        for line in re.findall(r"^.*\bcall\b.*$", body, flags=re.M):
            if not re.search(r"<mem(cpy|move)@", line):
                yield f"{name}: {line.strip()}"


def main():
    library, header, program, manual = sys.argv[1:]
    found = [*symbol_faults(library, header), *needs_faults(library),
             *manual_faults(header, manual)]
    if run("uname", "-m").strip() == "x86_64":
        found += call_faults(program)
    print("\n".join(found) or "in order")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
