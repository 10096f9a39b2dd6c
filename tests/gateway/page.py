#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The page in Debian's Chromium: it shows what is there, says when that is old, comes back by itself, can be read
by a screen reader, fits on a phone and a wall, and does not grow.

With POKEYS_SCREENSHOTS=FOLDER, pictures are left there to be looked at.
"""
import asyncio
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

from rig import OPEN, PYTHON, WARM, Gateway, House, Skip, environment, loops, machine
from browser import CONTRAST, NAMED, SIZES, browser  # noqa: E402  (it needs house, which rig.py finds)
from house import end, equal, main  # noqa: E402

PICTURES = os.environ.get("POKEYS_SCREENSHOTS")
STATUS = "(document.querySelector('[role=status]')?.textContent ?? '')"
LIVE = f"{STATUS}.includes('live') && document.querySelector('article.device:not(.old)') !== null"


def workshop():
    """A device with some of everything, and a gateway with the page."""
    if "page.js" not in House.programs:
        raise Skip("the page was not built (npm was missing)")
    return machine("--preset", "demo", **{"digital-inputs": "4,9,12-16", "digital-outputs": "31-34",
                                          "analog-inputs": "43,44", "axes": 3})


def run(work):
    asyncio.run(asyncio.wait_for(work, 600))


def cell(name):
    """The text of a terminal of the strip."""
    return f"(document.querySelector('.strip li[title=\"{name}\"]')?.innerText ?? '')"


def test_it_shows_what_is_there():
    async def look(house, sim, gateway):
        async with browser() as chromium:
            page = await chromium.open(f"http://127.0.0.1:{gateway.port}/")
            await page.until("live", LIVE)
            for level, word in ((1, "on"), (0, "off"), (1, "on")):
                await asyncio.to_thread(house.ask_sim, sim, "pin", 4, level)
                await page.until("the input", f"{cell('pin.03.in')}.trim().endsWith('{word}')")
            await asyncio.to_thread(house.ask_sim, sim, "analog", 43, 2000)
            await page.until("the voltage", f"{cell('adc.02.volts')}.includes('1.61 V')")
            shown = await page.text()
            for text in ("mill", "data fresh", "PoKeys57CNC 65432", "Axes", "Terminals", "Analog inputs", "Events",
                         "running (was configuring)", "terminal 43:"):
                assert text in shown, (text, shown)
            # what pokeysctl says of the axes
            rows = await page.value(
                """document.querySelectorAll('.part[aria-label$=": Axes, in pulses"] tbody tr').length""")
            axes = (await asyncio.to_thread(gateway.json, "/api/devices/mill"))["values"]["info.Axes"]
            equal(rows, axes)
            await page.value("document.querySelector('summary').click()")
            await page.until("latencies", "document.querySelectorAll('details tbody tr').length > 3")
            assert "round trip" in await page.text()
            # what pokeysctl doctor says, when it is asked
            await page.value("document.querySelector('[aria-label=\"Computer\"] button').click()")
            await page.until("findings", "document.querySelectorAll('.findings li').length > 10")
            checks = {one["check"] for one in json.loads((await asyncio.to_thread(gateway.ask, "/api/doctor", "POST"))[2])[
                "findings"]}
            equal(set(await page.value("[...document.querySelectorAll('.findings b')].map(one => one.textContent)")), checks)
            # the link saves a record
            assert "Flight recorder" in await page.text()
            size = await page.value("""(async () => { const link = document.querySelector('.save a');
                return (await (await fetch(link.href)).blob()).size; })()""")
            assert size > 10000, size
            equal(page.complaints, [])
    with workshop() as (house, sim, _daemon, gateway):
        run(look(house, sim, gateway))


def part(title):
    """The text of a part of the page."""
    return f"""(document.querySelector('.part[aria-label="mill: {title}"]')?.innerText ?? '')"""


def test_it_shows_heaters_and_motors():
    async def look(house, sim, gateway):
        async with browser() as chromium:
            page = await chromium.open(f"http://127.0.0.1:{gateway.port}/")
            await page.until("both", f"{part('Heaters')}.includes('25.0 °C') && {part('Servo motors')} !== ''")
            shown = await page.value(part("Heaters"))
            for text in "bed", "⚠ hotend: not ready: sensor open", "off":
                assert text in shown, shown
            assert "–" in shown, shown
            # what is not there leaves nothing behind
            for title in "Heaters", "Servo motors":
                assert not re.search(r"^0+$", await page.value(part(title)), re.MULTILINE), title
            heating = house.spawn("pokeysctl", "-r", house.runtime, "heater", "mill", "bed", "heat", "60", log="heat.log")
            await page.until("it heats", f"{part('Heaters')}.includes('60.0 °C') && {part('Heaters')}.includes('heating')")
            # hot enough for its fan
            await asyncio.to_thread(house.ask_sim, sim, "analog", 43, 3500)
            await page.until("the jump is a fault", f"{part('Heaters')}.includes('⚠ bed: fault: temperature jumps, off')")
            await page.until("its fan", f"{part('Heaters')}.includes('fan on')")
            heating.wait()
            moving = house.spawn("pokeysctl", "-r", house.runtime, "servo", "mill", "x", "swing", "20", "--speed", "40",
                                 log="swing.log")
            # a busy computer may stop it
            await page.until("it moves", f"/enabled|fault/.test({part('Servo motors')})")
            equal(await page.value(CONTRAST), [])
            async for size in page.sizes(PICTURES, "loops-"):
                equal(await page.value(CONTRAST), [], size)
            await asyncio.to_thread(end, moving)
            equal(page.complaints, [])
    if "page.js" not in House.programs:
        raise Skip("the page was not built (npm was missing)")
    with loops() as (house, sim, _daemon, gateway):
        house.ask_sim(sim, "analog", 43, WARM)
        house.ask_sim(sim, "analog", 44, OPEN)
        run(look(house, sim, gateway))


def test_what_is_old_is_said_and_it_comes_back():
    async def look(house, sim, daemon, gateway):
        async with browser() as chromium:
            page = await chromium.open(f"http://127.0.0.1:{gateway.port}/")
            await page.until("live", LIVE)
            # nothing comes any more, and nothing says so
            gateway.child.send_signal(signal.SIGSTOP)
            began = time.monotonic()
            await page.until("no connection", f"{STATUS}.includes('No connection to the gateway since')")
            print(f"said after {time.monotonic() - began:.1f} s")
            await page.until("marked as old", "document.querySelector('.device.old') !== null")
            gateway.child.send_signal(signal.SIGCONT)
            await page.until("live again", LIVE)
            # it is killed, and started again
            gateway.child.kill()
            await asyncio.to_thread(gateway.child.wait)
            await page.until("no connection", f"{STATUS}.includes('No connection to the gateway since')")
            assert "mill" in await page.text(), "what was known is no longer shown"
            again = await asyncio.to_thread(Gateway, house, "--config", house.folder / "gateway.conf", port=gateway.port)
            await page.until("live again", LIVE)
            # the device is lost
            sim.kill()
            await page.until("the device is lost", f"{STATUS}.includes('No fresh data of mill')")
            shown = await page.text()
            for text in "what is shown is old", "state of the machine not known":
                assert text in shown, shown
            assert "motion permitted" not in shown and "motion not permitted" not in shown, shown
            equal(await page.value(CONTRAST), [])
            # and the daemon has written a record of that
            await page.until("the record", """[...document.querySelectorAll('[aria-label="Flight recorder"] li a')]
                .some(link => link.textContent === 'a device was lost' && link.href.endsWith('-lost.pcapng'))""")
            sim = house.start_sim("--preset", "demo")
            await page.until("live again", LIVE)
            # the daemon ends, and is started again
            await asyncio.to_thread(end, daemon)
            await page.until("no daemon", f"{STATUS}.includes('is pokeysd running?')")
            await asyncio.to_thread(house.start_daemon, wait=False)
            await page.until("live again", LIVE)
            await asyncio.to_thread(house.ask_sim, sim, "pin", 4, 1)
            await page.until("the input", f"{cell('pin.03.in')}.trim().endsWith('on')")
            again.child.send_signal(signal.SIGTERM)
            # a connection that fails is in the console, whoever wrote the page
            equal([one for one in page.complaints
                   if "websocket" not in str(one) and "net::ERR_CONNECTION_" not in str(one)], [])
    with workshop() as (house, sim, daemon, gateway):
        run(look(house, sim, daemon, gateway))


def test_a_frozen_tab_is_fresh_again():
    async def look(house, sim, gateway):
        async with browser() as chromium:
            page = await chromium.open(f"http://127.0.0.1:{gateway.port}/")
            await page.until("live", LIVE)
            await page.value("window.turns = 0; setInterval(() => window.turns++, 100); 0")
            await page.call("Page.setWebLifecycleState", state="frozen")
            turns = await page.value("window.turns")
            for level in 0, 1, 0, 1:
                await asyncio.to_thread(house.ask_sim, sim, "pin", 4, level)
                await asyncio.sleep(1)
            assert await page.value("window.turns") - turns < 10, "it was not frozen"
            await page.call("Page.setWebLifecycleState", state="active")
            began = time.monotonic()
            await page.until("the input", f"{LIVE} && {cell('pin.03.in')}.trim().endsWith('on')")
            print(f"fresh after {time.monotonic() - began:.1f} s")
    with workshop() as (house, sim, _daemon, gateway):
        run(look(house, sim, gateway))


def test_it_fits_and_can_be_read():
    async def look(gateway):
        async with browser() as chromium:
            page = await chromium.open(f"http://127.0.0.1:{gateway.port}/")
            await page.until("live", LIVE)
            await page.value("document.querySelector('summary').click()")
            await page.until("latencies", "document.querySelectorAll('details tbody tr').length > 3")
            await page.value("document.querySelector('[aria-label=\"Computer\"] button').click()")
            await page.until("findings", "document.querySelectorAll('.findings li').length > 10")
            await page.value("document.querySelectorAll('[aria-label=\"Computer\"] details').forEach(one => one.open = true)")
            async for _ in page.sizes(PICTURES, ""):
                pass
            nameless = [role for role, text in await page.tree() if role in NAMED and not text]
            equal(nameless, [])
            # every value has enough contrast with what is behind it (WCAG 2: 4.5)
            for dark in False, True:
                await page.size(1440, 900, dark)
                equal(await page.value(CONTRAST), [], f"dark: {dark}")
            equal(page.complaints, [])
    with workshop() as (_house, _sim, _daemon, gateway):
        run(look(gateway))


def test_it_asks_who_you_are():
    async def fill(page, name, password):
        await page.value(f"""(() => {{ const form = document.querySelector('form');
            form.elements.name.value = '{name}'; form.elements.password.value = '{password}';
            form.requestSubmit(); }})()""")

    async def look(gateway):
        async with browser() as chromium:
            page = await chromium.open(f"http://127.0.0.1:{gateway.port}/")
            await page.until("the form", "document.querySelector('form.login') !== null")
            await page.size(*SIZES["phone"], phone=True)
            if PICTURES:
                await page.picture(pathlib.Path(PICTURES) / "login.png")
            equal(await page.value(CONTRAST), [])
            await fill(page, "anna", "wrong one")
            await page.until("why not",
                             "document.querySelector('[role=alert]').textContent.includes('the password is another')")
            assert "mill" not in await page.text()
            await fill(page, "anna", "correct horse")
            await page.until("live", LIVE)
            assert "anna (user)" in await page.text()
            await page.call("Page.reload")
            await page.until("live again", LIVE)
            await page.value("document.querySelector('.user button').click()")
            await page.until("the form", "document.querySelector('form.login') !== null")
            assert "mill" not in await page.text()
            equal([one for one in page.complaints if "401" not in str(one)], [])
    with House() as house:
        if "page.js" not in House.programs:
            raise Skip("the page was not built (npm was missing)")
        (conf := house.folder / "gateway.conf").write_text(f"[access]\nusers = {house.folder / 'users'}\n")
        house.device_keys["mill"] |= {"lost-after-ms": 5000, "stale-after-ms": 4000}
        house.start_sim("--preset", "demo")
        house.start_daemon()
        house.wait_fresh()
        subprocess.run([PYTHON, "-B", House.programs["pokeys-gateway"], "--config", conf, "--set-user", "anna",
                        "--level", "user"], input="correct horse\n", text=True, check=True,
                       env={**os.environ, **environment()}, stdout=subprocess.DEVNULL)
        gateway = Gateway(house, "--config", conf)
        gateway.wait("the gateway", lambda: gateway.ask("/healthz")[0] == 200)
        run(look(gateway))


def test_a_slow_computer_shows_it():
    async def look(gateway):
        async with browser() as chromium:
            page = await chromium.open("about:blank")
            # a tablet of some years ago, on the workshop's network
            await page.call("Emulation.setCPUThrottlingRate", rate=4)
            await page.call("Network.enable")
            await page.call("Network.emulateNetworkConditions", offline=False, latency=20, downloadThroughput=1.25e6,
                            uploadThroughput=1.25e6)
            began = time.monotonic()
            await page.call("Page.navigate", url=f"http://127.0.0.1:{gateway.port}/")
            await page.until("live", LIVE)
            print(f"live after {time.monotonic() - began:.2f} s")
            equal(page.complaints, [])
    with workshop() as (_house, _sim, _daemon, gateway):
        run(look(gateway))


def test_it_does_not_grow():
    async def used(page):
        await page.call("HeapProfiler.collectGarbage")
        return (await page.call("Runtime.getHeapUsage"))["usedSize"], await page.value(
            "document.getElementsByTagName('*').length")

    async def look(gateway):
        async with browser() as chromium:
            page = await chromium.open(f"http://127.0.0.1:{gateway.port}/")
            await page.until("live", LIVE)
            await asyncio.sleep(20)
            heap, elements = await used(page)
            # its history has a test of its own (page_parts.mjs), in virtual time
            await asyncio.sleep(40)
            later, more = await used(page)
            print(f"heap {heap >> 10} kB, later {later >> 10} kB; {elements} elements, later {more}")
            assert later < heap * 1.2 + 500e3 and more < elements * 1.2, (heap, later, elements, more)
    with workshop() as (_house, _sim, _daemon, gateway):
        run(look(gateway))


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
