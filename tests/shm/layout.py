# SPDX-License-Identifier: GPL-2.0-or-later
"""The layouts that binding.py writes down by hand, against those
that the C compiler makes of the headers (shm_layout_print)."""
import ctypes
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import binding  # noqa: E402


def first_difference(ours, theirs):
    for mine, other in zip(ours.split(";"), theirs.split(";")):
        if mine != other:
            return f"python has '{mine}', C has '{other}'"
    return "one of them ends early"


def faults(program):
    lines = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    images = {"state": binding.State, "diag": binding.Diag, "command": binding.Command,
              "report": binding.Report, "wish": binding.Wish}
    for line in lines.splitlines():
        name, size, published, text = line.split(" ", 3)
        image = images.pop(name)
        if ctypes.sizeof(image) != int(size):
            yield f"{name}: {ctypes.sizeof(image)} bytes, C has {size}"
        if binding.text(image) != text:
            yield f"{name}: {first_difference(binding.text(image), text)}"
        if binding.fnv1a(binding.text(image)) != int(published, 16):
            yield f"{name}: the members hash to {binding.fnv1a(binding.text(image)):#018x}"
        if image.HASH != int(published, 16):
            yield f"{name}: HASH is {image.HASH:#018x}, the header says 0x{published}"
    for name in images:
        yield f"{name}: C did not print it"
    if binding.fnv1a("foobar") != 0x85944171f73967e8:
        yield "fnv1a is not FNV-1a"


def main():
    found = list(faults(sys.argv[1]))
    print("\n".join(found) or "all images agree")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
