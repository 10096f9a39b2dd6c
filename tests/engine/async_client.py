#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The example clients without the daemon, against the simulator over real UDP:
it identifies, reads and reports; packets that are lost are made good; what is
wrong is said in one line and with a status other than 0.

Called with the simulator and the clients."""
import os
import random
import re
import signal
import socket
import subprocess
import sys

SIM, CLIENT, FOUR = sys.argv[1:4]
ADDRESS = ".".join(["127"] + [str(random.randint(1, 254)) for _ in range(3)])


def simulator(*options):
    read, write = os.pipe()
    sim = subprocess.Popen([SIM, "--address", ADDRESS, "--quiet", "--serial", "4711",
                            "--ready-fd", str(write), *options], pass_fds=[write])
    os.close(write)
    with os.fdopen(read) as ready:
        assert ready.readline(), "the simulator did not start"
    return sim


def client(*options):
    done = subprocess.run([CLIENT, "--address", ADDRESS, *options], timeout=120, check=False,
                          capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def counters(text):
    return {name: int(value) for name, value in re.findall(r"(\w+) (\d+)", text)}


def run_until(good, *options):
    """What the client says, once it is good: a machine that is held answers late, or less often."""
    for _ in range(10):
        status, out, err = client("--seconds", "2", "--rate", "250", *options)
        assert status == 0 and err == "", (status, out, err)
        if good(counters(out)):
            return out
    raise AssertionError(f"ten times: {out}")


def end(sim):
    sim.send_signal(signal.SIGTERM)
    status = sim.wait(60)
    assert status == 0, f"the simulator ended with {status}"


def polls_and_reports():
    sim = simulator("--service-us", "200")
    try:
        out = run_until(lambda found: found["answered"] >= 200 and found["timed_out"] == 0)
        assert "serial 4711 " in out and "firmware 4.7." in out, out
        assert len(re.findall(r"^inputs [0-9a-f]{14}  engine state", out, re.M)) >= 2, out
    finally:
        end(sim)


def makes_losses_good():
    sim = simulator("--loss", "0.05", "--duplicate", "0.2", "--copies", "3", "--seed", "9")
    try:
        run_until(lambda found: found["resent"] > 0 and found["duplicate"] > 0 and found["answered"] >= 200)
    finally:
        end(sim)


def resends_after_the_timeout_that_it_is_given():
    sim = simulator("--loss", "0.05", "--seed", "9")
    try:
        run_until(lambda found: found["resent"] > 0 and found["answered"] >= 200, "--timeout-us", "5000")
    finally:
        end(sim)


def goes_on_after_256_requests():
    """It gives no entry of the mailbox back."""
    sim = simulator()
    try:
        run_until(lambda found: found["answered"] >= 600)
    finally:
        end(sim)


def four_functions_are_enough():
    sim = simulator("--loss", "0.05", "--seed", "9")
    try:
        done = subprocess.run([FOUR, ADDRESS], timeout=120, check=False, capture_output=True, text=True)
        said = re.fullmatch(r"inputs [0-9a-f]{14}, (\d+) answers\n", done.stdout)
        assert done.returncode == 0 and said and int(said[1]) > 256, done
    finally:
        end(sim)
    done = subprocess.run([FOUR, "machine"], timeout=120, check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "") and "machine: no IPv4 address" in done.stderr, done


def says_what_is_wrong():
    def refused(word, *options):
        status, out, err = client(*options)
        first = err.splitlines()[0] if err else ""
        assert status != 0 and out == "" and word in first, (options, status, out, err)

    refused("not an IPv4 address", "--address", "machine")
    refused("wanted a number from 1 to 2000", "--rate", "0")
    refused("wanted a number from 1 to 86400", "--seconds", "5x")
    refused("wanted a number from 0 to 10000000", "--timeout-us", "-1")
    refused("not an option", "now")
    refused("no answer", "--seconds", "1")          # nobody listens there
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as deaf:
        deaf.bind((ADDRESS, 0))
        refused("no answer", "--port", str(deaf.getsockname()[1]))
        refused("no answer", "--port", str(deaf.getsockname()[1]), "--timeout-us", "10000000")


def main():
    for case in (polls_and_reports, makes_losses_good, resends_after_the_timeout_that_it_is_given,
                 goes_on_after_256_requests, four_functions_are_enough, says_what_is_wrong):
        case()
        print(f"{case.__name__}: ok")
    return 0


if __name__ == "__main__":
    sys.exit(main())
