#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""shm/build-rust.sh hands over the archive of the checkout that asks, also where several checkouts
share cargo's folder. The cargo here does what the real one does with them: it takes a younger
archive for its own.

usage: build_rust.py BUILD-RUST.sh
"""
import pathlib
import subprocess
import sys
import tempfile

CARGO = """#!/bin/sh
echo "$1" >>"${0%/*}/calls"
for word; do
	[ "$last" != --manifest-path ] || manifest=$word
	[ "$last" != --target-dir ] || target=$word
	last=$word
done
archive=$target/release/libpokeys_iox.a
source=${manifest%/*}/src/lib.rs
mkdir -p "$target/release"
if [ "$1" = clean ]; then
	rm -f "$archive"
elif ! [ "$archive" -nt "$source" ]; then
	cp "$source" "$archive"
fi
"""


def checkout(folder, name):
    (folder / name / "src").mkdir(parents=True)
    (folder / name / "src/lib.rs").write_text(name)
    (folder / name / "Cargo.toml").write_text("[package]\n")


def main():
    script = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as where:
        folder = pathlib.Path(where)
        (folder / "cargo").write_text(CARGO)
        (folder / "cargo").chmod(0o755)
        for name in ("one", "two"):
            checkout(folder, name)

        def built(name):
            subprocess.run([script, folder / "cargo", folder / name / "Cargo.toml", folder / "target", folder / "out"],
                           check=True)
            return (folder / "out").read_text()

        def calls():
            return (folder / "calls").read_text().split()

        for name in ("one", "two", "one", "two"):
            found = built(name)
            assert found == name, f"asked for the archive of checkout {name}, got that of {found}"
        # nothing is thrown away without need
        before = calls()
        assert built("two") == "two" and calls() == [*before, "build"], calls()
        (folder / "two/src/lib.rs").write_text("two, changed")
        assert built("two") == "two, changed"
    print("each checkout gets its own archive")
    return 0


if __name__ == "__main__":
    sys.exit(main())
