"""Walls from an image, and road graphs."""

from __future__ import annotations

import os
import sys

import numpy as np
import pytest
from small_worlds import block, mission

from tussle import Simulation
from tussle.api import Metric, State
from tussle.errors import TussleError
from tussle.messages import RoadGraph
from tussle.scene import Origin, Scene
from tussle.stock import GraphInteraction, MapGen2D
from tussle.view.scenery import scenery_of

MAZE = """
#####..
#...#..
#####.#
"""


@pytest.fixture
def maze(tmp_path):
    """A picture of 3 by 7 pixels."""
    rows = [[0 if c == "#" else 255 for c in line] for line in MAZE.split()]
    path = tmp_path / "maze.pgm"
    path.write_text(f"P2 7 3 255 {' '.join(str(v) for row in rows for v in row)}")
    return str(path)


class Looks(Metric):
    """Distances to the walls to the four sides and down, from the middle of the room."""

    seen = State("east north west south down", unit="m", per="world")

    def step(self, w):
        origin = np.array([[105.0], [23.0], [5.0]])
        ways = np.array([(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (0, 0, -1)], float).T
        self.seen[:] = w.scene.cast(np.repeat(origin, 5, axis=1), ways).distance[:, None]


def test_dark_pixels_are_walls(maze):
    rules = MapGen2D(map=maze, resolution=2.0, corner=(100.0, 20.0, 0.0), height=10.0)
    walls = rules.walls()
    # The rows of the room above and below, its two sides, and the pixel on the right below.
    assert sorted((wall.center, wall.lengths) for wall in walls) == [
        ((101.0, 23.0, 5.0), (2.0, 2.0, 10.0)),
        ((105.0, 21.0, 5.0), (10.0, 2.0, 10.0)),
        ((105.0, 25.0, 5.0), (10.0, 2.0, 10.0)),
        ((109.0, 23.0, 5.0), (2.0, 2.0, 10.0)),
        ((113.0, 21.0, 5.0), (2.0, 2.0, 10.0)),
    ]
    game = mission(interactions=[rules], metrics=[Looks()])
    sim = Simulation(game, seeds=[1, 2])
    sim.step()
    assert sim.read("Looks.seen")[0].tolist() == [[3.0, 1.0, 3.0, 1.0, np.inf]] * 2
    assert [r.is_wall for r in scenery_of(game).boundaries] == [True] * 5
    lost = game.replace(interactions=[rules.replace(map="nowhere.png")])
    (note,) = scenery_of(lost).notes
    assert note.endswith("its walls are not shown")


def test_equal_rows_make_one_wall(tmp_path):
    path = tmp_path / "solid.pgm"
    path.write_text("P2 2 3 255 " + "0 " * 6)
    (wall,) = MapGen2D(map=str(path)).walls()
    assert wall.lengths == (2.0, 3.0, 10.0)


def test_maps_that_cannot_be_read(tmp_path, monkeypatch):
    text = tmp_path / "text.png"
    text.write_text("no image")
    noise = tmp_path / "noise.pgm"
    noise.write_text("P2 301 300 255 " + "0 255 " * 45_150)
    os.mkfifo(tmp_path / "pipe.png")
    drawing = tmp_path / "x.eps"
    drawing.write_text("%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\nshowpage\n%%EOF\n")
    for path, message in (
        (str(tmp_path / "pipe.png"), "not a regular file"),
        (str(drawing), "it is no PNG, JPEG, TIFF, BMP, GIF, PPM file"),
        ("maze_2d_1", "MapGen2D.map = 'maze_2d_1' cannot be read.*takes the path of an image"),
        (str(text), "cannot be read"),
        (str(noise), "has .* walls; it may have 20,000"),
    ):
        with pytest.raises(TussleError, match=message):
            Simulation(mission(interactions=[MapGen2D(map=path)]))
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(TussleError, match=r"needs Pillow.*pip install 'tussle\[maps\]'"):
        MapGen2D(map=str(text)).walls()


def graphml(path, nodes, edges="", attributes="", names="x y z lat lon"):
    """A GraphML file with number attributes of nodes, given as {node: {name: value}}."""
    keys = "".join(f'<key id="{k}" for="node" attr.name="{k}" attr.type="string"/>' for k in names.split())
    points = "".join(
        f'<node id="{n}">{"".join(f"<data key={k!r}>{v}</data>" for k, v in values.items())}</node>'
        for n, values in nodes.items()
    )
    path.write_text(
        f'<graphml xmlns="http://graphml.graphdrawing.org/xmlns"><key id="crs" for="graph" attr.name="crs" attr.type="string"/>'
        f'{keys}<graph edgedefault="directed">{attributes}{points}{edges}</graph></graphml>'
    )
    return str(path)


class Roads(Metric):
    """The graphs that were published: how many, number of nodes, and the sums of the coordinates."""

    n = State(dtype=int, per="world")
    total = State("x y z", per="world")

    def step(self, w):
        told = w.inbox(RoadGraph)
        np.add.at(self.n, told.world, told.graph)
        for world, roads in zip(told.world, told.roads, strict=True):
            self.total[:, world] = np.sum([roads.nodes[name]["pos"] for name in roads], axis=0)


def published(path, **scene):
    game = mission(
        block(count=2), interactions=[GraphInteraction(graph_file=path, graph_id=7)], metrics=[Roads()]
    )
    sim = Simulation(game.replace(scene=Scene(**scene)), seeds=[1, 2])
    drawn = []
    sim.state.context.draw.sinks.append(lambda kind, shape: drawn.append((kind, shape)))
    sim.run()
    assert sim.read("Roads.n")[0].tolist() == [7, 7]  # once in each world
    return sim.read("Roads.total")[0][0], drawn


def test_a_road_graph_is_published_and_drawn_once(tmp_path):
    pytest.importorskip("networkx")
    nodes = {"a": {"x": 1, "y": 2}, "b": {"x": 10, "y": 20, "z": 5}}
    total, drawn = published(graphml(tmp_path / "g", nodes, '<edge source="a" target="b"/>'))
    assert total.tolist() == [11.0, 22.0, 5.0]
    assert [kind for kind, _ in drawn] == ["points", "line", "text", "text"]
    assert drawn[1][1]["pos"].tolist() == [[1.0, 10.0], [2.0, 20.0], [0.0, 5.0]]
    lone, drawn = published(graphml(tmp_path / "h", {"a": {"x": 1, "y": 2}}))
    assert lone.tolist() == [1.0, 2.0, 0.0]
    assert [kind for kind, _ in drawn] == ["points", "text"]


def test_geographic_coordinates_are_converted(tmp_path):
    pytest.importorskip("networkx")
    origin = Origin.from_degrees(35.0, -120.0, 0.0)
    expected = origin.from_geodetic(np.array([np.radians(35.01), np.radians(-119.99), 0.0]))
    plain = graphml(tmp_path / "plain", {"a": {"lat": 35.01, "lon": -119.99}})
    osmnx = graphml(
        tmp_path / "osmnx", {"a": {"x": -119.99, "y": 35.01}}, attributes='<data key="crs">epsg:4326</data>'
    )
    for path in (plain, osmnx):
        assert published(path, origin=origin)[0] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("values", [{}, {"x": 1}, {"x": "far", "y": 2}, {"x": "nan", "y": 2}])
def test_a_node_without_coordinates_is_an_error(tmp_path, values):
    pytest.importorskip("networkx")
    path = graphml(tmp_path / "g", {"a": {"x": 1, "y": 2}, "b7": values})
    with pytest.raises(
        TussleError, match="node 'b7' has no coordinates; each node takes x and y in m, or lat"
    ):
        published(path)


def test_graphs_that_cannot_be_read(tmp_path, monkeypatch):
    pytest.importorskip("networkx")
    text = tmp_path / "text"
    text.write_text("no graph")
    for path in ("default", str(text)):
        with pytest.raises(TussleError, match=r"GraphInteraction.graph_file = .* cannot be read"):
            published(path)
    monkeypatch.setitem(sys.modules, "networkx", None)
    with pytest.raises(TussleError, match=r"needs networkx.*pip install 'tussle\[maps\]'"):
        published(str(tmp_path / "other"))
