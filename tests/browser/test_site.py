"""The documentation site in a real browser: on the screen of a phone, in dark colours, with its search, and alone on its host."""

from __future__ import annotations

import threading
from contextlib import suppress
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import needs
import pytest
from playwright.sync_api import TimeoutError as PlaywrightTimeout

pytestmark = [pytest.mark.needs("mkdocs"), pytest.mark.needs("browser")]
PHONE = {"width": 390, "height": 844}


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture(scope="module")
def address(built_site):
    """Address at which the site is served."""
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=built_site)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


def test_no_page_is_wider_than_the_screen_of_a_phone(chromium, address, built_site):
    pages = [page.stem for page in (needs.ROOT / "docs").glob("[!i]*.md")]
    pages += [f"reference/{folder.parent.name}" for folder in built_site.glob("reference/*/index.html")]
    pages += ["", "plugins", "plugins/Boids", "files/CONTRIBUTING", "files/examples/02_your_own_chaser.py"]
    assert len(pages) > 50
    tab = chromium.new_page(viewport=PHONE)
    tab.route("**/search*.js*", lambda route: route.abort())  # each page would read the words of all pages
    wide = []
    for page in pages:
        tab.goto(f"{address}{page}", wait_until="domcontentloaded")
        if tab.evaluate("document.documentElement.scrollWidth") > PHONE["width"]:
            wide.append(page)
    tab.close()
    assert not wide


def test_colours_follow_the_system(watched, address):
    brightness = {}
    for scheme in ("light", "dark"):
        tab = watched(address, color_scheme=scheme)
        tab.goto(address, wait_until="networkidle")
        colour = tab.evaluate("getComputedStyle(document.body).backgroundColor")
        brightness[scheme] = sum(map(int, colour.removeprefix("rgb(").removesuffix(")").split(",")))
    assert brightness["dark"] < 200 < 600 < brightness["light"]


def test_search_finds_a_public_name(watched, address):
    tab = watched(address)
    found = tab.locator(".md-search-result__item a").first
    for attempt in range(10):  # the theme loses what is typed while it starts
        tab.goto(address, wait_until="networkidle")
        tab.fill("input.md-search__input", "load_batch")
        with suppress(PlaywrightTimeout):
            # The index of all pages is read first, which a busy machine does slowly.
            found.wait_for(timeout=4_000 * 1.6**attempt)
            break
    assert "reference/tussle.batch/" in found.get_attribute("href")
