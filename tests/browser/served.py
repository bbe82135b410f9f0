"""Opens a served page in a real browser."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from playwright.sync_api import Browser
from playwright.sync_api import Page as Tab
from waiting import wait_until

from tussle.view.page.server import Page

# What drawing without a graphics card says of itself.
HARMLESS = ("GPU stall due to ReadPixels", "Software WebGL")
SMALL = {"width": 820, "height": 520}
UNHURRIED = {"gui_update_period": "200"}
"""Time between frames [ms]: a browser without a graphics card draws no faster."""
UNMEASURED = "window.WebGL2RenderingContext && (WebGL2RenderingContext.prototype.readPixels = () => {});"
"""Lets the page not wait for what it draws when it measures whether 3D is slow: other programs of the machine do not change tests."""
READY = "Boolean(window.player && player.isReady)"


class Watched:
    """A tab with the page of a game, which remembers all that went wrong.

    Args:
        browser: The browser.
        page: The page that is served.
        size: Of the window.
        url: Address that is opened; by default that of who may do everything.
    """

    def __init__(
        self, browser: Browser, page: Page, size: dict[str, int] | None = None, url: str = ""
    ) -> None:
        self.page = page
        self.trouble: list[str] = []
        self.tab: Tab = browser.new_page(viewport=size or SMALL, reduced_motion="reduce")
        self.tab.set_default_timeout(90_000)
        self.tab.add_init_script(UNMEASURED)
        self._listen(url or page.url)
        self.tab.goto(url or page.url)
        self.wait(READY)

    def _listen(self, url: str) -> None:
        tab = self.tab

        def hear(message) -> None:
            if message.type in ("error", "warning") and not any(text in message.text for text in HARMLESS):
                self.trouble.append(f"console {message.type}: {message.text[:300]}")

        def look(address: str) -> None:
            if not address.startswith((url, url.replace("http", "ws"), "data:", "blob:")):
                self.trouble.append(f"request: {address[:200]}")

        tab.on("console", hear)
        tab.on("pageerror", lambda error: self.trouble.append(f"error: {error}"))
        tab.on("request", lambda request: look(request.url))
        tab.on("websocket", lambda socket: look(socket.url))
        tab.on("requestfailed", lambda request: self.trouble.append(f"failed: {request.url[:200]}"))

    def wait(self, expression: str) -> object:
        """The value of an expression of the page as soon as it is true."""
        assert self.page.error is None, self.page.error
        return wait_until(self.tab, expression, 90.0)

    def until(self, condition):
        """Wait until a condition of the game holds, while the browser goes on."""
        for _ in range(3000):
            if given := condition():
                return given
            self.tab.wait_for_timeout(30)
        raise AssertionError("it does not come")

    def button(self, name: str) -> None:
        """Press a button of the page."""
        self.tab.get_by_role("button", name=name, exact=True).first.click()

    def press(self, key: str) -> None:
        """Press a key of the keyboard, which nobody is typing into a field with."""
        self.tab.evaluate("() => document.activeElement && document.activeElement.blur()")
        self.tab.keyboard.press(key)

    def choose(self, who: int) -> None:
        """Choose an entity by a click on it; click again if it has moved on before the click came."""

        def is_chosen() -> bool:
            if self.tab.evaluate("() => player.chosen") == who:
                return True
            if pixel := self.tab.evaluate(f"() => player.isDrawn && player.pixelOf({who})"):
                self.tab.mouse.click(*pixel)
            return False

        self.until(is_chosen)

    def close(self) -> None:
        self.tab.close()


def another_browser(browser: Browser, flag: str) -> Browser:
    """One of the same kind in processes of its own, that can be told by a flag."""
    import needs  # pictures.py has no tests on its path

    options = ("--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader", flag)
    return browser.browser_type.launch(executable_path=needs.program(*needs.BROWSERS), args=list(options))


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
