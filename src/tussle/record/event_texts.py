"""Sentences for events of a game and for the ends of games: the same on the terminal, on the page, in reports and in exports."""

from __future__ import annotations

import re

EVENT_TEXTS = {
    "alarm": ["near failure: {text}"],
    "birth": ["{id} was born"],
    "capture": ["{id} captured {other}"],
    "collision": ["{id} and {other} collided", "{id} hit the {text}", "{id} hit the ground"],
    "death": ["{id} died: {text} ({other})", "{id} died: {text}", "{id} died ({other})", "{id} died"],
    "difference": ["the two runs differ from here on"],
    "failure": ["failed: {text}"],
    "flag": ["{id} {text}"],
    "mark": ["{text}"],
    "end": ["the game ended: {text}"],
}
"""Sentences of each kind of event; the first one whose parts are all known is used. The page has them from here."""
END_TEXTS = {
    "time": "end time reached",
    "one_team": "one team is left",
    "all_dead": "no entity is left",
    "error": "a plugin failed",
    "": "interrupted",
}
"""Text for each reason for which a game ends."""


def end_text(reason: str) -> str:
    """Return the text for a reason for which a game ended; a reason of a plugin is its own text."""
    return END_TEXTS.get(reason, reason)


def event_text(kind: str, who: str = "", other: str = "", text: str = "") -> str:
    """Return the sentence for an event.

    Args:
        kind: Kind of the event.
        who: Name of the entity.
        other: Name of the other entity; "" if there is none.
        text: Cause of a death, what was hit, or the reason for the end.
    """
    parts = {"id": who, "other": other, "text": end_text(text) if kind == "end" else text}
    for template in EVENT_TEXTS.get(kind, ()):
        if all(parts[name] for name in re.findall(r"\{(\w+)\}", template)):
            return template.format(**parts)
    return " ".join(part for part in (kind, *parts.values()) if part)
