"""Actors, which choose actions from observations."""

from __future__ import annotations

from typing import Any

import numpy as np


class Alternating:
    """Alternates: every component of the action is 1 in the first step, then 0 (discrete) or -1 (continuous), then 1 again.

    Args:
        action_space: A space of Gymnasium; unused.
        observation_space: A space of Gymnasium; unused.
        params: The parameters of the plugin; unused.
    """

    def __init__(self, action_space: Any, observation_space: Any, params: dict[str, str]) -> None:
        self.is_forward = False

    def __call__(self, observation: np.ndarray) -> int:
        """Return the next action: 1 or -1 for all components; for discrete components -1 means 0."""
        self.is_forward = not self.is_forward
        return 1 if self.is_forward else -1


def spaces_of(x_discrete: bool, y_discrete: bool | None, max_speed: float, observed: int) -> tuple[Any, Any]:
    """Return the spaces of actions and observations that SCRIMMAGE passes to actors.

    Args:
        x_discrete: Whether the velocity along x has two values.
        y_discrete: Whether that along y has two values; None if it is not controlled.
        max_speed: Limit of continuous actions [m/s].
        observed: Number of components of an observation.

    Returns:
        Discrete or MultiDiscrete, Box, or a Tuple of both; and a Box. None and None without Gymnasium.
    """
    try:
        from gymnasium import spaces
    except ImportError:
        return None, None
    is_discrete = [part for part in (x_discrete, y_discrete) if part is not None]
    parts: list[Any] = []
    if discrete := sum(is_discrete):
        parts.append(spaces.Discrete(2) if discrete == 1 else spaces.MultiDiscrete([2] * discrete))
    if continuous := len(is_discrete) - discrete:
        parts.append(spaces.Box(-max_speed, max_speed, (continuous,), np.float64))
    action = parts[0] if len(parts) == 1 else spaces.Tuple(parts)
    return action, spaces.Box(-np.inf, np.inf, (observed,), np.float64)
