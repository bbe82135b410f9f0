"""GroundCollision bears the weight that each motion model has by its own law, and stops what falls and slides."""

import re

import numpy as np
import pytest
from pages import FENCE, ROOT

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Interaction, MotionModel, Output, Param, State
from tussle.mission import read_mission
from tussle.plugins import historic, stock
from tussle.stock import (
    UUV6DOF,
    Ballistic,
    FixedWing6DOFRascal,
    FreeBody,
    Multirotor,
    RigidBody6DOF,
    SimpleCar,
)

MASS, GRAVITY, BLOCK_MASS = 3.51, 3.71, 0.22
"""With 3.51 kg or 0.22 kg and 9.81 m/s^2, weight over mass is rounded to more than gravity, so that it lifts the body."""
OWN_GROUND = ("JSBSimControl", "JSBSimModel", "JSBSimCompiled")
"""Models that need a file and stand on the wheels of their aircraft; forces do not act on them."""
AT_REST = {
    "enable_gravity": True,  # SimpleCar
    "omega_min": 0.0,  # Multirotor: no thrust
    "thrust_min": 0.0,  # FixedWing6DOF: no thrust without throttle
    "use_ground_model": False,  # FixedWing6DOF: no ground of its own
    "buoyancy": 4.0,  # UUV6DOF: less than the weight
    "mass": MASS,
    "gravity_magnitude": GRAVITY,
}
"""Parameters, of the models that have them, with which a body at rest has a weight and no other force acts on it."""

FALL = 0.5
"""What falls is lower by more after 5 s [m]."""


def models(library):
    """The motion models of a manifest."""
    found = {library.load(name) for name in library.manifest() if name not in OWN_GROUND}
    return sorted((c for c in found if c.kind == "motion"), key=lambda c: c.__name__)


def own(cls, values):
    """The values of the parameters that a model has."""
    return {name: value for name, value in values.items() if name in cls.params()}


def resting(model, **values):
    """A block with a body at rest on the ground, of which all inputs are 0."""
    inputs = {name: type(model).inputs()[name] for name in model.active_inputs()}
    outputs = {name: Output(" ".join(c.channels), unit=c.unit) for name, c in inputs.items()}
    rest = type("Rest", (Autonomy,), {**outputs, "step": lambda self, g: None})
    return Block(
        **{"name": "a", "variance": (0, 0, 0), "mass": BLOCK_MASS, "autonomy": rest(), **values}, motion=model
    )


def heights(block, *interactions, dt=0.05, steps=100, **values):
    """The height after each step, (steps,)."""
    sim = Simulation(Mission(blocks=[block], dt=dt, end=dt * steps, interactions=interactions, **values))
    found = []
    for _ in range(steps):
        sim.step()
        found.append(sim.read("a.pos")[0][0, 0, 2])
    return np.array(found)


def ground(library=stock, **values):
    return library.GroundCollision(remove_on_collision=False, enable_startup_collisions=False, **values)


@pytest.mark.parametrize("cls", models(stock), ids=lambda cls: cls.__name__)
@pytest.mark.parametrize("gravity", [GRAVITY, None])
def test_what_falls_stays_on_the_ground_and_what_does_not_is_not_lifted(cls, gravity):
    values = own(cls, AT_REST)
    if gravity is None:
        values.pop("gravity_magnitude", None)
    model = cls(**values)
    alone = heights(resting(model))
    on_the_ground = heights(resting(model), ground())
    if alone[-1] < -FALL:
        assert np.abs(on_the_ground).max() < 1e-6
    else:
        assert on_the_ground.tolist() == alone.tolist()


def test_those_that_fall_are_the_models_that_forces_act_on_but_one():
    """So the test above has something to carry."""
    falling = {c.__name__ for c in models(stock) if heights(resting(c(**own(c, AT_REST))))[-1] < -FALL}
    pushed = {c.__name__ for c in models(stock) if "force_z" in c().body_inputs()}
    assert falling == pushed - {"RigidBody6DOF"}
    assert {"Ballistic", "FreeBody", "FixedWing6DOFRascal", "Multirotor", "SimpleCar", "UUV6DOF"} <= falling


class Moonstone(MotionModel):
    """Falls with its own mass and gravity; a third-party model."""

    mass = Param(7.0, unit="kg", gt=0.0)
    gravity_magnitude = Param(1.62, unit="m/s^2")
    x = State("z rate", unit="m m/s")

    @staticmethod
    def derivative(rate, force_z, mass, gravity_magnitude):
        return rate, force_z / mass - gravity_magnitude

    def from_body(self, body, rows):
        self.x[0, rows], self.x[1, rows] = body.pos[2, rows], body.vel[2, rows]

    def to_body(self, body):
        body.pos[2], body.vel[2] = self.x[0], self.x[1]


class Feather(Moonstone):
    """Falls by a law without these parameters: with a tenth of the gravity."""

    @staticmethod
    def derivative(rate, force_z):
        return rate, force_z / 0.5 - 0.981

    def mass_properties(self, body):
        return (
            super().mass_properties(body)._replace(mass=np.full(body.n, 0.5), weight=np.full(body.n, 0.4905))
        )


@pytest.mark.parametrize("model", [Moonstone(), Moonstone(mass=0.3, gravity_magnitude=24.8), Feather()])
def test_a_model_from_outside_is_carried_by_its_parameters_or_its_own_properties(model):
    assert heights(resting(model))[-1] < -FALL
    assert np.abs(heights(resting(model), ground())).max() < 1e-6


@pytest.mark.parametrize("update", ["synchronous", "sequential"])
def test_each_row_gets_the_weight_of_its_own_model(update):
    blocks = [
        resting(Multirotor(mass=2.0, omega_min=0.0)),
        resting(Ballistic(), name="b", mass=5.0, count=2, position=(9, 0, 0)),
        resting(RigidBody6DOF(), name="c", mass=6.0, position=(0, 9, 0)),
        resting(SimpleCar(), name="d", mass=7.0, position=(9, 9, 0)),
        resting(Multirotor(mass=3.0, omega_min=0.0, gravity_magnitude=2.0), name="e", position=(0, 20, 0)),
    ]
    sim = Simulation(
        Mission(blocks=blocks, dt=0.05, end=1.0, interactions=[ground()], update=update), seeds=[1, 2]
    )
    sim.step()
    found = {name: sim.read(f"{name}.force")[0][:, :, 2] for name in "abcde"}
    assert found["a"].tolist() == [[2.0 * 9.81]] * 2
    assert found["b"].tolist() == [[5.0 * 9.81] * 2] * 2
    assert found["c"].tolist() == found["d"].tolist() == [[0.0]] * 2
    assert found["e"].tolist() == [[6.0]] * 2


class Scales(Interaction):
    """Shows mass, first moment of inertia and weight of all entities as the force on them."""

    def step(self, w):
        mass, inertia, weight = w.mass_properties()
        w.bodies.force[:] = mass, inertia[0], weight


def test_a_plugin_that_acts_on_some_worlds_gets_their_rows():
    blocks = [
        resting(Multirotor(mass=2.0), position=(0, 0, 50)),
        resting(SimpleCar(), name="b", mass=5.0, position=(0, 0, 99), count=2),
    ]
    sim = Simulation(Mission(blocks=blocks, dt=0.05, end=9.0, interactions=[Scales(rate=10.0)]), seeds=[1, 2])
    sim.step(3)
    sim.reset([0])
    sim.step(4)
    assert sim.read("a.force")[0].tolist() == [[[0.0] * 3], [[2.0, 0.0122, 2.0 * 9.81]]]
    assert sim.read("b.force")[0].tolist() == [[[0.0] * 3] * 2, [[5.0, 0.0, 0.0]] * 2]


def test_a_vehicle_that_floats_is_not_held_down_and_one_in_water_weighs_less():
    floating = heights(resting(UUV6DOF(surface_height=10.0)), ground())
    assert floating[-1] > 0.1
    heavy = resting(UUV6DOF(mass=32.0, surface_height=10.0))
    assert heights(heavy)[-1] < -FALL
    assert np.abs(heights(heavy, ground())).max() < 1e-6


# -- contact ----------------------------------------------------------------------------------------------------------------------


FALLING = [
    Ballistic(),
    FreeBody(),
    Multirotor(omega_min=0.0),
    FixedWing6DOFRascal(use_ground_model=False),
    SimpleCar(enable_gravity=True),
]


@pytest.mark.parametrize("model", FALLING, ids=lambda m: type(m).__name__)
@pytest.mark.parametrize("dt", [0.0025, 0.03, 0.1])
def test_what_falls_lands_and_rests(model, dt):
    """From many heights and speeds at once: wherever the last step before the ground begins."""
    rng = np.random.default_rng(1)
    blocks = [
        resting(model, name=f"b{i}", position=(0, 0, rng.uniform(0, 6)), velocity=(0, 0, rng.uniform(-9, 3)))
        for i in range(12)
    ]
    sim = Simulation(Mission(blocks=blocks, dt=dt, end=5.0, interactions=[ground()]))
    lowest = 0.0
    while not sim.is_over:
        sim.step()
        height = np.concatenate([sim.read(f"b{i}.pos")[0][0, :, 2] for i in range(12)])
        lowest = min(lowest, height.min())
    # What only gravity accelerates is stopped exactly. The drag of the others is not known in the step of the landing.
    assert lowest > -(1e-9 if isinstance(model, (Ballistic, FreeBody, SimpleCar)) else 20.0 * dt * dt)
    assert np.abs(height).max() <= 1e-5
    speed = np.concatenate([sim.read(f"b{i}.vel")[0][0] for i in range(12)])
    assert np.abs(speed).max() < 1e-4


@pytest.mark.parametrize("model", [Ballistic(), FreeBody()], ids=lambda m: type(m).__name__)
@pytest.mark.parametrize("friction", [0.2, 1.0])
def test_what_slides_is_stopped_by_friction(model, friction):
    block = resting(model, velocity=(3.0, 4.0, 0.0))
    sim = Simulation(Mission(blocks=[block], dt=0.01, end=6.0, interactions=[ground(friction=friction)]))
    sim.run()
    pos = sim.read("a.pos")[0][0, 0]
    way = 25.0 / (2.0 * friction * 9.81)
    assert pos == pytest.approx([0.6 * way, 0.8 * way, 0.0], abs=0.06)


def test_without_friction_it_slides_on():
    sim = Simulation(
        Mission(
            blocks=[resting(Ballistic(), velocity=(3, 0, 0))],
            dt=0.1,
            end=2.0,
            interactions=[ground(friction=0.0)],
        )
    )
    sim.run()
    assert sim.read("a.pos")[0][0, 0] == pytest.approx([6.0, 0.0, 0.0], abs=1e-9)


class Lift(Autonomy):
    """Increases the thrust of the rotors within a second to a share of the weight."""

    share = Param(0.0)
    motors = Output("motor_0 motor_1 motor_2 motor_3", unit="rad/s")

    def step(self, g):
        self.motors[:] = np.sqrt(self.share * np.minimum(1.0, g.t) * 1.5 * 9.81 / 4.0 / 5.45e-6)


@pytest.mark.parametrize(("share", "leaves"), [(0.0, False), (0.2, False), (0.9, False), (1.1, True)])
def test_a_copter_leaves_the_ground_with_more_thrust_than_its_weight(share, leaves):
    found = heights(resting(Multirotor(omega_min=0.0), autonomy=Lift(share=share)), ground(), dt=0.02)
    assert found.min() >= -1e-6
    assert np.abs(found[: 30 if leaves else None]).max() < 2e-3
    if leaves:
        assert found[-1] > 0.1
    else:
        assert np.abs(found[-20:]).max() <= 1e-6


def test_a_body_that_lands_aslant_levels_and_one_that_turns_stops():
    block = resting(FreeBody(), position=(0, 0, 1), roll=0.4, climb=-0.2, radius=0.3)
    sim = Simulation(Mission(blocks=[block], dt=0.01, end=5.0, interactions=[ground()]))
    sim.run()
    _, x, y, _ = sim.read("a.quat")[0][0, 0]
    assert abs(x) + abs(y) < 1e-3
    assert np.abs(sim.read("a.omega")[0]).max() < 1e-3


@pytest.mark.parametrize("update", ["synchronous", "sequential"])
def test_contact_is_the_same_alone_in_a_stack_and_after_a_restore(update):
    blocks = [
        resting(model, name=f"b{i}", position=(9 * i, 0, 2), velocity=(1, 0, -2))
        for i, model in enumerate(FALLING)
    ]
    game = Mission(blocks=blocks, dt=0.05, end=2.0, interactions=[ground()], update=update)
    (alone,) = Simulation(game, seeds=[3]).run()
    sim = Simulation(game, seeds=[1, 3])
    sim.step(17)
    saved = sim.snapshot()
    sim.run()
    assert sim.result()[1].state_hash == alone.state_hash
    sim.restore(saved)
    sim.run()
    assert sim.result()[1].state_hash == alone.state_hash


# -- the missions of the page on autopilots ----------------------------------------------------------------------------------------


PAGE = (ROOT / "docs" / "autopilots.md").read_text()
STANDING = [f[2] for f in FENCE.finditer(PAGE) if f[1] == "xml" and "GroundCollision" in f[2]]


@pytest.mark.parametrize("text", STANDING, ids=["ArduPilot", "PX4"])
def test_the_copters_of_the_page_on_autopilots_stand_on_the_ground(text, tmp_path):
    """With its rotors at their lowest speed, which bear a fifth of its weight."""
    text = re.sub(r"<(autonomy|controller).*?</\1>", "", text, flags=re.DOTALL)
    path = tmp_path / "copter.xml"
    path.write_text(text)
    mission = read_mission(path).mission
    (copter,) = mission.blocks
    rest = resting(copter.motion).autonomy
    game = mission.replace(blocks=[copter.replace(autonomy=rest, name="a")], end=10.0)
    sim = Simulation(game)
    heights = []
    while not sim.is_over:
        sim.step()
        heights.append(sim.read("a.pos")[0][0, 0, 2])
    assert np.abs(heights).max() < 1e-3
    assert np.abs(heights[100:]).max() <= 1e-6


# -- SCRIMMAGE ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "cls", [c for c in models(historic) if "force_z" in c().body_inputs()], ids=lambda c: c.__name__
)
def test_the_ground_of_scrimmage_gives_mass_times_gravity_of_the_model(cls):
    model = cls(**own(cls, AT_REST))
    block = resting(model, position=(0, 0, -9))
    sim = Simulation(Mission(blocks=[block], dt=0.05, end=1.0, interactions=[ground(historic)]))
    sim.step()
    mass, gravity = (
        own(cls, AT_REST).get("mass", BLOCK_MASS),
        own(cls, AT_REST).get("gravity_magnitude", 9.81),
    )
    assert sim.read("a.force")[0][0, 0].tolist() == [0.0, 0.0, mass * gravity]


def test_the_ground_of_scrimmage_bears_a_copter_whose_thrust_is_less_than_its_weight():
    """The model stands where the force is more than twice its thrust; where it is less than the thrust, the force does not count."""
    thrust = 12.0  # [N], more than 1 kg weighs
    copter = historic.Multirotor(omega_max=np.sqrt(thrust / 4 / 5.45e-6), omega_min=0.0, mass=3.0)

    class Thrust(Autonomy):
        motors = Output("motor_0 motor_1 motor_2 motor_3", unit="rad/s")

        def step(self, g):
            self.motors[:] = 9999.0

    block = resting(copter, autonomy=Thrust(), mass=1.0)
    assert np.abs(heights(block, ground(historic))).max() < 1e-6
