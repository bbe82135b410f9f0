"""Assembles the page: one HTML text with style, script and document, which makes no requests except to its own server."""

from __future__ import annotations

import base64
import hashlib
import re
import zlib
from collections.abc import Mapping
from html import escape
from importlib.resources import files
from typing import Any

from tussle.view.page.recorded import compact_json

MODULES = (
    *(
        "event_texts.js",
        "formatting.js",
        "geometry.js",
        "packing.js",
        "sources.js",
        "chunk.js",
        "layer.js",
        "live.js",
        "camera.js",
    ),
    *(
        "shaders.js",
        "drawing.js",
        "models.js",
        "trails.js",
        "scenery.js",
        "reach.js",
        "drawn.js",
        "events.js",
    ),
    *("overlay.js", "timeline.js", "panels.js", "steering.js", "keys.js", "actions.js", "player.js"),
)
"""Modules of the page, each after those that it imports."""
SERVED = "served.js"
"""The module that asks the page's server; a file does not hold it."""
NO_MARKUP = str.maketrans({c: f"\\u{ord(c):04x}" for c in "<>&"})


def page_html(document: Mapping[str, Any], blobs: Mapping[str, bytes] | None = None) -> str:
    """Return the HTML text of the page.

    Args:
        document: What it is told at once.
        blobs: Data by name, for a file; None for a page that asks its server.
    """
    folder = files("tussle.view.page").joinpath("web")
    modules = MODULES if blobs is not None else (*MODULES[:-1], SERVED, MODULES[-1])

    def text(name: str) -> str:
        return folder.joinpath(name).read_text(encoding="utf-8")

    script = "(() => {\n'use strict';\n" + "\n".join(_joined(text(name)) for name in modules) + "})();\n"
    style = text("page.css")
    # Nothing runs but this very script: what got in as text cannot.
    policy = (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; img-src data:; "
        f"connect-src '{'none' if blobs is not None else 'self'}'; base-uri 'none'; form-action 'none'"
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
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], text("page.html"))


def _joined(module: str) -> str:
    """Return a module without its imports and exports, as a part of one script."""
    return re.sub(
        r"^export (?=\w)", "", re.sub(r"^import [^;]*;\n", "", module, flags=re.MULTILINE), flags=re.MULTILINE
    )


def _hash(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _blob(name: str, data: bytes) -> str:
    packed = base64.b64encode(zlib.compress(data, 6)).decode()
    return f'<script type="application/octet-stream" id="data-{name}">{packed}</script>'
