# SPDX-License-Identifier: GPL-2.0-or-later
"""Debian's Chromium without a window, driven over the DevTools protocol."""
import asyncio
import base64
import contextlib
import json
import pathlib
import shutil
import subprocess
import tempfile

from house import PATIENCE, Skip

try:
    import websockets
except ImportError:
    websockets = None

PROGRAM = "chromium"
SIZES = {"phone": (360, 740), "tablet": (820, 1180), "desktop": (1440, 900), "wall": (3840, 2160)}
# names of elements that a hand or a screen reader gets to
NAMED = "button", "link", "textbox", "heading", "img", "group", "region", "article", "table", "DisclosureTriangle"
# texts that differ too little from what is behind them (WCAG 2: 4.5), in the page
CONTRAST = """(() => {
    const numbers = colour => colour.match(/[\\d.]+/g).map(Number);
    const light = ([r, g, b]) => { const [x, y, z] = [r, g, b].map(c => c / 255).map(
        c => c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4); return 0.2126 * x + 0.7152 * y + 0.0722 * z; };
    const behind = element => { for (let at = element; at; at = at.parentElement) {
        const colour = numbers(getComputedStyle(at).backgroundColor); if ((colour[3] ?? 1) > 0) return colour; }
        return [255, 255, 255]; };
    const bad = [];
    for (const element of document.querySelectorAll('body *')) {
        if (![...element.childNodes].some(node => node.nodeType === 3 && node.data.trim())) continue;
        if (element.closest('svg, script, style, noscript')) continue;
        for (let at = element; at; at = at.parentElement)
            if (getComputedStyle(at).opacity !== '1') bad.push(['opacity', at.className]);
        const [a, b] = [light(numbers(getComputedStyle(element).color)), light(behind(element))].sort((x, y) => y - x);
        if ((a + 0.05) / (b + 0.05) < 4.5) bad.push([element.className, element.textContent, (a + 0.05) / (b + 0.05)]);
    }
    return bad.slice(0, 5);
})()"""


class Page:
    """A tab: what it shows, and what it complains about."""

    def __init__(self, browser, session):
        self.browser, self.session = browser, session
        self.complaints = []

    async def call(self, method, **parameters):
        return await self.browser.call(method, self.session, **parameters)

    async def value(self, expression):
        """What an expression is in the page; a promise is waited for."""
        found = await self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    async def text(self):
        return await self.value("document.body.innerText")

    async def until(self, what, expression):
        """Wait until an expression is true in the page."""
        end_at = asyncio.get_running_loop().time() + PATIENCE
        while not (found := await self.value(expression)):
            assert asyncio.get_running_loop().time() < end_at, (what, found, await self.text(), self.complaints)
            await asyncio.sleep(0.05)
        return found

    async def size(self, width, height, dark=False, phone=False):
        await self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, mobile=phone,
                        deviceScaleFactor=1)
        await self.call("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    async def picture(self, path):
        """A picture of the whole page."""
        shot = await self.call("Page.captureScreenshot", captureBeyondViewport=True)
        pathlib.Path(path).write_bytes(base64.b64decode(shot["data"]))

    async def sizes(self, pictures, name):
        """In each size, light and dark: nothing is wider than the window. Pictures are left in a folder, if there is one."""
        for size, (width, height) in SIZES.items():
            for dark in False, True:
                await self.size(width, height, dark, phone=size == "phone")
                await asyncio.sleep(0.7)
                over = await self.value("[document.scrollingElement.scrollWidth, document.scrollingElement.clientWidth]")
                assert over[0] <= over[1], (size, over)
                if pictures:
                    await self.picture(pathlib.Path(pictures) / f"{name}{size}-{'dark' if dark else 'light'}.png")
                yield f"{size}, dark: {dark}"

    async def tree(self):
        """Role and name of all that a screen reader gets."""
        nodes = (await self.call("Accessibility.getFullAXTree"))["nodes"]
        return [(node["role"]["value"], node.get("name", {}).get("value", "")) for node in nodes
                if not node.get("ignored") and "role" in node]


class Browser:
    """One Chromium. Use :func:`browser`."""

    def __init__(self, ws):
        self.ws, self.number, self.waiting, self.pages = ws, 0, {}, {}

    async def call(self, method, session=None, **parameters):
        self.number += 1
        done = self.waiting[self.number] = asyncio.get_running_loop().create_future()
        await self.ws.send(json.dumps({"id": self.number, "method": method, "params": parameters,
                                       **({"sessionId": session} if session else {})}))
        return await asyncio.wait_for(done, PATIENCE)

    async def listen(self):
        async for text in self.ws:
            message = json.loads(text)
            if done := self.waiting.pop(message.get("id"), None):
                if "error" in message:
                    done.set_exception(AssertionError(message["error"]))
                elif not done.done():
                    done.set_result(message["result"])
            elif page := self.pages.get(message.get("sessionId")):
                self.note(page, message["method"], message["params"])

    @staticmethod
    def note(page, method, found):
        """What a person would see in red in the console."""
        if method == "Runtime.exceptionThrown":
            page.complaints.append(found["exceptionDetails"])
        elif method == "Log.entryAdded" and found["entry"]["level"] == "error":
            page.complaints.append(found["entry"])
        elif method == "Runtime.consoleAPICalled" and found["type"] in ("error", "warning", "assert"):
            page.complaints.append(found["args"])

    async def open(self, address):
        target = (await self.call("Target.createTarget", url="about:blank"))["targetId"]
        session = (await self.call("Target.attachToTarget", targetId=target, flatten=True))["sessionId"]
        page = self.pages[session] = Page(self, session)
        for domain in "Page", "Runtime", "Log", "Accessibility":
            await page.call(f"{domain}.enable")
        await page.call("Page.navigate", url=address)
        return page


@contextlib.asynccontextmanager
async def browser():
    """A Chromium with a profile of its own."""
    if not websockets or not shutil.which(PROGRAM):
        raise Skip("chromium or python3-websockets is not installed")
    with tempfile.TemporaryDirectory(prefix="pokeysd-test-") as profile:
        child = await asyncio.create_subprocess_exec(
            PROGRAM, "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
            "--disable-background-networking", "--disable-component-update", f"--user-data-dir={profile}",
            "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.*", "--remote-debugging-port=0", "about:blank",
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        try:
            while line := (await asyncio.wait_for(child.stderr.readline(), PATIENCE)).decode(errors="replace"):
                if line.startswith("DevTools listening on "):
                    break
            assert line, "Chromium has ended"
            drain = asyncio.create_task(child.stderr.read())
            async with websockets.connect(line.split()[-1], max_size=None, ping_interval=None) as ws:
                found = Browser(ws)
                listening = asyncio.create_task(found.listen())
                yield found
                with contextlib.suppress(Exception):
                    await found.call("Browser.close")
                listening.cancel()
            await asyncio.wait_for(child.wait(), PATIENCE)
            drain.cancel()
        finally:
            if child.returncode is None:
                child.kill()
                await child.wait()
