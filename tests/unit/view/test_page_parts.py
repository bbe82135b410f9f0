"""What the page is made of, piece by piece: sizes, trails, links, cones, words, addresses."""

import socket
import sys
import time

import numpy as np
import pytest
from page_client import PageClient
from recorded_games import hunt

from tussle import Simulation
from tussle.errors import MissingExtraError, ViewError
from tussle.mission import read_mission
from tussle.view import Live, Looks, scenery_of
from tussle.view.entity import EntityState, Letter, Reading
from tussle.view.frame import Frame, Happening
from tussle.view.page import overlays, words
from tussle.view.page.camera import FIELD_OF_VIEW, opening, view_from_above, whole_view
from tussle.view.page.clock import chosen_events, event_text, marks
from tussle.view.page.display import Display, reach_of
from tussle.view.page.server import Page
from tussle.view.page.trails import MOST_LINES, Trails
from tussle.view.page.visitor import on_ground


def frame_with(pos, t=0.0):
    pos = np.asarray(pos, float).reshape(-1, 3)
    n = len(pos)
    quat = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
    one = np.zeros(n, np.int32)
    return Frame(
        t, round(10 * t), np.arange(1, n + 1, dtype=np.int32), one + 1, one, pos, quat, 0 * pos, np.ones(n)
    )


LOOKS = Looks(["all"], [1])


# -- sizes ------------------------------------------------------------------------------------------------------------------------


def test_models_are_as_large_as_can_be_seen_and_told_apart():
    wide = scenery_of(None, extent=(np.zeros(3), np.array([4000.0, 3000.0, 0.0])))
    apart = Display.of(frame_with([[0, 0, 0], [2000, 0, 0]]), LOOKS, wide)
    close = Display.of(frame_with([[0, 0, 0], [40, 0, 0]]), LOOKS, wide)
    assert apart.size == pytest.approx(0.014 * wide.size)
    assert close.size == pytest.approx(28.0)
    assert Display.of(frame_with(np.zeros((9, 3))), LOOKS, wide).size == pytest.approx(0.004 * wide.size)
    assert Display.of(frame_with([]), LOOKS, wide).size > 0.0


def test_the_missions_own_scale_and_trails_count():
    scene = scenery_of(None)
    frame = frame_with([[0, 0, 0], [900, 0, 0]])
    plain = Display.of(frame, LOOKS, scene)
    told = Display.of(frame, LOOKS, scene, {"scale": 3.0, "plot_tracks": True})
    assert told.size == pytest.approx(3.0 * plain.size)
    assert told.has_trails
    assert not plain.has_trails


def test_few_are_named_and_many_are_not():
    scene = scenery_of(None)
    assert Display.of(frame_with(np.eye(3)), LOOKS, scene).has_labels
    assert not Display.of(frame_with(np.random.default_rng(1).normal(size=(99, 3))), LOOKS, scene).has_labels


def test_how_far_plugins_reach_is_where_rings_begin():
    assert reach_of(read_mission("predator_prey").mission)[0] == 200.0
    assert reach_of(None) == (0.0, 0.0)


# -- views ------------------------------------------------------------------------------------------------------------------------


def test_all_corners_of_the_scene_are_in_the_first_view_and_in_that_from_above():
    scene = scenery_of(None, extent=(np.array([-500.0, -100.0, 0.0]), np.array([2500.0, 1500.0, 400.0])))
    corners = np.array(np.meshgrid(*zip(scene.low, scene.high, strict=True))).reshape(3, -1).T
    for view in (whole_view(scene), view_from_above(scene)):
        forward = (view.target - view.position) / np.linalg.norm(view.target - view.position)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        up = np.cross(right, forward)
        seen = corners - view.position
        depth = seen @ forward
        assert (depth > 0.0).all()
        half = np.tan(0.5 * FIELD_OF_VIEW)
        assert (np.abs(seen @ up) < half * depth).all()
        assert (np.abs(seen @ right) < 1.3 * half * depth).all(), "for windows as wide as 4:3"


def test_a_ray_meets_the_ground_or_not():
    assert on_ground((1.0, 2.0, 10.0), (0.0, 1.0, -1.0), 4.0).tolist() == [1.0, 8.0, 4.0]
    assert on_ground((0.0, 0.0, 10.0), (1.0, 0.0, 0.0), 0.0) is None
    assert on_ground((0.0, 0.0, 10.0), (1.0, 0.0, 0.5), 0.0) is None


def test_the_missions_camera_is_where_one_begins():
    scene = scenery_of(None)
    said = {"mode": "offset", "follow_id": "2", "pos": "0,-100,50", "focal_point": "0 0 10"}
    told = opening(scene, said)
    assert told.view.position.tolist() == [0.0, -100.0, 50.0]
    assert told.view.target.tolist() == [0.0, 0.0, 10.0]
    assert (told.mode, told.follow, told.notes) == ("behind", 2, ())
    usual = opening(scene, None)
    assert np.array_equal(usual.view.position, whole_view(scene).position)
    assert (usual.mode, usual.follow) == ("free", None)


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ({"pos": "1,2"}, "camera pos '1,2' is not x, y, z in m"),
        ({"focal_point": "a b c"}, "camera focal_point 'a b c' is not x, y, z"),
        ({"mode": "fly"}, "camera mode 'fly' is none of free, follow, offset"),
        ({"follow_id": "all"}, "camera follow_id 'all' is no id"),
    ],
)
def test_a_camera_that_makes_no_sense_is_told_and_is_the_usual_one(said, told):
    scene = scenery_of(None)
    made = opening(scene, said)
    assert told in made.notes[0]
    assert np.array_equal(made.view.position, whole_view(scene).position)
    assert (made.mode, made.follow) == ("free", None)


def test_who_comes_follows_whom_the_mission_says(live):
    with (
        Page(live, viewer={"camera": {"mode": "follow", "follow_id": "2"}}) as page,
        PageClient(page.url) as client,
    ):
        client.wait(page.visitors)
        frame = live.frame()
        client.wait(
            lambda: np.allclose(client.camera.get("target", np.nan), frame.pos[frame.row_of(2)], atol=1e-2)
        )
        client.wait(lambda: client.value("Mode") == "follow")


# -- trails -----------------------------------------------------------------------------------------------------------------------


class Past:
    """A game whose entities fly east at 10 m/s; the second is born at t = 5 s."""

    epoch = 0
    span = (0.0, 60.0)

    def frame_at(self, t):
        t = round(t, 1)
        return frame_with([[10.0 * t, 0.0, 0.0], [10.0 * t, 9.0, 0.0]][: 1 + (t >= 5.0)], t)


def trail(t, **changes):
    display = Display(has_trails=True, **changes)
    return Trails(None, Past(), LOOKS, 1, display).lines(Past().frame_at(t))


def test_trails_lead_to_where_entities_are_from_where_they_have_been():
    lines, colours = trail(8.0, trail_time=6.0)
    first = lines[lines[:, 1, 1] == 0.0]
    assert first[:, 1, 0].max() == pytest.approx(80.0)
    assert first[:, 0, 0].min() == pytest.approx(20.0, abs=1.5)
    assert np.allclose(np.sort(first[:, 1, 0])[:-1], np.sort(first[:, 0, 0])[1:]), "without a gap"
    second = lines[lines[:, 1, 1] == 9.0]
    assert second[:, 0, 0].min() >= 50.0
    assert colours[0].sum() > colours[-1].sum(), "what is older is nearer to the white of the background"


def test_trails_begin_with_the_game():
    lines, _ = trail(0.5, trail_time=6.0)
    assert lines[:, :, 0].min() >= 0.0
    assert len(trail(0.0)[0]) == 0


def test_trails_of_many_have_fewer_points():
    class Crowd(Past):
        def frame_at(self, t):
            return frame_with(np.full((1500, 3), t), t)

    lines, _ = Trails(None, Crowd(), LOOKS, 1, Display(has_trails=True)).lines(Crowd().frame_at(30.0))
    assert 0 < len(lines) <= MOST_LINES


# -- reach ------------------------------------------------------------------------------------------------------------------------


def test_links_join_those_in_reach():
    pos = np.array([[0.0, 0, 0], [5, 0, 0], [11, 0, 0], [99, 0, 0]])
    assert sorted(map(tuple, overlays.links(pos, 6.0).tolist())) == [(0, 1), (1, 2)]
    assert len(overlays.links(pos[:1], 6.0)) == 0


@pytest.mark.parametrize("n", [150, 900])
def test_of_too_many_links_the_shortest_are_drawn(n):
    pos = np.random.default_rng(2).uniform(0.0, 10.0, (n, 3))
    pairs = overlays.links(pos, 9.0)
    assert 0 < len(pairs) <= overlays.MOST_LINKS
    length = np.linalg.norm(pos[pairs[:, 0]] - pos[pairs[:, 1]], axis=1)
    nearest = np.linalg.norm(pos[:, None] - pos, axis=2)[np.triu_indices(n, 1)]
    assert np.median(length) < np.median(nearest[nearest <= 9.0])


@pytest.mark.parametrize("angle", [0.1, 1.0, np.pi, 2.0 * np.pi])
def test_a_cone_holds_what_lies_within_its_angle(angle):
    mesh = overlays.cone(angle)
    points = mesh.vertices[1:]
    assert np.linalg.norm(points, axis=1) == pytest.approx(np.ones(len(points)), abs=1e-6)
    off_axis = np.arccos(np.clip(points[:, 0], -1.0, 1.0))
    assert off_axis.max() == pytest.approx(min(angle / 2, np.pi), abs=2e-3)


def test_a_ring_is_flat_and_round():
    vertices = overlays.ring().vertices
    assert (vertices[:, 2] == 0.0).all()
    assert np.linalg.norm(vertices, axis=1).max() == pytest.approx(1.0)


# -- events -----------------------------------------------------------------------------------------------------------------------


def event(t, kind="death", who=1, other=0, text=""):
    return Happening(t, kind, who, other, text)


def test_of_too_many_events_captures_come_before_births():
    births = [event(0.1 * i, "birth") for i in range(20)]
    rare = [event(9.0, "capture", 5, 3), event(1.0, "collision", 1, 2)]
    chosen = chosen_events([*births, *rare], 5)
    assert [h.t for h in chosen] == sorted(h.t for h in chosen)
    assert set(rare) < set(chosen)
    assert len(chosen) == 5


def test_an_event_in_a_line():
    assert event_text(event(12.3, "capture", 31, 4)) == "12.30 s  capture  31 → 4"
    assert event_text(event(60.0, "end", 0, 0, "time")) == "60.00 s  end    time"


def test_marks_are_where_events_are_and_not_too_many():
    class Some:
        span = (0.0, 99.0)
        happenings = (event(0.0, "birth"), event(2.0), event(2.0), event(3.0))

    class Many(Some):
        happenings = tuple(event(0.1 * i) for i in range(1, 500))

    assert marks(Some()) == (2.0, 3.0)
    assert 30 < len(marks(Many())) <= 60


# -- words ------------------------------------------------------------------------------------------------------------------------


def test_names_from_a_mission_are_no_markup():
    state = EntityState(
        0.0, 0, 1, 1, "<script>alert(1)</script>", {"pos": Reading(np.zeros(3), "m")},
        {"<b>Mine</b>": {"<i>": Reading("<img src=x>")}}, [Letter("<a>/b", 2, {"x": "<u>"})],
    )  # fmt: skip
    html = words.entity_html(state, "<h1>1")
    for tag in ("<script", "<b>Mine", "<i>", "<img", "<a>", "<u>", "<h1>"):
        assert tag not in html
    assert "&lt;script&gt;" in html


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1234567, "1,234,567"),
        (0.123456, "0.1235"),
        (True, "yes"),
        (np.array([1.0, 2.5]), "1  2.5"),
        (np.arange(20.0), "0  1  2  3  4  5 … (20)"),
        (np.zeros((2, 2)), "2 rows: 0  0;  0  0"),
        (np.zeros((0, 2)), "–"),
        ("text", "text"),
    ],
)
def test_numbers_in_words(value, text):
    assert words.number(value) == text


def test_units_of_fields_that_are_alike_are_said_once():
    assert words._reading(Reading(np.zeros(2), "m m")) == "0  0 m"
    assert words._reading(Reading(np.zeros(2), "m rad")) == "0  0 m rad"


# -- where it is served -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def live():
    with Simulation(hunt(), 1) as simulation, Live(simulation, is_paused=True) as live:
        yield live


def test_a_port_that_is_asked_for_and_taken_is_told(live):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(ViewError, match=f"cannot be served at 127.0.0.1, port {port}: .*in use"):
            Page(live, port=port)


def test_a_host_that_is_not_here_is_told(live):
    with pytest.raises(ViewError, match=r"cannot be served at 192\.0\.2\.1, ports 8123 to 8222"):
        Page(live, host="192.0.2.1")
    with pytest.raises(ViewError, match=r"cannot be served at nowhere\.invalid"):
        Page(live, host="nowhere.invalid")


def test_two_pages_get_a_port_each_and_say_nothing(live, capfd):
    with Page(live) as one, Page(live) as other:
        assert one.port != other.port
        assert one.is_local
        assert one.url.startswith(f"http://127.0.0.1:{one.port}/")
    one.stop()
    assert capfd.readouterr() == ("", "")


def test_a_page_for_others_says_so(live):
    with Page(live, host="0.0.0.0") as page:
        assert not page.is_local
        assert page.url.startswith("http://127.0.0.1:")


def test_the_missions_time_between_frames_counts(live):
    with Page(live, viewer={"gui_update_period": "200"}) as page, PageClient(page.url) as client:
        client.wait(page.visitors)
        live.resume()
        client.wait(lambda: page.pusher.n_pushed >= 2)
        began, pushed = time.monotonic(), page.pusher.n_pushed
        client.wait(lambda: page.pusher.n_pushed >= pushed + 4)
        assert time.monotonic() - began > 0.5
    with Page(live, viewer={"gui_update_period": "soon"}) as page:
        assert "gui_update_period 'soon' is no time in ms; frames are sent as fast as can be" in page.notes


def test_without_viser_the_extra_and_the_other_way_are_named(live, monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'tussle\[view\]' \(tussle export"):
        Page(live)


def test_a_browser_cannot_put_the_game_on_the_internet(live):
    with Page(live) as page:
        assert page._server.request_share_url() is None
        assert page._server._share_tunnel is None
