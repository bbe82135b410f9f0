"""The decision whether unknown tags and attributes of a mission file are errors."""

from __future__ import annotations

import re

from tussle.mission.node import Node
from tussle.mission.problems import Strictness
from tussle.mission.tags import WORLD

STYLESHEET = re.compile(r"<\?xml-stylesheet\b[^>]{0,500}?\bhref\s*=\s*[\"'][^\"'>]{0,500}(?:gtri|scrimmage)")
"""Missions of SCRIMMAGE name the address of its authors as their style sheet."""
SEARCHED = 2000
"""Number of characters at the beginning of a file in which the style sheet is searched."""
MARKS = ("stream_ip", "stream_port", *(tag for tag, known in WORLD.items() if known.kept_for == "log"))
"""Tags that set up SCRIMMAGE's own server and output. They do nothing here, so only missions written for SCRIMMAGE have them."""


def strictness_of(root: Node, text: str, strict: bool | None) -> Strictness:
    """Decide whether unknown tags and attributes of a mission are errors.

    They are, unless the mission was written for SCRIMMAGE, which ignores them: such missions worked, and many have some.

    Args:
        root: The mission's tree, includes resolved.
        text: Text of the mission's file.
        strict: The user's choice; None to decide by marks of SCRIMMAGE in the file.
    """
    if strict is not None:
        return Strictness(strict)
    if mark := scrimmage_mark(root, text):
        return Strictness(
            False,
            f"{root.place}: unknown tags and attributes are ignored, since {mark} marks a mission of SCRIMMAGE; "
            "--strict (strict=True) makes them errors",
        )
    return Strictness(
        True,
        f"{root.place}: unknown tags and attributes are errors, since nothing marks this as a mission of SCRIMMAGE; "
        "--lenient (strict=False) ignores them",
    )


def scrimmage_mark(root: Node, text: str) -> str:
    """Return what shows that a mission was written for SCRIMMAGE; "" if nothing does."""
    if STYLESHEET.search(text[:SEARCHED]):
        return "its style sheet"
    if root.attributes.get("compat") == "scrimmage":
        return "compat='scrimmage'"
    return next((f"<{child.tag}>" for child in root.children if child.tag in MARKS), "")
