"""A road graph from a GraphML file."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Any

import numpy as np

from tussle.api import HistoricAttributes, Interaction, Param, State, WorldView
from tussle.declare.messages import RoadGraph
from tussle.documents import read_bytes
from tussle.errors import ParameterError
from tussle.world.geodesy import Origin

COORDINATES = (("x", "y", "z"), ("lon", "lat", "alt"), ("longitude", "latitude", "altitude"))
FOREVER = 1e9  # [s]


class GraphInteraction(Interaction):
    """Reads a road graph from a GraphML file and publishes it once (`RoadGraph`): a `networkx` graph with the position of each node.

    Nodes have x, y and z [m] in the world frame, or lat, lon and alt, also called latitude, longitude and altitude [deg, m]; z and alt
    may be missing. In a graph with `crs`, such as those of OSMnx, x and y are longitude and latitude. It needs networkx, which
    `pip install 'tussle[maps]'` installs.

    Raises:
        ParameterError: The file cannot be read, a node has no coordinates, or networkx is not installed.
    """

    grade = "portable"
    named_files = ("graph_file",)
    historic_attributes = HistoricAttributes(renamed={"id": "graph_id"}, unread=("data",))

    graph_id = Param(1, structural=True, doc="Id of the graph in its message.")
    graph_file = Param("default", doc="Path of the file.")
    visualize_graph = Param(True, structural=True, doc="Draw nodes and edges in the viewer.")
    draw_node_labels = Param(True, structural=True, doc="Draw the names of the nodes.")
    is_told = State(dtype=bool, per="world", doc="Whether the graph has been published.")

    def start(self, w: WorldView) -> None:
        """Read the file, so that its errors show before the first step."""
        _read(self.graph_file, w.scene.origin)

    def step(self, w: WorldView) -> None:
        fresh = np.flatnonzero(~self.is_told & (np.bincount(w.world, minlength=w.n_worlds) > 0))
        if len(fresh):
            graph = _read(self.graph_file, w.scene.origin)
            w.publish(RoadGraph, fresh, graph=self.graph_id, roads=graph)
            self.is_told[fresh] = True
            if self.visualize_graph:
                self._draw(w, graph)

    def _draw(self, w: WorldView, graph: Any) -> None:
        pos = {name: np.array(values["pos"]) for name, values in graph.nodes(data=True)}
        w.draw.points(pos=np.array(list(pos.values())).T, lifetime=FOREVER)
        for a, b in graph.edges():
            w.draw.line(pos=np.array([pos[a], pos[b]]).T, lifetime=FOREVER)
        for name, place in pos.items() if self.draw_node_labels else ():
            w.draw.text(pos=place, text=str(name), lifetime=FOREVER)


def _read(path: str, origin: Origin) -> Any:
    """Read the graph of a file, and add the attribute "pos" [m], (3,), world frame, to each node."""
    try:
        import networkx as nx
    except ImportError:
        raise ParameterError(
            "GraphInteraction needs networkx, which is not installed: pip install 'tussle[maps]'"
        ) from None
    try:
        graph = nx.read_graphml(io.BytesIO(read_bytes(Path(path), ParameterError)))
    except (ParameterError, SyntaxError, KeyError, ValueError, nx.NetworkXError) as error:
        raise ParameterError(
            f"GraphInteraction.graph_file = {path!r} cannot be read ({error}); it takes the path of a GraphML file"
        ) from error
    for name, values in graph.nodes(data=True):
        values["pos"] = _position(values, "crs" in graph.graph, origin)
        if values["pos"] is None:
            raise ParameterError(
                f"GraphInteraction.graph_file = {path!r}: node {name!r} has no coordinates; each node takes x and y in m, or "
                f"lat and lon in deg"
            )
    return graph


def _position(values: dict[str, Any], has_crs: bool, origin: Origin) -> tuple[float, ...] | None:
    """Return the position of a node [m], (3,), from its attributes; None if they hold no finite coordinates."""
    for east, north, up in COORDINATES:
        if east in values and north in values:
            try:
                place = [float(values[east]), float(values[north]), float(values.get(up, 0.0))]
            except ValueError:
                return None
            if not all(map(math.isfinite, place)):
                return None
            if east == "x" and not has_crs:
                return tuple(place)
            geodetic = [math.radians(place[1]), math.radians(place[0]), place[2]]
            return tuple(float(v) for v in origin.from_geodetic(np.array(geodetic)))
    return None
