"""A headless Chromium, driven over its DevTools protocol; $YGSLAM_CHROMIUM names the program, else one on the path."""
import asyncio
import base64
import json
import os
import shutil
import subprocess
import tempfile

import websockets

CHROMIUM = os.environ.get("YGSLAM_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
PATIENCE_S = 120  # far beyond anything a loaded machine needs


class Browser:
    """One page. `async with Browser() as page`."""

    def __init__(self, width=1400, height=900, dark=False):
        self.size, self.dark = (width, height), dark
        self.calls, self.complaints = 0, []

    async def __aenter__(self):
        self.folder = tempfile.TemporaryDirectory()
        self.process = subprocess.Popen(
            [CHROMIUM, "--headless=new", "--no-sandbox", "--remote-debugging-port=0", "--no-first-run",
             "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage",
             f"--user-data-dir={self.folder.name}", "about:blank"],
            stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        address = None
        for line in self.process.stderr:
            if "DevTools listening on" in line:
                address = line.split()[-1]
                break
        assert address, "the browser did not start"
        self.drain = asyncio.create_task(asyncio.to_thread(self.process.stderr.read))
        self.connection = await websockets.connect(address, max_size=None)
        target = (await self.send("Target.createTarget", url="about:blank"))["targetId"]
        self.session = None
        self.session = (await self.send("Target.attachToTarget", targetId=target, flatten=True))["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            await self.send(f"{domain}.enable")
        await self.resize(*self.size)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if self.dark else "light"}
        await self.send("Emulation.setEmulatedMedia", features=[scheme])
        return self

    async def __aexit__(self, *_):
        await self.connection.close()
        self.process.terminate()
        self.process.wait(PATIENCE_S)
        await self.drain
        self.process.stderr.close()
        self.folder.cleanup()

    session = None

    async def send(self, method, **parameters):
        self.calls += 1
        number = self.calls
        message = {"id": number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        await self.connection.send(json.dumps(message))
        while True:
            said = json.loads(await asyncio.wait_for(self.connection.recv(), PATIENCE_S))
            if said.get("method") == "Runtime.exceptionThrown":
                self.complaints.append(said["params"]["exceptionDetails"])
            elif said.get("method") == "Log.entryAdded" and said["params"]["entry"]["level"] == "error":
                self.complaints.append(said["params"]["entry"]["text"])
            if said.get("id") == number:
                assert "error" not in said, said
                return said["result"]

    async def resize(self, width, height):
        await self.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
                        mobile=width < 800)

    async def open(self, url):
        await self.send("Page.navigate", url=url)

    async def value(self, expression):
        done = await self.send("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in done, done["exceptionDetails"]
        return done["result"].get("value")

    async def until(self, expression):
        """Waits until it is true. @return its value."""
        for _ in range(10 * PATIENCE_S):
            if found := await self.value(f"(() => {{ try {{ return {expression} }} catch {{ return null }} }})()"):
                return found
            await asyncio.sleep(0.1)
        raise AssertionError(f"never true: {expression}")

    async def choose(self, selector, value):
        await self.value(f"""(() => {{ const e = document.querySelector('{selector}'); e.value = '{value}';
            e.dispatchEvent(new Event('change')); }})()""")

    async def click(self, selector):
        x, y = await self.value(f"""(() => {{ const r = document.querySelector('{selector}').getBoundingClientRect();
            return [r.x + r.width / 2, r.y + r.height / 2]; }})()""")
        for kind in ("mousePressed", "mouseReleased"):
            await self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    async def press(self, key):
        """A key, as KeyboardEvent.key names it."""
        for kind in ("keyDown", "keyUp"):
            await self.send("Input.dispatchKeyEvent", type=kind, key=key)

    async def picture(self, file=None):
        """PNG of what is in view."""
        data = base64.b64decode((await self.send("Page.captureScreenshot", format="png"))["data"])
        if file:
            with open(file, "wb") as out:
                out.write(data)
        return data
