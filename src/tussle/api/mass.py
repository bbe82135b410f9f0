"""Mass, inertia and weight of entities."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class MassProperties(NamedTuple):
    """Mass, inertia and weight of entities, as their motion models use them.

    Attributes:
        mass: What the model divides forces by [kg], (n,).
        inertia: Inertia tensor about the center of mass [kg m^2], body frame, nine elements, (9, n); 0 for bodies that torques do
            not turn.
        weight: Upward force that keeps the entity from falling when nothing else acts on it [N], (n,); 0 if it does not fall,
            negative if it rises.
    """

    mass: np.ndarray
    inertia: np.ndarray
    weight: np.ndarray
