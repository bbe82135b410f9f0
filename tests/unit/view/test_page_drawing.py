"""What plugins draw: every kind of shape reaches the scene as it was meant, and what cannot be drawn is told."""

import numpy as np
import pytest
from page_client import browsed
from recorded_games import hunt

from tussle.api.draw import KINDS
from tussle.view.drawn import Shape
from tussle.view.page.drawing import ATTRIBUTES, DRAWN, drawing_message, read_drawing


def shape(kind, **attributes):
    return Shape(kind, attributes, 0.0)


def read(kind, **attributes):
    return read_drawing((shape(kind, **attributes),))


THREE = np.arange(9.0).reshape(3, 3)

EXAMPLES = {
    "points": {"pos": THREE},
    "cloud": {"pos": THREE, "value": [0.0, 0.5, 1.0]},
    "line": {"pos": THREE, "width": 3.0},
    "vectors": {"pos": THREE, "direction": (1.0, 0.0, 0.0)},
    "sphere": {"pos": THREE, "radius": 2.0, "opacity": 0.5},
    "box": {"pos": (0.0, 0.0, 0.0), "size": (1.0, 2.0, 3.0)},
    "cone": {"pos": (0.0, 0.0, 0.0), "direction": (0.0, 0.0, 2.0), "length": 4.0, "angle": 1.0},
    "text": {"pos": (0.0, 0.0, 5.0), "text": "here"},
    "mesh": {"vertices": THREE, "faces": [[0, 1, 2]]},
}


def test_there_is_an_example_of_each_kind():
    assert set(EXAMPLES) == set(ATTRIBUTES) == set(KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_is_read_without_a_note(kind):
    assert read(kind, **EXAMPLES[kind], lifetime=1.0).notes == []


@pytest.mark.parametrize("kind", KINDS)
def test_an_unknown_attribute_is_told_with_the_nearest_one(kind):
    (note,) = read(kind, **EXAMPLES[kind], opacitty=1.0).notes
    assert "no attribute 'opacitty' (did you mean 'opacity'?)" in note


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_needed_is_told(kind):
    (note,) = read(kind, colour=(1, 2, 3)).notes
    assert f"it needs '{ATTRIBUTES[kind][0]}'" in note


@pytest.mark.parametrize(
    ("kind", "wrong", "told"),
    [
        ("points", {"pos": np.zeros((2, 4))}, "pos must be"),
        ("points", {"pos": (0.0, np.nan, 0.0)}, "not finite"),
        ("sphere", {"pos": THREE, "radius": [1.0, 2.0]}, "radius must be a number"),
        ("box", {"pos": THREE, "quat": (1.0, 0.0)}, "quat must be"),
        ("mesh", {"vertices": THREE, "faces": [[0, 1, 3]]}, "faces must be"),
        ("vectors", {"pos": THREE}, "direction"),
        ("text", {"pos": "here"}, "a plugin drew text"),
    ],
)
def test_what_cannot_be_drawn_is_told_once_and_the_rest_is_drawn(kind, wrong, told):
    drawing = read_drawing((shape(kind, **wrong), shape(kind, **wrong), shape("points", pos=THREE)))
    (note,) = drawing.notes
    assert told in note
    assert [len(rows) for rows in drawing.rows["points"]] == [3]


def points(kind, **attributes):
    """Size and colours of points that were read."""
    (rows,) = read(kind, **attributes).rows["points"]
    return rows[:, 3], rows[:, 4:]


def test_colours_of_one_and_of_each_and_of_none():
    size, colour = points("points", pos=THREE)
    assert (colour == DRAWN).all()
    assert (size == 0.0).all()
    assert (points("points", pos=THREE, color=(1, 2, 300))[1] == (1, 2, 255)).all()
    assert points("points", pos=THREE, colour=THREE)[1].tolist() == THREE.T.tolist()


def test_values_of_a_cloud_become_colours_from_dark_to_light():
    colour = points("cloud", pos=THREE, value=[3.0, 5.0, 4.0])[1].sum(axis=1)
    assert colour[0] < colour[2] < colour[1]
    bounded = points("cloud", pos=THREE, value=[3.0, 5.0, 4.0], low=5.0, high=9.0)[1]
    assert (bounded == bounded[0]).all(), "all of them are at the lower end"


def test_a_line_joins_each_point_to_the_next():
    (rows,) = read("line", pos=THREE).rows["lines"]
    assert rows[:, :6].tolist() == [[*THREE[:, 0], *THREE[:, 1]], [*THREE[:, 1], *THREE[:, 2]]]


@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 0, 2), (0, -1, 0), (-1, 0, 0), (1, 2, 3)])
def test_a_cone_points_where_it_is_told(direction):
    (rows,) = read("cone", pos=(0, 0, 0), direction=direction, length=3.0, angle=np.pi / 2).rows["cone"]
    w, x, y, z = rows[0, 3:7]
    axis = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    assert axis == pytest.approx(np.array(direction) / np.linalg.norm(direction))
    assert rows[0, 7:10] == pytest.approx([3.0, 3.0, 3.0])


NUMBERS = {"points": 7, "lines": 9, "arrows": 9, "sphere": 14, "box": 14, "cone": 14}


def test_the_message_holds_every_kind_as_it_is_read():
    shapes = tuple(shape(kind, **given) for kind, given in EXAMPLES.items())
    header, data, notes = drawing_message((*shapes, shape("sphere", pos=(9.0, 8.0, 7.0), radius=1.5)))
    assert not notes
    counts = {part["kind"]: part["n"] for part in header["parts"]}
    assert counts == {"points": 6, "lines": 2, "arrows": 3, "sphere": 4, "box": 1, "cone": 1, "mesh": 1}
    assert header["texts"] == [["here", 0.0, 0.0, 5.0]]
    assert header["width"] == 3.0
    numbers = np.frombuffer(data, "<f4")
    ends = [part["at"] + part["n"] * NUMBERS[part["kind"]] for part in header["parts"][:-1]]
    assert ends == [part["at"] for part in header["parts"][1:]]
    at = {part["kind"]: part["at"] for part in header["parts"]}
    assert numbers[at["points"] : at["points"] + 7].tolist() == [0.0, 3.0, 6.0, 0.0, *DRAWN]
    last = numbers[at["sphere"] + 3 * 14 : at["sphere"] + 4 * 14]
    assert last.tolist() == [9.0, 8.0, 7.0, 1.0, 0.0, 0.0, 0.0, 3.0, 3.0, 3.0, *DRAWN, 1.0]
    mesh = numbers[at["mesh"] :]
    assert len(mesh) == 11 + 9 + 3
    assert mesh[-3:].tolist() == [0.0, 1.0, 2.0]


def test_nothing_drawn_is_a_message_without_parts():
    header, data, _ = drawing_message(())
    assert (header["parts"], header["texts"], data) == ([], [], b"")


def test_all_kinds_reach_a_browser():
    with browsed(hunt(end=60.0), 3, is_paused=True) as (live, page, client):
        client.wait(lambda: page.n_readers)
        draw = live.simulation.state.context.draw
        client.wait(lambda: draw.sinks)
        for kind, given in EXAMPLES.items():
            getattr(draw, kind)(**given, lifetime=100.0)
        draw.box(pos=(0.0, 0.0, 0.0), sise=1.0, lifetime=100.0)
        live.step()
        kinds = {"points", "lines", "arrows", "sphere", "box", "cone", "mesh"}
        client.wait(lambda: {part["kind"] for part in client.drawn.get("parts", ())} == kinds)
        client.wait(lambda: client.says("did you mean 'size'?"))
        assert page.error is None
