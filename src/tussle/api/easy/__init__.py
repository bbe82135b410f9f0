"""Easy mode: plugins written in plain Python for one entity or one world at a time. A debugger can step through them."""

from tussle.api.easy.entities import Me, Other
from tussle.api.easy.plugins import (
    EasyAutonomy,
    EasyController,
    EasyInteraction,
    EasyMetric,
    EasySensor,
)
from tussle.api.easy.worlds import Member, OneWorld

__all__ = [
    "EasyAutonomy",
    "EasyController",
    "EasyInteraction",
    "EasyMetric",
    "EasySensor",
    "Me",
    "Member",
    "OneWorld",
    "Other",
]
