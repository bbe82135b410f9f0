"""Waiting for what a page does in its own time."""

from __future__ import annotations

import time

from playwright.sync_api import Page


def wait_until(page: Page, expression: str, seconds: float = 60.0) -> object:
    """The value of an expression as soon as it is true.

    Not `wait_for_function`, which evaluates text on the page: its policy forbids that.
    """
    end = time.monotonic() + seconds
    while not (value := page.evaluate(f"() => {expression}")):
        assert time.monotonic() < end, f"still not true after {seconds:g} s: {expression}"
        page.wait_for_timeout(20)
    return value
