#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The gateway's page operates LinuxCNC, in Debian's Chromium: buttons that are locked, keys that are held, and a stop.

With POKEYS_SCREENSHOTS=FOLDER, pictures are left there to be looked at.
"""
import asyncio
import os
import pathlib
import signal
import sys

import rig

sys.path[1:1] = [str(rig.ROOT / "tests/system"), str(rig.ROOT / "tests/gateway")]
# pylint: disable=wrong-import-position
from browser import CONTRAST, NAMED, SIZES, browser  # noqa: E402
from gateway import PORT, Gateway  # noqa: E402
from house import Skip  # noqa: E402
from linuxcncrig import LinuxCNC, position, stands, switch_on  # noqa: E402

PICTURES = os.environ.get("POKEYS_SCREENSHOTS")
CNC = "document.querySelector('.cnc')"


def button(text, within=CNC):
    """A button by its text or label, in the page."""
    return (f"[...{within}.querySelectorAll('button')].find(one => one.textContent === {text!r} || "
            f"one.ariaLabel === {text!r})")


class Panel:
    """The page, and somebody's hand."""

    def __init__(self, page):
        self.page = page

    async def click(self, text, within=CNC):
        await self.page.until(text, f"{button(text, within)} !== undefined")
        await self.page.value(f"{button(text, within)}.click()")

    async def point(self, event, text):
        """A finger."""
        await self.page.value(f"""{button(text)}.dispatchEvent(new PointerEvent('{event}', {{
            bubbles: true, button: 0, pointerId: 1, isPrimary: true, pointerType: 'touch' }}))""")

    async def key(self, event, text, repeat=False):
        await self.page.value(f"""{button(text)}.dispatchEvent(new KeyboardEvent('{event}', {{
            bubbles: true, key: ' ', repeat: {str(repeat).lower()} }}))""")

    async def says(self, text):
        await self.page.until(text, f"{CNC}.innerText.includes({text!r})")

    async def move(self, test):
        await asyncio.to_thread(rig.wait, "it moves", test)


async def log_in(page):
    await page.until("the form", "document.querySelector('form.login') !== null")
    await page.value("""(() => { const form = document.querySelector('form'); form.elements.name.value = 'ulla';
        form.elements.password.value = 'secret, and long'; form.requestSubmit(); })()""")
    await page.until("LinuxCNC", f"{CNC} !== null")


async def pictures(page, name):
    for size, (width, height) in SIZES.items():
        for dark in False, True:
            await page.size(width, height, dark, phone=size == "phone")
            await asyncio.sleep(0.3)
            over = await page.value("[document.scrollingElement.scrollWidth, document.scrollingElement.clientWidth]")
            assert over[0] <= over[1], (size, over)
            bad = await page.value(CONTRAST)
            assert not bad, (size, dark, bad)
            if PICTURES:
                await page.picture(pathlib.Path(PICTURES) / f"cnc-{name}-{size}-{'dark' if dark else 'light'}.png")
    nameless = [role for role, text in await page.tree() if role in NAMED and not text]
    assert not nameless, nameless
    await page.size(*SIZES["desktop"])


async def operates(machine, gateway):
    async with browser() as chromium:
        page = await chromium.open(f"http://127.0.0.1:{PORT}/")
        panel = Panel(page)
        await log_in(page)
        await panel.says("emergency stop")
        screen = machine.control()
        screen.asked("subscribe")
        await asyncio.to_thread(switch_on, screen)
        await panel.says("not homed")
        # nothing is done as long as the buttons are locked
        await panel.click("Home all")
        await panel.point("pointerdown", "Jog 0 + while it is held")
        await asyncio.sleep(0.5)
        assert not any(screen.until(lambda seen: "homed" in seen)["homed"]) and position(0) == 0
        await panel.point("pointerup", "Jog 0 + while it is held")
        await panel.click("Unlock the buttons")
        await panel.click("Home joint 0")
        seen = await asyncio.to_thread(screen.until, lambda seen: any(seen.get("homed", ())))
        assert seen["homed"][0] and not all(seen["homed"]), seen
        await panel.click("Home all")
        await page.until("homed", f"!{CNC}.innerText.includes('not homed')")
        await pictures(page, "manual")
        # a finger, and the space bar
        for begin, end, repeated in (("pointerdown", "pointerup", None), ("keydown", "keyup", "keydown")):
            jog = "Jog X + while it is held"
            there = position(0)
            act = panel.key if repeated else panel.point
            await page.until("the axes", f"{button(jog)} !== undefined")
            await act(begin, jog)
            if repeated:
                await panel.key(repeated, jog, repeat=True)
            await panel.move(lambda there=there: position(0) > there + 3)
            await act(end, jog)
            await asyncio.to_thread(stands, 0)
        # the finger stays, and the buttons are locked, or somebody else stops
        jog = "Jog X − while it is held"
        for act in (panel.click("Lock the buttons"), asyncio.to_thread(screen.asked, "stop")):
            there = position(0)
            await panel.point("pointerdown", jog)
            await panel.move(lambda there=there: position(0) < there - 2)
            await act
            there = await asyncio.to_thread(stands, 0)
            await asyncio.sleep(0.5)
            assert position(0) == there
            await panel.point("pointerup", jog)
            if await page.value(f"{button('Unlock the buttons')} !== undefined"):
                await panel.click("Unlock the buttons")
        # a finger elsewhere, of a hand that holds nothing, changes nothing; that of another button ends the jog
        await panel.point("pointerdown", jog)
        await page.value("document.body.dispatchEvent(new PointerEvent('pointerup', { bubbles: true, pointerId: 2 }))")
        there = position(0)
        await panel.move(lambda: position(0) < there - 2)
        await page.value("document.body.dispatchEvent(new PointerEvent('pointerup', { bubbles: true, pointerId: 1 }))")
        await asyncio.to_thread(stands, 0)
        # an override is where the finger has it, until it is up
        slider = f"{CNC}.querySelector('.overrides input')"
        assert await page.value(f"{slider}.max") == "150"
        await page.value(f"{slider}.value = 30; {slider}.dispatchEvent(new Event('input', {{ bubbles: true }}))")
        await asyncio.sleep(0.5)
        assert await page.value(f"{slider}.value") == "30"
        assert screen.asked("jog", axis="x", speed=0, press=0) is None and screen.until(lambda seen: True)["feed_override"] == 1
        await page.value(f"{slider}.dispatchEvent(new Event('change', {{ bubbles: true }}))")
        await asyncio.to_thread(screen.until, lambda seen: seen["feed_override"] == 0.3)
        await panel.says("30 %")
        await page.value(f"{slider}.value = 100; {slider}.dispatchEvent(new Event('change', {{ bubbles: true }}))")
        await asyncio.to_thread(screen.until, lambda seen: seen["feed_override"] == 1)
        # the finger stays, and the page goes
        await panel.point("pointerdown", "Jog Y − while it is held")
        await panel.move(lambda: position(1) < -2)
        await page.call("Page.navigate", url="about:blank")
        await asyncio.to_thread(stands, 1)
        await page.call("Page.navigate", url=f"http://127.0.0.1:{PORT}/")
        await page.until("LinuxCNC", f"{CNC}?.innerText.includes('MDI')")
        await panel.click("Unlock the buttons")
        await panel.click("MDI")
        await page.until("the line", f"{CNC}.querySelector('form input') !== null")
        await page.value(f"""(() => {{ const input = {CNC}.querySelector('form input'); input.value = 'G1 X90 F300';
            input.dispatchEvent(new Event('input', {{ bubbles: true }})); }})()""")
        await pictures(page, "mdi")
        there = position(0)
        await page.value(f"{CNC}.querySelector('form').requestSubmit()")
        await panel.move(lambda: position(0) > there + 0.5)
        await panel.says("moving")
        # to stop needs no unlocking
        await panel.click("Lock the buttons")
        stop = button("■ Stop", "document.querySelector('.top')")
        # while another finger is down, there is no click
        await page.value(f"{stop}.dispatchEvent(new PointerEvent('pointerdown', {{ bubbles: true, button: 0 }}))")
        await page.value(f"{stop}.dispatchEvent(new MouseEvent('click', {{ bubbles: true, detail: 1 }}))")
        assert await asyncio.to_thread(stands, 0) < 80
        await panel.says("standing")
        assert await page.value(f"[...{CNC}.querySelectorAll('.events li')].map(one => one.innerText).filter("
                                "one => /^Stop at .*: done\\.$/.test(one)).length") == 1
        # what goes wrong is said
        await panel.click("Unlock the buttons")
        await page.value(f"""(() => {{ const input = {CNC}.querySelector('form input'); input.value = 'G987';
            input.dispatchEvent(new Event('input', {{ bubbles: true }})); }})()""")
        await page.value(f"{CNC}.querySelector('form').requestSubmit()")
        await panel.says("⚠ G-code out of range")
        await panel.click("Automatic")
        await panel.says("No programme is loaded.")
        await pictures(page, "auto")
        os.kill(rig.listed()["pokeys-remote"], signal.SIGSTOP)
        await panel.click("Manual")
        await panel.says("⚠ pokeys-remote does not answer")
        os.kill(rig.listed()["pokeys-remote"], signal.SIGCONT)
        await panel.click("Emergency stop")
        await panel.says("⚠ emergency stop")
        # a gateway that does not answer stops nothing, and the button says so
        os.kill(gateway.child.pid, signal.SIGSTOP)
        await page.until("the button", f"{button('■ Stop: no connection', 'document')} !== undefined")
        os.kill(gateway.child.pid, signal.SIGCONT)
        await page.until("the button", f"{button('■ Stop', 'document')} !== undefined")
        faults = [one for one in page.complaints if "401" not in str(one)]
        assert not faults, faults


def the_page_operates(machine):
    gateway = Gateway(machine)
    try:
        asyncio.run(asyncio.wait_for(operates(machine, gateway), 300))
    except Skip as skip:
        print(f"skipped: {skip}")
        sys.exit(77)
    finally:
        gateway.close()


if __name__ == "__main__":
    rig.main([the_page_operates], LinuxCNC)
