"""What of a game is shown, and how large: one choice for all who watch the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from tussle.mission import Mission
from tussle.view.frame import Frame
from tussle.view.looks import Looks
from tussle.view.scenery import Scenery

FEW = 30
"""As many entities are named from the beginning."""
SHARE_OF_SCENE = 0.014
"""Length of a model at first, of the diagonal of what is shown: a dozen pixels across on a usual screen."""
LEAST_SHARE = 0.004
"""No less than this, so that it is seen at all."""
SHARE_OF_GAP = 0.7
"""Of the usual distance to the nearest neighbour, so that a flock is not one lump."""


@dataclass
class Display:
    """What is shown. The panel writes it, all who draw read it.

    Attributes:
        model_length: Length of a model whose block has no scale of its own [m].
        model_scale: Factor on it.
        label_scale: Size of the labels' letters.
        has_labels: Name the entities.
        has_trails: Draw where they have been.
        trail_time: For how long [s].
        is_wireframe: Draw edges only.
        ring_radius: Of the rings around entities [m].
        has_rings: Draw them.
        cone_range: Length of the cones before entities [m].
        cone_angle: Their full opening angle [rad].
        has_cones: Draw them.
        link_range: Farthest that linked entities are apart [m].
        has_links: Draw lines between them.
        has_drawn: Show what plugins draw.
        version: Counts changes that need all entities to be drawn anew.
    """

    model_length: float = 1.0
    model_scale: float = 1.0
    label_scale: float = 1.0
    has_labels: bool = False
    has_trails: bool = False
    trail_time: float = 10.0
    is_wireframe: bool = False
    ring_radius: float = 100.0
    has_rings: bool = False
    cone_range: float = 100.0
    cone_angle: float = np.pi / 3
    has_cones: bool = False
    link_range: float = 100.0
    has_links: bool = False
    has_drawn: bool = True
    version: int = 0

    @classmethod
    def of(
        cls,
        frame: Frame,
        looks: Looks,
        scenery: Scenery,
        viewer: Mapping[str, Any] | None = None,
        mission: Mission | None = None,
    ) -> Display:
        """What suits a game at first.

        Args:
            frame: Its first moment.
            looks: Colours and models of its entities.
            scenery: What stands still.
            viewer: What the mission file says for the viewer.
            mission: The mission, whose plugins say how far they see; None where it is not known.
        """
        viewer = viewer or {}
        length = _suitable_length(frame, scenery) * float(viewer.get("scale") or 1.0)
        scales = [looks.scale(int(b)) for b in frame.block]
        reach, angle = reach_of(mission)
        reach = reach or 10.0 * length
        return cls(
            model_length=length / (float(np.median(scales)) if scales else 1.0),
            has_labels=len(frame) <= FEW,
            has_trails=bool(viewer.get("plot_tracks", False)),
            ring_radius=reach,
            cone_range=reach,
            cone_angle=angle or np.pi / 3,
            link_range=reach,
        )

    @property
    def size(self) -> float:
        """Length of a model now [m]."""
        return self.model_length * self.model_scale


def _suitable_length(frame: Frame, scenery: Scenery) -> float:
    length = max(1.0, SHARE_OF_SCENE * scenery.size)
    if len(frame) > 1:
        distance = cKDTree(frame.pos).query(frame.pos, k=2)[0][:, 1]
        length = min(length, SHARE_OF_GAP * float(np.median(distance)))
    return max(length, LEAST_SHARE * scenery.size, 1.0)


def reach_of(mission: Mission | None) -> tuple[float, float]:
    """How far entities hear or see [m], and the full angle in which they see [rad]; 0 where no plugin says.

    The first parameter that names a range counts, networks before others: a range of what is heard is what links are about.
    """
    reach = angle = 0.0
    if mission is None:
        return reach, angle
    plugins = [*mission.networks, *(p for b in mission.blocks for p in b.plugins)]
    for plugin in plugins:
        for name, value in plugin.values.items():
            if not isinstance(value, (int, float)) or isinstance(value, bool) or not 0.0 < value < 1e6:
                continue
            if not reach and name in RANGES:
                reach = float(value)
            if not angle and name in ANGLES and value < 2.0 * np.pi - 1e-6:
                angle = float(value)
    return reach, angle


RANGES = ("range", "comms_range", "max_range", "detection_range", "sensing_range", "sphere_of_influence")
ANGLES = ("fov_az", "fov", "field_of_view", "fov_el")
