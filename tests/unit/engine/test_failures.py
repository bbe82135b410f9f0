"""What goes wrong while a simulation runs: what is said, who ends, and that a world's own failure is noticed by no other."""

from __future__ import annotations

import traceback

import numpy as np
import pytest
from small_worlds import Drift, Listener, Note, NoteMetric, Talker, Wander, alone, block, mission

from tussle import Simulation
from tussle.api import (
    EVERYONE,
    Autonomy,
    Controller,
    EasyAutonomy,
    Handle,
    Input,
    Interaction,
    Metric,
    MotionModel,
    Network,
    Output,
    Param,
    Publish,
    State,
)
from tussle.errors import DeclarationError, MissionError, ParameterError, PluginError
from tussle.messages import CaptureEntity

NEVER = 10**9
STEP, WORLD, STACK = 1234, 17, 20


def fail(plugin, view, rows=slice(None)):
    """Raise in the step that the plugin is told."""
    if (view.step_count[rows] == plugin.at[rows]).any():
        raise ZeroDivisionError("the author's mistake")


class Faulty(Autonomy):
    """Wander, but in one step raise, fail, or write a value that is no number."""

    at = Param(NEVER)
    how = Param("step", choices=("step", "spawn", "ready", "fail", "nan"), structural=True)
    link = Handle()
    pull = State("x y z")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def open_one(self, row):
        return row.id

    def _raise(self, how, g, rows=slice(None)):
        if how == self.how:
            fail(self, g, rows)

    def spawn(self, g, rows):
        self._raise("spawn", g, rows)

    def ready(self, g):
        self._raise("ready", g)
        return True

    def step(self, g):
        self.pull[:] = 0.5 * self.pull + g.normal("pull", 3)
        self.velocity[:] = self.pull
        self._raise("step", g)
        for row in np.flatnonzero(g.step_count == self.at):
            if self.how == "fail":
                g.fail(row, "its link is down")
            elif self.how == "nan":
                self.velocity[1, row] = np.nan


class EasyFaulty(EasyAutonomy):
    at = Param(NEVER)

    def step_one(self, me):
        if round(me.t / 0.1) == me.at and me.id == 2:
            raise ZeroDivisionError("the author's mistake")


class FaultyMotion(MotionModel):
    at = Param(NEVER)
    hook = Param("to_body", structural=True)
    x = State("x y z", unit="m")
    velocity = Input("velocity_x velocity_y velocity_z", unit="m/s")

    @staticmethod
    def derivative(velocity_x, velocity_y, velocity_z):
        return velocity_x, velocity_y, velocity_z

    def from_body(self, body, rows):
        self.x[:, rows] = body.pos[:, rows]
        if self.hook == "from_body":
            fail(self, body, rows)

    def to_body(self, body):
        body.pos[:] = self.x
        if self.hook == "to_body":
            fail(self, body)


class FaultyReferee(Interaction):
    """Does all that a referee can before it raises."""

    at = Param(NEVER)
    seen = State(per="entity")

    def step(self, w):
        self.seen[:] += 1.0
        w.bodies.health[:] = w.bodies.health + 1.0
        w.publish(Note, np.unique(w.world), value=1)
        w.move(w.id == 1, pos=w.pos[:, w.id == 1] + 1.0)
        w.kill(w.id == 5, "at once")
        w.spawn("b", np.unique(w.world))
        fail(self, w)


class FaultyNetwork(Network):
    at = Param(NEVER)

    def route(self, w, messages):
        fail(self, w)
        return EVERYONE


def broken(*autonomies, network=None, **parts):
    """A mission of two blocks with a faulty plugin or none but the referee; the second block is born by and by."""
    talk = {"network": network.instance_name if network else "GlobalNetwork"}
    autonomy = [Wander(), Talker(**talk), Listener(**talk), *autonomies]
    one = block(count=2, variance=(9, 9, 9), autonomy=autonomy, **parts)
    world = {"interactions": [FaultyReferee()], "metrics": [NoteMetric()]}
    return mission(
        one, one.replace(name="b", rate=10.0, count=20), networks=[network] if network else [], **world
    )


BROKEN = {
    "a.Faulty": lambda: broken(Faulty()),
    "b.Spawn": lambda: broken(Faulty(how="spawn", name="Spawn")),
    "a.Ready": lambda: broken(Faulty(how="ready", name="Ready")),
    "a.EasyFaulty": lambda: broken(EasyFaulty()),
    "a.FaultyMotion": lambda: broken(motion=FaultyMotion()),
    "b.FaultyMotion": lambda: broken(motion=FaultyMotion(hook="from_body")),
    "FaultyReferee": broken,
    "FaultyNetwork": lambda: broken(network=FaultyNetwork()),
}


def crowd(autonomy, **values):
    return mission(block(count=2, variance=(9, 9, 9), autonomy=autonomy), **values)


def line_of(function, text):
    import inspect

    lines, first = inspect.getsourcelines(function)
    return first + next(i for i, line in enumerate(lines) if text in line)


# -- exceptions -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", BROKEN)
def test_an_exception_ends_the_stack(path):
    """Nothing else is left of the step that was broken off: after a reset, all is as in a simulation that is new."""
    game, plugin, at = BROKEN[path](), path.rpartition(".")[2], {f"{path}.at": [NEVER, 4, NEVER]}
    text = rf"{plugin}, .*step 4: test_failures.py:\d+: ZeroDivisionError: the author's mistake"
    with (
        Simulation(game, seeds=[1, 2, 3], params=at) as sim,
        pytest.raises(PluginError, match=f"^{text}") as caught,
    ):
        sim.run()
    assert isinstance(caught.value.cause, ZeroDivisionError)
    with (
        Simulation(game, params={f"{path}.at": 4}) as sim,
        pytest.raises(PluginError, match=", world 0, step 4"),
    ):
        sim.run()
    with (
        Simulation(game, seeds=[1, 2, 3], params=at, on_error="record") as sim,
        Simulation(game, seeds=[1, 2, 3]) as undisturbed,
    ):
        results = sim.run()
        assert [(r.end, r.steps, str(r.error)) for r in results] == [("error", 4, str(caught.value))] * 3
        sim.reset([0, 1, 2], params={f"{path}.at": NEVER})
        assert [r.state_hash for r in sim.run()] == [r.state_hash for r in undisturbed.run()]


def test_entity_and_world_are_named_where_they_are_known():
    game = mission(block(count=2, autonomy=[Drift(), EasyFaulty()]))
    line = line_of(EasyFaulty.step_one, "raise Zero")
    text = (
        f"EasyFaulty, a 2, world 1, step 4: test_failures.py:{line}: ZeroDivisionError: the author's mistake"
    )
    with pytest.raises(PluginError) as caught:
        Simulation(game, seeds=[1, 2, 3], params={"a.EasyFaulty.at": [NEVER, 4, NEVER]}).run()
    assert str(caught.value) == text
    with pytest.raises(PluginError, match=r"^FaultyReferee, world 0, step 4: "):  # a world without anybody
        Simulation(mission(block("b", count=0), interactions=[FaultyReferee(at=4)])).run()
    sim = Simulation(crowd(Faulty()), seeds=[1, 2], params={"a.Faulty.at": [NEVER, 4]})
    sim.step(2)
    sim.reset([1])
    with pytest.raises(PluginError, match=r"^Faulty, a, step 6"):  # as far as any clock is
        sim.run()


@pytest.mark.parametrize("worlds", [1, 3])
def test_a_result_that_raises_ends_the_stack(worlds):
    class Reporter(Metric):
        def result(self, w):
            raise ValueError("no result")

    game, seeds = crowd(Drift(), metrics=[NoteMetric(), Reporter()]), range(worlds)
    text = r"Reporter, result, world 0, step 10: test_failures.py:\d+: ValueError: no result"
    with pytest.raises(PluginError, match=text):
        Simulation(game, seeds=seeds).run()
    results = Simulation(game, seeds=seeds, on_error="record").run()
    assert [(r.end, r.steps, r.metrics) for r in results] == [
        ("error", 10, {"NoteMetric": {"n_notes": 0, "total": 0}})
    ] * worlds


def test_a_start_that_raises_is_named():
    class Starter(Metric):
        def start(self, w):
            raise ValueError("hooked")

    with pytest.raises(
        PluginError, match=r"^Starter, world 0, step 0: test_failures.py:\d+: ValueError: hooked"
    ):
        Simulation(mission(metrics=[Starter()]))


# -- failures of one world --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("how", "text"),
    [("fail", "its link is down"), ("nan", "output 'velocity_y' = nan is not a finite number")],
)
def test_step_1234_of_world_17_of_20(how, text):
    game = crowd(Faulty(how=how), end=130.0, metrics=[NoteMetric()])
    at = {"a.Faulty.at": [STEP if w == WORLD else NEVER for w in range(STACK)]}
    results = Simulation(game, seeds=range(STACK), params=at).run()
    assert [r.end for r in results] == ["error" if w == WORLD else "time" for w in range(STACK)]
    bad = results[WORLD]
    assert bad.steps == STEP + 1
    assert isinstance(bad.error, PluginError)
    assert (bad.error.plugin, bad.error.world, bad.error.step) == ("Faulty", WORLD, STEP)
    assert str(bad.error) == f"Faulty, a 1, world 17, step 1234: {text}"  # of the first that failed
    whole = Simulation(game, seeds=range(STACK)).run()
    others = [w for w in range(STACK) if w != WORLD]
    assert [results[w].state_hash for w in others] == [whole[w].state_hash for w in others]


@pytest.mark.parametrize("how", ["fail", "nan"])
def test_a_failure_is_raised_alone_or_if_asked_and_when_no_world_is_left(how):
    game, at = crowd(Faulty(how=how)), {"a.Faulty.at": [3, 5]}
    with pytest.raises(PluginError, match="world 0, step 3"):
        Simulation(game, params={"a.Faulty.at": 3}).run()
    assert Simulation(game, params={"a.Faulty.at": 3}, on_error="record").run()[0].steps == 4
    with pytest.raises(PluginError, match="world 0, step 3"):
        Simulation(game, seeds=[1, 2], params=at, on_error="raise").run()
    with pytest.raises(PluginError, match="world 1, step 5"):
        Simulation(game, seeds=[1, 2], params=at).run()
    results = Simulation(game, seeds=[1, 2], params=at, on_error="record").run()
    assert [(r.end, r.steps) for r in results] == [("error", 4), ("error", 6)]


def test_several_worlds_fail_each_in_its_step():
    at = {"a.Faulty.at": [2, NEVER, 2, 7]}
    results = Simulation(crowd(Faulty(how="fail")), seeds=[1, 2, 3, 4], params=at).run()
    assert [(r.end, r.steps) for r in results] == [("error", 3), ("time", 10), ("error", 3), ("error", 8)]
    assert "world 2, step 2" in str(results[2].error)


@pytest.mark.parametrize("rate", [None, 5.0])
def test_a_world_fails_alone_when_clocks_differ(rate):
    class DownReferee(Metric):
        at = Param(NEVER)

        def step(self, w):
            for world in np.flatnonzero(w.step_count == self.at):
                w.fail(np.flatnonzero(w.world == world)[0], "its link is down")

    for path in ("a.Faulty", "DownReferee"):
        game = mission(
            block(count=2, variance=(9, 9, 9), autonomy=[Wander(), Faulty(how="fail", rate=rate)]),
            metrics=[DownReferee(rate=rate)],
        )
        sim = Simulation(game, seeds=[1, 2, 3], params={f"{path}.at": [NEVER, 4, NEVER]})
        sim.step()
        sim.reset([0])
        results = sim.run()
        assert [(r.end, r.steps) for r in results] == [("time", 10), ("error", 5), ("time", 10)]
        assert str(results[1].error) == f"{path.rpartition('.')[2]}, a 1, world 1, step 4: its link is down"
        assert [results[k].state_hash for k in (0, 2)] == [alone(game, seed).state_hash() for seed in (1, 3)]


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
        match=r"^Explosive, a 1, world 0, step \d+: .* not finite: pos = .*outputs of its autonomies and controllers are finite",
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
    assert "count = State(...)" in text
    assert "(did you mean 'gain'?)" in failing(put("gian", 3))


def test_columns_are_written_into_not_replaced():
    assert "Wrong.n is a column: write to it with self.n[:] = value" in failing(put("n", 3))
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


def test_a_name_that_is_not_there_is_of_what_the_author_calls_the_view_so_and_methods_are_near_too():
    class Judge(Interaction):
        def step(self, w):
            w.killl([0], "all")

    with pytest.raises(PluginError, match=r"w has no 'killl' \(did you mean 'kill'\?\)"):
        Simulation(mission(interactions=[Judge()])).step()
    assert "g has no 'uniforn' (did you mean 'uniform'?)" in failing(lambda self, g: g.uniforn("a"))

    class Slow(FaultyMotion):
        def to_body(self, body):
            body.poss[:] = 0.0

    with pytest.raises(PluginError, match=r"body has no 'poss' \(did you mean 'pos'\?\)"):
        Simulation(mission(block(motion=Slow()))).step()


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
            r"me.pos is read-only: an autonomy decides, and the motion model moves a 1 of world 0",
        ),
        (lambda me: setattr(me, "gain", 0), r"me.gain is read-only: it is a Param of Easy"),
        (lambda me: setattr(me, "other", 0), r"Easy.other is not declared"),
        (lambda me: me.publish("notes"), r"Easy has no Publish column 'notes'; there are: claims"),
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
    with pytest.raises(
        MissionError,
        match="Simulation needs a Mission, the name of one that ships, or a mission file, not None",
    ):
        Simulation(None)
    with pytest.raises(MissionError, match="seeds is empty"):
        Simulation(mission(), seeds=[])
    with pytest.raises(ParameterError, match=r"seed 1.5 is not allowed"):
        Simulation(mission(), seeds=1.5)
    with pytest.raises(ParameterError, match="on_error = 'ignore' is not allowed; it is 'raise' or 'record'"):
        Simulation(mission(), on_error="ignore")


def test_names_that_the_api_does_not_have():
    import tussle.api
    import tussle.stock

    with pytest.raises(AttributeError, match=r"module 'tussle.api' has no attribute 'Autonmy'"):
        _ = tussle.api.Autonmy
    with pytest.raises(
        AttributeError, match=r"module 'tussle.stock' has no attribute 'Boid' \(did you mean 'Boids'\?\)"
    ):
        _ = tussle.stock.Boid
    with pytest.raises(ParameterError, match=r"there is no plugin 'Boid' \(did you mean 'Boids'\?\)"):
        tussle.plugins.stock.load("Boid")
