#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The control socket's server without HAL: what came before a stop is stale."""
import json
import os
import pathlib
import resource
import socket
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "remote"))
from pokeys_remote import lines  # noqa: E402
from pokeys_remote.control import DEAF, Control, Method  # noqa: E402


class Case:
    """A server whose method "note" keeps what it was asked."""

    def __init__(self, number):
        self.name = f"test-{os.getpid()}-{number}"
        self.noted = []
        self.listener = lines.listen(self.name)
        self.control = Control(self.listener, methods={"note": Method(self.note, {"word": str})})

    def note(self, call, now):
        self.noted.append((call.params["word"], call.stale))
        if call.params["word"] == "stop":
            self.control.pass_over(call.peer, now)
        call.answer()

    def connect(self):
        made = socket.socket(socket.AF_UNIX)
        made.connect(lines.address(self.name))
        return made

    @staticmethod
    def line(word):
        return json.dumps({"jsonrpc": "2.0", "id": 1, "method": "note", "params": {"word": word}}).encode() + b"\n"

    def serve(self, now=0.0, turns=20):
        for _ in range(turns):
            self.control.serve(now)
        return self.noted

    def close(self):
        self.control.close()
        self.listener.close()


def what_came_before_a_stop_is_stale(case):
    one, two = case.connect(), case.connect()
    case.serve()
    # a part of a line, and more lines than a turn takes
    one.sendall(case.line("a")[:20])
    case.serve()
    two.sendall(case.line("stop"))
    one.sendall(case.line("a")[20:] + b"".join(case.line(str(number)) for number in range(20)))
    late = case.connect()
    late.sendall(case.line("late"))
    case.serve(turns=1)
    case.control.serve(0.0)
    one.sendall(case.line("after"))
    two.sendall(case.line("same"))
    noted = dict(case.serve())
    before = [word for word, stale in case.noted if stale]
    assert noted["after"] is noted["same"] is noted["stop"] is False and noted["late"] is True, case.noted
    assert "19" in before and len(case.noted) == 25, case.noted


def connections_that_the_system_refuses_are_stale_too(case):
    """The one for whom there was no file when the stop came."""
    one = case.connect()
    case.serve()
    late = case.connect()
    late.sendall(case.line("late"))
    one.sendall(case.line("stop"))
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    # EMFILE comes in the turn of the stop: the next file would have this number
    free = os.dup(0)
    os.close(free)
    resource.setrlimit(resource.RLIMIT_NOFILE, (free, before[1]))
    try:
        case.serve(turns=1)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)
    assert case.noted == [("stop", False)], case.noted
    case.serve(now=DEAF / 2)
    assert len(case.noted) == 1
    assert case.serve(now=DEAF + 0.1)[1:] == [("late", True)], case.noted
    new = case.connect()
    new.sendall(case.line("new"))
    assert case.serve(now=DEAF + 0.2)[2:] == [("new", False)], case.noted


for order, test in enumerate((what_came_before_a_stop_is_stale, connections_that_the_system_refuses_are_stale_too)):
    tried = Case(order)
    test(tried)
    tried.close()
    print(f"ok: {test.__name__}")
