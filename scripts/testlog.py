# SPDX-License-Identifier: GPL-2.0-or-later
"""Read meson's logs of test runs: one JSON object per line."""
import json
import os
import pathlib
from typing import Any


class Test:
    """One test in a log."""

    def __init__(self, entry: dict[str, Any], build: pathlib.Path):
        # PROJECT:SUITE+SUITE / NAME
        head, _, self.name = entry["name"].partition(" / ")
        self.suites = set(head.rpartition(":")[2].split("+"))
        self.build = build
        self.title = f"{entry['name']} ({os.path.relpath(build)})"
        self.result: str = entry["result"]
        self.status: int | None = entry.get("returncode")
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
    """LOG=STATUS=SUITE+SUITE: a log, the exit status of `meson test`, and the suites that it was to run.
    The status is needed because a meson that was killed leaves a log without failures."""

    def __init__(self, argument: str):
        log, self.status, suites = argument.rsplit("=", 2)
        self.path, self.suites = pathlib.Path(log), suites.split("+")
        self.build = self.path.parent.parent
        self.tests: list[Test] = []
        self.fault = ""  # why the log could not be read completely
        try:
            with open(self.path, encoding="utf-8") as lines:
                for line in filter(str.strip, lines):
                    self.tests.append(Test(json.loads(line), self.build))
        except FileNotFoundError:
            pass  # meson writes no log if the suites contain no test
        except (OSError, ValueError, LookupError, TypeError) as why:
            self.fault = f"{self.path}: cannot be read completely: {why}"

    def faults(self) -> list[str]:
        """Errors other than failed tests."""
        if self.fault:
            return [self.fault]
        failed = sum(not test.passed() and not test.skipped() for test in self.tests)
        # meson ends with how many tests failed, or with 1; with anything else it did not run them all
        if self.status not in ({str(failed), "1"} if failed else {"0"}):
            return [f"{self.path}: {failed} tests failed, but meson test ended with {self.status}"]
        return []

    def missing(self) -> list[str]:
        """Suites without a single test run, unless something failed."""
        if self.faults():
            return []
        seen = set().union(*(test.suites for test in self.tests))
        return [f"{suite} ({os.path.relpath(self.build)}): no test was run"
                for suite in self.suites if suite not in seen]
