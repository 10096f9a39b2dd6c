#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""ESP3D-WEBUI 3.0, unmodified, in a browser: it connects, shows what the printer says, sends, lists, uploads and stops.

The page is third-party software and not a part of this project. POKEYS_ESP3D_WEBUI names its index.html.gz (of
dist/Printer3D/Marlin in the branch 3.0 of github.com/luc-github/ESP3D-WEBUI); without it, this is skipped.
"""
import asyncio
import os
import pathlib
import shutil
import sys

from bridge import PAGES, bridge
from browser import browser
from house import Skip, main

# Preact takes the value of an input from its own event
TYPE = """(() => {
    const input = [...document.querySelectorAll('input')].find(one => one.placeholder === 'Enter command');
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set.call(input, 'M105');
    input.dispatchEvent(new Event('input', {bubbles: true}));
    return true;
})()"""
PRESS = "[...document.querySelectorAll('button')].find(one => one.innerText.trim() === '%s').click()"
SAYS = "(document.body?.innerText ?? '').includes(%r)"


async def used(house, gateway, printer):
    part = house.folder / "part.gcode"
    part.write_text(2000 * "G1 X10 Y10\n", encoding="ascii")
    async with browser() as found:
        address = f"http://{house.console}:{PAGES}/"
        page = await found.open(address)
        await page.size(1280, 900)
        await page.until("it is connected, and lists the files", SAYS % "index.html.gz")
        await page.until("the terminal", TYPE)
        await page.value(PRESS % "Send")
        await page.until("the answer", SAYS % "ok T:21.3 /0.0")
        assert printer.lines == [b"M105"]
        printer.say(b"echo: hello from the printer\n")
        await page.until("what the printer says", SAYS % "hello from the printer")
        root = (await page.call("DOM.getDocument"))["root"]["nodeId"]
        chooser = (await page.call("DOM.querySelector", nodeId=root, selector="input[type=file]"))["nodeId"]
        await page.call("DOM.setFileInputFiles", nodeId=chooser, files=[str(part)])
        await page.until("it asks", SAYS % "Do you want to upload")
        await page.value(PRESS % "Yes")
        await page.until("it is uploaded", SAYS % "part.gcode uploaded")
        assert (house.folder / "files/part.gcode").read_bytes() == part.read_bytes()
        # another browser does not end this one
        other = await found.open(address)
        await other.until("it is connected", SAYS % "part.gcode")
        await page.value(PRESS % "Quick Stop")
        await asyncio.to_thread(gateway.wait, "it stops", lambda: b"M112" in printer.lines)
        if folder := os.environ.get("POKEYS_SCREENSHOTS"):
            await page.picture(pathlib.Path(folder, "esp3d-webui.png"))
        await page.until("it is still connected", SAYS % "hello from the printer")


def test_esp3d_webui():
    file = os.environ.get("POKEYS_ESP3D_WEBUI")
    if not file:
        raise Skip("POKEYS_ESP3D_WEBUI does not name index.html.gz of ESP3D-WEBUI 3.0")
    with bridge(level="admin") as (house, gateway, printer):
        shutil.copy(file, house.folder / "files/index.html.gz")
        asyncio.run(used(house, gateway, printer))


if __name__ == "__main__":
    sys.exit(main(sys.modules[__name__]))
