"""Small games with births, captures, collisions, deaths and several ends, for the tests of the recording."""

from __future__ import annotations

from pathlib import Path

from tussle import Block, Mission, Recorder, Simulation
from tussle.stock import (
    Boids,
    Predator,
    SimpleCapture,
    SimpleCaptureMetrics,
    SimpleCollision,
    Straight,
    Unicycle,
    UnicyclePID,
)


def record(mission: Mission, directory: Path, seeds: tuple[int, ...] = (1,), **options: object) -> Path:
    """Play a mission to its end and record it; returns the directory."""
    simulation = Simulation(mission, seeds=list(seeds))
    with Recorder(simulation, directory, **options):
        simulation.run()
    return directory


def hunt(n_prey: int = 12, end: float = 6.0, **changes: object) -> Mission:
    """Prey in the midst of hunters of two kinds; prey go on being born."""
    turn = {"turn_rate_max": 1.0, "pitch_rate_max": 1.0}
    prey = Block(
        name="prey", team=1, count=n_prey, position=(0, 0, 200), placement="uniform", half_width=(40, 40, 10),
        autonomy=Boids(), motion=Unicycle(vel_max=20.0, **turn),
    )  # fmt: skip
    late = Block(
        name="late", team=1, count=3, rate=1.0, first_birth=0.5, position=(30, 0, 200), autonomy=Boids(),
        motion=Unicycle(vel_max=20.0, **turn),
    )  # fmt: skip
    hunters = Block(
        name="hunters", team=2, count=3, position=(40, 0, 200), placement="uniform", half_width=(40, 40, 10),
        autonomy=Predator(max_speed=35.0, capture_range=20.0), motion=Unicycle(vel_max=35.0, **turn),
    )  # fmt: skip
    return Mission(
        blocks=[prey, late, hunters],
        end=end,
        motion_multiplier=2,
        end_conditions="time, one_team",
        interactions=[SimpleCapture(capture_range=20.0)],
        metrics=[SimpleCaptureMetrics()],
        name="hunt",
    ).replace(**changes)


def head_on(**changes: object) -> Mission:
    """Two that fly into each other, and one that flies by."""

    def flyer(name: str, team: int, x: float, y: float, heading: str) -> Block:
        return Block(
            name=name, team=team, position=(x, y, 100), heading=heading, speed=15.0,
            autonomy=Straight(speed=15.0), controller=UnicyclePID(), motion=Unicycle(vel_max=20.0),
        )  # fmt: skip

    return Mission(
        blocks=[
            flyer("west", 1, -30, 0, "0 deg"),
            flyer("east", 2, 30, 0, "180 deg"),
            flyer("by", 1, 0, 300, "0 deg"),
        ],
        end=4.0,
        end_conditions="time, one_team",
        interactions=[SimpleCollision(collision_range=5.0)],
    ).replace(**changes)
