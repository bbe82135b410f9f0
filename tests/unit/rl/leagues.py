"""Policies and leagues of `chase.py`."""

from __future__ import annotations

from pathlib import Path

from tussle.rl import write_policy
from tussle.rl.league import League

CHASE = Path(__file__).parent / "chase.py"
WIDTH = 11


def constant(path, speed, turn=0.0, task="test/Chase-v0", width=WIDTH):
    """A policy whose actions are always the same."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_policy(path, [([[0.0] * width] * 2, [speed, turn])], task=task)
    return path


def chase_league(*players, task="test/Chase-v0", **options):
    return League(task, list(map(str, players)), plugin_files=[CHASE], **options)
