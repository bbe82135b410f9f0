"""Plugins that only call kernels, joined into one call of machine code, give the bits that they give one by one."""

import gc

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Input, MotionModel, Output, Param, Publish, State, neighbors, service
from tussle.engine.joined_calls import Joined, JoinedCalls
from tussle.errors import PluginError
from tussle.messages import CaptureEntity
from tussle.mission import read_mission
from tussle.numeric.kernel import kernel
from tussle.numeric.neighbors.chain import kernel_of_chains
from tussle.numeric.replay import Replay, recording
from tussle.stock import (
    Boids,
    NoisyContacts,
    Predator,
    SimpleCapture,
    SingleIntegrator,
    Unicycle,
    UnicyclePID,
)

ALWAYS, NEVER = 1, 10**9
"""Numbers of steps after which calls are joined."""


@kernel("F F F F f8 Fw Fw Fw Fw")
def spiral(x, y, turned, gain, dt, angle, vx, vy, vz):
    for i in range(x.shape[0]):
        angle[i] = turned[i] + gain[i] * dt
        vx[i], vy[i], vz[i] = -gain[i] * y[i] + angle[i], gain[i] * x[i], 0.1 * angle[i]


@kernel("F Fw -> i8")
def counted(x, out):
    n = 0
    for i in range(x.shape[0]):
        n += x[i] > 0.0
    for i in range(x.shape[0]):
        out[i] = n
    return n


class Spiral(Autonomy):
    """Flies in spirals, by a kernel."""

    grade = "portable"
    only_calls_kernels = True
    gain = Param(0.5)
    angle = State(unit="rad")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        x, y, _ = g.components("pos")
        spiral(x, y, self.angle, self.gain, g.dt, self.angle, *self.velocity)


class Counter(Spiral):
    """A kernel of it returns a number, which decides."""

    only_calls_kernels = True

    def step(self, g):
        x, y, _ = g.components("pos")
        if counted(x, self.angle) % 2:
            spiral(y, x, self.angle, self.gain, g.dt, self.angle, *self.velocity)
        else:
            spiral(x, y, self.angle, self.gain, g.dt, self.angle, *self.velocity)


class Fickle(Spiral):
    """Overrides `step` with one that does more, and says nothing of kernels."""

    def step(self, g):
        super().step(g)
        self.velocity[2] = np.sin(g.t)


class Flock(Spiral):
    """Has a neighbour law, and reads a computed column."""

    only_calls_kernels = True
    sight = Param(30.0, unit="m")

    @neighbors("sight", east="sum", n="count")
    @staticmethod
    def near(offset_x, other_yaw):
        return offset_x * 0.01 + other_yaw, True

    def step(self, g):
        found = self.near(g)
        spiral(found.values[0], g.column("yaw"), self.angle, self.gain, g.dt, self.angle, *self.velocity)


def swarm(autonomy, n=40, **changes):
    block = Block(
        name="a", team=1, count=n, placement="uniform", half_width=(50, 50, 10), scatter_first=True,
        autonomy=autonomy, motion=SingleIntegrator(max_speed=40.0),
    )  # fmt: skip
    return Mission(blocks=[block], dt=0.1, end=4.0).replace(**changes)


def steered():
    """Boids with a controller."""
    boids = swarm(Boids(), 30).blocks[0]
    return Mission(
        blocks=[boids.replace(motion=Unicycle(vel_max=40.0), controller=UnicyclePID())],
        dt=0.1,
        end=4.0,
        motion_multiplier=3,
    )


GAME = read_mission("predator_prey").mission
MISSIONS = {
    "predator_prey": GAME.replace(end=30.0),
    "substeps": GAME.replace(end=8.0, motion_multiplier=5),
    "steered": steered(),
    "a kernel": swarm(Spiral()),
    "a law": swarm(Flock()),
    "fickle": swarm(Fickle()),
    "decides": swarm(Counter()),
    "in view": swarm(Boids(fov_az="200 deg"), 60, end=6.0),
    "historic means": swarm(Boids(averaging="historic"), 60, end=6.0),
}
NOT_JOINED = "fickle", "decides"


@pytest.fixture
def replays(monkeypatch):
    """The replays of all simulations, with the number of kernels that ran in each."""
    found, replay = [], JoinedCalls._replay
    monkeypatch.setattr(
        JoinedCalls, "_replay", lambda self, joined: found.append(joined) or replay(self, joined)
    )
    return found


def started(mission, seeds, steady):
    simulation = Simulation(mission, seeds=seeds)
    simulation.state.context.steady_steps = steady, steady
    return simulation


def pair(mission, seeds=(1,), act=lambda simulation, step: None, steps=40):
    """State hashes of two simulations in which the same is done before each step, joined and not."""
    hashes = []
    for steady in (ALWAYS, NEVER):
        with started(mission, seeds, steady) as simulation:
            for step in range(steps):
                act(simulation, step)
                simulation.step()
            hashes.append([simulation.state_hash(world) for world in range(len(seeds))])
    return hashes


@pytest.mark.parametrize("name", MISSIONS)
@pytest.mark.parametrize("seeds", [[1], [2, 3, 4]], ids=["alone", "stack"])
def test_the_bits_are_those_of_the_calls_one_by_one(name, seeds, replays):
    mission = MISSIONS[name]
    joined, apart = pair(mission, seeds, steps=round(mission.end / mission.dt))
    assert joined == apart
    assert (len(replays) > 0.3 * mission.steps / len(seeds)) == (name not in NOT_JOINED)


def test_onlookers_that_compute_columns_change_nothing(replays):
    def look(simulation, step):
        bodies = simulation.state.population.bodies
        if step % 3 == 0 or step < 5:
            for name in ("yaw", "level_forward", "forward"):
                bodies.derived(name)
            for group in simulation.state.population.groups:
                for view in group.views:
                    view.column("yaw")
            bodies.by_place(bodies.index(200.0), "level_forward")

    for mission in (swarm(Flock()), MISSIONS["predator_prey"]):
        looked = pair(mission, act=look)
        assert looked[0] == looked[1] == pair(mission)[0]
    assert len(replays) > 40


def test_what_is_written_between_steps_counts(replays):
    def act(simulation, step):
        if step == 12:
            simulation.write("prey.Boids.comms_range", 60.0)
        if step == 20:
            values, _ = simulation.read("keepers.Predator.max_speed")
            simulation.write("keepers.Predator.max_speed", 0.5 * values)
        if step == 25:
            simulation.write("prey.pos", simulation.read("prey.pos")[0] * 0.5)
        if step == 30:
            simulation.reset([1], seeds=[77], params={"prey.Boids.max_speed": 12.0})

    joined, apart = pair(GAME, [5, 6], act)
    assert joined == apart
    assert len(replays) > 10


def test_a_restored_game_goes_on_as_it_did(replays):
    with started(GAME, [3], ALWAYS) as simulation:
        simulation.step(15)
        saved = simulation.snapshot()
        simulation.step(30)
        first = simulation.state_hash()
        simulation.restore(saved)
        simulation.step(30)
        assert simulation.state_hash() == first
    assert len(replays) > 30


def few_spans(simulation):
    """Let the room for the spans of blocks be too small, as if entities had come nearer to each other than it was made for."""
    for view in simulation.state.population.groups[0].views:
        for kept in view.kept.values():
            if isinstance(kept, Joined):
                bound, words = kept.replay._bound, kept.replay._call[3]
                k = next(k for k, each in enumerate(bound) if each._kernel is kernel_of_chains())
                words[sum(len(each.words) for each in bound[:k]) + bound[k].at[4][2]] = 1


def many_claims(simulation):
    """Let all prey come into the range of the hunter."""
    simulation.write("prey.pos", 0.02 * simulation.read("prey.pos")[0])


@pytest.mark.parametrize("happens", [few_spans, many_claims])
def test_where_the_room_does_not_suffice_python_goes_on(happens, monkeypatch):
    block = swarm(Boids(), 300).blocks[0].replace(name="prey", motion=Unicycle(vel_max=30.0))
    hunter = block.replace(
        name="hunter", team=2, count=1, position=(0, 0, 0), scatter_first=False,
        autonomy=Predator(prey_team_id=1, capture_range=3.0), motion=Unicycle(vel_max=0.1),
    )  # fmt: skip
    mission = Mission(blocks=[block, hunter], dt=0.1, end=60.0, interactions=[SimpleCapture()])
    stops, run = [], Replay.run

    def watched(replay):
        done = run(replay)
        stops.append(done < len(replay._bound))
        return done

    monkeypatch.setattr(Replay, "run", watched)
    joined, apart = pair(
        mission,
        act=lambda simulation, step: happens(simulation) if step == 8 else None,
        steps=16,
    )
    assert joined == apart
    assert stops.count(False) > 2
    assert True in stops


def test_a_stack_that_loses_worlds_and_calls_that_are_inserted(replays):
    def act(simulation, step):
        if step == 10:
            simulation.schedule.insert(before="motion", call=lambda s: s.write("prey.Boids.speed", 9.0))
        if step == 20:
            simulation.schedule.remove(next(c for c in simulation.schedule if c.label == "<lambda>"))
        if step == 30:
            simulation.state.record_failure(1, PluginError("lost"))

    joined, apart = pair(GAME.replace(blocks=GAME.blocks[:1]), [1, 2, 3], act)
    assert joined == apart
    assert len(replays) > 12


def test_an_error_of_what_follows_the_kernels_names_the_plugin(replays):
    class Torn(Spiral):
        """Fails in what it does with what its kernel has written."""

        only_calls_kernels = True

        def step(self, g):
            super().step(g)
            g.finish(lambda: self.look(g))

        def look(self, g):
            if self.angle[0] > 0.5:
                raise ValueError("too far")

    texts = []
    for steady in (ALWAYS, NEVER):
        with (
            started(swarm(Torn()), [1], steady) as simulation,
            pytest.raises(PluginError, match="too far") as found,
        ):
            simulation.run()
        texts.append(str(found.value))
    assert texts[0] == texts[1]
    assert "Torn" in texts[0]
    assert len(replays) > 3


class Breaks(Spiral):
    """Does what its promise excludes, by name."""

    only_calls_kernels = True
    what = Param(
        "time",
        choices=("time", "draws", "steps", "publishes", "shapes", "service", "state", "output", "later"),
    )
    capture = Publish(CaptureEntity)

    @service
    def gait(self, g):
        return 1.0

    def step(self, g):
        if self.what == "time":
            self.angle[:] = g.t
        elif self.what == "draws":
            self.angle[:] = g.uniform("angle")
        elif self.what == "steps":
            g.step(self, self.angle < 0.0)
        elif self.what == "publishes":
            self.capture.publish([0], target=1)
        elif self.what == "shapes":
            g.draw.points(pos=g.pos)
        elif self.what == "service":
            g.call("gait")
        super().step(g)
        if self.what == "state":
            self.angle += 0.1
        elif self.what == "output":
            velocity_x = self.velocity[0]
            np.minimum(velocity_x, 1e9, out=velocity_x)  # has no effect yet
        elif self.what == "later":
            g.finish(lambda: self.angle.fill(1.0))


@pytest.mark.parametrize(
    ("what", "text"),
    [
        ("time", "reads the time"),
        ("draws", "draws 'angle'"),
        ("steps", "steps Breaks for some rows"),
        ("publishes", "publishes before `finish`"),
        ("shapes", "draws shapes before `finish`"),
        ("service", "calls the service 'gait'"),
        ("state", "changes a column without a kernel: .*read-only"),
        ("output", "changes a column without a kernel: .*read-only"),
        ("later", "changes a column without a kernel: .*read-only"),
    ],
)
def test_a_plugin_that_does_more_than_it_promises_is_refused(what, text):
    with (
        started(swarm(Breaks(what=what)), [1], 12) as simulation,
        pytest.raises(PluginError, match=f"Breaks promises only_calls_kernels, but {text}"),
    ):
        simulation.run()


@kernel("F Fw -> b1")
def goes_on(gain, turns):
    for i in range(gain.shape[0]):
        turns[i] += gain[i]
    return turns[0] % 1.5 < 1.0


@kernel("F Fw")
def limited(gain, turns):
    for i in range(gain.shape[0]):
        turns[i] += gain[i]
        if turns[i] > 5.0:
            raise ValueError("too many turns")


@kernel("F F Fw Fw")
def placed(x, v, east, speed):
    for i in range(x.shape[0]):
        east[i], speed[i] = x[i], v[i]


@kernel("F2 I Fw")
def added(items, start, angle):
    for i in range(angle.shape[0]):
        for k in range(start[i], start[i + 1]):
            angle[i] += 0.01 * items[2, k]


class Pausing(Spiral):
    """Writes a state before a kernel decides, which writes another one."""

    only_calls_kernels = True
    turns = State()

    def step(self, g):
        x, y, _ = g.components("pos")
        spiral(x, y, self.angle, self.gain, g.dt, self.angle, *self.velocity)
        if goes_on(self.gain, self.turns):
            spiral(y, x, self.angle, self.gain, g.dt, self.angle, *self.velocity)


class LateLaw(Flock):
    """Writes a state before its law, whose blocks may need more room."""

    only_calls_kernels = True

    def step(self, g):
        x, y, _ = g.components("pos")
        spiral(x, y, self.angle, self.gain, g.dt, self.angle, *self.velocity)
        super().step(g)


class Watcher(Spiral):
    """Reads a list, which is in another array whenever its sensor has written it."""

    only_calls_kernels = True
    contacts = Input(
        fields="id team x y z vx vy vz qw qx qy qz", unit="1 1 m m m m/s m/s m/s 1 1 1 1", ragged=True
    )

    def step(self, g):
        x, y, _ = g.components("pos")
        added(self.contacts.data, self.contacts.start, self.angle)
        spiral(x, y, self.angle, self.gain, g.dt, self.angle, *self.velocity)


class Spring(MotionModel):
    """Its bodies are placed by a kernel, after one that decides."""

    only_calls_kernels = True
    x = State("x v", unit="m m/s")
    turns = State()
    velocity = Input("velocity_x velocity_y velocity_z", unit="m/s")

    @staticmethod
    def derivative(x, v, velocity_x):
        return v, 0.1 * velocity_x - x

    def from_body(self, body, rows):
        self.x[:, rows] = body.pos[0, rows], body.vel[0, rows]

    def to_body(self, body):
        if goes_on(body.radius, self.turns):
            placed(self.x[0], self.x[1], body.pos[0], body.vel[0])


def watched():
    mission = swarm(Watcher())
    return mission.replace(blocks=[mission.blocks[0].replace(sensor=NoisyContacts(max_range=20.0))])


def sprung():
    mission = swarm(Spiral())
    return mission.replace(blocks=[mission.blocks[0].replace(motion=Spring(), radius=0.3)])


@pytest.mark.parametrize(
    "mission",
    [swarm(Pausing(gain=0.2)), swarm(LateLaw(), 300), watched(), sprung()],
    ids=lambda m: type(m.blocks[0].autonomy[0]).__name__,
)
def test_no_kernel_runs_twice_in_a_step_and_no_list_is_read_where_it_was(mission):
    joined, apart = pair(
        mission, [3, 4], lambda simulation, step: few_spans(simulation) if step == 12 else None, steps=20
    )
    assert joined == apart


class Slips(Spring):
    """Does more than its kernels, by name."""

    only_calls_kernels = True
    what = Param("pos", choices=("pos", "state"))

    def to_body(self, body):
        super().to_body(body)
        if self.what == "pos":
            body.pos[2] = 0.0
        else:
            self.turns.fill(0.0)


@pytest.mark.parametrize("what", ["pos", "state"])
def test_a_motion_model_that_does_more_than_it_promises_is_refused(what):
    mission = swarm(Spiral())
    mission = mission.replace(blocks=[mission.blocks[0].replace(motion=Slips(what=what), radius=0.3)])
    with (
        started(mission, [1], 12) as simulation,
        pytest.raises(PluginError, match="Slips promises only_calls_kernels, but changes a column"),
    ):
        simulation.run()


class Doubles(Spiral):
    """Gives a kernel an array that NumPy makes in each step, or a number that differs."""

    only_calls_kernels = True
    what = Param("array", choices=("array", "number"))

    def step(self, g):
        x, y, _ = g.components("pos")
        if self.what == "array":
            spiral(2.0 * x, y, self.angle, self.gain, g.dt, self.angle, *self.velocity)
        else:
            spiral(x, y, self.angle, self.gain, float(x[0]), self.angle, *self.velocity)


class Nearest(Spiral):
    """Gives a kernel what a search found, and a view of what a kernel before wrote."""

    only_calls_kernels = True

    def step(self, g):
        yaw, between = g.column("yaw"), np.empty((2, g.n))
        placed(yaw, yaw, *between)
        spiral(g.nearest().distance[0], between[1], self.angle, self.gain, g.dt, self.angle, *self.velocity)


@pytest.mark.parametrize("autonomy", [Doubles(), Doubles(what="number"), Nearest()], ids=repr)
def test_arrays_and_numbers_that_differ_from_step_to_step_are_not_joined(autonomy, replays):
    joined, apart = pair(swarm(autonomy), [3, 4])
    assert joined == apart
    assert not (replays and isinstance(autonomy, Doubles))


class Limited(Spiral):
    """Its kernel raises an error."""

    only_calls_kernels = True
    turns = State()

    def step(self, g):
        limited(self.gain, self.turns)


def test_an_error_in_a_kernel_names_the_plugin(replays):
    mission, texts = swarm([Spiral(), Limited(), Spiral(name="last")]), []
    for steady in (ALWAYS, NEVER):
        with (
            started(mission, [1], steady) as simulation,
            pytest.raises(PluginError, match=r"Limited, a, world 0, step 10: .*too many turns") as found,
        ):
            simulation.run()
        texts.append(str(found.value))
    assert texts[0] == texts[1]
    assert len(replays) > 3


def test_the_list_of_calls_stays_what_it_is():
    with Simulation(GAME, seeds=[1]) as simulation:
        before = simulation.describe()
        simulation.step(40)
        assert simulation.describe() == before
        assert len(simulation.schedule.functions) == len(simulation.schedule) - 3


def test_kernels_that_go_while_calls_are_recorded_change_nothing():
    """As those of a simulation that nothing holds any longer."""

    def clear(x):
        x[0] = 0.0

    kept, *gone = (kernel("Fw")(clear) for _ in range(4))
    for each in (kept, *gone):
        each(np.ones(1))
    with recording() as recorded:
        kept(np.ones(1))
        del each, gone
        gc.collect()
    assert recorded.is_whole
    assert len(recorded.calls) == 1
