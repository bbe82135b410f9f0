"""Each tag of a mission file, and what becomes of it."""

from __future__ import annotations

import math
import re

import pytest

from tussle import Simulation
from tussle.errors import MissionError
from tussle.mission import read_mission, to_python, to_xml
from tussle.mission.node import Node
from tussle.mission.paths import with_value
from tussle.mission.problems import Place, Problems
from tussle.mission.strictness import report_stray
from tussle.mission.tags import WORLD, WORLD_MANY
from tussle.scene import Base, Origin
from tussle.stock import (
    AvoidEntityMS,
    Boids,
    Boundary,
    MotorSchemas,
    MoveToGoalMS,
    NoisyState,
    SimpleAircraftControllerPID,
    SimpleCapture,
    SimpleCollision,
    SphereNetwork,
    Straight,
    Unicycle,
    WaypointGenerator,
)


def test_times_and_steps_and_their_defaults(files):
    mission = files.world(
        '<run start="1" end="2 min" dt="100 ms" motion_multiplier="12" update="sequential"/>'
    ).mission
    assert (mission.start, mission.end, mission.dt, mission.motion_multiplier, mission.update) == (
        1.0,
        120.0,
        0.1,
        12,
        "sequential",
    )
    mission = files.world().mission
    assert (mission.start, mission.end, mission.dt, mission.motion_multiplier) == (0.0, 50.0, 0.00833333, 1)
    assert (mission.update, mission.end_conditions) == ("synchronous", ("time",))
    assert mission.scene.origin == Origin()


@pytest.mark.parametrize(
    ("tags", "is_default"),
    [
        ("", True),
        ("<latitude_origin>29</latitude_origin><longitude_origin>-95</longitude_origin>", False),
        ("<latitude_origin>29 deg</latitude_origin>", False),
        ("<altitude_origin>0</altitude_origin>", False),
    ],
)
def test_the_default_origin_is_one_where_it_is_given_and_stays_so_when_it_is_written(files, tags, is_default):
    mission = files.world(tags).mission
    assert (mission.scene.origin.latitude, mission.scene.origin.longitude) == (
        math.radians(29),
        math.radians(-95),
    )
    assert mission.scene.origin.is_default is is_default
    (files.folder / "again.xml").write_text(to_xml(mission))
    assert read_mission(files.folder / "again.xml").mission.scene.origin.is_default is is_default
    names: dict = {"__name__": "built"}
    exec(to_python(mission), names)
    assert names["mission"].scene.origin == mission.scene.origin


def test_an_end_between_two_steps_is_noted(files):
    loaded = files.world('<run end="1" dt="0.3"/>')
    assert loaded.mission.steps == 3
    assert any(
        "end 1 s is not a whole number of steps of 0.3 s; the last ends at 0.9 s" in n for n in loaded.notes
    )
    assert not any("whole number of steps" in n for n in files.world('<run end="1" dt="0.1"/>').notes)
    assert not any("whole number of steps" in n for n in files.world().notes)


@pytest.mark.parametrize(
    ("tags", "inside", "note"),
    [
        ("<latitude_origin>35</latitude_origin>", "", "<longitude_origin> is missing, and is taken to be -95"),
        ("<longitude_origin>35</longitude_origin>", "", "<latitude_origin> is missing, and is taken to be 29"),
        ("", "<latitude>1</latitude><longitude>2</longitude><altitude>3</altitude>", "count from 29 N, 95 W"),
        ("<latitude_origin>1</latitude_origin><longitude_origin>2</longitude_origin>",
         "<latitude>1</latitude><longitude>2</longitude><altitude>3</altitude>", None),
    ],
)  # fmt: skip
def test_a_game_that_is_not_where_or_when_it_seems_is_noted(files, tags, inside, note):
    notes = files.world(tags, inside).notes
    assert bool(note) == any((note or "N, 95 W") in each for each in notes)
    assert note or not any("is missing" in each for each in notes)


@pytest.mark.parametrize(
    ("start", "end", "dt"),
    [(0, 0, 0.1), (5, 2, 0.1), (2, 2.04, 0.1), (-3, -4, 0.5), (0, 0.05, 0.1), (0, 2, 4)],
)
def test_an_end_before_which_no_step_is_played_is_refused_wherever_it_is_given(files, start, end, dt):
    text = rf"end = {end:g} s is not allowed; with start = {start:g} s and dt = {dt:g} s it takes a time > {start + dt / 2:g} s"
    with pytest.raises(MissionError, match=rf"m.xml:\d+: {text}"):
        files.world(f'<run start="{start}" end="{end}" dt="{dt}"/>')
    endless = files.world(
        f'<run start="{start}" end="{end}" dt="{dt}"/><end_condition>one_team</end_condition>'
    )
    for change in (endless.mission.ending_by_time, lambda: endless.mission.replace(end_conditions="time")):
        with pytest.raises(MissionError, match=f"^mission: {text}"):
            change()
    with pytest.raises(MissionError, match=text):
        with_value(endless.mission.replace(end=start + dt).ending_by_time(), "run.end", end)


def test_end_conditions_are_words_of_a_list(files):
    assert files.world("<end_condition>time, all_dead one_team</end_condition>").mission.end_conditions == (
        "time",
        "all_dead",
        "one_team",
    )
    with pytest.raises(
        MissionError,
        match=r"m\.xml:2: end_condition = 'all_ded' is not allowed \(did you mean 'all_dead'\?\)",
    ):
        files.world("<end_condition>time, all_ded</end_condition>")


@pytest.mark.parametrize(
    ("text", "seed"), [("0", 0), (" 2147483648 ", 2147483648), (str(2**64 - 1), 2**64 - 1), ("", None)]
)
def test_seeds(files, text, seed):
    assert files.world(f"<seed>{text}</seed>").seed == seed


@pytest.mark.parametrize("text", ["-1", "1.5", "one", str(2**64), "9" * 5000])
def test_wrong_seeds(files, text):
    with pytest.raises(MissionError, match=r"m\.xml:2: seed '.*' is not allowed; it takes a whole number"):
        files.world(f"<seed>{text}</seed>")


def test_where_and_how_an_entity_begins(files):
    block = files.world(
        inside="""<team_id>3</team_id><count>4</count><health>5</health><radius>2</radius><mass>2 lb</mass>
      <x>1</x><y>2 km</y><z>-3</z><heading>90</heading><roll>45</roll><pitch>30</pitch><speed>40 kt</speed>
      <variance_x>20</variance_x><variance_z>4</variance_z><variance_heading>9</variance_heading>
      <use_variance_all_ents>true</use_variance_all_ents>"""
    ).mission.blocks[0]
    assert (block.name, block.team, block.count, block.health, block.radius) == ("a", 3, 4, 5.0, 2.0)
    assert block.mass == pytest.approx(0.90718474)
    assert block.position == (1.0, 2000.0, -3.0)
    assert block.heading == math.radians(90.0)
    assert block.roll == math.radians(45.0)
    assert block.climb == -math.radians(30.0), "pitch is nose down in this format"
    assert block.velocity is None
    assert block.speed == pytest.approx(20.5777778)
    assert block.variance == (20.0, 100.0, 4.0)
    assert block.heading_variance == pytest.approx(math.radians(3.0) ** 2)
    assert block.scatter_first


def test_the_default_entity_is_the_historic_one(files):
    block = files.entity("<team_id>1</team_id>")
    assert (block.count, block.position, block.variance, block.scatter_first) == (
        1,
        (0.0, 0.0, 0.0),
        (100.0, 100.0, 0.0),
        False,
    )
    assert (block.health, block.radius, block.rate, block.heading, block.name) == (
        1.0,
        1.0,
        None,
        0.0,
        "team_1",
    )
    assert type(block.motion).__name__ == "Still"


def test_a_velocity_goes_before_a_speed(files):
    assert files.entity("<vx>1</vx><vz>3</vz><speed>9</speed>").velocity == (1.0, 0.0, 3.0)


def test_the_initial_speed_points_along_the_heading(files):
    sim = Simulation(files.world(inside="<speed>10</speed><heading>90</heading>").mission)
    assert sim.state.world_view.vel[:, 0] == pytest.approx([0.0, 10.0, 0.0])


def test_uniform_placement(files):
    block = files.entity(
        "<placement>uniform</placement><half_width_x>200</half_width_x><half_width_z>1 km</half_width_z>"
    )
    assert (block.placement, block.half_width) == ("uniform", (200.0, 0.0, 1000.0))


def test_geodetic_positions(files):
    tags = "<latitude_origin>35.721025</latitude_origin><longitude_origin>-120.767925</longitude_origin>"
    tags += "<altitude_origin>300</altitude_origin>"
    inside = "<latitude>35.722</latitude><longitude>-120.767925</longitude><altitude>350</altitude>"
    loaded = files.world(tags, inside)
    origin = Origin.from_degrees(35.721025, -120.767925, 300.0)
    assert loaded.mission.scene.origin == origin
    expected = origin.from_geodetic([math.radians(35.722), math.radians(-120.767925), 350.0])
    assert loaded.mission.blocks[0].position == tuple(expected)
    assert expected[1] == pytest.approx(108.2, abs=0.1)


def test_one_of_latitude_longitude_altitude_counts_for_nothing(files):
    loaded = files.world(inside="<altitude>200</altitude><z>5</z>")
    assert loaded.mission.blocks[0].position == (0.0, 0.0, 5.0)
    assert "<altitude> is ignored" in "\n".join(loaded.notes)


def test_bases(files):
    loaded = files.world(
        "<latitude_origin>35</latitude_origin><longitude_origin>-120</longitude_origin>",
        """<team_id>2</team_id><base><x>1</x><y>2</y><z>3</z><radius>9</radius><opacity>0.5</opacity></base>
        <base><latitude>35</latitude><longitude>-120</longitude><altitude>7</altitude></base><base/>""",
    )
    first, second, third = loaded.mission.scene.bases
    assert first == Base(team=2, position=(1.0, 2.0, 3.0), radius=9.0, opacity=0.5)
    assert second.position == pytest.approx((0.0, 0.0, 7.0), abs=1e-6)
    assert third == Base(team=2, position=(-1.0, -1.0, -1.0), radius=25.0, opacity=1.0)


def test_births(files):
    births = "<count>3</count><generate_rate> 1 / 2 </generate_rate><generate_count>2</generate_count>"
    block = files.entity(
        births
        + "<generate_start_time>4</generate_start_time><generate_time_variance>0.1</generate_time_variance>"
    )
    assert (block.rate, block.slots, block.first_birth, block.interval_sd) == (0.5, 2, 4.0, 0.1)
    assert files.entity("<generate_rate>3 Hz</generate_rate><generate_count>9</generate_count>").rate == 3.0


@pytest.mark.parametrize(
    "tags",
    [
        "<generate_rate>1</generate_rate>",
        "<generate_rate>0</generate_rate><generate_count>2</generate_count>",
    ],
)
def test_births_without_slots_or_rate_are_none(files, tags):
    loaded = files.world(inside=tags)
    assert loaded.mission.blocks[0].rate is None
    assert "<generate_rate> is ignored" in "\n".join(loaded.notes)


def test_plugins_of_the_world(files):
    mission = files.world("""<network range="50">SphereNetwork</network><network name="radio" comm_delay="-1">SphereNetwork</network>
      <entity_interaction capture_range="7" credit="each">SimpleCapture</entity_interaction>
      <entity_interaction>SimpleCollision</entity_interaction><metrics NonTeamCapture_weight="2">SimpleCaptureMetrics</metrics>""").mission
    assert mission.interactions == (SimpleCapture(capture_range=7, credit="each"), SimpleCollision())
    assert SphereNetwork(range=50) in mission.networks
    assert SphereNetwork(name="radio") in mission.networks
    assert mission.metrics[0].NonTeamCapture_weight == 2.0


def test_several_of_one_plugin_have_names(files):
    loaded = files.world(
        "<entity_interaction>Boundary</entity_interaction>\n<entity_interaction>Boundary</entity_interaction>"
    )
    assert [p.instance_name for p in loaded.mission.interactions] == ["Boundary", "Boundary_2"]
    assert "m.xml:3: a second Boundary is called Boundary_2" in "\n".join(loaded.notes)
    with pytest.raises(MissionError, match=r"m\.xml:2: name 'a\.b' is not allowed"):
        files.world('<entity_interaction name="a.b">Boundary</entity_interaction>')


def test_attributes_by_their_historic_names(files):
    tags = '<entity_interaction id="5" team_id="2" type="sphere" radius="9" center="1, 2, 3" color="0 0 255">Boundary</entity_interaction>'
    loaded = files.world(tags)
    assert loaded.mission.interactions[0] == Boundary(
        boundary_id=5, team=2, shape="sphere", radius=9, center=(1, 2, 3)
    )
    assert loaded.viewer["plugins"] == {"Boundary@color": "0 0 255"}


def test_plugins_of_an_entity_in_the_order_of_the_file(files):
    block = files.entity("""<motion_model vel_max="9">Unicycle</motion_model><controller>UnicyclePID</controller>
      <autonomy speed="3" loop_rate="10">Straight</autonomy><autonomy name="second" loop_rate="0">Straight</autonomy>
      <sensor pos_noise_0="0 2" order="0">NoisyState</sensor>""")
    assert block.autonomy == (Straight(speed=3, rate=10.0), Straight(name="second"))
    assert block.motion == Unicycle(vel_max=9)
    assert block.sensor == (NoisyState(pos_noise_0=(0, 2)),)


def test_angles_are_degrees_where_they_always_were(files):
    block = files.entity("""<motion_model max_roll="20">SimpleAircraft</motion_model><autonomy fov_az="90 deg" fov_el="180">Boids</autonomy>
      <controller heading_pid="1, 0.2, 3, 45">SimpleAircraftControllerPID</controller>""")
    assert block.motion.max_roll == math.radians(20.0)
    assert block.autonomy[0] == Boids(fov_az=math.radians(90.0), fov_el=math.radians(180.0))
    assert block.controller == (SimpleAircraftControllerPID(heading_pid=(1, 0.2, 3, math.radians(45.0))),)


def test_behaviors_are_plugins_in_a_parameter(files):
    block = files.entity("""<autonomy max_speed="9" behaviors="
       [ AvoidEntityMS gain='2.0' sphere_of_influence='10' contacts='truth' ]
       [ AvoidEntityMS name='wary' contacts='noisy' ]
       [ MoveToGoalMS goal='1,2,3' p_gain='0.7' ]">MotorSchemas</autonomy>""")
    assert block.autonomy == (
        MotorSchemas(max_speed=9, behaviors=[
            AvoidEntityMS(gain=2.0, sphere_of_influence=10), AvoidEntityMS(name="wary", contacts="noisy"),
            MoveToGoalMS(goal=(1, 2, 3), distance_pid=(0.7, 0, 0, 0)),
        ]),
    )  # fmt: skip


def test_waypoints_in_both_frames(files):
    waypoints = "[ XYZ 0 100 200 300 0 0 90 5 -1 ] [ GPS 1 35.001 -120 50 0 0 0 5 -1 ]"
    text = f"""<runscript><latitude_origin>35</latitude_origin><longitude_origin>-120</longitude_origin>
      <entity><autonomy waypoints="{waypoints}">WaypointGenerator</autonomy></entity></runscript>"""
    (autonomy,) = files.read(text).mission.blocks[0].autonomy
    assert isinstance(autonomy, WaypointGenerator)
    first, second = autonomy.waypoints
    assert first[:4] == (0.0, 100.0, 200.0, 300.0)
    assert second[1:4] == pytest.approx((0.0, 110.9, 50.0), abs=0.1)


def test_shared_parameters(files):
    tags = "<param_common name='fast'><max_speed>50</max_speed><sphere_of_influence>9</sphere_of_influence></param_common>"
    entity = "<entity><autonomy param_common='fast' sphere_of_influence='7'>Boids</autonomy></entity>"
    mission = files.read(f"<runscript>{tags}{entity}</runscript>").mission
    assert mission.blocks[0].autonomy == (Boids(max_speed=50, sphere_of_influence=7),)
    with pytest.raises(
        MissionError, match=r"m\.xml:1: there is no param_common 'fats' \(did you mean 'fast'\?\)"
    ):
        files.read(f"<runscript>{tags}{entity.replace('fast', 'fats')}</runscript>")


def test_shared_tags(files):
    shared = """<entity_common name="c"><name>never</name><count>3</count><x>5</x><autonomy>Straight</autonomy>
      <motion_model vel_max="30" turn_rate_max="2">Unicycle</motion_model><controller>DirectController</controller></entity_common>"""
    text = f"""<runscript>{shared}
      <entity entity_common="c"><name>one</name><x>7</x><autonomy>Boids</autonomy></entity>
      <entity entity_common="c"><team_id>4</team_id><motion_model vel_max="9">Unicycle</motion_model></entity>
      <entity entity_common="c"><motion_model>SimpleAircraft</motion_model></entity></runscript>"""
    one, two, three = files.read(text).mission.blocks
    assert (one.name, one.count, one.position[0], one.autonomy) == ("one", 3, 7.0, (Straight(), Boids()))
    assert (two.name, two.position[0], two.motion) == ("team_4", 5.0, Unicycle(vel_max=9, turn_rate_max=2))
    assert type(three.motion).__name__ == "SimpleAircraft"
    with pytest.raises(
        MissionError, match=r"m\.xml:3: there is no entity_common 'cc' \(did you mean 'c'\?\)"
    ):
        files.read(text.replace('common="c"><name>one', 'common="cc"><name>one'))


def test_names_of_blocks(files):
    twice = "<entity><name>my robot.2</name></entity>" * 2
    text = f"""<runscript><entity tag="t"><name>n</name></entity>{twice}
      <entity><team_id>5</team_id></entity><entity/></runscript>"""
    loaded = files.read(text)
    assert [b.name for b in loaded.mission.blocks] == ["t", "my_robot_2", "my_robot_2_2", "team_5", "team_0"]
    assert loaded.places["team_5"].endswith("m.xml:2")


def test_settings_for_the_viewer_and_the_log_are_kept(files):
    loaded = files.world(
        """<run time_warp="10" enable_gui="false"/><grid_size>1000</grid_size><camera mode="free" pos="0,1,2"/>
        <output_type>all</output_type><log_dir>~/x</log_dir><background_color>1 2 3</background_color>""",
        "<color>77 77 255</color><visual_model>sphere</visual_model>",
    )
    assert loaded.viewer["time_warp"] == 10.0
    assert loaded.viewer["enable_gui"] is False
    assert loaded.viewer["camera"] == {"value": "", "mode": "free", "pos": "0,1,2"}
    assert loaded.viewer["entities"] == {"a": {"color": "77 77 255", "visual_model": "sphere"}}
    assert loaded.log == {"output_type": "all", "log_dir": "~/x"}
    assert [
        n for n in loaded.notes if re.search(r"m\.xml:\d+: kept for the viewer: background_color, camera", n)
    ]
    assert [n for n in loaded.game_notes if "kept for the viewer" in n] == []


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        ("<id>7</id>", "<id> is ignored"),
        ("<connect_entity>0</connect_entity>", "<connect_entity> is ignored"),
        ("<script_name>x.xml</script_name>", "<script_name> is ignored"),
        ("<x>1</x><x>2</x>", "<x> occurs more than once"),
        ("stray words", "text between the tags of <entity> is ignored: 'stray words'"),
        ("<hedding>9</hedding>", "tag in <entity> 'hedding' is unknown (did you mean 'heading'?)"),
        ("<x unit='m'>9</x>", "attribute of <x> 'unit' is unknown; it is ignored"),
    ],
)
def test_what_is_ignored_is_said_with_its_line(files, inside, said):
    notes = "\n".join(files.world(inside=inside, strict=False).notes)
    assert f"m.xml:5: {said}" in notes or f"m.xml:3: {said}" in notes


@pytest.mark.parametrize("tag", WORLD)
def test_tags_of_the_mission_that_stand_twice_are_said_but_for_those_that_may(tag):
    for names, is_twice in (("pp", True), ("pq", not tag.endswith("_common"))):
        problems, place = Problems(), Place("m.xml", 1)
        report_stray(
            Node("runscript", {}, "", [Node(tag, {"name": name}, "", [], place) for name in names], place),
            problems,
        )
        said = any("occurs more than once; the last one is used" in note for note in problems.notes)
        assert said == (is_twice and tag not in WORLD_MANY)


def test_shared_parameters_that_nobody_takes_are_said(files):
    shared = "<param_common name='p'><speed>3</speed></param_common>"
    note = "no plugin takes this <param_common>; it is ignored"
    assert any(note in each for each in files.world(shared).notes)
    taken = files.world(shared, inside="<autonomy param_common='p'>Straight</autonomy>")
    assert not any(note in each for each in taken.notes)


def test_differences_to_the_existing_system_are_said(files):
    notes = "\n".join(
        files.read("<runscript>\n<entity><motion_model>Unicycle</motion_model></entity></runscript>").notes
    )
    assert "m.xml:2: Unicycle follows pitch_rate unless use_pitch='false'" in notes
    quiet = files.read(
        "<runscript><entity><motion_model use_pitch='true'>Unicycle</motion_model></entity></runscript>"
    ).notes
    assert not any("Unicycle" in note for note in quiet)


def test_what_is_unknown_is_an_error_when_strict(files):
    text = """<runscript>
<runn/>
<run edn="3"/>
<entity tagg="x"><autonomy max_sped="3">Boids</autonomy>
  <hedding>1</hedding></entity></runscript>"""
    assert len([n for n in files.read(text, strict=False).notes if "is unknown" in n]) == 5
    with pytest.raises(MissionError) as error:
        files.read(text, strict=True)
    lines = str(error.value).splitlines()
    assert [line.split("m.xml:")[1].split(":")[0] for line in lines] == ["2", "3", "4", "4", "5"]
    with pytest.raises(
        MissionError, match=r"m\.xml:1: .*--lenient \(strict=False\) ignores them"
    ) as by_default:
        files.read(text)
    assert str(by_default.value).splitlines()[:5] == lines
    assert (
        "attribute of Boids 'max_sped' is unknown (did you mean 'max_speed'?); there are: align_weight"
        in str(error.value)
    )


def test_all_that_is_wrong_is_told_at_once(files):
    text = """<runscript><run dt="0"
       end="x"/>
<entity_interaction>SimpleCaptur</entity_interaction>
<entity>
  <count>-3</count> <x>5 kt</x>
  <autonomy
     max_speed="-1"
     comms_range="abc">Boids</autonomy>
  <motion_model>APITester</motion_model> <controller>Boids</controller>
</entity></runscript>"""
    with pytest.raises(MissionError) as error:
        files.read(text)
    found = {}
    for line in str(error.value).splitlines():
        number, _, said = line.split("m.xml:")[1].partition(": ")
        found.setdefault(int(number), []).append(said)
    assert "dt: '0' is not allowed; it takes a number > 0" in found[1]
    assert found[2][0].startswith("end: 'x' is not a number")
    assert "there is no plugin 'SimpleCaptur' (did you mean 'SimpleCapture'?)" in found[3][0]
    assert found[5][0].startswith("count: '-3' is not allowed; it takes a whole number from 0")
    assert "'5 kt' is in kt, not convertible to m" in found[5][1]
    assert found[7] == ["Boids.max_speed = -1.0 is not allowed; it takes a finite number in m/s >= 0"]
    assert found[8][0].startswith("Boids.comms_range = 'abc' is not allowed; it takes a finite number in m")
    assert set(found[9]) == {
        "motion_model APITester is dropped: it tests the plugin interface of SCRIMMAGE; here `check_plugin` tests each plugin",
        "Boids is not allowed in controller; it belongs in autonomy",
    }
