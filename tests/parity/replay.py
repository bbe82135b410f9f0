"""Fly a mission from the recorded first states, and hold it against the recording frame by frame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from recordings import Recording

from tussle import Mission, Simulation
from tussle.engine.result import WorldResult


@dataclass
class Flight:
    """What a simulation did, at the frames of a recording.

    Attributes:
        error: Largest distance from the recorded position in each frame [m].
        distance: The distance by frame and entity [m].
        turn: Largest difference of a quaternion's components in each frame.
        slip: Largest difference of a velocity's components in each frame [m/s].
        worst: (frame, id) where the position differs most.
        strangers: First frame in which others were there than recorded; None if there is none.
        last_frame: Entity -> last frame in which it was there.
        result: What the metrics say at the end.
    """

    error: dict[int, float] = field(default_factory=dict)
    distance: dict[int, dict[int, float]] = field(default_factory=dict)
    turn: dict[int, float] = field(default_factory=dict)
    slip: dict[int, float] = field(default_factory=dict)
    worst: tuple[int, int] = (0, 0)
    strangers: int | None = None
    last_frame: dict[int, int] = field(default_factory=dict)
    result: WorldResult | None = None

    @property
    def max_error(self) -> float:
        """Over all frames [m]."""
        return max(self.error.values())


def fly(mission: Mission, recording: Recording, enough: float | None = None) -> Flight:
    """Play a mission from the recorded first states, and compare, to its end or until an error is larger than `enough` [m]."""
    flight = Flight()
    wanted = set(recording.frames.tolist())

    def look(sim: Simulation) -> None:
        frame = int(sim.steps[0])
        bodies = sim.state.population.bodies
        flight.last_frame.update(dict.fromkeys(bodies.id.tolist(), frame))
        if frame in wanted:
            _compare(flight, recording, frame, bodies)

    with Simulation(mission, start_from=recording.first_states) as sim:
        sim.observers.append(look)
        if enough is not None:
            sim.run_until(lambda _: next(reversed(flight.error.values()), 0.0) > enough)
            return flight
        flight.result = sim.run()[0]
        frame, bodies = int(sim.steps[0]), sim.state.parked[0].bodies
    flight.last_frame.update(dict.fromkeys(bodies.id.tolist(), frame))
    if frame in wanted:
        _compare(flight, recording, frame, bodies)
    return flight


def _compare(flight: Flight, recording: Recording, frame: int, bodies: object) -> None:
    rows = recording.rows(frame)
    order = np.argsort(bodies.id)
    if bodies.id[order].tolist() != recording.id[rows].tolist():
        flight.strangers = frame if flight.strangers is None else flight.strangers
        shared = np.intersect1d(bodies.id, recording.id[rows])
        order = order[np.isin(bodies.id[order], shared)]
        rows = rows[np.isin(recording.id[rows], shared)]
    offset = bodies.pos[:, order] - recording.pos[:, rows]
    distance = np.sqrt((offset * offset).sum(axis=0))
    q, r = bodies.quat[:, order], recording.quat[:, rows]
    flight.slip[frame] = float(np.abs(bodies.vel[:, order] - recording.vel[:, rows]).max(initial=0.0))
    flight.turn[frame] = float(np.minimum(np.abs(q - r), np.abs(q + r)).max(initial=0.0))
    if len(distance) and distance.max() > max(flight.error.values(), default=0.0):
        flight.worst = (frame, int(bodies.id[order][distance.argmax()]))
    flight.error[frame] = float(distance.max(initial=0.0))
    flight.distance[frame] = dict(zip(bodies.id[order].tolist(), distance.tolist(), strict=True))
