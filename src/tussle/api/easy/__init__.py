"""Easy mode: plugins that are written for one entity or one world at a time, in plain Python, and can be stepped through in a debugger."""

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
