"""Easy mode for world plugins: one world at a time, with entities and plain numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import Drift, Note, block, mission

from tussle import Simulation
from tussle.api import (
    Autonomy,
    EasyInteraction,
    EasyMetric,
    Interaction,
    Message,
    Metric,
    Param,
    Publish,
    State,
)
from tussle.errors import DeclarationError, PluginError
from tussle.messages import CaptureEntity, EntityCaptured


def referee(function, base=EasyInteraction, **columns):
    """A world plugin that does this in its step."""
    return type("Judge", (base,), {"step_one": function, "__module__": __name__, **columns})


def played(*plugins, seeds=1, steps=1, blocks=(), **values):
    """A simulation with these world plugins after some steps."""
    kinds = {
        "interactions": [p for p in plugins if isinstance(p, Interaction)],
        "metrics": [p for p in plugins if isinstance(p, Metric)],
    }
    default = (block("a", team=1, count=2), block("b", team=2, count=2, position=(10, 0, 0)))
    sim = Simulation(mission(*(blocks or default), **kinds, **values), seeds=seeds)
    sim.step(steps)
    return sim


def failing(function, **columns):
    with pytest.raises(PluginError) as caught:
        played(referee(function, **columns)())
    return str(caught.value)


def test_a_kill_says_whether_it_is_new():
    seen = []

    def kills(self, w):
        first, second, third, _ = w.entities
        seen.append([w.kill(first, "a"), w.kill(first, "b"), w.kill(second, "a"), third.id])

    def masks(self, w):
        seen.append(w.kill([2, 2, 3], "by row").tolist())
        seen.append(w.kill(w.id >= 2, "by mask").tolist())
        seen.append(w.kill([], "nobody").tolist())

    rows = type("Rows", (Interaction,), {"step": masks, "__module__": __name__})
    sim = played(referee(kills)(), rows())
    assert seen == [[True, False, True, 3], [True, False, True], [False, False, False, False], []]
    assert sim.result()[0].alive == {1: 0, 2: 0}


def test_an_entity_that_is_gone_is_none_and_one_that_never_was_is_an_error():
    found = []

    def look(self, w):
        found.append(w.entity(4))
        w.kill(w.entities[-1], "last")

    played(referee(look)(), steps=2)
    assert found[0].id == 4
    assert found[1] is None
    assert "there has been no entity 9; the largest id so far is 4" in failing(lambda self, w: w.entity(9))
    assert "'x' is no id" in failing(lambda self, w: w.entity("x"))


# -- what there is ----------------------------------------------------------------------------------------------------------------


def test_a_world_is_plain_values():
    seen = {}

    def look(self, w):
        entities = [(e.id, e.team) for e in w.entities]
        seen[w.seed] = (
            w.t,
            w.dt,
            w.step_count,
            w.teams,
            w.harm,
            entities,
            w.entity(3).id,
            w.entity(0),
            repr(w),
        )

    plugin = referee(look, harm=Param(0.5))
    played(plugin(), seeds=[7, 8])
    t, dt, step, teams, harm, entities, third, nobody, text = seen[8]
    assert [type(v) for v in (t, dt, step, harm)] == [float, float, int, float]
    assert (t, dt, step, teams, harm) == (0.1, 0.1, 0, [1, 2], 0.5)
    assert (entities, third, nobody, text) == ([(1, 1), (2, 1), (3, 2), (4, 2)], 3, None, "<world 1>")


def test_memory_is_per_world_team_and_entity():
    def count(self, w):
        w.calls += 1
        w.centre = np.mean([e.pos for e in w.entities], axis=0)
        for e in w.entities:
            e.age = e.age + w.dt
            w.seen[e.team] += e.id
        assert dict(w.seen) == {1: 3 * w.calls, 2: 7 * w.calls}
        assert len(w.seen) == 2

    columns = {
        "calls": State(dtype=int, per="world"),
        "centre": State("x y z", per="world"),
        "seen": State(dtype=int, per="team"),
        "age": State(),
    }
    sim = played(referee(count, **columns)(), seeds=[1, 2], steps=3)
    assert sim.read("Judge.calls")[0].tolist() == [3, 3]
    assert sim.read("Judge.centre")[0][0] == pytest.approx([5.3, 0.0, 0.0])
    plugin = sim.state.interactions[0].plugin
    assert plugin.seen.tolist() == [[9, 9], [21, 21]]
    assert plugin.age == pytest.approx(np.full(8, 0.3))


def test_entities_see_each_other():
    def look(self, w):
        first, _, third, _ = w.entities
        assert first.nearest(team="other") == third
        assert [e.id for e in third.near(50.0, team=1)] == [1, 2]
        assert third.nearest(team=1).distance == w.distance(first, third) == 10.0
        assert third.nearest(team=1).offset.tolist() == [-10.0, 0.0, 0.0]
        assert first.nearest(team=2, radius=10.0) is None
        assert [e.id for e in first.nearest(k=3)] == [2, 3, 4]
        w.looked = True

    sim = played(referee(look, looked=State(dtype=bool, per="world"))(), seeds=[1, 2])
    assert sim.read("Judge.looked")[0].all()


# -- what it does -----------------------------------------------------------------------------------------------------------------


class Claims(Autonomy):
    """Claims a target."""

    say = Publish(CaptureEntity)

    def step(self, g):
        self.say.publish(g.id == 1, target=3)


class WorldBinding(EasyInteraction):
    """Judges captures: who claims who is nearer than that has it."""

    reach = Param(20.0, unit="m")

    def step_one(self, w):
        for claim in w.inbox(CaptureEntity):
            if claim.target and w.distance(claim.sender, claim.target) < w.reach:
                w.kill(claim.target, "captured")
                w.publish(
                    EntityCaptured, source=claim.sender, target=claim.target, source_team=claim.sender.team
                )


class Score(EasyMetric):
    """Captures of each team."""

    captures = State(dtype=int, per="team")

    def step_one(self, w):
        for capture in w.inbox(EntityCaptured):
            w.captures[capture.source.team] += 1

    def result_one(self, w):
        return {"score": w.captures, "total": sum(w.captures.values())}


def test_a_referee_and_a_metric():
    blocks = (
        block("a", team=1, autonomy=[Drift(), Claims()]),
        block("b", team=2, count=3, position=(10, 0, 0)),
    )
    sim = played(WorldBinding(), Score(), blocks=blocks, seeds=[1, 2], steps=10)
    assert [r.metrics["Score"] for r in sim.result()] == [{"score": {1: 1, 2: 0}, "total": 1}] * 2
    assert [r.scores for r in sim.result()] == [{1: 1.0, 2: 0.0}] * 2
    assert sim.read("b.pos")[1].tolist() == [[True, False, True]] * 2


def test_entities_are_moved_hurt_pushed_and_born():
    def act(self, w):
        first = w.entities[0]
        if w.step_count == 0:
            w.move(first, pos=(0.0, 50.0, 0.0))
            assert first.pos.tolist() == [0.0, 50.0, 0.0]
            assert first.nearest().distance > 49.0
            first.health -= 0.25
            first.force = (1.0, 2.0, 3.0)
            first.force += (1.0, 0.0, 0.0)
            assert first.force.tolist() == [2.0, 2.0, 3.0]
            w.spawn("b", pos=(1.0, 2.0, 3.0), team=1)

    sim = played(referee(act)(), steps=2, seeds=[1, 2])
    assert sim.read("a.pos")[0][:, 0].tolist() == [[pytest.approx(0.1), 50.0, 0.0]] * 2
    assert sim.read("a.health")[0][:, 0].tolist() == [0.75] * 2
    assert sim.read("b.team")[0].tolist() == [[2, 2, 1]] * 2


def test_start_one_comes_first_and_draws_numbers_of_its_own():
    class Lots(EasyInteraction):
        lot = State(per="world")
        first = State(per="world")
        later = State(per="world")

        def start_one(self, w):
            w.lot = w.uniform()

        def step_one(self, w):
            w.first, w.later = w.uniform(), w.uniform()

    class Arrays(Interaction):
        first = State(per="world")
        later = State(per="world")

        def step(self, w):
            self.first[:], self.later[:] = w.uniform("uniform", 2)

    easy, arrays = played(Lots(name="same"), seeds=[1, 2]), played(Arrays(name="same"), seeds=[1, 2])
    for name in ("first", "later"):
        assert easy.read(f"same.{name}")[0].tobytes() == arrays.read(f"same.{name}")[0].tobytes()
    numbers = np.concatenate([easy.read(f"same.{name}")[0] for name in ("lot", "first", "later")])
    assert len(np.unique(numbers)) == 6


def test_worlds_that_have_ended_are_not_asked_again():
    """A referee that takes for granted that somebody is there is right as long as its world runs."""

    def oldest(self, w):
        w.calls += 1
        assert w.entities[0].id > 0
        if w.step_count == 3 and w.seed == 2:
            for e in w.entities:
                w.kill(e, "all of them")

    sim = played(
        referee(oldest, calls=State(dtype=int, per="world"))(),
        seeds=[1, 2, 3],
        steps=10,
        end_conditions="time, all_dead",
    )
    assert sim.is_over
    assert [r.end for r in sim.result()] == ["time", "all_dead", "time"]
    assert sim.read("Judge.calls")[0].tolist() == [10, 4, 10]


def test_drawings_belong_to_their_world():
    drawn = []

    def draw(self, w):
        w.draw.sphere(pos=w.entities[0].pos, radius=1.0)

    game = mission(block(), interactions=[referee(draw)()])
    sim = Simulation(game, seeds=[1, 2])
    sim.state.context.draw.sinks.append(lambda kind, attributes: drawn.append((kind, attributes["world"])))
    sim.step()
    assert drawn == [("sphere", 0), ("sphere", 1)]


def test_one_without_a_step_is_left_out():
    class AtTheEnd(EasyMetric):
        def result_one(self, w):
            return {"n": len(w.entities)}

    sim = played(AtTheEnd())
    assert not any("AtTheEnd" in call.label for call in sim.schedule)
    assert sim.result()[0].metrics == {"AtTheEnd": {"n": 4}}


def test_an_entity_is_one_of_this_world_and_of_this_call():
    kept = {}

    def of_the_first(self, w):
        kept.setdefault(0, w.entities[0])
        w.kill(kept[0], "x")

    def of_the_step_before(self, w):
        kept.setdefault(w.seed, w.entities[0])
        w.move(kept[w.seed], pos=(1.0, 2.0, 3.0))

    for step, text in (
        (of_the_first, r"w.kill: the entity 1 was found in another world; keep its id, and find it again with w.entity\(1\)"),
        (of_the_step_before, r"w.move: the entity 1 was found in another call"),
    ):  # fmt: skip
        with pytest.raises(PluginError, match=text):
            played(referee(step)(), seeds=[1, 2], steps=2)


# -- errors -----------------------------------------------------------------------------------------------------------------------

COLUMNS = {
    "reach": Param(1.0),
    "n": State(dtype=int, per="world"),
    "pair": State("a b", dtype=int, per="world"),
    "lost": State(dtype=int, per="team"),
    "age": State(),
}


@pytest.mark.parametrize(
    ("step", "text"),
    [
        (lambda self, w: w.entitis, "Judge: w has no 'entitis' (did you mean 'entities'?)"),
        (lambda self, w: w.entities[0].agee, "an entity has no 'agee' (did you mean 'age'?)"),
        (lambda self, w: self.reach, "Judge.reach differs between worlds: read w.reach, not self.reach"),
        (lambda self, w: setattr(w, "clas", 1), "declare clas = State(...)"),
        (lambda self, w: setattr(w, "reach", 1.0), "Judge: w.reach is read-only"),
        (lambda self, w: setattr(w, "t", 1.0), "Judge: w.t is read-only"),
        (lambda self, w: setattr(w, "lost", 1), "Judge: lost has one value per team"),
        (lambda self, w: setattr(w, "age", 1), "Judge: age has one value per entity"),
        (
            lambda self, w: setattr(w.entities[0], "health", None),
            "Judge: an entity's health takes a number, not None",
        ),
        (
            lambda self, w: setattr(w.entities[0], "health", "good"),
            "an entity's health takes a number, not 'good'",
        ),
        (
            lambda self, w: setattr(w.entities[0], "force", (1, 2)),
            "an entity's force takes three numbers, not (1, 2)",
        ),
        (lambda self, w: setattr(w, "n", "many"), "Judge.n takes whole numbers, not 'many'"),
        (lambda self, w: setattr(w, "n", 1.5), "Judge.n takes whole numbers, not 1.5"),
        (lambda self, w: setattr(w, "n", math.nan), "Judge.n takes whole numbers, not nan"),
        (lambda self, w: setattr(w, "n", 10**30), "Judge.n takes whole numbers, not 10000"),
        (lambda self, w: setattr(w, "n", 1e30), "Judge.n takes whole numbers, not 1e+30"),
        (lambda self, w: setattr(w, "pair", (1, 2.5)), "Judge.pair takes whole numbers, not of shape (2,)"),
        (
            lambda self, w: setattr(w, "pair", (1, 2, 3)),
            "Judge.pair takes 2 numbers (a, b), not of shape (3,)",
        ),
        (lambda self, w: w.lost.__setitem__(1, 0.5), "w.lost takes whole numbers, not 0.5"),
        (lambda self, w: w.spawn("a", pos=(0.0, math.nan, 0.0)), "w.spawn: pos is not finite"),
        (lambda self, w: w.spawn("a", quat=(2.0, 0.0, 0.0, 0.0)), "w.spawn: quat has the length 2; it takes"),
        (lambda self, w: w.move(w.entities[0], quat=(0.0,) * 4), "w.move: quat has the length 0; it takes"),
        (lambda self, w: w.lost[9], "w.lost: there is no team 9; there are: 1, 2"),
        (lambda self, w: w.distance(w.entities[0], None), "distance takes two entities"),
        (lambda self, w: w.lost.pop(1), "w.lost has one value per team"),
        (lambda self, w: w.kill(1, "x"), "w.kill takes an entity from w.entities or from a message, not 1"),
        (lambda self, w: setattr(w.entities[0], "pos", (0, 0, 0)), "pos of an entity is read-only"),
        (
            lambda self, w: setattr(w.entities[0], "aeg", 1),
            "an entity's 'aeg' cannot be written (did you mean 'age'?)",
        ),
        (lambda self, w: w.spawn("c"), "w.spawn: there is no block 'c'"),
        (lambda self, w: w.move(w.entities[0], pos=(1.0, 2.0)), "w.move: pos has shape (2, 1)"),
        (lambda self, w: w.publish(Note, valeu=1), "Note has no field 'valeu' (did you mean 'value'?)"),
    ],
)
def test_what_goes_wrong_is_said_in_the_authors_terms(step, text):
    assert text in failing(step, **COLUMNS)


def test_the_world_and_the_line_that_failed_are_named():
    def fail(self, w):
        if w.seed == 8 and w.step_count == 2:
            raise ValueError("not this one")

    sim = Simulation(mission(block(), interactions=[referee(fail)()]), seeds=[7, 8, 9])
    with pytest.raises(PluginError, match=r"Judge, world 1, step 2: test_easy_worlds.py:\d+: ValueError"):
        sim.step(5)


@pytest.mark.parametrize(
    ("result", "text"),
    [
        ({"score": 3.0}, "Judge.result_one: 'score' = 3.0 is not allowed"),
        ({"score": {1: 2.0}}, "Judge.result_one: 'score' has no value for team 2"),
        ({"lost": {1: 2.0, 2: 1.0, 3: 4.0}}, "Judge.result_one: 'lost': there is no team 3; there are: 1, 2"),
        (None, "Judge.result_one returns None; it takes a dict"),
        ({3: 1.0}, "Judge.result_one: 3 is not a name"),
        ({"name": "red"}, "Judge.result_one: 'name' = 'red' is not allowed"),
        (
            {"many": 10**5000},
            "Judge.result_one: 'many' is a whole number of 16,610 bits; it takes up to 1,024",
        ),
    ],
)
def test_results_that_mean_nothing(result, text):
    plugin = referee(lambda self, w: None, EasyMetric, result_one=lambda self, w: result)
    with pytest.raises(PluginError) as caught:
        played(plugin(), steps=10)
    assert text in str(caught.value)


def test_columns_that_hide_what_w_offers_are_refused():
    with pytest.raises(DeclarationError, match=r"Judge.entities: w.entities is an attribute of easy mode"):
        referee(lambda self, w: None, entities=State(per="world"))
    with pytest.raises(
        DeclarationError, match=r"Judge.distance: an entity.distance is an attribute of easy mode"
    ):
        referee(lambda self, w: None, distance=State())


def test_a_published_column_is_not_read():
    assert "w.say cannot be read, only published: w.publish(" in failing(
        lambda self, w: w.say, say=Publish(Note)
    )


# -- stacks -----------------------------------------------------------------------------------------------------------------------


class Unused(Message):
    """Nobody says it."""


def test_an_empty_inbox_is_an_empty_list():
    def look(self, w):
        assert w.inbox(Unused) == []
        w.looked = True

    assert played(referee(look, looked=State(dtype=bool, per="world"))()).read("Judge.looked")[0].all()
