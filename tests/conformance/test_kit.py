"""The kit catches what it says it catches: one deliberately broken plugin per rule."""

from __future__ import annotations

import math
import random
from collections import deque
from typing import ClassVar

import numpy as np
import pytest

from tussle.api import (
    Autonomy,
    Behavior,
    Controller,
    EasyAutonomy,
    EasyController,
    EasyInteraction,
    EasyMetric,
    EasySensor,
    EntityRef,
    GroupView,
    Input,
    Interaction,
    Metric,
    MotionModel,
    Network,
    Output,
    Param,
    Plugin,
    Publish,
    Sensor,
    State,
    Subscribe,
)
from tussle.errors import ConformanceError, TussleError
from tussle.messages import CaptureEntity
from tussle.numeric import cos, sin
from tussle.numeric.kernel import kernel
from tussle.testing import check_plugin

# -- sound plugins of each kind: what every broken one below would be without its fault -------------------------------------------


class SoundAutonomy(Autonomy):
    """Circles, the faster the more are near."""

    grade = "portable"
    gain = Param(0.5, unit="1/s", ge=0.0)
    sight = Param(20.0, unit="m", gt=0.0)
    turns = State(unit="rad", doc="Turned so far.")
    favourite = EntityRef()
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    capture = Publish(CaptureEntity)

    def step(self, g: GroupView) -> None:
        near = g.near(self.sight)
        other = g.nearest().other[0]
        self.favourite[:] = np.where(other >= 0, g.bodies.id[np.maximum(other, 0)], 0)
        self.turn_rate[:] = self.gain * near.count
        self.turns[:] = self.turns + self.turn_rate * g.dt
        self.speed[:] = 3.0 + near.sum(near.distance) / (1.0 + near.count) + g.uniform("speed")
        self.capture.publish(np.flatnonzero(near.count > 2), target=self.favourite[near.count > 2])


class SoundEasy(EasyAutonomy):
    """Goes to its nearest."""

    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")

    def step_one(self, me) -> None:
        other = me.nearest()
        me.speed = 0.0 if other is None else math.sqrt(me.distance(other))
        me.turn_rate = math.sin(me.yaw)


class SoundEasyChooser(EasyAutonomy):
    """Keeps to one, draws, says so, and counts what it hears."""

    grade = "portable"
    sight = Param(20.0, unit="m", gt=0.0)
    favourite = EntityRef()
    heard = State(dtype=int)
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    capture = Publish(CaptureEntity)
    captures = Subscribe(CaptureEntity)

    def spawn_one(self, me) -> None:
        me.heard = int(4.0 * me.uniform())

    def step_one(self, me) -> None:
        me.favourite = me.favourite or me.nearest(team="other")
        me.heard += sum(1 for claim in me.captures if claim.sender and claim.target)
        me.speed = me.uniform() + me.uniform() + len(me.near(me.sight, team="own"))
        me.turn_rate = 0.1 * me.normal() + 0.01 * me.heard
        if me.favourite and me.distance(me.favourite) < me.sight:
            me.publish("capture", target=me.favourite)


class SoundEasyController(EasyController):
    """A first-order lag, for one entity at a time."""

    grade = "portable"
    lag = Param(0.5, unit="s", gt=0.0)
    desired_speed = Input(unit="m/s")
    speed = Output(unit="m/s")
    memory = State(unit="m/s")

    def step_one(self, me) -> None:
        me.memory += me.dt / (me.lag + me.dt) * (me.desired_speed - me.memory)
        me.speed = me.memory


class SoundEasySensor(EasySensor):
    """Measures its height with noise, and the way to its nearest."""

    grade = "portable"
    noise = Param(0.5, unit="m", ge=0.0)
    height = Output(unit="m")
    way = Output("way_x way_y way_z", unit="m")

    def step_one(self, me) -> None:
        other = me.nearest(radius=50.0)
        me.height = me.pos[2] + me.noise * me.normal()
        me.way = other.offset if other else 0.0


class SoundEasyReferee(EasyInteraction):
    """Hurts who claims too much, by chance, and pushes who stands near."""

    grade = "portable"
    harm = Param(0.1, ge=0.0)
    claims = State(dtype=int, per="world")
    hits = State(dtype=int)

    def start_one(self, w) -> None:
        w.claims = len(w.entities)

    def step_one(self, w) -> None:
        for claim in w.inbox(CaptureEntity):
            w.claims += 1
            if claim.sender and w.uniform() < 0.5:
                claim.sender.hits += 1
                claim.sender.health -= w.harm * claim.sender.hits
        for entity in w.entities:
            near = entity.near(5.0)
            if near:
                w.move(entity, pos=entity.pos - 0.1 * near[0].offset)
        if w.claims % 7 == 1:
            w.spawn("red", pos=(float(w.claims), 0.0, 0.0))


class SoundEasyMetric(EasyMetric):
    """Counts how many of each team there are."""

    grade = "portable"
    seen = State(dtype=int, per="team")

    def step_one(self, w) -> None:
        for entity in w.entities:
            w.seen[entity.team] += 1

    def result_one(self, w):
        return {"seen": w.seen, "score": w.seen, "there": len(w.entities)}


class SoundController(Controller):
    """A first-order lag."""

    grade = "portable"
    lag = Param(0.5, unit="s", gt=0.0)
    desired_speed = Input(unit="m/s")
    speed = Output(unit="m/s")
    memory = State(unit="m/s")

    def step(self, g: GroupView) -> None:
        part = g.dt / (self.lag + g.dt)
        self.memory[:] = self.memory + part * (self.desired_speed - self.memory)
        self.speed[:] = self.memory


class SoundMotion(MotionModel):
    """A car whose speed follows the command with a lag."""

    grade = "portable"
    lag = Param(0.5, unit="s", gt=0.0, ge=0.05)
    x = State("east north up yaw v", unit="m m m rad m/s")
    speed = Input(unit="m/s")
    turn_rate = Input(unit="rad/s")

    @staticmethod
    def derivative(yaw, v, speed, turn_rate, lag):
        return v * cos(yaw), v * sin(yaw), 0.0, turn_rate, (speed - v) / lag

    def from_body(self, body, rows) -> None:
        self.x[:3, rows] = body.pos[:, rows]
        self.x[3, rows] = body.yaw[rows]
        self.x[4, rows] = body.forward_speed[rows]

    def to_body(self, body) -> None:
        body.pos[:] = self.x[:3]
        body.set_attitude(yaw=self.x[3])
        body.vel[0], body.vel[1] = self.x[4] * cos(self.x[3]), self.x[4] * sin(self.x[3])
        body.vel[2] = 0.0


class SoundRigidBody(MotionModel):
    """Six degrees of freedom: thrust along the body's own axes, moments, drag, gravity; it may slip in any direction."""

    grade = "portable"
    weight = Param(2.0, unit="kg", gt=0.0)
    drag = Param(0.4, unit="1/s", ge=0.0)
    x = State(
        "east north up vx vy vz qw qx qy qz wx wy wz", unit="m m m m/s m/s m/s 1 1 1 1 rad/s rad/s rad/s"
    )
    thrust = Input("thrust_x thrust_y thrust_z", unit="N")
    moment = Input("moment_x moment_y moment_z", unit="N*m")

    @staticmethod
    def derivative(
        vx, vy, vz, qw, qx, qy, qz, wx, wy, wz,
        thrust_x, thrust_y, thrust_z, moment_x, moment_y, moment_z, force_x, force_y, force_z, weight, drag,
    ):  # fmt: skip
        tx = 2.0 * (qy * thrust_z - qz * thrust_y)
        ty = 2.0 * (qz * thrust_x - qx * thrust_z)
        tz = 2.0 * (qx * thrust_y - qy * thrust_x)
        ax = thrust_x + qw * tx + qy * tz - qz * ty
        ay = thrust_y + qw * ty + qz * tx - qx * tz
        az = thrust_z + qw * tz + qx * ty - qy * tx
        return (
            *(vx, vy, vz),
            *((ax + force_x) / weight - drag * vx, (ay + force_y) / weight - drag * vy),
            (az + force_z) / weight - drag * vz - 9.81,
            *(-0.5 * (wx * qx + wy * qy + wz * qz), 0.5 * (wx * qw + wy * qz - wz * qy)),
            *(0.5 * (wy * qw + wz * qx - wx * qz), 0.5 * (wz * qw + wx * qy - wy * qx)),
            *(moment_x - wx, moment_y - wy, moment_z - wz),
        )

    def from_body(self, body, rows) -> None:
        parts = (body.pos, body.vel, body.quat, body.omega)
        self.x[:, rows] = np.concatenate([part[:, rows] for part in parts])

    def to_body(self, body) -> None:
        body.pos[:], body.vel[:], body.omega[:] = self.x[:3], self.x[3:6], self.x[10:]
        w, x, y, z = self.x[6:10]
        body.quat[:] = self.x[6:10] / np.sqrt(w * w + x * x + y * y + z * z)


class SoundBouncer(MotionModel):
    """Falls, and comes up from the ground again: its velocity jumps."""

    grade = "portable"
    x = State("east north up vx vy vz", unit="m m m m/s m/s m/s")

    @property
    def advance(self):
        return bounce

    def from_body(self, body, rows) -> None:
        self.x[:3, rows], self.x[3:, rows] = body.pos[:, rows], body.vel[:, rows]

    def to_body(self, body) -> None:
        body.pos[:], body.vel[:] = self.x[:3], self.x[3:]


@kernel("F2w F2 F2 f8 i8")
def bounce(x, u, p, dt, substeps):
    """Semi-implicit Euler under gravity; below the ground all speed is upwards."""
    h = dt / substeps
    for _ in range(substeps):
        for i in range(x.shape[1]):
            x[5, i] -= 9.81 * h
            if x[2, i] < 0.0:
                x[5, i] = abs(x[5, i])
            for k in range(3):
                x[k, i] += h * x[3 + k, i]


class SoundCounts(SoundAutonomy):
    """Has whole numbers for parameters."""

    n_legs = Param(4, ge=1, le=8)
    n_wheels = Param(3, gt=1)


class SoundSensor(Sensor):
    """Measures its height with noise."""

    grade = "portable"
    noise = Param(0.5, unit="m", ge=0.0)
    height = Output(unit="m")

    def step(self, g: GroupView) -> None:
        self.height[:] = g.pos[2] + self.noise * g.normal("height")


class SoundReferee(Interaction):
    """Hurts who claims too much."""

    grade = "portable"
    harm = Param(0.1, ge=0.0)
    claims = State(dtype=int, per="world")

    def step(self, w) -> None:
        claims = w.inbox(CaptureEntity)
        np.add.at(self.claims, claims.world, 1)
        rows = w.rows_at(claims.world, claims.sender)
        np.subtract.at(w.bodies.health, rows, self.harm[claims.world])


class SoundMetric(Metric):
    """Counts how many of each team there are."""

    grade = "portable"
    seen = State(dtype=int, per="team")

    def step(self, w) -> None:
        np.add.at(self.seen, (w.team_numbers(w.team), w.world), 1)

    def result(self, w):
        return {"seen": self.seen, "score": self.seen}


class SoundNetwork(Network):
    """Everyone hears, one step late at most."""

    grade = "portable"

    def route(self, w, messages):
        return "everyone"


class SoundBehavior(Behavior):
    """Wishes to be elsewhere."""

    grade = "portable"

    def step(self, g: GroupView) -> None:
        self.desired_velocity[:] = 0.1 * g.pos + g.call("max_desired_speed")


@kernel("F F Fw Fw")
def count_up(x, turns, turned, speed):
    for i in range(x.shape[0]):
        turned[i] = turns[i] + 1.0
        speed[i] = 3.0 + 0.1 * turned[i] + 0.01 * x[i]


class SoundByKernels(Autonomy):
    """Goes ever faster, by a kernel."""

    grade = "portable"
    only_calls_kernels = True
    turns = State()
    speed = Output(unit="m/s")

    def step(self, g: GroupView) -> None:
        count_up(g.components("pos")[0], self.turns, self.turns, self.speed)


SOUND = [v for k, v in list(globals().items()) if k.startswith("Sound")]


@pytest.mark.parametrize("cls", SOUND, ids=lambda cls: cls.__name__)
def test_a_sound_plugin_passes(cls) -> None:
    check_plugin(cls)


def test_a_plugin_can_come_with_companions_and_parameters() -> None:
    check_plugin(SoundAutonomy, companions=[SoundController(lag=0.2), SoundMotionOfSpeed()], gain=0.1)


def test_a_controller_may_work_between_the_substeps_of_a_motion_model() -> None:
    check_plugin(SoundMotionOfSpeed, companions=[SoundController()])


class SoundMotionOfSpeed(SoundMotion):
    """The same car, which needs a speed only."""

    turn_rate = Input(unit="rad/s", optional=True)


# -- broken ones ------------------------------------------------------------------------------------------------------------------

CALLS: list[int] = []
SEEN: dict[int, float] = {}


class NoDoc(SoundAutonomy):
    pass


class ListOnClass(SoundAutonomy):
    """Keeps a list on the class."""

    log = []  # noqa: RUF012 - that is the fault


class NotAHook(SoundAutonomy):
    """Overrides what the package relies on."""

    def replace(self, **values):
        return self


class OwnInit(SoundAutonomy):
    """Has a constructor of its own."""

    def __init__(self, **values) -> None:
        super().__init__(**values)


class NoStep(Autonomy):
    """Does nothing."""

    speed = Output(unit="m/s")


class HalfBelief(SoundSensor):
    """Believes in a place on the map only."""

    belief_pos = Output("belief_x belief_y", unit="m")


class NothingToDo(Interaction):
    """Neither starts nor steps."""


class UsesChance(SoundAutonomy):
    """Draws from one generator for all."""

    grade = "machine"

    def step(self, g: GroupView) -> None:
        self.speed[:] = random.random()


class CountsRows(SoundAutonomy):
    """Everybody flies faster the more there are, in other worlds too."""

    def step(self, g: GroupView) -> None:
        self.speed[:] = float(g.n)


class KnowsItsRow(SoundAutonomy):
    """The first one is special, wherever it stands."""

    def step(self, g: GroupView) -> None:
        self.speed[:] = 1.0 + (np.arange(g.n) == 0)


class CountsCalls(SoundAutonomy):
    """Remembers outside of columns: in a list of its module."""

    def step(self, g: GroupView) -> None:
        CALLS.append(1)
        self.speed[:] = 1.0 / len(CALLS)


class RemembersInADefault(SoundAutonomy):
    """Remembers in a default of a method."""

    def noted(self, number, notes=[]):  # noqa: B006 - what is tested
        """The number of calls."""
        notes.append(number)
        return len(notes)


class MisspellsAHook(SoundAutonomy):
    """Has a method that is never called."""

    def spwan(self, g, rows):
        """Never called."""


class MisspellsAHookByALetter(SoundAutonomy):
    """Has a method that is never called."""

    def spown(self, g, rows):
        """Never called."""


class RemembersById(SoundAutonomy):
    """Remembers outside of columns by entity, so that stacks do not show it, but a second game does."""

    def step(self, g: GroupView) -> None:
        for row, key in enumerate(zip(g.id.tolist(), g._seeds.tolist(), strict=True)):
            SEEN[hash(key)] = SEEN.get(hash(key), 0.0) + float(g.step_count[row] == 0)
            self.speed[row] = SEEN[hash(key)]


class MissesSnapshot(SoundAutonomy):
    """A memory that begins anew with each entity, but that a restore does not bring back."""

    def spawn(self, g: GroupView, rows) -> None:
        for row in rows:
            SEEN[hash((int(g.id[row]), int(g._seeds[row])))] = 0.0

    def step(self, g: GroupView) -> None:
        for row, key in enumerate(zip(g.id.tolist(), g._seeds.tolist(), strict=True)):
            SEEN[hash(key)] += 1.0
            self.speed[row] = SEEN[hash(key)]


class ForgetsToReset(SoundMetric):
    """Begins anew when all worlds do, but not when some of them do."""

    def start(self, w) -> None:
        if not w.step_count.any():
            SEEN.clear()

    def step(self, w) -> None:
        for world, seed in enumerate(w.seeds.tolist()):
            SEEN[seed] = SEEN.get(seed, 0.0) + 1.0
            self.seen[:, world] = SEEN[seed]


class SetsAttribute(SoundAutonomy):
    """Tries an attribute that is not declared."""

    def step(self, g: GroupView) -> None:
        self.previous = g.yaw.copy()


class HidesAttribute(SoundAutonomy):
    """Gets one past the guard."""

    def step(self, g: GroupView) -> None:
        self.__dict__["previous"] = g.yaw.copy()


class ChangesClass(SoundAutonomy):
    """Counts on the class."""

    count = 0

    def step(self, g: GroupView) -> None:
        type(self).count = 1


class Notes:
    """Any object."""


class GrowsOnClass(SoundAutonomy):
    """Remembers on the class, in what is neither a list nor a dict, and never uses it."""

    calls: ClassVar = deque()

    def step(self, g: GroupView) -> None:
        self.calls.append(1)


class GrowsInsideATuple(GrowsOnClass):
    """Remembers in a list that something else holds."""

    calls: ClassVar = ([],)

    def step(self, g: GroupView) -> None:
        self.calls[0].append(1)


class GrowsAnObject(GrowsOnClass):
    """Remembers in an object."""

    calls: ClassVar = Notes()

    def step(self, g: GroupView) -> None:
        self.calls.n = getattr(self.calls, "n", 0) + 1


class GrowsAndUses(GrowsOnClass):
    """Remembers on the class, so that stacks differ."""

    calls: ClassVar = deque()

    def step(self, g: GroupView) -> None:
        self.calls.append(1)
        self.speed[:] = 1.0 / len(self.calls)


class WritesView(SoundAutonomy):
    """Pushes others, which a view refuses."""

    def step(self, g: GroupView) -> None:
        g.vel[0] += 1.0


class WritesAroundView(SoundAutonomy):
    """Pushes others past the view."""

    def step(self, g: GroupView) -> None:
        g._bodies.vel[0] += 1.0


class WritesParameter(SoundAutonomy):
    """Adapts its own gain past the view."""

    def step(self, g: GroupView) -> None:
        self.gain.base[:] *= 0.9


class WritesWrongColumn(Metric):
    """A metric that heals."""

    def step(self, w) -> None:
        w.bodies.health[:] = 2.0


class NanAtBound(SoundAutonomy):
    """Divides by what may be zero."""

    def step(self, g: GroupView) -> None:
        with np.errstate(all="ignore"):
            self.speed[:] = 0.0 * g.pos[0] / self.gain


class NanInReferee(Interaction):
    """Keeps a number that is none when its parameter is large."""

    limit = Param(1.0, gt=0.0)
    ratio = State(per="world")

    def step(self, w) -> None:
        self.ratio[:] = np.where(self.limit > 5.0, np.inf, 1.0)


class RaisesAtBound(SoundAutonomy):
    """Refuses a value that it declares as allowed."""

    def step(self, g: GroupView) -> None:
        if (self.gain == 0.0).any():
            raise ValueError("gain is 0")


class Raises(SoundAutonomy):
    """Raises."""

    def step(self, g: GroupView) -> None:
        raise RuntimeError("no")


class BrokenVariant(SoundAutonomy):
    """Sound as long as nobody touches its switch."""

    fancy = Param(False, structural=True)

    def step(self, g: GroupView) -> None:
        self.speed[:] = float(g.n) if self.fancy else 1.0


class RolloutOfItsOwn(SoundMotion):
    """Flies otherwise than it plans: its path depends on more than its state."""

    def to_body(self, body) -> None:
        self.x[0] += 1e-9
        SoundMotion.to_body(self, body)


class NoVelocity(SoundMotion):
    """Leaves vel as it was at birth."""

    def to_body(self, body) -> None:
        body.pos[:] = self.x[:3]
        body.set_attitude(yaw=self.x[3])


class VelocityOfBody(SoundMotion):
    """Publishes the velocity along its own axes."""

    def to_body(self, body) -> None:
        SoundMotion.to_body(self, body)
        body.vel[:] = 0.0
        body.vel[0] = self.x[4]


class VelocityOfCommand(SoundMotion):
    """Publishes the speed that it is to have."""

    def to_body(self, body) -> None:
        SoundMotion.to_body(self, body)
        body.vel[:2] = self.speed * cos(self.x[3]), self.speed * sin(self.x[3])


class WrongRate(SoundMotion):
    """Moves at twice its speed."""

    @staticmethod
    def derivative(yaw, v, speed, turn_rate, lag):
        return 2.0 * v * cos(yaw), 2.0 * v * sin(yaw), 0.0, turn_rate, (speed - v) / lag


class ForgetsClimb(SoundRigidBody):
    """Its vertical velocity is missing."""

    def to_body(self, body) -> None:
        SoundRigidBody.to_body(self, body)
        body.vel[2] = 0.0


class DeclaresPos(MotionModel):
    """Has a column of the body's name, so that self.pos is not where the entity is."""

    pos = State("east north up", unit="m")

    @staticmethod
    def derivative():
        return 0.0, 0.0, 0.0

    def from_body(self, body, rows) -> None:
        self.pos[:, rows] = body.pos[:, rows]

    def to_body(self, body) -> None:
        body.pos[:], body.vel[:] = self.pos, 0.0


class DrawsTwice(SoundAutonomy):
    """Takes one draw for two."""

    def step(self, g: GroupView) -> None:
        self.speed[:], self.turn_rate[:] = g.normal("gust"), g.normal("gust", 2)[1]


class DrawsByBothLaws(SoundSensor):
    """Takes the bits of one draw for two."""

    def step(self, g: GroupView) -> None:
        self.height[:] = g.normal("height") + g.uniform("height")


class DrawsAtBirthAndAfter(SoundAutonomy):
    """Newborns draw the same number for two things."""

    def spawn(self, g: GroupView, rows) -> None:
        self.turns[rows] = g.uniform("start")[rows]

    def step(self, g: GroupView) -> None:
        self.speed[:] = g.uniform("start")


class DrawsTwiceForWorlds(SoundReferee):
    """The same for worlds."""

    def step(self, w) -> None:
        self.claims[:] = (w.uniform("luck") + w.uniform("luck")).astype(int)


class EasyChance(SoundEasySensor):
    """Asks Python's random module."""

    def step_one(self, me) -> None:
        me.height = random.random()


class EasyCalls(SoundEasyReferee):
    """Counts its calls for all worlds together."""

    def step_one(self, w) -> None:
        CALLS.append(1)
        w.claims = len(CALLS)


class EasyMisspelt(SoundEasyController):
    """Reads what it does not have."""

    def step_one(self, me) -> None:
        me.speed = me.desired_sped


class EasyReadsAll(SoundEasyController):
    """Reads the values of all entities."""

    def step_one(self, me) -> None:
        me.speed = me.desired_speed * self.lag


class EasyBothLaws(SoundEasySensor):
    """Draws by two laws under one label."""

    def step_one(self, me) -> None:
        me.height = me.uniform("height") + me.normal("height")


class EasyHides(SoundEasyChooser):
    """Remembers in the plugin object, behind its back."""

    def step_one(self, me) -> None:
        object.__setattr__(self, "last", me.id)


class EasyHurts(SoundEasyMetric):
    """A metric that changes what it counts."""

    def step_one(self, w) -> None:
        for entity in w.entities:
            entity.health = 0.5


class EasyNan(SoundEasyMetric):
    """Divides by a distance that may be 0."""

    limit = Param(1.0, ge=0.0)
    part = State(per="world")

    def step_one(self, w) -> None:
        w.part = math.inf if w.limit == 0.0 else 1.0 / w.limit


class JumpyDerivative(SoundMotion):
    """A state equation with steps in it."""

    @staticmethod
    def derivative(yaw, v, speed, turn_rate, lag):
        return (
            (1.0 if yaw * 7.0 - math.floor(yaw * 7.0) > 0.5 else -1.0),
            v * 3.0,
            yaw * yaw,
            3.0,
            (speed - v) / lag,
        )


@kernel("F2w F2 F2 f8 i8")
def euler(x, u, p, dt, substeps):
    """One Euler step where the equation asks for better."""
    for i in range(x.shape[1]):
        x[0, i] += dt * x[4, i] * cos(x[3, i])
        x[1, i] += dt * x[4, i] * sin(x[3, i])
        x[3, i] += dt * u[1, i]
        x[4, i] += dt * (u[0, i] - x[4, i]) / p[0, i]


class EulerKernel(SoundMotion):
    """A kernel that does not solve the equation."""

    advance = euler


@kernel("F2w F2 F2 f8 i8")
def place_counts(x, u, p, dt, substeps):
    """The last row flies elsewhere."""
    for i in range(x.shape[1]):
        x[0, i] += dt * u[0, i] * (1.0 + 1e-16 * i)
    x[1, x.shape[1] - 1] += 1e-12


class RowsDiffer(SoundMotion):
    """A kernel whose result depends on where a row stands."""

    derivative = None
    advance = place_counts


class Displaces(SoundMotion):
    """Publishes another place than it took over."""

    def to_body(self, body) -> None:
        SoundMotion.to_body(self, body)
        body.pos[2] += 0.5


class SetsAllRows(SoundMotion):
    """Takes over rows that it was not asked for."""

    def from_body(self, body, rows) -> None:
        SoundMotion.from_body(self, body, np.arange(body.n))
        self.x[4] = 0.0


class IgnoresBody(SoundMotion):
    """Goes on from where it was, wherever it is put."""

    def from_body(self, body, rows) -> None:
        self.x[3, rows] = body.yaw[rows]


class DoesMore(SoundByKernels):
    """Turns without a kernel."""

    only_calls_kernels = True

    def step(self, g: GroupView) -> None:
        self.turns += 1.0
        SoundByKernels.step(self, g)


BROKEN = {
    "only_calls_kernels": [DoesMore],
    "declarations": [
        RemembersInADefault,
        MisspellsAHook,
        MisspellsAHookByALetter,
        NoDoc,
        ListOnClass,
        NotAHook,
        OwnInit,
        NothingToDo,
        DeclaresPos,
    ],
    "stack invariance": [
        CountsRows,
        KnowsItsRow,
        CountsCalls,
        RemembersById,
        UsesChance,
        EasyChance,
        EasyCalls,
    ],
    "snapshot": [MissesSnapshot],
    "reset": [ForgetsToReset],
    "runs": [
        NoStep,
        HalfBelief,
        SetsAttribute,
        WritesView,
        Raises,
        EasyMisspelt,
        EasyReadsAll,
        EasyBothLaws,
    ],
    "memory in columns": [
        HidesAttribute,
        ChangesClass,
        EasyHides,
        GrowsOnClass,
        GrowsInsideATuple,
        GrowsAnObject,
        GrowsAndUses,
    ],
    "own columns": [WritesAroundView, WritesParameter, WritesWrongColumn, EasyHurts],
    "finite": [NanAtBound, NanInReferee, RaisesAtBound, EasyNan],
    "rollout": [RolloutOfItsOwn],
    "velocity": [NoVelocity, VelocityOfBody, VelocityOfCommand, WrongRate, ForgetsClimb],
    "draws": [DrawsTwice, DrawsByBothLaws, DrawsAtBirthAndAfter, DrawsTwiceForWorlds],
    "order of convergence": [JumpyDerivative],
    "advance": [EulerKernel],
    "rows": [RowsDiffer],
    "body round trip": [Displaces],
    "from_body": [SetsAllRows, IgnoresBody],
}


@pytest.mark.parametrize(
    ("rule", "cls"),
    [(rule, cls) for rule, classes in BROKEN.items() for cls in classes],
    ids=lambda v: getattr(v, "__name__", ""),
)
def test_a_broken_plugin_is_caught(rule: str, cls: type[Plugin]) -> None:
    CALLS.clear()
    SEEN.clear()
    with pytest.raises(ConformanceError) as caught:
        check_plugin(cls)
    assert (caught.value.rule, caught.value.plugin) == (rule, cls.__name__), str(caught.value)
    assert cls.__name__ in str(caught.value)
    assert caught.value.evidence


def test_variants_are_named() -> None:
    with pytest.raises(ConformanceError, match=r"stack invariance.*as BrokenVariant\(fancy=True\)"):
        check_plugin(BrokenVariant)


def test_evidence_says_seed_step_and_column() -> None:
    with pytest.raises(ConformanceError, match=r"step \d+ of the world with seed \d+, .*: .* versus "):
        check_plugin(CountsRows)
    with pytest.raises(ConformanceError, match=r"with gain = 0\.0, "):
        check_plugin(NanAtBound)
    with pytest.raises(ConformanceError, match=r"step wrote into vel, which is not its own"):
        check_plugin(WritesAroundView)


@pytest.mark.parametrize("cls", [GrowsOnClass, GrowsInsideATuple, GrowsAnObject, GrowsAndUses])
def test_the_attribute_that_grows_is_named(cls) -> None:
    with pytest.raises(ConformanceError, match=rf"{cls.__name__}.calls changed during a game"):
        check_plugin(cls)


def test_what_is_external_promises_no_bits() -> None:
    class Joystick(CountsRows):
        """Moves as somebody outside wants."""

        grade = "external"

    check_plugin(Joystick)


def test_only_plugins_are_checked() -> None:
    with pytest.raises(ConformanceError, match="the class of a plugin"):
        check_plugin(SoundAutonomy())
    assert issubclass(ConformanceError, TussleError)


class Listener(Autonomy):
    """Hears on a network that the mission would not have."""

    grade = "portable"
    words = Subscribe(CaptureEntity, network="Radio")
    heard = State()
    speed = Output(unit="m/s")

    def step(self, g: GroupView) -> None:
        rows, _ = self.words.pairs()
        np.add.at(self.heard, rows, 1.0)
        self.speed[:] = self.heard


def test_networks_and_messages_are_made_up_where_a_plugin_needs_them() -> None:
    check_plugin(Listener)
