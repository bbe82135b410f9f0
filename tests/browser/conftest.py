"""A real browser, which tells of everything that goes wrong on a page."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import needs
import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, Request, sync_playwright
from served import UNMEASURED

# Drawing without a graphics card; and nothing that the browser would ask of the network by itself.
OPTIONS = (
    *(
        "--no-sandbox",
        "--enable-unsafe-swiftshader",
        "--use-angle=swiftshader",
        "--disable-quic",
        "--no-first-run",
    ),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)
NAMELESS = ("about:", "data:", "blob:")


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    """Chromium of the system."""
    needs.require("browser")
    program = needs.program(*needs.BROWSERS)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(OPTIONS))
        yield browser
        browser.close()


@contextmanager
def _watched(chromium: Browser) -> Iterator[Callable[..., Page]]:
    """Opens pages of the browser; at the end, the test fails where one of them complained or asked for anything else.

    Called with the beginning of all addresses that may be asked for, and options of the page.
    """
    trouble: list[str] = []
    pages: list[Page] = []

    def listen(page: Page, allowed: str) -> None:
        def hear(message: ConsoleMessage) -> None:
            if message.type in {"error", "warning"} and "GPU stall" not in message.text:
                trouble.append(f"console {message.type}: {message.text}")

        def look(request: Request) -> None:
            if not request.url.startswith((allowed, *NAMELESS)):
                trouble.append(f"request: {request.url[:200]}")

        page.on("console", hear)
        page.on("pageerror", lambda error: trouble.append(f"error: {error}"))
        page.on("requestfailed", lambda request: trouble.append(f"failed: {request.url[:200]}"))
        page.on("request", look)
        page.on("dialog", lambda dialog: (trouble.append(f"dialog: {dialog.message}"), dialog.dismiss()))

    def new(allowed: str, **options: object) -> Page:
        page = chromium.new_page(**{"viewport": {"width": 900, "height": 650}, **options})
        page.add_init_script(UNMEASURED)
        listen(page, allowed)
        pages.append(page)
        return page

    yield new
    for page in pages:
        page.close()
    assert not trouble, "\n".join(trouble)


@pytest.fixture
def watched(chromium: Browser) -> Iterator[Callable[..., Page]]:
    """Opens pages for one test, see `_watched`."""
    with _watched(chromium) as new:
        yield new


@pytest.fixture(scope="module")
def watched_by_module(chromium: Browser) -> Iterator[Callable[..., Page]]:
    """Opens pages for a module, see `_watched`."""
    with _watched(chromium) as new:
        yield new
