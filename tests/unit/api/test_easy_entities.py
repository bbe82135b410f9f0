"""Easy mode for entities: the same helpers, the same numbers and the same errors as with arrays."""

from __future__ import annotations

import io
import math
import pdb  # noqa: T100

import numpy as np
import pytest
from small_worlds import VELOCITY, Drift, Reaper, Wander, block, hashes, mission

from tussle import Simulation
from tussle.api import (
    Autonomy,
    EasyAutonomy,
    EasyController,
    EasySensor,
    EntityRef,
    Input,
    Message,
    Output,
    Param,
    Publish,
    State,
    Subscribe,
)
from tussle.declare.columns import Field
from tussle.errors import DeclarationError, ParameterError, PluginError
from tussle.numeric import total
from tussle.stock import SingleIntegrator


def does(function, **columns):
    """An autonomy that does this in its step."""
    return type("Easy", (EasyAutonomy,), {"step_one": function, "__module__": __name__, **columns})


def one_step(*plugins, n=3, others=(), steps=1, **values):
    """A simulation of some entities with these plugins after one step."""
    sim = Simulation(
        mission(block(count=n, variance=(400, 400, 0), autonomy=[Drift(), *plugins]), *others, **values)
    )
    sim.step(steps)
    return sim


def failing(function, **columns):
    with pytest.raises(PluginError) as caught:
        one_step(does(function, **columns)(), others=[block("b", team=1, position=(9.0, 0, 0))])
    return str(caught.value)


# -- values -----------------------------------------------------------------------------------------------------------------------


class Pair(Message):
    """Two numbers, a truth and an entity."""

    where = Field("x y")
    is_true = Field(dtype=bool)
    about = EntityRef()


def test_values_are_plain_python():
    seen = {}

    def look(self, me):
        me.flag = me.id == 2
        me.pair = (1.0, me.id)
        seen[me.id] = (
            me.gain,
            me.n,
            me.flag,
            me.pair,
            me.pos,
            me.team,
            me.health,
            me.t,
            me.dt,
            me.step_count,
            me.choice,
        )

    one_step(
        does(
            look, gain=Param(2.5), n=Param(3), flag=State(dtype=bool), pair=State("a b"), choice=Param("x")
        )()
    )
    gain, n, flag, pair, pos, team, health, t, dt, step, choice = seen[2]
    assert [type(v) for v in (gain, n, flag, team, health, t, dt, step, choice)] == [
        float,
        int,
        bool,
        int,
        float,
        float,
        float,
        int,
        str,
    ]
    assert (gain, n, flag, team, health, t, dt, step, choice) == (2.5, 3, True, 0, 1.0, 0.0, 0.1, 0, "x")
    assert isinstance(pair, np.ndarray)
    assert (pair.shape, pos.shape) == ((2,), (3,))
    assert seen[1][2] is False


def test_a_parameter_may_differ_from_entity_to_entity_and_world_to_world():
    plugin = does(lambda self, me: setattr(me, "double", 2.0 * me.gain), gain=Param(1.0), double=State())
    sim = Simulation(
        mission(block(autonomy=[Drift(), plugin()])), seeds=[1, 2], params={"a.Easy.gain": [3.0, 4.0]}
    )
    sim.step()
    assert sim.read("a.Easy.double")[0].ravel().tolist() == [6.0, 8.0]


def test_spawn_one_sets_the_columns_of_who_is_born():
    def spawn_one(self, me):
        me.home = me.pos + 1.0
        me.luck = me.uniform()

    columns = {"home": State("x y z"), "luck": State(), "drawn": State()}
    plugin = does(lambda self, me: setattr(me, "drawn", me.uniform()), spawn_one=spawn_one, **columns)
    sim = one_step(plugin(), others=[])
    assert np.allclose(sim.read("a.Easy.home")[0] + [[[0.1, 0, 0]]] - 1.0, sim.read("a.pos")[0])
    assert not np.isin(sim.read("a.Easy.luck")[0], sim.read("a.Easy.drawn")[0]).any()


# -- others -----------------------------------------------------------------------------------------------------------------------


class EasyEyes(EasyAutonomy):
    """What one entity after another sees."""

    reach = Param(25.0, unit="m")
    own = State(dtype=int)
    foe = State(dtype=int)
    any_ = State(dtype=int)
    second = State(dtype=int)
    close = State(dtype=int)
    n_near = State(dtype=int)
    far = State(unit="m")
    offset = State("x y z", unit="m")

    def step_one(self, me):
        def number(other):
            return 0 if other is None else other.id

        me.own, me.foe = number(me.nearest(team="own")), number(me.nearest(team="other"))
        me.any_, me.close = number(me.nearest()), number(me.nearest(radius=5.0, team=1))
        two = me.nearest(k=2)
        me.second = two[1].id if len(two) > 1 else 0
        near = me.near(me.reach, team="other")
        me.n_near = len(near)
        assert [o.distance for o in near] == sorted(o.distance for o in near)
        if near:
            me.far, me.offset = near[-1].distance, near[-1].offset
            assert (
                near[-1].distance
                == me.distance(near[-1])
                == math.sqrt(total(v * v for v in near[-1].offset.tolist()))
            )


class ArrayEyes(Autonomy):
    """The same with arrays."""

    reach = Param(25.0, unit="m")
    own = State(dtype=int)
    foe = State(dtype=int)
    any_ = State(dtype=int)
    second = State(dtype=int)
    close = State(dtype=int)
    n_near = State(dtype=int)
    far = State(unit="m")
    offset = State("x y z", unit="m")

    def step(self, g):
        def numbers(other):
            return np.where(other >= 0, g.bodies.id[np.maximum(other, 0)], 0)

        self.own[:] = numbers(g.nearest(teams="own").other[0])
        self.foe[:] = numbers(g.nearest(teams="other").other[0])
        two = g.nearest(2)
        self.any_[:], self.second[:] = numbers(two.other[0]), numbers(two.other[1])
        close = g.nearest(teams=1)
        self.close[:] = np.where(close.distance[0] < 5.0, numbers(close.other[0]), 0)
        near = g.near(self.reach, teams="other")
        self.n_near[:] = near.count
        for row in np.unique(near.row):
            mine = np.flatnonzero(near.row == row)
            last = mine[np.lexsort((near.id[mine], near.distance[mine]))[-1]]
            self.far[row], self.offset[:, row] = near.distance[last], near.offset[:, last]


@pytest.mark.parametrize("n", [1, 3, 150])
def test_easy_mode_sees_what_arrays_see_bit_for_bit(n):
    """Few rows are answered one by one, many at once: the numbers are the same."""
    common = {"count": n, "variance": (900, 900, 100), "scatter_first": True}
    blocks = [
        block(name, team=team, autonomy=[Wander(), EasyEyes(), ArrayEyes()], **common)
        for name, team in (("a", 1), ("b", 2))
    ]
    sim = Simulation(mission(*blocks), seeds=[5, 6, 7])
    sim.step(3)
    for name in EasyEyes.states():
        for team in "ab":
            easy, arrays = (sim.read(f"{team}.{eyes}.{name}")[0] for eyes in ("EasyEyes", "ArrayEyes"))
            assert easy.tobytes() == arrays.tobytes(), name
    assert sim.read("a.EasyEyes.foe")[0].all()


def test_each_entity_may_look_another_way_far():
    seen = {}

    def look(self, me):
        seen[me.id] = [o.id for o in me.near(10.0 * me.id + 1.0)]

    blocks = [block(f"b{i}", position=(10.0 * i, 0, 0), autonomy=[Drift(), does(look)()]) for i in range(5)]
    Simulation(mission(*blocks)).step()
    assert seen == {1: [2], 2: [1, 3, 4], 3: [2, 4, 1, 5], 4: [3, 5, 2, 1], 5: [4, 3, 2, 1]}


def test_others_are_told_apart_and_stay_the_same():
    def look(self, me):
        other = me.nearest()
        assert other == me.near(100.0)[0]
        assert {other, me.nearest()} == {other}
        assert other != me
        assert (me == me.nearest()) is False
        assert me.nearest(k=1) == [other]
        assert repr(other) == f"<entity {other.id} of team 0>"
        assert repr(me) == f"<a {me.id} of world 0>"

    one_step(does(look)())


def test_who_has_seen_many_goes_on_seeing():
    def look(self, me):
        everyone = me.near(1e6)
        assert [o.id for o in everyone] == [o.id for o in me.near(1e6)]
        me.n = len({o.id for o in everyone} | {o.id for o in me.nearest(k=90)})

    assert (one_step(does(look, n=State(dtype=int))(), n=100).read("a.Easy.n")[0] == 99).all()


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda me: me.nearest(team="mine"), "team = 'mine' is not allowed"),
        (lambda me: me.near(5.0, team=True), "team = True is not allowed"),
        (lambda me: me.nearest(k=0), "nearest: k = 0 is not allowed; it takes a whole number >= 1"),
    ],
)
def test_what_cannot_be_asked(call, text):
    assert text in failing(lambda self, me: call(me))


def test_numpy_numbers_do_for_teams():
    def look(self, me):
        me.found = me.nearest(team=np.int64(1)).id

    sim = one_step(does(look, found=State(dtype=int))(), others=[block("b", team=1, position=(9.0, 0, 0))])
    assert (sim.read("a.Easy.found")[0] == 4).all()


# -- messages ---------------------------------------------------------------------------------------------------------------------


def test_messages_are_plain_values_and_entities():
    heard = []

    def talk(self, me):
        heard.extend((me.id, m.sender, m.about, m.where, m.is_true, repr(m)) for m in me.heard)
        if me.id == 1:
            me.publish("say", where=(1.0, 2.0), is_true=True, about=me.nearest())
        if me.id == 2:
            me.publish("say", about=me)

    talker = does(talk, say=Publish(Pair), heard=Subscribe(Pair))
    sim = one_step(talker(), n=2)
    sim.step()
    me, sender, about, where, is_true, text = heard[0]
    assert (me, sender.id, about.id, where.tolist(), is_true) == (1, 1, 2, [1.0, 2.0], True)
    assert (
        text == f"<Pair from <entity 1 of team 0>: where={where!r}, is_true=True, about=<entity 2 of team 0>>"
    )
    me, sender, about, where, is_true, _ = heard[1]
    assert (me, sender.id, about.id, where.tolist(), is_true) == (1, 2, 2, [0.0, 0.0], False)


def test_senders_and_references_that_are_gone_are_none():
    heard = []

    def talk(self, me):
        heard.extend((round(me.t, 1), m.sender and m.sender.id, m.about and m.about.id) for m in me.heard)
        if me.team == 1:
            me.publish("say", about=me)

    talker = does(talk, say=Publish(Pair), heard=Subscribe(Pair))
    blocks = [block(name, team=team, autonomy=[Drift(), talker()]) for name, team in (("a", 0), ("b", 1))]
    Simulation(mission(*blocks, interactions=[Reaper(team=1, at=0.2)], end_conditions="time")).run()
    gone = [m for m in heard if m[0] == 0.2]
    assert gone
    assert all(sender is None and about is None for _, sender, about in gone)
    assert all(sender == about == 2 for t, sender, about in heard if t < 0.2)


def test_messages_are_not_changed_by_who_hears_them():
    def talk(self, me):
        for m in me.heard:
            m.where[0] = 7.0
        me.publish("say", where=(1.0, 2.0))

    with pytest.raises(PluginError, match="read-only"):
        one_step(does(talk, say=Publish(Pair), heard=Subscribe(Pair))(), steps=2)


def test_drawings_belong_to_the_entitys_world():
    drawn = []

    def draw(self, me):
        me.draw.vectors(pos=me.pos, direction=me.forward)

    sim = Simulation(mission(block(count=2, autonomy=[Drift(), does(draw)()])), seeds=[1, 2])
    sim.state.context.draw.sinks.append(lambda kind, attributes: drawn.append((kind, attributes["world"])))
    sim.step()
    assert drawn == [("vectors", 0)] * 2 + [("vectors", 1)] * 2


# -- chance -----------------------------------------------------------------------------------------------------------------------


def test_draws_are_those_of_arrays_one_after_the_other():
    class Easy(EasyAutonomy):
        seen = State("a b c d e")

        def step_one(self, me):
            me.seen = (
                me.uniform("wind"),
                me.uniform("wind"),
                me.normal("gust"),
                me.uniform(),
                me.uniform("wind"),
            )

    class Arrays(Autonomy):
        seen = State("a b c d e")

        def step(self, g):
            a, b, e = g.uniform("wind", 3)
            self.seen[:] = a, b, g.normal("gust"), g.uniform("uniform"), e

    def seen(plugin):
        sim = Simulation(mission(block(count=4, autonomy=[Drift(), plugin])), seeds=[5, 6])
        sim.step(3)
        return sim.read("a.same.seen")[0]

    easy = seen(Easy(name="same"))
    assert easy.tobytes() == seen(Arrays(name="same")).tobytes()
    assert len(np.unique(easy)) == easy.size


def test_one_label_serves_one_law():
    text = failing(lambda self, me: me.uniform("luck") + me.normal("luck"))
    assert "label 'luck' is in use for uniform numbers in this step" in text


# -- errors -----------------------------------------------------------------------------------------------------------------------

COLUMNS = {
    "max_speed": Param(1.0),
    "n": State(dtype=int),
    "goal": State("x y z"),
    "target": EntityRef(),
    "is_on": State(dtype=bool),
    "flags": State("a b", dtype=bool),
    "size_": State(),
    "size": Param(2, structural=True),
}


@pytest.mark.parametrize(
    ("step", "text"),
    [
        (lambda self, me: me.taget, "Easy: me has no 'taget' (did you mean 'target'?)"),
        (lambda self, me: me.nearst(), "me has no 'nearst' (did you mean 'nearest'?)"),
        (lambda self, me: self.max_sped, "Easy has no 'max_sped' (did you mean 'max_speed'?)"),
        (lambda self, me: me.nearest().poss, "another entity has no 'poss' (did you mean 'pos'?)"),
        (lambda self, me: self.max_speed, "Easy.max_speed differs between entities: read me.max_speed"),
        (lambda self, me: self.goal, "Easy.goal differs between entities: read me.goal"),
        (lambda self, me: setattr(self, "n", 1), "Easy.n is a column: write to it with me.n = value"),
        (lambda self, me: setattr(me, "clas", 1), "clas = State(...) in the class"),
        (lambda self, me: setattr(me, "goal", (1.0, 2.0)), "Easy.goal takes 3 numbers (x, y, z)"),
        (lambda self, me: setattr(me, "n", (1.0, 2.0)), "Easy.n takes a whole number, not of shape (2,)"),
        (lambda self, me: setattr(me, "n", None), "Easy.n takes whole numbers, not None"),
        (lambda self, me: setattr(me, "n", math.nan), "Easy.n takes whole numbers, not nan"),
        (lambda self, me: setattr(me, "target", "prey"), "Easy.target takes an entity or None, not 'prey'"),
        *(
            (lambda self, me, i=i: setattr(me, "target", i), f"Easy.target takes an entity or None, not {i}")
            for i in (-1, 1.5, True)
        ),
        (
            lambda self, me: setattr(me, "target", 99),
            "me.target: there has been no entity 99; the largest id",
        ),
        *(
            (lambda self, me, v=v: setattr(me, "is_on", v), f"Easy.is_on takes true or false, not {v!r}")
            for v in (2, -1.0, "yes", None, math.nan)
        ),
        (
            lambda self, me: setattr(me, "flags", (True, 3)),
            "Easy.flags takes true or false, not of shape (2,)",
        ),
        (lambda self, me: setattr(me, "size_", None), "Easy.size_ takes a number, not None"),
        (lambda self, me: setattr(me, "goal", None), "Easy.goal takes 3 numbers (x, y, z), not None"),
        (lambda self, me: setattr(me, "t", 1.0), "me.t is read-only"),
        (lambda self, me: setattr(me.nearest(), "health", 0.0), "Easy: another entity is read-only"),
        (lambda self, me: me.draw.circle(), "there is no shape 'circle'"),
    ],
)
def test_what_goes_wrong_is_said_in_the_authors_terms(step, text):
    assert text in failing(step, **COLUMNS)


def test_truth_values_are_taken_as_what_is_equal_to_them():
    def turn(self, me):
        for given in (True, np.True_, 1, 1.0, np.array(True)):
            me.is_on = False
            me.is_on = given
            me.n += me.is_on is True
        me.flags = (0, 1.0)
        me.n += me.flags.tolist() == [False, True]

    assert (one_step(does(turn, **COLUMNS)()).read("a.Easy.n")[0] == 6).all()


def test_structural_parameters_are_the_plugins():
    def look(self, me):
        me.n = self.size + me.size

    assert (one_step(does(look, **COLUMNS)()).read("a.Easy.n")[0] == 4).all()


def test_a_published_column_is_not_read():
    assert "me.say cannot be read, only published: me.publish('say', ...)" in failing(
        lambda self, me: me.say, say=Publish(Pair)
    )


def test_a_number_that_is_none_is_told_as_with_arrays():
    def nan(self, me):
        me.velocity = (math.nan, 0.0, 0.0)

    class Arrays(Autonomy):
        velocity = Output(VELOCITY, unit="m/s")

        def step(self, g):
            self.velocity[0] = math.nan

    texts = []
    for plugin in (does(nan, velocity=Output(VELOCITY, unit="m/s"))(name="same"), Arrays(name="same")):
        with pytest.raises(PluginError) as caught:
            Simulation(mission(block(autonomy=plugin))).step(2)
        texts.append(str(caught.value))
    assert (
        texts[0] == texts[1] == "same, a 1, world 0, step 0: output 'velocity_x' = nan is not a finite number"
    )


def test_columns_that_hide_what_me_offers_are_refused():
    with pytest.raises(DeclarationError, match=r"Easy.near: me.near is an attribute of easy mode"):
        does(lambda self, me: None, near=Param(1.0))
    assert does(lambda self, me: None, radius=Param(1.0)).params()["radius"].default == 1.0


def test_an_entity_can_fail_its_world():
    def fail(self, me):
        if me.id == 2:
            me.fail("out of fuel")

    with pytest.raises(PluginError, match="Easy, a 2, world 0, step 0: out of fuel"):
        one_step(does(fail)())


def test_the_debugger_stands_in_step_one():
    told = io.StringIO()

    def look(self, me):
        if me.id == 2:
            debugger = pdb.Pdb(
                stdin=io.StringIO("p me.n, me.nearest().id\nup\ncontinue\n"), stdout=told, nosigint=True
            )
            debugger.set_trace()
        me.n = 7

    sim = one_step(does(look, n=State(dtype=int, default=5))(), n=2)
    assert "look()" in told.getvalue()
    assert "(5, 1)" in told.getvalue()
    assert sim.read("a.Easy.n")[0].ravel().tolist() == [7, 7]


# -- the other kinds --------------------------------------------------------------------------------------------------------------


class Steer(EasyController):
    """Passes on what is wanted, at most so much of it."""

    most = Param(2.0, unit="m/s")
    calls = State(dtype=int)
    elapsed = State(unit="s")
    wanted = Input("wanted_x wanted_y wanted_z", unit="m/s")
    velocity = Output(VELOCITY, unit="m/s")

    def step_one(self, me):
        me.calls += 1
        me.elapsed += me.dt
        me.velocity = np.minimum(me.wanted, me.most)


class Wants(Autonomy):
    """Wants to go fast."""

    wanted = Output("wanted_x wanted_y wanted_z", unit="m/s")

    def step(self, g):
        self.wanted[:] = 5.0


def test_a_controller_is_called_in_every_substep():
    game = mission(
        block(count=2, autonomy=Wants(), controller=Steer(), motion=SingleIntegrator()), motion_multiplier=4
    )
    sim = Simulation(game)
    sim.step(2)
    assert sim.read("a.Steer.calls")[0].ravel().tolist() == [8, 8]
    assert sim.read("a.Steer.elapsed")[0].ravel() == pytest.approx([0.2, 0.2])
    assert sim.read("a.vel")[0].ravel().tolist() == [2.0] * 6


class Blur(EasySensor):
    """Believes itself in another place."""

    belief_pos = Output("x y z", unit="m")

    def step_one(self, me):
        me.belief_pos = np.add(me.pos, (100.0 + me.normal(), 0.0, 0.0))


def test_a_sensor_sees_the_truth_and_writes_what_is_believed():
    def look(self, me):
        me.east = me.pos[0]
        me.other = me.nearest().pos[0]

    plugin = does(look, east=State(unit="m"), other=State(unit="m"))
    sim = Simulation(mission(block(count=2, sensor=Blur(), autonomy=[Drift(), plugin()])))
    sim.step(2)
    assert (sim.read("a.Easy.east")[0] > 90.0).all()
    assert (sim.read("a.Easy.other")[0] < 1.0).all()


# -- stacks -----------------------------------------------------------------------------------------------------------------------


class Errant(EasyAutonomy):
    """Uses everything that a row number could get wrong."""

    target = EntityRef()
    velocity = Output(VELOCITY, unit="m/s")
    say = Publish(Pair)
    heard = Subscribe(Pair)
    count = State(dtype=int)

    def step_one(self, me):
        me.target = me.target or me.nearest(team="other")
        me.count += sum(1 for m in me.heard if m.about is not None and m.sender != me)
        pull = 0.0 * me.pos if me.target is None else 0.1 * (me.target.pos - me.pos)
        me.velocity = np.add(pull, (me.normal(), me.uniform(), 0.01 * len(me.near(20.0)) + 0.001 * me.count))
        if me.uniform("say") < 0.3:
            me.publish("say", about=me.target)


def errants():
    common = {"variance": (200, 200, 0), "scatter_first": True, "autonomy": Errant()}
    return mission(
        block("a", count=7, team=1, **common),
        block("b", count=40, team=2, **common),
        interactions=[Reaper(at=0.4)],
        end_conditions="time",
    )


def test_entities_one_after_the_other_and_at_a_rate():
    sequential = errants().replace(update="sequential")
    assert hashes(sequential, [3, 4]) == [hashes(sequential, [seed])[0] for seed in (3, 4)]
    slow = errants().replace(blocks=[b.replace(autonomy=Errant(rate=5.0)) for b in errants().blocks])
    sim = Simulation(slow, seeds=[3, 4])
    sim.step(3)
    sim.reset([0])
    sim.run()
    assert [r.state_hash for r in sim.result()] == hashes(slow, [3, 4])


def test_plugins_are_values_in_easy_mode_too():
    assert Steer() == Steer(most=2.0)
    with pytest.raises(AttributeError, match=r"Steer.calls is an array only inside a simulation"):
        _ = Steer().calls
    with pytest.raises(ParameterError, match="immutable"):
        Steer().most = 3.0


def test_an_entity_is_found_by_its_id():
    seen = []

    def look(self, me):
        other = me.entity(np.int32(2)) if me.id == 1 else None
        if other is not None:
            seen.append(
                (other.id, other.team, other.distance, other == me.nearest(k=9)[-1] or other == me.nearest())
            )
            assert me.entity(2.0) == other
            assert me.entity(0) is None

    one_step(does(look)(), n=2)
    assert [s[0] for s in seen] == [2]
    assert seen[0][2] > 0.0
    assert seen[0][3]


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (99, "there has been no entity 99; the largest id so far is 4"),
        (-1, "-1 is no id"),
        (1.5, "1.5 is no id"),
        (math.nan, "nan is no id"),
        ("2", "'2' is no id"),
    ],
)
def test_an_id_that_nobody_had_is_an_error(number, words):
    message = failing(lambda self, me: me.entity(number))
    assert "me.entity" in message
    assert words in message
