"""What goes wrong while a simulation runs: who is told, in which words, and that nobody else notices."""

from __future__ import annotations

import traceback

import numpy as np
import pytest
from small_worlds import Drift, Listener, NoteMetric, Talker, Wander, block, mission

from tussle import Simulation
from tussle.api import (
    Autonomy,
    Controller,
    EasyAutonomy,
    Input,
    Interaction,
    Metric,
    MotionModel,
    Output,
    Param,
    Publish,
    Sensor,
    State,
)
from tussle.errors import DeclarationError, MissionError, ParameterError, PluginError
from tussle.messages import CaptureEntity

NEVER = 10**9
STEP, WORLD, STACK = 1234, 17, 20


class Faulty(Autonomy):
    """Wander, but in one step raise, or write a value that is no number."""

    at = Param(NEVER)
    how = Param("raise")
    only_id = Param(0)
    pull = State("x y z")
    n_calls = State(dtype=int)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.n_calls[:] += 1
        self.pull[:] = 0.5 * self.pull + g.normal("pull", 3)
        self.velocity[:] = self.pull
        fails = (g.step_count == self.at) & ((self.only_id == 0) | (g.id == self.only_id))
        if self.how == "raise" and fails.any():
            raise ZeroDivisionError("the author's mistake")
        self.velocity[1, fails] = np.nan


class EasyFaulty(EasyAutonomy):
    at = Param(NEVER)
    n_calls = State(dtype=int)

    def step_one(self, me):
        me.n_calls = me.n_calls + 1
        if round(me.t / 0.1) == me.at and me.id == 2:
            raise ZeroDivisionError("the author's easy mistake")


class FaultyReferee(Interaction):
    at = Param(NEVER)
    n_calls = State(dtype=int, per="world")
    seen = State(per="entity")
    notes = Publish(CaptureEntity)

    def step(self, w):
        self.n_calls[:] += 1
        self.seen[:] += 1.0
        w.bodies.health[:] = w.bodies.health + 1.0
        w.publish(
            CaptureEntity, np.arange(w.n_worlds)[np.bincount(w.world, minlength=w.n_worlds) > 0], target=0
        )
        w.kill(w.id == 99, "never")
        if (w.step_count[w.world] == self.at[w.world]).any():
            raise ZeroDivisionError("the referee's mistake")


def crowd(autonomy, **values):
    extra = values.pop("autonomies", ())
    return mission(block(count=2, variance=(9, 9, 9), autonomy=[autonomy, *extra]), **values)


def line_of(function, text):
    import inspect

    lines, first = inspect.getsourcelines(function)
    return first + next(i for i, line in enumerate(lines) if text in line)


@pytest.mark.parametrize("how", ["raise", "nan"])
def test_step_1234_of_world_17_of_20(how):
    game = crowd(Faulty(how=how), end=130.0, metrics=[NoteMetric()])
    sim = Simulation(
        game,
        seeds=range(STACK),
        params={"a.Faulty.at": [STEP if w == WORLD else NEVER for w in range(STACK)]},
    )
    results = sim.run()
    assert [r.end for r in results] == ["error" if w == WORLD else "time" for w in range(STACK)]
    bad = results[WORLD]
    assert bad.steps == STEP + 1
    assert isinstance(bad.error, PluginError)
    assert (bad.error.plugin, bad.error.world, bad.error.step) == ("Faulty", WORLD, STEP)
    if how == "raise":
        place = f"test_failures.py:{line_of(Faulty.step, 'raise Zero')}"
        assert (
            str(bad.error)
            == f"Faulty, a, world 17, step 1234: {place}: ZeroDivisionError: the author's mistake"
        )
        assert isinstance(bad.error.__cause__, ZeroDivisionError)
    else:
        assert (
            str(bad.error)
            == "Faulty, a 1, world 17, step 1234: output 'velocity_y' = nan is not a finite number"
        )
    whole = Simulation(game, seeds=range(STACK)).run()
    assert [r.state_hash for r in results if r is not bad] == [
        r.state_hash for w, r in enumerate(whole) if w != WORLD
    ]


def test_the_entity_is_named_where_it_is_known():
    game = crowd(Drift(), autonomies=[EasyFaulty()])
    results = Simulation(game, seeds=[1, 2, 3], params={"a.EasyFaulty.at": [NEVER, 4, NEVER]}).run()
    line = line_of(EasyFaulty.step_one, "raise Zero")
    assert (
        str(results[1].error)
        == f"EasyFaulty, a 2, world 1, step 4: test_failures.py:{line}: ZeroDivisionError: the author's easy mistake"
    )
    with pytest.raises(PluginError, match=r"^EasyFaulty, a 2, world 0, step 4: test_failures.py"):
        Simulation(game, params={"a.EasyFaulty.at": 4}).run()


def test_a_call_that_failed_is_made_again_for_the_others_as_if_it_had_not():
    game = crowd(Drift(), autonomies=[EasyFaulty()])
    sim = Simulation(game, seeds=[1, 2, 3], params={"a.EasyFaulty.at": [NEVER, 4, NEVER]})
    sim.run()
    assert sim.read("a.EasyFaulty.n_calls")[0][[0, 2]].tolist() == [[10, 10], [10, 10]]
    assert sim.read("a.EasyFaulty.n_calls")[0][1].tolist() == [4, 4]


def test_alone_the_first_error_is_raised_and_recorded_only_if_asked():
    game = crowd(Faulty(at=3))
    with pytest.raises(PluginError, match="Faulty, a, world 0, step 3"):
        Simulation(game).run()
    results = Simulation(game, on_error="record").run()
    assert results[0].end == "error"
    assert results[0].steps == 4


def test_a_stack_can_be_told_to_raise():
    sim = Simulation(crowd(Faulty()), seeds=[1, 2], params={"a.Faulty.at": [NEVER, 3]}, on_error="raise")
    with pytest.raises(PluginError, match="world 1, step 3"):
        sim.run()


def test_when_the_last_of_all_worlds_fails_it_is_raised_unless_records_are_asked_for():
    game, at = crowd(Faulty()), {"a.Faulty.at": [3, 5]}
    sim = Simulation(game, seeds=[1, 2], params=at)
    with pytest.raises(PluginError, match="world 1, step 5"):
        sim.run()
    results = Simulation(game, seeds=[1, 2], params=at, on_error="record").run()
    assert [(r.end, r.steps) for r in results] == [("error", 4), ("error", 6)]


def test_several_worlds_fail_each_in_its_step():
    results = Simulation(crowd(Faulty()), seeds=[1, 2, 3, 4], params={"a.Faulty.at": [2, NEVER, 2, 7]}).run()
    assert [(r.end, r.steps) for r in results] == [("error", 3), ("time", 10), ("error", 3), ("error", 8)]
    assert "world 2, step 2" in str(results[2].error)


def test_the_plugins_behind_a_failed_one_do_not_take_the_others_along():
    """Autonomy, controller, referee and metric all raise in world 1, and each only there."""

    class Picky(Controller):
        at = Param(NEVER)
        wanted = Input("velocity_x velocity_y velocity_z", unit="m/s")
        velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

        def step(self, g):
            self.velocity[:] = self.wanted
            if (g.step_count == self.at).any():
                raise ValueError("picky")

    game = mission(
        block(count=2, variance=(9, 9, 9), autonomy=Faulty(), controller=Picky()),
        interactions=[FaultyReferee()],
        metrics=[NoteMetric()],
        motion_multiplier=2,
    )
    at = [NEVER, 4, NEVER]
    paths = ("a.Faulty.at", "a.Picky.at", "FaultyReferee.at")
    whole = Simulation(game, seeds=[1, 2, 3]).run()
    for chosen in (paths, paths[1:], paths[2:], (paths[0], paths[2])):
        results = Simulation(game, seeds=[1, 2, 3], params=dict.fromkeys(chosen, at)).run()
        assert [r.end for r in results] == ["time", "error", "time"]
        assert [results[0].state_hash, results[2].state_hash] == [whole[0].state_hash, whole[2].state_hash]
        first = {"a.Faulty.at": "Faulty, a", "a.Picky.at": "Picky, a", "FaultyReferee.at": "FaultyReferee"}[
            chosen[0]
        ]
        assert str(results[1].error).startswith(f"{first}, world 1, step 4: test_failures.py")
    pair = Simulation(game, seeds=[1, 2], params={path: [NEVER, 4] for path in paths}).run()
    assert [r.end for r in pair] == ["time", "error"]
    assert pair[0].state_hash == whole[0].state_hash


@pytest.mark.parametrize("rate", [None, 5.0])
def test_what_a_failed_referee_did_is_undone_and_done_again_without_the_world(rate):
    game = crowd(Drift(), interactions=[FaultyReferee(rate=rate)])
    sim = Simulation(game, seeds=[1, 2, 3], params={"FaultyReferee.at": [NEVER, 4, NEVER]})
    results = sim.run()
    n = 10 if rate is None else 5
    assert [r.end for r in results] == ["time", "error", "time"]
    assert sim.read("FaultyReferee.n_calls")[0][[0, 2]].tolist() == [n, n]
    assert sim.read("a.health")[0][[0, 2]].tolist() == [[1.0 + n] * 2] * 2
    assert results[0].state_hash == Simulation(game, seeds=1).run()[0].state_hash


def test_a_referee_with_a_rate_fails_alone_when_clocks_differ():
    game = crowd(Drift(), interactions=[FaultyReferee(rate=5.0)])
    sim = Simulation(game, seeds=[1, 2, 3], params={"FaultyReferee.at": [NEVER, 4, NEVER]})
    sim.step()
    sim.reset([0])
    results = sim.run()
    assert [r.end for r in results] == ["time", "error", "time"]
    assert results[0].state_hash == Simulation(game, seeds=1).run()[0].state_hash


def test_an_autonomy_with_a_rate_fails_alone_when_clocks_differ():
    game = crowd(Drift(), autonomies=[EasyFaulty(rate=5.0)])
    sim = Simulation(game, seeds=[1, 2, 3], params={"a.EasyFaulty.at": [NEVER, 4, NEVER]})
    sim.step()
    sim.reset([0])
    results = sim.run()
    assert [r.end for r in results] == ["time", "error", "time"]
    assert "EasyFaulty, a 2, world 1, step 4" in str(results[1].error)
    assert results[0].state_hash == Simulation(game, seeds=1).run()[0].state_hash


def test_messages_of_a_call_that_failed_are_not_sent_twice():
    class Chatty(Talker):
        at = Param(NEVER)

        def step(self, g):
            super().step(g)
            if (g.step_count == self.at).any():
                raise ValueError("chatty")

    game = mission(block(count=2, autonomy=[Drift(), Chatty(), Listener()]), metrics=[NoteMetric()])
    sim = Simulation(game, seeds=[1, 2, 3], params={"a.Chatty.at": [NEVER, 4, NEVER]})
    results = sim.run()
    assert [r.metrics["NoteMetric"]["n_notes"] for r in results] == [20, 8, 20]
    assert sim.read("a.Listener.n_heard")[0][0].tolist() == [18, 18]


def test_a_motion_model_that_raises():
    class Brittle(MotionModel):
        at = Param(NEVER)
        x = State("x y z", unit="m")
        velocity = Input("velocity_x velocity_y velocity_z", unit="m/s")

        @staticmethod
        def derivative(velocity_x, velocity_y, velocity_z):
            return velocity_x, velocity_y, velocity_z

        def from_body(self, body, rows):
            self.x[:, rows] = body.pos[:, rows]

        def to_body(self, body):
            body.pos[:] = self.x
            if (body.step_count == self.at).any():
                raise ValueError("brittle")

    game = mission(block(count=2, variance=(9, 9, 9), autonomy=Wander(), motion=Brittle()))
    results = Simulation(game, seeds=[1, 2, 3], params={"a.Brittle.at": [NEVER, 4, NEVER]}).run()
    assert [r.end for r in results] == ["time", "error", "time"]
    assert str(results[1].error).startswith("Brittle, a, world 1, step 4: test_failures.py:")
    assert results[0].state_hash == Simulation(game, seeds=1).run()[0].state_hash


def test_a_motion_model_that_leaves_the_numbers_is_named():
    class Explosive(MotionModel):
        x = State("x", unit="m")

        @staticmethod
        def derivative(x):
            return 1e200 * x * x + 1.0

        def from_body(self, body, rows):
            self.x[:, rows] = 0.0

        def to_body(self, body):
            body.pos[0] = self.x

    class Idle(Autonomy):
        def step(self, g):
            pass

    with pytest.raises(
        PluginError,
        match=r"^Explosive, a 1, world 0, step \d+: the entity's state is not finite: pos = .*; all of its inputs are",
    ):
        Simulation(mission(block(autonomy=Idle(), motion=Explosive()))).run()


def test_a_controllers_nan_is_the_controllers():
    class Sloppy(Controller):
        wanted = Input("velocity_x velocity_y velocity_z", unit="m/s")
        velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

        def step(self, g):
            self.velocity[:] = self.wanted / 0.0 if g.step_count[0] == 3 else self.wanted

    with (
        np.errstate(all="ignore"),
        pytest.raises(
            PluginError,
            match=r"^Sloppy, a 1, world 0, step 3: output 'velocity_x' = inf is not a finite number",
        ),
    ):
        Simulation(mission(block(controller=Sloppy()))).run()


def test_a_sensor_that_raises():
    class Blind(Sensor):
        at = Param(NEVER)
        seen = Output()

        def step(self, g):
            self.seen[:] = 1.0
            if (g.step_count == self.at).any():
                raise ValueError("blind")

    game = mission(block(count=2, sensor=Blind()))
    results = Simulation(game, seeds=[1, 2], params={"a.Blind.at": [NEVER, 2]}).run()
    assert [r.end for r in results] == ["time", "error"]
    assert str(results[1].error).startswith("Blind, a, world 1, step 2")


@pytest.mark.parametrize("hook", ["start", "result", "spawn"])
def test_hooks_that_raise_are_named(hook):
    class Starter(Metric):
        def start(self, w):
            if hook == "start":
                raise ValueError("hooked")

        def result(self, w):
            if hook == "result":
                raise ValueError("hooked")
            return {}

    class Spawner(Autonomy):
        def spawn(self, g, rows):
            if hook == "spawn":
                raise ValueError("hooked")

        def step(self, g):
            pass

    with pytest.raises(PluginError, match=r"(Starter|Spawner), .*test_failures.py:\d+: ValueError: hooked"):
        Simulation(mission(block(autonomy=[Drift(), Spawner()]), metrics=[Starter()])).run()


# -- what plugins may not do ----------------------------------------------------------------------------------------------------


def failing(step, **columns):
    """The message of an autonomy whose step is wrong."""
    kind = type(
        "Wrong",
        (Autonomy,),
        {"step": step, "n": State(dtype=int), "gain": Param(1.0), "speed": Input(optional=True), **columns},
    )
    with pytest.raises(PluginError) as caught:
        Simulation(mission(block(autonomy=[Drift(), kind()]))).step()
    return str(caught.value)


def put(name, value):
    def step(self, g):
        setattr(self, name, value)

    return step


def write(path):
    def step(self, g):
        array = g
        for name in path.split("."):
            array = getattr(self if name == "self" else array, name) if name != "self" else self
        array[:] = 1.0

    return step


def test_undeclared_attributes_are_refused():
    text = failing(put("count", 3))
    assert "Wrong.count is not declared" in text
    assert (
        "one plugin object serves all entities, so memory goes into a column: count = State(...) on the class"
        in text
    )
    assert "(did you mean 'gain'?)" in failing(put("gian", 3))


def test_columns_are_written_into_not_replaced():
    assert "Wrong.n is a column: write into it with self.n[:] = value" in failing(put("n", 3))
    assert "Wrong.n is a column" in failing(put("n", np.zeros(1)))


def test_adding_in_place_is_writing_into_the_column():
    class Adds(Autonomy):
        n = State(dtype=int)

        def step(self, g):
            self.n += 2

    sim = Simulation(mission(block(autonomy=[Drift(), Adds()])))
    sim.step(3)
    assert sim.read("a.Adds.n")[0][0, 0] == 6


@pytest.mark.parametrize(
    "path", ["self.gain", "self.speed", "pos", "vel", "quat", "team", "yaw", "bodies.pos", "bodies.yaw", "id"]
)
def test_what_is_not_its_own_is_read_only(path):
    assert "read-only" in failing(write(path))


def test_a_world_plugin_moves_by_w_move_only():
    class Pusher(Interaction):
        def step(self, w):
            w.bodies.pos[:] = 0.0

    with pytest.raises(PluginError, match=r"Pusher, world 0, step 0: test_failures.py.*read-only"):
        Simulation(mission(interactions=[Pusher()])).step()


def test_entities_do_not_kill():
    assert "g has no 'kill'" in failing(lambda self, g: g.kill([0], "me"))


def test_names_that_are_not_there_are_told_with_those_that_are():
    assert "g has no 'possition' (did you mean 'position'?)" not in failing(lambda self, g: g.possition)
    assert "g has no 'poss' (did you mean 'pos'?); there are: pos, vel" in failing(lambda self, g: g.poss)
    assert "bodies have no column 'vle' (did you mean 'vel'?)" in failing(lambda self, g: g.bodies.vle)
    assert "teams = 'mine' is not allowed; it is 'own', 'other', a team number or None" in failing(
        lambda self, g: g.near(5.0, teams="mine")
    )
    assert "there is no shape 'circle'; there are: points, line" in failing(lambda self, g: g.draw.circle())
    assert "values of pairs have shape (3,)" in failing(lambda self, g: g.near(5.0).sum(np.zeros(3)))


@pytest.mark.parametrize(
    ("step", "message"),
    [
        (lambda me: me.sped, r"me has no 'sped' \(did you mean 'speed'\?\); there are: n, gain, speed"),
        (
            lambda me: setattr(me, "pos", 0),
            r"me.pos is read-only: an autonomy decides, its motion model moves a 1 of world 0",
        ),
        (lambda me: setattr(me, "gain", 0), r"me.gain is read-only: it is a Param of Easy"),
        (lambda me: setattr(me, "other", 0), r"Easy.other is not declared"),
        (lambda me: me.publish("notes"), r"Easy publishes no 'notes'; there are: claims"),
        (
            lambda me: me.publish("claims", targt=1),
            r"CaptureEntity has no field 'targt' \(did you mean 'target'\?\)",
        ),
        (lambda me: me.nearest().sped, r"another entity has no 'sped'.*there are: pos, vel"),
        (lambda me: me.nearest().pos.__setitem__(0, 1.0), r"read-only"),
    ],
)
def test_easy_mode_says_what_is_wrong(step, message):
    class Easy(EasyAutonomy):
        n = State(dtype=int)
        gain = Param(1.0)
        speed = Output(unit="m/s")
        claims = Publish(CaptureEntity)

        def step_one(self, me):
            step(me)

    with pytest.raises(PluginError, match=message):
        Simulation(mission(block(autonomy=[Drift(), Easy()]), block("b"))).step()


def test_plugins_without_their_method_say_so():
    class Easy(EasyAutonomy):
        def stepone(self, me):
            pass

    class Plain(Autonomy):
        pass

    with pytest.raises(
        DeclarationError, match=r"block 'a': Easy: Easy has no method 'step_one' \(did you mean 'stepone'\?\)"
    ):
        Simulation(mission(block(autonomy=[Drift(), Easy()])))
    with pytest.raises(DeclarationError, match="Plain has no method 'step'"):
        Simulation(mission(block(autonomy=[Drift(), Plain()])))


def test_a_failure_shows_the_plugins_lines_and_not_the_way_through_the_engine():
    class Careless(EasyAutonomy):
        def step_one(self, me):
            return 1.0 / 0.0

    with pytest.raises(PluginError, match="ZeroDivisionError") as caught:
        Simulation(mission(block(autonomy=[Drift(), Careless()]))).step(3)
    lines = "".join(traceback.format_exception(caught.value))
    assert "return 1.0 / 0.0" in lines
    assert "schedule.py" not in lines
    assert "easy.py" not in lines
    assert "During handling" not in lines


def test_a_model_without_to_body_says_so():
    class Half(MotionModel):
        x = State("x y z", unit="m")
        velocity = Input("velocity_x velocity_y velocity_z", unit="m/s")

        @staticmethod
        def derivative(velocity_x, velocity_y, velocity_z):
            return velocity_x, velocity_y, velocity_z

        def from_body(self, body, rows):
            pass

    with pytest.raises(DeclarationError, match="Half has no method 'to_body'"):
        Simulation(mission(block(motion=Half()))).step()


def test_simulations_that_cannot_be():
    with pytest.raises(MissionError, match="Simulation needs a Mission, not"):
        Simulation("game.xml")
    with pytest.raises(MissionError, match="seeds is empty"):
        Simulation(mission(), seeds=[])
    for seed in ("x", 1.5, True):
        with pytest.raises(ParameterError, match=f"seed {seed!r} is not allowed; it takes a whole number"):
            Simulation(mission(), seeds=[seed])
    with pytest.raises(ParameterError, match=r"seed 1.5 is not allowed"):
        Simulation(mission(), seeds=1.5)
    with pytest.raises(ParameterError, match="on_error = 'ignore' is not allowed; it is 'raise' or 'record'"):
        Simulation(mission(), on_error="ignore")
    with pytest.raises(ParameterError, match="threads = 0 is not allowed; it takes a whole number >= 1"):
        Simulation(mission(), threads=0)


def test_a_plugin_that_fails_only_in_company_stops_the_whole():
    """It breaks the promise that a world of a stack is as alone, so there is no world to blame."""

    class Crowded(Autonomy):
        def step(self, g):
            if len(np.unique(g.world)) > 1:
                raise ValueError("too many")

    class CrowdedReferee(Interaction):
        def step(self, w):
            if len(np.unique(w.world)) > 1:
                raise ValueError("too many")

    for game in (crowd(Drift(), autonomies=[Crowded()]), crowd(Drift(), interactions=[CrowdedReferee()])):
        with pytest.raises(
            PluginError,
            match=r"fails in the stack but in none of its worlds alone.*step 0: test_failures.py.*too many",
        ):
            Simulation(game, seeds=[1, 2]).step()
        Simulation(game).step()


def test_names_that_the_api_does_not_have():
    import tussle.api
    import tussle.stock

    with pytest.raises(AttributeError, match=r"module 'tussle.api' has no attribute 'Autonmy'"):
        _ = tussle.api.Autonmy
    with pytest.raises(
        AttributeError, match=r"module 'tussle.stock' has no attribute 'Boid' \(did you mean 'Boids'\?\)"
    ):
        _ = tussle.stock.Boid
    with pytest.raises(
        ParameterError, match=r"there is no plugin 'Boid' \(did you mean 'Boids'\?\); there are: "
    ):
        tussle.stock.load("Boid")
