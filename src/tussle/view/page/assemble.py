"""Assembles the page: one HTML text with style, script and document, which makes no requests except to its own server."""

from __future__ import annotations

import base64
import hashlib
import re
import zlib
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Any

from tussle.view.page.recorded import compact_json

MAIN = "main.js"
"""The module that starts the page; it and those that it imports are the script."""
SERVED = "served.js"
"""The module that asks the page's server; a file does not hold it."""
FRAMED = "framed.js"
"""The module that asks the notebook which shows the page."""
IMPORT = re.compile(r"^import [^;]*'\./([\w.]+)';\n", re.MULTILINE)
DOC_COMMENT = re.compile(r"^ */\*\*(?:(?!\*/).)*\*/\n", re.MULTILINE | re.DOTALL)
EXPORT = re.compile(r"^export (?=\w)", re.MULTILINE)
NO_MARKUP = str.maketrans({c: f"\\u{ord(c):04x}" for c in "<>&"})


def page_html(
    document: Mapping[str, Any], blobs: Mapping[str, bytes] | None = None, entry: str = SERVED
) -> str:
    """Return the HTML text of the page.

    Args:
        document: Data that the page needs before its first picture.
        blobs: Data by name, for a file; None for a page that asks for them.
        entry: The module that asks for them.
    """
    script = script_text([MAIN] if blobs is not None else [entry, MAIN])
    style = web_text("page.css")
    # Nothing runs but this very script: what got in as text cannot.
    policy = (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; img-src data:; "
        f"connect-src '{'none' if blobs is not None or entry != SERVED else 'self'}'; base-uri 'none'; form-action 'none'"
    )
    parts = {
        "policy": policy,
        "generator": escape(document["generator"]),
        "title": escape(document["title"]),
        "style": style,
        # No character that means something to HTML is left in it.
        "document": compact_json(document).translate(NO_MARKUP),
        "blobs": "\n".join(_blob(name, data) for name, data in (blobs or {}).items()),
        "script": script,
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], web_text("page.html"))


def web_text(name: str) -> str:
    """Return the text of a file of the page."""
    return files("tussle.view.page").joinpath("web", name).read_text(encoding="utf-8")


def script_text(entries: Sequence[str]) -> str:
    """Return modules and all that they import as one script, each module once and after its imports.

    Not modules of the browser: from a file it loads none, and the hash in the page's policy covers this one script.
    """
    parts: dict[str, str] = {}

    def add(name: str) -> None:
        if name in parts:
            return
        text = parts[name] = web_text(name)
        for imported in IMPORT.findall(text):
            add(imported)
        del parts[name]  # it comes after what it imports
        parts[name] = EXPORT.sub("", DOC_COMMENT.sub("", IMPORT.sub("", text)))

    for name in entries:
        add(name)
    return "(() => {\n'use strict';\n" + "\n".join(parts.values()) + "})();\n"


def _hash(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _blob(name: str, data: bytes) -> str:
    packed = base64.b64encode(zlib.compress(data, 6)).decode()
    return f'<script type="application/octet-stream" id="data-{name}">{packed}</script>'
