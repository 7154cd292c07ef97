"""Headless Chromium by the WebDriver protocol (W3C), with nothing but the standard library."""

import base64
import json
import os
import re
import shutil
import subprocess
import tempfile
import time
import urllib.request
from contextlib import contextmanager
from pathlib import Path

DRIVER, CHROMIUM = shutil.which("chromedriver"), shutil.which("chromium")
MISSING = "" if DRIVER and CHROMIUM else "there is no chromium with its chromedriver here"
_ARGUMENTS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage")
# Charts need none; results are drawn by WebGL, here without a graphics card.
_ARGUMENTS += ("--enable-unsafe-swiftshader",)


class Browser:
    """A browser with one window."""

    def __init__(self, address: str):
        options = {"binary": CHROMIUM, "args": list(_ARGUMENTS)}
        wanted = {"goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
        self._address = address
        answer = self._send("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
        self._session = f"/session/{answer['sessionId']}"

    def _send(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self._address + path, data, method=method)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.load(answer)["value"]

    def _ask(self, command, **body):
        return self._send("POST", f"{self._session}/{command}", body)

    def _tool(self, command, **parameters):
        return self._ask("goog/cdp/execute", cmd=command, params=parameters)

    def open(self, page: Path | str, width=1280, dark=False):
        """Load a page in a window of that width."""
        scheme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self._tool("Emulation.setEmulatedMedia", features=scheme)
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
        self._tool("Emulation.setDeviceMetricsOverride", **size)
        self._ask("url", url=page if isinstance(page, str) else page.resolve().as_uri())

    def run(self, script, *arguments):
        """What a piece of JavaScript returns."""
        return self._ask("execute/sync", script=f"return {script}", args=list(arguments))

    def wait(self, script, seconds=20):
        """Wait until a piece of JavaScript is true."""
        end = time.monotonic() + seconds
        while not (found := self.run(script)):
            assert time.monotonic() < end, f"never: {script}"
            time.sleep(0.05)
        return found

    def point(self, x, y, press=False):
        """Move the pointer to a place in the window; press there."""
        for kind in ["mouseMoved", *(["mousePressed", "mouseReleased"] if press else [])]:
            button = {"button": "left", "clickCount": 1} if kind != "mouseMoved" else {}
            self._tool("Input.dispatchMouseEvent", type=kind, x=x, y=y, **button)

    def wheel(self, x, y, ctrl=False):
        """Turn the wheel by a notch towards oneself at a place in the window."""
        turn = {"deltaX": 0, "deltaY": 120, "modifiers": 2 if ctrl else 0}
        self._tool("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, **turn)

    def complaints(self):
        """What the console was told since the last time, without notices."""
        entries = self._ask("se/log", type="browser")
        told = [e["message"] for e in entries if e["level"] in ("SEVERE", "WARNING")]
        # Without a graphics card, reading pixels back is slow, which the driver notes.
        return [line for line in told if "GL Driver Message (OpenGL, Performance" not in line]

    def picture(self, file: Path):
        """The whole page as a PNG file."""
        shot = self._tool("Page.captureScreenshot", captureBeyondViewport=True)
        file.write_bytes(base64.b64decode(shot["data"]))

    def close(self):
        """End the session."""
        self._send("DELETE", self._session)


@contextmanager
def browser():
    """A browser, ended with its driver. All that it writes is in a temporary folder."""
    command = [DRIVER, "--port=0", "--log-level=WARNING"]
    with (
        # Crash handlers of the browser outlive it, and write into the folder for a moment.
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,
        subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"TMPDIR": folder, "HOME": folder, "XDG_CONFIG_HOME": folder},
        ) as driver,
    ):
        try:
            port = next(
                m[1]
                for line in driver.stdout
                if (m := re.search(r"successfully on port (\d+)", line))
            )
            window = Browser(f"http://127.0.0.1:{port}")
            try:
                yield window
            finally:  # else the browser outlives its driver
                window.close()
        finally:
            driver.terminate()
