"""Signals are what they say, and the robustness of a world does not depend on its stack."""

from __future__ import annotations

import numpy as np
import pytest

from tussle import Simulation
from tussle.errors import ParameterError
from tussle.mission import read_mission
from tussle.stress import Monitor, Specification
from tussle.stress.kernels import SWEEP_FROM

SETTINGS = {"prey": 12, "run.end": 6}
MISSION = read_mission("predator_prey", SETTINGS).mission
ENDLESS = np.inf


def seen(sim, read):
    """read(sim) at the start of each step and at the end."""
    found = []
    sim.observers.append(lambda s: found.append(read(s)))
    sim.run()
    return np.array([*found, read(sim)])


def trace(text, sim):
    """The signal of `always (text > 0)` of world 0."""
    return Monitor(Specification.parse(f"always ({text} > 0)", sim.mission), sim)


def positions(sim):
    found = []
    for block in sim.mission.blocks:
        pos, alive = sim.read(f"{block.name}.pos")
        found += [
            (block.team, p, v)
            for p, v, a in zip(pos[0], sim.read(f"{block.name}.vel")[0][0], alive[0], strict=True)
            if a
        ]
    return found


def pairwise(these, others, is_same):
    d = [
        np.linalg.norm(a - b)
        for i, a in enumerate(these)
        for j, b in enumerate(others)
        if not is_same or i != j
    ]
    return min(d, default=ENDLESS)


def pos_of(sim, team=None):
    return [p for t, p, _ in positions(sim) if team in (None, t)]


def links(points):
    """Links of a minimum spanning tree."""
    from scipy.sparse.csgraph import minimum_spanning_tree

    if len(points) < 2:
        return np.zeros(0)
    d = np.linalg.norm(np.array(points)[:, None] - np.array(points)[None], axis=2)
    return minimum_spanning_tree(d).data


def approach(these, others, per_second):
    """Least approach of bodies (team, position, velocity), looked for along fine steps of time."""
    t, least = np.linspace(0.0, 100.0, 4001), ENDLESS
    for _, p, v in these:
        for _, q, u in others:
            if p is not q:
                offset, closing = np.subtract(q, p), np.subtract(v, u)
                d = np.sqrt(np.square(offset[:, None] - closing[:, None] * t).sum(axis=0))
                k = d.argmin()
                least = min(least, d[0], np.hypot(d[k], per_second * t[k]))
    return least


POINT = np.array([10.0, 20.0, 30.0])
SIGNALS = {
    "distance(team 1, team 1)": lambda s: pairwise(pos_of(s, 1), pos_of(s, 1), True),
    "distance(team 1, team 2)": lambda s: pairwise(pos_of(s, 1), pos_of(s, 2), False),
    "distance(all, all)": lambda s: pairwise(pos_of(s), pos_of(s), True),
    "distance(prey, point 10 20 30)": lambda s: pairwise(pos_of(s, 1), [POINT], False),
    "max_distance(prey, point 10 20 30)": lambda s: max((np.linalg.norm(p - POINT) for p in pos_of(s, 1)), default=-ENDLESS),
    "min_speed(all)": lambda s: min(np.linalg.norm(v) for _, _, v in positions(s)),
    "max_speed(team 2)": lambda s: max(np.linalg.norm(v) for t, _, v in positions(s) if t == 2),
    "min_height(all)": lambda s: min(p[2] for p in pos_of(s)),
    "count(team 1)": lambda s: len(pos_of(s, 1)),
    "components(team 1, 300 m)": lambda s: (links(pos_of(s, 1)) > 300.0).sum() + (len(pos_of(s, 1)) > 0),
    "longest_link(team 1)": lambda s: links(pos_of(s, 1)).max(initial=0.0),
    "time": lambda s: float(s.t[0]),
    "max(prey.pos)": lambda s: np.nanmax(s.read("prey.pos")[0][0]),
    "distance(entity 3, all)": lambda s: ENDLESS,
}  # fmt: skip


@pytest.mark.parametrize("text", [s for s in SIGNALS if "entity" not in s])
def test_signals_are_what_they_say(text):
    mission = MISSION.replace(scene=MISSION.scene.__class__(ground=MISSION.scene.ground or _ground()))
    sim = Simulation(mission, 5)
    monitor = trace(text, sim)
    expected = seen(sim, SIGNALS[text])
    name = "time()" if text == "time" else text
    np.testing.assert_allclose(monitor.trace(0)[name], expected, rtol=1e-12)


def _ground():
    from tussle.scene import FlatGround

    return FlatGround()


def test_clearance_is_the_distance_from_walls():
    from tussle.scene import Cuboid, Scene

    mission = MISSION.replace(scene=Scene(walls=(Cuboid(center=(0.0, 0.0, 0.0), lengths=(2.0, 2.0, 2.0)),)))
    sim = Simulation(mission, 5)
    sim.write("prey.pos", np.full((1, 12, 3), 90.0))
    pos = np.array(sim.read("prey.pos")[0])
    pos[0, 3] = (11.0, 0.5, 0.0)
    sim.write("prey.pos", pos)
    assert trace("clearance(prey)", sim).trace(0)["clearance(prey)"][0] == pytest.approx(10.0, abs=0.002)


def test_inside_counts():
    mission = read_mission("capture_the_flag").mission
    regions = [r for p in mission.world_plugins for r in p.regions()]
    sim = Simulation(mission, 1)
    number = regions[0].boundary
    expected = sum(int(regions[0].shape.contains(np.array(p)[:, None])[0]) for p in pos_of(sim))
    assert trace(f"inside(all, {number})", sim).trace(0)[f"inside(all, {number})"][0] == expected


def test_the_sweep_over_large_swarms_is_the_least_of_all_pairs():
    mission = read_mission("predator_prey", {"prey": 250, "run.end": 1}).mission
    assert SWEEP_FROM < 250**2
    sim = Simulation(mission, 5)
    pos = np.array(pos_of(sim, 1))
    d = np.linalg.norm(pos[:, None] - pos[None], axis=2)
    np.fill_diagonal(d, np.inf)
    assert trace("distance(prey, prey)", sim).trace(0)["distance(prey, prey)"][0] == pytest.approx(
        d.min(), rel=1e-12
    )


@pytest.mark.parametrize("per_second", [0.0, 3.0, 1e6])
@pytest.mark.parametrize("others", [1, 2])
def test_an_approach_is_how_near_two_come_if_they_fly_on(others, per_second):
    sim = Simulation(MISSION, 5)
    sim.step(7)
    bodies = positions(sim)
    mine = [b for b in bodies if b[0] == 1]
    text = f"approach(team 1, team {others}, {per_second:.0f} m/s)"
    found = trace(text, sim).trace(0)[text][-1]
    expected = approach(mine, [b for b in bodies if b[0] == others], per_second)
    assert found == pytest.approx(expected, rel=0.01)
    if per_second == 1e6:  # only what is near now counts
        assert (
            found
            == trace(f"distance(team 1, team {others})", sim).trace(0)[f"distance(team 1, team {others})"][-1]
        )


def test_an_approach_needs_a_pair_and_a_speed():
    sim = Simulation(MISSION, 5)
    alone = "approach(entity 3, entity 3, 1 m/s)"
    assert trace(alone, sim).trace(0)[alone] == [np.inf]
    with pytest.raises(ParameterError, match="approach\\(\\) takes 3 arguments, not 2"):
        trace("approach(all, all)", sim)
    with pytest.raises(ParameterError, match="m/s"):
        trace("approach(all, all, 2 kg)", sim)


SPECS = (
    "always (distance(team 1, team 2) > 5 m) and always[1,3] (distance(team 1, team 1) > 10 m -> eventually[0,1] (max_speed(all) < 40))",
    "lost[1] / start[1] < 0.2 or always (distance(team 1, point 0 0 0) > 100 m)",
)


@pytest.mark.parametrize("text", SPECS)
def test_a_world_has_its_robustness_in_any_stack(text):
    """Alone, stacked, after a reset of its slot, and where the others have ended."""
    mission = MISSION.replace(end=20.0)
    spec = Specification.parse(text, mission)

    def of(seeds, threads=1):
        sim = Simulation(mission, seeds, threads=threads)
        monitor = Monitor(spec, sim)
        sim.run()
        verdicts = [monitor.finish(w) for w in range(len(seeds))]
        again = list(reversed(range(len(seeds))))
        sim.reset(again, seeds)
        monitor.restart(again)
        sim.run()
        assert [monitor.finish(w) for w in again] == verdicts
        return verdicts

    together = of([1, 2, 3, 4, 5], threads=2)
    assert [of([seed])[0] for seed in (1, 2, 3, 4, 5)] == together
    assert len({v.robustness for v in together}) > 1


def test_what_was_known_of_a_game_is_its_prefix():
    sim = Simulation(MISSION, 5)
    monitor = Monitor(Specification.parse(SPECS[0], MISSION), sim)
    so_far = []
    while not sim.is_over:
        sim.step()
        so_far.append(monitor.robustness()[0])
    assert so_far == sorted(so_far, reverse=True)
    assert monitor.finish(0).robustness == so_far[-1]
    verdict = monitor.finish(0)
    place = verdict.first_below(verdict.levels[0])
    assert (place, verdict.first_below(-np.inf)) == (verdict.steps[1], None)
