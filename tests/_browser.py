"""Headless Chromium for tests of pages, driven through chromedriver's W3C WebDriver endpoint with the standard library.

Nothing that the browser asks for can leave the machine: every host name but this machine's fails to resolve.
"""

from __future__ import annotations

import base64
import http.client
import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-dev-shm-usage", "--hide-scrollbars",
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1 , EXCLUDE localhost",
)  # fmt: skip
PATIENCE = 60.0
"""Longest time for an answer of the driver, and for a condition of a page [s]."""
ELSEWHERE = re.compile(r"^(?!data:|blob:|about:|chrome:)")


def chromium() -> tuple[str, str] | None:
    """Paths of Chromium and its driver; None where one is missing."""
    browser = next((p for n in ("chromium", "chromium-browser", "google-chrome") if (p := shutil.which(n))), None)
    driver = shutil.which("chromedriver")
    return (browser, driver) if browser and driver else None


OVERLAPPING = """
    (() => {
        const words = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), seen = [];
        while (words.nextNode()) {
            const node = words.currentNode;
            if (!node.data.trim() || node.parentElement.closest("script, style, noscript")) continue;
            const range = document.createRange();
            range.selectNodeContents(node);
            for (const r of range.getClientRects()) if (r.width > 1 && r.height > 1) seen.push([r, node]);
        }
        const found = [];
        seen.forEach(([a, one], i) => seen.slice(i + 1).forEach(([b, other]) => {
            const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
            const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
            if (one !== other && across > 1 && down > 0.4 * Math.min(a.height, b.height)) {
                found.push(one.data.trim() + " | " + other.data.trim());
            }
        }));
        return found;
    })()
"""
"""Pairs of texts of a page that lie over each other."""


A4_WIDTH = 703
"""Pixels between the margins of an A4 page: (210 - 24) mm at 96 to the inch."""

DRAWN_OUT = "!window.Bokeh || Bokeh.documents.every((one) => one.is_idle)"
"""Whether every drawing of a page is there; also where it has none."""

BEYOND = """
    (() => {
        const cut = (e) => ["auto", "scroll", "hidden"].includes(getComputedStyle(e).overflowX)
            && e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 1;
        const found = [...document.querySelectorAll("body, body *")].filter(
            (e) => e.getBoundingClientRect().right > innerWidth + 1 || cut(e));
        return found.slice(0, 5).map((e) => e.tagName + "." + e.className + " " + e.textContent.trim().slice(0, 40));
    })()
"""
"""Parts of a page that reach beyond its right side, or hide a part of themselves."""


class Browser:
    """One browser with one page. Use as a context manager; starting it raises RuntimeError with the driver's words."""

    def __init__(
        self, programs: tuple[str, str], size: tuple[int, int] = (1280, 900), flags: tuple[str, ...] = ()
    ) -> None:
        self._browser, driver = programs
        self._profile = tempfile.TemporaryDirectory(prefix="page-test-", ignore_cleanup_errors=True)
        self._process = subprocess.Popen(
            [driver, "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL,
            text=True, start_new_session=True,
        )  # fmt: skip
        try:
            self._port = self._announced_port()
            self._session = self._start(size, flags)
        except BaseException:
            self._stop()
            raise

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self._call("DELETE", "")
        finally:
            self._stop()

    def open(self, page: Path | str) -> None:
        """Open a file or an address and wait until it is loaded."""
        self._call("POST", "/url", {"url": page.resolve().as_uri() if isinstance(page, Path) else page})

    def run(self, script: str, *arguments: Any) -> Any:
        """The value that a function body of JavaScript returns; `arguments` are its ``arguments``."""
        return self._call("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def wait(self, condition: str) -> None:
        """Wait until a JavaScript expression is true. Raises TimeoutError naming it."""
        script = f"""
            const done = arguments[0], last = performance.now() + {1000 * (PATIENCE - 10)};
            const look = () => {{
                let ok = false;
                try {{ ok = Boolean({condition}); }} catch (error) {{ ok = false; }}
                if (ok || performance.now() > last) done(ok); else setTimeout(look, 20);
            }};
            look();"""
        if not self._call("POST", "/execute/async", {"script": script, "args": []}):
            raise TimeoutError(f"the page did not come to {condition}")

    def resize(self, width: int, height: int) -> None:
        """Set the size of the window in pixels; a page may be narrower than a window with a frame can be."""
        self.devtools(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )

    def overlapping(self) -> list[str]:
        """Pairs of texts that lie over each other; letters inside of drawings do not count."""
        return list(self.run(f"return {OVERLAPPING.strip()};"))

    def devtools(self, command: str, **parameters: Any) -> Any:
        """Send a command of the DevTools protocol."""
        return self._call("POST", "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def screenshot(self, path: Path, *, whole: bool = False) -> None:
        """Write a PNG picture of what is in view, or of the whole page."""
        answer = self.devtools("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(answer["data"]))

    def printed(self) -> bytes:
        """The page printed on A4, as PDF."""
        return base64.b64decode(self._call("POST", "/print", {"page": {"width": 21.0, "height": 29.7}}))

    def lost_on_a4(self, page: Path | str) -> list[str]:
        """What a page loses when it is printed on A4: parts that reach beyond its right side, and words on words."""
        self.resize(A4_WIDTH, 1000)
        self.devtools("Emulation.setEmulatedMedia", media="print")
        try:
            self.open(page)
            for _ in range(2):  # printing opens what is folded
                self.wait(f"document.readyState == 'complete' && ({DRAWN_OUT})")
                self.run("for (const block of document.querySelectorAll('details')) block.open = true;")
            found = self.overlapping()
            for what in self.run(f"return {BEYOND.strip()};"):
                found.append(f"beyond the right side: {what}")
        finally:
            self.devtools("Emulation.setEmulatedMedia", media="")
        return found if self.printed().startswith(b"%PDF") else [*found, "it is not printed"]

    def console(self) -> list[str]:
        """Errors and warnings on the console since it was last asked for."""
        entries = self._call("POST", "/se/log", {"type": "browser"})
        return [f"{e['level']}: {e['message']}" for e in entries if e["level"] in ("SEVERE", "WARNING")]

    def requests(self) -> list[str]:
        """Every address that was asked for since this was last asked for, embedded data and blank pages left out."""
        events = [json.loads(e["message"])["message"] for e in self._call("POST", "/se/log", {"type": "performance"})]
        asked = [e["params"]["request"]["url"] for e in events if e["method"] == "Network.requestWillBeSent"]
        return [address for address in asked if ELSEWHERE.match(address)]

    def _announced_port(self) -> int:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            found = re.search(r"started successfully on port (\d+)", line)
            if found:
                return int(found[1])
        raise RuntimeError("chromedriver ended before it said on which port it listens")

    def _start(self, size: tuple[int, int], flags: tuple[str, ...]) -> str:
        options = {
            "binary": self._browser,
            "args": [*FLAGS, f"--user-data-dir={self._profile.name}", f"--window-size={size[0]},{size[1]}", *flags],
        }
        wanted = {
            "browserName": "chrome", "goog:chromeOptions": options,
            "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"},
            "timeouts": {"script": int(1000 * PATIENCE), "pageLoad": int(1000 * PATIENCE)},
        }  # fmt: skip
        self._session = ""
        return str(self._call("POST", "", {"capabilities": {"alwaysMatch": wanted}})["sessionId"])

    def _call(self, method: str, path: str, body: dict[str, Any] | None = None) -> Any:
        """One command; its value. Raises RuntimeError with the driver's words."""
        connection = http.client.HTTPConnection("127.0.0.1", self._port, timeout=PATIENCE + 30)
        try:
            text = json.dumps(body) if body is not None else None
            base = f"/session/{self._session}" if self._session else "/session"
            connection.request(method, base + path, text, {"Content-Type": "application/json"})
            value = json.loads(connection.getresponse().read())["value"]
        finally:
            connection.close()
        if isinstance(value, dict) and "error" in value:
            raise RuntimeError(f"{value['error']}: {value.get('message', '').splitlines()[0]}")
        return value

    def _stop(self) -> None:
        """End the driver and the browser it started: they are one process group of their own."""
        if self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGTERM)
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._profile.cleanup()


def is_this_machine(address: str) -> bool:
    """Whether an address is a file or a server on this machine."""
    parts = urlsplit(address)
    return parts.scheme == "file" or parts.hostname in ("127.0.0.1", "localhost")
