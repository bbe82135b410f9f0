"""An MCAP file tells the whole run in messages that Foxglove knows, in the order of time."""

from __future__ import annotations

import json
from collections import defaultdict

import numpy as np
import pytest
from mcap.reader import make_reader
from recorded_games import hunt, record

from tussle.errors import MissingExtraError, ParameterError, ViewError
from tussle.event_texts import event_text
from tussle.geodesy import Origin
from tussle.scene import Cuboid
from tussle.view import MODELS, Recording
from tussle.view.export import foxglove_schemas as schemas
from tussle.view.export.foxglove_scene import standing
from tussle.view.export.mcap_file import usual_scale, write_mcap
from tussle.view.scenery import Base, Region, Scenery
from tussle.view.solids import mesh_of, outline_of
from tussle.view.terrain import Terrain

SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def hunted(tmp_path_factory):
    """Births in the middle of it, captures, deaths."""
    return Recording(record(hunt(n_prey=8, end=12.0), tmp_path_factory.mktemp("runs") / "run", (5,)))


class Opened:
    """A file as a reader sees it: messages by topic, each with its time [ns]."""

    def __init__(self, path):
        self.messages, self.schemas, self.times = defaultdict(list), {}, []
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True)
            self.summary = reader.get_summary()
            self.metadata = {m.name: m.metadata for m in reader.iter_metadata()}
            for schema, channel, message in reader.iter_messages(log_time_order=False):
                assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
                self.schemas[channel.topic] = (schema.name, json.loads(schema.data))
                self.messages[channel.topic].append((message.log_time, json.loads(message.data)))
                self.times.append(message.log_time)


@pytest.fixture(scope="module")
def opened(hunted, tmp_path_factory):
    path = tmp_path_factory.mktemp("mcap") / "run.mcap"
    report = write_mcap(hunted, path)
    found = Opened(path)
    assert report.n_messages == {topic: len(found.messages[topic]) for topic in report.n_messages}
    assert report.n_frames == hunted.n_frames
    assert list(path.parent.iterdir()) == [path]
    return found


def matches(value, schema):
    """Whether a message has all the fields of its schema, of the right types, and no others."""
    kind = schema["type"]
    if kind == "object":
        names = set(schema.get("properties", ()))
        is_whole = isinstance(value, dict) and set(schema.get("required", ())) <= set(value)
        return (
            is_whole
            and (not names or set(value) <= names)
            and all(matches(v, schema["properties"][k]) for k, v in value.items())
        )
    if kind == "array":
        return isinstance(value, list) and all(matches(v, schema["items"]) for v in value)
    if kind == "integer":
        return isinstance(value, int) and schema.get("minimum", value) <= value <= schema.get(
            "maximum", value
        )
    return isinstance(value, {"number": (int, float), "string": str, "boolean": bool}[kind])


def test_all_messages_are_as_their_schemas_say(opened):
    assert {topic: name for topic, (name, _) in opened.schemas.items()} == {
        "/tf": "foxglove.FrameTransforms",
        "/models": "foxglove.SceneUpdate",
        "/labels": "foxglove.SceneUpdate",
        "/scene": "foxglove.SceneUpdate",
        "/events": "foxglove.Log",
        "/teams": "tussle.Teams",
    }
    for topic, messages in opened.messages.items():
        schema = opened.schemas[topic][1]
        for _, message in messages:
            assert matches(message, schema), (topic, message)
    assert not matches({"transforms": [{}]}, schemas.FRAME_TRANSFORMS)


def test_messages_are_in_the_order_of_simulated_time_and_compressed(opened, hunted):
    assert opened.times == sorted(opened.times)
    assert opened.times[0] == 0
    assert opened.times[-1] == round(hunted.t[-1] * 1e9)
    assert {chunk.compression for chunk in opened.summary.chunk_indexes} == {"zstd"}
    assert opened.metadata["run"]["seed"] == "5"
    assert opened.metadata["run"]["mission"] == "hunt"
    teams = next(c for c in opened.summary.channels.values() if c.topic == "/teams")
    assert teams.metadata == {"team_1": "prey, late", "team_2": "hunters"}


def test_transforms_are_the_recorded_states(opened, hunted):
    messages = opened.messages["/tf"]
    assert len(messages) == hunted.n_frames
    for k, (ns, message) in enumerate(messages):
        frame = hunted.frame(k)
        assert ns == round(frame.t * 1e9)
        seen = {t["child_frame_id"]: t for t in message["transforms"]}
        assert list(seen) == [f"{hunted.blocks[b]}/{i}" for i, b in zip(frame.id, frame.block, strict=True)]
        assert all(t["parent_frame_id"] == "world" for t in seen.values())
        assert all(t["timestamp"] == {"sec": ns // SECOND, "nsec": ns % SECOND} for t in seen.values())
        if not seen:
            continue
        pos = np.array([list(t["translation"].values()) for t in seen.values()])
        quat = np.array([[t["rotation"][c] for c in "wxyz"] for t in seen.values()])
        np.testing.assert_allclose(pos, frame.pos, atol=5.1e-5)
        np.testing.assert_allclose(quat, frame.quat, atol=5.1e-7)


def test_models_are_there_from_birth_to_death_in_their_colours(opened, hunted):
    """At each moment a reader that has seen all messages so far shows exactly those who are alive."""
    ends, starts = {}, {}
    for ns, message in opened.messages["/models"]:
        assert message["deletions"] == []
        for entity in message["entities"]:
            life = entity["lifetime"]["sec"] * SECOND + entity["lifetime"]["nsec"]
            ends[entity["id"]] = ns + life if life else float("inf")
            starts.setdefault(entity["id"], ns)
            assert entity["frame_locked"]
            assert entity["frame_id"] == entity["id"]
            block = hunted.blocks.index(entity["id"].split("/")[0])
            surface = entity["triangles"][0]
            assert len(surface["points"]) == len(MODELS[hunted.style.model(block)].vertices)
            colour = [round(255 * surface["color"][c]) for c in "rgb"]
            assert tuple(colour) == hunted.style.block_colour(block)
    for k in range(hunted.n_frames):
        frame = hunted.frame(k)
        now = round(frame.t * 1e9)
        shown = {name for name in ends if starts[name] <= now <= ends[name]}
        assert shown == {f"{hunted.blocks[b]}/{i}" for i, b in zip(frame.id, frame.block, strict=True)}, (
            frame.t
        )
    assert any(end < float("inf") for end in ends.values())


def test_who_jumps_into_the_file_soon_sees_all_who_are_there(opened, hunted):
    """The last message before tells all of them, except for the first second after a birth."""
    births = [h.t for h in hunted.events if h.kind == "birth"]
    assert any(t > 0.0 for t in births)
    for topic in ("/models", "/labels"):
        messages = opened.messages[topic]
        for k in range(hunted.n_frames):
            frame = hunted.frame(k)
            if any(0.0 < frame.t - t < 1.5 for t in births):
                continue
            last = [m for ns, m in messages if ns <= round(frame.t * 1e9)][-1]
            told = {entity["id"] for entity in last["entities"]}
            assert {f"{hunted.blocks[b]}/{i}" for i, b in zip(frame.id, frame.block, strict=True)} <= told


def test_labels_are_ids(opened):
    for _, message in opened.messages["/labels"]:
        for entity in message["entities"]:
            assert entity["texts"][0]["text"] == entity["id"].split("/")[1]


def test_events_are_all_told_in_words(opened, hunted):
    told = opened.messages["/events"]
    assert [ns for ns, _ in told] == [round(h.t * 1e9) for h in hunted.events]
    assert [m["name"] for _, m in told] == [h.kind for h in hunted.events]
    levels = {m["name"]: m["level"] for _, m in told}
    assert levels == {"birth": 1, "death": 2, "capture": 3, "end": 2}
    words = [m["message"] for _, m in told]
    death = next(h for h in hunted.events if h.kind == "death")
    prey = next(w for w in words if w.endswith("was born") and w.split("/")[1].startswith(f"{death.id} "))
    assert f"{prey.split(' ')[0]} died: captured (hunters/{death.other})" in words
    assert any(w.startswith(f"hunters/{death.other} captured {prey.split(' ')[0]}") for w in words)
    assert words[-1] == event_text("end", text=hunted.events[-1].text)


def test_teams_are_counted(opened, hunted):
    for k, (_, message) in enumerate(opened.messages["/teams"]):
        frame = hunted.frame(k)
        assert message["t"] == frame.t
        assert message["alive"] == {f"team_{n}": int((frame.team == n).sum()) for n in (1, 2)}


def test_fewer_moments_keep_all_events_and_the_last_moment(hunted, tmp_path):
    told = []
    report = write_mcap(
        hunted, tmp_path / "a.mcap", period=2.0, show=lambda n, total: told.append((n, total))
    )
    opened = Opened(tmp_path / "a.mcap")
    times = [ns for ns, _ in opened.messages["/tf"]]
    assert times[:-1] == [2 * SECOND * k for k in range(len(times) - 1)]
    assert times[-1] == round(hunted.t[-1] * 1e9)
    assert len(opened.messages["/events"]) == len(hunted.events)
    assert opened.times == sorted(opened.times)
    assert told == [(k, report.n_frames) for k in range(1, report.n_frames + 1)]


def test_models_are_as_large_as_can_be_seen(hunted, tmp_path):
    scale = usual_scale(hunted)
    assert scale > 1.0
    write_mcap(hunted, tmp_path / "a.mcap", period=5.0, scale=2.0)
    surface = Opened(tmp_path / "a.mcap").messages["/models"][0][1]["entities"][0]["triangles"][0]
    length = np.ptp([p["x"] for p in surface["points"]])
    assert length == pytest.approx(2.0 * scale * np.ptp(MODELS["aircraft"].vertices[:, 0]), rel=1e-3)


def test_a_clock_before_zero_is_shifted_and_that_is_said(tmp_path):
    recording = Recording(record(hunt(n_prey=2, end=-1.0, start=-2.5), tmp_path / "run", (5,)))
    report = write_mcap(recording, tmp_path / "a.mcap")
    assert report.notes == [
        "t = 0 is 3 s after the beginning of the file's clock, which knows no earlier times"
    ]
    opened = Opened(tmp_path / "a.mcap")
    assert opened.times[0] == SECOND // 2
    assert opened.messages["/teams"][0][1]["t"] == -2.5


def test_what_stands_is_in_the_scene(hunted, monkeypatch):
    low, high = np.full(3, -40.0), np.full(3, 40.0)
    shape = Cuboid(center=(0, 0, 10), lengths=(60, 60, 20))
    mesh, outline = mesh_of(shape, low, high), outline_of(shape, low, high)
    regions = [Region(name, team, shape, False, mesh, outline) for name, team in (("zone", 2), ("free", 0))]
    scenery = Scenery(
        Origin(), 10.0, 0.0, low, high, 10.0, [Base(1, np.array([1.0, 2.0, 3.0]), 8.0, 1.0)], regions,
        Terrain(np.arange(5.0), np.arange(4.0), np.ones((4, 5))),
    )  # fmt: skip
    monkeypatch.setitem(hunted.__dict__, "scenery", scenery)
    found = {e["id"]: e for e in standing(hunted, 7)}
    assert list(found) == ["origin", "base 1", "zone", "free", "terrain"]
    assert matches({"deletions": [], "entities": list(found.values())}, schemas.SCENE_UPDATE)
    assert found["base 1"]["spheres"][0]["size"] == {"x": 16.0, "y": 16.0, "z": 16.0}
    assert found["base 1"]["spheres"][0]["pose"]["position"] == {"x": 1.0, "y": 2.0, "z": 3.0}
    assert len(found["zone"]["lines"][0]["points"]) == 24
    blue, grey = (found[n]["triangles"][0]["color"] for n in ("zone", "free"))
    assert tuple(round(255 * blue[c]) for c in "rgb") == hunted.style.colour(2)
    assert blue != grey
    assert len(found["terrain"]["triangles"][0]["indices"]) == 3 * 2 * 3 * 4
    assert ("latitude [deg]", "29") in [(n["key"], n["value"]) for n in found["origin"]["metadata"]]


def test_what_cannot_be_is_refused_and_leaves_nothing(hunted, tmp_path, monkeypatch):
    for given in ({"period": 0.0}, {"scale": -1.0}, {"period": float("inf")}):
        with pytest.raises(ParameterError, match=r"is not allowed; it takes a number > 0"):
            write_mcap(hunted, tmp_path / "a.mcap", **given)
    with pytest.raises(ViewError, match=r"nowhere/a\.mcap: cannot be written: No such file"):
        write_mcap(hunted, tmp_path / "nowhere" / "a.mcap")
    monkeypatch.setitem(__import__("sys").modules, "mcap.writer", None)
    with pytest.raises(MissingExtraError, match=r"MCAP files need mcap, .* pip install 'tussle\[view\]'"):
        write_mcap(hunted, tmp_path / "a.mcap")
    assert not list(tmp_path.iterdir())
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "summary.csv").touch()
    with pytest.raises(ViewError, match="the run holds no states"):
        write_mcap(Recording(tmp_path / "run"), tmp_path / "a.mcap")
