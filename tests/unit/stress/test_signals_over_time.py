"""Coverage and lost messages: signals that have a memory are those of the definition in stacks, after resets and rewinds, and recorded."""

from __future__ import annotations

import numpy as np
import pytest
from recorded_games import hunt

from tussle import Recorder, Simulation
from tussle.api import Autonomy, Field, Message, Publish, Subscribe
from tussle.errors import ParameterError
from tussle.stock import FailingRadio, GlobalNetwork
from tussle.stress import Monitor, RecordedMonitor, Specification, Stress
from tussle.stress.blame import blame
from tussle.view import Recording


class Word(Message):
    """A number."""

    number = Field()


class Chatter(Autonomy):
    """Says a number to all in every third step, and hears what others say."""

    grade = "portable"
    said = Publish(Word, network="FailingRadio")
    heard = Subscribe(Word, network="FailingRadio")

    def step(self, g):
        self.said.publish(np.flatnonzero(g.step_count % 3 == 0), number=1.0)


RADIO = FailingRadio(failure_rate=2.0, outage=0.3)
PLAIN = hunt(n_prey=2, end=15.0)
GAME = PLAIN.replace(
    blocks=[b.replace(autonomy=[*b.autonomy, Chatter()]) for b in PLAIN.blocks], networks=[RADIO]
)
"""Births, deaths, and worlds that end at different times."""
SEEDS = [3, 4, 5, 6]
POINTS = np.array([[0.0, 0.0, 200.0], [40.0, 40.0, 190.0], [80.0, -20.0, 205.0]])
X, Y = np.meshgrid(np.arange(-95.0, 100.0, 10.0), np.arange(-35.0, 40.0, 10.0))


def near(pos, places, reach):
    """Which places have one of some positions nearer than a distance."""
    apart = np.asarray(pos).reshape(-1, 1, 3)[..., : places.shape[1]] - places
    return ((apart**2).sum(axis=-1) < reach**2).any(axis=0)


def of_team(sim, world, team=1):
    bodies = sim.state.population.bodies
    if not sim.state.running[world]:
        bodies = sim.state.parked[world].bodies
    return bodies.pos[:, (bodies.world == world) & (bodies.team == team)].T


def lost(sim, world):
    result = sim.result(is_hashed=False)[world].metrics["FailingRadio"]
    return result["lost_outage"] + result["lost_jammed"]


def known_before(values, of):
    """All of an array's first items, reduced, for each number of them."""
    return [of(values[: k + 1]) for k in range(len(values))]


def rate(values):
    """Of what was lost within 0.5 s, 5 steps."""
    return [(v - values[max(k - 5, 0)]) / 0.5 for k, v in enumerate(values)]


AREA = np.stack([X.ravel(), Y.ravel()], axis=1)
SIGNALS = {
    "coverage_now(team 1, points 0 0 200 40 40 190 80 -20 205, 15 m)": (
        lambda sim, w: near(of_team(sim, w), POINTS, 15.0), lambda seen: seen.mean(axis=1)),
    "coverage_now(team 2, area -100 -40 100 40 by 10 m, 12 m)": (
        lambda sim, w: near(of_team(sim, w, 2), AREA, 12.0), lambda seen: seen.mean(axis=1)),
    "coverage(team 2, area -100 -40 100 40 by 10 m, 12 m)": (
        lambda sim, w: near(of_team(sim, w, 2), AREA, 12.0),
        lambda seen: known_before(seen, lambda s: s.any(axis=0).mean())),
    "coverage(team 1, points 0 0 200 40 40 190 80 -20 205, 50 ft)": (
        lambda sim, w: near(of_team(sim, w), POINTS, 15.24), lambda seen: known_before(seen, lambda s: s.any(axis=0).mean())),
    "messages_sent(FailingRadio)": (lambda sim, w: sim.result(is_hashed=False)[w].metrics["FailingRadio"]["sent"], list),
    "messages_lost(FailingRadio)": (lost, list),
    "loss_rate(FailingRadio, 0.5 s)": (lost, rate),
}  # fmt: skip
"""Signal -> what is read of a world at each moment, and what becomes of all of that."""
TEXT = " and ".join(f"always ({name} >= 0)" for name in SIGNALS)
RECORDED = [name for name in SIGNALS if name.startswith("coverage")]


def monitored(sim):
    """A monitor, and what is read at each step, by signal and world."""
    monitor = Monitor(Specification.parse(TEXT, sim.mission), sim)
    seen = {(name, w): {} for name in SIGNALS for w in range(sim.n_worlds)}

    def read(s):
        for (name, w), found in seen.items():
            found[int(s.steps[w])] = SIGNALS[name][0](s, w)

    sim.observers.append(read)
    return monitor, seen, lambda: read(sim)


def check(sim, monitor, seen):
    for (name, w), found in seen.items():
        values = np.array([found[k] for k in range(int(sim.steps[w]) + 1)])
        np.testing.assert_allclose(
            monitor.trace(w)[name], SIGNALS[name][1](values), rtol=1e-12, err_msg=f"{name} {w}"
        )


def test_a_signal_is_that_of_its_definition_in_a_stack_and_after_resets():
    sim = Simulation(GAME, SEEDS)
    monitor, seen, read = monitored(sim)
    sim.run()
    read()
    assert len(set(sim.steps.tolist())) > 1
    check(sim, monitor, seen)
    lasts = [monitor.trace(w)[name][-1] for name in SIGNALS for w in range(4)]
    assert len({round(x, 9) for x in lasts}) > 12  # they say something
    sim.reset([1, 3], [8, 9])
    monitor.restart([1, 3])
    for key in seen:
        if key[1] in (1, 3):
            seen[key].clear()
    sim.run()
    read()
    check(sim, monitor, seen)


def test_a_game_that_is_rewound_forgets_what_came_later():
    sim = Simulation(GAME, SEEDS[:2])
    monitor, seen, read = monitored(sim)
    sim.step(10)
    saved = sim.snapshot()
    sim.step(20)
    sim.restore(saved)
    sim.write("hunters.pos", sim.read("hunters.pos")[0] + [50.0, 0.0, 0.0])  # another course
    sim.step(7)
    read()
    check(sim, monitor, seen)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_world_has_the_same_trace_alone(seed):
    def traces(seeds):
        sim = Simulation(GAME, seeds)
        monitor = Monitor(Specification.parse(TEXT, GAME), sim)
        sim.run()
        return monitor.trace(seeds.index(seed))

    alone, stacked = traces([seed]), traces(SEEDS)
    assert all(np.array_equal(alone[name], stacked[name]) for name in SIGNALS)


@pytest.mark.parametrize("name", RECORDED)
def test_a_recorded_game_has_the_same_coverage(tmp_path, monkeypatch, name):
    monkeypatch.setattr("tussle.stress.recorded.MAX_ROWS", 300)  # frames in several groups
    text = f"always ({name} < 0.9)"
    with Simulation(PLAIN, 3) as sim, Recorder(sim, tmp_path / "run"):
        monitor = Monitor(Specification.parse(text, PLAIN), sim)
        sim.run()
        expected = monitor.progress(0)
    found = RecordedMonitor(text, Recording(tmp_path / "run")).progress(0)
    for a, b in zip(expected, found, strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_recording_does_not_know_when_messages_were_lost(tmp_path):
    with Simulation(PLAIN.replace(networks=[RADIO]), 3) as sim, Recorder(sim, tmp_path / "run"):
        sim.step(3)
    for text in ("messages_lost(FailingRadio) < 9", "loss_rate(FailingRadio, 1 s) < 9"):
        with pytest.raises(
            ParameterError, match=r"counts messages, which are not recorded.*tussle view --from"
        ):
            RecordedMonitor(f"always ({text})", Recording(tmp_path / "run"))


def test_a_function_of_the_simulation_says_the_same():
    def share(sim):
        return [near(of_team(sim, w, 2), AREA, 12.0).mean() for w in range(sim.n_worlds)]

    name = "coverage_now(team 2, area -100 -40 100 40 by 10 m, 12 m)"
    specs = "always (share() > 0.1)", f"always ({name} > 0.1)"
    found = []
    for text in specs:
        sim = Simulation(GAME, SEEDS)
        monitor = Monitor(Specification.parse(text, GAME, {"share": share}), sim)
        sim.run()
        found.append(monitor.robustness().tolist())
    assert found[0] == found[1]


def test_splitting_goes_by_coverage_and_a_failure_is_due_to_it():
    text = "always (coverage(team 2, area -100 -40 100 40 by 10 m, 12 m) < 0.3)"
    study = Stress(GAME, text)
    assert study.specification.can_guide
    failed = study.sample(4, processes=1).failures[0]
    assert blame(GAME, failed, study.specification) == (text[8:-7],)


REFUSED = {
    "coverage(all, area 0 0 10 by 1 m, 5 m) > 1": "is no area and no points",
    "coverage(all, area 10 0 0 10 by 1 m, 5 m) > 1": "is no area and no points",
    "coverage(all, area 0 0 x 10 by 1 m, 5 m) > 1": "is no area and no points",
    "coverage(all, area 0 0 9 9 by 0 m, 5 m) > 1": "too many squares; at most 100,000",
    "coverage(all, area 0 0 9 9 by 1 cm, 5 m) > 1": "too many squares",
    "coverage(all, area 0 0 9 9 by 1 kg, 5 m) > 1": "kg",
    "coverage(all, points 1 2, 5 m) > 1": "is no area and no points",
    "coverage(all, points 1 2 nan, 5 m) > 1": "is no area and no points",
    "coverage(all, here, 5 m) > 1": "is no area and no points",
    "coverage(wolves, points 1 2 3, 5 m) > 1": "there are no entities",
    "coverage(all, points 1 2 3) > 1": "takes 3 arguments, not 2",
    "messages_lost(FailinRadio) > 1": r"no network 'FailinRadio' that counts lost messages \(did you mean 'FailingRadio'",
    "messages_lost(GlobalNetwork) > 1": "that counts lost messages",
    "loss_rate(FailingRadio, 0 s) > 1": "takes a time of a step or more",
    "loss_rate(FailingRadio, 1 s) > 1 m": "cannot be compared",
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_refused(text):
    with pytest.raises(ParameterError, match=REFUSED[text]):
        Specification.parse(f"always ({text})", GAME.replace(networks=[RADIO, GlobalNetwork()]))
