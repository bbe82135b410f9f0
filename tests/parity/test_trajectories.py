"""SCRIMMAGE's missions fly as it flew them with `compat="scrimmage"`.

The missions are read from its own files. Compared are, from the recorded ids, times of birth and first states on and over the
whole length: every position, attitude, who is there in each frame, the frame in which each entity was last seen, and what the
collision metric counted. Not compared is start placement, which comes out of the old system's random numbers. After the start, none of
these missions draws a random number that counts.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from recordings import NAMES, Recording, folder, load, mission
from replay import Flight, fly

from tussle import Mission, Simulation
from tussle.plugins import historic, stock
from tussle.record import FirstStates

LIMIT = 1e-6  # [m]
ATTITUDE_LIMIT = (
    1e-8  # of a quaternion's components; waypoints went by latitude there, which rounds to 1e-9 m
)
AS_THE_PRODUCT_FLIES = ["straight-no-gui", "harmonic-oscillator"]
NEEDED = [
    ("SimpleAircraft", "straight", 1.0),
    ("SimpleAircraft", "waypoint_follower", 10.0),
    ("Unicycle3D", "unicycle", 10.0),
    ("Unicycle3D", "batch-example-mission", 1e-5),
    ("TakeFlag", "capture-the-flag-simple", 0.9),
    ("BoundaryDefense", "capture-the-flag-simple", 0.9),
]


@pytest.mark.parametrize("name", NAMES)
def test_it_flies_as_recorded_over_the_whole_length(name: str) -> None:
    """Positions, attitudes, who is there and how long, and what is counted."""
    recording = load(name)
    flight = fly(mission(name).replace(compat="scrimmage"), recording)
    assert set(flight.error) == set(recording.frames.tolist())
    assert flight.max_error <= LIMIT, f"{flight.max_error:.1e} m, largest at (frame, id) {flight.worst}"
    assert max(flight.turn.values()) <= ATTITUDE_LIMIT
    assert max(flight.slip.values()) <= LIMIT
    assert flight.strangers is None
    assert flight.last_frame == recording.last_frame
    assert flight.result is not None
    if "SimpleCollisionMetrics" in flight.result.metrics:
        counts_alike(flight, recording)


def test_capture_the_flag_is_played_as_recorded() -> None:
    """Over the whole length, in which both runners are captured and the defenders return."""
    recording = load("capture-the-flag-simple")
    flight = fly(mission("capture-the-flag-simple").replace(compat="scrimmage"), recording)
    assert set(flight.error) == set(recording.frames.tolist())
    assert flight.max_error <= LIMIT
    assert flight.strangers is None
    assert flight.last_frame == recording.last_frame
    assert flight.result is not None
    for team, row in recording.summary.items():
        metrics = (flight.result.metrics[name] for name in flight.result.metrics if name.endswith("Metrics"))
        counted = {name: by_team[team] for metric in metrics for name, by_team in metric.items()}
        for column in set(row) & set(counted) - {"score"}:
            assert counted[column] == pytest.approx(row[column], abs=1e-6), (team, column)
        assert flight.result.scores[team] == row["score"]


def test_aircraft_that_play_for_flags_fly_as_recorded_until_rounding_shows() -> None:
    """16 of 20 over the whole length. Two pairs, 1 and 4, and 6 and 8, fly within reach of each other's avoidance, where rounding grows.

    That it is rounding is shown by our own game: a start changed by 1e-13 m parts the first pair further than the recording does, at
    each frame.
    """
    recording, exact_until = load("capture-the-flag"), {1: 155, 4: 155, 6: 300, 8: 300}
    game = mission("capture-the-flag").replace(compat="scrimmage")
    flight = fly(game, recording)
    assert set(flight.error) == set(recording.frames.tolist())
    for frame, distance in flight.distance.items():
        for each, metres in distance.items():
            assert metres <= LIMIT or frame > exact_until.get(each, frame), (frame, each)
    alone = {each: last for each, last in recording.last_frame.items() if each not in (6, 8)}
    assert {each: flight.last_frame[each] for each in alone} == alone

    starts = recording.first_states
    moved = starts.pos + 1e-13 * ((starts.id == 4) & (np.arange(3)[:, None] == 1))
    changed = _positions(game, dataclasses.replace(starts, pos=moved), 200)
    as_given = _positions(game, starts, 200)
    for frame in (50, 80, 100, 120, 140, 150, 160, 170, 180):
        grown = np.linalg.norm(changed[frame][4] - as_given[frame][4])
        assert grown >= flight.distance[frame][4], frame


def _positions(game: Mission, starts: FirstStates, n_steps: int) -> list[dict[int, np.ndarray]]:
    """Positions of a game by step and entity [m]."""
    found = []
    with Simulation(game, start_from=starts) as simulation:
        for _ in range(n_steps):
            bodies = simulation.state.population.bodies
            found.append(dict(zip(bodies.id.tolist(), bodies.pos.T.copy(), strict=True)))
            simulation.step()
    return found


def test_an_aircraft_with_surfaces_flies_as_recorded() -> None:
    """For 20 s. The plane of the flight is unstable: rounding grows sideways by e in 16 s, to 1e-6 m at 117 s."""
    flight = fly(mission("fixed_wing_6dof").replace(end=20.0, compat="scrimmage"), load("fixed_wing_6dof"))
    assert len(flight.error) > 35
    assert flight.max_error <= 1e-9
    assert max(flight.turn.values()) <= 1e-10


def test_aircraft_that_avoid_each_other_fly_as_recorded_until_rounding_shows() -> None:
    """80 aircraft fly for 24 s within 4e-7 m. Then the differences grow e-fold in 1 to 2 s, and decide who begins to avoid whom.

    The 24 losses, and when each was lost, are those of the recording to the end.
    """
    recording = load("straight-vs-motorschemas")
    flight = fly(mission("straight-vs-motorschemas").replace(compat="scrimmage"), recording)
    assert max(error for frame, error in flight.error.items() if frame <= 240) <= 4e-7
    assert flight.error[264] <= 2e-6
    assert flight.last_frame == recording.last_frame
    counts_alike(flight, recording)


def test_cars_drive_and_stop_as_recorded() -> None:
    """Two lots of cars, each at one point, where the forces of BulletCollision hold them from the second step to the end."""
    recording = load("colliding_spheres")
    flight = fly(mission("colliding_spheres").replace(compat="scrimmage"), recording)
    assert set(flight.error) == set(recording.frames.tolist())
    assert max(flight.max_error, *flight.turn.values(), *flight.slip.values()) <= 1e-12


@pytest.mark.slow
def test_aircraft_of_jsbsim_fly_as_recorded_but_for_the_start_of_the_engine(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two lots of aircraft, for 10 s, begun a step before the recording, at places of whole millionths of a degree.

    They agree until the engine starts, whose first turns JSBSim computes in another way than the version of the recording: that leaves
    half a metre.
    """
    pytest.importorskip("jsbsim")
    place = folder()
    assert place is not None
    monkeypatch.setenv("SCRIMMAGE_DATA_PATH", str(place / "scrimmage-data" / "data"))
    game, recording = (
        mission("straight_jsbsim").replace(compat="scrimmage", end=10.0),
        load("straight_jsbsim"),
    )
    flown = recording.first_states
    goes_east = flown.vel[0] > 0.0
    zero, half = 0.0 * flown.t, np.cos(np.pi / 2)
    before = dataclasses.replace(
        flown,
        pos=flown.pos - [game.dt * np.where(goes_east, 30.866, -30.866), zero, zero],
        vel=0.0 * flown.vel,
        quat=np.stack([np.where(goes_east, 1.0, half), zero, zero, np.where(goes_east, 0.0, 1.0)]),
    )
    flight = fly(game, dataclasses.replace(recording, first_states=before))
    at_start = flown.id[flown.t == 0.0].tolist()
    for frame, distance in flight.distance.items():
        assert max(distance[each] for each in at_start) <= (1e-4 if frame <= 4 else 0.6), frame


def counts_alike(flight: Flight, recording: Recording) -> None:
    """Collisions and times in the air."""
    assert flight.result is not None
    counted = flight.result.metrics["SimpleCollisionMetrics"]
    for team, row in recording.summary.items():
        for column, number in row.items():
            if column != "team_id":
                assert counted[column][team] == pytest.approx(number, abs=1e-6), (team, column)


@pytest.mark.parametrize("name", AS_THE_PRODUCT_FLIES)
def test_some_missions_need_no_variant(name: str) -> None:
    assert fly(mission(name), load(name)).max_error <= LIMIT


@pytest.mark.parametrize(("law", "name", "least"), NEEDED)
def test_without_the_old_law_the_recording_is_missed(law: str, name: str, least: float) -> None:
    """Each of these laws is there because tussle's own flies otherwise, by more than this."""
    flown = with_stock(mission(name).replace(compat="scrimmage"), law)
    assert fly(flown, load(name), enough=least).max_error > least


def with_stock(mission: Mission, law: str) -> Mission:
    """The mission with tussle's own law for one plugin."""

    def swap(plugin: Any) -> Any:
        if type(plugin) is not historic.load(law):
            return plugin
        own = stock.load(law)
        return own(name=plugin.instance_name, **{k: v for k, v in plugin.values.items() if k in own.params()})

    blocks = [
        dataclasses.replace(b, motion=swap(b.motion), autonomy=tuple(map(swap, b.autonomy)))
        for b in mission.blocks
    ]
    assert blocks != list(mission.blocks)
    return mission.replace(blocks=blocks, compat="")
