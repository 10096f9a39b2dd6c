# SPDX-License-Identifier: GPL-2.0-or-later
"""What meson wrote about tests that it ran: one JSON object a line."""
import json
import os
import pathlib


class Test:
    """What meson wrote of one test."""

    def __init__(self, entry: dict, build: pathlib.Path):
        # PROJECT:SUITE+SUITE / NAME
        head, _, self.name = entry["name"].partition(" / ")
        self.suites = set(head.rpartition(":")[2].split("+"))
        self.build = build
        self.title = f"{entry['name']} ({os.path.relpath(build)})"
        self.result, self.status = entry["result"], entry.get("returncode")
        stdout, stderr = ((entry.get(stream) or "").strip() for stream in ("stdout", "stderr"))
        self.output = "\n".join(filter(None, (stdout, stderr)))
        self.reason = (stderr or stdout or "no reason given").splitlines()[-1]

    def passed(self) -> bool:
        return self.result in ("OK", "EXPECTEDFAIL")

    def skipped(self) -> bool:
        return self.result == "SKIP"

    def what_happened(self) -> str:
        return f"{self.result}, status {self.status}" if self.status and self.result == "FAIL" else self.result


class Log:
    """LOG=STATUS=SUITE+SUITE: a log, what `meson test` ended with (one that was killed has a log in
    which everything passed so far), and the suites that it was asked for."""

    def __init__(self, argument: str):
        log, self.status, suites = argument.rsplit("=", 2)
        self.path, self.suites = pathlib.Path(log), suites.split("+")
        self.build = self.path.parent.parent
        self.tests: list[Test] = []
        self.fault = ""  # why not all of it could be read
        try:
            with open(self.path, encoding="utf-8") as lines:
                for line in filter(str.strip, lines):
                    self.tests.append(Test(json.loads(line), self.build))
        except FileNotFoundError:
            pass  # meson writes none when the suites hold no test
        except (OSError, ValueError, LookupError, TypeError) as why:
            self.fault = f"{self.path}: not all of it can be read: {why}"

    def faults(self) -> list[str]:
        """What is wrong besides tests that failed."""
        if self.fault:
            return [self.fault]
        if self.status != "0" and all(test.passed() or test.skipped() for test in self.tests):
            return [f"{self.path}: meson test ended with {self.status}"]
        return []

    def missing(self) -> list[str]:
        """Suites of which not one test was run, where all that was run is right."""
        if self.status != "0" or self.fault:
            return []
        seen = set().union(*(test.suites for test in self.tests))
        return [f"{suite} ({os.path.relpath(self.build)}): not one test was run"
                for suite in self.suites if suite not in seen]
