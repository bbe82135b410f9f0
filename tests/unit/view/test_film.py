"""A film shows who is where, at the right time, in the team's colour, and lasts as long as it should."""

from __future__ import annotations

import gc
import math
import signal
import subprocess

import imageio_ffmpeg
import numpy as np
import pytest
from recorded_games import hunt, record

from tussle import Block, Mission
from tussle.errors import MissingExtraError, ParameterError, ViewError
from tussle.scene import Base, Cuboid
from tussle.stock import Boids, Still, Straight, Unicycle, UnicyclePID
from tussle.view import Recording
from tussle.view.export.film import FilmOptions, write_film
from tussle.view.export.film import film as film_module
from tussle.view.export.film.cameras import View, camera_of
from tussle.view.export.film.captions import Captions
from tussle.view.export.film.film import default_speed
from tussle.view.export.film.ground import Tints
from tussle.view.export.film.moments import Moments, interpolated
from tussle.view.export.film.prescan import crowd_of
from tussle.view.export.film.renderer import Renderer, _delayed_interrupt, find_window
from tussle.view.export.film.trails import Trails
from tussle.view.frame import Frame
from tussle.view.scenery import Region, Scenery
from tussle.view.solids import Terrain, mesh_of, outline_of
from tussle.world.geodesy import Origin

SMALL = (64, 48)
BARE = {"size": SMALL, "captions": False, "trails": 0.0}


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Two that fly east, side by side, 40 m apart, for four seconds at 10 m/s."""
    blocks = [
        Block(
            name=name, team=team, position=(0, y, 30), speed=10.0, autonomy=Straight(speed=10.0),
            controller=UnicyclePID(), motion=Unicycle(vel_max=10.0),
        )
        for name, team, y in (("left", 1, 20.0), ("right", 2, -20.0))
    ]  # fmt: skip
    return Recording(
        record(Mission(blocks=blocks, end=4.0, name="flight"), tmp_path_factory.mktemp("runs") / "flown")
    )


@pytest.fixture(scope="module")
def hunted(tmp_path_factory):
    """A hunt with births and deaths."""
    return Recording(record(hunt(n_prey=8, end=12.0), tmp_path_factory.mktemp("runs") / "hunted"))


def pictures(path, size=SMALL):
    """All pictures of a file, (n, height, width, 3)."""
    command = [
        imageio_ffmpeg.get_ffmpeg_exe(),
        "-v",
        "error",
        "-i",
        str(path),
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-",
    ]
    data = subprocess.run(command, capture_output=True, check=True).stdout
    return np.frombuffer(data, np.uint8).reshape(-1, size[1], size[0], 3)


def camera(name, moments, size=SMALL, **options):
    return camera_of(moments, FilmOptions(camera=name, size=size, **options))


def projected(view, points, size):
    """Pixels of points, (n, 2), from the left and the top, and their distances in front of the camera, (n,)."""
    right, up, back = view.axes() @ (np.asarray(points, float) - view.eye).T
    scale = (
        0.5
        * size[1]
        / view.half_height
        * (1.0 if view.is_parallel else view.distance / np.maximum(-back, 1e-9))
    )
    return np.stack([0.5 * size[0] + scale * right, 0.5 * size[1] - scale * up], axis=1), -back


def drawn(recording, scenery, size, frame, view):
    """The picture of a frame, (height, width, 3)."""
    with Renderer(recording.style, scenery, size) as renderer:
        renderer.show(frame, view)
        return renderer.picture().astype(int)


def rows_of(frame, rows, t=None):
    """Some rows of a frame."""
    names = ("id", "team", "block", "pos", "quat", "vel", "health")
    return Frame(frame.t if t is None else t, frame.step, *(getattr(frame, name)[rows] for name in names))


def about(path):
    """What ffmpeg says of a file."""
    return subprocess.run(
        [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-i", str(path)],
        check=False,
        capture_output=True,
        text=True,
    ).stderr


def has_colour(picture, rgb, at, reach=3):
    """Whether a pixel near a place is of this hue."""
    x, y = round(at[0]), round(at[1])
    near = (
        picture[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1]
        .reshape(-1, 3)
        .astype(float)
    )
    lit = near - near.mean(axis=1, keepdims=True)
    wanted = np.array(rgb, float) - np.mean(rgb)
    likeness = lit @ wanted / np.maximum(np.linalg.norm(lit, axis=1) * np.linalg.norm(wanted), 1e-9)
    return bool(((likeness > 0.95) & (np.linalg.norm(lit, axis=1) > 40.0)).any())


# -- what is seen -------------------------------------------------------------------------------------------------------------------


@pytest.mark.needs("renderer")
@pytest.mark.parametrize("name", ["overview", "top", "follow"])
def test_entities_are_drawn_in_their_colours_where_the_projection_says(flown, name):
    size = (320, 240)
    moments = Moments(flown, 0.0, 4.0, 1.0, 10.0)
    eye = camera(name, moments, size)
    for t in (0.0, 1.55, 4.0):
        frame, view = moments.at(t), eye.view(t)
        picture = drawn(flown, flown.scenery, size, frame, view)
        pixels, depth = projected(view, frame.pos, size)
        assert (depth > 0.0).all()
        for row, at in enumerate(pixels):
            if (at > 0.0).all() and (at < size).all():
                assert has_colour(picture, flown.style.colour(int(frame.team[row])), at)
        assert not has_colour(picture, flown.style.colour(1), (3, 3))
        if name != "follow":
            assert ((pixels > 0.0) & (pixels < size)).all()


@pytest.mark.needs("renderer")
def test_a_nose_points_along_the_way(flown):
    """An aircraft flown east is longer to the east of its wings than the wings are thick: its mirror image is another picture."""
    size, moments = (240, 240), Moments(flown, 0.0, 4.0, 1.0, 10.0)
    frame = moments.at(2.0)
    row = frame.row_of(1)
    half = 8.0
    view = View(frame.pos[row] + (0, 0, 50.0), frame.pos[row], np.array([0.0, 1.0, 0.0]), half, True, 14.0)
    picture = drawn(flown, flown.scenery, size, rows_of(frame, [row]), view)
    blue = picture[..., 2] - picture[..., 0] > 60
    columns = np.flatnonzero(blue.any(axis=0))
    widest = int(np.argmax(blue.sum(axis=0)))
    # The wings are swept back from before the middle: they end behind it, and the tail is narrower than they are.
    assert columns[-1] - columns[0] > 0.8 * 14.0 * size[0] / (2.0 * half)
    assert widest < size[0] / 2
    assert (
        blue[:, columns[0] : columns[0] + 12].any(axis=1).sum()
        > 3 * blue[:, columns[-1] - 12 : columns[-1]].any(axis=1).sum()
    )


def test_who_is_gone_is_not_drawn_and_a_ring_says_where(hunted):
    death = next(h for h in hunted.events if h.kind == "death")
    moments = Moments(hunted, 0.0, 12.0, 1.0, 10.0)
    view = camera("overview", moments).view(death.t)
    trails = Trails(moments, 0.0)
    before, after = moments.at(death.t), moments.at(death.t + 0.1)
    assert before.row_of(death.id) >= 0
    assert after.row_of(death.id) < 0
    ends, colours = trails.lines(after, view)
    assert (
        np.linalg.norm(ends.mean(axis=0) - before.pos[before.row_of(death.id)])
        < 1e-6 * view.model_length + 1e-9
    )
    assert (colours[:, 3] > 150.0).all()
    faded, _ = trails.lines(moments.at(min(death.t + 0.9, 12.0)), view)
    others = [h for h in hunted.events if h.kind == "death" and death.t + 0.1 < h.t <= death.t + 0.9]
    assert len(faded) == len(ends) * len(others)


def test_trails_go_through_where_entities_were_and_fade(flown):
    moments = Moments(flown, 0.0, 4.0, 1.0, 10.0)
    ends, colours = Trails(moments, 1.0).lines(moments.at(3.05), camera("overview", moments).view(3.05))
    left = ends[:, 1] > 0.0
    np.testing.assert_allclose(ends[left][:, 1:], [[20.0, 30.0]] * left.sum(), atol=1e-6)
    assert ends[left][:, 0].max() == pytest.approx(30.5)
    assert ends[left][:, 0].min() == pytest.approx(20.5, abs=0.5)
    newest, oldest = np.argmax(ends[:, 0]), np.argmin(ends[:, 0])
    assert colours[newest, 3] > 150.0 > 20.0 > colours[oldest, 3]
    none, _ = Trails(moments, 0.0).lines(moments.at(3.05), camera("overview", moments).view(3.05))
    assert len(none) == 0


@pytest.mark.needs("renderer")
def test_scenery_is_drawn(flown):
    shape = Cuboid(center=(0, 0, 10), lengths=(60, 60, 20))
    low, high = np.full(3, -40.0), np.full(3, 40.0)
    things = {
        "bases": [Base(1, (10.0, 10.0, 0.0), 8.0, 1.0)],
        "boundaries": [
            Region("zone", 2, shape, False, mesh_of(shape, low, high), outline_of(shape, low, high))
        ],
        "terrain": Terrain(np.linspace(-30, 30, 9), np.linspace(-30, 30, 9), 10.0 * np.eye(9)),
    }
    view = View(np.array([0.0, -150.0, 80.0]), np.zeros(3), np.array([0.0, 0.0, 1.0]), 40.0)
    nobody = rows_of(flown.frame(0), slice(0))

    def with_things(**things):
        scenery = Scenery(Origin(), 0.0, 0.0, low, high, 10.0, **things)
        return drawn(flown, scenery, (160, 120), nobody, view)

    empty = with_things()
    for name, thing in things.items():
        changed = (np.abs(with_things(**{name: thing}) - empty).max(axis=2) > 12).sum()
        assert changed > 100, name
    pixels, _ = projected(view, np.array([[10.0, 10.0, 0.0]]), (160, 120))
    x, y = pixels[0].astype(int)
    base = with_things(bases=things["bases"])[y, x] - empty[y, x]
    assert base[2] - base[0] > 20, "team 1 is blue"
    night = with_things(background=(20, 20, 40))
    assert night.mean() < 60 < 180 < empty.mean()


@pytest.mark.needs("renderer")
def test_words_are_written_and_can_be_left_out(flown, tmp_path):
    size = (480, 270)
    options = {"size": size, "trails": 0.0, "at": 1.0}
    write_film(flown, png=tmp_path / "with.png", options=FilmOptions(**options))
    write_film(flown, png=tmp_path / "without.png", options=FilmOptions(captions=False, **options))
    write_film(flown, png=tmp_path / "ids.png", options=FilmOptions(captions=False, labels=True, **options))
    with_words, without, ids = (
        pictures(tmp_path / f"{n}.png", size)[0].astype(int) for n in ("with", "without", "ids")
    )
    panel = with_words[6:50, 6:90]
    assert (np.abs(with_words - without).max(axis=2) > 40).sum() > 300
    assert panel.max() > 240
    assert panel.min() < 90
    assert (np.abs(with_words - without)[120:200, 150:300].max(axis=2) > 40).sum() == 0
    moments = Moments(flown, 0.0, 4.0, 1.0, 25.0)
    changed = np.abs(ids - without).max(axis=2) > 40
    view = camera("overview", moments, size).view(1.0)
    for x, y in projected(view, moments.at(1.0).pos, size)[0].round().astype(int):
        assert changed[y - 20 : y, x - 8 : x + 8].any()
    assert not changed[:, :60].any()


@pytest.mark.needs("renderer")
def test_the_caption_counts_who_is_left(hunted):
    """The same text is drawn for the same numbers, and other text for others."""
    size = (640, 360)
    moments = Moments(hunted, 0.0, 12.0, 1.0, 25.0)
    view = camera("overview", moments, size).view(0.0)
    first, last = hunted.frame(0), hunted.frame(-1)
    with Renderer(hunted.style, hunted.scenery, size) as renderer:
        captions = Captions(renderer, hunted, FilmOptions(size=size))

        def written(frame):
            renderer.show(rows_of(first, slice(0)), view)
            captions.show(frame, view)
            return renderer.picture()

        assert (written(first) == written(first)).all()
        changed = written(first) != written(rows_of(last, slice(None), t=first.t))
    assert changed[30:110, :200].any()
    assert not changed[:30].any(), "the time stays"
    assert not changed[:, 200:].any()


# -- the eye ------------------------------------------------------------------------------------------------------------------------


def test_the_eye_sees_everybody_all_the_time(hunted):
    moments = Moments(hunted, 0.0, 12.0, 1.0, 25.0)
    for eye in (camera("overview", moments), camera("top", moments)):
        for k in range(0, len(moments), 7):
            t = float(moments.t[k])
            pixels, depth = projected(eye.view(t), moments.at(t).pos, SMALL)
            assert (depth > 0.0).all()
            assert ((pixels >= 0.0) & (pixels <= SMALL)).all()


def test_zoom_comes_nearer_and_scale_makes_models_larger(flown):
    moments = Moments(flown, 0.0, 4.0, 1.0, 25.0)
    for name in ("overview", "top", "follow"):
        usual = camera(name, moments).view(2.0)
        near, large = camera(name, moments, zoom=2.0).view(2.0), camera(name, moments, scale=3.0).view(2.0)
        assert near.half_height == pytest.approx(0.5 * usual.half_height)
        assert large.model_length == pytest.approx(3.0 * usual.model_length)


def test_the_eye_flies_behind_whom_it_follows_and_stays_where_that_is_lost(hunted):
    moments = Moments(hunted, 0.0, 12.0, 1.0, 25.0)
    death = next(h for h in hunted.events if h.kind == "death")
    eye = camera("follow", moments, follow=death.id)
    for t in np.linspace(0.0, death.t, 5):
        frame, view = moments.at(float(t)), eye.view(float(t))
        at, depth = projected(view, frame.pos[frame.row_of(death.id)][None], SMALL)
        assert 0.4 * SMALL[0] < at[0, 0] < 0.6 * SMALL[0]
        assert depth[0] > 0.0
    np.testing.assert_allclose(eye.view(12.0).target, eye.view(death.t + 0.1).target, atol=0.5)


def test_following_somebody_who_is_not_there_is_refused(flown, tmp_path):
    with pytest.raises(ViewError, match=r"entity 99 cannot be followed"):
        write_film(flown, mp4=tmp_path / "x.mp4", options=FilmOptions(camera="follow", follow=99))
    assert not list(tmp_path.iterdir())


# -- time ---------------------------------------------------------------------------------------------------------------------------


def test_moments_between_records_lie_on_the_way(tmp_path):
    """Of a flock that is recorded once a second, within a hair of the same flock recorded in every step."""
    block = Block(
        name="flock", team=1, count=12, position=(0, 0, 200), placement="uniform", half_width=(60, 60, 20),
        autonomy=Boids(), motion=Unicycle(vel_max=20.0),
    )  # fmt: skip
    mission = Mission(blocks=[block], end=20.0)
    fine = Recording(record(mission, tmp_path / "fine"))
    coarse = Moments(Recording(record(mission, tmp_path / "coarse", period=1.0)), 0.0, 20.0, 1.0, 25.0)
    off, straight = [], []
    for t in np.arange(2.0, 19.0, 0.7):
        before, after = coarse.recording.at(float(t)), coarse.recording.at(float(t) + 1.0)
        true, frame = fine.at(float(t)), coarse.at(float(fine.at(float(t)).t))
        np.testing.assert_array_equal(frame.id, true.id)
        off.append(np.linalg.norm(frame.pos - true.pos, axis=1))
        share = (true.t - before.t) / (after.t - before.t)
        straight.append(np.linalg.norm(before.pos + share * (after.pos - before.pos) - true.pos, axis=1))
        np.testing.assert_allclose(np.linalg.norm(frame.quat, axis=1), 1.0)
        np.testing.assert_allclose(np.abs((frame.quat * true.quat).sum(axis=1)), 1.0, atol=0.05)
    assert np.mean(off) < 0.35 * np.mean(straight)
    assert np.max(off) < 4.0  # [m] of 20 that are flown meanwhile


def test_a_jump_is_not_flown_and_who_is_gone_flies_on():
    def frame(t, ids, x, v):
        n, nothing = len(ids), np.zeros((len(ids), 2))
        pos, vel = np.column_stack([x, nothing]), np.column_stack([v, nothing])
        one = np.ones(n, np.int32)
        return Frame(
            t, 0, np.array(ids, np.int32), one, 0 * one, pos, np.tile([1.0, 0, 0, 0], (n, 1)), vel, 1.0 * one
        )

    middle = interpolated(
        frame(0.0, [1, 2, 3], [0, 0, 0], [10, 10, 10]), frame(1.0, [1, 3], [10, 900], [10, 10]), 0.5, 400.0
    )
    assert middle.t == 0.5
    np.testing.assert_allclose(middle.pos[:, 0], [5.0, 5.0, 0.0])
    swinging = interpolated(frame(0.0, [1], [0], [900]), frame(1.0, [1], [10], [-900]), 0.5, 400.0)
    np.testing.assert_allclose(swinging.pos[0, 0], 5.0)


def test_speed_is_such_that_a_film_lasts_half_a_minute():
    assert [default_speed(s) for s in (0.0, 12.0, 30.0, 31.0, 150.0, 500.0, 3000.0, 9001.0)] == [
        1,
        1,
        1,
        2,
        5,
        20,
        100,
        500,
    ]


# -- files --------------------------------------------------------------------------------------------------------------------------


@pytest.mark.needs("renderer")
def test_an_mp4_has_all_its_pictures_and_lasts_as_long(flown, tmp_path):
    told = []
    report = write_film(
        flown, mp4=tmp_path / "a.mp4", options=FilmOptions(start=1.0, stop=3.0, speed=0.5, fps=10.0, **BARE),
        show=lambda done, total: told.append((done, total)),
    )  # fmt: skip
    seen = pictures(tmp_path / "a.mp4")
    assert len(seen) == report.n_pictures == 41
    assert told == [(k, 41) for k in range(1, 42)]
    assert (report.start, report.stop, report.speed, report.duration) == (1.0, 3.0, 0.5, 4.1)
    said = about(tmp_path / "a.mp4")
    assert "Duration: 00:00:04.10" in said
    assert "h264" in said
    assert "yuv420p" in said
    assert "64x48" in said
    assert "10 fps" in said
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


@pytest.mark.needs("renderer")
def test_the_film_goes_on_while_the_game_does(hunted, tmp_path):
    """Its pictures are those of the moments: the middle one is nearer to a picture of the middle than to one of the end."""
    options = {"size": (128, 96), "captions": False}
    write_film(hunted, mp4=tmp_path / "a.mp4", options=FilmOptions(fps=5.0, speed=1.0, **options))
    seen = pictures(tmp_path / "a.mp4", (128, 96)).astype(int)
    assert len(seen) == 61
    write_film(hunted, png=tmp_path / "middle.png", options=FilmOptions(at=6.0, speed=1.0, **options))
    middle = pictures(tmp_path / "middle.png", (128, 96))[0].astype(int)
    distances = np.abs(seen - middle).mean(axis=(1, 2, 3))
    assert 28 <= int(np.argmin(distances)) <= 32


@pytest.mark.needs("renderer")
def test_a_gif_is_small_and_has_half_the_pictures(flown, tmp_path):
    report = write_film(
        flown, gif=tmp_path / "a.gif", options=FilmOptions(stop=0.8, speed=1.0, size=(960, 540))
    )
    assert report.n_pictures == 11
    seen = pictures(tmp_path / "a.gif", (640, 360))
    assert len(seen) == 11
    assert "Duration: 00:00:00.8" in about(tmp_path / "a.gif")
    assert len(np.unique(seen[0].reshape(-1, 3), axis=0)) <= film_module.GIF_COLOURS
    view = camera("overview", Moments(flown, 0.0, 0.8, 1.0, 12.5), (640, 360)).view(0.0)
    for row, at in enumerate(projected(view, flown.frame(0).pos, (640, 360))[0]):
        assert has_colour(seen[0], flown.style.colour(row + 1), at, reach=5)
    assert [p.name for p in tmp_path.iterdir()] == ["a.gif"]


@pytest.mark.needs("renderer")
def test_a_film_and_a_gif_and_a_picture_at_once(flown, tmp_path):
    report = write_film(
        flown, mp4=tmp_path / "a.mp4", gif=tmp_path / "a.gif", png=tmp_path / "a.png",
        options=FilmOptions(stop=1.0, fps=5.0, speed=1.0, **BARE),
    )  # fmt: skip
    assert len(pictures(tmp_path / "a.mp4")) == len(pictures(tmp_path / "a.gif")) == 6
    assert report.n_pictures == 6
    assert len(pictures(tmp_path / "a.png")) == 1


@pytest.mark.needs("renderer")
def test_a_run_that_was_cut_short_is_filmed_as_far_as_it_goes(tmp_path):
    whole = record(hunt(end=3.0), tmp_path / "whole", flush_every=1e-9)
    cut = tmp_path / "cut"
    cut.mkdir()
    data = (whole / "trajectory.arrow").read_bytes()
    (cut / "trajectory.arrow").write_bytes(data[: len(data) // 2])
    recording = Recording(cut)
    report = write_film(recording, mp4=tmp_path / "a.mp4", options=FilmOptions(speed=1.0, fps=5.0, **BARE))
    assert report.stop == recording.t[-1]
    assert 0.5 < report.stop < 2.5
    assert len(pictures(tmp_path / "a.mp4")) == report.n_pictures == round(report.stop * 5) + 1


@pytest.mark.needs("renderer")
def test_what_lies_outside_the_run_is_said_or_refused(flown, tmp_path):
    report = write_film(
        flown, mp4=tmp_path / "a.mp4", options=FilmOptions(start=-3.0, stop=9.0, speed=4.0, fps=2.0, **BARE)
    )
    assert report.notes == [
        "the run is recorded from t = 0 s on; the film begins there, not at -3 s",
        "the run is recorded until t = 4 s; the film ends there, not at 9 s",
    ]
    for options, message in (
        ({"start": 5.0}, "no film can begin at t = 5 s: the run is recorded from t = 0 s to 4 s"),
        ({"stop": -1.0}, "no film can end at t = -1 s"),
    ):
        with pytest.raises(ViewError, match=message):
            write_film(flown, mp4=tmp_path / "b.mp4", options=FilmOptions(**options, **BARE))
    with pytest.raises(ViewError, match="there is no picture of t = 7 s"):
        write_film(flown, png=tmp_path / "b.png", options=FilmOptions(at=7.0, **BARE))
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


@pytest.mark.needs("renderer")
@pytest.mark.filterwarnings(
    "ignore::ResourceWarning"
)  # imageio does not close the pipe to an encoder that has ended
def test_an_encoder_that_fails_on_its_way_is_told_at_once_and_leaves_nothing(
    flown, tmp_path, monkeypatch, capfd
):
    monkeypatch.setattr(film_module, "H264", ("-c:v", "no-such-codec"))
    with pytest.raises(ViewError, match=r"a\.mp4: cannot be written: ffmpeg failed"):
        write_film(flown, mp4=tmp_path / "a.mp4", options=FilmOptions(fps=60.0, **BARE))
    assert not list(tmp_path.iterdir())
    assert "no-such-codec" in capfd.readouterr().err
    gc.collect()


@pytest.mark.needs("renderer")
def test_an_interruption_leaves_nothing(flown, tmp_path):
    def stop(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_film(
            flown, mp4=tmp_path / "a.mp4", gif=tmp_path / "a.gif", options=FilmOptions(**BARE), show=stop
        )
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"camera": "side"}, "camera = 'side' is not allowed; there are: overview, top, follow"),
        ({"camera": "folow"}, "did you mean 'follow'"),
        ({"follow": 3}, "follow = 3 means nothing to camera = 'overview'"),
        ({"speed": 0.0}, "speed = 0.0 is not allowed; it takes a number from 1e-06 to 1e\\+06"),
        ({"fps": math.inf}, "fps = inf is not allowed"),
        ({"fps": 1000.0}, "fps = 1000 is not allowed; it takes up to 240"),
        ({"zoom": -1.0}, "zoom = -1.0 is not allowed"),
        ({"trails": -1.0}, "trails = -1.0 is not allowed"),
        ({"start": math.nan}, "start = nan is not allowed"),
        ({"start": 3.0, "stop": 2.0}, "stop = 2 s is not allowed; it takes a time after start = 3 s"),
        ({"size": (641, 480)}, "size = 641x480 is not allowed"),
        ({"size": (8, 8)}, "size = 8x8 is not allowed"),
    ],
)
def test_options_that_mean_nothing_are_refused(given, message):
    with pytest.raises(ParameterError, match=message):
        FilmOptions(**given)


# -- without -------------------------------------------------------------------------------------------------------------------------


def test_without_a_way_to_draw_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setattr("tussle.view.export.film.renderer.is_installed", lambda library: False)
    with pytest.raises(ViewError, match="neither is installed: apt-get install libosmesa6"):
        find_window()


@pytest.mark.needs("renderer")
@pytest.mark.parametrize(
    ("package", "message"),
    [
        ("pyvista", "films and pictures need pyvista"),
        ("imageio_ffmpeg", "films need imageio and imageio-ffmpeg"),
        ("matplotlib", "text on pictures needs matplotlib"),
    ],
)
def test_without_a_package_the_message_names_the_extra(flown, tmp_path, monkeypatch, package, message):
    monkeypatch.setitem(__import__("sys").modules, package, None)
    with pytest.raises(
        MissingExtraError, match=rf"{message}, which (is|are) not installed: pip install 'tussle\[view\]'"
    ):
        write_film(flown, mp4=tmp_path / "a.mp4", options=FilmOptions(size=(320, 240)))
    assert not list(tmp_path.iterdir())


def test_without_scipy_the_message_names_the_extra(hunted, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "scipy.spatial", None)
    with pytest.raises(MissingExtraError, match=r"scipy.*tussle\[view\]"):
        crowd_of(hunted.frame(0))


@pytest.mark.needs("renderer")
def test_without_an_encoder_for_this_machine_it_is_said(flown, tmp_path, monkeypatch):
    def none():
        raise RuntimeError("No ffmpeg exe could be found.")

    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", none)
    with pytest.raises(ViewError, match="imageio-ffmpeg brings none here: No ffmpeg exe could be found"):
        write_film(flown, mp4=tmp_path / "a.mp4", options=FilmOptions(**BARE))


def test_tints_go_with_the_background():
    assert Tints.on(None) == Tints()
    assert Tints.on((0, 0, 0)).ink == (130.0, 130.0, 130.0)
    assert Tints.on((255, 255, 255)).ink == (125.0, 125.0, 125.0)


@pytest.mark.needs("renderer")
def test_nobody_moves(tmp_path):
    """A film of one that stands still: no division by its speed, its spacing, or the length of its way."""
    mission = Mission(blocks=[Block(name="post", team=1, position=(3, 4, 0), motion=Still())], end=1.0)
    recording = Recording(record(mission, tmp_path / "run"))
    for name in ("overview", "top", "follow"):
        report = write_film(
            recording, mp4=tmp_path / f"{name}.mp4", options=FilmOptions(camera=name, fps=5.0, size=SMALL)
        )
        assert report.n_pictures == 6
        assert len(pictures(tmp_path / f"{name}.mp4")) == 6


def test_ctrl_c_waits_until_the_renderer_is_loaded():
    steps = []
    with pytest.raises(KeyboardInterrupt):
        _interrupted(steps)
    assert steps == ["loaded"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def _interrupted(steps):
    with _delayed_interrupt():
        signal.raise_signal(signal.SIGINT)
        steps.append("loaded")
    steps.append("drawn")
