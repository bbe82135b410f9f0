"""Opens a served page in a real browser, and finds things in its picture."""

from __future__ import annotations

import math
import os
import signal
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser
from playwright.sync_api import Page as Tab

from tussle.view.page.server import Page

# viser's page says these where everything is well: a note to its authors, and what drawing without a graphics card is.
HARMLESS = (
    "THREE.Clock: This module has been deprecated",
    "GPU stall due to ReadPixels",
    "Software WebGL",
    "GL_INVALID_OPERATION: glDrawElementsInstanced",  # of the software renderer; seen once
)
SMALL = {"width": 820, "height": 520}
UNHURRIED = {"gui_update_period": "300"}
"""Time between frames [ms]: each takes a browser without a graphics card about as long, and it looks after the panel in between."""
PATIENCE = 90.0
"""A browser that draws without a graphics card on a busy machine [s]."""


class Watched:
    """A tab with the page of a game, which remembers all that went wrong.

    Args:
        browser: The browser.
        page: The page that is served.
        size: Of the window.
        is_awaited: Wait until the first picture is drawn.
    """

    def __init__(
        self, browser: Browser, page: Page, size: dict[str, int] | None = None, *, is_awaited: bool = True
    ) -> None:
        self.page = page
        self.trouble: list[str] = []
        known = {id(v) for v in page.visitors()}
        self.tab: Tab = browser.new_page(viewport=size or SMALL)
        self.tab.set_default_timeout(1e3 * PATIENCE)
        self._listen()
        self.tab.goto(page.url)
        self.visitor = self.wait(lambda: next((v for v in page.visitors() if id(v) not in known), None))
        self.tab.get_by_text("step ").first.wait_for()
        if is_awaited:
            self.await_drawing()

    def _listen(self) -> None:
        tab, url = self.tab, self.page.url

        def hear(message) -> None:
            if message.type in ("error", "warning") and not any(text in message.text for text in HARMLESS):
                self.trouble.append(f"console {message.type}: {message.text[:300]}")

        def look(address: str) -> None:
            if not address.startswith(
                (url, url.replace("http", "ws"), "data:", f"blob:{url.rpartition('/')[0]}/")
            ):
                self.trouble.append(f"request: {address[:200]}")

        tab.on("console", hear)
        tab.on("pageerror", lambda error: self.trouble.append(f"error: {error}"))
        tab.on("request", lambda request: look(request.url))
        tab.on("websocket", lambda socket: look(socket.url))
        tab.on("requestfailed", lambda request: self.trouble.append(f"failed: {request.url[:200]}"))

    def await_drawing(self) -> None:
        """Wait until the picture is there and the browser has time again: its first takes long without a graphics card."""
        self.tab.evaluate(
            "() => new Promise(done => {"
            "  let n = 0; const count = () => ++n < 10 ? requestAnimationFrame(count) : done(n);"
            "  requestAnimationFrame(count); })"
        )

    def wait(self, condition, timeout: float = PATIENCE):
        """Wait until it holds, while the browser goes on; what it gave."""
        until = time.monotonic() + timeout
        while not (given := condition()):
            assert time.monotonic() < until, "it does not come"
            assert self.page.error is None, self.page.error
            self.tab.wait_for_timeout(30)
        return given

    def button(self, name: str) -> None:
        """Press a button of the panel."""
        self.tab.get_by_role("button", name=name, exact=True).first.click()

    def press(self, key: str) -> None:
        """Press a key of the keyboard, which nobody is typing into a field with."""
        self.tab.evaluate("document.activeElement && document.activeElement.blur()")
        self.tab.keyboard.press(key)

    def reads(self, text: str) -> bool:
        """Whether this stands on the page."""
        return self.tab.get_by_text(text).count() > 0

    def place_of(self, point) -> tuple[float, float]:
        """Where a point of the world [m], (3,), is in the window [pixels]."""
        camera = self.visitor._client.camera
        forward = camera.look_at - camera.position
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        up = np.cross(right, forward)
        seen = np.asarray(point) - camera.position
        scale = 0.5 * camera.image_height / math.tan(0.5 * camera.fov) / (seen @ forward)
        box = self.tab.locator("canvas").first.bounding_box()
        x = box["x"] + box["width"] * (0.5 + scale * (seen @ right) / camera.image_width)
        y = box["y"] + box["height"] * (0.5 - scale * (seen @ up) / camera.image_height)
        return x, y

    def close(self) -> None:
        self.tab.close()


def another_browser(browser: Browser, flag: str) -> Browser:
    """One of the same kind in processes of its own, that can be told by a flag."""
    (running,) = {Path(f"/proc/{pid}/exe").resolve() for pid in family_of("--use-angle=swiftshader")[:1]}
    options = ("--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader", flag)
    return browser.browser_type.launch(executable_path=running, args=list(options))


def family_of(flag: str) -> list[int]:
    """Processes whose command line has a flag, and all that come from them."""
    parents, marked = {}, set()
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                command = (folder / "cmdline").read_bytes().decode(errors="replace")
                parents[int(folder.name)] = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            except (OSError, ValueError):
                continue
            if flag in command.split("\0"):
                marked.add(int(folder.name))
    while grown := {pid for pid, parent in parents.items() if parent in marked} - marked:
        marked |= grown
    return sorted(marked - {os.getpid()})


def send_all(processes: list[int], number: signal.Signals) -> None:
    """Send a signal to each."""
    for process in processes:
        os.kill(process, number)
