"""One path language and one converter behind every door: a number is SI, a text is read as a mission file reads it."""

from __future__ import annotations

import math

import pytest

from tussle import Block, Mission, Simulation
from tussle.batch import Batch
from tussle.batch.sweep_file import read_sweep
from tussle.cli.options import read_settings
from tussle.errors import MissionError, ParameterError, TussleError
from tussle.mission import read_mission
from tussle.mission.paths import with_value
from tussle.stock import AvoidEntityMS, Boids, DirectController, MotorSchemas, SingleIntegrator, Unicycle

FILE = """<runscript><run end="1"/><entity><name>prey</name>
<autonomy{}>Boids</autonomy><controller>DirectController</controller><motion_model>SingleIntegrator</motion_model>
</entity></runscript>"""
PATH = "prey.Boids.fov_az"


def game(**values):
    block = Block(
        name="prey", autonomy=Boids(**values), controller=DirectController(), motion=SingleIntegrator()
    )
    return Mission(blocks=[block], end=1.0)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "m.xml"
    path.write_text(FILE.format(""))
    return path


def fov(mission):
    return mission.blocks[0].autonomy[0].values["fov_az"]


def of_point(batch):
    """What is played, with what differs in the stack."""
    with batch.simulation(0) as sim:
        return sim.read(PATH)[0].item()


def by_sweep(file, text):
    path = file.with_name("sweep.toml")
    path.write_text(text)
    sweep = read_sweep(path)
    return of_point(
        Batch(file, runs=1, vary=sweep.variables if sweep.points is None else (), points=sweep.points)
    )


def by_params(value):
    with Simulation(game(), params={PATH: value}) as sim:
        return sim.read(PATH)[0].item()


def by_reset(value):
    with Simulation(game()) as sim:
        sim.reset([0], params={PATH: value})
        return sim.read(PATH)[0].item()


def by_write(value):
    with Simulation(game()) as sim:
        sim.write(PATH, value)
        return sim.read(PATH)[0].item()


def by_file(file, value):
    file.write_text(FILE.format(f' fov_az="{value}"'))
    return fov(read_mission(file).mission)


EITHER = {
    "constructor": lambda file, value: fov(game(fov_az=value)),
    "replace": lambda file, value: fov(
        game().replace(blocks=[game().blocks[0].replace(autonomy=Boids().replace(fov_az=value))])
    ),
    "params=": lambda file, value: by_params(value),
    "params= by world": lambda file, value: by_params([value]),
    "reset": lambda file, value: by_reset(value),
    "write": lambda file, value: by_write(value),
    "with_value": lambda file, value: fov(with_value(game(), PATH, value)),
    "read_mission": lambda file, value: fov(read_mission(file, {PATH: value}).mission),
    "settings= of a file": lambda file, value: of_point(Batch(file, runs=1, settings={PATH: value})),
    "settings= of a mission": lambda file, value: of_point(Batch(game(), runs=1, settings={PATH: value})),
    "choices of a file": lambda file, value: of_point(Batch(file, runs=1, vary={PATH: [value]})),
    "choices of a mission": lambda file, value: of_point(Batch(game(), runs=1, vary={PATH: [value]})),
    "points= of a file": lambda file, value: of_point(Batch(file, runs=1, points=[{PATH: value}])),
    "points= of a mission": lambda file, value: of_point(Batch(game(), runs=1, points=[{PATH: value}])),
    "sweep file": lambda file, value: by_sweep(file, f"[vary]\n{PATH} = [{value!r}]"),
    "points of a sweep file": lambda file, value: by_sweep(file, f"[[points]]\n{PATH} = {value!r}"),
}
TEXT = {
    "mission file": by_file,
    "--set": lambda file, value: fov(read_mission(file, read_settings([f"{PATH}={value}"])).mission),
    "--vary of a file": lambda file, value: of_point(Batch(file, runs=1, vary=[f"{PATH}={value}"])),
    "--vary of a mission": lambda file, value: of_point(Batch(game(), runs=1, vary=[f"{PATH}={value}"])),
    "text in a sweep file": lambda file, value: by_sweep(file, f"[vary]\n{PATH} = {value!r}"),
}


@pytest.mark.parametrize("door", EITHER)
def test_a_number_is_si(file, door):
    assert EITHER[door](file, 1.5) == 1.5


@pytest.mark.parametrize(("text", "value"), [("90", math.pi / 2), ("90 deg", math.pi / 2), ("1.5 rad", 1.5)])
@pytest.mark.parametrize("door", EITHER | TEXT)
def test_a_text_is_read_as_a_mission_file_reads_it(file, door, text, value):
    assert (EITHER | TEXT)[door](file, text) == value


@pytest.mark.parametrize("source", ["file", "mission"])
def test_bounds_that_are_numbers_are_si_and_those_of_a_text_are_not(file, source):
    mission = file if source == "file" else game()
    for vary, low in (
        ({PATH: (1.0, 2.0)}, 1.0),
        ([f"{PATH}=90:180"], math.pi / 2),
        ([f"{PATH}=1:2 rad"], 1.0),
    ):
        assert of_point(Batch(mission, runs=1, vary=vary, sample="grid")) == low
    assert by_sweep(file, f"[vary]\n{PATH} = {{ low = 1.0, high = 2.0, levels = 2 }}\n") == 1.0


def test_a_batch_of_numbers_and_one_of_texts_are_not_the_same_batch(file):
    number, text = Batch(file, runs=1, vary={PATH: [1.5]}), Batch(file, runs=1, vary=[f"{PATH}=1.5"])
    assert number.fingerprint != text.fingerprint


def test_a_placeholder_is_a_piece_of_the_file(file):
    file.write_text(FILE.format(' fov_az="${fov=10}"'))
    assert fov(read_mission(file, {"fov": 90}).mission) == math.pi / 2


def test_the_file_is_kept_as_text_that_is_read_again_as_it_was(file, tmp_path):
    path = tmp_path / "again.xml"
    loaded = read_mission(file, {
        PATH: 1.5, "prey.heading": 0.25, "prey.variance_heading": 0.01, "run.dt": 0.1, "prey.count": 3, "prey.use_variance_all_ents": True,
        "prey.motion_model": "SimpleAircraft", "prey.controller": "SimpleAircraftControllerPID",
        "prey.SimpleAircraftControllerPID.heading_pid": (1.0, 2.0, 3.0, 0.5), "prey.Boids.loop_rate": 5,
    })  # fmt: skip
    (block,) = loaded.mission.blocks
    assert (block.heading, block.heading_variance, block.count, block.scatter_first) == (0.25, 0.01, 3, True)
    assert block.controller[0].values["heading_pid"] == (1.0, 2.0, 3.0, 0.5)
    assert (block.autonomy[0].rate, loaded.mission.dt) == (5.0, 0.1)
    assert loaded.settings[PATH] == "1.5 rad"
    path.write_text(loaded.text)
    assert read_mission(path).mission == read_mission(path, loaded.settings).mission == loaded.mission


def test_a_value_that_no_file_holds_is_refused(file):
    with pytest.raises(MissionError, match=r"setting prey.motion_model: Unicycle\(\) is not allowed"):
        read_mission(file, {"prey.motion_model": Unicycle()})


# -- paths ------------------------------------------------------------------------------------------------------------------

NESTED = """<runscript><entity><name>a</name><motion_model>SingleIntegrator</motion_model>
<controller>SingleIntegratorControllerSimple</controller>
<autonomy behaviors="[ AvoidEntityMS gain='1' ] [ AvoidEntityMS gain='2' ]">MotorSchemas</autonomy></entity></runscript>"""


def gains(mission):
    return [b.values["gain"] for b in mission.blocks[0].autonomy[0].values["behaviors"]]


def test_a_path_leads_into_a_plugin_within_a_plugin(file):
    file.write_text(NESTED)
    path = "a.MotorSchemas.AvoidEntityMS_2.gain"
    loaded = read_mission(file, {path: 5})
    assert gains(loaded.mission) == gains(with_value(read_mission(file).mission, path, "5")) == [1.0, 5.0]
    file.write_text(loaded.text)
    assert gains(read_mission(file).mission) == [1.0, 5.0]
    with pytest.raises(MissionError, match="has both kinds of quotes"):
        read_mission(file, {path: "'\""})


def test_names_of_a_path_are_those_of_the_mission(file):
    file.write_text(
        FILE.format("").replace("<controller", '<autonomy max_speed="3">Boids</autonomy><controller', 1)
    )
    mission = read_mission(file, {"prey.Boids.max_speed": 5, "prey.Boids_2.max_speed": 7}).mission
    assert [(a.instance_name, a.values["max_speed"]) for a in mission.blocks[0].autonomy] == [
        ("Boids", 5.0),
        ("Boids_2", 7.0),
    ]


def test_what_is_called_run_is_the_times_and_steps(file):
    text = FILE.format("").replace("<name>prey", "<name>run")
    file.write_text(text)
    loaded = read_mission(file, {"run.dt": "0.5", "run_2.count": "4"})
    assert (loaded.mission.dt, loaded.mission.blocks[0].name, loaded.mission.blocks[0].count) == (
        0.5,
        "run_2",
        4,
    )
    with pytest.raises(MissionError, match="'run' is not allowed as the name of a block or plugin"):
        game().replace(blocks=[game().blocks[0].replace(name="run")])


WRONG = "prey.Boid.fov_az"
SAID = r"prey has no 'Boid' \(did you mean 'Boids'\?\); there are: Boids, DirectController, SingleIntegrator"


@pytest.mark.parametrize("door", [k for k in EITHER if k not in ("constructor", "replace")])
def test_every_door_says_the_same_of_a_wrong_path(file, door, monkeypatch):
    monkeypatch.setitem(globals(), "PATH", WRONG)
    with pytest.raises(TussleError, match=SAID):
        EITHER[door](file, 1.5)
    with Simulation(game()) as sim, pytest.raises(ParameterError, match=f"'{WRONG}': {SAID}"):
        sim.read(WRONG)


def test_what_is_the_same_in_all_worlds_is_set_in_the_mission():
    nested = MotorSchemas(behaviors=[AvoidEntityMS()])
    mission = game().replace(blocks=[game().blocks[0].replace(autonomy=nested)])
    for path in (
        "run.dt",
        "prey.count",
        "prey.motion",
        "prey.MotorSchemas.behaviors",
        "prey.MotorSchemas.rate",
    ):
        with pytest.raises(ParameterError, match=f"'{path}'.*in the mission"):
            Simulation(mission, params={path: 1})


# -- write ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "text", "value"),
    [
        ("prey.pos", "1 km, 2, 3", [1000.0, 2.0, 3.0]),
        ("prey.radius", "3 ft", 0.9144),
        ("prey.omega", "0, 0, 90 deg/s", [0.0, 0.0, math.pi / 2]),
    ],
)
def test_a_text_is_written_to_any_column(path, text, value):
    with Simulation(game()) as sim:
        sim.write(path, text)
        assert sim.read(path)[0][0, 0].tolist() == value


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("prey.radius", "3 kg", r"'prey.radius': '3 kg' is in kg, not convertible to m"),
        ("prey.pos", [["1", "2", "3"]], r"'prey.pos': values are <U1"),
        (
            "GlobalNetwork.comm_delay",
            -1.0,
            r"GlobalNetwork.comm_delay: Network.comm_delay = -1.0 is not allowed",
        ),
        ("GlobalNetwork.comm_delay", [1.0, 2.0], r"values have shape \(2,\).*\(1,\)"),
    ],
)
def test_what_cannot_be_written(path, value, said):
    with Simulation(game()) as sim, pytest.raises(ParameterError, match=said):
        sim.write(path, value)
