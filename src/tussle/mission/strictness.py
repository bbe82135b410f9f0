"""Unknown tags and attributes of a mission file: which are reported, and whether as errors."""

from __future__ import annotations

import re

from tussle.mission.node import Node
from tussle.mission.problems import Problems, Strictness
from tussle.mission.tags import BASE, ENTITY, WORLD, WORLD_MANY

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


NAMED = {"param_common": ("name",), "entity_common": ("name",), "base": ()}
"""Attributes of tags that contain other tags, and that are not read elsewhere."""
KNOWN = {"runscript": WORLD, "entity": ENTITY, "entity_common": ENTITY, "base": BASE}
"""Tags that the tags which contain others may contain; what is unknown in them has been reported."""


def report_stray(root: Node, problems: Problems) -> None:
    """Report tags inside of tags that hold only a value, attributes of tags that have none, and tags of <runscript> that stand twice.

    Args:
        root: The mission's tree, before <entity_common> is copied.
        problems: Receives what is unknown.
    """
    _report_inside(root, problems)
    seen = set[str]()
    for node in root.children:
        shown = node.tag + (f" name='{node.attributes.get('name', '')}'" if node.tag in NAMED else "")
        if shown in seen and node.tag in WORLD and node.tag not in WORLD_MANY:
            problems.note(node.place, f"<{shown}> occurs more than once; the last one is used")
        seen.add(shown)
    taken = {node.attributes.get("entity_common") for node in root.find_all("entity")}
    for node in root.find_all("entity_common"):
        if node.attributes.get("name") in taken:
            continue  # unknown tags are reported where they are copied to
        problems.note(node.place, "no entity takes this <entity_common>; it is ignored")
        for child in node.children:
            if child.tag not in ENTITY:
                problems.unknown(child.place, "tag in <entity_common>", child.tag, ENTITY)


def _report_inside(node: Node, problems: Problems) -> None:
    for attribute in node.attributes if node.tag in NAMED else ():
        if attribute not in NAMED[node.tag]:
            problems.unknown(node.where(attribute), f"attribute of <{node.tag}>", attribute, NAMED[node.tag])
    for child in node.children:
        if node.tag == "param_common" or (node.tag == "base" and child.tag in BASE):
            for attribute in child.attributes:
                problems.unknown(child.where(attribute), f"attribute of <{child.tag}>", attribute, ())
        if node.tag in KNOWN:
            if child.tag in KNOWN[node.tag]:
                _report_inside(child, problems)
        elif node.tag == "param_common":
            for inner in child.children:
                problems.unknown(inner.place, f"tag in <{child.tag}>", inner.tag, ())
        else:
            problems.unknown(child.place, f"tag in <{node.tag}>", child.tag, ())
