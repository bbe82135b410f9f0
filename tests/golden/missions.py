"""The golden missions: small games that between them take every path of a step: orders, rates, births, deaths, messages, beliefs."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from golden_plugins import Beacon, Car, Nursery, Wanderer

from tussle import Block, Mission
from tussle.stock import (
    AvoidEntityMS,
    Boids,
    Boundary,
    DirectController,
    LocalNetwork,
    MotorSchemas,
    MoveToGoalMS,
    NoisyContacts,
    NoisyState,
    Predator,
    RadioNetwork,
    SimpleAircraft,
    SimpleAircraftControllerPID,
    SimpleCapture,
    SimpleCaptureMetrics,
    SimpleCollision,
    SingleIntegrator,
    SingleIntegratorControllerSimple,
    SphereNetwork,
    Still,
    Straight,
    Unicycle,
    UnicyclePID,
    WaypointDispatcher,
    WaypointGenerator,
)

SEEDS = (1, 2, 3)
"""Seeds whose hashes are kept."""


def _hunters(name: str, team: int, count: int, north: float, *, switches: bool) -> Block:
    return Block(
        name=name, team=team, count=count, position=(40.0, north, 200.0), placement="uniform", half_width=(30.0, 30.0, 10.0),
        heading="180 deg", autonomy=Predator(max_speed=35.0, capture_range=20.0, allow_prey_switching=switches),
        motion=Unicycle(vel_max=35.0, turn_rate_max=2.0, pitch_rate_max=1.5),
    )  # fmt: skip


def _prey(count: int, **law: object) -> Block:
    return Block(
        name="prey", team=1, count=count, position=(0.0, 0.0, 200.0), placement="uniform", half_width=(60.0, 60.0, 10.0),
        autonomy=Boids(**law), motion=Unicycle(vel_max=30.0, turn_rate_max=1.0, pitch_rate_max=1.0),
    )  # fmt: skip


def chase_synchronous() -> Mission:
    """Predator/prey with twelve substeps: the block loop, claims, captures, deaths, scores."""
    return Mission(
        blocks=[_prey(24), _hunters("keepers", 2, 3, -40.0, switches=False), _hunters("switchers", 3, 2, 40.0, switches=True)],
        motion_multiplier=12, end=5.0, end_conditions="time, one_team, all_dead",
        interactions=[SimpleCapture(capture_range=20.0)], metrics=[SimpleCaptureMetrics()],
    )  # fmt: skip


def chase_sequential() -> Mission:
    """The same one after another, with the paper's means and scoring."""
    return Mission(
        blocks=[
            _prey(8, averaging="historic"),
            _hunters("keepers", 2, 2, -40.0, switches=False), _hunters("switchers", 3, 1, 40.0, switches=True),
        ],
        update="sequential", end=5.0, end_conditions="time, one_team, all_dead",
        interactions=[SimpleCapture(capture_range=20.0, credit="each")], metrics=[SimpleCaptureMetrics()],
    )  # fmt: skip


def flock_sequential() -> Mission:
    """A flock one after another, in which entities come into range and leave it while the others move."""
    return Mission(
        blocks=[_prey(16, comms_range=30.0), _prey(8, comms_range=45.0, averaging="historic").replace(name="far", team=2)],
        update="sequential", end=5.0,
    )  # fmt: skip


def two_flocks() -> Mission:
    """Points in two flocks that see differently far, collide, and are placed apart."""
    flock = lambda name, team, east, sight: Block(  # noqa: E731
        name=name, team=team, count=20, position=(east, 0.0, 100.0), variance=(400.0, 400.0, 100.0), scatter_first=True,
        autonomy=Boids(comms_range=sight, avoid_nonteam_weight=0.0, goal=(-east, 0.0, 100.0), use_initial_heading=False),
        controller=SingleIntegratorControllerSimple(), motion=SingleIntegrator(),
    )  # fmt: skip
    return Mission(
        blocks=[flock("west", 1, -40.0, 35.0), flock("east", 2, 40.0, 120.0)], end=5.0,
        interactions=[SimpleCollision(collision_range=4.0, startup_collision_range=6.0)],
    )  # fmt: skip


def aircraft() -> Mission:
    """Aircraft under PID loops that believe a noisy state and turn back at a boundary."""
    return Mission(
        blocks=[
            Block(
                name="plane", team=1, count=6, position=(0.0, 0.0, 300.0), heading_variance=1.0, climb="5 deg", roll="10 deg", speed=22.0,
                autonomy=Straight(enable_boundary_control=True), controller=SimpleAircraftControllerPID(),
                motion=SimpleAircraft(), sensor=NoisyState(pos_noise_0=(0.0, 2.0), orient_noise_2=(0.01, 0.05)),
            )
        ],
        motion_multiplier=2, end=6.0,
        interactions=[Boundary(center=(0.0, 0.0, 300.0), lengths=(90.0, 90.0, 200.0), rpy=(0.0, 0.0, 0.3))],
    )  # fmt: skip


def schemas() -> Mission:
    """Behaviours inside a behaviour, a PID between the substeps, noisy contacts."""
    behaviors = [AvoidEntityMS(sphere_of_influence=40.0, gain=2.0), MoveToGoalMS(goal=(200.0, 50.0, 120.0))]
    return Mission(
        blocks=[
            Block(
                name="robot", team=1, count=12, position=(0.0, 0.0, 100.0), heading_variance=2.0,
                autonomy=MotorSchemas(max_speed=12.0, behaviors=behaviors), controller=UnicyclePID(),
                motion=Unicycle(vel_max=15.0, turn_rate_max=1.0, pitch_rate_max=1.0, enable_roll=True),
                sensor=NoisyContacts(max_range=25.0, orient_noise_0=(0.0, 0.1)),
            )
        ],
        motion_multiplier=4, end=6.0,
    )  # fmt: skip


def births_and_radio() -> Mission:
    """Births by rate, by count and by a referee; messages by a radio that is late and lossy; goals heard."""
    beacon = lambda name, count, **when: Block(  # noqa: E731
        name=name, team=1, count=count, variance=(900.0, 900.0, 25.0), heading_variance=0.5, autonomy=Beacon(),
        motion=SingleIntegrator(), **when,
    )  # fmt: skip
    listener = Block(
        name="listener", team=2, count=4, position=(20.0, 0.0, 0.0),
        autonomy=MotorSchemas(behaviors=[MoveToGoalMS(use_initial_heading=True, network_name="SphereNetwork")]),
        motion=SingleIntegrator(max_speed=8.0),
    )  # fmt: skip
    return Mission(
        blocks=[beacon("first", 6), listener, beacon("late", 14, rate=4.0, slots=2, first_birth=0.3, interval_sd=0.2)], end=5.0,
        networks=[SphereNetwork(range=60.0, prob_transmit=0.6, comm_delay=0.35), LocalNetwork()], interactions=[Nursery()],
    )  # fmt: skip


def radio() -> Mission:
    """A radio with all its losses, between entities that are born and jammed."""
    node = lambda name, count, **when: Block(  # noqa: E731
        name=name, team=1, count=count, variance=(900.0, 900.0, 25.0), autonomy=Beacon(network="RadioNetwork"),
        motion=SingleIntegrator(), **when,
    )  # fmt: skip
    network = RadioNetwork(
        range=40.0, prob_transmit=0.9, filter_comms_plane=True, comms_boundary_epsilon=3.0, path_loss_exponent=2.7, fading="rayleigh",
        jammer_team=2, jammer_range=25.0, bandwidth=5000.0, queue_limit=60.0, half_duplex=True, is_stochastic_delay=True,
    )  # fmt: skip
    jammer = Block(name="jammer", team=2, position=(20.0, 0.0, 0.0), motion=Still())
    return Mission(
        blocks=[node("first", 9), jammer, node("late", 9, rate=4.0)], end=3.0, networks=[network], interactions=[Nursery()],
    )  # fmt: skip


def narrow_view() -> Mission:
    """Flocking with a limited field of view, next to a flock without."""
    flock = lambda name, **view: Block(  # noqa: E731
        name=name, team=1, count=12, position=(0.0, 0.0, 100.0), variance=(900.0, 900.0, 100.0), heading_variance=1.0,
        autonomy=Boids(comms_range=70.0, **view), controller=DirectController(),
        motion=Unicycle(vel_max=25.0, turn_rate_max=1.0, pitch_rate_max=0.5),
    )  # fmt: skip
    narrow = flock("narrow", fov_az="150 deg", fov_el="60 deg")
    return Mission(blocks=[narrow, flock("wide")], motion_multiplier=3, end=5.0)


def slow_clocks() -> Mission:
    """Plugins at 3 Hz in steps of 0.1 s: who is due depends on each world's own clock."""
    prey = Block(
        name="prey", team=1, count=10, variance=(400.0, 400.0, 4.0), heading_variance=1.0, autonomy=Boids(rate=3.0),
        controller=UnicyclePID(), motion=Unicycle(vel_max=20.0, turn_rate_max=1.0, pitch_rate_max=0.5), sensor=NoisyState(rate=3.0),
    )  # fmt: skip
    hunter = Block(
        name="hunter", team=2, count=2, position=(40.0, 0.0, 0.0), autonomy=Predator(rate=3.0, capture_range=15.0),
        controller=DirectController(), motion=Unicycle(vel_max=30.0, turn_rate_max=2.0, pitch_rate_max=1.0),
    )  # fmt: skip
    talker = Block(name="talker", team=3, count=3, autonomy=Beacon(rate=3.0), motion=SingleIntegrator())
    return Mission(
        blocks=[prey, hunter, talker], motion_multiplier=2, end=5.0, networks=[SphereNetwork(range=40.0, comm_delay=0.2)],
        interactions=[SimpleCapture(capture_range=15.0, rate=3.0)], metrics=[SimpleCaptureMetrics()],
    )  # fmt: skip


def cars() -> Mission:
    """A motion model that is only its state equation, driven by plain NumPy code."""
    car = Block(
        name="car", team=1, count=15, variance=(400.0, 400.0, 0.0), heading_variance=3.0, speed=3.0, autonomy=Wanderer(), motion=Car(),
    )  # fmt: skip
    return Mission(blocks=[car], motion_multiplier=5, end=5.0)


def hunters_first() -> Mission:
    """Hunters with the lowest ids keep to prey whose ids are above all that are left once it is captured."""
    hunter = Block(
        name="hunter", team=2, count=3, autonomy=Predator(max_speed=35.0, capture_range=8.0, allow_prey_switching=False),
        motion=Unicycle(vel_max=35.0, turn_rate_max=2.0),
    )  # fmt: skip
    prey = Block(
        name="prey", team=1, count=4, position=(30.0, 0.0, 0.0), variance=(400.0, 400.0, 0.0), autonomy=Boids(),
        motion=Unicycle(vel_max=20.0),
    )  # fmt: skip
    return Mission(blocks=[hunter, prey], interactions=[SimpleCapture(capture_range=8.0)], end=8.0)


def last_captured_first() -> Mission:
    """The entity with the last id starts next to a hunter and is captured first."""
    prey = _prey(6)
    hunter = _hunters("keepers", 2, 1, 0.0, switches=False)
    last = Block(
        name="last",
        team=1,
        count=1,
        position=(40.0, 3.0, 200.0),
        autonomy=Boids(),
        motion=Unicycle(vel_max=20.0),
    )
    return Mission(
        blocks=[prey, hunter, last],
        interactions=[SimpleCapture(capture_range=20.0)],
        update="sequential",
        end=5.0,
    )


def _nursery(update: str) -> Mission:
    """Births two at a time, and messages in the very steps of the births."""
    block = Block(
        name="newborn", team=1, count=12, variance=(100.0, 100.0, 0.0), rate=2.0, slots=2, interval_sd=0.05,
        autonomy=[WaypointGenerator(), WaypointDispatcher(), MotorSchemas(behaviors=[MoveToGoalMS()])],
        controller=UnicyclePID(), motion=Unicycle(),
    )  # fmt: skip
    slow = Block(
        name="slow",
        team=2,
        count=4,
        autonomy=Beacon(rate=2.0, network="GlobalNetwork"),
        motion=SingleIntegrator(),
    )
    return Mission(blocks=[slow, block], update=update, end=5.0)


def births_synchronous() -> Mission:
    """Births and messages, all at once."""
    return _nursery("synchronous")


def births_sequential() -> Mission:
    """Births and messages, one after another: each newborn brings a group of its own."""
    return _nursery("sequential")


STEPS: dict[str, int] = {
    "chase_synchronous": 24,
    "chase_sequential": 24,
    "flock_sequential": 24,
    "two_flocks": 24,
    "aircraft": 40,
    "schemas": 24,
    "births_and_radio": 24,
    "radio": 24,
    "narrow_view": 24,
    "slow_clocks": 24,
    "cars": 24,
    "hunters_first": 80,
    "last_captured_first": 24,
    "births_synchronous": 40,
    "births_sequential": 40,
}
"""Steps after which a mission's hashes are taken."""

NAMES = tuple(STEPS)


@cache
def mission(name: str) -> Mission:
    """A golden mission by its name; missions are frozen, so all callers share it."""
    make: Callable[[], Mission] = globals()[name]
    return make()
