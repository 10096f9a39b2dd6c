#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A button is held, and then its browser dies or freezes, or the gateway does, or the cable to the device is cut: how far
the axis goes afterwards is counted in pulses, at the simulated motor.

The axis is asked for after the event, so a computer that is busy makes the count smaller. What does not depend on
anybody's timers is the daemon's queue: two short moves of a tenth of a second at most, and one on its way.
"""
import contextlib
import os
import re
import signal
import sys
import time

from rig import machine
from house import main, wait_for  # noqa: E402  (rig.py finds it)

SCALE = 200                 # pulses per unit
MOST_S = 0.3
STILL_S = 0.5
HOLD = """
import asyncio, sys, aiohttp
async def hold(port, speed):
    async with aiohttp.ClientSession() as session, session.ws_connect(f"http://127.0.0.1:{port}/websocket") as ws:
        async def ask(number, method, **params):
            await ws.send_json({"jsonrpc": "2.0", "id": number, "method": method, "params": params})
            while (answer := await ws.receive_json()).get("id") != number:
                pass
            return answer.get("error")
        await ask(1, "console.subscribe")
        press = 1
        for number in range(2, 100000):
            # on a busy computer, a wish may come too late; then the key is pressed again
            press += bool(await ask(number, "console.jog", axis="x", speed=speed, press=press))
            await asyncio.sleep(0.06)
asyncio.run(hold(int(sys.argv[1]), float(sys.argv[2])))
"""


@contextlib.contextmanager
def shop(**keys):
    """An axis of up to 50 units/s and 500 units/s^2."""
    keys = {"axes": 1, "generator": "external", "axis.0.mode": "position", "axis.0.pulses-per-unit": SCALE, "axis.0.name": "x",
            "axis.0.max-speed": 10000, "axis.0.max-acceleration": 100000, "axis.0.invert": "off",
            "heartbeat-timeout-ms": 2000, **keys}
    with machine(more="[machine]\nkind = pokeys\ndevice = mill\n[console]\nlevel = user\n", **keys) as found:
        yield found


def place(house, sim):
    """Of the motor, in pulses."""
    return int(re.search(r"machine=(-?\d+)", house.ask_sim(sim, "axis", 0))[1])


@contextlib.contextmanager
def held(house, sim, gateway, speed):
    """The process of who holds the button, while the axis moves."""
    begun = place(house, sim)
    browser = house.spawn("python", "-c", HOLD, gateway.port, speed, log="browser.log")
    wait_for("it moves", lambda: abs(place(house, sim) - begun) > abs(speed) * SCALE * MOST_S,
             say=lambda: house.log("browser.log") + house.log("gateway.log"))
    try:
        assert browser.poll() is None, house.log("browser.log")
        goes(house, sim)
        yield browser
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.kill(browser.pid, signal.SIGKILL)
        browser.wait()


def goes(house, sim):
    """It moves now."""
    begun = place(house, sim)
    wait_for("it moves", lambda: place(house, sim) != begun, say=lambda: house.log("browser.log"))


def stands(house, sim, speed, most_s=MOST_S):
    """From now on it goes no further than it would in so many seconds, from where it is commanded to be."""
    # on a busy computer, the motor may be behind that
    before, now = house.state()["engine"]["axes"][0]["reference"], place(house, sim)
    since = time.monotonic()

    def still():
        nonlocal now, since
        if (found := place(house, sim)) != now:
            now, since = found, time.monotonic()
        return time.monotonic() - since > STILL_S
    wait_for("it stands", still)
    gone = max(0, (now - before) * (1 if speed > 0 else -1)) / (abs(speed) * SCALE)
    print(f"{gone * 1000:.0f} ms of its speed", file=sys.stderr)
    assert gone <= most_s, (before, now, house.log())


def test_the_browser_dies():
    with shop() as (house, sim, _daemon, gateway), held(house, sim, gateway, 20) as browser:
        os.kill(browser.pid, signal.SIGKILL)
        stands(house, sim, 20)


def test_the_browser_freezes():
    """Or the cable to it is cut: nothing comes, and nobody says so."""
    with shop() as (house, sim, _daemon, gateway), held(house, sim, gateway, -20) as browser:
        os.kill(browser.pid, signal.SIGSTOP)
        stands(house, sim, 20)


def test_the_gateway_dies():
    with shop() as (house, sim, _daemon, gateway), held(house, sim, gateway, 20):
        os.kill(gateway.child.pid, signal.SIGKILL)
        stands(house, sim, 20)


def test_the_gateway_freezes():
    with shop() as (house, sim, _daemon, gateway), held(house, sim, gateway, 20):
        os.kill(gateway.child.pid, signal.SIGSTOP)
        try:
            stands(house, sim, 20)
        finally:
            os.kill(gateway.child.pid, signal.SIGCONT)


def test_an_axis_that_brakes_slowly():
    """It is asked to go faster than it can stop from in a moment, and so it does not."""
    with shop(**{"axis.0.max-acceleration": 4000}) as (house, sim, _daemon, gateway):
        begun = place(house, sim)
        browser = house.spawn("python", "-c", HOLD, gateway.port, 50, log="browser.log")
        wait_for("it moves", lambda: place(house, sim) - begun > 200, say=lambda: house.log("browser.log"))
        os.kill(gateway.child.pid, signal.SIGSTOP)
        try:
            # 20 units/s^2, so 2 units/s and no more
            stands(house, sim, 2, 2 * MOST_S)
        finally:
            os.kill(gateway.child.pid, signal.SIGCONT)
            os.kill(browser.pid, signal.SIGKILL)
            browser.wait()


def test_the_cable_to_the_device_is_cut():
    with shop() as (house, sim, _daemon, gateway), held(house, sim, gateway, 20):
        house.ask_sim(sim, "silence", 60000)
        stands(house, sim, 20, 0.1)


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__], beside=3))
