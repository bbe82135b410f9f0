"""PyAutonomy runs classes of SCRIMMAGE's Python interface."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.errors import MissionError, ParameterError, PluginError
from tussle.mission import read_mission, to_xml
from tussle.plugins.stock.autonomy.py_autonomy.bindings import Quaternion, State
from tussle.stock import PyAutonomy, SimpleAircraft, SimpleAircraftControllerPID, SingleIntegrator

PURSUER = """
import math
import numpy as np
import scrimmage as sc
from scrimmage.bindings import Quaternion

class Straight(object):
    def init(self, params):
        self.speed = float(params['speed'])
        self.state = sc.State()
        self.desired_state = sc.State()
        self.contacts = dict()

    def step_autonomy(self, t, dt):
        other = next(c for i, c in self.contacts.items() if c.id.team_id != self.id.team_id)
        offset = other.state.pos_const() - self.state.pos
        desired = sc.State()
        desired.vel = self.speed * offset / np.linalg.norm(offset)
        desired.quat = Quaternion(0, 0, math.atan2(offset[1], offset[0]))
        self.desired_state = desired
        return t < LAST
"""
MISSION = """<runscript><run end="4" dt="0.1"/>
<entity><name>pursuer</name><team_id>1</team_id><autonomy module="pursuer" class="CLASS" speed="20">PyAutonomy</autonomy>
<motion_model>SingleIntegrator</motion_model></entity>
<entity><name>target</name><team_id>2</team_id><x>300</x><y>400</y><motion_model>Still</motion_model></entity>
</runscript>"""


@pytest.fixture
def pursuit(tmp_path):
    """Read the mission with a class of the file."""

    def read(last="math.inf", chosen="Straight", plugin_file="pursuer.py"):
        (tmp_path / "pursuer.py").write_text(PURSUER.replace("LAST", last))
        (tmp_path / "m.xml").write_text(MISSION.replace("CLASS", chosen))
        return read_mission(tmp_path / "m.xml", plugin_files=[tmp_path / plugin_file] if plugin_file else ())

    return read


def test_a_python_class_of_scrimmage_flies_unchanged(pursuit):
    loaded = pursuit()
    with Simulation(loaded.mission, seeds=[1, 2]) as sim:
        sim.run()
        pos, _ = sim.read("pursuer.pos")
    np.testing.assert_allclose(pos[:, 0], [[48.0, 64.0, 0.0]] * 2, rtol=1e-12)
    assert any("module of PyAutonomy has no effect" in note for note in loaded.notes)


def test_a_stock_plugin_of_the_same_name_stays_what_it_is(pursuit, tmp_path):
    mission = pursuit().mission
    (tmp_path / "o.xml").write_text(
        to_xml(mission, 1).replace(
            "Still<", "Still</motion_model><autonomy>Straight</autonomy><motion_model>Still<", 1
        )
    )
    again = read_mission(tmp_path / "o.xml", plugin_files=[tmp_path / "pursuer.py"]).mission
    assert again.blocks[0].autonomy == mission.blocks[0].autonomy
    assert type(again.blocks[1].autonomy[0]).__module__ == "tussle.plugins.stock.autonomy.straight"


def test_a_mission_names_no_code(pursuit):
    with pytest.raises(
        MissionError, match=r"m.xml:2: PyAutonomy: no plugin file has a class 'Straight' .* --plugin-path"
    ):
        pursuit(plugin_file="")
    with pytest.raises(MissionError, match="did you mean 'Straight'"):
        pursuit(chosen="Strait")


def test_a_class_that_returns_false_ends_its_world(pursuit):
    with pytest.raises(
        PluginError, match=r"pursuer 1, world 1, step 10: Straight\.step_autonomy returned False"
    ):
        Simulation(pursuit(last="1.0").mission, seeds=[1, 2]).run()


def test_the_example_flies_by_heading_altitude_and_speed():
    block = Block(
        name="a", position=(0, 0, 100), heading="30 deg", speed=20, autonomy=PyAutonomy(init_params='{"speed": "25"}'),
        controller=SimpleAircraftControllerPID(), motion=SimpleAircraft(),
    )  # fmt: skip
    with Simulation(Mission(blocks=[block], end=20)) as sim:
        sim.run()
        vel, _ = sim.read("a.vel")
    np.testing.assert_allclose(vel[0, 0], [25 * math.cos(math.pi / 6), 12.5, 0.0], atol=0.3)


def test_a_snapshot_has_the_objects():
    block = Block(name="a", count=3, variance=(1e4, 1e4, 0), autonomy=PyAutonomy(), motion=SingleIntegrator())
    with Simulation(Mission(blocks=[block], end=20), seeds=[1, 2]) as sim:
        sim.step(2)
        snapshot = sim.snapshot()
        sim.step(5)
        wanted = sim.state_hash()
        sim.restore(snapshot)
        sim.step(5)
        assert sim.state_hash() == wanted


class Talker:
    """Publishes, or sets no desired state."""

    def init(self, params):
        if params:
            self.desired_state = State()
            self.pubs["topic"] = object()

    def step_autonomy(self, t, dt):
        return True


@pytest.mark.parametrize(
    ("params", "text"),
    [
        ("{}", r"Talker.desired_state is None; it takes a scrimmage.State"),
        ('{"a": ""}', r"Talker.pubs is not empty: messages"),
    ],
)
def test_what_is_not_passed_on_is_refused(params, text):
    from tussle.plugins.stock.autonomy.py_autonomy import adapted

    block = Block(name="a", autonomy=adapted(Talker)(init_params=params), motion=SingleIntegrator())
    with pytest.raises(PluginError, match=text):
        Simulation(Mission(blocks=[block])).run()


@pytest.mark.parametrize("params", ["speed=3", "[1]", '{"speed": 3}'])
def test_parameters_are_texts(params):
    with pytest.raises(ParameterError, match="init_params"):
        PyAutonomy(init_params=params)


def test_quaternions_and_states_are_those_of_scrimmage():
    turned = Quaternion(0.0, 0.0, math.pi / 2)
    np.testing.assert_allclose(turned.rotate((1, 0, 0)), [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(turned.rotate_reverse((0, 1, 0)), [1, 0, 0], atol=1e-15)
    about = Quaternion((0, 0, 2), math.pi / 2)
    assert about.rotation_angle() == pytest.approx(math.pi / 2)
    assert (about.w, about.x, about.y, about.z) == pytest.approx((turned.w, 0, 0, turned.z))
    angles = Quaternion(0.1, 0.2, 0.3)
    assert (angles.roll(), angles.pitch(), angles.yaw()) == pytest.approx((0.1, 0.2, 0.3))
    state = State((1, 0, 0), (0, 0, 0), turned)
    np.testing.assert_allclose(state.rel_pos_local_frame((1, 5, 0)), [5, 0, 0], atol=1e-15)
    np.testing.assert_allclose(state.orient_global_frame(), [0, 1, 0], atol=1e-15)
    assert state.in_field_of_view(State((2, 5, 0)), 0.5, 0.5)
    assert not state.in_field_of_view((6, 1, 0), 0.5, 0.5)
    state.vel_mutable()[0] = 3.0
    assert state.vel[0] == 3.0
    with pytest.raises(AttributeError, match="there are: pos, vel"):
        _ = state.position
    with pytest.raises(TypeError, match="not 1 values"):
        Quaternion(1.0)
