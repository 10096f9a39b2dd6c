#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The doctor's findings are those of pokeysctl, of the unit that may see everything or of the gateway's own; one run
is for all clients; and where there are none, the answer says why."""
import asyncio
import base64
import contextlib
import json
import os
import pathlib
import socket
import stat
import sys
import tempfile

from rig import PATIENCE, PYTHON, Gateway, House, environment, machine
from house import equal, main, run  # noqa: E402  (rig.py finds it)

FINDING = {"check": "kernel", "subject": "", "verdict": "ok", "why": "it is", "mend": "", "keep": ""}


def said(*findings):
    return json.dumps({"format": 1, "problems": 0, "findings": findings}).encode()


@contextlib.asynccontextmanager
async def service(answer):
    """As pokeys-doctor.socket: each connection gets the answer. Its path, and the connections."""
    came = []

    async def serve(_reader, writer):
        came.append(writer)
        if answer is not None:
            writer.write(answer)
            with contextlib.suppress(ConnectionError):
                await writer.drain()
            writer.close()
    with tempfile.TemporaryDirectory(prefix="pokeysd-test-") as folder:
        path = pathlib.Path(folder, "doctor")
        async with await asyncio.start_unix_server(serve, path):
            yield path, came
            for one in came:
                one.close()


def alone(work):
    """Work with the module alone, without a gateway."""
    from pokeys_gateway import doctor
    asyncio.run(asyncio.wait_for(work(doctor), PATIENCE))


def test_it_is_asked_once_for_all():
    async def work(doctor):
        now = 100.0
        worse = {**FINDING, "check": "core", "verdict": "problem"}
        async with service(said(FINDING, worse)) as (path, came):
            one = doctor.Doctor(path, "/run/pokeysd", lambda: now)
            found = await asyncio.gather(*(one.ask() for _ in range(50)))
            equal((len(came), len(set(map(id, found)))), (1, 1))
            equal((found[0].limited, found[0].findings), (False, [worse, FINDING]))
            now += doctor.KEPT_S - 0.1
            equal((await one.ask() is found[0], len(came)), (True, 1))
            now += 0.2
            equal((await one.ask() is found[0], len(came)), (False, 2))
    alone(work)


def fails(one, doctor):
    """Why it gives no findings."""
    async def ask():
        try:
            raise AssertionError(await one.ask())
        except doctor.NoDoctor as error:
            return str(error)
    return ask()


def test_what_is_no_diagnosis_is_an_error():
    async def work(doctor):
        now = 100.0
        for answer in (b"", b"{", b"[]", b"null", b'{"findings": 3}', b'{"findings": [3]}', b'{"findings": [{}]}',
                       b"\xff\xfe", said({**FINDING, "verdict": "perhaps"}), b" " * (doctor.SIZE_MOST + 1), b"[" * 100000):
            async with service(answer) as (path, came):
                one = doctor.Doctor(path, "/run/pokeysd", lambda: now)
                for times in 1, 1, 2:
                    text = await fails(one, doctor)
                    assert text == "pokeysctl doctor has given no findings; the log of pokeys-doctor@ says why", text
                    equal(len(came), times, answer)
                    # clients that wait meanwhile do not run it one after the other
                    now += doctor.KEPT_S / 2
    alone(work)


def test_one_that_hangs_holds_up_nobody_for_long():
    async def work(doctor):
        patience, doctor.PATIENCE_S = doctor.PATIENCE_S, 0.1
        try:
            async with service(None) as (path, came):
                one = doctor.Doctor(path, "/run/pokeysd", lambda: 100.0)
                texts = await asyncio.gather(*(fails(one, doctor) for _ in range(50)))
                equal((set(texts), len(came) <= 1), ({doctor.LATE}, True))
        finally:
            doctor.PATIENCE_S = patience
    alone(work)


def test_without_a_socket_for_us_it_looks_itself():
    async def work(doctor):
        os.environ["POKEYSCTL"] = str(House.programs["pokeysctl"])
        with tempfile.TemporaryDirectory(prefix="pokeysd-test-") as folder:
            # left behind by somebody who listened
            dead = pathlib.Path(folder, "dead")
            with socket.socket(socket.AF_UNIX) as left:
                left.bind(str(dead))
            for path in None, pathlib.Path(folder, "nobody"), dead:
                found = await doctor.Doctor(path, "/run/pokeysd").ask()
                equal((found.limited, len(found.findings) > 10), (True, True), path)
    alone(work)


def test_the_usual_socket_is_for_the_usual_daemon():
    from pokeys_gateway import config
    usual, other = config.DOCTOR, pathlib.Path("/run/other")
    for settings, path in ((config.Config(), usual), (config.Config(runtime_directory="/run/mill"), None),
                           (config.Config(runtime_directory="/run/mill", doctor_socket=other), other)):
        equal(config.doctor_socket(settings), path)


def post(gateway):
    """Status and document of the answer."""
    status, _headers, body = gateway.ask("/api/doctor", "POST")
    return status, json.loads(body)


def test_it_is_what_pokeysctl_says():
    with machine() as (house, _sim, _daemon, gateway):
        status, found = post(gateway)
        equal((status, found["limited"]), (200, True))
        theirs = json.loads(run(House.programs["pokeysctl"], "-r", house.runtime, "doctor", "--json").stdout)
        key = lambda one: (one["check"], one["subject"])  # noqa: E731
        equal(sorted(map(key, found["findings"])), sorted(map(key, theirs["findings"])))
        of = {key(one): one for one in theirs["findings"]}
        for one in found["findings"]:
            if one["check"] in ("kernel", "virtual", "timer-migration"):
                equal(one, of[key(one)])
        equal(gateway.ask("/api/doctor")[0], 405)
        assert "Traceback" not in house.log("gateway.log")
        # the configuration names the folder as well
        named = json.loads(run(House.programs["pokeysctl"], "doctor", "--json", "--config", house.conf).stdout)
        of_daemon = [{key(one) for one in found["findings"] if one["check"].startswith("daemon")} for found in (named, theirs)]
        assert of_daemon[0] == of_daemon[1] and len(of_daemon[0]) > 1, of_daemon


def test_guests_do_not_run_it():
    with House() as house:
        (conf := house.folder / "gateway.conf").write_text(
            f"[gateway]\ndoctor-socket = {house.folder / 'doctor'}\n[access]\nusers = {house.folder / 'users'}\nguests = yes\n")
        run(PYTHON, "-B", House.programs["pokeys-gateway"], "--config", conf, "--set-user", "anna",
            input="correct horse\n", env={**os.environ, **environment()})
        gateway = Gateway(house, "--config", conf)
        gateway.wait("the gateway", lambda: gateway.ask("/api/devices")[0] == 200)
        basic = base64.b64encode(b"anna:correct horse").decode()
        equal((post(gateway)[0], gateway.ask("/api/doctor", "POST", Authorization=f"Basic {basic}")[0]), (401, 200))


def test_without_a_doctor_there_is_a_reason():
    with House() as house:
        (conf := house.folder / "gateway.conf").write_text(f"[gateway]\ndoctor-socket = {house.folder / 'doctor'}\n")
        (script := house.folder / "pokeysctl").write_text(
            f'#!/bin/sh\n[ "$1" != doctor ] || {{ echo "pokeysctl: no doctor" >&2; exit 70; }}\n'
            f'exec {House.programs["pokeysctl"]} "$@"\n')
        script.chmod(script.stat().st_mode | stat.S_IXUSR)
        real, House.programs["pokeysctl"] = House.programs["pokeysctl"], script
        try:
            gateway = Gateway(house, "--config", conf)
        finally:
            House.programs["pokeysctl"] = real
        gateway.wait("the gateway", lambda: gateway.ask("/healthz")[0] == 200)
        status, found = post(gateway)
        equal((status, found["error"]["message"]),
              (503, "pokeysctl doctor has given no findings; the log of the gateway says why"))
        assert "pokeysctl: no doctor" in house.log("gateway.log")


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
