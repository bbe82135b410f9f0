"""The keys of the page: one table, from which they are set and their help is made."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Key:
    """A key and what it does.

    Attributes:
        does: Name of the command.
        key: The key as browsers call it.
        with_shift: Together with the shift key.
        shown: As people call it.
        text: What it does, in words.
        is_live: It says something to the plugins or begins anew, and so needs a game that is played.
    """

    does: str
    key: str
    text: str
    shown: str = ""
    with_shift: bool = False
    is_live: bool = False

    @property
    def label(self) -> str:
        """As people call it: "B", "Shift + Z"."""
        name = self.shown or self.key.upper()
        return f"Shift + {name}" if self.with_shift else name


# As in SCRIMMAGE where a browser lets them be: there + and - change the size of models, which differ between keyboards, and q quits,
# which is for the terminal.
KEYS: tuple[Key, ...] = (
    Key("toggle", "B", "pause, go on"),
    Key("step", "space", "one step", "Space"),
    Key("step_back", "backspace", "one step back", "Backspace"),
    Key("slower", "[", "slower: one less above 2 × real time, then halved"),
    Key("faster", "]", "faster: doubled below 2 × real time, then one more"),
    Key("fastest", "M", "as fast as possible, and back"),
    Key("previous_event", ",", "to the event before"),
    Key("next_event", ".", "to the next event"),
    Key("camera_mode", "A", "camera: free, following, behind"),
    Key("previous_entity", "arrowleft", "previous entity", "←"),
    Key("next_entity", "arrowright", "next entity", "→"),
    Key("nearer", "Z", "camera nearer to the entity"),
    Key("farther", "Z", "camera farther from the entity", with_shift=True),
    Key("reset_view", "R", "see the whole"),
    Key("from_above", "V", "see it from above"),
    Key("undo_view", "U", "camera back to where it was"),
    Key("models_larger", "plus", "models larger", "+", with_shift=True),
    Key("models_larger", "plus", "models larger", "+"),
    Key("models_larger", "=", "models larger"),
    Key("models_smaller", "minus", "models smaller", "-"),
    Key("models_reset", "0", "models as at first"),
    Key("labels_larger", "N", "names larger"),
    Key("labels_smaller", "N", "names smaller", with_shift=True),
    Key("labels", "L", "names"),
    Key("trails", "T", "trails"),
    Key("links", "G", "links between entities in reach"),
    Key("wireframe", "W", "edges only"),
    Key("solid", "S", "surfaces"),
    Key("pick", "O", "pick a point of the ground, which plugins are told", is_live=True),
    Key("custom_key", ";", "a key for the plugins", is_live=True),
    Key("help", "H", "these keys"),
)


def keys_of(is_live: bool) -> tuple[Key, ...]:
    """The keys that mean something: of a recorded run, none that speaks to plugins."""
    return tuple(key for key in KEYS if is_live or not key.is_live)


def help_table(is_live: bool) -> str:
    """The keys as a table in Markdown; those that do the same share a line."""
    rows: dict[str, tuple[list[str], str]] = {}
    for key in keys_of(is_live):
        rows.setdefault(key.does, ([], key.text))[0].append(key.label)
    lines = ["| key | does |", "|---|---|"]
    return "\n".join([*lines, *(f"| {' or '.join(names)} | {text} |" for names, text in rows.values())])
