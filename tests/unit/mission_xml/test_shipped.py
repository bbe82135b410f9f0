"""The missions that ship, and those of SCRIMMAGE."""

from __future__ import annotations

from pathlib import Path

import pytest

from tussle import Block, Mission, Simulation
from tussle.errors import MissionError, TussleError
from tussle.mission import catalogue, read_mission, shipped_missions, tags
from tussle.plugins import stock
from tussle.scene import Origin, Scene
from tussle.stock import Boids, DirectController, Predator, SimpleCapture, SimpleCaptureMetrics, Unicycle

PAGE = Path(__file__).parents[3] / "docs" / "mission-format.md"
PLAY = {
    "straight.xml": 3, "straight-no-gui.xml": 2, "unicycle.xml": 2, "harmonic-oscillator.xml": 1, "waypoint_follower.xml": 2,
    "batch-example-mission.xml": 2, "straight_include/straight_complete.xml": 2, "capture-the-flag-simple.xml": 4,
    "colliding_spheres.xml": 2, "fixed_wing_6dof.xml": 1, "multirotor-test.xml": 1, "rlsimple.xml": 1,
    "straight_include/straight_include.xml": 2,
}  # fmt: skip
"""Missions of SCRIMMAGE that play as they are, and the number of blocks of each."""
RASCAL = ("predator_prey_boids.xml", "straight_jsbsim.xml")
"""Those that fly the Rascal in JSBSim, which JSBSim's package doesn't have."""
PARTS = {f"straight_include/{name}.xml" for name in ("entity1", "entity2", "run_tag", "sim_info")}
"""Files that others include."""


def game(*, update: str, boids: Boids, credit: str, between: bool, health: float) -> Mission:
    """The paper's game in Python."""

    def hunters(name: str, team: int, north: float, *, switches: bool) -> Block:
        return Block(
            name=name, team=team, count=5, position=(2000, north, 200), placement="uniform", half_width=(500, 500, 100),
            heading="180 deg", health=health, controller=DirectController(),
            autonomy=Predator(max_speed=35, allow_prey_switching=switches, between_steps=between),
            motion=Unicycle(vel_max=35, turn_rate_max=2, pitch_rate_max=1.5),
        )  # fmt: skip

    prey = Block(
        name="prey", team=1, count=100, position=(0, 0, 200), placement="uniform", half_width=(200, 200, 100), health=health,
        autonomy=boids, controller=DirectController(), motion=Unicycle(vel_max=30),
    )  # fmt: skip
    keepers = hunters("keepers", 2, -1000, switches=False)
    return Mission(
        blocks=[prey, keepers, hunters("switchers", 3, 1000, switches=True)],
        end=20, update=update, end_conditions="time, one_team, all_dead",
        interactions=[SimpleCapture(credit=credit, between_steps=between)], metrics=[SimpleCaptureMetrics()],
        scene=Scene(origin=Origin.from_degrees(35.721025, -120.767925, 300)),
    )  # fmt: skip


GAMES = {
    "predator_prey": game(update="synchronous", boids=Boids(), credit="once", between=True, health=1),
    "predator_prey_paper": game(
        update="sequential",
        boids=Boids(goal_distance=1e4, averaging="historic"),
        credit="each",
        between=False,
        health=5,
    ),
}


ON_REGIONS = {
    "capture_the_flag": {"runner_speed": "15"},
    "boundary_defense": {"defenders": "100", "raiders": "25"},
}


@pytest.mark.parametrize("name", ON_REGIONS)
def test_the_games_on_regions_are_contested(name):
    """In the first minute defenders capture, and a flag is taken in spite of them."""
    mission = read_mission(name, {**ON_REGIONS[name], "end": "60"}, strict=True).mission
    result = Simulation(mission, seeds=1).run()[0]
    captures = result.metrics["SimpleCaptureMetrics"]["NonTeamCapture"]
    assert captures[1] > 5
    assert sum(captures.values()) == sum(b.count for b in mission.blocks) - sum(result.alive.values())
    assert sum(result.metrics["FlagCaptureMetrics"]["flags_taken"].values()) > 0


@pytest.mark.slow
def test_a_jammer_costs_a_convoy_vehicles():
    """Without a jammer the escorts hear of all raiders in time; with one the convoy halts in its range, and raiders get through."""
    mission = read_mission("convoy", {"end": "240"}, strict=True).mission
    far = {"radio.jammer_range": [0.0] * 3 + [8000.0] * 3}
    results = Simulation(mission, seeds=[1, 2, 3] * 2, params=far).run()
    left = [[sum(r.alive[team] for r in half) for team in (1, 3)] for half in (results[:3], results[3:])]
    (trucks, raiders), (jammed_trucks, jammed_raiders) = left
    assert trucks >= jammed_trucks + 3
    assert raiders + 5 <= jammed_raiders


@pytest.mark.slow
def test_searchers_who_bid_their_whole_way_find_all_first():
    """Bids of the way to the area alone give most areas to one searcher."""
    left = {}
    for rule in ("path", "nearest"):
        mission = read_mission("auction_search", {"rule": rule, "end": "180"}, strict=True).mission
        left[rule] = Simulation(mission, seeds=1).run()[0].alive[2]
    assert left["path"] == 0 < 3 < left["nearest"]


@pytest.mark.slow
def test_a_survey_has_a_best_speed():
    """Slower finds less in the time, faster on the battery; energy over distance grows with the square of the speed."""
    mission = read_mission(
        "underwater_survey", {"end": "450", "energy": "200", "mines": "300"}, strict=True
    ).mission
    speeds = {f"{name}.GoTo.speed": [0.6, 1.0, 1.5] for name in ("south", "north")}
    simulation = Simulation(mission, seeds=[3] * 3, params=speeds)
    found = [300 - result.alive[2] for result in simulation.run()]
    assert found[1] > 1.1 * max(found[0], found[2])
    energy = simulation.read("south.UUV6DOFLinearEnergy.energy")[0][:, 0]
    assert energy[0] > energy[1] > energy[2] == 0.0


def test_cars_find_their_way_through_the_maze():
    """No car passes through a wall, and some leave the corridor in which they begin."""
    loaded = read_mission("car_maze", {"end": "40"}, strict=True)
    sim = Simulation(loaded.mission, seeds=loaded.seed)
    last, farthest = sim.read("cars.pos")[0][0], -100.0
    while not sim.is_over:
        sim.step(5)
        pos = sim.read("cars.pos")[0][0]
        assert loaded.mission.scene.line_of_sight(last.T, pos.T).all()
        last, farthest = pos, max(farthest, pos[:, 0].max())
    assert farthest > -30.0


@pytest.mark.slow
def test_quadrotors_that_see_far_enough_to_brake_arrive():
    """At 8 m/s they need about 15 m to stop: who sees 5 m hits buildings."""
    mission = read_mission("urban_quadrotors", {"end": "45", "quadrotors": "3"}, strict=True).mission
    far = {f"{name}.RayTrace.max_range": [5.0, 40.0] for name in ("eastbound", "northbound")}
    blind, seeing = Simulation(mission, seeds=[2, 2], params=far).run()
    arrived = [sum(r.metrics["Arrivals"]["arrived"].values()) for r in (blind, seeing)]
    assert arrived[0] <= 2 < 5 <= arrived[1]
    assert sum(blind.alive.values()) <= 2


@pytest.mark.slow
def test_strong_dozers_clear_more_than_weak_ones():
    """A crate holds against 490 N: with 1 kN a dozer halts before the third, with 8 kN it takes all along."""
    mission = read_mission("dozers", {"end": "30"}, strict=True).mission
    push = {f"dozer_{k}.DoubleIntegrator.max_acc": [2.0, 16.0] for k in range(1, 6)}
    weak, strong = Simulation(mission, seeds=[1, 1], params=push).run()
    assert weak.alive[2] >= 38
    assert strong.alive[2] <= 30


@pytest.mark.parametrize("name", GAMES)
def test_the_games_are_those_built_in_python(name):
    loaded = read_mission(name, {"end": "20"}, strict=True)
    mission = GAMES[name].replace(name=loaded.mission.name)
    assert loaded.mission == mission
    assert loaded.seed == 1
    short = {"end": 2.0} if mission.update == "sequential" else {}
    read, built = (Simulation(m.replace(**short), seeds=7).run()[0] for m in (loaded.mission, mission))
    assert read.state_hash == built.state_hash
    assert read.scores == built.scores


@pytest.mark.slow
def test_a_jet_and_compiled_aircraft_hold_their_courses():
    for name, speed, options in (("fixed_wing_6dof", 220.0, {}), ("straight_jsbsim", 24.0, {"count": "2"})):
        sim = Simulation(read_mission(name, {"end": "12", **options}, strict=True).mission, seeds=1)
        sim.run()
        vel = sim.state.population.bodies.vel
        assert vel.shape[1] >= (1 if name == "fixed_wing_6dof" else 4)
        assert abs(vel[0] / speed).min() > 0.85
        assert abs(vel[1:] / speed).max() < 0.2


def test_prey_that_fly_as_aircraft_are_hunted():
    mission = read_mission("predator_prey_jsbsim", {"end": "40", "prey": "60"}, strict=True).mission
    result = Simulation(mission, seeds=1).run()[0]
    captured = sum(result.metrics["SimpleCaptureMetrics"]["NonTeamCapture"].values())
    assert 0 < 60 - result.alive[1] <= captured + 12  # others collided at the start


OTHERS = ("convoy", "auction_search", "underwater_survey")
AIRCRAFT = ("formation_flight", "straight_jsbsim", "fixed_wing_6dof", "predator_prey_jsbsim")


def test_shipped_missions_have_titles_and_are_packaged():
    shipped = shipped_missions()
    assert set(shipped) == {*GAMES, *ON_REGIONS, *OTHERS, *AIRCRAFT, "car_maze", "urban_quadrotors", "dozers"}
    for path, title in shipped.values():
        assert title
        assert read_mission(path, strict=True).name == title
        assert path.parent == Path(catalogue.__file__).parent / "library"
    assert read_mission("predator_prey").mission.end == 500.0


def test_the_example_of_each_plugin_is_short_and_uses_it():
    for name, path in stock.examples().items():
        text = path.read_text(encoding="utf-8")
        its_names = [other for other in stock.manifest() if stock.load(other) is stock.load(name)]
        assert any(f">{one}<" in text or f"[ {one} " in text for one in its_names), name
        assert len(text.splitlines()) <= 25, name
        assert text.startswith("<runscript name="), name


def test_each_mission_at_hand_is_read_or_refused_in_a_sentence(existing):
    """Whatever the folder holds beside the missions that are known to play."""
    folder = existing("")
    found = {path.relative_to(folder).as_posix() for path in folder.rglob("*.xml")}
    assert {*PLAY, *RASCAL, *PARTS} <= found
    said = {}
    for name in found:
        try:
            assert read_mission(folder / name, search=[folder], compat="scrimmage").mission.blocks
        except TussleError as error:
            said[name] = str(error)
    assert [name for name, text in said.items() if Path(name).name not in text] == []


@pytest.mark.parametrize("name", PLAY)
def test_missions_of_the_existing_system_play(existing, name):
    loaded = read_mission(existing(name), search=[existing("")])
    assert len(loaded.mission.blocks) == PLAY[name]
    with Simulation(loaded.mission, seeds=loaded.seed or 1, on_error="raise") as sim:
        sim.step(3)
        assert sim.steps.tolist() == [3]
    assert read_mission(existing(name), search=[existing("")]).mission == loaded.mission


@pytest.mark.parametrize("name", RASCAL)
def test_a_mission_that_flies_the_rascal_says_what_is_missing(existing, name):
    pytest.importorskip("jsbsim")
    with pytest.raises(
        MissionError, match=r"there is no file 'scripts/rascal_piedmont\.xml' .*--data-path DIR"
    ):
        read_mission(existing(name))


def test_missing_plugins_have_an_error_of_their_own():
    with pytest.raises(catalogue.AbsentPluginError, match="AirSimSensor is dropped: AirSim"):
        catalogue.Catalogue().load("AirSimSensor")


def test_only_plugins_that_do_not_ship_are_named_as_missing():
    assert set(catalogue.historic()["plugins"]["names"]).isdisjoint(stock.manifest())


@pytest.mark.parametrize("plugin", stock.manifest())
def test_historic_attributes_belong_to_parameters_that_are_there(plugin):
    cls = stock.load(plugin)
    params, known = cls.params(), cls.historic_attributes
    assert {*known.renamed.values(), *known.joined, *known.least_zero} <= set(params)
    assert set(known.differs) <= {*params, *cls.children()}
    assert {*known.unread, *known.renamed}.isdisjoint(params)
    for parameter, parts in known.joined.items():
        assert len(parts) == len(params[parameter].fields)


TABLES = {
    "run": tags.RUN, "runscript": tags.WORLD, "entity": tags.ENTITY, "attributes of entity": tags.ENTITY_ATTRIBUTES, "base": tags.BASE,
    "plugin": tags.PLUGIN,
}  # fmt: skip


def row(name: str, known: tags.TagSpec) -> str:
    """The line of the page about a tag."""
    words = {
        "truth": "true/false",
        "whole": "whole number",
        "number": "number",
        "text": "text",
        "words": "words",
    }
    takes = f"number in {known.unit}" if known.unit else words[known.reads]
    bound = f", {known.bound}" if known.bound else ""
    return f"| `{name}` | {takes}{bound} | {known.default or '–'} | {known.doc} |"


@pytest.mark.parametrize("table", TABLES)
def test_every_tag_that_the_reader_knows_stands_in_the_page(table):
    lines = PAGE.read_text().splitlines()
    missing = [line for name, known in TABLES[table].items() if (line := row(name, known)) not in lines]
    assert not missing, "\n".join(missing)


def test_every_plugin_tag_and_addition_stands_in_the_page():
    page = PAGE.read_text()
    for word in ("${name=default}", "xi:include", "--set", "not in tussle yet", "credit"):
        assert word in page
