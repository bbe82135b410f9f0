"""GeoJSON, KML and CZML hold the places of a run, in the order and the form that each format asks for."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from recorded_games import hunt, record

from tussle import Block, Mission, Scene
from tussle.errors import MissingExtraError, ParameterError, ViewError
from tussle.scene import Base, Cuboid, Origin, Prism
from tussle.stock import Boundary, Still
from tussle.view import Recording
from tussle.view.export.geographic import DEFAULT_EPOCH, write_geographic
from tussle.view.export.geographic.formats import Heading, kml
from tussle.view.export.geographic.places import Track, to_places

ORIGIN = Origin.from_degrees(-33.9, 18.4, 120.0)
KML, GX = "{http://www.opengis.net/kml/2.2}", "{http://www.google.com/kml/ext/2.2}"
KINDS = ("geojson", "kml", "czml")
SCENE = Scene(
    origin=ORIGIN,
    bases=(Base(2, (500.0, 0.0, 10.0), 50.0),),
    walls=(
        Prism(((0, 0), (0, 100), (50, 50), (100, 100), (100, 0)), 5.0, 60.0),  # clockwise and concave
        Cuboid((0, 0, 50), (100, 60, 20), (0, 0, 0.3)),
    ),
)
FENCES = [
    Boundary(name="box", boundary_id=3, team=1, shape="cuboid", center=(0, 0, 50), lengths=(10, 20, 30)),
    Boundary(name="ball", boundary_id=4, team=2, shape="sphere", center=(200, 0, 0), radius=30.0),
    Boundary(name="half", boundary_id=5, team=2, shape="plane", center=(0, 0, 0), normal=(0, 1, 0)),
]
NAMES = {"base 1", "wall 1", "wall 2", "box", "ball"}


@pytest.fixture(scope="module")
def hunted(tmp_path_factory):
    """Births, captures and deaths over a place in the south."""
    mission = hunt(n_prey=6, end=6.0)
    mission = mission.replace(scene=SCENE, interactions=[*mission.interactions, *FENCES])
    return Recording(record(mission, tmp_path_factory.mktemp("runs") / "run", (5,)))


def written(recording, tmp_path, kind, **options):
    report = write_geographic(recording, tmp_path / f"out.{kind}", kind, **options)
    return report, (tmp_path / f"out.{kind}").read_text(encoding="utf-8")


def states(recording):
    """Times and positions of each entity, by id."""
    found: dict[int, list] = {}
    for i in range(recording.n_frames):
        frame = recording.frame(i)
        for who, pos in zip(frame.id.tolist(), frame.pos.tolist(), strict=True):
            found.setdefault(who, []).append((frame.t, pos))
    return {who: ([t for t, _ in rows], np.array([pos for _, pos in rows])) for who, rows in found.items()}


def local(places):
    """Positions [m] of longitudes, latitudes and heights, (n, 3)."""
    longitude, latitude, height = np.array(places, float).reshape(-1, 3).T
    return ORIGIN.from_geodetic(np.stack([np.radians(latitude), np.radians(longitude), height])).T


def is_long(feature):
    return feature["geometry"]["type"] == "LineString"


def is_counter_clockwise(ring):
    x, y = np.array(ring)[:, :2].T
    return (x[:-1] * y[1:] - x[1:] * y[:-1]).sum() > 0.0


def test_geojson_has_all_places_to_a_millimetre(hunted, tmp_path):
    report, text = written(hunted, tmp_path, "geojson")
    document = json.loads(text)
    assert document["type"] == "FeatureCollection"
    tracks = {
        f["properties"]["entity"]: f for f in document["features"] if f["properties"]["kind"] == "track"
    }
    expected = states(hunted)
    assert tracks.keys() == expected.keys()
    assert report.n_tracks == len(expected)
    assert len({len(t) for t, _ in expected.values()}) > 1
    for who, (t, pos) in expected.items():
        feature = tracks[who]
        assert feature["type"] == "Feature"
        assert feature["properties"]["times"] == t
        assert feature["properties"]["block"] in hunted.blocks
        is_line = len(t) > 1
        assert feature["geometry"]["type"] == ("LineString" if is_line else "Point")
        assert np.abs(local(feature["geometry"]["coordinates"]) - pos).max() < 1e-3
    longitude, latitude, _ = next(f for f in tracks.values() if is_long(f))["geometry"]["coordinates"][0]
    assert (round(longitude, 1), round(latitude, 1)) == (18.4, -33.9)


def test_geojson_has_the_geometry_of_the_mission_by_the_right_hand_rule(hunted, tmp_path):
    report, text = written(hunted, tmp_path, "geojson")
    areas = {
        f["properties"]["name"]: f for f in json.loads(text)["features"] if f["geometry"]["type"] == "Polygon"
    }
    assert areas.keys() == NAMES
    assert report.notes == ["half is left out: a plane has no edge"]
    for feature in areas.values():
        (ring,) = feature["geometry"]["coordinates"]
        assert ring[0] == ring[-1]
        assert len(ring) >= 4
        assert is_counter_clockwise(ring)
    corners = local(areas["wall 2"]["geometry"]["coordinates"][0])
    assert {tuple(np.round(c, 2)) for c in corners} == {
        (0, 0, 5), (0, 100, 5), (50, 50, 5), (100, 100, 5), (100, 0, 5),
    }  # fmt: skip
    box = local(areas["wall 1"]["geometry"]["coordinates"][0])[:-1]
    assert sorted(np.hypot(box[:, 0], box[:, 1])) == pytest.approx([math.hypot(50, 30)] * 4, abs=1e-2)
    around = local(areas["base 1"]["geometry"]["coordinates"][0]) - (500.0, 0.0, 10.0)
    assert np.hypot(around[:, 0], around[:, 1]) == pytest.approx(50.0, abs=1e-2)
    assert areas["box"]["properties"]["team"] == 1
    assert areas["box"]["properties"]["high"] - areas["box"]["properties"]["low"] == pytest.approx(
        30.0, abs=0.01
    )


def test_czml_has_all_samples_to_a_millimetre(hunted, tmp_path):
    _, text = written(hunted, tmp_path, "czml", epoch=datetime(2026, 5, 4, 9, 30, tzinfo=UTC))
    document, *packets = json.loads(text)
    assert (document["id"], document["version"]) == ("document", "1.0")
    assert len({packet["id"] for packet in packets}) == len(packets)
    begin, end = document["clock"]["interval"].split("/")
    assert begin == "2026-05-04T09:30:00.000000Z"
    by_id = {packet["id"]: packet for packet in packets}
    for who, (t, pos) in states(hunted).items():
        packet = by_id[f"entity-{who}"]
        assert packet["position"]["epoch"] == "2026-05-04T09:30:00.000000Z"
        samples = np.array(packet["position"]["cartographicDegrees"]).reshape(-1, 4)
        assert samples[:, 0].tolist() == t
        assert np.abs(local(samples[:, 1:]) - pos).max() < 1e-3
        first, last = (datetime.fromisoformat(each) for each in packet["availability"].split("/"))
        assert (last - first).total_seconds() == pytest.approx(t[-1] - t[0], abs=1e-6)
        assert last <= datetime.fromisoformat(end)
        assert packet["point"]["color"]["rgba"] == [*hunted.style.colour(packet["properties"]["team"]), 255]
    polygon = next(p for p in packets if p.get("name") == "wall 2")["polygon"]
    assert polygon["extrudedHeight"] - polygon["height"] == pytest.approx(55.0, abs=0.01)
    assert len(polygon["positions"]["cartographicDegrees"]) == 3 * 5


def test_kml_has_tracks_with_times_in_the_colours_of_the_teams(hunted, tmp_path):
    _, text = written(hunted, tmp_path, "kml")
    root = ET.fromstring(text)
    assert root.tag == f"{KML}kml"
    colours = {
        style.get("id"): style.find(f"{KML}LineStyle/{KML}color").text for style in root.iter(f"{KML}Style")
    }
    expected = states(hunted)
    tracks = [p for p in root.iter(f"{KML}Placemark") if p.find(f"{GX}Track") is not None]
    assert len(tracks) == len(expected)
    for placemark in tracks:
        data = {d.get("name"): d.find(f"{KML}value").text for d in placemark.iter(f"{KML}Data")}
        t, pos = expected[int(data["entity"])]
        track = placemark.find(f"{GX}Track")
        assert [child.tag for child in track] == [
            f"{KML}altitudeMode",
            *[f"{KML}when"] * len(t),
            *[f"{GX}coord"] * len(t),
        ]
        assert track[0].text == "absolute"
        dates = [datetime.fromisoformat(when.text) for when in track.iter(f"{KML}when")]
        epoch = datetime(2000, 1, 1, tzinfo=UTC)
        assert all(
            abs(d - epoch - timedelta(seconds=s)) < timedelta(microseconds=2)
            for d, s in zip(dates, t, strict=True)
        )
        places = [[float(x) for x in coord.text.split()] for coord in track.iter(f"{GX}coord")]
        assert np.abs(local(places) - pos).max() < 1e-3
        red, green, blue = hunted.style.colour(int(data["team"]))
        assert colours[placemark.find(f"{KML}styleUrl").text[1:]] == f"ff{blue:02x}{green:02x}{red:02x}"
    polygons = {
        p.find(f"{KML}name").text: p
        for p in root.iter(f"{KML}Placemark")
        if p.find(f"{KML}Polygon") is not None
    }
    assert polygons.keys() == NAMES
    for placemark in polygons.values():
        text = placemark.find(f".//{KML}coordinates").text
        ring = [[float(x) for x in place.split(",")] for place in text.split()]
        assert ring[0] == ring[-1]
        assert is_counter_clockwise(ring)


@pytest.mark.parametrize("kind", KINDS)
def test_a_period_thins_the_states_and_the_bytes_are_the_same_again(hunted, tmp_path, kind):
    _, all_of_it = written(hunted, tmp_path, kind)
    _, again = written(Recording(hunted.path), tmp_path, kind)
    assert again == all_of_it
    _, thin = written(hunted, tmp_path, kind, period=1.0)
    assert len(thin) < 0.5 * len(all_of_it)


def still(tmp_path, origin, position=(0.0, 0.0, 5.0), **changes):
    block = Block(name="Zoë", position=position, motion=Still())
    return Recording(
        record(
            Mission(blocks=[block], scene=Scene(origin=origin), end=0.2, dt=0.1, **changes), tmp_path / "run"
        )
    )


@pytest.mark.parametrize("kind", KINDS)
def test_a_run_without_an_origin_says_what_to_set(tmp_path, kind):
    with pytest.raises(ViewError, match=r"no origin.*latitude_origin.*longitude_origin"):
        write_geographic(still(tmp_path, Origin()), tmp_path / "out", kind)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("kind", KINDS)
def test_odd_names_and_the_180th_meridian(tmp_path, kind):
    recording = still(tmp_path, Origin.from_degrees(10.0, 179.999, 0.0), (1000.0, 0.0, 5.0))
    _, text = written(recording, tmp_path, kind)
    if kind == "kml":
        coord = ET.fromstring(text).find(f".//{GX}coord").text
        assert -180.0 <= float(coord.split()[0]) < -179.9
    else:
        found = json.loads(text)
        track = found["features"][-1] if kind == "geojson" else found[-1]
        assert "Zoë" in str(track)
        if kind == "geojson":
            assert track["geometry"]["coordinates"][0][0] > 180.0


@pytest.mark.parametrize("longitude", [-180.0, -95.0, 0.0, 13.0, 180.0])
def test_an_origin_by_any_turns_is_one_place(longitude):
    pos = np.array([[0.0, 0.0, 5.0], [-300.0, 40.0, 0.0]])
    once = to_places(Origin.from_degrees(40.0, longitude), pos)
    other = to_places(Origin.from_degrees(40.0, longitude - math.copysign(360.0, longitude)), pos)
    assert np.abs(once[:, 0]).max() < 180.01
    turns = (other - once) / (360.0, 1.0, 1.0)  # the 180th meridian is at either end
    assert np.abs(turns - np.round(turns)).max() < 1e-9
    assert np.abs(other[:, 0]).max() < 180.01


def test_errors_leave_no_file(hunted, tmp_path):
    with pytest.raises(ParameterError, match="did you mean 'kml'"):
        write_geographic(hunted, tmp_path / "out", "kmz")
    with pytest.raises(ViewError, match="is no date"):
        write_geographic(
            hunted, tmp_path / "out", "kml", epoch=datetime(9999, 12, 31, 23, 59, 59, tzinfo=UTC)
        )
    assert list(tmp_path.iterdir()) == []


def test_a_run_whose_mission_is_gone(tmp_path):
    recording = still(tmp_path, ORIGIN)
    (recording.path / "mission.xml").unlink(missing_ok=True)
    with pytest.raises(ViewError, match=r"mission\.xml cannot be read"):
        write_geographic(Recording(recording.path), tmp_path / "out", "geojson")


def test_kml_is_valid_whatever_a_run_directory_calls_its_blocks():
    heading = Heading("a\x00<b>", {1: ""}, lambda team: (1, 2, 3), DEFAULT_EPOCH, (0.0, 0.0))
    track = Track(7, 9, "\ud800\x1b]]>&", np.zeros(1), np.array([[18.4, -33.9, 1e-7]]))
    root = ET.fromstring("".join(kml(heading, [track], [])).encode())
    assert root.find(f".//{KML}Data[@name='block']/{KML}value").text == "\ufffd\ufffd]]>&"
    assert root.find(f".//{GX}coord").text == "18.4 -33.9 0.0000001"
    assert root.find(f".//{KML}Placemark/{KML}styleUrl").text == "#no-team"


def test_a_run_without_states_or_with_places_that_are_none(hunted, tmp_path, monkeypatch):
    read = hunted.frame
    lost = read(3)
    monkeypatch.setattr(
        hunted, "frame", lambda i: replace(read(i), pos=lost.pos * np.nan) if i == 3 else read(i)
    )
    with pytest.raises(ViewError, match="a position is not finite"):
        write_geographic(hunted, tmp_path / "out", "kml")
    monkeypatch.setattr("tussle.view.page.recorded.kept_frames", lambda t, period: np.zeros(0, int))
    with pytest.raises(ViewError, match="holds no states"):
        write_geographic(hunted, tmp_path / "out", "kml")
    monkeypatch.setitem(sys.modules, "scipy.spatial", None)
    with pytest.raises(MissingExtraError, match="need scipy"):
        write_geographic(hunted, tmp_path / "out", "kml")
    assert list(tmp_path.iterdir()) == []
