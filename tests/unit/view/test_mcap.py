"""An MCAP file tells the whole run in messages that Foxglove knows, in the order of time."""

from __future__ import annotations

import json
import struct
from collections import defaultdict

import numpy as np
import pytest
from mcap.reader import make_reader
from recorded_games import hunt, record

from tussle import Block, Mission
from tussle.errors import MissingExtraError, ParameterError
from tussle.record.event_texts import event_text
from tussle.scene import Base, Cuboid
from tussle.stock import Still
from tussle.view import MODELS, Recording
from tussle.view.export.mcap_file import default_scale, write_mcap
from tussle.view.scenery import Region, Scenery
from tussle.view.solids import Terrain, mesh_of, outline_of
from tussle.world.geodesy import Origin

SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def hunted(tmp_path_factory):
    """Births in the middle of it, captures, deaths."""
    return Recording(record(hunt(n_prey=8, end=12.0), tmp_path_factory.mktemp("runs") / "run", (5,)))


def fields_of(data):
    """Fields of a message in Protobuf's wire format: number -> values."""
    found, at = defaultdict(list), 0

    def varint():
        nonlocal at
        value = shift = 0
        while True:
            byte, at = data[at], at + 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    while at < len(data):
        key = varint()
        if key & 7 == 0:
            found[key >> 3].append(varint())
            continue
        n = {1: 8, 5: 4}.get(key & 7) or varint()
        found[key >> 3].append(data[at : at + n])
        at += n
    return found


class Schema:
    """Message types of a file descriptor set, by which messages are read."""

    def __init__(self, data, name):
        self.name, self.types = f".{name}", {}
        for file in fields_of(data)[1]:
            head = fields_of(file)
            for message in head[4]:
                self.add(f".{head[2][0].decode()}", message)

    def add(self, scope, message):
        fields = fields_of(message)
        name = f"{scope}.{fields[1][0].decode()}"
        self.types[name] = [
            (f[1][0].decode(), f[3][0], f[4][0] == 3, f[5][0], f[6][0].decode() if 6 in f else "")
            for f in map(fields_of, fields[2])
        ]
        for nested in fields[3]:
            self.add(name, nested)

    def read(self, data, name=""):
        """A message as a dictionary; absent fields have their default values."""
        found, message = fields_of(data), {}
        for field, number, is_list, kind, type_name in self.types[name or self.name]:
            values = found.get(number, [])
            if is_list and kind in (13, 7):  # packed numbers
                values = [v[0] for v in (struct.iter_unpack("<I", values[0]) if values else ())]
            else:
                values = [self.value(v, kind, type_name) for v in values]
            default = {1: 0.0, 9: "", 11: None, 8: False}.get(kind, 0)
            message[field] = values if is_list else values[0] if values else default
        return message

    def value(self, value, kind, type_name):
        if kind == 11:
            return self.read(value, type_name)
        if kind == 1:
            return struct.unpack("<d", value)[0]
        if kind == 7:
            return int.from_bytes(value, "little")
        return value.decode() if kind == 9 else bool(value) if kind == 8 else value


def time_of(stamp):
    """A time or a duration [ns]."""
    return stamp["seconds"] * SECOND + stamp["nanos"]


class Opened:
    """A file as a reader sees it: messages by topic, each with its time [ns]."""

    def __init__(self, path):
        self.messages, self.schemas, self.times = defaultdict(list), {}, []
        known = {}
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True)
            self.summary = reader.get_summary()
            self.metadata = {m.name: m.metadata for m in reader.iter_metadata()}
            for schema, channel, message in reader.iter_messages(log_time_order=False):
                self.schemas[channel.topic] = schema.name
                if schema.encoding == "protobuf":
                    known.setdefault(schema.id, Schema(schema.data, schema.name))
                    read = known[schema.id].read(message.data)
                else:
                    assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
                    read = json.loads(message.data)
                self.messages[channel.topic].append((message.log_time, read))
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


def test_topics_have_messages_of_foxglove(opened):
    assert opened.schemas == {
        "/tf": "foxglove.FrameTransforms",
        "/models": "foxglove.SceneUpdate",
        "/labels": "foxglove.SceneUpdate",
        "/scene": "foxglove.SceneUpdate",
        "/events": "foxglove.Log",
        "/teams": "tussle.Teams",
    }


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
        assert all(time_of(t["timestamp"]) == ns for t in seen.values())
        if not seen:
            continue
        pos = np.array([list(t["translation"].values()) for t in seen.values()])
        quat = np.array([[t["rotation"][c] for c in "wxyz"] for t in seen.values()])
        np.testing.assert_allclose(pos, frame.pos, rtol=0)
        np.testing.assert_allclose(quat, frame.quat, atol=1e-7)


def test_models_are_there_from_birth_to_death_in_their_colours(opened, hunted):
    """At each moment a reader that has seen all messages so far shows exactly those who are alive."""
    ends, starts = {}, {}
    for ns, message in opened.messages["/models"]:
        assert message["deletions"] == []
        for entity in message["entities"]:
            life = time_of(entity["lifetime"])
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


def test_columns_of_plugins_are_messages_of_each_entity(tmp_path):
    recording = Recording(record(hunt(end=3.0), tmp_path / "run", columns="*.Boids.target,*.Predator.target"))
    report = write_mcap(recording, tmp_path / "run.mcap")
    found = Opened(tmp_path / "run.mcap").messages
    targets = [recording.values(i, "Boids.target") for i in range(recording.n_frames)]
    rows = [recording.frame(i).row_of(1) for i in range(recording.n_frames)]
    assert [message for _, message in found["/columns/prey/1"]] == [
        {"Boids": {"target": dict(zip("xyz", target[row].tolist(), strict=True))}}
        for target, row in zip(targets, rows, strict=True)
        if row >= 0
    ]
    hunters = [topic for topic in report.n_messages if topic.startswith("/columns/hunters/")]
    assert len(hunters) == 3
    assert all(type(m["Predator"]["target"]) is int for topic in hunters for _, m in found[topic])


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
    scale = default_scale(hunted)
    assert scale > 1.0
    write_mcap(hunted, tmp_path / "a.mcap", period=5.0, scale=2.0)
    surface = Opened(tmp_path / "a.mcap").messages["/models"][0][1]["entities"][0]["triangles"][0]
    length = np.ptp([p["x"] for p in surface["points"]])
    assert length == pytest.approx(2.0 * scale * np.ptp(MODELS["aircraft"].vertices[:, 0]), rel=1e-3)


def test_a_clock_before_zero_is_shifted_and_that_is_said(tmp_path):
    recording = Recording(record(hunt(n_prey=2).replace(end=-1.0, start=-2.5), tmp_path / "run", (5,)))
    report = write_mcap(recording, tmp_path / "a.mcap")
    assert report.notes == [
        "t = 0 is 3 s after the beginning of the file's clock, which knows no earlier times"
    ]
    opened = Opened(tmp_path / "a.mcap")
    assert opened.times[0] == SECOND // 2
    assert opened.messages["/teams"][0][1]["t"] == -2.5


def test_what_stands_is_in_the_scene(hunted, tmp_path, monkeypatch):
    low, high = np.full(3, -40.0), np.full(3, 40.0)
    shape = Cuboid(center=(0, 0, 10), lengths=(60, 60, 20))
    mesh, outline = mesh_of(shape, low, high), outline_of(shape, low, high)
    regions = [Region(name, team, shape, False, mesh, outline) for name, team in (("zone", 2), ("free", 0))]
    scenery = Scenery(
        Origin(), 10.0, 0.0, low, high, 10.0, [Base(1, (1.0, 2.0, 3.0), 8.0, 1.0)], regions,
        Terrain(np.arange(5.0), np.arange(4.0), np.ones((4, 5))),
    )  # fmt: skip
    monkeypatch.setitem(hunted.__dict__, "scenery", scenery)
    write_mcap(hunted, tmp_path / "a.mcap", period=5.0)
    ((_, message),) = Opened(tmp_path / "a.mcap").messages["/scene"]
    found = {e["id"]: e for e in message["entities"]}
    assert list(found) == ["origin", "base 1", "zone", "free", "terrain"]
    assert found["base 1"]["spheres"][0]["size"] == {"x": 16.0, "y": 16.0, "z": 16.0}
    assert found["base 1"]["spheres"][0]["pose"]["position"] == {"x": 1.0, "y": 2.0, "z": 3.0}
    assert len(found["zone"]["lines"][0]["points"]) == 24
    blue, grey = (found[n]["triangles"][0]["color"] for n in ("zone", "free"))
    assert tuple(round(255 * blue[c]) for c in "rgb") == hunted.style.colour(2)
    assert blue != grey
    assert len(found["terrain"]["triangles"][0]["indices"]) == 3 * 2 * 3 * 4
    assert ("latitude [deg]", "29") in [(n["key"], n["value"]) for n in found["origin"]["metadata"]]


def test_boxes_have_their_lengths_and_others_are_enlarged(tmp_path):
    blocks = [
        Block(name="crate", team=1, box=(8.0, 4.0, 2.0), motion=Still()),
        Block(name="robot", team=2, position=(0, 30, 0), motion=Still()),
    ]
    stood = Recording(record(Mission(blocks=blocks, end=1.0), tmp_path / "run"))
    write_mcap(stood, tmp_path / "a.mcap", scale=5.0 / default_scale(stood))
    extents = []
    for entity in Opened(tmp_path / "a.mcap").messages["/models"][0][1]["entities"]:
        points = entity["triangles"][0]["points"]
        extents.append([np.ptp([point.get(axis, 0.0) for point in points]) for axis in "xyz"])
    assert extents[0] == pytest.approx([8.0, 4.0, 2.0])
    assert extents[1] == pytest.approx([5.0] * 3, rel=0.1)


def test_what_cannot_be_is_refused_and_leaves_nothing(hunted, tmp_path, monkeypatch):
    with pytest.raises(ParameterError, match=r"is not allowed; it takes a number > 0"):
        write_mcap(hunted, tmp_path / "a.mcap", scale=-1.0)
    monkeypatch.setitem(__import__("sys").modules, "foxglove", None)
    with pytest.raises(
        MissingExtraError, match=r"MCAP files need foxglove-sdk, .* pip install 'tussle\[view\]'"
    ):
        write_mcap(hunted, tmp_path / "a.mcap")
    assert not list(tmp_path.iterdir())
