# SPDX-License-Identifier: GPL-2.0-or-later
"""The simulated device as the test of every name sees it: its control socket, and its
inside as lists of numbers."""
import socket
import time

LIMIT = 60      # seconds; a loaded machine is slow, and nothing is judged by time
GOES_ON = ("device.clock", "saves")     # change by themselves


class Device:
    """The simulator's control socket."""

    def __init__(self, path):
        end = time.monotonic() + LIMIT
        while True:     # the path is there a moment before somebody listens
            self.socket = socket.socket(socket.AF_UNIX)
            try:
                self.socket.connect(str(path))
                break
            except ConnectionRefusedError:
                self.socket.close()
                assert time.monotonic() < end, "the simulator does not listen"
                time.sleep(0.02)
        self.reader = self.socket.makefile()

    def ask(self, *commands):
        """Each command's answer as a dict; all of them in one."""
        answer = {}
        for command in commands:
            self.socket.sendall(command.encode() + b"\n")
            while (line := self.reader.readline().rstrip("\n")) != "ok":
                assert line and not line.startswith("error"), f"{command}: {line}"
                if "=" in line:
                    key, value = line.split("=", 1)
                    answer[key] = value
        return answer

    def inside(self):
        """Every field as a list of numbers, and what is worked out from them."""
        fields = {}
        for key, text in self.ask("field").items():
            if text.startswith("0x"):
                fields[key] = list(bytes.fromhex(text[2:]))
            else:
                fields[key] = [int(word) for word in text.split(",")]
        axes = [self.ask(f"axis {i}") for i in range(8)]
        fields["axis.speed"] = [float(axis["speed"]) for axis in axes]
        fields["saves"] = [int(self.ask("stat").get("op.50", 0))]
        for key, text in self.ask("inputs").items():
            fields[key] = [int(text, 16) >> i & 1 for i in range(55)]
        return fields

    def close(self):
        self.reader.close()
        self.socket.close()


def place_of(fields, field, index):
    """Its list of numbers, and which of them; rows are counted through."""
    if field in fields:
        return fields[field], index
    width = len(fields[f"{field}.0"])
    return fields[f"{field}.{index // width}"], index % width


def load(fields, field, index, mask=None):
    values, index = place_of(fields, field, index)
    return values[index] if mask is None else values[index] & mask
