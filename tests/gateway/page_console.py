#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The console of the page in Debian's Chromium: lines and replies, targets, moves, files and macros, and a stop.

With POKEYS_SCREENSHOTS=FOLDER, pictures are left there to be looked at.
"""
import asyncio
import json
import os
import pathlib
import sys
import tempfile

from rig import House, Skip, machine
from browser import CONTRAST, NAMED, browser  # noqa: E402  (it needs house, which rig.py finds)
from house import equal, main  # noqa: E402

PICTURES = os.environ.get("POKEYS_SCREENSHOTS")
LOG = "[...document.querySelectorAll('[aria-label=\"Console: lines\"] li')].map(one => one.innerText)"
AXIS = {"mode": "position", "invert": "off", "max-speed": 20000, "max-acceleration": 200000, "pulses-per-unit": 200}


def printer(folder):
    """Heaters and axes that G-code commands, and a gateway with the page."""
    if "page.js" not in House.programs:
        raise Skip("the page was not built (npm was missing)")
    common = {"sensor": "thermistor", "max-age-ms": 2000}
    return machine(
        "--preset", "printer", more=f"[machine]\nkind = pokeys\ndevice = mill\nfolder = {folder}\n[console]\nlevel = user\n",
        heaters={"hotend": {"sensor-pin": 43, "pwm": 0, "max-temperature": 280, **common},
                 "bed": {"sensor-pin": 44, "pwm": 1, "max-temperature": 120, **common}},
        **{"axes": 3, "generator": "external", "pwm-period": 2500000, "heartbeat-timeout-ms": 3000, "digital-outputs": "31, 32",
           **{f"axis.{i}.{key}": value for i, name in enumerate("xyz") for key, value in {**AXIS, "name": name}.items()}})


def button(text):
    """A button of the console by its text or its label."""
    return f"""[...document.querySelectorAll('[aria-label="Console"] button, .top button')].find(
        one => (one.ariaLabel ?? one.innerText).trim() === {json.dumps(text)})"""


async def press(page, text):
    await page.until(text, f"({button(text)}) !== undefined && ({button(text)}).ariaDisabled !== 'true'")
    await page.value(f"{button(text)}.click()")


async def touch(page, text):
    """As a finger does: what stops does not wait for a click."""
    await page.value(f"{button(text)}.dispatchEvent(new PointerEvent('pointerdown', {{ button: 0, bubbles: true }}))")


async def fill(page, selector, text):
    await page.value(f"""(() => {{ const input = document.querySelector({json.dumps(selector)});
        Object.getOwnPropertyDescriptor(Object.getPrototypeOf(input), 'value').set.call(input, {json.dumps(text)});
        input.dispatchEvent(new Event('input', {{ bubbles: true }})); return input.value; }})()""")


async def said(page, text):
    await page.until(text, f"{LOG}.some(line => line.includes({json.dumps(text)}))")


def test_a_machine_is_worked_with():
    async def work(house, gateway, folder):
        def axes():
            return [axis["position"] for axis in house.state()["engine"]["axes"][:3]]

        async with browser() as chromium:
            page = await chromium.open(f"http://127.0.0.1:{gateway.port}/")
            await page.until("the console", "document.querySelector('[aria-label=\"Console\"] form input') !== null")
            line = "[aria-label=\"Console\"] .log + form input"

            async def type_line(text):
                await fill(page, line, text)
                await page.value(f"document.querySelector({json.dumps(line)}).form.requestSubmit()")
            await type_line("M115")
            await said(page, "FIRMWARE_NAME:pokeys-gateway")
            # what was typed comes again
            await page.value(f"document.querySelector({json.dumps(line)}).dispatchEvent("
                             "new KeyboardEvent('keydown', { key: 'ArrowUp', bubbles: true }))")
            await page.until("the line of before", f"document.querySelector({json.dumps(line)}).value === 'M115'")
            # nothing moves or heats before the buttons are unlocked
            await page.until("axes", f"({button('Move X by 1')})?.ariaDisabled === 'true'")
            await page.until("a search", f"({button('Home Z')})?.ariaDisabled === 'true'")
            await press(page, "Unlock the buttons")
            await press(page, "Move X by 1")
            await said(page, "› $J=G91 G21 X1 F1200")
            await asyncio.sleep(0.5)
            equal(await asyncio.to_thread(axes), [200, 0, 0])
            await fill(page, "form.target input", "60")
            await page.until("Set", "document.querySelector('form.target button').ariaDisabled !== 'true'")
            await page.value("document.querySelector('form.target button').click()")
            for _ in range(100):
                if (await asyncio.to_thread(house.state))["heaters"][0]["target"] == 60:
                    break
                await asyncio.sleep(0.1)
            equal((await asyncio.to_thread(house.state))["heaters"][0]["target"], 60)
            shown = "document.querySelector('form.target .number').innerText"
            await page.until("how warm it is, and its target", f"/^\\d+\\.\\d → 60.0 °C$/.test({shown})")
            # a file is sent, and its job is done; its name has no spaces
            await page.value("""(() => { const input = document.querySelector('input[type=file]'), all = new DataTransfer();
                all.items.add(new File(['G90 ; a part\\n\\nG1 X2 Y3 F6000\\n' + 'G1 X2.5\\nG1 X2\\n'.repeat(20)], 'my part.gcode'));
                input.files = all.files; input.dispatchEvent(new Event('change', { bubbles: true })); })()""")
            await said(page, "my_part.gcode was sent")
            equal((pathlib.Path(folder) / "my_part.gcode").read_text(encoding="utf-8").splitlines()[:3],
                  ["G90 ; a part", "", "G1 X2 Y3 F6000"])
            await press(page, "Start my_part.gcode")
            await said(page, "my_part.gcode has ended, 43 lines")
            await asyncio.sleep(0.5)
            equal(await asyncio.to_thread(axes), [400, 600, 0])
            # as long as it is held, and not longer
            await page.value("""(() => { const select = document.querySelector('[aria-label="Console"] select');
                select.value = '0'; select.dispatchEvent(new Event('change', { bubbles: true })); })()""")
            jog = "Jog Z + while it is held"
            await page.until(jog, f"({button(jog)}) !== undefined")
            await touch(page, jog)
            await asyncio.sleep(0.6)
            await page.value("document.dispatchEvent(new PointerEvent('pointerup', { pointerId: 0, bubbles: true }))")
            last = (await asyncio.to_thread(axes))[2]
            assert last > 0, last
            await asyncio.sleep(0.5)
            assert 0 <= (await asyncio.to_thread(axes))[2] - last <= 0.25 * 20 * 200, last
            # an output is switched, and shown as the device has it
            for name in "31 PoExtension 2", "OC1":
                for before, after in ("off", "● on"), ("● on", "off"):
                    await press(page, f"{name}: {before}")
                    await page.until(after, f"({button(f'{name}: {after}')}) !== undefined")
            # a macro is kept by the browser
            await press(page, "Edit")
            await fill(page, "form.macro input", "Park")
            await fill(page, "form.macro textarea", "G90\nG1 X0 Y0 F6000\n")
            await press(page, "Save")
            await press(page, "Park")
            await said(page, "› G1 X0 Y0 F6000")
            async for size in page.sizes(PICTURES, "console-"):
                equal(await page.value(CONTRAST), [], size)
            equal([role for role, text in await page.tree() if role in NAMED and not text], [])
            # an emergency stop is for all, and the page says what to do
            await touch(page, "Emergency stop of mill")
            await page.until("stopped", "document.querySelector('[aria-label=\"Console\"]').innerText.includes('stopped by M112')")
            equal((await asyncio.to_thread(house.state))["heaters"][0]["target"], 0)
            await press(page, "Permit commands again (M999)")
            await page.until("permitted", "!document.querySelector('[aria-label=\"Console\"]').innerText.includes('stopped by M112')")
            await touch(page, "■ Stop mill")
            await said(page, "[stop by page")
            await page.call("Page.reload")
            await page.until("the macro", f"({button('Park')}) !== undefined")
            equal(page.complaints, [])
    with tempfile.TemporaryDirectory() as folder, printer(folder) as (house, _sim, _daemon, gateway):
        asyncio.run(asyncio.wait_for(work(house, gateway, folder), 300))


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
