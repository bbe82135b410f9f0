"""Whatever a reward, an end or an observation reads is what the simulation reports, whether or not something else reads it too."""

from functools import partial

import numpy as np
import pytest
from flee import Flee, mission

from tussle import load_run
from tussle.api.bodies import FLOATS
from tussle.errors import ParameterError
from tussle.rl import (
    Act,
    Computed,
    Own,
    Situation,
    Term,
    alive,
    captured,
    captures,
    collisions,
    make,
    make_swarm,
    make_vec,
    parallel_env,
    record_episode,
)
from tussle.stock import SimpleCapture, SimpleCaptureMetrics, SimpleCollision

KINDS = ("capture", "collision", "death", "flag")
RULES = [SimpleCapture(capture_range=12), SimpleCollision(collision_range=3.0), SimpleCaptureMetrics()]
SEEDS = (1, 2, 3, 4)


class Crowd(Flee):
    """Prey and hunters learn; the latter claim by themselves. Prey that meet collide."""

    mission = mission(interactions=RULES[:2], metrics=RULES[2:])
    learners = "prey hunters"
    observation = (Own("vel", scale=20.0),)
    action = {"prey": Flee.action, "hunters": (Act("Predator.max_speed", 20.0, 40.0),)}  # noqa: RUF012
    reward = {"alive": Term(alive, 0.1)}  # noqa: RUF012


class Reader:
    """A callable of one's own that counts."""

    def __init__(self, kind):
        self.kind = kind

    def __call__(self, now):
        return now.count(self.kind)


def count(now, kind):
    return now.count(kind)


def count_captures(now):
    return now.count("capture")


def count_collisions(now):
    return now.count("collision") + now.count("collision", "other")


OWN = {
    "captures": {
        "function": count_captures,
        "lambda": lambda now: 1.0 * captures(now),
        "partial": partial(count, kind="capture"),
        "object": Reader("capture"),
        "late": lambda now: now.count("capture") if (now.t > 1.0).all() else now.count("capture", "id"),
    },
    "collisions": {"function": count_collisions, "lambda": lambda now: 1.0 * collisions(now)},
    "captured": {"lambda": lambda now: 1.0 * captured(now)},
}


class Recorded:
    """Events of a swarm's simulation by agent, (W, A), from the last step: the independent count."""

    def __init__(self, swarm):
        self.swarm, self.events = swarm, []
        swarm.simulation.events.listen(self.events.append)

    def ids(self):
        """Ids of the agents, -1 for those that are not there."""
        read = self.swarm.simulation.read
        return np.concatenate([read(f"{b.name}.id")[0] for b in self.swarm.task.blocks], axis=1)

    def begin(self):
        self.events.clear()
        self.before = self.ids()

    def count(self, what):
        out = np.zeros(self.before.shape)
        for events in self.events:
            for w, i, other, text in zip(events.world, events.id, events.other, events.text, strict=True):
                both = {"captures": ("capture", (i,)), "collisions": ("collision", (i, other))}
                kind, who = both.get(what, ("death", (i,) if text == "captured" else ()))
                if events.kind == kind:
                    for each in who:
                        out[w] += self.before[w] == each
        return out


def actions_of(swarm, step):
    """Prey turn in circles, so that they meet and are caught."""
    shape = swarm.n_worlds, swarm.n_agents, swarm.action_width
    return np.broadcast_to(np.sin(np.arange(shape[1])[:, None] + 0.1 * step), shape).astype(np.float32)


CASES = [(what, how) for what, ways in OWN.items() for how in ways]


@pytest.mark.parametrize(("what", "how"), CASES)
@pytest.mark.parametrize("autoreset", ["disabled", "same_step", "next_step"])
def test_a_term_of_ones_own_counts_what_happens(what, how, autoreset):
    swarm = make_swarm(Crowd(reward={"own": Term(OWN[what][how])}), len(SEEDS), autoreset=autoreset)
    recorded = Recorded(swarm)
    swarm.reset(seed=SEEDS)
    total = 0
    for step in range(70):
        recorded.begin()
        began = swarm.over.copy() if autoreset == "next_step" else np.zeros(len(SEEDS), bool)
        swarm.step(actions_of(swarm, step))
        want = np.where(began[:, None], 0.0, recorded.count(what))
        np.testing.assert_array_equal(swarm.terms["own"], want)
        total += want.sum()
    assert total > 2


@pytest.mark.parametrize("seed", SEEDS)
def test_the_run_has_the_events_that_are_counted(seed, tmp_path):
    terms = {
        "captures": Term(lambda now: now.count("capture")),
        "collisions": Term(lambda now: now.count("collision") + now.count("collision", "other")),
        "deaths": Term(lambda now: now.count("death")),
    }
    task = Crowd(reward=terms)
    sums = record_episode(task, lambda obs: np.sin(obs[..., :2]), tmp_path / "run", seed=seed)
    kinds = load_run(tmp_path / "run").events["kind"].tolist()
    assert sums == {
        "captures": kinds.count("capture"),
        "collisions": 2 * kinds.count("collision"),
        "deaths": kinds.count("death"),
    }
    assert sums["deaths"] > 0


class Bounded(Crowd):
    """Ends at the first capture; nothing else reads events."""

    def ends(self, now):
        return now.count("capture").sum(axis=1) > 0


@pytest.mark.parametrize("reward", [{}, {"alive": Term(alive)}, {"own": Term(captures)}])
def test_an_end_of_ones_own_sees_events(reward):
    swarm = make_swarm(Bounded(reward=reward), len(SEEDS), autoreset="disabled")
    recorded = Recorded(swarm)
    swarm.reset(seed=SEEDS)
    ends, n_ended = np.zeros(len(SEEDS), bool), 0
    for step in range(55):
        recorded.begin()
        swarm.step(actions_of(swarm, step))
        ends = recorded.count("captures").sum(axis=1) > 0
        is_one_team = ~swarm.alive[:, :6].any(axis=1) | ~swarm.alive[:, 6:].any(axis=1)
        np.testing.assert_array_equal(swarm.over, ends | is_one_team)
        n_ended += ends.sum()
    assert n_ended > 3


def views(task, seed):
    """Name and steps of each view of one world: functions of an action (A, n) that return whether it is over, and what `own` gave."""
    env = make(task)
    env.reset(seed=seed)

    def one(action):
        *_, dead, late, info = env.step(action)
        return dead or late, info["terms"]["own"]

    many = make_vec(task, 2, autoreset="disabled")
    many.reset(seed=[seed, seed + 1])

    def vector(action):
        *_, dead, late, info = many.step(np.stack([action, action]))
        return (dead | late)[0], info["terms"]["own"][0]

    agents = parallel_env(task)
    agents.reset(seed=seed)

    def parallel(action):
        rows = {name: action[agents.possible_agents.index(name)] for name in agents.agents}
        widths = {name: agents.action_space(name).shape[0] for name in rows}
        agents.step({name: row[: widths[name]].astype(np.float32) for name, row in rows.items()})
        return agents.swarm.over[0], agents.swarm.terms["own"].sum()

    return {"Env": one, "VectorEnv": vector, "ParallelEnv": parallel}


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("view", ["Env", "VectorEnv", "ParallelEnv"])
def test_all_views_count(view, seed, tmp_path):
    task = Crowd(reward={"own": Term(lambda now: now.count("death"))})
    step, total, is_over = views(task, seed)[view], 0.0, False
    action = np.tile(np.float32([0.5, 0.3]), (8, 1))
    while not is_over:
        is_over, gave = step(action)
        total += gave
    record_episode(task, lambda obs: action[None], tmp_path / "run", seed=seed)
    assert total == load_run(tmp_path / "run").events["kind"].tolist().count("death") > 0


def test_other_worlds_keep_their_events_when_one_begins():
    """After a step that ended one world, the others still tell what happened."""

    class Restless(Crowd):
        def ends(self, now):
            return np.arange(len(SEEDS)) == 0

    swarm = make_swarm(Restless(), len(SEEDS), autoreset="same_step")
    recorded = Recorded(swarm)
    swarm.reset(seed=SEEDS)
    n_seen = 0
    for step in range(55):
        recorded.begin()
        swarm.step(actions_of(swarm, step))
        assert swarm.over[0]
        want = np.where(swarm.over[:, None], 0.0, recorded.count("captures"))
        np.testing.assert_array_equal(captures(swarm.now), want)
        n_seen += want.sum()
    assert n_seen > 2


# -- all that can be read ---------------------------------------------------------------------------------------------------


def all_of(now):
    """Everything that a situation tells, by name, (W, A, ...), (A,) or (W,); found by its attributes, so that new ones are tested."""
    names = {k for k in vars(now) if not k.startswith("_")} | {
        k for k, v in vars(Situation).items() if isinstance(v, property)
    }
    told = {name: getattr(now, name) for name in (*names, *FLOATS)}
    told |= {(kind, ids): now.count(kind, ids) for kind in KINDS for ids in ("id", "other")}
    told["metric"] = now.simulation.read("SimpleCaptureMetrics.non_team_captures")[0]
    told.pop("simulation")
    return {name: np.array(value) for name, value in told.items()}


class Expected:
    """The same from the simulation's own columns and events."""

    def __init__(self, swarm):
        self.swarm, self.recorded, self.score = swarm, Recorded(swarm), np.zeros((swarm.n_worlds, 2), int)

    def column(self, name):
        found = [self.swarm.simulation.read(f"{b}.{name}") for b in ("prey", "hunters")]
        values = np.concatenate([v for v, _ in found], axis=1)
        there = np.concatenate([t for _, t in found], axis=1)
        values[~there] = 0
        return values, there

    def begin(self):
        self.recorded.begin()
        self.was_alive, self.t = self.column("id")[1], self.swarm.simulation.t.copy()

    def events(self, kind, ids):
        out = np.zeros(self.was_alive.shape)
        for events in self.recorded.events:
            for w, who in zip(events.world, getattr(events, ids), strict=True):
                out[w] += (self.recorded.before[w] == who) * (events.kind == kind)
        return out

    def all(self, actions, ids):
        is_alive = self.column("id")[1]
        told = {name: self.column(name)[0] for name in FLOATS}
        told |= {(kind, who): self.events(kind, who) for kind in KINDS for who in ("id", "other")}
        bodies = self.swarm.simulation.state.population.bodies
        self.score[:, 1] += told["capture", "id"].sum(axis=1).astype(int)
        return told | {
            "alive": is_alive,
            "was_alive": self.was_alive,
            "died": self.was_alive & ~is_alive,
            "actions": actions,
            "team": np.repeat([1, 2], [6, 2]),
            "t": self.t + 0.1 * self.swarm.task.decide_every,
            "id": ids,
            "rows": np.sort(np.flatnonzero(bodies.id > 0)),
            "agents": np.flatnonzero(is_alive.ravel()),
            "metric": self.score,
        }


@pytest.mark.parametrize("where", ["function", "lambda", "ends", "observation"])
@pytest.mark.parametrize("decide_every", [1, 3])
def test_all_that_can_be_read_is_what_the_simulation_holds(where, decide_every):
    """Whoever reads it is the only one that does."""
    told = []

    def note(now):
        told.append(all_of(now))
        return 0.0

    def seen(simulation):
        told.append(all_of(held[0].now))
        return np.zeros((4, 8, 1))

    class Ending(Crowd):
        def ends(self, now):
            note(now)
            return False

    values = {
        "function": {"reward": {"own": Term(note)}},
        "lambda": {"reward": {"own": Term(lambda now: note(now) + 0.0)}},
        "ends": {"reward": {}},
        "observation": {"reward": {}, "observation": (Computed(1, seen),)},
    }[where]
    task = (Ending if where == "ends" else Crowd)(**values, decide_every=decide_every)
    swarm = make_swarm(task, 4, autoreset="disabled")
    held = [swarm]
    swarm.reset(seed=5)
    expected = Expected(swarm)
    ids = expected.column("id")[0]
    n_events = 0
    for step in range(40 // decide_every):
        expected.begin()
        told.clear()
        actions = actions_of(swarm, step)
        swarm.step(actions)
        want = expected.all(actions, ids)
        for each in told:
            assert each.keys() == want.keys()
            for name, value in each.items():
                ordered = np.sort(value) if name in ("rows", "agents") else value
                np.testing.assert_allclose(ordered, want[name], atol=1e-12, err_msg=str(name))
        n_events += sum(want[kind, "id"].sum() for kind in KINDS)
        assert told
    assert n_events > 5


@pytest.mark.parametrize("kind", ["birth", "end", "captures", "hit", 3])
def test_other_kinds_of_events_are_refused(task, kind):
    swarm = make_swarm(task.replace(reward={"own": Term(lambda now: now.count(kind))}))
    swarm.reset(seed=1)
    with pytest.raises(ParameterError, match=r"count: kind = .*; there are: capture, collision, death, flag"):
        swarm.step(np.zeros((1, 6, 2), np.float32))


def test_ids_of_events_are_id_and_other(task):
    swarm = make_swarm(task.replace(reward={"own": Term(lambda now: now.count("death", ids="world"))}))
    swarm.reset(seed=1)
    with pytest.raises(ParameterError, match="count: ids = 'world' is not allowed"):
        swarm.step(np.zeros((1, 6, 2), np.float32))


def test_an_output_that_nobody_computes_is_refused(task):
    """`Predator` leaves out the channels that no other plugin reads: their columns stay 0."""
    lost = "hunters.Predator.desired_heading"
    swarm = make_swarm(task.replace(reward={"own": Term(lambda now: now.simulation.read(lost)[1][:, :1])}))
    swarm.reset(seed=1)
    with pytest.raises(ParameterError, match=r"desired_heading' is not computed: Predator leaves out"):
        swarm.step(np.zeros((1, 6, 2), np.float32))
    kept = make_swarm(
        Crowd(learners="hunters", observation=(Own("Predator.speed"),), action=Crowd.action["hunters"])
    )
    kept.reset(seed=1)
    kept.step(np.ones((1, 2, 1), np.float32))
    np.testing.assert_array_equal(kept.obs[0, :, 0], kept.simulation.read("hunters.Predator.speed")[0][0])
    observation = (Own("Predator.desired_heading"),)
    swarm = make_swarm(Crowd(learners="hunters", observation=observation, action=Crowd.action["hunters"]))
    swarm.reset(seed=1)
    with pytest.raises(ParameterError, match=r"Own: 'Predator.desired_heading' is not computed"):
        swarm.step(np.ones((1, 2, 1), np.float32))


def test_an_unborn_agent_has_no_events_of_an_earlier_episode(task):
    """Its place had an id in the last episode, which another entity may have in this one."""
    prey, hunters = task.mission.blocks
    late = prey.replace(name="late", rate=2.0, slots=1, first_birth=1.0)
    game = task.mission.replace(blocks=[prey, late, hunters], end=3.0)
    swarm = make_swarm(
        task.replace(mission=game, learners="prey late", reward={"own": Term(captured)}),
        2,
        autoreset="disabled",
    )
    for seed in (1, 2, 3):
        swarm.reset(seed=seed)
        was_there = swarm.alive.copy()
        for _ in range(30):
            swarm.step(np.full((2, 12, 2), -1, np.float32))
            was_there |= swarm.alive
            assert not swarm.now.count("death")[~was_there].any()
            assert (swarm.now.id[~was_there] == -1).all()
        assert was_there.sum() > 14


# -- what is returned -----------------------------------------------------------------------------------------------------------


def stepped(task, worlds=6):
    swarm = make_swarm(task, worlds)
    swarm.reset(seed=1)
    return swarm.step(np.zeros((worlds, 6, 2), np.float32))


@pytest.mark.parametrize("worlds", [1, 4, 6])
def test_values_of_worlds_and_of_agents_are_told_apart(task, worlds):
    """In a stack of as many worlds as agents, a value for each world would be taken for one of each agent."""
    reward = {"east": Term(lambda now: now.pos[..., 0].max(axis=1))}
    with pytest.raises(
        ParameterError, match=rf"Flee: reward 'east' returns shape \({worlds},\); it returns \({worlds}, 6\)"
    ):
        stepped(task.replace(reward=reward), worlds)
    for function in (
        lambda now: now.pos[..., 0].max(axis=1)[:, None],
        lambda now: 1.0 * now.alive,
        lambda now: 2.0,
        lambda now: now.team[None] == 1,
    ):
        stepped(task.replace(reward={"own": Term(function)}), worlds)


def test_rewards_that_are_no_numbers_are_refused(task):
    def apart(now):
        pos = now.simulation.read("prey.pos")[0]
        return np.linalg.norm(pos - pos.mean(axis=1, keepdims=True), axis=-1)

    swarm = make_swarm(task.replace(reward={"apart": Term(apart)}), 2, autoreset="disabled")
    swarm.reset(seed=1)

    def play():
        for _ in range(60):
            swarm.step(np.full((2, 6, 2), -1, np.float32))

    message = r"reward 'apart' is nan for agent \d in world \d; it returns finite numbers"
    with pytest.raises(ParameterError, match=message):
        play()
    with pytest.raises(ParameterError, match="reward 'far' is inf for agent 0"):
        stepped(task.replace(reward={"far": Term(lambda now: np.full((6, 6), np.inf))}))
    for values in (None, "much", 1j, np.full((6, 6), None), np.full((6, 6), "a")):
        with pytest.raises(
            ParameterError, match=r"Flee: reward 'odd' returns \S+, .*; it returns finite numbers"
        ):
            stepped(task.replace(reward={"odd": Term(lambda now, values=values: values)}))


def test_values_of_the_dead_do_not_matter(task):
    """A function may return anything for agents that are not there."""
    own = {"own": Term(lambda now: np.where(now.was_alive, 1.0, np.nan), per="team")}
    swarm = make_swarm(task.replace(reward=own), 2, autoreset="disabled")
    swarm.reset(seed=1)
    for _ in range(55):
        before = swarm.alive.copy()
        swarm.step(np.full((2, 6, 2), -1, np.float32))
        np.testing.assert_array_equal(swarm.rewards, before.sum(axis=1, keepdims=True) * before)
    assert not swarm.alive.all()


@pytest.mark.parametrize(
    "ends", [lambda now: now.count("death").sum(axis=1), lambda now: 1, lambda now: "no"]
)
def test_ends_are_truth_values(task, ends):
    kind = type("Ending", (Flee,), {"ends": lambda self, now: ends(now)})
    with pytest.raises(ParameterError, match=r"Ending.ends returns .* it returns truth values"):
        stepped(kind())


@pytest.mark.parametrize(
    "function",
    [
        lambda simulation: simulation.read("prey.pos")[0][..., :1],  # of one block of two
        lambda simulation: np.zeros((4, 8)),
        lambda simulation: np.zeros((8, 4, 1)),
        lambda simulation: 0.0,
        lambda simulation: np.full((4, 8, 1), "a"),
        lambda simulation: np.full((4, 8, 1), None),
    ],
)
def test_an_observation_has_a_row_for_each_agent(function):
    swarm = make_swarm(Crowd(observation=(Computed(1, function),)), 4)
    with pytest.raises(
        ParameterError, match=r"Computed: the function returns shape \(.*\)( of \S+)?; it returns \(4, 8, 1\)"
    ):
        swarm.reset(seed=1)


def test_an_observation_is_a_number(task):
    observation = (Computed(1, lambda simulation: 1.0 / simulation.read("prey.vel")[0][..., :1].clip(0, 0)),)
    with (
        pytest.raises(ParameterError, match=r"Computed: agent 0 in world 0 observes \[inf\]"),
        np.errstate(all="ignore"),
    ):
        make_swarm(task.replace(observation=observation), 2).reset(seed=1)


def test_a_misspelt_column_names_the_nearest(task):
    for name, near in (
        ("alve", "alive"),
        ("poss", "pos"),
        ("diedd", "died"),
        ("neerest", "nearest"),
        ("yaww", "yaw"),
    ):
        with pytest.raises(AttributeError, match=rf"a situation has no {name!r} \(did you mean {near!r}\?\)"):
            stepped(task.replace(reward={"own": Term(lambda now, name=name: getattr(now, name))}))


def test_derived_columns_are_those_of_the_simulation(task):
    swarm = make_swarm(task, 3, autoreset="disabled")
    swarm.reset(seed=1)
    for _ in range(40):
        swarm.step(np.ones((3, 6, 2), np.float32))
        for name in ("yaw", "climb", "roll", "forward"):
            values, there = swarm.simulation.read(f"prey.{name}")
            values[~there] = 0.0
            np.testing.assert_array_equal(getattr(swarm.now, name), values)
