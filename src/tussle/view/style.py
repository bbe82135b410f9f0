"""Colours of teams and blocks, and models of blocks."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from typing import Any

from tussle.arguments import explained
from tussle.palette import colour_in, colour_of, rgb_of, team_colours
from tussle.view.shapes import MODELS
from tussle.view.sight import Sight

Colour = tuple[int, int, int]

_WORDS: Mapping[str, tuple[str, ...]] = {
    "aircraft": (
        *("zephyr", "cessna", "aircraft", "airplane", "plane", "fixedwing", "fixed", "wing", "glider", "jet"),
        *("f15", "f16", "c172", "uav", "skywalker", "bird"),
    ),
    "quadrotor": ("iris", "quad", "quadrotor", "multirotor", "copter", "rotor", "hexacopter", "drone"),
    "car": ("volkswagen", "car", "truck", "pioneer", "husky", "turtlebot", "ugv", "rover", "jeep", "ackermann"),
    "boat": (
        *("seaangler", "angler", "boat", "ship", "usv", "uuv", "auv", "vessel", "submarine", "kayak"),
        *("wamv", "torpedo", "heron"),
    ),
    "sphere": ("sphere", "ball", "point", "marble", "oscillator"),
    "box": ("box", "cube", "crate", "brick", "container"),
}  # fmt: skip
"""Words in names of visual models."""

_MOTION_WORDS: Mapping[str, tuple[str, ...]] = {
    "aircraft": ("unicycle", "aircraft", "wing", "jsbsim"),
    "quadrotor": ("rotor", "quad", "copter"),
    "car": ("car", "ackermann", "drive", "ground"),
    "boat": ("boat", "ship", "vessel", "usv"),
}
"""Words in the names of motion models."""


@explained
class Style:
    """Colours and models of a mission's entities.

    A block has its `<color>`, else the colour of its team: that of the first block with one, else a colour of the palette that no other
    team has, while there is one. The model is the one nearest to `visual_model`, else a box of its own lengths for entities that are
    boxes, else one that suits the motion model. `visual_rpy` is ignored: it turns the meshes of SCRIMMAGE, and these point forward.

    Args:
        blocks: Names of the blocks.
        teams: Team of each block.
        plugins: Names of the classes of each block's plugins, which choose the model of a block without `visual_model`.
        viewer: Viewer tags of the mission file, see `tussle.mission.Loaded`.
        boxes: Lengths of each block's entities along their axes [m], (3,); None where they are no boxes.
        views: What the plugins of each block see.

    Attributes:
        notes: Viewer tags that were not followed, one line each.
    """

    def __init__(
        self,
        blocks: Sequence[str],
        teams: Sequence[int],
        plugins: Sequence[Sequence[str]] = (),
        viewer: Mapping[str, Any] | None = None,
        boxes: Sequence[Sequence[float] | None] = (),
        views: Sequence[Sequence[Sight]] = (),
    ) -> None:
        self.notes: list[str] = []
        self._teams = list(teams)
        entities = (viewer or {}).get("entities", {})
        own = [entities.get(name, {}) for name in blocks]
        self._colours = [self._read_colour(name, s.get("color")) for name, s in zip(blocks, own, strict=True)]
        self._scales = [
            self._read_scale(name, s.get("visual_scale")) for name, s in zip(blocks, own, strict=True)
        ]
        self._views = [*views, *[()] * (len(blocks) - len(views))]
        self._boxes = [*boxes, *[None] * (len(blocks) - len(boxes))]
        self._models = [
            self._read_model(
                name, s.get("visual_model"), plugins[i] if i < len(plugins) else (), self._boxes[i]
            )
            for i, (name, s) in enumerate(zip(blocks, own, strict=True))
        ]
        written = team_colours((team, s.get("color")) for team, s in zip(teams, own, strict=True))
        self._by_team = {team: rgb_of(colour) for team, colour in written.items()}

    def colour(self, team: int) -> Colour:
        """Red, green, blue of a team, 0 to 255."""
        return self._by_team.get(team) or rgb_of(colour_of(team))

    def block_colour(self, block: int) -> Colour:
        """Red, green, blue of a block by its number, 0 to 255."""
        return self._colours[block] or self.colour(self._teams[block])

    def model(self, block: int) -> str:
        """Name of the model of a block by its number, in `MODELS`."""
        return self._models[block]

    def views(self, block: int) -> Sequence[Sight]:
        """What the plugins of a block see, by its number."""
        return self._views[block]

    def lengths(self, block: int) -> tuple[float, float, float]:
        """Lengths of an entity of a block along its axes [m]: factors by which its model, 1 m long, is enlarged."""
        scale = self._scales[block]
        x, y, z = self._boxes[block] if self.is_true_box(block) else (1.0, 1.0, 1.0)  # type: ignore[misc]
        return scale * x, scale * y, scale * z

    def scale(self, block: int) -> float:
        """The longest of `lengths` [m]."""
        return max(self.lengths(block))

    def is_true_box(self, block: int) -> bool:
        """Whether the entities of a block are drawn as the boxes that they are, and so not enlarged to be seen."""
        return self._models[block] == "box" and self._boxes[block] is not None

    def _read_colour(self, block: str, text: str | None) -> Colour | None:
        if text is None:
            return None
        colour = colour_in(text)
        if colour is None:
            self.notes.append(
                f"block {block!r}: color {text!r} is not three numbers from 0 to 255; the team's colour is used"
            )
            return None
        return rgb_of(colour)

    def _read_scale(self, block: str, text: str | None) -> float:
        try:
            scale = 1.0 if text is None else float(text)
        except ValueError:
            scale = -1.0
        if 0.0 < scale < float("inf"):
            return scale
        self.notes.append(f"block {block!r}: visual_scale {text!r} is not a number > 0; 1 is used")
        return 1.0

    def _read_model(
        self, block: str, asked: str | None, plugins: Sequence[str], box: Sequence[float] | None
    ) -> str:
        suitable = (
            "box" if box else next((m for p in plugins if (m := _model_by_words(p, _MOTION_WORDS))), "sphere")
        )
        if not asked:
            return suitable
        found = _model_by_words(asked, _WORDS) or _model_by_likeness(asked)
        if not found:
            self.notes.append(
                f"block {block!r}: visual_model {asked!r} is unknown; it is drawn as {suitable}"
            )
        return found or suitable


def _model_by_words(name: str, words: Mapping[str, tuple[str, ...]]) -> str:
    """The model with a word that a name contains, or ""; short words count only as whole words."""
    parts = set(re.findall(r"[A-Z]?[a-z]+\d*|[A-Z]+(?![a-z])\d*", name)) | {name}
    parts = {p.lower() for p in parts}
    whole = re.sub(r"[^a-z0-9]", "", name.lower())
    for model, known in words.items():
        if any(word in parts or (len(word) > 4 and word in whole) for word in known):
            return model
    return ""


def _model_by_likeness(name: str) -> str:
    """The model with a word that is spelled similarly to a name, or ""."""
    by_word = {word: model for model, words in _WORDS.items() for word in words}
    close = difflib.get_close_matches(name.lower(), by_word, n=1, cutoff=0.7)
    return by_word[close[0]] if close else ""


assert set(_WORDS) == set(MODELS)
