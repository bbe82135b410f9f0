"""What is played: a mission as data."""

from tussle.mission.spec import Block, Mission

__all__ = ["Block", "Mission"]
